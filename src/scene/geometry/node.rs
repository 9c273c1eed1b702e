//! What a tree is made of: nodes of eight children, blocks of eight triangles, and the primitives that they stand for.

use glam::{Vec2, Vec3};

use super::{
    Bounds,
    ray::{Interval, OneLine},
    sphere::Sphere,
    triangle::Triangle,
};
use crate::lanes::{Float, Lanes, Mask};

/// Children of a node, and triangles of a block.
pub(super) const WIDTH: usize = 8;

/// Eight numbers side by side, aligned for loads.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Row(pub [f32; WIDTH]);

impl Row {
    /// Of eight lanes.
    #[inline(always)]
    pub fn of(x: impl Float) -> Self {
        let mut row = Self([0.0; WIDTH]);
        x.store(&mut row.0);
        row
    }
}

/// A primitive as the builder gets it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Primitive {
    pub shape: Shape,
    /// The number of the primitive in its space, or that of the instance.
    pub index: u32,
}

/// The geometry of a primitive.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Triangle(Triangle),
    Sphere(Sphere),
    /// The box of an instance.
    Instance(Bounds),
}

impl Primitive {
    pub fn bounds(&self) -> Bounds {
        match self.shape {
            Shape::Triangle(t) => t.bounds(),
            Shape::Sphere(s) => s.bounds(),
            Shape::Instance(b) => b,
        }
    }

    /// Whether any ray meets it.
    pub fn is_solid(&self) -> bool {
        match self.shape {
            Shape::Triangle(t) => !t.is_degenerate(),
            Shape::Sphere(s) => s.radius > 0.0,
            Shape::Instance(_) => true,
        }
    }
}

/// An inner node: the boxes of its children and where they are. 256 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// For each axis the lower and the upper planes; of a child that is not there, the upper ones lie below the lower
    /// ones.
    pub planes: [[Row; 2]; 3],
    pub children: [Child; WIDTH],
}

impl Node {
    pub const EMPTY: Self = Self {
        planes: [[Row([f32::INFINITY; WIDTH]), Row([f32::NEG_INFINITY; WIDTH])]; 3],
        children: [Child(0); WIDTH],
    };

    /// The planes of the children's boxes along each axis, those of the side `first` before the others.
    #[inline(always)]
    pub fn planes<L: Lanes>(&self, lanes: L, first: [usize; 3]) -> [[L::F; 2]; 3] {
        let [x, y, z] = &self.planes;
        // With the last bit alone, indices need no test.
        [
            [lanes.load(&x[first[0] & 1].0), lanes.load(&x[first[0] & 1 ^ 1].0)],
            [lanes.load(&y[first[1] & 1].0), lanes.load(&y[first[1] & 1 ^ 1].0)],
            [lanes.load(&z[first[2] & 1].0), lanes.load(&z[first[2] & 1 ^ 1].0)],
        ]
    }

    /// The lower and the upper plane of a child's box along each axis, if there is a child.
    #[inline(always)]
    pub fn child_planes(&self, slot: usize) -> Option<[[f32; 2]; 3]> {
        let [[x0, x1], [y0, y1], [z0, z1]] = &self.planes;
        let planes = [[x0.0[slot], x1.0[slot]], [y0.0[slot], y1.0[slot]], [z0.0[slot], z1.0[slot]]];
        (planes[0][0] <= planes[0][1]).then_some(planes)
    }

    pub fn put(&mut self, slot: usize, bounds: Bounds, child: Child) {
        for (axis, [low, high]) in self.planes.iter_mut().enumerate() {
            low.0[slot] = bounds.min[axis];
            high.0[slot] = bounds.max[axis];
        }
        self.children[slot] = child;
    }
}

/// What hangs below a node: a node, or a leaf of blocks of triangles or of other primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// A [`Child`], taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Below {
    Node(u32),
    Blocks { first: u32, count: u32 },
    Others { first: u32, count: u32 },
}

impl Child {
    const LEAF: u32 = 1 << 31;
    const OTHERS: u32 = 1 << 30;
    const COUNT_SHIFT: u32 = 26;
    /// The most blocks or other primitives in a leaf.
    pub const MOST: usize = 16;
    /// How many nodes, blocks and others can be told apart.
    pub const NAMES: usize = 1 << Self::COUNT_SHIFT;

    pub fn new(below: Below) -> Self {
        let leaf = |kind: u32, first: u32, count: u32| {
            assert!((1..=Self::MOST as u32).contains(&count) && (first as usize) < Self::NAMES);
            Self(Self::LEAF | kind | (count - 1) << Self::COUNT_SHIFT | first)
        };
        match below {
            Below::Node(index) => {
                assert!((index as usize) < Self::NAMES, "fewer than 2²⁶ nodes");
                Self(index)
            }
            Below::Blocks { first, count } => leaf(0, first, count),
            Below::Others { first, count } => leaf(Self::OTHERS, first, count),
        }
    }

    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// What gave these [`Self::bits`].
    #[inline(always)]
    pub fn of_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline]
    pub fn below(self) -> Below {
        let (first, count) = (self.0 % Self::NAMES as u32, (self.0 >> Self::COUNT_SHIFT) % 16 + 1);
        match self.0 & (Self::LEAF | Self::OTHERS) {
            Self::LEAF => Below::Blocks { first, count },
            x if x & Self::LEAF != 0 => Below::Others { first, count },
            _ => Below::Node(self.0),
        }
    }
}

/// Up to eight triangles side by side: for the first, second and third corner its coordinates along each axis. 320
/// bytes. A lane without a triangle has three equal corners, which no ray meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    corners: [[Row; 3]; 3],
    indices: [u32; WIDTH],
}

impl Block {
    /// # Panics
    /// If there are more than eight, or what is no triangle.
    pub fn new(triangles: &[Primitive]) -> Self {
        let mut block = Self { corners: [[Row([0.0; WIDTH]); 3]; 3], indices: [u32::MAX; WIDTH] };
        for (lane, primitive) in triangles.iter().enumerate() {
            let Shape::Triangle(triangle) = primitive.shape else { panic!("a block holds triangles") };
            for (k, corner) in triangle.corners().iter().enumerate() {
                (0..3).for_each(|axis| block.corners[k][axis].0[lane] = corner[axis]);
            }
            block.indices[lane] = primitive.index;
        }
        block
    }

    /// How many triangles it has: those of the first lanes.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.indices.iter().take_while(|index| **index != u32::MAX).count()
    }

    /// The number of its triangle in a lane.
    #[inline(always)]
    pub fn index(&self, lane: usize) -> u32 {
        self.indices[lane]
    }

    /// Its triangle in a lane, with its number, if there is one.
    #[inline]
    pub fn in_lane(&self, lane: usize) -> Option<(u32, Triangle)> {
        let index = self.indices[lane];
        (index != u32::MAX).then(|| (index, self.triangle(lane)))
    }

    /// The boxes of its triangles, as a node has those of its children.
    #[inline]
    pub fn boxes(&self) -> [[Row; 2]; 3] {
        let mut boxes = Node::EMPTY.planes;
        for corner in &self.corners {
            for ([low, high], corner) in boxes.iter_mut().zip(corner) {
                for lane in 0..WIDTH {
                    low.0[lane] = low.0[lane].min(corner.0[lane]);
                    high.0[lane] = high.0[lane].max(corner.0[lane]);
                }
            }
        }
        boxes
    }

    #[inline(always)]
    fn triangle(&self, lane: usize) -> Triangle {
        let (a, b, c) = (self.corner(lane, 0), self.corner(lane, 1), self.corner(lane, 2));
        Triangle::new([Vec3::from_array(a), Vec3::from_array(b), Vec3::from_array(c)])
    }

    /// A corner of the triangle in a lane.
    #[inline(always)]
    pub fn corner(&self, lane: usize, corner: usize) -> [f32; 3] {
        let [x, y, z] = &self.corners[corner];
        [x.0[lane], y.0[lane], z.0[lane]]
    }

    /// The coordinates of the first, second or third corners.
    #[inline(always)]
    pub fn corners(&self, corner: usize) -> [&[f32; WIDTH]; 3] {
        let [x, y, z] = &self.corners[corner];
        [&x.0, &y.0, &z.0]
    }

    /// The planes of the triangles' boxes along an axis, those of the side `first` before the others.
    #[inline(always)]
    fn planes<L: Lanes>(&self, lanes: L, axis: usize, first: usize) -> [L::F; 2] {
        let [a, b, c] = &self.corners;
        let (a, b, c) = (lanes.load(&a[axis].0), lanes.load(&b[axis].0), lanes.load(&c[axis].0));
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        if first == 0 { [low, high] } else { [high, low] }
    }

    /// `Triangle::intersect` for all of its triangles, with the same roundings: calls `found` with the index, t and the
    /// barycentric coordinates of each triangle that the ray meets, and returns the limit that is left.
    #[inline(always)]
    pub fn intersect<L: Lanes>(
        &self,
        line: &OneLine<L>,
        mut limit: f32,
        mut found: impl FnMut(u32, f32, Vec2, f32) -> f32,
    ) -> f32 {
        let OneLine { ray, lines, first } = line;
        let lanes = lines.lanes;
        let [x, y, z] = ray.axes;
        let (x, y, z) = (x as usize, y as usize, z as usize);
        let [a, b, c] = &self.corners;
        let a = lines.relative([lanes.load(&a[x].0), lanes.load(&a[y].0), lanes.load(&a[z].0)]);
        let b = lines.relative([lanes.load(&b[x].0), lanes.load(&b[y].0), lanes.load(&b[z].0)]);
        let c = lines.relative([lanes.load(&c[x].0), lanes.load(&c[y].0), lanes.load(&c[z].0)]);
        let edges = lines.edges([lines.sheared(a), lines.sheared(b), lines.sheared(c)]);
        if !edges.inside.any() {
            return limit;
        }
        let det = edges.det();
        // Most of what is left lies behind the ray.
        let boxes = [self.planes(lanes, 0, first[0]), self.planes(lanes, 1, first[1]), self.planes(lanes, 2, first[2])];
        let ([near, far], entered) = line.clip(boxes, limit);
        let mut met = (edges.inside & lines.is_area(det) & entered).bits();
        if met == 0 {
            return limit;
        }
        let (v, w, det) = (Row::of(edges.v), Row::of(edges.w), Row::of(det));
        let (near, far) = (Row::of(near), Row::of(far));
        while met != 0 {
            let lane = met.trailing_zeros() as usize % WIDTH;
            met &= met - 1;
            let range = Interval { near: near.0[lane], far: far.0[lane] };
            if let Some(t) = self.triangle(lane).distance(ray, range) {
                let det = det.0[lane];
                limit = found(self.indices[lane], t, Vec2::new(v.0[lane] / det, w.0[lane] / det), limit);
            }
        }
        limit
    }
}
