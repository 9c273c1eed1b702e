//! Where on the scale of all numbers a film's words lie.

use super::ExactSum;

/// The quantum 2^exponent of a film's words.
///
/// Deposits that are multiples of it and not much too large for a word, which with a well-placed quantum nearly all
/// are, cost one addition of integers. All others are added just as exactly, and take longer: so where it lies never
/// changes a sum, and films with different quanta add up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedPoint {
    exponent: i32,
}

impl FixedPoint {
    /// How many bits of a typical radiance's leading one lie above the quantum: f32 down to 2⁻²¹ of that radiance are
    /// multiples of it.
    const BITS: i32 = 44;
    /// The lowest bit of a film's words is that of the smallest f32.
    const LEAST: i32 = ExactSum::UNIT + FINE_BITS as i32;
    /// The largest f32 still fits into a word.
    const MOST: i32 = 127 - 23 - LARGEST_SHIFT as i32;

    /// The quantum 2^`exponent`. (Exponents for which f32 has no use are moved to the nearest that has.)
    pub fn with_exponent(exponent: i32) -> Self {
        Self { exponent: exponent.clamp(Self::LEAST, Self::MOST) }
    }

    /// The quantum for an image most of which is within a few powers of ten of `typical`, a radiance. Where that is no
    /// positive number (nothing emits), any quantum will do.
    pub fn for_radiance(typical: f64) -> Self {
        let typical = if typical.is_normal() && typical > 0.0 { typical } else { 1.0 };
        let leading = ((typical.to_bits() >> 52) & 0x7ff) as i32 - 1023;
        Self::with_exponent(leading - Self::BITS)
    }

    /// The exponent of the quantum.
    pub fn exponent(self) -> i32 {
        self.exponent
    }

    /// The biased exponent of the smallest f32 all of whose bits are multiples of the quantum.
    pub(super) fn lowest(self) -> u32 {
        (127 + 23 + self.exponent) as u32
    }

    /// The place of the quantum's bit in an [`ExactSum`].
    pub(super) fn bit(self) -> u32 {
        (self.exponent - ExactSum::UNIT) as u32
    }

    /// The place there of the lowest bit of a film's fine words.
    pub(super) fn fine_bit(self) -> u32 {
        self.bit() - FINE_BITS
    }

    /// The quantum.
    pub(super) fn unit(self) -> f64 {
        power_of_two(self.exponent)
    }

    /// The unit of fine words.
    pub(super) fn fine_unit(self) -> f64 {
        power_of_two(self.exponent - FINE_BITS as i32)
    }
}

/// How far below the quantum the fine words reach, in bits.
pub(super) const FINE_BITS: u32 = 32;
/// A mantissa of 24 bits that is shifted by so much leaves two bits of a word to its sign and to sums.
pub(super) const LARGEST_SHIFT: u32 = 38;

/// 2^`exponent`, exactly.
pub(super) fn power_of_two(exponent: i32) -> f64 {
    debug_assert!(exponent.abs() <= 1022);
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quanta_are_powers_of_two_that_follow_the_scale() {
        assert_eq!(FixedPoint::for_radiance(1.0).exponent(), -44);
        assert_eq!(FixedPoint::for_radiance(1.99).exponent(), -44);
        assert_eq!(FixedPoint::for_radiance(1024.0).exponent(), -34);
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(FixedPoint::for_radiance(odd).exponent(), -44);
        }
        assert_eq!(FixedPoint::with_exponent(i32::MIN).fine_bit(), 0);
        assert_eq!(FixedPoint::with_exponent(i32::MAX).lowest() + LARGEST_SHIFT, 254, "that of f32::MAX");
    }
}
