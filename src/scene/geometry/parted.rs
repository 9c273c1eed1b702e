//! Rays of a packet that go on alone, one after the other or in turn.

use glam::Vec3;

use super::{
    Geometry, PrimitiveId, Ray,
    bvh::{Found, Order, Tree},
    node::{Child, WIDTH},
    packet::{Met, Packet},
    ray::{Axis, Prepared},
    rays::RayColumns,
};
#[cfg(target_arch = "x86_64")]
use crate::lanes::Eight;
use crate::lanes::{Arrays, Float, Instructions, Lanes, MOST, Mask, Set, Unsigned};

/// Rays that go on alone, by their lanes.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Parted {
    origin: [[f32; MOST]; 3],
    direction: [[f32; MOST]; 3],
    inverse: [[f32; MOST]; 3],
    axes: [[u32; MOST]; 3],
    shear: [[f32; MOST]; 2],
    skip: [[[u32; MOST]; 2]; 2],
}

impl Parted {
    pub const NONE: Self = Self {
        origin: [[0.0; MOST]; 3],
        direction: [[0.0; MOST]; 3],
        inverse: [[0.0; MOST]; 3],
        axes: [[0; MOST]; 3],
        shear: [[0.0; MOST]; 2],
        skip: [[[0; MOST]; 2]; 2],
    };

    /// Takes all rays of a packet.
    #[inline(always)]
    pub fn set<L: Lanes>(&mut self, packet: &Packet<L>) {
        for axis in 0..3 {
            packet.lines.origin[axis].store(&mut self.origin[axis]);
            packet.direction[axis].store(&mut self.direction[axis]);
            packet.lines.inverse[axis].store(&mut self.inverse[axis]);
            packet.axes[axis].store(&mut self.axes[axis]);
        }
        for i in 0..2 {
            packet.lines.shear[i].store(&mut self.shear[i]);
            packet.skip[i][0].store(&mut self.skip[i][0]);
            packet.skip[i][1].store(&mut self.skip[i][1]);
        }
    }

    /// What the ray of a lane passes by.
    #[inline(always)]
    pub fn skip(&self, k: usize) -> [PrimitiveId; 2] {
        let [[i, j], [l, m]] = &self.skip;
        [PrimitiveId { instance: i[k], index: j[k] }, PrimitiveId { instance: l[k], index: m[k] }]
    }

    /// The ray of a lane.
    #[inline(always)]
    pub fn ray(&self, k: usize) -> Prepared {
        let [ox, oy, oz] = [self.origin[0][k], self.origin[1][k], self.origin[2][k]];
        let [dx, dy, dz] = [self.direction[0][k], self.direction[1][k], self.direction[2][k]];
        let [ix, iy, iz] = [self.inverse[0][k], self.inverse[1][k], self.inverse[2][k]];
        Prepared {
            origin: Vec3::new(ox, oy, oz),
            direction: Vec3::new(dx, dy, dz),
            inverse: Vec3::new(ix, iy, iz),
            axes: Axis::frame(self.axes[2][k] as usize),
            shear: [self.shear[0][k], self.shear[1][k]],
        }
    }
}

/// When rays leave their packet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parting {
    /// So many of them or fewer enter a node.
    pub few: u32,
    /// Their origins lie further apart than this along an axis: then they share nothing, and go in turn from the start.
    pub scattered: f32,
}

impl Parting {
    /// What is fastest in this tree, for packets of so many rays.
    pub fn of<O: Order>(tree: Option<&Tree>, lanes: usize) -> Self {
        let Some(tree) = tree else { return Self { few: 0, scattered: f32::INFINITY } };
        // One lane prefetches nothing.
        let scattered = if lanes > 1 { tree.scattered() } else { f32::INFINITY };
        // In a small tree, a walk that ends at the first hit is too short to pay for going alone.
        let is_short = !O::NEAREST_FIRST && tree.nodes.len() < 64;
        Self { few: lanes as u32 / if is_short { 4 } else { 2 }, scattered }
    }
}

impl Geometry {
    /// Brings what rays of a packet meet in a subtree of the world's tree to their places in `met`, one by one: the
    /// closest, or anything.
    #[inline(always)]
    pub(super) fn meet_below<O: Order>(&self, parted: &Parted, which: u32, below: Child, met: &mut Met) {
        let Some(tree) = self.tree() else { return };
        match tree.instructions() {
            Instructions::Portable => self.meet_in::<O, _>(Arrays::<WIDTH>, tree, parted, which, below, met),
            // SAFETY, here and below: a set of lanes exists only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(eight) => unsafe { self.meet_avx2::<O>(eight, tree, parted, which, below, met) },
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(sixteen) => unsafe {
                self.meet_avx2::<O>(sixteen.eight(), tree, parted, which, below, met);
            },
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    #[inline(never)]
    fn meet_avx2<O: Order>(&self, lanes: Eight, tree: &Tree, parted: &Parted, which: u32, below: Child, met: &mut Met) {
        self.meet_in::<O, _>(lanes, tree, parted, which, below, met);
    }

    /// [`Self::meet_below`] in eight lanes.
    #[inline(always)]
    fn meet_in<O: Order, L: Lanes>(
        &self,
        lanes: L,
        tree: &Tree,
        parted: &Parted,
        which: u32,
        below: Child,
        met: &mut Met,
    ) {
        for k in Set::of_bits(which) {
            let (ray, skip) = (parted.ray(k), parted.skip(k));
            tree.walk_in::<O, _>(lanes, below, &ray, met.limit[k], |found, limit| {
                self.meet::<O>(found, limit, &ray, &skip, k, met)
            });
        }
    }

    /// Where `n` rays from the `from`-th on lie [further apart than this](Parting::scattered), brings what they meet to
    /// their places in `met`, and says so. Not inlined, because of the room that it takes on the stack.
    #[inline(never)]
    pub(super) fn meet_in_turn<O: Order>(
        &self,
        rays: &RayColumns<'_>,
        [from, n]: [usize; 2],
        scattered: f32,
        met: &mut Met,
    ) -> bool {
        let Some(tree) = self.tree().filter(|_| rays.are_scattered([from, n], scattered)) else { return false };
        match tree.instructions() {
            Instructions::Portable => self.turns_in::<O, _>(Arrays::<WIDTH>, tree, rays, [from, n], met),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(eight) => unsafe { self.turns_avx2::<O>(eight, tree, rays, [from, n], met) },
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(sixteen) => unsafe {
                self.turns_avx2::<O>(sixteen.eight(), tree, rays, [from, n], met);
            },
        }
        true
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn turns_avx2<O: Order>(&self, lanes: Eight, tree: &Tree, rays: &RayColumns<'_>, range: [usize; 2], met: &mut Met) {
        self.turns_in::<O, _>(lanes, tree, rays, range, met);
    }

    /// [`Self::meet_in_turn`] in eight lanes.
    #[inline(always)]
    fn turns_in<O: Order, L: Lanes>(
        &self,
        lanes: L,
        tree: &Tree,
        rays: &RayColumns<'_>,
        [from, n]: [usize; 2],
        met: &mut Met,
    ) {
        let mut prepared = [Prepared::new(&Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: 0.0 }); MOST];
        let mut skip = [[PrimitiveId::NONE; 2]; MOST];
        for k in 0..n {
            prepared[k] = Prepared::new(&rays.ray(from + k));
            skip[k] = rays.passed_by(from + k);
        }
        let (mut limits, all) = (met.limit, Arrays::<MOST>.first(n).bits());
        tree.walk_in_turn::<O, _>(lanes, &prepared, all, &mut limits, |k, found, limit| {
            self.meet::<O>(found, limit, &prepared[k], &skip[k], k, met)
        });
    }

    /// Brings what the ray of a lane has come upon to its place in `met`; returns the new limit.
    #[inline(always)]
    fn meet<O: Order>(
        &self,
        found: Found<'_>,
        limit: f32,
        ray: &Prepared,
        skip: &[PrimitiveId; 2],
        k: usize,
        met: &mut Met,
    ) -> f32 {
        let skip_world = [skip[0].index_in(PrimitiveId::WORLD), skip[1].index_in(PrimitiveId::WORLD)];
        self.offer::<O, 2>(found, limit, ray, skip, &skip_world, &mut |hit, limit| {
            if !met.improves(k, &hit) {
                return limit;
            }
            met.put(k, hit);
            if O::NEAREST_FIRST { hit.t } else { f32::NEG_INFINITY }
        })
    }
}
