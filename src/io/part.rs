//! Triangles of a mesh: as they are read, and where a node has them.

use glam::{DMat3, Vec3};

use super::{
    error::Fault,
    influence::Influences,
    placed::{Placed, is_near},
};
use crate::scene::geometry::{Attributes, moved_tangent};

/// A primitive's triangles in the space of its mesh: read once, placed by every node that shows it.
pub(super) struct Part {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Option<Vec<Vec3>>,
    /// What the material reads, and colours if there are any.
    pub(super) attributes: Attributes,
    pub(super) triangles: Vec<[u32; 3]>,
    /// For a skin; empty where there are no joints.
    pub(super) influences: Influences,
    /// The index of the material among those that were read.
    pub(super) material: usize,
}

/// Whether a mesh has vertex colours.
#[derive(Clone, Copy)]
pub(super) enum Coloring {
    Plain,
    Colored,
}

impl Part {
    /// Whether there are vertex colours, which the material then multiplies.
    pub(super) fn coloring(&self) -> Coloring {
        if self.attributes.colors.is_empty() { Coloring::Plain } else { Coloring::Colored }
    }
}

/// World-space triangles, as `Geometry::add_triangles` takes them.
pub(super) struct World {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Option<Vec<Vec3>>,
    pub(super) attributes: Attributes,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Places a part. A transform that mirrors also turns the winding, so that N_g stays on the side that was the front;
/// normals go with the inverse transpose.
pub(super) fn place(part: &Part, node: &Placed) -> Result<World, Fault> {
    let m = node.to_world.matrix3;
    let to_world = |p: &Vec3| node.to_world.transform_point3(p.as_dvec3()).as_vec3();
    let positions: Vec<Vec3> = part.positions.iter().map(to_world).collect();
    if let Some(i) = positions.iter().position(|p| !is_near(*p)) {
        let what = format!("vertex {i} of the node's mesh lies at {} in world space, too far away", positions[i]);
        return Err(Fault::invalid(node.pointer(), what));
    }
    let mirrored = m.determinant() < 0.0;
    let turn = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    let matrix = normal_matrix(m);
    let normal = |n: &Vec3| turned(matrix, *n);
    let tangents = part.attributes.tangents.iter().map(|&t| moved_tangent(m, t)).collect();
    Ok(World {
        positions,
        attributes: Attributes { tangents, ..part.attributes.clone() },
        normals: part.normals.as_ref().map(|normals| normals.iter().map(normal).collect()),
        triangles: part.triangles.iter().map(turn).collect(),
    })
}

/// The unit normal `n` after a [`normal_matrix`]; as it was where the matrix leaves nothing of it.
pub(super) fn turned(matrix: DMat3, n: Vec3) -> Vec3 {
    (matrix * n.as_dvec3()).try_normalize().map_or(n, |n| n.as_vec3())
}

/// The matrix that takes normals along with `m`, up to a positive factor: the cofactors are the inverse transpose up to
/// the determinant, and exist for a matrix that flattens too.
pub(super) fn normal_matrix(m: DMat3) -> DMat3 {
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign
}
