//! Independent random numbers.

use rand_philox::philox4x32_10;

use super::{Block, Sampler, Stream};

/// Independent uniform numbers from the counter-based generator Philox4x32-10
/// (Salmon et al. 2011, *Parallel Random Numbers: As Easy as 1, 2, 3*).
#[derive(Clone, Debug)]
pub struct Independent {
    key: [u32; 2],
    counter: [u32; 4],
    block: [u32; 4],
    used: usize,
}

impl Sampler for Independent {
    #[inline]
    fn new(seed: u64, pixel: u32, sample: u32, stream: Stream) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            counter: [0, stream as u32, pixel, sample],
            block: [0; 4],
            used: 4,
        }
    }

    /// Nothing: one dimension is as good as another, and none is taken twice.
    #[inline]
    fn start(&mut self, _: Block) {}

    #[inline]
    fn next_word(&mut self) -> u32 {
        if self.used == 4 {
            self.block = philox4x32_10(self.counter, self.key);
            self.counter[0] += 1;
            self.used = 0;
        }
        let word = self.block[self.used];
        self.used += 1;
        word
    }

    /// Two words.
    #[inline]
    fn next_choice_words(&mut self) -> [u32; 2] {
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
