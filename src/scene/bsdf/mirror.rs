//! A perfect mirror.

use glam::Vec3;

use super::{Scatter, Transport, fresnel, is_grazing, mirrored};
use crate::{
    lanes::{Float, Lanes, Vector},
    math::Rgb,
};

/// A smooth metal, the same from both sides: [`Delta(0)`](super::Lobe::Delta) alone. In several lanes a mirror in each.
#[derive(Clone, Copy, Debug)]
pub struct Mirror<V = Vec3> {
    /// Reflectance at normal incidence.
    pub color: Rgb<V>,
}

impl<V: Vector> Mirror<V> {
    /// The value and the densities, from the cosine of both directions. Each is sampled with certainty from the other.
    #[inline(always)]
    pub(super) fn between(&self, cos_camera: V::F, cos_light: V::F) -> Scatter<V::Lanes> {
        let one = cos_camera.lanes().splat(1.0);
        let white = Rgb::of(V::new(one, one, one));
        let reflectance = fresnel::schlick(self.color, white, fresnel::schlick_power(cos_camera.abs()));
        Scatter::delta(reflectance, cos_light, one, one, one)
    }

    /// The direction across from `known`, with the value and the densities there: none for a grazing one.
    #[inline(always)]
    pub(super) fn sample(&self, known: V, transport: Transport) -> (V, Scatter<V::Lanes>) {
        let direction = mirrored(known);
        let [[_, _, known], [_, _, sampled]] = [known.coordinates(), direction.coordinates()];
        let (cos_camera, cos_light) = transport.sides(known, sampled);
        (direction, self.between(cos_camera, cos_light).only(!is_grazing(known)))
    }
}
