//! `cargo bench`: rays and samples per second by integrator, and error against time on the two caustic scenes.
//!
//! Rounds are interleaved, so that a noisy machine is fair to all, and every figure is the median of several. Compare
//! figures of one run only.

#![allow(clippy::print_stdout)] // the report of a benchmark

use std::{path::Path, time::Instant};

use pathspace::{
    film::{Image, half_image_rel_mse},
    integrator::IntegratorKind,
    io,
    render::{Renderer, Settings},
    scene::{Scene, camera::Sensor},
};

const KINDS: [IntegratorKind; 4] =
    [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt];
const ROUNDS: usize = 5;
const SENSOR: Sensor = Sensor { width: 128, height: 128, padding: 0 };

fn load(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("glb");
    let loaded = io::load(&path).unwrap_or_else(|e| panic!("{e}"));
    let c = loaded.cameras[0].clone();
    loaded.into_scene(c.to_camera(SENSOR), None)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Renders `spp` samples per pixel with a seed of its own; returns the renderer and the seconds.
fn render<'a>(scene: &'a Scene, settings: &'a Settings, spp: u32) -> (Renderer<'a>, f64) {
    let mut renderer = Renderer::new(scene, settings);
    let start = Instant::now();
    (0..spp).for_each(|_| renderer.pass());
    (renderer, start.elapsed().as_secs_f64())
}

fn throughput(name: &str) {
    let scene = load(name);
    println!("\n{name}: throughput, median of {ROUNDS} interleaved rounds");
    let mut figures = vec![Vec::new(); KINDS.len()];
    for round in 0..ROUNDS {
        for (kind, figures) in KINDS.into_iter().zip(&mut figures) {
            let settings = Settings { integrator: kind, seed: round as u64, ..Settings::new(SENSOR) };
            let (renderer, seconds) = render(&scene, &settings, 8);
            let samples = f64::from(SENSOR.pixels() * renderer.passes());
            figures.push((samples / seconds * 1e-6, renderer.statistics().rays.total() as f64 / seconds * 1e-6));
        }
    }
    for (kind, figures) in KINDS.into_iter().zip(figures) {
        let (samples, rays) = figures.into_iter().unzip();
        println!("  {kind:>7}  {:6.3} Msamples/s  {:6.2} Mrays/s", median(samples), median(rays));
    }
}

fn convergence(name: &str) {
    let scene = load(name);
    let reference = Settings { integrator: IntegratorKind::Bdpt, seed: 999, ..Settings::new(SENSOR) };
    let (renderer, _) = render(&scene, &reference, 512);
    let reference: Image = renderer.film().image(renderer.passes());
    println!("\n{name}: relMSE against bdpt at 512 spp, after so many seconds (median of {ROUNDS} interleaved rounds)");
    for spp in [4, 16, 64] {
        let mut figures = vec![Vec::new(); KINDS.len()];
        for round in 0..ROUNDS {
            for (kind, figures) in KINDS.into_iter().zip(&mut figures) {
                let settings = Settings { integrator: kind, seed: round as u64, ..Settings::new(SENSOR) };
                let (renderer, seconds) = render(&scene, &settings, spp);
                // (A − B)/2 over half images is an error of the mean; of an image and its reference it is half the
                // error.
                figures.push((seconds, 4.0 * half_image_rel_mse(&renderer.film().image(spp), &reference)));
            }
        }
        for (kind, figures) in KINDS.into_iter().zip(figures) {
            let (seconds, errors) = figures.into_iter().unzip();
            println!("  {kind:>7}  {spp:3} spp  {:7.2} s  relMSE {:.2e}", median(seconds), median(errors));
        }
    }
}

fn main() {
    throughput("cornell-box");
    throughput("veach-room");
    convergence("caustic-ring");
    convergence("caustic-sphere");
}
