//! The GGX microsurface: Trowbridge & Reitz 1975, Walter et al. 2007, Heitz 2014.
//!
//! Directions may lie on either side of the surface; the microsurface is the same seen from below. All formulas are in
//! terms of S(ω) = √(cos²θ + α² sin²θ), with which Smith's shadowing needs neither a tangent nor a division by cos θ:
//! Λ = (S/cos θ − 1)/2, so G1/cos θ = 2/(cos θ + S) and G2/(cos θ cos θ') = 2/(cos θ S' + cos θ' S).

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

use super::{Scatter, functions, is_grazing};
use crate::{
    lanes::{Float, Lanes, Select, Vector},
    math::Rgb,
    sampling::PdfSolidAngle,
};

/// Below this α a lobe counts as a delta.
///
/// A half vector is known to a few 1e-7 in f32, so D of a lobe narrower than this would be noise in its third digit;
/// and at α = 1e-3 (glTF roughness 0.03) a lobe already spans 0.1°, less than a pixel or the sun.
pub(super) const SMOOTH_ALPHA: f32 = 1e-3;

/// An isotropic GGX microsurface; `alpha` is the slope's scale, glTF roughness squared, at least [`SMOOTH_ALPHA`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx<V: Vector = Vec3> {
    pub alpha: V::F,
}

/// One microfacet that carries light between two directions, before Fresnel's factor and the choice of a lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet<F = f32> {
    /// |cos| of the camera direction against the facet; 1 where no facet carries light.
    pub cos_camera: F,
    /// |cos| of the light direction against the facet; the same for a reflection.
    pub cos_light: F,
    /// f of a perfect facet, 1/sr, in the radiance convention.
    value: F,
    /// The density of the light direction if the facet is drawn from those visible from the camera, 1/sr.
    to_light: F,
    /// The density of the camera direction if the facet is drawn from those visible from the light, 1/sr.
    to_camera: F,
}

impl<F: Float> Facet<F> {
    /// The same where the condition holds; elsewhere no facet carries light.
    #[inline(always)]
    fn only(self, which: <F::Lanes as Lanes>::M) -> Self {
        let (zero, one) = (self.value.lanes().splat(0.0), self.value.lanes().splat(1.0));
        Self {
            cos_camera: which.select(self.cos_camera, one),
            cos_light: which.select(self.cos_light, one),
            value: which.select(self.value, zero),
            to_light: which.select(self.to_light, zero),
            to_camera: which.select(self.to_camera, zero),
        }
    }

    /// The lobe of facets that pass the fraction `color`, chosen with the given probability from either end.
    #[inline(always)]
    pub fn scatter(&self, color: Rgb<<F::Lanes as Lanes>::V>, p_camera: F, p_light: F) -> Scatter<F::Lanes> {
        Scatter {
            f: color.times(self.value),
            to_light: PdfSolidAngle(p_camera * self.to_light),
            to_camera: PdfSolidAngle(p_light * self.to_camera),
        }
    }
}

impl<V: Vector> Ggx<V> {
    /// The density of facet normals per solid angle and projected area, 1/sr (Walter et al. 2007, eq. 33).
    ///
    /// From sin²θ directly: 1 − cos²θ would cost half the digits where a narrow lobe has all its energy.
    #[inline(always)]
    fn d(self, h: V) -> V::F {
        let ([x, y, z], a2) = (h.coordinates(), self.alpha * self.alpha);
        let s = x * x + y * y + a2 * z * z;
        a2 * FRAC_1_PI / (s * s)
    }

    /// S(ω) = √(cos²θ + α² sin²θ); see the module.
    #[inline(always)]
    fn stretched(self, w: V) -> V::F {
        let [x, y, z] = w.coordinates();
        (z * z + self.alpha * self.alpha * (x * x + y * y)).sqrt()
    }

    /// G1(camera)/cos, G1(light)/cos and the height-correlated G2/(cos cos) (Heitz 2014, eqs. 43, 72 and 99).
    #[inline(always)]
    fn shadowing(self, to_camera: V, to_light: V) -> (V::F, V::F, V::F) {
        let ([_, _, c], [_, _, l]) = (to_camera.coordinates(), to_light.coordinates());
        let (c, l, two) = (c.abs(), l.abs(), self.alpha.lanes().splat(2.0));
        let (sc, sl) = (self.stretched(to_camera), self.stretched(to_light));
        (two / (c + sc), two / (l + sl), two / (c * sl + l * sc))
    }

    /// The facet that mirrors one direction into the other; both lie on the same side (Walter et al. 2007, eq. 20).
    #[inline(always)]
    pub fn reflect(self, to_camera: V, to_light: V) -> Facet<V::F> {
        // From the length of the sum, the cosine is the same from both ends to the last bit: F is steep where it is
        // small.
        let sum = to_camera + to_light;
        let length = sum.dot(sum).sqrt();
        let (h, cos) = (sum / length, (length * 0.5).min(self.alpha.lanes().splat(1.0)));
        let (g_camera, g_light, g) = self.shadowing(to_camera, to_light);
        // The visible normals have density G1 cos_h D/cos, and dω_h/dω = 1/(4 cos_h).
        let d = self.d(h) * 0.25;
        let facet =
            Facet { cos_camera: cos, cos_light: cos, value: d * g, to_light: d * g_camera, to_camera: d * g_light };
        facet.only(!are_grazing(to_camera, to_light))
    }

    /// The facet that refracts one direction into the other, across indices `eta_camera` and `eta_light`
    /// (Walter et al. 2007, eq. 21; his incident direction i is the one to the light).
    #[inline(always)]
    pub fn refract(self, to_camera: V, to_light: V, eta_camera: V::F, eta_light: V::F) -> Facet<V::F> {
        let (zero, one) = (self.alpha.lanes().splat(0.0), self.alpha.lanes().splat(1.0));
        let sum = to_camera * eta_camera + to_light * eta_light;
        let (square, [_, _, z]) = (sum.dot(sum), sum.coordinates());
        let reciprocal = one / square.sqrt();
        let some = zero.lt(reciprocal) & reciprocal.lt(self.alpha.lanes().splat(f32::INFINITY));
        let h = sum * reciprocal * one.copysign(z);
        let (camera, light) = (to_camera.dot(h), to_light.dot(h));
        let ([_, _, z_camera], [_, _, z_light]) = (to_camera.coordinates(), to_light.coordinates());
        // Each direction must see the facet on the side on which it sees the surface.
        let sees = !((camera * z_camera).le(zero) | (light * z_light).le(zero));
        let (cos_camera, cos_light) = (camera.abs(), light.abs());
        let (g_camera, g_light, g) = self.shadowing(to_camera, to_light);
        // dω_h/dω_light = η_light² cos_light/|η_camera ω_camera + η_light ω_light|², and so from the camera side.
        let d = self.d(h) * cos_camera * cos_light / square;
        let (from_light, from_camera) = (d * eta_light * eta_light, d * eta_camera * eta_camera);
        let facet = Facet {
            cos_camera,
            cos_light,
            value: from_camera * g,
            to_light: from_light * g_camera,
            to_camera: from_camera * g_light,
        };
        facet.only(some & sees & !are_grazing(to_camera, to_light))
    }

    /// A facet normal on the side of `w`, from those visible from `w`, with density G1(w) |w·h| D(h)/|cos θ_w|: a
    /// spherical cap in the stretched space (Dupuy & Benyoub 2023, *Sampling Visible GGX Normals with Spherical Caps*).
    /// In the lanes `which`.
    #[inline(always)]
    pub fn sample_visible(self, w: V, [u, v]: [V::F; 2], which: <V::Lanes as Lanes>::M) -> V {
        let (zero, one) = (u.lanes().splat(0.0), u.lanes().splat(1.0));
        let [x, y, side] = w.coordinates();
        let [x, y, z] = V::new(self.alpha * x, self.alpha * y, side.abs()).normalize().coordinates();
        // The height of the half vector is known without the cancellation in its terms, and never 0.
        let height = (one - v) * (one + z);
        let z = height - z;
        let r = ((one - z) * (one + z)).max(zero).sqrt();
        let [sin, cos] = functions::sin_cos(u * TAU, which);
        let (x, y) = (r * cos + x, r * sin + y);
        V::new(self.alpha * x, self.alpha * y, height.copysign(side)).normalize()
    }
}

/// Where either direction is in the surface's plane.
#[inline(always)]
fn are_grazing<V: Vector>(to_camera: V, to_light: V) -> <V::Lanes as Lanes>::M {
    let ([_, _, camera], [_, _, light]) = (to_camera.coordinates(), to_light.coordinates());
    is_grazing(camera) | is_grazing(light)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;

    /// ∫ g dω over the upper hemisphere by the midpoint rule in θ and φ.
    fn hemisphere(g: impl Fn(Vec3) -> f32) -> f64 {
        let (m, n) = (1024, 256);
        let step = (PI / 2.0 / m as f32, TAU / n as f32);
        let mut sum = 0.0;
        for i in 0..m {
            let (sin, cos) = ((i as f32 + 0.5) * step.0).sin_cos();
            for j in 0..n {
                let (y, x) = ((j as f32 + 0.5) * step.1).sin_cos();
                sum += f64::from(g(Vec3::new(sin * x, sin * y, cos)) * sin * step.0 * step.1);
            }
        }
        sum
    }

    #[test]
    fn the_microsurface_projects_to_the_surface() {
        for alpha in [0.05, 0.3, 1.0] {
            let ggx = Ggx { alpha };
            // Heitz 2014, eqs. 11 and 14: ∫ D cos = 1, and the visible facets project to the visible surface.
            assert!((hemisphere(|h| ggx.d(h) * h.z) - 1.0).abs() < 2e-3, "{alpha}");
            for w in [Vec3::new(0.3, -0.1, 0.9), Vec3::new(0.9, 0.2, 0.1)].map(Vec3::normalize) {
                let g1_over_cos = ggx.shadowing(w, w).0;
                let visible = hemisphere(|h| g1_over_cos * w.dot(h).max(0.0) * ggx.d(h));
                assert!((visible - 1.0).abs() < 2e-3, "α = {alpha}, {w}: {visible}");
            }
        }
    }

    #[test]
    fn shadowing_and_masking_are_correlated_by_height() {
        // Heitz 2014, eq. 99: G2 = 1/(1 + Λ + Λ'), where G1 = 1/(1 + Λ).
        let ggx = Ggx { alpha: 0.5 };
        let (a, b) = (Vec3::new(0.8, 0.0, 0.6), Vec3::new(0.0, 0.954, 0.3).normalize());
        let (ga, gb, g) = ggx.shadowing(a, b);
        let (ga, gb, g) = (ga * a.z, gb * b.z, g * a.z * b.z);
        assert!((1.0 / g - (1.0 / ga + 1.0 / gb - 1.0)).abs() < 1e-5, "{ga} {gb} {g}");
        let lambda = 0.5 * ((1.0 + 0.25 * (0.8_f32 / 0.6).powi(2)).sqrt() - 1.0);
        assert!((ga - 1.0 / (1.0 + lambda)).abs() < 1e-6);
    }
}
