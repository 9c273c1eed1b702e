//! Reading scenes: glTF 2.0, as `.gltf` and `.glb`, and environment maps ([`load_environment`]).
//!
//! [`load`] reads a file into world space: triangles, spheres and instances of shared meshes as [`Geometry`],
//! [`Material`]s, lights without a surface, and cameras. Whatever is wrong with a file is one sentence ([`LoadError`]);
//! whatever it asks for that this version does not do is a sentence in [`Loaded::warnings`]; no input makes it panic.
//!
//! # Extensions
//! [`EXTENSIONS`] lists what is read, and `docs/gltf.md` shows the list. A *required* extension outside of it is an
//! error (one of materials a warning, with [`Required::MaterialsIgnored`]), an optional one a warning. Ours are the
//! node extension
//!
//! ```json
//! "extensions": { "PATHSPACE_sphere": { "radius": 0.5, "material": 2 } }
//! ```
//!
//! an analytic sphere around the node's origin with the radius in the node's units (the node's scale must be uniform)
//! and a material of the file (without one, the default material). It faces outward. Another reader shows nothing
//! there. And the camera extension
//!
//! ```json
//! "extensions": { "PATHSPACE_thin_lens": { "aperture": 0.05, "focusDistance": 3.0 } }
//! ```
//!
//! which gives a perspective camera a thin lens of this *diameter*, sharp in the plane at this distance along the
//! viewing axis. Both are metres of the world whatever the node's scale, as that does not apply to cameras. Another
//! reader sees through a pinhole, everything sharp. With `"blades": 6, "rotation": 0.2` it is a polygon
//! ([`Blades`](crate::scene::camera::Blades)). And the material extension
//!
//! ```json
//! "extensions": { "PATHSPACE_materials_metal": { "name": "Au" } }
//! ```
//!
//! which makes a material of a [measured metal](crate::scene::bsdf::Metal). Another reader shows the base colour.
//!
//! # Cameras
//! Perspective and orthographic, placed by their nodes, the nodes' scale ignored (as glTF says). Nothing is clipped at
//! `znear` or `zfar`: a perspective camera sees all that is before its lens, an orthographic one all that is before the
//! plane of its film through the node's origin.
//!
//! # Far from the origin
//! Nodes are placed in f64, with the numbers of the JSON. Where a scene lies far from the file's origin,
//! [`Loaded::centre`] becomes the origin of all that is read before it is rounded to f32; it is zero for others.
//!
//! # Materials
//! Which glTF material becomes which BSDF stands at [`Parameters::bsdf`](crate::scene::material::Parameters::bsdf).
//! `doubleSided` decides which sides of an emitter emit, and what [`Scene::culling_back_faces`] hides from the camera.
//! Otherwise back faces are there and reflect as front faces do.
//!
//! A volume (`KHR_materials_volume`) is what all closed surfaces of a material enclose, wherever they are; cameras,
//! lamps and other volumes may be in it, and where volumes overlap the smaller one is there: see [`media`]. A surface
//! that is not closed is warned of, and so is one that is inside out.

mod accessor;
mod animation;
mod attribute;
mod buffer;
mod camera;
mod document;
mod draco;
mod environment;
mod error;
mod extensions;
mod far;
mod features;
mod ies;
mod image;
mod image_light;
mod influence;
mod instancing;
mod ktx2;
mod layered;
mod layers;
mod light;
mod limits;
mod material;
mod mesh;
mod meshopt;
mod node;
mod openexr;
mod part;
mod placed;
mod pose;
mod primaries;
mod radiance;
mod scenes;
mod tangent;
mod texture;
mod variants;

#[cfg(test)]
mod tests;

use std::{collections::HashMap, path::Path, sync::Arc};

use glam::{DVec3, Vec3};
use gltf_json::Root;
use serde_json::Value;

pub use animation::NamedAnimation;
pub use camera::{NamedCamera, ThinLens, View};
pub use environment::{
    EnvironmentError, LoadedEnvironment, load_environment, load_environment_within, read_environment,
};
pub use error::LoadError;
pub use features::{EXTENSIONS, Extension, Status};
pub use image_light::ImageLight;
pub use layered::{Layered, read_attributes, read_layered};
pub use light::PunctualLight;
pub use limits::{Drafts, Limits, LoadOptions, Outside, PosedAt, Required};
pub use openexr::{ImageError, read_halves, read_image};

use crate::scene::{
    Scene,
    camera::Camera,
    geometry::Geometry,
    light::Light,
    material::{Material, MaterialId},
    media,
};
use accessor::Accessors;
use buffer::{Buffers, Hash};
use error::{Fault, one_line, quoted};
use ies::Profiles;
use image::Images;
use instancing::{Counts, Shown};
use limits::Place;
use part::Coloring;
use placed::{Placed, is_near};

/// A scene as its file describes it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Triangles, spheres and instances, not yet built into a tree.
    pub geometry: Geometry,
    /// Where the origin of everything here lies in the file's coordinates, metres: zero, or the place around which the
    /// detail of a scene lies that is far from the file's origin.
    pub centre: DVec3,
    /// The materials: those of the file in its order, then the default one and those of meshes with vertex colours, as
    /// far as something uses them.
    pub materials: Vec<Material>,
    /// Lights without a surface. Emissive surfaces are found by their materials.
    pub lights: Vec<PunctualLight>,
    /// What lies around the scene that is shown, if the file says so (`EXT_lights_image_based`).
    pub environment: Option<ImageLight>,
    /// The cameras, in the order of the hierarchy.
    pub cameras: Vec<NamedCamera>,
    /// What the file asks for and does not get, one sentence each.
    pub warnings: Vec<String>,
    /// SHA-256 of all bytes that were read (the file, and the buffers and images beside it), in hexadecimal.
    pub hash: String,
    /// What the file contains, shown or not.
    pub summary: Summary,
}

impl Loaded {
    /// Whether anything in the scene emits light.
    pub fn is_lit(&self) -> bool {
        let emits = |id: MaterialId| self.materials[id.0 as usize].emits();
        let alone = !self.lights.is_empty() || self.environment.is_some();
        alone || self.geometry.with_material(&emits).next().is_some()
    }

    /// The scene seen by `camera`, with `environment` around it: a light of its kind in place of what the file has
    /// there.
    ///
    /// # Panics
    /// As [`Scene::new`].
    pub fn into_scene(self, camera: Camera, environment: Option<Light>) -> Scene {
        let own = || Some(Light::EnvironmentMap(Arc::new(self.environment.as_ref()?.to_map(1.0).ok()?)));
        let environment = environment.or_else(own);
        let lights: Vec<_> = self.lights.iter().map(PunctualLight::to_light).chain(environment).collect();
        let mut scene = Scene::new(self.geometry, self.materials, &lights, camera);
        scene.centre = self.centre;
        scene
    }
}

/// Counts of what a file contains, for `pathspace info`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Whether the file is a GLB.
    pub binary: bool,
    /// Who wrote it, as it says.
    pub generator: Option<String>,
    /// The names of its scenes, where they have one.
    pub scenes: Vec<Option<String>>,
    /// The scene that is shown; none in a file without scenes, of which all is shown.
    pub scene: Option<usize>,
    /// The names of its variants of materials.
    pub variants: Vec<String>,
    /// The variant that is shown; none if the materials are those of the file by default.
    pub variant: Option<usize>,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of meshes.
    pub meshes: usize,
    /// Number of materials.
    pub materials: usize,
    /// Number of textures.
    pub textures: usize,
    /// Number of images.
    pub images: usize,
    /// Number of cameras.
    pub cameras: usize,
    /// Its animations.
    pub animations: Vec<NamedAnimation>,
    /// The time that they are shown at, seconds; none if what they move is at rest.
    pub at: Option<f32>,
    /// Number of skins.
    pub skins: usize,
    /// The extensions that it uses.
    pub extensions_used: Vec<String>,
    /// The extensions that it cannot do without.
    pub extensions_required: Vec<String>,
    /// Those of the extensions it uses that this version knows.
    pub extensions_honoured: Vec<String>,
}

/// Reads a `.gltf` or `.glb` file with the buffers beside it.
///
/// # Errors
/// A [`LoadError`] says in one sentence what keeps the file from being read.
pub fn load(path: &Path) -> Result<Loaded, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// The same with options of one's own.
///
/// # Errors
/// As [`load`], and if there is no such scene or variant.
pub fn load_with(path: &Path, options: &LoadOptions<'_>) -> Result<Loaded, LoadError> {
    let file = one_line(&path.display().to_string());
    match buffer::file(path, options.limits.file_bytes) {
        Ok(bytes) => read(&bytes, path.parent().unwrap_or(Path::new("")), &file, options),
        Err(reason) => Err(LoadError::Unreadable { file, reason }),
    }
}

/// Reads a document from memory; `file` is its name in messages, `folder` where its buffers lie.
///
/// # Errors
/// As [`load_with`].
pub fn read(bytes: &[u8], folder: &Path, file: &str, options: &LoadOptions<'_>) -> Result<Loaded, LoadError> {
    let place = Place { folder, limits: options.limits, outside: options.outside };
    let mut hash = Hash::new();
    hash.add(bytes);
    let chunks = document::chunks(bytes, file)?;
    let mut warnings = Vec::new();
    let mut root = document::parse(chunks.json, options.policy(), file, &mut warnings)?;
    let buffers =
        accessor::check(&root, &place.limits).and_then(|()| buffer::read(&root, chunks.bin, place, &mut hash));
    let buffers = buffers.map_err(|fault| fault.at(file))?;
    let accessors = Accessors::new(&root, &buffers);
    let mut animations = animation::list(&root, accessors);
    let posed = match options.at {
        Some(at) => animation::posed(chunks.json, &root, accessors, at, file, &mut warnings)?,
        None => None,
    };
    let json = posed.as_ref().map_or(chunks.json, |posed| &posed.json);
    match &posed {
        Some(posed) => {
            posed.shown.iter().for_each(|&index| animations[index].shown = true);
            root = document::parse(json, options.policy(), file, &mut Vec::new())?;
        }
        None => animation::at_rest(&root, &mut warnings),
    }
    let exact = far::exact(&root, json);
    scenes::choose(&mut root, options.scene, file, &mut warnings)?;
    let variant = variants::choose(&mut root, options.variant, file)?;
    let profiles = ies::profiles(&root, &buffers, place, &mut hash, &mut warnings).map_err(|fault| fault.at(file))?;
    let mut images = Images::new(&root, &buffers, place, &mut hash);
    let environment = image_light::image_light(&root, &mut images, &place.limits).map_err(|fault| fault.at(file))?;
    let assembled = assemble(&root, &buffers, (images, profiles), &exact, options, warnings);
    let mut loaded = assembled.map_err(|fault| fault.at(file))?;
    let at = options.at.filter(|_| posed.is_some()).map(|at| at.seconds);
    loaded.environment = environment;
    let honoured = |name: &&String| features::is_read(name, options.drafts);
    let extensions_honoured = root.extensions_used.iter().filter(honoured).cloned().collect();
    loaded.summary = Summary { binary: chunks.binary, variant, animations, at, extensions_honoured, ..loaded.summary };
    loaded.hash = hash.hex();
    Ok(loaded)
}

/// Puts together what a checked document shows.
fn assemble(
    root: &Root,
    buffers: &Buffers,
    (images, profiles): (Images<'_>, Profiles),
    exact: &[Value],
    options: &LoadOptions<'_>,
    mut warnings: Vec<String>,
) -> Result<Loaded, Fault> {
    let materials = material::all(root, images, options.drafts, &mut warnings)?;
    let mut scene = Assembly::new(root, buffers, options.limits, materials, warnings);
    scene.nodes(exact, &profiles)?;
    let lit = |id: MaterialId| !scene.materials[scene.sources[id.0 as usize]].unlit();
    let outshone = light::outshone(&scene.loaded, lit).map(|(id, what)| {
        let name = quoted(&scene.loaded.materials[id.0 as usize].name);
        format!("/materials/{} ({name}): {what}", scene.sources[id.0 as usize])
    });
    let vague: Vec<_> = media::faults(&scene.loaded.geometry, &scene.loaded.materials)
        .into_iter()
        .map(|(id, fault)| {
            let name = quoted(&scene.loaded.materials[id.0 as usize].name);
            format!(
                "/materials/{} ({name}): {fault}, so that the volume which it bounds is no body: a segment of a path \
                 lies inside only if one of its ends is this surface seen from behind",
                scene.sources[id.0 as usize]
            )
        })
        .collect();
    let mut loaded = scene.loaded;
    loaded.warnings.extend(outshone);
    loaded.warnings.extend(vague);
    Ok(loaded)
}

/// A scene being put together from a checked document.
struct Assembly<'a> {
    root: &'a Root,
    accessors: Accessors<'a>,
    /// The meshes of the file, in its order.
    meshes: Vec<Shown>,
    limits: Limits,
    counts: Counts,
    /// What the file's materials are, and last the default one.
    materials: Vec<material::Read>,
    /// The id of the default material and of the coloured form of each material, once something uses them.
    default_material: Option<MaterialId>,
    colored_materials: HashMap<usize, MaterialId>,
    /// For each material of the scene the index of the one that it was made of.
    sources: Vec<usize>,
    loaded: Loaded,
}

impl<'a> Assembly<'a> {
    fn new(
        root: &'a Root,
        buffers: &'a Buffers,
        limits: Limits,
        materials: Vec<material::Read>,
        warnings: Vec<String>,
    ) -> Self {
        Self {
            root,
            accessors: Accessors::new(root, buffers),
            meshes: root.meshes.iter().map(|_| Shown::default()).collect(),
            limits,
            counts: Counts::default(),
            default_material: None,
            colored_materials: HashMap::new(),
            sources: (0..root.materials.len()).collect(),
            loaded: Loaded {
                geometry: Geometry::default(),
                centre: DVec3::ZERO,
                materials: materials.iter().take(root.materials.len()).map(material::Read::plain).collect(),
                lights: Vec::new(),
                environment: None,
                cameras: Vec::new(),
                warnings,
                hash: String::new(),
                summary: summary(root),
            },
            materials,
        }
    }

    fn nodes(&mut self, exact: &[Value], profiles: &Profiles) -> Result<(), Fault> {
        let mut nodes = node::hierarchy(self.root, exact, self.limits.depth, &mut self.loaded.warnings)?;
        self.count_uses(&nodes)?;
        let extents = self.extents(&nodes)?;
        let centre = far::Centre::of(&extents);
        self.loaded.warnings.extend(centre.warning(&extents));
        self.loaded.centre = centre.at;
        for Placed { to_world, .. } in &mut nodes {
            let at = to_world.translation;
            to_world.translation = at - centre.at;
        }
        for placed in &nodes {
            let Some(node) = self.root.nodes.get(placed.index) else { continue };
            if let Some(index) = node.camera {
                let camera = camera::camera(self.root, placed, index.value(), &mut self.loaded.warnings)?;
                self.loaded.cameras.push(camera);
            }
            if !placed.visible {
                continue;
            }
            if let Some(mesh) = node.mesh {
                self.mesh(mesh.value(), node, placed, &nodes)?;
            }
            let Some(extensions) = &node.extensions else { continue };
            if let Some(light) = &extensions.khr_lights_punctual {
                let light = light::light(self.root, placed, light.light.value(), &mut self.loaded.warnings)?;
                self.loaded.lights.extend(light);
            }
            self.loaded.lights.extend(ies::light(node, placed, profiles)?);
            if let Some(sphere) = extensions.others.get("PATHSPACE_sphere") {
                self.sphere(sphere, placed)?;
            }
        }
        Ok(())
    }

    fn sphere(&mut self, sphere: &Value, node: &Placed) -> Result<(), Fault> {
        let at = format!("{}/extensions/PATHSPACE_sphere", node.pointer());
        let scale = node.uniform_scale().ok_or_else(|| {
            Fault::invalid(&at, "a sphere needs a node of uniform scale, and this one is stretched or sheared")
        })?;
        let radius = sphere.get("radius").and_then(Value::as_f64).map(|radius| (radius * scale) as f32);
        let Some(radius) = radius.filter(|radius| *radius > 0.0 && is_near(Vec3::splat(*radius))) else {
            return Err(Fault::invalid(format!("{at}/radius"), "the radius is not a positive number, or enormous"));
        };
        let material = match sphere.get("material") {
            None => self.root.materials.len(),
            Some(index) => {
                index.as_u64().filter(|&i| i < self.root.materials.len() as u64).map(|i| i as usize).ok_or_else(
                    || Fault::invalid(format!("{at}/material"), "this index points to no material of the file"),
                )?
            }
        };
        if self.materials[material].maps().vary() {
            let what = format!("{at}: a sphere has no texture coordinates, its material's textures are read at (0, 0)");
            self.loaded.warnings.push(what);
        }
        let material = self.material(material, Coloring::Plain);
        self.loaded.geometry.add_sphere(node.origin(), radius, material);
        Ok(())
    }

    /// The id of the material with this index among those that were read, on meshes with or without vertex colours.
    fn material(&mut self, index: usize, coloring: Coloring) -> MaterialId {
        let Self { materials, sources, loaded: Loaded { materials: made, .. }, .. } = self;
        let mut add = |material| {
            made.push(material);
            sources.push(index);
            MaterialId(made.len() as u32 - 1)
        };
        match coloring {
            Coloring::Colored => {
                *self.colored_materials.entry(index).or_insert_with(|| add(materials[index].colored()))
            }
            Coloring::Plain if index + 1 == materials.len() => {
                *self.default_material.get_or_insert_with(|| add(materials[index].plain()))
            }
            Coloring::Plain => MaterialId(index as u32),
        }
    }
}

fn summary(root: &Root) -> Summary {
    Summary {
        generator: root.asset.generator.as_deref().map(one_line),
        scenes: scenes::names(root),
        scene: scenes::shown(root),
        variants: variants::names(root),
        nodes: root.nodes.len(),
        meshes: root.meshes.len(),
        materials: root.materials.len(),
        textures: root.textures.len(),
        images: root.images.len(),
        cameras: root.cameras.len(),
        skins: root.skins.len(),
        extensions_used: root.extensions_used.iter().map(|name| one_line(name)).collect(),
        extensions_honoured: Vec::new(),
        extensions_required: root.extensions_required.iter().map(|name| one_line(name)).collect(),
        ..Summary::default()
    }
}
