//! A rough diffuse base (`KHR_materials_diffuse_roughness`): Portsmouth, Kutz & Hill 2025, *EON: A Practical
//! Energy-Preserving Rough Diffuse BRDF* (JCGT 14.1).
//!
//! f = ρ/π (A + B s/t), Fujii's form of Oren & Nayar's model, A = 1/(1 + c₁ r), B = r A, s = ω·ω′ − cos θ cos θ′, and t
//! the greater cosine where s is positive, else 1; and a lobe for the light that it loses, which has met several
//! facets. A white surface keeps all light at every angle.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::Vec3;

use crate::{math::Rgb, sampling::warp, scene::bsdf::layer::product_lobe};

const C1: f32 = 0.5 - 2.0 / (3.0 * PI);
const C2: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// A (section 2.1).
fn a(r: f32) -> f32 {
    1.0 / (1.0 + C1 * r)
}

/// The albedo of the first term of a white surface (eq. 14), with nothing cancelled at grazing incidence.
fn single(r: f32, cos: f32) -> f32 {
    let cos = cos.clamp(0.0, 1.0);
    let sin = (1.0 - cos * cos).sqrt();
    let steep = sin * cos * (1.0 + sin + sin * sin) / (1.0 + sin);
    let g = sin * (cos.acos() - sin * cos) + 2.0 / 3.0 * (steep - sin);
    a(r) * (1.0 + r * FRAC_1_PI * g)
}

/// π f/ρ between two directions on one side, for the colour ρ.
pub(super) fn shape(color: Rgb, r: f32, w: Vec3, v: Vec3) -> Rgb {
    let s = w.dot(v) - w.z * v.z;
    let s_over_t = if s > 0.0 { s / w.z.max(v.z) } else { s };
    let once = a(r) * (1.0 + r * s_over_t);
    let mean = a(r) * (1.0 + C2 * r);
    let lost = |cos: f32| (1.0 - single(r, cos)).max(0.0);
    let lacking = PI * product_lobe(lost(w.z), lost(v.z), 1.0 - mean);
    color.map(|c| once + c * mean / (1.0 - c * (1.0 - mean)) * lacking)
}

/// The probability of a uniform direction: at grazing incidence a rough base sends much light back at low angles, where
/// the cosine hardly looks.
fn uniform(r: f32, cos: f32) -> f32 {
    0.5 * r * (1.0 - cos)
}

/// A direction above the surface.
pub(super) fn sample(r: f32, cos: f32, [u, v, w]: [f32; 3]) -> Vec3 {
    if w >= uniform(r, cos) {
        return warp::cosine_hemisphere([u, v]);
    }
    let (sin, cos) = (v * TAU).sin_cos();
    let radius = (1.0 - u * u).sqrt();
    Vec3::new(radius * cos, radius * sin, u)
}

/// The density of [`sample`], 1/sr.
pub(super) fn density(r: f32, cos: f32, to: f32) -> f32 {
    let uniform = uniform(r, cos);
    uniform * 0.5 * FRAC_1_PI + (1.0 - uniform) * warp::cosine_hemisphere_pdf(to).0
}
