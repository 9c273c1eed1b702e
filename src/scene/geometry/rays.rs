//! Rays in batches: what each of many rays meets.

use glam::{Vec2, Vec3};

use super::{
    Geometry, Hit, PrimitiveId, Ray,
    bvh::{LargestFirst, NearestFirst, Order},
    packet::{Met, Packet},
    parted::{Parted, Parting},
};
use crate::lanes::{Arrays, Float, Instructions, Lanes, MOST, Select, Unsigned};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{Eight, Sixteen};

/// Rays side by side, and the flat primitives that each passes by.
#[derive(Clone, Debug, Default)]
pub struct Rays {
    len: usize,
    // Each has a multiple of `MOST` places, so that the last packet can be loaded whole.
    origin: [Vec<f32>; 3],
    direction: [Vec<f32>; 3],
    t_max: Vec<f32>,
    skip: [[Vec<u32>; 2]; 2],
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
    pub fn extend(&mut self, rays: &[Ray], skip: impl Fn(usize) -> [PrimitiveId; 2]) {
        for axis in 0..3 {
            refill(&mut self.origin[axis], self.len, rays.iter().map(|ray| ray.origin[axis]));
            refill(&mut self.direction[axis], self.len, rays.iter().map(|ray| ray.direction[axis]));
        }
        refill(&mut self.t_max, self.len, rays.iter().map(|ray| ray.t_max));
        for (which, words) in self.skip.iter_mut().enumerate() {
            for (part, word) in words.iter_mut().enumerate() {
                refill(word, self.len, (0..rays.len()).map(|i| skip(i)[which].words()[part]));
            }
        }
        self.len += rays.len();
    }

    /// What [`Geometry::closest_of_each`] takes.
    pub fn columns(&self) -> RayColumns<'_> {
        let ([ox, oy, oz], [dx, dy, dz], [[i, j], [k, l]]) = (&self.origin, &self.direction, &self.skip);
        RayColumns {
            len: self.len,
            origin: [ox, oy, oz],
            direction: [dx, dy, dz],
            t_max: Some(&self.t_max),
            skip: [Some([i, j]), Some([k, l])],
        }
    }
}

/// Puts `new` behind the first `len`, and so much behind that, that the last packet can be loaded whole.
fn refill<T: Copy + Default>(numbers: &mut Vec<T>, len: usize, new: impl Iterator<Item = T>) {
    numbers.truncate(len);
    numbers.extend(new);
    numbers.resize(numbers.len().next_multiple_of(MOST), T::default());
}

/// Rays that lie side by side somewhere, column by column. Each column has something up to the next multiple of
/// [`MOST`], so that the last packet can be loaded whole.
#[derive(Clone, Copy, Debug)]
pub struct RayColumns<'a> {
    pub(crate) len: usize,
    pub(crate) origin: [&'a [f32]; 3],
    pub(crate) direction: [&'a [f32]; 3],
    /// See [`Ray::t_max`]; none for half-lines.
    pub(crate) t_max: Option<&'a [f32]>,
    /// The flat primitives that each passes by, as [`PrimitiveId::words`].
    pub(crate) skip: [Option<[&'a [u32]; 2]>; 2],
}

impl RayColumns<'_> {
    /// Where those from the `from`-th on end, one for each lane.
    #[inline(always)]
    fn t_max<L: Lanes>(&self, lanes: L, from: usize) -> L::F {
        match self.t_max {
            None => lanes.splat(f32::INFINITY),
            Some(t_max) => lanes.load(&t_max[from..]),
        }
    }

    /// Whether the origins of `n` from the `from`-th on lie further apart than `far` along an axis.
    pub(super) fn are_scattered(&self, [from, n]: [usize; 2], far: f32) -> bool {
        self.origin.iter().any(|x| {
            let x = &x[from..from + n];
            x.iter().copied().fold(x[0], f32::max) - x.iter().copied().fold(x[0], f32::min) > far
        })
    }

    /// The `i`-th.
    #[inline]
    pub(super) fn ray(&self, i: usize) -> Ray {
        let at = |[x, y, z]: [&[f32]; 3]| Vec3::new(x[i], y[i], z[i]);
        let t_max = self.t_max.map_or(f32::INFINITY, |t_max| t_max[i]);
        Ray { origin: at(self.origin), direction: at(self.direction), t_max }
    }

    /// What the `i`-th passes by.
    #[inline]
    pub(super) fn passed_by(&self, i: usize) -> [PrimitiveId; 2] {
        let name = |words: Option<[&[u32]; 2]>| {
            words.map_or(PrimitiveId::NONE, |[instance, index]| PrimitiveId::of_words([instance[i], index[i]]))
        };
        self.skip.map(name)
    }

    /// What those from the `from`-th on pass by.
    #[inline(always)]
    pub(super) fn skip<L: Lanes>(&self, lanes: L, from: usize) -> [[L::U; 2]; 2] {
        let mut skip = [[lanes.splat_u(u32::MAX); 2]; 2];
        for (skip, words) in skip.iter_mut().zip(self.skip) {
            if let Some([instance, index]) = words {
                *skip = [lanes.load_u(&instance[from..]), lanes.load_u(&index[from..])];
            }
        }
        skip
    }
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

    /// How far the hits from the `from`-th ray on are along theirs, one for each lane; anything where there is none.
    #[inline(always)]
    pub(crate) fn distances<L: Lanes>(&self, lanes: L, from: usize) -> L::F {
        lanes.load(&self.t[from..])
    }

    /// All of them, in the order of the rays.
    pub fn iter(&self) -> impl Iterator<Item = Option<Hit>> {
        (0..self.len).map(|i| self.get(i))
    }

    fn start(&mut self, len: usize) {
        self.len = len;
        let room = len.next_multiple_of(MOST);
        if self.t.len() < room {
            let [b, c] = &mut self.barycentric;
            [&mut self.t, b, c].into_iter().for_each(|numbers| numbers.resize(room, 0.0));
            [&mut self.instance, &mut self.index].into_iter().for_each(|names| names.resize(room, u32::MAX));
        }
    }

    /// Sets those of a packet.
    #[inline(always)]
    fn put<L: Lanes>(&mut self, lanes: L, from: usize, met: &Met) {
        let (any, none) = (lanes.mask(met.any), lanes.splat_u(u32::MAX));
        lanes.load(&met.limit).store(&mut self.t[from..]);
        any.select(lanes.load_u(&met.instance), none).store(&mut self.instance[from..]);
        any.select(lanes.load_u(&met.index), none).store(&mut self.index[from..]);
        let det = lanes.load(&met.areas[2]);
        (lanes.load(&met.areas[0]) / det).store(&mut self.barycentric[0][from..]);
        (lanes.load(&met.areas[1]) / det).store(&mut self.barycentric[1][from..]);
    }
}

impl Geometry {
    /// Of each ray its closest hit, as [`Self::closest`] finds it, in `hits`.
    ///
    /// # Panics
    /// If there are primitives, but [`Self::build`] has not been called.
    pub fn closest_of_each(&self, rays: RayColumns<'_>, hits: &mut Hits) {
        match self.instructions() {
            Instructions::Portable => self.fill::<NearestFirst, _>(Arrays::<1>, rays, hits),
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
    pub fn obstacle_of_each(&self, rays: RayColumns<'_>, found: &mut Hits) {
        match self.instructions() {
            Instructions::Portable => self.fill::<LargestFirst, _>(Arrays::<1>, rays, found),
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
    fn closest_avx2(&self, lanes: Eight, rays: RayColumns<'_>, hits: &mut Hits) {
        self.fill::<NearestFirst, _>(lanes, rays, hits);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn closest_avx512(&self, lanes: Sixteen, rays: RayColumns<'_>, hits: &mut Hits) {
        self.fill::<NearestFirst, _>(lanes, rays, hits);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn obstacle_avx2(&self, lanes: Eight, rays: RayColumns<'_>, found: &mut Hits) {
        self.fill::<LargestFirst, _>(lanes, rays, found);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn obstacle_avx512(&self, lanes: Sixteen, rays: RayColumns<'_>, found: &mut Hits) {
        self.fill::<LargestFirst, _>(lanes, rays, found);
    }

    #[inline(always)]
    fn fill<O: Order, L: Lanes>(&self, lanes: L, rays: RayColumns<'_>, hits: &mut Hits) {
        hits.start(rays.len);
        let parting = Parting::of::<O>(self.tree(), L::N);
        self.packets::<O, _>(lanes, parting, rays, |from, _, met| hits.put(lanes, from, met));
    }

    /// Walks all rays, one packet after the other; `put` gets where a packet begins, how many rays it has, and what
    /// they have met.
    #[inline(always)]
    pub(super) fn packets<O: Order, L: Lanes>(
        &self,
        lanes: L,
        parting: Parting,
        rays: RayColumns<'_>,
        mut put: impl FnMut(usize, usize, &Met),
    ) {
        const { assert!(MOST.is_multiple_of(L::N), "the last packet is loaded whole") };
        let tree = self.tree();
        let mut met = Met::NOTHING;
        let mut parted = Parted::NONE;
        let mut from = 0;
        while from < rays.len {
            let n = L::N.min(rays.len - from);
            met.start(rays.t_max(lanes, from));
            let in_turn = parting.scattered < f32::INFINITY
                && self.meet_in_turn::<O>(&rays, [from, n], parting.scattered, &mut met);
            if let Some(tree) = tree.filter(|_| !in_turn) {
                let packet = Packet::new(lanes, &rays, from);
                let mut ready = false;
                tree.walk_packet::<O, L>(&packet, lanes.first(n), parting.few, &mut met, |which, below, met| {
                    if !ready {
                        parted.set(&packet);
                        ready = true;
                    }
                    self.meet_below::<O>(&parted, which, below, met);
                });
            }
            put(from, n, &met);
            from += L::N;
        }
    }
}
