//! What one pass goes over: the pixels of the image and of its padding, tile by tile.

use std::ops::Range;

use glam::Vec2;

use crate::scene::camera::Sensor;

/// The pixels of the image and of the padding around it.
#[derive(Clone, Copy)]
pub(super) struct PaddedImage(pub(super) Sensor);

/// A pixel of the padded image.
#[derive(Clone, Copy)]
pub(super) struct Pixel {
    pub(super) x: i32,
    pub(super) y: i32,
}

impl PaddedImage {
    /// Side of the square that one task renders: long enough to hide the cost of a task, short enough to balance
    /// threads.
    pub(super) const TILE: u32 = 16;

    /// The numbers of the tiles.
    pub(super) fn tiles(self) -> Range<u32> {
        0..self.columns() * self.height().div_ceil(Self::TILE)
    }

    fn columns(self) -> u32 {
        self.width().div_ceil(Self::TILE)
    }

    fn width(self) -> u32 {
        self.0.width + 2 * self.0.padding
    }

    fn height(self) -> u32 {
        self.0.height + 2 * self.0.padding
    }

    /// The pixels of a tile, row by row.
    pub(super) fn tile(self, tile: u32) -> impl Iterator<Item = Pixel> {
        let (x0, y0) = (tile % self.columns() * Self::TILE, tile / self.columns() * Self::TILE);
        let (x1, y1) = ((x0 + Self::TILE).min(self.width()), (y0 + Self::TILE).min(self.height()));
        let padding = self.0.padding as i32;
        (y0..y1).flat_map(move |y| (x0..x1).map(move |x| Pixel { x: x as i32 - padding, y: y as i32 - padding }))
    }
}

impl Pixel {
    /// A number that names the pixel whatever the image's size and padding.
    pub(super) fn key(self) -> u32 {
        // Padding is a few pixels; sizes are below 2¹⁶ less this offset.
        let offset = |x: i32| (x + 16) as u32 & 0xffff;
        offset(self.y) << 16 | offset(self.x)
    }

    /// Its upper left corner on the image.
    #[inline]
    pub(super) fn corner(self) -> Vec2 {
        Vec2::new(self.x as f32, self.y as f32)
    }

    pub(super) fn is_inside(self, sensor: Sensor) -> bool {
        (0..sensor.width as i32).contains(&self.x) && (0..sensor.height as i32).contains(&self.y)
    }
}
