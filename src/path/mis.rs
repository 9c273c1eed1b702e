//! Multiple importance sampling: the weight of a strategy as a pure sum over two arrays of densities (Veach 9.2, 10.2).

use super::{MeetingPlaces, Strategy, Technique, Techniques};
use crate::{
    lanes::{Float, Lanes, One, Select},
    sampling::PdfArea,
};

/// How the strategies that could have found a path share it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heuristic {
    /// w ∝ n p.
    Balance,
    /// w ∝ (n p)²: lower variance where one strategy is much better than the rest.
    Power,
    /// All weight to the supported strategy with the most light vertices, as next-event estimation without MIS does:
    /// s = 1, and s = 0 only where s = 1 has no support.
    FirstSupported,
}

/// What a weight depends on: the densities of one path, vertex by vertex, from both sides.
///
/// With c_i = `camera_density(i)` and l_i = `light_density(i)`, strategy (s,t) has density p_{s,t} = Π_{i<t} c_i
/// Π_{i≥t} l_i, except that p_{1,t≥2} has the next-event density of p_n in place of the emission density l_n.
pub trait Densities<L: Lanes = One> {
    /// The lanes in which there is a path each, of the same length and found by the same strategy.
    fn lanes(&self) -> L;
    /// n, the path's length in edges.
    fn edges(&self) -> u32;
    /// c_i: the density of p_i when sampled from p_{i−1}; of interest for i ≥ 1.
    fn camera_density(&self, i: u32) -> PdfArea<L::F>;
    /// l_i: the density of p_i when sampled from p_{i+1}; l_n is the emission density of the light's point.
    fn light_density(&self, i: u32) -> PdfArea<L::F>;
    /// Next-event density of p_n given p_{n−1}, over its emission density l_n.
    fn next_event_ratio(&self) -> L::F;
    /// Whether p_i passes a delta lobe, so that no edge can be connected to it. Its densities still are in the
    /// products.
    fn is_delta(&self, i: u32) -> L::M;
    /// Whether there are vertices between the lens and p_i, and all of them pass delta lobes: of interest to merges
    /// alone.
    #[inline(always)]
    fn is_seen_by_specular(&self, i: u32) -> L::M {
        let mut is_seen = self.lanes().mask(if i >= 2 { u32::MAX } else { 0 });
        for between in 1..i {
            is_seen = is_seen & self.is_delta(between);
        }
        is_seen
    }
    /// Whether a ray can meet the light at p_n: point lights and suns are neither hit nor seen directly.
    fn light_is_hittable(&self) -> L::M;
    /// Where the path arrives on the image: of interest where weights know their noise.
    fn raster(&self) -> [L::F; 2];
    /// Whether both p_0 and p_n are directions alone (an orthographic camera and an environment), which (1,1) cannot
    /// join.
    fn ends_are_directions(&self) -> L::M;
}

/// v n_{s,t} of a strategy as far as it could have found this path, zero where it could not;
/// for s = 1 it carries the ratio of next-event to emission density, so that ratios of products may use l_n throughout.
#[inline(always)]
pub(super) fn effective_count<L: Lanes>(path: &impl Densities<L>, strategy: Strategy, techniques: &Techniques) -> L::F {
    let lanes = path.lanes();
    let (count, zero) = (techniques.count(strategy), lanes.splat(0.0));
    if count == 0.0 {
        return zero;
    }
    let Strategy { s, t } = strategy;
    let n = path.edges();
    let mut impossible = lanes.mask(0);
    if s >= 1 && t >= 2 {
        impossible = impossible | path.is_delta(t - 1);
    }
    if s >= 2 {
        impossible = impossible | path.is_delta(t);
    }
    if s == 0 || n == 1 {
        impossible = impossible | !path.light_is_hittable();
    }
    if s == 1 && n == 1 {
        impossible = impossible | path.ends_are_directions();
    }
    let next_event = s == 1 && t >= 2;
    let mut count = if next_event { path.next_event_ratio() * count } else { lanes.splat(count) };
    if let Some(factors) = techniques.variance_factors()
        && n == 2
    {
        count = count * factors.of(lanes, strategy, path.raster());
    }
    impossible.select(zero, count)
}

/// What is to be multiplied by l_{t−1} and the density of (s,t) for n p of the merge at p_{t−1}; zero where the path
/// does not let that vertex merge.
#[inline(always)]
pub(super) fn effective_merges<L: Lanes>(path: &impl Densities<L>, t: u32, techniques: &Techniques) -> L::F {
    let (lanes, factor) = (path.lanes(), techniques.merging_factor(t));
    let (zero, i) = (lanes.splat(0.0), t.wrapping_sub(1));
    if factor == 0.0 || i == 0 || i >= path.edges() {
        return zero;
    }
    let places = techniques.meeting_places();
    if path.edges() + 1 - i < places.fewest_light_vertices() {
        return zero;
    }
    let merges = match places {
        MeetingPlaces::Everywhere => !path.is_delta(i),
        MeetingPlaces::SeenBySpecular => !path.is_delta(i) & path.is_seen_by_specular(i),
    };
    merges.select(lanes.splat(factor), zero)
}

/// n of a strategy over the n, of which `per_own` is the reciprocal, of the one that found the path.
#[inline(always)]
pub(super) fn count_ratio<F: Float>(count: F, per_own: F) -> F {
    count * per_own
}

/// w(p̄): the share of a path that the technique which found it may deposit, a strategy (s,t) or a merge.
///
/// It must have found the path: its count and all its densities are positive. The ratios n p_{s',t'} / n p_{s,t} are
/// built step by step outwards from the connection, never as products of densities, and in f64: single ones may be as
/// large as 10⁸³, and what leaves f32's range at one vertex may come back at the next. Returns a number in [0, 1]; the
/// weights of all supported techniques sum to 1.
#[inline(always)]
pub fn mis_weight(path: &impl Densities, found: Technique, techniques: &Techniques, heuristic: Heuristic) -> f32 {
    let Some((strategy, own)) = expected(path, found, techniques) else { return 1.0 };
    let others = |of: fn(f64) -> f64| {
        let (lower_s, higher_s) = others(path, strategy.t, 1.0 / own, techniques, of);
        let connected = match found {
            // Among the others is the merge itself, but not the strategy that connects next to it.
            Technique::Merged(_) => of(f64::from(effective_count(path, strategy, techniques)) / f64::from(own)),
            _ => 1.0,
        };
        (connected, lower_s, higher_s)
    };
    match heuristic {
        Heuristic::Balance => {
            let (connected, lower_s, higher_s) = others(|r| r);
            (1.0 / (connected + lower_s + higher_s)) as f32
        }
        Heuristic::Power => {
            let (connected, lower_s, higher_s) = others(|r| r * r);
            (1.0 / (connected + lower_s + higher_s)) as f32
        }
        Heuristic::FirstSupported => {
            let (_, _, higher_s) = others(|r| r);
            if higher_s > 0.0 { 0.0 } else { 1.0 }
        }
    }
}

/// The strategy that a technique of the table goes with, and n p in units of its density; `None` of area sampling.
#[inline(always)]
fn expected(path: &impl Densities, found: Technique, techniques: &Techniques) -> Option<(Strategy, f32)> {
    match found {
        Technique::Bidirectional(strategy) => Some((strategy, effective_count(path, strategy, techniques))),
        Technique::Merged(strategy) => {
            let merges = effective_merges(path, strategy.t, techniques);
            Some((strategy, merges * path.light_density(strategy.t - 1).0))
        }
        Technique::Area => None,
    }
}

/// Σ over the techniques beside (s,t) that could have found the path of a function of their n p over the n p of the one
/// that did, of which `per_own` is the reciprocal in units of the density of (s,t): over those with fewer light
/// vertices, and over those with more, to which a merge at p_{t−1} belongs.
#[inline(always)]
fn others(path: &impl Densities, t: u32, per_own: f32, techniques: &Techniques, of: fn(f64) -> f64) -> (f64, f64) {
    let n = path.edges();
    let count = |t: u32| effective_count(path, Strategy { s: n + 1 - t, t }, techniques);
    let merges = |i: u32| effective_merges(path, i + 1, techniques);
    // A ratio may overflow, and ∞·0 would be no number where the other strategy has no sample at all.
    let term = |ratio: f64, count: f32| if count == 0.0 { 0.0 } else { ratio * f64::from(count_ratio(count, per_own)) };
    let range = techniques.range(n);
    let (mut first, mut last) = (*range.start(), *range.end());
    if techniques.radius().is_some() {
        (first, last) = (1, n + 1);
    }
    let (mut lower_s, mut ratio) = (0.0, 1.0);
    for i in t..last {
        // p_i moves from the light's part to the camera's, s falls.
        let [camera, light] = [path.camera_density(i), path.light_density(i)].map(|p| f64::from(p.0));
        lower_s += of(term(ratio * camera, merges(i)));
        ratio *= camera / light;
        if ratio.is_nan() || ratio <= 0.0 {
            break;
        }
        lower_s += of(term(ratio, count(i + 1)));
    }
    let (mut higher_s, mut ratio) = (0.0, 1.0);
    for i in (first..t).rev() {
        // p_i moves from the camera's part to the light's, s grows.
        let [camera, light] = [path.camera_density(i), path.light_density(i)].map(|p| f64::from(p.0));
        higher_s += of(term(ratio * light, merges(i)));
        ratio *= light / camera;
        if ratio.is_nan() || ratio <= 0.0 {
            break;
        }
        higher_s += of(term(ratio, count(i)));
    }
    (lower_s, higher_s)
}

/// Whether some strategy of the table could have found the path: its count is positive, and so is every density in its
/// product.
///
/// Signs alone decide, so that nothing underflows. The densities are those of a path that walks and connections have
/// found, by the BSDF.
pub fn is_covered(path: &impl Densities, techniques: &Techniques) -> bool {
    let n = path.edges();
    let from_camera = (1..=n).take_while(|i| path.camera_density(*i) > PdfArea::ZERO).count() as u32;
    let from_light = (1..=n).rev().take_while(|i| path.light_density(*i) > PdfArea::ZERO).count() as u32;
    let lowest = (n + 1).saturating_sub(from_light).max(1);
    let highest = (from_camera + 1).min(n + 1);
    // A merge has one vertex from both sides.
    let mut meeting = (n + 1).saturating_sub(from_light).max(1)..=from_camera;
    (lowest..=highest).any(|t| effective_count(path, Strategy { s: n + 1 - t, t }, techniques) > 0.0)
        || meeting.any(|i| effective_merges(path, i + 1, techniques) > 0.0)
}

/// How much a table deposits where it finds this path, over F/(n p) of the technique `found` of the table `own`, which
/// found it: the mean over the table's techniques in proportion to what they deposit, Σ w² n p/(n_s p_s). Infinite
/// where the table does not cover the path. Neither table has [variance factors](Techniques::with_plain_weights), which
/// are in weights alone.
///
/// With it, what one integrator finds says how rare and how large the finds of another are, also those that it has not
/// made yet.
pub fn relative_deposit(
    path: &impl Densities,
    found: Technique,
    own: &Techniques,
    techniques: &Techniques,
    heuristic: Heuristic,
) -> f64 {
    let Some((Strategy { t, .. }, own)) = expected(path, found, own) else { return f64::INFINITY };
    let same = f64::from(effective_count(path, Strategy { s: path.edges() + 1 - t, t }, techniques)) / f64::from(own);
    let sum = |of: fn(f64) -> f64| {
        let (lower_s, higher_s) = others(path, t, 1.0 / own, techniques, of);
        lower_s + of(same) + higher_s
    };
    match heuristic {
        Heuristic::Balance => sum(|r| r).recip(),
        Heuristic::Power => {
            let (squares, cubes) = (sum(|r| r * r), sum(|r| r * r * r));
            if squares > 0.0 { cubes / (squares * squares) } else { f64::INFINITY }
        }
        Heuristic::FirstSupported => first_supported(path, t, techniques).map_or(f64::INFINITY, |r| f64::from(own) / r),
    }
}

/// n p of the supported strategy with the most light vertices, in units of the density of the one with `t` vertices
/// from the camera.
fn first_supported(path: &impl Densities, t: u32, techniques: &Techniques) -> Option<f64> {
    let n = path.edges();
    let count = |t: u32| f64::from(effective_count(path, Strategy { s: n + 1 - t, t }, techniques));
    let ratio = |up: PdfArea, down: PdfArea| f64::from(up.0) / f64::from(down.0);
    let lower_s = (t..=n).scan(1.0, |product, i| {
        *product *= ratio(path.camera_density(i), path.light_density(i));
        Some(*product * count(i + 1))
    });
    let higher_s = (1..t).rev().scan(1.0, |product, i| {
        *product *= ratio(path.light_density(i), path.camera_density(i));
        (*product > 0.0).then_some(*product * count(i))
    });
    let is_supported = |r: &f64| *r > 0.0;
    let same = std::iter::once(count(t));
    higher_s.filter(is_supported).last().or_else(|| same.chain(lower_s).find(is_supported))
}

#[cfg(test)]
mod tests;
