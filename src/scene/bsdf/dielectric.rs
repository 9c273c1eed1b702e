//! The boundary of a refracting volume, smooth or rough.

use glam::Vec3;

use super::{
    BsdfSample, GRAZING, Lobe, Scatter, ScatterEvent, Transport, cosine_on_side, fresnel,
    layer::Base,
    microfacet::{Ggx, SMOOTH_ALPHA},
    mirrored,
};
use crate::math::Rgb;

/// A dielectric boundary: index 1 outside (z > 0), `ior` inside. Exact Fresnel reflection over a base that refracts the
/// fraction `transmission` of what enters it and scatters the rest diffusely back to the side it came from.
///
/// Smooth, it has `Delta(0)`, the reflection, and `Delta(1)`, the refraction; rough, it is that of Walter et al. 2007,
/// *Microfacet Models for Refraction through Rough Surfaces*, with visible normals (Heitz 2014).
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// The tint of refraction and of the diffuse remainder, in [0, 1] per channel.
    pub color: Rgb,
    /// The index of refraction inside, positive. Within 1e-4 of 1 the boundary only tints.
    pub ior: f32,
    /// GGX's α, the square of glTF's roughness; smooth below 1e-3.
    pub alpha: f32,
    /// The fraction of the base that refracts, in [0, 1].
    pub transmission: f32,
}

/// Indices closer than this to the outside's neither reflect nor bend: the half vector of a rough refraction,
/// the difference of two nearly opposite directions, would be rounding noise.
const MATCHED_IOR: f32 = 1e-4;

impl Dielectric {
    #[inline]
    fn base(&self) -> Base {
        Base { color: self.color, transmission: self.transmission }
    }

    #[inline]
    fn is_matched(&self) -> bool {
        (self.ior - 1.0).abs() < MATCHED_IOR
    }

    #[inline]
    fn is_smooth(&self) -> bool {
        self.alpha < SMOOTH_ALPHA || self.is_matched()
    }

    /// The index of refraction on the side of `w`.
    #[inline]
    fn eta(&self, w: Vec3) -> f32 {
        if w.z > 0.0 || self.is_matched() { 1.0 } else { self.ior }
    }

    /// η across the boundary over η on the side of `w`.
    #[inline]
    fn eta_across(&self, w: Vec3) -> f32 {
        self.eta(-w) / self.eta(w)
    }

    /// Reflectance of the smooth boundary towards `w`.
    #[inline]
    fn fresnel(&self, w: Vec3) -> f32 {
        fresnel::dielectric(w.z.abs(), self.eta_across(w))
    }

    /// The diffuse and the rough specular lobe.
    #[inline]
    fn lobes(&self, to_camera: Vec3, to_light: Vec3) -> (Scatter, Scatter) {
        let base = self.base();
        let (diffuse, [p_camera, p_light]) =
            base.remainder((to_camera, self.fresnel(to_camera)), (to_light, self.fresnel(to_light)));
        if self.is_smooth() {
            return (diffuse, Scatter::ZERO);
        }
        let ggx = Ggx { alpha: self.alpha };
        let specular = if to_camera.z * to_light.z > 0.0 {
            let facet = ggx.reflect(to_camera, to_light);
            let f = fresnel::dielectric(facet.cos_camera, self.eta_across(to_camera));
            let q = base.reflection_probability(f);
            facet.scatter(Rgb::splat(f), p_camera * q, p_light * q)
        } else {
            let facet = ggx.refract(to_camera, to_light, self.eta(to_camera), self.eta(to_light));
            let f = fresnel::dielectric_pair(facet.cos_camera, facet.cos_light, self.eta_across(to_camera));
            let q = base.transmission_probability(f);
            facet.scatter(base.transmittance() * (1.0 - f), p_camera * q, p_light * q)
        };
        (diffuse, specular)
    }

    /// See [`super::Bsdf::eval`].
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        let same_side = to_camera.z * to_light.z > 0.0;
        let base = self.base();
        match lobe {
            Lobe::Continuous => {
                let (diffuse, specular) = self.lobes(to_camera, to_light);
                Scatter::sum(diffuse, specular)
            }
            Lobe::Delta(0) if same_side && self.is_smooth() => {
                let f = self.fresnel(to_camera);
                let p = base.interface_probability(f) * base.reflection_probability(f);
                Scatter::delta(Rgb::splat(f), to_light, p, p, 1.0)
            }
            Lobe::Delta(1) if !same_side && self.is_smooth() => {
                let (cos_camera, cos_light) = (to_camera.z.abs(), to_light.z.abs());
                let f = fresnel::dielectric_pair(cos_camera, cos_light, self.eta_across(to_camera));
                let p = base.interface_probability(f) * base.transmission_probability(f);
                // Radiance scales with η² (Veach 5.2); so does dω cos, by the differential of Snell's law.
                let eta = self.relative_ior(to_camera, to_light);
                let value = base.transmittance() * ((1.0 - f) / mistake!(eta * eta, NoEtaSquared => 1.0));
                let jacobian = mistake!(cos_camera / (eta * eta * cos_light), UnitDelta => 1.0);
                Scatter::delta(value, to_light, p, p, jacobian)
            }
            Lobe::Delta(_) => Scatter::ZERO,
        }
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if known.z.abs() < GRAZING {
            return None;
        }
        let base = self.base();
        let p = base.interface_probability(self.fresnel(known));
        let (direction, lobe) = if u.z >= p {
            (cosine_on_side(known, u.truncate()), Lobe::Continuous)
        } else {
            let smooth = self.is_smooth();
            let h = if smooth {
                Vec3::Z.copysign(Vec3::splat(known.z))
            } else {
                Ggx { alpha: self.alpha }.sample_visible(known, u.truncate())
            };
            let (cos, eta) = (known.dot(h), self.eta_across(known));
            let cos_t = fresnel::refracted_cos(cos, eta);
            let reflects = u.z < p * base.reflection_probability(fresnel::dielectric_pair(cos, cos_t, eta));
            let direction = match (smooth, reflects) {
                (true, true) => mirrored(known),
                (true, false) => Vec3::new(-known.x / eta, -known.y / eta, -cos_t.copysign(known.z)),
                (false, true) => fresnel::reflect(known, h, cos),
                (false, false) => fresnel::refract(known, h, cos, cos_t, eta),
            };
            // A facet may send light to the wrong side of the surface, where it would meet another facet: lost here.
            if (direction.z * known.z > 0.0) != reflects {
                return None;
            }
            (direction, if smooth { Lobe::Delta(u8::from(!reflects)) } else { Lobe::Continuous })
        };
        let (to_camera, to_light) = transport.sides(known, direction);
        BsdfSample::checked(direction, lobe, self.eval(lobe, to_camera, to_light), transport)
    }

    /// See [`super::Bsdf::has_continuous`].
    #[inline]
    pub fn has_continuous(&self) -> bool {
        !self.is_smooth() || self.base().albedo() != Rgb::ZERO
    }

    /// See [`super::Bsdf::delta_count`].
    #[inline]
    pub fn delta_count(&self) -> u8 {
        if self.is_smooth() { 2 } else { 0 }
    }

    /// See [`super::Bsdf::continuous_probability`].
    #[inline]
    pub fn continuous_probability(&self, known: Vec3) -> f32 {
        if self.is_smooth() { 1.0 - self.base().interface_probability(self.fresnel(known)) } else { 1.0 }
    }

    /// See [`super::Bsdf::continuous_transmits`].
    #[inline]
    pub fn continuous_transmits(&self) -> bool {
        !self.is_smooth()
    }

    /// See [`super::Bsdf::event`].
    #[inline]
    pub fn continuous_event(&self, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        let (diffuse, specular) = self.lobes(to_camera, to_light);
        ScatterEvent::dominant(&diffuse, &specular)
    }

    /// See [`super::Bsdf::relative_ior`].
    #[inline]
    pub fn relative_ior(&self, to_camera: Vec3, to_light: Vec3) -> f32 {
        if to_camera.z * to_light.z < 0.0 { self.eta(to_light) / self.eta(to_camera) } else { 1.0 }
    }
}
