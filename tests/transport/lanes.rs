//! Lanes: the same bytes for one path at a time and for waves of paths in eight lanes or sixteen.

use std::path::Path;

use glam::Vec3;
use pathspace::{
    film::{ExactSum, Half},
    integrator::IntegratorKind,
    math::Rgb,
    render::{Renderer, Settings, Statistics, Width},
    sampling::{Filter, SamplerKind},
    scene::{
        Scene,
        camera::Sensor,
        light::{Light, LightChoice},
    },
};

use crate::scenes;

/// Every sum of a film of three passes, with what was counted; `None` if the processor has no such lanes.
fn film(scene: &Scene, settings: &Settings, width: Width) -> Option<(Vec<ExactSum>, Statistics)> {
    let mut renderer = Renderer::new(scene, settings).with_width(width)?;
    (0..3).for_each(|_| renderer.pass());
    let film = renderer.film();
    let halves = [Half::Even, Half::Odd].into_iter();
    let pixels = halves.flat_map(|half| (0..film.pixels()).map(move |pixel| (half, pixel)));
    let sums = pixels.flat_map(|(half, pixel)| [0, 1, 2].map(|channel| film.sum(half, pixel, channel)));
    Some((sums.collect(), renderer.statistics()))
}

fn assert_widths_do_not_matter(name: &str, scene: &Scene, settings: &Settings) {
    let one = film(scene, settings, Width::One).expect("one lane");
    for width in [Width::Eight, Width::Sixteen] {
        match film(scene, settings, width) {
            Some(film) => assert!(film == one, "{name}, {}: {width:?} lanes", settings.integrator),
            None => eprintln!("SKIPPED: this processor has no {width:?} lanes"),
        }
    }
}

/// Not a multiple of a tile, nor of a group of lanes.
const SENSOR: Sensor = Sensor { width: 45, height: 37, padding: 0 };

fn settings(integrator: IntegratorKind) -> Settings {
    let roulette = integrator.description().roulette;
    Settings { integrator, sampler: SamplerKind::Sobol, roulette, ..Settings::new(SENSOR) }
}

#[test]
fn any_number_of_lanes_gives_the_same_bytes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = std::fs::read_dir(folder).expect("the scenes").map(|entry| entry.expect("an entry").path());
    let files: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "glb")).collect();
    assert!(files.len() > 10);
    for file in files {
        let scene = scenes::load_file(&file, SENSOR);
        for integrator in IntegratorKind::ALL {
            assert_widths_do_not_matter(&file.display().to_string(), &scene, &settings(integrator));
        }
    }
}

#[test]
fn whatever_is_in_the_scene() {
    let sun = Light::Directional { towards: Vec3::new(0.3, 1.0, 0.4).normalize(), irradiance: Rgb::splat(2.0) };
    let sky = Light::Environment { radiance: Rgb::new(0.2, 0.3, 0.5) };
    let lamp = Light::Point { position: Vec3::new(0.5, 1.5, 0.5), intensity: Rgb::splat(3.0) };
    let lights = [sun, sky, lamp];
    let all = [
        ("zoo", scenes::zoo(SENSOR)),
        ("open zoo", scenes::open_zoo(SENSOR)),
        ("veiled", scenes::veiled(SENSOR)),
        ("courtyard", scenes::courtyard(&lights, SENSOR)),
        ("courtyard by tree", scenes::courtyard(&lights, SENSOR).choosing_lights(LightChoice::Tree)),
        ("courtyard, each light", scenes::courtyard(&lights, SENSOR).choosing_lights(LightChoice::All)),
        ("sphere furnace", scenes::sphere_furnace(0.7, 1.0, SENSOR)),
    ];
    for (name, scene) in &all {
        for integrator in IntegratorKind::ALL {
            assert_widths_do_not_matter(name, scene, &settings(integrator));
        }
    }
}

#[test]
fn whatever_the_render_is_asked_for() {
    let filter = Filter::BlackmanHarris;
    let padded = Sensor { padding: filter.padding(), ..SENSOR };
    let scene = scenes::open_zoo(padded);
    let plain = Settings { sampler: SamplerKind::Sobol, ..Settings::new(padded) };
    for integrator in [IntegratorKind::Path, IntegratorKind::PathHemisphere] {
        let plain = Settings { integrator, filter, ..plain.clone() };
        let crop = pathspace::film::Crop { x0: 9, y0: 17, x1: 30, y1: 37 };
        for settings in [
            plain.clone(),
            Settings { crop, ..plain.clone() },
            Settings { light_samples: 3, ..plain.clone() },
            Settings { max_depth: 3, min_depth: 2, clamp: Some(0.5), ..plain.clone() },
            Settings { roulette: pathspace::path::Roulette::ByThroughput(2), ..plain.clone() },
            Settings { hemisphere: pathspace::scene::bsdf::Directions::Uniform, seed: 9, ..plain.clone() },
        ] {
            assert_widths_do_not_matter("open zoo", &scene, &settings);
        }
    }
}
