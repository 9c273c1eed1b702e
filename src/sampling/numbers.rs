//! Sequences that a wave takes up again at each vertex.

use super::{Block, Independent, Sampler, SamplerKind, Sobol, Stream};
use crate::lanes::{Lanes, Unsigned};

/// One of the samplers, chosen when the program runs.
#[derive(Clone, Debug)]
pub enum Numbers<L: Lanes> {
    /// See [`Sobol`].
    Sobol(Sobol<L>),
    /// See [`Independent`].
    Independent(Independent<L>),
}

/// What a sequence is made of again: the two words that a wave keeps of it in each lane.
pub type Kept<L> = [<L as Lanes>::U; 2];

impl<L: Lanes> Numbers<L> {
    /// The words to keep of a sample of a pixel.
    #[inline(always)]
    pub fn keep(kind: SamplerKind, seed: u64, pixel: L::U, sample: u32, stream: Stream) -> Kept<L> {
        let sample = pixel.lanes().splat_u(sample);
        match kind {
            SamplerKind::Sobol => <Sobol<L> as Sampler<L>>::new(seed, pixel, sample, stream).place(),
            SamplerKind::Independent => [pixel, sample],
        }
    }

    /// The sequence again, after `taken` words.
    #[inline(always)]
    pub fn again(kind: SamplerKind, seed: u64, kept: Kept<L>, stream: Stream, taken: u32) -> Self {
        match kind {
            SamplerKind::Sobol => Self::Sobol(Sobol::at(kept[0], kept[1])),
            SamplerKind::Independent => Self::Independent(Independent::after(seed, kept, stream, taken)),
        }
    }

    /// How many words a place on a light, a direction and a choice among lights take.
    pub fn words_of_emission(kind: SamplerKind) -> u32 {
        match kind {
            SamplerKind::Sobol => 5,
            SamplerKind::Independent => 6,
        }
    }
}

impl<L: Lanes> Sampler<L> for Numbers<L> {
    /// Sobol's; [`Numbers::again`] makes either.
    #[inline(always)]
    fn new(seed: u64, pixel: L::U, sample: L::U, stream: Stream) -> Self {
        Self::Sobol(Sampler::new(seed, pixel, sample, stream))
    }

    #[inline(always)]
    fn start(&mut self, block: Block) {
        match self {
            Self::Sobol(numbers) => numbers.start(block),
            Self::Independent(numbers) => numbers.start(block),
        }
    }

    #[inline(always)]
    fn next_word(&mut self) -> L::U {
        match self {
            Self::Sobol(numbers) => numbers.next_word(),
            Self::Independent(numbers) => numbers.next_word(),
        }
    }

    #[inline(always)]
    fn next_choice_words(&mut self) -> [L::U; 2] {
        match self {
            Self::Sobol(numbers) => numbers.next_choice_words(),
            Self::Independent(numbers) => numbers.next_choice_words(),
        }
    }
}
