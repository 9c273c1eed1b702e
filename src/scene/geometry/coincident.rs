//! Coincident surfaces: faces of different triangles that lie in one plane, closer to each other than their rounding errors, and overlap.
//!
//! No ray can tell which of them comes first, and roundings would decide another way for rays of another direction. So one rule
//! says which surface is there: the one of the first [`Rank`]. It is asked at a place, without any direction, so that camera rays, light
//! paths and sampled points get the same answer.
//!
//! [`Geometry::find_coincident`] marks the triangles that have a coincident one anywhere. What is not marked costs a bit test,
//! and nothing where no triangle is marked. At a place of a marked triangle, a short segment along its normal finds the others.

use std::ops::ControlFlow;

use glam::{DVec3, Vec2, Vec3};

use super::{
    Bounds, Geometry, Hit, Instance, Mesh, PrimitiveId, Ray, Surface,
    bvh::{Region, Tree, Within},
    triangle::Triangle,
};

/// Which of coincident surfaces is there rather than others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Precedence {
    /// What emits, so that a lamp flush with a ceiling shines.
    Emitter,
    /// What lets no light through where it is.
    Opaque,
    /// What transmits. It comes last, so that no light gets through the table that a glass stands on.
    Transmitting,
}

/// What a material is among coincident surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Role {
    /// Whether it is there rather than others.
    pub precedence: Precedence,
    /// Whether it bounds a volume. Two such surfaces never hide each other: a hidden boundary would leave its volume open.
    pub bounds_volume: bool,
}

/// The order in which coincident surfaces are there: by precedence, then by id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rank(Precedence, PrimitiveId);

/// The plane of a triangle, near a point of it.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    primitive: PrimitiveId,
    position: Vec3,
    normal: Vec3,
    error: f32,
}

/// Of a geometry with coincident surfaces: which triangles have any.
#[derive(Clone, Debug)]
pub(super) struct Coincident {
    /// By material.
    roles: Vec<Role>,
    /// A bit for each of the world's triangles.
    world: Marks,
    /// By mesh, a bit for each of its triangles that has a coincident one in any of its places.
    meshes: Vec<Marks>,
    /// No two coincident surfaces are further apart, m.
    reach: f32,
}

/// A set of triangles.
#[derive(Clone, Debug)]
struct Marks(Vec<u64>);

impl Marks {
    fn none_of(count: u32) -> Self {
        Self(vec![0; count.div_ceil(64) as usize])
    }

    fn mark(&mut self, index: u32) {
        self.0[index as usize / 64] |= 1 << (index % 64);
    }

    fn mark_all(&mut self) {
        self.0.fill(u64::MAX);
    }

    fn has(&self, index: u32) -> bool {
        self.0.get(index as usize / 64).is_some_and(|word| word >> (index % 64) & 1 == 1)
    }

    fn is_empty(&self) -> bool {
        self.0.iter().all(|word| *word == 0)
    }
}

/// How far apart the planes of coincident surfaces may be, in units of the larger bound on the error along the normal. A ray's origin is
/// moved by 9/7 of that at most (the error and two floats: [`super::offset_origin`]), and must not get behind a surface that counts as
/// another one.
const OFFSET: f32 = 9.0 / 7.0;
/// What is found coincident when the scene is built stays so wherever it is asked later, whatever is rounded in between.
const MARGIN: f32 = 1.5;
/// Planes whose normals differ by more do not coincide, wherever they cross: cos 25°.
const PARALLEL: f32 = 0.9;
/// How many triangles may be compared to find what coincides among large instances, some seconds' worth. What is not compared counts as
/// marked, which costs time and changes nothing else.
const MOST_COMPARED: u64 = 1 << 25;

impl Geometry {
    /// Finds which surfaces coincide; `roles` is by material. Without this, none do.
    ///
    /// # Panics
    /// Before [`Self::build`].
    pub fn find_coincident(&mut self, roles: Vec<Role>) {
        let Some(tree) = self.tree() else { return };
        let mut found = Coincident {
            roles,
            world: Marks::none_of(self.world.len()),
            meshes: self.meshes.iter().map(|m| Marks::none_of(m.mesh.len())).collect(),
            reach: self.reach(),
        };
        mark_within(&self.world, tree, 0.0, &found.roles, &mut found.world);
        for (number, (m, marks)) in (0..).zip(self.meshes.iter().zip(&mut found.meshes)) {
            // Where it is placed, roundings of the world's coordinates come on top of its own.
            let placed = self.instances.iter().filter(|i| i.mesh == number);
            let placed = placed.filter_map(|i| Some(i.placement.shrinking() * f64::from(self.instance_error(i)?)));
            if let (Some(tree), error) = (&m.tree, placed.fold(0.0, f64::max)) {
                mark_within(&m.mesh, tree, error as f32, &found.roles, marks);
            }
        }
        let mut compared = 0;
        (0..self.instance_count()).for_each(|number| self.mark_around(number, &mut found, &mut compared));
        let any = !found.world.is_empty() || found.meshes.iter().any(|marks| !marks.is_empty());
        self.coincident = any.then(|| Box::new(found));
    }

    /// Whether any surfaces coincide.
    #[inline(always)]
    pub fn has_coincident(&self) -> bool {
        self.coincident.is_some()
    }

    /// Whether another surface may coincide with a part of this primitive. Never so for spheres.
    #[inline]
    pub fn may_coincide(&self, primitive: PrimitiveId) -> bool {
        let Some(found) = &self.coincident else { return false };
        match primitive.instance() {
            None => found.world.has(primitive.index) && primitive.index < self.world.len(),
            Some(number) => self
                .instances
                .get(number as usize)
                .is_some_and(|instance| found.meshes[instance.mesh as usize].has(primitive.index)),
        }
    }

    /// The rank of a primitive among those with which it coincides.
    ///
    /// # Panics
    /// If [`Self::find_coincident`] found none.
    pub fn rank(&self, primitive: PrimitiveId) -> Rank {
        Rank(self.role(primitive).precedence, primitive)
    }

    /// Calls `visit` with the other surfaces that are at `position` on the triangle `primitive`. They have no distance of their own:
    /// t is 0.
    #[inline(never)]
    pub fn coincident_at(&self, primitive: PrimitiveId, position: Vec3, mut visit: impl FnMut(Hit)) {
        let Some(found) = self.coincident.as_ref().filter(|_| self.may_coincide(primitive)) else { return };
        let plane = self.plane(primitive, position);
        let origin = position - found.reach * plane.normal;
        let ray = Ray { origin, direction: plane.normal, t_max: 2.0 * found.reach };
        let _ = self.crossings(&ray, [primitive, PrimitiveId::NONE], |hit| {
            if self.is_in(&plane, hit) {
                visit(Hit { t: 0.0, ..*hit });
            }
            ControlFlow::Continue(())
        });
    }

    /// The plane of a triangle near `position`, if anything may coincide with it.
    pub fn shared_plane(&self, primitive: PrimitiveId, position: Vec3) -> Option<Plane> {
        self.may_coincide(primitive).then(|| self.plane(primitive, position))
    }

    /// Whether a ray hits what coincides with the plane's triangle near the plane's position.
    pub fn is_in(&self, plane: &Plane, hit: &Hit) -> bool {
        let id = hit.primitive;
        if !self.may_coincide(id) || !compete(self.role(id), self.role(plane.primitive)) {
            return false;
        }
        let other = self.triangle_surface(id, hit.barycentric);
        let apart = plane.normal.dot(other.position - plane.position).abs();
        plane.normal.dot(other.normal).abs() > PARALLEL && apart <= MARGIN * plane.error.max(self.plane_error(id))
    }

    fn plane(&self, primitive: PrimitiveId, position: Vec3) -> Plane {
        let normal = self.triangle_surface(primitive, Vec2::ZERO).normal;
        Plane { primitive, position, normal, error: self.plane_error(primitive) }
    }

    /// A bound on how far roundings move a triangle's plane, or an origin that leaves it, along its normal, m.
    fn plane_error(&self, primitive: PrimitiveId) -> f32 {
        let at = |b: Vec2| {
            let Surface { error, normal, .. } = self.triangle_surface(primitive, b);
            OFFSET * error * normal.abs().element_sum()
        };
        at(Vec2::ZERO).max(at(Vec2::X)).max(at(Vec2::Y))
    }

    fn role(&self, primitive: PrimitiveId) -> Role {
        let found = self.coincident.as_ref().expect("surfaces that coincide");
        found.roles[self.material(primitive).0 as usize]
    }

    /// A bound on what [`Self::is_in`] allows for.
    fn reach(&self) -> f32 {
        let of_instances = self.instances.iter().filter_map(|i| self.instance_error(i));
        MARGIN * of_instances.fold(most_error(&self.world), f32::max)
    }

    /// A bound on [`Self::plane_error`] of an instance's triangles; `None` if there are none.
    fn instance_error(&self, instance: &Instance) -> Option<f32> {
        let size = |b: Bounds| b.min.abs().max(b.max.abs());
        let object = self.meshes[instance.mesh as usize].bounds?;
        Some(OFFSET * 3_f32.sqrt() * instance.placement.error(size(object), size(instance.bounds)))
    }

    /// Marks what coincides with instance `number`: in world space, and in later instances.
    fn mark_around(&self, number: u32, found: &mut Coincident, compared: &mut u64) {
        let (instance, mesh) = self.instance(number);
        let (Some(tree), Some(world)) = (&self.meshes[instance.mesh as usize].tree, &self.tree) else { return };
        let mut others = Vec::new();
        let mut pairs = Vec::new();
        let around = Region::around(instance.bounds, found.reach);
        let _ = world.within(&around, &mut |within| {
            match within {
                Within::Triangle { index, .. } => {
                    let id = PrimitiveId::world(index);
                    let face =
                        Face::of(self.world.triangle(index).corners().map(|p| p.as_dvec3()), self.plane_error(id));
                    self.mark_pairs(&face, id, (number, instance, mesh, tree), found, &mut pairs, compared);
                }
                Within::Instance { number: other } if other > number => others.push(other),
                Within::Instance { .. } => {}
            }
            ControlFlow::Continue(())
        });
        for other in others {
            let (placed, other_mesh) = self.instance(other);
            let Some(other_tree) = &self.meshes[placed.mesh as usize].tree else { continue };
            if *compared > MOST_COMPARED {
                found.meshes[instance.mesh as usize].mark_all();
                found.meshes[placed.mesh as usize].mark_all();
                continue;
            }
            let common = placed.region_of_box(instance.bounds, found.reach);
            let _ = other_tree.within(&common, &mut |within| {
                let Within::Triangle { index, .. } = within else { return ControlFlow::Continue(()) };
                let id = PrimitiveId::of(other, index);
                let corners = other_mesh.triangle(index).corners();
                let face = Face::of(corners.map(|p| placed.in_world(p)), self.plane_error(id));
                *compared += 1;
                self.mark_pairs(&face, id, (number, instance, mesh, tree), found, &mut pairs, compared);
                ControlFlow::Continue(())
            });
        }
        for id in pairs {
            match id.instance() {
                None => found.world.mark(id.index),
                Some(n) => found.meshes[self.instances[n as usize].mesh as usize].mark(id.index),
            }
        }
    }

    /// Adds `face` and the triangles of an instance that coincide with it to `pairs`.
    fn mark_pairs(
        &self,
        face: &Face,
        id: PrimitiveId,
        (number, instance, mesh, tree): (u32, &Instance, &Mesh, &Tree),
        found: &Coincident,
        pairs: &mut Vec<PrimitiveId>,
        compared: &mut u64,
    ) {
        let role = found.roles[self.material(id).0 as usize];
        let region = instance.region_of_face(face.corners, found.reach);
        let before = pairs.len();
        let _ = tree.within(&region, &mut |within| {
            let Within::Triangle { index, triangle } = within else { return ControlFlow::Continue(()) };
            *compared += 1;
            let other = PrimitiveId::of(number, index);
            if compete(role, found.roles[mesh.material(index).0 as usize]) {
                let corners = triangle.corners().map(|p| instance.in_world(p));
                if Face::of(corners, self.plane_error(other)).coincides(face) {
                    pairs.push(other);
                }
            }
            ControlFlow::Continue(())
        });
        if pairs.len() > before {
            pairs.push(id);
        }
    }
}

/// Whether one of two surfaces can hide the other.
fn compete(a: Role, b: Role) -> bool {
    !(a.bounds_volume && b.bounds_volume)
}

/// A bound on the error of every triangle's plane.
fn most_error(mesh: &Mesh) -> f32 {
    let size = mesh.bounds().map_or(0.0, |b| b.min.abs().max(b.max.abs()).max_element());
    OFFSET * 3_f32.sqrt() * Mesh::error_at_most(size)
}

/// Marks the triangles of a mesh that coincide with others of it, where planes have at least the error `error`.
fn mark_within(mesh: &Mesh, tree: &Tree, error: f32, roles: &[Role], marks: &mut Marks) {
    let role = |index: u32| roles[mesh.material(index).0 as usize];
    // The same for both of a pair, so that each of them finds the other.
    let slack = error.max(most_error(mesh));
    for a in 0..mesh.len() {
        let triangle = mesh.triangle(a);
        if triangle.is_degenerate() {
            continue;
        }
        let face = Face::in_mesh(triangle, error);
        let flow = tree.within(&Region::of_face(face.corners, face.normal, slack), &mut |within| {
            if let Within::Triangle { index, triangle } = within
                && index != a
                && compete(role(a), role(index))
                && Face::in_mesh(triangle, error).coincides(&face)
            {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        if flow.is_break() {
            marks.mark(a);
        }
    }
}

/// A triangle in f64, to be held against others.
struct Face {
    corners: [DVec3; 3],
    normal: DVec3,
    /// A bound on the error of its plane.
    error: f64,
}

impl Face {
    /// Where triangles overlap by less than so many errors, they only touch.
    const TOUCHING: f64 = 4.0;

    fn of(corners: [DVec3; 3], error: f32) -> Self {
        let [a, b, c] = corners;
        Self { corners, normal: (b - a).cross(c - a).normalize_or_zero(), error: f64::from(error) }
    }

    /// In the mesh's own space, with the error of its surfaces or a larger one.
    fn in_mesh(triangle: Triangle, error: f32) -> Self {
        let corners = triangle.corners();
        let size = corners.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
        let mut face = Self::of(corners.map(|p| p.as_dvec3()), 0.0);
        let normal = face.normal.abs().element_sum();
        face.error = f64::from(error).max(f64::from(OFFSET * Mesh::error_at_most(size)) * normal);
        face
    }

    /// Whether the two overlap, and are no further apart than the larger error wherever they do.
    fn coincides(&self, other: &Self) -> bool {
        let error = self.error.max(other.error);
        if self.normal.dot(other.normal).abs() < f64::from(PARALLEL)
            || self.touches(other, error)
            || other.touches(self, error)
        {
            return false;
        }
        // The overlap: the other one, cut by the planes through the edges of this one (Sutherland & Hodgman 1974).
        let mut overlap = other.corners.to_vec();
        for (start, inward) in self.sides() {
            let side = |p: DVec3| inward.dot(p - start);
            let mut cut = Vec::with_capacity(overlap.len() + 1);
            for (i, &p) in overlap.iter().enumerate() {
                let q = overlap[(i + 1) % overlap.len()];
                let (at_p, at_q) = (side(p), side(q));
                if at_p >= 0.0 {
                    cut.push(p);
                }
                if (at_p < 0.0) != (at_q < 0.0) {
                    cut.push(p.lerp(q, at_p / (at_p - at_q)));
                }
            }
            overlap = cut;
        }
        let apart = |p: &DVec3| self.normal.dot(*p - self.corners[0]).abs();
        !overlap.is_empty() && overlap.iter().all(|p| apart(p) <= error)
    }

    /// Whether the other one is outside of one of this one's edges, or reaches no further inside than roundings do.
    fn touches(&self, other: &Self, error: f64) -> bool {
        self.sides()
            .into_iter()
            .any(|(start, inward)| other.corners.iter().all(|p| inward.dot(*p - start) <= Self::TOUCHING * error))
    }

    /// A point of each edge, and the unit vector in the plane that points from there across the triangle.
    fn sides(&self) -> [(DVec3, DVec3); 3] {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)].map(|(p, q)| (p, self.normal.cross(q - p).normalize_or_zero()))
    }
}
