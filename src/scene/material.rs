//! Materials: what a surface is made of, before it is resolved at a point.

use super::bsdf::{Bsdf, Dielectric, Diffuse, MetallicRoughness, ThinDielectric};
use crate::math::Rgb;

/// The index of a material in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialId(pub u32);

/// A surface's scattering, its emission, and the absorption of the volume behind it.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name in the file, for messages.
    pub name: String,
    /// The scattering.
    pub bsdf: Bsdf,
    /// Emitted radiance, constant over the front hemisphere; black if the surface is no light.
    pub emission: Rgb,
    /// Which sides emit.
    pub emission_sides: EmissionSides,
    /// σ_a of the volume that a [`Bsdf::Dielectric`] bounds, 1/m; zero for clear volumes and all other materials.
    pub absorption: Rgb,
}

/// Which sides of an emitter emit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissionSides {
    /// The front face only: the side of N_g.
    Front,
    /// Both faces (glTF `doubleSided`).
    Both,
}

impl Material {
    /// A material with the given scattering that neither emits nor absorbs.
    pub fn new(name: &str, bsdf: Bsdf) -> Self {
        Self {
            name: name.to_owned(),
            bsdf,
            emission: Rgb::ZERO,
            emission_sides: EmissionSides::Front,
            absorption: Rgb::ZERO,
        }
    }

    /// A Lambertian reflector.
    pub fn diffuse(name: &str, albedo: Rgb) -> Self {
        Self::new(name, Bsdf::Diffuse(Diffuse { albedo }))
    }

    /// A smooth metal that reflects `reflectance` at normal incidence (Schlick: 1 at grazing incidence).
    pub fn mirror(name: &str, reflectance: Rgb) -> Self {
        Self::new(name, Bsdf::MetallicRoughness(MetallicRoughness::metal(reflectance, 0.0)))
    }

    /// Smooth clear glass that bounds a volume of index of refraction `ior`.
    pub fn glass(name: &str, ior: f32) -> Self {
        Self::new(name, Bsdf::Dielectric(Dielectric { color: Rgb::ONE, ior, alpha: 0.0, transmission: 1.0 }))
    }

    /// A smooth thin-walled pane.
    pub fn pane(name: &str, ior: f32) -> Self {
        Self::new(name, Bsdf::Thin(ThinDielectric { color: Rgb::ONE, ior, alpha: 0.0, transmission: 1.0 }))
    }

    /// The same material, emitting `radiance` from its front face.
    #[must_use]
    pub fn emitting(mut self, radiance: Rgb) -> Self {
        self.emission = radiance;
        self
    }
}
