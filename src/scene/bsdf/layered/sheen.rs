//! Sheen: fibres that stand on the surface (`KHR_materials_sheen`; Estevez & Kulla 2017, *Production Friendly
//! Microfacet Sheen BRDF*), and fuzz, the same over all else (`KHR_materials_fuzz`).
//!
//! f = c D/(4 cos θ cos θ' (1 + Λ + Λ')), reciprocal, with the inverted Gaussian-like D of sines and the paper's fit of
//! Λ. What lies below gets 1 − max(c) E, E the lobe's albedo, which a table has. Fuzz covers it by its amount w
//! instead, whatever its colour: f has w c for c, and below it is 1 − w E.

use std::{
    f32::consts::{FRAC_1_PI, PI, TAU},
    sync::LazyLock,
};

use glam::Vec3;

use super::{End, Part, SheenPlace, Stack};
use crate::math::Rgb;

/// The least α: below it D is a needle at the horizon.
pub(super) const LEAST_ALPHA: f32 = 0.01;

/// The sheen's lobe.
pub(super) struct Sheen;

impl Part for Sheen {
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb {
        if s.surface.sheen == Rgb::ZERO || !a.covered {
            return Rgb::ZERO;
        }
        let f = value(s.surface.sheen_alpha, a.up, b.up) / most(s.surface.sheen_alpha);
        let sheen = s.surface.sheen * (f * a.to_sheen.min(b.to_sheen));
        match s.surface.sheen_place {
            SheenPlace::UnderCoat => sheen * (a.tint * b.tint),
            SheenPlace::OverAll { .. } => sheen,
        }
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        s.surface.sheen.max_element() * from.sheen * from.to_sheen
    }

    fn sample(&self, _: &Stack, _: &End, [u, v, _]: [f32; 3]) -> Vec3 {
        let (sin, cos) = (v * TAU).sin_cos();
        let r = (1.0 - u * u).sqrt();
        Vec3::new(r * cos, r * sin, u)
    }

    fn density(&self, _: &Stack, _: &End, _: &End) -> f32 {
        0.5 * FRAC_1_PI
    }
}

/// D (Estevez & Kulla 2017, eq. 2), by the squared sine.
fn distribution(alpha: f32, sin2: f32) -> f32 {
    (2.0 + 1.0 / alpha) * sin2.powf(0.5 / alpha) / TAU
}

/// Λ (Estevez & Kulla 2017, section 3).
fn lambda(alpha: f32, cos: f32) -> f32 {
    let t = (1.0 - alpha) * (1.0 - alpha);
    let mix = |rough: f32, smooth: f32| rough + (smooth - rough) * t;
    let [a, b, c] = [mix(21.5473, 25.3245), mix(3.82987, 3.32435), mix(0.19823, 0.16801)];
    let [d, e] = [mix(-1.97760, -1.27393), mix(-4.32054, -4.85967)];
    let l = |x: f32| a / (1.0 + b * x.powf(c)) + d * x + e;
    if cos < 0.5 { l(cos).exp() } else { (2.0 * l(0.5) - l(1.0 - cos)).exp() }
}

/// f of a white sheen, 1/sr.
fn value(alpha: f32, a: Vec3, b: Vec3) -> f32 {
    let sum = a + b;
    let sin2 = (sum.x * sum.x + sum.y * sum.y) / sum.length_squared();
    distribution(alpha, sin2) / (4.0 * a.z * b.z * (1.0 + lambda(alpha, a.z) + lambda(alpha, b.z)))
}

/// Rows of the table, over √α, and columns, over √cos θ.
const ROWS: usize = 24;
const COLUMNS: usize = 32;

/// Of each row the albedo of the lobe, and what it is divided by: the greatest, where that is more than 1.
struct Table {
    albedo: Vec<f32>,
    most: Vec<f32>,
}

static TABLE: LazyLock<Table> = LazyLock::new(Table::new);

/// The number of the entry below the fraction `x` of `n` entries, and how far `x` lies towards the next.
fn place(x: f32, n: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (x as usize).min(n - 2);
    (i, x - i as f32)
}

fn row(alpha: f32) -> (usize, f32) {
    let least = LEAST_ALPHA.sqrt();
    place((alpha.sqrt() - least) / (1.0 - least), ROWS)
}

/// By what the paper's lobe is divided so that nobody gets more than there is: smooth sheens shine at the horizon.
fn most(alpha: f32) -> f32 {
    let (j, v) = row(alpha);
    TABLE.most[j] + (TABLE.most[j + 1] - TABLE.most[j]) * v
}

/// The albedo of a white sheen towards a direction of this cosine, at most 1.
pub(super) fn albedo(alpha: f32, cos: f32) -> f32 {
    let ((i, u), (j, v)) = (place(cos.sqrt(), COLUMNS), row(alpha));
    let at = |i: usize, j: usize| TABLE.albedo[j * COLUMNS + i];
    let of_row = |j: usize| at(i, j) + (at(i + 1, j) - at(i, j)) * u;
    ((of_row(j) + (of_row(j + 1) - of_row(j)) * v) / most(alpha)).min(1.0)
}

impl Table {
    fn new() -> Self {
        let least = LEAST_ALPHA.sqrt();
        let entry = |k: usize| {
            let (i, j) = (k % COLUMNS, k / COLUMNS);
            let root = least + (1.0 - least) * j as f32 / (ROWS - 1) as f32;
            let root_cos = (i as f32 / (COLUMNS - 1) as f32).max(1e-2);
            integral(root * root, root_cos * root_cos)
        };
        let albedo: Vec<_> = (0..ROWS * COLUMNS).map(entry).collect();
        let most = albedo.chunks(COLUMNS).map(|row| row.iter().copied().fold(1.0, f32::max)).collect();
        Self { albedo, most }
    }
}

/// ∫ f cos θ' dω' by the midpoint rule.
pub(super) fn integral(alpha: f32, cos: f32) -> f32 {
    const N: usize = 40;
    let a = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let mut sum = 0.0;
    for i in 0..N {
        // Denser at the horizon, where smooth sheens are.
        let x = (i as f32 + 0.5) / N as f32;
        let z = x * x;
        let r = (1.0 - z * z).sqrt();
        for j in 0..N {
            // And near the plane of incidence.
            let y = (j as f32 + 0.5) / N as f32;
            let (phi, stretch) = (y * y * (3.0 - 2.0 * y) * PI, 6.0 * y * (1.0 - y));
            let b = Vec3::new(r * phi.cos(), r * phi.sin(), z);
            sum += value(alpha, a, b) * z * 2.0 * x * stretch;
        }
    }
    sum * TAU / (N * N) as f32
}

/// What sheen keeps from all that lies below, towards a direction of this cosine.
pub(super) fn taken(s: &Stack, cos: f32) -> f32 {
    if s.sheen_cover == 0.0 { 0.0 } else { s.sheen_cover * albedo(s.surface.sheen_alpha, cos) }
}
