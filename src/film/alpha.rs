//! How much of each pixel is covered by something: the alpha channel of an image without background.

use std::{
    iter,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

use super::{Crop, reach};
use crate::{sampling::Filter, scene::camera::Raster};

/// The exact sums behind an alpha channel. Threads share it.
///
/// As with the film, integers make it the same for any number of threads and any order of the samples. They are
/// rounded: filter values lie between 0 and a few, so that a fixed quantum is as good as any.
pub struct AlphaSums {
    crop: Crop,
    filter: Filter,
    /// Filter values of all camera samples, and of those by as much as they are covered.
    sums: Box<[[AtomicU64; 2]]>,
}

impl AlphaSums {
    /// Quanta in 1: 2³⁶, which leaves room for 2²⁶ samples a pixel.
    const PER_UNIT: f64 = (1_u64 << 36) as f64;

    /// Nothing known yet about the pixels `crop`.
    pub fn new(crop: Crop, filter: Filter) -> Self {
        let sums = iter::repeat_with(<[AtomicU64; 2]>::default).take(crop.pixels() as usize).collect();
        Self { crop, filter, sums }
    }

    /// What it takes for so many pixels, in bytes.
    pub fn memory(pixels: u64) -> u64 {
        size_of::<[AtomicU64; 2]>() as u64 * pixels
    }

    /// Adds a camera sample that is `covered` in [0, 1].
    #[inline]
    pub fn deposit(&self, raster: Raster, covered: f32) {
        let (columns, values_x) = reach(self.filter, raster.0.x, self.crop.x0, self.crop.x1);
        let (rows, values_y) = reach(self.filter, raster.0.y, self.crop.y0, self.crop.y1);
        for (y, wy) in rows.zip(values_y) {
            let row = y as usize * self.crop.width() as usize;
            for (x, wx) in columns.clone().zip(values_x) {
                let value = f64::from(wx * wy) * Self::PER_UNIT;
                let quanta = [value, value * f64::from(covered)].map(|part| (part + 0.5) as u64);
                for (sum, quanta) in self.sums[row + x as usize].iter().zip(quanta) {
                    sum.fetch_add(quanta, Relaxed);
                }
            }
        }
    }

    /// One of the two sums of a pixel.
    pub(super) fn sum(&self, pixel: usize, channel: usize) -> u64 {
        self.sums[pixel][channel].load(Relaxed)
    }

    /// Adds to it.
    pub(super) fn add_sum(&self, pixel: usize, channel: usize, sum: u64) {
        // There is room for 2²⁶ samples: only a file that no render wrote could need more, and alpha is a quotient all
        // the same.
        self.sums[pixel][channel].fetch_add(sum, Relaxed);
    }

    /// Alpha, pixel by pixel in the crop, row after row: the covered part of the filter's values, in [0, 1].
    ///
    /// This is the one place where filter values are divided by their sum. Light is not (a splat has none of its own to
    /// divide by), but alpha has only camera samples, and what is covered or empty throughout is exactly 1 or 0 so,
    /// however few they are. Without a sample it is 0.
    pub fn alpha(&self) -> Vec<f32> {
        let part = |pixel| match self.sum(pixel, 0) {
            0 => 0.0,
            all => (self.sum(pixel, 1) as f64 / all as f64) as f32,
        };
        (0..self.sums.len()).map(part).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::sampling::{Independent, Sampler, Stream};

    #[test]
    fn alpha_is_exact_where_nothing_varies_and_the_filtered_step_at_an_edge() {
        for filter in Filter::ALL {
            let crop = Crop { x0: 0, y0: 0, x1: 9, y1: 3 };
            let alpha_sums = AlphaSums::new(crop, filter);
            assert_eq!(alpha_sums.alpha(), [0.0; 27]);
            let mut sampler = Independent::new(1, 0, 0, Stream::Camera);
            for _ in 0..1_000_000 {
                let place = sampler.next_2d() * Vec2::new(13.0, 7.0) - 2.0;
                alpha_sums.deposit(Raster(place), if place.x < 4.5 { 1.0 } else { 0.0 });
            }
            let alpha = alpha_sums.alpha();
            for row in alpha.chunks(9) {
                assert!(row[..3] == [1.0; 3] && row[6..] == [0.0; 3], "{filter}: {row:?}");
                assert!((row[4] - 0.5).abs() < 0.02, "{filter}: {row:?}");
            }
        }
    }
}
