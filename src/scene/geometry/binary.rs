//! The binary tree that is built first: what `build` makes and `collapse` makes wide.

use std::ops::Range;

use super::{Bounds, node::Primitive};

/// The most primitives in a leaf: triangles, or others, but not both.
pub(super) const MAX_LEAF: usize = 16;

/// What a tree is built over: triangles first, then the others.
pub(super) struct Primitives<'a> {
    pub triangles: u32,
    pub count: u32,
    pub get: &'a (dyn Fn(u32) -> Primitive + Sync),
}

impl Primitives<'_> {
    pub fn is_triangle(&self, i: u32) -> bool {
        i < self.triangles
    }

    /// A box around some of them; `None` around nothing.
    pub fn bounds(&self, of: &[u32]) -> Option<Bounds> {
        of.iter().map(|&i| (self.get)(i).bounds()).reduce(Bounds::union)
    }
}

/// A binary tree: nodes, each before those below it, over primitives in the order of its leaves.
pub(super) struct Binary {
    pub order: Vec<u32>,
    pub nodes: Vec<BinaryNode>,
}

/// A node of a [`Binary`] tree. Of 36 bytes: there are two for each triangle.
pub(super) struct BinaryNode {
    pub bounds: Bounds,
    /// Its primitives: the first, and how many.
    pub first: u32,
    pub count: u32,
    /// The second half; the first is the next node. 0 of a leaf: up to [`MAX_LEAF`] primitives that may share one.
    pub second: u32,
}

impl BinaryNode {
    pub fn range(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

impl Binary {
    /// The halves of a node.
    pub fn children(&self, node: usize) -> Option<[usize; 2]> {
        let second = self.nodes[node].second as usize;
        (second > 0).then_some([node + 1, second])
    }

    /// The primitives of a node.
    pub fn primitives(&self, node: usize) -> &[u32] {
        &self.order[self.nodes[node].range()]
    }
}
