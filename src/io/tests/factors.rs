//! A factor with a texture of one value is the product of the two, whichever parameter it is and whatever the material.

use glam::Vec2;
use image::{DynamicImage, ImageFormat, RgbaImage};

use super::{
    textures::{encoded, textured, uri},
    *,
};
use crate::{
    math::Rgb,
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::PrimitiveId,
        light::Light,
        material::{AlphaMode, Material},
        texture::srgb_to_linear,
    },
};

/// A parameter with its factor, its texture, and the channels that it reads.
struct Slot {
    factor: &'static str,
    value: fn(f32) -> Value,
    texture: &'static str,
    texel: fn(u8) -> [u8; 4],
    decode: fn(u8) -> f32,
}

fn linear(texel: u8) -> f32 {
    f32::from(texel) / 255.0
}

fn srgb(texel: u8) -> f32 {
    srgb_to_linear(linear(texel))
}

const SLOTS: [Slot; 9] = [
    Slot {
        factor: "/pbrMetallicRoughness/baseColorFactor",
        value: |f| json!([f, f, f, 1.0]),
        texture: "/pbrMetallicRoughness/baseColorTexture",
        texel: |t| [t, t, t, 255],
        decode: srgb,
    },
    Slot {
        factor: "/pbrMetallicRoughness/baseColorFactor",
        value: |f| json!([1.0, 1.0, 1.0, f]),
        texture: "/pbrMetallicRoughness/baseColorTexture",
        texel: |t| [255, 255, 255, t],
        decode: linear,
    },
    Slot {
        factor: "/pbrMetallicRoughness/metallicFactor",
        value: |f| json!(f),
        texture: "/pbrMetallicRoughness/metallicRoughnessTexture",
        texel: |t| [0, 255, t, 0],
        decode: linear,
    },
    Slot {
        factor: "/pbrMetallicRoughness/roughnessFactor",
        value: |f| json!(f),
        texture: "/pbrMetallicRoughness/metallicRoughnessTexture",
        texel: |t| [0, t, 255, 0],
        decode: linear,
    },
    Slot {
        factor: "/emissiveFactor",
        value: |f| json!([f, f, f]),
        texture: "/emissiveTexture",
        texel: |t| [t, t, t, 0],
        decode: srgb,
    },
    Slot {
        factor: "/extensions/KHR_materials_transmission/transmissionFactor",
        value: |f| json!(f),
        texture: "/extensions/KHR_materials_transmission/transmissionTexture",
        texel: |t| [t, 0, 0, 0],
        decode: linear,
    },
    Slot {
        factor: "/extensions/KHR_materials_volume/thicknessFactor",
        value: |f| json!(f),
        texture: "/extensions/KHR_materials_volume/thicknessTexture",
        texel: |t| [0, t, 0, 0],
        decode: linear,
    },
    Slot {
        factor: "/extensions/KHR_materials_specular/specularFactor",
        value: |f| json!(f),
        texture: "/extensions/KHR_materials_specular/specularTexture",
        texel: |t| [0, 0, 0, t],
        decode: linear,
    },
    Slot {
        factor: "/extensions/KHR_materials_specular/specularColorFactor",
        value: |f| json!([f, f, f]),
        texture: "/extensions/KHR_materials_specular/specularColorTexture",
        texel: |t| [t, t, t, 0],
        decode: srgb,
    },
];

/// Materials of every kind, all of them emitting something.
fn materials() -> Vec<Value> {
    let base = json!({
        "pbrMetallicRoughness":
            { "baseColorFactor": [0.9, 0.8, 0.7, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.4 },
        "emissiveFactor": [0.2, 0.3, 0.4],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 3.0 } },
    });
    let transmits =
        || changed(base.clone(), "/extensions/KHR_materials_transmission", json!({ "transmissionFactor": 0.8 }));
    let volume = json!({ "thicknessFactor": 0.5, "attenuationColor": [0.5, 0.6, 0.7], "attenuationDistance": 2.0 });
    let volume = || changed(transmits(), "/extensions/KHR_materials_volume", volume.clone());
    vec![
        base.clone(),
        changed(base.clone(), "/pbrMetallicRoughness/metallicFactor", json!(1.0)),
        changed(base.clone(), "/alphaMode", json!("BLEND")),
        changed(base.clone(), "/alphaMode", json!("MASK")),
        changed(base.clone(), "/extensions/KHR_materials_unlit", json!({})),
        transmits(),
        volume(),
        changed(volume(), "/pbrMetallicRoughness/metallicFactor", json!(1.0)),
        changed(transmits(), "/alphaMode", json!("BLEND")),
    ]
}

/// Sets a value of an object, and makes those around it.
fn set(object: &mut Value, pointer: &str, value: Value) {
    let mut at = object;
    for member in pointer.split('/').skip(1) {
        at = &mut at[member];
    }
    *at = value;
}

fn one_texel(texel: [u8; 4]) -> Vec<u8> {
    encoded(&DynamicImage::from(RgbaImage::from_pixel(1, 1, image::Rgba(texel))), ImageFormat::Png)
}

/// All that paths meet of the first triangle's material at a place.
fn resolved(loaded: &Loaded, material: &Material) -> String {
    let at = || loaded.geometry.attributes(PrimitiveId::world(0), Vec2::splat(0.3));
    let maps = material.maps.as_ref();
    let bsdf = maps.map_or(material.bsdf, |maps| maps.parameters(&at()).bsdf());
    let emission = material.emission * maps.map_or(Rgb::ONE, |maps| maps.emission(&at()));
    let (alpha, whole) = (material.alpha(at), material.alpha_mode == AlphaMode::Opaque);
    let Material { emission_sides, absorption, .. } = material;
    let (emits, lit) = (material.emits(), loaded.is_lit());
    format!("{bsdf:?} {emission:?} {emission_sides:?} {alpha} {whole} {absorption:?} {emits} {lit}")
}

/// Equal up to the roundings of numbers in them.
fn alike(a: &str, b: &str) -> bool {
    let parts = |text: &str| -> Vec<String> {
        text.split(|c: char| !(c.is_alphanumeric() || "+-._".contains(c))).map(str::to_owned).collect()
    };
    let (a, b) = (parts(a), parts(b));
    let same = |a: &str, b: &str| match (a.parse::<f32>(), b.parse::<f32>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 2e-6 * a.abs().max(b.abs()),
        _ => a == b,
    };
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| same(a, b))
}

#[test]
fn a_constant_texture_is_a_factor() {
    for (n, material) in materials().into_iter().enumerate() {
        for slot in &SLOTS {
            for (factor, texel) in [1.0, 0.5].into_iter().flat_map(|f| [0, 51, 128, 255].map(|t| (f, t))) {
                let mut plain = material.clone();
                let mut varying = material.clone();
                set(&mut varying, slot.factor, (slot.value)(factor));
                set(&mut varying, slot.texture, json!({ "index": 0 }));
                set(&mut plain, slot.factor, (slot.value)(factor * (slot.decode)(texel)));
                let image = one_texel((slot.texel)(texel));
                let [varying, plain] = [varying, plain].map(|material| load(&textured(&image, &material)).unwrap());
                let [a, b] = [&varying, &plain].map(|loaded| resolved(loaded, &loaded.materials[0]));
                let what = slot.texture;
                assert!(alike(&a, &b), "material {n}, {what}, {factor} · {texel}:\n{a}\n{b}");
            }
        }
    }
}

#[test]
fn a_constant_vertex_colour_is_a_factor() {
    for material in materials() {
        let mut document = textured(&one_texel([255; 4]), &json!({}));
        document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(4);
        document["bufferViews"][4]["byteOffset"] = json!(0);
        let bytes =
            STANDARD.decode(document["buffers"][0]["uri"].as_str().unwrap().split_once(',').unwrap().1).unwrap();
        let bytes: Vec<u8> = [51_u8, 102, 204, 128].repeat(3).into_iter().chain(bytes).collect();
        for view in document["bufferViews"].as_array_mut().unwrap().iter_mut().take(4) {
            view["byteOffset"] = json!(view["byteOffset"].as_u64().unwrap() + 12);
        }
        document["buffers"][0] = json!({ "byteLength": bytes.len(), "uri": uri(&bytes) });
        document["materials"] = json!([material]);
        let colored = load(&document).unwrap();
        let id = colored.geometry.material(PrimitiveId::world(0)).0 as usize;

        let mut factor = material["pbrMetallicRoughness"]["baseColorFactor"].clone();
        for (factor, texel) in factor.as_array_mut().unwrap().iter_mut().zip([51, 102, 204, 128]) {
            *factor = json!(factor.as_f64().unwrap() as f32 * linear(texel));
        }
        document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = factor;
        document["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("COLOR_0");
        let plain = load(&document).unwrap();
        let (a, b) = (resolved(&colored, &colored.materials[id]), resolved(&plain, &plain.materials[0]));
        // AlphaMode by colours stays a property of each point.
        let [a, b] = [a, b].map(|text| text.replace("true", "").replace("false", ""));
        assert!(alike(&a, &b), "{material}:\n{a}\n{b}");
    }
}

#[test]
fn no_normal_is_tilted_by_a_scale_of_zero() {
    let image = one_texel([255, 128, 128, 0]);
    for (scale, tilted) in [(0.0, false), (1.0, true)] {
        let material = json!({ "normalTexture": { "index": 0, "scale": scale } });
        let loaded = load(&textured(&image, &material)).unwrap();
        let map = loaded.materials[0].maps.as_ref().unwrap().normal.as_ref().unwrap();
        let surface = loaded.geometry.surface_at(PrimitiveId::world(0), Vec2::splat(0.3)).unwrap();
        let frame = loaded.geometry.tangent_frame(PrimitiveId::world(0), &surface).unwrap();
        let n = map.shading_normal(Vec2::ZERO, &frame, surface.normal);
        assert_eq!(n.z < 0.9, tilted, "{n}");
    }
}

/// Where a texture varies, what the material is anywhere decides whether it can let light through.
#[test]
fn textures_that_vary_decide_by_their_extremes() {
    let metallic = |texels: [u8; 2], factor: f32| {
        let texels = texels.into_iter().flat_map(|t| [0, 255, t, 0]).collect();
        let image = DynamicImage::from(RgbaImage::from_raw(2, 1, texels).unwrap());
        let material = json!({
            "name": "wing",
            "pbrMetallicRoughness": { "metallicFactor": factor, "metallicRoughnessTexture": { "index": 0 } },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 } },
        });
        let loaded = load(&textured(&encoded(&image, ImageFormat::Png), &material)).unwrap();
        let boundary = loaded.materials[0].maps.as_ref().unwrap().factors.boundary;
        (format!("{boundary:?}"), loaded.warnings.join("; "))
    };
    let thin = |warnings: &str| ("Thin".to_owned(), warnings.to_owned());
    let opaque = |warnings: &str| ("Opaque".to_owned(), warnings.to_owned());
    let partly = "material “wing” transmits where its texture makes it less than half metal";
    let between = "material “wing” lies between metal and glass: taken as";
    assert_eq!(metallic([0, 255], 1.0), thin(partly));
    assert_eq!(metallic([0, 0], 1.0), thin(""));
    assert_eq!(metallic([0, 255], 0.4), thin(&format!("{between} glass")));
    assert_eq!(metallic([20, 40], 1.0), thin(&format!("{between} glass")));
    assert_eq!(metallic([200, 255], 1.0), opaque(&format!("{between} metal")));
    assert_eq!(metallic([255, 255], 1.0), opaque(""));
}

/// A pane and a volume of black glass whose default metallic factor of 1 meets a texture of 0 reflect Fresnel's 0.04,
/// where a black metal reflects nothing.
#[test]
fn glass_of_a_metallic_texture_is_rendered_as_glass() {
    for volume in [false, true] {
        let mut material = json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [0, 0, 0, 1], "roughnessFactor": 0, "metallicRoughnessTexture": { "index": 0 },
            },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 } },
        });
        if volume {
            set(&mut material, "/extensions/KHR_materials_volume", json!({ "thicknessFactor": 1 }));
        }
        let rendered = |material: &Value| {
            let loaded = load(&textured(&one_texel([0, 255, 0, 0]), material)).unwrap();
            let sensor = Sensor { width: 8, height: 8, padding: 0 };
            let center = Vec3::new(0.25, 0.25, 0.0);
            let camera = Camera::look_at(center + Vec3::Z, center, Vec3::Y, 0.1, sensor);
            let sky = Light::Environment { radiance: Rgb::ONE };
            let scene = Scene::new(loaded.geometry, loaded.materials, &[sky], camera);
            let settings = Settings { filter: Filter::Box, ..Settings::new(sensor) };
            let mut renderer = Renderer::new(&scene, &settings);
            (0..16).for_each(|_| renderer.pass());
            renderer.film().image(16)
        };
        let varying = rendered(&material);
        let black = json!({ "baseColorFactor": [0, 0, 0, 1], "roughnessFactor": 0, "metallicFactor": 0 });
        material["pbrMetallicRoughness"] = black;
        assert_eq!(varying, rendered(&material), "volume: {volume}");
        assert!((0.03..0.05).contains(&varying.mean().r()), "volume: {volume}, {}", varying.mean());
    }
}

#[test]
fn an_attenuation_distance_of_zero_is_infinite() {
    for (distance, expected, warnings) in
        [(json!(2.0), 0.5 * 2.0_f32.ln(), 0), (json!(0.0), 0.0, 1), (json!(-1.0), 0.0, 1)]
    {
        let volume =
            json!({ "thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 0.5], "attenuationDistance": distance });
        let mut material = json!({ "pbrMetallicRoughness": { "metallicFactor": 0 } });
        set(&mut material, "/extensions/KHR_materials_transmission", json!({ "transmissionFactor": 1 }));
        set(&mut material, "/extensions/KHR_materials_volume", volume);
        let loaded = load(&textured(&one_texel([0; 4]), &material)).unwrap();
        assert!((loaded.materials[0].absorption - Rgb::splat(expected)).abs().max_element() < 1e-6);
        // The triangle bounds no volume, which is another warning.
        let infinite: Vec<_> = loaded.warnings.iter().filter(|text| text.contains("counts as infinite")).collect();
        assert_eq!(infinite.len(), warnings, "{:?}", loaded.warnings);
        assert!(infinite.iter().all(|text| text.len() < 120), "{infinite:?}");
    }
}
