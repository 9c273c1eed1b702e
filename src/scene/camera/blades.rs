//! Irises: lenses that are regular polygons.

use std::f32::consts::{PI, TAU};

use glam::Vec2;

use crate::sampling::warp;

/// The straight blades of an iris: the lens is a regular polygon *of the same area* as the disk without them, so that
/// neither densities nor exposure change with their number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blades {
    count: u32,
    rotation: f32,
}

impl Blades {
    /// How many there can be.
    pub const COUNTS: [u32; 2] = [3, 64];

    /// So many blades. Without a rotation a corner is to the right, seen by the camera; it turns counter-clockwise by
    /// `rotation`, radians. `None` for a polygon that there is not.
    pub fn new(count: u32, rotation: f32) -> Option<Self> {
        let [least, most] = Self::COUNTS;
        ((least..=most).contains(&count) && rotation.is_finite()).then_some(Self { count, rotation })
    }

    /// Their number.
    pub fn count(self) -> u32 {
        self.count
    }

    /// Radians.
    pub fn rotation(self) -> f32 {
        self.rotation
    }

    /// How far the corners are from the middle, for a disk of radius 1: R with ½ N R² sin(2π/N) = π.
    pub fn reach(self) -> f32 {
        let angle = TAU / self.count as f32;
        (2.0 * PI / (self.count as f32 * angle.sin())).sqrt()
    }

    /// A uniformly distributed point of the polygon, right and up, for a disk of radius 1: of one of the triangles
    /// around its middle. Its density is 1/π.
    #[inline(never)]
    pub(super) fn sample(self, u: Vec2) -> Vec2 {
        let place = u.x * self.count as f32;
        // Rounding may lead to the last one's end.
        let triangle = (place as u32).min(self.count - 1);
        let corner = |i: u32| Vec2::from_angle(self.rotation + TAU * i as f32 / self.count as f32);
        let [b, c] = warp::triangle([place - triangle as f32, u.y]);
        self.reach() * (corner(triangle) * b + corner(triangle + 1) * c)
    }
}
