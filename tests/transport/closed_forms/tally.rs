//! What an integrator finds, added up by a property of the path in place of the pixel.

use glam::DVec3;
use pathspace::{
    integrator::{Connects, Integrator, IntegratorKind, LightStage, Samplers, Sink, Splats},
    math::Rgb,
    path::{JoinedPath, Roulette},
    sampling::{Independent, Sampler},
    scene::{Scene, camera::Raster},
    statistics::{Comparison, Estimate, Regions},
};
use rayon::prelude::*;

use super::{MOST_PASSES, REPLICATES, ROUNDING, SIGNIFICANCE};

/// Which sum a path belongs to, if any.
pub type Bin<'a> = &'a (dyn Fn(&JoinedPath) -> Option<usize> + Sync);

/// The image's mean, bin by bin.
struct Bins<'a> {
    bin: Bin<'a>,
    sums: Vec<DVec3>,
}

impl Sink for Bins<'_> {
    fn deposit(&mut self, path: &JoinedPath, value: Rgb) {
        if let Some(bin) = (self.bin)(path) {
            self.sums[bin] += value.as_dvec3();
        }
    }

    fn reject(&mut self, path: &JoinedPath, value: Rgb) {
        panic!("{} by {} contributes {value}", path.to_path().class(), path.technique());
    }
}

/// An expected sum of a bin with what is not known of it, both as a part of the image's mean.
#[derive(Clone, Copy, Debug)]
pub struct Expectation {
    pub value: f64,
    /// How far the truth may be off the value: a discretisation's error.
    pub slack: f64,
}

impl From<f64> for Expectation {
    fn from(value: f64) -> Self {
        Self { value, slack: 0.0 }
    }
}

/// Holds the grey sums of each integrator of `kinds` to what is expected of every bin, so that a relative bias of
/// `visible` in any of them shows.
#[track_caller]
pub fn assert_bins(
    what: &str,
    scene: &Scene,
    kinds: &[IntegratorKind],
    depth: u32,
    visible: f64,
    (bin, expected): (Bin, &[Expectation]),
) {
    for &kind in kinds {
        let integrator = Integrator::new(kind, scene.camera.sensor(), depth, Roulette::FromDepth(3));
        let start = std::time::Instant::now();
        let mut sums = vec![vec![DVec3::ZERO; expected.len()]; REPLICATES as usize];
        let (mut done, mut passes) = (0, 2);
        let replicates = loop {
            sums.par_iter_mut().enumerate().for_each(|(r, sums)| {
                let mut sink = Bins { bin, sums: std::mem::take(sums) };
                pass(scene, &integrator, 9000 + 100 * kind as u64 + r as u64, done..passes, &mut sink);
                *sums = sink.sums;
            });
            done = passes;
            let count = f64::from(passes) * f64::from(scene.camera.sensor().pixels());
            let replicates: Vec<Vec<Regions>> = (0..expected.len())
                .map(|i| sums.iter().map(|s| (s[i] / count).to_array().to_vec()).collect())
                .collect();
            let goal = 0.72 * visible;
            let reached = replicates.iter().map(|r| super::visible_bias(r)).fold(0.0, f64::max);
            if reached < goal || passes >= MOST_PASSES {
                break replicates;
            }
            passes = (f64::from(passes) * (1.1 * (reached / goal).powi(2)).clamp(1.3, 8.0)) as u32 + 1;
        };
        let judged: Vec<_> = replicates.iter().zip(expected).map(|(r, e)| judge(r, *e, visible)).collect();
        let worst = (0..judged.len()).min_by(|a, b| judged[*a].p.total_cmp(&judged[*b].p)).expect("a bin");
        let Judged { mean, p, .. } = judged[worst];
        // Šidák: one p-value for all bins.
        let p = -(judged.len() as f64 * (-p).ln_1p()).exp_m1();
        let seen = judged.iter().map(|j| j.seen).fold(0.0, f64::max);
        println!(
            "  {what}, {kind}: worst of {} bins is {worst}: {mean:.6}, expected {:.6} ± {:.1e}; p = {p:.1e}, \
             visible {:.2} %, {passes} passes, {:.1} s",
            judged.len(),
            expected[worst].value,
            expected[worst].slack,
            100.0 * seen,
            start.elapsed().as_secs_f32()
        );
        assert!(p > SIGNIFICANCE, "{what}, {kind}, bin {worst}: {mean} instead of {:?}", expected[worst]);
        for (i, j) in judged.iter().enumerate() {
            assert!(j.notices, "{what}, {kind}: a bias of {visible} in bin {i} would go unnoticed ({})", j.seen);
        }
    }
}

struct Judged {
    mean: f64,
    p: f64,
    seen: f64,
    /// Whether a bias of the wanted size would be significant.
    notices: bool,
}

fn judge(replicates: &[Regions], expected: Expectation, visible: f64) -> Judged {
    let estimate = Estimate::new(replicates);
    let mean = estimate.image_mean();
    let p_of = |factor: f64| {
        let estimate = estimate.biased(factor - 1.0);
        let mean = mean * factor;
        // What is nearest to the mean of all that may be true.
        let slack = expected.slack + ROUNDING * expected.value.abs();
        let truth = mean.clamp(expected.value - slack, expected.value + slack);
        if mean == truth { 1.0 } else { estimate.p_of_mean(truth) }
    };
    let seen = Comparison::new(&estimate, &estimate.exact()).visible_bias;
    let notices = expected.value == 0.0 || p_of(1.0 + visible).min(p_of(1.0 - visible)) < SIGNIFICANCE;
    Judged { mean, p: p_of(1.0), seen, notices }
}

/// Passes of an image without padding, into a sink.
fn pass(scene: &Scene, integrator: &Integrator, seed: u64, passes: std::ops::Range<u32>, sink: &mut impl Sink) {
    let sensor = scene.camera.sensor();
    assert_eq!(sensor.padding, 0);
    let mut scratch = integrator.scratch();
    for pass in passes {
        for (x, y) in (0..sensor.height).flat_map(|y| (0..sensor.width).map(move |x| (x, y))) {
            let mut streams = Independent::streams(seed, y << 16 | x, pass);
            let samplers = &mut Samplers::of(&mut streams, None);
            let raster = Raster(glam::Vec2::new(x as f32, y as f32) + samplers.camera.next_2d());
            let all = LightStage { connects: Connects::Yes, splats: Splats::Yes, keeps: None, paths: 1 };
            scratch.start_over();
            integrator.estimate_from_light(scene, all, &mut scratch, samplers, sink);
            integrator.estimate_from_camera(scene, raster, &mut scratch, samplers, None, sink);
        }
    }
}
