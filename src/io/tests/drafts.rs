//! Extensions that are drafts: read on request alone, and in place of those that they are to replace.

use glam::Vec2;
use image::{DynamicImage, ImageFormat, RgbaImage};

use super::{
    textures::{encoded, textured},
    *,
};
use crate::{
    io::Drafts,
    math::Rgb,
    scene::{
        bsdf::{Bsdf, Emission, SheenPlace, Surface},
        geometry::PrimitiveId,
        layers::Layers,
        texture::srgb_to_linear,
    },
};

fn with_drafts() -> LoadOptions<'static> {
    LoadOptions { drafts: Drafts::Read, ..LoadOptions::default() }
}

fn document(extensions: &Value) -> Value {
    let used: Vec<_> = extensions.as_object().unwrap().keys().cloned().collect();
    let material = json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0 }, "extensions": extensions });
    changed(changed(triangle(), "/materials", json!([material])), "/extensionsUsed", json!(used))
}

fn surface(extensions: &Value, options: &LoadOptions<'_>) -> (Surface, Vec<String>) {
    let loaded = load_as(&document(extensions), options).unwrap();
    let Bsdf::Layered(layered) = loaded.materials[0].bsdf else { panic!("{:?}", loaded.materials[0].bsdf) };
    (layered.surface(), loaded.warnings)
}

fn near(a: f32, b: f32) {
    assert!((a - b).abs() < 3e-3, "{a}, not {b}");
}

#[test]
fn a_coat_comes_in_place_of_a_clear_coat() {
    let extensions = json!({
        "KHR_materials_clearcoat": { "clearcoatFactor": 0.25 },
        "KHR_materials_coat": {
            "coatFactor": 0.5, "coatRoughnessFactor": 0.5, "coatIor": 1.8, "coatColorFactor": [0.25, 0.5, 1.0],
            "coatDarkeningFactor": 0.75,
        },
    });
    let (s, warnings) = surface(&extensions, &with_drafts());
    near(s.coat, 0.5);
    near(s.coat_alpha, 0.25);
    near(s.coat_f0, (0.8_f32 / 2.8).powi(2));
    near(s.coat_color.r(), 0.25);
    near(s.coat_darkening, 0.75);
    assert_eq!((s.emission, warnings), (Emission::OverAll, vec![]));
    let (s, warnings) = surface(&extensions, &LoadOptions::default());
    near(s.coat, 0.25);
    assert_eq!((s.coat_color, s.coat_darkening, s.emission), (Rgb::ONE, 0.0, Emission::UnderCoat));
    assert!(warnings.len() == 1 && warnings[0].contains("KHR_materials_coat") && warnings[0].contains("--drafts"));
    let brushed = json!({ "KHR_materials_coat": { "coatFactor": 1.0, "coatAnisotropyStrength": 0.5 } });
    let (s, warnings) = surface(&brushed, &with_drafts());
    near(s.coat_f0, 0.04);
    near(s.coat_darkening, 1.0);
    assert!(warnings[0].contains("anisotropy of its coat"), "{warnings:?}");
    let document = changed(document(&extensions), "/extensionsRequired", json!(["KHR_materials_coat"]));
    let error = load(&document).unwrap_err().to_string();
    assert!(error.contains("--drafts") && !error.contains('\n'), "{error}");
}

#[test]
fn fuzz_comes_in_place_of_sheen() {
    let extensions = json!({
        "KHR_materials_sheen": { "sheenColorFactor": [1.0, 1.0, 1.0], "sheenRoughnessFactor": 1.0 },
        "KHR_materials_fuzz": { "fuzzFactor": 0.5, "fuzzColorFactor": [0.0, 0.5, 0.0] },
    });
    let (s, _) = surface(&extensions, &with_drafts());
    let SheenPlace::OverAll { cover } = s.sheen_place else { panic!("{s:?}") };
    near(cover, 0.5);
    near(s.sheen.g(), 0.25);
    near(s.sheen.r(), 0.0);
    near(s.sheen_alpha, 0.25);
    let (s, _) = surface(&extensions, &LoadOptions::default());
    assert_eq!((s.sheen_place, s.sheen), (SheenPlace::UnderCoat, Rgb::ONE));
    let black = json!({ "KHR_materials_fuzz": { "fuzzFactor": 1.0, "fuzzColorFactor": [0.0, 0.0, 0.0] } });
    let (s, _) = surface(&black, &with_drafts());
    assert_eq!((s.sheen_place, s.sheen), (SheenPlace::OverAll { cover: 1.0 }, Rgb::ZERO));
}

/// The extension, its factor, its texture, which channel counts, how it is encoded, and where it arrives.
type Slot = (&'static str, &'static str, &'static str, usize, fn(f32) -> f32, fn(&Layers) -> f32);

const SLOTS: [Slot; 8] = [
    ("KHR_materials_coat", "coatFactor", "coatTexture", 0, |t| t, |l| l.coat),
    ("KHR_materials_coat", "coatRoughnessFactor", "coatRoughnessTexture", 1, |t| t, |l| l.coat_roughness),
    ("KHR_materials_coat", "coatColorFactor", "coatColorTexture", 1, srgb_to_linear, |l| {
        l.coating.map_or(-1.0, |coating| coating.color.g())
    }),
    ("KHR_materials_fuzz", "fuzzFactor", "fuzzTexture", 0, |t| t, |l| l.fuzz.unwrap_or(-1.0)),
    ("KHR_materials_fuzz", "fuzzColorFactor", "fuzzColorTexture", 2, srgb_to_linear, |l| l.sheen.b()),
    ("KHR_materials_fuzz", "fuzzRoughnessFactor", "fuzzRoughnessTexture", 3, |t| t, |l| l.sheen_roughness),
    (
        "KHR_materials_diffuse_roughness",
        "diffuseRoughnessFactor",
        "diffuseRoughnessTexture",
        0,
        |t| t,
        |l| l.diffuse_roughness,
    ),
    (
        "EXT_materials_diffuse_roughness",
        "diffuseRoughnessFactor",
        "diffuseRoughnessTexture",
        0,
        |t| t,
        |l| l.diffuse_roughness,
    ),
];

#[test]
fn each_texture_multiplies_its_factor() {
    for (extension, factor, texture, channel, decode, read) in SLOTS {
        for texel in [0_u8, 51, 255] {
            let mut texels = [255 - texel / 2; 4];
            texels[channel] = texel;
            let half = if factor.contains("Color") { json!([0.5, 0.5, 0.5]) } else { json!(0.5) };
            let mut members = json!({ "coatFactor": 1.0, "fuzzFactor": 1.0 });
            members[factor] = half;
            members[texture] = json!({ "index": 0 });
            let image =
                encoded(&DynamicImage::from(RgbaImage::from_pixel(1, 1, image::Rgba(texels))), ImageFormat::Png);
            let document = textured(&image, &json!({ "extensions": { extension: members } }));
            let loaded = load_as(&document, &with_drafts()).unwrap();
            let at = loaded.geometry.attributes(PrimitiveId::world(0), Vec2::splat(0.3));
            let found = read(&loaded.materials[0].maps.as_ref().expect("it has a texture").parameters(&at).layers);
            let expected = 0.5 * decode(f32::from(texel) / 255.0);
            assert!((found - expected).abs() < 1e-5, "{texture}, {texel}: {found}, not {expected}");
            let plain = load(&document).unwrap();
            assert!(plain.materials[0].maps.as_ref().is_none_or(|maps| !maps.factors.layers.are_there()));
        }
    }
}
