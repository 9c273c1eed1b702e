//! A node where it is in the world.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::error::Fault;

/// Metres from the world's origin beyond which nothing may lie: squared distances and areas must stay in the range of
/// f32.
pub(super) const FARTHEST: f32 = 1e17;

/// Whether `point` can be computed with.
pub(super) fn is_near(point: Vec3) -> bool {
    // A NaN is nowhere.
    point.to_array().iter().all(|x| x.abs() <= FARTHEST)
}

/// A node of the scene with its transform to world space, kept in f64 so that deep hierarchies lose nothing.
pub(super) struct Placed {
    pub(super) index: usize,
    pub(super) to_world: DAffine3,
    /// Whether what is at the node is there, cameras apart (`KHR_node_visibility`).
    pub(super) visible: bool,
}

impl Placed {
    /// The JSON pointer of the node.
    pub(super) fn pointer(&self) -> String {
        format!("/nodes/{}", self.index)
    }

    /// The world position of the node's origin.
    pub(super) fn origin(&self) -> Vec3 {
        self.to_world.translation.as_vec3()
    }

    /// The unit world direction of a local axis.
    pub(super) fn axis(&self, local: DVec3) -> Result<Vec3, Fault> {
        let axis = (self.to_world.matrix3 * local).try_normalize();
        axis.map(|axis| axis.as_vec3()).ok_or_else(|| {
            Fault::invalid(self.pointer(), "a camera or light here has no direction, its node is scaled to nothing")
        })
    }

    /// The factor of a uniform scale, mirrored or not; `None` for any other transform.
    pub(super) fn uniform_scale(&self) -> Option<f64> {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = self.to_world.matrix3;
        let scale = x.length();
        // Nodes are stored in f32, and a product of several rounds a little more.
        let small = 1e-5 * scale * scale;
        let uniform = (y.length_squared() - scale * scale).abs() <= 2.0 * small
            && (z.length_squared() - scale * scale).abs() <= 2.0 * small
            && [x.dot(y), y.dot(z), z.dot(x)].iter().all(|dot| dot.abs() <= small);
        uniform.then_some(scale)
    }
}
