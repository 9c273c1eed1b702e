//! Triangles: the watertight intersection test and their measures.

use glam::{DVec3, Vec2, Vec3};
#[cfg(test)]
use glam::{Vec4, Vec4Swizzles};

#[cfg(test)]
use super::ray::Axis;
use super::{
    Bounds,
    ray::{Interval, Prepared},
};

/// A triangle's corners: for each axis the coordinates of the three corners, and a zero to fill a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Triangle {
    axes: [[f32; 4]; 3],
}

impl Triangle {
    pub fn new([a, b, c]: [Vec3; 3]) -> Self {
        Self { axes: [[a.x, b.x, c.x, 0.0], [a.y, b.y, c.y, 0.0], [a.z, b.z, c.z, 0.0]] }
    }

    #[inline]
    pub fn corners(&self) -> [Vec3; 3] {
        let [x, y, z] = &self.axes;
        [Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]), Vec3::new(x[2], y[2], z[2])]
    }

    #[inline]
    pub fn bounds(&self) -> Bounds {
        let [a, b, c] = self.corners();
        Bounds { min: a.min(b).min(c), max: a.max(b).max(c) }
    }

    /// The edges from the first corner to the second and the third.
    #[inline]
    pub fn edges(&self) -> [DVec3; 2] {
        let [a, b, c] = self.corners();
        [b.as_dvec3() - a.as_dvec3(), c.as_dvec3() - a.as_dvec3()]
    }

    /// The cross product of the edges: twice the area long, along N_g. In f64 it neither under- nor overflows, and is
    /// exactly zero where f32 corners lie on one line of moderate extent.
    #[inline]
    pub fn cross(&self) -> DVec3 {
        let [u, v] = self.edges();
        u.cross(v)
    }

    /// Whether the corners lie on one line; such a triangle has no normal and is never hit.
    pub fn is_degenerate(&self) -> bool {
        self.cross() == DVec3::ZERO
    }

    /// The area, m².
    pub fn area(&self) -> f32 {
        (0.5 * self.cross().length()) as f32
    }

    /// N_g by winding; of a degenerate triangle +z.
    pub fn normal(&self) -> Vec3 {
        self.cross().try_normalize().map_or(Vec3::Z, |n| n.as_vec3())
    }

    /// The point with the given barycentric coordinates, on the triangle's plane to the precision of f64.
    pub fn point_f64(&self, b: Vec2) -> DVec3 {
        let [p, q, r] = self.corners().map(|p| p.as_dvec3());
        let b = b.as_dvec2();
        p * (1.0 - b.x - b.y) + q * b.x + r * b.y
    }

    /// Where the ray meets the triangle: t > 0 and the barycentric coordinates of the second and third corner. Trees
    /// test eight triangles at once; this is what they have to find.
    ///
    /// Woop, Benthin & Wald 2013, *Watertight Ray/Triangle Intersection*: the corners are sheared so that the ray
    /// becomes the z axis, and the signs of three 2D edge functions decide. An edge function of two corners is the
    /// exact negative of the same one with the corners exchanged (no fused multiply-add may break that), and zero
    /// counts as inside, so nothing passes between two triangles that share an edge.
    #[cfg(test)]
    pub fn intersect(&self, ray: &Prepared) -> Option<(f32, Vec2)> {
        let [kx, ky, kz] = ray.axes;
        let from_origin = |k: Axis| Vec4::from_array(self.axes[k as usize]) - Vec4::splat(ray.origin[k as usize]);
        let h = from_origin(kz);
        let x = from_origin(kx) - Vec4::splat(ray.shear[0]) * h;
        let y = from_origin(ky) - Vec4::splat(ray.shear[1]) * h;
        // Lane by lane x_c y_b − y_c x_b, x_a y_c − y_a x_c, x_b y_a − y_b x_a; the last lane is 0.
        let edges = x.zxyw() * y.yzxw() - y.zxyw() * x.yzxw();
        let (outside, inside) = (edges.cmplt(Vec4::ZERO).bitmask() & 7, edges.cmpgt(Vec4::ZERO).bitmask() & 7);
        if outside != 0 && inside != 0 {
            return None;
        }
        let det = edges.x + edges.y + edges.z;
        if det == 0.0 || !det.is_finite() {
            return None;
        }
        let range = ray.clip(self.bounds());
        let t = self.distance(ray, range).filter(|_| range.near <= range.far)?;
        Some((t, Vec2::new(edges.y / det, edges.z / det)))
    }

    /// Where a ray that the edge functions let through meets the triangle's plane; `range` is where it is in the
    /// triangle's box. In f64, so that the side of the plane on which the ray starts is decided without error; few
    /// candidates get here.
    #[inline]
    pub fn distance(&self, ray: &Prepared, range: Interval) -> Option<f32> {
        let n = self.cross();
        let a = self.corners()[0].as_dvec3();
        let t = range.clamp(n.dot(a - ray.origin.as_dvec3()) / n.dot(ray.direction.as_dvec3()));
        (t > 0.0).then_some(t)
    }
}
