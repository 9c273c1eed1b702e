//! Integers that choose: the number of integers that lead somewhere *is* its probability.

use glam::Vec2;

use crate::lanes::{Double, Float, Lanes, Unsigned};

/// A uniformly distributed integer below [`Choice::COUNT`], from which one of many is chosen.
///
/// To choose is to divide the integers among what there is to choose from. A float would do for a few alternatives of
/// like weight; among a million it leaves some without any number, and others with twice their share. Here each
/// alternative of positive probability has an integer that leads to it, its probability is how many do, and where among
/// them the number lies is a uniform number again ([`Remainder`]), with the bits that the choice has not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice(u64);

/// A number of integers as a probability.
const PER_INTEGER: f32 = 1.0 / 18_446_744_073_709_551_616.0;

impl Choice {
    /// How many integers there are: 2⁶⁴ − 1, so that a share of all of them still is a `u64`.
    pub const COUNT: u64 = u64::MAX;

    /// The integer of these bits; all ones count as the integer below.
    #[inline(always)]
    pub const fn new(bits: u64) -> Self {
        Self(if bits == u64::MAX { bits - 1 } else { bits })
    }

    /// The integer of these two words.
    #[inline(always)]
    pub const fn of_words(high: u32, low: u32) -> Self {
        Self::new((high as u64) << 32 | low as u64)
    }

    /// The integer.
    #[inline(always)]
    pub fn bits(self) -> u64 {
        self.0
    }

    /// One of 0…n−1, all alike: to within n/2⁶⁴.
    #[inline(always)]
    pub fn among(self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// The choice as a number in [0, 1), of 24 bits.
    #[inline(always)]
    pub fn unit(self) -> f32 {
        unit((self.bits() >> 32) as u32)
    }

    /// The place among all integers.
    #[inline(always)]
    pub fn whole(self) -> Remainder {
        Remainder { offset: self.bits(), width: Self::COUNT }
    }

    /// The probability of so many integers.
    #[inline(always)]
    pub fn probability(width: u64) -> f32 {
        width as f32 * PER_INTEGER
    }

    /// How many integers make up this probability, which is at least 0. More than all of them are all.
    #[inline]
    pub fn width(probability: f64) -> u64 {
        (probability * (1_u128 << 64) as f64) as u64
    }
}

/// For numbers in [0, 1) that are given rather than drawn.
impl From<f32> for Choice {
    fn from(u: f32) -> Self {
        Self::new((f64::from(u) * (1_u128 << 64) as f64) as u64)
    }
}

/// Where in a share of the choice's integers the number lies: uniform in 0…width−1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Remainder {
    offset: u64,
    width: u64,
}

impl Remainder {
    /// The place `offset` < `width`.
    #[inline(always)]
    pub const fn new(offset: u64, width: u64) -> Self {
        debug_assert!(offset < width);
        Self { offset, width }
    }

    /// The part of it before `first` integers of the share, or the part from there on: with the place in that part.
    /// `first` is at most the width.
    #[inline(always)]
    pub const fn split(self, first: u64) -> (Part, Self) {
        if self.offset < first {
            (Part::First, Self::new(self.offset, first))
        } else {
            (Part::Second, Self::new(self.offset - first, self.width - first))
        }
    }

    /// How many integers the share has.
    #[inline(always)]
    pub const fn width(self) -> u64 {
        self.width
    }

    /// The place as a choice of its own. It takes a long division, so it is for those who need more than they have.
    #[inline]
    pub fn rest(self) -> Choice {
        Choice::new(((u128::from(self.offset) << 64) / u128::from(self.width)) as u64)
    }
}

/// A part of a share that is divided in two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The lower integers.
    First,
    /// The others.
    Second,
}

/// A place in the unit square as two words: what two dimensions give, without rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Square<U = u32>(pub [U; 2]);

impl<U: Unsigned> Square<U> {
    /// Its coordinates in floats below 1.
    #[inline(always)]
    pub fn coordinates(self) -> [<U::Lanes as Lanes>::F; 2] {
        let [x, y] = self.0;
        [unit(x), unit(y)]
    }
}

impl Square {
    /// The place in floats below 1.
    #[inline(always)]
    pub fn place(self) -> Vec2 {
        self.coordinates().into()
    }

    /// Both coordinates as choices, for a place that is chosen among many: the bits below the words are those that
    /// another choice has left.
    #[inline]
    pub fn refined(self, rest: Choice) -> [Choice; 2] {
        let [x, y] = self.0;
        [Choice::of_words(x, (rest.0 >> 32) as u32), Choice::of_words(y, rest.0 as u32)]
    }
}

/// For numbers in [0, 1) that are given rather than drawn.
impl From<Vec2> for Square {
    fn from(u: Vec2) -> Self {
        Self(u.to_array().map(|u| (f64::from(u) * (1_u64 << 32) as f64) as u32))
    }
}

/// A number that decides whether something of a given probability happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chance<U = u32>(pub U);

impl<U: Unsigned> Chance<U> {
    /// Whether what has this probability happens: for an even one of 2³² numbers, to within 2⁻³². Never if it is 0, and
    /// always if it is 1.
    #[inline(always)]
    pub fn falls_below(self, probability: <U::Lanes as Lanes>::F) -> <U::Lanes as Lanes>::M {
        self.0.to_f64().lt(probability.to_f64() * (1_u64 << 32) as f64)
    }
}

/// A word as a number in [0, 1): 24 bits fill an f32 exactly and can never round up to 1.
#[inline(always)]
pub fn unit<U: Unsigned>(word: U) -> <U::Lanes as Lanes>::F {
    (word >> 8).to_f32() * (1.0 / 16_777_216.0)
}

/// Divides all integers among alternatives with these weights, and appends where the share of each begins to `begins`:
/// behind the last of positive weight at [`Choice::COUNT`].
///
/// A weight of zero has no integer, and any other at least one. The shares are right to within an integer; what
/// rounding leaves or takes is the heaviest's. Returns false, and appends the end alone, if nothing has a weight.
pub(crate) fn divide(weights: &[f64], begins: &mut Vec<u64>) -> bool {
    debug_assert!(weights.iter().all(|w| w.is_finite() && *w >= 0.0));
    let total: f64 = weights.iter().sum();
    let of = |weight: f64| if weight > 0.0 { Choice::width(weight / total).max(1) } else { 0 };
    let Some((heaviest, most)) = weights.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).filter(|m| *m.1 > 0.0)
    else {
        begins.extend(weights.iter().map(|_| Choice::COUNT));
        return false;
    };
    let others: u64 = weights.iter().enumerate().filter(|(i, _)| *i != heaviest).map(|(_, w)| of(*w)).sum();
    debug_assert!(others < Choice::COUNT, "{most} of {total}");
    let mut begin = 0;
    for (i, &weight) in weights.iter().enumerate() {
        begins.push(begin);
        begin += if i == heaviest { Choice::COUNT - others } else { of(weight) };
    }
    // Of weightless ones at the end no integer is the first.
    debug_assert_eq!(begin, Choice::COUNT);
    true
}

/// The alternative that `choice` leads to, and where in its share it lies: `begins` as [`divide`] gives them for one
/// table.
#[inline(always)]
pub(crate) fn find(begins: &[u64], choice: Choice) -> (usize, Remainder) {
    let u = choice.bits();
    let i = begins.partition_point(|begin| *begin <= u).saturating_sub(1);
    let end = begins.get(i + 1).copied().unwrap_or(Choice::COUNT);
    (i, Remainder { offset: u.wrapping_sub(begins[i]), width: end - begins[i] })
}

#[cfg(test)]
mod tests {
    use proptest::{prelude::*, proptest};

    use super::*;

    /// The first and the last integer that lead to each alternative.
    fn ends(weights: &[f64]) -> Vec<Option<(u64, u64)>> {
        let mut begins = vec![];
        divide(weights, &mut begins);
        let end = |i: usize| begins.get(i + 1).copied().unwrap_or(Choice::COUNT);
        (0..weights.len()).map(|i| (end(i) > begins[i]).then(|| (begins[i], end(i) - 1))).collect()
    }

    proptest! {
        /// Whatever the weights, each that is not zero has an integer, no other has, and their numbers are in
        /// proportion.
        #[test]
        fn shares_are_in_proportion_and_none_is_empty(
            weights in prop::collection::vec(
                prop_oneof![Just(0.0), (-300.0_f64..300.0).prop_map(|x| 10_f64.powf(x)), 1e-3..1.0_f64],
                1..40,
            ),
        ) {
            let total: f64 = weights.iter().sum();
            prop_assume!(total > 0.0);
            let mut begins = vec![];
            prop_assert!(divide(&weights, &mut begins));
            let mut next = 0;
            for (i, (ends, weight)) in ends(&weights).into_iter().zip(&weights).enumerate() {
                prop_assert_eq!(ends.is_some(), *weight > 0.0);
                let Some((first, last)) = ends else { continue };
                prop_assert_eq!(first, next);
                next = last + 1;
                let exact = weight / total * (1_u128 << 64) as f64;
                // Of the heaviest, what rounding does to all.
                let rounded = if weights.iter().all(|w| w <= weight) { 2_f64.powi(64) } else { exact };
                let off = ((last - first) as f64 + 1.0 - exact).abs();
                prop_assert!(off <= weights.len() as f64 + 1e-15 * rounded, "{}: {} for \
                    {}", i, last - first + 1, exact);
                for u in [first, last] {
                    let (found, place) = find(&begins, Choice::new(u));
                    prop_assert_eq!((found, place.width()), (i, last - first + 1));
                }
                // The ends of a share are the ends of what is left of it.
                let rest = |u| find(&begins, Choice::new(u)).1.rest().bits();
                let most_left = (u64::MAX / (last - first + 1)).saturating_add(1);
                prop_assert!(rest(first) == 0 && Choice::COUNT - rest(last) <= most_left);
            }
            prop_assert_eq!(next, Choice::COUNT);
        }

        #[test]
        fn a_split_share_is_two(offset in any::<u64>(), width in 1..=u64::MAX, first in any::<u64>()) {
            let (place, first) = (Remainder::new(offset % width, width), first % width);
            let (half, part) = place.split(first);
            prop_assert!(part.offset < part.width);
            match half {
                Part::First => prop_assert_eq!((part.offset, part.width), (place.offset, first)),
                Part::Second => prop_assert_eq!((part.offset + first, part.width + first), (place.offset, width)),
            }
        }
    }

    #[test]
    fn each_of_many_has_as_many_integers() {
        for n in [1, 3, 1000, 16_777_217, 4_000_000_007] {
            for i in [0, n / 3, n - 1] {
                // The first integer of i is ⌈i 2⁶⁴/n⌉.
                let first = ((i as u128) << 64).div_ceil(n as u128);
                let last = (((i as u128 + 1) << 64).div_ceil(n as u128) - 1).min(u128::from(Choice::COUNT - 1));
                assert_eq!((Choice::new(first as u64).among(n), Choice::new(last as u64).among(n)), (i, i), "of {n}");
                if i > 0 {
                    assert_eq!(Choice::new(first as u64 - 1).among(n), i - 1);
                }
            }
        }
    }

    #[test]
    fn chances_have_the_resolution_that_they_claim() {
        for p in [0.0, 1e-9, 2.0_f32.powi(-32), 2.0_f32.powi(-25), 0.3, 1.0_f32.next_down(), 1.0] {
            // How many of the numbers fall below: they do up to some.
            let count = (0..=32).rev().fold(0_u64, |count, bit| {
                let more = count | 1 << bit;
                if more <= 1 << 32 && Chance((more - 1) as u32).falls_below(p) { more } else { count }
            });
            let exact = f64::from(p) * 4_294_967_296.0;
            assert!((count as f64 - exact).abs() < 1.0 && (count == 0) == (p == 0.0), "{p}: {count} for {exact}");
        }
        assert_eq!(unit(u32::MAX), 1.0_f32.next_down());
        assert_eq!([unit(0), unit(1 << 8)], [0.0, 1.0 / 16_777_216.0]);
    }

    #[test]
    fn a_refined_square_has_the_bits_of_both() {
        let [x, y] = Square([0x1234_5678, 0x9abc_def0]).refined(Choice::new(0xdead_beef_0bad_f00d));
        assert_eq!([x.bits(), y.bits()], [0x1234_5678_dead_beef, 0x9abc_def0_0bad_f00d]);
        assert_eq!(Square::from(Vec2::new(0.5, 0.75)).place(), Vec2::new(0.5, 0.75));
    }
}
