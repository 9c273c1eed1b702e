//! The film: where contributions are added, exactly and in any order, and how images leave the program.
//!
//! Sums are exact: every finite f32 of either sign counts to its last bit, however small beside the brightest light and
//! however large ([`ExactSum`]). They are integers, and adding integers commutes, so the image is the same to the last
//! bit for any number of threads, any split of the samples and any order of them. Nothing is lost silently: what cannot
//! be added is counted ([`DepositErrors`]).

mod alpha;
mod checkpoint;
mod crop;
mod exr;
mod fixed;
mod folder;
mod image;
mod noise;
mod output;
mod plane;
mod png;
mod sparse;
mod sum;
mod tile;
mod tone;

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

pub(crate) use self::exr::{PREFIX, sort_attributes};
use self::plane::{Overflow, Plane};
pub use self::{
    alpha::AlphaSums,
    checkpoint::{CheckpointError, CheckpointFile, CheckpointHeader, Contents, Sums, encode_checkpoint},
    crop::Crop,
    exr::{DENOISED, Header, Samples, encode_exr},
    fixed::FixedPoint,
    folder::{check_folder, write_folder},
    image::{Image, half_image_rel_mse},
    noise::ENOUGH_TILES,
    output::{Format, OutputError, UnknownFormat, check_writable, write_atomically},
    png::{Exposure, encode_png, srgb_codes},
    sum::ExactSum,
    tile::TileSums,
    tone::{Look, Tone, WhiteBalance},
};
use crate::{
    lanes::Lanes,
    math::Rgb,
    sampling::Filter,
    scene::camera::{Raster, Sensor},
};

/// Which of the two half images a pass belongs to. Each half is an image of its own; their difference is the noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// Even passes.
    Even,
    /// Odd passes.
    Odd,
}

impl Half {
    /// The half of the pass with this index.
    pub fn of_pass(pass: u32) -> Self {
        if pass.is_multiple_of(2) { Self::Even } else { Self::Odd }
    }
}

/// How many deposits were left out of the film, and why. A render without a bug has none of these.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DepositErrors {
    /// Deposits with a NaN or an infinity in value or place.
    pub non_finite: u64,
    /// Additions to a pixel's channel for which an [`ExactSum`] has no room: these pixels are wrong. No render lives to
    /// see one.
    pub overflow: u64,
}

impl DepositErrors {
    /// Whether there was none.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.non_finite.saturating_add(self.overflow)
    }

    /// These and the other's. (They may come from a file, which can say anything.)
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            non_finite: self.non_finite.saturating_add(other.non_finite),
            overflow: self.overflow.saturating_add(other.overflow),
        }
    }
}

/// The two half images of (a crop of) an image, as exact unnormalised sums. Threads share it.
pub struct Film {
    crop: Crop,
    filter: Filter,
    halves: [Plane; 2],
    /// In the order of [`DepositErrors`].
    errors: [AtomicU64; 2],
}

/// Indices into [`Film::errors`].
#[derive(Clone, Copy)]
enum Fault {
    NonFinite,
    Overflow,
}

impl Film {
    /// A black film for the pixels `crop` of `sensor`'s image.
    ///
    /// # Panics
    /// If the crop does not fit the image ([`Crop::fits`]), or the sensor has less padding than the filter needs.
    pub fn new(sensor: Sensor, crop: Crop, filter: Filter, scale: FixedPoint) -> Self {
        assert!(crop.fits(sensor), "{crop:?} does not fit {sensor:?}");
        assert!(sensor.padding >= filter.padding(), "{sensor:?} has too little padding for {filter:?}");
        let pixels = crop.pixels() as usize;
        let halves = [Plane::new(scale, pixels), Plane::new(scale, pixels)];
        Self { crop, filter, halves, errors: Default::default() }
    }

    /// What a film of so many pixels takes, in bytes, where no deposit is out of the common: half of it from the
    /// beginning, the other half where small deposits fall. What lies beyond adds [`Film::wide_memory`].
    pub fn memory(pixels: u64) -> u64 {
        2 * Plane::expected_memory(pixels)
    }

    /// The most that one sum of a pixel takes which is far out of the common, in bytes.
    pub const WIDEST_SUM: u64 = Plane::WIDEST;

    /// What it takes now, in bytes.
    pub fn memory_now(&self) -> u64 {
        self.halves.iter().map(|plane| plane.memory().0).sum()
    }

    /// How much of this the sums of pixels take that got deposits far out of the common: far below the typical
    /// radiance, far above it, or so many that they are.
    pub fn wide_memory(&self) -> u64 {
        self.halves.iter().map(|plane| plane.memory().1).sum()
    }

    /// The pixels of the image that the film holds.
    pub fn crop(&self) -> Crop {
        self.crop
    }

    /// Where its words lie. It changes no sum.
    pub fn scale(&self) -> FixedPoint {
        self.halves[0].scale()
    }

    /// Adds `value` h_j(`raster`), rounded to f32, to every pixel j. (With the box filter that is `value` itself.)
    /// `value` is a contribution F/(n p) without its h_j; it is not divided by the number of passes.
    #[inline(always)]
    pub fn deposit(&self, raster: Raster, value: Rgb, half: Half) {
        if !(value.is_finite() && raster.0.is_finite()) {
            self.count(Fault::NonFinite, 1);
            return;
        }
        if self.filter == Filter::Box {
            // h is 1 on the sample's own pixel: the general way below, without its loops.
            let (x, y) = (raster.0.x.floor() as i64, raster.0.y.floor() as i64);
            if let Some(pixel) = self.crop.index(x, y) {
                let overflows = self.halves[half as usize].add(pixel, value.to_array());
                if overflows > 0 {
                    self.count(Fault::Overflow, overflows);
                }
            }
        } else {
            self.spread(raster, value, half);
        }
    }

    /// Has the words of a place brought near before something is added to them: an atomic addition waits for its line
    /// of the cache, and holds up all that comes after.
    #[inline(always)]
    pub(crate) fn announce(&self, lanes: impl Lanes, raster: Raster, half: Half) {
        if let Some(pixel) = self.crop.index(raster.0.x.floor() as i64, raster.0.y.floor() as i64) {
            lanes.prefetch(self.halves[half as usize].words_of(pixel));
        }
    }

    /// Adds to every pixel that the filter's support reaches.
    #[inline(never)]
    fn spread(&self, raster: Raster, value: Rgb, half: Half) {
        // The support reaches as many pixels to either side as the padding has; what lies outside the crop belongs to
        // another part of the image.
        let place = raster.0;
        let (columns, values_x) = reach(self.filter, place.x, self.crop.x0, self.crop.x1);
        let (rows, values_y) = reach(self.filter, place.y, self.crop.y0, self.crop.y1);
        let plane = &self.halves[half as usize];
        for (y, wy) in rows.zip(values_y) {
            let row = y as usize * self.crop.width() as usize;
            for (x, wx) in columns.clone().zip(values_x) {
                // No filter is above 1, so that this is as finite as `value`.
                let overflows = plane.add(row + x as usize, (value * (wx * wy)).to_array());
                if overflows > 0 {
                    self.count(Fault::Overflow, overflows);
                }
            }
        }
    }

    #[cold]
    fn count(&self, fault: Fault, times: u64) {
        let errors = &self.errors[fault as usize];
        // What a file says may be as large as numbers get.
        if errors.fetch_add(times, Relaxed).checked_add(times).is_none() {
            errors.store(u64::MAX, Relaxed);
        }
    }

    /// What could not be added so far.
    pub fn errors(&self) -> DepositErrors {
        let count = |fault: Fault| self.errors[fault as usize].load(Relaxed);
        DepositErrors { non_finite: count(Fault::NonFinite), overflow: count(Fault::Overflow) }
    }

    /// Adds to the count of what could not be added: what other parts of the same render left out.
    pub fn add_errors(&self, errors: DepositErrors) {
        let DepositErrors { non_finite, overflow } = errors;
        self.count(Fault::NonFinite, non_finite);
        self.count(Fault::Overflow, overflow);
    }

    /// How many pixels it holds.
    pub fn pixels(&self) -> usize {
        self.halves[0].len()
    }

    /// The sum of one channel of a half image's pixel. Pixels are counted row by row.
    ///
    /// # Panics
    /// For a pixel or a channel that is not there.
    pub fn sum(&self, half: Half, pixel: usize, channel: usize) -> ExactSum {
        self.halves[half as usize].sum(pixel, channel)
    }

    fn add_sum(&self, half: Half, pixel: usize, channel: usize, sum: ExactSum) {
        self.count_overflow(self.halves[half as usize].add_sum(pixel, channel, sum));
    }

    /// [`Plane::units`].
    #[inline]
    fn units(&self, half: Half, pixel: usize, channel: usize, scale: FixedPoint) -> Option<i128> {
        self.halves[half as usize].units(pixel, channel, scale)
    }

    /// [`Plane::add_units`].
    #[inline]
    fn add_units(&self, half: Half, pixel: usize, channel: usize, units: i128, scale: FixedPoint) {
        self.count_overflow(self.halves[half as usize].add_units(pixel, channel, units, scale));
    }

    #[inline]
    fn count_overflow(&self, added: Result<(), Overflow>) {
        if added.is_err() {
            self.count(Fault::Overflow, 1);
        }
    }

    /// The image after `passes` passes.
    ///
    /// # Panics
    /// If `passes` is zero.
    pub fn image(&self, passes: u32) -> Image {
        let [even, odd] = &self.halves;
        self.normalised(passes, |pixel| even.value_with(odd, pixel))
    }

    /// One half of the image, of which `passes` passes were rendered.
    ///
    /// # Panics
    /// If `passes` is zero.
    pub fn half_image(&self, half: Half, passes: u32) -> Image {
        let plane = &self.halves[half as usize];
        self.normalised(passes, |pixel| plane.value(pixel))
    }

    /// Whether nothing has been added to any pixel. Such an image is dark or has missed all light there is: nobody
    /// knows which.
    pub fn is_black(&self) -> bool {
        let sums = |pixel| self.halves.iter().flat_map(move |plane| [0, 1, 2].map(|channel| plane.sum(pixel, channel)));
        (0..self.pixels()).flat_map(sums).all(|sum| sum == ExactSum::ZERO)
    }

    /// The noise of [`Film::image`] as [`half_image_rel_mse`] of its halves; `None` unless `passes` is even and not
    /// zero, since nothing is known about one pass and the halves of an odd number are not alike, and for an image that
    /// [`is_black`](Film::is_black).
    pub fn noise(&self, passes: u32) -> Option<f64> {
        let of_half = (passes.is_multiple_of(2) && passes > 0 && !self.is_black()).then_some(passes / 2)?;
        Some(half_image_rel_mse(&self.half_image(Half::Even, of_half), &self.half_image(Half::Odd, of_half)))
    }

    fn normalised(&self, passes: u32, sum: impl Fn(usize) -> [f64; 3]) -> Image {
        assert!(passes > 0, "an image is a mean over at least one pass");
        let passes = f64::from(passes);
        let pixels =
            (0..self.pixels()).map(|pixel| Rgb::from_array(sum(pixel).map(|sum| (sum / passes) as f32))).collect();
        Image { width: self.crop.width(), height: self.crop.height(), pixels }
    }
}

/// The pixels of one axis that a sample at `x` reaches between `first` and `end`, counted from `first`, and the
/// filter's value at each (the array may be longer than the range).
#[inline]
fn reach(filter: Filter, x: f32, first: u32, end: u32) -> (std::ops::Range<u32>, [f32; Filter::MAX_WIDTH]) {
    // Places far outside saturate, and stay outside.
    let (own, padding) = (x.floor() as i64, i64::from(filter.padding()));
    let from = (own - padding).clamp(i64::from(first), i64::from(end));
    let to = (own + padding + 1).clamp(i64::from(first), i64::from(end));
    let mut values = [0.0; Filter::MAX_WIDTH];
    for (pixel, value) in (from..to).zip(&mut values) {
        *value = filter.value_1d(x - (pixel as f32 + 0.5));
    }
    ((from as u32 - first)..(to as u32 - first), values)
}

#[cfg(test)]
mod tests;
