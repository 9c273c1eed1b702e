//! How fast integrators converge on a scene: their errors against one reference, with samples and with time.
//!
//! Integrators take passes in turn, always the one that has had the least of the budget: whatever slows the machine for
//! a while slows all of them. Errors are measured outside the clock, whenever the number of passes is a power of two
//! and at the end.

use std::{
    fmt,
    ops::ControlFlow,
    time::{Duration, Instant},
};

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
    /// Of bdpt, if it was made here.
    pub own: Option<Own>,
    /// Its relMSE, as its own half images show it; unknown for a given one.
    pub noise: Option<f64>,
}

/// What a reference of one's own took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Own {
    /// Samples per pixel.
    pub passes: u32,
    /// Time, apart from that of the integrators.
    pub seconds: f64,
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
    /// The error by one metric.
    pub fn error(&self, metric: Metric) -> f64 {
        self.errors[metric as usize]
    }

    /// The root of a squared error, which falls as N^(−½).
    pub fn root(&self, metric: Metric) -> f64 {
        self.error(metric).sqrt()
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

    /// 1/(error × seconds); `None` if the image is the reference.
    pub fn efficiency(&self, metric: Metric) -> Option<f64> {
        let product = self.end().error(metric) * self.end().seconds;
        (product > 0.0).then(|| product.recip())
    }

    /// How the root of a squared error falls with the number of samples: see [`power_law`].
    pub fn law(&self, metric: Metric) -> Option<PowerLaw> {
        power_law(self.snapshots.iter().map(|s| (f64::from(s.passes), s.root(metric))))
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
    /// Whether it was ended before its time: everything is there, from fewer samples.
    pub ended_early: bool,
}

/// How far the measuring is.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// What is measured.
    pub what: &'static str,
    /// The part of all the work that is done, from 0 to 1.
    pub part: f64,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.0} %: {}", 100.0 * self.part, self.what)
    }
}

/// Who hears how far it is, and may end it.
type Hear<'a> = &'a mut dyn FnMut(Stage) -> ControlFlow<()>;

/// Measures the plan's integrators on a scene, on the current rayon pool, against `given` or a bdpt run of its own.
/// `hear` is told how far it is after every pass, and may end it: what is there by then is reported.
///
/// # Errors
/// If the layers cannot be made.
///
/// # Panics
/// Without an integrator, or if `given` has another size than the camera's image.
pub fn converge(scene: &Scene, plan: &Plan, given: Option<Image>, hear: Hear<'_>) -> Result<Report, LayerError> {
    assert!(!plan.integrators.is_empty());
    let mut course = Course::new(plan, hear);
    let what = if given.is_some() { "path classes, by bdpt" } else { "reference and path classes, by bdpt" };
    course.begin(what, amount(plan.reference));
    let (own, classes) = layered(scene, plan, LayerSet::Classes, (plan.max_depth, plan.reference), &mut course)?;
    let reference = given.map_or(own, |image| Reference { image, own: None, noise: None });
    course.begin("technique images, by bdpt", amount(plan.budget));
    let short = (plan.max_depth.min(PYRAMID_DEPTH), plan.budget);
    let (_, pyramid) = layered(scene, plan, LayerSet::Strategies, short, &mut course)?;
    course.begin("the integrators in turn", amount(plan.budget) * plan.integrators.len() as f64);
    let measured = measure(scene, plan, &reference.image, &mut course);
    let agreement = (plan.integrators.len() > 1).then(|| {
        let budget = match plan.budget {
            Budget::Passes(passes) => Budget::Passes(passes.max(2)),
            time @ Budget::Time(_) => time,
        };
        course.begin("agreement of the integrators", amount(plan.budget));
        let plan = verify::Plan {
            integrators: plan.integrators.clone(),
            max_depth: plan.max_depth,
            roulette: plan.roulette.unwrap_or_default(),
            seed: plan.seed,
            budget,
            bar: 0.02,
        };
        verify::verify(scene, &plan, &mut |part| course.is_at(part))
    });
    Ok(Report { reference, measured, classes, pyramid, agreement, ended_early: course.ended })
}

/// The work of one budget, in a unit that does for comparing those of a plan.
fn amount(budget: Budget) -> f64 {
    match budget {
        Budget::Time(time) => time.as_secs_f64(),
        Budget::Passes(passes) => f64::from(passes),
    }
}

/// Where in the plan the measuring is.
struct Course<'a> {
    hear: Hear<'a>,
    what: &'static str,
    /// The work of the whole plan, that before this stage, and that of it.
    whole: f64,
    before: f64,
    own: f64,
    ended: bool,
}

impl<'a> Course<'a> {
    fn new(plan: &Plan, hear: Hear<'a>) -> Self {
        let each = amount(plan.budget);
        let agreement = if plan.integrators.len() > 1 { each } else { 0.0 };
        let whole = amount(plan.reference) + each + each * plan.integrators.len() as f64 + agreement;
        Self { hear, what: "", whole, before: 0.0, own: 0.0, ended: false }
    }

    fn begin(&mut self, what: &'static str, own: f64) {
        (self.what, self.before, self.own) = (what, self.before + self.own, own);
    }

    /// This part of the stage is done. Once it has been asked to end, every stage is to end.
    fn is_at(&mut self, part: f64) -> ControlFlow<()> {
        let part = ((self.before + self.own * part.min(1.0)) / self.whole).min(1.0);
        self.ended |= (self.hear)(Stage { what: self.what, part }).is_break();
        if self.ended { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// The settings of `render` for this integrator; each has random numbers of its own.
fn settings(scene: &Scene, plan: &Plan, kind: IntegratorKind, number: u64) -> Settings {
    Settings {
        integrator: kind,
        max_depth: plan.max_depth.min(kind.description().longest_path),
        roulette: plan.roulette.unwrap_or(kind.description().roulette),
        sampler: kind.description().sampler,
        weights: kind.description().weights,
        seed: plan.seed.wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15)),
        ..Settings::new(scene.camera.sensor())
    }
}

/// Whether so much is all of the budget.
fn is_spent(budget: Budget, passes: u32, elapsed: Duration) -> bool {
    passes > 0 && spent(budget, passes, elapsed) >= 1.0
}

/// The part of the budget that this is.
fn spent(budget: Budget, passes: u32, elapsed: Duration) -> f64 {
    match budget {
        Budget::Time(all) => elapsed.as_secs_f64() / all.as_secs_f64(),
        Budget::Passes(all) => f64::from(passes) / f64::from(all),
    }
}

fn measure(scene: &Scene, plan: &Plan, reference: &Image, course: &mut Course<'_>) -> Vec<Measured> {
    let kinds = plan.integrators.iter().zip(1..);
    let settings: Vec<_> = kinds.map(|(kind, number)| settings(scene, plan, *kind, number)).collect();
    let mut runs: Vec<_> =
        settings.iter().map(|settings| (Renderer::new(scene, settings), Duration::ZERO, Vec::new())).collect();
    let snapshot = |renderer: &Renderer<'_>, elapsed: Duration| {
        let passes = renderer.passes();
        let image = renderer.film().image(passes);
        let errors = Metric::ALL.map(|metric| metric.between(&image, reference));
        Snapshot { passes, seconds: elapsed.as_secs_f64(), errors }
    };
    loop {
        let parts = runs.iter().map(|(r, elapsed, _)| spent(plan.budget, r.passes(), *elapsed).min(1.0));
        let ended = course.is_at(parts.sum::<f64>() / runs.len() as f64).is_break();
        let open = runs.iter_mut().filter(|(r, elapsed, _)| !is_spent(plan.budget, r.passes(), *elapsed));
        // Each has a pass at least.
        let open = open.filter(|(renderer, ..)| !ended || renderer.passes() == 0);
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
            snapshots.push(snapshot(renderer, *elapsed));
        }
    }
    let finish = |((renderer, elapsed, mut snapshots), kind): ((Renderer<'_>, _, Vec<Snapshot>), &IntegratorKind)| {
        if snapshots.last().is_none_or(|last| last.passes < renderer.passes()) {
            snapshots.push(snapshot(&renderer, elapsed));
        }
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
    (max_depth, budget): (u32, Budget),
    course: &mut Course<'_>,
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
    loop {
        let (passes, elapsed) = (renderer.passes(), start.elapsed());
        let ended = course.is_at(spent(budget, passes, elapsed)).is_break();
        if (ended && passes > 0 || is_spent(budget, passes, elapsed)) && passes.is_multiple_of(2) {
            break;
        }
        renderer.pass();
    }
    let own = Own { passes: renderer.passes(), seconds: start.elapsed().as_secs_f64() };
    let passes = own.passes;
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
    Ok((Reference { image, own: Some(own), noise: Some(half_image_rel_mse(&a, &b)) }, parts))
}

/// y = c x^a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// c.
    pub factor: f64,
    /// a: the slope in logarithms.
    pub exponent: f64,
}

impl PowerLaw {
    /// y at `x`.
    pub fn at(self, x: f64) -> f64 {
        self.factor * x.powf(self.exponent)
    }
}

/// The power law that fits positive points best in logarithms (least squares); `None` if they are fewer than two.
pub fn power_law(points: impl Iterator<Item = (f64, f64)>) -> Option<PowerLaw> {
    let logs: Vec<_> = points.filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mean_x, mean_y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let xx: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let xy: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    (xx > 0.0).then(|| PowerLaw { factor: (mean_y - mean_x * xy / xx).exp(), exponent: xy / xx })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_the_exponent_of_a_power_law() {
        let law = (0..6).map(|i| f64::from(1 << i)).map(|n| (n, 3.0 / n.sqrt()));
        let fitted = power_law(law).unwrap();
        assert!((fitted.exponent + 0.5).abs() < 1e-12 && (fitted.at(16.0) - 0.75).abs() < 1e-12);
        assert_eq!(power_law([(2.0, 1.0)].into_iter()), None);
        assert_eq!(power_law([(2.0, 0.0), (4.0, 1.0)].into_iter()), None, "zero has no logarithm");
    }
}
