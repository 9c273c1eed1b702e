//! `EXT_lights_image_based`.

use std::{
    f64::consts::{PI, TAU},
    io::Cursor,
};

use ::image::{ExtendedColorType, ImageEncoder as _, codecs::png::PngEncoder};
use base64::{Engine as _, engine::general_purpose::STANDARD};
use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use super::{load, triangle};
use crate::{math::Rgb, scene::light::EnvironmentMap};

/// A PNG of `side`² texels of `channels` channels.
fn png(side: u32, channels: usize, texel: impl Fn(u32, u32) -> [u8; 4]) -> Value {
    let texels = (0..side * side).map(|i| texel(i % side, i / side));
    let bytes: Vec<u8> = texels.flat_map(|texel| texel.into_iter().take(channels)).collect();
    let mut file = Cursor::new(Vec::new());
    let kind = if channels == 4 { ExtendedColorType::Rgba8 } else { ExtendedColorType::Rgb8 };
    PngEncoder::new(&mut file).write_image(&bytes, side, side, kind).unwrap();
    json!({ "uri": format!("data:image/png;base64,{}", STANDARD.encode(file.into_inner())) })
}

/// The triangle with a light of these six images.
fn document(faces: [Value; 6], members: &Value) -> Value {
    let mut document = triangle();
    document["images"] = Value::Array(faces.into());
    document["scenes"][0]["extensions"] = json!({ "EXT_lights_image_based": { "light": 0 } });
    let mut light = json!({ "specularImages": [[0, 1, 2, 3, 4, 5]], "specularImageSize": 8,
        "irradianceCoefficients": vec![[0.0; 3]; 9] });
    for (name, value) in members.as_object().unwrap() {
        light[name] = value.clone();
    }
    document["extensions"] = json!({ "EXT_lights_image_based": { "lights": [light] } });
    document
}

fn map(document: &Value) -> EnvironmentMap {
    let loaded = load(document).unwrap();
    assert!(loaded.is_lit() && loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.environment.unwrap().to_map(1.0).unwrap()
}

/// The face `lit` white where `texel` says so, all else black.
fn one_face(lit: usize, texel: impl Fn(u32, u32) -> bool) -> [Value; 6] {
    let texel = |face, x, y| if face == lit && texel(x, y) { [255; 4] } else { [0, 0, 0, 255] };
    std::array::from_fn(|face| png(8, 3, |x, y| texel(face, x, y)))
}

#[test]
fn faces_are_what_one_sees_from_the_middle_of_the_cube() {
    // Towards the middle of each face, its right edge and its top.
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let faces = [[x, z, y], [-x, -z, y], [y, -x, -z], [-y, -x, z], [z, -x, y], [-z, x, y]];
    for (face, [towards, right, up]) in faces.into_iter().enumerate() {
        let whole = map(&document(one_face(face, |_, _| true), &json!({})));
        let quarter = map(&document(one_face(face, |x, y| x >= 4 && y < 4), &json!({})));
        // The sphere's sixth, by luminance.
        assert!((f64::from(whole.integral()) / (TAU / 3.0) - 1.0).abs() < 0.06, "{}", whole.integral());
        for (i, [other, ..]) in faces.into_iter().enumerate() {
            let expected = if i == face { Rgb::ONE } else { Rgb::ZERO };
            assert_eq!(whole.radiance(other), expected, "{face} from {other}");
        }
        for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let w = (towards + 0.5 * (a * right + b * up)).normalize();
            let found = quarter.radiance(w).r();
            let expected = f32::from(u8::from(a > 0.0 && b > 0.0));
            assert!((found - expected).abs() < 1e-3, "{face}: {found} towards {w}");
        }
        // A quarter turn about +y takes +z to +x.
        let turned = json!({ "rotation": [0, 0.5_f64.sqrt(), 0, 0.5_f64.sqrt()], "intensity": 3 });
        let turned = map(&document(one_face(face, |_, _| true), &turned));
        let now = Vec3::new(towards.z, towards.y, -towards.x);
        assert!((turned.radiance(now) - Rgb::splat(3.0)).abs().max_element() < 1e-5, "{face} from {now}");
    }
}

#[test]
fn a_constant_cube_has_the_irradiance_of_its_coefficients() {
    // 188 is 0.502 886 in sRGB, divided by 51/255.
    for (channels, radiance) in [(3, 0.502_886), (4, 5.0 * 0.502_886)] {
        let faces = std::array::from_fn(|_| png(4, channels, |_, _| [188, 188, 188, 51]));
        // E = π L is the first coefficient times Y_00 = 1/√4π.
        let coefficient = PI * radiance * (4.0 * PI).sqrt();
        let mut coefficients = vec![[0.0; 3]; 9];
        coefficients[0] = [coefficient; 3];
        let map = map(&document(faces, &json!({ "irradianceCoefficients": coefficients })));
        let normal = DVec3::new(0.48, -0.6, 0.64);
        let (n, mut irradiance) = (128, 0.0);
        for (i, j) in (0..n).flat_map(|i| (0..2 * n).map(move |j| (i, j))) {
            let (cos, phi) =
                (1.0 - (f64::from(i) + 0.5) * 2.0 / f64::from(n), (f64::from(j) + 0.5) * PI / f64::from(n));
            let sin = (1.0 - cos * cos).sqrt();
            let w = DVec3::new(sin * phi.cos(), cos, sin * phi.sin());
            let solid_angle = 2.0 * PI / f64::from(n * n);
            irradiance += f64::from(map.radiance(w.as_vec3()).r()) * w.dot(normal).max(0.0) * solid_angle;
        }
        let expected = coefficient / (4.0 * PI).sqrt();
        assert!((irradiance / expected - 1.0).abs() < 1e-3, "{irradiance} for {expected}");
    }
}

#[test]
fn a_map_has_four_times_the_width_of_a_face() {
    let loaded = load(&document(one_face(0, |_, _| true), &json!({}))).unwrap();
    assert_eq!(loaded.environment.unwrap().size(), (32, 16));
    // A single texel for each face, and black ones.
    let single = document(std::array::from_fn(|_| png(1, 3, |_, _| [255; 4])), &json!({}));
    assert!((map(&single).radiance(Vec3::Y) - Rgb::ONE).abs().max_element() < 1e-6);
    let loaded = load(&document(one_face(6, |_, _| true), &json!({}))).unwrap();
    assert!(loaded.environment.is_none() && !loaded.is_lit());
}

#[test]
fn a_broken_cube_is_said_to_be_in_one_sentence() {
    let faces = || one_face(0, |_, _| true);
    let mut sizes = faces();
    sizes[3] = png(4, 3, |_, _| [9; 4]);
    let dark = || std::array::from_fn(|_| png(2, 4, |_, _| [9, 9, 9, 0]));
    for (faces, members, says) in [
        (faces(), json!({ "specularImages": [[0, 1, 2, 3, 4]] }), "not the six images"),
        (faces(), json!({ "specularImages": [[0, 1, 2, 3, 4, "5"]] }), "not the number of an image"),
        (faces(), json!({ "specularImages": [[0, 1, 2, 3, 4, 9]] }), "the file has no such image"),
        (faces(), json!({ "intensity": -1 }), "not a number of at least 0"),
        (faces(), json!({ "rotation": [0, 0, 0] }), "no unit quaternion"),
        (sizes, json!({}), "differ in size"),
        (dark(), json!({}), "which is infinite or above 1e30"),
    ] {
        let error = load(&document(faces, &members)).unwrap_err().to_string();
        assert!(error.contains(says) && error.lines().count() == 1, "{says}: {error}");
    }
    let mut document = document(faces(), &json!({}));
    document["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = json!(7);
    assert!(load(&document).unwrap_err().to_string().contains("there is no such light"));
}
