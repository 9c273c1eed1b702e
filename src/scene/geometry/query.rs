//! What a ray meets: the questions, asked of both levels of trees.

use std::ops::ControlFlow;

use glam::Vec2;

use super::{
    Geometry, Hit, PrimitiveId, Ray,
    bvh::{Found, LargestFirst, NearestFirst, Order},
    node::{Primitive, Shape},
    ray::Prepared,
};

impl Geometry {
    /// The closest hit, not counting `skip` if that is a flat primitive (a sphere may be hit again from inside).
    /// Of several hits at the same distance it is the one with the smallest id.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray, skip: PrimitiveId) -> Option<Hit> {
        self.first(ray, skip, |_| true)
    }

    /// The hit that comes next after `hit` along the same ray, in the order of [`Self::closest`]: every surface comes
    /// once, also where several lie at the same distance; a sphere comes once for each side.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    #[inline(never)]
    pub fn closest_after(&self, ray: &Ray, skip: PrimitiveId, hit: &Hit) -> Option<Hit> {
        self.first(ray, skip, |h| h.order() > hit.order())
    }

    #[inline(always)]
    fn first(&self, ray: &Ray, skip: PrimitiveId, wanted: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.candidates::<NearestFirst, 1>(ray, [skip], |hit, limit| {
            if best.map_or(hit.t < limit, |b| hit.order() < b.order()) && wanted(&hit) {
                best = Some(hit);
                hit.t
            } else {
                limit
            }
        });
        best
    }

    /// Anything but the two flat primitives in `skip` that lies on the segment.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    #[inline(always)]
    pub fn obstacle(&self, ray: &Ray, skip: [PrimitiveId; 2]) -> Option<Hit> {
        let mut found = None;
        let _ = self.crossings(ray, skip, |hit| {
            found = Some(*hit);
            ControlFlow::Break(())
        });
        found
    }

    /// Calls `visit` with everything but the two flat primitives in `skip` that the segment crosses, until it breaks:
    /// what [`Self::closest_after`] would find one by one, in the order of the walk, which depends on the tree.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    #[inline(always)]
    pub fn crossings(
        &self,
        ray: &Ray,
        skip: [PrimitiveId; 2],
        mut visit: impl FnMut(&Hit) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut flow = ControlFlow::Continue(());
        self.candidates::<LargestFirst, 2>(ray, skip, |hit, limit| {
            if flow.is_continue() && hit.t < ray.t_max {
                flow = visit(&hit);
            }
            if flow.is_break() { f32::NEG_INFINITY } else { limit }
        });
        flow
    }

    /// Calls `accept` for what the ray may meet up to the limit, which starts as the ray's end; `accept` gets a hit and
    /// the limit, and returns the new limit.
    #[inline(always)]
    fn candidates<O: Order, const N: usize>(
        &self,
        ray: &Ray,
        skip: [PrimitiveId; N],
        mut accept: impl FnMut(Hit, f32) -> f32,
    ) {
        let Some(tree) = self.tree() else { return };
        let ray_end = ray.t_max;
        let ray = Prepared::new(ray);
        let skip_world = skip.map(|id| id.index_in(PrimitiveId::WORLD));
        tree.walk::<O>(&ray, ray_end, |found, limit| {
            self.offer::<O, N>(found, limit, &ray, &skip, &skip_world, &mut accept)
        });
    }

    /// Brings what a walk through the world's tree has come upon to `accept`; returns the new limit.
    #[inline(always)]
    pub(super) fn offer<O: Order, const N: usize>(
        &self,
        found: Found<'_>,
        limit: f32,
        ray: &Prepared,
        skip: &[PrimitiveId; N],
        skip_world: &[u32; N],
        accept: &mut impl FnMut(Hit, f32) -> f32,
    ) -> f32 {
        match found {
            Found::Triangle { index, .. } if skip_world.contains(&index) => limit,
            Found::Triangle { index, t, barycentric } => {
                accept(Hit { t, primitive: PrimitiveId::world(index), barycentric }, limit)
            }
            Found::Other(&Primitive { shape: Shape::Sphere(sphere), index }) => {
                let hit = |t| Hit { t, primitive: PrimitiveId::world(index), barycentric: Vec2::ZERO };
                sphere.intersect(ray).into_iter().flatten().fold(limit, |limit, t| accept(hit(t), limit))
            }
            Found::Other(instance) => self.enter::<O, N>(instance.index, ray, skip, limit, accept),
        }
    }

    /// [`Self::candidates`] of an instance; returns the new limit.
    #[inline(never)]
    fn enter<O: Order, const N: usize>(
        &self,
        number: u32,
        ray: &Prepared,
        skip: &[PrimitiveId; N],
        mut limit: f32,
        accept: &mut impl FnMut(Hit, f32) -> f32,
    ) -> f32 {
        let instance = &self.instances[number as usize];
        let range = instance.clip(ray);
        let Some(tree) =
            self.meshes[instance.mesh as usize].tree.as_ref().filter(|_| range.near <= range.far.min(limit))
        else {
            return limit;
        };
        let object_ray = instance.object_ray(ray);
        let skip = skip.map(|id| id.index_in(number + 1));
        // In the mesh's tree, a hit beyond the box counts as at its end: only what comes before that can be culled.
        let inner = |limit: f32| if limit >= range.far { f32::INFINITY } else { limit };
        tree.walk::<O>(&object_ray, inner(limit), |found, _| {
            if let Found::Triangle { index, t, barycentric } = found
                && !skip.contains(&index)
            {
                let t = range.clamp(f64::from(t));
                if t > 0.0 {
                    limit = accept(Hit { t, primitive: PrimitiveId::of(number, index), barycentric }, limit);
                }
            }
            inner(limit)
        });
        limit
    }
}
