//! How many light subpaths a pixel has.

use std::{fmt, num::NonZeroU32, str::FromStr};

use crate::sampling::hash;

/// How many light subpaths go with the samples of a pixel: several with each of them, or one with one of several.
///
/// Where not every sample has one, it is a pixel's turn once in as many passes, at random: in any single pass with the
/// same probability, so that no number of passes biases an image. Neighbours take turns, and of every two turns one is
/// in a pass of either half image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightPaths {
    paths: NonZeroU32,
    /// One unless `paths` is.
    samples: NonZeroU32,
}

impl LightPaths {
    /// One with each sample.
    pub const ONE: Self = Self { paths: NonZeroU32::MIN, samples: NonZeroU32::MIN };

    /// The most of [`Self::each`] and of [`Self::one_in`] that a text asks for.
    pub const MOST: u32 = 1024;

    /// So many with each sample.
    ///
    /// # Panics
    /// If there are none.
    pub const fn each(paths: u32) -> Self {
        Self { paths: NonZeroU32::new(paths).expect("a light subpath"), ..Self::ONE }
    }

    /// One with one of so many samples.
    ///
    /// # Panics
    /// If there are none.
    pub const fn one_in(samples: u32) -> Self {
        Self { samples: NonZeroU32::new(samples).expect("a sample"), ..Self::ONE }
    }

    /// How many go with a sample in the mean.
    #[inline]
    pub fn per_sample(self) -> f32 {
        self.paths.get() as f32 / self.samples.get() as f32
    }

    /// How many go with a sample that has any.
    #[inline]
    pub fn most(self) -> u32 {
        self.paths.get()
    }

    /// Whether every sample has some.
    #[inline]
    pub fn is_with_each(self) -> bool {
        self.samples == NonZeroU32::MIN
    }

    /// How many the pixel at this place has in a pass.
    #[inline]
    pub fn of_pixel(self, [x, y]: [i32; 2], seed: u64, pass: u32) -> u32 {
        if self.is_with_each() {
            return self.most();
        }
        let samples = self.samples.get();
        let (turn, since) = (pass / samples, pass % samples);
        // The same for two turns, so that the second is in a pass of the other half image.
        let chance = hash(hash(seed as u32 ^ hash((seed >> 32) as u32)) ^ hash(turn / 2));
        let other_half = if samples.is_multiple_of(2) { turn % 2 } else { 0 };
        let place = i64::from(x) + i64::from(y) * Self::step(samples);
        let when = place + i64::from(chance) + i64::from(other_half);
        if when.rem_euclid(i64::from(samples)) == i64::from(since) { self.most() } else { 0 }
    }

    /// By how much two rows of pixels are apart: by the golden section, so that turns are even in both directions.
    fn step(samples: u32) -> i64 {
        (0.382 * f64::from(samples)).round() as i64
    }

    /// Whose random numbers the light subpaths of a pass have: those of the sample with this number, so that no point
    /// of a pixel's sequence is left out.
    #[inline]
    pub fn number(self, pass: u32) -> u32 {
        if self.is_with_each() {
            return pass;
        }
        (pass / self.samples) & !1 | pass & 1
    }
}

impl fmt::Display for LightPaths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_with_each() { write!(f, "{}", self.paths) } else { write!(f, "1/{}", self.samples) }
    }
}

/// A text says of no number of light subpaths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("light paths are 1 to {most} for each pixel, or 1/N with N up to {most} for one in N samples of a pixel",
    most = LightPaths::MOST)]
pub struct NoLightPaths;

impl FromStr for LightPaths {
    type Err = NoLightPaths;

    /// Takes `2`, `2.0`, `1/4` and `0.25`.
    fn from_str(text: &str) -> Result<Self, NoLightPaths> {
        let some = |text: &str| {
            let number = text.parse().ok().filter(|number| (1..=Self::MOST).contains(number));
            number.ok_or(NoLightPaths)
        };
        if let Some(samples) = text.strip_prefix("1/") {
            return Ok(Self::one_in(some(samples)?));
        }
        match text.parse::<f64>() {
            Ok(part) if part > 0.0 && part < 1.0 => {
                let samples = (1.0 / part).round();
                let is_one_in = samples <= f64::from(Self::MOST) && (samples * part - 1.0).abs() < 1e-3;
                if is_one_in { Ok(Self::one_in(samples as u32)) } else { Err(NoLightPaths) }
            }
            Ok(whole) if (1.0..=f64::from(Self::MOST)).contains(&whole) && whole.fract() == 0.0 => {
                Ok(Self::each(whole as u32))
            }
            _ => Err(NoLightPaths),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: u32 = 24;

    fn turns(paths: LightPaths, seed: u64, pass: u32) -> Vec<u32> {
        (0..PIXELS * PIXELS)
            .map(|i| paths.of_pixel([(i % PIXELS) as i32 - 3, (i / PIXELS) as i32 - 3], seed, pass))
            .collect()
    }

    #[test]
    fn every_pixel_has_its_turn_once_and_in_either_half() {
        for samples in [2, 3, 4, 5, 8, 16, 24] {
            let paths = LightPaths::one_in(samples);
            for turn in 0..6 {
                let mut sums = vec![0; (PIXELS * PIXELS) as usize];
                for pass in turn * samples..(turn + 1) * samples {
                    for (sum, has) in sums.iter_mut().zip(turns(paths, 7, pass)) {
                        *sum += has;
                    }
                }
                assert!(sums.iter().all(|sum| *sum == 1), "{paths}, turn {turn}: {sums:?}");
            }
            // Each point of both sequences once.
            let mut numbers: Vec<_> = (0..8 * samples)
                .filter(|pass| turns(paths, 7, *pass)[100] == 1)
                .map(|pass| (paths.number(pass), pass % 2))
                .collect();
            numbers.sort_unstable();
            let expected: Vec<_> = (0..8).map(|number| (number, number % 2)).collect();
            assert_eq!(numbers, expected, "{paths}");
        }
    }

    #[test]
    fn a_single_pass_is_as_likely_as_any() {
        for samples in [2, 3, 4, 8] {
            let paths = LightPaths::one_in(samples);
            for pass in [0, 1, samples, 2 * samples - 1] {
                let seeds = 4000;
                let has = (0..seeds).filter(|seed| paths.of_pixel([5, 9], seed * 0x1_0001, pass) == 1).count();
                let (mean, expected) = (has as f64 / seeds as f64, 1.0 / f64::from(samples));
                let deviation = (expected * (1.0 - expected) / seeds as f64).sqrt();
                assert!((mean - expected).abs() < 4.0 * deviation, "{paths} in pass {pass}: {mean}");
            }
        }
    }

    #[test]
    fn neighbours_take_turns() {
        for (samples, side) in [(2, 2), (4, 2), (16, 4)] {
            for pass in 0..samples {
                let of = |x, y| LightPaths::one_in(samples).of_pixel([x, y], 3, pass);
                let sum = |left, upper| -> u32 {
                    (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).map(|(x, y)| of(left + x, upper + y)).sum()
                };
                let most = (0..8).flat_map(|i| (0..8).map(move |k| (i, k))).map(|(x, y)| sum(x, y)).max();
                assert!(most <= Some(2), "1/{samples}: {most:?} of {side} × {side} pixels at once");
            }
        }
    }

    #[test]
    fn texts_are_read_as_they_are_written() {
        for (text, paths) in [
            ("1", LightPaths::ONE),
            ("3", LightPaths::each(3)),
            ("2.0", LightPaths::each(2)),
            ("1/1", LightPaths::ONE),
            ("1/4", LightPaths::one_in(4)),
            ("0.25", LightPaths::one_in(4)),
            (".333", LightPaths::one_in(3)),
        ] {
            assert_eq!(text.parse(), Ok(paths), "{text}");
            assert_eq!(paths.to_string().parse(), Ok(paths), "{text}");
        }
        for text in ["0", "", "1/0", "2/3", "0.4", "1025", "1/1025", "-1", "1.5", "nan", "0.0001"] {
            assert_eq!(text.parse::<LightPaths>(), Err(NoLightPaths), "{text}");
        }
    }
}
