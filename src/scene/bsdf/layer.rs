//! What the layered BSDFs share: a base under a Fresnel interface, and how to choose between them.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::Scatter;
use crate::{
    math::Rgb,
    sampling::{PdfSolidAngle, warp},
};

/// The base that glTF puts under a dielectric interface: mix(diffuse, transmission), both tinted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Base {
    /// The tint of what the base reflects and transmits.
    pub color: Rgb,
    /// The fraction of the base that transmits; the rest is Lambertian.
    pub transmission: f32,
}

impl Base {
    /// The transmittance of the base, without the interface.
    #[inline]
    pub fn transmittance(self) -> Rgb {
        self.color * mistake!(self.transmission, DimGlass => 0.95 * self.transmission)
    }

    /// The albedo of the diffuse remainder, without the interface.
    #[inline]
    pub fn albedo(self) -> Rgb {
        self.color * (1.0 - self.transmission)
    }

    /// The probability of sampling the interface (reflection or transmission) rather than the diffuse remainder, from a
    /// direction in which the smooth surface reflects `fresnel`. The remainder is as bright as it is likely: it has
    /// probability 0 only where 1 − F, and with it its value, is 0.
    #[inline]
    pub fn interface_probability(self, fresnel: f32) -> f32 {
        let interface = fresnel + (1.0 - fresnel) * self.transmittance().max_element();
        let diffuse = (1.0 - fresnel) * self.albedo().max_element();
        ratio(interface, diffuse)
    }

    /// The probability of reflection rather than transmission at a (micro)surface that reflects `fresnel`.
    /// It depends on F alone, hence is the same from both ends.
    #[inline]
    pub fn reflection_probability(self, fresnel: f32) -> f32 {
        ratio(fresnel, (1.0 - fresnel) * self.transmittance().max_element())
    }

    /// The diffuse remainder under an interface that reflects `fresnel_*` towards either end, and the probabilities of
    /// sampling the interface from there. Nothing of it where the ends lie on different sides.
    #[inline]
    pub fn remainder(
        self,
        (to_camera, fresnel_camera): (Vec3, f32),
        (to_light, fresnel_light): (Vec3, f32),
    ) -> (Scatter, [f32; 2]) {
        let p_camera = self.interface_probability(fresnel_camera);
        let p_light = self.interface_probability(fresnel_light);
        let diffuse = if to_camera.z * to_light.z > 0.0 {
            let (camera, light) =
                ((to_camera, fresnel_camera, 1.0 - p_camera), (to_light, fresnel_light, 1.0 - p_light));
            coated_diffuse(self.albedo(), camera, light)
        } else {
            Scatter::ZERO
        };
        (diffuse, [p_camera, p_light])
    }

    /// The probability of transmission: what [`Self::reflection_probability`] leaves, and 0 if nothing passes.
    #[inline]
    pub fn transmission_probability(self, fresnel: f32) -> f32 {
        ratio((1.0 - fresnel) * self.transmittance().max_element(), fresnel)
    }
}

/// a/(a + b) for weights that are not negative; 0 if both are.
#[inline]
pub(super) fn ratio(a: f32, b: f32) -> f32 {
    if a > 0.0 { a / (a + b) } else { 0.0 }
}

/// A Lambertian base under an interface that reflects `fresnel_*` towards either end, both on one side, chosen with the
/// given probabilities: f = albedo/π (1 − F(camera)) (1 − F(light)).
///
/// glTF's `fresnel_mix` weighs the base with 1 − F(half vector). At grazing incidence that gives the base almost all of
/// its albedo while the coat already reflects everything: more light leaves than came. Passing the interface
/// once on the way in and once on the way out is reciprocal, and never more than what the coat lets in.
#[inline]
pub(super) fn coated_diffuse(
    albedo: Rgb,
    (to_camera, fresnel_camera, p_camera): (Vec3, f32, f32),
    (to_light, fresnel_light, p_light): (Vec3, f32, f32),
) -> Scatter {
    Scatter {
        f: albedo * ((1.0 - fresnel_camera) * (1.0 - fresnel_light) * FRAC_1_PI),
        to_light: PdfSolidAngle(p_camera * warp::cosine_hemisphere_pdf(to_light.z.abs()).0),
        to_camera: PdfSolidAngle(p_light * warp::cosine_hemisphere_pdf(to_camera.z.abs()).0),
    }
}
