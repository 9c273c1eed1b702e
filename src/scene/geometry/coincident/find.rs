//! Finds which surfaces coincide, when the scene is built.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    super::{
        Instance, InstancedMesh, Mesh,
        bvh::Tree,
        region::{Region, Within},
        triangle::Triangle,
    },
    Bounds, Coincident, Geometry, Hidden, MARGIN, OFFSET, PARALLEL, PrimitiveId, Rank, Role, Sharing, compete,
};

/// How many pairs of triangles may be compared among instances, and of instances with the world: some seconds' worth of
/// each. What is not compared counts as coincident everywhere, which costs time and changes nothing else.
const MOST_COMPARED: u64 = 1 << 25;
/// How many boxes a triangle may have. With more, it counts as hidden everywhere.
const MOST_BOXES: usize = 64;
/// A box for what is not known better.
const EVERYWHERE: Bounds = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };

/// A triangle that overlaps others, and a box around where one comes before it, if one does.
type Found = (u32, Option<Bounds>);

/// What was found so far.
struct Search<'a> {
    roles: &'a [Role],
    reach: f32,
    world: Vec<Found>,
    /// By mesh.
    meshes: Vec<Meshwide>,
    /// After how many pairs the rest is not compared.
    most: u64,
    /// How many pairs were compared of instances with the world.
    compared_with_world: u64,
    /// And among instances.
    compared: u64,
}

/// What was found of a mesh, in any of its places.
struct Meshwide {
    /// By triangle.
    sharing: Vec<Sharing>,
    /// Whether not all was compared.
    is_cut_short: bool,
}

/// An instance with its tree.
struct Placed<'a> {
    number: u32,
    instance: &'a Instance,
    mesh: &'a Mesh,
    tree: &'a Tree,
}

impl Geometry {
    /// Finds which surfaces coincide, on the current rayon pool; `roles` is by material. Without this, none do.
    ///
    /// # Panics
    /// Before [`Self::build`].
    pub fn find_coincident(&mut self, roles: Vec<Role>) {
        self.find_coincident_by(roles, MOST_COMPARED);
    }

    /// The same with no more than about `most` pairs of each sort compared.
    pub(in crate::scene) fn find_coincident_by(&mut self, roles: Vec<Role>, most: u64) {
        let Some(tree) = self.tree() else { return };
        let mut search = Search {
            roles: &roles,
            reach: self.reach(),
            world: overlaps_within(&self.world, tree, 0.0, &roles),
            meshes: (0..).zip(&self.meshes).map(|(number, m)| self.search_within(number, m, &roles)).collect(),
            most,
            compared_with_world: 0,
            compared: 0,
        };
        (0..self.instance_count()).for_each(|number| self.search_around(number, &mut search));
        let Search { mut world, mut meshes, reach, compared_with_world, .. } = search;
        if compared_with_world > most {
            world = (0..self.world.len()).map(|index| (index, Some(EVERYWHERE))).collect();
        }
        meshes.iter_mut().filter(|m| m.is_cut_short).for_each(|m| m.sharing.fill(Sharing::Hidden));
        if world.is_empty() && meshes.iter().flat_map(|m| &m.sharing).all(|s| *s == Sharing::Alone) {
            self.coincident = None;
            return;
        }
        for (index, bounds) in &world {
            self.world.shares(*index, sharing(*bounds));
        }
        for (m, found) in self.meshes.iter_mut().zip(meshes) {
            (0..).zip(found.sharing).for_each(|(index, sharing)| m.mesh.shares(index, sharing));
        }
        // Positions lie within `reach` of where the search has them.
        let around = 2.0 * reach;
        let grown = |b: Bounds| Bounds { min: b.min - around, max: b.max + around };
        let boxes = world.into_iter().filter_map(|(index, bounds)| Some((index, grown(bounds?)))).collect();
        self.coincident = Some(Box::new(Coincident { roles, world: Hidden::new(boxes), reach }));
    }

    /// Finds what coincides within a mesh that instances place.
    fn search_within(&self, number: u32, m: &InstancedMesh, roles: &[Role]) -> Meshwide {
        let mut sharing = vec![Sharing::Alone; m.mesh.len() as usize];
        if let Some(tree) = &m.tree {
            // Where it is placed, roundings of the world's coordinates come on top of its own.
            let placed = self.instances.iter().filter(|i| i.mesh == number);
            let placed = placed.filter_map(|i| Some(i.placement.shrinking() * f64::from(self.instance_error(i)?)));
            for found in overlaps_within(&m.mesh, tree, placed.fold(0.0, f64::max) as f32, roles) {
                note(&mut sharing, found);
            }
        }
        Meshwide { sharing, is_cut_short: false }
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

    /// Finds what coincides with instance `number`: in world space, and in later instances.
    fn search_around(&self, number: u32, search: &mut Search<'_>) {
        let (Some(placed), Some(world)) = (self.placed(number), &self.tree) else { return };
        let mut others = Vec::new();
        let around = Region::around(placed.instance.bounds, search.reach);
        let _ = world.within(&around, &mut |within| {
            match within {
                Within::Triangle { index, .. } => self.compare_with_world(index, &placed, search),
                Within::Instance { number: other } if other > number => others.push(other),
                Within::Instance { .. } => {}
            }
            ControlFlow::Continue(())
        });
        others.into_iter().filter_map(|other| self.placed(other)).for_each(|other| {
            self.compare_instances(&placed, &other, search);
        });
    }

    /// Notes what coincides of a triangle of the world and the triangles of an instance.
    fn compare_with_world(&self, index: u32, placed: &Placed<'_>, search: &mut Search<'_>) {
        if search.compared_with_world > search.most {
            search.meshes[placed.instance.mesh as usize].is_cut_short = true;
            return;
        }
        let id = PrimitiveId::world(index);
        let corners = self.world.triangle(index).corners().map(|p| p.as_dvec3());
        let mut boxes = Vec::new();
        let of_mesh = &mut search.meshes[placed.instance.mesh as usize].sharing;
        search.compared_with_world += self.overlaps(corners, id, placed, search.reach, search.roles, |overlap| {
            note(of_mesh, (overlap.index, overlap.is_later.then_some(EVERYWHERE)));
            if boxes.len() <= MOST_BOXES {
                boxes.push((index, (!overlap.is_later).then_some(overlap.bounds)));
            }
        });
        // One more box than may be stands for all.
        search.world.extend(boxes);
    }

    /// Notes what coincides of the triangles of two instances.
    fn compare_instances(&self, placed: &Placed<'_>, other: &Placed<'_>, search: &mut Search<'_>) {
        if search.compared > search.most {
            [placed, other].iter().for_each(|p| search.meshes[p.instance.mesh as usize].is_cut_short = true);
            return;
        }
        let common = other.instance.region_of_box(placed.instance.bounds, search.reach);
        let _ = other.tree.within(&common, &mut |within| {
            let Within::Triangle { index, .. } = within else { return ControlFlow::Continue(()) };
            let id = PrimitiveId::of(other.number, index);
            let corners = other.mesh.triangle(index).corners().map(|p| other.instance.in_world(p));
            let mut meets = false;
            let of_mesh = &mut search.meshes[placed.instance.mesh as usize].sharing;
            // The order of two instances is not that of all places of their meshes: each may be hidden.
            search.compared += 1;
            search.compared += self.overlaps(corners, id, placed, search.reach, search.roles, |overlap| {
                note(of_mesh, (overlap.index, Some(EVERYWHERE)));
                meets = true;
            });
            if meets {
                note(&mut search.meshes[other.instance.mesh as usize].sharing, (index, Some(EVERYWHERE)));
            }
            ControlFlow::Continue(())
        });
    }

    /// Instance `number`, if there is anything to meet.
    fn placed(&self, number: u32) -> Option<Placed<'_>> {
        let (instance, mesh) = self.instance(number);
        Some(Placed { number, instance, mesh, tree: self.meshes[instance.mesh as usize].tree.as_ref()? })
    }

    /// Calls `visit` with the triangles of an instance that overlap the triangle `id` with these corners; returns how
    /// many it compared.
    fn overlaps(
        &self,
        corners: [DVec3; 3],
        id: PrimitiveId,
        placed: &Placed<'_>,
        reach: f32,
        roles: &[Role],
        mut visit: impl FnMut(Overlap),
    ) -> u64 {
        let role = roles[self.material(id).0 as usize];
        let face = Face::of(corners, self.plane_error(id));
        let mut compared = 0;
        let region = placed.instance.region_of_face(corners, reach);
        let _ = placed.tree.within(&region, &mut |within| {
            let Within::Triangle { index, triangle } = within else { return ControlFlow::Continue(()) };
            compared += 1;
            let other = PrimitiveId::of(placed.number, index);
            let other_role = roles[placed.mesh.material(index).0 as usize];
            if compete(role, other_role) {
                let corners = triangle.corners().map(|p| placed.instance.in_world(p));
                if let Some(bounds) = Face::of(corners, self.plane_error(other)).overlap(&face) {
                    let is_later = Rank(role.precedence, id) < Rank(other_role.precedence, other);
                    visit(Overlap { index, bounds, is_later });
                }
            }
            ControlFlow::Continue(())
        });
        compared
    }
}

/// A triangle of an instance that overlaps another one.
struct Overlap {
    index: u32,
    /// A box around where they overlap.
    bounds: Bounds,
    /// Whether the other one comes first.
    is_later: bool,
}

/// What a triangle's box says of it.
fn sharing(hidden: Option<Bounds>) -> Sharing {
    if hidden.is_some() { Sharing::Hidden } else { Sharing::First }
}

/// Notes what was found of a triangle in what is known of its mesh.
fn note(mesh: &mut [Sharing], (index, hidden): Found) {
    let known = &mut mesh[index as usize];
    *known = (*known).max(sharing(hidden));
}

impl Hidden {
    fn new(mut boxes: Vec<(u32, Bounds)>) -> Self {
        boxes.sort_by_key(|(index, _)| *index);
        // The two halves of a rectangle have the same box.
        boxes.dedup_by(|(i, a), (j, b)| i == j && b.union(*a) == *b);
        let mut kept = Vec::with_capacity(boxes.len());
        for of_one in boxes.chunk_by(|(i, _), (j, _)| i == j) {
            match of_one {
                [(index, _), ..] if of_one.len() > MOST_BOXES => kept.push((*index, EVERYWHERE)),
                few => kept.extend(few),
            }
        }
        Self(kept)
    }
}

/// A bound on the error of every triangle's plane.
fn most_error(mesh: &Mesh) -> f32 {
    let size = mesh.bounds().map_or(0.0, |b| b.min.abs().max(b.max.abs()).max_element());
    OFFSET * 3_f32.sqrt() * Mesh::error_at_most(size)
}

/// The triangles of a mesh that coincide with others of it, with boxes in the mesh's space. Planes have at least the
/// error `error`.
fn overlaps_within(mesh: &Mesh, tree: &Tree, error: f32, roles: &[Role]) -> Vec<Found> {
    let role = |index: u32| roles[mesh.material(index).0 as usize];
    // Of triangles of one instance, ids have the order of the mesh.
    let rank = |index: u32| Rank(role(index).precedence, PrimitiveId::world(index));
    // The same for both of a pair, so that each of them finds the other.
    let slack = error.max(most_error(mesh));
    let of_triangle = |a: u32| {
        let mut found = Vec::new();
        let triangle = mesh.triangle(a);
        if triangle.is_degenerate() {
            return found;
        }
        let face = Face::in_mesh(triangle, error);
        let flow = tree.within(&Region::of_face(face.corners, face.normal, slack), &mut |within| {
            let Within::Triangle { index, triangle } = within else { return ControlFlow::Continue(()) };
            // Neighbours touch: most are done with here.
            let corners = triangle.corners().map(|p| p.as_dvec3());
            if index != a
                && !face.touches(&corners, face.error)
                && compete(role(a), role(index))
                && let Some(bounds) = Face::in_mesh(triangle, error).overlap(&face)
            {
                found.push((a, (rank(index) < rank(a)).then_some(bounds)));
            }
            if found.len() > MOST_BOXES { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        if flow.is_break() { vec![(a, Some(EVERYWHERE))] } else { found }
    };
    (0..mesh.len()).into_par_iter().flat_map_iter(of_triangle).collect()
}

/// A triangle in f64, to be held against others.
struct Face {
    corners: [DVec3; 3],
    normal: DVec3,
    /// A point of each edge, and the unit vector in the plane that points from there across the triangle.
    sides: [(DVec3, DVec3); 3],
    /// A bound on the error of its plane.
    error: f64,
}

impl Face {
    /// Where triangles overlap by less than so many errors, they only touch.
    const TOUCHING: f64 = 4.0;

    fn of(corners: [DVec3; 3], error: f32) -> Self {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| (p, normal.cross(q - p).normalize_or_zero()));
        Self { corners, normal, sides, error: f64::from(error) }
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

    /// A box around where the two overlap, if they do and are no further apart than the larger error wherever they do.
    fn overlap(&self, other: &Self) -> Option<Bounds> {
        let error = self.error.max(other.error);
        if self.normal.dot(other.normal).abs() < f64::from(PARALLEL)
            || self.touches(&other.corners, error)
            || other.touches(&self.corners, error)
        {
            return None;
        }
        // The overlap: the other one, cut by the planes through the edges of this one (Sutherland & Hodgman 1974).
        let mut overlap = other.corners.to_vec();
        for (start, inward) in self.sides {
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
        let near = overlap.iter().all(|p| apart(p) <= error);
        // Neighbours at a vertex, neither of which keeps to one side of the other's edges, may have it alone in common.
        let first = *overlap.first()?;
        let is_point = overlap.iter().all(|p| (p - first).abs().max_element() <= Self::TOUCHING * error);
        let bounds = overlap.iter().map(|p| Bounds { min: p.as_vec3(), max: p.as_vec3() }).reduce(Bounds::union);
        bounds.filter(|_| near && !is_point)
    }

    /// Whether another triangle is outside of one of this one's edges, or reaches no further inside than roundings do.
    fn touches(&self, corners: &[DVec3; 3], error: f64) -> bool {
        self.sides
            .iter()
            .any(|(start, inward)| corners.iter().all(|p| inward.dot(*p - start) <= Self::TOUCHING * error))
    }
}
