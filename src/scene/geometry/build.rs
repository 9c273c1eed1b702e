//! From primitives to a binary tree. obvhs finds its shape (parallel locally-ordered clustering and reinsertion); the
//! bound on its depth is ours, and so is everything after: see the module `collapse`.

use std::{collections::HashMap, ops::Range, time::Duration};

use glam::{DVec3, Vec3};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};

use super::{
    Bounds,
    binary::{Binary, BinaryNode, MAX_LEAF},
    bvh::{MAX_DEPTH, Tree},
    collapse::collapse,
    node::Primitive,
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

    fn parameters(self) -> BvhBuildParams {
        let preset = match self {
            Self::Fast => BvhBuildParams::fast_build(),
            Self::Best => BvhBuildParams::very_slow_build(),
        };
        // One box a leaf: where leaves are is decided later.
        BvhBuildParams { max_prims_per_leaf: 1, ..preset }
    }
}

/// Builds the tree over any number of primitives, given in the order of their ids.
pub(super) fn build(mut primitives: Vec<Primitive>, effort: BuildEffort) -> Tree {
    primitives.retain(Primitive::is_solid);
    let groups = group(&primitives);
    let shape = (groups.len() > 1).then(|| cluster(&groups, effort));
    collapse(&Draft::new(&primitives, &groups, shape).binary())
}

/// Primitives of a kind with the same box.
struct Group {
    aabb: Aabb,
    members: Vec<u32>,
}

/// Groups primitives whose boxes are the same, on which obvhs takes quadratic time. The boxes are scaled to the unit
/// cube, where its areas neither over- nor underflow.
fn group(primitives: &[Primitive]) -> Vec<Group> {
    let Some(all) = bounds(primitives) else { return Vec::new() };
    let origin = all.min.as_dvec3();
    let size = (all.max.as_dvec3() - origin).max_element();
    let scale = if size > 0.0 { 1.0 / size } else { 1.0 };
    let unit = |p: Vec3| -> Vec3 { ((p.as_dvec3() - origin) * scale).clamp(DVec3::ZERO, DVec3::ONE).as_vec3() };
    let mut index = HashMap::new();
    let mut groups = Vec::<Group>::new();
    for (i, p) in primitives.iter().enumerate() {
        let b = p.bounds();
        let (min, max) = (unit(b.min), unit(b.max));
        let key = (p.is_triangle(), [min, max].map(|v| v.to_array().map(f32::to_bits)));
        let slot = *index.entry(key).or_insert_with(|| {
            groups.push(Group { aabb: Aabb::new(min.into(), max.into()), members: Vec::new() });
            groups.len() - 1
        });
        groups[slot].members.push(i as u32);
    }
    groups
}

fn cluster(groups: &[Group], effort: BuildEffort) -> Bvh2 {
    let boxes: Vec<Aabb> = groups.iter().map(|g| g.aabb).collect();
    build_bvh2(&boxes, effort.parameters(), &mut Duration::default())
}

fn bounds(primitives: &[Primitive]) -> Option<Bounds> {
    primitives.iter().map(|p| p.bounds()).reduce(|a, b| a.union(b))
}

/// The number of levels of a balanced tree over n primitives.
fn balanced_height(n: usize) -> usize {
    n.next_power_of_two().trailing_zeros() as usize
}

/// The tree to be: the primitives in the order of obvhs's leaves, so that every subtree is a range of them.
struct Draft {
    primitives: Vec<Primitive>,
    shape: Option<Bvh2>,
    /// Of each node of `shape`: its primitives, and the inner nodes on the longest way down from it.
    ranges: Vec<Range<usize>>,
    heights: Vec<usize>,
}

/// A subtree to be written: a range of primitives and, where it still follows obvhs, its node there.
struct Subtree {
    range: Range<usize>,
    node: Option<usize>,
}

impl Draft {
    fn new(primitives: &[Primitive], groups: &[Group], shape: Option<Bvh2>) -> Self {
        let mut draft = Self {
            primitives: Vec::with_capacity(primitives.len()),
            shape: None,
            ranges: Vec::new(),
            heights: Vec::new(),
        };
        let members = |g: &Group| g.members.iter().map(|&i| primitives[i as usize]).collect::<Vec<_>>();
        let Some(bvh) = shape else {
            draft.primitives.extend(groups.iter().flat_map(members));
            return draft;
        };
        draft.ranges.resize(bvh.nodes.len(), 0..0);
        draft.heights.resize(bvh.nodes.len(), 0);
        // Loops, not recursion: obvhs's tree can be as deep as it has leaves.
        let mut order = Vec::with_capacity(bvh.nodes.len());
        let mut todo = vec![0];
        while let Some(i) = todo.pop() {
            order.push(i);
            let (node, start) = (&bvh.nodes[i], draft.primitives.len());
            let first = node.first_index as usize;
            if node.is_leaf() {
                for &g in &bvh.primitive_indices[first..first + node.prim_count as usize] {
                    draft.primitives.extend(members(&groups[g as usize]));
                }
                draft.ranges[i] = start..draft.primitives.len();
            } else {
                todo.extend([first + 1, first]);
            }
        }
        for &i in order.iter().rev() {
            let node = &bvh.nodes[i];
            if node.is_leaf() {
                draft.heights[i] = balanced_height(draft.ranges[i].len());
            } else {
                let (a, b) = (node.first_index as usize, node.first_index as usize + 1);
                draft.ranges[i] = draft.ranges[a].start..draft.ranges[b].end;
                draft.heights[i] = 1 + draft.heights[a].max(draft.heights[b]);
            }
        }
        draft.shape = Some(bvh);
        draft
    }

    /// The two subtrees below one at the given depth, or `None` if it is a leaf.
    ///
    /// Follows obvhs as long as a balanced tree would still fit below, and is balanced from there on: so a tree that
    /// is deep without need (and only that) is rebuilt where it goes too deep, and no depth exceeds [`MAX_DEPTH`].
    fn split(&mut self, subtree: &Subtree, depth: usize) -> Option<[Subtree; 2]> {
        let range = subtree.range.clone();
        if let (Some(bvh), Some(i)) = (&self.shape, subtree.node) {
            let node = &bvh.nodes[i];
            if !node.is_leaf() {
                let children = [node.first_index as usize, node.first_index as usize + 1];
                let balanced = children.map(|c| depth + 1 + balanced_height(self.ranges[c].len()));
                if depth + self.heights[i] <= MAX_DEPTH || balanced.iter().all(|&d| d <= MAX_DEPTH) {
                    return Some(children.map(|c| Subtree { range: self.ranges[c].clone(), node: Some(c) }));
                }
            }
        }
        let primitives = &self.primitives[range.clone()];
        if range.len() <= MAX_LEAF && primitives.iter().all(|p| p.is_triangle() == primitives[0].is_triangle()) {
            return None;
        }
        let part = &mut self.primitives[range.clone()];
        let extent = bounds(part).map_or(Vec3::ZERO, |b| b.max - b.min);
        let axis = extent.max_position();
        let center = |p: &Primitive| {
            let b = p.bounds();
            0.5 * b.min[axis] + 0.5 * b.max[axis]
        };
        part.sort_by(|a, b| center(a).total_cmp(&center(b)));
        let middle = range.start + range.len().div_ceil(2);
        Some([range.start..middle, middle..range.end].map(|range| Subtree { range, node: None }))
    }

    fn binary(mut self) -> Binary {
        let mut nodes = Vec::<BinaryNode>::new();
        // Each with its depth, and the node and side that will refer to it.
        let mut todo = Vec::new();
        if !self.primitives.is_empty() {
            let all = Subtree { range: 0..self.primitives.len(), node: self.shape.as_ref().map(|_| 0) };
            todo.push((all, 0, None));
        }
        while let Some((subtree, depth, above)) = todo.pop() {
            let index = nodes.len();
            if let Some((parent, side)) = above {
                let parent: &mut BinaryNode = &mut nodes[parent];
                parent.children.get_or_insert([0; 2])[side] = index;
            }
            let halves = self.split(&subtree, depth);
            let bounds = if halves.is_none() { bounds(&self.primitives[subtree.range.clone()]) } else { None };
            nodes.push(BinaryNode { bounds: bounds.unwrap_or(NOWHERE), range: subtree.range, children: None });
            if let Some([left, right]) = halves {
                todo.extend([(right, depth + 1, Some((index, 1))), (left, depth + 1, Some((index, 0)))]);
            }
        }
        for i in (0..nodes.len()).rev() {
            if let Some([a, b]) = nodes[i].children {
                nodes[i].bounds = nodes[a].bounds.union(nodes[b].bounds);
            }
        }
        Binary { primitives: self.primitives, nodes }
    }
}

/// The box of nothing.
const NOWHERE: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };
