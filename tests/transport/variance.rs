//! Weights that know their noise: any factors leave the image as it is, and the pilot's are what a brute force says.

use std::sync::Arc;

use pathspace::{
    integrator::{Integrator, IntegratorKind, Weighting, Weights},
    lanes::One,
    math::luminance,
    path::{Roulette, Strategy, VarianceFactors},
    render::{Renderer, Settings},
    sampling::{Filter, SamplerKind},
    scene::camera::Sensor,
};

use crate::{
    exactness::render,
    identity,
    options::{Variant, assert_same_image, courtyard},
    scenes,
};

const HIT: Strategy = Strategy { s: 0, t: 3 };
const NEXT_EVENT: Strategy = Strategy { s: 1, t: 2 };

#[test]
fn every_path_is_as_defined_by_any_factors() {
    let scene = scenes::zoo(scenes::square(40, Filter::BlackmanHarris));
    let factors = Arc::new(VarianceFactors::new(2, vec![[1.0, 7.0], [9.0, 1.0], [3.0, 40.0], [1.0, 2.0]]));
    for kind in [IntegratorKind::Path, IntegratorKind::Hybrid, IntegratorKind::Bdpt, IntegratorKind::Vcm] {
        let integrator = Integrator::new(kind, scene.camera.sensor(), 5, Roulette::FromDepth(3)).merging_within(0.02);
        let integrator = integrator.with_variance_factors(&factors);
        identity::assert_identity_of(&format!("zoo {kind} by factors"), &scene, integrator, 2);
    }
}

#[test]
fn no_image_changes() {
    let scene = courtyard();
    for kind in [IntegratorKind::Path, IntegratorKind::Hybrid, IntegratorKind::Bdpt] {
        let variants = [Weights::Plain, Weights::VarianceAware]
            .map(|weights| Variant::new(weights.name(), &scene, kind, move |settings| settings.weights = weights));
        assert_same_image(&format!("courtyard-{kind}-weights"), &variants);
    }
}

/// The mean of one strategy's luminance at the pixels of the pilot, and the variance of the mean of 16 samples.
fn moments(settings: &Settings, seeds: u64) -> Vec<[f64; 2]> {
    let scene = scenes::load("cornell-box", settings_sensor());
    let images: Vec<_> =
        (0..seeds).map(|seed| render(&scene, &Settings { seed: 1000 + seed, ..settings.clone() }, 16)).collect();
    let places = (8..SIDE).step_by(16).flat_map(|y| (8..SIDE).step_by(16).map(move |x| (x, y)));
    let of_pixel = |(x, y)| {
        let values: Vec<_> = images.iter().map(|image| f64::from(luminance(image.get(x, y)))).collect();
        let mean = values.iter().sum::<f64>() / seeds as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (seeds - 1) as f64;
        [mean, variance]
    };
    places.map(of_pixel).collect()
}

/// Three tiles, so that the factors of the middle one are those of all.
const SIDE: u32 = 3 * VarianceFactors::SIDE;

fn settings_sensor() -> Sensor {
    scenes::square(SIDE, Filter::Box)
}

/// From independent numbers σ²_N = (m₂ − m₁²)/N, so that they and the even ones give v = m₂/(N σ²_N) without the pilot.
#[test]
fn the_pilot_measures_what_many_renders_show() {
    const SEEDS: u64 = 32;
    let integrator = IntegratorKind::Bdpt;
    let base = Settings { integrator, max_depth: 2, min_depth: 2, ..Settings::new(settings_sensor()) };
    let scene = scenes::load("cornell-box", settings_sensor());
    let aware = |sampler| Settings { weights: Weights::VarianceAware, sampler, ..base.clone() };
    let middle = [SIDE as f32 / 2.0; 2];
    // The lamp is small: what hits it is as rare as if no number knew of the others.
    for (strategy, at_least) in [(HIT, 1.0), (NEXT_EVENT, 3.0)] {
        let alone = |sampler| Settings { only: Some((strategy, Weighting::Unweighted)), sampler, ..base.clone() };
        let independent = moments(&alone(SamplerKind::Independent), SEEDS);
        let even = moments(&alone(SamplerKind::Sobol), SEEDS);
        let second: f64 = independent.iter().map(|[mean, variance]| variance + mean * mean / 16.0).sum();
        let expected = second / even.iter().map(|x| x[1]).sum::<f64>();
        // What one pilot says hangs on the few pixels with most of the variance, which is in 1/v.
        let of = |sampler| {
            let one = |seed: u64| {
                let settings = Settings { seed, ..aware(sampler) };
                let renderer = Renderer::new(&scene, &settings);
                let factors = renderer.integrator().techniques().variance_factors().expect("a pilot was made");
                1.0 / f64::from(factors.of(One, strategy, middle))
            };
            SEEDS as f64 / (0..SEEDS).map(one).sum::<f64>()
        };
        let measured = of(SamplerKind::Sobol);
        println!("{strategy}: v = {measured:.2}, {expected:.2} by many renders");
        assert!(measured >= at_least && (measured / expected).ln().abs() < 0.4, "{strategy}: {measured} {expected}");
        let without = second / independent.iter().map(|x| x[1]).sum::<f64>();
        let measured = of(SamplerKind::Independent);
        assert!((measured / without).ln().abs() < 0.4, "{strategy}, independent: {measured} {without}");
    }
}
