//! The film's range: what an image shows does not depend on how bright a light is that nobody sees, nor on how near one
//! comes.
//!
//! Oracles are closed forms. They would catch deposits that are too small for the film's quantum, sums that are too
//! large for a word of it, and a quantum that follows the wrong light.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use pathspace::{
    film::{ExactSum, Film, Half},
    integrator::IntegratorKind,
    math::Rgb,
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::Geometry,
        light::{EnvironmentMap, Light},
        material::Material,
    },
};

use crate::{scenes, shards};

fn render<'a>(scene: &'a Scene, settings: &'a Settings, spp: u32) -> Renderer<'a> {
    let mut renderer = Renderer::new(scene, settings);
    (0..spp).for_each(|_| renderer.pass());
    let statistics = renderer.statistics();
    assert!(renderer.film().errors().is_empty() && statistics.rejected.is_empty(), "{:?}", statistics.rejected);
    renderer
}

fn mean(renderer: &Renderer<'_>) -> DVec3 {
    renderer.film().image(renderer.passes()).mean().as_dvec3()
}

/// The inside of a closed cube of this radiance, of which half is emitted; outside of it shine `lights`.
fn closed(radiance: f32, lights: &[Light], sensor: Sensor) -> Scene {
    let mut g = Geometry::default();
    scenes::cube_inside(&mut g, 1.0, [0; 6]);
    let wall = Material::diffuse("wall", Rgb::splat(0.5)).emitting(Rgb::splat(0.5 * radiance));
    let camera = Camera::look_at(Vec3::new(0.2, -0.1, 0.7), Vec3::new(-0.3, 0.2, -1.0), Vec3::Y, 1.2, sensor);
    Scene::new(g, vec![wall], lights, camera)
}

/// A sky with a single texel of a sun in it.
fn sun(radiance: f32) -> Light {
    let mut texels = vec![Rgb::splat(0.1); 64 * 32];
    texels[5 * 64 + 20] = Rgb::splat(radiance);
    Light::EnvironmentMap(Arc::new(EnvironmentMap::new(64, texels, 0.0).unwrap()))
}

#[test]
fn a_hidden_light_takes_nothing_from_what_is_seen() {
    let sensor = scenes::square(12, Filter::Box);
    let sky = |radiance| Light::Environment { radiance: Rgb::splat(radiance) };
    use IntegratorKind::{Bdpt, Hybrid, Path};
    for (radiance, outside) in [(1.2e-4, sun(1e8)), (1.2e-4, sun(1.6e9)), (2.0, sky(1e13)), (2.0, sky(1e30))] {
        let scene = closed(radiance, &[outside], sensor);
        for integrator in [Path, Hybrid, Bdpt] {
            let settings = Settings { integrator, max_depth: 12, ..Settings::new(sensor) };
            let found = mean(&render(&scene, &settings, 48)) / f64::from(radiance);
            println!("{integrator}: {found} of {radiance}");
            assert!((found - 1.0).abs().max_element() < 0.02, "{integrator}: {found} of {radiance}");
        }
    }
}

#[test]
fn no_light_is_too_near() {
    // A lamp 5 cm above the middle of a floor 2 km wide, of which a square of 4 cm is seen from above.
    let (height, half, albedo, intensity) = (0.05_f64, 0.02_f64, 0.8_f64, 1.0_f32);
    let sensor = scenes::square(2, Filter::Box);
    let mut g = Geometry::default();
    let v = |x: f32, z: f32| 1000.0 * Vec3::new(x, 0.0, z);
    scenes::quad(&mut g, [v(-1.0, -1.0), v(-1.0, 1.0), v(1.0, 1.0), v(1.0, -1.0)], 0);
    let floor = Material::diffuse("floor", Rgb::splat(albedo as f32));
    let lamp = Light::Point { position: Vec3::Y * height as f32, intensity: Rgb::splat(intensity) };
    let camera = Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::Z, 2.0 * half.atan() as f32, sensor);
    let scene = Scene::new(g, vec![floor], &[lamp], camera);
    // L = ρ/π · I h/d³, by the midpoint rule.
    let n = 200;
    let at = |i: i32| half * ((f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0);
    let radiance = |i, j| {
        let square = height * height + at(i).powi(2) + at(j).powi(2);
        albedo / std::f64::consts::PI * f64::from(intensity) * height / square.powf(1.5)
    };
    let expected = (0..n * n).map(|k| radiance(k % n, k / n)).sum::<f64>() / f64::from(n * n);
    // With so many standard errors of one sample, as light tracing hits the square once in 20 paths.
    for (integrator, noise) in [(IntegratorKind::Path, 0.4), (IntegratorKind::Bdpt, 0.4), (IntegratorKind::Light, 10.0)]
    {
        let settings = Settings { integrator, max_depth: 3, ..Settings::new(sensor) };
        for spp in [64, 1024, 8192_u32] {
            let found = mean(&render(&scene, &settings, spp)).x / expected - 1.0;
            println!("{integrator}, {spp} spp: {:+.2} %", 100.0 * found);
            let off = noise / f64::from(spp).sqrt();
            assert!(found.abs() < off, "{integrator}, {spp} spp: off by {found} of {expected}");
        }
    }
}

fn sums(film: &Film) -> Vec<ExactSum> {
    let channels = (0..film.pixels()).flat_map(|pixel| [0, 1, 2].map(|channel| (pixel, channel)));
    channels.flat_map(|(pixel, c)| [Half::Even, Half::Odd].map(|half| film.sum(half, pixel, c))).collect()
}

#[test]
fn shards_of_deposits_that_spill_are_the_whole() {
    let sensor = Sensor { width: 9, height: 7, padding: Filter::BlackmanHarris.padding() };
    let scene = closed(2.0, &[Light::Environment { radiance: Rgb::splat(1e30) }], sensor);
    let base = Settings { filter: Filter::BlackmanHarris, max_depth: 5, ..Settings::new(sensor) };
    for integrator in [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Bdpt, IntegratorKind::Vcm] {
        let settings = Settings { integrator, ..base.clone() };
        let whole = render(&scene, &settings, 6);
        assert!(whole.film().wide_memory() > 0, "{integrator}: nothing spills");
        let merged = Renderer::new(&scene, &settings);
        for passes in [4..6, 0..1, 1..4] {
            let mut shard = Renderer::new(&scene, &settings).starting_at(passes.start);
            passes.for_each(|_| shard.pass());
            shards::add(&shard, &merged, sensor, 6);
        }
        assert!(sums(merged.film()) == sums(whole.film()), "{integrator}");
        assert_eq!(merged.film().image(6), whole.film().image(6));
    }
}
