//! Agreement over a pairwise covering array of integrators, samplers, materials, cameras, filters and lights, each row
//! against bdpt (source: Cohen et al. 1997, *The AETG System*); and p-values of many small comparisons, uniform by
//! Kolmogorov and Smirnov's test. It would catch what goes wrong only where two features meet, such as splats under a
//! wide filter through an orthographic camera, and a bias too small for any single comparison of so few samples.

use std::time::Instant;

use pathspace::{
    film::Image,
    integrator::{Integrator, IntegratorKind},
    math::luminance,
    path::{Densities, JoinedPath, Strategy},
    render::{Renderer, Settings},
    sampling::{Filter, SamplerKind},
    scene::{Scene, point::Place},
    statistics::Comparison,
};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::{
    agreement::{Run, converge, each_other},
    islands::{Around, Content, Lamp, View, islands},
    scenes::{self, UNBIASED},
    strategies::supports,
};

/// The number of values of each factor: integrators, samplers, materials, cameras, filters, lights.
const LEVELS: [usize; 6] =
    [UNBIASED.len(), SamplerKind::ALL.len(), Content::ALL.len(), View::ALL.len(), Filter::ALL.len(), Lamp::ALL.len()];

/// A value of every factor.
type Row = [usize; LEVELS.len()];

/// Whether an integrator sees anything of a light at all; all other values go together. Walks never meet a light
/// without extent, and area sampling finds emitting surfaces alone.
fn is_possible(integrator: usize, lamp: usize) -> bool {
    let delta = matches!(Lamp::ALL[lamp], Lamp::Point | Lamp::Spot | Lamp::Sun);
    match UNBIASED[integrator] {
        IntegratorKind::PathHemisphere => !delta,
        IntegratorKind::Area => matches!(Lamp::ALL[lamp], Lamp::Area | Lamp::Textured | Lamp::Mixed),
        _ => true,
    }
}

/// Every pair of values of two factors that some row can have, as (factor, value, factor, value).
fn possible_pairs() -> Vec<[usize; 4]> {
    let factors = (0..LEVELS.len()).flat_map(|f| (f + 1..LEVELS.len()).map(move |g| (f, g)));
    let pairs = factors.flat_map(|(f, g)| (0..LEVELS[f]).flat_map(move |a| (0..LEVELS[g]).map(move |b| [f, a, g, b])));
    pairs.filter(|[f, a, g, b]| (*f, *g) != (0, LEVELS.len() - 1) || is_possible(*a, *b)).collect()
}

/// Rows that have every possible pair, greedily: each starts from a pair that is missing, and goes on with the values
/// that bring the most missing pairs.
fn covering_array() -> Vec<Row> {
    let mut missing = possible_pairs();
    let mut rows = Vec::new();
    while let Some(&[f, a, g, b]) = missing.first() {
        let mut row = [None; LEVELS.len()];
        (row[f], row[g]) = (Some(a), Some(b));
        for factor in 0..LEVELS.len() {
            if row[factor].is_some() {
                continue;
            }
            let fits = |value: &usize| match factor {
                0 => row[LEVELS.len() - 1].is_none_or(|lamp| is_possible(*value, lamp)),
                5 => row[0].is_none_or(|integrator| is_possible(integrator, *value)),
                _ => true,
            };
            let brings = |value: usize| {
                let has = |f: usize, a: usize| if f == factor { a == value } else { row[f] == Some(a) };
                missing
                    .iter()
                    .filter(|[f, a, g, b]| (*f == factor || *g == factor) && has(*f, *a) && has(*g, *b))
                    .count()
            };
            // Among equals the one that is turned to by the number of rows so far, so that all values are used evenly.
            let turned = (0..LEVELS[factor]).map(|i| (i + rows.len()) % LEVELS[factor]);
            row[factor] = turned.filter(fits).max_by_key(|value| brings(*value));
        }
        let row: Row = row.map(|value| value.expect("each value goes with some value of every factor"));
        missing.retain(|[f, a, g, b]| row[*f] != *a || row[*g] != *b);
        rows.push(row);
    }
    rows
}

#[test]
fn every_possible_pair_is_in_a_row() {
    let rows = covering_array();
    let pairs = possible_pairs();
    for [f, a, g, b] in &pairs {
        assert!(rows.iter().any(|row| row[*f] == *a && row[*g] == *b), "factors {f} = {a} and {g} = {b}");
    }
    assert!(rows.iter().all(|row| is_possible(row[0], row[LEVELS.len() - 1])));
    // No array is shorter than its two largest factors ask for, and a greedy one not much longer.
    let least = LEVELS[0] * LEVELS[5] - (0..LEVELS[0] * LEVELS[5]).filter(|i| !is_possible(i / 8, i % 8)).count();
    println!("{} rows for {} pairs", rows.len(), pairs.len());
    assert!((least..least + 12).contains(&rows.len()), "{} rows", rows.len());
}

/// Whether a table could have found the path: [`Integrator::covers`] without the definition's cost.
fn covers(table: &Integrator, path: &JoinedPath) -> bool {
    let n = path.edges();
    let techniques = table.techniques();
    let drawn = |i| path.vertex(i).point.place == Place::Surface && !path.is_delta(i);
    let found = |strategy| techniques.multiplicity(strategy) > 0 && supports(path, strategy);
    (techniques.area() > 0 && n <= techniques.max_depth() && (1..=n).all(drawn))
        || (1..=n + 1).map(|t| Strategy { s: n + 1 - t, t }).any(found)
}

/// The longest paths, in edges.
const DEPTH: u32 = 3;
/// The bias that every comparison can see.
const VISIBLE: f64 = 0.05;

fn settings(scene: &Scene, filter: Filter, kind: IntegratorKind, sampler: SamplerKind, seed: u64) -> Vec<Settings> {
    let sensor = scene.camera.sensor();
    let base = Settings { integrator: kind, sampler, filter, max_depth: DEPTH, ..Settings::new(sensor) };
    (0..24).map(|r| Settings { seed: seed + r, ..base.clone() }).collect()
}

/// The complaint about a row, if it and its reference differ or are too noisy to tell.
fn disagreement(number: usize, row: Row, most: f64) -> Option<String> {
    let [kind, sampler, content, view, filter, lamp] = row;
    let (kind, sampler) = (UNBIASED[kind], SamplerKind::ALL[sampler]);
    let (content, view, filter) = (Content::ALL[content], View::ALL[view], Filter::ALL[filter]);
    let lamp = Lamp::ALL[lamp];
    let scene = islands(content, lamp, view, Around::Nothing, scenes::square(8, filter));
    // The reference is bdpt by independent numbers, and where that is the row itself, path tracing.
    let reference = match (kind, sampler) {
        (IntegratorKind::Bdpt, SamplerKind::Independent) => IntegratorKind::Path,
        _ => IntegratorKind::Bdpt,
    };
    let tables = [kind, reference]
        .map(|kind| Integrator::new(kind, scene.camera.sensor(), DEPTH, Settings::new(scene.camera.sensor()).roulette));
    // Lights seen directly are the same strategy with the weight 1 in most tables, and their edges most of the noise.
    let keep = |path: &JoinedPath| path.edges() >= 2 && tables.iter().all(|table| covers(table, path));
    let seed = 1_000_000 + 1_000 * number as u64;
    let settings = [
        settings(&scene, filter, kind, sampler, seed),
        settings(&scene, filter, reference, SamplerKind::Independent, seed + 500),
    ];
    let name = format!("{kind} {sampler} {content:?} {view:?} {filter} {lamp:?}");
    let mut runs =
        [Run::new(&scene, &settings[0], &name, &keep), Run::new(&scene, &settings[1], reference.name(), &keep)];
    converge(VISIBLE, &mut runs, &each_other(2));
    let comparison = Comparison::new(&runs[0].estimate(), &runs[1].estimate());
    let wrong = comparison.p < most || comparison.visible_bias > VISIBLE;
    wrong.then(|| format!("{name}: {comparison}"))
}

#[test]
fn every_row_agrees_with_bdpt() {
    let start = Instant::now();
    let rows = covering_array();
    // The probability that right rows fail anywhere is 1e-3.
    let most = 1e-3 / rows.len() as f64;
    let complaints: Vec<_> = rows.par_iter().enumerate().filter_map(|(i, row)| disagreement(i, *row, most)).collect();
    println!("{} rows in {:.1} s", rows.len(), start.elapsed().as_secs_f32());
    assert!(complaints.is_empty(), "{} of {} rows:\n{}", complaints.len(), rows.len(), complaints.join("\n"));
}

/// Comparisons, each of two estimates from so many replicates of so many passes.
const COMPARISONS: u64 = 400;
const REPLICATES: u64 = 8;
const PASSES: u32 = 4;
/// Most light paths miss the image, and none costs much.
const LIGHT_PASSES: u32 = 20;

fn image_mean(image: &Image) -> f64 {
    image.pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>() / image.pixels.len() as f64
}

/// The image's mean in each replicate.
fn means(scene: &Scene, kind: IntegratorKind, sampler: SamplerKind, seed: u64) -> Vec<f64> {
    let passes = if kind == IntegratorKind::Light { LIGHT_PASSES } else { PASSES };
    let replicate = |r| {
        let settings = Settings {
            integrator: kind,
            sampler,
            seed: seed + r,
            max_depth: 4,
            ..Settings::new(scene.camera.sensor())
        };
        let mut renderer = Renderer::new(scene, &settings);
        (0..passes).for_each(|_| renderer.pass());
        image_mean(&renderer.film().image(passes))
    };
    (0..REPLICATES).map(replicate).collect()
}

/// The probability of a smaller t if the means are equal, by Welch: uniform then, with the sign of the difference kept,
/// since that is where a small bias shows.
fn one_sided_p(a: &[f64], b: &[f64]) -> f64 {
    let moments = |x: &[f64]| {
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        (mean, x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
    };
    let ((x, u), (y, v)) = (moments(a), moments(b));
    let freedom = (u + v).powi(2) / ((u * u + v * v) / (REPLICATES - 1) as f64);
    StudentsT::new(0.0, 1.0, freedom).unwrap().cdf((x - y) / (u + v).sqrt())
}

/// The p-value of a uniform distribution: Kolmogorov's asymptotic distribution with Stephens's correction for the
/// number.
fn kolmogorov_smirnov(mut p: Vec<f64>) -> f64 {
    p.sort_by(f64::total_cmp);
    let n = p.len() as f64;
    let off = |(i, p): (usize, &f64)| (p - i as f64 / n).max((i + 1) as f64 / n - p);
    let d = p.iter().enumerate().map(off).fold(0.0, f64::max);
    let lambda = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * d;
    let term = |k: i32| f64::from(1 - 2 * ((k + 1) % 2)) * (-2.0 * (f64::from(k) * lambda).powi(2)).exp();
    (2.0 * (1..100).map(term).sum::<f64>()).clamp(0.0, 1.0)
}

#[test]
fn the_kolmogorov_smirnov_test_has_its_tabulated_quantiles() {
    // Evenly spread but for a shift d: D = d + 1/2n. Critical values at n = 100: 0.1340 (5 %), 0.1608 (1 %).
    let shifted = |d: f64| (0..100).map(|i| ((f64::from(i) + 0.5) / 100.0 + d - 0.005).min(1.0)).collect::<Vec<_>>();
    for (d, p) in [(0.1340, 0.05), (0.1608, 0.01)] {
        let found = kolmogorov_smirnov(shifted(d));
        assert!((found / p - 1.0).abs() < 0.08, "{d}: {found}");
    }
}

/// In a glowing sphere around diffuse islands no contribution is large, and the means of a few hundred samples are
/// normal.
#[test]
fn p_values_of_agreeing_integrators_are_uniform() {
    use IntegratorKind::{Bdpt, Hybrid, Light, Path};
    use SamplerKind::{Independent, Sobol};
    let start = Instant::now();
    let scene = islands(Content::Diffuse, Lamp::Area, View::Pinhole, Around::Wall, scenes::square(8, Filter::Box));
    let pairs = [
        ((Path, Independent), (Bdpt, Independent)),
        ((Path, Sobol), (Light, Independent)),
        ((Hybrid, Independent), (Bdpt, Sobol)),
    ];
    for (number, (a, b)) in (0_u64..).zip(pairs) {
        let comparisons: Vec<_> = (0..COMPARISONS)
            .into_par_iter()
            .map(|i| {
                let seed = 2_000_000 + 100_000 * number + 2 * REPLICATES * i;
                (means(&scene, a.0, a.1, seed), means(&scene, b.0, b.1, seed + REPLICATES))
            })
            .collect();
        let uniform = |bias: f64| {
            let biased = |x: &[f64]| x.iter().map(|v| v * (1.0 + bias)).collect::<Vec<_>>();
            kolmogorov_smirnov(comparisons.iter().map(|(a, b)| one_sided_p(&biased(a), b)).collect())
        };
        let [right, above, below] = [0.0, BIAS, -BIAS].map(uniform);
        println!("{a:?} = {b:?}? p = {right:.3}; with a bias of ±{:.1} %: {above:.1e}, {below:.1e}", 100.0 * BIAS);
        assert!(right > 1e-3, "{a:?} and {b:?}: p-values are not uniform, p = {right:.1e}");
        assert!(
            above < 1e-3 && below < 1e-3,
            "{a:?} and {b:?}: a planted bias went unnoticed, {above:.1e}, {below:.1e}"
        );
    }
    println!("{:.1} s", start.elapsed().as_secs_f32());
}

/// The bias that must be seen.
const BIAS: f64 = 0.005;
