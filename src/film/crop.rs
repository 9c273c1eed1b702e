//! The part of the image that is rendered.

use crate::scene::camera::Sensor;

/// Pixels x0 ≤ x < x1, y0 ≤ y < y1 of the full image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// Column after the last.
    pub x1: u32,
    /// Row after the last.
    pub y1: u32,
}

impl Crop {
    /// The whole image.
    pub fn full(sensor: Sensor) -> Self {
        Self { x0: 0, y0: 0, x1: sensor.width, y1: sensor.height }
    }

    /// Whether it holds at least one pixel and no pixel outside the image.
    pub fn fits(&self, sensor: Sensor) -> bool {
        self.x0 < self.x1 && self.y0 < self.y1 && self.x1 <= sensor.width && self.y1 <= sensor.height
    }

    /// The number of a pixel of the full image among those of the crop, row by row; `None` outside it.
    #[inline]
    pub fn index(&self, x: i64, y: i64) -> Option<usize> {
        let inside = (i64::from(self.x0)..i64::from(self.x1)).contains(&x)
            && (i64::from(self.y0)..i64::from(self.y1)).contains(&y);
        inside.then(|| (y - i64::from(self.y0)) as usize * self.width() as usize + (x - i64::from(self.x0)) as usize)
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width()) * u64::from(self.height())
    }
}
