//! What a primitive is by itself: a triangle's corners, or a sphere.

use glam::{DVec3, Vec2, Vec3};

use super::{Geometry, PrimitiveId, Surface, sphere_surface};

impl Geometry {
    /// The surface at the barycentric coordinates `b` of what is known to be a triangle.
    #[inline(always)]
    pub(in crate::scene) fn surface_at_place(&self, triangle: PrimitiveId, b: Vec2) -> Surface {
        self.triangle_surface(triangle, b)
    }

    /// The centre and the radius of a sphere; `None` of a triangle.
    #[inline(always)]
    pub(in crate::scene) fn sphere_of(&self, primitive: PrimitiveId) -> Option<(Vec3, f32)> {
        self.sphere(primitive).map(|(sphere, _)| (sphere.center, sphere.radius))
    }

    /// The surface of a sphere in this direction from its centre.
    pub(in crate::scene) fn surface_of_sphere(&self, primitive: PrimitiveId, towards: DVec3) -> Surface {
        let (sphere, _) = self.sphere(primitive).expect("a sphere");
        sphere_surface(sphere.point(towards))
    }

    /// The corners of a triangle in world space.
    #[inline(always)]
    pub(in crate::scene) fn corners(&self, triangle: PrimitiveId) -> [Vec3; 3] {
        match triangle.instance() {
            None => self.world.triangle(triangle.index).corners(),
            Some(number) => {
                let (instance, mesh) = self.instance(number);
                instance.corners(mesh, triangle.index)
            }
        }
    }
}
