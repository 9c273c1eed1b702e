//! Do the integrators agree on a scene? The agreement test of this project's own suite, on any scene and within a given
//! time.
//!
//! Every integrator samples the same integral by another table of strategies. Their images are independent estimates of
//! one quantity wherever both cover the paths, so a difference beyond chance is a mistake in one of them.
//!
//! * **Replicates.** Each pass over the image has random numbers of its own, so passes are independent replicates, and
//!   variances come from them alone. Time goes to the integrators in turn, to the one whose noise a second reduces
//!   most.
//! * **Classes.** Every path is in one [`Class`]. Two integrators are compared class by class, and on the sum of all
//!   scattered light, over the paths that both *cover*, path by path ([`is_covered`](crate::path::is_covered)).
//! * **Test.** Welch's t over channels and tiles; Šidák's correction over these, over all pairs and classes, and over
//!   the two looks at the results: together [`FAMILY`]. A suspicion is tested again with fresh seeds, and is a
//!   disagreement only if they confirm it.
//! * **Rare finds.** The variance of a heavy tail cannot be estimated from a run that has not met it. It is predicted
//!   from what the other integrators find: see the module `rare`.
//! * **Merges.** What merges is compared within a fixed radius r/2, and its bias is bounded by rendering within r as
//!   well: a bias that falls at least in proportion to the radius is smaller than the difference of the two. The square
//!   of the difference is a further error, region by region.
//! * **The bar.** "Agree" means that no difference was found *and* that a bias of [`Plan::bar`] of the image's mean
//!   would have been. Two per cent is what a person would not see in a side by side comparison and is well below every
//!   mistake that we know of (a lost shading-normal factor, a light counted twice, a roulette out of balance: 6 to 70 %
//!   in other renderers).

mod class;
mod contest;
mod judge;
mod rare;
mod tally;
#[cfg(test)]
mod tests;

use std::{ops::ControlFlow, time::Duration};

pub use self::{
    class::Class,
    contest::Found,
    judge::{FAMILY, Row, Scope, Verdict},
};
use self::{
    contest::sample,
    judge::Evidence,
    tally::{Covering, Films, Setting},
};
use crate::{
    film::Image,
    integrator::{Integrator, IntegratorKind},
    path::Roulette,
    render::{MergeRadius, Settings},
    sampling::SamplerKind,
    scene::Scene,
    statistics::TILES,
};

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// After so much time. A suspicion in its second half takes half as long again.
    Time(Duration),
    /// After so many passes of each integrator, and as many again after a suspicion: reproducible.
    Passes(u32),
}

impl Budget {
    /// A look at the results comes when half of the time is over: a suspicion leaves the rest to fresh seeds.
    fn looks(self) -> f64 {
        match self {
            Self::Time(_) => 2.0,
            Self::Passes(_) => 1.0,
        }
    }

    fn part(self) -> Self {
        match self {
            Self::Time(time) => Self::Time(time / 2),
            passes @ Self::Passes(_) => passes,
        }
    }
}

/// What to compare, and for how long.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The integrators, different ones: two at least and eight at most, none of them [`IntegratorKind::Area`].
    pub integrators: Vec<IntegratorKind>,
    /// The longest path, in edges.
    pub max_depth: u32,
    /// When Russian roulette may end a subpath.
    pub roulette: Roulette,
    /// All random numbers follow from it.
    pub seed: u64,
    /// When to stop.
    pub budget: Budget,
    /// The bias that has to be visible for integrators to agree, as a fraction of the image's mean.
    pub bar: f64,
}

/// An integrator in a [`Report`].
#[derive(Clone, Debug)]
pub struct Contestant {
    /// Which.
    pub kind: IntegratorKind,
    /// Samples per pixel.
    pub passes: usize,
    /// Time spent.
    pub elapsed: Duration,
    /// The part of the image that it does not cover, as the others see it.
    pub uncovered: f64,
    /// The classes that it does not cover or covers in part, with the uncovered part of the image, largest first.
    pub uncovered_classes: Vec<(Class, f64)>,
    /// The mean image.
    pub image: Image,
    /// Contributions that are no number, or that the film could not hold: a mistake by itself.
    pub rejected: u64,
}

/// A class in a [`Report`].
#[derive(Clone, Copy, Debug)]
pub struct ClassShare {
    /// Which.
    pub class: Class,
    /// Its part of the image, lights included.
    pub share: f64,
    /// The part of the image in it that one integrator alone covers, so that nothing vouches for it.
    pub alone: f64,
}

/// What all comparisons come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All agree, as far as anything would have been seen.
    Agree,
    /// A confirmed difference.
    Disagree,
    /// Too noisy to say.
    Undecided,
}

/// The difference of a pair.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The comparison with the smallest p-value.
    pub row: Row,
    /// First minus second, of the paths that both cover.
    pub difference: Image,
    /// p-values of the tiles, [`TILES`] in a row.
    pub tiles: Vec<f64>,
}

/// What a verification came to.
#[derive(Clone, Debug)]
pub struct Report {
    /// The sum of it.
    pub outcome: Outcome,
    /// In the order of the plan.
    pub integrators: Vec<Contestant>,
    /// The classes in which there is light.
    pub classes: Vec<ClassShare>,
    /// The comparisons, pair by pair.
    pub rows: Vec<Row>,
    /// The mean of the image and its channels, of what the integrators find together.
    pub mean: f64,
    /// The part of the image that are lights seen directly, in mirrors and through glass.
    pub lights: f64,
    /// Whether a suspicion was tested with fresh seeds.
    pub retested: bool,
    /// How many times as long a run would be long enough, if this one was not.
    pub longer: Option<f64>,
    /// The most different pair.
    pub worst: Option<Picture>,
}

impl Report {
    /// The largest of the biases that the comparisons could have missed, as a fraction of the image; of those that
    /// count.
    pub fn visible(&self) -> f64 {
        let counts = |row: &&Row| !matches!(row.verdict, Verdict::Faint | Verdict::SameStrategy);
        self.rows.iter().filter(counts).map(|row| row.visible).fold(0.0, f64::max)
    }
}

/// Compares the plan's integrators on a scene, on the current rayon pool. `progress` hears the part of the budget that
/// is spent, which may exceed 1 while a late suspicion is tested, and may end it: then there is what two passes of each
/// say, or more.
///
/// # Panics
/// With fewer than two integrators or more than eight, the same one twice, or area sampling; with a budget of fewer
/// than two passes; if the camera's sensor is padded.
pub fn verify(scene: &Scene, plan: &Plan, progress: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Report {
    let Plan { integrators: kinds, max_depth, roulette, budget, .. } = plan;
    assert!((2..=Covering::MOST).contains(&kinds.len()) && kinds.iter().all(|k| k.has_strategies()), "{kinds:?}");
    assert!((1..kinds.len()).all(|i| !kinds[..i].contains(&kinds[i])), "{kinds:?}");
    assert!(!matches!(budget, Budget::Passes(0..2)), "a variance needs two passes");
    let sensor = scene.camera.sensor();
    assert_eq!(sensor.padding, 0);
    let merge_radius = merge_radius(scene);
    let table =
        |kind: &IntegratorKind| Integrator::new(*kind, sensor, *max_depth, *roulette).merging_within(merge_radius);
    let tables = kinds.iter().map(table).collect();
    let setting = Setting::new(scene, tables);
    let films: Vec<_> = kinds.iter().map(|_| Films::new()).collect();
    let nothing = || kinds.iter().map(|kind| Found::new(*kind, kinds.len())).collect::<Vec<_>>();
    let mut spend = |found: &mut Vec<Found>, stage: u64, parts: (f64, f64)| {
        let settings: Vec<_> = (0..kinds.len()).map(|i| settings(scene, plan, i, stage)).collect();
        let mut part = |part: f64| progress(parts.0 + part * parts.1);
        sample(scene, &setting, &settings, &films, found, budget.part(), &mut part);
    };

    let mut found = nothing();
    let share = 1.0 / budget.looks();
    spend(&mut found, 0, (0.0, share));
    let suspects = |found: &[Found]| {
        let mut rows = Evidence::new(&setting, found).compare(plan.bar, budget.looks());
        rows.retain(|row| row.differs);
        rows
    };
    let mut suspected = suspects(&found);
    let mut stage = 1;
    if suspected.is_empty() && budget.looks() > 1.0 {
        spend(&mut found, stage, (share, share));
        stage += 1;
        suspected = suspects(&found);
    }
    let mut confirmed = Vec::new();
    if !suspected.is_empty() {
        let mut fresh = nothing();
        spend(&mut fresh, stage, (f64::from(stage as u32) * share, share));
        let same = Evidence::new(&setting, &fresh).confirm(&suspected);
        confirmed = suspected.iter().zip(same).filter(|x| x.1).map(|(row, _)| (row.pair, row.scope)).collect();
        found.iter_mut().zip(fresh).for_each(|(all, part)| all.merge(part));
    }
    conclude(scene, plan, &setting, &found, &films, &confirmed, !suspected.is_empty())
}

/// The radius of the merges that are compared, m.
fn merge_radius(scene: &Scene) -> f32 {
    /// As in a render of this many passes.
    const PASS: u32 = 16;
    MergeRadius::of(scene, None).of_pass(PASS)
}

/// The settings of integrator `i` in a stage: its seed is no other's.
fn settings(scene: &Scene, plan: &Plan, i: usize, stage: u64) -> Settings {
    // A step of an odd constant visits every seed once (the one of SplitMix64, Steele et al. 2014).
    let number = 1 + stage * Covering::MOST as u64 + i as u64;
    Settings {
        integrator: plan.integrators[i],
        max_depth: plan.max_depth,
        min_depth: 1,
        roulette: plan.roulette,
        // Passes are replicates only if their numbers have nothing to do with each other.
        sampler: SamplerKind::Independent,
        merge_radius: plan.integrators[i].merges().then(|| merge_radius(scene)),
        seed: plan.seed.wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15)),
        ..Settings::new(scene.camera.sensor())
    }
}

fn conclude(
    scene: &Scene,
    plan: &Plan,
    setting: &Setting,
    found: &[Found],
    films: &[Films],
    confirmed: &[((usize, usize), Scope)],
    retested: bool,
) -> Report {
    let evidence = Evidence::new(setting, found);
    let mut rows = evidence.compare(plan.bar, plan.budget.looks());
    for row in rows.iter_mut().filter(|row| confirmed.contains(&(row.pair, row.scope))) {
        row.verdict = Verdict::Disagree;
    }
    let conclusion = Conclusion { whole: evidence.mean(|_| true).iter().sum::<f64>(), evidence, scene, found, films };
    let open = rows.iter().filter(|row| row.verdict.is_open());
    // What fresh seeds left in doubt wants to be seen twice as sharply.
    let needed = open.map(|row| if row.differs { 4.0 } else { row.longer }).reduce(f64::max);
    let nothing_to_compare = rows.is_empty() && conclusion.whole > 0.0;
    let outcome = if rows.iter().any(|row| row.verdict == Verdict::Disagree) {
        Outcome::Disagree
    } else if needed.is_some() || nothing_to_compare {
        Outcome::Undecided
    } else {
        Outcome::Agree
    };
    let most_different = rows.iter().min_by(|a, b| a.p.total_cmp(&b.p)).cloned();
    Report {
        outcome,
        classes: conclusion.evidence.classes().iter().map(|class| conclusion.share(*class)).collect(),
        lights: conclusion.part(|group| !group.class.is_scattered()),
        mean: conclusion.whole / 3.0,
        integrators: (0..found.len()).map(|i| conclusion.contestant(i)).collect(),
        rows,
        retested,
        longer: needed,
        worst: most_different.map(|row| conclusion.picture(row)),
    }
}

/// All that was found, and what a report says of it.
struct Conclusion<'a> {
    evidence: Evidence<'a>,
    /// The sum of the channels of the mean of the image.
    whole: f64,
    scene: &'a Scene,
    found: &'a [Found],
    films: &'a [Films],
}

impl Conclusion<'_> {
    /// The part of the image in these groups.
    fn part(&self, wanted: impl Fn(&tally::Group) -> bool) -> f64 {
        if self.whole > 0.0 { self.evidence.mean(wanted).iter().sum::<f64>() / self.whole } else { 0.0 }
    }

    /// The mean image of integrator `i`, of the paths that all of `who` cover.
    fn image(&self, i: usize, who: Covering) -> Image {
        self.films[i].image(who, self.scene.camera.sensor(), self.found[i].passes.len())
    }

    fn contestant(&self, i: usize) -> Contestant {
        let own = Covering::of(&[i]);
        let missing = |class: Option<Class>| {
            self.part(|group| class.is_none_or(|class| group.class == class) && !group.covering.holds(own))
        };
        let by_class = self.evidence.classes().iter().map(|class| (*class, missing(Some(*class))));
        let mut uncovered_classes: Vec<_> = by_class.filter(|(_, part)| *part > 0.0).collect();
        uncovered_classes.sort_by(|a, b| b.1.total_cmp(&a.1));
        let found = &self.found[i];
        Contestant {
            kind: found.kind,
            passes: found.passes.len(),
            elapsed: found.elapsed,
            uncovered: missing(None),
            uncovered_classes,
            image: self.image(i, Covering(0)),
            rejected: found.statistics.rejected.values().sum::<u64>() + self.films[i].faults(),
        }
    }

    fn share(&self, class: Class) -> ClassShare {
        ClassShare {
            class,
            share: self.part(|group| group.class == class),
            alone: self.part(|group| group.class == class && group.covering.0.is_power_of_two()),
        }
    }

    fn picture(&self, row: Row) -> Picture {
        let both = Covering::of(&[row.pair.0, row.pair.1]);
        let (mut difference, second) = (self.image(row.pair.0, both), self.image(row.pair.1, both));
        difference.pixels.iter_mut().zip(second.pixels).for_each(|(a, b)| *a -= b);
        let tiles = self.evidence.tiles(&row);
        debug_assert_eq!(tiles.len(), TILES * TILES);
        Picture { row, difference, tiles }
    }
}
