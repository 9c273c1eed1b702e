//! Where surfaces coincide, one rule says which of them is there, for walks, connections and sampled points alike: see
//! [`Geometry::find_coincident`].
//!
//! Coincident surfaces are one surface. Of that, each one in the order of its [`Rank`] has its α of what those before it leave, from
//! either side: a walk stops there with that probability, and f and L_e carry it ([`Point::alpha`]). What a segment crosses in
//! between lets pass the product of all their 1 − α, and what lies in the plane of one of its ends is no obstacle.

use std::ops::ControlFlow;

use super::{
    Scene, Traced,
    geometry::{Geometry, Hit, Plane, PrimitiveId, Rank, Ray, Surface},
    material::Material,
    point::{Place, Point},
};

/// The part of the place that the coincident surfaces of a lower rank leave to `primitive`: the product of their 1 − α.
#[cold]
#[inline(never)]
pub(super) fn left_by_others(
    geometry: &Geometry,
    materials: &[Material],
    primitive: PrimitiveId,
    surface: &Surface,
) -> f32 {
    if !geometry.may_coincide(primitive) {
        return 1.0;
    }
    let rank = geometry.rank(primitive);
    let mut left = 1.0;
    geometry.coincident_at(primitive, surface, |hit| {
        if geometry.rank(hit.primitive) < rank {
            left *= 1.0 - alpha(geometry, materials, &hit);
        }
    });
    left
}

/// α in [0, 1] of the material where a ray hits, whatever coincides there.
#[inline]
pub(super) fn alpha(geometry: &Geometry, materials: &[Material], hit: &Hit) -> f32 {
    let material = &materials[geometry.material(hit.primitive).0 as usize];
    material.alpha(|| geometry.attributes(hit.primitive, hit.barycentric))
}

/// What a ray meets where surfaces may coincide.
enum Met {
    /// It stops here.
    Stops(Hit),
    /// It passes them all, with this V.
    Passes(f32),
}

impl Scene {
    /// [`Scene::trace_through`] where surfaces coincide; `next` is the closest hit.
    #[cold]
    #[inline(never)]
    pub(super) fn trace_among_coincident(
        &self,
        ray: Ray,
        skip: PrimitiveId,
        mut next: Option<Hit>,
        mut stops: impl FnMut(f32) -> bool,
        alpha: impl Fn(&Hit) -> f32,
    ) -> Traced {
        let geometry = &self.geometry;
        let mut visibility = 1.0;
        // What lies in the plane that the ray leaves was met there, and what lies in one that it has passed was passed with it.
        let left = geometry.shared_plane(skip, ray.origin);
        let mut passed: Option<Plane> = None;
        while let Some(hit) = next {
            if ![&left, &passed].into_iter().flatten().any(|plane| geometry.is_in(plane, &hit)) {
                match self.meet(&ray, &hit, &mut stops, &alpha) {
                    Met::Stops(hit) => return Traced { ray, hit: Some(hit), visibility },
                    Met::Passes(v) => visibility *= v,
                }
                passed = geometry.shared_plane(hit.primitive, geometry.surface(&ray, &hit).position);
            }
            next = geometry.closest_after(&ray, skip, &hit);
        }
        Traced { ray, hit: None, visibility }
    }

    /// Goes through what is where the ray hits, in the order of ranks.
    fn meet(&self, ray: &Ray, hit: &Hit, stops: &mut impl FnMut(f32) -> bool, alpha_of: &impl Fn(&Hit) -> f32) -> Met {
        let geometry = &self.geometry;
        let mut visibility = 1.0;
        if !geometry.may_coincide(hit.primitive) {
            let alpha = alpha_of(hit);
            let stop = alpha == 1.0 || (alpha > 0.0 && stops(alpha));
            return if stop { Met::Stops(*hit) } else { Met::Passes(1.0 - alpha) };
        }
        let surface = geometry.surface(ray, hit);
        let mut passed: Option<Rank> = None;
        loop {
            let mut first: Option<(Rank, Hit)> = None;
            let mut see = |member: Hit| {
                let rank = geometry.rank(member.primitive);
                if passed.is_none_or(|p| p < rank) && first.is_none_or(|(r, _)| rank < r) {
                    first = Some((rank, Hit { t: hit.t, ..member }));
                }
            };
            see(*hit);
            geometry.coincident_at(hit.primitive, &surface, see);
            let Some((rank, member)) = first else { return Met::Passes(visibility) };
            let alpha = alpha_of(&member);
            if alpha == 1.0 || (alpha > 0.0 && stops(alpha)) {
                return Met::Stops(self.settled(ray, member));
            }
            visibility *= 1.0 - alpha;
            passed = Some(rank);
        }
    }

    /// `hit`, or what hides it there. Its point is a rounding away from where it was found, and on the other side of an edge perhaps; but
    /// what a walk stops on must be there, or its density would be zero.
    fn settled(&self, ray: &Ray, mut hit: Hit) -> Hit {
        let geometry = &self.geometry;
        loop {
            let mut first = (geometry.rank(hit.primitive), hit);
            geometry.coincident_at(hit.primitive, &geometry.surface(ray, &hit), |other| {
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
        let mut visibility = 1.0;
        let _ = self.geometry.crossings(ray, [a.primitive, b.primitive], |hit| {
            if !ends.iter().flatten().any(|end| self.geometry.is_in(end, hit)) {
                visibility *= 1.0 - alpha(hit);
            }
            if visibility == 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        visibility
    }
}

#[cfg(test)]
mod tests;
