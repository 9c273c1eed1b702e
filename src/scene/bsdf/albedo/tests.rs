//! The tables against quadratures, and their making.
//!
//! Oracle: Walter et al. 2007 with Smith's height-correlated G2, integrated in f64; 1 − ln 2 where the integral has a
//! closed form.

use std::f64::consts::{LN_2, PI};

use super::*;
use crate::scene::bsdf::tests::ledger::reflectance;

/// What one scattering of a unit of light comes to, seen from one direction.
#[derive(Clone, Copy, Debug, Default)]
struct Albedo {
    /// Reflected by facets that reflect everything: E₁.
    mirror: f64,
    /// By facets with Schlick's weight: B.
    grazing: f64,
    /// Reflected and refracted at a boundary: E.
    boundary: f64,
}

/// Smith's Λ (Heitz 2014, eq. 72).
fn lambda(cos: f64, alpha: f64) -> f64 {
    let cos = cos.min(1.0);
    0.5 * ((1.0 + alpha * alpha * (1.0 - cos * cos) / (cos * cos)).sqrt() - 1.0)
}

/// The albedos from `mu` by the midpoint rule over the facets visible from there, `n`² of a half of them.
fn albedo(mu: f64, alpha: f64, eta: f64, n: usize) -> Albedo {
    let sin = (1.0 - mu * mu).max(0.0).sqrt();
    let length = (alpha * sin).hypot(mu);
    let stretched = (alpha * sin / length, mu / length);
    let own = 1.0 + lambda(mu, alpha);
    let mut sum = Albedo::default();
    for j in 0..n {
        let v = (j as f64 + 0.5) / n as f64;
        // Denser at both ends of the cap, where directions turn fast.
        let (v, weight) = (v * v * (3.0 - 2.0 * v), 6.0 * v * (1.0 - v));
        let height = v * (1.0 + stretched.1);
        let z = height - stretched.1;
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        for i in 0..n {
            let (y, x) = (PI * (i as f64 + 0.5) / n as f64).sin_cos();
            let h = (alpha * (r * x + stretched.0), alpha * r * y, height);
            let length = (h.0 * h.0 + h.1 * h.1 + h.2 * h.2).sqrt();
            let cos = ((sin * h.0 + mu * h.2) / length).clamp(0.0, 1.0);
            let fresnel = reflectance(cos, eta);
            let up = 2.0 * cos * h.2 / length - mu;
            if up > 0.0 {
                let g = weight * own / (own + lambda(up, alpha));
                sum.mirror += g;
                sum.grazing += g * (1.0 - cos).powi(5);
                sum.boundary += g * fresnel;
            }
            let inside = (cos * cos + eta * eta - 1.0).max(0.0).sqrt() / eta;
            let down = mu / eta - h.2 / length * (cos / eta - inside);
            if fresnel < 1.0 && down > 0.0 {
                sum.boundary += weight * own / (own + lambda(down, alpha)) * (1.0 - fresnel);
            }
        }
    }
    let n = (n * n) as f64;
    Albedo { mirror: sum.mirror / n, grazing: sum.grazing / n, boundary: sum.boundary / n }
}

/// Where the increasing `f` of [0, 1] is `y`, by bisection.
fn invert(f: impl Fn(f32) -> f32, y: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f64::from(f(middle as f32)) < y { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The cosine and α at the coordinates of an entry, and η on the thin side.
fn parameters([x, y, z]: [f64; 3]) -> (f64, f64, f64) {
    let alpha = alpha(y);
    let mu = invert(|mu| direction_coordinate(mu, alpha as f32), x).clamp(1e-5 * alpha, 1.0);
    (mu, alpha, index(z, alpha))
}

/// η at a coordinate, on the thin side. Nearer to 1 than it ever is every boundary is matched.
fn index(z: f64, alpha: f64) -> f64 {
    let q = invert(|q| index_coordinate(q, alpha as f32), z).clamp(7e-3, 0.9999);
    (1.0 + q * q) / (1.0 - q * q)
}

/// α at a coordinate.
fn alpha(y: f64) -> f64 {
    invert(roughness_coordinate, y).clamp(f64::from(LEAST_ROUGHNESS), 1.0).powi(2)
}

fn fraction(i: usize, n: usize) -> f64 {
    i as f64 / (n - 1) as f64
}

/// 2∫ g(μ) μ dμ over [0, 1], dense where μ is small.
fn average(g: impl Fn(f32) -> f32) -> f64 {
    let n = 600;
    let term = |i: usize| {
        let z = (i as f64 + 0.5) / f64::from(n as u32);
        let mu = z * z * z;
        f64::from(g(mu as f32)) * 2.0 * mu * 3.0 * z * z
    };
    (0..n).map(term).sum::<f64>() / f64::from(n as u32)
}

/// Run it to write `tables.bin` anew: `cargo test --release --lib write_the_tables -- --ignored`; it takes two minutes.
#[test]
#[ignore = "it writes a source file"]
fn write_the_tables() {
    let mut bytes = Box::new([0; 2 * ENTRIES]);
    let put = |bytes: &mut [u8; 2 * ENTRIES], i: usize, value: f64| {
        assert!((0.0..=1.0).contains(&value), "{i}: {value}");
        bytes[2 * i..2 * i + 2].copy_from_slice(&((value * 65535.0).round() as u16).to_le_bytes());
    };
    for j in 0..SPLIT[1] {
        for i in 0..SPLIT[0] {
            let (mu, alpha, _) = parameters([fraction(i, SPLIT[0]), fraction(j, SPLIT[1]), 0.0]);
            let a = albedo(mu, alpha, 1.5, 160);
            let at = j * SPLIT[0] + i;
            put(&mut bytes, at, (1.0 - a.mirror).max(0.0).sqrt());
            let deviation = (a.grazing / a.mirror - (1.0 - mu).powi(5)) / alpha.sqrt();
            put(&mut bytes, DEVIATION + at, 0.5 + 0.5 * deviation / f64::from(DEVIATION_RANGE));
        }
    }
    for side in 0..2 {
        let [nx, ny, nz] = BOUNDARY[side];
        for at in 0..size(BOUNDARY[side]) {
            let (i, j, k) = (at % nx, at / nx % ny, at / (nx * ny));
            let (mu, alpha, eta) = parameters([fraction(i, nx), fraction(j, ny), fraction(k, nz)]);
            // Smooth boundaries want more facets, and what is least exact, the dense side, must not send back more than
            // came.
            let a = albedo(mu, alpha, if side == 0 { eta } else { 1.0 / eta }, if j < 3 { 120 } else { 72 });
            let lowered = [1.0, 0.9985][side];
            let missing = lowered * (1.0 - a.boundary).max(0.0) / f64::from(boundary_range(j as u32));
            put(&mut bytes, BOUNDARIES[side] + at, missing);
        }
    }
    let mut averages = Vec::new();
    let tables = Tables { bytes: &bytes };
    for j in 0..SPLIT_AVERAGES {
        let alpha = alpha(fraction(j, SPLIT_AVERAGES));
        let missing = average(|mu| tables.split(mu, alpha as f32).missing);
        averages.push((AVERAGES + j, (missing / alpha).sqrt()));
        averages.push((GRAZING_AVERAGES + j, average(|mu| tables.split(mu, alpha as f32).grazing)));
    }
    for side in 0..2 {
        let [nx, ny] = BOUNDARY_AVERAGES[side];
        for at in 0..nx * ny {
            let alpha = alpha(fraction(at % nx, nx));
            let eta = index(fraction(at / nx, ny), alpha);
            let eta = if side == 0 { eta } else { 1.0 / eta };
            let missing = average(|mu| tables.boundary(mu, alpha as f32, eta as f32));
            averages.push((AVERAGE_BOUNDARIES[side] + at, (missing / alpha).sqrt()));
        }
    }
    for (i, value) in averages {
        put(&mut bytes, i, value);
    }
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/bsdf/albedo/tables.bin"), *bytes).unwrap();
}

/// Fractions in [0, 1) that fill the unit cube evenly: a Kronecker sequence in the powers of the plastic number's
/// cousin for 3.
fn even(i: u32) -> [f64; 3] {
    [0.819_172_513_396_164_5, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3]
        .map(|step| (0.5 + step * f64::from(i)).fract())
}

#[test]
fn tables_interpolate_what_quadratures_find() {
    let mut worst = [0.0_f64; 4];
    for i in 0..600 {
        let [a, b, c] = even(i);
        // Cosines and indices evenly and by their logarithms.
        let mu = if i % 2 == 0 { 1e-3_f64.powf(a) } else { 1e-3 + 0.999 * a };
        let roughness = f64::from(LEAST_ROUGHNESS).powf(if i % 4 < 2 { b } else { 0.3 * b });
        let alpha = roughness * roughness;
        let eta = if i % 3 == 0 { 1.0 + 2e-3 * 1e3_f64.powf(c) } else { 1.05 + 2.0 * c };
        let n = if alpha < 0.01 { 200 } else { 90 };
        let (dense, thin) = (albedo(mu, alpha, eta, n), albedo(mu, alpha, 1.0 / eta, n));
        let (mu, alpha, eta) = (mu as f32, alpha as f32, eta as f32);
        let split = TABLES.split(mu, alpha);
        let errors = [
            1.0 - f64::from(split.missing) - dense.mirror,
            f64::from(split.grazing) - dense.grazing,
            1.0 - f64::from(TABLES.boundary(mu, alpha, eta)) - dense.boundary,
            1.0 - f64::from(TABLES.boundary(mu, alpha, 1.0 / eta)) - thin.boundary,
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error.abs());
        }
    }
    for (worst, stated) in worst.into_iter().zip([0.0008, 0.0008, 0.002, 0.003]) {
        assert!(worst < stated, "{worst}, stated are {stated}");
    }
}

#[test]
fn a_mirror_of_slope_one_keeps_one_minus_the_logarithm_of_two() {
    // At α = 1 facets are uniform over the hemisphere: ∫ 2c·2(2c² − 1)/(2c²) dc over c² > 1/2, seen from above.
    let split = TABLES.split(1.0, 1.0);
    assert!((1.0 - f64::from(split.missing) - (1.0 - LN_2)).abs() < 2e-4, "{split:?}");
    assert!((albedo(1.0, 1.0, 1.5, 256).mirror - (1.0 - LN_2)).abs() < 5e-5);
}

/// An error of an average is one of the furnace by as much as is missing, and least visible where little is.
#[test]
fn averages_are_those_of_the_tables() {
    for i in 0..400 {
        let [a, b, _] = even(i);
        let alpha = 1e-3_f32.powf(a as f32);
        let eta = 1.0 + 2e-3 * 1e3_f32.powf(b as f32);
        let check = |name: &str, found: f32, missing: &dyn Fn(f32) -> f32| {
            let most = (0..60).map(|i| missing(0.89_f32.powi(i))).fold(0.0, f32::max);
            let error = (f64::from(found) / average(missing) - 1.0).abs() * f64::from(most);
            assert!(error < 0.001, "{name}, α = {alpha}, η = {eta}: {error}");
        };
        check("E₁", TABLES.average_split(alpha).missing, &|mu| TABLES.split(mu, alpha).missing);
        for eta in [eta, 1.0 / eta] {
            check("E", TABLES.average_boundary(alpha, eta), &|mu| TABLES.boundary(mu, alpha, eta));
        }
        let grazing = average(|mu| TABLES.split(mu, alpha).grazing);
        assert!((f64::from(TABLES.average_split(alpha).grazing) - grazing).abs() < 3e-4, "α = {alpha}: {grazing}");
    }
}

#[test]
fn entries_are_fractions_rounded_once() {
    for n in 0..=u32::from(u16::MAX) {
        assert_eq!(super::fraction(n), n as f32 / 65535.0, "{n}");
    }
}
