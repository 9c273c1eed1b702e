//! What the candidates find too seldom to be met in a small image: it is predicted from what all techniques find.

use super::{Keep, frequent::Measured};
use crate::{
    integrator::{IntegratorKind, Weights},
    math::{Rgb, luminance},
    path::{Heuristic, JoinedPath, LightPaths, Techniques, relative_deposit},
    render::{Collector, MergeRadius, Renderer, Settings},
    scene::{Scene, camera::Sensor},
};

/// Contributions up to so many times the typical value are common enough to be measured.
const COMMON: f64 = 20.0;
/// In an image of [`SAMPLES`] samples, one of so many times the typical value is a white dot in its pixel, and a larger
/// one is no whiter.
const WHITE: f64 = 200.0;
/// Of the usual image, per pixel.
pub const SAMPLES: f64 = 64.0;

/// What is rare: the largest channel of single contributions.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Larger ones are rare.
    pub common: f64,
    /// Those count as no larger than this: the rest is missing from the image.
    pub white: f64,
}

impl Bounds {
    /// For an image of which this is a typical value.
    pub fn around(typical: f64) -> Self {
        // An image without light has none that is rare.
        let typical = if typical > 0.0 { typical } else { f64::from(f32::MAX) / WHITE };
        Self { common: COMMON * typical, white: WHITE * typical }
    }

    pub(super) fn by(self, factor: f64) -> Self {
        Self { common: factor * self.common, white: factor * self.white }
    }
}

/// With all techniques. In one alone, a caustic in a small pilot is so few finds that the seed would choose.
const PASSES: u32 = 4;

/// A candidate that cannot find so few of the paths may be unlucky: one merge can be a thousandth of all light.
const FEW: u32 = 8;

/// What passes with all techniques tell, in the mean.
pub struct Rare {
    /// Of each candidate.
    pub(super) candidates: Vec<OfOne>,
    /// The light of the image.
    pub light: f64,
}

/// What it tells of a candidate.
#[derive(Clone)]
pub(super) struct OfOne {
    /// Of each pixel.
    pub(super) excess: Vec<Excess>,
    /// The light that it cannot find, and in how many paths.
    pub(super) missed: (f64, u32),
}

/// By how much the mean and the mean square of a sample exceed those of one with what is rare clamped, and by how much
/// its mean falls short of the light since no dot is whiter than white.
#[derive(Clone, Copy, Default)]
pub(super) struct Excess {
    pub(super) mean: f64,
    pub(super) square: f64,
    pub(super) lost: f64,
    /// How often a sample finds what is whiter than white.
    pub(super) often: f64,
}

impl Rare {
    /// The part of the light that a candidate cannot find.
    pub fn missed(&self, candidate: usize) -> f64 {
        let (light, finds) = self.candidates[candidate].missed;
        if finds < FEW { 0.0 } else { light / self.light }
    }

    /// The mean light of a pixel beyond white dots, in an image in which there is none: that of all finds times the
    /// probability that no sample has one. What every sample finds, such as a lamp, is in the image.
    pub fn lost(&self, candidate: usize, pixel: usize) -> f64 {
        let Excess { lost, often, .. } = self.candidates[candidate].excess[pixel];
        lost * (-SAMPLES * often).exp()
    }

    /// By how much the mean of a pixel exceeds that of its clamped image.
    pub fn mean(&self, candidate: usize, pixel: usize) -> f64 {
        self.candidates[candidate].excess[pixel].mean
    }

    /// By how much the variance of a sample in a pixel, E x² − (E x)², exceeds that of its clamped image, of this mean.
    /// Light that is large in every sample adds none.
    pub fn variance(&self, candidate: usize, pixel: usize, clamped_mean: f64) -> f64 {
        let Excess { mean, square, .. } = self.candidates[candidate].excess[pixel];
        (square - mean * (2.0 * clamped_mean + mean)).max(0.0)
    }

    /// The passes have the settings of a candidate but for the integrator and the number of light subpaths.
    pub fn predict(
        scene: &Scene,
        settings: &Settings,
        candidates: &[Measured],
        bounds: Bounds,
        keep: Option<&Keep<'_>>,
    ) -> Self {
        let sensor = scene.camera.sensor();
        let all = Settings {
            integrator: IntegratorKind::Vcm,
            light_paths: LightPaths::ONE,
            weights: Weights::Plain,
            seed: settings.seed ^ 0x9e37_79b9_7f4a_7c15,
            ..settings.clone()
        };
        let mut renderer = Renderer::new(scene, &all);
        let radius = MergeRadius::of(scene, all.merge_radius).of_pass(0);
        let own = renderer.integrator().clone().merging_within(radius);
        let tables: Vec<_> = candidates
            .iter()
            .map(|x| (x.integrator.techniques().clone().with_plain_weights(), x.integrator.heuristic()))
            .collect();
        let mut found = Self::nothing(candidates.len(), sensor);
        let setting = Setting { scene, sensor, own: own.techniques(), tables: &tables, bounds, keep };
        for _ in 0..PASSES {
            for task in renderer.pass_into(|| Tally { setting, found: Self::nothing(candidates.len(), sensor) }) {
                found.add(&task.found);
            }
        }
        found
    }

    fn nothing(candidates: usize, sensor: Sensor) -> Self {
        let nothing = OfOne { excess: vec![Excess::default(); sensor.pixels() as usize], missed: (0.0, 0) };
        Self { candidates: vec![nothing; candidates], light: 0.0 }
    }

    fn add(&mut self, other: &Self) {
        for (of_one, more) in self.candidates.iter_mut().zip(&other.candidates) {
            of_one.missed.0 += more.missed.0;
            of_one.missed.1 += more.missed.1;
            for (excess, more) in of_one.excess.iter_mut().zip(&more.excess) {
                excess.mean += more.mean;
                excess.square += more.square;
                excess.lost += more.lost;
                excess.often += more.often;
            }
        }
        self.light += other.light;
    }
}

#[derive(Clone, Copy)]
struct Setting<'a> {
    scene: &'a Scene,
    sensor: Sensor,
    /// What finds the paths.
    own: &'a Techniques,
    /// Of the candidates.
    tables: &'a [(Techniques, Heuristic)],
    bounds: Bounds,
    keep: Option<&'a Keep<'a>>,
}

/// Sees all paths of one task.
struct Tally<'a> {
    setting: Setting<'a>,
    found: Rare,
}

impl Collector for Tally<'_> {
    fn collect(&mut self, path: &JoinedPath, value: Rgb) {
        let Setting { scene, sensor, own, tables, bounds, keep } = self.setting;
        let technique = path.technique();
        let (x, y) = (path.raster().0.x.floor(), path.raster().0.y.floor());
        let inside = x >= 0.0 && y >= 0.0 && x < sensor.width as f32 && y < sensor.height as f32;
        if !inside || keep.is_some_and(|keep| !keep(scene, path)) {
            return;
        }
        let pixel = (y as u32 * sensor.width + x as u32) as usize;
        // Of a dispersed path channels may be negative: its size is what counts.
        let deposit = f64::from(luminance(value).abs());
        let light = deposit / f64::from(PASSES);
        // F/(n p), over the survival of roulette.
        let single = f64::from(luminance(path.contribution()).abs() / own.samples(technique));
        // The measured images are clamped channel by channel.
        let bounds = bounds.by(deposit / f64::from(value.abs().max_element()));
        self.found.light += light;
        for (of_one, (table, heuristic)) in self.found.candidates.iter_mut().zip(tables) {
            let relative = relative_deposit(path, technique, own, table, *heuristic);
            if relative.is_infinite() {
                of_one.missed.0 += light;
                of_one.missed.1 += 1;
            } else {
                of_one.excess[pixel].add(light, single * relative, bounds);
            }
        }
    }
}

impl Excess {
    /// Contributions of this size whose mean is `light`.
    pub(super) fn add(&mut self, light: f64, size: f64, Bounds { common, white }: Bounds) {
        if size > common {
            let (often, counted) = (light / size, size.min(white));
            self.mean += often * (counted - common);
            self.square += often * (counted * counted - common * common);
            if size > white {
                self.lost += often * (size - white);
                self.often += often;
            }
        }
    }
}
