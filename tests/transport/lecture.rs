//! The lecture's first integrators, directional and light-area sampling, against bidirectional path tracing.

use pathspace::{
    integrator::{Integrator, IntegratorKind},
    math::Rgb,
    path::{JoinedPath, Roulette},
    render::Settings,
    sampling::Filter,
    scene::{Scene, bsdf::Directions, light::Light},
};

use crate::{
    agreement::{DEPTH, Run, VISIBLE, assert_agree, settings, with_the_first},
    scenes,
};

fn sampling(rule: Directions, settings: Vec<Settings>) -> Vec<Settings> {
    settings.into_iter().map(|s| Settings { hemisphere: rule, seed: s.seed + 50, ..s }).collect()
}

#[test]
fn directional_and_light_area_sampling_find_what_bdpt_finds() {
    let scene = scenes::courtyard(&[], scenes::square(16, Filter::Box));
    let everything = |_: &JoinedPath| true;
    let hemisphere = settings(&scene, IntegratorKind::PathHemisphere, 0);
    let variants = [
        ("bdpt", settings(&scene, IntegratorKind::Bdpt, 0)),
        ("uniform hemisphere", sampling(Directions::Uniform, hemisphere.clone())),
        ("path-hemisphere", hemisphere),
        ("path-light", settings(&scene, IntegratorKind::PathLight, 0)),
    ];
    let mut runs = variants.each_ref().map(|(name, settings)| Run::new(&scene, settings, name, &everything));
    assert_agree("courtyard", VISIBLE, &mut runs, &with_the_first(4));
}

/// A point light is the part of the image that directional sampling does not cover, and light-area sampling does.
#[test]
fn directional_sampling_misses_exactly_the_lights_without_extent() {
    let lamp = Light::Point { position: glam::Vec3::new(-0.5, 0.3, 0.4), intensity: Rgb::new(0.5, 0.6, 0.9) };
    let scene: Scene = scenes::courtyard(&[lamp], scenes::square(16, Filter::Box));
    let sensor = scene.camera.sensor();
    let table =
        Integrator::new(IntegratorKind::PathHemisphere, sensor, DEPTH, Roulette::Off).with_directions(Directions::Bsdf);
    let (everything, covered) = (|_: &JoinedPath| true, |path: &JoinedPath| table.covers(path));
    let all = [IntegratorKind::PathHemisphere, IntegratorKind::PathLight, IntegratorKind::Path];
    let all = all.map(|kind| settings(&scene, kind, 2));
    let mut runs = [
        Run::new(&scene, &all[0], "path-hemisphere", &everything),
        Run::new(&scene, &all[1], "path-light where covered", &covered),
        Run::new(&scene, &all[1], "path-light", &everything),
        Run::new(&scene, &all[2], "path", &everything),
    ];
    let pairs = [[vec![0], vec![1]], [vec![2], vec![3]]];
    assert_agree("courtyard with a point light", VISIBLE, &mut runs, &pairs);
    let missing = 1.0 - runs[1].estimate().image_mean() / runs[2].estimate().image_mean();
    println!("  the point light is {:.1} % of the image", 100.0 * missing);
    assert!(missing > 0.02);
}
