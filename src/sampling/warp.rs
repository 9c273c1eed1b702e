//! Maps from the unit square to the domains that light transport samples.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Vec2, Vec3};

use super::PdfSolidAngle;
use crate::lanes::{Float, Lanes, Select, Vector};

/// A point of the unit disk, uniform in area, by the concentric map (Shirley & Chiu 1997). Density 1/π.
#[inline(always)]
pub fn disk<F: Float>([u, v]: [F; 2]) -> [F; 2] {
    let (zero, one) = (u.lanes().splat(0.0), u.lanes().splat(1.0));
    let (x, y) = (u * 2.0 - one, v * 2.0 - one);
    // The angle from the nearer axis, at most π/4 either way.
    let near_x = y.abs().lt(x.abs());
    let r = near_x.select(x, y);
    let angle = near_x.select(y, x) / r.eq(zero).select(one, r) * (PI / 4.0);
    let (along, across) = (r * cosine(angle), r * sine(angle));
    [near_x.select(along, across), near_x.select(across, along)]
}

/// sin x to an ulp for |x| ≤ π/4 (Moshier, *Cephes*, `sinf`): the same bits on every processor and system.
#[inline(always)]
fn sine<F: Float>(x: F) -> F {
    let constant = |c| x.lanes().splat(c);
    let z = x * x;
    let p = (z * -1.951_529_6e-4 + constant(8.332_161e-3)) * z + constant(-0.166_666_55);
    x + x * z * p
}

/// cos x to an ulp for |x| ≤ π/4 (Moshier, *Cephes*, `cosf`).
#[inline(always)]
fn cosine<F: Float>(x: F) -> F {
    let constant = |c| x.lanes().splat(c);
    let z = x * x;
    let p = (z * 2.443_315_7e-5 + constant(-1.388_731_6e-3)) * z + constant(4.166_664_6e-2);
    constant(1.0) - z * 0.5 + z * z * p
}

/// sin x and cos x to 10⁻⁶, and the sine of small angles to some ulps, for 0 ≤ x ≤ π.
#[inline(always)]
pub fn sine_and_cosine<F: Float>(x: F) -> (F, F) {
    let one = x.lanes().splat(1.0);
    let quarter = x * 0.25;
    let (sin, cos) = (sine(quarter), cosine(quarter));
    // Twice the angle, twice: 1 − 2 sin² is exact where the angle is small.
    let (sin, cos) = (sin * cos * 2.0, one - sin * sin * 2.0);
    (sin * cos * 2.0, one - sin * sin * 2.0)
}

/// The angle of (x, y) from the x axis, in [0, π], for y ≥ 0, to some ulps (Moshier, *Cephes*, `atanf`).
#[inline(always)]
pub fn angle<F: Float>([x, y]: [F; 2]) -> F {
    let constant = |c| x.lanes().splat(c);
    let (a, one) = (x.abs(), constant(1.0));
    // Between 0 and π/4, and then between −π/8 and π/8.
    let is_steep = a.lt(y);
    let slope = is_steep.select(a, y) / is_steep.select(y, a);
    let is_large = constant(0.414_213_57).lt(slope);
    let t = is_large.select((slope - one) / (slope + one), slope);
    let z = t * t;
    let p = ((z * 8.053_744_4e-2 - constant(1.387_768_6e-1)) * z + constant(1.997_771_1e-1)) * z;
    let small = (p - constant(3.333_295e-1)) * z * t + t;
    let angle = is_large.select(small + constant(PI / 4.0), small);
    let angle = is_steep.select(constant(PI / 2.0) - angle, angle);
    x.lt(constant(0.0)).select(constant(PI) - angle, angle)
}

/// A unit vector around +z with density cos θ/π ([`cosine_hemisphere_pdf`]).
#[inline(always)]
pub fn cosine_hemisphere<F: Float>(u: [F; 2]) -> <F::Lanes as Lanes>::V {
    let [x, y] = disk(u);
    let (zero, one) = (x.lanes().splat(0.0), x.lanes().splat(1.0));
    Vector::new(x, y, (one - (x * x + y * y)).max(zero).sqrt())
}

/// Density of [`cosine_hemisphere`] for a direction with |cos θ| = `cos`.
#[inline(always)]
pub fn cosine_hemisphere_pdf<F: Float>(cos: F) -> PdfSolidAngle<F> {
    PdfSolidAngle(cos * FRAC_1_PI)
}

/// A unit vector, uniform on the sphere. Density 1/(4π).
#[inline(always)]
pub fn sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = TAU * u.y;
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// Barycentric coordinates (of the second and third corner), uniform in the triangle's area
/// (Heitz 2019, *A Low-Distortion Map Between Triangle and Square*).
#[inline(always)]
pub fn triangle<F: Float>([u, v]: [F; 2]) -> [F; 2] {
    let upper = u.lt(v);
    let half = upper.select(u, v) * 0.5;
    [upper.select(half, u - half), upper.select(v - half, half)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_are_right_to_an_ulp() {
        for i in -10_000..=10_000 {
            let x = i as f32 * (PI / 4.0 / 10_000.0);
            let (sin, cos) = f64::from(x).sin_cos();
            assert!((f64::from(sine(x)) - sin).abs() <= f64::from(f32::EPSILON) * sin.abs(), "sin {x}");
            assert!((f64::from(cosine(x)) - cos).abs() <= f64::from(f32::EPSILON) * cos, "cos {x}");
        }
    }

    #[test]
    fn angles_are_right_to_some_ulps() {
        for i in 0..=10_000 {
            let x = (i as f32 * (PI / 10_000.0)).min(PI);
            let (sin, cos) = sine_and_cosine(x);
            let right = f64::from(x).sin_cos();
            assert!((f64::from(sin) - right.0).abs() <= 5e-7 * f64::from(x.min(1.0)), "sin {x}");
            assert!((f64::from(cos) - right.1).abs() <= 1e-6, "cos {x}");
            let (y, x) = (right.0.max(0.0) as f32, right.1 as f32);
            for scale in [1.0, 1e-12, 3e9] {
                let right = f64::from(y * scale).atan2(f64::from(x * scale));
                assert!((f64::from(angle([x * scale, y * scale])) - right).abs() <= 3e-7 * right, "{x} {y}: {right}");
            }
        }
        for y in [1e-30, 1e-9, 1e-4_f32] {
            assert!((angle([3.0, y]) / (y / 3.0) - 1.0).abs() < 3e-7 && (sine_and_cosine(y).0 / y - 1.0).abs() < 3e-7);
        }
    }

    #[test]
    fn the_disk_is_covered_evenly_and_once() {
        // Of a fine grid each cell's image has the area π/n²; straight sides miss a tenth of it at the centre.
        let n = 64;
        let at = |i: u32, j: u32| disk([i as f32 / n as f32, j as f32 / n as f32]).map(f64::from);
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let area = 0.5 * ((c[0] - a[0]) * (d[1] - b[1]) - (d[0] - b[0]) * (c[1] - a[1]));
            let share = area / (std::f64::consts::PI / f64::from(n * n));
            assert!((share - 1.0).abs() < 0.11, "{i}, {j}: {share}");
        }
        assert_eq!(disk([0.5, 0.5]), [0.0, 0.0]);
        assert!(disk([0.0, 0.0]).iter().all(|x| (x + 0.5_f32.sqrt()).abs() < 1e-6));
    }
}
