//! Multiple importance sampling: the weight of a strategy as a pure sum over two arrays of densities (Veach 9.2, 10.2).

use super::{Strategy, Techniques};
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
    /// Whether a ray can meet the light at p_n: point lights and suns are neither hit nor seen directly.
    fn light_is_hittable(&self) -> L::M;
    /// Whether both p_0 and p_n are directions alone (an orthographic camera and an environment), which (1,1) cannot
    /// join.
    fn ends_are_directions(&self) -> L::M;
}

/// n_{s,t} of a strategy as far as it could have found this path, zero where it could not;
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
    let count = if next_event { path.next_event_ratio() * count } else { lanes.splat(count) };
    impossible.select(zero, count)
}

/// n of a strategy over the n, of which `per_own` is the reciprocal, of the one that found the path.
#[inline(always)]
pub(super) fn count_ratio<F: Float>(count: F, per_own: F) -> F {
    count * per_own
}

/// w_{s,t}(p̄): the share of a path that the strategy which found it may deposit.
///
/// `strategy` must have found the path: its count and all its densities are positive. The ratios n p_{s',t'} / n
/// p_{s,t} are built step by step outwards from the connection, never as products of densities, and in f64: single ones
/// may be as large as 10⁸³, and what leaves f32's range at one vertex may come back at the next. Returns a number in
/// [0, 1]; the weights of all supported strategies sum to 1.
#[inline(always)]
pub fn mis_weight(path: &impl Densities, strategy: Strategy, techniques: &Techniques, heuristic: Heuristic) -> f32 {
    let others = |lower: fn(f64) -> f64, higher: fn(f64) -> f64| others(path, strategy, techniques, lower, higher);
    match heuristic {
        Heuristic::Balance => {
            let (lower_s, higher_s) = others(|r| r, |r| r);
            (1.0 / (1.0 + lower_s + higher_s)) as f32
        }
        Heuristic::Power => {
            let (lower_s, higher_s) = others(|r| r * r, |r| r * r);
            (1.0 / (1.0 + lower_s + higher_s)) as f32
        }
        Heuristic::FirstSupported => {
            let (_, higher_s) = others(|r| r, |r| r);
            if higher_s > 0.0 { 0.0 } else { 1.0 }
        }
    }
}

/// Σ over the other strategies that could have found the path of a function of n p_{s',t'} / n p_{s,t}: over those with
/// fewer light vertices, and over those with more.
#[inline(always)]
fn others(
    path: &impl Densities,
    strategy: Strategy,
    techniques: &Techniques,
    lower: fn(f64) -> f64,
    higher: fn(f64) -> f64,
) -> (f64, f64) {
    let n = path.edges();
    debug_assert_eq!(n, strategy.edges());
    let count = |t: u32| effective_count(path, Strategy { s: n + 1 - t, t }, techniques);
    let per_own = 1.0 / count(strategy.t);
    // A ratio may overflow, and ∞·0 would be no number where the other strategy has no sample at all.
    let term = |ratio: f64, count: f32| if count == 0.0 { 0.0 } else { ratio * f64::from(count_ratio(count, per_own)) };
    let range = techniques.range(n);
    let (mut lower_s, mut ratio) = (0.0, 1.0);
    for i in strategy.t..*range.end() {
        // p_i moves from the light's part to the camera's, s falls.
        ratio *= f64::from(path.camera_density(i).0) / f64::from(path.light_density(i).0);
        if ratio.is_nan() || ratio <= 0.0 {
            break;
        }
        lower_s += lower(term(ratio, count(i + 1)));
    }
    let (mut higher_s, mut ratio) = (0.0, 1.0);
    for i in (*range.start()..strategy.t).rev() {
        // p_i moves from the camera's part to the light's, s grows.
        ratio *= f64::from(path.light_density(i).0) / f64::from(path.camera_density(i).0);
        if ratio.is_nan() || ratio <= 0.0 {
            break;
        }
        higher_s += higher(term(ratio, count(i)));
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
    (lowest..=highest).any(|t| effective_count(path, Strategy { s: n + 1 - t, t }, techniques) > 0.0)
}

/// How much a table deposits where it finds this path, over F/(n p) of the table `own` whose strategy `found` found it:
/// the mean over the table's strategies in proportion to what they deposit, Σ w_s² n p/(n_s p_s). Infinite where the
/// table does not cover the path.
///
/// With it, what one integrator finds says how rare and how large the finds of another are, also those that it has not
/// made yet.
pub fn relative_deposit(
    path: &impl Densities,
    found: Strategy,
    own: &Techniques,
    techniques: &Techniques,
    heuristic: Heuristic,
) -> f64 {
    let n = path.edges();
    let own = f64::from(effective_count(path, found, own));
    let relative = |ratio: f64, t: u32| {
        let count = f64::from(effective_count(path, Strategy { s: n + 1 - t, t }, techniques));
        if count == 0.0 { 0.0 } else { ratio * count / own }
    };
    let step = |product: &mut f64, up: PdfArea, down: PdfArea| {
        *product *= f64::from(up.0) / f64::from(down.0);
        (*product > 0.0).then_some(*product)
    };
    let lower_s = || {
        (found.t..=n).scan(1.0, |product, i| {
            step(product, path.camera_density(i), path.light_density(i)).map(|r| relative(r, i + 1))
        })
    };
    let higher_s = || {
        (1..found.t).rev().scan(1.0, |product, i| {
            step(product, path.light_density(i), path.camera_density(i)).map(|r| relative(r, i))
        })
    };
    let same = relative(1.0, found.t);
    match heuristic {
        Heuristic::Balance => 1.0 / (lower_s().sum::<f64>() + same + higher_s().sum::<f64>()),
        Heuristic::Power => {
            let all = lower_s().chain([same]).chain(higher_s());
            let (squares, cubes) = all.fold((0.0, 0.0), |(q, c), r| (q + r * r, c + r * r * r));
            if squares > 0.0 { cubes / (squares * squares) } else { f64::INFINITY }
        }
        Heuristic::FirstSupported => {
            let reached = |r: &f64| *r > 0.0;
            let first = higher_s().filter(reached).last().or(Some(same).filter(reached)).or(lower_s().find(reached));
            first.map_or(f64::INFINITY, f64::recip)
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::{
        prelude::{Strategy as Generator, any, prop, prop_assert},
        proptest,
    };

    use super::{
        super::{RivalSum, Rivals, RunningSum},
        *,
    };
    use crate::scene::camera::Sensor;

    /// Densities out of thin air.
    #[derive(Debug)]
    struct Arbitrary {
        camera: Vec<f32>,
        light: Vec<f32>,
        delta: Vec<bool>,
        next_event: f32,
        hittable: bool,
        directions: bool,
    }

    impl Densities for Arbitrary {
        fn lanes(&self) -> One {
            One
        }
        fn edges(&self) -> u32 {
            self.camera.len() as u32 - 1
        }
        fn camera_density(&self, i: u32) -> PdfArea {
            PdfArea(self.camera[i as usize])
        }
        fn light_density(&self, i: u32) -> PdfArea {
            PdfArea(self.light[i as usize])
        }
        fn next_event_ratio(&self) -> f32 {
            self.next_event
        }
        fn is_delta(&self, i: u32) -> bool {
            0 < i && i < self.edges() && self.delta[i as usize]
        }
        fn light_is_hittable(&self) -> bool {
            self.hittable
        }
        fn ends_are_directions(&self) -> bool {
            self.directions
        }
    }

    fn densities() -> impl Generator<Value = Arbitrary> {
        densities_up_to(5.0)
    }

    /// Up to e^`log` and down to its reciprocal.
    fn densities_up_to(log: f32) -> impl Generator<Value = Arbitrary> {
        (2_usize..9).prop_flat_map(move |n| {
            let density = || prop::collection::vec(-log..log, n).prop_map(|v| v.into_iter().map(f32::exp).collect());
            (density(), density(), prop::collection::vec(any::<bool>(), n), 0.1_f32..10.0, any::<bool>(), any::<bool>())
                .prop_map(|(camera, light, delta, next_event, hittable, directions)| Arbitrary {
                    camera,
                    light,
                    delta,
                    next_event,
                    hittable,
                    directions,
                })
        })
    }

    /// A table whose weights running sums can give.
    fn separable(entries: &[u32]) -> impl Fn(Strategy) -> u32 {
        let entry = |s: u32, t: u32| entries[(s * 10 + t) as usize];
        move |x| match (x.s, x.t) {
            (3.., 4..) => entry(0, 0),
            (3.., t) => entry(9, t),
            (s, 4..) => entry(s, 9),
            (s, t) => entry(s, t),
        }
    }

    const SENSOR: Sensor = Sensor { width: 7, height: 5, padding: 1 };

    /// The weight of every strategy that could have found the path, by running sums.
    fn weights_by_running_sums(path: &Arbitrary, table: &Techniques, heuristic: Heuristic) -> Vec<(Strategy, f32)> {
        let n = path.edges() as usize;
        let rivals = Rivals::of(table, heuristic).unwrap();
        let (camera, light) = ([&path.camera, &path.light], [&path.light, &path.camera]);
        // Along a subpath through all of the path from each side; a connection looks at the part that it has.
        let along = |sum: &RunningSum, [own, other]: [&Vec<f32>; 2], at: &dyn Fn(usize) -> usize, ends: [f32; 2]| {
            let delta = |j: usize| path.is_delta(at(j) as u32);
            let next = |before: &mut RivalSum, j: usize| {
                let free = j == 0 || !(delta(j) || delta(j - 1));
                let connects = if free { ends.get(j).copied().unwrap_or(1.0) } else { 0.0 };
                *before = sum.next(j, [other, own].map(|p| PdfArea(p[at(j)])), connects, *before);
                Some(*before)
            };
            (0..n).scan(RivalSum::ZERO, next).collect::<Vec<_>>()
        };
        let from_camera = along(&rivals.camera, camera, &|j| j, [0.0, 1.0]);
        let from_light = along(&rivals.light, light, &|j| n - j, [f32::from(path.hittable), path.next_event]);
        let before = |sums: &[RivalSum], k: usize| k.checked_sub(3).map_or(RivalSum::ZERO, |j| sums[j]);
        let strategies = (1..=n + 1).map(|t| Strategy { s: (n + 1 - t) as u32, t: t as u32 });
        strategies
            .filter(|x| table.range(n as u32).contains(&x.t) && effective_count(path, *x, table) > 0.0)
            .map(|x| {
                let sums = [before(&from_camera, x.t as usize), before(&from_light, x.s as usize)];
                (x, rivals.weight(path, x, table, sums))
            })
            .collect()
    }

    /// w from the logarithms of n p, which have any range.
    fn weight_by_logarithms(path: &Arbitrary, strategy: Strategy, table: &Techniques, exponent: f64) -> f64 {
        let n = path.edges();
        let log = |t: u32| {
            let ratio = |i: u32| f64::from(path.camera[i as usize]).ln() - f64::from(path.light[i as usize]).ln();
            f64::from(effective_count(path, Strategy { s: n + 1 - t, t }, table)).ln() + (1..t).map(ratio).sum::<f64>()
        };
        let own = log(strategy.t);
        1.0 / table.range(n).map(|t| (exponent * (log(t) - own)).exp()).sum::<f64>()
    }

    proptest! {
        /// Over all of f32's range: near-smooth metals beside micrometre lamps are well within it.
        #[test]
        fn weights_of_any_densities_are_those_by_logarithms(
            path in densities_up_to(85.0),
            entries in prop::collection::vec(0_u32..3, 100),
        ) {
            let table = Techniques::new(SENSOR, 8, separable(&entries));
            for (heuristic, exponent) in [(Heuristic::Balance, 1.0), (Heuristic::Power, 2.0)] {
                for (strategy, running) in weights_by_running_sums(&path, &table, heuristic) {
                    let exact = weight_by_logarithms(&path, strategy, &table, exponent);
                    let whole = mis_weight(&path, strategy, &table, heuristic);
                    for (weight, how) in [(running, "running"), (whole, "whole")] {
                        let off = (f64::from(weight) - exact).abs();
                        prop_assert!(off <= 1e-5 * exact + 1e-37, "{heuristic:?} {strategy}, {how}: {weight} for \
                            {exact}");
                    }
                }
            }
        }

        /// Σ n_s p_s (w_s F/(n_s p_s))² over the table is what one find deposits, whichever strategy found the path.
        #[test]
        fn a_relative_deposit_is_the_second_moment(
            path in densities(),
            entries in prop::collection::vec(0_u32..3, 100),
        ) {
            let sensor = Sensor { width: 7, height: 5, padding: 1 };
            let all = Techniques::new(sensor, 9, |_| 1);
            let table = Techniques::new(sensor, 9, |x| entries[((x.s * 10 + x.t) % 100) as usize]);
            let n = path.edges();
            let strategies = || (1..=n + 1).map(|t| Strategy { s: n + 1 - t, t });
            // n_s p_s over the product of all light densities.
            let np = |x: Strategy, table: &Techniques| {
                let ratio = |i: u32| f64::from(path.camera[i as usize]) / f64::from(path.light[i as usize]);
                let ratio: f64 = (1..x.t).map(ratio).product();
                ratio * f64::from(effective_count(&path, x, table))
            };
            for heuristic in [Heuristic::Balance, Heuristic::Power, Heuristic::FirstSupported] {
                let supported: Vec<_> = strategies().filter(|x| np(*x, &table) > 0.0).collect();
                prop_assert!(is_covered(&path, &table) != supported.is_empty());
                let moment: f64 = supported.iter()
                    .map(|x| f64::from(mis_weight(&path, *x, &table, heuristic)).powi(2) / np(*x, &table))
                    .sum();
                for found in strategies().filter(|x| np(*x, &all) > 0.0) {
                    let relative = relative_deposit(&path, found, &all, &table, heuristic);
                    if supported.is_empty() {
                        prop_assert!(relative == f64::INFINITY);
                    } else {
                        let expected = moment * np(found, &all);
                        prop_assert!((relative / expected - 1.0).abs() < 1e-3, "{heuristic:?}: {relative} {expected}");
                    }
                }
            }
        }

        /// For tables that allow it.
        #[test]
        fn running_sums_give_the_whole_tables_weights(
            path in densities(),
            entries in prop::collection::vec(0_u32..3, 100),
            other in 1_u32..3,
        ) {
            let table = Techniques::new(SENSOR, 8, separable(&entries));
            for heuristic in [Heuristic::Balance, Heuristic::Power] {
                for (strategy, fast) in weights_by_running_sums(&path, &table, heuristic) {
                    let whole = mis_weight(&path, strategy, &table, heuristic);
                    prop_assert!((fast - whole).abs() <= 1e-5 * whole, "{heuristic:?} {strategy}: {fast} {whole}");
                }
            }
            let more = |x: Strategy| if (x.s, x.t) == (3, 4) { other } else { 0 };
            let one_more = Techniques::new(SENSOR, 8, |x| separable(&entries)(x) + more(x));
            prop_assert!(Rivals::of(&one_more, Heuristic::Power).is_none());
        }

        #[test]
        fn weights_over_the_table_sum_to_one(path in densities(), entries in prop::collection::vec(0_u32..4, 100)) {
            let sensor = Sensor { width: 7, height: 5, padding: 1 };
            let table = Techniques::new(sensor, 9, |x| entries[((x.s * 10 + x.t) % 100) as usize]);
            let n = path.edges();
            for heuristic in [Heuristic::Balance, Heuristic::Power, Heuristic::FirstSupported] {
                let supported: Vec<_> = (1..=n + 1)
                    .map(|t| Strategy { s: n + 1 - t, t })
                    .filter(|x| effective_count(&path, *x, &table) > 0.0)
                    .collect();
                let sum: f32 = supported.iter().map(|x| mis_weight(&path, *x, &table, heuristic)).sum();
                prop_assert!(supported.is_empty() || (sum - 1.0).abs() < 1e-4, "{heuristic:?}: {sum} over \
                    {supported:?}");
            }
        }
    }
}
