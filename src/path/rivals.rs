//! Weights in constant time: running sums over the rivals of a strategy, filled in while a subpath is walked.
//!
//! Of all the strategies that could have found a path, those that connect three vertices or more before the present connection see nothing
//! of it: what they have against a strategy that connects further on is a matter of the subpath alone. So each vertex carries their sum
//! R_j = (p_other/p_own)^β (n_j^β + R_{j−1}), and a weight adds to it the two nearest on each side. That needs a table whose n_{s,t} is,
//! so far back, a matter of the subpath alone as well ([`Rivals::of`]); any other is summed whole ([`mis_weight`](super::mis_weight)).

use super::{
    Densities, Heuristic, Strategy, Techniques,
    mis::{effective_count, share},
};

/// What a table has against strategies further on, from both sides: the counts of the running sums.
#[derive(Clone, Debug)]
pub struct Rivals {
    /// Towards the lens, where s ≥ 3.
    pub camera: RunningSum,
    /// Towards the light, where t ≥ 4.
    pub light: RunningSum,
    /// The number that the running sums' counts are multiples of.
    unit: f32,
}

/// The rule of a running sum along the subpaths of one side.
#[derive(Clone, Debug, Default)]
pub struct RunningSum {
    /// n_j over a unit, by the number j of vertices from this side; empty if all are zero.
    counts: Box<[f32]>,
    exponent: Exponent,
}

/// β of the heuristic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Exponent {
    #[default]
    One,
    Two,
}

impl Exponent {
    #[inline(always)]
    fn of(self, x: f32) -> f32 {
        match self {
            Self::One => x,
            Self::Two => x * x,
        }
    }

    /// (ratio)^β (count^β + further): a vertex moves from one side to the other, and with it all further rivals.
    ///
    /// A ratio may overflow, and may be no number; neither makes anything of no rival. Nothing here is infinite, so that no product
    /// with zero is lost.
    #[inline(always)]
    fn moved(self, ratio: f32, count: f32, further: f32) -> f32 {
        let all = self.of(count) + further;
        if ratio > 0.0 && all > 0.0 { (self.of(ratio) * all).min(f32::MAX) } else { 0.0 }
    }
}

impl RunningSum {
    /// Whether there is anything to sum.
    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// R_j from R_{j−1}: `ratio` is p_other/p_own of the subpath's vertex j, counted from 0, and `connects` how many times its j-th
    /// edge, between the vertices j−1 and j, counts as one that can be connected (the table's count apart).
    #[inline(always)]
    pub(super) fn next(&self, j: usize, ratio: f32, connects: f32, before: f32) -> f32 {
        let count = self.counts.get(j).copied().unwrap_or(0.0);
        self.exponent.moved(ratio, count * connects, before)
    }
}

impl Rivals {
    /// The counts of a table in which n_{s,t} depends on t alone where s ≥ 3, and on s alone where t ≥ 4, among the strategies of all
    /// lengths; `None` for another, and for a rule that sums nothing.
    pub fn of(table: &Techniques, heuristic: Heuristic) -> Option<Self> {
        let exponent = match heuristic {
            Heuristic::Balance => Exponent::One,
            Heuristic::Power => Exponent::Two,
            Heuristic::FirstSupported => return None,
        };
        let longest = table.max_depth() + 1;
        let unit = table.camera_subpaths();
        let same_for_all = |mut counts: Vec<f32>| {
            let first = counts.pop().unwrap_or(0.0);
            counts.iter().all(|count| *count == first).then_some(first / unit)
        };
        let by_t =
            |t: u32| same_for_all((3..=longest.saturating_sub(t)).map(|s| table.count(Strategy { s, t })).collect());
        let by_s =
            |s: u32| same_for_all((4..=longest.saturating_sub(s)).map(|t| table.count(Strategy { s, t })).collect());
        let sum = |counts: Vec<f32>| {
            let any = counts.iter().any(|count| *count > 0.0);
            RunningSum { counts: if any { counts.into() } else { Box::default() }, exponent }
        };
        let camera = sum((0..longest).map(by_t).collect::<Option<_>>()?);
        let light = sum((0..longest).map(by_s).collect::<Option<_>>()?);
        Some(Self { camera, light, unit })
    }

    /// [`mis_weight`](super::mis_weight) from the running sums: `towards_camera` is that of p_{t−3}, `towards_light` that of p_{t+2}, zero
    /// where there is no such vertex in its subpath.
    #[inline(always)]
    pub fn weight(
        &self,
        path: &impl Densities,
        strategy: Strategy,
        techniques: &Techniques,
        [towards_camera, towards_light]: [f32; 2],
    ) -> f32 {
        let n = path.edges();
        let t = strategy.t;
        let exponent = self.camera.exponent;
        let count = |t: u32| effective_count(path, Strategy { s: n + 1 - t, t }, techniques);
        let per_own = 1.0 / count(t);
        let near = |t: u32| share(count(t), per_own);
        let further =
            |sum: f32| if sum > 0.0 { (exponent.of(share(self.unit, per_own)) * sum).min(f32::MAX) } else { 0.0 };
        let range = techniques.range(n);
        let up = |i: u32| path.camera_density(i).0 / path.light_density(i).0;
        let down = |i: u32| path.light_density(i).0 / path.camera_density(i).0;
        let (mut lower_s, mut higher_s) = (0.0, 0.0);
        if t < *range.end() {
            if t + 1 < *range.end() {
                lower_s = exponent.moved(up(t + 1), near(t + 2), further(towards_light));
            }
            lower_s = exponent.moved(up(t), near(t + 1), lower_s);
        }
        if t > *range.start() {
            if t - 1 > *range.start() {
                higher_s = exponent.moved(down(t - 2), near(t - 2), further(towards_camera));
            }
            higher_s = exponent.moved(down(t - 1), near(t - 1), higher_s);
        }
        1.0 / (1.0 + lower_s + mistake!(higher_s, HeuristicHalfSquared => higher_s.sqrt()))
    }
}
