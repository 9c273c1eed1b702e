//! The binary tree that is built first: what `build` makes and `collapse` makes wide.

use std::ops::Range;

use super::{Bounds, node::Primitive};

/// The most primitives in a leaf: triangles, or others, but not both.
pub(super) const MAX_LEAF: usize = 16;

/// A binary tree: nodes, each before those below it, over primitives in the order of its leaves.
pub(super) struct Binary {
    pub primitives: Vec<Primitive>,
    pub nodes: Vec<BinaryNode>,
}

/// A node of a [`Binary`] tree.
pub(super) struct BinaryNode {
    pub bounds: Bounds,
    /// Its primitives.
    pub range: Range<usize>,
    /// `None` of a leaf: up to [`MAX_LEAF`] primitives that may share one.
    pub children: Option<[usize; 2]>,
}
