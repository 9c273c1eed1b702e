//! From primitives to a binary tree. obvhs finds its shape (see the module `cluster`); the bound on its depth is ours,
//! and so is everything after: see the module `collapse`.
//!
//! Two nodes for each triangle are alive here, and little else: a scene's peak of memory is the time of its tree.

use std::ops::Range;

use glam::{DVec3, Vec3};
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use super::{
    Bounds,
    binary::{Binary, BinaryNode, MAX_LEAF, Primitives},
    bvh::{MAX_DEPTH, Tree},
    cluster::{Below, Shape, cluster},
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
    pub(super) fn reinsertion(self) -> f32 {
        match self {
            Self::Fast => 0.02,
            Self::Best => 1.0,
        }
    }
}

/// Builds the tree over any number of primitives.
pub(super) fn build(primitives: &Primitives, effort: BuildEffort) -> Tree {
    collapse(primitives, binary(primitives, effort))
}

fn binary(primitives: &Primitives, effort: BuildEffort) -> Binary {
    let groups = Groups::of(primitives);
    let aabb = |group: u32| groups.unit.aabb((primitives.get)(groups.members(group)[0]).bounds());
    let shape = (groups.len() > 1).then(|| cluster(groups.len() as u32, &aabb, effort));
    Draft::new(primitives, &groups, shape.as_ref()).binary()
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

/// The number of levels of a balanced tree over n primitives.
fn balanced_height(n: usize) -> usize {
    n.next_power_of_two().trailing_zeros() as usize
}

/// The tree to be, in which every subtree is a range of the primitives' order.
struct Draft<'a> {
    primitives: &'a Primitives<'a>,
    groups: &'a Groups,
    shape: Option<&'a Shape>,
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
    fn new(primitives: &'a Primitives<'a>, groups: &'a Groups, shape: Option<&'a Shape>) -> Self {
        let mut draft = Self { primitives, groups, shape, heights: Vec::new(), order: Vec::new() };
        draft.order.reserve_exact(groups.members.len());
        let Some(shape) = shape else {
            draft.order.extend(&groups.members);
            return draft;
        };
        draft.heights.resize(shape.len(), 0);
        // Loops, not recursion: obvhs's tree can be as deep as it has leaves.
        let mut order = Vec::with_capacity(shape.len());
        draft.walk(0, |node| order.push(node as u32));
        for i in order.into_iter().rev().map(|i| i as usize) {
            draft.heights[i] = match shape.below(i) {
                Below::Leaf(group) => balanced_height(groups.members(group).len()) as u16,
                Below::Nodes([a, b]) => draft.heights[a].max(draft.heights[b]).saturating_add(1),
            };
        }
        draft
    }

    /// Visits a node of obvhs's tree and all below it, each before those below it.
    fn walk(&self, from: usize, mut visit: impl FnMut(usize)) {
        let Some(shape) = self.shape else { return };
        let mut todo = vec![from];
        while let Some(i) = todo.pop() {
            visit(i);
            if let Below::Nodes([a, b]) = shape.below(i) {
                todo.extend([b, a]);
            }
        }
    }

    /// The primitives of a node of obvhs's tree, if it is a leaf.
    fn leaf(&self, node: usize) -> &'a [u32] {
        match self.shape.map(|shape| shape.below(node)) {
            Some(Below::Leaf(group)) => self.groups.members(group),
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
        let Below::Nodes(children) = self.shape?.below(node) else { return None };
        let fits = |child: usize| {
            let mut count = 0;
            self.walk(child, |i| count += self.leaf(i).len());
            depth + 1 + balanced_height(count) <= MAX_DEPTH
        };
        (depth + usize::from(self.heights[node]) <= MAX_DEPTH || children.into_iter().all(fits)).then_some(children)
    }

    fn binary(mut self) -> Binary {
        let mut nodes = Vec::<BinaryNode>::with_capacity(self.shape.map_or(1, Shape::len));
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

#[cfg(test)]
mod tests {
    use super::{
        super::{
            node::{self, Primitive},
            sphere::Sphere,
            triangle::Triangle,
        },
        *,
    };

    /// Forty after the other have the same box, triangles and spheres alike.
    fn in_forties(triangles: u32, i: u32) -> Primitive {
        let low = Vec3::new((i / 40 % 7) as f32, (i / 280) as f32, 0.0) * 1.5;
        let corner = |x, y, z| low + Vec3::new(x, y, z);
        let shape = if i < triangles {
            node::Shape::Triangle(Triangle::new([low, corner(1.0, 1.0, 0.0), corner(0.5, 0.0, 1.0)]))
        } else {
            node::Shape::Sphere(Sphere { center: low + 0.5, radius: 0.5 })
        };
        Primitive { shape, index: i }
    }

    #[test]
    fn leaves_are_of_one_kind_and_hold_each_primitive_once() {
        let cases = [(0, 0), (0, 1), (1, 2), (0, 90), (90, 90), (16, 17), (410, 700), (5, 1000)];
        for ((triangles, count), effort) in cases.into_iter().flat_map(|c| BuildEffort::ALL.map(|effort| (c, effort))) {
            let get = |i| in_forties(triangles, i);
            let Binary { order, nodes } = binary(&Primitives { triangles, count, get: &get }, effort);
            let mut place = vec![usize::MAX; count as usize];
            order.iter().enumerate().for_each(|(at, i)| place[*i as usize] = at);
            assert!(order.len() == count as usize && !place.contains(&usize::MAX), "{count}");
            let mut in_leaves = 0;
            for (i, node) in nodes.iter().enumerate() {
                assert!(node.second == 0 || node.second as usize > i + 1, "halves come after their node");
                if node.second == 0 {
                    let members = &order[node.range()];
                    assert!(members.len() <= MAX_LEAF);
                    assert!(members.iter().all(|i| (*i < triangles) == (members[0] < triangles)), "{members:?}");
                    in_leaves += members.len();
                }
            }
            assert_eq!(in_leaves, order.len());
            // What has the same box stays side by side, whatever the shape of the tree.
            let key = |i: u32| (i < triangles, in_forties(triangles, i).bounds().min.to_array().map(f32::to_bits));
            for group in (0..count).collect::<Vec<_>>().chunk_by(|a, b| key(*a) == key(*b)) {
                let places = || group.iter().map(|i| place[*i as usize]);
                assert_eq!(places().max().zip(places().min()).map(|(b, a)| b - a + 1), Some(group.len()));
            }
        }
    }
}
