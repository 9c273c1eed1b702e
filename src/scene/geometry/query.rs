//! What a ray meets: the questions, asked of both levels of trees.

use std::ops::ControlFlow;

use glam::Vec2;

use super::{
    Geometry, Hit, PrimitiveId, Ray,
    bvh::{MeshLeaf, Shape, WorldLeaf},
    ray::Prepared,
};

impl Geometry {
    /// The closest hit, not counting `skip` if that is a flat primitive (a sphere may be hit again from inside).
    /// Of several hits at the same distance it is the one with the smallest id.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    pub fn closest(&self, ray: &Ray, skip: PrimitiveId) -> Option<Hit> {
        self.first(ray, skip, |_| true)
    }

    /// The hit that comes next after `hit` along the same ray, in the order of [`Self::closest`]: every surface comes once,
    /// also where several lie at the same distance; a sphere comes once for each side.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    pub fn closest_after(&self, ray: &Ray, skip: PrimitiveId, hit: &Hit) -> Option<Hit> {
        self.first(ray, skip, |h| h.order() > hit.order())
    }

    #[inline]
    fn first(&self, ray: &Ray, skip: PrimitiveId, wanted: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.candidates(ray, &[skip], |hit, limit| {
            if best.map_or(hit.t < limit, |b| hit.order() < b.order()) && wanted(&hit) {
                best = Some(hit);
                hit.t
            } else {
                limit
            }
        });
        best
    }

    /// Whether anything but the two flat primitives in `skip` lies on the segment.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    pub fn occluded(&self, ray: &Ray, skip: [PrimitiveId; 2]) -> bool {
        self.crossings(ray, skip, |_| ControlFlow::Break(())).is_break()
    }

    /// Calls `visit` with everything but the two flat primitives in `skip` that the segment crosses, until it breaks: what
    /// [`Self::closest_after`] would find one by one, in an order that depends on the geometry alone.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    #[inline]
    pub fn crossings(
        &self,
        ray: &Ray,
        skip: [PrimitiveId; 2],
        mut visit: impl FnMut(&Hit) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut flow = ControlFlow::Continue(());
        self.candidates(ray, &skip, |hit, limit| {
            if flow.is_continue() && hit.t < ray.t_max {
                flow = visit(&hit);
            }
            if flow.is_break() { f32::NEG_INFINITY } else { limit }
        });
        flow
    }

    /// Calls `accept` for what the ray may meet up to the limit, which starts as the ray's end; `accept` gets a hit and
    /// the limit, and returns the new limit.
    #[inline]
    fn candidates<const N: usize>(&self, ray: &Ray, skip: &[PrimitiveId; N], mut accept: impl FnMut(Hit, f32) -> f32) {
        let Some(tree) = self.tree() else { return };
        let prepared = Prepared::new(ray);
        let skip_world = skip.map(|id| id.index_in(PrimitiveId::WORLD));
        tree.walk(&prepared, ray.t_max, |leaf, mut limit| {
            for primitive in leaf {
                limit = match primitive.shape {
                    Shape::Instance(_) => self.enter(primitive.index, &prepared, skip, limit, &mut accept),
                    _ => primitive
                        .intersect(&prepared, &skip_world)
                        .into_iter()
                        .flatten()
                        .fold(limit, |l, h| accept(h, l)),
                };
            }
            limit
        });
    }

    /// [`Self::candidates`] of an instance; returns the new limit.
    #[inline(never)]
    fn enter<const N: usize>(
        &self,
        number: u32,
        ray: &Prepared,
        skip: &[PrimitiveId; N],
        mut limit: f32,
        accept: &mut impl FnMut(Hit, f32) -> f32,
    ) -> f32 {
        let instance = &self.instances[number as usize];
        let range = instance.clip(ray);
        if range.near > range.far.min(limit) {
            return limit;
        }
        let object_ray = instance.object_ray(ray);
        let skip = skip.map(|id| id.index_in(number + 1));
        // In the mesh's tree, a hit beyond the box counts as at its end: only what comes before that can be culled.
        let inner = |limit: f32| if limit >= range.far { f32::INFINITY } else { limit };
        let Some(tree) = &self.meshes[instance.mesh as usize].tree else { return limit };
        tree.walk(&object_ray, inner(limit), |leaf, _| {
            for triangle in leaf {
                if let Some((t, barycentric)) = triangle.intersect(&object_ray, &skip) {
                    let t = range.clamp(f64::from(t));
                    if t > 0.0 {
                        limit =
                            accept(Hit { t, primitive: PrimitiveId::of(number, triangle.index), barycentric }, limit);
                    }
                }
            }
            inner(limit)
        });
        limit
    }
}

impl WorldLeaf {
    /// Where the ray meets this primitive at t > 0, unless it is a triangle that is to be skipped; of a sphere both sides.
    #[inline]
    pub(super) fn intersect(&self, ray: &Prepared, skip: &[u32]) -> [Option<Hit>; 2] {
        let hit = |(t, barycentric)| Hit { t, primitive: PrimitiveId::world(self.index), barycentric };
        match &self.shape {
            Shape::Triangle(s) => [s.intersect(ray).filter(|_| !skip.contains(&self.index)).map(hit), None],
            Shape::Sphere(s) => s.intersect(ray).map(|t| t.map(|t| hit((t, Vec2::ZERO)))),
            Shape::Instance(_) => [None; 2],
        }
    }
}

impl MeshLeaf {
    #[inline]
    fn intersect(&self, ray: &Prepared, skip: &[u32]) -> Option<(f32, Vec2)> {
        self.triangle.intersect(ray).filter(|_| !skip.contains(&self.index))
    }
}
