//! `pathspace info`: what a scene file holds.

use std::{collections::BTreeMap, path::Path};

use super::{exit::Failure, terminal};
use crate::{
    io::{self, Loaded, PunctualLight, ThinLens, View},
    scene::{
        bsdf::Bsdf,
        material::{Material, MaterialId},
    },
};

pub(super) fn run(path: &Path) -> Result<(), Failure> {
    let loaded = io::load(path).map_err(|error| Failure::input(error.to_string()))?;
    terminal::answer(describe(&loaded));
    for warning in &loaded.warnings {
        terminal::answer(format_args!("warning    {warning}"));
    }
    Ok(())
}

/// One line for each kind of thing, one for each camera.
pub(super) fn describe(loaded: &Loaded) -> String {
    let geometry = &loaded.geometry;
    let mut lines = vec![
        format!("hash       {}", loaded.hash),
        format!("geometry   {} triangles, {} spheres", geometry.triangle_count(), geometry.sphere_count()),
    ];
    if geometry.instance_count() > 0 {
        let (instances, meshes) = (geometry.instance_count(), geometry.mesh_count());
        lines.push(format!("instances  {instances} of {meshes} shared meshes, whose triangles are counted in each"));
    }
    if let Some(bounds) = geometry.bounds() {
        lines.push(format!("bounds     {} to {}, metres", bounds.min, bounds.max));
    }
    lines.push(format!("materials  {}", materials(&loaded.materials)));
    lines.push(format!("lights     {}", lights(loaded)));
    for (index, camera) in loaded.cameras.iter().enumerate() {
        let aspect = camera.aspect.map(|aspect| format!(", aspect {aspect:.3}")).unwrap_or_default();
        let view = view(camera.view);
        lines.push(format!("camera     {index} '{}': at {}, {view}{aspect}", camera.name, camera.position));
    }
    if loaded.cameras.is_empty() {
        lines.push("camera     none; 'render' frames the whole scene".to_owned());
    }
    lines.join("\n")
}

fn view(view: View) -> String {
    match view {
        View::Perspective { yfov, lens } => {
            let lens = lens.map(|ThinLens { aperture, focus }| format!(", lens {aperture} m wide, sharp at {focus} m"));
            format!("yfov {:.1}°{}", yfov.to_degrees(), lens.unwrap_or_default())
        }
        View::Orthographic { height } => format!("orthographic, {height} m high"),
    }
}

/// `5: 3 diffuse, 1 metallic-roughness, 1 glass; 1 of them emits`.
fn materials(materials: &[Material]) -> String {
    let mut kinds = BTreeMap::new();
    for material in materials {
        *kinds.entry(kind(&material.bsdf)).or_insert(0) += 1;
    }
    if kinds.is_empty() {
        return "none".to_owned();
    }
    let kinds = kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect::<Vec<_>>().join(", ");
    let emitters = materials.iter().filter(|material| material.emission.max_element() > 0.0).count();
    format!("{}: {kinds}; emitting: {emitters}", materials.len())
}

/// `12 emissive triangles, 1 emissive sphere, 2 points, 1 sun`.
fn lights(loaded: &Loaded) -> String {
    let geometry = &loaded.geometry;
    let emits = |id: MaterialId| loaded.materials[id.0 as usize].emission.max_element() > 0.0;
    let (spheres, triangles): (Vec<_>, Vec<_>) = geometry.with_material(&emits).partition(|&id| geometry.is_sphere(id));
    let punctual = |is: fn(&PunctualLight) -> bool| loaded.lights.iter().filter(|light| is(light)).count();
    let kinds = [
        (triangles.len(), "emissive triangles"),
        (spheres.len(), "emissive spheres"),
        (punctual(|light| matches!(light, PunctualLight::Point { .. })), "points"),
        (punctual(|light| matches!(light, PunctualLight::Spot { .. })), "spots"),
        (punctual(|light| matches!(light, PunctualLight::Directional { .. })), "suns"),
    ];
    let present: Vec<_> =
        kinds.iter().filter(|(count, _)| *count > 0).map(|(count, kind)| format!("{count} {kind}")).collect();
    if present.is_empty() { "none: the image will be black".to_owned() } else { present.join(", ") }
}

fn kind(bsdf: &Bsdf) -> &'static str {
    match bsdf {
        Bsdf::Diffuse(_) => "diffuse",
        Bsdf::MetallicRoughness(_) => "metallic-roughness",
        Bsdf::Dielectric(_) => "dielectric",
        Bsdf::Thin(_) => "thin dielectric",
    }
}
