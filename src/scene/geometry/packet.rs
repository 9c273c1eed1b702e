//! Rays in packets: one in each lane, on one walk through the tree.
//!
//! A packet stays together while more than a few of its rays enter a node. Where few do, each goes on through that
//! subtree alone, eight boxes at a time; so do rays that come to a sphere or an instance. Roundings are those of single
//! rays, and a hit is a function of the ray and its primitive alone, so that nobody can tell who went with whom.

use std::mem::MaybeUninit;

use glam::{DVec3, Vec3};

use super::{
    Hit, PrimitiveId,
    bvh::{Order, Stack, Tree},
    node::{Below, Block, Child, Node, WIDTH},
    ray::{BEFORE, Lines},
    rays::RayColumns,
    triangle::Triangle,
};
use crate::lanes::{Float, Lanes, MOST, Mask, Select, Unsigned};

/// A ray in each lane.
pub(super) struct Packet<L: Lanes> {
    pub lines: Lines<L>,
    /// See [`Prepared::axes`](super::ray::Prepared::axes).
    pub axes: [L::U; 3],
    /// The inverse of the direction along them.
    inverse: [L::F; 3],
    pub direction: [L::F; 3],
    /// What each ray passes by, as [`PrimitiveId::words`].
    pub skip: [[L::U; 2]; 2],
    /// The numbers of those in world space.
    skipped: [L::U; 2],
}

/// What the rays of a packet have met so far, side by side; places beyond the last lane are not used.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Met {
    /// How far each ray still looks.
    pub limit: [f32; MOST],
    /// The primitive that is there, as [`PrimitiveId`] has it; before there is one, a name that no other comes before.
    pub instance: [u32; MOST],
    pub index: [u32; MOST],
    /// The edge functions of the second and the third corner, and the sum of all: over it, they are the barycentric
    /// coordinates.
    pub areas: [[f32; MOST]; 3],
    /// Which rays have met anything.
    pub any: u32,
}

impl Met {
    pub const NOTHING: Self =
        Self { limit: [0.0; MOST], instance: [0; MOST], index: [0; MOST], areas: [[1.0; MOST]; 3], any: 0 };

    /// Forgets all, and looks as far as this.
    #[inline(always)]
    pub fn start(&mut self, limit: impl Float) {
        limit.store(&mut self.limit);
        (self.instance, self.index, self.any) = ([0; MOST], [0; MOST], 0);
    }

    /// Whether `hit` is what the ray looks for: what comes before what it has met.
    #[inline(always)]
    pub fn improves(&self, k: usize, hit: &Hit) -> bool {
        let there = (self.limit[k], PrimitiveId { instance: self.instance[k], index: self.index[k] });
        hit.order() < there
    }

    #[inline(always)]
    pub fn put(&mut self, k: usize, hit: Hit) {
        self.limit[k] = hit.t;
        (self.instance[k], self.index[k]) = (hit.primitive.instance, hit.primitive.index);
        [self.areas[0][k], self.areas[1][k], self.areas[2][k]] = [hit.barycentric.x, hit.barycentric.y, 1.0];
        self.any |= 1 << k;
    }
}

impl<L: Lanes> Packet<L> {
    /// The rays from the `from`-th on, one for each lane.
    #[inline(always)]
    pub fn new(lanes: L, rays: &RayColumns<'_>, from: usize) -> Self {
        let [ox, oy, oz] = [&rays.origin[0][from..], &rays.origin[1][from..], &rays.origin[2][from..]];
        let [dx, dy, dz] = [&rays.direction[0][from..], &rays.direction[1][from..], &rays.direction[2][from..]];
        let (ox, oy, oz) = (lanes.load(ox), lanes.load(oy), lanes.load(oz));
        let (dx, dy, dz) = (lanes.load(dx), lanes.load(dy), lanes.load(dz));
        // `Prepared::new`, with the same roundings.
        let (x, y, z) = (dx.abs(), dy.abs(), dz.abs());
        let along_x = y.le(x) & z.le(x);
        let along_y = z.le(y);
        let one = lanes.splat(1.0);
        let depth = turned::<L, _>(along_x, along_y, [dx, dy, dz]);
        let [k0, k1, k2] = [lanes.splat_u(0), lanes.splat_u(1), lanes.splat_u(2)];
        let [ix, iy, iz] = [inverse(lanes, one, dx), inverse(lanes, one, dy), inverse(lanes, one, dz)];
        let lines = Lines {
            lanes,
            origin: [ox, oy, oz],
            inverse: [ix, iy, iz],
            start: [
                turned::<L, _>(along_x, along_y, [oy, oz, ox]),
                turned::<L, _>(along_x, along_y, [oz, ox, oy]),
                turned::<L, _>(along_x, along_y, [ox, oy, oz]),
            ],
            shear: [
                turned::<L, _>(along_x, along_y, [dy, dz, dx]) / depth,
                turned::<L, _>(along_x, along_y, [dz, dx, dy]) / depth,
            ],
        };
        let (skip, world, none) = (rays.skip(lanes, from), lanes.splat_u(PrimitiveId::WORLD), lanes.splat_u(u32::MAX));
        let [[i, j], [k, l]] = skip;
        Self {
            lines,
            axes: [
                turned::<L, _>(along_x, along_y, [k1, k2, k0]),
                turned::<L, _>(along_x, along_y, [k2, k0, k1]),
                turned::<L, _>(along_x, along_y, [k0, k1, k2]),
            ],
            inverse: [
                turned::<L, _>(along_x, along_y, [iy, iz, ix]),
                turned::<L, _>(along_x, along_y, [iz, ix, iy]),
                turned::<L, _>(along_x, along_y, [ix, iy, iz]),
            ],
            direction: [dx, dy, dz],
            skip,
            skipped: [i.eq(world).select(j, none), k.eq(world).select(l, none)],
        }
    }

    /// Where the rays are in a box, and which of them enter it at `limit` or before.
    #[inline(always)]
    fn clip(&self, [[x0, x1], [y0, y1], [z0, z1]]: [[f32; 2]; 3], limit: L::F) -> ([L::F; 2], L::M) {
        let lanes = self.lines.lanes;
        let [x0, x1] = self.lines.slab([lanes.splat(x0), lanes.splat(x1)], 0);
        let [y0, y1] = self.lines.slab([lanes.splat(y0), lanes.splat(y1)], 1);
        let [z0, z1] = self.lines.slab([lanes.splat(z0), lanes.splat(z1)], 2);
        let slabs = [[x0.min(x1), x0.max(x1)], [y0.min(y1), y0.max(y1)], [z0.min(z1), z0.max(z1)]];
        let [near, far] = self.lines.clip(slabs);
        ([near, far], near.le(far.min(limit)))
    }

    /// A corner of the triangle in a lane of a block as [`Lines::relative`] has it.
    #[inline(always)]
    fn relative(&self, block: &Block, k: usize, corner: usize) -> [L::F; 3] {
        let (lanes, of) = (self.lines.lanes, block.corners(corner));
        let [x, y, z] = self.axes;
        self.lines.relative([lanes.pick(of, k, x), lanes.pick(of, k, y), lanes.pick(of, k, z)])
    }

    /// Where the rays enter and leave the slab between the least and the largest of coordinates as seen from the
    /// origin, along one of [`Self::axes`].
    #[inline(always)]
    fn slab(&self, [a, b, c]: [[L::F; 3]; 3], axis: usize) -> [L::F; 2] {
        let inverse = self.inverse[axis];
        let (a, b, c) = (a[axis] * inverse, b[axis] * inverse, c[axis] * inverse);
        [a.min(b).min(c), a.max(b).max(c)]
    }

    /// [`Triangle::distance`], with the same roundings.
    #[inline(always)]
    fn distance(&self, n: DVec3, a: DVec3, [near, far]: [L::F; 2]) -> L::F {
        let ([ox, oy, oz], [dx, dy, dz]) = (self.lines.origin, self.direction);
        // From the plane to the origin, and not the other way: it rounds alike, and the sign is turned below.
        let behind = (ox.to_f64() - a.x) * n.x + (oy.to_f64() - a.y) * n.y + (oz.to_f64() - a.z) * n.z;
        let t = -L::F::from_f64(behind / (dx.to_f64() * n.x + dy.to_f64() * n.y + dz.to_f64() * n.z));
        near.le(t).select(t.min(far), near)
    }

    /// Puts aside the children of a node that some of the rays enter, with these.
    #[inline(always)]
    fn enter<O: Order>(&self, node: &Node, rays: u32, met: &Met, stack: &mut Stack<'_, Entry>) {
        let lanes = self.lines.lanes;
        let (entering, from) = (lanes.mask(rays), stack.len());
        for i in 0..WIDTH {
            // Where the order does not matter, the largest is put aside last.
            let slot = if O::NEAREST_FIRST { i } else { WIDTH - 1 - i };
            let Some(planes) = node.child_planes(slot) else { continue };
            let ([near, _], entered) = self.clip(planes, lanes.load(&met.limit));
            let rays = (entered & entering).bits();
            if rays != 0 {
                let near = near.lane(rays.trailing_zeros());
                let entry = Entry { near, rays, child: node.children[slot].bits() };
                if O::NEAREST_FIRST { stack.push_sorted(from, entry) } else { stack.push(entry) }
            }
        }
    }

    /// Meets the triangle in a lane of a block with those of the rays `which`.
    #[inline(always)]
    fn triangle<O: Order>(&self, block: &Block, k: usize, which: L::M, met: &mut Met) {
        let lanes = self.lines.lanes;
        let corners = [self.relative(block, k, 0), self.relative(block, k, 1), self.relative(block, k, 2)];
        let (lines, [a, b, c]) = (&self.lines, corners);
        let edges = lines.edges([lines.sheared(a), lines.sheared(b), lines.sheared(c)]);
        // Most of what is left lies behind the ray or too far away, which the box shows along one axis already.
        let (limit, z) = (lanes.load(&met.limit), self.slab(corners, 2));
        let within = lanes.splat(0.0).le(z[1]) & (z[0] * BEFORE).le(limit);
        let index = lanes.splat_u(block.index(k));
        let skipped = index.eq(self.skipped[0]) | index.eq(self.skipped[1]);
        let candidates = edges.inside & within & which & !skipped;
        if !candidates.any() {
            return;
        }
        let det = edges.det();
        let [near, far] = lines.clip([self.slab(corners, 0), self.slab(corners, 1), z]);
        let candidates = candidates & lines.is_area(det) & near.le(far.min(limit));
        if !candidates.any() {
            return;
        }
        let [a, b, c] = [block.corner(k, 0), block.corner(k, 1), block.corner(k, 2)];
        let [a, b, c] = [Vec3::from_array(a), Vec3::from_array(b), Vec3::from_array(c)];
        let t = self.distance(Triangle::new([a, b, c]).cross(), a.as_dvec3(), [near, far]);
        let ahead = candidates & lanes.splat(0.0).lt(t);
        // At equal distance the smaller id: see `Hit::order`.
        let (before, there) = (lanes.load_u(&met.index), lanes.load_u(&met.instance));
        let world = lanes.splat_u(PrimitiveId::WORLD);
        let first = world.lt(there) | (world.eq(there) & index.lt(before));
        let nearer = if O::NEAREST_FIRST { t.lt(limit) | (t.eq(limit) & first) } else { t.lt(limit) };
        let hit = ahead & nearer;
        if hit.any() {
            hit.select(t, limit).store(&mut met.limit);
            hit.select(world, there).store(&mut met.instance);
            hit.select(index, before).store(&mut met.index);
            for (area, x) in met.areas.iter_mut().zip([edges.v, edges.w, det]) {
                hit.select(x, lanes.load(area)).store(area);
            }
            met.any |= hit.bits();
        }
    }
}

/// The first of three where a ray goes along x most, and so on.
#[inline(always)]
fn turned<L: Lanes, T>(along_x: L::M, along_y: L::M, [x, y, z]: [T; 3]) -> T
where
    L::M: Select<T>,
{
    along_x.select(x, along_y.select(y, z))
}

#[inline(always)]
fn inverse<L: Lanes>(lanes: L, one: L::F, x: L::F) -> L::F {
    x.abs().lt(lanes.splat(1e-18)).select(lanes.splat(1e18).copysign(x), one / x)
}

/// A child that is put aside; the nearest is the least.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Entry {
    /// Where the first of its rays enters it.
    near: f32,
    /// The rays that do.
    rays: u32,
    child: u32,
}

impl Tree {
    /// Walks the rays `which` of a packet through the tree, together as long as more than `few` of them enter a node.
    ///
    /// `alone` sends those of some lanes through a subtree one by one, and brings what they meet to [`Met`].
    #[inline(always)]
    pub fn walk_packet<O: Order, L: Lanes>(
        &self,
        packet: &Packet<L>,
        which: L::M,
        few: u32,
        met: &mut Met,
        mut alone: impl FnMut(u32, Child, &mut Met),
    ) {
        let Some(root) = self.root else { return };
        let lanes = packet.lines.lanes;
        // Not initialised: that would take longer than many walks.
        let mut place = MaybeUninit::uninit();
        let mut stack = Stack::new(&mut place);
        // The rays that still look, and those of them that enter the present node.
        let (mut open, mut rays, mut current) = (which.bits(), which.bits(), root);
        loop {
            let below = current.below();
            let together = match below {
                Below::Node(_) => rays.count_ones() > few,
                Below::Blocks { .. } => true,
                Below::Others { .. } => false,
            };
            match below {
                Below::Node(index) if together => {
                    packet.enter::<O>(&self.nodes[index as usize], rays, met, &mut stack);
                }
                Below::Blocks { first, count } => {
                    for block in &self.blocks[first as usize..][..count as usize] {
                        for k in 0..block.len() {
                            let which = if O::NEAREST_FIRST { rays } else { rays & !met.any };
                            packet.triangle::<O>(block, k, lanes.mask(which), met);
                        }
                    }
                }
                _ => alone(rays, current, met),
            }
            if !O::NEAREST_FIRST {
                open &= !met.any;
                if open == 0 {
                    return;
                }
            }
            loop {
                let Some(entry) = stack.pop() else { return };
                (current, rays) = (Child::of_bits(entry.child), entry.rays & open);
                if rays != 0 {
                    break;
                }
            }
        }
    }
}
