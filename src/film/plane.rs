//! One image of exact sums.

use std::{
    iter,
    sync::atomic::{AtomicI64, AtomicU64, Ordering::Relaxed},
};

use super::{
    ExactSum,
    fixed::{FINE_BITS, FixedPoint, LARGEST_SHIFT},
    sparse::Sparse,
    sum::integer,
};

/// The exact sums of an image's pixels. A half image is one, and so can a layer's be.
///
/// A sum is spread over three places, each a sum of its own of certain deposits, and is what these add up to:
///
/// * its *word*, 64 bits in quanta ([`FixedPoint`]): deposits that are multiples of the quantum, below 2⁶² of it;
/// * its *fine word*, 64 bits in units of 2⁻³² quanta: smaller deposits that are multiples of that unit, and no more
///   than 2⁵⁶ of it;
/// * its *wide sum*, an [`ExactSum`]: all others.
///
/// A word that leaves its range wraps around, and the next wider place gets the 2⁶⁴ that it lost. All of this is
/// addition of integers, so neither order nor threads can be seen in what the sums come to.
pub(super) struct Plane {
    scale: FixedPoint,
    words: Box<[[AtomicI64; 3]]>,
    fine: Sparse<[AtomicI64; 3], FINE_PAGE>,
    wide: Sparse<[Wide; 3], WIDE_PAGE>,
}

/// What word and fine word hold together, with its sign.
pub(super) const UNIT_BITS: u32 = 64 + FINE_BITS;

const FINE_PAGE: usize = 64;
const WIDE_PAGE: usize = 8;

/// An [`ExactSum`] that threads add to.
type Wide = [AtomicU64; ExactSum::WORDS];

/// A sum went beyond what an [`ExactSum`] holds, and is wrong from now on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Overflow;

impl Plane {
    pub(super) fn new(scale: FixedPoint, pixels: usize) -> Self {
        let words = iter::repeat_with(<[AtomicI64; 3]>::default).take(pixels).collect();
        Self { scale, words, fine: Sparse::new(pixels), wide: Sparse::new(pixels) }
    }

    /// What it takes for so many pixels, all of which have fine words and none wide sums, in bytes.
    pub(super) fn expected_memory(pixels: u64) -> u64 {
        let words = 2 * size_of::<[AtomicI64; 3]>() as u64 * pixels;
        let pages = Sparse::<[AtomicI64; 3], FINE_PAGE>::empty_memory(pixels);
        words + pages + Sparse::<[Wide; 3], WIDE_PAGE>::empty_memory(pixels)
    }

    /// The most that one wide sum takes, in bytes: nothing else is on its page.
    pub(super) const WIDEST: u64 = Sparse::<[Wide; 3], WIDE_PAGE>::BYTES_PER_PAGE;

    /// What it takes now, in bytes, and how much of that are wide sums.
    pub(super) fn memory(&self) -> (u64, u64) {
        let pixels = self.len() as u64;
        let fine = self.fine.pages_memory() + Sparse::<[AtomicI64; 3], FINE_PAGE>::empty_memory(pixels);
        let wide = self.wide.pages_memory();
        let words = size_of::<[AtomicI64; 3]>() as u64 * pixels;
        (words + fine + wide + Sparse::<[Wide; 3], WIDE_PAGE>::empty_memory(pixels), wide)
    }

    pub(super) fn scale(&self) -> FixedPoint {
        self.scale
    }

    /// Adds finite values. Returns how many channels have no room for theirs.
    #[inline(always)]
    #[must_use]
    pub(super) fn add(&self, pixel: usize, values: [f32; 3]) -> u64 {
        let words = &self.words[pixel];
        let mut overflows = 0;
        for (channel, value) in values.into_iter().enumerate() {
            if let Some(quanta) = self.quanta(value) {
                if words[channel].fetch_add(quanta, Relaxed).checked_add(quanta).is_none() {
                    overflows += u64::from(self.carry(pixel, channel, quanta).is_err());
                }
            } else if value != 0.0 {
                overflows += u64::from(self.add_elsewhere(pixel, channel, value).is_err());
            }
        }
        overflows
    }

    /// A value in quanta, if it is a multiple of the quantum that a word can take; `None` for zero, which needs none.
    #[inline(always)]
    pub(super) fn quanta(&self, value: f32) -> Option<i64> {
        let bits = value.to_bits();
        // Of numbers that are too small, zero among them, it is beyond all bounds.
        let shift = (bits >> 23 & 0xff).wrapping_sub(self.scale.lowest());
        if shift > LARGEST_SHIFT {
            return None;
        }
        let quanta = i64::from(bits & 0x7f_ffff | 0x80_0000) << shift;
        Some(if value.is_sign_negative() { -quanta } else { quanta })
    }

    /// The words of a pixel.
    #[inline(always)]
    pub(super) fn words_of(&self, pixel: usize) -> &impl Sized {
        &self.words[pixel]
    }

    /// Adds so many quanta. Returns how many channels have no room for theirs.
    #[must_use]
    pub(super) fn add_quanta(&self, pixel: usize, quanta: [i64; 3]) -> u64 {
        let add = |(channel, quanta)| u64::from(self.add_word(pixel, channel, quanta).is_err());
        quanta.into_iter().enumerate().map(add).sum()
    }

    /// Adds what a word cannot take.
    #[inline(never)]
    fn add_elsewhere(&self, pixel: usize, channel: usize, value: f32) -> Result<(), Overflow> {
        let (mantissa, place) = integer(value);
        match place.checked_sub(self.scale.fine_bit()) {
            Some(shift) if shift < FINE_BITS => self.add_fine(pixel, channel, i64::from(mantissa) << shift),
            _ => self.add_wide(pixel, channel, mantissa.into(), place),
        }
    }

    fn add_word(&self, pixel: usize, channel: usize, quanta: i64) -> Result<(), Overflow> {
        match self.words[pixel][channel].fetch_add(quanta, Relaxed).checked_add(quanta) {
            Some(_) => Ok(()),
            None => self.carry(pixel, channel, quanta),
        }
    }

    fn add_fine(&self, pixel: usize, channel: usize, units: i64) -> Result<(), Overflow> {
        match self.fine.get_or_make(pixel)[channel].fetch_add(units, Relaxed).checked_add(units) {
            Some(_) => Ok(()),
            None => self.add_word(pixel, channel, units.signum() << (64 - FINE_BITS)),
        }
    }

    /// Gives the wide sum what a word lost when it wrapped around in adding `quanta`.
    #[cold]
    #[inline(never)]
    fn carry(&self, pixel: usize, channel: usize, quanta: i64) -> Result<(), Overflow> {
        self.add_wide(pixel, channel, quanta.signum(), 64 + self.scale.bit())
    }

    /// Adds `value`·2^`place` units of [`ExactSum`] to the wide sum, |`value`| being below 2²⁴.
    fn add_wide(&self, pixel: usize, channel: usize, value: i64, place: u32) -> Result<(), Overflow> {
        self.add_words(pixel, channel, ExactSum::shifted(value.into(), place))
    }

    fn add_words(&self, pixel: usize, channel: usize, sum: ExactSum) -> Result<(), Overflow> {
        let wide = &self.wide.get_or_make(pixel)[channel];
        let words = sum.words();
        let last = ExactSum::WORDS - 1;
        for (i, word) in words[..last].iter().enumerate().filter(|(_, word)| **word != 0) {
            if wide[i].fetch_add(*word, Relaxed).checked_add(*word).is_none() {
                Self::carry_on(wide, i + 1)?;
            }
        }
        Self::add_last(wide, words[last] as i64)
    }

    /// Adds one to the words from `first` on.
    fn carry_on(wide: &Wide, first: usize) -> Result<(), Overflow> {
        let last = ExactSum::WORDS - 1;
        for word in &wide[first..last] {
            if word.fetch_add(1, Relaxed) != u64::MAX {
                return Ok(());
            }
        }
        Self::add_last(wide, 1)
    }

    /// Adds to the word that has the sign.
    fn add_last(wide: &Wide, word: i64) -> Result<(), Overflow> {
        let old = wide[ExactSum::WORDS - 1].fetch_add(word as u64, Relaxed) as i64;
        old.checked_add(word).map(|_| ()).ok_or(Overflow)
    }

    /// Adds a sum that was made elsewhere.
    pub(super) fn add_sum(&self, pixel: usize, channel: usize, sum: ExactSum) -> Result<(), Overflow> {
        match sum.in_units(self.scale.fine_bit(), UNIT_BITS) {
            Some(fine) => self.add_fine_units(pixel, channel, fine),
            None => self.add_words(pixel, channel, sum),
        }
    }

    /// Adds so many units of fine words of `scale`, less than 2⁹⁵.
    #[inline]
    pub(super) fn add_units(
        &self,
        pixel: usize,
        channel: usize,
        units: i128,
        scale: FixedPoint,
    ) -> Result<(), Overflow> {
        if scale == self.scale {
            self.add_fine_units(pixel, channel, units)
        } else {
            self.add_sum(pixel, channel, ExactSum::shifted(units, scale.fine_bit()))
        }
    }

    #[inline]
    fn add_fine_units(&self, pixel: usize, channel: usize, fine: i128) -> Result<(), Overflow> {
        let (quanta, rest) = ((fine >> FINE_BITS) as i64, (fine & ((1 << FINE_BITS) - 1)) as i64);
        if rest != 0 {
            self.add_fine(pixel, channel, rest)?;
        }
        if quanta != 0 { self.add_word(pixel, channel, quanta) } else { Ok(()) }
    }

    /// What word and fine word hold.
    #[inline]
    fn words(&self, pixel: usize, channel: usize) -> (i64, i64) {
        let fine = self.fine.get(pixel).map_or(0, |fine| fine[channel].load(Relaxed));
        (self.words[pixel][channel].load(Relaxed), fine)
    }

    /// The sum of a pixel.
    pub(super) fn sum(&self, pixel: usize, channel: usize) -> ExactSum {
        let (word, fine) = self.words(pixel, channel);
        let units = (i128::from(word) << FINE_BITS) + i128::from(fine);
        let words = ExactSum::shifted(units, self.scale.fine_bit());
        let Some(wide) = self.wide.get(pixel) else { return words };
        let wide = ExactSum::from_words(std::array::from_fn(|i| wide[channel][i].load(Relaxed)));
        // Words without room for them in a wide sum that is full to the brim: it has been counted as an overflow, or
        // nearly was.
        words.checked_add(wide).unwrap_or(wide)
    }

    /// The same in units of fine words of `scale`, if it is less than 2⁹⁵ of them and they make it up exactly.
    #[inline]
    pub(super) fn units(&self, pixel: usize, channel: usize, scale: FixedPoint) -> Option<i128> {
        if scale == self.scale && self.wide.get(pixel).is_none() {
            let (word, fine) = self.words(pixel, channel);
            let units = (i128::from(word) << FINE_BITS) + i128::from(fine);
            return (units.unsigned_abs() >> (UNIT_BITS - 1) == 0).then_some(units);
        }
        self.sum(pixel, channel).in_units(scale.fine_bit(), UNIT_BITS)
    }

    /// The same of all channels, rounded once.
    #[inline]
    pub(super) fn value(&self, pixel: usize) -> [f64; 3] {
        if self.wide.get(pixel).is_some() {
            return [0, 1, 2].map(|channel| self.sum(pixel, channel).to_f64());
        }
        [0, 1, 2].map(|channel| {
            let (word, fine) = self.words(pixel, channel);
            self.rounded(word.into(), fine.into())
        })
    }

    /// The sums of this pixel and that of another plane with the same quantum, rounded once.
    #[inline]
    pub(super) fn value_with(&self, other: &Self, pixel: usize) -> [f64; 3] {
        debug_assert_eq!(self.scale, other.scale);
        let planes = [self, other];
        if planes.iter().any(|plane| plane.wide.get(pixel).is_some()) {
            return [0, 1, 2].map(|channel| {
                let [a, b] = planes.map(|plane| plane.sum(pixel, channel));
                // Only sums that no render makes have no room together.
                a.checked_add(b).map_or_else(|| a.to_f64() + b.to_f64(), ExactSum::to_f64)
            });
        }
        [0, 1, 2].map(|channel| {
            let [a, b] = planes.map(|plane| plane.words(pixel, channel));
            self.rounded(i128::from(a.0) + i128::from(b.0), i128::from(a.1) + i128::from(b.1))
        })
    }

    /// So many quanta and fine units, rounded once.
    #[inline]
    fn rounded(&self, quanta: i128, fine: i128) -> f64 {
        match i64::try_from(quanta) {
            // The usual case takes one instruction.
            Ok(quanta) if fine == 0 => quanta as f64 * self.scale.unit(),
            _ => ((quanta << FINE_BITS) + fine) as f64 * self.scale.fine_unit(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.words.len()
    }
}

#[cfg(test)]
mod tests;
