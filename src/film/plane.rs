//! One image of exact sums.

use std::{
    iter,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

/// The unit in which a film counts: every deposit is rounded once to a multiple of the quantum 2^exponent, and from
/// there on sums are integers, the same in whatever order they are made.
///
/// It depends on the scene alone, never on the number of samples, a crop or an exposure; otherwise two parts of one
/// render could not be added exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedPoint {
    exponent: i32,
}

impl FixedPoint {
    /// How many bits of the peak radiance lie below the point. The 24 bits above it hold the sum of a million samples of
    /// 16 times the peak; the 40 below resolve an image a hundred million times dimmer than its light.
    const BITS: i32 = 40;
    /// Far inside what f64 can represent, far outside what f32 radiances can reach.
    const LARGEST: i32 = 400;
    /// A single deposit must stay below this many quanta.
    pub(super) const LIMIT: f64 = (1_u64 << 60) as f64;

    /// The quantum 2^`exponent`. (Exponents that no radiance in f32 could need are moved to the nearest useful one.)
    pub fn with_exponent(exponent: i32) -> Self {
        Self { exponent: exponent.clamp(-Self::LARGEST, Self::LARGEST) }
    }

    /// The quantum for a scene in which nothing emits more than `scale`, a radiance: 40 binary digits below its leading
    /// one. Where the scale is not a positive number (nothing emits), any quantum will do.
    pub fn for_peak_radiance(scale: f64) -> Self {
        if !scale.is_normal() || scale < 0.0 {
            return Self::with_exponent(-Self::BITS);
        }
        let leading = ((scale.to_bits() >> 52) & 0x7ff) as i32 - 1023;
        Self::with_exponent(leading - Self::BITS)
    }

    /// The exponent of the quantum.
    pub fn exponent(self) -> i32 {
        self.exponent
    }

    /// The quantum.
    pub fn quantum(self) -> f64 {
        power_of_two(self.exponent)
    }

    /// How many quanta make one.
    pub(super) fn per_unit(self) -> f64 {
        power_of_two(-self.exponent)
    }
}

/// 2^`exponent`, exactly.
fn power_of_two(exponent: i32) -> f64 {
    debug_assert!(exponent.abs() <= 1022);
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// Sums in quanta, so many channels for every pixel. A half image is one, and so can a layer be.
pub(super) struct Plane<const CHANNELS: usize>(Box<[[AtomicU64; CHANNELS]]>);

impl<const CHANNELS: usize> Plane<CHANNELS> {
    /// Bytes for each pixel.
    pub(super) const BYTES_PER_PIXEL: u64 = size_of::<[AtomicU64; CHANNELS]>() as u64;

    pub(super) fn new(pixels: usize) -> Self {
        Self(iter::repeat_with(|| [const { AtomicU64::new(0) }; CHANNELS]).take(pixels).collect())
    }

    /// Adds non-negative `quanta` below [`FixedPoint::LIMIT`], rounded to nearest. Returns how many channels
    /// wrapped around in doing so.
    #[inline(always)]
    #[must_use]
    pub(super) fn add(&self, pixel: usize, quanta: [f64; CHANNELS]) -> u64 {
        let mut overflows = 0;
        for (sum, q) in self.0[pixel].iter().zip(quanta) {
            let q = mistake!(q + 0.5, DepositsCut => q) as u64;
            if q != 0 {
                let old = sum.fetch_add(q, Relaxed);
                overflows += u64::from(old.checked_add(q).is_none());
            }
        }
        overflows
    }

    /// Adds a sum that was made elsewhere. Returns whether it wrapped around.
    #[must_use]
    pub(super) fn add_sum(&self, pixel: usize, channel: usize, sum: u64) -> bool {
        self.0[pixel][channel].fetch_add(sum, Relaxed).checked_add(sum).is_none()
    }

    #[inline]
    pub(super) fn sum(&self, pixel: usize, channel: usize) -> u64 {
        self.0[pixel][channel].load(Relaxed)
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quanta_are_powers_of_two_that_follow_the_scale() {
        assert_eq!(FixedPoint::with_exponent(-3).quantum(), 0.125);
        assert_eq!(FixedPoint::with_exponent(-3).per_unit(), 8.0);
        assert_eq!(FixedPoint::for_peak_radiance(1.0).exponent(), -40);
        assert_eq!(FixedPoint::for_peak_radiance(1.99).exponent(), -40);
        assert_eq!(FixedPoint::for_peak_radiance(1024.0).exponent(), -30);
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(FixedPoint::for_peak_radiance(odd).exponent(), -40);
        }
        assert!(FixedPoint::with_exponent(i32::MIN).quantum() > 0.0);
        assert!(FixedPoint::with_exponent(i32::MAX).quantum().is_finite());
    }

    #[test]
    fn a_wrap_around_is_noticed() {
        let plane = Plane::new(1);
        let most = [FixedPoint::LIMIT * 0.999; 3];
        let wraps: u64 = (0..20).map(|_| plane.add(0, most)).sum();
        assert_eq!(wraps, 3, "19.98 · 2⁶⁰ passes 2⁶⁴ once in each channel");
    }
}
