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
    agreement::{DEPTH, Run, assert_agree, settings},
    scenes,
};

/// Below the bias that a comparison must be able to see, by as much as two such estimates need: 2 · 0.006² < 0.01².
const REFINED: f64 = 0.006;
/// Uniform directions find highlights late. The others leave them most of the budget: 0.009² + 0.004² < 0.01².
const COARSE: f64 = 0.009;
const FINE: f64 = 0.004;

fn sampling(rule: Directions, settings: Vec<Settings>) -> Vec<Settings> {
    settings.into_iter().map(|s| Settings { hemisphere: rule, seed: s.seed + 50, ..s }).collect()
}

fn assert_all_agree(scene: &str, runs: &[&Run<'_>]) {
    let images = || runs.iter().map(|r| (r.name.clone(), r.image())).collect::<Vec<_>>();
    for (i, a) in runs.iter().enumerate() {
        for b in &runs[i + 1..] {
            assert_agree(scene, (&a.name, &a.estimate()), (&b.name, &b.estimate()), images);
        }
    }
}

#[test]
fn directional_and_light_area_sampling_find_what_bdpt_finds() {
    let scene = scenes::courtyard(&[], scenes::square(16, Filter::Box));
    let everything = |_: &JoinedPath| true;
    let hemisphere = settings(&scene, IntegratorKind::PathHemisphere, 0);
    let variants = [
        ("uniform hemisphere", sampling(Directions::Uniform, hemisphere.clone()), COARSE),
        ("path-hemisphere", hemisphere, REFINED),
        ("path-light", settings(&scene, IntegratorKind::PathLight, 0), REFINED),
        ("bdpt", settings(&scene, IntegratorKind::Bdpt, 0), FINE),
    ];
    let runs: Vec<_> = variants
        .iter()
        .map(|(name, settings, refined)| Run::new(&scene, settings, name, &everything).converge(*refined))
        .collect();
    let (bdpt, others) = runs.split_last().expect("four runs");
    for run in others {
        assert_all_agree("courtyard", &[run, bdpt]);
    }
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
    let runs = [
        Run::new(&scene, &all[0], "path-hemisphere", &everything).converge(REFINED),
        Run::new(&scene, &all[1], "path-light where covered", &covered).converge(REFINED),
    ];
    assert_all_agree("courtyard with a point light", &runs.each_ref());
    let whole = [
        Run::new(&scene, &all[1], "path-light", &everything).converge(REFINED),
        Run::new(&scene, &all[2], "path", &everything).converge(REFINED),
    ];
    assert_all_agree("courtyard with a point light", &whole.each_ref());
    let missing = 1.0 - runs[1].estimate().image_mean() / whole[0].estimate().image_mean();
    println!("  the point light is {:.1} % of the image", 100.0 * missing);
    assert!(missing > 0.02);
}
