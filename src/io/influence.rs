//! Which joints move the vertices of a skin.

use glam::{DAffine3, DMat4, Vec4};
use gltf_json::{
    Accessor, Index,
    mesh::{Primitive, Semantic},
    validation::Checked,
};

use super::{
    accessor::{self, Accessors},
    error::Fault,
};

/// Which joints move each vertex, and by how much: four at a time.
#[derive(Default)]
pub(super) struct Influences(Vec<Influence>);

struct Influence {
    joints: Vec<[u16; 4]>,
    weights: Vec<Vec4>,
    /// The accessor of the joints, for messages.
    source: Index<Accessor>,
}

impl Influences {
    /// Reads `JOINTS_n` and `WEIGHTS_n` from n = 0 on.
    pub(super) fn read(
        accessors: Accessors<'_>,
        primitive: &Primitive,
        vertices: usize,
        at: &str,
    ) -> Result<Self, Fault> {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let pairs = (0..).map_while(|n| attribute(Semantic::Joints(n)).zip(attribute(Semantic::Weights(n))));
        let influences = pairs.enumerate().map(|(n, (source, weights))| {
            let (joints, weights) = (accessors.joints(source)?, accessors.vec4(weights)?);
            for (name, have) in [("JOINTS", joints.len()), ("WEIGHTS", weights.len())] {
                if have != vertices {
                    let what = format!("there are {have} elements for {vertices} positions");
                    return Err(Fault::invalid(format!("{at}/attributes/{name}_{n}"), what));
                }
            }
            Ok(Influence { joints, weights, source })
        });
        Ok(Self(influences.collect::<Result<_, _>>()?))
    }

    /// Appends copies of the vertices `copied`.
    pub(super) fn copy(&mut self, copied: &[u32]) {
        for influence in &mut self.0 {
            extend(&mut influence.joints, copied);
            extend(&mut influence.weights, copied);
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The transformation of a vertex: Σ weight · joint matrix, the weights brought to a sum of 1. Where all weights
    /// are 0, the first joint's (files have such vertices, and other readers do this).
    pub(super) fn matrix(&self, vertex: usize, joints: &[DAffine3]) -> Result<DAffine3, Fault> {
        let mut sum = DMat4::ZERO;
        let mut total = 0.0;
        for influence in &self.0 {
            let weights = influence.weights[vertex];
            for (&joint, weight) in influence.joints[vertex].iter().zip(weights.to_array()) {
                let Some(matrix) = joints.get(usize::from(joint)) else {
                    let what = format!("element {vertex} names joint {joint}, and the skin has {}", joints.len());
                    return Err(Fault::invalid(accessor::pointer(influence.source), what));
                };
                let weight = f64::from(weight);
                sum += DMat4::from(*matrix) * weight;
                total += weight;
            }
        }
        Ok(match (total != 0.0, self.0.first()) {
            (false, Some(first)) => joints[usize::from(first.joints[vertex][0])],
            _ => DAffine3::from_mat4(sum * (1.0 / total)),
        })
    }
}

/// Appends copies of the elements `copied` to a list that is not empty.
pub(super) fn extend<T: Copy>(list: &mut Vec<T>, copied: &[u32]) {
    if !list.is_empty() {
        list.extend(copied.iter().map(|i| list[*i as usize]).collect::<Vec<_>>());
    }
}
