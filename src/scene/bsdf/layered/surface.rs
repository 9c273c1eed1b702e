//! The parameters of a layered surface at a point.

use glam::Vec2;

use super::Metal;
use crate::math::Rgb;

/// What a layered surface is made of, from the outside in: fuzz or sheen, coat, and the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The metal's reflectance at normal incidence, the diffuse base's albedo, and the tint of what is clear.
    pub base_color: Rgb,
    /// Reflectance of the dielectric's interface at normal incidence.
    pub f0: Rgb,
    /// And at grazing incidence.
    pub f90: f32,
    /// The fraction of metal.
    pub metallic: f32,
    /// GGX's α of the base, across the grain.
    pub alpha: f32,
    /// How rough the diffuse base is, in [0, 1].
    pub diffuse_roughness: f32,
    /// How much of a coat there is, in [0, 1].
    pub coat: f32,
    /// GGX's α of the coat.
    pub coat_alpha: f32,
    /// Reflectance of the coat at normal incidence.
    pub coat_f0: f32,
    /// What the coat lets pass of light that crosses it twice along its normal.
    pub coat_color: Rgb,
    /// How much of the light that goes to and fro under the coat is absorbed by the base, in [0, 1].
    pub coat_darkening: f32,
    /// x and y of the coat's unit normal in the shading frame.
    pub coat_normal: Vec2,
    /// Whether it is N_g or nearly so, over which light travels without being bent as it is over N_s.
    pub coat_is_flat: bool,
    /// Where the light begins that the surface emits.
    pub emission: Emission,
    /// The sheen's colour, or the fuzz's times how much of it there is.
    pub sheen: Rgb,
    /// The sheen's α.
    pub sheen_alpha: f32,
    /// Where it lies.
    pub sheen_place: SheenPlace,
    /// How much of a thin film there is, in [0, 1].
    pub film: f32,
    /// The film's index of refraction.
    pub film_ior: f32,
    /// The film's thickness, nanometres.
    pub film_thickness: f32,
    /// The strength of the grain, in [0, 1]: along it α is mix(α, 1, strength²).
    pub anisotropy: f32,
    /// The angle of the grain from the shading frame's first axis to its second.
    pub tangent: f32,
    /// Whether and how light passes the base.
    pub passage: Passage,
    /// The metal that the base is all of, if it is a measured one: base colour, F0, F90 and the fraction of metal then
    /// do not count.
    pub measured: Option<Metal>,
}

/// How light passes to the other side of the base, of that part which is no metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Passage {
    /// It does not.
    None,
    /// Diffusely, as through a leaf.
    Leaf {
        /// The fraction of the diffuse base that lets light through.
        fraction: f32,
        /// The tint of that light.
        color: Rgb,
    },
    /// Through a clear thin wall, layers on both sides of it.
    Wall(Clear),
    /// Through the clear boundary of a volume behind the surface, which has its layers in front.
    Volume(Clear),
}

/// A clear boundary, tinted by the base colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clear {
    /// The fraction of the dielectric that is clear. The rest is diffuse.
    pub fraction: f32,
    /// The index of refraction behind the surface, relative to that in front of it.
    pub ior: f32,
}

impl Clear {
    /// Reflectance at normal incidence, as the index has it.
    pub(super) fn f0(self) -> f32 {
        let r = (self.ior - 1.0) / (self.ior + 1.0);
        r * r
    }
}

/// Where a sheen lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SheenPlace {
    /// Under the coat, where it hides what lies below as its brightest channel is bright (`KHR_materials_sheen`).
    UnderCoat,
    /// Over all else (`KHR_materials_fuzz`).
    OverAll {
        /// How much of it there is, in [0, 1], whatever its colour.
        cover: f32,
    },
}

/// Where the light begins that a surface emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Emission {
    /// Below the coat, which darkens it (`KHR_materials_clearcoat`).
    UnderCoat,
    /// Over all layers (`KHR_materials_coat`).
    OverAll,
}

impl Surface {
    /// A white Lambertian base under no layer.
    pub const LAMBERT: Self = Self {
        base_color: Rgb::ONE,
        f0: Rgb::ZERO,
        f90: 0.0,
        metallic: 0.0,
        alpha: 1.0,
        diffuse_roughness: 0.0,
        coat: 0.0,
        coat_alpha: 0.0,
        coat_f0: 0.04,
        coat_color: Rgb::ONE,
        coat_darkening: 0.0,
        coat_normal: Vec2::ZERO,
        coat_is_flat: true,
        emission: Emission::UnderCoat,
        sheen: Rgb::ZERO,
        sheen_alpha: 0.0,
        sheen_place: SheenPlace::UnderCoat,
        film: 0.0,
        film_ior: 1.3,
        film_thickness: 0.0,
        anisotropy: 0.0,
        tangent: 0.0,
        passage: Passage::None,
        measured: None,
    };

    /// The same, with a measured metal's parameters in their places.
    pub(super) fn settled(self) -> Self {
        let Some(metal) = self.measured else { return self };
        Self { base_color: metal.reflectance(1.0), f0: Rgb::ZERO, f90: 0.0, metallic: 1.0, ..self }
    }

    /// The clear boundary, if it has one.
    pub(super) fn clear(&self) -> Option<Clear> {
        match self.passage {
            Passage::Wall(clear) | Passage::Volume(clear) => Some(clear),
            Passage::None | Passage::Leaf { .. } => None,
        }
    }

    /// The fraction of the dielectric that is clear.
    pub(super) fn clear_fraction(&self) -> f32 {
        self.clear().map_or(0.0, |clear| clear.fraction)
    }

    /// The fraction of the sheen's albedo that is missing below it.
    pub(super) fn sheen_cover(&self) -> f32 {
        match self.sheen_place {
            SheenPlace::UnderCoat => self.sheen.max_element(),
            SheenPlace::OverAll { cover } => cover,
        }
    }

    /// Whether a volume lies behind the surface.
    pub(super) fn bounds_volume(&self) -> bool {
        matches!(self.passage, Passage::Volume(_))
    }
}
