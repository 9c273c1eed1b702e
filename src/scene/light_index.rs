//! Which light a primitive is.

use super::{
    geometry::{Geometry, PrimitiveId},
    light::{LightId, Lights},
};

/// The lights that primitives are, found in constant time.
///
/// The lights of an instance follow each other in the order of its mesh's emissive triangles, so one number for each
/// instance and one for each triangle of a mesh that emits say them all. 8 bytes for a primitive in world space, 8 for
/// an instance, 4 for a triangle of a mesh that emits.
#[derive(Clone, Debug)]
pub(super) struct LightIndex {
    world: Vec<Option<LightId>>,
    instances: Vec<Instanced>,
    /// Of each mesh that emits: how many of its triangles before this one do, [`NONE`] if this one does not.
    ranks: Vec<Vec<u32>>,
}

#[derive(Clone, Copy, Debug)]
struct Instanced {
    /// The light of the instance's first emissive triangle, [`NONE`] if it has none.
    first: u32,
    mesh: u32,
}

const NONE: u32 = u32::MAX;

impl LightIndex {
    /// The index over the area lights among `lights`, which were collected from `geometry`.
    pub fn new(geometry: &Geometry, lights: &Lights) -> Self {
        let instances = (0..geometry.instance_count()).map(|n| Instanced { first: NONE, mesh: geometry.mesh_of(n).0 });
        let mut index = Self {
            world: vec![None; geometry.world_len() as usize],
            instances: instances.collect(),
            ranks: vec![Vec::new(); geometry.mesh_count()],
        };
        for (light, primitive) in lights.area_lights() {
            let Some(number) = primitive.instance() else {
                index.world[primitive.index() as usize] = Some(light);
                continue;
            };
            let instance = &mut index.instances[number as usize];
            if instance.first == NONE {
                instance.first = light.index() as u32;
            }
            let ranks = &mut index.ranks[instance.mesh as usize];
            if ranks.is_empty() {
                ranks.resize(geometry.mesh(geometry.mesh_of(number)).len() as usize, NONE);
            }
            ranks[primitive.index() as usize] = light.index() as u32 - instance.first;
        }
        index
    }

    /// The light that the primitive is, if it is one.
    #[inline]
    pub fn get(&self, primitive: PrimitiveId) -> Option<LightId> {
        let Some(number) = primitive.instance() else { return self.world[primitive.index() as usize] };
        let Instanced { first, mesh } = self.instances[number as usize];
        if first == NONE {
            return None;
        }
        let rank = self.ranks[mesh as usize][primitive.index() as usize];
        (rank != NONE).then(|| LightId::new(first + rank))
    }
}
