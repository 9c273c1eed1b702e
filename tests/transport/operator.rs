//! The lecture's operators, discretised: L = L_e + K L, K = R∘T, L = Σ K^i L_e = (I − K)⁻¹ L_e.
//!
//! Oracle: radiosity in a box of diffuse walls, a matrix of exact configuration factors (Howell C-12, C-15) and a dense
//! solve, which knows no path, no density and no weight (lecture 14, *Linear operators* to *Successive
//! approximations*). It would catch a bounce counted twice, left out or weighed wrongly even where other bounces make
//! up for it in the sum, and a ray that does not lead back where it came from.
//!
//! The matrix is exact but for taking radiance as constant over a patch: two resolutions say how much that is, and it
//! is allowed for.

use glam::{DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    math::{Frame, Rgb},
    path::{Densities, JoinedPath},
    sampling::{Choice, Filter, Independent, Sampler, Stream, warp},
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::Geometry,
        material::Material,
        point::{Place, Point},
    },
};

use rayon::prelude::*;

use crate::{
    closed_forms::{
        WEIGHTED,
        form_factors::{parallel, perpendicular},
        tally::{Expectation, assert_bins},
    },
    lights, scenes,
};

/// A box with walls of different albedos, two of which emit: −x, +x, −y, +y, −z, +z.
const ALBEDO: [f64; 6] = [0.7, 0.3, 0.5, 0.6, 0.4, 0.8];
const EMISSION: [f64; 6] = [0.0, 2.0, 0.0, 0.0, 0.5, 0.0];

/// The inside of [−1, 1]³ with each wall cut into n × n patches; a patch has the index (wall n + row) n + column.
struct Patches {
    n: usize,
    /// F_ij.
    factors: Vec<f64>,
}

/// A function on the patches: radiance, the same in all directions.
type Radiance = Vec<f64>;

impl Patches {
    fn new(n: usize) -> Self {
        let count = 6 * n * n;
        let row = |i: usize| (0..count).map(|j| Self::factor(n, i, j)).collect::<Vec<_>>();
        let factors = (0..count).into_par_iter().flat_map_iter(row).collect();
        Self { n, factors }
    }

    fn count(&self) -> usize {
        6 * self.n * self.n
    }

    fn wall(n: usize, patch: usize) -> usize {
        patch / (n * n)
    }

    /// The extents of a patch along the two axes of its wall that are not its normal's, in their order.
    fn extents(n: usize, patch: usize) -> [[f64; 2]; 2] {
        let side = |k: usize| [0, 1].map(|e| -1.0 + 2.0 * (k + e) as f64 / n as f64);
        [side(patch / n % n), side(patch % n)]
    }

    fn factor(n: usize, i: usize, j: usize) -> f64 {
        let (a, b) = (Self::wall(n, i), Self::wall(n, j));
        let (p, q) = (Self::extents(n, i), Self::extents(n, j));
        let area = (2.0 / n as f64).powi(2);
        let (axis_a, axis_b) = (a / 2, b / 2);
        if a == b {
            0.0
        } else if axis_a == axis_b {
            parallel(p, q, 2.0) / area
        } else {
            // Along the edge where the walls meet, and away from it on either.
            let others = |axis: usize| [0, 1, 2].into_iter().filter(move |x| *x != axis);
            let along = 3 - axis_a - axis_b;
            let of = |extents: [[f64; 2]; 2], axis: usize, wanted: usize| {
                extents[others(axis).position(|x| x == wanted).expect("one of its axes")]
            };
            let away = |extent: [f64; 2], wall: usize| {
                let [lo, hi] = extent;
                if wall.is_multiple_of(2) { [lo + 1.0, hi + 1.0] } else { [1.0 - hi, 1.0 - lo] }
            };
            perpendicular(
                [away(of(p, axis_a, axis_b), b), of(p, axis_a, along)],
                [away(of(q, axis_b, axis_a), a), of(q, axis_b, along)],
            ) / area
        }
    }

    fn of_walls(&self, walls: [f64; 6]) -> Radiance {
        (0..self.count()).map(|i| walls[Self::wall(self.n, i)]).collect()
    }

    /// T: what arrives at every patch from every other is what leaves there.
    fn propagate(&self, leaving: &Radiance) -> Vec<Radiance> {
        vec![leaving.clone(); self.count()]
    }

    /// R: ∫ f L_i cos θ dω = ρ Σ_j F_ij L_ij.
    fn reflect(&self, arriving: &[Radiance]) -> Radiance {
        let row = |i: usize| &self.factors[i * self.count()..(i + 1) * self.count()];
        let sum = |i: usize| row(i).iter().zip(&arriving[i]).map(|(f, l)| f * l).sum::<f64>();
        (0..self.count()).map(|i| ALBEDO[Self::wall(self.n, i)] * sum(i)).collect()
    }

    /// K = R∘T.
    fn k(&self, leaving: &Radiance) -> Radiance {
        self.reflect(&self.propagate(leaving))
    }

    /// (I − K)⁻¹ L_e by Gaussian elimination with pivots.
    fn solve(&self, emitted: &Radiance) -> Radiance {
        let n = self.count();
        let entry =
            |i: usize, j: usize| f64::from(u8::from(i == j)) - ALBEDO[Self::wall(self.n, i)] * self.factors[i * n + j];
        let mut rows: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| entry(i, j)).chain([emitted[i]]).collect()).collect();
        for k in 0..n {
            let pivot = (k..n).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs())).expect("a row");
            rows.swap(k, pivot);
            let (done, rest) = rows.split_at_mut(k + 1);
            for row in rest {
                let factor = row[k] / done[k][k];
                for (x, y) in row[k..].iter_mut().zip(&done[k][k..]) {
                    *x -= factor * y;
                }
            }
        }
        let mut solution = vec![0.0; n];
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| rows[i][j] * solution[j]).sum();
            solution[i] = (rows[i][n] - known) / rows[i][i];
        }
        solution
    }

    /// The mean over each of 2 × 2 quarters of a wall.
    fn quarters(&self, wall: usize, radiance: &Radiance) -> [f64; 4] {
        let half = self.n / 2;
        let mut sums = [0.0; 4];
        for row in 0..self.n {
            for column in 0..self.n {
                sums[row / half * 2 + column / half] += radiance[(wall * self.n + row) * self.n + column];
            }
        }
        sums.map(|s| s / (half * half) as f64)
    }
}

fn largest(f: &Radiance) -> f64 {
    f.iter().fold(0.0, |a, b| a.max(b.abs()))
}

/// Numbers of no pattern in [−1, 1).
fn random(seed: u32, count: usize) -> Radiance {
    let mut sampler = Independent::new(5, seed, 0, Stream::Camera);
    (0..count).map(|_| f64::from(2.0 * sampler.next_1d() - 1.0)).collect()
}

#[test]
fn k_is_linear_and_shrinks_what_it_is_applied_to() {
    let patches = Patches::new(4);
    let n = patches.count();
    for i in 0..n {
        let row: f64 = patches.factors[i * n..(i + 1) * n].iter().sum();
        assert!((row - 1.0).abs() < 1e-9, "all that leaves patch {i} arrives: {row}");
        for j in 0..n {
            let (there, back) = (patches.factors[i * n + j], patches.factors[j * n + i]);
            assert!(there >= -1e-12 && (there - back).abs() < 1e-9, "reciprocity between {i} and {j}: {there}, {back}");
        }
    }
    let most = ALBEDO.into_iter().fold(0.0, f64::max);
    for seed in 0..20 {
        let (f, g) = (random(2 * seed, n), random(2 * seed + 1, n));
        let (a, b) = (1.7, -0.6);
        let mixed: Radiance = f.iter().zip(&g).map(|(x, y)| a * x + b * y).collect();
        let (kf, kg, km) = (patches.k(&f), patches.k(&g), patches.k(&mixed));
        for i in 0..n {
            assert!((km[i] - (a * kf[i] + b * kg[i])).abs() < 1e-12);
        }
        assert!(largest(&kf) <= most * largest(&f));
    }
    // ‖K‖_∞ is the largest sum of a row, and reached by a constant.
    let norm = largest(&patches.k(&vec![1.0; n]));
    println!("‖K‖ = {norm:.6}");
    assert!((norm - most).abs() < 1e-9 && norm < 1.0);
}

#[test]
fn partial_sums_of_the_neumann_series_approach_the_solution() {
    let patches = Patches::new(4);
    let emitted = patches.of_walls(EMISSION);
    let solution = patches.solve(&emitted);
    let residual: f64 =
        patches.k(&solution).iter().zip(&emitted).zip(&solution).map(|((k, e), l)| (e + k - l).abs()).sum();
    assert!(residual < 1e-10, "L = L_e + K L: {residual}");
    let (mut term, mut sum, mut before) = (emitted.clone(), emitted.clone(), f64::INFINITY);
    let most = ALBEDO.into_iter().fold(0.0, f64::max);
    for i in 1..=120 {
        term = patches.k(&term);
        sum.iter_mut().zip(&term).for_each(|(s, t)| *s += t);
        let rest: Radiance = solution.iter().zip(&sum).map(|(l, s)| l - s).collect();
        // ‖L − Σ_{k≤i} K^k L_e‖ ≤ ‖K‖ ‖L − Σ_{k<i}‖.
        assert!(largest(&rest) <= most * before + 1e-12, "term {i}");
        before = largest(&rest);
    }
    assert!(before < 1e-9, "{before}");
}

/// The box with a camera that sees one wall whole: its film fills the middle of the box.
fn room(wall: usize) -> Scene {
    let mut g = Geometry::default();
    scenes::cube_inside(&mut g, 1.0, [0, 1, 2, 3, 4, 5]);
    let materials = (0..6)
        .map(|i| Material::diffuse("wall", Rgb::splat(ALBEDO[i] as f32)).emitting(Rgb::splat(EMISSION[i] as f32)))
        .collect();
    let axis = [Vec3::X, Vec3::Y, Vec3::Z][wall / 2];
    let forward = if wall.is_multiple_of(2) { -axis } else { axis };
    let sensor = Sensor { width: 8, height: 8, padding: 0 };
    Scene::new(g, materials, &[], Camera::orthographic(Vec3::ZERO, forward, axis.any_orthonormal_vector(), 2.0, sensor))
}

/// K^i L_e on the quarters of each wall, for i = 0 … , from small patches. The slack is by how much patches twice as
/// large differ: the error of the smaller ones is less if it falls at least linearly with their size.
fn terms(count: usize) -> Vec<[[Expectation; 4]; 6]> {
    let of = |n: usize| {
        let patches = Patches::new(n);
        let mut term = patches.of_walls(EMISSION);
        let quarters = |_| {
            let quarters = [0, 1, 2, 3, 4, 5].map(|wall| patches.quarters(wall, &term));
            term = patches.k(&term);
            quarters
        };
        (0..count).map(quarters).collect::<Vec<_>>()
    };
    let [coarse, fine] = [8, 16].map(of);
    let at = |i: usize, wall: usize, q: usize| {
        let value = fine[i][wall][q];
        Expectation { value, slack: (value - coarse[i][wall][q]).abs() }
    };
    let quarters = |i: usize, wall: usize| [0, 1, 2, 3].map(|q| at(i, wall, q));
    (0..count).map(|i| [0, 1, 2, 3, 4, 5].map(|wall| quarters(i, wall))).collect()
}

/// Paths of n edges are K^{n−1} L_e, on each quarter of a wall that emits, of one that does not, and of one in between.
#[test]
fn integrators_find_each_power_of_k() {
    const DEPTH: usize = 5;
    let terms = terms(DEPTH);
    for wall in [0, 3, 4] {
        let scene = room(wall);
        let axis = wall / 2;
        let others: [usize; 2] = [(0, [1, 2]), (1, [0, 2]), (2, [0, 1])][axis].1;
        let quarter = |p: Vec3| {
            let half = |k: usize| usize::from(p[others[k]] >= 0.0);
            half(0) * 2 + half(1)
        };
        let bin = |path: &JoinedPath| Some((path.edges() as usize - 1) * 4 + quarter(path.vertex(1).point.position));
        let truth: Vec<_> = terms.iter().map(|walls| walls[wall]).collect();
        for (i, term) in truth.iter().enumerate() {
            let slack = term.iter().map(|e| if e.value > 0.0 { e.slack / e.value } else { 0.0 }).fold(0.0, f64::max);
            println!("  wall {wall}, K^{i} L_e = {:.6} …, discretised to {:.3} %", term[0].value, 100.0 * slack);
            assert!(slack < 0.005);
        }
        // A quarter is a fourth of the image's mean.
        let part = |e: Expectation| Expectation { value: e.value / 4.0, slack: e.slack / 4.0 };
        let truth: Vec<_> = truth.iter().flatten().map(|e| part(*e)).collect();
        let kinds: &[IntegratorKind] =
            if wall == 0 { &WEIGHTED } else { &[IntegratorKind::Path, IntegratorKind::Bdpt] };
        assert_bins(&format!("wall {wall}"), &scene, kinds, DEPTH as u32, 0.03, (&bin, &truth));
    }
}

/// R∘T by rays: K f at points of a patch, with T f(p, ω) = f(tr(p, ω)) asked of the scene and R as a mean over
/// directions.
#[test]
fn k_by_rays_is_k_by_configuration_factors() {
    const N: usize = 4;
    const SAMPLES: u32 = 4096;
    let patches = Patches::new(N);
    let scene = room(0);
    let f: Radiance = random(77, patches.count()).iter().map(|x| x + 1.5).collect();
    let truth = patches.k(&f);
    let patch_of = |p: &Point| {
        let wall = p.material.0 as usize;
        let others: [usize; 2] = [[1, 2], [0, 2], [0, 1]][wall / 2];
        let cell = |axis: usize| (((p.position[axis] + 1.0) * 0.5 * N as f32) as usize).min(N - 1);
        (wall * N + cell(others[0])) * N + cell(others[1])
    };
    let mut sums = vec![(0.0, 0.0, 0.0); patches.count()];
    let mut sampler = Independent::new(8, 0, 0, Stream::Camera);
    for _ in 0..SAMPLES * 96 {
        let p = scene.surfaces().sample(&scene, sampler.next_2d(), sampler.next_choice()).expect("walls");
        let w = Frame::around(p.normal).to_world(warp::cosine_hemisphere(sampler.next_2d().to_array()));
        let q = scene.trace(&p, w).expect("the box is closed");
        let i = patch_of(&p);
        let value = ALBEDO[p.material.0 as usize] * f[patch_of(&q)];
        let sum = &mut sums[i];
        *sum = (sum.0 + 1.0, sum.1 + value, sum.2 + value * value);
    }
    let mut chi2 = 0.0;
    for (i, (n, sum, squares)) in sums.iter().enumerate() {
        let mean = sum / n;
        let error = ((squares / n - mean * mean) / n).sqrt();
        let z = (mean - truth[i]) / error;
        chi2 += z * z;
        assert!(z.abs() < 5.0, "patch {i}: {mean} instead of {}, {z} standard errors", truth[i]);
        assert!(error / truth[i] < 0.01);
    }
    // χ² of 96 patches: mean 96, variance 192.
    println!("  χ² = {chi2:.1} of {} patches", sums.len());
    assert!((chi2 - 96.0).abs() < 4.0 * 192.0_f64.sqrt());
}

/// Radiance is invariant along rays: tr(p, ω) = q looks back at p, tr(q, −ω) = p, and V(p↔q) = 1 both ways, so that
/// L_i(p, ω) = L_o(q, −ω).
#[test]
fn a_ray_leads_back_to_where_it_came_from() {
    let sensor = scenes::square(8, Filter::Box);
    let scenes: [(&str, Scene, u32); 5] = [
        ("box", room(0), 1),
        ("sphere", scenes::sphere_furnace(0.5, 1.0, sensor), 1),
        ("zoo", scenes::zoo(sensor), 4),
        ("cornell box with spheres", scenes::load("cornell-spheres", sensor), 4),
        ("terrace", lights::terrace(0.7, sensor), 4),
    ];
    for (name, scene, tolerated) in scenes {
        let mut sampler = Independent::new(3, 0, 0, Stream::Camera);
        let (mut rays, mut lost, mut unseen, mut skimming, mut worst) = (0_u32, 0, 0, 0, 0.0_f32);
        while rays < 20_000 {
            let p = scene.surfaces().sample(&scene, sampler.next_2d(), sampler.next_choice()).expect("surfaces");
            let w = warp::sphere(sampler.next_2d());
            let Some(q) = scene.trace(&p, w) else {
                rays += 1;
                assert!(scene.visible(&p, &Point { place: Place::Infinite, ..Point::nowhere(w) }) == 1.0, "{name}");
                continue;
            };
            rays += 1;
            let back = (p.position - q.position).normalize();
            let scale = p.position.distance(q.position);
            // A ray within its own rounding of an edge may end next door, and a flat one a little further on.
            let flat = p.normal.dot(w).abs().min(q.normal.dot(w).abs());
            let near = 1e-5 * (1.0 + scale) / flat;
            let found = scene.trace(&q, back).filter(|r| r.position.distance(p.position) < near);
            match found {
                Some(r) => {
                    worst = worst.max(r.position.distance(p.position) * flat);
                    assert!(r.primitive != p.primitive || scene.le(&r, w) == scene.le(&p, w), "{name}");
                }
                None => lost += 1,
            }
            let (there, again) = (scene.visible(&p, &q), scene.visible(&q, &p));
            assert_eq!(there, again, "{name}: V is symmetric");
            if p.is_in_one_plane_with(&q) {
                assert_eq!(there, 0.0, "{name}: nothing is seen in its own plane");
                skimming += 1;
            } else {
                unseen += u32::from(there != 1.0);
            }
        }
        println!(
            "  {name}: {lost} of {rays} rays do not lead back, {unseen} ends do not see each other and {skimming} are \
             in one plane; \
             off by {worst:.1e} m across"
        );
        assert!(lost < tolerated && unseen < tolerated, "{name}: {lost} lost, {unseen} unseen");
        assert!(
            skimming < 10,
            "{name}: {skimming} in one plane, where uniform directions have a cosine below some 1e-4"
        );
    }
}

/// The mean over all directions of a wall's own emission is what T leaves of it: L_i integrates to π L_e where nothing
/// else is seen.
#[test]
fn what_arrives_is_what_left() {
    let scene = scenes::sphere_furnace(0.5, 1.5, scenes::square(8, Filter::Box));
    let mut sampler = Independent::new(4, 0, 0, Stream::Camera);
    for _ in 0..2000 {
        let p = scene.surfaces().sample(&scene, sampler.next_2d(), Choice::from(0.5)).expect("wall");
        let w = -Frame::around(p.normal).to_world(warp::cosine_hemisphere(sampler.next_2d().to_array()));
        let q = scene.trace(&p, w).expect("closed");
        assert_eq!(scene.le(&q, -w), Rgb::splat(1.5));
        // In a sphere G is 1/(4R²) between any two points (R = 1.5).
        let d = q.position.as_dvec3() - p.position.as_dvec3();
        let cos = |n: Vec3| n.as_dvec3().dot(d.normalize()).abs();
        let g = cos(p.normal) * cos(q.normal) / DVec3::length_squared(d);
        assert!((g * 4.0 * 2.25 - 1.0).abs() < 1e-3 || d.length() < 0.05, "G = {g}");
    }
}
