//! Where meshes go: into world space, or, where several nodes show one, into the scene once with an instance for each.

use glam::{DAffine3, DQuat, Vec3, Vec4};
use gltf_json::{Accessor, Index, Node};
use serde_json::Value;

use super::{
    Assembly,
    accessor::Accessors,
    error::Fault,
    limits::Limit,
    mesh,
    part::{self, Part, World},
    placed::{Placed, is_near},
    pose,
};
use crate::scene::{
    geometry::{Mesh, MeshId, Placement},
    material::MaterialId,
};

/// A node's mesh drawn many times, with a transformation each.
const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// A mesh whose copies have no more triangles than this is copied: a ray finds its way among them faster in one tree,
/// and an instance of very few triangles takes more memory than they do.
const MAX_COPIES: u64 = 4096;

/// What is known of a mesh of the file.
#[derive(Default)]
pub(super) struct Shown {
    /// How often the scene shows it.
    pub(super) uses: u64,
    /// Its parts, once some node has shown it.
    parts: Option<Vec<Part>>,
    /// Where it is kept for instances, once there is one.
    kept: Option<MeshId>,
}

/// What the limits count.
#[derive(Default)]
pub(super) struct Counts {
    /// Triangles in memory: in world space, or once in a mesh.
    triangles: u64,
    /// Emissive triangles, each of which is a light in every instance.
    emissive: u64,
}

impl Assembly<'_> {
    /// Counts how often each mesh is shown, which decides what becomes of it, and refuses too many before memory is
    /// taken for any of them. A mesh that is copied counts as well.
    pub(super) fn count_uses(&mut self, nodes: &[Placed]) -> Result<(), Fault> {
        let mut all = 0;
        for placed in nodes.iter().filter(|placed| placed.visible) {
            let Some(node) = self.root.nodes.get(placed.index) else { continue };
            let Some(shown) = node.mesh.and_then(|mesh| self.meshes.get_mut(mesh.value())) else { continue };
            let uses = match attributes(node, placed)? {
                None => 1,
                Some(attributes) => count(self.accessors, &attributes, placed)?.unwrap_or(1) as u64,
            };
            all += uses;
            if all > self.limits.instances {
                let limit = Limit("instances", self.limits.instances);
                let what = format!("the scene has {all} instances by here, and {limit}");
                return Err(Fault::too_large(placed.pointer(), what));
            }
            if node.skin.is_none() && node.weights.is_none() {
                shown.uses += uses;
            }
        }
        Ok(())
    }

    /// Shows a mesh where the node is, wherever the node's instances are, or where its skin's joints put it.
    pub(super) fn mesh(&mut self, index: usize, node: &Node, placed: &Placed, nodes: &[Placed]) -> Result<(), Fault> {
        if node.skin.is_some() || node.weights.is_some() {
            return self.posed(index, node, placed, nodes);
        }
        let Some(shown) = self.meshes.get_mut(index) else { return Ok(()) };
        let mut shown = std::mem::take(shown);
        let parts = match shown.parts.take() {
            Some(parts) => parts,
            None => self.read_mesh(index, None)?,
        };
        let materials: Vec<_> = parts.iter().map(|part| self.material(part.material, part.coloring())).collect();
        let triangles: u64 = parts.iter().map(|part| part.triangles.len() as u64).sum();
        let shared = shown.uses > 1 && triangles * shown.uses > MAX_COPIES;
        for to_world in transforms(self.accessors, node, placed)? {
            let placed = Placed { to_world, ..*placed };
            let kept = match Placement::new(to_world).filter(|_| shared) {
                Some(placement) => self.instance(&mut shown.kept, &parts, &materials, &placement, &placed)?,
                None => false,
            };
            if !kept {
                self.copy(&parts, &materials, &placed)?;
            }
        }
        shown.parts = Some(parts);
        self.meshes[index] = shown;
        Ok(())
    }

    /// Shows a mesh in a pose of the node's own, which it shares with no other.
    fn posed(&mut self, index: usize, node: &Node, placed: &Placed, nodes: &[Placed]) -> Result<(), Fault> {
        let parts = self.read_mesh(index, node.weights.as_deref())?;
        let joints = pose::joints(self.root, self.accessors, node, nodes, &mut self.loaded.warnings)?;
        let mut transforms = transforms(self.accessors, node, placed)?;
        if joints.is_some() && transforms.len() > 1 {
            let at = placed.pointer();
            let what = "has a skin and instances: a skin is where its joints are, and is there once";
            self.loaded.warnings.push(format!("{at} {what}"));
            transforms.truncate(1);
        }
        for to_world in transforms {
            for part in &parts {
                self.counts.add(part, placed, self.limits.triangles)?;
                let world = match &joints {
                    Some(joints) if !part.influences.is_empty() => pose::place(part, joints, placed)?,
                    _ => part::place(part, &Placed { to_world, ..*placed })?,
                };
                let material = self.material(part.material, part.coloring());
                self.add(&world, material);
            }
        }
        Ok(())
    }

    /// A mesh morphed with the weights of the node, or its own.
    fn read_mesh(&mut self, index: usize, weights: Option<&[f32]>) -> Result<Vec<Part>, Fault> {
        let own = self.root.meshes.get(index).and_then(|mesh| mesh.weights.as_deref());
        let weights = weights.or(own).unwrap_or_default();
        mesh::read(self.root, self.accessors, &self.materials, index, weights, &mut self.loaded.warnings)
    }

    fn add(&mut self, world: &World, material: MaterialId) {
        let normals = world.normals.as_deref();
        let geometry = &mut self.loaded.geometry;
        geometry.add_triangles_with(&world.positions, normals, &world.attributes, &world.triangles, material);
    }

    /// Places an instance. False if it would lie too far away, which copying can say more of.
    fn instance(
        &mut self,
        kept: &mut Option<MeshId>,
        parts: &[Part],
        materials: &[MaterialId],
        placement: &Placement,
        placed: &Placed,
    ) -> Result<bool, Fault> {
        let emits = |material: &MaterialId| self.loaded.materials[material.0 as usize].emits();
        let emissive: usize =
            parts.iter().zip(materials).filter(|(_, m)| emits(m)).map(|(p, _)| p.triangles.len()).sum();
        let counts = &mut self.counts;
        counts.emissive += emissive as u64;
        if counts.emissive > self.limits.triangles {
            let limit = Limit("triangles", self.limits.triangles);
            let what = format!("{} emissive triangles are instanced by here, and {limit}", counts.emissive);
            return Err(Fault::too_large(placed.pointer(), what));
        }
        let mesh = match *kept {
            Some(mesh) => mesh,
            None => {
                let mut mesh = Mesh::default();
                for (part, &material) in parts.iter().zip(materials) {
                    self.counts.add(part, placed, self.limits.triangles)?;
                    let normals = part.normals.as_deref();
                    mesh.add_triangles_with(&part.positions, normals, &part.attributes, &part.triangles, material);
                }
                *kept.insert(self.loaded.geometry.add_mesh(mesh))
            }
        };
        let geometry = &mut self.loaded.geometry;
        let near = geometry.placed_bounds(mesh, placement).is_none_or(|b| is_near(b.min) && is_near(b.max));
        if near {
            geometry.add_instance(mesh, *placement);
        }
        Ok(near)
    }

    /// Copies the mesh into world space.
    fn copy(&mut self, parts: &[Part], materials: &[MaterialId], placed: &Placed) -> Result<(), Fault> {
        for (part, &material) in parts.iter().zip(materials) {
            self.counts.add(part, placed, self.limits.triangles)?;
            let world = part::place(part, placed)?;
            self.add(&world, material);
        }
        Ok(())
    }
}

impl Counts {
    fn add(&mut self, part: &Part, placed: &Placed, most: u64) -> Result<(), Fault> {
        self.triangles += part.triangles.len() as u64;
        if self.triangles > most {
            let what = format!("the scene has {} triangles by here, and {}", self.triangles, Limit("triangles", most));
            return Err(Fault::too_large(placed.pointer(), what));
        }
        Ok(())
    }
}

/// The accessors of `EXT_mesh_gpu_instancing` that say where the instances are. Others (`_ID` and the like) are for
/// applications.
struct Attributes {
    translation: Option<Index<Accessor>>,
    rotation: Option<Index<Accessor>>,
    scale: Option<Index<Accessor>>,
}

fn attributes(node: &Node, placed: &Placed) -> Result<Option<Attributes>, Fault> {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get(INSTANCING));
    let Some(extension) = extension else { return Ok(None) };
    let at = format!("{}/extensions/{INSTANCING}/attributes", placed.pointer());
    let Some(attributes) = extension.get("attributes").and_then(Value::as_object) else {
        return Err(Fault::invalid(at, "this is no object with the attributes of the instances"));
    };
    let accessor = |name: &str| match attributes.get(name) {
        None => Ok(None),
        Some(index) => match index.as_u64().and_then(|index| u32::try_from(index).ok()) {
            Some(index) => Ok(Some(Index::new(index))),
            None => Err(Fault::invalid(format!("{at}/{name}"), "this is not the index of an accessor")),
        },
    };
    Ok(Some(Attributes {
        translation: accessor("TRANSLATION")?,
        rotation: accessor("ROTATION")?,
        scale: accessor("SCALE")?,
    }))
}

/// The number of instances; `None` without any attribute, when the extension says nothing.
fn count(accessors: Accessors<'_>, attributes: &Attributes, placed: &Placed) -> Result<Option<usize>, Fault> {
    let mut all = None;
    for (name, index) in
        [("TRANSLATION", attributes.translation), ("ROTATION", attributes.rotation), ("SCALE", attributes.scale)]
    {
        let Some(index) = index else { continue };
        let count = accessors.count(index);
        match all {
            Some(n) if n != count => {
                let at = format!("{}/extensions/{INSTANCING}/attributes/{name}", placed.pointer());
                let what = format!("this attribute has {count} elements, and another one has {n}: they must agree");
                return Err(Fault::invalid(at, what));
            }
            _ => all = Some(count),
        }
    }
    Ok(all)
}

/// Where the node shows its mesh: once, or for each instance at node · T · R · S.
pub(super) fn transforms(accessors: Accessors<'_>, node: &Node, placed: &Placed) -> Result<Vec<DAffine3>, Fault> {
    let Some(attributes) = attributes(node, placed)? else { return Ok(vec![placed.to_world]) };
    let Some(n) = count(accessors, &attributes, placed)? else { return Ok(vec![placed.to_world]) };
    let read = |index: Option<Index<Accessor>>, default: Vec3| match index {
        Some(index) => accessors.vec3(index),
        None => Ok(vec![default; n]),
    };
    let (translations, scales) = (read(attributes.translation, Vec3::ZERO)?, read(attributes.scale, Vec3::ONE)?);
    let rotations = match attributes.rotation {
        Some(index) => accessors.vec4(index)?,
        None => vec![Vec4::W; n],
    };
    let mut out = Vec::with_capacity(n);
    for (i, ((t, r), s)) in translations.iter().zip(&rotations).zip(&scales).enumerate() {
        let rotation = DQuat::from_vec4(r.as_dvec4());
        let to_world = placed.to_world
            * DAffine3::from_scale_rotation_translation(s.as_dvec3(), rotation.normalize(), t.as_dvec3());
        if rotation.length_squared() < 1e-12 || !to_world.is_finite() {
            let at = format!("{}/extensions/{INSTANCING}", placed.pointer());
            let what = format!("the transform of instance {i} is not finite, or its rotation is no unit quaternion");
            return Err(Fault::invalid(at, what));
        }
        out.push(to_world);
    }
    Ok(out)
}
