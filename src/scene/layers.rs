//! The layers of a surface: their parameters at one place, and what varies them over the surface.

use glam::{Vec2, Vec3};

use super::{
    bsdf::Metal,
    geometry::{Interpolation, TangentFrame},
    material::NormalMap,
    texture::Texture,
};
use crate::math::{Frame, Rgb};

/// The parameters of the extensions that add lobes to glTF's metallic-roughness model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layers {
    /// clearcoat, in [0, 1].
    pub coat: f32,
    /// clearcoatRoughness, in [0, 1]; GGX's α is its square.
    pub coat_roughness: f32,
    /// x and y of the coat's unit normal in the frame around N_s.
    pub coat_normal: Vec2,
    /// Whether that is the mesh's normal, and no texture's.
    pub coat_is_flat: bool,
    /// What the coat has of its own, if it is one of `KHR_materials_coat`.
    pub coating: Option<Coating>,
    /// sheenColor or fuzzColor, in [0, 1].
    pub sheen: Rgb,
    /// fuzz, in [0, 1]: how much there is, if that is what it is.
    pub fuzz: Option<f32>,
    /// sheenRoughness or fuzzRoughness, in [0, 1]; the sheen's α is its square.
    pub sheen_roughness: f32,
    /// anisotropyStrength, in [0, 1].
    pub anisotropy: f32,
    /// The direction of the grain: along tangent and bitangent, and once [oriented](LayerMaps::orient) in the frame
    /// around N_s.
    pub grain: Vec2,
    /// iridescence, in [0, 1].
    pub iridescence: f32,
    /// The thin film's index of refraction, at least 1.
    pub film_ior: f32,
    /// Its thickness, nanometres.
    pub film_thickness: f32,
    /// diffuseRoughness, in [0, 1].
    pub diffuse_roughness: f32,
    /// diffuseTransmission, in [0, 1].
    pub diffuse_transmission: f32,
    /// diffuseTransmissionColor, in [0, 1].
    pub diffuse_transmission_color: Rgb,
    /// The measured metal that the base is all of, whatever its colour and its metallic are.
    pub metal: Option<Metal>,
}

/// What a coat of `KHR_materials_coat` has beyond that of `KHR_materials_clearcoat`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coating {
    /// coatIor, at least 1, or 0 for a coat that reflects everything.
    pub ior: f32,
    /// coatColor, in [0, 1].
    pub color: Rgb,
    /// coatDarkening, in [0, 1].
    pub darkening: f32,
}

impl Coating {
    /// That of `KHR_materials_clearcoat`.
    pub const CLEAR: Self = Self { ior: 1.5, color: Rgb::ONE, darkening: 0.0 };
}

impl Layers {
    /// No layers.
    pub const NONE: Self = Self {
        coat: 0.0,
        coat_roughness: 0.0,
        coat_normal: Vec2::ZERO,
        coat_is_flat: true,
        coating: None,
        sheen: Rgb::ZERO,
        fuzz: None,
        sheen_roughness: 0.0,
        anisotropy: 0.0,
        grain: Vec2::X,
        iridescence: 0.0,
        film_ior: 1.3,
        film_thickness: 400.0,
        diffuse_roughness: 0.0,
        diffuse_transmission: 0.0,
        diffuse_transmission_color: Rgb::ONE,
        metal: None,
    };

    /// Whether there are any, which is known of the factors: what is zero there stays so.
    pub fn are_there(&self) -> bool {
        let amounts = [self.coat, self.anisotropy, self.iridescence, self.diffuse_transmission, self.diffuse_roughness];
        let sheen = self.fuzz.unwrap_or(self.sheen.max_element());
        self.metal.is_some() || sheen > 0.0 || amounts.into_iter().any(|amount| amount > 0.0)
    }
}

/// The textures of the layers: each multiplies its factor.
#[derive(Clone, Debug, Default)]
pub struct LayerMaps {
    /// R: clearcoat.
    pub coat: Option<Texture>,
    /// G: clearcoatRoughness.
    pub coat_roughness: Option<Texture>,
    /// The coat's own normal texture. Without one its normal is the mesh's.
    pub coat_normal: Option<NormalMap>,
    /// RGB: coatColor, sRGB.
    pub coat_color: Option<Texture>,
    /// RGB: sheenColor or fuzzColor, sRGB.
    pub sheen_color: Option<Texture>,
    /// A: sheenRoughness or fuzzRoughness.
    pub sheen_roughness: Option<Texture>,
    /// R: fuzz.
    pub fuzz: Option<Texture>,
    /// R: diffuseRoughness.
    pub diffuse_roughness: Option<Texture>,
    /// R and G: the direction of the grain along tangent and bitangent, 1/2 for 0. B: anisotropyStrength.
    pub anisotropy: Option<Texture>,
    /// R: iridescence.
    pub iridescence: Option<Texture>,
    /// G: from the film's least thickness to its greatest, the factor.
    pub film_thickness: Option<Texture>,
    /// The least thickness, nanometres.
    pub least_thickness: f32,
    /// A: diffuseTransmission.
    pub diffuse_transmission: Option<Texture>,
    /// RGB: diffuseTransmissionColor, sRGB.
    pub diffuse_transmission_color: Option<Texture>,
}

impl LayerMaps {
    /// Every texture.
    pub fn textures(&self) -> impl Iterator<Item = &Texture> {
        let all = [
            &self.coat,
            &self.coat_roughness,
            &self.coat_color,
            &self.sheen_color,
            &self.sheen_roughness,
            &self.fuzz,
            &self.diffuse_roughness,
            &self.anisotropy,
            &self.iridescence,
            &self.film_thickness,
            &self.diffuse_transmission,
            &self.diffuse_transmission_color,
        ];
        all.into_iter().flatten().chain(self.coat_normal.as_ref().map(|map| &map.texture))
    }

    /// The layers at a place, from their factors.
    pub fn at(&self, factors: &Layers, at: &Interpolation<'_>) -> Layers {
        let lookup = |texture: &Option<Texture>| texture.as_ref().map(|texture| texture.lookup(at.uv(texture.uv_set)));
        let mut layers = *factors;
        if let Some(texel) = lookup(&self.coat) {
            layers.coat *= texel.x;
        }
        if let Some(texel) = lookup(&self.coat_roughness) {
            layers.coat_roughness *= texel.y;
        }
        if let Some(texel) = lookup(&self.sheen_color) {
            layers.sheen *= Rgb::from(texel.truncate());
        }
        if let Some(texel) = lookup(&self.sheen_roughness) {
            layers.sheen_roughness *= texel.w;
        }
        if let Some((coating, texel)) = layers.coating.as_mut().zip(lookup(&self.coat_color)) {
            coating.color *= Rgb::from(texel.truncate());
        }
        if let Some((fuzz, texel)) = layers.fuzz.as_mut().zip(lookup(&self.fuzz)) {
            *fuzz *= texel.x;
        }
        if let Some(texel) = lookup(&self.diffuse_roughness) {
            layers.diffuse_roughness *= texel.x;
        }
        if let Some(texel) = lookup(&self.anisotropy) {
            layers.anisotropy *= texel.z;
            let direction = 2.0 * Vec2::new(texel.x, texel.y) - 1.0;
            layers.grain = layers.grain.rotate(direction.normalize_or(Vec2::X));
        }
        if let Some(texel) = lookup(&self.iridescence) {
            layers.iridescence *= texel.x;
        }
        if let Some(texel) = lookup(&self.film_thickness) {
            layers.film_thickness = self.least_thickness + (factors.film_thickness - self.least_thickness) * texel.y;
        }
        if let Some(texel) = lookup(&self.diffuse_transmission) {
            layers.diffuse_transmission *= texel.w;
        }
        if let Some(texel) = lookup(&self.diffuse_transmission_color) {
            layers.diffuse_transmission_color *= Rgb::from(texel.truncate());
        }
        layers
    }

    /// Puts what has a direction into the frame around N_s: `n_s`, where the mesh alone has the shading normal `mesh`
    /// over the geometric `n_g`. Without tangents there is no grain: the frame's own axis stands in for it.
    pub fn orient(
        &self,
        layers: &mut Layers,
        at: &Interpolation<'_>,
        tangents: Option<&TangentFrame>,
        [n_s, mesh, n_g]: [Vec3; 3],
    ) {
        let around = Frame::around(n_s);
        if layers.coat > 0.0 {
            let mapped = self.coat_normal.as_ref().zip(tangents);
            layers.coat_is_flat = mapped.is_none();
            let normal = mapped.map_or(mesh, |(map, frame)| map.shading_normal(at.uv(map.texture.uv_set), frame, n_g));
            let local = around.to_local(normal);
            layers.coat_normal = if normal == n_s { Vec2::ZERO } else { local.truncate() };
        }
        if let Some(frame) = tangents.filter(|_| layers.anisotropy > 0.0) {
            let bitangent = frame.bitangent.normalize_or_zero();
            let grain = frame.tangent.normalize_or_zero() * layers.grain.x + bitangent * layers.grain.y;
            layers.grain = around.to_local(grain).truncate().normalize_or(Vec2::X);
        }
    }
}
