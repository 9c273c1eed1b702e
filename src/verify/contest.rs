//! Rendering with all integrators in turn, so that each has the time that its noise needs.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use super::{
    Budget, Class,
    rare::Sizes,
    tally::{Films, Look, Pass, Setting, Tally},
};
use crate::{
    film::Half,
    integrator::IntegratorKind,
    render::{Renderer, Settings, Statistics},
    scene::Scene,
};

/// Passes of every integrator before their noise is compared: enough for a first variance.
const FIRST: usize = 8;
/// Every so many passes the sizes of finds are looked at.
const LOOK_EVERY: usize = 8;
/// The part of the time that is shared in equal parts, whatever the noise seems to be: a variance that looks small may
/// only have missed what is rare.
const EQUAL_SHARE: f64 = 1.0 / 3.0;

/// What an integrator has found so far.
pub struct Found {
    /// Which.
    pub kind: IntegratorKind,
    /// Its independent replicates: one for each pass.
    pub passes: Vec<Pass>,
    /// As many of what merges, within twice the radius.
    pub(super) wide: Vec<Pass>,
    /// Time spent.
    pub elapsed: Duration,
    /// Samples, rays and contributions that are no number.
    pub statistics: Statistics,
    pub(super) sizes: Sizes,
    /// Passes whose sizes are in `sizes`.
    pub(super) watched: usize,
    scattered: Running,
}

impl Found {
    pub(super) fn new(kind: IntegratorKind, integrators: usize) -> Self {
        Self {
            kind,
            passes: Vec::new(),
            wide: Vec::new(),
            elapsed: Duration::ZERO,
            statistics: Statistics::default(),
            sizes: Sizes::new(integrators),
            watched: 0,
            scattered: Running::default(),
        }
    }

    /// Adds what was found apart.
    pub(super) fn merge(&mut self, other: Self) {
        other.passes.iter().for_each(|pass| self.scattered.add(scattered(pass)));
        self.passes.extend(other.passes);
        self.wide.extend(other.wide);
        self.elapsed += other.elapsed;
        self.statistics.add(&other.statistics);
        self.sizes.add(&other.sizes);
        self.watched += other.watched;
    }

    /// How much a second of this integrator lowers the squared error of its mean image: σ²/(n² c) for passes that cost
    /// c.
    fn urgency(&self) -> f64 {
        let n = self.passes.len() as f64;
        let cost = self.elapsed.as_secs_f64() / n;
        self.scattered.variance() / (n * n * cost)
    }
}

/// Mean and variance of a sequence (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
struct Running {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Running {
    fn add(&mut self, x: f64) {
        self.count += 1.0;
        let from_old = x - self.mean;
        self.mean += from_old / self.count;
        self.squares += from_old * (x - self.mean);
    }

    fn variance(self) -> f64 {
        self.squares / (self.count - 1.0).max(1.0)
    }
}

/// Adds passes with `settings`' seeds to what was found, until the budget is spent. `progress` is told the part that
/// is, and may end it.
pub(super) fn sample(
    scene: &Scene,
    setting: &Setting,
    settings: &[Settings],
    films: &[Films],
    found: &mut [Found],
    budget: Budget,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) {
    let wide: Vec<_> = settings.iter().map(wide).collect();
    let renderers = settings.iter().zip(&wide).map(|(own, wide)| Renderers {
        own: Renderer::new(scene, own),
        wide: wide.as_ref().map(|wide| Renderer::new(scene, wide)),
    });
    let mut renderers: Vec<_> = renderers.collect();
    let start = Instant::now();
    let spent: Vec<_> = found.iter().map(|f| f.elapsed).collect();
    loop {
        let done = |i: usize| renderers[i].own.passes() as usize;
        let all = 0..found.len();
        let (next, part) = match budget {
            Budget::Passes(goal) => {
                let total = goal as usize * found.len();
                (all.clone().min_by_key(|i| done(*i)), all.map(done).sum::<usize>() as f64 / total as f64)
            }
            Budget::Time(goal) => {
                let since = |i: usize| (found[i].elapsed - spent[i]).as_secs_f64();
                let least = all.clone().min_by(|a, b| since(*a).total_cmp(&since(*b)));
                let fair = EQUAL_SHARE * start.elapsed().as_secs_f64() / found.len() as f64;
                let next = all
                    .clone()
                    .find(|i| done(*i) < 2)
                    .or(all.clone().filter(|i| found[*i].passes.len() < FIRST).min_by_key(|i| done(*i)))
                    .or(least.filter(|i| since(*i) < fair))
                    .or(all.max_by(|a, b| found[*a].urgency().total_cmp(&found[*b].urgency())));
                (next, start.elapsed().as_secs_f64() / goal.as_secs_f64())
            }
        };
        let ended = progress(part.min(1.0)).is_break();
        // Two passes are a variance: without them nothing can be said at all, however short the time was.
        let said_nothing = (ended || matches!(budget, Budget::Time(_))) && (0..found.len()).any(|i| done(i) < 2);
        let Some(next) = next.filter(|_| (part < 1.0 && !ended) || said_nothing) else { break };
        pass(setting, &mut renderers[next], &films[next], &mut found[next], next);
    }
    for (found, Renderers { own, wide }) in found.iter_mut().zip(&renderers) {
        found.statistics.add(&own.statistics());
        wide.iter().for_each(|wide| found.statistics.add(&wide.statistics()));
    }
}

/// What renders for an integrator.
struct Renderers<'a> {
    own: Renderer<'a>,
    /// Of what merges.
    wide: Option<Renderer<'a>>,
}

/// The settings of what merges, with twice the radius.
fn wide(settings: &Settings) -> Option<Settings> {
    let merge_radius = settings.merge_radius.map(|radius| 2.0 * radius);
    // Any seed but those of all integrators would do.
    let seed = !settings.seed;
    settings.integrator.merges().then(|| Settings { merge_radius, seed, ..settings.clone() })
}

fn pass(setting: &Setting, renderers: &mut Renderers<'_>, films: &Films, found: &mut Found, own: usize) {
    let start = Instant::now();
    let number = found.passes.len();
    let look = if number.is_multiple_of(LOOK_EVERY) { Look::Sizes } else { Look::Sums };
    let half = Half::of_pass(number as u32);
    let (pass, sizes) = Tally::sum(renderers.own.pass_into(|| Tally::new(setting, own, Some(films), half, look)));
    if let Some(wide) = &mut renderers.wide {
        found.wide.push(Tally::sum(wide.pass_into(|| Tally::new(setting, own, None, half, Look::Sums))).0);
    }
    if let Some(sizes) = sizes {
        found.sizes.add(&sizes);
        found.watched += 1;
    }
    found.scattered.add(scattered(&pass));
    found.passes.push(pass);
    found.elapsed += start.elapsed();
}

/// The mean of a pass's image without the lights themselves.
fn scattered(pass: &Pass) -> f64 {
    let groups = pass.iter().filter(|(group, _)| group.class.is_scattered());
    groups.map(|(_, regions)| regions[..3].iter().sum::<f64>()).sum()
}

/// The classes in which anything was found, in order.
pub(super) fn classes(found: &[Found]) -> Vec<Class> {
    let seen =
        |class: &Class| found.iter().flat_map(|f| f.passes.iter().flatten()).any(|(group, _)| group.class == *class);
    Class::ALL.into_iter().filter(seen).collect()
}
