//! Fresnel reflectance and Snell's law.
//!
//! Everywhere `eta` is η_transmitted/η_incident and a cosine is |cos| of an angle against the (micro)surface normal.

use crate::{
    lanes::{Float, Lanes, Select, Vector},
    math::Rgb,
};

/// The cosine of the refracted angle by Snell's law; 0 exactly under total internal reflection.
///
/// Written as √(cos² + η² − 1)/η, which loses no digits where 1 − sin²/η² cancels (grazing incidence, η ≈ 1).
#[inline(always)]
pub(super) fn refracted_cos<F: Float>(cos: F, eta: F) -> F {
    let (zero, one) = (cos.lanes().splat(0.0), cos.lanes().splat(1.0));
    (cos * cos + (eta - one) * (eta + one)).max(zero).sqrt() / eta
}

/// The unit direction into which `w` refracts at the normal `n` on its side, given both cosines (`refracted_cos`).
#[inline(always)]
pub(super) fn refract<V: Vector>(w: V, n: V, cos: V::F, cos_t: V::F, eta: V::F) -> V {
    (n * (cos / eta - cos_t) - w / eta).normalize()
}

/// The same at a smooth surface, whose normal is the third axis.
#[inline(always)]
pub(super) fn refracted<V: Vector>(w: V, cos_t: V::F, eta: V::F) -> V {
    let [x, y, z] = w.coordinates();
    V::new(-x / eta, -y / eta, -cos_t.copysign(z))
}

/// `w` mirrored at the unit normal `n`.
#[inline(always)]
pub(super) fn reflect<V: Vector>(w: V, n: V, cos: V::F) -> V {
    (n * (cos * 2.0) - w).normalize()
}

/// Unpolarised reflectance of a dielectric boundary from the cosines of *both* angles, which Snell's law ties together.
///
/// Given both, F is symmetric in its two sides to the last bit of `cos` and well conditioned up to the critical angle,
/// where recomputing one cosine from the other is not.
#[inline(always)]
pub(super) fn dielectric_pair<F: Float>(cos: F, cos_t: F, eta: F) -> F {
    let (zero, one) = (cos.lanes().splat(0.0), cos.lanes().splat(1.0));
    let s = (cos - eta * cos_t) / (cos + eta * cos_t);
    let p = (eta * cos - cos_t) / (eta * cos + cos_t);
    (cos.eq(zero) | cos_t.eq(zero)).select(one, (s * s + p * p) * 0.5)
}

/// Unpolarised reflectance of a dielectric boundary (Fresnel's equations); 1 under total internal reflection.
#[inline(always)]
pub(super) fn dielectric<F: Float>(cos: F, eta: F) -> F {
    dielectric_pair(cos, refracted_cos(cos, eta), eta)
}

/// [`dielectric`] averaged over the cosine-weighted hemisphere, to 0.006 for η from 1/4 to 4: from the thin side the
/// fit of Kulla & Conty 2017, and from the dense side by the symmetry of η² (1 − F_avg).
#[inline(always)]
pub(super) fn mean_dielectric<F: Float>(eta: F) -> F {
    let one = eta.lanes().splat(1.0);
    let from_thin = !eta.lt(one);
    let thin = from_thin.select(eta, one / eta);
    let fit = (thin - one) / (eta.lanes().splat(4.08567) + thin * 1.00071);
    from_thin.select(fit, one - (one - fit) * eta * eta)
}

/// (1 − cos)⁵: how far Schlick's approximation has gone from F(0°) to F(90°).
#[inline(always)]
pub(super) fn schlick_power<F: Float>(cos: F) -> F {
    let (zero, one) = (cos.lanes().splat(0.0), cos.lanes().splat(1.0));
    let x = (one - cos).max(zero);
    let x2 = x * x;
    x2 * x2 * x
}

/// Schlick's approximation (1994) between `f0` at normal and `f90` at grazing incidence, by its [`schlick_power`].
#[inline(always)]
pub(super) fn schlick<V: Vector>(f0: Rgb<V>, f90: Rgb<V>, power: V::F) -> Rgb<V> {
    f0 + (f90 - f0).times(power)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn reflectance_of_glass_water_and_flint() {
        let table = [
            (1.5, [0.04, 0.050_239_91, 0.089_186_71, 0.387_704_4]),
            (1.33, [0.020_059_31, 0.027_521_38, 0.059_125_6, 0.346_916_1]),
            (1.8, [0.081_632_65, 0.093_523_12, 0.134_643_3, 0.418_749_6]),
        ];
        for (eta, expected) in table {
            for (degrees, r) in [0.0_f32, 45.0, 60.0, 80.0].into_iter().zip(expected) {
                let cos = degrees.to_radians().cos();
                assert!((dielectric(cos, eta) - r).abs() < 5e-7, "n = {eta}, {degrees}°: {}", dielectric(cos, eta));
                // From below, at the refracted angle, the boundary reflects the same.
                let below = dielectric(refracted_cos(cos, eta), 1.0 / eta);
                assert!((below - r).abs() < 5e-6, "from below, n = {eta}, {degrees}°: {below}");
            }
        }
    }

    #[test]
    fn reflection_is_total_beyond_the_critical_angle_and_at_grazing_incidence() {
        let critical = (1.0_f32 - 1.0 / (1.5 * 1.5)).sqrt();
        assert_eq!(dielectric(critical - 1e-3, 1.0 / 1.5), 1.0);
        assert!(dielectric(critical + 1e-3, 1.0 / 1.5) < 0.9);
        assert_eq!(dielectric(0.0, 1.5), 1.0);
        assert_eq!(dielectric(0.0, 1.0), 1.0);
        assert_eq!(dielectric(0.3, 1.0), 0.0);
    }

    #[test]
    fn mean_reflectance_is_that_of_all_directions() {
        for eta in [0.25, 0.4, 0.66, 0.9, 1.0, 1.1, 1.33, 1.5, 2.0, 3.0, 4.0] {
            let n = 4000;
            let terms = (0..n).map(|i| {
                let cos = (i as f32 + 0.5) / n as f32;
                f64::from(dielectric(cos, eta) * 2.0 * cos) / f64::from(n)
            });
            let (mean, fit) = (terms.sum::<f64>(), f64::from(mean_dielectric(eta)));
            assert!((mean - fit).abs() < 0.006, "η = {eta}: {fit}, not {mean}");
        }
    }

    #[test]
    fn refraction_obeys_snell_and_stays_in_the_plane_of_incidence() {
        let w = Vec3::new(0.6, -0.2, 0.5).normalize();
        let n = Vec3::new(0.1, 0.1, 1.0).normalize();
        let (cos, eta) = (w.dot(n), 1.5);
        let t = refract(w, n, cos, refracted_cos(cos, eta), eta);
        assert!((w.cross(n) + t.cross(n) * eta).length() < 1e-6);
        assert!(t.dot(n) < 0.0);
    }
}
