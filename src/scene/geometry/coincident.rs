//! Coincident surfaces: faces of different triangles that lie in one plane, closer to each other than their rounding
//! errors, and overlap.
//!
//! No ray can tell which of them comes first, and roundings would decide another way for rays of another direction. So
//! one rule says which surface is there: the one of the first [`Rank`]. It is asked at a place, without any direction,
//! so that camera rays, light paths and sampled points get the same answer.
//!
//! [`Geometry::find_coincident`] finds where triangles overlap, as some boxes for each triangle that has a coincident
//! one. Elsewhere a place costs a look at these boxes. Within one, a short segment along the triangle's normal finds
//! the others.

mod find;

use std::ops::ControlFlow;

use glam::{Vec2, Vec3};

use super::{Bounds, Geometry, Hit, PrimitiveId, Ray, Surface};
use crate::lanes::{Float, Lanes};

/// Which of coincident surfaces is there rather than others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Precedence {
    /// What emits, so that a lamp flush with a ceiling shines.
    Emitter,
    /// What lets no light through where it is.
    Opaque,
    /// What transmits. It comes last, so that no light gets through the table that a glass stands on.
    Transmitting,
}

/// What a material is among coincident surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Role {
    /// Whether it is there rather than others.
    pub precedence: Precedence,
    /// Whether it bounds a volume. Two such surfaces never hide each other: a hidden boundary would leave its volume
    /// open.
    pub bounds_volume: bool,
}

/// The order in which coincident surfaces are there: by precedence, then by id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rank(Precedence, PrimitiveId);

/// The plane of a triangle that something may coincide with, near a point of it.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    primitive: PrimitiveId,
    position: Vec3,
}

/// Of a geometry with coincident surfaces: where they are.
#[derive(Clone, Debug)]
pub(super) struct Coincident {
    /// By material.
    roles: Vec<Role>,
    /// Where triangles of the world are hidden. Those of instances have several places, and may be hidden everywhere if
    /// they are somewhere.
    world: Hidden,
    /// No two coincident surfaces are further apart, m.
    reach: f32,
}

/// Whether a triangle shares its place with others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Sharing {
    /// Nothing coincides with it.
    Alone,
    /// Something coincides with a part of it, and comes after it in the order of ranks.
    First,
    /// Something that coincides with a part of it comes before it.
    Hidden,
}

/// Of the world's triangles that are hidden somewhere: by triangle, boxes around all places where they may be.
#[derive(Clone, Debug)]
struct Hidden(Vec<(u32, Bounds)>);

impl Hidden {
    fn may_be_at(&self, index: u32, p: Vec3) -> bool {
        let start = self.0.partition_point(|(i, _)| *i < index);
        let own = self.0[start..].iter().take_while(|(i, _)| *i == index);
        own.into_iter().any(|(_, b)| p.cmpge(b.min).all() && p.cmple(b.max).all())
    }
}

/// How far apart the planes of coincident surfaces may be, in units of the larger bound on the error along the normal.
/// A ray's origin is moved by 9/7 of that at most (the error and two floats: [`super::offset_origin`]), and must not
/// get behind a surface that counts as another one.
const OFFSET: f32 = 9.0 / 7.0;
/// What is found coincident when the scene is built stays so wherever it is asked later, whatever is rounded in
/// between.
const MARGIN: f32 = 1.5;
/// Planes whose normals differ by more do not coincide, wherever they cross: cos 25°.
const PARALLEL: f32 = 0.9;

impl Geometry {
    /// Whether any surfaces coincide.
    #[inline(always)]
    pub fn has_coincident(&self) -> bool {
        self.coincident.is_some()
    }

    /// Whether another surface may coincide with a part of this primitive. Never so for spheres.
    #[inline(always)]
    pub fn may_coincide(&self, primitive: PrimitiveId) -> bool {
        self.sharing(primitive) != Sharing::Alone
    }

    /// Whether another surface that coincides with this primitive somewhere may come before it.
    #[inline(always)]
    pub fn may_be_hidden(&self, primitive: PrimitiveId) -> bool {
        self.sharing(primitive) == Sharing::Hidden
    }

    /// Whether another surface that coincides with this primitive at `position` may come before it.
    #[inline(never)]
    pub fn may_be_hidden_at(&self, primitive: PrimitiveId, position: Vec3) -> bool {
        match (&self.coincident, primitive.instance()) {
            (None, _) => false,
            (Some(found), None) => found.world.may_be_at(primitive.index, position),
            (Some(_), Some(_)) => self.may_be_hidden(primitive),
        }
    }

    /// Whether a ray that leaves `left` meets nothing before what it hits first: nothing that coincides comes before
    /// that, and it is not in the plane that the ray leaves. False also where that takes a closer look.
    #[inline(always)]
    pub fn is_met_first(&self, ray: &Ray, left: PrimitiveId, hit: &Hit) -> bool {
        let sharing = self.sharing(hit.primitive);
        if sharing == Sharing::Alone {
            return true;
        }
        if sharing == Sharing::Hidden && self.may_be_hidden_at(hit.primitive, self.surface(ray, hit).position) {
            return false;
        }
        !self.may_be_in_plane(left, hit.t, ray.direction)
    }

    /// Whether what a segment between places on two primitives crosses may be in the plane of one of them.
    #[inline(always)]
    pub fn may_be_in_plane_of_end(&self, ray: &Ray, [a, b]: [PrimitiveId; 2], hit: &Hit) -> bool {
        self.may_coincide(hit.primitive)
            && (self.may_be_in_plane(a, hit.t, ray.direction)
                || self.may_be_in_plane(b, ray.t_max - hit.t, ray.direction))
    }

    /// Whether what is so far along a ray in this direction from a place on the triangle `primitive` may be in its
    /// plane: false for almost all hits.
    #[inline(always)]
    fn may_be_in_plane(&self, primitive: PrimitiveId, t: f32, direction: Vec3) -> bool {
        if !self.may_coincide(primitive) {
            return false;
        }
        t * self.plane_normal(primitive).dot(direction).abs() <= self.reach_of_planes()
    }

    /// So far from a plane, as far as the cosine and the distance along a ray tell, something may still be in it: the
    /// ray's ends and the hit are each as near to where they are computed as surfaces that coincide are to each other.
    #[inline(always)]
    fn reach_of_planes(&self) -> f32 {
        4.0 * self.coincident.as_ref().map_or(0.0, |found| found.reach)
    }

    /// Of what is so far along a ray from places in planes whose cosines to it are these, where it may be in the plane:
    /// wherever [`Self::may_be_in_plane_of_end`] and [`Self::is_met_first`] would look at it more closely.
    #[inline(always)]
    pub(crate) fn may_be_in_planes<F: Float>(&self, distance: F, cos: F) -> <F::Lanes as Lanes>::M {
        // The plane's normal may be rounded otherwise there.
        (distance * cos.abs()).le(cos.lanes().splat(2.0 * self.reach_of_planes()))
    }

    #[inline(always)]
    fn sharing(&self, primitive: PrimitiveId) -> Sharing {
        match primitive.instance() {
            None => self.world.sharing(primitive.index),
            Some(number) => self.sharing_of_instance(number, primitive.index),
        }
    }

    #[inline(never)]
    fn sharing_of_instance(&self, number: u32, index: u32) -> Sharing {
        let Some(instance) = self.instances.get(number as usize) else { return Sharing::Alone };
        self.meshes[instance.mesh as usize].mesh.sharing(index)
    }

    /// The rank of a primitive among those with which it coincides.
    ///
    /// # Panics
    /// If [`Self::find_coincident`] found none.
    pub fn rank(&self, primitive: PrimitiveId) -> Rank {
        Rank(self.role(primitive).precedence, primitive)
    }

    /// Calls `visit` with the other surfaces that are at `position` on the triangle `primitive`. They have no distance
    /// of their own: t is 0.
    #[inline(never)]
    pub fn coincident_at(&self, primitive: PrimitiveId, position: Vec3, mut visit: impl FnMut(Hit)) {
        let Some(found) = self.coincident.as_ref().filter(|_| self.may_coincide(primitive)) else { return };
        let plane = Plane { primitive, position };
        let normal = self.plane_normal(primitive);
        let ray = Ray { origin: position - found.reach * normal, direction: normal, t_max: 2.0 * found.reach };
        let _ = self.crossings(&ray, [primitive, PrimitiveId::NONE], |hit| {
            if self.is_in(&plane, hit) {
                visit(Hit { t: 0.0, ..*hit });
            }
            ControlFlow::Continue(())
        });
    }

    /// The plane of a triangle near `position`, if anything may coincide with it.
    #[inline]
    pub fn shared_plane(&self, primitive: PrimitiveId, position: Vec3) -> Option<Plane> {
        self.may_coincide(primitive).then_some(Plane { primitive, position })
    }

    /// Whether a ray hits what coincides with the plane's triangle near the plane's position.
    pub fn is_in(&self, plane: &Plane, hit: &Hit) -> bool {
        let id = hit.primitive;
        if !self.may_coincide(id) || !compete(self.role(id), self.role(plane.primitive)) {
            return false;
        }
        let normal = self.plane_normal(plane.primitive);
        let other = self.triangle_surface(id, hit.barycentric);
        let apart = normal.dot(other.position - plane.position).abs();
        normal.dot(other.normal).abs() > PARALLEL
            && apart <= MARGIN * self.plane_error(plane.primitive).max(self.plane_error(id))
    }

    #[inline(always)]
    fn plane_normal(&self, primitive: PrimitiveId) -> Vec3 {
        self.triangle_surface(primitive, Vec2::ZERO).normal
    }

    /// A bound on how far roundings move a triangle's plane, or an origin that leaves it, along its normal, m.
    #[inline(never)]
    fn plane_error(&self, primitive: PrimitiveId) -> f32 {
        let at = |b: Vec2| {
            let Surface { error, normal, .. } = self.triangle_surface(primitive, b);
            OFFSET * error * normal.abs().element_sum()
        };
        at(Vec2::ZERO).max(at(Vec2::X)).max(at(Vec2::Y))
    }

    fn role(&self, primitive: PrimitiveId) -> Role {
        let found = self.coincident.as_ref().expect("surfaces that coincide");
        found.roles[self.material(primitive).0 as usize]
    }
}

/// Whether one of two surfaces can hide the other.
fn compete(a: Role, b: Role) -> bool {
    !(a.bounds_volume && b.bounds_volume)
}
