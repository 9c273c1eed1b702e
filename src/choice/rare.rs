//! What the candidates find too seldom to be met in a small image: it is foretold from what all techniques find.

use super::{Keep, frequent::Measured};
use crate::{
    integrator::{Integrator, IntegratorKind, Weights},
    math::{Rgb, luminance},
    path::{JoinedPath, Technique, relative_deposit},
    render::{Collector, MergeRadius, Renderer, Settings},
    scene::{Scene, camera::Sensor},
};

/// Contributions up to so many times the typical value are common enough to be measured.
const COMMON: f64 = 20.0;
/// In an image of the usual 64 samples, one of so many times the typical value is a white dot in its pixel, and a
/// larger one is no whiter.
const WHITE: f64 = 200.0;

/// What is rare, as luminances of single contributions.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Larger ones are rare.
    pub common: f64,
    /// Those count as no larger than this.
    pub white: f64,
}

impl Bounds {
    /// For an image of which this is a typical value.
    pub fn around(typical: f64) -> Self {
        // An image without light has none that is rare.
        let typical = if typical > 0.0 { typical } else { f64::from(f32::MAX) / WHITE };
        Self { common: COMMON * typical, white: WHITE * typical }
    }
}

/// What one pass with all techniques tells.
pub struct Rare {
    /// Of each candidate and pixel: by how much the mean square of a sample exceeds that of a sample with what is rare
    /// clamped.
    pub squares: Vec<Vec<f64>>,
    /// Of each candidate the light that it cannot find, summed over the image.
    pub missed: Vec<f64>,
    /// All of it.
    pub light: f64,
    /// How many pairs of vertices have merged.
    pub merges: f64,
}

impl Rare {
    /// The pass has the settings of a candidate but for the integrator.
    pub fn foretell(
        scene: &Scene,
        settings: &Settings,
        candidates: &[Measured],
        bounds: Bounds,
        keep: Option<&Keep<'_>>,
    ) -> Self {
        let sensor = scene.camera.sensor();
        let all = Settings {
            integrator: IntegratorKind::Vcm,
            weights: Weights::Plain,
            seed: settings.seed ^ 0x9e37_79b9_7f4a_7c15,
            ..settings.clone()
        };
        let mut renderer = Renderer::new(scene, &all);
        let radius = MergeRadius::of(scene, all.merge_radius).of_pass(0);
        let own = renderer.integrator().clone().merging_within(radius);
        let integrators: Vec<_> = candidates.iter().map(|x| &x.integrator).collect();
        let mut found = Self::nothing(candidates.len(), sensor);
        let setting = Setting { scene, sensor, own: &own, integrators: &integrators, bounds, keep };
        for task in renderer.pass_into(|| Tally { setting, found: Self::nothing(candidates.len(), sensor) }) {
            found.add(&task.found);
        }
        found
    }

    fn nothing(candidates: usize, sensor: Sensor) -> Self {
        let squares = vec![vec![0.0; sensor.pixels() as usize]; candidates];
        Self { squares, missed: vec![0.0; candidates], light: 0.0, merges: 0.0 }
    }

    fn add(&mut self, other: &Self) {
        let add = |sums: &mut [f64], more: &[f64]| sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        self.squares.iter_mut().zip(&other.squares).for_each(|(sums, more)| add(sums, more));
        add(&mut self.missed, &other.missed);
        self.light += other.light;
        self.merges += other.merges;
    }
}

#[derive(Clone, Copy)]
struct Setting<'a> {
    scene: &'a Scene,
    sensor: Sensor,
    /// What finds the paths.
    own: &'a Integrator,
    integrators: &'a [&'a Integrator],
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
        let Setting { scene, sensor, own, integrators, bounds, keep } = self.setting;
        let technique = path.technique();
        if matches!(technique, Technique::Merged(_)) {
            self.found.merges += 1.0;
        }
        let (x, y) = (path.raster().0.x.floor(), path.raster().0.y.floor());
        let inside = x >= 0.0 && y >= 0.0 && x < sensor.width as f32 && y < sensor.height as f32;
        if !inside || keep.is_some_and(|keep| !keep(scene, path)) {
            return;
        }
        let pixel = (y as u32 * sensor.width + x as u32) as usize;
        let light = f64::from(luminance(value));
        // F/(n p), over the survival of roulette.
        let single = f64::from(luminance(path.contribution()) / own.techniques().samples(technique));
        self.found.light += light;
        for (candidate, other) in integrators.iter().enumerate() {
            let relative = relative_deposit(path, technique, own.techniques(), other.techniques(), other.heuristic());
            if relative.is_infinite() {
                self.found.missed[candidate] += light;
            } else {
                self.found.squares[candidate][pixel] += excess(light, single * relative, bounds);
            }
        }
    }
}

/// What contributions of this size that bring so much light in the mean add to the mean square of a sample, beyond
/// what they would as common ones.
fn excess(light: f64, size: f64, Bounds { common, white }: Bounds) -> f64 {
    if size > common { light / size * (size.min(white).powi(2) - common * common) } else { 0.0 }
}
