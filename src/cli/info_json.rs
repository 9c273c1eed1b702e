//! `pathspace info --json`: the same for programs.

use glam::Vec3;
use serde_json::{Value, json};

use super::info;
use crate::io::{Loaded, NamedCamera, ThinLens, View};

/// The version of the layout: it grows when a member changes its meaning or goes away, not when one is added.
const LAYOUT: u32 = 1;

/// Everything that is known about a file. Lengths are metres, angles radians; what a file does not say is null.
pub(super) fn describe(loaded: &Loaded) -> Value {
    let (summary, geometry) = (&loaded.summary, &loaded.geometry);
    let bounds = geometry.bounds().map(|bounds| json!({ "min": vector(bounds.min), "max": vector(bounds.max) }));
    let materials = loaded.materials.iter().map(|material| {
        let emits = material.emits();
        json!({ "name": material.name, "kind": info::kind(&material.bsdf), "emits": emits })
    });
    let lights = info::light_kinds(loaded).map(|(count, kind)| (kind.replace(' ', "_"), json!(count)));
    json!({
        "layout": LAYOUT,
        "hash": loaded.hash,
        "binary": summary.binary,
        "generator": summary.generator,
        "scenes": summary.scenes,
        "scene": summary.scene,
        "file": {
            "nodes": summary.nodes,
            "meshes": summary.meshes,
            "materials": summary.materials,
            "textures": summary.textures,
            "images": summary.images,
            "cameras": summary.cameras,
            "animations": summary.animations,
            "skins": summary.skins,
        },
        "geometry": {
            "triangles": geometry.triangle_count(),
            "spheres": geometry.sphere_count(),
            "shared_meshes": geometry.mesh_count(),
            "instances": geometry.instance_count(),
            "bounds": bounds,
        },
        "materials": materials.collect::<Vec<_>>(),
        "lights": Value::Object(lights.into_iter().collect()),
        "cameras": loaded.cameras.iter().map(camera).collect::<Vec<_>>(),
        "extensions": {
            "used": summary.extensions_used,
            "required": summary.extensions_required,
            "honoured": summary.extensions_honoured,
        },
        "warnings": loaded.warnings,
    })
}

fn camera(camera: &NamedCamera) -> Value {
    let mut value = json!({
        "name": camera.name,
        "position": vector(camera.position),
        "forward": vector(camera.forward),
        "up": vector(camera.up),
        "aspect": camera.aspect.map(number),
    });
    match camera.view {
        View::Perspective { yfov, lens } => {
            value["type"] = json!("perspective");
            value["yfov"] = number(yfov);
            value["lens"] = lens.map_or(
                Value::Null,
                |ThinLens { aperture, focus }| json!({ "aperture": number(aperture), "focusDistance": number(focus) }),
            );
        }
        View::Orthographic { height } => {
            value["type"] = json!("orthographic");
            value["height"] = number(height);
        }
    }
    value
}

fn vector(v: Vec3) -> Value {
    Value::Array(v.to_array().map(number).to_vec())
}

/// The shortest number that is `x` in f32: 0.1, not the 0.10000000149011612 that it is in f64.
fn number(x: f32) -> Value {
    json!(x.to_string().parse::<f64>().ok())
}
