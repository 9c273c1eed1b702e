//! Maps from the unit square to the domains that light transport samples.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Vec2, Vec3};

use super::PdfSolidAngle;

/// A point of the unit disk, uniform in area, by the concentric map (Shirley & Chiu 1997). Density 1/π.
#[inline(always)]
pub fn disk(u: Vec2) -> Vec2 {
    let v = 2.0 * u - Vec2::ONE;
    if v == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (r, phi) =
        if v.x.abs() > v.y.abs() { (v.x, PI / 4.0 * (v.y / v.x)) } else { (v.y, PI / 2.0 - PI / 4.0 * (v.x / v.y)) };
    r * Vec2::new(phi.cos(), phi.sin())
}

/// A unit vector around +z with density cos θ/π ([`cosine_hemisphere_pdf`]).
#[inline(always)]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] for a direction with |cos θ| = `cos`.
#[inline(always)]
pub fn cosine_hemisphere_pdf(cos: f32) -> PdfSolidAngle {
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
pub fn triangle(u: Vec2) -> Vec2 {
    let mut b = u;
    if b.y > b.x {
        b.x *= 0.5;
        b.y -= b.x;
    } else {
        b.y *= 0.5;
        b.x -= b.y;
    }
    b
}
