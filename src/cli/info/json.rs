//! `pathspace info --json`: the same for programs.

use glam::{DVec3, Vec3};
use pathspace::{
    io::{Loaded, NamedAnimation, NamedCamera, PunctualLight, ThinLens, View},
    scene::{
        bsdf::Metal,
        layers::LayerMaps,
        material::{AlphaMode, EmissionSides, Material, VertexColors},
        texture::Texture,
    },
};
use serde_json::{Value, json};

use crate::cli::{info, shared::number::exact as number};

/// The version of the layout: it grows when a member changes its meaning or goes away, not when one is added.
const LAYOUT: u32 = 1;

/// Everything that is known about a file. Lengths are metres, angles radians; what a file does not say is null.
pub fn describe(loaded: &Loaded) -> Value {
    let (summary, geometry) = (&loaded.summary, &loaded.geometry);
    let bounds = geometry.bounds().map(|b| json!({ "min": place(loaded, b.min), "max": place(loaded, b.max) }));
    let lights = info::light_kinds(loaded).map(|(count, kind)| (kind.replace(' ', "_"), json!(count)));
    json!({
        "layout": LAYOUT,
        "hash": loaded.hash,
        "binary": summary.binary,
        "generator": summary.generator,
        "scenes": summary.scenes,
        "scene": summary.scene,
        "variants": summary.variants,
        "variant": summary.variant,
        "animations": summary.animations.iter().map(animation).collect::<Vec<_>>(),
        "at": summary.at.map(number),
        "file": {
            "nodes": summary.nodes,
            "meshes": summary.meshes,
            "materials": summary.materials,
            "textures": summary.textures,
            "images": summary.images,
            "cameras": summary.cameras,
            "animations": summary.animations.len(),
            "skins": summary.skins,
        },
        "geometry": {
            "triangles": geometry.triangle_count(),
            "spheres": geometry.sphere_count(),
            "shared_meshes": geometry.mesh_count(),
            "instances": geometry.instance_count(),
            "bounds": bounds,
            "centre": loaded.centre.to_array(),
        },
        "materials": loaded.materials.iter().map(material).collect::<Vec<_>>(),
        "lights": Value::Object(lights.into_iter().collect()),
        "punctual_lights": loaded.lights.iter().map(|light| punctual_light(loaded, light)).collect::<Vec<_>>(),
        "cameras": loaded.cameras.iter().map(|c| camera(loaded, c)).collect::<Vec<_>>(),
        "extensions": {
            "used": summary.extensions_used,
            "required": summary.extensions_required,
            "honoured": summary.extensions_honoured,
        },
        "warnings": loaded.warnings,
    })
}

fn animation(animation: &NamedAnimation) -> Value {
    json!({ "name": animation.name, "seconds": animation.seconds.map(number), "shown": animation.shown })
}

/// Radiance and absorption are linear RGB, per steradian and square metre or nit, and per metre; dispersion is 20 over
/// Abbe's number; textures are those that are read.
fn material(material: &Material) -> Value {
    let maps = material.maps.as_ref();
    let slots: [(&str, Option<&Texture>); 7] = [
        ("base_color", maps.and_then(|m| m.base_color.as_ref())),
        ("metallic_roughness", maps.and_then(|m| m.metallic_roughness.as_ref())),
        ("normal", maps.and_then(|m| m.normal.as_ref()).map(|normal| &normal.texture)),
        ("emission", maps.and_then(|m| m.emission.as_ref())),
        ("transmission", maps.and_then(|m| m.transmission.as_ref())),
        ("specular", maps.and_then(|m| m.specular.as_ref())),
        ("specular_color", maps.and_then(|m| m.specular_color.as_ref())),
    ];
    let layers = maps.and_then(|m| m.layers.as_ref()).into_iter().flat_map(|layers| layer_slots(layers));
    let textures = slots.into_iter().chain(layers).filter_map(|(slot, texture)| {
        texture.map(|t| {
            let (width, height) = t.image.size();
            (slot.to_owned(), json!({ "width": width, "height": height }))
        })
    });
    json!({
        "name": material.name,
        "kind": info::kind(material),
        "metal": material.measured_metal().map(Metal::symbol),
        "emits": material.emits(),
        "radiance": vector(material.emission),
        "emission_sides": match material.emission_sides {
            EmissionSides::Front => 1,
            EmissionSides::Both => 2,
        },
        "absorption": vector(material.absorption),
        "dispersion": number(material.dispersion),
        "alpha": match material.alpha_mode {
            AlphaMode::Opaque => json!({ "mode": "opaque" }),
            AlphaMode::Mask { factor, cutoff } =>
                json!({ "mode": "mask", "factor": number(factor), "cutoff": number(cutoff) }),
            AlphaMode::Blend { factor } => json!({ "mode": "blend", "factor": number(factor) }),
        },
        "textures": Value::Object(textures.collect()),
        "vertex_colors": maps.is_some_and(|m| m.vertex_colors != VertexColors::Nothing),
    })
}

fn layer_slots(layers: &LayerMaps) -> [(&'static str, Option<&Texture>); 10] {
    [
        ("clearcoat", layers.coat.as_ref()),
        ("clearcoat_roughness", layers.coat_roughness.as_ref()),
        ("clearcoat_normal", layers.coat_normal.as_ref().map(|normal| &normal.texture)),
        ("sheen_color", layers.sheen_color.as_ref()),
        ("sheen_roughness", layers.sheen_roughness.as_ref()),
        ("anisotropy", layers.anisotropy.as_ref()),
        ("iridescence", layers.iridescence.as_ref()),
        ("iridescence_thickness", layers.film_thickness.as_ref()),
        ("diffuse_transmission", layers.diffuse_transmission.as_ref()),
        ("diffuse_transmission_color", layers.diffuse_transmission_color.as_ref()),
    ]
}

/// Intensities are linear RGB, candela; irradiance is in lux, and flux in lumen before it is coloured.
fn punctual_light(loaded: &Loaded, light: &PunctualLight) -> Value {
    match *light {
        PunctualLight::Profile { position, to_world, color, ref profile } => json!({
            "type": "profile",
            "position": place(loaded, position),
            "direction": vector(-to_world.z_axis),
            "color": vector(color),
            "peak": number(profile.peak()),
            "flux": number(profile.integral()),
        }),
        PunctualLight::Point { position, intensity } => {
            json!({ "type": "point", "position": place(loaded, position), "intensity": vector(intensity) })
        }
        PunctualLight::Spot { position, direction, intensity, inner, outer } => json!({
            "type": "spot",
            "position": place(loaded, position),
            "direction": vector(direction),
            "intensity": vector(intensity),
            "innerConeAngle": number(inner),
            "outerConeAngle": number(outer),
        }),
        PunctualLight::Directional { direction, irradiance } => {
            json!({ "type": "directional", "direction": vector(direction), "irradiance": vector(irradiance) })
        }
    }
}

fn camera(loaded: &Loaded, camera: &NamedCamera) -> Value {
    let mut value = json!({
        "name": camera.name,
        "position": place(loaded, camera.position),
        "forward": vector(camera.forward),
        "up": vector(camera.up),
        "aspect": camera.aspect.map(number),
    });
    match camera.view {
        View::Perspective { yfov, lens } => {
            value["type"] = json!("perspective");
            value["yfov"] = number(yfov);
            value["lens"] = lens.map_or(Value::Null, |ThinLens { aperture, focus, blades }| {
                let blades = blades.map(|blades| (blades.count(), number(blades.rotation())));
                json!({
                    "aperture": number(aperture),
                    "focusDistance": number(focus),
                    "blades": blades.as_ref().map(|(count, _)| count),
                    "rotation": blades.as_ref().map(|(_, rotation)| rotation),
                })
            });
        }
        View::Orthographic { height } => {
            value["type"] = json!("orthographic");
            value["height"] = number(height);
        }
    }
    value
}

/// A place in the file's coordinates, metres; of a scene that was re-centred in f64.
fn place(loaded: &Loaded, p: Vec3) -> Value {
    if loaded.centre == DVec3::ZERO { vector(p) } else { json!((loaded.centre + p.as_dvec3()).to_array()) }
}

fn vector(v: impl Into<Vec3>) -> Value {
    Value::Array(v.into().to_array().map(number).to_vec())
}
