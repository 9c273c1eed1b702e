//! Materials: what a surface is made of, before it is resolved at a point.

use glam::{Vec2, Vec3, Vec4};

use super::{
    bsdf::{Bsdf, Dielectric, Diffuse, Metal, MetallicRoughness, Passage, ThinDielectric},
    geometry::{Interpolation, Precedence, Role, TangentFrame, lifted},
    layers::LayerMaps,
    texture::Texture,
};
pub use super::{
    geometry::MaterialId,
    parameters::{Boundary, Parameters},
};
use crate::math::Rgb;

/// A surface's scattering, its coverage, its emission, and the absorption of the volume behind it.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name in the file, for messages.
    pub name: String,
    /// The scattering; where there are `maps`, with all of them white.
    pub bsdf: Bsdf,
    /// How much of the surface is there.
    pub alpha_mode: AlphaMode,
    /// Emitted radiance, constant over the front hemisphere; black if the surface is no light. A texture can only
    /// darken it, and so does a coat, by its Fresnel reflectance.
    pub emission: Rgb,
    /// Which sides emit.
    pub emission_sides: EmissionSides,
    /// What becomes of its back faces in a scene that [culls them](super::Scene::culling_back_faces) for the camera.
    pub back_faces: BackFaces,
    /// σ_a of the volume that the surface bounds, 1/m; zero for clear volumes and all other materials.
    pub absorption: Rgb,
    /// 20/V_d of that volume, not negative: see [`Index`](super::wavelength::Index). 0 for one that does not disperse.
    pub dispersion: f32,
    /// What varies over the surface, resolved at each hit; `None` for a material that is the same everywhere.
    pub maps: Option<Box<Maps>>,
}

/// What a material varies over its surface: its parameters as factors, and the textures and vertex colours that
/// multiply them.
#[derive(Clone, Debug)]
pub struct Maps {
    /// The parameters where every texture is white.
    pub factors: Parameters,
    /// RGB: base colour, sRGB. Alpha: coverage.
    pub base_color: Option<Texture>,
    /// G: roughness. B: metallic.
    pub metallic_roughness: Option<Texture>,
    /// R: transmission.
    pub transmission: Option<Texture>,
    /// A: specular.
    pub specular: Option<Texture>,
    /// RGB: specular colour, sRGB.
    pub specular_color: Option<Texture>,
    /// RGB: emission, sRGB.
    pub emission: Option<Texture>,
    /// The normal texture.
    pub normal: Option<NormalMap>,
    /// The textures of the layers, where there are any.
    pub layers: Option<Box<LayerMaps>>,
    /// What the vertex colours multiply.
    pub vertex_colors: VertexColors,
}

/// What the colours at a mesh's vertices multiply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexColors {
    /// Nothing: the mesh has none.
    Nothing,
    /// The base colour.
    BaseColor,
    /// The emission, of a surface that shows its base colour by emitting it.
    Emission,
}

impl Maps {
    /// Maps with these factors that change nothing yet.
    pub fn new(factors: Parameters) -> Self {
        Self {
            factors,
            base_color: None,
            metallic_roughness: None,
            transmission: None,
            specular: None,
            specular_color: None,
            emission: None,
            normal: None,
            layers: None,
            vertex_colors: VertexColors::Nothing,
        }
    }

    /// The parameters at a place.
    pub fn parameters(&self, at: &Interpolation<'_>) -> Parameters {
        let mut p = self.factors;
        if let Some(texture) = &self.base_color {
            p.base_color *= rgb(texture.lookup(at.uv(texture.uv_set)));
        }
        if self.vertex_colors == VertexColors::BaseColor {
            p.base_color *= rgb(at.color());
        }
        if let Some(texture) = &self.metallic_roughness {
            let texel = texture.lookup(at.uv(texture.uv_set));
            p.roughness *= texel.y;
            p.metallic *= texel.z;
        }
        if let Some(texture) = &self.transmission {
            p.transmission *= texture.lookup(at.uv(texture.uv_set)).x;
        }
        if let Some(texture) = &self.specular {
            p.specular *= texture.lookup(at.uv(texture.uv_set)).w;
        }
        if let Some(texture) = &self.specular_color {
            p.specular_color *= rgb(texture.lookup(at.uv(texture.uv_set)));
        }
        if let Some(maps) = &self.layers {
            p.layers = maps.at(&p.layers, at);
        }
        p
    }

    /// The texture along whose u tangents lie where the mesh has none: of the normal, or else of what else needs them.
    pub fn tangent_texture(&self) -> Option<&Texture> {
        let layers = self.layers.as_ref();
        let coat = || layers.and_then(|maps| maps.coat_normal.as_ref());
        let normal = self.normal.as_ref().or_else(coat).map(|map| &map.texture);
        normal.or_else(|| layers.and_then(|maps| maps.anisotropy.as_ref()))
    }

    /// Whether the mesh's tangents count.
    pub fn need_tangents(&self) -> bool {
        let of_coat = self.layers.as_ref().is_some_and(|maps| maps.coat_normal.is_some());
        self.normal.is_some() || of_coat || self.factors.layers.anisotropy > 0.0
    }

    /// What a material's emission is multiplied by at a place, in [0, 1] per channel.
    pub fn emission(&self, at: &Interpolation<'_>) -> Rgb {
        let texel = self.emission.as_ref().map_or(Rgb::ONE, |texture| rgb(texture.lookup(at.uv(texture.uv_set))));
        if self.vertex_colors == VertexColors::Emission { texel * rgb(at.color()) } else { texel }
    }

    /// What a base colour factor's alpha is multiplied by at a place, in [0, 1].
    pub fn alpha(&self, at: &Interpolation<'_>) -> f32 {
        let texel = self.base_color.as_ref().map_or(1.0, |texture| texture.lookup(at.uv(texture.uv_set)).w);
        if self.vertex_colors == VertexColors::Nothing { texel } else { texel * at.color().w }
    }

    /// Whether alpha may vary over the surface.
    pub fn vary_alpha(&self) -> bool {
        self.base_color.is_some() || self.vertex_colors != VertexColors::Nothing
    }

    /// Whether anything varies over the surface at all.
    pub fn vary(&self) -> bool {
        let has_grain = self.factors.layers.anisotropy > 0.0;
        self.textures().next().is_some() || has_grain || self.vertex_colors != VertexColors::Nothing
    }

    /// Every texture of the material.
    pub fn textures(&self) -> impl Iterator<Item = &Texture> {
        let Self { base_color, metallic_roughness, transmission, specular, specular_color, emission, normal, .. } =
            self;
        let normal = normal.as_ref().map(|map| &map.texture);
        let others = [base_color, metallic_roughness, transmission, specular, specular_color, emission];
        let layers = self.layers.iter().flat_map(|maps| maps.textures());
        others.into_iter().flatten().chain(normal).chain(layers)
    }

    /// Whether the emission varies over the surface.
    pub fn vary_emission(&self) -> bool {
        self.emission.is_some() || self.vertex_colors == VertexColors::Emission
    }
}

/// A normal texture with its scale.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// RGB: the normal in the tangent frame, 1/2 for 0.
    pub texture: Texture,
    /// How much the normal is tilted: its x and y are multiplied by this.
    pub scale: f32,
}

impl NormalMap {
    /// N_s at the mesh's texture coordinates `uv`, on the side of the geometric unit normal `n_g`
    /// (glTF 2.0 specification, 3.9.3).
    ///
    /// A mesh whose interpolated normal lies behind N_g shows its front from behind, so all of the normal is turned.
    /// One that the texture tilts below the surface is lifted to the horizon: turned about, it would lean the other
    /// way.
    pub fn shading_normal(&self, uv: Vec2, frame: &TangentFrame, n_g: Vec3) -> Vec3 {
        let texel = self.texture.lookup(uv).truncate();
        let local = (2.0 * texel - 1.0) * Vec3::new(self.scale, self.scale, 1.0);
        let n = frame.tangent * local.x + frame.bitangent * local.y + frame.normal * local.z;
        let side = 1.0_f32.copysign(frame.normal.dot(n_g));
        (side * n).try_normalize().map_or(n_g, |n| lifted(n, n_g))
    }
}

/// How much of a surface is there (glTF `alphaMode`): the fraction α of it that scatters and emits, while rays pass the
/// rest undisturbed. It has nothing to do with transmission, which is scattering by what is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// All of it.
    Opaque,
    /// At each point all or nothing.
    Mask {
        /// The base colour factor's alpha.
        factor: f32,
        /// From which alpha on the surface is there.
        cutoff: f32,
    },
    /// The fraction that alpha says.
    Blend {
        /// The base colour factor's alpha, in [0, 1].
        factor: f32,
    },
}

impl AlphaMode {
    /// α in [0, 1] where texture and vertex colour have the alpha `texel`.
    ///
    /// It is a multiple of 2⁻²⁴, the step of random numbers: a walk stops with probability α exactly, and 1 − α is
    /// exact.
    #[inline]
    pub fn alpha(self, texel: f32) -> f32 {
        const STEPS: f32 = 16_777_216.0;
        match self {
            Self::Opaque => 1.0,
            Self::Mask { factor, cutoff } => {
                if factor * texel >= cutoff {
                    1.0
                } else {
                    0.0
                }
            }
            Self::Blend { factor } => ((factor * texel).clamp(0.0, 1.0) * STEPS).round() / STEPS,
        }
    }
}

/// Which sides of an emitter emit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissionSides {
    /// The front face only: the side of N_g.
    Front,
    /// Both faces (glTF `doubleSided`).
    Both,
}

/// What the camera sees of a surface from behind, where a scene [culls](super::Scene::culling_back_faces).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackFaces {
    /// Nothing: its rays pass (glTF without `doubleSided`).
    Culled,
    /// The same as from the front.
    Drawn,
}

impl Material {
    /// A material with the given scattering that neither emits nor absorbs.
    pub fn new(name: &str, bsdf: Bsdf) -> Self {
        Self {
            name: name.to_owned(),
            bsdf,
            alpha_mode: AlphaMode::Opaque,
            emission: Rgb::ZERO,
            emission_sides: EmissionSides::Front,
            back_faces: BackFaces::Drawn,
            absorption: Rgb::ZERO,
            dispersion: 0.0,
            maps: None,
        }
    }

    /// A material whose parameters vary as `maps` say.
    pub fn varying(name: &str, maps: Maps) -> Self {
        let bsdf = maps.factors.bsdf();
        Self { maps: Some(Box::new(maps)), ..Self::new(name, bsdf) }
    }

    /// α in [0, 1] at a place, which is asked for only if something of the material may be missing there.
    #[inline(always)]
    pub fn alpha<'a>(&self, at: impl FnOnce() -> Interpolation<'a>) -> f32 {
        match (self.alpha_mode, &self.maps) {
            (AlphaMode::Opaque, _) => 1.0,
            (mode, Some(maps)) if maps.vary_alpha() => mode.alpha(maps.alpha(&at())),
            (mode, _) => mode.alpha(1.0),
        }
    }

    /// Whether it emits anything: in some channel neither its factor nor all of its emissive texture is 0.
    pub fn emits(&self) -> bool {
        self.brightest() != Rgb::ZERO
    }

    /// A bound on the emitted radiance in each channel: the factor times the greatest texel.
    pub fn brightest(&self) -> Rgb {
        let texture = self.maps.as_ref().and_then(|maps| maps.emission.as_ref());
        texture.map_or(self.emission, |texture| self.emission * rgb(texture.extremes()[1]))
    }

    /// The index of refraction of the volume that its surfaces bound; `None` if there is no volume.
    pub fn volume_ior(&self) -> Option<f32> {
        match (&self.maps, self.bsdf) {
            (Some(maps), _) => (maps.factors.boundary == Boundary::Volume).then_some(maps.factors.ior),
            (None, Bsdf::Dielectric(boundary)) => Some(boundary.ior),
            (None, Bsdf::Layered(layered)) => layered.volume_ior(),
            (None, _) => None,
        }
    }

    /// The measured metal that it is of, if any.
    pub fn measured_metal(&self) -> Option<Metal> {
        match &self.bsdf {
            Bsdf::Layered(layered) => layered.surface().measured,
            _ => None,
        }
    }

    /// The BSDF at a place, as it is against empty space.
    pub fn bsdf_at<'a>(&self, at: impl FnOnce() -> Interpolation<'a>) -> Bsdf {
        self.maps.as_ref().map_or(self.bsdf, |maps| maps.parameters(&at()).bsdf())
    }

    /// What it is among coincident surfaces.
    pub fn role(&self) -> Role {
        let transmits = match &self.maps {
            Some(maps) => maps.factors.boundary == Boundary::Thin && maps.factors.transmission > 0.0,
            None => match &self.bsdf {
                Bsdf::Thin(_) => true,
                Bsdf::Layered(layered) => matches!(layered.surface().passage, Passage::Wall(_)),
                _ => false,
            },
        };
        let bounds_volume = match &self.maps {
            Some(maps) => maps.factors.boundary == Boundary::Volume,
            None => self.bsdf.bounds_volume(),
        };
        let precedence = match (self.emits(), transmits || bounds_volume) {
            (true, _) => Precedence::Emitter,
            (_, true) => Precedence::Transmitting,
            _ => Precedence::Opaque,
        };
        Role { precedence, bounds_volume }
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

    /// The same material, there to the extent of `coverage`.
    #[must_use]
    pub fn covering(mut self, mode: AlphaMode) -> Self {
        self.alpha_mode = mode;
        self
    }

    /// The same material, emitting `radiance` from its front face.
    #[must_use]
    pub fn emitting(mut self, radiance: Rgb) -> Self {
        self.emission = radiance;
        self
    }
}

/// A texel or a vertex colour without its alpha.
#[inline]
fn rgb(rgba: Vec4) -> Rgb {
    rgba.truncate().into()
}
