//! A point of the scene: where a path may scatter, start or end.

use glam::Vec3;

use super::{bsdf::Bsdf, geometry::PrimitiveId, light::LightId, material::MaterialId};

/// What kind of place a point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On a surface (or on the lens, whose plane counts as one).
    Surface,
    /// Without a normal (point light): cosines there count as 1.
    Degenerate,
    /// Infinitely far away (environment, sun): `position` is the unit direction towards it, dA becomes dω.
    Infinite,
}

/// A point of the scene with everything about it that does not depend on a path. World space, metres.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// The position; of an infinite point, the unit direction towards it.
    pub position: Vec3,
    /// N_g, unit: of a triangle by its winding (the front face), of a sphere outward, of the lens the viewing direction.
    pub normal: Vec3,
    /// N_s, unit, on the side of N_g.
    pub shading_normal: Vec3,
    /// A bound on the rounding error of each coordinate of `position`.
    pub error: f32,
    /// The kind of place.
    pub place: Place,
    /// The primitive it lies on, [`PrimitiveId::NONE`] if on none.
    pub primitive: PrimitiveId,
    /// The material of that primitive; meaningless where there is none.
    pub material: MaterialId,
    /// The light that emits here, if any.
    pub light: Option<LightId>,
    /// The BSDF here; black where there is no surface.
    pub bsdf: Bsdf,
}
