//! The albedos of facets with a grain, as [`albedo`](super::super::albedo) has those of facets without.
//!
//! No isotropic surface has the albedos of one with a grain: they have a table of their own, over the direction, and
//! α across the grain and along it: the root of what meets another facet, and what Schlick's weight reflects.

use std::{f32::consts::FRAC_PI_2, sync::LazyLock};

use glam::Vec3;

use super::{base::mirror, facets::Facets};
use crate::scene::bsdf::{albedo::Split, fresnel};

/// Entries over √cos θ, the angle from the grain, ⁴√α_y, and how far ⁴√α_x is from there to 1.
const SIZE: [usize; 4] = [14, 6, 10, 9];

/// [`Split`]s and their means.
struct Table {
    /// √(1 − E₁) and B.
    entries: Vec<[f32; 2]>,
    averages: Vec<[f32; 2]>,
}

static TABLE: LazyLock<Table> = LazyLock::new(Table::new);

fn of([root, grazing]: [f32; 2]) -> Split {
    let missing = root * root;
    Split { normal: 1.0 - missing - grazing, grazing, missing }
}

/// The least of [`coordinate`].
const LEAST: f32 = 0.18;

/// ⁴√α: albedos of smooth surfaces go as α².
fn coordinate(alpha: f32) -> f32 {
    alpha.sqrt().sqrt()
}

/// The places of these facets along the last two axes.
fn place(facets: Facets) -> [f32; 2] {
    let [x, y] = [coordinate(facets.x), coordinate(facets.y)];
    [(y - LEAST) / (1.0 - LEAST), ((x - y) / (1.0 - y).max(1e-6)).clamp(0.0, 1.0)]
}

/// The split towards `w`, whose first coordinate lies along the grain.
pub(super) fn split(facets: Facets, w: Vec3) -> Split {
    let phi = w.y.abs().atan2(w.x.abs()) / FRAC_PI_2;
    let [y, x] = place(facets);
    of(interpolate(&TABLE.entries, SIZE, [w.z.sqrt(), phi, y, x]))
}

/// The cosine-weighted mean over all directions.
pub(super) fn average(facets: Facets) -> Split {
    let [y, x] = place(facets);
    of(interpolate(&TABLE.averages, [1, 1, SIZE[2], SIZE[3]], [0.0, 0.0, y, x]))
}

/// Linear between the entries at both sides along each of four axes, over [0, 1].
fn interpolate(entries: &[[f32; 2]], size: [usize; 4], at: [f32; 4]) -> [f32; 2] {
    let (mut stride, mut first) = (1, 0);
    let mut axes = [(0, 0.0); 4];
    for ((axis, n), x) in axes.iter_mut().zip(size).zip(at) {
        let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
        let i = (x as usize).min(n.saturating_sub(2));
        first += i * stride;
        *axis = (if n > 1 { stride } else { 0 }, x - i as f32);
        stride *= n;
    }
    let mut sum = [0.0; 2];
    for corner in 0..16 {
        let (mut index, mut weight) = (first, 1.0);
        for (k, (stride, x)) in axes.into_iter().enumerate() {
            let upper = corner >> k & 1;
            index += upper * stride;
            weight *= if upper == 1 { x } else { 1.0 - x };
        }
        if weight > 0.0 {
            sum[0] += weight * entries[index][0];
            sum[1] += weight * entries[index][1];
        }
    }
    sum
}

impl Table {
    fn new() -> Self {
        let [a, b, c, d] = SIZE;
        let fraction = |i: usize, n: usize| i as f32 / (n - 1) as f32;
        let entry = |k: usize| {
            let [i, j, m, n] = [k % a, k / a % b, k / (a * b) % c, k / (a * b * c)];
            let (root_cos, y) = (fraction(i, a).max(0.02), LEAST + (1.0 - LEAST) * fraction(m, c));
            let x = y + (1.0 - y) * fraction(n, d);
            let facets = Facets { x: x.powi(4), y: y.powi(4) };
            integral(root_cos * root_cos, fraction(j, b) * FRAC_PI_2, facets)
        };
        let entries: Vec<_> = (0..a * b * c * d).map(entry).collect();
        let average = |k: usize| average_of(&entries, [fraction(k % c, c), fraction(k / c, d)]);
        let averages = (0..c * d).map(average).collect();
        Self { entries, averages }
    }
}

/// The mean of what [`split`] finds.
fn average_of(entries: &[[f32; 2]], [y, x]: [f32; 2]) -> [f32; 2] {
    const COSINES: usize = 64;
    const ANGLES: usize = 2 * (SIZE[1] - 1);
    let mut sum = [0.0; 2];
    for k in 0..COSINES * ANGLES {
        let square = ((k / ANGLES) as f32 + 0.5) / COSINES as f32;
        let phi = ((k % ANGLES) as f32 + 0.5) / ANGLES as f32;
        let found = interpolate(entries, SIZE, [square.sqrt().sqrt(), phi, y, x]);
        sum = [sum[0] + found[0] * found[0], sum[1] + found[1]];
    }
    let [missing, grazing] = sum.map(|x| x / (COSINES * ANGLES) as f32);
    [missing.sqrt(), grazing]
}

/// √(1 − E₁) and B from a direction, by the facets visible from there.
fn integral(cos: f32, phi: f32, facets: Facets) -> [f32; 2] {
    const N: usize = 20;
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let from = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
    let (mut once, mut grazing) = (0.0, 0.0);
    for k in 0..2 * N * N {
        let u = (k % (2 * N)) as f32 + 0.5;
        // Denser at both ends of the cap, where directions turn fast.
        let v = ((k / (2 * N)) as f32 + 0.5) / N as f32;
        let (v, weight) = (v * v * (3.0 - 2.0 * v), 6.0 * v * (1.0 - v));
        let to = mirror(from, facets.sample_visible(from, [u / (2 * N) as f32, v]));
        let facet = facets.reflect(from, to);
        if facet.forward > 0.0 {
            let g = weight * facet.value * to.z / facet.forward;
            once += g;
            grazing += g * fresnel::schlick_power(facet.cos);
        }
    }
    let n = (2 * N * N) as f32;
    [(1.0 - once / n).max(0.0).sqrt(), grazing / n]
}
