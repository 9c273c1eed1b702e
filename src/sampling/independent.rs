//! Independent random numbers.

use super::{Block, Sampler, Stream, hashes::philox4x32_10};
use crate::lanes::{Lanes, One, Unsigned};

/// Independent uniform numbers from the counter-based generator Philox4x32-10
/// (Salmon et al. 2011, *Parallel Random Numbers: As Easy as 1, 2, 3*).
#[derive(Clone, Debug)]
pub struct Independent<L: Lanes = One> {
    key: [u32; 2],
    pixel: L::U,
    sample: L::U,
    stream: u32,
    /// Blocks of four words that have been made; all lanes have taken as many.
    blocks: u32,
    words: [L::U; 4],
    used: usize,
}

impl Independent {
    /// [`Sampler::new`] in one lane, where nothing else says how many there are.
    #[inline]
    pub fn new(seed: u64, pixel: u32, sample: u32, stream: Stream) -> Self {
        Sampler::new(seed, pixel, sample, stream)
    }
}

impl<L: Lanes> Independent<L> {
    /// The sequence of a sample of a pixel after `taken` words.
    #[inline(always)]
    pub fn after(seed: u64, [pixel, sample]: [L::U; 2], stream: Stream, taken: u32) -> Self {
        let mut numbers: Self = Sampler::new(seed, pixel, sample, stream);
        numbers.blocks = taken / 4;
        if !taken.is_multiple_of(4) {
            numbers.next_block();
            numbers.used = taken as usize % 4;
        }
        numbers
    }

    #[inline(always)]
    fn next_block(&mut self) {
        let constant = |word| self.pixel.lanes().splat_u(word);
        self.words = philox4x32_10([constant(self.blocks), constant(self.stream), self.pixel, self.sample], self.key);
        self.blocks += 1;
        self.used = 0;
    }
}

impl<L: Lanes> Sampler<L> for Independent<L> {
    #[inline(always)]
    fn new(seed: u64, pixel: L::U, sample: L::U, stream: Stream) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            pixel,
            sample,
            stream: stream as u32,
            blocks: 0,
            words: [pixel; 4],
            used: 4,
        }
    }

    /// Nothing: one dimension is as good as another, and none is taken twice.
    #[inline(always)]
    fn start(&mut self, _: Block) {}

    #[inline(always)]
    fn next_word(&mut self) -> L::U {
        if self.used == 4 {
            self.next_block();
        }
        let word = self.words[self.used];
        self.used += 1;
        word
    }

    /// Two words.
    #[inline(always)]
    fn next_choice_words(&mut self) -> [L::U; 2] {
        let high = self.next_word();
        [high, self.next_word()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_a_pure_function_of_its_place() {
        let take = |pixel, sample, stream| {
            let mut s = Independent::new(7, pixel, sample, stream);
            (0..9).map(|_| s.next_1d()).collect::<Vec<_>>()
        };
        let base = take(3, 5, Stream::Camera);
        assert_eq!(base, take(3, 5, Stream::Camera));
        assert_ne!(base, take(4, 5, Stream::Camera));
        assert_ne!(base, take(3, 6, Stream::Camera));
        assert_ne!(base, take(3, 5, Stream::Light));
        assert!(base.iter().all(|x| (0.0..1.0).contains(x)));
    }
}
