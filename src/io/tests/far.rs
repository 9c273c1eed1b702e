//! Scenes far from their file's origin.

use super::*;
use crate::{
    film::Image,
    integrator::IntegratorKind,
    render::{Renderer, Settings},
    scene::{camera::Sensor, light::Light},
};

/// A ball, a triangle whose parent is far away, a lamp and a camera, moved by `offset`.
fn scene(offset: DVec3) -> Value {
    let at = |x: f64, y: f64, z: f64| json!([x + offset.x, y + offset.y, z + offset.z]);
    let mut document = triangle();
    document["nodes"] = json!([
        { "translation": at(-1.3, -1.2, 0.1), "children": [1] },
        { "mesh": 0, "scale": [3, 3, 3] },
        { "translation": at(0.3, 0.1, 0.7), "extensions": { "PATHSPACE_sphere": { "radius": 0.5, "material": 0 } } },
        { "translation": at(0.7, 1.1, 3.3), "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "translation": at(0.0, 0.0, 5.0), "camera": 0 },
    ]);
    document["materials"] = json!([{ "emissiveFactor": [1, 1, 1] }]);
    document["scenes"][0]["nodes"] = json!([0, 2, 3, 4]);
    document["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]);
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 30.0 }] } });
    document["extensionsUsed"] = json!(["KHR_lights_punctual", "PATHSPACE_sphere"]);
    document
}

fn render(loaded: &Loaded, integrator: IntegratorKind) -> Image {
    let camera = loaded.cameras[0].to_camera(Sensor { width: 16, height: 16, padding: 0 });
    let sky = Light::Environment { radiance: crate::math::Rgb::ONE };
    let scene = loaded.clone().into_scene(camera, Some(sky));
    let settings = Settings { integrator, max_depth: 4, ..Settings::new(scene.camera.sensor()) };
    let mut renderer = Renderer::new(&scene, &settings);
    (0..16).for_each(|_| renderer.pass());
    renderer.film().image(16)
}

#[test]
fn a_scene_looks_alike_wherever_it_lies() {
    let near = load(&scene(DVec3::ZERO)).unwrap();
    assert_eq!(near.centre, DVec3::ZERO);
    for offset in [DVec3::new(1e5, -1e5, 1e5), DVec3::new(-3_761_603.743_620_786, 4_105_279.007_277_16, 3_870_314.849)]
    {
        let far = load(&scene(offset)).unwrap();
        assert!((far.centre - offset).length() < 4.0 && far.warnings == near.warnings, "{}", far.centre);
        let eye = far.centre + far.cameras[0].position.as_dvec3();
        assert!((eye - offset - DVec3::Z * 5.0).length() < 1e-6, "{eye}");
        for integrator in IntegratorKind::ALL {
            let [a, b] = [&near, &far].map(|loaded| render(loaded, integrator));
            let whole: f32 = a.pixels.iter().map(|p| p.abs().element_sum()).sum();
            let off: f32 = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).abs().element_sum()).sum();
            assert!(whole > 0.0 && off < 0.01 * whole, "{} at {offset}: {off} of {whole}", integrator.name());
        }
    }
}

/// What a parent far away and its child's way back come to is where the child lies, and nothing needs another centre.
#[test]
fn translations_that_cancel_leave_their_difference() {
    let near = scene(DVec3::ZERO);
    let wanted = load(&near).unwrap();
    for away in [DVec3::new(4e6 + 1.0 / 3.0, -4e6 - 0.7, 1e5 + 0.1), DVec3::new(-3_761_603.743_620_786, 77_777.77, 0.3)]
    {
        let mut document = near.clone();
        let own = DVec3::new(-1.3, -1.2, 0.1);
        document["nodes"][0]["translation"] = json!((own + away).to_array());
        document["nodes"][1]["translation"] = json!((-away).to_array());
        let found = load(&document).unwrap();
        assert_eq!((found.centre, &found.warnings), (DVec3::ZERO, &wanted.warnings));
        let [a, b] = [&wanted, &found].map(|loaded| loaded.geometry.bounds().unwrap());
        let off = (a.min - b.min).abs().max((a.max - b.max).abs()).max_element();
        assert!(off < 1e-6, "{off} m by {away}: {b:?}");
    }
}

#[test]
fn a_scene_that_is_larger_than_f32_holds_says_so() {
    let mut document = scene(DVec3::ZERO);
    document["nodes"][2]["translation"] = json!([4e6, 0.0, 0.0]);
    let warnings = load(&document).unwrap().warnings;
    assert!(warnings.iter().any(|w| w.contains("places are known to") && w.contains("4.")), "{warnings:?}");
}
