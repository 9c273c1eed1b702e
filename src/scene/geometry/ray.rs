//! Rays, and what is computed once per ray for all its box and triangle tests.

use glam::Vec3;

use super::{Bounds, simd::Simd};

/// A half-line or segment: points `origin + t·direction`, 0 < t < `t_max`. The direction need not be of unit length.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes.
    pub direction: Vec3,
    /// Where it ends, in multiples of `direction`; infinite for a half-line.
    pub t_max: f32,
}

impl Ray {
    /// The segment between two points, t from 0 to 1.
    ///
    /// It starts at the point with the smaller coordinates. The difference of the points rounds as the larger
    /// coordinates do, so it misses the other end by no more than that end's own error allows, and a small thing lit
    /// from far away does not shadow itself.
    #[inline(always)]
    pub fn between(a: Vec3, b: Vec3) -> Self {
        let (from, to) = if b.abs().max_element() < a.abs().max_element() { (b, a) } else { (a, b) };
        Self { origin: from, direction: to - from, t_max: 1.0 }
    }
}

/// Boxes are entered a little early and left a little late (Ize 2013, *Robust BVH Ray Traversal*): three roundings of
/// the box test itself, and about five of the shear in the triangle test that must find its triangle inside.
const SLACK: f32 = 4.0 * f32::EPSILON;

/// A coordinate axis: an index that is known to be in range.
#[derive(Clone, Copy, Debug)]
pub(super) enum Axis {
    X,
    Y,
    Z,
}

/// A ray prepared for traversal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    pub origin: Vec3,
    pub direction: Vec3,
    inverse: Vec3,
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

/// A ray ready to be clipped by eight boxes at once. Its functions are called from where the instructions are known to
/// be there, and have no closures around them: those would be compiled without.
#[derive(Clone, Copy)]
pub(super) struct EightLines<F> {
    origin: [F; 3],
    inverse: [F; 3],
    /// For each axis which planes the ray passes first: 0 for the lower ones, 1 for the upper ones.
    pub first: [usize; 3],
    /// The origin along [`Prepared::axes`].
    start: [F; 3],
    shear: [F; 2],
}

impl<F: Copy> EightLines<F> {
    /// [`Prepared::clip`] with the same roundings, of the boxes whose `planes` the ray passes first and last in each
    /// axis: where the ray enters and leaves them, and a mask of those that it enters at `limit` or before.
    #[inline(always)]
    pub fn clip<S: Simd<F = F>>(&self, simd: S, planes: [[F; 2]; 3], limit: f32) -> (F, F, u32) {
        let [[x, x_far], [y, y_far], [z, z_far]] =
            [self.slab(simd, planes[0], 0), self.slab(simd, planes[1], 1), self.slab(simd, planes[2], 2)];
        let near = simd.max(simd.max(x, y), simd.max(z, simd.splat(0.0)));
        let far = simd.min(simd.min(x_far, y_far), z_far);
        let near = simd.mul(near, simd.splat(1.0 - SLACK));
        let far = simd.mul(far, simd.splat(1.0 + SLACK));
        (near, far, simd.le(near, simd.min(far, simd.splat(limit))))
    }

    /// Corners in the sheared frame, x and y, from their coordinates along [`Prepared::axes`].
    #[inline(always)]
    pub fn sheared<S: Simd<F = F>>(&self, simd: S, [x, y, z]: [F; 3]) -> [F; 2] {
        let z = simd.sub(z, self.start[2]);
        let (dx, dy) = (simd.mul(self.shear[0], z), simd.mul(self.shear[1], z));
        [simd.sub(simd.sub(x, self.start[0]), dx), simd.sub(simd.sub(y, self.start[1]), dy)]
    }

    #[inline(always)]
    fn slab<S: Simd<F = F>>(&self, simd: S, [first, last]: [F; 2], axis: usize) -> [F; 2] {
        [
            simd.mul(simd.sub(first, self.origin[axis]), self.inverse[axis]),
            simd.mul(simd.sub(last, self.origin[axis]), self.inverse[axis]),
        ]
    }
}

impl Prepared {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let axes = match d.abs().max_position() {
            0 => [Axis::Y, Axis::Z, Axis::X],
            1 => [Axis::Z, Axis::X, Axis::Y],
            _ => [Axis::X, Axis::Y, Axis::Z],
        };
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
        Interval { near: s.min(t).max_element().max(0.0) * (1.0 - SLACK), far: s.max(t).min_element() * (1.0 + SLACK) }
    }

    /// For [`EightLines::clip`].
    #[inline(always)]
    pub fn lines<S: Simd>(&self, simd: S) -> EightLines<S::F> {
        let (origin, [ix, iy, iz]) = (self.origin.to_array(), self.inverse.to_array());
        let ([ox, oy, oz], [x, y, z]) = (origin, self.axes);
        let along = |axis: Axis| origin[axis as usize];
        let (x, y, z) = (along(x), along(y), along(z));
        EightLines {
            origin: [simd.splat(ox), simd.splat(oy), simd.splat(oz)],
            inverse: [simd.splat(ix), simd.splat(iy), simd.splat(iz)],
            first: [usize::from(ix < 0.0), usize::from(iy < 0.0), usize::from(iz < 0.0)],
            start: [simd.splat(x), simd.splat(y), simd.splat(z)],
            shear: [simd.splat(self.shear[0]), simd.splat(self.shear[1])],
        }
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
