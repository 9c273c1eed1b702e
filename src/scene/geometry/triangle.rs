//! Triangles: the watertight intersection test and their measures.

use glam::{DVec3, Vec2, Vec3};

use super::{Bounds, ray::Prepared};

/// A triangle's corners, stored where the ray finds them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Triangle(pub [[f32; 3]; 3]);

impl Triangle {
    pub fn new(corners: [Vec3; 3]) -> Self {
        Self(corners.map(|p| p.to_array()))
    }

    fn corners(&self) -> [Vec3; 3] {
        self.0.map(Vec3::from_array)
    }

    pub fn bounds(&self) -> Bounds {
        let [a, b, c] = self.corners();
        Bounds { min: a.min(b).min(c), max: a.max(b).max(c) }
    }

    /// The edges from the first corner to the second and the third.
    pub fn edges(&self) -> [DVec3; 2] {
        let [a, b, c] = self.corners().map(|p| p.as_dvec3());
        [b - a, c - a]
    }

    /// The cross product of the edges: twice the area long, along N_g. In f64 it neither under- nor overflows, and is
    /// exactly zero where f32 corners lie on one line of moderate extent.
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

    /// The point with the given barycentric coordinates, and the bound γ₇ Σ|bᵢpᵢ| on the rounding of its coordinates
    /// (Pharr, Jakob & Humphreys, *Physically Based Rendering*, 6.8.4).
    pub fn point(&self, b: Vec2) -> (Vec3, f32) {
        const GAMMA_7: f32 = 7.0 * (f32::EPSILON / 2.0) / (1.0 - 7.0 * (f32::EPSILON / 2.0));
        let [p, q, r] = self.corners();
        let (p, q, r) = (p * (1.0 - b.x - b.y), q * b.x, r * b.y);
        (p + q + r, GAMMA_7 * (p.abs() + q.abs() + r.abs()).max_element())
    }

    /// The point with the given barycentric coordinates, on the triangle's plane to the precision of f64.
    pub fn point_f64(&self, b: Vec2) -> DVec3 {
        let [p, q, r] = self.corners().map(|p| p.as_dvec3());
        let b = b.as_dvec2();
        p * (1.0 - b.x - b.y) + q * b.x + r * b.y
    }

    /// Where the ray meets the triangle: t > 0 and the barycentric coordinates of the second and third corner.
    ///
    /// Woop, Benthin & Wald 2013, *Watertight Ray/Triangle Intersection*: the corners are sheared so that the ray
    /// becomes the z axis, and the signs of three 2D edge functions decide. An edge function of two corners is the
    /// exact negative of the same one with the corners exchanged (no fused multiply-add may break that), and zero
    /// counts as inside, so nothing passes between two triangles that share an edge.
    #[inline]
    pub fn intersect(&self, ray: &Prepared) -> Option<(f32, Vec2)> {
        let [x, y, z] = ray.axes;
        let o = ray.origin.to_array();
        let sheared = |p: &[f32; 3]| {
            let h = p[z] - o[z];
            ((p[x] - o[x]) - ray.shear[0] * h, (p[y] - o[y]) - ray.shear[1] * h)
        };
        let (ax, ay) = sheared(&self.0[0]);
        let (bx, by) = sheared(&self.0[1]);
        let (cx, cy) = sheared(&self.0[2]);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        if ((u < 0.0) | (v < 0.0) | (w < 0.0)) & ((u > 0.0) | (v > 0.0) | (w > 0.0)) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 || !det.is_finite() {
            return None;
        }
        let t = self.distance(ray)?;
        Some((t, Vec2::new(v / det, w / det)))
    }

    /// Where a ray that the edge functions let through meets the triangle's plane. In f64, so that the side of the
    /// plane on which the ray starts is decided without error; few candidates get here.
    fn distance(&self, ray: &Prepared) -> Option<f32> {
        let range = ray.clip(self.bounds());
        let n = self.cross();
        let a = Vec3::from_array(self.0[0]).as_dvec3();
        let t = n.dot(a - ray.origin.as_dvec3()) / n.dot(ray.direction.as_dvec3());
        let t = range.clamp(t);
        (range.near <= range.far && t > 0.0).then_some(t)
    }
}
