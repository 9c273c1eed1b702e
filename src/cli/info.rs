//! `pathspace info`: what a scene file holds.

use std::{collections::BTreeMap, path::Path};

use super::{
    exit::Failure,
    shim::{self, Loaded},
    terminal,
};
use crate::scene::{bsdf::Bsdf, material::Material};

pub(super) fn run(path: &Path) -> Result<(), Failure> {
    let loaded = shim::load(path).map_err(|error| Failure::input(error.to_string()))?;
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
    if let Some(bounds) = geometry.bounds() {
        lines.push(format!("bounds     {} to {}, metres", bounds.min, bounds.max));
    }
    lines.push(format!("materials  {}", materials(&loaded.materials)));
    lines.push(format!("lights     {}", shim::light_summary(loaded)));
    for (index, camera) in loaded.cameras.iter().enumerate() {
        let name = camera.name.as_ref().map(|name| format!(" '{name}'")).unwrap_or_default();
        let aspect = camera.aspect.map(|aspect| format!(", aspect {aspect:.3}")).unwrap_or_default();
        let degrees = camera.yfov.to_degrees();
        lines.push(format!("camera     {index}{name}: at {}, yfov {degrees:.1}°{aspect}", camera.position));
    }
    if loaded.cameras.is_empty() {
        lines.push("camera     none; 'render' frames the whole scene".to_owned());
    }
    lines.join("\n")
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

fn kind(bsdf: &Bsdf) -> &'static str {
    match bsdf {
        Bsdf::Diffuse(_) => "diffuse",
        Bsdf::MetallicRoughness(_) => "metallic-roughness",
        Bsdf::Dielectric(_) => "dielectric",
        Bsdf::Thin(_) => "thin dielectric",
    }
}
