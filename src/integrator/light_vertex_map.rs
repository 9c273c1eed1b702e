//! Where the light vertices of a pass are: a hashed grid of cells as wide as what a camera vertex meets (Teschner et
//! al. 2003).

use std::ops::Range;

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use crate::{
    lanes::{Lanes, MOST, Mask, Record, Vector},
    path::{LightVertex, is_near},
};

/// The part of a pass that is done at once.
#[derive(Clone, Copy, Debug)]
pub enum Sweep<'a> {
    /// All of it.
    Whole,
    /// The light subpaths, whose vertices are kept for merges.
    Light,
    /// The rest, with these light vertices.
    Camera(&'a LightVertexMap),
}

/// The light vertices of a pass by their places. Their order is that in which they came, cell by cell, whatever threads
/// there are.
#[derive(Debug, Default)]
pub struct LightVertexMap {
    records: Vec<Record>,
    /// Their places once more, by coordinate: most that are looked at are too far away. With room for all lanes behind
    /// the last.
    places: [Vec<f32>; 3],
    /// How many vertices their subpaths have.
    vertices: Vec<u32>,
    /// Where each bucket of cells begins, and behind the last where it ends; empty without vertices.
    starts: Vec<u32>,
    radius: f32,
}

/// Cells around a place.
const CELLS: usize = 8;

impl LightVertexMap {
    /// Of [`LightVertex`]es that are to be found within `radius` of a point, in metres.
    ///
    /// # Panics
    /// If there are more than 2³¹ of them.
    pub fn new(parts: &[Vec<Record>], radius: f32) -> Self {
        let records: Vec<_> = parts.iter().flatten().collect();
        let len = u32::try_from(records.len()).ok().filter(|len| *len <= 1 << 31).expect("at most 2³¹ light vertices");
        if len == 0 {
            return Self { radius, ..Self::default() };
        }
        let buckets = len.next_power_of_two();
        let place = |record: &Record| LightVertex::of_record(record).position;
        let key =
            |(i, record): (usize, &&Record)| u64::from(bucket(cell(place(record), radius), buckets)) << 32 | i as u64;
        let mut order: Vec<_> = records.par_iter().enumerate().map(key).collect();
        order.par_sort_unstable();
        let first_from = |bucket: u32| order.partition_point(|key| (key >> 32) < u64::from(bucket)) as u32;
        let ordered = |key: &u64| *records[*key as u32 as usize];
        let coordinate = |axis: usize| {
            let of_each = order.par_iter().map(|key| place(&ordered(key))[axis]);
            of_each.chain(rayon::iter::repeat_n(f32::NAN, MOST)).collect()
        };
        Self {
            places: std::array::from_fn(coordinate),
            vertices: order.par_iter().map(|key| LightVertex::of_record(&ordered(key)).vertices()).collect(),
            records: order.par_iter().map(ordered).collect(),
            starts: (0..=buckets).into_par_iter().map(first_from).collect(),
            radius,
        }
    }

    /// Adds to `found` the numbers of those within the radius of a place, in the order of the map.
    #[inline(always)]
    pub fn around<L: Lanes>(&self, lanes: L, place: Vec3, found: &mut Vec<u32>) {
        if self.starts.is_empty() {
            return;
        }
        let (mut seen, mut run) = ([u32::MAX; CELLS], 0..0);
        // The radius is half a cell.
        let corner = cell(place - self.radius, self.radius);
        for k in 0..CELLS {
            let step = IVec3::new(k as i32 & 1, k as i32 >> 1 & 1, k as i32 >> 2);
            let bucket = bucket(corner.wrapping_add(step), (self.starts.len() - 1) as u32);
            // Cells may share a bucket.
            if seen[..k].contains(&bucket) {
                continue;
            }
            seen[k] = bucket;
            let (from, to) = (self.starts[bucket as usize] as usize, self.starts[bucket as usize + 1] as usize);
            if from == run.end {
                run.end = to;
            } else {
                self.near(lanes, place, run, found);
                run = from..to;
            }
        }
        self.near(lanes, place, run, found);
    }

    /// Of a run of them, those within the radius.
    #[inline(always)]
    fn near<L: Lanes>(&self, lanes: L, place: Vec3, run: Range<usize>, found: &mut Vec<u32>) {
        let x = lanes.splat_v(place.to_array());
        for at in run.clone().step_by(L::N) {
            let [a, b, c] = &self.places;
            let q = L::V::new(lanes.load(&a[at..]), lanes.load(&b[at..]), lanes.load(&c[at..]));
            let near = is_near(self.radius, x, q) & lanes.first(run.end - at);
            for i in near.lanes() {
                found.push((at + i) as u32);
            }
        }
    }

    /// All of them, by their numbers.
    #[inline]
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// How many vertices the subpath of this one has. (The record itself is far away.)
    #[inline]
    pub fn vertices(&self, number: u32) -> u32 {
        self.vertices[number as usize]
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }
}

/// What a light vertex takes at most while the map is made, in bytes: in its tile's list, which may have twice the room
/// that it needs, in the map, and as a place in the order.
pub const BYTES_OF_A_LIGHT_VERTEX: u64 = 3 * size_of::<Record>() as u64 + 40;

/// Of a place among cells that are two radii wide.
#[inline]
fn cell(place: Vec3, radius: f32) -> IVec3 {
    let cells = place * (0.5 / radius);
    let whole = cells.as_ivec3();
    // The next lower number: floor() is a call where the processor has no instruction for it.
    whole.saturating_sub(IVec3::from(whole.as_vec3().cmpgt(cells)))
}

/// Cells side by side along x are in buckets side by side: what is there lies together.
#[inline]
fn bucket(cell: IVec3, buckets: u32) -> u32 {
    let [x, y, z] = cell.to_array().map(i32::cast_unsigned);
    let mixed = y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
    // The lower bits alone of neighbouring rows differ too little.
    (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d).rotate_right(16).wrapping_add(x) & (buckets - 1)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    use super::*;
    use crate::lanes::{Instructions, One};

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
            let records: Vec<_> = (0..).zip(&places).map(|(i, place)| LightVertex::at(*place, i).record()).collect();
            let map = LightVertexMap::new(&[records], radius);
            assert_eq!(map.len(), places.len());
            for _ in 0..200 {
                let x = place();
                let mut found = Vec::new();
                map.around(One, x, &mut found);
                let len = found.len();
                found.sort_unstable();
                found.dedup();
                assert_eq!(len, found.len(), "found twice");
                let expected = places.iter().filter(|place| place.distance(x) <= radius).count();
                assert_eq!(len, expected, "around {x}");
                in_lanes(&map, x, &found);
            }
        }
        let mut found = Vec::new();
        LightVertexMap::new(&[], 0.1).around(One, Vec3::ZERO, &mut found);
        assert!(found.is_empty());
    }

    /// As many lanes as the processor has find those that one finds.
    fn in_lanes(map: &LightVertexMap, place: Vec3, expected: &[u32]) {
        let mut found = Vec::new();
        match Instructions::detect() {
            Instructions::Portable => return,
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(lanes) => map.around(lanes, place, &mut found),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(lanes) => map.around(lanes, place, &mut found),
        }
        found.sort_unstable();
        assert_eq!(found, expected, "around {place}");
    }
}
