//! `cargo bench --bench samplers`: what the Sobol sampler saves against independent numbers, by scene and integrator.
//!
//! Variances per pixel come from replicates with seeds of their own, and need no reference; rounds are interleaved.
//! `variance` is the ratio of the variances relative to each pixel's squared mean, averaged over the image; `median` is
//! the median pixel's ratio, which no firefly moves; `seconds` the ratio of times. Below one, Sobol is better.

#![allow(clippy::print_stdout)] // the report of a benchmark

use std::{path::Path, time::Instant};

use pathspace::{
    film::Image,
    integrator::IntegratorKind,
    io,
    math::luminance,
    render::{Renderer, Settings},
    sampling::SamplerKind,
    scene::{Scene, camera::Sensor},
};

const KINDS: [IntegratorKind; 3] = [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Bdpt];
const SCENES: [&str; 6] =
    ["cornell-box", "cornell-spheres", "veach-room", "textured-room", "many-lights", "caustic-sphere"];
const SENSOR: Sensor = Sensor { width: 48, height: 48, padding: 0 };
const REPLICATES: u64 = 12;

/// What is known of one sampler: the luminance of every pixel in every replicate, and the time that they took.
#[derive(Default)]
struct Figures {
    replicates: Vec<Vec<f64>>,
    seconds: f64,
}

impl Figures {
    fn add(&mut self, scene: &Scene, settings: &Settings, spp: u32) {
        let mut renderer = Renderer::new(scene, settings);
        let start = Instant::now();
        (0..spp).for_each(|_| renderer.pass());
        self.seconds += start.elapsed().as_secs_f64();
        let image: Image = renderer.film().image(spp);
        self.replicates.push(image.pixels.iter().map(|p| f64::from(luminance(*p))).collect());
    }

    /// Mean and variance of each pixel.
    fn pixels(&self) -> Vec<(f64, f64)> {
        let n = self.replicates.len() as f64;
        let pixel = |i: usize| {
            let mean: f64 = self.replicates.iter().map(|r| r[i]).sum::<f64>() / n;
            (mean, self.replicates.iter().map(|r| (r[i] - mean).powi(2)).sum::<f64>() / (n - 1.0))
        };
        (0..self.replicates[0].len()).map(pixel).collect()
    }
}

fn main() {
    for name in SCENES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("glb");
        let loaded = io::load(&path).unwrap_or_else(|e| panic!("{e}"));
        let camera = loaded.cameras[0].to_camera(SENSOR);
        let scene = loaded.into_scene(camera, None);
        println!("{name}");
        for kind in KINDS {
            for spp in [16, 64] {
                let mut figures = [Figures::default(), Figures::default()];
                for seed in 0..REPLICATES {
                    for (sampler, figures) in SamplerKind::ALL.into_iter().zip(&mut figures) {
                        figures.add(
                            &scene,
                            &Settings { integrator: kind, sampler, seed, ..Settings::new(SENSOR) },
                            spp,
                        );
                    }
                }
                report(kind, spp, &figures);
            }
        }
    }
}

fn report(kind: IntegratorKind, spp: u32, [independent, sobol]: &[Figures; 2]) {
    let (a, b) = (independent.pixels(), sobol.pixels());
    let image_mean = a.iter().map(|p| p.0).sum::<f64>() / a.len() as f64;
    let floor = (0.01 * image_mean).powi(2);
    let mut sums = (0.0, 0.0);
    let mut ratios = Vec::new();
    for (x, y) in a.iter().zip(&b) {
        let scale = 0.25 * (x.0 + y.0).powi(2) + floor;
        sums = (sums.0 + x.1 / scale, sums.1 + y.1 / scale);
        if x.1 > 0.0 {
            ratios.push(y.1 / x.1);
        }
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "  {kind:>5}  {spp:2} spp  variance {:.3}  median {:.3}  seconds {:.3}",
        sums.1 / sums.0,
        ratios[ratios.len() / 2],
        sobol.seconds / independent.seconds
    );
}
