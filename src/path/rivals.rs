//! Weights in constant time: running sums over the rivals of a strategy, filled in while a subpath is walked.
//!
//! Of all the strategies that could have found a path, those that connect three vertices or more before the present
//! connection see nothing of it: what they have against a strategy that connects further on is a matter of the subpath
//! alone. So each vertex carries their sum R_j = (p_other/p_own)^β (n_j^β + R_{j−1}), and a weight adds to it the two
//! nearest on each side. That needs a table whose n_{s,t} is, so far back, a matter of the subpath alone as well
//! ([`Rivals::of`]); any other is summed whole ([`mis_weight`](super::mis_weight)).
//!
//! A merge at p_j stands beside the strategy that connects p_{j−1} to it: R_j = (p_other/p_own)^β (n_j^β + (p_own
//! m_j)^β + R_{j−1}), with m_j the pairs of subpaths times πr² (Georgiev et al. 2012).

use super::{
    Densities, Heuristic, MeetingPlaces, Strategy, Techniques,
    mis::{count_ratio, effective_count, effective_merges},
};
use crate::{
    lanes::{Double, Float, Lanes, Mask, Select, Unsigned},
    sampling::PdfArea,
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
    /// Of merges at the vertex 1, and at those further on: [`Techniques::merging_factor`] over the unit.
    merges: [f32; 2],
    /// Where there are merges.
    places: MeetingPlaces,
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
    fn of<D: Double>(self, x: D) -> D {
        match self {
            Self::One => x,
            Self::Two => x * x,
        }
    }

    /// (x^β + y^β)^{1/β} for numbers of any size.
    #[inline(always)]
    fn sum<D: Double>(self, x: D, y: D) -> D {
        match self {
            Self::One => x + y,
            Self::Two => {
                let lanes = x.lanes();
                let less = x.lt(y);
                let (small, large) = (less.select(x, y), less.select(y, x));
                // Neither square has to be a number.
                let ratio = small / large;
                lanes.splat_d(0.0).lt(small).select(large * (lanes.splat_d(1.0) + ratio * ratio).sqrt(), large)
            }
        }
    }
}

/// A running sum as a vertex keeps it: R_j^{1/β}, the upper half of an f64.
///
/// Densities of near-smooth metals and of micrometre lamps are 10¹² and more, and a sum may leave the range of f32 at
/// one vertex, squared, and come back at the next. As a root it has the range of an f64, 10³⁰⁸, in which four vertices
/// in a row may have a ratio as large as densities can be apart; 21 bits are left of it, an error of up to 2⁻²¹ at each
/// vertex, in the four bytes that a vertex has for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RivalSum<U = u32>(U);

impl RivalSum {
    /// No rivals.
    pub const ZERO: Self = Self(0);
}

impl<U: Unsigned> RivalSum<U> {
    /// No rivals.
    #[inline(always)]
    pub fn none(lanes: U::Lanes) -> Self {
        Self(lanes.splat_u(0))
    }

    /// The word that keeps it.
    #[inline(always)]
    pub fn word(self) -> U {
        self.0
    }

    /// What such a word keeps.
    #[inline(always)]
    pub fn of_word(word: U) -> Self {
        Self(word)
    }

    /// The nearest to a number of at least 0, which does not round to infinity.
    #[inline(always)]
    pub(super) fn nearest(root: <U::Lanes as Lanes>::D) -> Self {
        let most = root.lanes().splat_d(1e308);
        Self(root.lt(most).select(root, most).upper_half())
    }

    #[inline(always)]
    pub(super) fn root(self) -> <U::Lanes as Lanes>::D {
        Double::of_upper_half(self.0)
    }
}

/// How much the densities from two sides differ. Of two floats it may be as large as 10⁸³.
#[inline(always)]
fn ratio<F: Float>(other: PdfArea<F>, own: PdfArea<F>) -> <F::Lanes as Lanes>::D {
    other.0.to_f64() / own.0.to_f64()
}

/// The sum, moved from one side to the other; zero where either is.
#[inline(always)]
fn times_ratio<F: Float>([other, own]: [PdfArea<F>; 2], sum: <F::Lanes as Lanes>::D) -> <F::Lanes as Lanes>::D {
    let ratio = ratio(other, own);
    // A ratio may be infinite, and may be NaN; neither makes anything of no rival.
    let zero = ratio.lanes().splat_d(0.0);
    (zero.lt(ratio) & zero.lt(sum)).select(ratio * sum, zero)
}

impl RunningSum {
    /// Whether there is anything to sum.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.counts.is_empty() && !self.has_merges()
    }

    /// Whether merges are among it.
    #[inline]
    pub fn has_merges(&self) -> bool {
        self.merges[1] > 0.0
    }

    /// Where subpaths merge, if they do.
    #[inline]
    pub fn meeting_places(&self) -> MeetingPlaces {
        self.places
    }

    /// [`Self::next`] of a table with merges; `merges` says whether there is one at vertex j: see
    /// [`MeetingPlaces::admit`].
    #[inline(always)]
    pub fn next_merging<F: Float>(
        &self,
        j: usize,
        [other, own]: [PdfArea<F>; 2],
        connects: F,
        merges: <F::Lanes as Lanes>::M,
        before: RivalSum<<F::Lanes as Lanes>::U>,
    ) -> RivalSum<<F::Lanes as Lanes>::U> {
        let all = self.up_to(j, own, connects, merges, before);
        RivalSum::nearest(times_ratio([other, own], all))
    }

    /// (n_j^β + (p_own m_j)^β + R_{j−1})^{1/β}.
    #[inline(always)]
    pub fn up_to<F: Float>(
        &self,
        j: usize,
        own: PdfArea<F>,
        connects: F,
        merges: <F::Lanes as Lanes>::M,
        before: RivalSum<<F::Lanes as Lanes>::U>,
    ) -> <F::Lanes as Lanes>::D {
        let lanes = connects.lanes();
        let count = self.counts.get(j).copied().unwrap_or(0.0);
        let factor = if j == 0 { 0.0 } else { self.merges[(j - 1).min(1)] };
        let merges = merges.select(lanes.splat(factor), lanes.splat(0.0)).to_f64() * own.0.to_f64();
        self.exponent.sum(self.exponent.sum((connects * count).to_f64(), merges), before.root())
    }

    /// R_j from R_{j−1}: `other` and `own` are the densities of the subpath's vertex j, counted from 0, from the other
    /// side and from its own; for `connects` see [`Beginning::connects`].
    #[inline(always)]
    pub fn next<F: Float>(
        &self,
        j: usize,
        [other, own]: [PdfArea<F>; 2],
        connects: F,
        before: RivalSum<<F::Lanes as Lanes>::U>,
    ) -> RivalSum<<F::Lanes as Lanes>::U> {
        let lanes = connects.lanes();
        let count = self.counts.get(j).copied().unwrap_or(0.0);
        let all = self.exponent.sum((connects * count).to_f64(), before.root());
        let ratio = ratio(other, own);
        // A ratio may be infinite, and may be NaN; neither makes anything of no rival.
        let zero = lanes.splat_d(0.0);
        let some = zero.lt(ratio) & zero.lt(all);
        let next = RivalSum::<<F::Lanes as Lanes>::U>::nearest(ratio * all);
        RivalSum(some.select(next.0, lanes.splat_u(0)))
    }
}

/// What the first two edges of a subpath count as in its running sums.
#[derive(Clone, Copy, Debug)]
pub struct Beginning<F = f32> {
    /// Of a light subpath: 1 if a ray can meet its light, else 0. The camera's table has no such count.
    pub hittable: F,
    /// Of a light subpath with two vertices or more: see [`Densities::next_event_ratio`]. The camera's first edge has
    /// the ratio 1.
    pub next_event_ratio: F,
}

impl<F: Float> Beginning<F> {
    /// One that changes no count.
    #[inline(always)]
    pub fn plain(lanes: F::Lanes) -> Self {
        Self { hittable: lanes.splat(1.0), next_event_ratio: lanes.splat(1.0) }
    }

    /// How many times the j-th edge, between the vertices j−1 and j, counts as one that can be connected, the table's
    /// count apart. `is_delta` says it of these two vertices, the j-th first.
    #[inline(always)]
    pub fn connects(&self, j: usize, is_delta: [<F::Lanes as Lanes>::M; 2]) -> F {
        let lanes = self.hittable.lanes();
        let [here, before] = is_delta;
        match j {
            0 => self.hittable,
            // The edge to p_n is that of next-event estimation.
            1 => here.select(lanes.splat(0.0), self.next_event_ratio),
            _ => (here | before).select(lanes.splat(0.0), lanes.splat(1.0)),
        }
    }
}

impl Rivals {
    /// The counts of a table in which n_{s,t} depends on t alone where s ≥ 3, and on s alone where t ≥ 4, among the
    /// strategies of all lengths; `None` for another, and for a rule that sums nothing.
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
        // A light vertex that is kept for merges knows the strategy beyond its own predecessor, too.
        let first = if table.radius().is_some() { 3 } else { 4 };
        let by_s = |s: u32| {
            same_for_all((first..=longest.saturating_sub(s)).map(|t| table.count(Strategy { s, t })).collect())
        };
        let merges = [2, 3].map(|t| table.merging_factor(t) / unit);
        // What is seen by specular vertices alone has no connection between it and the camera.
        let beyond_connections = match table.meeting_places() {
            MeetingPlaces::Everywhere => merges[1],
            MeetingPlaces::SeenBySpecular => 0.0,
        };
        let sum = |counts: Vec<f32>, merges: [f32; 2]| {
            let any = counts.iter().any(|count| *count > 0.0);
            let counts = if any { counts.into() } else { Box::default() };
            RunningSum { counts, merges, places: table.meeting_places(), exponent }
        };
        let camera = sum((0..longest).map(by_t).collect::<Option<_>>()?, merges);
        let light = sum((0..longest).map(by_s).collect::<Option<_>>()?, [beyond_connections; 2]);
        Some(Self { camera, light, unit })
    }

    /// [`mis_weight`](super::mis_weight) from the running sums: `towards_camera` is that of p_{t−3}, `towards_light`
    /// that of p_{t+2}, zero where there is no such vertex in its subpath.
    #[inline(always)]
    pub fn weight<L: Lanes>(
        &self,
        path: &impl Densities<L>,
        strategy: Strategy,
        techniques: &Techniques,
        [towards_camera, towards_light]: [RivalSum<L::U>; 2],
    ) -> L::F {
        let lanes = path.lanes();
        let (n, t, range) = (path.edges(), strategy.t, techniques.range(path.edges()));
        let (zero, one) = (lanes.splat_d(0.0), lanes.splat_d(1.0));
        // No closures: they are not compiled for the lanes' instructions unless they happen to be inlined.
        macro_rules! count {
            ($t:expr) => {
                effective_count(path, Strategy { s: n + 1 - $t, t: $t }, techniques)
            };
        }
        let per_own = lanes.splat(1.0) / count!(t);
        macro_rules! near {
            ($t:expr) => {
                count_ratio(count!($t), per_own).to_f64()
            };
        }
        let further = count_ratio(lanes.splat(self.unit), per_own).to_f64();
        // Up to two vertices move from one side to the other, and with them all further rivals.
        let (mut lower_s, mut higher_s) = (zero, zero);
        if t < *range.end() {
            let first = ratio(path.camera_density(t), path.light_density(t));
            lower_s = self.term(first, near!(t + 1));
            if t + 1 < *range.end() {
                let second = first * ratio(path.camera_density(t + 1), path.light_density(t + 1));
                let all_further = self.term(second, further * towards_light.root());
                lower_s = lower_s + (self.term(second, near!(t + 2)) + all_further);
            }
        }
        if t > *range.start() {
            let first = ratio(path.light_density(t - 1), path.camera_density(t - 1));
            higher_s = self.term(first, near!(t - 1));
            if t - 1 > *range.start() {
                let second = first * ratio(path.light_density(t - 2), path.camera_density(t - 2));
                let all_further = self.term(second, further * towards_camera.root());
                higher_s = higher_s + (self.term(second, near!(t - 2)) + all_further);
            }
        }
        L::F::from_f64(one / (one + lower_s + higher_s))
    }

    /// The weight of a strategy in a table with merges, from the same sums as [`Self::weight`].
    #[inline(always)]
    pub fn weight_among_merges<L: Lanes>(
        &self,
        path: &impl Densities<L>,
        strategy: Strategy,
        techniques: &Techniques,
        [towards_camera, towards_light]: [RivalSum<L::U>; 2],
    ) -> L::F {
        let lanes = path.lanes();
        let (mut merges, mut plain) = (lanes.mask(u32::MAX), lanes.splat(0.0));
        if techniques.meeting_places() == MeetingPlaces::SeenBySpecular {
            // Few paths have a merge beside the connection; where there is none, nothing needs roots.
            merges = merges_around(path, strategy.t, techniques);
            plain = self.weight(path, strategy, techniques, [towards_camera, towards_light]);
            if !merges.any() {
                return plain;
            }
        }
        let own = (effective_count(path, strategy, techniques) * (1.0 / self.unit)).to_f64();
        let camera = self.towards_camera(path, strategy.t, techniques, towards_camera);
        let light = self.towards_light(path, strategy.t, techniques, towards_light);
        merges.select(self.share(own, [own, camera, light]), plain)
    }

    /// What the techniques that have p_{t−1} from the light come to in units of (s,t)'s density: those that connect at
    /// or before it, and the merges up to that at p_{t−1}.
    #[inline(always)]
    pub fn towards_camera<L: Lanes>(
        &self,
        path: &impl Densities<L>,
        t: u32,
        techniques: &Techniques,
        before: RivalSum<L::U>,
    ) -> L::D {
        let mut sum = before.root();
        for i in t.saturating_sub(2).max(1)..t {
            sum = self.over(path, i, i, techniques, [path.light_density(i), path.camera_density(i)], sum);
        }
        sum
    }

    /// The same of those that have p_t from the camera.
    #[inline(always)]
    fn towards_light<L: Lanes>(
        &self,
        path: &impl Densities<L>,
        t: u32,
        techniques: &Techniques,
        before: RivalSum<L::U>,
    ) -> L::D {
        let mut sum = before.root();
        for i in (t..(t + 2).min(path.edges() + 1)).rev() {
            sum = self.over(path, i, i + 1, techniques, [path.camera_density(i), path.light_density(i)], sum);
        }
        sum
    }

    /// A sum with the strategy of `t` camera vertices and the merge at p_i, moved over p_i from the side of the density
    /// `own` to the other.
    #[inline(always)]
    fn over<L: Lanes>(
        &self,
        path: &impl Densities<L>,
        i: u32,
        t: u32,
        techniques: &Techniques,
        [other, own]: [PdfArea<L::F>; 2],
        sum: L::D,
    ) -> L::D {
        let (exponent, per_unit) = (self.camera.exponent, 1.0 / self.unit);
        let connects = effective_count(path, Strategy { s: path.edges() + 1 - t, t }, techniques) * per_unit;
        let merges = (effective_merges(path, i + 1, techniques) * per_unit).to_f64() * own.0.to_f64();
        times_ratio([other, own], exponent.sum(exponent.sum(connects.to_f64(), merges), sum))
    }

    /// own^β over Σ all^β.
    #[inline(always)]
    pub fn share<D: Double>(&self, own: D, all: [D; 3]) -> <D::Lanes as Lanes>::F {
        let exponent = self.camera.exponent;
        let [a, b, c] = all;
        let share = own / exponent.sum(exponent.sum(a, b), c);
        <D::Lanes as Lanes>::F::from_f64(exponent.of(share))
    }

    /// What the counts are in multiples of.
    #[inline]
    pub fn unit(&self) -> f32 {
        self.unit
    }

    /// A summand: multiplied out before it is squared, so that one beyond f64 leaves nothing to the others, and one
    /// below it is nothing to them.
    #[inline(always)]
    fn term<D: Double>(&self, ratio: D, rivals: D) -> D {
        let zero = ratio.lanes().splat_d(0.0);
        (zero.lt(ratio) & zero.lt(rivals)).select(self.camera.exponent.of(ratio * rivals), zero)
    }
}

/// In which lanes one of the two vertices on either side of a connection, the last of which from the camera is p_{t−1},
/// may merge.
#[inline(always)]
fn merges_around<L: Lanes>(path: &impl Densities<L>, t: u32, techniques: &Techniques) -> L::M {
    let lanes = path.lanes();
    let mut merges = lanes.mask(0);
    for i in t.saturating_sub(2).max(1)..(t + 2).min(path.edges()) {
        merges = merges | lanes.splat(0.0).lt(effective_merges(path, i + 1, techniques));
    }
    merges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_keep_their_range_and_21_bits() {
        assert_eq!(RivalSum::ZERO.root(), 0.0);
        for exponent in -300..308 {
            for mantissa in [1.0, 1.234_567_890_123, 9.999_999_999_9] {
                let root = mantissa * 10_f64.powi(exponent);
                let off = (RivalSum::<u32>::nearest(root).root() / root - 1.0).abs();
                assert!(off <= 2_f64.powi(-21), "{root:e}: off by {off:e}");
            }
        }
        let most = RivalSum::<u32>::nearest(f64::INFINITY).root();
        assert!((9.9e307..f64::INFINITY).contains(&most), "{most:e}");
    }

    #[test]
    fn a_sum_of_powers_needs_none_of_them() {
        for (x, y, sum) in [(3e200, 4e200, 5e200), (4e-200, 3e-200, 5e-200), (1e-300, 1e300, 1e300), (0.0, 7.0, 7.0)] {
            assert!((Exponent::Two.sum(x, y) / sum - 1.0).abs() < 1e-15 && Exponent::One.sum(x, y) >= sum, "{x} {y}");
        }
        assert_eq!(Exponent::Two.sum(0.0, 0.0), 0.0);
    }
}
