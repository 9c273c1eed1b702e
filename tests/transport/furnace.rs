//! A closed furnace: L = L_e Σ_k a^k, path length by path length.

use pathspace::{
    integrator::IntegratorKind,
    path::{Densities, Roulette},
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{Scene, bsdf::Directions},
    statistics::{Estimate, regions},
};

use crate::scenes;

const ALBEDO: f64 = 0.5;

/// K^i L_e is L_e a^i everywhere: every path length of every integrator has its own closed form.
#[test]
fn every_path_length_has_its_power_of_the_albedo() {
    let scene = scenes::furnace(ALBEDO as f32, 1.0, scenes::square(16, Filter::Box));
    let kinds = scenes::WEIGHTED.into_iter().chain([IntegratorKind::PathHemisphere]);
    assert_furnace(&scene, kinds.map(|kind| (kind, Directions::Bsdf, 6)));
    assert_furnace(&scene, [(IntegratorKind::PathHemisphere, Directions::Uniform, 4)]);
}

/// Inside a sphere G is the same between any two points, 1/(4R²): the one closed room in which unweighted connections have a
/// variance, and none at that.
#[test]
fn every_path_length_has_its_power_of_the_albedo_in_a_sphere() {
    let scene = scenes::sphere_furnace(ALBEDO as f32, 1.0, scenes::square(16, Filter::Box));
    assert_furnace(&scene, IntegratorKind::ALL.map(|kind| (kind, Directions::Bsdf, 4)));
}

/// Holds each integrator, with its rule for directions, to L_e a^(n−1) for the lengths n up to the given one.
fn assert_furnace(scene: &Scene, integrators: impl IntoIterator<Item = (IntegratorKind, Directions, u32)>) {
    for (kind, hemisphere, depth) in integrators {
        for n in 1..=depth {
            let settings = Settings {
                integrator: kind,
                hemisphere,
                max_depth: depth,
                roulette: Roulette::FromDepth(2),
                ..Settings::new(scene.camera.sensor())
            };
            let replicates: Vec<_> = (0..12)
                .map(|seed| {
                    let settings = Settings { seed, ..settings.clone() };
                    let mut renderer = Renderer::new(scene, &settings);
                    (0..24).for_each(|_| renderer.pass_where(&|path| path.edges() == n));
                    regions(&renderer.film().image(renderer.passes()))
                })
                .collect();
            let estimate = Estimate::new(&replicates);
            let expected = ALBEDO.powi(n as i32 - 1);
            let p = estimate.p_of_mean(expected);
            println!(
                "{kind} {hemisphere:?} n = {n}: {:.5}, expected {expected:.5}, p = {p:.2e}",
                estimate.image_mean()
            );
            assert!(p > 1e-4, "{kind} n = {n}: {} instead of {expected}", estimate.image_mean());
            assert!((estimate.image_mean() / expected - 1.0).abs() < 0.03);
        }
    }
}
