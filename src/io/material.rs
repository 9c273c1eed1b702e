//! glTF materials as [`Material`]s.
//!
//! | glTF | becomes |
//! |---|---|
//! | metallic 0, `KHR_materials_specular` factor 0, no transmission | [`Bsdf::Diffuse`]: exactly Lambert |
//! | transmission > 0 with a volume of thickness > 0 | [`Bsdf::Dielectric`] with absorption |
//! | transmission > 0 without | [`Bsdf::Thin`]: it does not refract |
//! | all else | [`Bsdf::MetallicRoughness`] |
//!
//! A metal does not transmit. Between metal and glass (0 < metallic < 1 with transmission) there is no BSDF of ours:
//! the nearer of the two is taken, with a warning.

use std::collections::BTreeMap;

use glam::Vec3;
use gltf_json::{
    material::{AlphaMode, Material as Source},
    validation::Checked,
};

use super::error::{Fault, quoted};
use crate::{
    math::Rgb,
    scene::{
        bsdf::{Bsdf, Dielectric, Diffuse, MetallicRoughness, ThinDielectric},
        material::{EmissionSides, Material},
    },
};

/// The darkest attenuation colour: black would be an infinite absorption coefficient.
const DARKEST: f32 = 1e-6;

/// The material of a primitive that names none (glTF 2.0 specification, 3.7.2.1: all factors at their defaults).
pub(super) fn default() -> Material {
    // The defaults are finite and in range: neither warnings nor an error come of them.
    one(&Source::default(), "", "default".to_owned(), &mut Vec::new())
        .unwrap_or_else(|_| Material::diffuse("default", Rgb::ONE))
}

/// Every material of the file, in its order.
pub(super) fn all(sources: &[Source], warnings: &mut Vec<String>) -> Result<Vec<Material>, Fault> {
    let mut materials = Vec::with_capacity(sources.len());
    let mut ignored = BTreeMap::<&str, u32>::new();
    for (i, source) in sources.iter().enumerate() {
        let name = source.name.clone().unwrap_or_else(|| format!("material {i}"));
        materials.push(one(source, &format!("/materials/{i}"), name, warnings)?);
        for what in unread(source) {
            *ignored.entry(what).or_default() += 1;
        }
    }
    for (what, n) in ignored {
        warnings.push(format!("{what} (materials concerned: {n})"));
    }
    Ok(materials)
}

fn one(m: &Source, at: &str, name: String, warnings: &mut Vec<String>) -> Result<Material, Fault> {
    let pbr = &m.pbr_metallic_roughness;
    let ext = m.extensions.as_ref();
    let specular = ext.and_then(|e| e.specular.as_ref());
    let transmission = ext.and_then(|e| e.transmission.as_ref()).map_or(0.0, |t| t.transmission_factor.0);
    let volume = ext.and_then(|e| e.volume.as_ref());
    let ior = ext.and_then(|e| e.ior.as_ref()).map_or(1.5, |i| i.ior.0);
    let strength = ext.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |e| e.emissive_strength.0);

    let mut range = Range { at, name: &name, warnings };
    let color = range.color("baseColorFactor", Vec3::from_slice(&pbr.base_color_factor.0), 1.0)?;
    let metallic = range.number("metallicFactor", pbr.metallic_factor.0, 0.0, 1.0)?;
    let roughness = range.number("roughnessFactor", pbr.roughness_factor.0, 0.0, 1.0)?;
    let transmission = range.number("transmissionFactor", transmission, 0.0, 1.0)?;
    let weight = range.number("specularFactor", specular.map_or(1.0, |s| s.specular_factor.0), 0.0, 1.0)?;
    let tint = Vec3::from(specular.map_or([1.0; 3], |s| s.specular_color_factor.0));
    let tint = range.color("specularColorFactor", tint, f32::MAX)?;
    let thickness = range.number("thicknessFactor", volume.map_or(0.0, |v| v.thickness_factor.0), 0.0, f32::MAX)?;
    // 0 stands for an infinite index: a surface that reflects everything (KHR_materials_ior, "ior = 0").
    let ior = if ior == 0.0 { 0.0 } else { range.number("ior", ior, 1.0, f32::MAX)? };
    let emission = Vec3::from(m.emissive_factor.0) * strength;
    let emission = range.color("emissiveFactor", emission, f32::MAX)?;

    let alpha = roughness * roughness;
    let mut transmits = transmission > 0.0 && ior > 0.0 && metallic < 1.0;
    if transmits && metallic > 0.0 {
        transmits = metallic < 0.5;
        let taken = if transmits { "glass" } else { "metal" };
        warnings.push(format!("material {} lies between metal and glass: taken as {taken}", quoted(&name)));
    }
    if transmits && (weight != 1.0 || tint != Vec3::ONE) {
        warnings.push(format!(
            "material {} transmits: its KHR_materials_specular factors are not applied, its index of refraction is",
            quoted(&name)
        ));
    }
    let mut absorption = Rgb::ZERO;
    let bsdf = if transmits && thickness > 0.0 {
        if let Some(volume) = volume {
            absorption = self::absorption(
                Vec3::from(volume.attenuation_color.0),
                volume.attenuation_distance.0,
                &mut Range { at, name: &name, warnings },
            )?;
        }
        Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission })
    } else if transmits {
        Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission })
    } else if metallic == 0.0 && weight == 0.0 {
        Bsdf::Diffuse(Diffuse { albedo: color })
    } else {
        // KHR_materials_specular: f0 = min(((ior − 1)/(ior + 1))² · specularColor, 1) · specular, f90 = specular.
        let r = (ior - 1.0) / (ior + 1.0);
        let dielectric_f0 = (tint * (r * r)).min(Vec3::ONE) * weight;
        Bsdf::MetallicRoughness(MetallicRoughness {
            base_color: color,
            metallic,
            alpha,
            dielectric_f0,
            dielectric_f90: weight,
        })
    };
    let emission_sides = if m.double_sided { EmissionSides::Both } else { EmissionSides::Front };
    Ok(Material { name, bsdf, emission, emission_sides, absorption })
}

/// σ_a = −ln(attenuationColor) / attenuationDistance (KHR_materials_volume).
fn absorption(color: Vec3, distance: f32, range: &mut Range<'_>) -> Result<Rgb, Fault> {
    let color = range.color("attenuationColor", color, 1.0)?;
    // NaN cannot be written in JSON; zero and negative distances can.
    let distance = range.number("attenuationDistance", distance.min(f32::MAX), f32::MIN_POSITIVE, f32::MAX)?;
    let absorption = color.max(Vec3::splat(DARKEST)).map(|c| -c.ln() / distance);
    // −0 from a white colour, and the infinity that a tiny distance makes of anything else.
    Ok(absorption.clamp(Vec3::ZERO, Vec3::splat(f32::MAX)) + Vec3::ZERO)
}

/// Brings factors into their range, with a warning, and refuses those that are no numbers.
struct Range<'a> {
    at: &'a str,
    name: &'a str,
    warnings: &'a mut Vec<String>,
}

impl Range<'_> {
    fn number(&mut self, what: &str, value: f32, min: f32, max: f32) -> Result<f32, Fault> {
        if !value.is_finite() {
            return Err(Fault::invalid(self.at, format!("{what} is not a finite number")));
        }
        let clamped = value.clamp(min, max);
        if clamped != value {
            self.warnings.push(format!("material {}: {what} {value} is taken as {clamped}", quoted(self.name)));
        }
        Ok(clamped)
    }

    fn color(&mut self, what: &str, value: Vec3, max: f32) -> Result<Vec3, Fault> {
        Ok(Vec3::new(
            self.number(what, value.x, 0.0, max)?,
            self.number(what, value.y, 0.0, max)?,
            self.number(what, value.z, 0.0, max)?,
        ))
    }
}

/// What the material asks for and this version leaves out: textures and coverage.
fn unread(m: &Source) -> Vec<&'static str> {
    let pbr = &m.pbr_metallic_roughness;
    let ext = m.extensions.as_ref();
    let specular = ext.and_then(|e| e.specular.as_ref());
    let is = |there: bool, what: &'static str| there.then_some(what);
    [
        is(pbr.base_color_texture.is_some(), "base colour textures are not read yet: the factor alone is shown"),
        is(
            pbr.metallic_roughness_texture.is_some(),
            "metallic-roughness textures are not read yet: the factors alone are shown",
        ),
        is(m.emissive_texture.is_some(), "emissive textures are not read yet: all of the surface emits the factor"),
        is(m.normal_texture.is_some(), "normal textures are not read yet: the mesh's own normals are shown"),
        is(m.occlusion_texture.is_some(), "occlusion textures are ignored: occlusion is computed, not painted"),
        is(
            ext.and_then(|e| e.transmission.as_ref()).is_some_and(|t| t.transmission_texture.is_some()),
            "transmission textures are not read yet: the factor alone is shown",
        ),
        is(
            ext.and_then(|e| e.volume.as_ref()).is_some_and(|v| v.thickness_texture.is_some()),
            "thickness textures are ignored: the mesh itself bounds the volume",
        ),
        is(
            specular.is_some_and(|s| s.specular_texture.is_some() || s.specular_color_texture.is_some()),
            "specular textures are not read yet: the factors alone are shown",
        ),
        is(m.alpha_mode == Checked::Valid(AlphaMode::Mask), "alphaMode MASK is not supported yet: shown opaque"),
        is(m.alpha_mode == Checked::Valid(AlphaMode::Blend), "alphaMode BLEND is not supported yet: shown opaque"),
    ]
    .into_iter()
    .flatten()
    .collect()
}
