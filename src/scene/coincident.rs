//! Where surfaces coincide, one rule says which of them is there, for walks, connections and sampled points alike: see
//! [`Geometry::find_coincident`].
//!
//! Coincident surfaces are one surface. Of that, each one in the order of its [`Rank`] has its α of what those before
//! it leave, from either side: a walk stops there with that probability, and f and L_e carry it ([`Point::alpha`]).
//! What a segment crosses in between lets pass the product of all their 1 − α, and what lies in the plane of one of its
//! ends is no obstacle.

use std::ops::ControlFlow;

use super::{
    Scene,
    alpha::Product,
    geometry::{Geometry, Hit, Plane, PrimitiveId, Rank, Ray},
    point::{Place, Point},
};

/// What a ray meets one after the other where surfaces may coincide, front to back and in the order of ranks.
pub(super) struct Meetings {
    ray: Ray,
    skip: PrimitiveId,
    /// The closest hit that is not behind it.
    next: Option<Hit>,
    /// Where the ray leaves: what lies in this plane was met there.
    left: Option<Plane>,
    /// What coincides with `next` and was met.
    met: Option<Rank>,
    /// Where the ray passed `next`'s predecessor, and with it what lies in this plane.
    passed: Option<Plane>,
}

impl Meetings {
    /// `next` is the closest hit.
    pub fn new(geometry: &Geometry, ray: Ray, skip: PrimitiveId, next: Option<Hit>) -> Self {
        let left = geometry.shared_plane(skip, ray.origin);
        Self { ray, skip, next, left, met: None, passed: None }
    }

    #[cold]
    #[inline(never)]
    pub fn next(&mut self, geometry: &Geometry) -> Option<Hit> {
        while let Some(hit) = self.next {
            if ![&self.left, &self.passed].into_iter().flatten().any(|plane| geometry.is_in(plane, &hit)) {
                if let Some(there) = self.next_at(geometry, &hit) {
                    return Some(there);
                }
                self.met = None;
                self.passed = geometry.shared_plane(hit.primitive, geometry.surface(&self.ray, &hit).position);
            }
            self.next = geometry.closest_after(&self.ray, self.skip, &hit);
        }
        None
    }

    /// Of `hit` and what coincides there, the first after what was met.
    fn next_at(&mut self, geometry: &Geometry, hit: &Hit) -> Option<Hit> {
        let mut first: Option<(Rank, Hit)> = None;
        let mut see = |member: Hit| {
            let rank = geometry.rank(member.primitive);
            if self.met.is_none_or(|met| met < rank) && first.is_none_or(|(r, _)| rank < r) {
                first = Some((rank, Hit { t: hit.t, ..member }));
            }
        };
        see(*hit);
        geometry.coincident_at(hit.primitive, geometry.surface(&self.ray, hit).position, see);
        let (rank, member) = first?;
        self.met = Some(rank);
        Some(member)
    }
}

impl Scene {
    /// `hit`, or what hides it there. Its point is a rounding away from where it was found, and on the other side of an
    /// edge perhaps; but what a walk stops on must be there, or its density would be zero.
    #[cold]
    #[inline(never)]
    pub(super) fn settled(&self, ray: &Ray, mut hit: Hit) -> Hit {
        let geometry = &self.geometry;
        loop {
            let position = geometry.surface(ray, &hit).position;
            if !geometry.may_be_hidden_at(hit.primitive, position) {
                return hit;
            }
            let mut first = (geometry.rank(hit.primitive), hit);
            geometry.coincident_at(hit.primitive, position, |other| {
                let rank = geometry.rank(other.primitive);
                if rank < first.0 && self.alpha(&other) == 1.0 {
                    first = (rank, Hit { t: hit.t, ..other });
                }
            });
            if first.1.primitive == hit.primitive {
                return hit;
            }
            hit = first.1;
        }
    }

    /// Whether V(a↔b) = 1 along `ray`, where surfaces coincide and all are opaque.
    #[cold]
    #[inline(never)]
    pub(crate) fn sees_among_coincident(&self, ray: &Ray, a: &Point, b: &Point) -> bool {
        self.visible_among_coincident(ray, a, b, |hit| self.alpha(hit)) > 0.0
    }

    /// [`Scene::visibility`] where surfaces coincide.
    #[cold]
    #[inline(never)]
    pub(super) fn visible_among_coincident(&self, ray: &Ray, a: &Point, b: &Point, alpha: impl Fn(&Hit) -> f32) -> f32 {
        if a.alpha == 0.0 || b.alpha == 0.0 {
            return 0.0;
        }
        let plane = |p: &Point| match p.place {
            Place::Surface => self.geometry.shared_plane(p.primitive, p.position),
            _ => None,
        };
        let ends = [plane(a), plane(b)];
        let mut visibility = Product::ONE;
        let _ = self.geometry.crossings(ray, [a.primitive, b.primitive], |hit| {
            if !ends.iter().flatten().any(|end| self.geometry.is_in(end, hit)) {
                visibility.times(1.0 - alpha(hit));
            }
            if visibility.is_zero() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        visibility.value()
    }
}

#[cfg(test)]
mod tests;
