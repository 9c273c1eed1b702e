//! Placed meshes: the transformation between a mesh's space and the world, for rays on their way in and surfaces on
//! their way out.
//!
//! Both ways are computed in f64 and rounded once. A ray keeps its parameter t, so hits in different spaces compare.

use glam::{DAffine3, DMat3, DVec3, Mat3, Vec2, Vec3, Vec4};

use super::{
    Bounds, Surface,
    attributes::moved_tangent,
    mesh::{Mesh, shading_normal},
    ray::{Interval, Prepared, Ray},
    region::Region,
};

/// An affine transformation that can place a mesh: what it does to rays can be undone without losing much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    to_world: DAffine3,
    to_object: DAffine3,
}

impl Placement {
    /// The most that a placement may stretch one direction against another, in the Frobenius norm (√3·√3 = 3 for a
    /// rotation). A direction's rounding in object space grows by this in the world.
    const MAX_CONDITION: f64 = 3000.0;

    /// The largest factor of scale, and the inverse of the smallest: t and the inverse of a direction stay in f32's
    /// range.
    const MAX_SCALE: f64 = 1e6;

    /// The transformation `to_world`, mirrored or not, uniform or not. `None` if it is not finite, scales by more than
    /// 10⁶ either way, or is so flat that a mesh has to be transformed vertex by vertex instead.
    pub fn new(to_world: DAffine3) -> Option<Self> {
        let to_object = to_world.inverse();
        let norm = |m: DMat3| m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        let (there, back) = (norm(to_world.matrix3), norm(to_object.matrix3));
        let usable = to_world.is_finite()
            && to_object.is_finite()
            && there * back <= Self::MAX_CONDITION
            && there.max(back) <= 2.0 * Self::MAX_SCALE;
        usable.then_some(Self { to_world, to_object })
    }

    /// From the mesh's space to the world.
    pub fn to_world(&self) -> DAffine3 {
        self.to_world
    }

    /// A world-space box that contains everything in the object-space box `b`, with a margin for the rounding of rays.
    pub fn bounds(&self, b: Bounds) -> Bounds {
        let corner = |i: u32| {
            let pick = |k: usize| f64::from(if i >> k & 1 == 0 { b.min[k] } else { b.max[k] });
            self.to_world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        };
        let corners: [DVec3; 8] = std::array::from_fn(|i| corner(i as u32));
        let (min, max) = corners.iter().fold((corners[0], corners[0]), |(min, max), &c| (min.min(c), max.max(c)));
        let margin = 2.0 * self.rounding(b.min.abs().max(b.max.abs()), min.abs().max(max.abs()));
        Bounds { min: (min - margin).as_vec3(), max: (max + margin).as_vec3() }
    }

    /// A bound on what rounding world coordinates of magnitude `world` and object coordinates of magnitude `object` to
    /// f32 moves a point, per coordinate in world space. Four times what one rounding of each makes, so that points
    /// next to the given one are covered as well, and the rounding of a segment that ends there.
    fn rounding(&self, object: Vec3, world: DVec3) -> DVec3 {
        let m = self.to_world.matrix3;
        let abs = DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
        2.0 * f64::from(f32::EPSILON) * (world.abs() + abs * object.abs().as_dvec3())
    }

    /// A bound on the error of surfaces whose coordinates are at most these.
    pub(super) fn error(&self, object: Vec3, world: Vec3) -> f32 {
        self.rounding(object, world.as_dvec3()).max_element() as f32
    }

    /// A bound on how much longer anything is in the mesh's space than in the world.
    pub(super) fn shrinking(&self) -> f64 {
        self.to_object.matrix3.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}

/// A mesh in its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    pub mesh: u32,
    pub placement: Placement,
    /// The world-space box.
    pub bounds: Bounds,
    /// The inverse transpose, for normals. It needs no care for mirroring: the front stays the front.
    normals: Mat3,
}

impl Instance {
    pub fn new(mesh: u32, placement: Placement, bounds: Bounds) -> Self {
        let m = placement.to_object.matrix3.transpose();
        // Of any size, so that f32 holds it well.
        let size = m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
        Self { mesh, placement, bounds, normals: (m * (1.0 / size)).as_mat3() }
    }

    /// The world-space ray `ray` in the mesh's space, with the same parameter.
    #[inline]
    pub fn object_ray(&self, ray: &Prepared) -> Prepared {
        let to_object = &self.placement.to_object;
        Prepared::new(&Ray {
            origin: to_object.transform_point3(ray.origin.as_dvec3()).as_vec3(),
            direction: (to_object.matrix3 * ray.direction.as_dvec3()).as_vec3(),
            t_max: f32::INFINITY,
        })
    }

    /// Where the world-space ray is in the instance's box; hits are pulled into it as those of a primitive into its
    /// own.
    #[inline]
    pub fn clip(&self, ray: &Prepared) -> Interval {
        ray.clip(self.bounds)
    }

    /// The world-space surface at the barycentric coordinates `b` of a triangle of `mesh`.
    ///
    /// The position is rounded once here; a ray that leaves it is rounded once more on its way back into the mesh's
    /// space, and the bound on the error covers both.
    pub fn surface(&self, mesh: &Mesh, index: u32, b: Vec2) -> Surface {
        let triangle = mesh.triangle(index);
        let object = triangle.point_f64(b);
        let world = self.placement.to_world.transform_point3(object);
        let error = self.placement.rounding(object.as_vec3(), world).max_element() as f32;
        let cofactors = self.placement.to_object.matrix3.transpose();
        let normal = (cofactors * triangle.cross()).try_normalize();
        let normal = normal.map_or(Vec3::Z, |n| n.as_vec3());
        let corners = mesh.corner_normals(index).map(|corners| corners.map(|n| self.normal(n)));
        let shading_normal = shading_normal(corners, b, normal);
        Surface { position: world.as_vec3(), normal, shading_normal, error, barycentric: b }
    }

    /// A point of the mesh in world space.
    pub fn in_world(&self, p: Vec3) -> DVec3 {
        self.placement.to_world.transform_point3(p.as_dvec3())
    }

    /// A region of the mesh's space around everything no further than `slack` from a world-space triangle.
    pub fn region_of_face(&self, corners: [DVec3; 3], slack: f32) -> Region {
        let [a, b, c] = corners.map(|p| self.placement.to_object.transform_point3(p));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Region::of_face([a, b, c], normal, slack * self.placement.shrinking() as f32)
    }

    /// A region of the mesh's space around everything no further than `slack` from a world-space box.
    pub fn region_of_box(&self, b: Bounds, slack: f32) -> Region {
        let corner =
            |i: u32| Vec3::from_array(std::array::from_fn(|k| if i >> k & 1 == 0 { b.min[k] } else { b.max[k] }));
        let corners = (0..8).map(|i| self.placement.to_object.transform_point3(corner(i).as_dvec3()).as_vec3());
        let bounds = corners.map(|p| Bounds { min: p, max: p }).reduce(Bounds::union).expect("eight corners");
        Region::around(bounds, slack * self.placement.shrinking() as f32)
    }

    /// A vertex normal in world space; zero stays zero.
    pub fn normal(&self, n: Vec3) -> Vec3 {
        (self.normals * n).normalize_or_zero()
    }

    /// A vertex tangent in world space.
    pub fn tangent(&self, t: Vec4) -> Vec4 {
        moved_tangent(self.placement.to_world.matrix3, t)
    }

    /// The corners of a triangle of `mesh` in world space.
    pub fn corners(&self, mesh: &Mesh, index: u32) -> [Vec3; 3] {
        mesh.triangle(index).corners().map(|p| self.placement.to_world.transform_point3(p.as_dvec3()).as_vec3())
    }

    /// The world-space box around a triangle of `mesh`.
    pub fn bounds_of(&self, mesh: &Mesh, index: u32) -> Bounds {
        let [a, b, c] = self.corners(mesh, index);
        Bounds { min: a.min(b).min(c), max: a.max(b).max(c) }
    }

    /// The world-space area of a triangle of `mesh`, m²; positive if the triangle has one in its own space.
    pub fn area(&self, mesh: &Mesh, index: u32) -> f32 {
        let [u, v] = mesh.triangle(index).edges().map(|e| self.placement.to_world.matrix3 * e);
        let area = (0.5 * u.cross(v).length()) as f32;
        if mesh.triangle(index).is_degenerate() { 0.0 } else { area.max(f32::MIN_POSITIVE) }
    }
}
