//! Strategy by strategy: every (s,t) by itself, unweighted, estimates the same integral over the paths that another
//! could have found as well (Veach 1997, section 10.2). Its source is the definition of F alone: no weight takes part.
//! It would catch what weights hide: a density or a prefix wrong on one side only, a normal or an η² that depends on
//! the direction of travel, emission sampled with another density than is divided by.

use std::{sync::Mutex, time::Instant};

use pathspace::{
    integrator::{Integrator, IntegratorKind},
    math::luminance,
    path::{Densities, Edge, JoinedPath, Roulette, Strategy},
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{Scene, camera::Sensor, point::Place},
};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::{
    islands::{Around, Content, Lamp, View, islands, mirrored_instances},
    scenes,
};

/// s + t ≤ 6.
const LONGEST: usize = 5;
/// Shorter edges are left out on all sides: unweighted connections have an infinite variance where surfaces come close,
/// for ∫G² diverges. The functional is F·1[every edge ≥ this].
const SHORTEST_EDGE: f32 = 0.25;
const REPLICATES: u64 = 32;
/// The probability that right strategies fail in any of all comparisons.
const SIGNIFICANCE: f64 = 1e-3;
/// The bias that every comparison must be able to see, as a part of the light along paths of that length.
const VISIBLE: f64 = 0.03;
/// Of the pairs of all lengths, in all scenes.
const PAIRS: f64 = 7.0 * 35.0;

/// Whether `strategy` could have found the path, from which of its vertices are delta and where its light is; a test
/// holds it to the definition's densities.
pub fn supports(path: &JoinedPath, strategy: Strategy) -> bool {
    let Strategy { s, t } = strategy;
    let n = path.edges();
    let connected = s == 0 || !(path.is_delta(t - 1) || path.is_delta(t));
    let lit = path.light_is_hittable() || (s >= 1 && n >= 2);
    connected && lit && !(n == 1 && s == 1 && path.ends_are_directions())
}

fn spaced(path: &JoinedPath) -> bool {
    let point = |i| path.vertex(i).point;
    (0..path.edges()).all(|i| {
        let (a, b) = (point(i), point(i + 1));
        b.place == Place::Infinite || a.position.distance(b.position) >= SHORTEST_EDGE
    })
}

fn grazes(path: &JoinedPath) -> bool {
    let point = |i| path.vertex(i).point;
    (0..path.edges()).map(|i| Edge::between(&point(i), &point(i + 1))).any(|e| e.cos_a.min(e.cos_b) < 1e-4)
}

/// One replicate: `found[n][s][s']` is the mean image of strategy s, on paths of n edges that s' supports; `total[n]`
/// bdpt's.
#[derive(Clone, Copy, Default)]
struct Tally {
    found: [[[f64; LONGEST + 1]; LONGEST + 1]; LONGEST + 1],
    total: [f64; LONGEST + 1],
    paths: u64,
}

fn strategies(n: usize) -> impl Iterator<Item = Strategy> {
    (0..=n as u32).map(move |s| Strategy { s, t: n as u32 + 1 - s })
}

fn tally(scene: &Scene, seed: u64, passes: u32) -> Tally {
    let sensor = scene.camera.sensor();
    let settings = Settings { seed, ..Settings::new(sensor) };
    let integrator = Integrator::new(IntegratorKind::Bdpt, sensor, LONGEST as u32, Roulette::Off);
    let (table, heuristic) = (integrator.techniques().clone(), integrator.heuristic());
    let mut renderer = Renderer::with_integrator(scene, &settings, integrator);
    let tally = Mutex::new(Tally::default());
    for _ in 0..passes {
        renderer.pass_where(&|path| {
            if !spaced(path) {
                return false;
            }
            let (n, found) = (path.edges() as usize, path.strategy().s as usize);
            let value = f64::from(luminance(path.contribution()) / table.samples(path.technique())) / f64::from(passes);
            let mut tally = tally.lock().unwrap();
            tally.paths += 1;
            tally.total[n] += value * f64::from(path.mis_weight(&table, heuristic));
            // Along a plane's own points rounding decides whether a cosine is zero.
            let check = (tally.paths.is_multiple_of(997) && !grazes(path)).then(|| path.to_path());
            for strategy in strategies(n) {
                let supported = supports(path, strategy);
                if let Some(explicit) = &check {
                    assert_eq!(supported, explicit.pdf(strategy) > 0.0, "{} by {strategy}", explicit.class());
                }
                if supported {
                    tally.found[n][found][strategy.s as usize] += value;
                }
            }
            false
        });
    }
    assert!(renderer.statistics().rejected.is_empty(), "{:?}", renderer.statistics().rejected);
    tally.into_inner().unwrap()
}

/// Compares all pairs of strategies of all lengths, up to `longest` edges; every pair has paths in common. Each
/// comparison could have seen a bias of `visible` of that length's light.
fn compare(name: &str, scene: impl Fn(Sensor) -> Scene, passes: u32, longest: usize, visible: f64) {
    let start = Instant::now();
    let scene = scene(scenes::square(8, Filter::Box));
    let tallies: Vec<_> = (0..REPLICATES).into_par_iter().map(|r| tally(&scene, 4_000 + r, passes)).collect();
    let r = REPLICATES as f64;
    let student = StudentsT::new(0.0, 1.0, r - 1.0).unwrap();
    let single = -((-SIGNIFICANCE).ln_1p() / PAIRS).exp_m1();
    let (mut compared, mut worst, mut least, mut wrong) = (0, 0.0_f64, 1.0_f64, Vec::new());
    for n in 1..=longest {
        let total = tallies.iter().map(|t| t.total[n]).sum::<f64>() / r;
        for (a, b) in strategies(n).flat_map(|a| strategies(n).map(move |b| (a, b))).filter(|(a, b)| a.s < b.s) {
            let (i, j) = (a.s as usize, b.s as usize);
            let differences: Vec<_> = tallies.iter().map(|t| t.found[n][i][j] - t.found[n][j][i]).collect();
            if tallies.iter().all(|t| t.found[n][i][j] == 0.0 && t.found[n][j][i] == 0.0) {
                continue;
            }
            compared += 1;
            let mean = differences.iter().sum::<f64>() / r;
            let error = (differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (r - 1.0) / r).sqrt();
            let p = 2.0 * student.cdf(-(mean / error).abs());
            let seen = student.inverse_cdf(1.0 - 0.5 * single) * error / total;
            least = least.min(p);
            worst = worst.max(seen);
            if p < single {
                wrong.push(format!("{a} and {b} differ by {:+.2} % of the light, p = {p:.1e}", 100.0 * mean / total));
            } else if seen > visible {
                wrong.push(format!("{a} and {b}: only a bias of {:.2} % would be seen", 100.0 * seen));
            }
        }
    }
    println!(
        "{name}: {compared} pairs, smallest p {least:.1e}, largest of the smallest visible biases {:.2} %, {:.1} s",
        100.0 * worst,
        start.elapsed().as_secs_f32()
    );
    assert!(wrong.is_empty(), "{name}:\n{}", wrong.join("\n"));
    let pairs: usize = (1..=longest).map(|n| n * (n + 1) / 2).sum();
    assert!(compared == pairs, "{name}: {compared} pairs have a support in common");
}

fn inside(content: Content, lamp: Lamp) -> impl Fn(Sensor) -> Scene {
    move |sensor| islands(content, lamp, View::Pinhole, Around::Wall, sensor)
}

#[test]
fn agree_on_diffuse_surfaces() {
    compare("diffuse", inside(Content::Diffuse, Lamp::Area), 480, LONGEST, VISIBLE);
}

#[test]
fn agree_on_glossy_surfaces() {
    compare("glossy", inside(Content::Glossy, Lamp::Area), 640, LONGEST, VISIBLE);
}

#[test]
fn agree_through_glass() {
    compare("glass", inside(Content::Glass, Lamp::Area), 480, LONGEST, VISIBLE);
}

#[test]
fn agree_on_normal_maps_and_smooth_normals() {
    compare("normal-mapped", inside(Content::NormalMapped, Lamp::Area), 640, LONGEST, VISIBLE);
}

#[test]
fn agree_under_a_textured_emitter() {
    compare("textured-emitter", inside(Content::Diffuse, Lamp::Textured), 480, LONGEST, VISIBLE);
}

#[test]
fn agree_among_mirrored_instances() {
    compare("mirrored-instance", mirrored_instances, 640, LONGEST, 0.05);
}

#[test]
fn agree_under_lights_of_every_kind() {
    let open = |sensor| islands(Content::Diffuse, Lamp::Mixed, View::Pinhole, Around::Nothing, sensor);
    // A sun and a sky need an open scene, where little light is left after two bounces.
    compare("mixed-light", open, 2400, 3, 0.06);
}
