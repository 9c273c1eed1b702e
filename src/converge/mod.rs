//! How fast integrators converge on a scene: their errors against one reference, with samples and with time.
//!
//! Integrators take passes in turn, always the one that has had the least of the budget: whatever slows the machine for a while
//! slows all of them. Errors are measured outside the clock, whenever the number of passes is a power of two and at the end.

use std::time::{Duration, Instant};

use crate::{
    compare::Metric,
    film::{Half, Image, half_image_rel_mse},
    integrator::IntegratorKind,
    layers::{LayerError, LayerSet, Layers},
    math::luminance,
    path::Roulette,
    render::{Renderer, Settings},
    sampling::SamplerKind,
    scene::Scene,
    verify::{self, Budget},
};

/// Technique images are made of paths up to so many edges: the pyramid is as wide as it is high.
pub const PYRAMID_DEPTH: u32 = 5;

/// What to measure.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The integrators: at least one, none twice.
    pub integrators: Vec<IntegratorKind>,
    /// The longest path, in edges.
    pub max_depth: u32,
    /// When Russian roulette may end a subpath, or what suits each integrator.
    pub roulette: Option<Roulette>,
    /// All random numbers follow from it.
    pub seed: u64,
    /// For each integrator.
    pub budget: Budget,
    /// For the run that sorts paths into classes, which is the reference where no other is given.
    pub reference: Budget,
}

/// What errors are measured against.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The image.
    pub image: Image,
    /// Samples per pixel of bdpt, if it was made here.
    pub own: Option<u32>,
    /// Its relMSE, as its own half images show it; unknown for a given one.
    pub noise: Option<f64>,
}

/// An integrator at a moment of its run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// Samples per pixel.
    pub passes: u32,
    /// Time spent, in seconds.
    pub seconds: f64,
    /// In the order of [`Metric::ALL`].
    pub errors: [f64; Metric::ALL.len()],
}

impl Snapshot {
    /// √relMSE, which falls as N^(−½).
    pub fn root(&self) -> f64 {
        self.errors[1].sqrt()
    }
}

/// What an integrator came to.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Which.
    pub kind: IntegratorKind,
    /// At powers of two, and at the end.
    pub snapshots: Vec<Snapshot>,
    /// The image at the end.
    pub image: Image,
    /// Rays traced.
    pub rays: u64,
    /// Contributions that are no number: a mistake by itself.
    pub rejected: u64,
}

impl Measured {
    /// The last snapshot.
    pub fn end(&self) -> &Snapshot {
        self.snapshots.last().expect("a run ends with a snapshot")
    }

    /// 1/(relMSE × seconds); `None` if the image is the reference.
    pub fn efficiency(&self) -> Option<f64> {
        let product = self.end().errors[1] * self.end().seconds;
        (product > 0.0).then(|| product.recip())
    }

    /// The exponent a of √relMSE ∝ N^a by least squares in logarithms: see [`slope`].
    pub fn slope(&self) -> Option<f64> {
        slope(self.snapshots.iter().map(|s| (f64::from(s.passes), s.root())))
    }
}

/// A part of the light.
#[derive(Clone, Debug)]
pub struct Part {
    /// The layer's name.
    pub name: String,
    /// Its part of the image's luminance.
    pub share: f64,
    /// What it shows.
    pub image: Image,
}

/// Everything that was measured.
#[derive(Clone, Debug)]
pub struct Report {
    /// What errors are against.
    pub reference: Reference,
    /// In the order of the plan.
    pub measured: Vec<Measured>,
    /// The layers `classes`, of bdpt.
    pub classes: Vec<Part>,
    /// The layers `strategies` of bdpt, weighted, up to [`PYRAMID_DEPTH`].
    pub pyramid: Vec<Part>,
    /// Whether the integrators agree; `None` for one alone.
    pub agreement: Option<verify::Report>,
}

/// Measures the plan's integrators on a scene, on the current rayon pool, against `given` or a bdpt run of its own. `stage` hears
/// what begins.
///
/// # Errors
/// If the layers cannot be made.
///
/// # Panics
/// Without an integrator, or if `given` has another size than the camera's image.
pub fn converge(
    scene: &Scene,
    plan: &Plan,
    given: Option<Image>,
    stage: &mut dyn FnMut(&str),
) -> Result<Report, LayerError> {
    assert!(!plan.integrators.is_empty());
    stage(if given.is_some() { "path classes, by bdpt" } else { "reference and path classes, by bdpt" });
    let (own, classes) = layered(scene, plan, LayerSet::Classes, plan.max_depth, plan.reference)?;
    let reference = given.map_or(own, |image| Reference { image, own: None, noise: None });
    stage("technique images, by bdpt");
    let (_, pyramid) = layered(scene, plan, LayerSet::Strategies, plan.max_depth.min(PYRAMID_DEPTH), plan.budget)?;
    stage("the integrators in turn");
    let measured = measure(scene, plan, &reference.image);
    let agreement = (plan.integrators.len() > 1).then(|| {
        stage("agreement of the integrators");
        let budget = match plan.budget {
            Budget::Passes(passes) => Budget::Passes(passes.max(2)),
            time @ Budget::Time(_) => time,
        };
        let plan = verify::Plan {
            integrators: plan.integrators.clone(),
            max_depth: plan.max_depth,
            roulette: plan.roulette.unwrap_or_default(),
            seed: plan.seed,
            budget,
            bar: 0.02,
        };
        verify::verify(scene, &plan, &mut |_| ())
    });
    Ok(Report { reference, measured, classes, pyramid, agreement })
}

/// The settings of `render` for this integrator; each has random numbers of its own.
fn settings(scene: &Scene, plan: &Plan, kind: IntegratorKind, number: u64) -> Settings {
    Settings {
        integrator: kind,
        max_depth: plan.max_depth.min(kind.longest_path()),
        roulette: plan.roulette.unwrap_or(kind.roulette()),
        sampler: kind.sampler(),
        seed: plan.seed.wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15)),
        ..Settings::new(scene.camera.sensor())
    }
}

/// Whether so much is all of the budget.
fn is_spent(budget: Budget, passes: u32, elapsed: Duration) -> bool {
    match budget {
        Budget::Time(all) => passes > 0 && elapsed >= all,
        Budget::Passes(all) => passes >= all,
    }
}

fn measure(scene: &Scene, plan: &Plan, reference: &Image) -> Vec<Measured> {
    let kinds = plan.integrators.iter().zip(1..);
    let settings: Vec<_> = kinds.map(|(kind, number)| settings(scene, plan, *kind, number)).collect();
    let mut runs: Vec<_> =
        settings.iter().map(|settings| (Renderer::new(scene, settings), Duration::ZERO, Vec::new())).collect();
    loop {
        let open = runs.iter_mut().filter(|(r, elapsed, _)| !is_spent(plan.budget, r.passes(), *elapsed));
        let next = match plan.budget {
            Budget::Time(_) => open.min_by_key(|(_, elapsed, _)| *elapsed),
            Budget::Passes(_) => open.min_by_key(|(renderer, ..)| renderer.passes()),
        };
        let Some((renderer, elapsed, snapshots)) = next else { break };
        let start = Instant::now();
        renderer.pass();
        *elapsed += start.elapsed();
        let passes = renderer.passes();
        if passes.is_power_of_two() || is_spent(plan.budget, passes, *elapsed) {
            let image = renderer.film().image(passes);
            let errors = Metric::ALL.map(|metric| metric.between(&image, reference));
            snapshots.push(Snapshot { passes, seconds: elapsed.as_secs_f64(), errors });
        }
    }
    let finish = |((renderer, _, snapshots), kind): ((Renderer<'_>, _, _), &IntegratorKind)| {
        let statistics = renderer.statistics();
        Measured {
            kind: *kind,
            snapshots,
            image: renderer.film().image(renderer.passes()),
            rays: statistics.rays.total(),
            rejected: statistics.rejected.values().sum(),
        }
    };
    runs.into_iter().zip(&plan.integrators).map(finish).collect()
}

/// bdpt with the layers of a set: the image, and what there is light in. An even number of passes, for two half images.
fn layered(
    scene: &Scene,
    plan: &Plan,
    set: LayerSet,
    max_depth: u32,
    budget: Budget,
) -> Result<(Reference, Vec<Part>), LayerError> {
    let settings = Settings {
        max_depth,
        // Only of independent numbers are the two halves independent.
        sampler: SamplerKind::Independent,
        ..settings(scene, plan, IntegratorKind::Bdpt, 1000 + set as u64)
    };
    let renderer = Renderer::new(scene, &settings);
    let layers = Layers::new(&[set], &[], scene, renderer.integrator())?;
    let mut renderer = renderer.with_layers(&layers);
    let start = Instant::now();
    while !is_spent(budget, renderer.passes(), start.elapsed()) || renderer.passes() % 2 == 1 {
        renderer.pass();
    }
    let passes = renderer.passes();
    let image = renderer.film().image(passes);
    let [a, b] = [Half::Even, Half::Odd].map(|half| renderer.film().half_image(half, passes / 2));
    let all = f64::from(luminance(image.mean()));
    let part = |(name, film): (&str, &crate::film::Film)| {
        let image = film.image(passes);
        let share = if all > 0.0 { f64::from(luminance(image.mean())) / all } else { 0.0 };
        let name = name.split_once('.').map_or(name, |(_, name)| name).to_owned();
        Part { name, share, image }
    };
    let parts = layers.names().zip(renderer.layer_films()).map(part).filter(|part| part.share > 0.0).collect();
    Ok((Reference { image, own: Some(passes), noise: Some(half_image_rel_mse(&a, &b)) }, parts))
}

/// The exponent a of the power law y ∝ x^a that fits positive points best in logarithms (least squares); `None` if they are fewer than
/// two.
pub fn slope(points: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let logs: Vec<_> = points.filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mean_x, mean_y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let xx: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let xy: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    (xx > 0.0).then(|| xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_the_exponent_of_a_power_law() {
        let law = (0..6).map(|i| f64::from(1 << i)).map(|n| (n, 3.0 / n.sqrt()));
        assert!((slope(law).unwrap() + 0.5).abs() < 1e-12);
        assert_eq!(slope([(2.0, 1.0)].into_iter()), None);
        assert_eq!(slope([(2.0, 0.0), (4.0, 1.0)].into_iter()), None, "zero has no logarithm");
    }
}
