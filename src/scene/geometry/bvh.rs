//! The tree over the primitives, and the two ways a ray walks it.

use glam::Vec2;

use super::{
    Bounds, Hit, PrimitiveId, Ray,
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

/// A primitive as the tree's leaves hold it, in leaf order.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafPrimitive {
    pub shape: Shape,
    pub id: PrimitiveId,
}

/// The geometry of a leaf primitive.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Triangle(Triangle),
    Sphere(Sphere),
}

impl Shape {
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Triangle(t) => t.bounds(),
            Self::Sphere(s) => s.bounds(),
        }
    }
}

impl LeafPrimitive {
    /// Where the ray meets this primitive at t > 0, unless it is a triangle that is to be skipped.
    #[inline]
    pub fn intersect(&self, ray: &Prepared, skip: &[PrimitiveId]) -> Option<Hit> {
        let (t, barycentric) = match &self.shape {
            Shape::Triangle(s) => s.intersect(ray).filter(|_| !skip.contains(&self.id))?,
            Shape::Sphere(s) => (s.intersect(ray)?, Vec2::ZERO),
        };
        Some(Hit { t, primitive: self.id, barycentric })
    }
}

/// The tree: inner nodes, and the primitives in the order of its leaves.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub primitives: Vec<LeafPrimitive>,
    /// An inner node or, for few primitives, a leaf.
    pub root: Child,
}

impl Tree {
    fn leaf(&self, child: Child) -> &[LeafPrimitive] {
        &self.primitives[child.first as usize..][..child.count as usize]
    }

    /// The closest hit; of several at the same distance the one with the smallest id.
    pub fn closest(&self, ray: &Ray, skip: PrimitiveId) -> Option<Hit> {
        let prepared = Prepared::new(ray);
        let mut best: Option<Hit> = None;
        let mut limit = ray.t_max;
        let mut stack = [(0.0_f32, Child::default()); MAX_DEPTH];
        let mut top = 0;
        let mut current = self.root;
        loop {
            if current.count > 0 {
                for hit in self.leaf(current).iter().filter_map(|p| p.intersect(&prepared, &[skip])) {
                    if best.map_or(hit.t < limit, |b| (hit.t, hit.primitive) < (b.t, b.primitive)) {
                        limit = hit.t;
                        best = Some(hit);
                    }
                }
            } else if let Some(node) = self.nodes.get(current.first as usize) {
                let [a, b] = prepared.clip_pair(&node.boxes);
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
            // Boxes that begin exactly at the hit stay: they may hold an equal one with a smaller id.
            loop {
                if top == 0 {
                    return best;
                }
                top -= 1;
                if stack[top].0 <= limit {
                    current = stack[top].1;
                    break;
                }
            }
        }
    }

    /// Whether anything is hit. The builder puts the larger child, which is likelier to be hit, first.
    pub fn occluded(&self, ray: &Ray, skip: [PrimitiveId; 2]) -> bool {
        let prepared = Prepared::new(ray);
        let mut stack = [Child::default(); MAX_DEPTH];
        let mut top = 0;
        let mut current = self.root;
        loop {
            if current.count > 0 {
                let mut hits = self.leaf(current).iter().filter_map(|p| p.intersect(&prepared, &skip));
                if hits.any(|hit| hit.t < ray.t_max) {
                    return true;
                }
            } else if let Some(node) = self.nodes.get(current.first as usize) {
                let [a, b] = prepared.clip_pair(&node.boxes);
                let [left, right] = node.children;
                match (a.near <= a.far.min(ray.t_max), b.near <= b.far.min(ray.t_max)) {
                    (true, true) => {
                        stack[top] = right;
                        top += 1;
                        current = left;
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
            if top == 0 {
                return false;
            }
            top -= 1;
            current = stack[top];
        }
    }
}
