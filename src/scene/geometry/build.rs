//! From primitives to a binary tree. obvhs finds its shape (parallel locally-ordered clustering and reinsertion); the
//! bound on its depth is ours, and so is everything after: see the module `collapse`.
//!
//! Two nodes for each triangle are alive here, and little else: a scene's peak of memory is the time of its tree.

use std::ops::Range;

use glam::{DVec3, Vec3};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, SortPrecision},
};
use rayon::prelude::*;

use super::{
    Bounds,
    binary::{Binary, BinaryNode, MAX_LEAF, Primitives},
    bvh::{MAX_DEPTH, Tree},
    collapse::collapse,
    same::same,
};

/// How much time building a tree may take. What a ray hits does not depend on it, nor does an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildEffort {
    /// Soon ready, for previews of large scenes.
    Fast,
    /// The tree that rays walk fastest.
    #[default]
    Best,
}

impl BuildEffort {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Fast, Self::Best];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Best => "best",
        }
    }

    /// What is likely to have so many samples of pixels first, trees over so many triangles included.
    pub(super) fn for_work(triangles: u64, samples: u64) -> Self {
        if samples < Self::WORTH_IT * triangles { Self::Fast } else { Self::Best }
    }

    /// From how many samples for each triangle on the best tree is worth the time that it takes longer: nine
    /// microseconds of a core for each triangle, where a sample takes three to ten, and about a tenth less by the best
    /// tree (`benches/notes/rays.md`).
    const WORTH_IT: u64 = 10;

    /// Of all nodes, the part that is tried elsewhere at first.
    fn reinsertion(self) -> f32 {
        match self {
            Self::Fast => 0.02,
            Self::Best => 1.0,
        }
    }
}

/// Builds the tree over any number of primitives.
pub(super) fn build(primitives: &Primitives, effort: BuildEffort) -> Tree {
    let groups = Groups::of(primitives);
    let shape = (groups.len() > 1).then(|| cluster(primitives, &groups, effort));
    let binary = Draft::new(primitives, &groups, shape.as_ref()).binary();
    drop((groups, shape));
    collapse(primitives, &binary)
}

/// Primitives of a kind with the same box: obvhs takes quadratic time for such.
struct Groups {
    /// All that a ray may meet, those of a group side by side.
    members: Vec<u32>,
    /// Where each group starts, and where the last one ends; `None` if each primitive is a group of its own.
    starts: Option<Vec<u32>>,
    unit: Unit,
}

/// Scales boxes to the unit cube, where obvhs's areas neither over- nor underflow.
struct Unit {
    origin: DVec3,
    scale: f64,
}

impl Unit {
    fn new(all: Bounds) -> Self {
        let origin = all.min.as_dvec3();
        let size = (all.max.as_dvec3() - origin).max_element();
        Self { origin, scale: if size > 0.0 { 1.0 / size } else { 1.0 } }
    }

    fn aabb(&self, b: Bounds) -> Aabb {
        let unit = |p: Vec3| ((p.as_dvec3() - self.origin) * self.scale).clamp(DVec3::ZERO, DVec3::ONE).as_vec3();
        Aabb::new(unit(b.min).into(), unit(b.max).into())
    }
}

impl Groups {
    fn of(primitives: &Primitives) -> Self {
        let get = primitives.get;
        // One vector from the start: parts that are put together leave as much memory behind as they took.
        let mut members = Vec::with_capacity(primitives.count as usize);
        members.extend((0..primitives.count).filter(|&i| get(i).is_solid()));
        let all = members.par_iter().map(|&i| get(i).bounds()).reduce_with(Bounds::union);
        let unit = Unit::new(all.unwrap_or(NOWHERE));
        let mut groups = Self { members, starts: None, unit };
        groups.find(primitives);
        groups
    }

    fn find(&mut self, primitives: &Primitives) {
        let key = |i: u32| {
            let aabb = self.unit.aabb((primitives.get)(i).bounds());
            (primitives.is_triangle(i), [aabb.min, aabb.max].map(|p| p.to_array().map(f32::to_bits)))
        };
        let followers = same(self.members.par_iter().copied(), key);
        if followers.is_empty() {
            return;
        }
        let mut follows = vec![false; primitives.count as usize];
        followers.iter().for_each(|(_, i)| follows[*i as usize] = true);
        let (mut members, mut starts) = (Vec::with_capacity(self.members.len()), vec![0]);
        let mut followers = followers.into_iter().peekable();
        for &i in self.members.iter().filter(|i| !follows[**i as usize]) {
            members.push(i);
            members.extend(std::iter::from_fn(|| followers.next_if(|(first, _)| *first == i)).map(|(_, i)| i));
            starts.push(members.len() as u32);
        }
        (self.members, self.starts) = (members, Some(starts));
    }

    fn len(&self) -> usize {
        self.starts.as_ref().map_or(self.members.len(), |starts| starts.len() - 1)
    }

    fn members(&self, group: u32) -> &[u32] {
        let i = group as usize;
        let range = self.starts.as_ref().map_or(i..i + 1, |starts| starts[i] as usize..starts[i + 1] as usize);
        &self.members[range]
    }
}

/// The shape of the tree over groups, a leaf for each. In scenes of millions it may depend on the number of threads, as
/// obvhs sorts what is equal; what rays hit does not.
fn cluster(primitives: &Primitives, groups: &Groups, effort: BuildEffort) -> Bvh2 {
    let count = groups.len() as u32;
    let leaf = |group: u32| {
        let bounds = (primitives.get)(groups.members(group)[0]).bounds();
        Bvh2Node::new(groups.unit.aabb(bounds), 1, group)
    };
    let mut builder = PlocBuilder::new();
    builder.current_nodes = (0..count).into_par_iter().map(leaf).collect();
    let all = builder.current_nodes.iter().fold(Aabb::empty(), |all, node| all.union(node.aabb()));
    let mut bvh = Bvh2::default();
    bvh.reset_for_reuse(count as usize, Some((0..count).collect()));
    match effort {
        BuildEffort::Fast => builder.build_ploc_from_leaves::<6, false>(&mut bvh, all, SortPrecision::U64, 2),
        BuildEffort::Best => builder.build_ploc_from_leaves::<14, false>(&mut bvh, all, SortPrecision::U64, 1),
    }
    drop(builder);
    ReinsertionOptimizer::default().run(&mut bvh, effort.reinsertion(), None);
    bvh.parents = Vec::new();
    bvh
}

/// The number of levels of a balanced tree over n primitives.
fn balanced_height(n: usize) -> usize {
    n.next_power_of_two().trailing_zeros() as usize
}

/// The tree to be, in which every subtree is a range of the primitives' order.
struct Draft<'a> {
    primitives: &'a Primitives<'a>,
    groups: &'a Groups,
    shape: Option<&'a Bvh2>,
    /// Of each node of `shape`, the inner nodes on the longest way down from it (or 65,535).
    heights: Vec<u16>,
    order: Vec<u32>,
}

/// A subtree to be written.
enum Subtree {
    /// It follows obvhs, from this node on.
    Shape(usize),
    /// It is a balanced one, over primitives that have their places.
    Balanced(Range<usize>),
}

impl<'a> Draft<'a> {
    fn new(primitives: &'a Primitives<'a>, groups: &'a Groups, shape: Option<&'a Bvh2>) -> Self {
        let mut draft = Self { primitives, groups, shape, heights: Vec::new(), order: Vec::new() };
        draft.order.reserve_exact(groups.members.len());
        let Some(bvh) = shape else {
            draft.order.extend(&groups.members);
            return draft;
        };
        draft.heights.resize(bvh.nodes.len(), 0);
        // Loops, not recursion: obvhs's tree can be as deep as it has leaves.
        let mut order = Vec::with_capacity(bvh.nodes.len());
        draft.walk(0, |node| order.push(node as u32));
        for i in order.into_iter().rev().map(|i| i as usize) {
            let node = &bvh.nodes[i];
            draft.heights[i] = if node.is_leaf() {
                balanced_height(groups.members(node.first_index).len()) as u16
            } else {
                let [a, b] = [0, 1].map(|side| draft.heights[node.first_index as usize + side]);
                a.max(b).saturating_add(1)
            };
        }
        draft
    }

    /// Visits a node of obvhs's tree and all below it, each before those below it.
    fn walk(&self, from: usize, mut visit: impl FnMut(usize)) {
        let Some(bvh) = self.shape else { return };
        let mut todo = vec![from];
        while let Some(i) = todo.pop() {
            visit(i);
            let node = &bvh.nodes[i];
            if !node.is_leaf() {
                todo.extend([node.first_index as usize + 1, node.first_index as usize]);
            }
        }
    }

    /// The primitives of a node of obvhs's tree, if it is a leaf.
    fn leaf(&self, node: usize) -> &'a [u32] {
        match self.shape.map(|bvh| &bvh.nodes[node]) {
            Some(node) if node.is_leaf() => self.groups.members(node.first_index),
            _ => &[],
        }
    }

    /// The two subtrees below one at the given depth, or `None` if it is a leaf, whose primitives then have their
    /// places.
    ///
    /// Follows obvhs as long as a balanced tree would still fit below, and is balanced from there on: so a tree that
    /// is deep without need (and only that) is rebuilt where it goes too deep, and no depth exceeds [`MAX_DEPTH`].
    fn split(&mut self, subtree: Subtree, depth: usize) -> (Range<usize>, Option<[Subtree; 2]>) {
        let range = match subtree {
            Subtree::Balanced(range) => range,
            Subtree::Shape(node) => {
                if let Some(children) = self.followed(node, depth) {
                    return (0..0, Some(children.map(Subtree::Shape)));
                }
                let start = self.order.len();
                let mut leaves = Vec::<u32>::new();
                self.walk(node, |i| leaves.extend(self.leaf(i)));
                self.order.extend(leaves);
                start..self.order.len()
            }
        };
        let Self { primitives, order, .. } = self;
        let part = &mut order[range.clone()];
        let is_triangle = |i: u32| primitives.is_triangle(i);
        if part.len() <= MAX_LEAF && part.iter().all(|&i| is_triangle(i) == is_triangle(part[0])) {
            return (range, None);
        }
        let extent = primitives.bounds(part).map_or(Vec3::ZERO, |b| b.max - b.min);
        let axis = extent.max_position();
        let center = |i: u32| {
            let b = (primitives.get)(i).bounds();
            0.5 * b.min[axis] + 0.5 * b.max[axis]
        };
        part.sort_by(|&a, &b| center(a).total_cmp(&center(b)));
        let middle = range.start + range.len().div_ceil(2);
        let halves = [range.start..middle, middle..range.end].map(Subtree::Balanced);
        (range, Some(halves))
    }

    /// The nodes below an inner node of obvhs's tree, if they are followed.
    fn followed(&self, node: usize, depth: usize) -> Option<[usize; 2]> {
        let inner = self.shape.map(|bvh| &bvh.nodes[node]).filter(|node| !node.is_leaf())?;
        let children = [inner.first_index as usize, inner.first_index as usize + 1];
        let fits = |child: usize| {
            let mut count = 0;
            self.walk(child, |i| count += self.leaf(i).len());
            depth + 1 + balanced_height(count) <= MAX_DEPTH
        };
        (depth + usize::from(self.heights[node]) <= MAX_DEPTH || children.into_iter().all(fits)).then_some(children)
    }

    fn binary(mut self) -> Binary {
        let mut nodes = Vec::<BinaryNode>::with_capacity(self.shape.map_or(1, |bvh| bvh.nodes.len()));
        // Each with its depth, and the node whose second half it is.
        let mut todo = Vec::new();
        if !self.groups.members.is_empty() {
            let all = if self.shape.is_some() { Subtree::Shape(0) } else { Subtree::Balanced(0..self.order.len()) };
            todo.push((all, 0, None));
        }
        while let Some((subtree, depth, second_of)) = todo.pop() {
            let index = nodes.len();
            if let Some(above) = second_of {
                let above: &mut BinaryNode = &mut nodes[above];
                above.second = index as u32;
            }
            let (range, halves) = self.split(subtree, depth);
            nodes.push(BinaryNode { bounds: NOWHERE, first: range.start as u32, count: range.len() as u32, second: 0 });
            if let Some([first, second]) = halves {
                todo.extend([(second, depth + 1, Some(index)), (first, depth + 1, None)]);
            }
        }
        let mut binary = Binary { order: self.order, nodes };
        for i in (0..binary.nodes.len()).rev() {
            let (bounds, first, count) = match binary.children(i) {
                None => {
                    let BinaryNode { first, count, .. } = binary.nodes[i];
                    (self.primitives.bounds(binary.primitives(i)).unwrap_or(NOWHERE), first, count)
                }
                Some(children) => {
                    let [a, b] = children.map(|child| &binary.nodes[child]);
                    (a.bounds.union(b.bounds), a.first, a.count + b.count)
                }
            };
            binary.nodes[i] = BinaryNode { bounds, first, count, ..binary.nodes[i] };
        }
        binary
    }
}

/// The box of nothing.
const NOWHERE: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };
