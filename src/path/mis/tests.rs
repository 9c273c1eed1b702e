//! Weights of densities out of thin air.

use proptest::{
    prelude::{Strategy as Generator, any, prop, prop_assert},
    proptest,
};

use super::{
    super::{LightPaths, RivalSum, Rivals, RunningSum, VarianceFactors},
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
    fn raster(&self) -> [f32; 2] {
        [40.0, 8.0]
    }
    fn ends_are_directions(&self) -> bool {
        self.directions
    }
}

/// Some that are not 1 where [`Arbitrary`] arrives.
fn factors() -> VarianceFactors {
    VarianceFactors::new(2, vec![[1.0, 1.0], [5.0, 17.0]])
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
            let densities = [other, own].map(|p| PdfArea(p[at(j)]));
            *before = if sum.has_merges() {
                let is_seen = j > 1 && (1..j).all(delta);
                let merges = sum.meeting_places().admit(is_seen, delta(j));
                sum.next_merging(j, densities, connects, merges, *before)
            } else {
                sum.next(j, densities, connects, *before)
            };
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
            let merges = table.radius().is_some();
            let weight = if merges {
                rivals.weight_among_merges(path, x, table, sums)
            } else {
                rivals.weight(path, x, table, sums)
            };
            (x, weight)
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
                let whole = mis_weight(&path, Technique::Bidirectional(strategy), &table, heuristic);
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
                .map(|x| (np(*x, &table), mis_weight(&path, Technique::Bidirectional(*x), &table, heuristic)))
                .map(|(np, weight)| f64::from(weight).powi(2) / np)
                .sum();
            for found in strategies().filter(|x| np(*x, &all) > 0.0) {
                let relative = relative_deposit(&path, Technique::Bidirectional(found), &all, &table, heuristic);
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
        let table = Techniques::new(SENSOR, 8, separable(&entries)).with_variance_factors(factors().into());
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            for (strategy, fast) in weights_by_running_sums(&path, &table, heuristic) {
                let whole = mis_weight(&path, Technique::Bidirectional(strategy), &table, heuristic);
                prop_assert!((fast - whole).abs() <= 1e-5 * whole, "{heuristic:?} {strategy}: {fast} {whole}");
            }
        }
        let more = |x: Strategy| if (x.s, x.t) == (3, 4) { other } else { 0 };
        let one_more = Techniques::new(SENSOR, 8, |x| separable(&entries)(x) + more(x));
        prop_assert!(Rivals::of(&one_more, Heuristic::Power).is_none());
    }

    /// Of strategies and merges, summed whole, by running sums, and from the logarithms of n p.
    #[test]
    fn merges_are_further_terms(
        path in densities(),
        radius in 1e-4_f32..0.1,
        splits in 1_u32..3,
        places in prop::sample::select(vec![MeetingPlaces::Everywhere, MeetingPlaces::SeenBySpecular]),
        merging in (1_u32..9).prop_map(LightPaths::one_in),
    ) {
        let table = Techniques::new(SENSOR, 8, |x| u32::from(x.t >= 1)).with_splits(splits);
        let table = table.merging_within(Some(radius)).merging_at(places, merging);
        let table = table.with_variance_factors(factors().into());
        let n = path.edges();
        let area = f64::from(std::f32::consts::PI * radius * radius);
        let pairs = |t: u32| f64::from(table.samples(Technique::Merged(Strategy { s: n + 1 - t, t })));
        let is_seen = |i: u32| i > 1 && i + 1 < n && (1..i).all(|j| path.is_delta(j));
        let prefix = |t: u32| (1..t).map(|i| f64::from(path.camera[i as usize])).product::<f64>();
        let suffix = |t: u32| (t..=n).map(|i| f64::from(path.light[i as usize])).product::<f64>();
        let np = |x: Technique| match x {
            Technique::Bidirectional(x) => f64::from(effective_count(&path, x, &table)) * prefix(x.t) * suffix(x.t),
            Technique::Merged(x) if path.is_delta(x.t - 1) => 0.0,
            Technique::Merged(x) if places == MeetingPlaces::SeenBySpecular && !is_seen(x.t - 1) => 0.0,
            Technique::Merged(x) => pairs(x.t) * area * prefix(x.t) * suffix(x.t - 1),
            Technique::Area => 0.0,
        };
        let strategies = || (1..=n + 1).map(|t| Strategy { s: n + 1 - t, t });
        let merges = strategies().filter(|x| x.s >= 1 && x.t >= 2).map(Technique::Merged);
        let all: Vec<_> = strategies().map(Technique::Bidirectional).chain(merges).collect();
        let fewer = if places == MeetingPlaces::Everywhere { 1 } else { 3 };
        prop_assert!(table.merges().filter(|x| x.edges() == n).count() as u32 == n.saturating_sub(fewer));
        for (heuristic, exponent) in [(Heuristic::Balance, 1), (Heuristic::Power, 2)] {
            let total: f64 = all.iter().map(|x| np(*x).powi(exponent)).sum();
            for found in all.iter().filter(|x| np(**x) > 0.0) {
                let exact = np(*found).powi(exponent) / total;
                let whole = f64::from(mis_weight(&path, *found, &table, heuristic));
                prop_assert!((whole - exact).abs() <= 1e-4 * exact + 1e-30, "{found}: {whole} for {exact}");
            }
            for (strategy, running) in weights_by_running_sums(&path, &table, heuristic) {
                let exact = np(Technique::Bidirectional(strategy)).powi(exponent) / total;
                let off = (f64::from(running) - exact).abs();
                prop_assert!(off <= 1e-4 * exact + 1e-30, "{strategy}, running: {running} for {exact}");
            }
        }
        prop_assert!(is_covered(&path, &table) == all.iter().any(|x| np(*x) > 0.0));
        // What one find deposits is the second moment, whichever table found the path, and by what.
        let table = table.with_plain_weights();
        let others = Techniques::new(SENSOR, 8, |x| u32::from(x.s >= 1 && x.t >= 2));
        for (own, whole) in [(&table, &others), (&others, &table)] {
            for heuristic in [Heuristic::Balance, Heuristic::Power] {
                let moment = |x: &Technique| match expected(&path, *x, whole) {
                    Some((Strategy { t, .. }, own)) if own > 0.0 => {
                        let np = f64::from(own) * prefix(t) * suffix(t);
                        f64::from(mis_weight(&path, *x, whole, heuristic)).powi(2) / np
                    }
                    _ => 0.0,
                };
                let exact: f64 = all.iter().map(moment).sum();
                for found in &all {
                    let Some((Strategy { t, .. }, n)) = expected(&path, *found, own) else { continue };
                    let np = f64::from(n) * prefix(t) * suffix(t);
                    if np > 0.0 && exact > 0.0 {
                        let relative = relative_deposit(&path, *found, own, whole, heuristic);
                        let off = (relative / (exact * np) - 1.0).abs();
                        prop_assert!(off < 1e-3, "{heuristic:?} {found}: {relative} for {}", exact * np);
                    }
                }
            }
        }
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
            let weight = |x: &Strategy| mis_weight(&path, Technique::Bidirectional(*x), &table, heuristic);
            let sum: f32 = supported.iter().map(weight).sum();
            prop_assert!(supported.is_empty() || (sum - 1.0).abs() < 1e-4, "{heuristic:?}: {sum} over \
                {supported:?}");
        }
    }
}
