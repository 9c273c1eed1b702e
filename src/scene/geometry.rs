//! Triangles and spheres: their storage, their surfaces and the rays that meet them.

use glam::{Vec2, Vec3};

use super::material::MaterialId;

/// The index of a primitive of the scene: triangles first, then spheres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PrimitiveId(pub u32);

impl PrimitiveId {
    /// No primitive.
    pub const NONE: Self = Self(u32::MAX);
}

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

/// Where a ray meets a primitive.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// The distance along the ray in multiples of its direction.
    pub t: f32,
    /// What was hit.
    pub primitive: PrimitiveId,
    /// Barycentric coordinates of a triangle's second and third corner; unused for spheres.
    pub barycentric: Vec2,
}

/// The surface at a point of a primitive.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// The position, recomputed on the primitive (not along the ray), metres.
    pub position: Vec3,
    /// N_g: unit, by the winding of a triangle (counter-clockwise seen from the front), outward of a sphere.
    pub normal: Vec3,
    /// N_s: unit, interpolated where the mesh has normals, and flipped to the side of N_g.
    pub shading_normal: Vec3,
    /// A bound on the rounding error of each coordinate of `position`.
    pub error: f32,
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The lower corner.
    pub min: Vec3,
    /// The upper corner.
    pub max: Vec3,
}

/// All primitives of a scene and the tree over them.
#[derive(Clone, Debug, Default)]
pub struct Geometry {}

impl Geometry {
    /// Adds triangles with world-space corners, optional per-corner-vertex normals, and indices into both.
    ///
    /// # Panics
    /// If an index is out of range, `normals` has another length than `positions`, or a coordinate is not finite:
    /// readers of files check these first and say where.
    pub fn add_triangles(
        &mut self,
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        indices: &[[u32; 3]],
        material: MaterialId,
    ) {
        let _ = (positions, normals, indices, material);
    }
    /// Adds an analytic sphere.
    pub fn add_sphere(&mut self, center: Vec3, radius: f32, material: MaterialId) {
        let _ = (center, radius, material);
    }
    /// Builds the tree. No primitive may be added afterwards.
    pub fn build(&mut self) {}
    /// The number of primitives; their ids are 0…n−1.
    pub fn len(&self) -> u32 {
        0
    }
    /// number of triangles.
    pub fn triangle_count(&self) -> u32 {
        0
    }
    /// number of spheres.
    pub fn sphere_count(&self) -> u32 {
        0
    }
    /// Whether there are no primitives.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The box around everything, `None` if there is nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        None
    }
    /// The closest hit, not counting `skip` if that is a flat primitive (a sphere may be hit again from inside).
    pub fn closest(&self, ray: &Ray, skip: PrimitiveId) -> Option<Hit> {
        let _ = (ray, skip);
        None
    }
    /// Whether anything but the two flat primitives in `skip` lies on the segment.
    pub fn occluded(&self, ray: &Ray, skip: [PrimitiveId; 2]) -> bool {
        let _ = (ray, skip);
        false
    }
    /// The surface where `ray` hit.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let _ = (ray, hit);
        unimplemented!()
    }
    /// The material of a primitive.
    pub fn material(&self, primitive: PrimitiveId) -> MaterialId {
        let _ = primitive;
        MaterialId(0)
    }
    /// The area of a primitive, m².
    pub fn area(&self, primitive: PrimitiveId) -> f32 {
        let _ = primitive;
        0.0
    }
    /// A point of the primitive, uniform in area (density 1/area).
    pub fn sample(&self, primitive: PrimitiveId, u: Vec2) -> Surface {
        let _ = (primitive, u);
        unimplemented!()
    }
}

/// Placeholder.
pub fn offset_origin(position: Vec3, normal: Vec3, error: f32, direction: Vec3) -> Vec3 { let _ = (normal, error, direction); position }
