//! From a binary tree to a wide one: which of its nodes become children of which, so that rays cost least.
//!
//! A ray that meets a box meets one inside it with a probability in proportion to its surface area. So the expected
//! cost of a tree is the sum of the areas of what is tested, and the best way to put a subtree into k places follows
//! from the best ways of its halves (Wald, Benthin & Boulos 2008, *Getting Rid of Packets*; Ylitie, Karras & Laine
//! 2017, section 4.2): dynamic programming over nodes and k.

use super::{
    Bounds,
    binary::{Binary, BinaryNode, MAX_LEAF},
    bvh::Tree,
    node::{Below, Block, Child, Node, Primitive, WIDTH},
};

/// The time to test a block of triangles, in that of a node.
const BLOCK_COST: f32 = 0.7;
/// The time to test a sphere or to enter an instance, in that of a node.
const OTHER_COST: f32 = 2.0;

/// The cheapest ways to have a subtree below a node.
#[derive(Clone, Copy)]
struct Ways {
    /// The cost in at most 1, 2, … places.
    cost: [f32; WIDTH],
    /// How many of 2, 3, … places the first half takes; 0: it is best to leave one place out. In one place it stands by
    /// itself.
    first_half: [u8; WIDTH],
    /// In one place: what it is there.
    alone: Alone,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Alone {
    Leaf,
    /// A node, whose first half takes this many of its places.
    Node(u8),
}

/// The cheapest wide tree.
pub(super) fn collapse(binary: &Binary) -> Tree {
    let Some(root) = binary.nodes.first() else { return Tree::new(vec![], vec![], vec![], None) };
    let whole = half_area(&root.bounds);
    let mut ways = vec![Ways { cost: [0.0; WIDTH], first_half: [0; WIDTH], alone: Alone::Leaf }; binary.nodes.len()];
    for (i, node) in binary.nodes.iter().enumerate().rev() {
        // Relative to the root's: f32 has no number for the area of every box.
        let area = if whole > 0.0 { (half_area(&node.bounds) / whole) as f32 } else { 1.0 };
        let leaf = area * leaf_cost(&binary.primitives[node.range.clone()]);
        ways[i] = match node.children {
            None => Ways { cost: [leaf; WIDTH], first_half: [0; WIDTH], alone: Alone::Leaf },
            Some([a, b]) => Ways::of(area, leaf, &ways[a], &ways[b]),
        };
    }
    Writer { binary, ways, nodes: Vec::new(), blocks: Vec::new(), others: Vec::new() }.write()
}

impl Ways {
    /// Of a node with this area, this cost as a leaf, and these halves.
    fn of(area: f32, leaf: f32, a: &Self, b: &Self) -> Self {
        let shared = |places: usize| {
            let shares = (1..places).map(|first| (a.cost[first - 1] + b.cost[places - first - 1], first as u8));
            shares.min_by(|x, y| x.0.total_cmp(&y.0)).expect("two places or more")
        };
        let (children, first) = shared(WIDTH);
        let (one, alone) =
            if leaf <= area + children { (leaf, Alone::Leaf) } else { (area + children, Alone::Node(first)) };
        let mut ways = Self { cost: [one; WIDTH], first_half: [0; WIDTH], alone };
        for places in 2..=WIDTH {
            let (cost, first) = shared(places);
            let k = places - 1;
            (ways.cost[k], ways.first_half[k]) =
                if cost < ways.cost[k - 1] { (cost, first) } else { (ways.cost[k - 1], 0) };
        }
        ways
    }
}

/// The cost of a leaf of these primitives relative to its area; infinite if they cannot be one.
fn leaf_cost(primitives: &[Primitive]) -> f32 {
    if primitives.len() > MAX_LEAF {
        return f32::INFINITY;
    }
    match primitives.iter().filter(|p| p.is_triangle()).count() {
        0 => primitives.len() as f32 * OTHER_COST,
        n if n == primitives.len() => n.div_ceil(WIDTH) as f32 * BLOCK_COST,
        _ => f32::INFINITY,
    }
}

/// The wide tree to be.
struct Writer<'a> {
    binary: &'a Binary,
    ways: Vec<Ways>,
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    others: Vec<Primitive>,
}

impl Writer<'_> {
    fn write(mut self) -> Tree {
        let mut todo = Vec::new();
        let root = self.child(0, &mut todo);
        while let Some((from, to)) = todo.pop() {
            let mut children = Vec::with_capacity(WIDTH);
            self.gather(from, &mut children);
            // The largest first: rays that stop at anything visit them in this order.
            let area = |i: &usize| half_area(&self.binary.nodes[*i].bounds);
            children.sort_by(|a, b| area(b).total_cmp(&area(a)));
            let after = todo.len();
            for (slot, i) in children.into_iter().enumerate() {
                let child = self.child(i, &mut todo);
                self.nodes[to].put(slot, self.binary.nodes[i].bounds, child);
            }
            todo[after..].reverse();
        }
        Tree::new(self.nodes, self.blocks, self.others, Some(root))
    }

    /// What stands for a subtree in one place. A node is made empty, to be filled by what is left to do.
    fn child(&mut self, i: usize, todo: &mut Vec<(usize, usize)>) -> Child {
        let node = &self.binary.nodes[i];
        Child::new(match self.ways[i].alone {
            Alone::Leaf => self.leaf(node),
            Alone::Node(_) => {
                todo.push((i, self.nodes.len()));
                self.nodes.push(Node::EMPTY);
                Below::Node(self.nodes.len() as u32 - 1)
            }
        })
    }

    fn leaf(&mut self, node: &BinaryNode) -> Below {
        let primitives = &self.binary.primitives[node.range.clone()];
        if primitives[0].is_triangle() {
            let first = self.blocks.len() as u32;
            self.blocks.extend(primitives.chunks(WIDTH).map(Block::new));
            Below::Blocks { first, count: self.blocks.len() as u32 - first }
        } else {
            let first = self.others.len() as u32;
            self.others.extend_from_slice(primitives);
            Below::Others { first, count: primitives.len() as u32 }
        }
    }

    /// The subtrees that become the children of the node that `root` becomes.
    fn gather(&self, root: usize, children: &mut Vec<usize>) {
        let (Some([a, b]), Alone::Node(first)) = (self.binary.nodes[root].children, self.ways[root].alone) else {
            return;
        };
        let mut todo = vec![(b, WIDTH - usize::from(first)), (a, usize::from(first))];
        while let Some((i, mut places)) = todo.pop() {
            let ways = &self.ways[i];
            while places > 1 && ways.first_half[places - 1] == 0 {
                places -= 1;
            }
            match self.binary.nodes[i].children {
                Some([a, b]) if places > 1 => {
                    let first = usize::from(ways.first_half[places - 1]);
                    todo.extend([(b, places - first), (a, first)]);
                }
                _ => children.push(i),
            }
        }
    }
}

/// Half the surface of a box.
fn half_area(b: &Bounds) -> f64 {
    let e = b.max.as_dvec3() - b.min.as_dvec3();
    e.x * e.y + e.y * e.z + e.z * e.x
}
