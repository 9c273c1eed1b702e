//! Scenes whose image somebody has worked out, rendered by every integrator that covers them.
//!
//! Oracle: closed forms of radiative transfer (radiosity in spheres and boxes, Howell's catalogue of configuration
//! factors, Lambert's polygon formula, Fresnel, Snell and Beer–Lambert), evaluated here in f64 with nothing of the
//! renderer's. It would catch any factor that *all* integrators share and agreement between them cannot see: π,
//! cosines, areas, η², a bounce too many or too few, an intensity taken for a power.
//!
//! A comparison is a t-test over independent replicates, in the whole image and in its tiles, at a level of 1e-4. Each
//! is refined until a bias of the stated size turns it red, and shows that it would.

mod caustics;
mod dielectrics;
mod environments;
pub mod form_factors;
mod furnaces;
mod irradiance;
pub mod receiver;
pub mod tally;

use std::{sync::LazyLock, time::Instant};

use glam::DVec3;
use pathspace::{
    integrator::{Gap, IntegratorKind},
    math::luminance,
    render::{Renderer, Settings},
    scene::Scene,
    statistics::{Comparison, Estimate, Regions, regions},
};
use rayon::prelude::*;

/// Below this p-value, after Šidák's correction, an estimate is wrong.
const SIGNIFICANCE: f64 = 1e-4;
/// Independent replicates of each estimate.
const REPLICATES: u64 = 64;
/// Where a scene's variance makes the visible bias unreachable, that is a failure and not a reason to go on forever.
const MOST_PASSES: u32 = 1 << 17;
/// What f32 may make of a number that takes no chance: an image without variance need not be right to more digits.
const ROUNDING: f64 = 2e-5;

type Kinds = LazyLock<Vec<IntegratorKind>>;

/// The integrators of connected strategies that cover every light, and every surface that is not specular.
pub use crate::scenes::{UNBIASED, WEIGHTED};
/// Those that see through specular surfaces to a light with an extent.
pub static FROM_CAMERA: Kinds = LazyLock::new(|| covering(Gap::SpecularSeen));
/// Those that find the caustics of lights without extent on what the camera sees directly.
pub static FROM_LIGHT: Kinds = LazyLock::new(|| covering(Gap::CausticsOfPoints));
/// Those that cover point lights, spots and suns.
pub static TO_POINTS: Kinds = LazyLock::new(|| covering(Gap::LightsWithoutExtent));

fn covering(gap: Gap) -> Vec<IntegratorKind> {
    UNBIASED.into_iter().filter(|kind| !kind.lacks(gap)).collect()
}

/// The regions of an image with the radiance `radiance(u, v)` at the place (u, v) in [0, 1]² of the image, u to the
/// right and v downwards: the midpoint rule with `fine`² places in each of 4 × 4 tiles.
pub fn expected(fine: usize, radiance: impl Fn(f64, f64) -> DVec3) -> Regions {
    const TILES: usize = 4;
    let place = |tile: usize, i: usize| (tile as f64 + (i as f64 + 0.5) / fine as f64) / TILES as f64;
    let tile = |tile: usize| -> DVec3 {
        let row = |j| (0..fine).map(move |i| (i, j));
        let at = |(i, j)| radiance(place(tile % TILES, i), place(tile / TILES, j));
        (0..fine).flat_map(row).map(at).sum::<DVec3>() / (fine * fine) as f64
    };
    of_tiles(&(0..TILES * TILES).map(tile).collect::<Vec<_>>())
}

/// The regions of an image whose tiles have these means, row after row.
pub fn of_tiles(tiles: &[DVec3]) -> Regions {
    let weights = [glam::Vec3::X, glam::Vec3::Y, glam::Vec3::Z].map(|axis| f64::from(luminance(axis.into())));
    let image = tiles.iter().sum::<DVec3>() / tiles.len() as f64;
    image.to_array().into_iter().chain(tiles.iter().map(|t| t.dot(DVec3::from_array(weights)))).collect()
}

/// The regions of an image that is the same everywhere.
pub fn constant(radiance: f64) -> Regions {
    of_tiles(&[DVec3::splat(radiance); 16])
}

/// Holds the image of every integrator of `kinds`, of paths of at most `depth` edges, to the `expected` regions (or to
/// as many of the first regions as there are), so that a relative bias of `visible` shows: twice that where most of
/// what an integrator draws misses the image.
#[track_caller]
pub fn assert_image(what: &str, scene: &Scene, kinds: &[IntegratorKind], depth: u32, visible: f64, expected: &Regions) {
    for &kind in kinds {
        let visible = if kind.has(|x| x.t >= 2) { visible } else { 2.0 * visible };
        let base = Settings { integrator: kind, max_depth: depth, ..Settings::new(scene.camera.sensor()) };
        let settings: Vec<_> =
            (0..REPLICATES).map(|r| Settings { seed: 7000 + 100 * kind as u64 + r, ..base.clone() }).collect();
        let mut renderers: Vec<_> = settings.iter().map(|s| Renderer::new(scene, s)).collect();
        let outcome = converge(visible, |passes| {
            renderers.par_iter_mut().for_each(|renderer| {
                while renderer.passes() < passes {
                    renderer.pass();
                }
            });
            renderers.iter().map(|r| regions(&r.film().image(passes))[..expected.len()].to_vec()).collect()
        });
        for renderer in &renderers {
            let statistics = renderer.statistics();
            assert!(statistics.rejected.is_empty(), "{what}, {kind}: {:?}", statistics.rejected);
            assert!(renderer.film().errors().is_empty(), "{what}, {kind}: {:?}", renderer.film().errors());
        }
        outcome.assert(&format!("{what}, {kind}"), expected, visible);
    }
}

/// What replicates have come to.
pub struct Outcome {
    replicates: Vec<Regions>,
    passes: u32,
    seconds: f32,
}

/// Brings replicates to more and more passes, until the whole image shows a bias of `visible` at [`SIGNIFICANCE`].
fn converge(visible: f64, mut advance: impl FnMut(u32) -> Vec<Regions>) -> Outcome {
    // `Comparison` states the bias that shows at a level of 1e-3.
    let goal = 0.72 * visible;
    let start = Instant::now();
    let mut passes = 2;
    loop {
        let replicates = advance(passes);
        let reached = visible_bias(&replicates);
        if reached < goal || passes >= MOST_PASSES {
            return Outcome { replicates, passes, seconds: start.elapsed().as_secs_f32() };
        }
        // The error falls as the square root; a little more saves a round.
        passes = (f64::from(passes) * (1.1 * (reached / goal).powi(2)).clamp(1.3, 8.0)) as u32 + 1;
    }
}

fn visible_bias(replicates: &[Regions]) -> f64 {
    let estimate = Estimate::new(replicates);
    Comparison::new(&estimate, &estimate.exact()).visible_bias
}

impl Outcome {
    #[track_caller]
    fn assert(&self, what: &str, expected: &Regions, visible: f64) {
        let n = self.replicates.len() as f64;
        let mean = |i: usize| self.replicates.iter().map(|r| r[i]).sum::<f64>() / n;
        // Rounding is no evidence.
        let rounded = |(i, e): (usize, &f64)| if (mean(i) - e).abs() <= ROUNDING * e.abs() { mean(i) } else { *e };
        let truth: Regions = expected.iter().enumerate().map(rounded).collect();
        let truth = Estimate::new(&[truth.clone(), truth]);
        let estimate = Estimate::new(&self.replicates);
        let p = |bias: f64| Comparison::new(&estimate.biased(bias), &truth).p;
        let seen = visible_bias(&self.replicates);
        println!(
            "  {what}: {:.6}, expected {:.6}; p = {:.1e}, visible {:.2} %, {} passes, {:.1} s",
            estimate.image_mean(),
            expected[..3].iter().sum::<f64>() / 3.0,
            p(0.0),
            100.0 * seen,
            self.passes,
            self.seconds
        );
        if p(0.0) <= SIGNIFICANCE {
            for (i, e) in expected.iter().enumerate() {
                println!("    region {i}: {:.6}, expected {e:.6}", mean(i));
            }
        }
        assert!(p(0.0) > SIGNIFICANCE, "{what}: {} instead of {}", estimate.image_mean(), expected[1]);
        // Chance may hide a bias of one sign in part; it cannot hide both.
        assert!(p(visible).min(p(-visible)) < SIGNIFICANCE, "{what}: a bias of {visible} would go unnoticed ({seen})");
    }
}
