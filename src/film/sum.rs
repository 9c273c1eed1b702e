//! Sums of f32 without any rounding.

use super::fixed::power_of_two;

/// An exact sum of finite f32 of either sign: an integer of 320 bits in units of 2⁻¹⁴⁹, the smallest f32.
///
/// All f32 lie between bits 0 and 276; 43 more hold the sum of 2⁴² of the largest. (Kulisch's long accumulator.)
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ExactSum([u64; Self::WORDS]);

impl ExactSum {
    /// Words of 64 bits, the lowest first, in two's complement.
    pub(super) const WORDS: usize = 5;
    /// The exponent of the unit.
    pub(super) const UNIT: i32 = -149;
    /// Nothing, or what cancels.
    pub const ZERO: Self = Self([0; Self::WORDS]);

    /// The value of a finite f32; `None` for others.
    pub fn of(value: f32) -> Option<Self> {
        value.is_finite().then(|| {
            let (mantissa, shift) = integer(value);
            Self::shifted(mantissa.into(), shift)
        })
    }

    pub(super) fn from_words(words: [u64; Self::WORDS]) -> Self {
        Self(words)
    }

    pub(super) fn words(self) -> [u64; Self::WORDS] {
        self.0
    }

    /// `value`·2^`shift` units; there must be room for it.
    pub(super) fn shifted(value: i128, shift: u32) -> Self {
        let mut words = [0; Self::WORDS];
        let (first, offset) = ((shift / 64) as usize, shift % 64);
        let magnitude = value.unsigned_abs();
        let (low, high) = (magnitude as u64, (magnitude >> 64) as u64);
        // Three words hold 128 bits that begin anywhere in the first of them.
        let above = |word: u64| if offset == 0 { 0 } else { word >> (64 - offset) };
        let parts = [low << offset, (high << offset) | above(low), above(high)];
        for (i, part) in parts.into_iter().enumerate().filter(|(_, part)| *part != 0) {
            words[first + i] = part;
        }
        let sum = Self(words);
        if value < 0 { sum.negated() } else { sum }
    }

    /// Whether it is less than zero.
    pub fn is_negative(self) -> bool {
        (self.0[Self::WORDS - 1] as i64) < 0
    }

    /// Whether it is zero.
    pub fn is_zero(self) -> bool {
        self == Self::ZERO
    }

    fn negated(self) -> Self {
        let mut carry = true;
        Self(self.0.map(|word| {
            let (negated, carried) = (!word).overflowing_add(carry.into());
            carry = carried;
            negated
        }))
    }

    /// The exact sum of both; `None` beyond 2¹⁷⁰ in magnitude.
    pub fn checked_add(self, other: Self) -> Option<Self> {
        let mut carry = false;
        let mut words = self.0;
        for (word, own) in words.iter_mut().zip(other.0) {
            let (sum, first) = word.overflowing_add(own);
            let (sum, second) = sum.overflowing_add(carry.into());
            (*word, carry) = (sum, first || second);
        }
        let sum = Self(words);
        let fits = self.is_negative() != other.is_negative() || sum.is_negative() == self.is_negative();
        fits.then_some(sum)
    }

    /// It in units of 2^`shift` of its own, if that is an integer of `bits` bits with its sign.
    pub(super) fn in_units(self, shift: u32, bits: u32) -> Option<i128> {
        let magnitude = if self.is_negative() { self.negated() } else { self };
        let (first, offset) = ((shift / 64) as usize, shift % 64);
        let word = |i: usize| u128::from(magnitude.0.get(i).copied().unwrap_or(0));
        let parts = (word(first) | word(first + 1) << 64, word(first + 2));
        let value = if offset == 0 { parts.0 } else { parts.0 >> offset | parts.1 << (128 - offset) };
        let value = i128::try_from(value).ok().filter(|value| *value >> (bits - 1) == 0)?;
        let value = if self.is_negative() { -value } else { value };
        (Self::shifted(value, shift) == self).then_some(value)
    }

    /// The nearest f64: rounded once, to even.
    pub fn to_f64(self) -> f64 {
        let magnitude = if self.is_negative() { self.negated() } else { self };
        let Some(top) = magnitude.0.iter().rposition(|word| *word != 0) else { return 0.0 };
        let unused = magnitude.0[top].leading_zeros();
        let below = |i: usize| top.checked_sub(i).map_or(0, |i| magnitude.0[i]);
        // The 64 bits from the leading one on, the last of them set where anything follows: enough to round as all bits
        // would.
        let cut = if unused == 0 { 0 } else { below(1) >> (64 - unused) };
        let rest = below(1) << unused != 0 || (2..=top).any(|i| below(i) != 0);
        let leading = (magnitude.0[top] << unused | cut) | u64::from(rest);
        let value = leading as f64 * power_of_two(64 * top as i32 - unused as i32 + Self::UNIT);
        if self.is_negative() { -value } else { value }
    }
}

/// A finite f32 as m·2^k units of [`ExactSum`]: (m, k), |m| < 2²⁴ and k < 254.
pub(super) fn integer(value: f32) -> (i32, u32) {
    let bits = value.to_bits();
    let exponent = bits >> 23 & 0xff;
    // Subnormal numbers have the exponent of the smallest normal ones, and no leading one.
    let leading = u32::from(exponent > 0) << 23;
    let mantissa = ((bits & 0x7f_ffff) | leading) as i32;
    (if bits >> 31 == 0 { mantissa } else { -mantissa }, exponent.max(1) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_value_is_itself() {
        let values = [0.0, 1.0, -1.0, 0.1, -3e-39, f32::MAX, f32::MIN, f32::MIN_POSITIVE, f32::from_bits(1), -1.5e30];
        for value in values {
            let sum = ExactSum::of(value).unwrap();
            assert_eq!(sum.to_f64(), f64::from(value));
            assert_eq!(sum.is_negative(), value < 0.0);
            let (mantissa, shift) = integer(value);
            assert_eq!(sum.in_units(shift, 96), Some(mantissa.into()));
            assert_eq!(sum.in_units(shift + 24, 96).is_some(), value == 0.0, "{value}");
            assert!(sum.checked_add(ExactSum::of(-value).unwrap()).unwrap().is_zero());
        }
        assert_eq!([f32::NAN, f32::INFINITY].map(ExactSum::of), [None, None]);
    }

    #[test]
    fn it_is_rounded_once_and_to_even() {
        // 2⁵³ + 1 is half way; whatever lies below, however far, decides.
        let sum = |terms: &[f32]| {
            let terms = terms.iter().map(|term| ExactSum::of(*term).unwrap());
            terms.fold(ExactSum::ZERO, |sum, term| sum.checked_add(term).unwrap()).to_f64()
        };
        let (big, tiny) = (2.0_f32.powi(53), f32::from_bits(1));
        let even = f64::from(big);
        assert_eq!(sum(&[big, 1.0]), even);
        assert_eq!(sum(&[big, 1.0, tiny]), even + 2.0);
        assert_eq!(sum(&[-big, -1.0, -tiny]), -even - 2.0);
        assert_eq!(sum(&[big, 1.0, -tiny]), even);
        assert_eq!(sum(&[big, 1.0, 1.0, 1.0]), even + 4.0);
        assert_eq!(sum(&[f32::MAX, f32::MAX]), 2.0 * f64::from(f32::MAX));
    }

    #[test]
    fn what_has_no_room_is_said() {
        let half = ExactSum::shifted(1, 318);
        assert_eq!(half.checked_add(half), None);
        let negative = half.negated();
        let least = negative.checked_add(negative).unwrap();
        assert_eq!(least.checked_add(negative), None);
        assert_eq!(least.to_f64(), -power_of_two(319 - 149));
        assert_eq!(least.in_units(300, 96), Some(-(1 << 19)));
        assert_eq!(ExactSum::shifted(1 << 95, 7).in_units(7, 96), None);
        assert_eq!(ExactSum::shifted((1 << 95) - 1, 7).in_units(7, 96), Some((1 << 95) - 1));
    }
}
