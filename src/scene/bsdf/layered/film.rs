//! A thin film on the base: interference between the light that it reflects and that from below (Belcour & Barla 2017,
//! *A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence*, section 4; in the form that
//! `KHR_materials_iridescence` gives it, with Schlick's approximation in place of polarised reflectances).

use std::f32::consts::{PI, TAU};

use crate::math::Rgb;

/// A film of one thickness and index between the outside and a base.
#[derive(Clone, Copy, Debug)]
pub(super) struct Film {
    /// Its index of refraction.
    pub ior: f32,
    /// Its thickness, nanometres.
    pub thickness: f32,
    /// The index of refraction of what lies above: air's, or the coat's.
    pub outside: f32,
}

/// ((n₂ − n₁)/(n₂ + n₁))².
fn normal_reflectance(n1: f32, n2: f32) -> f32 {
    let r = (n2 - n1) / (n2 + n1);
    r * r
}

fn schlick(f0: f32, cos: f32) -> f32 {
    f0 + (1.0 - f0) * (1.0 - cos).max(0.0).powi(5)
}

impl Film {
    /// The reflectance, in [0, 1], at a facet of the base whose reflectance against air is `f0`, for light that meets
    /// the facet with this cosine.
    pub fn reflectance(&self, f0: Rgb, cos: f32) -> Rgb {
        // What is thin to nothing is not there: its index becomes that of the outside.
        let smooth = (self.thickness / 30.0).clamp(0.0, 1.0);
        let ior = self.outside + (self.ior - self.outside) * smooth * smooth * (3.0 - 2.0 * smooth);
        let eta = self.outside / ior;
        let cos2_squared = 1.0 - eta * eta * (1.0 - cos * cos);
        if cos2_squared <= 0.0 {
            return Rgb::ONE;
        }
        let cos2 = cos2_squared.sqrt();
        let r12 = schlick(normal_reflectance(self.outside, ior), cos);
        let passed = 1.0 - r12;
        let phi21 = if ior < self.outside { 0.0 } else { PI };
        // Per channel: √(R₁₂ R₂₃), R_s, and the phase.
        let channel = |f0: f32| {
            let root = f0.min(0.9999).sqrt();
            let base = (1.0 + root) / (1.0 - root);
            let r23 = schlick(normal_reflectance(ior, base), cos2);
            let both = (r12 * r23).clamp(1e-5, 0.9999);
            let rs = passed * passed * r23 / (1.0 - both);
            (both.sqrt(), rs, phi21 + if base < ior { PI } else { 0.0 })
        };
        let channels = f0.to_array().map(channel);
        let mut sum = Rgb::from_array(channels.map(|(_, rs, _)| r12 + rs));
        // 2 η d cos θ₂, as the paper has it; the extension's page has cos θ₁, and its viewer cos θ₂.
        let path = 2.0 * ior * self.thickness * cos2;
        for m in 1..=2_u8 {
            let order = f32::from(m);
            let amplitude = Rgb::from_array(channels.map(|(r, rs, _)| (rs - passed) * r.powi(m.into())));
            sum += amplitude * (sensitivity(order * path, channels.map(|(.., phase)| order * phase)) * 2.0);
        }
        sum.max(Rgb::ZERO).min(Rgb::ONE)
    }
}

/// The Fourier transform of the eye's response, by Gaussians for X, Y and Z (Belcour & Barla 2017, eq. 10), in linear
/// Rec. 709, at the optical path difference `path`, nanometres.
fn sensitivity(path: f32, shift: [f32; 3]) -> Rgb {
    const NORMALISATION: f32 = 1.0685e-7;
    let phase = TAU * path * 1e-9;
    let gaussian = |value: f32, position: f32, variance: f32, shift: f32| {
        let height = value / NORMALISATION * (TAU * variance).sqrt();
        height * (position * phase + shift).cos() * (-variance * phase * phase).exp()
    };
    let x = gaussian(5.4856e-13, 1.6810e6, 4.3278e9, shift[0]) + gaussian(9.7470e-14, 2.2399e6, 4.5282e9, shift[0]);
    let y = gaussian(4.4201e-13, 1.7953e6, 9.3046e9, shift[1]);
    let z = gaussian(5.2481e-13, 2.2084e6, 6.6121e9, shift[2]);
    Rgb::new(
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    )
}
