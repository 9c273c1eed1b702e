//! Tangents for meshes that have none: MikkTSpace, which is what normal textures are baked against
//! (glTF 2.0 specification, 3.7.2.1).

use std::{collections::HashMap, thread};

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

use super::{influence::extend, part::Part};
use crate::scene::texture::Texture;

/// The stack on which tangents are made, bytes. Systems give memory for what is used of it only.
const STACK: usize = 1 << 24;
/// More of it for each triangle: several times what a call takes.
const STACK_PER_TRIANGLE: usize = 1024;

/// Gives `part` the tangents of its normal texture, from the texture coordinates that the texture is looked up with.
/// Vertices whose triangles do not agree on a tangent are split. Without texture coordinates there is no tangent.
///
/// False if tangents cannot be made; then the mesh is left as it is.
#[must_use]
pub(super) fn generate(part: &mut Part, normal: &Texture) -> bool {
    let uv = &part.attributes.uv[usize::from(normal.uv_set)];
    if uv.is_empty() || part.triangles.is_empty() {
        return true;
    }
    // As for lookups, coordinates that overflow mean the corner.
    let uv = uv.iter().map(|uv| Some(normal.transform.transform_point2(*uv)).filter(|uv| uv.is_finite()));
    let uv = uv.map(Option::unwrap_or_default).collect();
    let corners = vec![Vec4::ZERO; 3 * part.triangles.len()];
    let mut mesh = Mesh { part, uv, corners };
    // The library calls itself once for each triangle around a vertex, and a fan may be one vertex's alone.
    let stack = STACK + STACK_PER_TRIANGLE * mesh.part.triangles.len();
    let generated = thread::scope(|scope| {
        let thread =
            thread::Builder::new().stack_size(stack).spawn_scoped(scope, || generate_tangents(&mut mesh).is_ok());
        thread.is_ok_and(|thread| thread.join().unwrap_or(false))
    });
    if generated {
        let corners = mesh.corners;
        split(part, &corners);
    }
    generated
}

struct Mesh<'a> {
    part: &'a Part,
    uv: Vec<Vec2>,
    /// The tangent at each corner of each triangle.
    corners: Vec<Vec4>,
}

impl Mesh<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.part.triangles[face][corner] as usize
    }
}

impl Geometry for Mesh<'_> {
    fn num_faces(&self) -> usize {
        self.part.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.part.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        let normal = match &self.part.normals {
            Some(normals) => normals[self.vertex(face, corner)],
            None => {
                let [a, b, c] = self.part.triangles[face].map(|i| self.part.positions[i as usize]);
                (b - a).cross(c - a).normalize_or(Vec3::Z)
            }
        };
        normal.to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // MikkTSpace's v goes up, glTF's down: its bitangent is to be up on the image.
        let uv = self.uv[self.vertex(face, corner)];
        [uv.x, -uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        // Where the texture coordinates do not span the triangle there is no tangent, and the mesh's normal is shown.
        let tangent = space.map_or(Vec4::ZERO, |space| Vec4::from_array(space.tangent_encoded()));
        self.corners[3 * face + corner] = if tangent.is_finite() { tangent } else { Vec4::ZERO };
    }
}

/// One vertex for each pair of an old vertex and a tangent; those of no triangle keep a tangent of zero.
fn split(part: &mut Part, corners: &[Vec4]) {
    let old = part.positions.len();
    let mut tangents: Vec<Option<Vec4>> = vec![None; old];
    let mut copies = HashMap::<(u32, [u32; 4]), u32>::new();
    let mut sources: Vec<u32> = (0..old as u32).collect();
    for (index, tangent) in part.triangles.as_flattened_mut().iter_mut().zip(corners) {
        let vertex = *index;
        match &mut tangents[vertex as usize] {
            first @ None => *first = Some(*tangent),
            Some(first) if first == tangent => {}
            Some(_) => {
                *index = *copies.entry((vertex, tangent.to_array().map(f32::to_bits))).or_insert_with(|| {
                    sources.push(vertex);
                    tangents.push(Some(*tangent));
                    tangents.len() as u32 - 1
                });
            }
        }
    }
    let copied = &sources[old..];
    extend(&mut part.positions, copied);
    if let Some(normals) = &mut part.normals {
        extend(normals, copied);
    }
    part.attributes.uv.iter_mut().for_each(|set| extend(set, copied));
    extend(&mut part.attributes.colors, copied);
    part.influences.copy(copied);
    part.attributes.tangents = tangents.into_iter().map(Option::unwrap_or_default).collect();
}
