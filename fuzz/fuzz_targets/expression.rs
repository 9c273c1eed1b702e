//! Any text as a light path expression: compiled and matched, or refused in one line.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use pathspace::{
    layers::{Expression, Tags},
    math::Rgb,
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::Geometry,
        material::Material,
    },
};

/// A scene of two materials whose names are in the seeds.
static SCENE: LazyLock<Scene> = LazyLock::new(|| {
    let camera = Camera::look_at([0.0, 0.0, 1.0].into(), [0.0; 3].into(), [0.0, 1.0, 0.0].into(), 1.0, SENSOR);
    let materials = ["wall", "glass"].map(|name| Material::diffuse(name, Rgb::ONE));
    Scene::new(Geometry::default(), materials.to_vec(), &[], camera)
});

const SENSOR: Sensor = Sensor { width: 1, height: 1, padding: 0 };

fuzz_target!(|text: &str| {
    let refused = |error: &dyn std::fmt::Display| assert!(!error.to_string().contains(char::is_control), "{error}");
    let expression = match Expression::parse(text) {
        Ok(expression) => expression,
        Err(error) => return refused(&error),
    };
    match Tags::new(expression.names(), &SCENE) {
        Ok(tags) => match expression.compile(&tags) {
            // Any symbols make a path as far as an automaton is concerned.
            Ok(matcher) => std::hint::black_box(matcher.matches(text.as_bytes())),
            Err(error) => return refused(&error),
        },
        Err(error) => return refused(&error),
    };
});
