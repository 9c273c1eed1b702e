//! `cargo bench`: samples per second by integrator and by how many paths are computed at once, and error against time
//! on the two caustic scenes. `cargo bench --bench speed -- SCENE…` measures the samples per second of other files.
//!
//! Rounds are interleaved, so that a noisy machine is fair to all, and every figure is the median of several. Compare
//! figures of one run only.

#![allow(clippy::print_stdout)] // the report of a benchmark

use std::{
    env,
    path::{Path, PathBuf},
    time::Instant,
};

use pathspace::{
    film::{Image, half_image_rel_mse},
    integrator::IntegratorKind,
    io,
    render::{Renderer, Settings, Width},
    scene::{Scene, camera::Sensor},
};

const KINDS: [IntegratorKind; 4] =
    [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt];
const WIDTHS: [Width; 3] = [Width::One, Width::Eight, Width::Sixteen];
const ROUNDS: usize = 5;
const SENSOR: Sensor = Sensor { width: 128, height: 128, padding: 0 };

fn ours(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("glb")
}

fn load(file: &Path) -> Scene {
    let loaded = io::load(file).unwrap_or_else(|e| panic!("{e}"));
    let c = loaded.cameras[0].clone();
    loaded.into_scene(c.to_camera(SENSOR), None)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Renders `spp` samples per pixel with a seed of its own; returns the renderer and the seconds.
fn render<'a>(scene: &'a Scene, settings: &'a Settings, spp: u32) -> (Renderer<'a>, f64) {
    passes(Renderer::new(scene, settings), spp)
}

fn passes(mut renderer: Renderer<'_>, spp: u32) -> (Renderer<'_>, f64) {
    let start = Instant::now();
    (0..spp).for_each(|_| renderer.pass());
    (renderer, start.elapsed().as_secs_f64())
}

fn throughput(file: &Path) {
    let scene = load(file);
    println!("\n{}: million samples per second, median of {ROUNDS} interleaved rounds", file.display());
    let mut figures = vec![[Vec::new(), Vec::new(), Vec::new()]; KINDS.len()];
    for round in 0..ROUNDS {
        for (kind, figures) in KINDS.into_iter().zip(&mut figures) {
            let settings = Settings { integrator: kind, seed: round as u64, ..Settings::new(SENSOR) };
            for (width, figures) in WIDTHS.into_iter().zip(figures) {
                // Processors have no lanes of some widths.
                let Some(renderer) = Renderer::new(&scene, &settings).with_width(width) else { continue };
                let (renderer, seconds) = passes(renderer, 8);
                figures.push(f64::from(SENSOR.pixels() * renderer.passes()) / seconds * 1e-6);
            }
        }
    }
    println!("  {:>7}  {:>7}  {:>7}  {:>7}", "", "one", "eight", "sixteen");
    for (kind, figures) in KINDS.into_iter().zip(figures) {
        let [one, eight, sixteen] =
            figures.map(|x| if x.is_empty() { "–".to_owned() } else { format!("{:.3}", median(x)) });
        println!("  {kind:>7}  {one:>7}  {eight:>7}  {sixteen:>7}");
    }
}

fn convergence(name: &str) {
    let scene = load(&ours(name));
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
    // Cargo's own arguments begin with dashes.
    let files: Vec<PathBuf> = env::args().skip(1).filter(|x| !x.starts_with('-')).map(PathBuf::from).collect();
    if !files.is_empty() {
        return files.iter().for_each(|file| throughput(file));
    }
    throughput(&ours("cornell-box"));
    throughput(&ours("veach-room"));
    convergence("caustic-ring");
    convergence("caustic-sphere");
}
