//! The tree over primitives, and how a ray walks it.
//!
//! There are two levels of the same tree: one over the world's primitives, in which an instance is a primitive too, and
//! one over the triangles of each instanced mesh.

use super::{
    Bounds,
    ray::{BoxPair, Prepared},
    sphere::Sphere,
    triangle::Triangle,
};

/// The most inner nodes on any way from the root to a leaf. The builder keeps to it, whatever the geometry, so a
/// walk that puts at most one sibling per level aside needs no larger stack.
pub(super) const MAX_DEPTH: usize = 64;

/// An inner node: the boxes of its two children and where they are. 64 bytes, one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub boxes: BoxPair,
    pub children: [Child; 2],
}

/// What hangs below a node: with `count` = 0 the inner node at `first`, else that many leaf primitives from `first`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Child {
    pub first: u32,
    pub count: u32,
}

/// A primitive as a tree's leaves hold it, in leaf order.
pub(super) trait Leaf: Copy {
    fn bounds(&self) -> Bounds;

    /// Whether any ray meets it.
    fn is_solid(&self) -> bool;
}

/// A triangle of an instanced mesh. 52 bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshLeaf {
    pub triangle: Triangle,
    /// The triangle's number in its mesh.
    pub index: u32,
}

/// What lies in world space: a primitive, or an instance. 56 bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldLeaf {
    pub shape: Shape,
    /// The number of the primitive, or that of the instance.
    pub index: u32,
}

/// The geometry of a leaf in world space.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Triangle(Triangle),
    Sphere(Sphere),
    /// The box of an instance.
    Instance(Bounds),
}

impl Leaf for MeshLeaf {
    fn bounds(&self) -> Bounds {
        self.triangle.bounds()
    }

    fn is_solid(&self) -> bool {
        !self.triangle.is_degenerate()
    }
}

impl Leaf for WorldLeaf {
    fn bounds(&self) -> Bounds {
        match self.shape {
            Shape::Triangle(t) => t.bounds(),
            Shape::Sphere(s) => s.bounds(),
            Shape::Instance(b) => b,
        }
    }

    fn is_solid(&self) -> bool {
        match self.shape {
            Shape::Triangle(t) => !t.is_degenerate(),
            Shape::Sphere(s) => s.radius > 0.0,
            Shape::Instance(_) => true,
        }
    }
}

/// A tree: inner nodes, and the primitives in the order of its leaves.
#[derive(Clone, Debug)]
pub(super) struct Tree<L> {
    pub nodes: Vec<Node>,
    pub primitives: Vec<L>,
    /// An inner node or, for few primitives, a leaf.
    pub root: Child,
}

impl<L: Leaf> Tree<L> {
    /// Visits the leaves that the ray enters at `limit` or before, the nearer of two siblings first. `visit` gets a
    /// leaf's primitives and the present limit, and returns the new one, which must not be larger; −∞ ends the walk.
    ///
    /// Leaves that begin exactly at the limit are visited: they may hold an equal hit with a smaller id.
    #[inline]
    pub fn walk(&self, ray: &Prepared, mut limit: f32, mut visit: impl FnMut(&[L], f32) -> f32) {
        let mut stack = [(0.0_f32, Child::default()); MAX_DEPTH];
        let mut top = 0;
        let mut current = self.root;
        loop {
            if current.count > 0 {
                limit = visit(&self.primitives[current.first as usize..][..current.count as usize], limit);
            } else if let Some(node) = self.nodes.get(current.first as usize) {
                let [a, b] = ray.clip_pair(&node.boxes);
                let [left, right] = node.children;
                match (a.near <= a.far.min(limit), b.near <= b.far.min(limit)) {
                    (true, true) => {
                        let (near, far) =
                            if a.near <= b.near { (left, (b.near, right)) } else { (right, (a.near, left)) };
                        stack[top] = far;
                        top += 1;
                        current = near;
                        continue;
                    }
                    (true, false) => {
                        current = left;
                        continue;
                    }
                    (false, true) => {
                        current = right;
                        continue;
                    }
                    (false, false) => {}
                }
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                if stack[top].0 <= limit {
                    current = stack[top].1;
                    break;
                }
            }
        }
    }
}
