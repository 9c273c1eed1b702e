//! Poses at rest: morph targets with the weights that the file gives, and skins with their joints where the nodes are.

use glam::{DAffine3, DMat4, Vec3, Vec4};
use gltf_json::{Accessor, Index, Node, Root, mesh::Primitive};

use super::{
    accessor::Accessors,
    error::Fault,
    part::{Part, World, normal_matrix, turned},
    placed::Placed,
};
use crate::scene::geometry::{Attributes, moved_tangent};

/// Moves positions and normals by the morph targets: base + Σ weight · displacement (glTF 2.0 specification, 3.7.2.2).
/// Normals are not normalised.
pub(super) fn morph(
    accessors: Accessors<'_>,
    primitive: &Primitive,
    weights: &[f32],
    positions: &mut [Vec3],
    mut normals: Option<&mut [Vec3]>,
    at: &str,
) -> Result<(), Fault> {
    let targets = primitive.targets.as_deref().unwrap_or_default();
    if !targets.is_empty() && !weights.is_empty() && targets.len() != weights.len() {
        let what = format!("there are {} morph targets here, and {} weights for them", targets.len(), weights.len());
        return Err(Fault::invalid(format!("{at}/targets"), what));
    }
    for (i, (target, &weight)) in targets.iter().zip(weights).enumerate().filter(|(_, (_, weight))| **weight != 0.0) {
        let move_by = |values: &mut [Vec3], source: Option<Index<Accessor>>, name: &str| {
            let Some(source) = source else { return Ok(()) };
            let offsets = accessors.vec3(source)?;
            if offsets.len() != values.len() {
                let what = format!("there are {} displacements for {} vertices", offsets.len(), values.len());
                return Err(Fault::invalid(format!("{at}/targets/{i}/{name}"), what));
            }
            for (value, offset) in values.iter_mut().zip(offsets) {
                *value += weight * offset;
            }
            Ok(())
        };
        move_by(positions, target.positions, "POSITION")?;
        if let Some(normals) = normals.as_deref_mut() {
            move_by(normals, target.normals, "NORMAL")?;
        }
    }
    match positions.iter().position(|p| !p.is_finite()) {
        None => Ok(()),
        Some(i) => Err(Fault::invalid(format!("{at}/targets"), format!("they move vertex {i} to {}", positions[i]))),
    }
}

/// Moves tangents by the morph targets, as [`morph`] moves normals; their signs stay. Not checked for being finite.
pub(super) fn morph_tangents(
    accessors: Accessors<'_>,
    primitive: &Primitive,
    weights: &[f32],
    tangents: &mut [Vec4],
    at: &str,
) -> Result<(), Fault> {
    let targets = primitive.targets.as_deref().unwrap_or_default();
    for (i, (target, &weight)) in targets.iter().zip(weights).enumerate().filter(|(_, (_, weight))| **weight != 0.0) {
        let Some(source) = target.tangents else { continue };
        let offsets = accessors.vec3(source)?;
        if offsets.len() != tangents.len() {
            let what = format!("there are {} displacements for {} vertices", offsets.len(), tangents.len());
            return Err(Fault::invalid(format!("{at}/targets/{i}/TANGENT"), what));
        }
        for (tangent, offset) in tangents.iter_mut().zip(offsets) {
            *tangent += (weight * offset).extend(0.0);
        }
    }
    Ok(())
}

/// From bind pose to world space for each joint of a node's skin: global transform of the joint · inverse bind matrix.
///
/// `None`, with a warning, if a joint is not in the scene. The transform of the skinned node itself plays no part (glTF
/// 2.0 specification, 3.7.3.3).
pub(super) fn joints(
    root: &Root,
    accessors: Accessors<'_>,
    node: &Node,
    placed: &[Placed],
    warnings: &mut Vec<String>,
) -> Result<Option<Vec<DAffine3>>, Fault> {
    let Some((index, skin)) = node.skin.and_then(|index| Some((index, root.get(index)?))) else { return Ok(None) };
    let at = format!("/skins/{}", index.value());
    let inverse_bind = match skin.inverse_bind_matrices {
        None => vec![DMat4::IDENTITY; skin.joints.len()],
        Some(source) => accessors.mat4(source)?,
    };
    if inverse_bind.len() < skin.joints.len() {
        let what = format!("there are {} of them for {} joints", inverse_bind.len(), skin.joints.len());
        return Err(Fault::invalid(format!("{at}/inverseBindMatrices"), what));
    }
    let mut out = Vec::with_capacity(skin.joints.len());
    for (joint, inverse_bind) in skin.joints.iter().zip(inverse_bind) {
        let Some(joint) = placed.iter().find(|placed| placed.index == joint.value()) else {
            warnings.push(format!("{at}: its joint {} is not in the scene; what it poses is unposed", joint.value()));
            return Ok(None);
        };
        let matrix = joint.to_world * DAffine3::from_mat4(inverse_bind);
        if !matrix.is_finite() {
            return Err(Fault::invalid(at, format!("the matrix of joint node {} is not finite", joint.index)));
        }
        out.push(matrix);
    }
    Ok(Some(out))
}

/// Places a part as its joints do. N_g stays on the side that was the front, as with a node that mirrors.
pub(super) fn place(part: &Part, joints: &[DAffine3], placed: &Placed) -> Result<World, Fault> {
    let mut positions = Vec::with_capacity(part.positions.len());
    let mut normals = part.normals.as_ref().map(|normals| Vec::with_capacity(normals.len()));
    let mut mirrored = Vec::with_capacity(part.positions.len());
    let mut attributes = Attributes { tangents: Vec::new(), ..part.attributes.clone() };
    for (i, p) in part.positions.iter().enumerate() {
        let matrix = part.influences.matrix(i, joints)?;
        let position = matrix.transform_point3(p.as_dvec3()).as_vec3();
        if !position.is_finite() {
            let what = format!("vertex {i} of the node's mesh lies at {position} in world space");
            return Err(Fault::invalid(placed.pointer(), what));
        }
        positions.push(position);
        if let (Some(to), Some(from)) = (&mut normals, &part.normals) {
            to.push(turned(normal_matrix(matrix.matrix3), from[i]));
        }
        attributes.tangents.extend(part.attributes.tangents.get(i).map(|&t| moved_tangent(matrix.matrix3, t)));
        mirrored.push(matrix.matrix3.determinant() < 0.0);
    }
    let turn = |&[a, b, c]: &[u32; 3]| if mirrored[a as usize] { [a, c, b] } else { [a, b, c] };
    Ok(World { positions, normals, attributes, triangles: part.triangles.iter().map(turn).collect() })
}
