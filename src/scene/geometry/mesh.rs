//! Indexed triangles: the ones in world space, and those of each mesh that is kept once and placed several times.

use std::collections::{HashMap, hash_map::Entry};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{
    Attributes, Bounds, Interpolation, MaterialId, Surface,
    coincident::{Role, Sharing},
    horizon::lifted,
    same::same,
    triangle::Triangle,
};
use crate::lanes::{Float, Lanes, Vector};

/// Triangles over shared vertices, each with a material, in a space of their own.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    positions: Vec<Vec3>,
    /// As long as `positions`; zero where a part has no normals.
    normals: Vec<Vec3>,
    attributes: Attributes,
    triangles: Vec<IndexedTriangle>,
    /// In the order of the triangles that they are copies of.
    copies: Vec<Copied>,
}

/// A triangle that was dropped as a copy. It may bound another body, or the same one from the other side.
#[derive(Clone, Copy, Debug)]
struct Copied {
    /// The triangle that has stayed.
    of: u32,
    material: MaterialId,
    /// Whether it faces the other way.
    turned: bool,
}

#[derive(Clone, Copy, Debug)]
struct IndexedTriangle {
    corners: [u32; 3],
    material: MaterialId,
    /// N_g by winding: what every hit needs, and f64 has to find.
    normal: Vec3,
    shading: Shading,
    sharing: Sharing,
}

#[cfg(test)]
pub(super) const TRIANGLE_BYTES: usize = size_of::<IndexedTriangle>();

#[derive(Clone, Copy, Debug)]
enum Shading {
    /// N_s is N_g.
    Flat,
    /// N_s is interpolated from the corners' normals.
    Smooth,
}

impl Mesh {
    /// Adds triangles with corners, optional per-corner-vertex normals, and indices into both. A triangle whose corners
    /// lie on one line has an index and an area of zero, and is never hit.
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
        self.add_triangles_with(positions, normals, &Attributes::default(), indices, material);
    }

    /// [`Self::add_triangles`] with attributes that their material reads.
    ///
    /// # Panics
    /// As there; also if an attribute is there for some vertices only, or is not finite.
    pub fn add_triangles_with(
        &mut self,
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        attributes: &Attributes,
        indices: &[[u32; 3]],
        material: MaterialId,
    ) {
        assert!(attributes.fit(positions.len()), "finite attributes for every vertex");
        assert!(positions.iter().all(|p| p.is_finite()), "positions are finite");
        assert!(indices.as_flattened().iter().all(|&i| (i as usize) < positions.len()), "indices are in range");
        let base = u32::try_from(self.positions.len()).expect("fewer than 2³² vertices");
        self.attributes.append(base as usize, attributes);
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
        let shading = if normals.is_some() { Shading::Smooth } else { Shading::Flat };
        self.triangles.extend(indices.iter().map(|t| IndexedTriangle {
            corners: t.map(|i| base + i),
            material,
            normal: Triangle::new(t.map(|i| positions[i as usize])).normal(),
            shading,
            sharing: Sharing::Alone,
        }));
    }

    /// See [`super::Geometry::drop_copies`].
    pub(super) fn drop_copies(&mut self, opaque: impl Fn(MaterialId) -> bool, role: impl Fn(MaterialId) -> Role) {
        let positions = &self.positions;
        // The same of all triangles with these corners, and whether this one goes round them the odd way.
        let corners = |t: &IndexedTriangle| {
            // + 0: −0 is the same place.
            let mut corners = t.corners.map(|i| (positions[i as usize] + 0.0).to_array().map(f32::to_bits));
            let [a, b, c] = corners;
            corners.sort_unstable();
            (corners, (a > b) ^ (b > c) ^ (a > c))
        };
        let all = (0..self.len()).into_par_iter();
        if same(all, |i| corners(&self.triangles[i as usize]).0).is_empty() {
            return;
        }
        // By corners: the first opaque one in the order in which they are there. It hides those that come after it.
        let rank = |index: usize, t: &IndexedTriangle| (role(t.material).precedence, index);
        let mut hiding = HashMap::with_capacity(self.triangles.len());
        for (index, t) in self.triangles.iter().enumerate() {
            let this = opaque(t.material).then(|| (rank(index, t), t.material));
            hiding
                .entry(corners(t).0)
                .and_modify(|first| *first = [*first, this].into_iter().flatten().min_by_key(|(rank, _)| *rank))
                .or_insert(this);
        }
        let mut kept = HashMap::with_capacity(hiding.len());
        let mut dropped = Vec::new();
        let (mut index, mut stay) = (0, 0);
        self.triangles.retain(|t| {
            let (corners, odd) = corners(t);
            let hidden = hiding[&corners].is_some_and(|(first, _)| rank(index, t) > first);
            index += 1;
            match kept.entry((corners, t.material)) {
                Entry::Vacant(place) if !hidden => {
                    place.insert((stay, odd));
                    stay += 1;
                    return true;
                }
                _ => dropped.push((corners, t.material, odd)),
            }
            false
        });
        // A copy goes with the triangle of its own material, or with the one that hides it.
        self.copies.extend(dropped.into_iter().map(|(corners, material, odd)| {
            let hiding = hiding[&corners].map(|(_, material)| material);
            let stays = [Some(material), hiding].into_iter().flatten().find_map(|m| kept.get(&(corners, m)));
            let &(of, as_odd) = stays.expect("a triangle that stays");
            Copied { of, material, turned: odd != as_odd }
        }));
        self.copies.sort_by_key(|copy| copy.of);
    }

    /// See [`super::Geometry::copies`].
    pub(super) fn copies(&self, index: u32) -> impl Iterator<Item = (MaterialId, bool)> {
        let from = self.copies.partition_point(|copy| copy.of < index);
        self.copies[from..].iter().take_while(move |copy| copy.of == index).map(|copy| (copy.material, copy.turned))
    }

    /// Every triangle that was added: its number (of a dropped one, that of its copy), its material, and whether it
    /// faces the other way than the triangle of that number.
    pub(super) fn faces(&self) -> impl Iterator<Item = (u32, MaterialId, bool)> {
        let kept = (0..).zip(&self.triangles).map(|(index, t)| (index, t.material, false));
        kept.chain(self.copies.iter().map(|copy| (copy.of, copy.material, copy.turned)))
    }

    /// The number of triangles.
    ///
    /// # Panics
    /// With 2³² or more.
    #[inline]
    pub fn len(&self) -> u32 {
        u32::try_from(self.triangles.len()).expect("fewer than 2³² triangles")
    }

    /// Whether there are no triangles.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The box around all triangles, `None` if there are none.
    pub fn bounds(&self) -> Option<Bounds> {
        (0..self.len()).map(|i| self.triangle(i).bounds()).reduce(Bounds::union)
    }

    pub(super) fn triangle(&self, index: u32) -> Triangle {
        // Not by an array's `map`, which is called.
        let [a, b, c] = self.triangles[index as usize].corners;
        Triangle::new([self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]])
    }

    /// Whether it shares its place; a triangle that is not there is alone.
    #[inline(always)]
    pub(super) fn sharing(&self, index: u32) -> Sharing {
        // Not by closures, which are inlined or not as the size of what is around them goes.
        match self.triangles.get(index as usize) {
            Some(triangle) => triangle.sharing,
            None => Sharing::Alone,
        }
    }

    /// Notes that it shares its place, if nothing more is known.
    pub(super) fn shares(&mut self, index: u32, sharing: Sharing) {
        let known = &mut self.triangles[index as usize].sharing;
        *known = (*known).max(sharing);
    }

    #[inline]
    pub(super) fn material(&self, index: u32) -> MaterialId {
        self.triangles[index as usize].material
    }

    /// The normals of the triangle's corners; `None` where it is flat.
    #[inline(always)]
    pub(super) fn corner_normals(&self, index: u32) -> Option<[Vec3; 3]> {
        let triangle = &self.triangles[index as usize];
        match triangle.shading {
            Shading::Flat => None,
            Shading::Smooth => Some(triangle.corners.map(|i| self.normals[i as usize])),
        }
    }

    /// The attributes at the barycentric coordinates `b`; none of a triangle that the mesh does not have.
    #[inline]
    pub(super) fn attributes(&self, index: u32, b: Vec2) -> Interpolation<'_> {
        let corners = self.triangles.get(index as usize).map_or([u32::MAX; 3], |t| t.corners);
        self.attributes.between(corners, b)
    }

    /// A bound on the error of surfaces of triangles whose coordinates are at most `size`.
    pub(super) fn error_at_most(size: f32) -> f32 {
        // The barycentric coordinates of a surface add up to a little more than 1 at most.
        GAMMA_7 * size * (1.0 + 4.0 * f32::EPSILON)
    }

    /// The surface in the mesh's own space, at the barycentric coordinates `b`.
    ///
    /// The bound on the position's error is γ₇ Σ|bᵢpᵢ| (Pharr, Jakob & Humphreys, *Physically Based Rendering*, 6.8.4).
    #[inline(always)]
    pub(super) fn surface(&self, index: u32, b: Vec2) -> Surface {
        let triangle = &self.triangles[index as usize];
        // Not by `map`, which is inlined or not as the size of what is around it goes.
        let [i, j, k] = triangle.corners;
        let corners = [self.positions[i as usize], self.positions[j as usize], self.positions[k as usize]];
        let (position, error) = surface_of(corners, [b.x, b.y]);
        let normal = triangle.normal;
        let shading_normal = shading_normal(self.corner_normals(index), b, normal);
        Surface { position, normal, shading_normal, error, barycentric: b }
    }

    /// N_g of a triangle, by winding.
    pub(super) fn normal(&self, index: u32) -> Vec3 {
        self.triangles[index as usize].normal
    }
}

/// The position at the barycentric coordinates `b` and `c` of the second and third corner, and a bound on its error.
#[inline(always)]
pub fn surface_of<V: Vector>([p, q, r]: [V; 3], [b, c]: [V::F; 2]) -> (V, V::F) {
    let one = b.lanes().splat(1.0);
    let (p, q, r) = (p * (one - b - c), q * b, r * c);
    (p + q + r, (p.abs() + q.abs() + r.abs()).max_element() * GAMMA_7)
}

const GAMMA_7: f32 = 7.0 * (f32::EPSILON / 2.0) / (1.0 - 7.0 * (f32::EPSILON / 2.0));

/// N_s from the normals of a triangle's corners, on the side of N_g and [lifted] off its horizon; N_g where there are
/// none, or they have no direction.
#[inline(always)]
pub(super) fn shading_normal(corners: Option<[Vec3; 3]>, b: Vec2, normal: Vec3) -> Vec3 {
    let Some([p, q, r]) = corners else { return normal };
    let interpolated = p * (1.0 - b.x - b.y) + q * b.x + r * b.y;
    match interpolated.try_normalize() {
        Some(n) if n.dot(normal) < 0.0 => lifted(-n, normal),
        Some(n) => lifted(n, normal),
        None => normal,
    }
}
