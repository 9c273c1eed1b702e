//! Rays, and what is computed once per ray for all its box and triangle tests.

use glam::Vec3;

use super::Bounds;
use crate::lanes::{Float, Lanes, Select, Vector};

/// A half-line or segment: points `origin + t·direction`, 0 < t < `t_max`. The direction need not be of unit length.
#[derive(Clone, Copy, Debug)]
pub struct Ray<V: Vector = Vec3> {
    /// Where it starts.
    pub origin: V,
    /// Where it goes.
    pub direction: V,
    /// Where it ends, in multiples of `direction`; infinite for a half-line.
    pub t_max: V::F,
}

impl<V: Vector> Ray<V> {
    /// The segment between two points, t from 0 to 1.
    ///
    /// It starts at the point with the smaller coordinates. The difference of the points rounds as the larger
    /// coordinates do, so it misses the other end by no more than that end's own error allows, and a small thing lit
    /// from far away does not shadow itself.
    #[inline(always)]
    pub fn between(a: V, b: V) -> Self {
        let (at_a, at_b) = (a.abs().max_element(), b.abs().max_element());
        let b_is_smaller = at_b.lt(at_a);
        let (from, to) = (b_is_smaller.select(b, a), b_is_smaller.select(a, b));
        Self { origin: from, direction: to - from, t_max: at_a.lanes().splat(1.0) }
    }
}

/// Boxes are entered a little early and left a little late (Ize 2013, *Robust BVH Ray Traversal*): three roundings of
/// the box test itself, and about five of the shear in the triangle test that must find its triangle inside.
const SLACK: f32 = 4.0 * f32::EPSILON;
/// What is left of a distance with that slack.
pub(super) const BEFORE: f32 = 1.0 - SLACK;

/// A coordinate axis: an index that is known to be in range.
#[derive(Clone, Copy, Debug)]
pub(super) enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// The axes x, y, z of the sheared frame of a ray that goes along this one most.
    #[inline(always)]
    pub fn frame(depth: usize) -> [Self; 3] {
        match depth {
            0 => [Self::Y, Self::Z, Self::X],
            1 => [Self::Z, Self::X, Self::Y],
            _ => [Self::X, Self::Y, Self::Z],
        }
    }
}

/// A ray prepared for traversal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    pub origin: Vec3,
    pub direction: Vec3,
    pub inverse: Vec3,
    /// The axes x, y, z of the sheared frame: z is where the direction is largest.
    pub axes: [Axis; 3],
    /// The shear that turns the direction into +z: `x −= shear[0]·z`, `y −= shear[1]·z`.
    pub shear: [f32; 2],
}

/// The part of a ray inside a box, in multiples of its direction; empty if `near > far`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub near: f32,
    pub far: f32,
}

/// Rays in lanes, for box and triangle tests: one ray in all of them, against as many boxes or triangles, or as many
/// rays against one.
#[derive(Clone, Copy)]
pub(super) struct Lines<L: Lanes> {
    pub lanes: L,
    pub origin: [L::F; 3],
    pub inverse: [L::F; 3],
    /// The origin along [`Prepared::axes`].
    pub start: [L::F; 3],
    pub shear: [L::F; 2],
}

/// The edge functions of triangles in the sheared frame (see `Triangle::intersect`).
pub(super) struct Edges<L: Lanes> {
    /// Those of the corners: over the sum of all, they are its barycentric coordinates.
    pub u: L::F,
    pub v: L::F,
    pub w: L::F,
    /// Where none lies on the other side than another. If the sum of all [is an area](Lines::is_area), the line passes
    /// through the triangle.
    pub inside: L::M,
}

impl<L: Lanes> Edges<L> {
    /// The sum of all.
    #[inline(always)]
    pub fn det(&self) -> L::F {
        self.u + self.v + self.w
    }
}

impl<L: Lanes> Lines<L> {
    /// Where the lines pass two planes that stand across an axis.
    #[inline(always)]
    pub fn slab(&self, [first, last]: [L::F; 2], axis: usize) -> [L::F; 2] {
        [(first - self.origin[axis]) * self.inverse[axis], (last - self.origin[axis]) * self.inverse[axis]]
    }

    /// [`Prepared::clip`] with the same roundings, from where the lines enter and leave the slab of each axis.
    #[inline(always)]
    pub fn clip(&self, [[x, x_far], [y, y_far], [z, z_far]]: [[L::F; 2]; 3]) -> [L::F; 2] {
        let near = x.max(y).max(z.max(self.lanes.splat(0.0)));
        let far = x_far.min(y_far).min(z_far);
        [near * BEFORE, far * (1.0 + SLACK)]
    }

    /// Corners as seen from the origin, from their coordinates along [`Prepared::axes`].
    #[inline(always)]
    pub fn relative(&self, [x, y, z]: [L::F; 3]) -> [L::F; 3] {
        [x - self.start[0], y - self.start[1], z - self.start[2]]
    }

    /// The same in the sheared frame, x and y.
    #[inline(always)]
    pub fn sheared(&self, [x, y, z]: [L::F; 3]) -> [L::F; 2] {
        [x - self.shear[0] * z, y - self.shear[1] * z]
    }

    /// `Triangle::intersect`, with the same roundings, of triangles with these corners in the sheared frame.
    #[inline(always)]
    pub fn edges(&self, [[ax, ay], [bx, by], [cx, cy]]: [[L::F; 2]; 3]) -> Edges<L> {
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let zero = self.lanes.splat(0.0);
        Edges { u, v, w, inside: !(u.min(v).min(w).lt(zero) & zero.lt(u.max(v).max(w))) }
    }

    /// Where a sum of edge functions is neither zero nor beyond what there are numbers for.
    #[inline(always)]
    pub fn is_area(&self, det: L::F) -> L::M {
        self.lanes.splat(0.0).lt(det.abs()) & det.abs().lt(self.lanes.splat(f32::INFINITY))
    }
}

/// One ray in all lanes.
#[derive(Clone, Copy)]
pub(super) struct OneLine<'a, L: Lanes> {
    pub ray: &'a Prepared,
    pub lines: Lines<L>,
    /// For each axis which planes the ray passes first: 0 for the lower ones, 1 for the upper ones.
    pub first: [usize; 3],
}

impl<'a, L: Lanes> OneLine<'a, L> {
    #[inline(always)]
    pub fn new(lanes: L, ray: &'a Prepared) -> Self {
        let (origin, [ix, iy, iz]) = (ray.origin.to_array(), ray.inverse.to_array());
        let ([ox, oy, oz], [x, y, z]) = (origin, ray.axes);
        let lines = Lines {
            lanes,
            origin: [lanes.splat(ox), lanes.splat(oy), lanes.splat(oz)],
            inverse: [lanes.splat(ix), lanes.splat(iy), lanes.splat(iz)],
            start: [lanes.splat(origin[x as usize]), lanes.splat(origin[y as usize]), lanes.splat(origin[z as usize])],
            shear: [lanes.splat(ray.shear[0]), lanes.splat(ray.shear[1])],
        };
        Self { ray, lines, first: [usize::from(ix < 0.0), usize::from(iy < 0.0), usize::from(iz < 0.0)] }
    }

    /// Of boxes whose `planes` the ray passes first and last in each axis: where it enters and leaves them, and a mask
    /// of those that it enters at `limit` or before.
    #[inline(always)]
    pub fn clip(&self, [x, y, z]: [[L::F; 2]; 3], limit: f32) -> ([L::F; 2], L::M) {
        let lines = &self.lines;
        let [near, far] = lines.clip([lines.slab(x, 0), lines.slab(y, 1), lines.slab(z, 2)]);
        ([near, far], near.le(far.min(lines.lanes.splat(limit))))
    }
}

impl Prepared {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let axes = Axis::frame(d.abs().max_position());
        let components = d.to_array();
        let [x, y, z] = axes.map(|axis| components[axis as usize]);
        // An inverse that is finite even for ±0 keeps 0·∞ = NaN out of the box test.
        let inverse = d.to_array().map(|c| if c.abs() < 1e-18 { 1e18_f32.copysign(c) } else { 1.0 / c });
        Self { origin: ray.origin, direction: d, inverse: Vec3::from_array(inverse), axes, shear: [x / z, y / z] }
    }

    /// Where the line is inside a box, from t = 0 on. Every operation is monotone, so a box inside another never has
    /// the longer interval, rounding included.
    #[inline]
    pub fn clip(&self, b: Bounds) -> Interval {
        let (s, t) = ((b.min - self.origin) * self.inverse, (b.max - self.origin) * self.inverse);
        Interval { near: s.min(t).max_element().max(0.0) * BEFORE, far: s.max(t).min_element() * (1.0 + SLACK) }
    }
}

impl Interval {
    /// The nearest t in the interval to `t` (which may be NaN: then the near end).
    ///
    /// Hits are pulled into their primitive's own box, so that no box around it can be culled before them: with that,
    /// what a ray hits does not depend on the tree at all.
    #[inline]
    pub fn clamp(self, t: f64) -> f32 {
        let t = t as f32;
        if t >= self.near { t.min(self.far) } else { self.near }
    }
}
