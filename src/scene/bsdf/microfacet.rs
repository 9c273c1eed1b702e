//! The GGX microsurface: Trowbridge & Reitz 1975, Walter et al. 2007, Heitz 2014.
//!
//! Directions may lie on either side of the surface; the microsurface is the same seen from below. All formulas are in
//! terms of S(ω) = √(cos²θ + α² sin²θ), with which Smith's shadowing needs neither a tangent nor a division by cos θ:
//! Λ = (S/cos θ − 1)/2, so G1/cos θ = 2/(cos θ + S) and G2/(cos θ cos θ') = 2/(cos θ S' + cos θ' S).

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::{GRAZING, Scatter};
use crate::{math::Rgb, sampling::PdfSolidAngle};

/// Below this α a lobe counts as a delta.
///
/// A half vector is known to a few 1e-7 in f32, so D of a lobe narrower than this would be noise in its third digit;
/// and at α = 1e-3 (glTF roughness 0.03) a lobe already spans 0.1°, less than a pixel or the sun.
pub(super) const SMOOTH_ALPHA: f32 = 1e-3;

/// An isotropic GGX microsurface; `alpha` is the slope's scale, glTF roughness squared, at least [`SMOOTH_ALPHA`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx {
    pub alpha: f32,
}

/// One microfacet that carries light between two directions, before Fresnel's factor and the choice of a lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// |cos| of the camera direction against the facet.
    pub cos_camera: f32,
    /// |cos| of the light direction against the facet; the same for a reflection.
    pub cos_light: f32,
    /// f of a perfect facet, 1/sr, in the radiance convention.
    value: f32,
    /// The density of the light direction if the facet is drawn from those visible from the camera, 1/sr.
    to_light: f32,
    /// The density of the camera direction if the facet is drawn from those visible from the light, 1/sr.
    to_camera: f32,
}

impl Facet {
    /// No facet carries light between the directions.
    const NONE: Self = Self { cos_camera: 1.0, cos_light: 1.0, value: 0.0, to_light: 0.0, to_camera: 0.0 };

    /// The lobe of facets that pass the fraction `color`, chosen with the given probability from either end.
    #[inline]
    pub fn scatter(&self, color: Rgb, p_camera: f32, p_light: f32) -> Scatter {
        Scatter {
            f: color * self.value,
            to_light: PdfSolidAngle(p_camera * self.to_light),
            to_camera: PdfSolidAngle(p_light * self.to_camera),
        }
    }
}

impl Ggx {
    /// The density of facet normals per solid angle and projected area, 1/sr (Walter et al. 2007, eq. 33).
    ///
    /// From sin²θ directly: 1 − cos²θ would cost half the digits where a narrow lobe has all its energy.
    #[inline]
    fn d(self, h: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        let s = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
        a2 * FRAC_1_PI / (s * s)
    }

    /// S(ω) = √(cos²θ + α² sin²θ); see the module.
    #[inline]
    fn stretched(self, w: Vec3) -> f32 {
        (w.z * w.z + self.alpha * self.alpha * (w.x * w.x + w.y * w.y)).sqrt()
    }

    /// G1(camera)/cos, G1(light)/cos and the height-correlated G2/(cos cos) (Heitz 2014, eqs. 43, 72 and 99).
    #[inline]
    fn shadowing(self, to_camera: Vec3, to_light: Vec3) -> (f32, f32, f32) {
        let (c, l) = (to_camera.z.abs(), to_light.z.abs());
        let (sc, sl) = (self.stretched(to_camera), self.stretched(to_light));
        (2.0 / (c + sc), 2.0 / (l + sl), 2.0 / (c * sl + l * sc))
    }

    /// The facet that mirrors one direction into the other; both lie on the same side (Walter et al. 2007, eq. 20).
    #[inline]
    pub fn reflect(self, to_camera: Vec3, to_light: Vec3) -> Facet {
        if to_camera.z.abs() < GRAZING || to_light.z.abs() < GRAZING {
            return Facet::NONE;
        }
        // From the length of the sum, the cosine is the same from both ends to the last bit: F is steep where it is
        // small.
        let sum = to_camera + to_light;
        let length = sum.length();
        let (h, cos) = (sum / length, (0.5 * length).min(1.0));
        let (g_camera, g_light, g) = self.shadowing(to_camera, to_light);
        // The visible normals have density G1 cos_h D/cos, and dω_h/dω = 1/(4 cos_h).
        let d = 0.25 * self.d(h);
        Facet { cos_camera: cos, cos_light: cos, value: d * g, to_light: d * g_camera, to_camera: d * g_light }
    }

    /// The facet that refracts one direction into the other, across indices `eta_camera` and `eta_light`
    /// (Walter et al. 2007, eq. 21; his incident direction i is the one to the light).
    #[inline]
    pub fn refract(self, to_camera: Vec3, to_light: Vec3, eta_camera: f32, eta_light: f32) -> Facet {
        if to_camera.z.abs() < GRAZING || to_light.z.abs() < GRAZING {
            return Facet::NONE;
        }
        let sum = to_camera * eta_camera + to_light * eta_light;
        let h = sum.normalize_or_zero() * 1.0_f32.copysign(sum.z);
        let (camera, light) = (to_camera.dot(h), to_light.dot(h));
        // Each direction must see the facet on the side on which it sees the surface.
        if camera * to_camera.z <= 0.0 || light * to_light.z <= 0.0 {
            return Facet::NONE;
        }
        let (cos_camera, cos_light) = (camera.abs(), light.abs());
        let (g_camera, g_light, g) = self.shadowing(to_camera, to_light);
        // dω_h/dω_light = η_light² cos_light/|η_camera ω_camera + η_light ω_light|², and so from the camera side.
        let d = self.d(h) * cos_camera * cos_light / sum.length_squared();
        let (from_light, from_camera) = (d * eta_light * eta_light, d * eta_camera * eta_camera);
        Facet {
            cos_camera,
            cos_light,
            value: from_camera * g,
            to_light: from_light * g_camera,
            to_camera: from_camera * g_light,
        }
    }

    /// A facet normal on the side of `w`, from those visible from `w`, with density G1(w) |w·h| D(h)/|cos θ_w|: a
    /// spherical cap in the stretched space (Dupuy & Benyoub 2023, *Sampling Visible GGX Normals with Spherical Caps*).
    #[inline]
    pub fn sample_visible(self, w: Vec3, u: Vec2) -> Vec3 {
        let stretched = Vec3::new(self.alpha * w.x, self.alpha * w.y, w.z.abs()).normalize();
        // The height of the half vector is known without the cancellation in z + stretched.z, and never 0.
        let height = (1.0 - u.y) * (1.0 + stretched.z);
        let z = height - stretched.z;
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = (TAU * u.x).sin_cos();
        let (x, y) = (r * cos + stretched.x, r * sin + stretched.y);
        Vec3::new(self.alpha * x, self.alpha * y, height.copysign(w.z)).normalize()
    }
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
