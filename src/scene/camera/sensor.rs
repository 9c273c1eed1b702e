//! The image that a camera looks through, and places on it.

use glam::Vec2;

use crate::lanes::{Float, Lanes};

/// A place on the image in pixels: x to the right, y downwards, (0, 0) the upper left corner of the upper left pixel.
/// In the padding around the image, coordinates are negative or beyond its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster(pub Vec2);

/// The size of an image in pixels, and the padding around it that a filter wider than a pixel needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sensor {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Pixels of padding on every side: the filter's radius beyond half a pixel, rounded up.
    pub padding: u32,
}

impl Sensor {
    /// N_l by default: the pixels of the unpadded image.
    pub fn pixels(&self) -> u32 {
        self.width * self.height
    }

    /// N_c: one camera subpath per pixel of the padded image.
    pub fn padded_pixels(&self) -> u32 {
        (self.width + 2 * self.padding) * (self.height + 2 * self.padding)
    }

    /// The lower right corner of the image.
    #[inline]
    pub(super) fn size(&self) -> Vec2 {
        Vec2::new(self.width as f32, self.height as f32)
    }

    /// Whether `raster` lies in the padded image.
    #[inline(always)]
    pub(super) fn holds<F: Float>(&self, [x, y]: [F; 2]) -> <F::Lanes as Lanes>::M {
        let lanes = x.lanes();
        let (padding, size) = (self.padding as f32, self.size());
        let low = lanes.splat(-padding);
        let (right, bottom) = (lanes.splat(size.x + padding), lanes.splat(size.y + padding));
        low.le(x) & x.lt(right) & low.le(y) & y.lt(bottom)
    }
}
