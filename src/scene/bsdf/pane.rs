//! A smooth clear sheet: reflection and straight transmission, and nothing else.

use glam::Vec3;

use super::{Scatter, Transport, fresnel, glass::probabilities, is_grazing, mirrored};
use crate::{
    lanes::{Float, Lanes, Select, Vector},
    math::Rgb,
};

/// A smooth thin-walled dielectric without any plastic, the same from both sides: [`Delta(0)`](super::Lobe::Delta), the
/// reflection, and `Delta(1)`, straight on. In several lanes a sheet in each.
#[derive(Clone, Copy, Debug)]
pub struct Pane<V: Vector = Vec3> {
    /// The tint of transmission, in [0, 1] per channel.
    pub color: Rgb<V>,
    /// The index of refraction of the sheet, positive.
    pub ior: V::F,
}

impl<V: Vector> Pane<V> {
    /// The value and the densities of the delta that joins two directions, from their cosines.
    #[inline(always)]
    pub(super) fn between(&self, cos_camera: V::F, cos_light: V::F) -> Scatter<V::Lanes> {
        let (zero, one) = (cos_camera.lanes().splat(0.0), cos_camera.lanes().splat(1.0));
        let same_side = zero.lt(cos_camera * cos_light);
        let f = fresnel::dielectric(cos_camera.abs(), self.ior);
        let [p, q] = probabilities(f, self.color);
        let value = Rgb::select(same_side, Rgb::of(V::new(f, f, f)), self.color.times(one - f));
        let p = same_side.select(p, q);
        Scatter::delta(value, cos_light, p, p, one)
    }

    /// A direction across from `known`, where it is let through, and the value and the densities there: none for a
    /// grazing one.
    #[inline(always)]
    pub(super) fn sample(
        &self,
        known: V,
        transport: Transport,
        u: V::F,
    ) -> (V, <V::Lanes as Lanes>::M, Scatter<V::Lanes>) {
        let [_, _, z] = known.coordinates();
        let [p, _] = probabilities(fresnel::dielectric(z.abs(), self.ior), self.color);
        let reflects = u.lt(p);
        let direction = reflects.select(mirrored(known), through(mirrored(known)));
        let [_, _, sampled] = direction.coordinates();
        let (cos_camera, cos_light) = transport.sides(z, sampled);
        (direction, !reflects, self.between(cos_camera, cos_light).only(!is_grazing(z)))
    }
}

/// The direction mirrored through the surface.
#[inline(always)]
pub(super) fn through<V: Vector>(w: V) -> V {
    let [x, y, z] = w.coordinates();
    V::new(x, y, -z)
}
