//! The parameters of a surface at one place, and the BSDF that they make.

use super::{
    bsdf::{
        Bsdf, Clear, Dielectric, Diffuse, Emission, Layered, MetallicRoughness, Passage, SheenPlace, Surface,
        ThinDielectric,
    },
    layers::{Coating, Layers},
};
use crate::math::Rgb;

/// A surface's parameters at one place, as glTF's metallic-roughness model and its extensions name them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// baseColor without its alpha, in [0, 1].
    pub base_color: Rgb,
    /// metallic, in [0, 1].
    pub metallic: f32,
    /// roughness, in [0, 1]; GGX's α is its square.
    pub roughness: f32,
    /// transmission, in [0, 1]; counts at a boundary that transmits.
    pub transmission: f32,
    /// specular, in [0, 1].
    pub specular: f32,
    /// specularColor, not negative.
    pub specular_color: Rgb,
    /// The index of refraction, at least 1, or 0 for a surface that reflects everything.
    pub ior: f32,
    /// What lies behind the surface.
    pub boundary: Boundary,
    /// What is added to the model.
    pub layers: Layers,
}

/// What lies behind a surface: a property of the whole material, whatever its textures say in one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// Nothing that light could enter.
    Opaque,
    /// The other side of a thin wall: light passes without being refracted.
    Thin,
    /// A volume.
    Volume,
}

impl Parameters {
    /// A white Lambertian reflector.
    pub const LAMBERT: Self = Self {
        base_color: Rgb::ONE,
        metallic: 0.0,
        roughness: 1.0,
        transmission: 0.0,
        specular: 0.0,
        specular_color: Rgb::ONE,
        ior: 1.5,
        boundary: Boundary::Opaque,
        layers: Layers::NONE,
    };

    /// The BSDF of these parameters.
    ///
    /// | parameters | BSDF |
    /// |---|---|
    /// | layers, or a specular of its own at a boundary that transmits | [`Bsdf::Layered`] |
    /// | metallic < 1/2 on the boundary of a volume | [`Bsdf::Dielectric`], transmission 0 included |
    /// | metallic < 1/2 and transmission on a thin wall | [`Bsdf::Thin`] |
    /// | metallic 0, specular 0 | [`Bsdf::Diffuse`]: exactly Lambert |
    /// | all else | [`Bsdf::MetallicRoughness`] |
    ///
    /// A metal does not transmit. Between metal and glass the nearer of the two is taken where there are no layers.
    pub fn bsdf(&self) -> Bsdf {
        let Self { base_color: color, metallic, transmission, specular, specular_color, ior, .. } = *self;
        let alpha = self.roughness * self.roughness;
        // KHR_materials_specular: f0 = min(((ior − 1)/(ior + 1))² · specularColor, 1) · specular, f90 = specular.
        let r = (ior - 1.0) / (ior + 1.0);
        let dielectric_f0 = (specular_color * (r * r)).min(Rgb::ONE) * specular;
        if self.are_layered() {
            return self.layered(dielectric_f0);
        }
        if metallic < 0.5 && self.boundary == Boundary::Volume {
            return Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission });
        }
        if metallic < 0.5 && self.boundary == Boundary::Thin && transmission > 0.0 {
            return Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission });
        }
        if metallic == 0.0 && specular == 0.0 {
            return Bsdf::Diffuse(Diffuse { albedo: color });
        }
        Bsdf::MetallicRoughness(MetallicRoughness {
            base_color: color,
            metallic,
            alpha,
            dielectric_f0,
            dielectric_f90: specular,
        })
    }

    /// Whether the surface is one of layers.
    pub fn are_layered(&self) -> bool {
        let transmits = self.boundary != Boundary::Opaque && self.metallic < 1.0;
        let tinted = self.specular != 1.0 || self.specular_color != Rgb::ONE;
        // A rough diffuse base is there where something is diffuse.
        let is_diffuse = self.metallic < 1.0 && (self.boundary == Boundary::Opaque || self.transmission < 1.0);
        let diffuse_roughness = if is_diffuse { self.layers.diffuse_roughness } else { 0.0 };
        Layers { diffuse_roughness, ..self.layers }.are_there() || transmits && tinted
    }

    fn layered(&self, f0: Rgb) -> Bsdf {
        let layers = &self.layers;
        let clear = Clear { fraction: self.transmission, ior: self.ior };
        let passage = match self.boundary {
            Boundary::Volume => Passage::Volume(clear),
            Boundary::Thin if self.transmission > 0.0 => Passage::Wall(clear),
            _ if layers.diffuse_transmission > 0.0 => {
                Passage::Leaf { fraction: layers.diffuse_transmission, color: layers.diffuse_transmission_color }
            }
            _ => Passage::None,
        };
        // KHR_materials_coat has its index, KHR_materials_clearcoat one of 1.5.
        let coating = layers.coating.unwrap_or(Coating::CLEAR);
        let coat_r = (coating.ior - 1.0) / (coating.ior + 1.0);
        Bsdf::Layered(Layered::new(&Surface {
            base_color: self.base_color,
            f0,
            f90: self.specular,
            metallic: self.metallic,
            alpha: self.roughness * self.roughness,
            diffuse_roughness: layers.diffuse_roughness,
            coat: layers.coat,
            coat_alpha: layers.coat_roughness * layers.coat_roughness,
            coat_f0: coat_r * coat_r,
            coat_color: coating.color,
            coat_darkening: coating.darkening,
            coat_normal: layers.coat_normal,
            coat_is_flat: layers.coat_is_flat,
            emission: if layers.coating.is_some() { Emission::OverAll } else { Emission::UnderCoat },
            sheen: layers.fuzz.map_or(layers.sheen, |cover| layers.sheen * cover),
            sheen_alpha: layers.sheen_roughness * layers.sheen_roughness,
            sheen_place: layers.fuzz.map_or(SheenPlace::UnderCoat, |cover| SheenPlace::OverAll { cover }),
            film: layers.iridescence,
            film_ior: layers.film_ior,
            film_thickness: layers.film_thickness,
            anisotropy: layers.anisotropy,
            tangent: layers.grain.to_angle(),
            passage,
            measured: layers.metal,
        }))
    }
}
