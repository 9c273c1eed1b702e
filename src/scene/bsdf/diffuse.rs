//! Lambert's law.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::{BsdfSample, Lobe, Scatter, ScatterEvent, Transport, cosine_on_side};
use crate::{math::Rgb, sampling::warp};

/// A two-sided Lambertian reflector: f = albedo/π where both directions are on the same side.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    /// The reflected fraction, in [0, 1] per channel.
    pub albedo: Rgb,
}

impl Diffuse {
    /// See [`super::Bsdf::eval`].
    #[inline(always)]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        if lobe != Lobe::Continuous || to_camera.z * to_light.z <= 0.0 {
            return Scatter::ZERO;
        }
        Scatter {
            f: self.albedo * FRAC_1_PI,
            to_light: warp::cosine_hemisphere_pdf(to_light.z.abs()),
            to_camera: warp::cosine_hemisphere_pdf(to_camera.z.abs()),
        }
    }

    /// See [`super::Bsdf::sample`].
    #[inline(always)]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        let direction = cosine_on_side(known, u.truncate());
        let (to_camera, to_light) = transport.sides(known, direction);
        let scatter = self.eval(Lobe::Continuous, to_camera, to_light);
        BsdfSample::checked(direction, Lobe::Continuous, scatter, transport)
    }

    /// See [`super::Bsdf::has_continuous`]: false for a black surface, which no connection needs to try.
    #[inline(always)]
    pub fn has_continuous(&self) -> bool {
        self.albedo != Rgb::ZERO
    }

    /// See [`super::Bsdf::delta_count`].
    #[inline(always)]
    pub fn delta_count(&self) -> u8 {
        0
    }

    /// See [`super::Bsdf::continuous_probability`].
    #[inline(always)]
    pub fn continuous_probability(&self, _known: Vec3) -> f32 {
        1.0
    }

    /// See [`super::Bsdf::event`].
    #[inline(always)]
    pub fn continuous_event(&self, _to_camera: Vec3, _to_light: Vec3) -> ScatterEvent {
        ScatterEvent::Diffuse
    }
}
