//! Triangles and spheres: their storage, their surfaces and the rays that meet them.
//!
//! Triangle tests are watertight, hits at equal distance are decided by the smaller id, and what a ray hits is the
//! same whatever the tree. Coordinates up to about 1e18 m in magnitude can be hit.
//!
//! Memory: a triangle takes 16 bytes of indices, 44 bytes in a leaf and its share of a 64-byte node (one for about
//! two or three triangles); a vertex takes 24 bytes.

mod build;
mod bvh;
mod offset;
mod ray;
mod sphere;
#[cfg(test)]
mod tests;
mod triangle;

use glam::{Vec2, Vec3};

use self::{
    bvh::{LeafPrimitive, Shape, Tree},
    sphere::Sphere,
    triangle::Triangle,
};
pub use self::{offset::offset_origin, ray::Ray};
use super::material::MaterialId;
use crate::sampling::warp;

/// The index of a primitive of the scene: triangles first, then spheres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PrimitiveId(pub u32);

impl PrimitiveId {
    /// No primitive.
    pub const NONE: Self = Self(u32::MAX);
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

impl Bounds {
    /// The smallest box around both.
    fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
}

/// All primitives of a scene and the tree over them.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    positions: Vec<Vec3>,
    /// As long as `positions`; zero where a mesh has no normals.
    normals: Vec<Vec3>,
    triangles: Vec<IndexedTriangle>,
    spheres: Vec<(Sphere, MaterialId)>,
    tree: Option<Tree>,
}

#[derive(Clone, Copy, Debug)]
struct IndexedTriangle {
    corners: [u32; 3],
    material: MaterialId,
}

impl Geometry {
    /// Adds triangles with world-space corners, optional per-corner-vertex normals, and indices into both. A triangle
    /// whose corners lie on one line has an id and an area of zero, and is never hit.
    ///
    /// # Panics
    /// If an index is out of range, `normals` has another length than `positions`, or a coordinate is not finite:
    /// readers of files check these first and say where. Also after [`Self::build`].
    pub fn add_triangles(
        &mut self,
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        indices: &[[u32; 3]],
        material: MaterialId,
    ) {
        assert!(self.tree.is_none(), "primitives come before build()");
        assert!(positions.iter().all(|p| p.is_finite()), "positions are finite");
        assert!(indices.as_flattened().iter().all(|&i| (i as usize) < positions.len()), "indices are in range");
        let base = u32::try_from(self.positions.len()).expect("fewer than 2³² vertices");
        self.positions.extend_from_slice(positions);
        u32::try_from(self.positions.len()).expect("fewer than 2³² vertices");
        match normals {
            Some(normals) => {
                assert_eq!(normals.len(), positions.len(), "one normal per position");
                assert!(normals.iter().all(|n| n.is_finite()), "normals are finite");
                self.normals.extend_from_slice(normals);
            }
            None => self.normals.resize(self.positions.len(), Vec3::ZERO),
        }
        let shifted = indices.iter().map(|t| IndexedTriangle { corners: t.map(|i| base + i), material });
        self.triangles.extend(shifted);
    }

    /// Adds an analytic sphere; one of radius 0 is never hit.
    ///
    /// # Panics
    /// If a coordinate of the sphere's box is not finite, or the radius is negative. Also after [`Self::build`].
    pub fn add_sphere(&mut self, center: Vec3, radius: f32, material: MaterialId) {
        assert!(self.tree.is_none(), "primitives come before build()");
        let sphere = Sphere { center, radius };
        let Bounds { min, max } = sphere.bounds();
        assert!(radius >= 0.0 && min.is_finite() && max.is_finite(), "a sphere is finite");
        self.spheres.push((sphere, material));
    }

    /// Builds the tree. No primitive may be added afterwards; ids are final from here on.
    ///
    /// # Panics
    /// With 2³² − 1 primitives or more.
    pub fn build(&mut self) {
        assert!(self.triangles.len() + self.spheres.len() < u32::MAX as usize, "fewer than 2³² − 1 primitives");
        let primitives = (0..self.len()).map(PrimitiveId).map(|id| LeafPrimitive { shape: self.shape(id), id });
        self.tree = Some(build::build(primitives.collect()));
    }

    /// The number of primitives; their ids are 0…n−1.
    pub fn len(&self) -> u32 {
        self.triangle_count() + self.sphere_count()
    }

    /// The number of triangles.
    pub fn triangle_count(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// The number of spheres.
    pub fn sphere_count(&self) -> u32 {
        self.spheres.len() as u32
    }

    /// Whether there are no primitives.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The box around everything, `None` if there is nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        (0..self.len()).map(|i| self.shape(PrimitiveId(i)).bounds()).reduce(Bounds::union)
    }

    /// The closest hit, not counting `skip` if that is a flat primitive (a sphere may be hit again from inside).
    /// Of several hits at the same distance it is the one with the smallest id.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    pub fn closest(&self, ray: &Ray, skip: PrimitiveId) -> Option<Hit> {
        self.tree()?.closest(ray, skip)
    }

    /// Whether anything but the two flat primitives in `skip` lies on the segment.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    pub fn occluded(&self, ray: &Ray, skip: [PrimitiveId; 2]) -> bool {
        self.tree().is_some_and(|tree| tree.occluded(ray, skip))
    }

    /// The surface where `ray` hit.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        match self.shape(hit.primitive) {
            Shape::Triangle(triangle) => self.triangle_surface(hit.primitive, triangle, hit.barycentric),
            Shape::Sphere(sphere) => {
                let p = ray.origin.as_dvec3() + f64::from(hit.t) * ray.direction.as_dvec3();
                sphere_surface(sphere.point(p - sphere.center.as_dvec3()))
            }
        }
    }

    /// The material of a primitive.
    pub fn material(&self, primitive: PrimitiveId) -> MaterialId {
        match self.triangles.get(primitive.0 as usize) {
            Some(t) => t.material,
            None => self.sphere(primitive).1,
        }
    }

    /// The area of a primitive, m².
    pub fn area(&self, primitive: PrimitiveId) -> f32 {
        match self.shape(primitive) {
            Shape::Triangle(t) => t.area(),
            Shape::Sphere(s) => s.area(),
        }
    }

    /// A point of the primitive, uniform in area (density 1/area).
    pub fn sample(&self, primitive: PrimitiveId, u: Vec2) -> Surface {
        match self.shape(primitive) {
            Shape::Triangle(t) => self.triangle_surface(primitive, t, warp::triangle(u)),
            Shape::Sphere(s) => sphere_surface(s.point(warp::sphere(u).as_dvec3())),
        }
    }

    fn tree(&self) -> Option<&Tree> {
        assert!(self.tree.is_some() || self.is_empty(), "build() comes before rays");
        self.tree.as_ref()
    }

    fn shape(&self, primitive: PrimitiveId) -> Shape {
        match self.triangles.get(primitive.0 as usize) {
            Some(t) => Shape::Triangle(Triangle::new(t.corners.map(|i| self.positions[i as usize]))),
            None => Shape::Sphere(self.sphere(primitive).0),
        }
    }

    fn sphere(&self, primitive: PrimitiveId) -> (Sphere, MaterialId) {
        self.spheres[primitive.0 as usize - self.triangles.len()]
    }

    fn triangle_surface(&self, primitive: PrimitiveId, triangle: Triangle, b: Vec2) -> Surface {
        let (position, error) = triangle.point(b);
        let normal = triangle.normal();
        let corners = self.triangles[primitive.0 as usize].corners;
        let [p, q, r] = corners.map(|i| self.normals[i as usize]);
        let interpolated = p * (1.0 - b.x - b.y) + q * b.x + r * b.y;
        let shading_normal = match interpolated.try_normalize() {
            Some(n) if n.dot(normal) < 0.0 => -n,
            Some(n) => n,
            None => normal,
        };
        Surface { position, normal, shading_normal, error }
    }
}

fn sphere_surface((position, normal, error): (Vec3, Vec3, f32)) -> Surface {
    Surface { position, normal, shading_normal: normal, error }
}
