//! Triangles and spheres, instances of meshes, the surfaces of all of them, and the rays that meet them.
//!
//! Triangle tests are watertight within a mesh and within the world's own triangles, hits at equal distance are decided
//! by the smaller id, and what a ray hits is the same whatever the tree. Coordinates up to about 1e18 m in magnitude
//! can be hit.
//!
//! Memory: a triangle takes 32 bytes, an eighth of a 320-byte block (which is about half full) and its share of a
//! 256-byte node (one for about twenty triangles); a vertex takes 24 bytes, and more with [`Attributes`]. An instance
//! takes 256 bytes, 56 bytes in a leaf and its share of a node, whatever its mesh.

mod attributes;
mod binary;
mod build;
mod bvh;
mod cluster;
mod coincident;
mod collapse;
mod corners;
mod horizon;
mod id;
mod instance;
mod mesh;
mod node;
mod offset;
mod packet;
mod parted;
mod query;
mod ray;
mod rays;
mod region;
mod same;
mod shells;
mod sphere;
#[cfg(test)]
mod tests;
mod triangle;

use std::collections::HashSet;

use glam::{Vec2, Vec3};

pub use self::{
    attributes::{Attributes, Interpolation, TangentFrame, UV_SETS, moved_tangent},
    build::BuildEffort,
    coincident::{Plane, Precedence, Rank, Role},
    horizon::{STEEPEST, lifted},
    id::{MaterialId, MeshId, PrimitiveId},
    instance::Placement,
    mesh::{Mesh, surface_of},
    offset::offset_origin,
    ray::Ray,
    rays::{Hits, RayColumns, Rays},
    shells::{Form, Shell, Shells},
};
use self::{
    binary::Primitives,
    bvh::Tree,
    coincident::Coincident,
    instance::Instance,
    node::{Primitive, Shape},
    sphere::Sphere,
};
use crate::sampling::warp;

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

impl Hit {
    /// A ray meets surfaces in the order of their distance, and at equal distance of their ids.
    #[inline]
    fn order(&self) -> (f32, PrimitiveId) {
        (self.t, self.primitive)
    }
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
    /// Barycentric coordinates of a triangle's second and third corner; zero on spheres.
    pub barycentric: Vec2,
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
    pub(crate) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether they have a point in common.
    pub(crate) fn meets(self, other: Self) -> bool {
        self.min.cmple(other.max).all() && self.max.cmpge(other.min).all()
    }
}

/// All primitives of a scene and the trees over them.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    world: Mesh,
    spheres: Vec<(Sphere, MaterialId)>,
    meshes: Vec<InstancedMesh>,
    instances: Vec<Instance>,
    effort: BuildEffort,
    tree: Option<Tree>,
    /// Of a built geometry in which surfaces coincide.
    coincident: Option<Box<Coincident>>,
}

/// A mesh that is kept once, with the tree over it.
#[derive(Clone, Debug)]
struct InstancedMesh {
    mesh: Mesh,
    bounds: Option<Bounds>,
    /// Of a built geometry.
    tree: Option<Tree>,
}

impl Geometry {
    /// Adds triangles with world-space corners; see [`Mesh::add_triangles`].
    ///
    /// # Panics
    /// As [`Mesh::add_triangles`]. Also after [`Self::build`].
    pub fn add_triangles(
        &mut self,
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        indices: &[[u32; 3]],
        material: MaterialId,
    ) {
        self.assert_unbuilt();
        self.world.add_triangles(positions, normals, indices, material);
    }

    /// Adds triangles in world space with attributes, the tangents among them in world space too; see
    /// [`Mesh::add_triangles_with`].
    ///
    /// # Panics
    /// As [`Mesh::add_triangles_with`]. Also after [`Self::build`].
    pub fn add_triangles_with(
        &mut self,
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        attributes: &Attributes,
        indices: &[[u32; 3]],
        material: MaterialId,
    ) {
        self.assert_unbuilt();
        self.world.add_triangles_with(positions, normals, attributes, indices, material);
    }

    /// Adds an analytic sphere; one of radius 0 is never hit.
    ///
    /// # Panics
    /// If a coordinate of the sphere's box is not finite, or the radius is negative. Also after [`Self::build`].
    pub fn add_sphere(&mut self, center: Vec3, radius: f32, material: MaterialId) {
        self.assert_unbuilt();
        let sphere = Sphere { center, radius };
        let Bounds { min, max } = sphere.bounds();
        assert!(radius >= 0.0 && min.is_finite() && max.is_finite(), "a sphere is finite");
        self.spheres.push((sphere, material));
    }

    /// Adds a mesh to be placed by [`Self::add_instance`]. By itself it is nowhere.
    ///
    /// # Panics
    /// After [`Self::build`].
    pub fn add_mesh(&mut self, mesh: Mesh) -> MeshId {
        self.assert_unbuilt();
        let id = MeshId(u32::try_from(self.meshes.len()).expect("fewer than 2³² meshes"));
        let bounds = mesh.bounds();
        self.meshes.push(InstancedMesh { mesh, bounds, tree: None });
        id
    }

    /// Places a mesh. Its triangles become primitives of their own, named by [`PrimitiveId::of`] this instance's
    /// number.
    ///
    /// # Panics
    /// If the mesh's world-space box ([`Self::placed_bounds`]) is not finite. Also after [`Self::build`].
    pub fn add_instance(&mut self, mesh: MeshId, placement: Placement) {
        self.assert_unbuilt();
        // A mesh without triangles has no box; an instance of it would be nothing, and is.
        let Some(bounds) = self.placed_bounds(mesh, &placement) else { return };
        assert!(bounds.min.is_finite() && bounds.max.is_finite(), "an instance is finite");
        self.instances.push(Instance::new(mesh.0, placement, bounds));
    }

    /// A world-space box around a mesh as it would be placed; `None` if it has no triangles. Not finite if it reaches
    /// beyond the range of f32.
    pub fn placed_bounds(&self, mesh: MeshId, placement: &Placement) -> Option<Bounds> {
        self.meshes[mesh.0 as usize].bounds.map(|bounds| placement.bounds(bounds))
    }

    /// Drops triangles that no light can tell from others, so that rays, lights and densities know the same ones: of
    /// triangles with the same corners, in whatever order, those after one of their own material, and those that come,
    /// in the order of their [`Rank`], after one that is `opaque`; and second instances of a mesh in the same place.
    /// Ids change. A mesh's triangles are not compared with those of the world.
    ///
    /// What coincides otherwise is left to [`Self::find_coincident`]; this makes the most common case cost nothing.
    ///
    /// # Panics
    /// After [`Self::build`].
    pub fn drop_copies(&mut self, opaque: impl Fn(MaterialId) -> bool, role: impl Fn(MaterialId) -> Role) {
        self.assert_unbuilt();
        self.world.drop_copies(&opaque, &role);
        self.meshes.iter_mut().for_each(|m| m.mesh.drop_copies(&opaque, &role));
        let mut seen = HashSet::new();
        self.instances.retain(|i| seen.insert((i.mesh, i.placement.to_world().to_cols_array().map(f64::to_bits))));
    }

    /// Sets how much time [`Self::build`] takes; [`BuildEffort::Best`] unless something else is said. No hit depends on
    /// it.
    ///
    /// # Panics
    /// After [`Self::build`].
    pub fn set_effort(&mut self, effort: BuildEffort) {
        self.assert_unbuilt();
        self.effort = effort;
    }

    /// Sets the effort by which so many samples of pixels, the trees included, are likely to be there first.
    ///
    /// # Panics
    /// After [`Self::build`].
    pub fn set_effort_for(&mut self, samples: u64) {
        let meshes = self.meshes.iter().map(|m| u64::from(m.mesh.len()));
        let triangles = u64::from(self.world.len()) + meshes.sum::<u64>();
        self.set_effort(BuildEffort::for_work(triangles, samples));
    }

    /// Builds the trees. Nothing may be added afterwards; ids are final from here on.
    ///
    /// # Panics
    /// With 2³² − 2 primitives in world space or instances, or more.
    pub fn build(&mut self) {
        let count = self.world.len() as usize + self.spheres.len();
        assert!(count.max(self.instances.len()) < u32::MAX as usize - 1, "fewer than 2³² − 2 primitives");
        let (world, effort) = (self.world_len(), self.effort);
        let get = |i: u32| match i.checked_sub(world) {
            None => Primitive { shape: self.shape(i), index: i },
            Some(number) => Primitive { shape: Shape::Instance(self.instances[number as usize].bounds), index: number },
        };
        let count = world.checked_add(self.instance_count()).expect("fewer than 2³² primitives and instances");
        self.tree = Some(build::build(&Primitives { triangles: self.world.len(), count, get: &get }, effort));
        for InstancedMesh { mesh, tree, .. } in &mut self.meshes {
            let get = |index| Primitive { shape: Shape::Triangle(mesh.triangle(index)), index };
            *tree = Some(build::build(&Primitives { triangles: mesh.len(), count: mesh.len(), get: &get }, effort));
        }
    }

    /// The number of primitives in world space; their ids are [`PrimitiveId::world`] of 0…n−1.
    pub fn world_len(&self) -> u32 {
        self.world.len() + self.spheres.len() as u32
    }

    /// The number of triangles, those of instances counted as often as they are there.
    pub fn triangle_count(&self) -> u64 {
        let instanced = self.instances.iter().map(|i| u64::from(self.meshes[i.mesh as usize].mesh.len()));
        u64::from(self.world.len()) + instanced.sum::<u64>()
    }

    /// The number of spheres.
    pub fn sphere_count(&self) -> u32 {
        self.spheres.len() as u32
    }

    /// The number of instances.
    pub fn instance_count(&self) -> u32 {
        self.instances.len() as u32
    }

    /// Whether there are no primitives.
    pub fn is_empty(&self) -> bool {
        self.world_len() == 0 && self.instances.is_empty()
    }

    /// The box around everything, `None` if there is nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        let primitives = (0..self.world_len()).map(|i| Primitive { shape: self.shape(i), index: i }.bounds());
        primitives.chain(self.instances.iter().map(|i| i.bounds)).reduce(Bounds::union)
    }

    /// The primitives with an area and a material that `wanted` picks, in the order of their ids. Of every mesh's
    /// instances, those picked are the same, in the same order.
    pub fn with_material(&self, wanted: &impl Fn(MaterialId) -> bool) -> impl Iterator<Item = PrimitiveId> {
        let world = (0..self.world_len()).map(PrimitiveId::world);
        let world = world.filter(|&id| wanted(self.material(id)) && self.area(id) > 0.0);
        let of_mesh = |m: &InstancedMesh| -> Vec<u32> {
            (0..m.mesh.len()).filter(|&i| wanted(m.mesh.material(i)) && !m.mesh.triangle(i).is_degenerate()).collect()
        };
        let picked: Vec<Vec<u32>> = self.meshes.iter().map(of_mesh).collect();
        let instances = (0..self.instance_count()).flat_map(move |n| {
            let indices = picked[self.mesh_of(n).0 as usize].clone();
            indices.into_iter().map(move |i| PrimitiveId::of(n, i))
        });
        world.chain(instances)
    }

    /// The surface where `ray` hit.
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        match self.sphere(hit.primitive) {
            None => self.triangle_surface(hit.primitive, hit.barycentric),
            Some((sphere, _)) => {
                let p = ray.origin.as_dvec3() + f64::from(hit.t) * ray.direction.as_dvec3();
                sphere_surface(sphere.point(p - sphere.center.as_dvec3()))
            }
        }
    }

    /// The material of a primitive.
    #[inline(always)]
    pub fn material(&self, primitive: PrimitiveId) -> MaterialId {
        match (primitive.instance(), self.sphere(primitive)) {
            (Some(number), _) => self.instance(number).1.material(primitive.index),
            (None, Some((_, material))) => *material,
            (None, None) => self.world.material(primitive.index),
        }
    }

    /// The triangles that [`Self::drop_copies`] has dropped in favour of this one: the material of each, and whether
    /// its front is this one's back.
    pub fn copies(&self, primitive: PrimitiveId) -> impl Iterator<Item = (MaterialId, bool)> {
        let mesh = primitive.instance().map_or(&self.world, |number| self.instance(number).1);
        mesh.copies(primitive.index)
    }

    /// The area of a primitive, m².
    pub fn area(&self, primitive: PrimitiveId) -> f32 {
        match (primitive.instance(), self.sphere(primitive)) {
            (Some(number), _) => {
                let (instance, mesh) = self.instance(number);
                instance.area(mesh, primitive.index)
            }
            (None, Some((sphere, _))) => sphere.area(),
            (None, None) => self.world.triangle(primitive.index).area(),
        }
    }

    /// A box around a primitive.
    pub fn bounds_of(&self, primitive: PrimitiveId) -> Bounds {
        match (primitive.instance(), self.sphere(primitive)) {
            (Some(number), _) => {
                let (instance, mesh) = self.instance(number);
                instance.bounds_of(mesh, primitive.index)
            }
            (None, Some((sphere, _))) => sphere.bounds(),
            (None, None) => self.world.triangle(primitive.index).bounds(),
        }
    }

    /// Whether the primitive is an analytic sphere.
    #[inline(always)]
    pub fn is_sphere(&self, primitive: PrimitiveId) -> bool {
        self.sphere(primitive).is_some()
    }

    /// A point of the primitive, uniform in area (density 1/area).
    #[inline(always)]
    pub fn sample(&self, primitive: PrimitiveId, u: Vec2) -> Surface {
        match self.sphere(primitive) {
            None => self.triangle_surface(primitive, warp::triangle(u.to_array()).into()),
            Some((sphere, _)) => sphere_surface(sphere.point(warp::sphere(u).as_dvec3())),
        }
    }

    /// The surface at the barycentric coordinates `b` of a triangle; `None` for a sphere.
    pub fn surface_at(&self, primitive: PrimitiveId, b: Vec2) -> Option<Surface> {
        (!self.is_sphere(primitive)).then(|| self.triangle_surface(primitive, b))
    }

    /// The vertex attributes at the barycentric coordinates `b` of a triangle; a sphere has none.
    #[inline]
    pub fn attributes(&self, primitive: PrimitiveId, b: Vec2) -> Interpolation<'_> {
        match primitive.instance() {
            None => self.world.attributes(primitive.index, b),
            Some(number) => self.instance(number).1.attributes(primitive.index, b),
        }
    }

    /// The axes of a normal texture there, in world space; `None` without tangents. A mesh without normals takes its
    /// N_g.
    pub fn tangent_frame(&self, primitive: PrimitiveId, surface: &Surface) -> Option<TangentFrame> {
        let at = self.attributes(primitive, surface.barycentric);
        let tangents = at.tangents()?;
        let Some(number) = primitive.instance() else {
            let normals = self.world.corner_normals(primitive.index).unwrap_or_default();
            return at.frame(tangents, normals, surface.normal);
        };
        let (instance, mesh) = self.instance(number);
        let normals = mesh.corner_normals(primitive.index).unwrap_or_default().map(|n| instance.normal(n));
        at.frame(tangents.map(|t| instance.tangent(t)), normals, surface.normal)
    }

    /// The number of meshes that are kept for instances.
    pub fn mesh_count(&self) -> usize {
        self.meshes.len()
    }

    /// A mesh that is kept for instances.
    pub fn mesh(&self, id: MeshId) -> &Mesh {
        &self.meshes[id.0 as usize].mesh
    }

    /// The mesh that an instance shows.
    pub fn mesh_of(&self, instance: u32) -> MeshId {
        MeshId(self.instances[instance as usize].mesh)
    }

    /// The number of triangles in world space: the first primitives.
    pub(super) fn world_triangles(&self) -> u32 {
        self.world.len()
    }

    /// The corners of a triangle in world space, and N_g.
    pub(super) fn world_triangle(&self, index: u32) -> ([Vec3; 3], Vec3) {
        (self.world.triangle(index).corners(), self.world.normal(index))
    }

    /// The normals of its corners; `None` where it is flat.
    pub(super) fn world_normals(&self, index: u32) -> Option<[Vec3; 3]> {
        self.world.corner_normals(index)
    }

    fn assert_unbuilt(&self) {
        assert!(self.tree.is_none(), "primitives come before build()");
    }

    #[inline]
    fn tree(&self) -> Option<&Tree> {
        assert!(self.tree.is_some() || self.is_empty(), "build() comes before rays");
        self.tree.as_ref()
    }

    /// The shape of a primitive in world space.
    fn shape(&self, index: u32) -> Shape {
        match self.sphere(PrimitiveId::world(index)) {
            None => Shape::Triangle(self.world.triangle(index)),
            Some((sphere, _)) => Shape::Sphere(*sphere),
        }
    }

    /// The sphere that the primitive is, unless it is a triangle.
    #[inline(always)]
    fn sphere(&self, primitive: PrimitiveId) -> Option<&(Sphere, MaterialId)> {
        let index = primitive.index_in(PrimitiveId::WORLD).checked_sub(self.world.len())?;
        self.spheres.get(index as usize)
    }

    #[inline]
    fn instance(&self, number: u32) -> (&Instance, &Mesh) {
        let instance = &self.instances[number as usize];
        (instance, &self.meshes[instance.mesh as usize].mesh)
    }

    #[inline(always)]
    fn triangle_surface(&self, primitive: PrimitiveId, b: Vec2) -> Surface {
        match primitive.instance() {
            None => self.world.surface(primitive.index, b),
            Some(number) => {
                let (instance, mesh) = self.instance(number);
                instance.surface(mesh, primitive.index, b)
            }
        }
    }
}

fn sphere_surface((position, normal, error): (Vec3, Vec3, f32)) -> Surface {
    Surface { position, normal, shading_normal: normal, error, barycentric: Vec2::ZERO }
}
