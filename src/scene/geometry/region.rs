//! What of a tree lies in a part of space.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use super::{
    Bounds,
    bvh::Tree,
    node::{Below, Child, Row, Shape, WIDTH},
    triangle::Triangle,
};

/// A part of space for [`Tree::within`]: a box, or the part of it that a slab leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    bounds: Bounds,
    /// A point and the unit normal of a plane, and how far from it the region reaches.
    slab: Option<(DVec3, DVec3, f64)>,
}

impl Region {
    /// Everything no further than `slack` from the box, along each axis.
    pub fn around(bounds: Bounds, slack: f32) -> Self {
        // Finite, since the box of a child that is not there is infinitely far.
        let (min, max) = ((bounds.min - slack).max(Vec3::MIN), (bounds.max + slack).min(Vec3::MAX));
        Self { bounds: Bounds { min, max }, slab: None }
    }

    /// Everything no further than `slack` from the triangle's plane, and along each axis from its box.
    pub fn of_face(corners: [DVec3; 3], normal: DVec3, slack: f32) -> Self {
        let [a, b, c] = corners;
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        // Rounding the corners to f32 moves them by less than this, and so do the roundings of the nodes' boxes.
        let slack = slack + 2.0 * f32::EPSILON * min.abs().max(max.abs()).max_element() as f32;
        let bounds = Bounds { min: min.as_vec3(), max: max.as_vec3() };
        Self { slab: Some((a, normal, f64::from(slack))), ..Self::around(bounds, slack) }
    }

    fn meets(&self, b: Bounds) -> bool {
        b.meets(self.bounds) && self.slab_meets(b)
    }

    /// Which of eight boxes meet the region's.
    fn boxes_met(&self, boxes: &[[Row; 2]; 3]) -> impl Iterator<Item = usize> {
        let mut apart = [0_u32; WIDTH];
        for (axis, [low, high]) in boxes.iter().enumerate() {
            let (min, max) = (self.bounds.min[axis], self.bounds.max[axis]);
            for (lane, apart) in apart.iter_mut().enumerate() {
                *apart |= u32::from(low.0[lane] > max) | u32::from(min > high.0[lane]);
            }
        }
        (0..WIDTH).filter(move |lane| apart[*lane] == 0)
    }

    fn slab_meets(&self, b: Bounds) -> bool {
        let Some((point, normal, slack)) = self.slab else { return true };
        let (min, max) = (b.min.as_dvec3(), b.max.as_dvec3());
        let half = 0.5 * (max - min);
        normal.dot(0.5 * (min + max) - point).abs() <= slack + normal.abs().dot(half)
    }

    fn slab_meets_triangle(&self, triangle: &Triangle) -> bool {
        let Some((point, normal, slack)) = self.slab else { return true };
        let [a, b, c] = triangle.corners().map(|p| normal.dot(p.as_dvec3() - point));
        a.min(b).min(c) <= slack && a.max(b).max(c) >= -slack
    }
}

/// What [`Tree::within`] comes upon.
pub(super) enum Within {
    /// A triangle of the tree.
    Triangle { index: u32, triangle: Triangle },
    /// An instance.
    Instance { number: u32 },
}

impl Tree {
    /// Visits triangles and instances until `visit` breaks: all that have a part in the region, and some whose box has
    /// one.
    pub fn within(&self, region: &Region, visit: &mut impl FnMut(Within) -> ControlFlow<()>) -> ControlFlow<()> {
        self.root.map_or(ControlFlow::Continue(()), |root| self.within_child(root, region, visit))
    }

    /// No deeper than [`super::bvh::MAX_DEPTH`].
    fn within_child(
        &self,
        child: Child,
        region: &Region,
        visit: &mut impl FnMut(Within) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        match child.below() {
            Below::Node(index) => {
                let node = &self.nodes[index as usize];
                let [x, y, z] = &node.planes;
                for slot in region.boxes_met(&node.planes) {
                    let corner = |k: usize| Vec3::new(x[k].0[slot], y[k].0[slot], z[k].0[slot]);
                    if region.slab_meets(Bounds { min: corner(0), max: corner(1) }) {
                        self.within_child(node.children[slot], region, visit)?;
                    }
                }
            }
            Below::Blocks { first, count } => {
                for block in &self.blocks[first as usize..][..count as usize] {
                    for lane in region.boxes_met(&block.boxes()) {
                        if let Some((index, triangle)) = block.in_lane(lane)
                            && region.slab_meets_triangle(&triangle)
                        {
                            visit(Within::Triangle { index, triangle })?;
                        }
                    }
                }
            }
            Below::Others { first, count } => {
                for other in &self.others[first as usize..][..count as usize] {
                    if let Shape::Instance(bounds) = other.shape
                        && region.meets(bounds)
                    {
                        visit(Within::Instance { number: other.index })?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}
