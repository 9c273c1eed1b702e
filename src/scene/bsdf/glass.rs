//! Smooth clear glass: reflection and refraction at the boundary of a volume, and nothing else.

use glam::Vec3;

use super::{Scatter, Transport, fresnel, is_grazing, layer::ratio, mirrored};
use crate::{
    lanes::{Float, Lanes, Select, Vector},
    math::Rgb,
};

/// A smooth dielectric boundary without any plastic: [`Delta(0)`](super::Lobe::Delta), the reflection, and `Delta(1)`,
/// the refraction. Index 1 outside (z > 0), `ior` inside. In several lanes a boundary in each.
///
/// Cosines are those of directions away from the surface: negative inside.
#[derive(Clone, Copy, Debug)]
pub struct Glass<V: Vector = Vec3> {
    /// The tint of refraction, in [0, 1] per channel.
    pub color: Rgb<V>,
    /// The index of refraction inside, positive. Within 1e-4 of 1 the boundary only tints.
    pub ior: V::F,
}

/// Indices closer than this to the outside's neither reflect nor bend: the half vector of a rough refraction,
/// the difference of two nearly opposite directions, would be rounding noise.
const MATCHED_IOR: f32 = 1e-4;

impl<V: Vector> Glass<V> {
    #[inline(always)]
    pub(super) fn is_matched(&self) -> <V::Lanes as Lanes>::M {
        let lanes = self.ior.lanes();
        (self.ior - lanes.splat(1.0)).abs().lt(lanes.splat(MATCHED_IOR))
    }

    /// The index of refraction on the side of a direction with this cosine.
    #[inline(always)]
    pub(super) fn eta(&self, cos: V::F) -> V::F {
        let lanes = cos.lanes();
        (lanes.splat(0.0).lt(cos) | self.is_matched()).select(lanes.splat(1.0), self.ior)
    }

    /// η across the boundary over η on the side of a direction with this cosine.
    #[inline(always)]
    pub(super) fn eta_across(&self, cos: V::F) -> V::F {
        self.eta(-cos) / self.eta(cos)
    }

    /// See [`super::Bsdf::relative_ior`].
    #[inline(always)]
    pub fn relative_ior(&self, cos_camera: V::F, cos_light: V::F) -> V::F {
        let lanes = cos_camera.lanes();
        let crosses = (cos_camera * cos_light).lt(lanes.splat(0.0));
        crosses.select(self.eta(cos_light) / self.eta(cos_camera), lanes.splat(1.0))
    }

    /// The delta that refracts the fraction 1 − `fresnel` of the light, tinted by `transmittance`; it is chosen with
    /// the probabilities `p_camera` and `p_light` from the two ends.
    #[inline(always)]
    pub(super) fn refraction(
        &self,
        (transmittance, fresnel): (Rgb<V>, V::F),
        [p_camera, p_light]: [V::F; 2],
        cos_camera: V::F,
        cos_light: V::F,
    ) -> Scatter<V::Lanes> {
        let one = fresnel.lanes().splat(1.0);
        // Radiance scales with η² (Veach 5.2); so does dω cos, by the differential of Snell's law.
        let eta = self.relative_ior(cos_camera, cos_light);
        let value = transmittance.times((one - fresnel) / (eta * eta));
        let jacobian = cos_camera.abs() / (eta * eta * cos_light.abs());
        Scatter::delta(value, cos_light, p_camera, p_light, jacobian)
    }

    /// The value and the densities of the delta that joins two directions.
    #[inline(always)]
    pub(super) fn between(&self, cos_camera: V::F, cos_light: V::F) -> Scatter<V::Lanes> {
        let (zero, one) = (cos_camera.lanes().splat(0.0), cos_camera.lanes().splat(1.0));
        let same_side = zero.lt(cos_camera * cos_light);
        let (cos, eta) = (cos_camera.abs(), self.eta_across(cos_camera));
        // F from both cosines is the same at both ends to the last bit, and so are the probabilities.
        let cos_t = same_side.select(fresnel::refracted_cos(cos, eta), cos_light.abs());
        let f = fresnel::dielectric_pair(cos, cos_t, eta);
        let [p, q] = probabilities(f, self.color);
        let reflection = Scatter::delta(Rgb::of(V::new(f, f, f)), cos_light, p, p, one);
        let refraction = self.refraction((self.color, f), [q; 2], cos_camera, cos_light);
        Scatter::select(same_side, reflection, refraction)
    }

    /// A direction across from `known`, where it is refracted, and the value and the densities there: none for a
    /// grazing one.
    #[inline(always)]
    pub(super) fn sample(
        &self,
        known: V,
        transport: Transport,
        u: V::F,
    ) -> (V, <V::Lanes as Lanes>::M, Scatter<V::Lanes>) {
        let [_, _, z] = known.coordinates();
        let (cos, eta) = (z.abs(), self.eta_across(z));
        let cos_t = fresnel::refracted_cos(cos, eta);
        let [p, _] = probabilities(fresnel::dielectric_pair(cos, cos_t, eta), self.color);
        let reflects = u.lt(p);
        let direction = reflects.select(mirrored(known), fresnel::refracted(known, cos_t, eta));
        let [_, _, sampled] = direction.coordinates();
        let (cos_camera, cos_light) = transport.sides(z, sampled);
        (direction, !reflects, self.between(cos_camera, cos_light).only(!is_grazing(z)))
    }
}

/// The probability of reflection at what reflects the fraction `fresnel` and passes the rest, tinted by `color`; and
/// that of passing, which is what the first leaves, and 0 if nothing passes.
#[inline(always)]
pub(super) fn probabilities<V: Vector>(fresnel: V::F, color: Rgb<V>) -> [V::F; 2] {
    let passed = (fresnel.lanes().splat(1.0) - fresnel) * color.max_element();
    [ratio(fresnel, passed), ratio(passed, fresnel)]
}
