//! The pilot of weights that know their noise: what it measures are the [`VarianceFactors`] of a render.

use rayon::prelude::*;

use super::{Renderer, padded::Pixel, wavelength};
use crate::{
    integrator::{Integrator, Samplers, Scratch, Sink, Weighting},
    math::{Rgb, luminance},
    path::{Densities, Heuristic, JoinedPath, Strategy, VarianceFactors},
    sampling::{Block, Independent, Sampler, SamplerKind, Sobol},
    scene::camera::{Raster, Sensor},
};

/// Of so many samples of a pixel the mean's variance is measured, whatever the render takes.
const SAMPLES: u32 = 16;
/// In so many replicates, whose random numbers know nothing of each other.
const REPLICATES: u64 = 4;
/// Of pixels so far apart.
const STEP: u32 = VarianceFactors::SIDE / 2;
/// The strategies, in the order of the factors.
const MEASURED: [Strategy; 2] = [Strategy { s: 0, t: 3 }, Strategy { s: 1, t: 2 }];

/// m₂/N and σ²_N of some pixels, for each strategy.
type Moments = [[f64; 2]; MEASURED.len()];

/// Whether weights of this integrator have anything of such factors: several strategies for direct light, one of which
/// is measured, and a rule that compares densities.
pub(super) fn would_use_factors(integrator: &Integrator) -> bool {
    let table = integrator.techniques();
    let of_direct_light = (1..=3).map(|t| Strategy { s: 3 - t, t }).filter(|x| table.multiplicity(*x) > 0);
    integrator.heuristic() != Heuristic::FirstSupported && of_direct_light.count() > 1
}

/// Measures v = m₂/(N σ²_N) tile by tile: over the whole image, whatever the crop, and with random numbers of its own.
/// A function of the scene, the settings and the seed, so that shards, resumed renders and crops have the same.
pub(super) fn measured(renderer: &Renderer<'_>) -> VarianceFactors {
    let Sensor { width, height, .. } = renderer.scene.camera.sensor();
    let [columns, rows] = [width, height].map(|side| side.div_ceil(VarianceFactors::SIDE));
    let single = MEASURED.map(|strategy| {
        // Hits keep v = 1: where a mirror shows a lamp they are free of noise, and beside it on a wall the rarest of
        // all, so that a tile's factor for both would leave the wall to chance.
        let measured = strategy.s == 1 && renderer.integrator.techniques().multiplicity(strategy) > 0;
        measured.then(|| renderer.integrator.clone().only(strategy, Weighting::Unweighted))
    });
    let moments: Vec<_> = (0..rows * columns)
        .into_par_iter()
        .map(|tile| match renderer.settings.sampler {
            SamplerKind::Independent => of_tile::<Independent>(renderer, &single, [tile % columns, tile / columns]),
            SamplerKind::Sobol => of_tile::<Sobol>(renderer, &single, [tile % columns, tile / columns]),
        })
        .collect();
    let smooth = |tile: u32| {
        let mut sums = Moments::default();
        for y in (tile / columns).saturating_sub(1)..=(tile / columns + 1).min(rows - 1) {
            for x in (tile % columns).saturating_sub(1)..=(tile % columns + 1).min(columns - 1) {
                add(&mut sums, &moments[(y * columns + x) as usize]);
            }
        }
        sums.map(|[of_independent, of_mean]| {
            let v = if of_independent > 0.0 { of_independent / of_mean } else { 1.0 };
            // Without any variance the most; and what is no number says nothing.
            if v.is_nan() { 1.0 } else { v.clamp(1.0, f64::from(VarianceFactors::MOST)) as f32 }
        })
    };
    VarianceFactors::new(columns, (0..rows * columns).map(smooth).collect())
}

fn add(sums: &mut Moments, more: &Moments) {
    for (sum, more) in sums.iter_mut().zip(more) {
        *sum = [sum[0] + more[0], sum[1] + more[1]];
    }
}

fn of_tile<S: Sampler>(renderer: &Renderer<'_>, single: &[Option<Integrator>; 2], [x, y]: [u32; 2]) -> Moments {
    let Sensor { width, height, .. } = renderer.scene.camera.sensor();
    let along = |tile: u32, size: u32| {
        let from = tile * VarianceFactors::SIDE;
        (from + STEP / 2..(from + VarianceFactors::SIDE).min(size).max(from + STEP / 2 + 1))
            .step_by(STEP as usize)
            .map(move |x| x.min(size - 1) as i32)
    };
    let mut sums = Moments::default();
    for (integrator, sums) in single.iter().zip(&mut sums) {
        let Some(integrator) = integrator else { continue };
        let mut scratch = integrator.scratch();
        for y in along(y, height) {
            for x in along(x, width) {
                let [of_independent, of_mean] = of_pixel::<S>(renderer, integrator, Pixel { x, y }, &mut scratch);
                *sums = [sums[0] + of_independent, sums[1] + of_mean];
            }
        }
    }
    sums
}

/// m₂/N and σ²_N of a strategy alone.
fn of_pixel<S: Sampler>(
    renderer: &Renderer<'_>,
    integrator: &Integrator,
    pixel: Pixel,
    scratch: &mut Scratch,
) -> [f64; 2] {
    let (mut squares, mut means) = (0.0, [0.0; REPLICATES as usize]);
    for (replicate, mean) in (1..).zip(&mut means) {
        // Any seeds but the image's would do.
        let seed = renderer.settings.seed ^ u64::wrapping_mul(replicate, 0x9e37_79b9_7f4a_7c15);
        let mut found = Found::default();
        for sample in 0..SAMPLES {
            let mut streams = S::streams(seed, pixel.key(), sample);
            let wavelength = wavelength::drawn(renderer.scene, seed, pixel.key(), sample);
            let samplers = &mut Samplers::of(&mut streams, wavelength);
            samplers.camera.start(Block::START);
            let raster = Raster(pixel.corner() + samplers.camera.next_2d());
            scratch.start_over();
            integrator.estimate_from_camera(renderer.scene, raster, scratch, samplers, None, &mut found);
        }
        squares += found.squares;
        *mean = found.sum / f64::from(SAMPLES);
    }
    let replicates = REPLICATES as f64;
    let mean = means.iter().sum::<f64>() / replicates;
    let variance = means.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (replicates - 1.0);
    [squares / (replicates * f64::from(SAMPLES).powi(2)), variance]
}

/// What a strategy has found in a pixel.
#[derive(Default)]
struct Found {
    sum: f64,
    squares: f64,
}

impl Sink for Found {
    fn deposit(&mut self, path: &JoinedPath, value: Rgb) {
        if path.edges() == 2 {
            let value = f64::from(luminance(value));
            self.sum += value;
            self.squares += value * value;
        }
    }

    fn reject(&mut self, _: &JoinedPath, _: Rgb) {
        // The image counts its own; weights only have to be the same for all.
    }
}
