//! From a binary tree to a wide one: which of its nodes become children of which, so that rays cost least.
//!
//! A ray that meets a box meets one inside it with a probability in proportion to its surface area. So the expected
//! cost of a tree is the sum of the areas of what is tested, and the best way to put a subtree into k places follows
//! from the best ways of its halves (Wald, Benthin & Boulos 2008, *Getting Rid of Packets*; Ylitie, Karras & Laine
//! 2017, section 4.2): dynamic programming over nodes and k.

use rayon::prelude::*;

use super::{
    Bounds,
    binary::{Binary, MAX_LEAF, Primitives},
    bvh::Tree,
    node::{Below, Block, Child, Node, WIDTH},
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

/// What the cheapest ways come to, for each node of the binary tree.
#[derive(Clone, Copy)]
struct Choice {
    first_half: [u8; WIDTH],
    alone: Alone,
}

/// The cheapest wide tree.
pub(super) fn collapse(primitives: &Primitives, binary: Binary) -> Tree {
    if binary.nodes.is_empty() {
        return Tree::new(vec![], vec![], vec![], None);
    }
    let mut plan = Plan::new(&binary, choices(primitives, &binary));
    let root = plan.write(primitives);
    let Plan { children, blocks, others, choices, .. } = plan;
    drop(choices);
    let node = |children: &[Option<(u32, Child)>; WIDTH]| {
        let mut node = Node::EMPTY;
        for (slot, (from, child)) in children.iter().flatten().enumerate() {
            node.put(slot, binary.nodes[*from as usize].bounds, *child);
        }
        node
    };
    let nodes = children.par_iter().map(node).collect();
    // Blocks take most of a tree's memory: what is not needed for them goes first.
    drop(children);
    drop(binary.nodes);
    let order = binary.order;
    let block = |&(first, count): &(u32, u32)| {
        let members = &order[first as usize..][..count as usize];
        let mut eight = [(primitives.get)(members[0]); WIDTH];
        eight.iter_mut().zip(members).for_each(|(primitive, i)| *primitive = (primitives.get)(*i));
        Block::new(&eight[..members.len()])
    };
    let blocks = blocks.par_iter().map(block).collect();
    Tree::new(nodes, blocks, others.into_iter().map(primitives.get).collect(), Some(root))
}

/// The choices that follow from the costs below each node, from the leaves on.
fn choices(primitives: &Primitives, binary: &Binary) -> Vec<Choice> {
    let whole = half_area(&binary.nodes[0].bounds);
    let mut choices = vec![Choice { first_half: [0; WIDTH], alone: Alone::Leaf }; binary.nodes.len()];
    // Of the nodes whose halves are known while they themselves wait: the first half is on top.
    let mut ways = Vec::<Ways>::new();
    for (i, node) in binary.nodes.iter().enumerate().rev() {
        // Relative to the root's: f32 has no number for the area of every box.
        let area = if whole > 0.0 { (half_area(&node.bounds) / whole) as f32 } else { 1.0 };
        let leaf = area * leaf_cost(primitives, binary.primitives(i));
        let here = if node.second == 0 {
            Ways { cost: [leaf; WIDTH], first_half: [0; WIDTH], alone: Alone::Leaf }
        } else {
            let (Some(first), Some(second)) = (ways.pop(), ways.pop()) else { unreachable!("halves come before") };
            Ways::of(area, leaf, &first, &second)
        };
        choices[i] = Choice { first_half: here.first_half, alone: here.alone };
        ways.push(here);
    }
    choices
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
fn leaf_cost(primitives: &Primitives, members: &[u32]) -> f32 {
    if members.len() > MAX_LEAF {
        return f32::INFINITY;
    }
    match members.iter().filter(|i| primitives.is_triangle(**i)).count() {
        0 => members.len() as f32 * OTHER_COST,
        n if n == members.len() => n.div_ceil(WIDTH) as f32 * BLOCK_COST,
        _ => f32::INFINITY,
    }
}

/// The wide tree to be: what goes where, before any of it is made.
struct Plan<'a> {
    binary: &'a Binary,
    choices: Vec<Choice>,
    /// Of each wide node its children: from which binary nodes, and what they are called.
    children: Vec<[Option<(u32, Child)>; WIDTH]>,
    /// Of each block its part of the order: the first, and how many.
    blocks: Vec<(u32, u32)>,
    others: Vec<u32>,
}

impl<'a> Plan<'a> {
    fn new(binary: &'a Binary, choices: Vec<Choice>) -> Self {
        Self { binary, choices, children: Vec::new(), blocks: Vec::new(), others: Vec::new() }
    }

    /// Returns what the root is called.
    fn write(&mut self, primitives: &Primitives) -> Child {
        let mut todo = Vec::new();
        let root = self.child(primitives, 0, &mut todo);
        while let Some((from, to)) = todo.pop() {
            let mut children = Vec::with_capacity(WIDTH);
            self.gather(from, &mut children);
            // The largest first: rays that stop at anything visit them in this order.
            let area = |i: &usize| half_area(&self.binary.nodes[*i].bounds);
            children.sort_by(|a, b| area(b).total_cmp(&area(a)));
            let after = todo.len();
            for (slot, i) in children.into_iter().enumerate() {
                let child = self.child(primitives, i, &mut todo);
                self.children[to][slot] = Some((i as u32, child));
            }
            todo[after..].reverse();
        }
        root
    }

    /// What stands for a subtree in one place. A node is left empty, to be filled by what is left to do.
    fn child(&mut self, primitives: &Primitives, i: usize, todo: &mut Vec<(usize, usize)>) -> Child {
        Child::new(match self.choices[i].alone {
            Alone::Leaf => self.leaf(primitives, i),
            Alone::Node(_) => {
                todo.push((i, self.children.len()));
                self.children.push([None; WIDTH]);
                Below::Node(self.children.len() as u32 - 1)
            }
        })
    }

    fn leaf(&mut self, primitives: &Primitives, i: usize) -> Below {
        let (members, start) = (self.binary.primitives(i), self.binary.nodes[i].first);
        if primitives.is_triangle(members[0]) {
            let first = self.blocks.len() as u32;
            let chunks = members.chunks(WIDTH).scan(start, |from, chunk| {
                let block = (*from, chunk.len() as u32);
                *from += block.1;
                Some(block)
            });
            self.blocks.extend(chunks);
            Below::Blocks { first, count: self.blocks.len() as u32 - first }
        } else {
            let first = self.others.len() as u32;
            self.others.extend_from_slice(members);
            Below::Others { first, count: members.len() as u32 }
        }
    }

    /// The subtrees that become the children of the node that `root` becomes.
    fn gather(&self, root: usize, children: &mut Vec<usize>) {
        let (Some([a, b]), Alone::Node(first)) = (self.binary.children(root), self.choices[root].alone) else {
            return;
        };
        let mut todo = vec![(b, WIDTH - usize::from(first)), (a, usize::from(first))];
        while let Some((i, mut places)) = todo.pop() {
            let choice = &self.choices[i];
            while places > 1 && choice.first_half[places - 1] == 0 {
                places -= 1;
            }
            match self.binary.children(i) {
                Some([a, b]) if places > 1 => {
                    let first = usize::from(choice.first_half[places - 1]);
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
