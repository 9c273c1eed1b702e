//! The tree over primitives, and how a ray walks it: eight children a node, up to sixteen triangles a leaf.
//!
//! There are two levels of the same tree: one over the world's primitives, in which an instance is a primitive too, and
//! one over the triangles of each instanced mesh.

use std::mem::MaybeUninit;

use glam::Vec2;

use super::{
    node::{Below, Block, Child, Node, Primitive, Row, WIDTH},
    ray::{OneLine, Prepared},
};
#[cfg(target_arch = "x86_64")]
use crate::lanes::Eight;
use crate::lanes::{Arrays, Instructions, Lanes, MOST, Mask, Set};

/// The most inner nodes on any way from the root to a leaf. The builder keeps to it, whatever the geometry, so a
/// walk that puts at most seven siblings per level aside needs no larger stack.
pub(super) const MAX_DEPTH: usize = 64;
/// What a walk comes upon.
#[derive(Clone, Copy)]
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
    /// See [`Self::scattered`].
    scattered: f32,
}

/// A tree of more bytes than this is not in the cache of the processor.
const LARGE: usize = 48 << 20;

impl Tree {
    pub fn new(nodes: Vec<Node>, blocks: Vec<Block>, others: Vec<Primitive>, root: Option<Child>) -> Self {
        let (instructions, mut scattered) = (Instructions::detect(), f32::INFINITY);
        if size_of_val(&*nodes) + size_of_val(&*blocks) > LARGE
            && let Some(Below::Node(root)) = root.map(Child::below)
        {
            let size = |[low, high]: &[Row; 2]| {
                let low = low.0.iter().copied().fold(f32::INFINITY, f32::min);
                high.0.iter().copied().fold(f32::NEG_INFINITY, f32::max) - low
            };
            scattered = nodes[root as usize].planes.iter().map(size).fold(0.0, f32::max) / 8.0;
        }
        Self { nodes, blocks, others, root, instructions, scattered }
    }

    /// How far apart rays have to begin so that each needs other parts of the tree, which are not in the cache of the
    /// processor; infinitely far where all of the tree may be.
    pub fn scattered(&self) -> f32 {
        self.scattered
    }

    /// The same with walks that use what every processor has.
    #[cfg(test)]
    pub fn portable(self) -> Self {
        Self { instructions: Instructions::Portable, ..self }
    }

    /// Those that walks use.
    #[inline]
    pub fn instructions(&self) -> Instructions {
        self.instructions
    }

    /// Visits what the ray meets at `limit` or before. `visit` gets it with the present limit, and returns the new one,
    /// which must not be larger; −∞ ends the walk.
    ///
    /// What begins exactly at the limit is visited: it may be an equal hit with a smaller id.
    #[inline]
    pub fn walk<O: Order>(&self, ray: &Prepared, limit: f32, visit: impl FnMut(Found<'_>, f32) -> f32) {
        if let Some(root) = self.root {
            self.walk_below::<O>(root, ray, limit, visit);
        }
    }

    /// [`Self::walk`] through a subtree.
    #[inline]
    pub fn walk_below<O: Order>(
        &self,
        from: Child,
        ray: &Prepared,
        limit: f32,
        visit: impl FnMut(Found<'_>, f32) -> f32,
    ) {
        match self.instructions {
            Instructions::Portable => self.walk_in::<O, _>(Arrays::<WIDTH>, from, ray, limit, visit),
            // SAFETY: a set of lanes exists only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(eight) => unsafe { self.walk_avx2::<O>(eight, from, ray, limit, visit) },
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(sixteen) => unsafe { self.walk_avx2::<O>(sixteen.eight(), from, ray, limit, visit) },
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn walk_avx2<O: Order>(
        &self,
        lanes: Eight,
        from: Child,
        ray: &Prepared,
        limit: f32,
        visit: impl FnMut(Found<'_>, f32) -> f32,
    ) {
        self.walk_in::<O, _>(lanes, from, ray, limit, visit);
    }

    /// [`Self::walk_below`] in eight lanes.
    #[inline(always)]
    pub(super) fn walk_in<O: Order, L: Lanes>(
        &self,
        lanes: L,
        from: Child,
        ray: &Prepared,
        mut limit: f32,
        mut visit: impl FnMut(Found<'_>, f32) -> f32,
    ) {
        let line = OneLine::new(lanes, ray);
        // Not initialised: that would take longer than many walks.
        let mut place = MaybeUninit::uninit();
        let mut stack = Stack::new(&mut place);
        let mut next = Some(from);
        while let Some(current) = next {
            next = self.step::<O, _>(&line, current, &mut stack, &mut limit, &mut visit);
        }
    }

    /// Visits what is in a node or a leaf; returns where to go on.
    #[inline(always)]
    fn step<O: Order, L: Lanes>(
        &self,
        line: &OneLine<L>,
        current: Child,
        stack: &mut Stack<'_, Entry>,
        limit: &mut f32,
        visit: &mut impl FnMut(Found<'_>, f32) -> f32,
    ) -> Option<Child> {
        match current.below() {
            Below::Node(index) => {
                let node = &self.nodes[index as usize];
                let ([near, _], entered) = line.clip(node.planes(line.lines.lanes, line.first), *limit);
                let mut entered = entered.bits();
                if entered.is_power_of_two() {
                    return Some(node.children[entered.trailing_zeros() as usize % WIDTH]);
                }
                if entered != 0 {
                    let near = Row::of(near).0;
                    let from = stack.len();
                    // The largest is the first of them. Those after it are put aside, the last first.
                    while !entered.is_power_of_two() {
                        let slot = entered.ilog2() as usize % WIDTH;
                        entered ^= 1 << slot;
                        stack.push(Entry::new(near[slot], node.children[slot]));
                    }
                    let slot = entered.trailing_zeros() as usize % WIDTH;
                    return Some(if O::NEAREST_FIRST {
                        stack.exchange_sorted(from, Entry::new(near[slot], node.children[slot])).child()
                    } else {
                        node.children[slot]
                    });
                }
            }
            Below::Blocks { first, count } => {
                for block in &self.blocks[first as usize..][..count as usize] {
                    *limit = block.intersect(line, *limit, |index, t, barycentric, limit| {
                        visit(Found::Triangle { index, t, barycentric }, limit)
                    });
                }
            }
            Below::Others { first, count } => {
                for other in &self.others[first as usize..][..count as usize] {
                    *limit = visit(Found::Other(other), *limit);
                }
            }
        }
        loop {
            let entry = stack.pop()?;
            if entry.near() <= *limit {
                return Some(entry.child());
            }
        }
    }

    /// Walks several rays through the tree, a step of each in turn, so that memory answers one while others go on.
    /// `rays` has those of the lanes `which`, `limits` how far they look, and `visit` gets the lane.
    #[inline(always)]
    pub fn walk_in_turn<O: Order, L: Lanes>(
        &self,
        lanes: L,
        rays: &[Prepared; MOST],
        mut which: u32,
        limits: &mut [f32; MOST],
        mut visit: impl FnMut(usize, Found<'_>, f32) -> f32,
    ) {
        // Not initialised: that would take longer than many walks.
        let mut places = [const { MaybeUninit::uninit() }; MOST];
        let Some(from) = self.root else { return };
        let (mut lens, mut at) = ([0; MOST], [from; MOST]);
        while which != 0 {
            for k in Set::of_bits(which) {
                let k = k % MOST;
                let line = OneLine::new(lanes, &rays[k]);
                let mut stack = Stack { entries: &mut places[k], len: lens[k] };
                let next = self
                    .step::<O, _>(&line, at[k], &mut stack, &mut limits[k], &mut |found, limit| visit(k, found, limit));
                lens[k] = stack.len;
                match next {
                    None => which &= !(1 << k),
                    Some(child) => {
                        at[k] = child;
                        self.prefetch(lanes, child);
                    }
                }
            }
        }
    }

    /// Asks memory for a node or a leaf.
    #[inline(always)]
    fn prefetch(&self, lanes: impl Lanes, child: Child) {
        match child.below() {
            Below::Node(index) => lanes.prefetch(&self.nodes[index as usize]),
            Below::Blocks { first, .. } => lanes.prefetch(&self.blocks[first as usize]),
            Below::Others { .. } => {}
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
        Self(u64::from(near.to_bits()) << 32 | u64::from(child.bits()))
    }

    #[inline(always)]
    fn near(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child::of_bits(self.0 as u32)
    }
}

/// What a walk has put aside: the first `len` entries.
pub(super) struct Stack<'a, E> {
    entries: &'a mut MaybeUninit<[E; STACK_SIZE]>,
    len: usize,
}

const STACK_SIZE: usize = WIDTH * MAX_DEPTH;

impl<'a, E: Copy + PartialOrd> Stack<'a, E> {
    #[inline(always)]
    pub fn new(entries: &'a mut MaybeUninit<[E; STACK_SIZE]>) -> Self {
        Self { entries, len: 0 }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn push(&mut self, entry: E) {
        assert!(self.len < STACK_SIZE);
        // SAFETY: it is in range.
        unsafe { self.entries.as_mut_ptr().cast::<E>().add(self.len).write(entry) };
        self.len += 1;
    }

    /// The same, before those entries from `from` on that are less.
    #[inline(always)]
    pub fn push_sorted(&mut self, from: usize, entry: E) {
        self.push(entry);
        let entries = self.since(from);
        let mut i = entries.len() - 1;
        while i > 0 && entries[i - 1] < entry {
            entries[i] = entries[i - 1];
            i -= 1;
        }
        entries[i] = entry;
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<E> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: what lies below the old `len` was pushed.
        Some(unsafe { self.entries.as_ptr().cast::<E>().add(self.len).read() })
    }

    #[inline(always)]
    fn since(&mut self, from: usize) -> &mut [E] {
        assert!(from <= self.len);
        // SAFETY: what lies below `len` was pushed.
        unsafe { std::slice::from_raw_parts_mut(self.entries.as_mut_ptr().cast::<E>().add(from), self.len - from) }
    }
}

impl Stack<'_, Entry> {
    /// Puts the entries from `from` on, eight at most, and `last` in order, the nearest last; returns the nearest,
    /// which is not put aside.
    #[inline(always)]
    fn exchange_sorted(&mut self, from: usize, last: Entry) -> Entry {
        let entries = self.since(from);
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
