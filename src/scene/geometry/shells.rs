//! Which surfaces bound a volume: closed shells, their volumes, and whether they come close to each other.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec3, Vec3};

use super::MaterialId;
use super::{Bounds, Geometry, mesh::Mesh};

/// All surfaces of one material, as the boundary of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shell {
    /// Whose surfaces they are.
    pub material: MaterialId,
    /// Whether they bound anything.
    pub form: Form,
    /// The enclosed volume by the divergence theorem, counted by the winding number, m³.
    pub volume: f64,
    /// A box around them.
    pub bounds: Bounds,
}

/// Whether surfaces bound a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Every edge is passed as often in one direction as in the other, and the fronts look out.
    Closed,
    /// There are edges on which the surface ends, or where its front becomes its back.
    Open {
        /// How many.
        edges: u64,
    },
    /// Closed, but with the front inside, or flat.
    InsideOut,
}

/// The shells of a geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Shells {
    /// One for each material with a surface, in the order of their ids.
    pub all: Vec<Shell>,
    /// Whether some of their connected pieces may touch or intersect: false only if their boxes keep apart.
    pub meet: bool,
}

/// A connected piece of a material's surface in one mesh, or a sphere.
#[derive(Clone, Copy, Debug)]
struct Piece {
    material: MaterialId,
    open: u64,
    /// Whether an edge belongs to more than two triangles: where boxes with a common side are one piece.
    crowded: bool,
    volume: f64,
    bounds: Bounds,
}

impl Geometry {
    /// The shells of the materials that `wanted` picks. Triangles are joined where their corners are at the same place;
    /// those of different instances never are.
    pub fn shells(&self, wanted: &impl Fn(MaterialId) -> bool) -> Shells {
        let mut pieces = pieces(&self.world, wanted);
        let spheres = self.spheres.iter().filter(|(sphere, material)| wanted(*material) && sphere.radius > 0.0);
        pieces.extend(spheres.map(|(sphere, material)| Piece {
            material: *material,
            open: 0,
            crowded: false,
            volume: 4.0 / 3.0 * std::f64::consts::PI * f64::from(sphere.radius).powi(3),
            bounds: sphere.bounds(),
        }));
        let of_meshes: Vec<_> = self.meshes.iter().map(|m| self::pieces(&m.mesh, wanted)).collect();
        for instance in &self.instances {
            let placement = &instance.placement;
            // The front of a mirrored instance stays the front.
            let scale = placement.to_world().matrix3.determinant().abs();
            pieces.extend(of_meshes[instance.mesh as usize].iter().map(|piece| Piece {
                volume: piece.volume * scale,
                bounds: placement.bounds(piece.bounds),
                ..*piece
            }));
        }
        Shells { meet: pieces.iter().any(|p| p.crowded) || overlap(&pieces), all: joined(&pieces) }
    }
}

/// The shells of all pieces of a material.
fn joined(pieces: &[Piece]) -> Vec<Shell> {
    let mut of_material = BTreeMap::<u32, Vec<&Piece>>::new();
    for piece in pieces {
        of_material.entry(piece.material.0).or_default().push(piece);
    }
    let shell = |(id, pieces): (u32, Vec<&Piece>)| {
        let bounds = pieces.iter().map(|p| p.bounds).reduce(Bounds::union)?;
        let edges = pieces.iter().map(|p| p.open).sum();
        let volume = pieces.iter().map(|p| p.volume).sum();
        // A bubble: its front looks into it, and something of the same material is around it.
        let bubble = |hole: &Piece| pieces.iter().any(|p| p.volume > -hole.volume && contains(p.bounds, hole.bounds));
        let form = if edges > 0 {
            Form::Open { edges }
        } else if pieces.iter().any(|p| p.volume <= 0.0 && !bubble(p)) {
            Form::InsideOut
        } else {
            Form::Closed
        };
        Some(Shell { material: MaterialId(id), form, volume, bounds })
    };
    of_material.into_iter().filter_map(shell).collect()
}

fn contains(outer: Bounds, inner: Bounds) -> bool {
    outer.min.cmple(inner.min).all() && outer.max.cmpge(inner.max).all()
}

/// Whether any two boxes meet, a little margin for rounding included. With so many that it takes long to tell: yes.
fn overlap(pieces: &[Piece]) -> bool {
    const MOST_TESTS: u32 = 20_000_000;
    const MARGIN: f32 = 1e-5;
    let wide = |b: Bounds| {
        let margin = Vec3::splat(MARGIN * b.min.abs().max(b.max.abs()).max_element());
        Bounds { min: b.min - margin, max: b.max + margin }
    };
    let mut boxes: Vec<_> = pieces.iter().map(|p| wide(p.bounds)).collect();
    let Some(all) = boxes.iter().copied().reduce(Bounds::union) else { return false };
    let axis = (all.max - all.min).max_position();
    boxes.sort_by(|a, b| a.min[axis].total_cmp(&b.min[axis]));
    let (mut active, mut tests) = (Vec::<Bounds>::new(), 0);
    for b in boxes {
        active.retain(|a| a.max[axis] >= b.min[axis]);
        tests += active.len() as u32;
        if tests > MOST_TESTS || active.iter().any(|a| a.meets(b)) {
            return true;
        }
        active.push(b);
    }
    false
}

/// The connected pieces of the triangles whose materials are wanted.
fn pieces(mesh: &Mesh, wanted: &impl Fn(MaterialId) -> bool) -> Vec<Piece> {
    // Corners of one material at the same place are one.
    let mut welded = HashMap::new();
    let mut sets = Sets::default();
    let mut faces = Vec::new();
    for (index, material, turned) in mesh.faces().filter(|(_, material, _)| wanted(*material)) {
        let corners = mesh.triangle(index).corners();
        let mut ids = corners.map(|p| {
            // + 0: −0 is the same place.
            let key = (material, (p + 0.0).to_array().map(f32::to_bits));
            *welded.entry(key).or_insert_with(|| sets.add())
        });
        if turned {
            ids.swap(1, 2);
        }
        sets.unite(ids[0], ids[1]);
        sets.unite(ids[0], ids[2]);
        faces.push((ids, index, material, turned));
    }
    let mut pieces = Vec::<(Piece, DVec3)>::new();
    // The piece of each set's first corner.
    let mut number = vec![None; sets.len()];
    // Each with its lower corner, its higher one and, in the last bit, its direction: one number, which is sorted fast.
    let mut edges = Vec::with_capacity(3 * faces.len());
    for (ids, index, material, turned) in faces {
        let triangle = mesh.triangle(index);
        let n = *number[sets.find(ids[0]) as usize].get_or_insert_with(|| {
            let piece = Piece { material, open: 0, crowded: false, volume: 0.0, bounds: triangle.bounds() };
            pieces.push((piece, triangle.corners()[0].as_dvec3()));
            pieces.len() - 1
        });
        let (piece, origin) = &mut pieces[n];
        piece.bounds = piece.bounds.union(triangle.bounds());
        let [a, b, c] = triangle.corners().map(|p| p.as_dvec3() - *origin);
        piece.volume += a.dot(b.cross(c)) / if turned { -6.0 } else { 6.0 };
        for (from, to) in [(ids[0], ids[1]), (ids[1], ids[2]), (ids[2], ids[0])] {
            if from != to {
                let corners = u64::from(from.min(to)) << 32 | u64::from(from.max(to)) << 1;
                edges.push(corners | u64::from(from < to));
            }
        }
    }
    edges.sort_unstable();
    for same in edges.chunk_by(|a, b| a >> 1 == b >> 1) {
        let Some(n) = number[sets.find((same[0] >> 32) as u32) as usize] else { continue };
        let piece = &mut pieces[n].0;
        piece.crowded |= same.len() > 2;
        piece.open += u64::from(2 * same.iter().filter(|edge| *edge & 1 == 1).count() != same.len());
    }
    pieces.into_iter().map(|(piece, _)| piece).collect()
}

/// Disjoint sets of numbers from 0 on.
#[derive(Debug, Default)]
struct Sets {
    parent: Vec<u32>,
}

impl Sets {
    fn add(&mut self) -> u32 {
        let id = self.parent.len() as u32;
        assert!(id < 1 << 31, "fewer than 2³¹ corners");
        self.parent.push(id);
        id
    }

    fn len(&self) -> usize {
        self.parent.len()
    }

    fn find(&mut self, mut id: u32) -> u32 {
        while self.parent[id as usize] != id {
            let above = self.parent[self.parent[id as usize] as usize];
            self.parent[id as usize] = above;
            id = above;
        }
        id
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::scene::geometry::{Placement, PrimitiveId};
    use crate::scene::material::Material;

    const GLASS: MaterialId = MaterialId(0);

    /// A cube of side 2 around `center`, with its front outside or, of `side` −1, inside.
    fn cube(center: Vec3, half: f32, side: i32) -> ([Vec3; 8], Vec<[u32; 3]>) {
        let corner = |i: usize| {
            let pick = |k: usize| if i >> k & 1 == 0 { -half } else { half };
            center + Vec3::new(pick(0), pick(1), pick(2))
        };
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = quads.into_iter().flat_map(|[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]]);
        (std::array::from_fn(corner), triangles.map(|[a, b, c]| if side < 0 { [a, c, b] } else { [a, b, c] }).collect())
    }

    fn of(cubes: &[(Vec3, f32, i32)]) -> Shells {
        let mut g = Geometry::default();
        for &(center, half, side) in cubes {
            let (corners, faces) = cube(center, half, side);
            // Each face has corners of its own: places count, not indices.
            for face in faces {
                g.add_triangles(&face.map(|i| corners[i as usize]), None, &[[0, 1, 2]], GLASS);
            }
        }
        g.shells(&|_| true)
    }

    fn only(shells: &Shells) -> Shell {
        assert_eq!(shells.all.len(), 1);
        shells.all[0]
    }

    #[test]
    fn closed_surfaces_bound_their_volume() {
        let apart = of(&[(Vec3::ZERO, 1.0, 1), (3.0 * Vec3::X, 1.0, 1)]);
        let shell = only(&apart);
        assert_eq!((shell.form, apart.meet), (Form::Closed, false));
        assert!((shell.volume - 16.0).abs() < 1e-9);
        let bubble = of(&[(Vec3::ZERO, 1.0, 1), (Vec3::ZERO, 0.5, -1)]);
        assert_eq!((only(&bubble).form, bubble.meet), (Form::Closed, true));
        assert!((only(&bubble).volume - 7.0).abs() < 1e-9);
        // A common side, which both have.
        let touching = of(&[(Vec3::ZERO, 1.0, 1), (2.0 * Vec3::X, 1.0, 1)]);
        assert_eq!((only(&touching).form, touching.meet), (Form::Closed, true));
    }

    #[test]
    fn what_is_inside_out_or_open_is_said_to_be() {
        assert_eq!(only(&of(&[(Vec3::ZERO, 1.0, -1)])).form, Form::InsideOut);
        assert_eq!(only(&of(&[(Vec3::ZERO, 1.0, 1), (5.0 * Vec3::X, 0.5, -1)])).form, Form::InsideOut);
        let mut g = Geometry::default();
        let (corners, faces) = cube(Vec3::ZERO, 1.0, 1);
        g.add_triangles(&corners, None, &faces[1..], GLASS);
        assert_eq!(only(&g.shells(&|_| true)).form, Form::Open { edges: 3 });
        assert!(g.shells(&|_| false).all.is_empty());
    }

    #[test]
    fn copies_and_instances_count() {
        let mut g = Geometry::default();
        let (corners, faces) = cube(Vec3::ZERO, 1.0, 1);
        let (beside, _) = cube(2.0 * Vec3::X, 1.0, 1);
        g.add_triangles(&corners, None, &faces, GLASS);
        g.add_triangles(&beside, None, &faces, GLASS);
        let before = g.shells(&|_| true);
        let mut mesh = Mesh::default();
        mesh.add_triangles(&corners, None, &faces, MaterialId(1));
        let mesh = g.add_mesh(mesh);
        let mirrored = DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0));
        g.add_instance(mesh, Placement::new(mirrored).expect("a placement"));
        g.drop_copies(|_| true, |_| Material::glass("glass", 1.5).role());
        g.build();
        let after = g.shells(&|_| true);
        assert_eq!((before.all[0].form, after.all[0].form), (Form::Closed, Form::Closed));
        assert!((before.all[0].volume - 16.0).abs() < 1e-9 && (after.all[0].volume - 16.0).abs() < 1e-9);
        assert!(g.copies(PrimitiveId::world(0)).next().is_none());
        assert_eq!(
            (0..g.world_len()).flat_map(|i| g.copies(PrimitiveId::world(i))).count(),
            24 - g.world_len() as usize
        );
        assert_eq!((after.all[1].form, after.meet), (Form::Closed, true));
        assert!((after.all[1].volume - 16.0).abs() < 1e-9);
    }
}
