//! What shines: a source of light by itself, and which sources the primitives of emissive materials are.

use std::{collections::HashMap, sync::Arc};

use glam::Vec3;

use super::{
    choice::Family,
    emission::{Detail, EmissionMap},
    environment::EnvironmentMap,
    goniometric::Goniometric,
    spot::Spot,
};
use crate::{
    math::{Rgb, luminance},
    scene::{
        geometry::{Geometry, MeshId, PrimitiveId},
        id::LightId,
        material::{EmissionSides, Material},
        point::{Place, Point},
    },
};

/// A source of light.
#[derive(Clone, Debug)]
pub enum Light {
    /// A primitive each of whose points emits the same radiance (W/(m² sr) or nit) into every direction of its emitting
    /// sides, [`Point::emission`], less what a coat over it takes.
    Area {
        /// The primitive.
        primitive: PrimitiveId,
        /// L_e; of a textured primitive its mean, and under a coat its cosine-weighted mean over the hemisphere. A coat
        /// counts as if its texture were white.
        radiance: Rgb,
        /// Which sides emit, with respect to N_g.
        sides: EmissionSides,
        /// The primitive's area, m².
        area: f32,
        /// Where on it how much is emitted; `None` if it is the same everywhere. Instances of a mesh share it.
        map: Option<Arc<EmissionMap>>,
    },
    /// An isotropic point light. Never seen directly.
    Point {
        /// Where it is.
        position: Vec3,
        /// Intensity, W/sr or candela.
        intensity: Rgb,
    },
    /// A point that shines into a cone. Never seen directly.
    Spot(Spot),
    /// A point that shines as a table over directions says. Never seen directly.
    Goniometric(Arc<Goniometric>),
    /// A sun: parallel light. Never seen directly.
    Directional {
        /// The unit direction *towards* the light.
        towards: Vec3,
        /// Irradiance on a plane that faces the light, W/m² or lux.
        irradiance: Rgb,
    },
    /// The same radiance from every direction in which a ray leaves the scene.
    Environment {
        /// L_e.
        radiance: Rgb,
    },
    /// Radiance by the direction in which a ray leaves the scene.
    EnvironmentMap(Arc<EnvironmentMap>),
}

impl Light {
    /// What it emits in the unit direction `w` if it is no surface: see [`Lights::le`](super::Lights::le). `position`
    /// is that of its point, for an environment the direction to it.
    #[inline(always)]
    pub(super) fn le_off_surfaces(&self, position: [f32; 3], w: [f32; 3]) -> Rgb {
        match self {
            Self::Area { .. } => Rgb::ZERO,
            Self::Point { intensity, .. } => *intensity,
            Self::Spot(spot) => spot.intensity_towards(w.into()),
            Self::Goniometric(lamp) => lamp.intensity_towards(w.into()),
            Self::Directional { irradiance, .. } => *irradiance,
            Self::Environment { radiance } => *radiance,
            Self::EnvironmentMap(map) => map.radiance(position.into()),
        }
    }

    /// Whether a ray can meet it: a surface or an environment, not a point, a spot or a sun.
    #[inline(always)]
    pub fn has_extent(&self) -> bool {
        matches!(self.family(), Family::Surface | Family::Environment)
    }

    /// Whether it is not infinitely far away.
    pub(super) fn has_a_place(&self) -> bool {
        matches!(self.family(), Family::Surface | Family::Lamp)
    }

    /// The luminance of its (mean) radiance or its intensity; zero for infinite lights.
    pub(super) fn brightness(&self) -> f32 {
        match self {
            Self::Area { radiance, .. } => luminance(*radiance),
            Self::Point { intensity, .. } => luminance(*intensity),
            Self::Spot(spot) => luminance(spot.intensity()),
            Self::Goniometric(lamp) => luminance(lamp.peak()),
            Self::Directional { .. } | Self::Environment { .. } | Self::EnvironmentMap(_) => 0.0,
        }
    }

    #[inline(always)]
    pub(super) fn family(&self) -> Family {
        match self {
            Self::Area { .. } => Family::Surface,
            Self::Point { .. } | Self::Spot(_) | Self::Goniometric(_) => Family::Lamp,
            Self::Directional { .. } => Family::Sun,
            Self::Environment { .. } | Self::EnvironmentMap(_) => Family::Environment,
        }
    }
}

/// The maps that instances share, by mesh and triangle; `None` where a triangle is black.
pub(super) type SharedMaps = HashMap<(MeshId, u32), Option<Arc<EmissionMap>>>;

/// The light that a primitive of an emissive material is; `None` if its texture is black all over.
///
/// Whether it is one depends on its mesh alone, not on where an instance puts it.
pub(super) fn emitter(
    geometry: &Geometry,
    materials: &[Material],
    primitive: PrimitiveId,
    detail: Detail,
    shared: &mut SharedMaps,
) -> Option<Light> {
    let material = &materials[geometry.material(primitive).0 as usize];
    let passed = material.bsdf.mean_emission_factor();
    let area = Light::Area {
        primitive,
        radiance: material.emission * passed,
        sides: material.emission_sides,
        area: geometry.area(primitive),
        map: None,
    };
    let Some(maps) = material.maps.as_ref().filter(|maps| maps.vary_emission()) else { return Some(area) };
    let new = || EmissionMap::new(geometry, primitive, material, maps, detail).map(Arc::new);
    let found = match primitive.instance() {
        Some(n) => shared.entry((geometry.mesh_of(n), primitive.index())).or_insert_with(new).clone(),
        None => new(),
    }?;
    let Light::Area { primitive, sides, area, .. } = area else { return None };
    let radiance = found.mean() * passed;
    Some(Light::Area { primitive, radiance, sides, area, map: (!geometry.is_sphere(primitive)).then_some(found) })
}

/// The point of the light `id` that has a place and nothing else.
pub(super) fn without_extent(position: Vec3, id: LightId) -> Point {
    Point { place: Place::Degenerate, light: Some(id), ..Point::nowhere(position) }
}

/// The infinite point of the light `id` in the unit direction `w`.
pub(super) fn at_infinity(w: Vec3, id: LightId) -> Point {
    Point { place: Place::Infinite, light: Some(id), ..Point::nowhere(w) }
}

impl EmissionSides {
    /// Those of all the lights, if all have an area and the same sides of it emit.
    pub(super) fn of_all(lights: &[Light]) -> Option<Self> {
        let sides = |light: &Light| if let Light::Area { sides, .. } = light { Some(*sides) } else { None };
        let first = sides(lights.first()?)?;
        lights.iter().all(|light| sides(light) == Some(first)).then_some(first)
    }

    /// How many sides emit.
    pub(super) fn count(self) -> f32 {
        match self {
            Self::Front => 1.0,
            Self::Both => 2.0,
        }
    }
}
