//! The tree over primitives, and how a ray walks it: eight children a node, up to sixteen triangles a leaf.
//!
//! There are two levels of the same tree: one over the world's primitives, in which an instance is a primitive too, and
//! one over the triangles of each instanced mesh.

use std::mem::MaybeUninit;

use glam::{Vec2, Vec3};

use super::{
    Bounds,
    ray::{EightLines, Interval, Prepared},
    simd::{Lanes, Portable, Simd},
    sphere::Sphere,
    triangle::Triangle,
};
#[cfg(target_arch = "x86_64")]
use crate::instructions::Avx2;
use crate::instructions::Instructions;

/// The most inner nodes on any way from the root to a leaf. The builder keeps to it, whatever the geometry, so a
/// walk that puts at most seven siblings per level aside needs no larger stack.
pub(super) const MAX_DEPTH: usize = 64;
/// Children of a node, and triangles of a block.
pub(super) const WIDTH: usize = 8;

/// A primitive as the builder gets it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Primitive {
    pub shape: Shape,
    /// The number of the primitive in its space, or that of the instance.
    pub index: u32,
}

/// The geometry of a primitive.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Triangle(Triangle),
    Sphere(Sphere),
    /// The box of an instance.
    Instance(Bounds),
}

impl Primitive {
    pub fn bounds(&self) -> Bounds {
        match self.shape {
            Shape::Triangle(t) => t.bounds(),
            Shape::Sphere(s) => s.bounds(),
            Shape::Instance(b) => b,
        }
    }

    /// Whether any ray meets it.
    pub fn is_solid(&self) -> bool {
        match self.shape {
            Shape::Triangle(t) => !t.is_degenerate(),
            Shape::Sphere(s) => s.radius > 0.0,
            Shape::Instance(_) => true,
        }
    }

    pub fn is_triangle(&self) -> bool {
        matches!(self.shape, Shape::Triangle(_))
    }
}

/// An inner node: the boxes of its children and where they are. 256 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// For each axis the lower and the upper planes; of a child that is not there, the upper ones lie below the lower
    /// ones.
    pub planes: [[Lanes; 2]; 3],
    pub children: [Child; WIDTH],
}

impl Node {
    pub const EMPTY: Self = Self {
        planes: [[Lanes([f32::INFINITY; WIDTH]), Lanes([f32::NEG_INFINITY; WIDTH])]; 3],
        children: [Child(0); WIDTH],
    };

    #[inline(always)]
    fn planes<S: Simd>(&self, simd: S, [x, y, z]: [usize; 3]) -> [[S::F; 2]; 3] {
        let [px, py, pz] = &self.planes;
        // With the last bit alone, indices need no test.
        [
            [simd.load(&px[x & 1]), simd.load(&px[x & 1 ^ 1])],
            [simd.load(&py[y & 1]), simd.load(&py[y & 1 ^ 1])],
            [simd.load(&pz[z & 1]), simd.load(&pz[z & 1 ^ 1])],
        ]
    }

    pub fn put(&mut self, slot: usize, bounds: Bounds, child: Child) {
        for (axis, [low, high]) in self.planes.iter_mut().enumerate() {
            low.0[slot] = bounds.min[axis];
            high.0[slot] = bounds.max[axis];
        }
        self.children[slot] = child;
    }
}

/// What hangs below a node: a node, or a leaf of blocks of triangles or of other primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// A [`Child`], taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Below {
    Node(u32),
    Blocks { first: u32, count: u32 },
    Others { first: u32, count: u32 },
}

impl Child {
    const LEAF: u32 = 1 << 31;
    const OTHERS: u32 = 1 << 30;
    const COUNT_SHIFT: u32 = 26;
    /// The most blocks or other primitives in a leaf.
    pub const MOST: usize = 16;
    /// How many nodes, blocks and others can be told apart.
    pub const NAMES: usize = 1 << Self::COUNT_SHIFT;

    pub fn new(below: Below) -> Self {
        let leaf = |kind: u32, first: u32, count: u32| {
            assert!((1..=Self::MOST as u32).contains(&count) && (first as usize) < Self::NAMES);
            Self(Self::LEAF | kind | (count - 1) << Self::COUNT_SHIFT | first)
        };
        match below {
            Below::Node(index) => {
                assert!((index as usize) < Self::NAMES, "fewer than 2²⁶ nodes");
                Self(index)
            }
            Below::Blocks { first, count } => leaf(0, first, count),
            Below::Others { first, count } => leaf(Self::OTHERS, first, count),
        }
    }

    #[inline]
    pub fn below(self) -> Below {
        let (first, count) = (self.0 % Self::NAMES as u32, (self.0 >> Self::COUNT_SHIFT) % 16 + 1);
        match self.0 & (Self::LEAF | Self::OTHERS) {
            Self::LEAF => Below::Blocks { first, count },
            x if x & Self::LEAF != 0 => Below::Others { first, count },
            _ => Below::Node(self.0),
        }
    }
}

/// Up to eight triangles side by side: for each axis the coordinates of their first, second and third corners. 320
/// bytes. A lane without a triangle has three equal corners, which no ray meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    corners: [[Lanes; 3]; 3],
    indices: [u32; WIDTH],
}

impl Block {
    /// # Panics
    /// If there are more than eight, or what is no triangle.
    pub fn new(triangles: &[Primitive]) -> Self {
        let mut block = Self { corners: [[Lanes([0.0; WIDTH]); 3]; 3], indices: [u32::MAX; WIDTH] };
        for (lane, primitive) in triangles.iter().enumerate() {
            let Shape::Triangle(triangle) = primitive.shape else { panic!("a block holds triangles") };
            for (k, corner) in triangle.corners().iter().enumerate() {
                (0..3).for_each(|axis| block.corners[axis][k].0[lane] = corner[axis]);
            }
            block.indices[lane] = primitive.index;
        }
        block
    }

    /// Its triangle in a lane, with its number, if there is one.
    #[inline]
    pub fn in_lane(&self, lane: usize) -> Option<(u32, Triangle)> {
        let index = self.indices[lane];
        (index != u32::MAX).then(|| (index, self.triangle(lane)))
    }

    /// The boxes of its triangles, as a node has those of its children.
    #[inline]
    pub fn boxes(&self) -> [[Lanes; 2]; 3] {
        let mut boxes = Node::EMPTY.planes;
        for ([low, high], corners) in boxes.iter_mut().zip(&self.corners) {
            for corner in corners {
                for lane in 0..WIDTH {
                    low.0[lane] = low.0[lane].min(corner.0[lane]);
                    high.0[lane] = high.0[lane].max(corner.0[lane]);
                }
            }
        }
        boxes
    }

    #[inline]
    fn triangle(&self, lane: usize) -> Triangle {
        let corner = |k: usize| Vec3::from_array([0, 1, 2].map(|axis| self.corners[axis][k].0[lane]));
        Triangle::new([corner(0), corner(1), corner(2)])
    }

    /// The planes of the triangles' boxes along an axis, the ones that the ray passes first before the others.
    #[inline(always)]
    fn planes<S: Simd>(&self, simd: S, axis: usize, first: usize) -> [S::F; 2] {
        let [a, b, c] = &self.corners[axis];
        let (a, b, c) = (simd.load(a), simd.load(b), simd.load(c));
        let (low, high) = (simd.min(simd.min(a, b), c), simd.max(simd.max(a, b), c));
        if first == 0 { [low, high] } else { [high, low] }
    }

    /// `Triangle::intersect` for all lanes, with the same roundings: calls `found` with the index, t and the
    /// barycentric coordinates of each triangle that the ray meets, and returns the limit that is left.
    #[inline(always)]
    fn intersect<S: Simd>(
        &self,
        simd: S,
        ray: &Prepared,
        lines: &EightLines<S::F>,
        mut limit: f32,
        mut found: impl FnMut(u32, f32, Vec2, f32) -> f32,
    ) -> f32 {
        let [kx, ky, kz] = ray.axes;
        let [x, y, z] = [&self.corners[kx as usize], &self.corners[ky as usize], &self.corners[kz as usize]];
        let [ax, ay] = lines.sheared(simd, [simd.load(&x[0]), simd.load(&y[0]), simd.load(&z[0])]);
        let [bx, by] = lines.sheared(simd, [simd.load(&x[1]), simd.load(&y[1]), simd.load(&z[1])]);
        let [cx, cy] = lines.sheared(simd, [simd.load(&x[2]), simd.load(&y[2]), simd.load(&z[2])]);
        let u = simd.sub(simd.mul(cx, by), simd.mul(cy, bx));
        let v = simd.sub(simd.mul(ax, cy), simd.mul(ay, cx));
        let w = simd.sub(simd.mul(bx, ay), simd.mul(by, ax));
        let zero = simd.splat(0.0);
        let outside = simd.lt(simd.min(simd.min(u, v), w), zero);
        let inside = simd.lt(zero, simd.max(simd.max(u, v), w));
        let det = simd.add(simd.add(u, v), w);
        let size = simd.max(det, simd.sub(zero, det));
        let infinite = simd.splat(f32::INFINITY);
        let mut met = !(outside & inside) & simd.lt(zero, size) & simd.lt(size, infinite);
        if met == 0 {
            return limit;
        }
        // Most of what is left lies behind the ray.
        let [x, y, z] = lines.first;
        let boxes = [self.planes(simd, 0, x), self.planes(simd, 1, y), self.planes(simd, 2, z)];
        let (near, far, entered) = lines.clip(simd, boxes, limit);
        met &= entered;
        if met == 0 {
            return limit;
        }
        let (v, w, det) = (simd.store(v).0, simd.store(w).0, simd.store(det).0);
        let (near, far) = (simd.store(near).0, simd.store(far).0);
        while met != 0 {
            let lane = met.trailing_zeros() as usize % WIDTH;
            met &= met - 1;
            let range = Interval { near: near[lane], far: far[lane] };
            if let Some(t) = self.triangle(lane).distance(ray, range) {
                limit = found(self.indices[lane], t, Vec2::new(v[lane] / det[lane], w[lane] / det[lane]), limit);
            }
        }
        limit
    }
}

/// What a walk comes upon.
pub(super) enum Found<'a> {
    /// A triangle that the ray meets.
    Triangle { index: u32, t: f32, barycentric: Vec2 },
    /// Another primitive in a leaf that the ray enters.
    Other(&'a Primitive),
}

/// In which order a walk visits what it finds.
pub(super) trait Order {
    const NEAREST_FIRST: bool;
}

/// Nearer nodes first: for the closest hit.
pub(super) struct NearestFirst;

/// Larger nodes first, without sorting: for anything that is in the way.
pub(super) struct LargestFirst;

impl Order for NearestFirst {
    const NEAREST_FIRST: bool = true;
}

impl Order for LargestFirst {
    const NEAREST_FIRST: bool = false;
}

/// A tree: inner nodes, the triangles of its leaves, and the other primitives of its leaves.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub blocks: Vec<Block>,
    pub others: Vec<Primitive>,
    /// `None` if there is nothing.
    pub root: Option<Child>,
    instructions: Instructions,
}

impl Tree {
    pub fn new(nodes: Vec<Node>, blocks: Vec<Block>, others: Vec<Primitive>, root: Option<Child>) -> Self {
        let instructions = Instructions::detect();
        Self { nodes, blocks, others, root, instructions }
    }

    /// The same with walks that use what every processor has.
    #[cfg(test)]
    pub fn portable(self) -> Self {
        Self { instructions: Instructions::Portable, ..self }
    }

    /// Visits what the ray meets at `limit` or before. `visit` gets it with the present limit, and returns the new one,
    /// which must not be larger; −∞ ends the walk.
    ///
    /// What begins exactly at the limit is visited: it may be an equal hit with a smaller id.
    #[inline]
    pub fn walk<O: Order>(&self, ray: &Prepared, limit: f32, visit: impl FnMut(Found<'_>, f32) -> f32) {
        match self.instructions {
            Instructions::Portable => self.walk_with::<O, _>(Portable, ray, limit, visit),
            // SAFETY: a value of `Avx2` exists only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(simd) => unsafe { self.walk_avx2::<O>(simd, ray, limit, visit) },
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn walk_avx2<O: Order>(&self, simd: Avx2, ray: &Prepared, limit: f32, visit: impl FnMut(Found<'_>, f32) -> f32) {
        self.walk_with::<O, _>(simd, ray, limit, visit);
    }

    #[inline(always)]
    fn walk_with<O: Order, S: Simd>(
        &self,
        simd: S,
        ray: &Prepared,
        mut limit: f32,
        mut visit: impl FnMut(Found<'_>, f32) -> f32,
    ) {
        let Some(mut current) = self.root else { return };
        let lines = ray.lines(simd);
        // Not initialised: that would take longer than many walks.
        let mut place = MaybeUninit::uninit();
        let mut stack = Stack { entries: &mut place, len: 0 };
        loop {
            match current.below() {
                Below::Node(index) => {
                    let node = &self.nodes[index as usize];
                    let (near, _, mut entered) = lines.clip(simd, node.planes(simd, lines.first), limit);
                    if entered.is_power_of_two() {
                        current = node.children[entered.trailing_zeros() as usize % WIDTH];
                        continue;
                    }
                    if entered != 0 {
                        let near = simd.store(near).0;
                        let from = stack.len;
                        // The largest is the first of them. Those after it are put aside, the last first.
                        while !entered.is_power_of_two() {
                            let slot = entered.ilog2() as usize % WIDTH;
                            entered ^= 1 << slot;
                            stack.push(Entry::new(near[slot], node.children[slot]));
                        }
                        let slot = entered.trailing_zeros() as usize % WIDTH;
                        current = if O::NEAREST_FIRST {
                            stack.exchange_sorted(from, Entry::new(near[slot], node.children[slot])).child()
                        } else {
                            node.children[slot]
                        };
                        continue;
                    }
                }
                Below::Blocks { first, count } => {
                    for block in &self.blocks[first as usize..][..count as usize] {
                        limit = block.intersect(simd, ray, &lines, limit, |index, t, barycentric, limit| {
                            visit(Found::Triangle { index, t, barycentric }, limit)
                        });
                    }
                }
                Below::Others { first, count } => {
                    for other in &self.others[first as usize..][..count as usize] {
                        limit = visit(Found::Other(other), limit);
                    }
                }
            }
            current = loop {
                let Some(entry) = stack.pop() else { return };
                if entry.near() <= limit {
                    break entry.child();
                }
            };
        }
    }
}

/// A child that is put aside, below the bits of where the ray enters it: of distances that are not negative, the order
/// is that of their bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u64);

impl Entry {
    #[inline(always)]
    fn new(near: f32, child: Child) -> Self {
        Self(u64::from(near.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    fn near(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

/// What a walk has put aside: the first `len` entries.
struct Stack<'a> {
    entries: &'a mut MaybeUninit<[Entry; STACK_SIZE]>,
    len: usize,
}

const STACK_SIZE: usize = WIDTH * MAX_DEPTH;

impl Stack<'_> {
    #[inline(always)]
    fn push(&mut self, entry: Entry) {
        assert!(self.len < STACK_SIZE);
        // SAFETY: it is in range.
        unsafe { self.entries.as_mut_ptr().cast::<Entry>().add(self.len).write(entry) };
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: what lies below the old `len` was pushed.
        Some(unsafe { self.entries.as_ptr().cast::<Entry>().add(self.len).read() })
    }

    /// Puts the entries from `from` on, eight at most, and `last` in order, the nearest last; returns the nearest,
    /// which is not put aside.
    #[inline(always)]
    fn exchange_sorted(&mut self, from: usize, last: Entry) -> Entry {
        assert!(from <= self.len);
        // SAFETY: what lies below `len` was pushed.
        let entries = unsafe {
            std::slice::from_raw_parts_mut(self.entries.as_mut_ptr().cast::<Entry>().add(from), self.len - from)
        };
        let mut nearest = last;
        for i in 0..entries.len() {
            let entry = entries[i].max(nearest);
            nearest = entries[i].min(nearest);
            let mut j = i;
            while j > 0 && entries[j - 1] < entry {
                entries[j] = entries[j - 1];
                j -= 1;
            }
            entries[j] = entry;
        }
        nearest
    }
}
