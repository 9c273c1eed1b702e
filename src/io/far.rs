//! Scenes far from their file's origin: numbers as the file has them, and the centre that world space is moved to.
//!
//! f32 knows a place at 4,000 km to a quarter of a metre. So nodes are placed in f64, and the place around which most
//! of the scene's detail lies becomes the origin before anything is rounded.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use gltf_json::{Node, Root, mesh::Semantic, validation::Checked};
use serde_json::Value;

use super::{Assembly, error::Fault, instancing, placed::Placed, pose};

/// Metres: a file whose nodes are moved less far keeps the f32 numbers, which then know places to 15 µm.
const NEAR: f32 = 256.0;

/// The distance from the origin, in sizes of what the scene consists of, up to which the file's origin stays the
/// world's. f32 knows places there to 1/16,000 of these sizes.
const STAYS: f64 = 1024.0;

/// The distance from the centre, in the same sizes, from which the error is worth a warning: 1/256 of a size.
const WARNS: f64 = 65536.0;

/// The relative error of rounding to f32.
const HALF_ULP: f64 = 0.5 * f32::EPSILON as f64;

/// Metres: the least size that counts.
const SMALLEST: f64 = 1e-3;

/// The nodes as JSON, whose numbers are doubles, where some node is moved beyond 256 m; else nothing, as gltf-json's
/// f32 do.
pub(super) fn exact(root: &Root, json: &[u8]) -> Vec<Value> {
    let moves = |node: &Node| {
        let [matrix, translation] =
            [node.matrix.map(|m| [m[12], m[13], m[14]]), node.translation].map(Option::unwrap_or_default);
        matrix.iter().chain(&translation).any(|x| x.abs() >= NEAR)
    };
    if !root.nodes.iter().any(moves) {
        return Vec::new();
    }
    let Ok(mut value) = serde_json::from_slice::<Value>(json) else { return Vec::new() };
    match value.get_mut("nodes").map(Value::take) {
        Some(Value::Array(nodes)) => nodes,
        _ => Vec::new(),
    }
}

/// The numbers of a node's `member` as the JSON has them; those of gltf-json where it does not say.
pub(super) fn numbers<const N: usize>(exact: Option<&Value>, member: &str, rounded: [f32; N]) -> [f64; N] {
    let array = exact.and_then(|node| node.get(member)).and_then(Value::as_array);
    std::array::from_fn(|i| {
        let number = array.and_then(|array| array.get(i)).and_then(Value::as_f64);
        number.unwrap_or(f64::from(rounded[i]))
    })
}

/// A box in world space: of a mesh, a sphere, or a camera's place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    middle: DVec3,
    /// Half its sides.
    half: DVec3,
}

impl Extent {
    fn size(&self) -> f64 {
        self.half.length().max(SMALLEST)
    }
}

/// Where the world's origin goes, in the file's coordinates, and how large what lies there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Centre {
    pub(super) at: DVec3,
    /// The harmonic mean of the sizes of all extents, metres.
    size: f64,
}

impl Centre {
    /// By coordinate, the median of the middles, each weighted by the inverse of its size: detail counts, a plain below
    /// it does not. Rounded to a multiple of a power of two of about their mean size; the file's origin, if it lies
    /// within 1024 of these sizes.
    pub(super) fn of(extents: &[Extent]) -> Self {
        let weights: f64 = extents.iter().map(|e| e.size().recip()).sum();
        let size = if weights > 0.0 { extents.len() as f64 / weights } else { 1.0 };
        let median = |axis: usize| {
            let mut all: Vec<_> = extents.iter().map(|e| (e.middle[axis], e.size().recip())).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut below = 0.0;
            let reaches_half = |&&(_, weight): &&(f64, f64)| {
                below += weight;
                below >= 0.5 * weights
            };
            all.iter().find(reaches_half).map_or(0.0, |(x, _)| *x)
        };
        let median = DVec3::new(median(0), median(1), median(2));
        let grid = size.log2().floor().exp2();
        let at = if median.abs().max_element() <= STAYS * size { DVec3::ZERO } else { (median / grid).round() * grid };
        Self { at, size }
    }

    /// What to say of a scene that f32 cannot hold from here, if it is one.
    pub(super) fn warning(&self, extents: &[Extent]) -> Option<String> {
        let reach = extents.iter().map(|e| ((e.middle - self.at).abs() + e.half).max_element()).fold(0.0, f64::max);
        let error = reach * HALF_ULP;
        (reach > WARNS * self.size).then(|| {
            format!(
                "the scene reaches {reach:.3e} m from its centre, where places are known to {error:.1e} m only (32-bit \
                 numbers), and what it consists of is {:.1e} m large on average: split it, or leave out what is far \
             away",
                self.size
            )
        })
    }
}

impl Assembly<'_> {
    /// The extents of all that is placed: meshes as their nodes, instances or joints place them, and spheres. Cameras
    /// count for a scene that has nothing else, as boxes of one metre.
    pub(super) fn extents(&self, nodes: &[Placed]) -> Result<Vec<Extent>, Fault> {
        let mut boxes: Vec<Option<Option<Extent>>> = vec![None; self.root.meshes.len()];
        let mut extents = Vec::new();
        for placed in nodes.iter().filter(|placed| placed.visible) {
            let Some(node) = self.root.nodes.get(placed.index) else { continue };
            if let Some(mesh) = node.mesh.map(|mesh| mesh.value()).filter(|&mesh| mesh < boxes.len()) {
                let own = *boxes[mesh].get_or_insert_with(|| self.extent_of(mesh));
                let Some(own) = own else { continue };
                let joints = pose::joints(self.root, self.accessors, node, nodes, &mut Vec::new())?;
                let transforms = match joints.filter(|joints| !joints.is_empty()) {
                    Some(joints) => joints,
                    None => instancing::transforms(self.accessors, node, placed)?,
                };
                extents.extend(transforms.iter().map(|to_world| own.moved(to_world)));
            }
            let extensions = node.extensions.as_ref();
            if let Some(sphere) = extensions.and_then(|extensions| extensions.others.get("PATHSPACE_sphere")) {
                let radius = sphere.get("radius").and_then(Value::as_f64).unwrap_or_default();
                extents.push(Extent { middle: DVec3::ZERO, half: DVec3::splat(radius) }.moved(&placed.to_world));
            }
        }
        if extents.is_empty() {
            let cameras = nodes.iter().filter(|p| self.root.nodes.get(p.index).is_some_and(|n| n.camera.is_some()));
            extents.extend(cameras.map(|p| Extent { middle: p.to_world.translation, half: DVec3::splat(0.5) }));
        }
        extents.retain(|e| e.middle.is_finite() && e.half.is_finite());
        Ok(extents)
    }

    /// The box around a mesh's positions in its own space; none if it has none that can be read, which is said where it
    /// is shown.
    fn extent_of(&self, mesh: usize) -> Option<Extent> {
        let positions = self.root.meshes.get(mesh)?.primitives.iter().enumerate().filter_map(|(i, primitive)| {
            let source = *primitive.attributes.get(&Checked::Valid(Semantic::Positions))?;
            let accessors = self.accessors.of_primitive(mesh, i);
            if accessors.has_data(source) { accessors.vec3(source).ok() } else { None }
        });
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let grow = |(min, max): (Vec3, Vec3), p: &Vec3| (min.min(*p), max.max(*p));
        let (min, max) = positions.fold(empty, |bounds, positions| positions.iter().fold(bounds, grow));
        let (min, max) = (min.as_dvec3(), max.as_dvec3());
        (min.is_finite() && max.is_finite()).then(|| Extent { middle: 0.5 * (min + max), half: 0.5 * (max - min) })
    }
}

impl Extent {
    fn moved(&self, to_world: &DAffine3) -> Self {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = to_world.matrix3;
        let half = DMat3::from_cols(x.abs(), y.abs(), z.abs()) * self.half.abs();
        Self { middle: to_world.transform_point3(self.middle), half }
    }
}
