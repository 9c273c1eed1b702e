//! From what the integrators found to verdicts.

use statrs::distribution::{ContinuousCDF, Normal};

use super::{
    Class,
    contest::{Found, classes},
    tally::{Covering, Group, Pass, Setting},
};
use crate::statistics::{Comparison, Estimate, REGIONS, Regions, TILES, each_of, p_values};

/// The probability that integrators which agree are suspected in one look at all comparisons together. A suspicion has
/// to be confirmed by fresh seeds, at the same level, before it is called a disagreement.
pub const FAMILY: f64 = 1e-3;
/// A run is not extended beyond this factor in a forecast.
const LONGEST: f64 = 1e7;

/// Which paths of a pair are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Scope {
    /// All that were scattered on their way: the image without the lights themselves.
    Scattered,
    /// One class.
    Of(Class),
}

impl Scope {
    fn contains(self, class: Class) -> bool {
        match self {
            Self::Scattered => class.is_scattered(),
            Self::Of(own) => class == own,
        }
    }

    /// Its name in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scattered => "all scattered light",
            Self::Of(class) => class.name(),
        }
    }
}

/// What a comparison came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No difference, and a bias as large as the bar would have been seen.
    Agree,
    /// A difference that fresh seeds confirmed.
    Disagree,
    /// A difference that fresh seeds did not confirm, but have not made go away either.
    Unconfirmed,
    /// No difference, but a bias larger than the bar could hide.
    TooNoisy,
    /// So little light that twice as much would stay under the bar.
    Faint,
    /// No difference, and all integrators do the same here: noise says nothing about them.
    SameStrategy,
}

impl Verdict {
    /// In two words at most.
    pub fn name(self) -> &'static str {
        match self {
            Self::Agree => "agree",
            Self::Disagree => "DISAGREE",
            Self::Unconfirmed => "unconfirmed",
            Self::TooNoisy => "too noisy",
            Self::Faint => "faint",
            Self::SameStrategy => "same strategy",
        }
    }

    /// Whether it leaves the question open.
    pub fn is_open(self) -> bool {
        matches!(self, Self::TooNoisy | Self::Unconfirmed)
    }
}

/// A pair of integrators compared on the paths of a scope that both cover.
///
/// Fractions of the image are of its mean; for scattered light, of the mean without the lights themselves, which often
/// outshine all that they light. Of the three channels the largest fraction counts.
#[derive(Clone, Debug)]
pub struct Row {
    /// Indices of the integrators.
    pub pair: (usize, usize),
    /// The paths.
    pub scope: Scope,
    /// The p-value, corrected for the regions of the image but not for the number of comparisons.
    pub p: f64,
    /// The region with the smallest p-value: see [`Regions`].
    pub worst: usize,
    /// The part of the image that these paths make.
    pub share: f64,
    /// (first − second) as a part of the image, of luminance.
    pub difference: f64,
    /// The smallest bias that would have been seen, as a part of the image.
    pub visible: f64,
    /// The same as a part of what is compared.
    pub visible_of_scope: f64,
    /// How many times longer the run would have to be to see a bias as large as the bar; at most 1 where it was long
    /// enough.
    pub longer: f64,
    /// What it came to.
    pub verdict: Verdict,
    pub(super) differs: bool,
}

/// Everything that was found, ready for comparisons.
pub struct Evidence<'a> {
    setting: &'a Setting,
    found: &'a [Found],
    classes: Vec<Class>,
    /// The mean of the image in each group, by the integrator that knows it best.
    groups: Vec<(Group, [f64; 3])>,
}

/// An estimate with the kinds of its error apart.
struct Known {
    replicates: Estimate,
    rare: Vec<f64>,
    /// The square of what bounds the bias of merges.
    bias: Vec<f64>,
}

impl Known {
    fn estimate(self) -> Estimate {
        let Self { replicates, rare, bias } = self;
        replicates.with_further_error(&rare).with_further_error(&bias)
    }
}

impl<'a> Evidence<'a> {
    pub(super) fn new(setting: &'a Setting, found: &'a [Found]) -> Self {
        let mut this = Self { setting, found, classes: classes(found), groups: Vec::new() };
        let mut groups: Vec<_> =
            found.iter().flat_map(|f| f.passes.iter().flatten()).map(|(group, _)| *group).collect();
        groups.sort_unstable();
        groups.dedup();
        this.groups = groups.into_iter().map(|group| (group, this.best(group))).collect();
        this
    }

    /// The mean of a group, by the integrator with the smallest error.
    fn best(&self, group: Group) -> [f64; 3] {
        let error = |e: &Estimate| e.error2()[..3].iter().sum::<f64>();
        let all = (0..self.found.len()).filter(|i| group.covering.holds(Covering::of(&[*i])));
        let estimates = all.map(|i| self.known(i, Scope::Of(group.class), |set| set == group.covering, 1.0).estimate());
        let best = estimates.min_by(|a, b| error(a).total_cmp(&error(b)));
        best.map_or([0.0; 3], |e| [0, 1, 2].map(|c| e.mean()[c]))
    }

    /// What integrator `i` knows of the paths in `scope` whose covering set is `wanted`, after a run `longer` times as
    /// long.
    fn known(&self, i: usize, scope: Scope, wanted: impl Fn(Covering) -> bool, longer: f64) -> Known {
        let found = &self.found[i];
        let sums = |pass: &Pass| -> Regions {
            let mut sum = vec![0.0; REGIONS];
            let groups = pass.iter().filter(|(group, _)| scope.contains(group.class) && wanted(group.covering));
            groups.for_each(|(_, part)| sum.iter_mut().zip(part).for_each(|(s, p)| *s += p));
            sum
        };
        let estimate = |passes: &[Pass]| Estimate::new(&passes.iter().map(sums).collect::<Vec<_>>());
        let replicates = estimate(&found.passes);
        let rare = self.rare(i, scope, &replicates, longer);
        let mut bias = vec![0.0; REGIONS];
        if !found.wide.is_empty() {
            let wide = estimate(&found.wide);
            let differences = wide.mean().iter().zip(replicates.mean()).map(|(wide, own)| wide - own);
            bias.iter_mut().zip(differences).for_each(|(bound, x)| *bound = x * x);
        }
        Known { replicates, rare, bias }
    }

    /// The squared errors from what integrator `i` finds too rarely to know about, as the other integrators predict
    /// them.
    fn rare(&self, i: usize, scope: Scope, estimate: &Estimate, longer: f64) -> Vec<f64> {
        let passes = self.found[i].passes.len() as f64 * longer;
        let per_tile = self.setting.per_tile();
        let per_image = per_tile / (TILES * TILES) as f64;
        let luminance = estimate.mean()[3..].iter().sum::<f64>() / (TILES * TILES) as f64;
        let mut error2 = vec![0.0_f64; REGIONS];
        for class in self.classes.iter().filter(|class| scope.contains(**class)) {
            let mut largest = vec![0.0_f64; REGIONS];
            let others = self.found.iter().enumerate().filter(|(j, other)| *j != i && other.watched > 0);
            for (_, other) in others {
                let rare = other.sizes.rare(*class, i, passes, other.watched as f64, self.setting.unit);
                let (channels, tiles) = largest.split_at_mut(3);
                for (l, mean) in channels.iter_mut().zip(estimate.mean()) {
                    let colour = if luminance > 0.0 { mean / luminance } else { 1.0 };
                    *l = l.max(rare.image * (per_image * colour).powi(2));
                }
                tiles.iter_mut().zip(rare.tiles).for_each(|(l, r)| *l = l.max(r * per_tile * per_tile));
            }
            error2.iter_mut().zip(largest).for_each(|(sum, e)| *sum += e);
        }
        error2
    }

    /// The mean of the groups for which `wanted` holds, in each channel.
    pub(super) fn mean(&self, wanted: impl Fn(&Group) -> bool) -> [f64; 3] {
        let groups = self.groups.iter().filter(|(group, _)| wanted(group));
        groups.fold([0.0; 3], |sum, (_, mean)| [0, 1, 2].map(|c| sum[c] + mean[c]))
    }

    /// What fractions of the image are fractions of: the image without the lights themselves, if anything is left of
    /// it.
    pub(super) fn reference(&self, scope: Scope) -> [f64; 3] {
        let scattered = self.mean(|group| group.class.is_scattered());
        let lights = matches!(scope, Scope::Of(class) if !class.is_scattered());
        if lights || scattered.iter().all(|x| *x == 0.0) { self.mean(|_| true) } else { scattered }
    }

    /// The classes in which anything was found.
    pub(super) fn classes(&self) -> &[Class] {
        &self.classes
    }

    /// Every comparison, at a level that is shared by all of them and by `looks` looks. `bar` is a fraction of the
    /// image.
    pub(super) fn compare(&self, bar: f64, looks: f64) -> Vec<Row> {
        let n = self.found.len();
        let pairs: Vec<_> = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).collect();
        let compared = |(i, j): (usize, usize), scope: Scope| {
            let both = Covering::of(&[i, j]);
            self.groups.iter().any(|(group, _)| scope.contains(group.class) && group.covering.holds(both))
        };
        let scopes = || [Scope::Scattered].into_iter().chain(self.classes.iter().map(|class| Scope::Of(*class)));
        let tests: Vec<_> = pairs
            .iter()
            .flat_map(|pair| scopes().map(move |scope| (*pair, scope)))
            .filter(|(pair, scope)| compared(*pair, *scope))
            .collect();
        let level = each_of(FAMILY / looks, tests.len().max(1) as f64);
        tests.into_iter().map(|(pair, scope)| self.row(pair, scope, bar, level)).collect()
    }

    /// Whether these comparisons differ, at a level that they share.
    pub(super) fn confirm(&self, suspects: &[Row]) -> Vec<bool> {
        let level = each_of(FAMILY, suspects.len().max(1) as f64);
        suspects.iter().map(|row| self.comparison(level, row.pair, row.scope).differs()).collect()
    }

    /// The estimates of a pair in a scope, of the paths that both cover.
    fn estimates(&self, (i, j): (usize, usize), scope: Scope) -> (Estimate, Estimate) {
        let both = Covering::of(&[i, j]);
        let of = |i| self.known(i, scope, |set| set.holds(both), 1.0).estimate();
        (of(i), of(j))
    }

    fn comparison(&self, level: f64, pair: (usize, usize), scope: Scope) -> Comparison {
        let (a, b) = self.estimates(pair, scope);
        Comparison::at(level, &a, &b)
    }

    /// The p-values of the image's tiles in a comparison, row after row, each by itself.
    pub(super) fn tiles(&self, row: &Row) -> Vec<f64> {
        let (a, b) = self.estimates(row.pair, row.scope);
        p_values(&a, &b).split_off(3)
    }

    fn row(&self, pair: (usize, usize), scope: Scope, bar: f64, level: f64) -> Row {
        let (a, b) = self.estimates(pair, scope);
        let comparison = Comparison::at(level, &a, &b);
        let reference = self.reference(scope);
        let both = Covering::of(&[pair.0, pair.1]);
        let light = self.mean(|group| scope.contains(group.class) && group.covering.holds(both));
        let largest = |part: [f64; 3], whole: [f64; 3]| {
            (0..3).filter(|c| whole[*c] > 0.0).map(|c| part[c] / whole[c]).fold(0.0, f64::max)
        };
        let luminance = |e: &Estimate| e.mean()[3..].iter().sum::<f64>();
        let rgb = |[r, g, b]: [f64; 3]| f64::from(crate::math::Rgb::new(r as f32, g as f32, b as f32).luminance());
        let (visible, share) = (largest(comparison.visible, reference), largest(light, reference));
        let longer = self.longer(pair, scope, bar, level, reference);
        let differs = comparison.differs();
        let verdict = match scope {
            _ if differs => Verdict::Unconfirmed,
            _ if visible <= bar => Verdict::Agree,
            _ if share <= bar => Verdict::Faint,
            Scope::Of(class) if class.has_one_strategy() => Verdict::SameStrategy,
            _ => Verdict::TooNoisy,
        };
        Row {
            pair,
            scope,
            p: comparison.p,
            worst: comparison.worst,
            share,
            difference: (luminance(&a) - luminance(&b))
                / (TILES * TILES) as f64
                / rgb(reference).max(f64::MIN_POSITIVE),
            visible,
            visible_of_scope: largest(comparison.visible, light),
            longer,
            verdict,
            differs,
        }
    }

    /// How many times as long a run would have to be for a bias as large as the bar to be seen, in steps of a quarter.
    fn longer(&self, (i, j): (usize, usize), scope: Scope, bar: f64, level: f64, reference: [f64; 3]) -> f64 {
        let both = Covering::of(&[i, j]);
        let known = [i, j].map(|i| (i, self.known(i, scope, |set| set.holds(both), 1.0)));
        let normal = Normal::standard().inverse_cdf(1.0 - 0.5 * each_of(level, REGIONS as f64));
        let seen = |longer: f64| {
            let mut error2 = [0.0; 3];
            for (i, Known { replicates, bias, .. }) in &known {
                let rare = self.rare(*i, scope, replicates, longer);
                (0..3).for_each(|c| error2[c] += replicates.error2()[c] / longer + rare[c] + bias[c]);
            }
            (0..3).filter(|c| reference[*c] > 0.0).all(|c| normal * error2[c].sqrt() <= bar * reference[c])
        };
        let mut longer = 1.0;
        while longer < LONGEST && !seen(longer) {
            longer *= 1.25;
        }
        longer
    }
}
