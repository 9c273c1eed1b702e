//! Rays in batches: what each of many rays meets.

use glam::{Vec2, Vec3};

use super::{
    Geometry, Hit, PrimitiveId, Ray,
    bvh::{LargestFirst, NearestFirst, Order},
    packet::{Met, Packet},
    ray::Prepared,
};
use crate::lanes::{Arrays, Float, Instructions, Lanes, MOST, Select, Unsigned};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{Eight, Sixteen};

/// Rays side by side, and the flat primitives that each passes by.
#[derive(Clone, Debug, Default)]
pub struct Rays {
    len: usize,
    // Each has a multiple of `MOST` places, so that the last packet can be loaded whole.
    pub(super) origin: [Vec<f32>; 3],
    pub(super) direction: [Vec<f32>; 3],
    pub(super) t_max: Vec<f32>,
    skip: Vec<[PrimitiveId; 2]>,
    /// The number of each of the two in world space, or one that no primitive has.
    pub(super) skip_in_world: [Vec<u32>; 2],
}

impl Rays {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds rays that do not meet the two flat primitives in `skip` (a sphere may be hit again from inside).
    #[inline]
    pub fn extend(&mut self, rays: &[Ray], skip: impl Fn(usize) -> [PrimitiveId; 2]) {
        let len = self.len + rays.len();
        // One loop for each array: each is a plain copy then.
        for axis in 0..3 {
            refill(&mut self.origin[axis], self.len, rays.iter().map(|ray| ray.origin[axis]), 0.0);
            refill(&mut self.direction[axis], self.len, rays.iter().map(|ray| ray.direction[axis]), 0.0);
        }
        refill(&mut self.t_max, self.len, rays.iter().map(|ray| ray.t_max), 0.0);
        refill(&mut self.skip, self.len, (0..rays.len()).map(&skip), [PrimitiveId::NONE; 2]);
        for which in 0..2 {
            let in_world = (0..rays.len()).map(|i| skip(i)[which].index_in(PrimitiveId::WORLD));
            refill(&mut self.skip_in_world[which], self.len, in_world, u32::MAX);
        }
        self.len = len;
    }

    /// Puts rays with these origins and directions, column by column, in place of all: each up to `t_max` of its
    /// number, without the two flat primitives of `skip`.
    #[inline(always)]
    pub(crate) fn set(
        &mut self,
        len: usize,
        [origin, direction]: [[&[f32]; 3]; 2],
        t_max: impl Fn(usize) -> f32,
        skip: impl Fn(usize) -> [PrimitiveId; 2],
    ) {
        for axis in 0..3 {
            refill(&mut self.origin[axis], 0, origin[axis].iter().copied(), 0.0);
            refill(&mut self.direction[axis], 0, direction[axis].iter().copied(), 0.0);
        }
        refill(&mut self.t_max, 0, (0..len).map(t_max), 0.0);
        refill(&mut self.skip, 0, (0..len).map(&skip), [PrimitiveId::NONE; 2]);
        for which in 0..2 {
            let in_world = (0..len).map(|i| skip(i)[which].index_in(PrimitiveId::WORLD));
            refill(&mut self.skip_in_world[which], 0, in_world, u32::MAX);
        }
        self.len = len;
    }

    #[inline]
    fn ray(&self, i: usize) -> Ray {
        let at = |[x, y, z]: &[Vec<f32>; 3]| Vec3::new(x[i], y[i], z[i]);
        Ray { origin: at(&self.origin), direction: at(&self.direction), t_max: self.t_max[i] }
    }
}

/// Puts `new` behind the first `len`, and so much of `filling` behind that, that the last packet can be loaded whole.
#[inline(always)]
fn refill<T: Copy>(numbers: &mut Vec<T>, len: usize, new: impl Iterator<Item = T>, filling: T) {
    numbers.truncate(len);
    numbers.extend(new);
    numbers.resize(numbers.len().next_multiple_of(MOST), filling);
}

/// What each of many rays has met, side by side.
#[derive(Clone, Debug, Default)]
pub struct Hits {
    len: usize,
    // Each has a multiple of `MOST` places, so that the last packet can be stored whole.
    t: Vec<f32>,
    instance: Vec<u32>,
    index: Vec<u32>,
    barycentric: [Vec<f32>; 2],
}

impl Hits {
    /// What the `i`-th ray has met, if anything.
    ///
    /// # Panics
    /// If there are no more than `i`.
    #[inline]
    pub fn get(&self, i: usize) -> Option<Hit> {
        assert!(i < self.len);
        let primitive = PrimitiveId { instance: self.instance[i], index: self.index[i] };
        let barycentric = Vec2::new(self.barycentric[0][i], self.barycentric[1][i]);
        (primitive != PrimitiveId::NONE).then_some(Hit { t: self.t[i], primitive, barycentric })
    }

    /// Which of those from the `from`-th on, one for each lane, have met anything; any behind the last.
    #[inline(always)]
    pub(crate) fn any<L: Lanes>(&self, lanes: L, from: usize) -> L::M {
        !lanes.load_u(&self.instance[from..]).eq(lanes.splat_u(u32::MAX))
    }

    /// Whether the primitives from the `from`-th ray on, one for each lane, are the world's, their numbers, and where
    /// on them; anything where a ray has met nothing.
    #[inline(always)]
    pub(crate) fn places<L: Lanes>(&self, lanes: L, from: usize) -> (L::M, L::U, [L::F; 2]) {
        let [b, c] = &self.barycentric;
        let in_world = lanes.load_u(&self.instance[from..]).eq(lanes.splat_u(PrimitiveId::WORLD));
        (in_world, lanes.load_u(&self.index[from..]), [lanes.load(&b[from..]), lanes.load(&c[from..])])
    }

    /// All of them, in the order of the rays.
    pub fn iter(&self) -> impl Iterator<Item = Option<Hit>> {
        (0..self.len).map(|i| self.get(i))
    }

    fn start(&mut self, len: usize) {
        self.len = len;
        let room = len.next_multiple_of(MOST);
        let [b, c] = &mut self.barycentric;
        [&mut self.t, b, c].into_iter().for_each(|numbers| numbers.resize(room, 0.0));
        [&mut self.instance, &mut self.index].into_iter().for_each(|names| names.resize(room, u32::MAX));
    }

    /// Sets those of a packet.
    #[inline(always)]
    fn put<L: Lanes>(&mut self, lanes: L, from: usize, met: &Met) {
        let (any, none) = (lanes.mask(met.any), lanes.splat_u(u32::MAX));
        lanes.load(&met.limit).store(&mut self.t[from..]);
        any.select(lanes.load_u(&met.instance), none).store(&mut self.instance[from..]);
        any.select(lanes.load_u(&met.index), none).store(&mut self.index[from..]);
        lanes.load(&met.barycentric[0]).store(&mut self.barycentric[0][from..]);
        lanes.load(&met.barycentric[1]).store(&mut self.barycentric[1][from..]);
    }
}

impl Geometry {
    /// Of each ray its closest hit, as [`Self::closest`] finds it, in `hits`.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    pub fn closest_of_each(&self, rays: &Rays, hits: &mut Hits) {
        hits.start(rays.len);
        match self.instructions() {
            Instructions::Portable => {
                self.packets::<NearestFirst, _>(Arrays::<1>, 1, rays, |from, _, met| hits.put(Arrays::<1>, from, met));
            }
            // SAFETY, here and below: a set of lanes exists only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(eight) => unsafe { self.closest_avx2(eight, rays, hits) },
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(sixteen) => unsafe { self.closest_avx512(sixteen, rays, hits) },
        }
    }

    /// Of each ray something other than the two primitives that it passes by, as [`Self::obstacle`] finds it, in
    /// `found`: which of several, depends on the tree and the packets.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    pub fn obstacle_of_each(&self, rays: &Rays, found: &mut Hits) {
        found.start(rays.len);
        match self.instructions() {
            Instructions::Portable => {
                self.packets::<LargestFirst, _>(Arrays::<1>, 1, rays, |from, _, met| {
                    found.put(Arrays::<1>, from, met);
                });
            }
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(eight) => unsafe { self.obstacle_avx2(eight, rays, found) },
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(sixteen) => unsafe { self.obstacle_avx512(sixteen, rays, found) },
        }
    }

    fn instructions(&self) -> Instructions {
        self.tree().map_or(Instructions::Portable, |tree| tree.instructions())
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn closest_avx2(&self, lanes: Eight, rays: &Rays, hits: &mut Hits) {
        self.packets::<NearestFirst, _>(lanes, 4, rays, |from, _, met| hits.put(lanes, from, met));
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn closest_avx512(&self, lanes: Sixteen, rays: &Rays, hits: &mut Hits) {
        self.packets::<NearestFirst, _>(lanes, 8, rays, |from, _, met| hits.put(lanes, from, met));
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn obstacle_avx2(&self, lanes: Eight, rays: &Rays, found: &mut Hits) {
        self.packets::<LargestFirst, _>(lanes, 4, rays, |from, _, met| found.put(lanes, from, met));
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn obstacle_avx512(&self, lanes: Sixteen, rays: &Rays, found: &mut Hits) {
        self.packets::<LargestFirst, _>(lanes, 8, rays, |from, _, met| found.put(lanes, from, met));
    }

    /// Walks all rays, one packet after the other; `put` gets where a packet begins, how many rays it has, and what
    /// they have met.
    #[inline(always)]
    pub(super) fn packets<O: Order, L: Lanes>(
        &self,
        lanes: L,
        few: u32,
        rays: &Rays,
        mut put: impl FnMut(usize, usize, &Met),
    ) {
        const { assert!(MOST.is_multiple_of(L::N), "the last packet is loaded whole") };
        let tree = self.tree();
        let mut met = Met::NOTHING;
        // Of the rays that go on alone, by their lanes.
        let mut alone = [Prepared::new(&Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: 0.0 }); MOST];
        let mut from = 0;
        while from < rays.len {
            let n = L::N.min(rays.len - from);
            met.start(lanes.load(&rays.t_max[from..]));
            if let Some(tree) = tree {
                let packet = Packet::new(lanes, rays, from);
                let mut ready = 0;
                tree.walk_packet::<O, L>(&packet, lanes.first(n), few, &mut met, |k, below, met| {
                    if ready >> k & 1 == 0 {
                        alone[k] = Prepared::new(&rays.ray(from + k));
                        ready |= 1 << k;
                    }
                    self.meet_below::<O>(&alone[k], &rays.skip[from + k], below, k, met);
                });
            }
            put(from, n, &met);
            from += L::N;
        }
    }
}
