//! Where random numbers come from: pure functions of (seed, pixel, sample, stream, block, dimension).

use std::{fmt, str::FromStr};

use glam::{Vec2, Vec3};

use super::choice::{Chance, Choice, Square, unit};
use crate::lanes::{Lanes, One};

/// Numbers in [0, 1) for one sample of one pixel, taken dimension after dimension. In lanes, each has a sample of its
/// own, and the same numbers as if it were alone.
pub trait Sampler<L: Lanes = One>: Clone {
    /// The sequence of one sample of one pixel, before its first block. `pixel` is any number that names the pixel of
    /// the full image.
    fn new(seed: u64, pixel: L::U, sample: L::U, stream: Stream) -> Self;

    /// The sequences of all streams, in their order.
    #[inline(always)]
    fn streams(seed: u64, pixel: L::U, sample: L::U) -> [Self; 4] {
        Stream::ALL.map(|stream| Self::new(seed, pixel, sample, stream))
    }

    /// Goes to the first dimension of `block`, whatever was taken before: so a vertex has the same dimensions in every
    /// sample, however many numbers the vertices before it took. Blocks are visited in any order, each once.
    fn start(&mut self, block: Block);

    /// The next dimension, as an integer.
    fn next_word(&mut self) -> L::U;

    /// The next dimension, for choosing one of many: its word, and a word of 32 more bits below it. Each lane's are a
    /// [`Choice::of_words`].
    fn next_choice_words(&mut self) -> [L::U; 2];

    /// The next dimension, for choosing one of many.
    #[inline(always)]
    fn next_choice(&mut self) -> Choice
    where
        L: Lanes<U = u32>,
    {
        let [high, low] = self.next_choice_words();
        Choice::of_words(high, low)
    }

    /// The next dimension.
    #[inline(always)]
    fn next_1d(&mut self) -> L::F {
        unit(self.next_word())
    }

    /// The next dimension, for what happens or does not.
    #[inline(always)]
    fn next_chance(&mut self) -> Chance<L::U> {
        Chance(self.next_word())
    }

    /// The next two dimensions, for a place that may have to be chosen among many.
    #[inline(always)]
    fn next_square(&mut self) -> Square<L::U> {
        let x = self.next_word();
        Square([x, self.next_word()])
    }

    /// The next two dimensions.
    #[inline(always)]
    fn next_two(&mut self) -> [L::F; 2] {
        let x = self.next_1d();
        [x, self.next_1d()]
    }

    /// The next three dimensions.
    #[inline(always)]
    fn next_three(&mut self) -> [L::F; 3] {
        let [x, y] = self.next_two();
        [x, y, self.next_1d()]
    }

    /// The next two dimensions, as a vector.
    #[inline(always)]
    fn next_2d(&mut self) -> Vec2
    where
        L: Lanes<F = f32>,
    {
        self.next_two().into()
    }

    /// The next three dimensions, as a vector.
    #[inline(always)]
    fn next_3d(&mut self) -> Vec3
    where
        L: Lanes<F = f32>,
    {
        self.next_three().into()
    }
}

/// What a sequence of random numbers is used for. Each use has its own sequence, so that a longer camera subpath
/// does not shift the numbers of the light subpath.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// The camera subpath: raster position, lens, scattering.
    Camera,
    /// The light subpath: light, position, direction, scattering.
    Light,
    /// The connections: next-event samples and their like.
    Connection,
    /// The points of the lens to which light subpaths are connected.
    Lens,
}

impl Stream {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Camera, Self::Light, Self::Connection, Self::Lens];
}

/// Four dimensions of a stream that are used together. A block may be left early; numbers beyond its fourth are as good
/// as independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    pub(super) number: u32,
    pub(super) spread: Spread,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spread {
    /// Evenly distributed together with the stream's other blocks of this spread, the better the lower their numbers
    /// are.
    Joint,
    /// On its own.
    Padded(u32),
}

impl Block {
    /// The stream's first: where a subpath starts, on the film and the lens or on a light.
    pub const START: Self = Self::joint(0);

    /// The stream's block of this number. The lower it is, the better is its distribution together with that of others.
    pub const fn joint(number: u32) -> Self {
        Self { number, spread: Spread::Joint }
    }

    /// How a subpath leaves its vertex `i` ≥ 1, counted from its own end.
    pub const fn scattering(i: u32) -> Self {
        Self::joint(i)
    }

    /// What a walk passes on the way to its vertex `i` ≥ 1.
    pub const fn passing(i: u32) -> Self {
        Self { number: i, spread: Spread::Padded(u32::MAX) }
    }

    /// The same for the part `n` of a subpath that has split; of the first, it is the block itself.
    #[must_use]
    pub const fn of_branch(self, n: u32) -> Self {
        match self.spread {
            _ if n == 0 => self,
            Spread::Joint => Self { spread: Spread::Padded(n), ..self },
            Spread::Padded(own) => Self { spread: Spread::Padded(own - n), ..self },
        }
    }

    /// What decides on the connection of p_{t−1} with the `s`-th vertex of the `n`-th light subpath.
    pub const fn connection(s: u32, t: u32, n: u32) -> Self {
        Self { number: n << 18 | s << 9 | t, spread: Spread::Padded(1 << 31) }
    }

    /// Which light vertex of its tile p_{t−1} is connected to, the `n`-th time; and what decides on that.
    pub const fn chosen_end(t: u32, n: u32) -> Self {
        Self { number: n << 9 | t, spread: Spread::Padded(1 << 30) }
    }

    /// The wavelength.
    pub const WAVELENGTH: Self = Self { number: 0, spread: Spread::Padded(1 << 29) };

    /// The `n`-th of several samples that are taken for the same purpose.
    pub const fn repeated(number: u32, n: u32) -> Self {
        if n == 0 { Self::joint(number) } else { Self { number, spread: Spread::Padded(n) } }
    }
}

/// The samplers that a person can choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SamplerKind {
    /// [`super::Independent`].
    #[default]
    Independent,
    /// [`super::Sobol`].
    Sobol,
}

impl SamplerKind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Independent, Self::Sobol];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Sobol => "sobol",
        }
    }
}

impl fmt::Display for SamplerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A sampler's name was none of `independent` and `sobol`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a sampler is 'independent' or 'sobol'")]
pub struct UnknownSampler;

impl FromStr for SamplerKind {
    type Err = UnknownSampler;

    fn from_str(name: &str) -> Result<Self, UnknownSampler> {
        Self::ALL.into_iter().find(|s| s.name() == name).ok_or(UnknownSampler)
    }
}
