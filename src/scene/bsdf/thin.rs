//! A thin-walled transmitting surface: glTF's `KHR_materials_transmission` without a volume.

use glam::Vec3;

use super::{
    BsdfSample, GRAZING, Lobe, Scatter, ScatterEvent, Transport, cosine_on_side, fresnel,
    layer::Base,
    microfacet::{Ggx, SMOOTH_ALPHA},
    mirrored,
};
use crate::math::Rgb;

/// A sheet without thickness, the same from both sides: the exact Fresnel reflection of one interface, as the extension
/// has it, over a base that lets the fraction `transmission` straight through and scatters the rest diffusely back.
///
/// Smooth, it has `Delta(0)`, the reflection, and `Delta(1)`, straight on; rough, the transmitted lobe is the
/// reflected one mirrored through the surface.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    /// The tint of transmission and of the diffuse remainder, in [0, 1] per channel.
    pub color: Rgb,
    /// The index of refraction of the sheet, positive: it sets the reflectance and bends nothing.
    pub ior: f32,
    /// GGX's α, the square of glTF's roughness; smooth below 1e-3.
    pub alpha: f32,
    /// The fraction of the base that transmits, in [0, 1].
    pub transmission: f32,
}

impl ThinDielectric {
    #[inline]
    fn base(&self) -> Base {
        Base { color: self.color, transmission: self.transmission }
    }

    #[inline]
    fn is_smooth(&self) -> bool {
        self.alpha < SMOOTH_ALPHA
    }

    /// The diffuse and the rough specular lobe.
    #[inline]
    fn lobes(&self, to_camera: Vec3, to_light: Vec3) -> (Scatter, Scatter) {
        let base = self.base();
        let fresnel = |w: Vec3| fresnel::dielectric(w.z.abs(), self.ior);
        let (diffuse, [p_camera, p_light]) =
            base.remainder((to_camera, fresnel(to_camera)), (to_light, fresnel(to_light)));
        if self.is_smooth() {
            return (diffuse, Scatter::ZERO);
        }
        let same_side = to_camera.z * to_light.z > 0.0;
        let ggx = Ggx { alpha: self.alpha };
        let facet = ggx.reflect(to_camera, if same_side { to_light } else { through(to_light) });
        let f = fresnel::dielectric(facet.cos_camera, self.ior);
        let (color, q) = if same_side {
            (Rgb::splat(f), base.reflection_probability(f))
        } else {
            (base.transmittance() * (1.0 - f), base.transmission_probability(f))
        };
        (diffuse, facet.scatter(color, p_camera * q, p_light * q))
    }

    /// See [`super::Bsdf::eval`].
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        let Lobe::Delta(k) = lobe else {
            let (diffuse, specular) = self.lobes(to_camera, to_light);
            return Scatter::sum(diffuse, specular);
        };
        let same_side = to_camera.z * to_light.z > 0.0;
        if !self.is_smooth() || k != u8::from(!same_side) {
            return Scatter::ZERO;
        }
        let base = self.base();
        let f = fresnel::dielectric(to_camera.z.abs(), self.ior);
        let (value, q) = if same_side {
            (Rgb::splat(f), base.reflection_probability(f))
        } else {
            (base.transmittance() * (1.0 - f), base.transmission_probability(f))
        };
        let p = base.interface_probability(f) * q;
        Scatter::delta(value, to_light, p, p, 1.0)
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if known.z.abs() < GRAZING {
            return None;
        }
        let base = self.base();
        let p = base.interface_probability(fresnel::dielectric(known.z.abs(), self.ior));
        let (direction, lobe) = if u.z >= p {
            (cosine_on_side(known, u.truncate()), Lobe::Continuous)
        } else {
            let smooth = self.is_smooth();
            let (mirror, cos) = if smooth {
                (mirrored(known), known.z.abs())
            } else {
                let h = Ggx { alpha: self.alpha }.sample_visible(known, u.truncate());
                let cos = known.dot(h);
                (fresnel::reflect(known, h, cos), cos)
            };
            // Light that a facet sends below the surface would meet another facet: lost here.
            if mirror.z * known.z <= 0.0 {
                return None;
            }
            let reflects = u.z < p * base.reflection_probability(fresnel::dielectric(cos, self.ior));
            let lobe = if smooth { Lobe::Delta(u8::from(!reflects)) } else { Lobe::Continuous };
            (if reflects { mirror } else { through(mirror) }, lobe)
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
        if self.is_smooth() {
            1.0 - self.base().interface_probability(fresnel::dielectric(known.z.abs(), self.ior))
        } else {
            1.0
        }
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
}

/// The direction mirrored through the surface.
#[inline]
fn through(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, -w.z)
}
