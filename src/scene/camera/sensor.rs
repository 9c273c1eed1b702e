//! The image that a camera looks through, and places on it.

use glam::Vec2;

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
    #[inline]
    pub(super) fn holds(&self, raster: Vec2) -> bool {
        let padding = Vec2::splat(self.padding as f32);
        raster.cmpge(-padding).all() && raster.cmplt(self.size() + padding).all()
    }
}
