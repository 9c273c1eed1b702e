//! Where the light vertices of a pass are: a hashed grid of cells as wide as what a camera vertex meets (Teschner et
//! al. 2003).

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use crate::path::LightVertex;

/// The light vertices of a pass by their places. Their order is that in which they came, cell by cell, whatever threads
/// there are.
#[derive(Debug, Default)]
pub struct LightVertexMap {
    vertices: Vec<LightVertex>,
    /// Where each bucket of cells begins, and behind the last where it ends; empty without vertices.
    starts: Vec<u32>,
    /// Cells per metre.
    per_metre: f32,
}

impl LightVertexMap {
    /// Of vertices that are to be found within `radius` of a point, in metres.
    ///
    /// # Panics
    /// If there are more than 2³¹ of them.
    pub fn new(parts: &[Vec<LightVertex>], radius: f32) -> Self {
        let vertices: Vec<_> = parts.iter().flatten().collect();
        let len = u32::try_from(vertices.len()).expect("no more light vertices than 2³¹");
        if len == 0 {
            return Self::default();
        }
        let (per_metre, buckets) = (0.5 / radius, len.next_power_of_two());
        let key =
            |(i, y): (usize, &&LightVertex)| u64::from(bucket(cell(y.position, per_metre), buckets)) << 32 | i as u64;
        let mut order: Vec<_> = vertices.par_iter().enumerate().map(key).collect();
        order.par_sort_unstable();
        let first_from = |bucket: u32| order.partition_point(|key| (key >> 32) < u64::from(bucket)) as u32;
        Self {
            vertices: order.par_iter().map(|key| *vertices[*key as u32 as usize]).collect(),
            starts: (0..=buckets).into_par_iter().map(first_from).collect(),
            per_metre,
        }
    }

    /// Those in the cells around a place: all that are within the radius of it, and some that are not.
    #[inline]
    pub fn around(&self, place: Vec3, mut see: impl FnMut(&LightVertex)) {
        if self.starts.is_empty() {
            return;
        }
        let buckets = (self.starts.len() - 1) as u32;
        // The radius is half a cell.
        let corner = cell(place - 0.5 / self.per_metre, self.per_metre);
        for k in 0..8 {
            let cell_of = |axis: usize| corner[axis].checked_add(k >> axis & 1);
            // Beyond the last number of a cell there is none.
            let (Some(x), Some(y), Some(z)) = (cell_of(0), cell_of(1), cell_of(2)) else { continue };
            let wanted = IVec3::new(x, y, z);
            let bucket = bucket(wanted, buckets) as usize;
            for y in &self.vertices[self.starts[bucket] as usize..self.starts[bucket + 1] as usize] {
                // Two of the eight cells may share a bucket.
                if cell(y.position, self.per_metre) == wanted {
                    see(y);
                }
            }
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }
}

/// What a light vertex takes at most while the map is made, in bytes: in its tile's list, which may have twice the room
/// that it needs, in the map, and as a place in the order.
pub const BYTES_OF_A_LIGHT_VERTEX: u64 = 3 * size_of::<LightVertex>() as u64 + 24;

#[inline]
fn cell(place: Vec3, per_metre: f32) -> IVec3 {
    (place * per_metre).floor().as_ivec3()
}

#[inline]
fn bucket(cell: IVec3, buckets: u32) -> u32 {
    let [x, y, z] = cell.to_array().map(|x| x as u32);
    let mixed = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
    // The lower bits alone of neighbouring cells differ too little.
    (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d).rotate_right(16) & (buckets - 1)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    use super::*;

    /// Every vertex within the radius is found, and found once, also far from the origin and where cells are many.
    #[test]
    fn all_around_a_place_are_found_once() {
        let mut random = StdRng::seed_from_u64(7);
        for (middle, size, radius) in [
            (Vec3::ZERO, 1.0, 0.1),
            (Vec3::splat(1e9), 1e3, 0.2),
            (Vec3::new(1e4, -1e4, 30.0), 4.0, 0.7),
            (Vec3::ZERO, 1.0, 5.0),
        ] {
            let mut place = || middle + size * Vec3::from(std::array::from_fn(|_| random.random_range(-1.0..1.0_f32)));
            let places: Vec<_> = (0..500).map(|_| place()).collect();
            let vertices: Vec<_> = (0..).zip(&places).map(|(i, place)| LightVertex::at(*place, i)).collect();
            let map = LightVertexMap::new(&[vertices], radius);
            assert_eq!(map.len(), places.len());
            for _ in 0..200 {
                let x = place();
                let mut found = Vec::new();
                map.around(x, |y| {
                    if y.position.distance(x) <= radius {
                        found.push(y.path());
                    }
                });
                let len = found.len();
                found.sort_unstable();
                found.dedup();
                assert_eq!(len, found.len(), "found twice");
                let expected = places.iter().filter(|place| place.distance(x) <= radius).count();
                assert_eq!(len, expected, "around {x}");
            }
        }
        LightVertexMap::new(&[], 0.1).around(Vec3::ZERO, |_| panic!("there is none"));
    }
}
