//! A point of the scene: where a path may scatter, start or end.

use glam::{Vec2, Vec3};

use super::{
    alpha::left_by_others,
    bsdf::{Bsdf, Diffuse},
    geometry::{Geometry, PrimitiveId, Surface, offset_origin},
    id::{LightId, MediumId},
    material::{Maps, Material, MaterialId},
};
use crate::math::Rgb;

/// What kind of place a point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On a surface (or on the lens, whose plane counts as one).
    Surface,
    /// Without a normal (point light): cosines there count as 1.
    Degenerate,
    /// Infinitely far away (environment, sun): `position` is the unit direction towards it, dA becomes dω.
    Infinite,
    /// On the film of an orthographic camera, which sees along `normal` alone. As with a sun, that direction is what
    /// counts, and G has neither cosine nor distance there; `position` is where on the film.
    Film,
}

/// A point of the scene with everything about it that does not depend on a path. World space, metres.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// The position; of an infinite point, the unit direction towards it.
    pub position: Vec3,
    /// N_g, unit: of a triangle by its winding (the front face), of a sphere outward, of the lens the viewing
    /// direction.
    pub normal: Vec3,
    /// N_s, unit, on the side of N_g and not lower than [`STEEPEST`](super::geometry::STEEPEST) over its horizon.
    pub shading_normal: Vec3,
    /// A bound on the rounding error of each coordinate of `position`.
    pub error: f32,
    /// The kind of place.
    pub place: Place,
    /// The primitive it lies on, [`PrimitiveId::NONE`] if on none.
    pub primitive: PrimitiveId,
    /// The material of that primitive; meaningless where there is none.
    pub material: MaterialId,
    /// The media in front of the surface, on N_g's side, and behind it, as the walk knows them that has come here: see
    /// [`super::media::Inside`]. Empty space for points that no walk has found.
    pub media: [MediumId; 2],
    /// The light that emits here, if any.
    pub light: Option<LightId>,
    /// α: how much of the surface is there, in [0, 1], after what coincident surfaces leave of it; 1 where there is no
    /// surface. f and L_e of a path's vertex carry it, and V the 1 − α of what a segment crosses.
    pub alpha: f32,
    /// The BSDF here; black where there is no surface.
    pub bsdf: Bsdf,
    /// The radiance that the material emits here from its emitting sides; zero where there is no surface.
    pub emission: Rgb,
    /// Barycentric coordinates of a triangle's second and third corner; zero elsewhere.
    pub barycentric: Vec2,
}

impl Point {
    /// The point of a primitive's surface, its material resolved.
    #[inline(always)]
    pub fn on_surface(
        geometry: &Geometry,
        materials: &[Material],
        primitive: PrimitiveId,
        surface: &Surface,
        light: Option<LightId>,
    ) -> Self {
        let id = geometry.material(primitive);
        let material = &materials[id.0 as usize];
        let mut point = Self {
            position: surface.position,
            normal: surface.normal,
            shading_normal: surface.shading_normal,
            error: surface.error,
            place: Place::Surface,
            primitive,
            material: id,
            media: [MediumId::EMPTY; 2],
            light,
            alpha: material.alpha(|| geometry.attributes(primitive, surface.barycentric)),
            bsdf: material.bsdf,
            emission: material.emission,
            barycentric: surface.barycentric,
        };
        if let Some(maps) = &material.maps {
            point.resolve(geometry, maps, surface);
        }
        if geometry.may_be_hidden(primitive) {
            point.alpha *= left_by_others(geometry, materials, primitive, surface.position);
        }
        point
    }

    /// Puts what varies over the surface in place of the material's constants.
    #[inline(never)]
    fn resolve(&mut self, geometry: &Geometry, maps: &Maps, surface: &Surface) {
        let at = geometry.attributes(self.primitive, surface.barycentric);
        self.bsdf = maps.parameters(&at).bsdf();
        if maps.vary_emission() {
            self.emission *= maps.emission(&at);
        }
        if let Some(map) = &maps.normal
            && let Some(frame) = geometry.tangent_frame(self.primitive, surface)
        {
            self.shading_normal = map.shading_normal(at.uv(map.texture.uv_set), &frame, self.normal);
        }
    }

    /// A black point without surface at `position`.
    #[inline(always)]
    pub fn nowhere(position: Vec3) -> Self {
        Self {
            position,
            normal: Vec3::Z,
            shading_normal: Vec3::Z,
            error: 0.0,
            place: Place::Degenerate,
            primitive: PrimitiveId::NONE,
            material: MaterialId(u32::MAX),
            media: [MediumId::EMPTY; 2],
            light: None,
            alpha: 1.0,
            bsdf: Bsdf::Diffuse(Diffuse { albedo: Rgb::ZERO }),
            emission: Rgb::ZERO,
            barycentric: Vec2::ZERO,
        }
    }

    /// Where a ray in direction `w` (of any length) has to start so as not to meet the surface it leaves.
    #[inline(always)]
    pub fn ray_origin(&self, w: Vec3) -> Vec3 {
        if self.primitive == PrimitiveId::NONE {
            self.position
        } else {
            offset_origin(self.position, self.normal, self.error, w)
        }
    }

    /// Whether one of two points lies in the plane of the other's surface, as far as their errors tell.
    #[inline(always)]
    pub fn is_in_one_plane_with(&self, other: &Self) -> bool {
        let to = other.position - self.position;
        // The components of a unit vector add up to √3 at most. Errors are several ε of the positions, and so cover
        // that of N_g.
        let slack = 1.75 * (self.error + other.error);
        let [own, others] = [self, other].map(|p| p.normal.dot(to).abs() <= slack);
        (own || others) && {
            let finite = |p: &Self| matches!(p.place, Place::Surface | Place::Degenerate);
            let has_plane = |p: &Self| p.place == Place::Surface;
            finite(self) && finite(other) && (own && has_plane(self) || others && has_plane(other))
        }
    }

    /// The medium into which the direction `w` leads.
    #[inline]
    pub fn medium_towards(&self, w: Vec3) -> MediumId {
        let [front, behind] = self.media;
        if self.normal.dot(w) < 0.0 { behind } else { front }
    }

    /// Whether N_s is N_g, as on all flat surfaces: the common case, for which [`Tilt`](super::tilt::Tilt) has nothing
    /// to do.
    #[inline(always)]
    pub fn is_flat(&self) -> bool {
        self.normal == self.shading_normal
    }
}
