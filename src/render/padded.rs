//! What one pass goes over: the pixels of the image and of its padding, tile by tile.

use std::ops::Range;

use glam::Vec2;

use crate::scene::camera::Sensor;

/// The pixels of the image and of the padding around it.
#[derive(Clone, Copy)]
pub(super) struct PaddedImage {
    pub(super) sensor: Sensor,
    /// Of a tile: its side in pixels.
    pub(super) side: u32,
}

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

    /// The same of one that is rendered in waves: enough paths to fill the queues well, and no more than a cache holds.
    pub(super) const TILE_OF_WAVES: u32 = 32;

    /// The numbers of the tiles.
    pub(super) fn tiles(self) -> Range<u32> {
        0..self.columns() * self.height().div_ceil(self.side)
    }

    fn columns(self) -> u32 {
        self.width().div_ceil(self.side)
    }

    fn width(self) -> u32 {
        self.sensor.width + 2 * self.sensor.padding
    }

    fn height(self) -> u32 {
        self.sensor.height + 2 * self.sensor.padding
    }

    /// The pixels of a tile, row by row.
    pub(super) fn tile(self, tile: u32) -> impl Iterator<Item = Pixel> {
        let [[x0, x1], [y0, y1]] = self.extent(tile);
        (y0..y1).flat_map(move |y| (x0..x1).map(move |x| self.pixel(x, y)))
    }

    /// The same, square by square, so that the rays of neighbouring lanes stay together.
    #[inline(always)]
    pub(super) fn each_in_squares(self, tile: u32, mut visit: impl FnMut(Pixel)) {
        const SIDE: u32 = 4;
        let [[x0, x1], [y0, y1]] = self.extent(tile);
        for upper in (y0..y1).step_by(SIDE as usize) {
            for left in (x0..x1).step_by(SIDE as usize) {
                for y in upper..(upper + SIDE).min(y1) {
                    for x in left..(left + SIDE).min(x1) {
                        visit(self.pixel(x, y));
                    }
                }
            }
        }
    }

    /// The upper left pixel of a tile.
    pub(super) fn corner(self, tile: u32) -> [i32; 2] {
        let [[x, _], [y, _]] = self.extent(tile);
        let Pixel { x, y } = self.pixel(x, y);
        [x, y]
    }

    fn extent(self, tile: u32) -> [[u32; 2]; 2] {
        let (x, y) = (tile % self.columns() * self.side, tile / self.columns() * self.side);
        [[x, (x + self.side).min(self.width())], [y, (y + self.side).min(self.height())]]
    }

    fn pixel(self, x: u32, y: u32) -> Pixel {
        let padding = self.sensor.padding as i32;
        Pixel { x: x as i32 - padding, y: y as i32 - padding }
    }
}

impl Pixel {
    /// A number that names the pixel whatever the image's size and padding.
    pub(super) fn key(self) -> u32 {
        // Padding is a few pixels; sizes are below 2¹⁶ less this offset.
        let offset = |x: i32| (x + 16) as u32 & 0xffff;
        offset(self.y) << 16 | offset(self.x)
    }

    /// Its number among those of the image, of which it is one, row by row.
    pub(super) fn number(self, sensor: Sensor) -> u32 {
        self.y as u32 * sensor.width + self.x as u32
    }

    /// The pixel with this number.
    pub(super) fn of_number(number: u32, sensor: Sensor) -> Self {
        Self { x: (number % sensor.width) as i32, y: (number / sensor.width) as i32 }
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
