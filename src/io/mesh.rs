//! Meshes: primitives as indexed triangles, and their placement in world space.

use glam::{Vec3, Vec4};
use gltf_json::{
    Accessor, Index, Root,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};

use super::{
    accessor::{self, Accessors},
    attribute,
    error::Fault,
    influence::Influences,
    material,
    part::Part,
    pose, tangent,
};

/// Reads the primitives of a mesh that are made of triangles, morphed with these weights.
pub(super) fn read(
    root: &Root,
    accessors: Accessors<'_>,
    materials: &[material::Read],
    mesh: usize,
    weights: &[f32],
    warnings: &mut Vec<String>,
) -> Result<Vec<Part>, Fault> {
    let mut parts = Vec::new();
    let Some(mesh_source) = root.meshes.get(mesh) else { return Ok(parts) };
    for (i, primitive) in mesh_source.primitives.iter().enumerate() {
        let at = format!("/meshes/{mesh}/primitives/{i}");
        parts.extend(part(accessors.of_primitive(mesh, i), materials, primitive, weights, &at, warnings)?);
    }
    Ok(parts)
}

fn part(
    accessors: Accessors<'_>,
    materials: &[material::Read],
    primitive: &Primitive,
    weights: &[f32],
    at: &str,
    warnings: &mut Vec<String>,
) -> Result<Option<Part>, Fault> {
    let Some(mode) = mode_with_area(primitive, at, warnings)? else { return Ok(None) };
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let Some(source) = attribute(Semantic::Positions) else {
        warnings.push(format!("{at} has no positions: skipped"));
        return Ok(None);
    };
    let mut positions = finite_positions(accessors, source)?;
    if let Some(announced) = accessors.announced(source).filter(|&announced| announced != positions.len()) {
        let have = positions.len();
        warnings
            .push(format!("{at} has {have} compressed vertices, and not {announced} as its accessors: these are read"));
    }
    let (corners, mode) = corners(accessors, primitive, mode, positions.len(), at)?;
    let triangles = triangles(&corners, mode, at, warnings);
    let normals = attribute(Semantic::Normals).map(|source| normals_of(accessors, source, positions.len(), at));
    let mut normals = normals.transpose()?;
    pose::morph(accessors, primitive, weights, &mut positions, normals.as_deref_mut(), at)?;
    if let Some(normals) = &mut normals {
        mend(normals, &positions, &triangles, at, warnings);
    }
    let influences = Influences::read(accessors, primitive, positions.len(), at)?;
    // The last material is the default one; the document's indices were checked.
    let material = primitive.material.map_or(materials.len() - 1, |material| material.value());
    let maps = materials[material].maps();
    let mut attributes = attribute::read(accessors, primitive, positions.len(), maps, at, warnings)?;
    if !attributes.tangents.is_empty() {
        pose::morph_tangents(accessors, primitive, weights, &mut attributes.tangents, at)?;
        drop_unusable(&mut attributes.tangents, &triangles, at, warnings);
    }
    let mut part = Part { positions, normals, attributes, triangles, influences, material };
    if let Some(texture) = maps.tangent_texture()
        && part.attributes.tangents.is_empty()
        && !tangent::generate(&mut part, texture)
    {
        warnings.push(format!("{at}: no tangents can be made for its normal texture, which is not applied"));
    }
    Ok(Some(part))
}

/// The primitive's mode; `None`, with a warning, for points and lines.
fn mode_with_area(primitive: &Primitive, at: &str, warnings: &mut Vec<String>) -> Result<Option<Mode>, Fault> {
    match primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => Ok(Some(mode)),
        Checked::Valid(mode) => {
            let what = if mode == Mode::Points { "points" } else { "lines" };
            warnings.push(format!("{at} consists of {what}, which have no area: skipped"));
            Ok(None)
        }
        Checked::Invalid => Err(Fault::invalid(format!("{at}/mode"), "this primitive mode does not exist")),
    }
}

fn finite_positions(accessors: Accessors<'_>, source: Index<Accessor>) -> Result<Vec<Vec3>, Fault> {
    let positions = accessors.vec3(source)?;
    if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
        let what = format!("the position in element {i} is not finite: {}", positions[i]);
        return Err(Fault::invalid(accessor::pointer(source), what));
    }
    Ok(positions)
}

/// The normals, one for each position.
fn normals_of(
    accessors: Accessors<'_>,
    source: Index<Accessor>,
    positions: usize,
    at: &str,
) -> Result<Vec<Vec3>, Fault> {
    let normals = accessors.count(source);
    if normals != positions {
        let what = format!("there are {normals} normals for {positions} positions");
        return Err(Fault::invalid(format!("{at}/attributes/NORMAL"), what));
    }
    accessors.vec3(source)
}

/// The vertices at the corners of the triangles, and how they follow each other. What was compressed is a list.
fn corners(
    accessors: Accessors<'_>,
    primitive: &Primitive,
    mode: Mode,
    positions: usize,
    at: &str,
) -> Result<(Vec<u32>, Mode), Fault> {
    if let Some(corners) = accessors.decoded_corners() {
        return in_range(corners.to_vec(), positions, at).map(|corners| (corners, Mode::Triangles));
    }
    let corners = match primitive.indices {
        Some(indices) => in_range(accessors.indices(indices)?, positions, &accessor::pointer(indices))?,
        None => (0..positions as u32).collect(),
    };
    Ok((corners, mode))
}

fn in_range(corners: Vec<u32>, positions: usize, at: &str) -> Result<Vec<u32>, Fault> {
    match corners.iter().position(|&corner| corner as usize >= positions) {
        None => Ok(corners),
        Some(i) => {
            let what = format!("element {i} is index {}, and there are {positions} positions", corners[i]);
            Err(Fault::invalid(at, what))
        }
    }
}

/// The triangles of a list, strip or fan, all wound alike (glTF 2.0 specification, 3.7.2.1).
fn triangles(corners: &[u32], mode: Mode, at: &str, warnings: &mut Vec<String>) -> Vec<[u32; 3]> {
    let left_over = match mode {
        Mode::Triangles => corners.len() % 3,
        _ if corners.len() < 3 => corners.len(),
        _ => 0,
    };
    if left_over > 0 {
        warnings.push(format!("{at}: the last {left_over} corners make no triangle: skipped"));
    }
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => corners.windows(2).skip(1).map(|w| [w[0], w[1], corners[0]]).collect(),
        _ => corners.as_chunks::<3>().0.to_vec(),
    }
}

/// Replaces normals that have no direction by the geometric normal of a triangle at that corner.
fn mend(normals: &mut [Vec3], positions: &[Vec3], triangles: &[[u32; 3]], at: &str, warnings: &mut Vec<String>) {
    let usable = |n: Vec3| n.is_finite() && n.length_squared() > 1e-12 && n.length_squared().is_finite();
    let mut mended = 0_usize;
    let mut bad: Vec<bool> = normals.iter().map(|&n| !usable(n)).collect();
    if bad.iter().all(|&bad| !bad) {
        return;
    }
    for t in triangles.iter().map(|t| t.map(|i| i as usize)) {
        let [a, b, c] = t.map(|i| positions[i]);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        for i in t.into_iter().filter(|&i| std::mem::take(&mut bad[i])) {
            normals[i] = normal;
            mended += 1;
        }
    }
    // What is left belongs to no triangle with an area: any unit vector will do.
    for (normal, _) in normals.iter_mut().zip(&bad).filter(|&(_, &bad)| bad) {
        *normal = Vec3::Y;
    }
    if mended > 0 {
        warnings.push(format!("{at}: {mended} normals have no direction and were taken from the triangles"));
    }
}

/// Drops tangents of which some say no direction or no handedness: all of them, since only all together can be made
/// anew.
fn drop_unusable(tangents: &mut Vec<Vec4>, triangles: &[[u32; 3]], at: &str, warnings: &mut Vec<String>) {
    let direction = |t: Vec4| (1e-12..f32::INFINITY).contains(&t.truncate().length_squared());
    let usable = |t: Vec4| direction(t) && t.w.is_finite() && t.w != 0.0;
    let mut used = vec![false; tangents.len()];
    triangles.as_flattened().iter().for_each(|&i| used[i as usize] = true);
    let bad = tangents.iter().zip(&used).filter(|&(&t, &used)| used && !usable(t)).count();
    if bad > 0 {
        warnings
            .push(format!("{at}: {bad} tangents have no direction: all are made anew from the texture coordinates"));
        tangents.clear();
    } else {
        // Those of no triangle are never looked at.
        tangents.iter_mut().filter(|t| !t.is_finite()).for_each(|t| *t = Vec4::ZERO);
    }
}
