//! glTF materials as [`Material`]s: factors brought into their range, and their textures. Which BSDF they make stands
//! at [`Parameters::bsdf`].
//!
//! Wherever a decision needs a parameter, it takes the factor times its texture, never the factor alone: a texture of
//! one value is the same as that value in the factor.
//!
//! Occlusion textures are not read: occlusion is what a path tracer computes, and painted on top it would count twice.
//! Thickness stands in for the back of a volume where nothing is traced through it; here the mesh itself bounds the
//! volume, and all that is read of a thickness and its texture is whether there is any.
//!
//! `KHR_materials_unlit` becomes a black surface that emits its base colour, in radiance 1 for white, to both sides.
//!
//! `alphaMode` and the base colour's alpha are [`AlphaMode`], of whatever scatters there: a pane with alphaMode BLEND
//! is there in part and transmits where it is there. An OPAQUE material ignores alpha.

use std::{collections::BTreeMap, fmt};

use glam::Vec3;
use gltf_json::{
    Root,
    material::{AlphaMode as SourceMode, Material as Source},
    validation::Checked,
};

use super::{
    error::{Fault, quoted},
    image::Images,
    limits::Drafts,
    texture::{self, Reference},
};
use crate::{
    math::Rgb,
    scene::{
        layers::Layers,
        light::BRIGHTEST,
        material::{
            AlphaMode, BackFaces, Boundary, EmissionSides, Maps, Material, NormalMap, Parameters, VertexColors,
        },
        texture::{Encoding, Texture},
    },
};

/// The darkest attenuation colour: black would be an infinite absorption coefficient.
const DARKEST: f32 = 1e-6;

/// A material of the file, before it is known whether the mesh that it is on has vertex colours.
pub(super) struct Read {
    name: String,
    maps: Maps,
    alpha_mode: AlphaMode,
    emission: Rgb,
    emission_sides: EmissionSides,
    back_faces: BackFaces,
    absorption: Rgb,
    dispersion: f32,
    unlit: bool,
}

impl Read {
    /// What the material reads of a mesh.
    pub(super) fn maps(&self) -> &Maps {
        &self.maps
    }

    /// Whether it shows its base colour by emitting it.
    pub(super) fn unlit(&self) -> bool {
        self.unlit
    }

    /// The material on meshes without vertex colours.
    pub(super) fn plain(&self) -> Material {
        self.on(VertexColors::Nothing)
    }

    /// The material on meshes with vertex colours, which multiply its base colour.
    pub(super) fn colored(&self) -> Material {
        self.on(if self.unlit { VertexColors::Emission } else { VertexColors::BaseColor })
    }

    fn on(&self, vertex_colors: VertexColors) -> Material {
        let maps = Maps { vertex_colors, ..self.maps.clone() };
        let holed = |texture: &&Texture| self.alpha_mode != AlphaMode::Opaque && texture.image.has_alpha();
        let thinnest = maps.base_color.as_ref().filter(holed).map_or(1.0, |texture| texture.extremes()[0].w);
        let whole = vertex_colors == VertexColors::Nothing && self.alpha_mode.alpha(thinnest) == 1.0;
        let mut material = if maps.vary() {
            Material::varying(&self.name, maps)
        } else {
            Material::new(&self.name, maps.factors.bsdf())
        };
        // What is there wholly is better known as opaque: rays through such a scene cost less.
        material.alpha_mode = if whole { AlphaMode::Opaque } else { self.alpha_mode };
        material.emission = self.emission;
        material.emission_sides = self.emission_sides;
        material.back_faces = self.back_faces;
        material.absorption = self.absorption;
        material.dispersion = self.dispersion;
        material
    }
}

/// Every material of the file, in its order, and after them that of a primitive that names none
/// (glTF 2.0 specification, 3.7.2.1: all factors at their defaults).
pub(super) fn all(
    root: &Root,
    mut images: Images<'_>,
    drafts: Drafts,
    warnings: &mut Vec<String>,
) -> Result<Vec<Read>, Fault> {
    let mut materials = Vec::with_capacity(root.materials.len() + 1);
    let mut ignored = BTreeMap::<&str, u32>::new();
    for (i, source) in root.materials.iter().enumerate() {
        let name = source.name.clone().unwrap_or_else(|| format!("material {i}"));
        let mut reader = Reader { root, images: &mut images, drafts, at: format!("/materials/{i}"), name, warnings };
        materials.push(reader.material(source)?);
        for what in unread(source) {
            *ignored.entry(what).or_default() += 1;
        }
    }
    for (what, n) in ignored {
        warnings.push(format!("{what} (materials concerned: {n})"));
    }
    let name = "default".to_owned();
    let mut reader = Reader { root, images: &mut images, drafts, at: String::new(), name, warnings };
    materials.push(reader.material(&Source::default())?);
    Ok(materials)
}

/// Reads one material: brings factors into their range, with a warning, and refuses those that are no numbers.
pub(super) struct Reader<'a, 'b> {
    root: &'a Root,
    images: &'a mut Images<'b>,
    /// Whether extensions that are drafts count.
    pub(super) drafts: Drafts,
    pub(super) at: String,
    pub(super) name: String,
    pub(super) warnings: &'a mut Vec<String>,
}

impl Reader<'_, '_> {
    fn material(&mut self, m: &Source) -> Result<Read, Fault> {
        let pbr = &m.pbr_metallic_roughness;
        let ext = m.extensions.as_ref();
        let volume = ext.and_then(|e| e.volume.as_ref());
        let mut maps = Maps::new(self.factors(m)?);
        let (color, data) = (Encoding::Srgb, Encoding::Linear);
        let base = "pbrMetallicRoughness";
        maps.base_color = self.texture(pbr.base_color_texture.as_ref(), color, &format!("{base}/baseColorTexture"))?;
        maps.metallic_roughness =
            self.texture(pbr.metallic_roughness_texture.as_ref(), data, &format!("{base}/metallicRoughnessTexture"))?;
        maps.emission = self.texture(m.emissive_texture.as_ref(), color, "emissiveTexture")?;
        let transmission = ext.and_then(|e| e.transmission.as_ref()?.transmission_texture.as_ref());
        maps.transmission =
            self.texture(transmission, data, "extensions/KHR_materials_transmission/transmissionTexture")?;
        if let Some(specular) = ext.and_then(|e| e.specular.as_ref()) {
            let at = "extensions/KHR_materials_specular";
            maps.specular = self.texture(specular.specular_texture.as_ref(), data, &format!("{at}/specularTexture"))?;
            let texture = specular.specular_color_texture.as_ref();
            maps.specular_color = self.texture(texture, color, &format!("{at}/specularColorTexture"))?;
        }
        let diffuse_alpha = self.specular_glossiness(m, &mut maps)?;
        if let Some(normal) = &m.normal_texture {
            let extensions = normal.extensions.as_ref().map(|extensions| &extensions.others);
            let reference = Reference { texture: normal.index.value(), tex_coord: normal.tex_coord, extensions };
            let texture = self.reference(Some(reference), data, "normalTexture")?;
            let scale = self.number("normalTexture/scale", normal.scale, f32::MIN, f32::MAX)?;
            maps.normal = texture.map(|texture| NormalMap { texture, scale });
        }
        let mut emission = self.emission(m, &maps)?;
        let unlit = ext.is_some_and(|e| e.others.contains_key("KHR_materials_unlit"));
        if !unlit {
            self.layers(m, &mut maps)?;
            maps.factors.boundary = self.boundary(m, &maps)?;
            self.check_diffuse_transmission(m, &mut maps);
        }
        let factors = maps.factors;
        let mut absorption = Rgb::ZERO;
        if let Some(volume) = volume.filter(|_| factors.boundary == Boundary::Volume) {
            let color = Rgb::from_array(volume.attenuation_color.0);
            absorption = self.absorption(color, volume.attenuation_distance.0)?;
        }
        let dispersion = self.dispersion(m, &maps)?;
        let back_faces = if m.double_sided { BackFaces::Drawn } else { BackFaces::Culled };
        let mut emission_sides = if m.double_sided { EmissionSides::Both } else { EmissionSides::Front };
        let alpha = diffuse_alpha.unwrap_or(m.pbr_metallic_roughness.base_color_factor.0[3]);
        let alpha_mode = self.alpha_mode(m, alpha)?;
        if unlit {
            emission = factors.base_color;
            emission_sides = EmissionSides::Both;
            let black = Parameters { base_color: Rgb::ZERO, specular: 0.0, metallic: 0.0, ..factors };
            let shown = maps.base_color;
            maps = Maps::new(black);
            (maps.base_color, maps.emission) = (shown.clone(), shown);
        }
        let name = self.name.clone();
        Ok(Read { name, maps, alpha_mode, emission, emission_sides, back_faces, absorption, dispersion, unlit })
    }

    /// Radiance where the texture is white.
    fn emission(&mut self, m: &Source, maps: &Maps) -> Result<Rgb, Fault> {
        let strength = m.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
        let emission = Rgb::from_array(m.emissive_factor.0) * strength.map_or(1.0, |e| e.emissive_strength.0);
        let emission = self.color("emissiveFactor", emission, f32::MAX)?;
        let brightest = maps.emission.as_ref().map_or(Rgb::ONE, |texture| texture.extremes()[1].truncate().into());
        let brightest = (emission * brightest).max_element();
        if brightest > BRIGHTEST {
            let what = format!("the emission is {brightest:e} nit, and {BRIGHTEST:e} is the limit");
            return Err(Fault::invalid(format!("{}/emissiveFactor", self.at), what));
        }
        Ok(emission)
    }

    fn factors(&mut self, m: &Source) -> Result<Parameters, Fault> {
        let pbr = &m.pbr_metallic_roughness;
        let ext = m.extensions.as_ref();
        let specular = ext.and_then(|e| e.specular.as_ref());
        let transmission = ext.and_then(|e| e.transmission.as_ref()).map_or(0.0, |t| t.transmission_factor.0);
        let ior = ext.and_then(|e| e.ior.as_ref()).map_or(1.5, |i| i.ior.0);

        let base_color = self.color("baseColorFactor", Vec3::from_slice(&pbr.base_color_factor.0).into(), 1.0)?;
        let metallic = self.number("metallicFactor", pbr.metallic_factor.0, 0.0, 1.0)?;
        let roughness = self.number("roughnessFactor", pbr.roughness_factor.0, 0.0, 1.0)?;
        let transmission = self.number("transmissionFactor", transmission, 0.0, 1.0)?;
        let weight = self.number("specularFactor", specular.map_or(1.0, |s| s.specular_factor.0), 0.0, 1.0)?;
        let tint = Rgb::from_array(specular.map_or([1.0; 3], |s| s.specular_color_factor.0));
        let specular_color = self.color("specularColorFactor", tint, f32::MAX)?;
        // 0 stands for an infinite index: a surface that reflects everything (KHR_materials_ior, "ior = 0").
        let ior = if ior == 0.0 { 0.0 } else { self.number("ior", ior, 1.0, f32::MAX)? };

        Ok(Parameters {
            base_color,
            metallic,
            roughness,
            transmission,
            specular: weight,
            specular_color,
            ior,
            boundary: Boundary::Opaque,
            layers: Layers::NONE,
        })
    }

    /// What lies behind the surface: whether light gets through it anywhere, and what thickness it then has.
    fn boundary(&mut self, m: &Source, maps: &Maps) -> Result<Boundary, Fault> {
        let ext = m.extensions.as_ref();
        let volume = ext.and_then(|e| e.volume.as_ref());
        let thickness = self.number("thicknessFactor", volume.map_or(0.0, |v| v.thickness_factor.0), 0.0, f32::MAX)?;
        let p = maps.factors;
        if p.transmission * extremes(maps.transmission.as_ref(), RED)[1] == 0.0 || p.ior == 0.0 {
            return Ok(Boundary::Opaque);
        }
        if Self::is_measured(m) {
            let name = quoted(&self.name);
            self.warnings.push(format!("material {name} is a metal: KHR_materials_transmission is not applied to it"));
            return Ok(Boundary::Opaque);
        }
        let [least, most] = extremes(maps.metallic_roughness.as_ref(), BLUE).map(|texel| p.metallic * texel);
        // Layers have a base of both, and of whatever is between.
        let tinted = p.specular != 1.0 || p.specular_color != Rgb::ONE;
        let tinted = tinted || maps.specular.is_some() || maps.specular_color.is_some();
        let layers = Layers { diffuse_transmission: 0.0, ..p.layers };
        if layers.are_there() || tinted {
            if least >= 1.0 {
                return Ok(Boundary::Opaque);
            }
        } else {
            let name = quoted(&self.name);
            if least < 0.5 && most >= 0.5 {
                let what = "transmits where its texture makes it less than half metal";
                self.warnings.push(format!("material {name} {what}"));
            } else if most > 0.0 && least < 1.0 {
                let taken = if least < 0.5 { "glass" } else { "metal" };
                self.warnings.push(format!("material {name} lies between metal and glass: taken as {taken}"));
            }
            if least >= 0.5 {
                return Ok(Boundary::Opaque);
            }
        }
        let texture = volume.and_then(|v| v.thickness_texture.as_ref()).filter(|_| thickness > 0.0);
        let at = "extensions/KHR_materials_volume/thicknessTexture";
        let texture = self.texture(texture, Encoding::Linear, at)?;
        let thick = thickness * extremes(texture.as_ref(), GREEN)[1] > 0.0;
        Ok(if thick { Boundary::Volume } else { Boundary::Thin })
    }

    fn texture<'i>(
        &mut self,
        reference: Option<impl Into<Reference<'i>>>,
        encoding: Encoding,
        at: &str,
    ) -> Result<Option<Texture>, Fault> {
        self.reference(reference.map(Into::into), encoding, at)
    }

    pub(super) fn reference(
        &mut self,
        reference: Option<Reference<'_>>,
        encoding: Encoding,
        at: &str,
    ) -> Result<Option<Texture>, Fault> {
        let Some(reference) = reference else { return Ok(None) };
        let at = format!("{}/{at}", self.at);
        texture::read(self.root, self.images, &reference, encoding, &at, self.warnings)
    }

    /// What is there of the surface (glTF 2.0 specification, 3.9.4).
    fn alpha_mode(&mut self, m: &Source, alpha: f32) -> Result<AlphaMode, Fault> {
        Ok(match m.alpha_mode {
            Checked::Valid(SourceMode::Mask) => AlphaMode::Mask {
                factor: self.number("baseColorFactor (alpha)", alpha, 0.0, 1.0)?,
                cutoff: self.number("alphaCutoff", m.alpha_cutoff.map_or(0.5, |c| c.0), 0.0, f32::MAX)?,
            },
            Checked::Valid(SourceMode::Blend) => {
                AlphaMode::Blend { factor: self.number("baseColorFactor (alpha)", alpha, 0.0, 1.0)? }
            }
            // Values that glTF does not know have been refused with the whole document.
            Checked::Valid(SourceMode::Opaque) | Checked::Invalid => AlphaMode::Opaque,
        })
    }

    /// σ_a = −ln(attenuationColor) / attenuationDistance (KHR_materials_volume).
    fn absorption(&mut self, color: Rgb, distance: f32) -> Result<Rgb, Fault> {
        let color = self.color("attenuationColor", color, 1.0)?;
        // Exporters write 0 for "no absorption"; NaN and infinity cannot be written in JSON.
        if distance <= 0.0 {
            let name = quoted(&self.name);
            self.warnings.push(format!(
                "material {name}: attenuationDistance {} counts as infinite: its volume absorbs nothing",
                Short(distance)
            ));
            return Ok(Rgb::ZERO);
        }
        let distance = self.number("attenuationDistance", distance.min(f32::MAX), f32::MIN_POSITIVE, f32::MAX)?;
        let absorption = color.max(Rgb::splat(DARKEST)).map(|c| -c.ln() / distance);
        // −0 from a white colour, and the infinity that a tiny distance makes of anything else.
        Ok(absorption.max(Rgb::ZERO).min(Rgb::splat(f32::MAX)) + Rgb::ZERO)
    }

    pub(super) fn number(&mut self, what: &str, value: f32, min: f32, max: f32) -> Result<f32, Fault> {
        if !value.is_finite() {
            return Err(Fault::invalid(&self.at, format!("{what} is not a finite number")));
        }
        let clamped = value.clamp(min, max);
        if clamped != value {
            let (name, value, clamped) = (quoted(&self.name), Short(value), Short(clamped));
            self.warnings.push(format!("material {name}: {what} {value} is taken as {clamped}"));
        }
        Ok(clamped)
    }

    pub(super) fn color(&mut self, what: &str, value: Rgb, max: f32) -> Result<Rgb, Fault> {
        Ok(Rgb::new(
            self.number(what, value.r(), 0.0, max)?,
            self.number(what, value.g(), 0.0, max)?,
            self.number(what, value.b(), 0.0, max)?,
        ))
    }
}

/// Channels of a texel.
const RED: usize = 0;
const GREEN: usize = 1;
const BLUE: usize = 2;

/// The least and the greatest by which a texture multiplies its factor.
fn extremes(texture: Option<&Texture>, channel: usize) -> [f32; 2] {
    texture.map_or([1.0; 2], |texture| texture.extremes().map(|texel| texel[channel]))
}

/// A number in as few characters as it needs.
struct Short(f32);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.abs() {
            0.0 | 1e-4..1e6 => write!(f, "{}", self.0),
            _ => write!(f, "{:e}", self.0),
        }
    }
}

/// What the material asks for and this version leaves out.
fn unread(m: &Source) -> Vec<&'static str> {
    let ext = m.extensions.as_ref();
    let is = |there: bool, what: &'static str| there.then_some(what);
    [
        is(m.occlusion_texture.is_some(), "occlusion textures are ignored: occlusion is computed, not painted"),
        is(
            ext.and_then(|e| e.volume.as_ref()).is_some_and(|v| v.thickness_texture.is_some()),
            "thickness textures say only whether there is a volume: the mesh itself bounds it",
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}
