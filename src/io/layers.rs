//! The extensions that add lobes to a material (clear coat, sheen, anisotropy, iridescence, diffuse transmission; of
//! drafts coat, fuzz, diffuse roughness), the measured metals, the dispersion of its volume, and the model of speculars
//! and glossiness, which is converted.

use std::sync::Arc;

use glam::Vec2;
use gltf_json::{
    material::{Material as Source, NormalTexture},
    texture::Info,
};
use serde_json::{Map, Value};

use super::{
    error::{Fault, quoted},
    limits::Drafts,
    material::Reader,
    texture::Reference,
};
use crate::{
    math::Rgb,
    scene::{
        bsdf::Metal,
        layers::{Coating, LayerMaps, Layers},
        material::{Boundary, Maps, NormalMap, Parameters},
        texture::{Encoding, Image, Texels, Texture},
    },
};

/// A measured metal by its symbol, of this project.
const METAL: &str = "PATHSPACE_materials_metal";

/// How much a volume's index of refraction depends on the wavelength.
const DISPERSION: &str = "KHR_materials_dispersion";

/// The legacy model.
const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

/// An extension of a material.
struct Extension<'a> {
    name: &'static str,
    members: &'a Map<String, Value>,
}

impl<'a> Extension<'a> {
    fn of(m: &'a Source, name: &'static str) -> Option<Self> {
        let members = m.extensions.as_ref()?.others.get(name)?.as_object()?;
        Some(Self { name, members })
    }

    fn at(&self, member: &str) -> String {
        format!("extensions/{}/{member}", self.name)
    }
}

impl Reader<'_, '_> {
    /// Adds the layers of a material.
    pub(super) fn layers(&mut self, m: &Source, maps: &mut Maps) -> Result<(), Fault> {
        let mut layers = Layers::NONE;
        let mut textures = LayerMaps::default();
        if !self.draft_coat(m, &mut layers, &mut textures)? {
            self.coat(m, &mut layers, &mut textures)?;
        }
        if !self.fuzz(m, &mut layers, &mut textures)? {
            self.sheen(m, &mut layers, &mut textures)?;
        }
        self.diffuse_roughness(m, &mut layers, &mut textures)?;
        self.anisotropy(m, &mut layers, &mut textures)?;
        self.iridescence(m, &mut layers, &mut textures)?;
        self.diffuse_transmission(m, &mut layers, &mut textures)?;
        layers.metal = self.metal(m)?;
        if layers.are_there() {
            maps.factors.layers = layers;
            maps.layers = Some(Box::new(textures));
        }
        Ok(())
    }

    /// What is said of a material that transmits diffusely, once its boundary is known.
    pub(super) fn check_diffuse_transmission(&mut self, m: &Source, maps: &mut Maps) {
        if maps.factors.layers.diffuse_transmission == 0.0 {
            return;
        }
        let name = quoted(&self.name);
        if maps.factors.boundary != Boundary::Opaque {
            let what = "transmits: KHR_materials_diffuse_transmission is not applied to it";
            self.warnings.push(format!("material {name} {what}"));
            maps.factors.layers.diffuse_transmission = 0.0;
        } else if m.extensions.as_ref().is_some_and(|e| e.volume.is_some()) {
            self.warnings.push(format!(
                "material {name} transmits diffusely: light passes it as it does a thin sheet, and not its volume"
            ));
        }
    }

    /// An extension that is a draft, if drafts count.
    fn draft<'m>(&self, m: &'m Source, name: &'static str) -> Option<Extension<'m>> {
        Extension::of(m, name).filter(|_| self.drafts == Drafts::Read)
    }

    /// Whether the material names a measured metal.
    pub(super) fn is_measured(m: &Source) -> bool {
        Extension::of(m, METAL).is_some()
    }

    fn metal(&self, m: &Source) -> Result<Option<Metal>, Fault> {
        let Some(e) = Extension::of(m, METAL) else { return Ok(None) };
        let at = || format!("{}/{}", self.at, e.at("name"));
        let symbol = e.members.get("name").and_then(Value::as_str);
        let symbol = symbol.ok_or_else(|| Fault::invalid(at(), "there is no name of a metal"))?;
        let known = || Metal::all().map(Metal::symbol).collect::<Vec<_>>().join(", ");
        let unknown = || Fault::invalid(at(), format!("{} is none of the measured metals {}", quoted(symbol), known()));
        Metal::named(symbol).ok_or_else(unknown).map(Some)
    }

    /// 20/V_d of the volume that a material bounds, not negative; 0 without one, and a warning if the file has another.
    pub(super) fn dispersion(&mut self, m: &Source, maps: &Maps) -> Result<f32, Fault> {
        let Some(e) = Extension::of(m, DISPERSION) else { return Ok(0.0) };
        let dispersion = self.factor(&e, "dispersion", 0.0, [0.0, f32::MAX])?;
        if dispersion > 0.0 && maps.factors.boundary != Boundary::Volume {
            let name = quoted(&self.name);
            self.warnings.push(format!("material {name} bounds no volume: {DISPERSION} is not applied to it"));
            return Ok(0.0);
        }
        Ok(dispersion)
    }

    fn coat(&mut self, m: &Source, layers: &mut Layers, maps: &mut LayerMaps) -> Result<(), Fault> {
        let Some(e) = Extension::of(m, "KHR_materials_clearcoat") else { return Ok(()) };
        layers.coat = self.factor(&e, "clearcoatFactor", 0.0, [0.0, 1.0])?;
        layers.coat_roughness = self.factor(&e, "clearcoatRoughnessFactor", 0.0, [0.0, 1.0])?;
        maps.coat = self.slot(&e, "clearcoatTexture", Encoding::Linear)?;
        maps.coat_roughness = self.slot(&e, "clearcoatRoughnessTexture", Encoding::Linear)?;
        maps.coat_normal = self.coat_normal(&e, "clearcoatNormalTexture")?;
        Ok(())
    }

    fn coat_normal(&mut self, e: &Extension<'_>, member: &str) -> Result<Option<NormalMap>, Fault> {
        let Some(value) = e.members.get(member) else { return Ok(None) };
        let at = e.at(member);
        let Ok(normal) = serde_json::from_value::<NormalTexture>(value.clone()) else {
            return Err(Fault::invalid(format!("{}/{at}", self.at), "this is no reference to a normal texture"));
        };
        let extensions = normal.extensions.as_ref().map(|extensions| &extensions.others);
        let reference = Reference { texture: normal.index.value(), tex_coord: normal.tex_coord, extensions };
        let texture = self.reference(Some(reference), Encoding::Linear, &at)?;
        let scale = self.number(&format!("{at}/scale"), normal.scale, f32::MIN, f32::MAX)?;
        Ok(texture.map(|texture| NormalMap { texture, scale }))
    }

    /// Whether there is a coat that is one of the draft, which comes in place of a clear coat.
    fn draft_coat(&mut self, m: &Source, layers: &mut Layers, maps: &mut LayerMaps) -> Result<bool, Fault> {
        let Some(e) = self.draft(m, "KHR_materials_coat") else { return Ok(false) };
        layers.coat = self.factor(&e, "coatFactor", 0.0, [0.0, 1.0])?;
        layers.coat_roughness = self.factor(&e, "coatRoughnessFactor", 0.0, [0.0, 1.0])?;
        let ior = self.factor(&e, "coatIor", 1.5, [0.0, f32::MAX])?;
        let ior = if ior == 0.0 { 0.0 } else { self.number(&e.at("coatIor"), ior, 1.0, f32::MAX)? };
        let color = self.tint(&e, "coatColorFactor", Rgb::ONE)?;
        layers.coating =
            Some(Coating { ior, color, darkening: self.factor(&e, "coatDarkeningFactor", 1.0, [0.0, 1.0])? });
        maps.coat = self.slot(&e, "coatTexture", Encoding::Linear)?;
        maps.coat_roughness = self.slot(&e, "coatRoughnessTexture", Encoding::Linear)?;
        maps.coat_color = self.slot(&e, "coatColorTexture", Encoding::Srgb)?;
        maps.coat_normal = self.coat_normal(&e, "coatNormalTexture")?;
        if self.factor(&e, "coatAnisotropyStrength", 0.0, [0.0, 1.0])? > 0.0 {
            let name = quoted(&self.name);
            self.warnings.push(format!("material {name}: the anisotropy of its coat is left out"));
        }
        Ok(true)
    }

    /// Whether there is fuzz, which comes in place of a sheen.
    fn fuzz(&mut self, m: &Source, layers: &mut Layers, maps: &mut LayerMaps) -> Result<bool, Fault> {
        let Some(e) = self.draft(m, "KHR_materials_fuzz") else { return Ok(false) };
        layers.fuzz = Some(self.factor(&e, "fuzzFactor", 0.0, [0.0, 1.0])?);
        layers.sheen = self.tint(&e, "fuzzColorFactor", Rgb::ONE)?;
        layers.sheen_roughness = self.factor(&e, "fuzzRoughnessFactor", 0.5, [0.0, 1.0])?;
        maps.fuzz = self.slot(&e, "fuzzTexture", Encoding::Linear)?;
        maps.sheen_color = self.slot(&e, "fuzzColorTexture", Encoding::Srgb)?;
        maps.sheen_roughness = self.slot(&e, "fuzzRoughnessTexture", Encoding::Linear)?;
        Ok(true)
    }

    /// By its name at Khronos, or before it had one there.
    fn diffuse_roughness(&mut self, m: &Source, layers: &mut Layers, maps: &mut LayerMaps) -> Result<(), Fault> {
        let [ours, before] = ["KHR_materials_diffuse_roughness", "EXT_materials_diffuse_roughness"];
        let Some(e) = self.draft(m, ours).or_else(|| self.draft(m, before)) else { return Ok(()) };
        layers.diffuse_roughness = self.factor(&e, "diffuseRoughnessFactor", 0.0, [0.0, 1.0])?;
        maps.diffuse_roughness = self.slot(&e, "diffuseRoughnessTexture", Encoding::Linear)?;
        Ok(())
    }

    fn sheen(&mut self, m: &Source, layers: &mut Layers, maps: &mut LayerMaps) -> Result<(), Fault> {
        let Some(e) = Extension::of(m, "KHR_materials_sheen") else { return Ok(()) };
        layers.sheen = self.tint(&e, "sheenColorFactor", Rgb::ZERO)?;
        layers.sheen_roughness = self.factor(&e, "sheenRoughnessFactor", 0.0, [0.0, 1.0])?;
        maps.sheen_color = self.slot(&e, "sheenColorTexture", Encoding::Srgb)?;
        maps.sheen_roughness = self.slot(&e, "sheenRoughnessTexture", Encoding::Linear)?;
        Ok(())
    }

    fn anisotropy(&mut self, m: &Source, layers: &mut Layers, maps: &mut LayerMaps) -> Result<(), Fault> {
        let Some(e) = Extension::of(m, "KHR_materials_anisotropy") else { return Ok(()) };
        layers.anisotropy = self.factor(&e, "anisotropyStrength", 0.0, [0.0, 1.0])?;
        let rotation = self.factor(&e, "anisotropyRotation", 0.0, [f32::MIN, f32::MAX])?;
        layers.grain = Vec2::from_angle(rotation);
        maps.anisotropy = self.slot(&e, "anisotropyTexture", Encoding::Linear)?;
        Ok(())
    }

    fn iridescence(&mut self, m: &Source, layers: &mut Layers, maps: &mut LayerMaps) -> Result<(), Fault> {
        let Some(e) = Extension::of(m, "KHR_materials_iridescence") else { return Ok(()) };
        layers.iridescence = self.factor(&e, "iridescenceFactor", 0.0, [0.0, 1.0])?;
        layers.film_ior = self.factor(&e, "iridescenceIor", 1.3, [1.0, f32::MAX])?;
        maps.least_thickness = self.factor(&e, "iridescenceThicknessMinimum", 100.0, [0.0, f32::MAX])?;
        layers.film_thickness = self.factor(&e, "iridescenceThicknessMaximum", 400.0, [0.0, f32::MAX])?;
        maps.iridescence = self.slot(&e, "iridescenceTexture", Encoding::Linear)?;
        maps.film_thickness = self.slot(&e, "iridescenceThicknessTexture", Encoding::Linear)?;
        Ok(())
    }

    fn diffuse_transmission(&mut self, m: &Source, layers: &mut Layers, maps: &mut LayerMaps) -> Result<(), Fault> {
        let Some(e) = Extension::of(m, "KHR_materials_diffuse_transmission") else { return Ok(()) };
        layers.diffuse_transmission = self.factor(&e, "diffuseTransmissionFactor", 0.0, [0.0, 1.0])?;
        layers.diffuse_transmission_color = self.tint(&e, "diffuseTransmissionColorFactor", Rgb::ONE)?;
        maps.diffuse_transmission = self.slot(&e, "diffuseTransmissionTexture", Encoding::Linear)?;
        maps.diffuse_transmission_color = self.slot(&e, "diffuseTransmissionColorTexture", Encoding::Srgb)?;
        Ok(())
    }

    /// Puts the model of speculars and glossiness in the place of metal and roughness, if the material has it, and
    /// returns the alpha of its diffuse factor: a dielectric whose interface has the specular colour for F0 at any
    /// angle of its own (which an infinite index leaves to it), over the diffuse colour.
    pub(super) fn specular_glossiness(&mut self, m: &Source, maps: &mut Maps) -> Result<Option<f32>, Fault> {
        let Some(e) = Extension::of(m, SPECULAR_GLOSSINESS) else { return Ok(None) };
        let diffuse = self.numbers(&e, "diffuseFactor", [1.0; 4])?;
        let glossiness = self.factor(&e, "glossinessFactor", 1.0, [0.0, 1.0])?;
        let of_both = self.slot(&e, "specularGlossinessTexture", Encoding::Srgb)?;
        let [r, g, b, alpha] = diffuse;
        maps.factors = Parameters {
            base_color: self.color(&e.at("diffuseFactor"), Rgb::new(r, g, b), 1.0)?,
            metallic: 0.0,
            roughness: if of_both.is_some() { 1.0 } else { 1.0 - glossiness },
            specular_color: self.tint(&e, "specularFactor", Rgb::ONE)?,
            ior: 0.0,
            ..Parameters { specular: 1.0, ..Parameters::LAMBERT }
        };
        maps.base_color = self.slot(&e, "diffuseTexture", Encoding::Srgb)?;
        maps.metallic_roughness = of_both.as_ref().map(|texture| rough(texture, glossiness));
        maps.specular_color = of_both;
        Ok(Some(alpha))
    }

    fn factor(&mut self, e: &Extension<'_>, member: &str, default: f32, [min, max]: [f32; 2]) -> Result<f32, Fault> {
        let [x] = self.numbers(e, member, [default])?;
        self.number(&e.at(member), x, min, max)
    }

    fn tint(&mut self, e: &Extension<'_>, member: &str, default: Rgb) -> Result<Rgb, Fault> {
        let color = self.numbers(e, member, default.to_array())?;
        self.color(&e.at(member), Rgb::from_array(color), 1.0)
    }

    /// A number, or an array of so many.
    fn numbers<const N: usize>(&self, e: &Extension<'_>, member: &str, default: [f32; N]) -> Result<[f32; N], Fault> {
        let Some(value) = e.members.get(member) else { return Ok(default) };
        let one = std::slice::from_ref(value);
        let all = if N == 1 { Some(one) } else { value.as_array().map(Vec::as_slice) };
        let numbers = all.filter(|all| all.len() == N).and_then(|all| {
            all.iter().map(|x| x.as_f64().map(|x| x as f32)).collect::<Option<Vec<_>>>()?.try_into().ok()
        });
        let what = if N == 1 { "this is no number".to_owned() } else { format!("these are not {N} numbers") };
        numbers.ok_or_else(|| Fault::invalid(format!("{}/{}", self.at, e.at(member)), what))
    }

    fn slot(&mut self, e: &Extension<'_>, member: &str, encoding: Encoding) -> Result<Option<Texture>, Fault> {
        let Some(value) = e.members.get(member) else { return Ok(None) };
        let at = e.at(member);
        let Ok(info) = serde_json::from_value::<Info>(value.clone()) else {
            return Err(Fault::invalid(format!("{}/{at}", self.at), "this is no reference to a texture"));
        };
        self.reference(Some(Reference::from(&info)), encoding, &at)
    }
}

/// Roughness, 1 − glossiness · A, in the channel where metallic-roughness has it.
fn rough(glossy: &Texture, glossiness: f32) -> Texture {
    let (width, height) = glossy.image.size();
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let texels = places.flat_map(|(x, y)| {
        let rough = 1.0 - glossiness * glossy.image.texel(x, y, Encoding::Linear).w;
        [u8::MAX, (rough * 255.0).round() as u8, u8::MAX]
    });
    let image = Image::new(width, height, Texels::U8(texels.collect()));
    Texture { image: Arc::new(image), encoding: Encoding::Linear, ..glossy.clone() }
}
