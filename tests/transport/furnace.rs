//! A closed furnace: L = L_e Σ_k a^k, path length by path length.

use pathspace::{
    integrator::IntegratorKind,
    path::{Densities, Roulette},
    render::{Renderer, Settings},
    sampling::Filter,
};

use crate::{
    scenes,
    statistics::{Estimate, regions},
};

/// K^i L_e is L_e a^i everywhere: every path length of every integrator has its own closed form.
#[test]
fn every_path_length_has_its_power_of_the_albedo() {
    let (albedo, depth) = (0.5_f64, 6);
    let scene = scenes::furnace(albedo as f32, 1.0, scenes::square(16, Filter::Box));
    for kind in IntegratorKind::ALL {
        for n in 1..=depth {
            let settings = Settings {
                integrator: kind,
                max_depth: depth,
                roulette: Roulette::FromDepth(2),
                ..Settings::new(scene.camera.sensor())
            };
            let replicates: Vec<_> = (0..12)
                .map(|seed| {
                    let settings = Settings { seed, ..settings.clone() };
                    let mut renderer = Renderer::new(&scene, &settings);
                    (0..24).for_each(|_| renderer.pass_where(&|path| path.edges() == n));
                    regions(&renderer.film().image(renderer.passes()))
                })
                .collect();
            let estimate = Estimate::new(&replicates);
            let expected = albedo.powi(n as i32 - 1);
            let p = estimate.p_of_mean(expected);
            println!("{kind} n = {n}: {:.5}, expected {expected:.5}, p = {p:.2e}", estimate.image_mean());
            assert!(p > 1e-4, "{kind} n = {n}: {} instead of {expected}", estimate.image_mean());
            assert!((estimate.image_mean() / expected - 1.0).abs() < 0.03);
        }
    }
}
