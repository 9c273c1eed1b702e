//! Lambert's law.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::{BsdfSample, Lobe, Scatter, ScatterEvent, Transport, cosine_on_side};
use crate::{
    lanes::{Float, Lanes, Vector},
    math::{Frame, Rgb},
    sampling::warp,
};

/// A two-sided Lambertian reflector: f = albedo/π where both directions are on the same side.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse<V = Vec3> {
    /// The reflected fraction, in [0, 1] per channel.
    pub albedo: Rgb<V>,
}

impl<V: Vector> Diffuse<V> {
    /// f and both densities, from the cosines of the directions towards the camera and the light.
    #[inline(always)]
    pub fn between(&self, cos_camera: V::F, cos_light: V::F) -> Scatter<V::Lanes> {
        let lanes = cos_camera.lanes();
        let scatter = Scatter {
            f: self.albedo.times(lanes.splat(FRAC_1_PI)),
            to_light: warp::cosine_hemisphere_pdf(cos_light.abs()),
            to_camera: warp::cosine_hemisphere_pdf(cos_camera.abs()),
        };
        scatter.only(!(cos_camera * cos_light).le(lanes.splat(0.0)))
    }

    /// A unit direction across from the unit direction `known` at a surface with the unit normal `n`, both of any
    /// space, with the value and the densities there.
    #[inline(always)]
    pub fn sample_around(&self, n: V, known: V, transport: Transport, u: [V::F; 2]) -> (V, Scatter<V::Lanes>) {
        let cos = n.dot(known);
        let zero = cos.lanes().splat(0.0);
        let local = cosine_on_side(V::new(zero, zero, cos), u);
        let [_, _, sampled] = local.coordinates();
        let (cos_camera, cos_light) = transport.sides(cos, sampled);
        (Frame::around(n).to_world(local).normalize(), self.between(cos_camera, cos_light))
    }
}

impl Diffuse {
    /// See [`super::Bsdf::eval`].
    #[inline(always)]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        if lobe == Lobe::Continuous { self.between(to_camera.z, to_light.z) } else { Scatter::ZERO }
    }

    /// See [`super::Bsdf::sample`].
    #[inline(always)]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        let direction = cosine_on_side(known, [u.x, u.y]);
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
