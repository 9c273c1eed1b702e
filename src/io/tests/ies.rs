//! `EXT_lights_ies`.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use glam::{Mat3, Vec3};
use serde_json::{Value, json};

use super::{changed, load, triangle};
use crate::{
    io::{LoadError, Loaded, PunctualLight, ies},
    math::Rgb,
    scene::light::{Light, Profile},
};

/// A file with these angles, and intensities that count from 1, of each horizontal angle all vertical ones.
fn file(polar: &str, azimuths: &str) -> String {
    let count = |list: &str| list.split_whitespace().count();
    let (n, m) = (count(polar), count(azimuths));
    let values: Vec<_> = (1..=n * m).map(|value| value.to_string()).collect();
    let values = values.join("\n");
    format!(
        "IESNA:LM-63-2002\r\n[TEST] by hand\r\n[MANUFAC] Lümière\r\nTILT=NONE\r\n1 -1 2 {n} {m} 1 2 0 0 0\r\n\
         0.5 1 40\r\n{polar}\r\n{azimuths}\r\n{values}\r\n"
    )
}

fn read(file: &str) -> Result<Profile, String> {
    let mut warnings = Vec::new();
    let profile = ies::parse(file.as_bytes(), "/x", &mut warnings).map_err(|fault| fault.at("f").to_string())?;
    assert!(warnings.is_empty(), "{warnings:?}");
    Ok(profile.expect("light"))
}

/// Intensity at these angles, degrees.
fn at(profile: &Profile, theta: f32, phi: f32) -> f32 {
    let ((sin, cos), (y, x)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
    profile.intensity(Vec3::new(sin * x, sin * y, -cos))
}

fn document(light: Value, reference: Value) -> Value {
    let of = |value: Value| Value::Object([("EXT_lights_ies".to_owned(), value)].into_iter().collect());
    let document = changed(triangle(), "/nodes/0/extensions", of(reference));
    changed(
        document,
        "/extensions",
        of(Value::Object([("lights".to_owned(), Value::Array(vec![light]))].into_iter().collect())),
    )
}

fn uri(file: &str) -> Value {
    json!({ "uri": format!("data:application/x-ies-lm-63;base64,{}", STANDARD.encode(file)) })
}

fn loaded(document: &Value) -> Loaded {
    load(document).unwrap()
}

#[test]
fn horizontal_angles_are_continued_by_symmetry() {
    for (azimuths, equal) in [
        ("0", &[(0.0, 77.0, 1.0), (0.0, 200.0, 1.0)][..]),
        ("0 90", &[(0.0, 0.0, 1.0), (0.0, 90.0, 4.0), (0.0, 180.0, 1.0), (0.0, 270.0, 4.0), (0.0, 315.0, 2.5)]),
        ("0 60 180", &[(0.0, 60.0, 4.0), (0.0, 300.0, 4.0), (0.0, 180.0, 7.0)]),
        ("0 90 180 270 360", &[(0.0, 90.0, 4.0), (0.0, 270.0, 10.0), (0.0, 315.0, 11.5)]),
        // The last angle left out, and the plane of LM-63-1995.
        ("0 90 180 270", &[(0.0, 90.0, 4.0), (0.0, 270.0, 10.0), (0.0, 315.0, 5.5)]),
        ("90 180 270", &[(0.0, 90.0, 1.0), (0.0, 180.0, 4.0), (0.0, 0.0, 4.0), (0.0, 270.0, 7.0), (0.0, 45.0, 2.5)]),
    ] {
        let profile = read(&file("0 45 90", azimuths)).unwrap();
        for &(theta, phi, expected) in equal {
            // Next to the axis, where the azimuth still tells.
            let found = at(&profile, theta + 0.02, phi);
            assert!((found - expected).abs() < 0.01, "{azimuths} at {phi}°: {found} for {expected}");
        }
        assert_eq!(at(&profile, 91.0, 20.0), 0.0);
        assert!((at(&profile, 45.0, 0.0) - at(&profile, 0.02, 0.0) - 1.0).abs() < 0.01);
    }
}

#[test]
fn a_profile_stands_in_its_nodes_frame() {
    // Half a turn about x takes −z to +z and y to −y; twice the size does not matter.
    let reference = json!({ "light": 0, "multiplier": 3, "color": [1, 0.5, 0] });
    let mut document = document(uri(&file("0 90", "0 90 180 270 360")), reference);
    document["nodes"][0]["translation"] = json!([0, 5, 0]);
    document["nodes"][0]["rotation"] = json!([1, 0, 0, 0]);
    document["nodes"][0]["scale"] = json!([2, 2, 2]);
    let loaded = loaded(&document);
    let [PunctualLight::Profile { position, to_world, color, profile }] = &loaded.lights[..] else {
        panic!("{:?}", loaded.lights)
    };
    assert_eq!((*position, *color), (Vec3::new(0.0, 5.0, 0.0), Rgb::new(3.0, 1.5, 0.0)));
    assert!((*to_world - Mat3::from_diagonal(Vec3::new(1.0, -1.0, -1.0))).abs_diff_eq(Mat3::ZERO, 1e-6));
    assert_eq!(profile.peak(), 10.0);
    let Light::Goniometric(lamp) = loaded.lights[0].to_light() else { panic!() };
    // Straight on; and to the sides, where intensities are 2, 4, 6, 8 from +x towards the frame's +y, which is −y here.
    for (w, expected) in [(Vec3::Z, 0.0), (Vec3::X, 2.0), (Vec3::NEG_Y, 4.0), (Vec3::NEG_X, 6.0), (Vec3::Y, 8.0)] {
        let w = (w + 1e-4 * Vec3::Z).normalize();
        let found = lamp.intensity_towards(w);
        if expected > 0.0 {
            assert!((found - expected * *color).abs().max_element() < 0.01, "{w}: {found}");
        }
    }
    // A mirror turns the azimuth about.
    document["nodes"][0]["scale"] = json!([2, -2, 2]);
    let Light::Goniometric(lamp) = load(&document).unwrap().lights[0].to_light() else { panic!() };
    let found = lamp.intensity_towards((Vec3::Y + 1e-4 * Vec3::Z).normalize());
    assert!((found - 4.0 * *color).abs().max_element() < 0.01, "{found}");
    assert!(loaded.is_lit() && loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn profiles_lie_in_buffers_and_shine_for_several_nodes() {
    let text = file("0 90", "0");
    let mut document =
        document(json!({ "bufferView": 3, "mimeType": "application/x-ies-lm-63" }), json!({ "light": 0 }));
    let view = json!({ "buffer": 1, "byteLength": text.len() });
    document["bufferViews"].as_array_mut().unwrap().push(view);
    let buffer = json!({ "byteLength": text.len(), "uri": uri(&text)["uri"] });
    document["buffers"].as_array_mut().unwrap().push(buffer);
    document["nodes"] = json!([document["nodes"][0], { "extensions": { "EXT_lights_ies": { "light": 0 } } }]);
    document["scenes"] = json!([{ "nodes": [0, 1] }]);
    let lights = loaded(&document).lights;
    let [PunctualLight::Profile { profile: a, .. }, PunctualLight::Profile { profile: b, .. }] = &lights[..] else {
        panic!("{lights:?}")
    };
    assert!(std::sync::Arc::ptr_eq(a, b));
    // Dark ones are no lights, and tilts are said to be ignored.
    document["nodes"][1]["extensions"]["EXT_lights_ies"]["multiplier"] = json!(0);
    assert_eq!(loaded(&document).lights.len(), 1);
    let tilted = text.replace("TILT=NONE", "TILT=INCLUDE\r\n1 2 0,90 1,0.9");
    let warnings = load(&self::document(uri(&tilted), json!({ "light": 0 }))).unwrap().warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("TILT=“INCLUDE” is ignored"), "{warnings:?}");
}

#[test]
fn a_broken_profile_is_said_to_be_in_one_sentence() {
    let good = file("0 45 90", "0 90");
    for (from, to, says) in [
        ("TILT=NONE", "TLIT", "no line TILT="),
        ("1 -1 2", "1 -1 x", "the multiplier (number 3 after TILT) is “x”, not a number"),
        ("3 2 1 2", "0 2 1 2", "the number of vertical angles is 0"),
        ("3 2 1 2", "3600 3600 1 2", "3600 × 3600 intensities"),
        ("3 2 1 2", "3 2 2 2", "photometry is of type B, only C is read"),
        ("3 2 1 2", "3 2 9 2", "the type of photometry is 9"),
        ("0 45 90", "0 90 45", "the vertical angles do not rise"),
        ("0 90\r\n1", "0 80\r\n1", "run from 0 to 80"),
        ("\n6\r", "\n\r", "the file ends where an intensity should be"),
        ("\n4\n", "\n-4\n", "an intensity is -4e0 cd"),
    ] {
        let error = read(&good.replacen(from, to, 1)).unwrap_err();
        assert!(error.contains(says) && error.lines().count() == 1, "{to}: {error}");
    }
    let error = |light: Value, reference: Value| -> LoadError { load(&document(light, reference)).unwrap_err() };
    for (light, reference, says) in [
        (uri(&good), json!({ "light": 1 }), "there is no such light profile"),
        (uri(&good), json!({}), "not the number of a light profile"),
        (json!({}), json!({ "light": 0 }), "neither a URI nor a buffer view"),
        (json!({ "bufferView": 99 }), json!({ "light": 0 }), "there is no such buffer view"),
        (json!({ "uri": "nowhere.ies" }), json!({ "light": 0 }), "cannot read the light profile"),
        (uri(&good), json!({ "light": 0, "multiplier": -1 }), "not a number of at least 0"),
        (uri(&good), json!({ "light": 0, "multiplier": 1e30 }), "is the limit"),
        (uri(&good), json!({ "light": 0, "color": [1, 2, 1] }), "not a colour"),
    ] {
        let error = error(light, reference).to_string();
        assert!(error.contains(says) && error.lines().count() == 1, "{says}: {error}");
    }
}
