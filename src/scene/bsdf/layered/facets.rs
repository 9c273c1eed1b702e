//! GGX with a roughness for each of two directions: Heitz 2014, section 5.3, and Dupuy & Benyoub 2023.
//!
//! As in [`microfacet`](super::super::microfacet), everything is in terms of S(ω) = √(z² + (α_x x)² + (α_y y)²):
//! G1/cos θ = 2/(cos θ + S) and G2/(cos θ cos θ') = 2/(cos θ S' + cos θ' S). Directions lie above the surface.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

use crate::scene::bsdf::GRAZING;

/// A microsurface whose slopes have the scales `x` and `y` along these axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Facets {
    pub x: f32,
    pub y: f32,
}

/// The facet that mirrors or refracts one direction into another, before Fresnel's factor.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Facet {
    /// The cosine of the first direction against it, of a mirror that of both.
    pub cos: f32,
    /// And of the second.
    pub beyond: f32,
    /// f of a perfect facet, 1/sr.
    pub value: f32,
    /// The density of the second direction if facets are drawn from those visible from the first, 1/sr.
    pub forward: f32,
}

impl Facets {
    /// S(ω); see the module.
    #[inline]
    fn stretched(self, w: Vec3) -> f32 {
        (Vec3::new(self.x, self.y, 1.0) * w).length()
    }

    /// The density of facet normals per solid angle and projected area, 1/sr (Heitz 2014, eq. 85), from their sines.
    #[inline]
    fn d(self, h: Vec3) -> f32 {
        let product = self.x * self.y;
        let s = h.x * h.x * (self.y / self.x) + h.y * h.y * (self.x / self.y) + product * h.z * h.z;
        product * FRAC_1_PI / (s * s)
    }

    /// The facet that mirrors `a` into `b`; none where either is not above the surface.
    #[inline]
    pub fn reflect(self, a: Vec3, b: Vec3) -> Facet {
        self.reflect_at(a, b).0
    }

    /// The same, and its normal.
    #[inline]
    pub fn reflect_at(self, a: Vec3, b: Vec3) -> (Facet, Vec3) {
        if a.z < GRAZING || b.z < GRAZING {
            return (Facet::default(), Vec3::Z);
        }
        let sum = a + b;
        let length = sum.length();
        let h = sum / length;
        let d = self.d(h) * 0.25;
        let (sa, sb) = (self.stretched(a), self.stretched(b));
        let (value, forward) = (d * 2.0 / (a.z * sb + b.z * sa), d * 2.0 / (a.z + sa));
        let cos = (0.5 * length).min(1.0);
        (Facet { cos, beyond: cos, value, forward }, h)
    }

    /// The facet that refracts `a`, above the surface, into `b` below it, across the indices on their sides, and its
    /// normal on the side of `a` (Walter et al. 2007, eq. 21); none where either sees its back. The value is
    /// that of a facet which passes all light, seen from `a`.
    pub fn refract_at(self, a: Vec3, b: Vec3, eta_a: f32, eta_b: f32) -> (Facet, Vec3) {
        let sum = a * eta_a + b * eta_b;
        let square = sum.length_squared();
        let h = sum / (square.sqrt() * 1.0_f32.copysign(sum.z));
        let (cos_a, cos_b) = (a.dot(h), -b.dot(h));
        if a.z < GRAZING || b.z > -GRAZING || !(cos_a > 0.0 && cos_b > 0.0) {
            return (Facet::default(), Vec3::Z);
        }
        let d = self.d(h) * cos_a * cos_b / square;
        let (sa, sb) = (self.stretched(a), self.stretched(b));
        // dω_h/dω_b = η_b² cos_b/|η_a ω_a + η_b ω_b|², and radiance seen from `a` has η_a² in its place.
        let value = d * eta_a * eta_a * 2.0 / (a.z * sb - b.z * sa);
        (Facet { cos: cos_a, beyond: cos_b, value, forward: d * eta_b * eta_b * 2.0 / (a.z + sa) }, h)
    }

    /// A facet normal from those visible from `w`: a spherical cap in the stretched space.
    #[inline]
    pub fn sample_visible(self, w: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        let stretch = Vec3::new(self.x, self.y, 1.0);
        let from = (stretch * w).normalize();
        let height = (1.0 - v) * (1.0 + from.z);
        let z = height - from.z;
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = (u * TAU).sin_cos();
        (stretch * Vec3::new(r * cos + from.x, r * sin + from.y, height)).normalize()
    }
}
