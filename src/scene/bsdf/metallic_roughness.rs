//! Opaque dielectrics and metals: glTF's metallic-roughness model.

use glam::Vec3;

use super::{
    BsdfSample, GRAZING, Lobe, Scatter, ScatterEvent, Transport, cosine_on_side, fresnel,
    layer::{coated_diffuse, ratio},
    microfacet::{Ggx, SMOOTH_ALPHA},
    mirrored,
};
use crate::math::Rgb;

/// A GGX reflection over a Lambertian base, (1 − m)·dielectric + m·metal, the same from both sides.
///
/// With `metallic` = 0 and `dielectric_f0` = `dielectric_f90` = 0 it is Lambert's law. Source: glTF 2.0, appendix B.
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness {
    /// Albedo of the dielectric's base, and reflectance of the metal at normal incidence.
    pub base_color: Rgb,
    /// The fraction m of metal, in [0, 1].
    pub metallic: f32,
    /// GGX's α, the square of glTF's roughness; a perfect mirror below 1e-3.
    pub alpha: f32,
    /// Reflectance of the dielectric's interface at normal incidence.
    pub dielectric_f0: Rgb,
    /// Reflectance of the dielectric's interface at grazing incidence.
    pub dielectric_f90: f32,
}

/// Mean of Schlick's weight (1 − cos θ)⁵ over the cosine-weighted hemisphere.
const MEAN_SCHLICK_WEIGHT: f32 = 1.0 / 21.0;

impl MetallicRoughness {
    /// With the interface that glTF gives where no extension says otherwise: index 1.5, which reflects 4 %.
    pub fn new(base_color: Rgb, metallic: f32, alpha: f32) -> Self {
        Self { base_color, metallic, alpha, dielectric_f0: Rgb::splat(0.04), dielectric_f90: 1.0 }
    }

    /// A pure metal of the given reflectance at normal incidence.
    pub fn metal(base_color: Rgb, alpha: f32) -> Self {
        Self::new(base_color, 1.0, alpha)
    }

    /// Reflectance of both interfaces together, by Schlick's weight.
    #[inline]
    fn reflectance(&self, weight: f32) -> Rgb {
        let dielectric = fresnel::schlick(self.dielectric_f0, Rgb::splat(self.dielectric_f90), weight);
        let metal = fresnel::schlick(self.base_color, Rgb::ONE, weight);
        dielectric * (1.0 - self.metallic) + metal * self.metallic
    }

    /// Albedo of the base, without the interface.
    #[inline]
    fn albedo(&self) -> Rgb {
        self.base_color * (1.0 - self.metallic)
    }

    /// What the dielectric's interface keeps from the base in a direction: its brightest channel, so that no channel gains.
    #[inline]
    fn coat(&self, w: Vec3) -> f32 {
        let weight = fresnel::schlick_weight(w.z.abs());
        fresnel::schlick(self.dielectric_f0, Rgb::splat(self.dielectric_f90), weight).max_element()
    }

    /// The probability of sampling the specular lobe from direction `w`.
    ///
    /// By the reflectance there, drawn by α towards its mean over the hemisphere: a rough lobe sees facets at all angles,
    /// and must not be left to the base's samples where F of the macroscopic surface is 0 (f0 = 0, normal incidence).
    #[inline]
    fn specular_probability(&self, w: Vec3, coat: f32) -> f32 {
        let weight = fresnel::schlick_weight(w.z.abs());
        let spread = if self.is_smooth() { 0.0 } else { self.alpha.min(1.0) };
        let specular = self.reflectance(weight + (MEAN_SCHLICK_WEIGHT - weight) * spread).max_element();
        ratio(specular, self.albedo().max_element() * (1.0 - coat))
    }

    #[inline]
    fn is_smooth(&self) -> bool {
        self.alpha < SMOOTH_ALPHA
    }

    /// Whether any interface reflects at any angle.
    #[inline]
    fn is_specular(&self) -> bool {
        self.metallic > 0.0 || self.dielectric_f90 > 0.0 || self.dielectric_f0.max_element() > 0.0
    }

    /// The diffuse and the rough specular lobe of two directions on one side.
    #[inline]
    fn lobes(&self, to_camera: Vec3, to_light: Vec3) -> (Scatter, Scatter) {
        let (coat_camera, coat_light) = (self.coat(to_camera), self.coat(to_light));
        let p_camera = self.specular_probability(to_camera, coat_camera);
        let p_light = self.specular_probability(to_light, coat_light);
        let diffuse = coated_diffuse(
            self.albedo(),
            (to_camera, coat_camera, 1.0 - p_camera),
            (to_light, coat_light, 1.0 - p_light),
        );
        if self.is_smooth() {
            return (diffuse, Scatter::ZERO);
        }
        let facet = Ggx { alpha: self.alpha }.reflect(to_camera, to_light);
        let reflectance = self.reflectance(fresnel::schlick_weight(facet.cos_camera));
        (diffuse, facet.scatter(reflectance, p_camera, p_light))
    }

    /// See [`super::Bsdf::eval`].
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        if to_camera.z * to_light.z <= 0.0 {
            return Scatter::ZERO;
        }
        match lobe {
            Lobe::Continuous => {
                let (diffuse, specular) = self.lobes(to_camera, to_light);
                Scatter::sum(diffuse, specular)
            }
            Lobe::Delta(0) if self.is_smooth() => {
                let reflectance = self.reflectance(fresnel::schlick_weight(to_camera.z.abs()));
                let p = |w| self.specular_probability(w, self.coat(w));
                Scatter::delta(reflectance, to_light, p(to_camera), p(to_light), 1.0)
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
        let (direction, lobe) = if u.z >= self.specular_probability(known, self.coat(known)) {
            (cosine_on_side(known, u.truncate()), Lobe::Continuous)
        } else if self.is_smooth() {
            (mirrored(known), Lobe::Delta(0))
        } else {
            let h = Ggx { alpha: self.alpha }.sample_visible(known, u.truncate());
            (fresnel::reflect(known, h, known.dot(h)), Lobe::Continuous)
        };
        let (to_camera, to_light) = transport.sides(known, direction);
        BsdfSample::checked(direction, lobe, self.eval(lobe, to_camera, to_light), transport)
    }

    /// See [`super::Bsdf::has_continuous`].
    #[inline]
    pub fn has_continuous(&self) -> bool {
        self.albedo() != Rgb::ZERO || (!self.is_smooth() && self.is_specular())
    }

    /// See [`super::Bsdf::delta_count`].
    #[inline]
    pub fn delta_count(&self) -> u8 {
        u8::from(self.is_smooth() && self.is_specular())
    }

    /// See [`super::Bsdf::continuous_probability`].
    #[inline]
    pub fn continuous_probability(&self, known: Vec3) -> f32 {
        if self.is_smooth() { 1.0 - self.specular_probability(known, self.coat(known)) } else { 1.0 }
    }

    /// See [`super::Bsdf::event`].
    #[inline]
    pub fn continuous_event(&self, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        if to_camera.z * to_light.z <= 0.0 {
            return ScatterEvent::Glossy;
        }
        let (diffuse, specular) = self.lobes(to_camera, to_light);
        ScatterEvent::dominant(&diffuse, &specular)
    }
}
