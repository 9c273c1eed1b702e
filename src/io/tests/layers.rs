//! Layers of materials: every texture multiplies its factor by its own channel, directions are in the frame that the
//! BSDF has, and what cannot be read is said in one sentence.

use glam::{Vec2, Vec3};
use image::{DynamicImage, ImageFormat, RgbaImage};

use super::{
    textures::{encoded, textured},
    *,
};
use crate::{
    math::{Frame, Rgb},
    scene::{
        bsdf::{Bsdf, Clear, Passage, Surface},
        geometry::{PrimitiveId, TangentFrame},
        layers::{LayerMaps, Layers},
        texture::srgb_to_linear,
    },
};

fn one_texel(texel: [u8; 4]) -> Vec<u8> {
    encoded(&DynamicImage::from(RgbaImage::from_pixel(1, 1, image::Rgba(texel))), ImageFormat::Png)
}

fn loaded(texel: [u8; 4], extensions: &Value) -> Loaded {
    load(&textured(&one_texel(texel), &json!({ "extensions": extensions }))).unwrap()
}

fn layers(loaded: &Loaded) -> Layers {
    let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::splat(0.3));
    loaded.materials[0].maps.as_ref().expect("it has a texture").parameters(&at).layers
}

/// The extension, its factor, its texture, which channel counts, how it is encoded, and where it arrives.
type Slot = (&'static str, &'static str, &'static str, usize, fn(f32) -> f32, fn(&Layers) -> f32);

const SLOTS: [Slot; 10] = [
    ("clearcoat", "clearcoatFactor", "clearcoatTexture", 0, |t| t, |l| l.coat),
    ("clearcoat", "clearcoatRoughnessFactor", "clearcoatRoughnessTexture", 1, |t| t, |l| l.coat_roughness),
    ("sheen", "sheenColorFactor", "sheenColorTexture", 0, srgb_to_linear, |l| l.sheen.r()),
    ("sheen", "sheenColorFactor", "sheenColorTexture", 2, srgb_to_linear, |l| l.sheen.b()),
    ("sheen", "sheenRoughnessFactor", "sheenRoughnessTexture", 3, |t| t, |l| l.sheen_roughness),
    ("anisotropy", "anisotropyStrength", "anisotropyTexture", 2, |t| t, |l| l.anisotropy),
    ("iridescence", "iridescenceFactor", "iridescenceTexture", 0, |t| t, |l| l.iridescence),
    (
        "diffuse_transmission",
        "diffuseTransmissionFactor",
        "diffuseTransmissionTexture",
        3,
        |t| t,
        |l| l.diffuse_transmission,
    ),
    (
        "diffuse_transmission",
        "diffuseTransmissionColorFactor",
        "diffuseTransmissionColorTexture",
        1,
        srgb_to_linear,
        |l| l.diffuse_transmission_color.g(),
    ),
    (
        "iridescence",
        "iridescenceThicknessMaximum",
        "iridescenceThicknessTexture",
        1,
        |t| t,
        |l| l.film_thickness / 1000.0,
    ),
];

#[test]
fn each_texture_multiplies_its_factor_by_its_channel() {
    for (extension, factor, texture, channel, decode, read) in SLOTS {
        for texel in [0_u8, 51, 255] {
            let mut texels = [255 - texel / 2; 4];
            texels[channel] = texel;
            let value = match factor {
                f if f.contains("Color") => json!([0.5, 0.5, 0.5]),
                f if f.contains("Thickness") => json!(500.0),
                _ => json!(0.5),
            };
            // What makes that there is a layer at all.
            let mut members = json!({
                "clearcoatFactor": 1.0, "sheenColorFactor": [1.0, 1.0, 1.0], "anisotropyStrength": 1.0,
                "iridescenceFactor": 1.0, "iridescenceThicknessMinimum": 0.0, "diffuseTransmissionFactor": 1.0,
            });
            members[factor] = value;
            members[texture] = json!({ "index": 0 });
            let name = format!("KHR_materials_{extension}");
            let found = read(&layers(&loaded(texels, &json!({ name: members }))));
            let expected = 0.5 * decode(f32::from(texel) / 255.0);
            assert!((found - expected).abs() < 1e-5, "{texture}, {texel}: {found}, not {expected}");
        }
    }
}

#[test]
fn layers_without_textures_are_their_factors() {
    let extensions = json!({
        "KHR_materials_clearcoat": { "clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25 },
        "KHR_materials_sheen": { "sheenColorFactor": [0.25, 0.5, 1.0], "sheenRoughnessFactor": 0.5 },
        "KHR_materials_iridescence": { "iridescenceFactor": 1.0, "iridescenceIor": 1.75 },
    });
    let loaded = loaded([255; 4], &extensions);
    let Bsdf::Layered(layered) = loaded.materials[0].bsdf else { panic!("{:?}", loaded.materials[0].bsdf) };
    let s = layered.surface();
    let near = |a: f32, b: f32| assert!((a - b).abs() < 3e-3, "{a}, not {b}: {s:?}");
    near(s.coat, 0.5);
    near(s.coat_alpha, 0.0625);
    near(s.sheen.r(), 0.25);
    near(s.sheen.b(), 1.0);
    near(s.sheen_alpha, 0.25);
    near(s.film_ior, 1.75);
    near(s.film_thickness, 400.0);
    near(s.f0.g(), 0.04);
    assert!(loaded.warnings.is_empty() && loaded.materials[0].maps.is_none(), "{:?}", loaded.warnings);
}

#[test]
fn the_grain_turns_counter_clockwise_from_the_tangent() {
    // Red and green (1/2, 1): up on the image.
    let anisotropy = json!({ "anisotropyStrength": 1.0, "anisotropyTexture": { "index": 0 } });
    let up = layers(&loaded([128, 255, 255, 255], &json!({ "KHR_materials_anisotropy": anisotropy })));
    assert!((up.grain - Vec2::Y).length() < 0.01, "{}", up.grain);
    let turned = json!({ "anisotropyStrength": 1.0, "anisotropyRotation": 0.5, "anisotropyTexture": { "index": 0 } });
    let loaded = loaded([255, 128, 255, 255], &json!({ "KHR_materials_anisotropy": turned }));
    let mut turned = layers(&loaded);
    assert!((turned.grain - Vec2::from_angle(0.5)).length() < 0.01, "{}", turned.grain);

    let n = Vec3::new(0.3, -0.4, 0.8).normalize();
    let tangent = n.cross(Vec3::X).normalize();
    let frame = TangentFrame { tangent: 3.0 * tangent, bitangent: 2.0 * n.cross(tangent), normal: n };
    let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::splat(0.3));
    LayerMaps::default().orient(&mut turned, &at, Some(&frame), [n; 3]);
    let world = Frame::around(n).to_world(turned.grain.extend(0.0));
    let expected = tangent * 0.5_f32.cos() + n.cross(tangent) * 0.5_f32.sin();
    assert!((world - expected).length() < 0.01, "{world}, not {expected}");
}

#[test]
fn a_coat_without_a_normal_texture_has_the_meshs_normal() {
    let loaded = loaded(
        [255; 4],
        &json!({ "KHR_materials_clearcoat": {
        "clearcoatFactor": 1.0, "clearcoatTexture": { "index": 0 },
    } }),
    );
    let mut coated = layers(&loaded);
    let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::splat(0.3));
    let (n_s, mesh) = (Vec3::new(0.6, 0.0, 0.8), Vec3::Z);
    LayerMaps::default().orient(&mut coated, &at, None, [n_s, mesh, mesh]);
    let x = coated.coat_normal;
    let world = Frame::around(n_s).to_world(x.extend((1.0 - x.length_squared()).sqrt()));
    assert!((world - mesh).length() < 1e-6, "{world}");
    LayerMaps::default().orient(&mut coated, &at, None, [mesh; 3]);
    assert_eq!(coated.coat_normal, Vec2::ZERO);
}

/// What a material with these extensions transmits through, and what is said of it.
fn passage(extensions: &Value, metallic: f32) -> (Surface, Vec<String>) {
    let pbr = json!({ "metallicFactor": metallic, "roughnessFactor": 0.5 });
    let material = json!({ "pbrMetallicRoughness": pbr, "extensions": extensions });
    let loaded = load(&changed(triangle(), "/materials", json!([material]))).unwrap();
    let Bsdf::Layered(layered) = loaded.materials[0].bsdf else { panic!("{:?}", loaded.materials[0].bsdf) };
    (layered.surface(), loaded.warnings)
}

#[test]
fn what_transmits_has_layers_as_anything_else() {
    let transmission = json!({ "transmissionFactor": 1.0 });
    let volume = json!({ "thicknessFactor": 1.0 });
    let layers = [
        json!({ "KHR_materials_clearcoat": { "clearcoatFactor": 1.0 } }),
        json!({ "KHR_materials_sheen": { "sheenColorFactor": [1, 1, 1] } }),
        json!({ "KHR_materials_iridescence": { "iridescenceFactor": 1.0 } }),
        json!({ "KHR_materials_anisotropy": { "anisotropyStrength": 1.0 } }),
        json!({ "KHR_materials_specular": { "specularColorFactor": [1.0, 0.5, 0.0] } }),
    ];
    for mut extensions in layers {
        extensions["KHR_materials_transmission"] = transmission.clone();
        extensions["KHR_materials_ior"] = json!({ "ior": 1.25 });
        let (wall, warnings) = passage(&extensions, 0.25);
        assert!(matches!(wall.passage, Passage::Wall(Clear { fraction: 1.0, ior: 1.25 })), "{wall:?}");
        assert!((wall.metallic - 0.25).abs() < 2e-3 && warnings.is_empty(), "{wall:?} {warnings:?}");
        extensions["KHR_materials_volume"] = volume.clone();
        let (body, _) = passage(&extensions, 0.0);
        assert!(matches!(body.passage, Passage::Volume(Clear { fraction: 1.0, ior: 1.25 })), "{body:?}");
    }
}

#[test]
fn speculars_and_glossiness_are_converted() {
    let name = "KHR_materials_pbrSpecularGlossiness";
    let plain = json!({ name: {
        "diffuseFactor": [0.8, 0.4, 0.2, 1.0], "specularFactor": [0.9, 0.5, 0.1], "glossinessFactor": 0.75,
    } });
    let material = &loaded([255; 4], &plain).materials[0];
    let Bsdf::MetallicRoughness(b) = material.bsdf else { panic!("{:?}", material.bsdf) };
    assert_eq!((b.base_color, b.metallic, b.alpha), (Rgb::new(0.8, 0.4, 0.2), 0.0, 0.0625));
    assert_eq!((b.dielectric_f0, b.dielectric_f90), (Rgb::new(0.9, 0.5, 0.1), 1.0));
    let textured = json!({ name: {
        "specularFactor": [0.5, 1.0, 1.0], "glossinessFactor": 0.5, "specularGlossinessTexture": { "index": 0 },
    } });
    let loaded = loaded([255, 188, 0, 204], &textured);
    let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::splat(0.3));
    let p = loaded.materials[0].maps.as_ref().unwrap().parameters(&at);
    let expected = Rgb::new(0.5, srgb_to_linear(188.0 / 255.0), 0.0);
    assert!((Vec3::from(p.specular_color) - Vec3::from(expected)).length() < 1e-6, "{p:?}");
    assert!((p.roughness - (1.0 - 0.5 * 0.8)).abs() < 2e-3 && p.metallic == 0.0, "{p:?}");
}

#[test]
fn what_is_wrong_or_left_out_is_said_in_a_sentence() {
    let fails = |extensions: Value, pointer: &str| {
        let error = load(&textured(&one_texel([255; 4]), &json!({ "extensions": extensions }))).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(pointer) && !text.contains('\n'), "{text}");
    };
    let at = "/materials/0/extensions/KHR_materials_";
    fails(
        json!({ "KHR_materials_clearcoat": { "clearcoatFactor": "much" } }),
        &format!("{at}clearcoat/clearcoatFactor"),
    );
    fails(json!({ "KHR_materials_sheen": { "sheenColorFactor": [1.0, 2.0] } }), &format!("{at}sheen/sheenColorFactor"));
    fails(
        json!({ "KHR_materials_sheen": { "sheenColorTexture": { "index": 7 } } }),
        &format!("{at}sheen/sheenColorTexture"),
    );
    fails(
        json!({ "KHR_materials_clearcoat": { "clearcoatNormalTexture": 3 } }),
        &format!("{at}clearcoat/clearcoatNormalTexture"),
    );
    let glass = json!({
        "pbrMetallicRoughness": { "metallicFactor": 0.0 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1.0 },
            "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 1.0 },
        },
    });
    let warnings = load(&textured(&one_texel([255; 4]), &glass)).unwrap().warnings;
    assert!(warnings.iter().any(|w| w.contains("diffuse_transmission is not applied")), "{warnings:?}");
    let lamp = json!({
        "emissiveFactor": [0.0, 1.0, 0.0], "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 1.0 } },
    });
    let warnings = load(&textured(&one_texel([255; 4]), &lamp)).unwrap().warnings;
    assert!(warnings.is_empty(), "a coat darkens what is emitted below it: {warnings:?}");
}

#[test]
fn a_metal_is_found_by_its_symbol() {
    let metal = |name: Value| json!({ "PATHSPACE_materials_metal": { "name": name } });
    let of = |extensions: Value| {
        let material = json!({ "pbrMetallicRoughness": { "roughnessFactor": 0.5 }, "extensions": extensions });
        changed(triangle(), "/materials", json!([material]))
    };
    let loaded = load(&of(metal(json!("Cu")))).unwrap();
    let Bsdf::Layered(layered) = loaded.materials[0].bsdf else { panic!("{:?}", loaded.materials[0].bsdf) };
    let copper = loaded.materials[0].measured_metal().expect("a metal");
    assert_eq!((copper.symbol(), layered.surface().metallic), ("Cu", 1.0));
    assert!((layered.surface().alpha - 0.25).abs() < 1e-3 && loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let error = load(&of(metal(json!("Unobtainium")))).unwrap_err().to_string();
    let place = "/materials/0/extensions/PATHSPACE_materials_metal/name";
    assert!(error.contains(place) && error.contains("Unobtainium") && error.contains("Ag, Al, Au, Co, Cr"), "{error}");
    let error = load(&of(metal(json!(29)))).unwrap_err().to_string();
    assert!(error.contains(place) && error.contains("no name of a metal"), "{error}");
    let mut extensions = metal(json!("Ag"));
    extensions["KHR_materials_transmission"] = json!({ "transmissionFactor": 1.0 });
    let loaded = load(&of(extensions)).unwrap();
    assert_eq!(loaded.materials[0].measured_metal().map(|metal| metal.symbol()), Some("Ag"));
    assert!(loaded.warnings.iter().any(|w| w.contains("is a metal")), "{:?}", loaded.warnings);
}
