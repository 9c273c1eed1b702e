//! The oracle of densities and energy: samples counted in bins, against quadratures of `eval` over the same bins.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::*;
use crate::math::luminance;

/// The bins of the sphere, each split into `FINE`² cells by the quadrature.
///
/// Rows are even in θ, and the horizon is a border of rows. Columns are even in t, where t|t|π is the azimuth away from
/// the forward direction −`known`: at grazing incidence a lobe is that much narrower in azimuth.
const BINS: (usize, usize) = (8, 8);
const FINE: usize = 48;

fn azimuth(w: Vec3) -> f64 {
    f64::from(w.y).atan2(f64::from(w.x))
}

fn bin(known: Vec3, w: Vec3) -> usize {
    let theta = f64::from(w.z).clamp(-1.0, 1.0).acos() / PI;
    let row = ((theta * BINS.0 as f64) as usize).min(BINS.0 - 1);
    // By the sign, not by the angle: acos cannot tell the last directions above the horizon from it.
    let row = if w.z > 0.0 { row.min(BINS.0 / 2 - 1) } else { row.max(BINS.0 / 2) };
    let away = (azimuth(w) - azimuth(-known) + PI).rem_euclid(2.0 * PI) / PI - 1.0;
    let t = 0.5 + 0.5 * away.abs().sqrt().copysign(away);
    row * BINS.1 + ((t * BINS.1 as f64) as usize).min(BINS.1 - 1)
}

/// One direction for every cell of the sphere, with azimuth relative to the forward direction, and its solid angle.
///
/// Cells are met off their middles by multiples of the golden ratio: edges of a lobe (the facets' other side, the
/// critical angle) may run along the grid, where the midpoint rule would see them all at one place.
fn cells() -> Vec<(DVec3, f64)> {
    let (rows, columns) = (BINS.0 * FINE, BINS.1 * FINE);
    let (d_theta, d_t) = (PI / rows as f64, 2.0 / columns as f64);
    let place = |i: usize, other: usize| i as f64 + (0.5 + 0.618_033_988_75 * other as f64).fract();
    let cell = |i: usize, j: usize| {
        let (sin, cos) = (place(i, j) * d_theta).sin_cos();
        let t = place(j, i) * d_t - 1.0;
        let (y, x) = (PI * t * t.abs()).sin_cos();
        (DVec3::new(sin * x, sin * y, cos), sin * d_theta * 2.0 * PI * t.abs() * d_t)
    };
    (0..rows).flat_map(|i| (0..columns).map(move |j| cell(i, j))).collect()
}

/// ∫ g dω for every bin, over the given [`cells`].
fn integrate<const N: usize>(
    cells: &[(DVec3, f64)],
    known: Vec3,
    mut g: impl FnMut(Vec3) -> [f64; N],
) -> Vec<[f64; N]> {
    let (y, x) = azimuth(-known).sin_cos();
    let mut bins = vec![[0.0; N]; BINS.0 * BINS.1];
    for (k, (w, solid_angle)) in cells.iter().enumerate() {
        let values = g(DVec3::new(x * w.x - y * w.y, y * w.x + x * w.y, w.z).as_vec3());
        let (i, j) = (k / (BINS.1 * FINE), k % (BINS.1 * FINE));
        for (sum, v) in bins[i / FINE * BINS.1 + j / FINE].iter_mut().zip(values) {
            *sum += v * solid_angle;
        }
    }
    bins
}

/// |dω_light/dω_camera| of a delta, from Snell's law.
fn jacobian(bsdf: &Bsdf, to_camera: Vec3, to_light: Vec3) -> f64 {
    let eta = f64::from(bsdf.relative_ior(to_camera, to_light));
    f64::from(to_camera.z.abs()) / (eta * eta * f64::from(to_light.z.abs()))
}

/// What `n` samples from one direction came to, and what they should have come to.
struct Tally {
    /// Samples of the continuous part by bin, of either delta, and of nothing.
    observed: Vec<f64>,
    /// Their expected probabilities.
    expected: Vec<f64>,
    /// Directional albedo (luminance): mean and standard error over samples, and by quadrature.
    sampled_albedo: (f64, f64),
    albedo: f64,
}

fn tally(
    cells: &[(DVec3, f64)],
    (bsdf, directions): (&Bsdf, Directions),
    transport: Transport,
    known: Vec3,
    random: &mut Independent,
    n: usize,
) -> Tally {
    let bins = BINS.0 * BINS.1;
    let mut observed = vec![0.0; bins + 3];
    let mut delta_directions = [None; 2];
    let (mut sum, mut sum2) = (0.0, 0.0);
    for _ in 0..n {
        let Some(sample) = bsdf.sample_by(directions, known, transport, random.next_3d()) else {
            observed[bins + 2] += 1.0;
            continue;
        };
        let sides = transport.sides(known, sample.direction);
        let (pdf, _) = sample.scatter.forward_reverse(transport);
        let estimate = power(bsdf, transport, sides, f64::from(luminance(sample.scatter.f)) / f64::from(pdf.0));
        (sum, sum2) = (sum + estimate, sum2 + estimate * estimate);
        match sample.lobe {
            Lobe::Continuous => observed[bin(known, sample.direction)] += 1.0,
            Lobe::Delta(k) => {
                assert!(k < bsdf.delta_count());
                delta_directions[usize::from(k)] = Some(sample.direction);
                observed[bins + usize::from(k)] += 1.0;
            }
        }
    }
    let mean = sum / n as f64;
    let error = ((sum2 / n as f64 - mean * mean).max(0.0) / n as f64).sqrt();

    let bins = integrate(cells, known, |direction| {
        let sides = transport.sides(known, direction);
        let scatter = bsdf.eval_by(directions, Lobe::Continuous, sides.0, sides.1);
        let pdf = f64::from(scatter.forward_reverse(transport).0.0);
        assert!(bsdf.has_continuous() || scatter == Scatter::ZERO);
        [pdf, power(bsdf, transport, sides, f64::from(luminance(scatter.f)))]
    });
    let mut expected: Vec<f64> = bins.iter().map(|b| b[0]).collect();
    let mut albedo: f64 = bins.iter().map(|b| b[1]).sum();
    for (k, direction) in delta_directions.into_iter().enumerate() {
        let Some(direction) = direction else {
            expected.push(0.0);
            continue;
        };
        let (to_camera, to_light) = transport.sides(known, direction);
        let scatter = bsdf.eval(Lobe::Delta(k as u8), to_camera, to_light);
        let pdf = f64::from(scatter.forward_reverse(transport).0.0);
        // The coefficients share one measure, on the light side: as a measure of the camera side, each divides by the
        // Jacobian, after which the density is the lobe's probability again.
        let own = if transport == Transport::Radiance { 1.0 } else { jacobian(bsdf, to_camera, to_light) };
        expected.push(pdf / own);
        albedo += power(bsdf, transport, (to_camera, to_light), f64::from(luminance(scatter.f)) / own);
    }
    expected.push(1.0 - expected.iter().sum::<f64>());
    Tally { observed, expected, sampled_albedo: (mean, error), albedo }
}

/// The p-value of Pearson's χ² test, cells of fewer than 10 expected samples pooled.
fn chi_squared(observed: &[f64], expected: &[f64]) -> f64 {
    let n: f64 = observed.iter().sum();
    let (mut statistic, mut cells, mut pool) = (0.0, 0, (0.0, 0.0));
    for (o, e) in observed.iter().zip(expected) {
        let e = e * n;
        if e < 10.0 {
            pool = (pool.0 + o, pool.1 + e);
        } else {
            statistic += (o - e) * (o - e) / e;
            cells += 1;
        }
    }
    // A pool of next to nothing is no χ² cell; it must hold next to nothing.
    if pool.1 >= 10.0 {
        statistic += (pool.0 - pool.1) * (pool.0 - pool.1) / pool.1;
        cells += 1;
    } else if pool.0 > pool.1.max(0.0) + 8.0 * pool.1.max(1.0).sqrt() {
        return 0.0;
    }
    if cells < 2 { 1.0 } else { ChiSquared::new(f64::from(cells - 1)).unwrap().sf(statistic) }
}

#[test]
fn samples_follow_their_densities_and_no_energy_is_gained() {
    assert_densities(&table(), Directions::Bsdf);
}

/// The rule changes densities and nothing else: the same albedo, and delta lobes as often as before.
#[test]
fn uniform_directions_do_so_too() {
    let names = [
        "diffuse",
        "plastic, smooth",
        "half metal, smooth",
        "half metal, glossy",
        "glass, mostly diffuse",
        "glass, smooth and half diffuse",
        "glass, rough",
        "pane, rough and half diffuse",
        "pane, smooth and half diffuse",
    ];
    let table: Vec<_> = table().into_iter().filter(|(name, _)| names.contains(name)).collect();
    assert_eq!(table.len(), names.len());
    assert_densities(&table, Directions::Uniform);
}

fn assert_densities(table: &[(&'static str, Bsdf)], directions: Directions) {
    let n = 60_000;
    let tests = table.len() * TRANSPORTS.len() * known_directions().len();
    // Šidák: the whole table fails by chance once in a hundred seeds, and the seed is fixed.
    let significance = 1.0 - 0.99_f64.powf(1.0 / tests as f64);
    let cells = cells();
    let (mut planted, mut caught) = (0, 0);
    each_case(table, |case, bsdf, transport, known, random| {
        let Tally { observed, expected, sampled_albedo: (mean, error), albedo } =
            tally(&cells, (bsdf, directions), transport, known, random, n);

        // ∫ density + Σ P(delta) + P(nothing) = 1, the last from the frequency of `None`.
        let nothing = expected[expected.len() - 1];
        let frequency = observed[observed.len() - 1] / n as f64;
        let sigma = (frequency.max(1.0 / n as f64) * (1.0 - frequency) / n as f64).sqrt();
        assert!(
            (nothing - frequency).abs() < 5.0 * sigma + 1e-3,
            "{case}: ∫pdf = {}, P(None) = {frequency}",
            1.0 - nothing
        );

        let p = chi_squared(&observed, &expected);
        assert!(p > significance, "{case}: samples do not follow their density, p = {p:e}");

        // White furnace, by sampling and by quadrature.
        assert!(mean - 5.0 * error < 1.002 && albedo < 1.002, "{case}: albedo {mean} ± {error}, {albedo}");
        assert!(
            (mean - albedo).abs() < 5.0 * error + 2e-3,
            "{case}: albedo {mean} ± {error} sampled, {albedo} integrated"
        );

        // The same test must notice a density that is 5 % too high on one side of the plane of incidence and 5 % too
        // low on the other: nothing but the shape tells it from the right one.
        if expected[..BINS.0 * BINS.1].iter().sum::<f64>() > 0.8 {
            let mut wrong = expected.clone();
            for (i, e) in wrong.iter_mut().take(BINS.0 * BINS.1).enumerate() {
                *e *= if i % BINS.1 < BINS.1 / 2 { 1.05 } else { 0.95 };
            }
            planted += 1;
            caught += usize::from(chi_squared(&observed, &wrong) < significance);
        }
    });
    assert!(planted * 4 > tests && caught * 100 > planted * 99, "{caught} of {planted} wrong densities caught");
}
