//! The shape of a binary tree: obvhs's parallel locally-ordered clustering and its reinsertion.
//!
//! Clustering takes 200 bytes for each box while it runs, half of them for the tree. So boxes are clustered in parts,
//! one after the other, each into its place in the one tree that reinsertion then improves across parts.

use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, SortPrecision},
};
use rayon::prelude::*;

use super::build::BuildEffort;

/// The most boxes that are clustered at a time.
const MOST: u32 = 1 << 17;

/// A binary tree without its boxes. Node 0 is the root.
pub(super) struct Shape(Vec<u32>);

/// What is below a node.
pub(super) enum Below {
    /// One of the boxes.
    Leaf(u32),
    /// Two nodes.
    Nodes([usize; 2]),
}

/// Marks a leaf. Without it, nodes 2i + 1 and 2i + 2 are below.
const LEAF: u32 = 1 << 31;

impl Shape {
    /// The number of nodes.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn below(&self, node: usize) -> Below {
        match self.0[node].checked_sub(LEAF) {
            Some(leaf) => Below::Leaf(leaf),
            None => Below::Nodes([1, 2].map(|side| 2 * self.0[node] as usize + side)),
        }
    }
}

/// The shape of the tree over so many boxes, two or more. In scenes of millions it may depend on the number of threads,
/// as obvhs sorts what is equal; what rays hit does not.
///
/// # Panics
/// With 2³¹ boxes or more.
pub(super) fn cluster(count: u32, aabb: &(impl Fn(u32) -> Aabb + Sync), effort: BuildEffort) -> Shape {
    assert!(count < LEAF, "fewer than 2³¹ boxes");
    let mut bvh = Parts::new(count).clustered(aabb, effort);
    ReinsertionOptimizer::default().run(&mut bvh, effort.reinsertion(), None);
    let below = |node: &Bvh2Node| if node.is_leaf() { LEAF + node.first_index } else { node.first_index / 2 };
    Shape(bvh.nodes.par_iter().map(below).collect())
}

/// How boxes are parted: in two at the median of their centres, again and again.
struct Parts {
    boxes: usize,
    /// A power of two.
    parts: usize,
}

impl Parts {
    fn new(count: u32) -> Self {
        Self { boxes: count as usize, parts: count.div_ceil(MOST).next_power_of_two() as usize }
    }

    /// Where a part starts: none has two more than another.
    fn start(&self, part: usize) -> usize {
        (part as u64 * self.boxes as u64 / self.parts as u64) as usize
    }

    /// Sorts the centres of boxes, those of the parts from `from` to `to`, into these.
    fn sort(&self, centers: &mut [([f32; 3], u32)], from: usize, to: usize) {
        if to - from < 2 {
            return;
        }
        let all = centers.iter().fold(Aabb::empty(), |all, (center, _)| all.union(&Aabb::from_point((*center).into())));
        let axis = all.diagonal().max_position();
        let middle = from.midpoint(to);
        let at = self.start(middle) - self.start(from);
        centers.select_nth_unstable_by(at, |(a, i), (b, j)| a[axis].total_cmp(&b[axis]).then(i.cmp(j)));
        let (first, second) = centers.split_at_mut(at);
        rayon::join(|| self.sort(first, from, middle), || self.sort(second, middle, to));
    }

    /// The place in the tree of node `i` of the tree over a part.
    ///
    /// Obvhs tries nodes elsewhere that come first, as the large ones do in each of its trees. So parts take turns, one
    /// pair of nodes each; before them come the nodes above, in the order of a heap.
    fn place(&self, part: usize, i: usize) -> usize {
        let Some(below) = i.checked_sub(1) else { return self.parts - 1 + part };
        // All have their turn as often as a part with one box less than others has pairs.
        let least = self.boxes / self.parts;
        let pair = below / 2;
        let before = if pair < least - 1 { part } else { self.start(part) - part * least };
        2 * (self.parts + pair * self.parts + before) - 1 + below % 2
    }

    fn clustered(&self, aabb: &(impl Fn(u32) -> Aabb + Sync), effort: BuildEffort) -> Bvh2 {
        let center = |i: u32| (aabb(i).center().to_array(), i);
        let mut order: Vec<_> = (0..self.boxes as u32).into_par_iter().map(center).collect();
        self.sort(&mut order, 0, self.parts);
        let mut bvh = Bvh2::zeroed(self.boxes);
        bvh.primitive_indices = Vec::new();
        let (mut builder, mut tree) = (PlocBuilder::new(), Bvh2::default());
        for part in 0..self.parts {
            let boxes = &order[self.start(part)..self.start(part + 1)];
            builder.current_nodes.clear();
            builder.current_nodes.par_extend(boxes.par_iter().map(|&(_, i)| Bvh2Node::new(aabb(i), 1, i)));
            let all = builder.current_nodes.iter().fold(Aabb::empty(), |all, node| all.union(node.aabb()));
            match effort {
                BuildEffort::Fast => {
                    builder.build_ploc_from_leaves::<6, false>(&mut tree, all, SortPrecision::U64, 2);
                }
                BuildEffort::Best => {
                    builder.build_ploc_from_leaves::<14, false>(&mut tree, all, SortPrecision::U64, 1);
                }
            }
            for (i, mut node) in tree.nodes.iter().copied().enumerate() {
                if !node.is_leaf() {
                    node.first_index = self.place(part, node.first_index as usize) as u32;
                }
                bvh.nodes[self.place(part, i)] = node;
            }
            bvh.max_depth = bvh.max_depth.max(tree.max_depth + self.parts.ilog2() as usize);
        }
        for above in (0..self.parts - 1).rev() {
            let [a, b] = [1, 2].map(|side| *bvh.nodes[2 * above + side].aabb());
            bvh.nodes[above] = Bvh2Node::new(a.union(&b), 0, 2 * above as u32 + 1);
        }
        bvh
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    use super::*;

    /// Also where parts differ by a box, and where there are several of them.
    #[test]
    fn every_box_is_a_leaf_of_the_one_tree() {
        let mut r = StdRng::seed_from_u64(4);
        for count in [2, 3, 1000, 2 * MOST + 1, 2 * MOST + 40_002] {
            let boxes: Vec<_> = (0..count)
                .map(|_| {
                    let low = [r.random::<f32>(), r.random(), r.random()];
                    Aabb::new(low.into(), low.map(|c| c + 0.01).into())
                })
                .collect();
            let shape = cluster(count, &|i| boxes[i as usize], BuildEffort::Fast);
            let (mut nodes, mut leaves, mut todo) = (0, vec![0; count as usize], vec![0]);
            while let Some(node) = todo.pop() {
                nodes += 1;
                match shape.below(node) {
                    Below::Leaf(i) => leaves[i as usize] += 1,
                    Below::Nodes(both) => todo.extend(both),
                }
            }
            assert_eq!((nodes, shape.len()), (shape.len(), 2 * count as usize - 1));
            assert!(leaves.iter().all(|times| *times == 1), "{count}");
        }
    }

    #[test]
    #[should_panic(expected = "fewer than 2³¹ boxes")]
    fn boxes_that_nodes_cannot_count_are_refused() {
        cluster(1 << 31, &|_| Aabb::empty(), BuildEffort::Fast);
    }
}
