//! Evenly distributed random numbers.

use std::{array, sync::LazyLock};

use sobol_burley::{NUM_DIMENSION_SETS_4D, parts::sobol_rev};

use super::{
    Block, Sampler, Stream,
    hashes::{hash, owen_scramble_rev, philox4x32_10},
    sampler::Spread,
};
use crate::lanes::{Lanes, One, Unsigned};

/// Owen-scrambled Sobol sequences (Burley 2020, *Practical Hash-based Owen Scrambling*): over the samples of a pixel,
/// the numbers of a block fill its four dimensions evenly, and each is uniformly distributed by itself.
///
/// Sample 2k + b is point k of the sequence with the scramble b, so that each of the two half images has a whole
/// sequence, and an independent one. Each (seed, pixel, stream) has scrambles of its own as well: errors do not repeat
/// from pixel to pixel, and renders with different seeds are independent.
#[derive(Clone, Debug)]
pub struct Sobol<L: Lanes = One> {
    /// Of this (seed, pixel, half, stream).
    scramble: L::U,
    index: L::U,
    /// The index, its bits reversed.
    reversed: L::U,
    /// All lanes are at the same block, and at the same number of it.
    block: Block,
    /// How often the block has run out of dimensions.
    overrun: u32,
    words: [L::U; 4],
    used: usize,
}

/// log₂ of the points that a sequence has; after them comes another with a new scramble.
const LENGTH: u32 = 16;

impl Sobol {
    /// [`Sampler::new`] in one lane, where nothing else says how many there are.
    #[inline]
    pub fn new(seed: u64, pixel: u32, sample: u32, stream: Stream) -> Self {
        Sampler::new(seed, pixel, sample, stream)
    }
}

impl<L: Lanes> Sampler<L> for Sobol<L> {
    #[inline(always)]
    fn new(seed: u64, pixel: L::U, sample: L::U, stream: Stream) -> Self {
        let [camera, light, connection, lens] = Self::streams(seed, pixel, sample);
        match stream {
            Stream::Camera => camera,
            Stream::Light => light,
            Stream::Connection => connection,
            Stream::Lens => lens,
        }
    }

    #[inline(always)]
    fn streams(seed: u64, pixel: L::U, sample: L::U) -> [Self; 4] {
        let constant = |c| pixel.lanes().splat_u(c);
        let (k, half) = (sample >> 1, sample & constant(1));
        // The first counter word keeps these apart from the numbers of the independent sampler.
        let place = [constant(u32::MAX), constant(0), pixel, (k >> LENGTH) << 1 | half];
        let index = k & constant((1 << LENGTH) - 1);
        let [a, b, c, d] = philox4x32_10(place, [seed as u32, (seed >> 32) as u32]);
        [Self::at(a, index), Self::at(b, index), Self::at(c, index), Self::at(d, index)]
    }

    #[inline(always)]
    fn start(&mut self, block: Block) {
        self.block = block;
        self.overrun = 0;
        self.words = self.four();
        self.used = 0;
    }

    #[inline(always)]
    fn next_word(&mut self) -> L::U {
        if self.used == 4 {
            if L::N == 1 { self.go_on_alone() } else { self.go_on() }
        }
        let word = self.words[self.used];
        self.used += 1;
        word
    }

    /// The dimension's word, which keeps the choices of a pixel's samples even, and a hash below it.
    #[inline(always)]
    fn next_choice_words(&mut self) -> [L::U; 2] {
        let word = self.next_word();
        let step = word.lanes().splat_u(0x9e37_79b9);
        [word, hash(word ^ hash(self.scramble ^ self.index.wrapping_mul(step)))]
    }
}

impl<L: Lanes> Sobol<L> {
    /// At this point of the sequence with this scramble.
    #[inline(always)]
    pub fn at(scramble: L::U, index: L::U) -> Self {
        Self {
            scramble,
            index,
            reversed: index.reverse_bits(),
            block: Block::START,
            overrun: 0,
            words: [index.lanes().splat_u(0); 4],
            used: 4,
        }
    }

    /// What [`Self::at`] makes it again of.
    #[inline(always)]
    pub fn place(&self) -> [L::U; 2] {
        [self.scramble, self.index]
    }

    /// Takes four more numbers than the block has.
    #[inline(always)]
    fn go_on(&mut self) {
        self.overrun += 1;
        self.words = self.four();
        self.used = 0;
    }

    /// [`Self::go_on`] where it need not be compiled for any lanes.
    #[cold]
    #[inline(never)]
    fn go_on_alone(&mut self) {
        self.go_on();
    }

    /// The next four numbers: of the block's own dimensions the first time, of a sequence with a new scramble after
    /// that.
    #[inline(always)]
    fn four(&self) -> [L::U; 4] {
        let Block { number, spread } = self.block;
        let (set, pad) = match spread {
            Spread::Joint => (number % NUM_DIMENSION_SETS_4D, (number / NUM_DIMENSION_SETS_4D, 0)),
            Spread::Padded(pad) => (0, (number, pad)),
        };
        // Odd multipliers keep the pads of one scramble apart; what comes out is hashed before it is used.
        let pads = (pad.0.wrapping_mul(0x9e37_79b9))
            .wrapping_add(pad.1.wrapping_mul(0x85eb_ca6b))
            .wrapping_add(self.overrun.wrapping_mul(0xc2b2_ae35));
        sample_4d(self.reversed, set, self.scramble.wrapping_add(self.scramble.lanes().splat_u(pads)))
    }
}

/// [`sobol_burley::sample_4d`] before it becomes floats, which takes twice as many instructions: it adds the points'
/// bits one by one, and multiplies as the first processors with 64 bits could. This takes the index with its bits
/// reversed, adds four bits at once, and is compiled for the processor's own instructions.
#[inline(always)]
fn sample_4d<U: Unsigned>(reversed: U, set: u32, seed: U) -> [U; 4] {
    let constant = |c| seed.lanes().splat_u(c);
    let shuffled = owen_scramble_rev(reversed, hash(seed ^ constant(0x79c6_8e4a)));
    let salt = constant(set) ^ seed.wrapping_mul(constant(0x9c8f_2d3b));
    // A loop, because closures of the standard library's arrays are not compiled for the processor's own instructions.
    let mut words = point(set, shuffled);
    for (word, own) in words.iter_mut().zip([0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8]) {
        *word = owen_scramble_rev(*word, hash(salt ^ constant(own))).reverse_bits();
    }
    words
}

/// The point of the index with these (reversed) bits in the four dimensions of a set, its bits reversed.
#[inline(always)]
fn point<U: Unsigned>(set: u32, index: U) -> [U; 4] {
    let mut point = [index; 4];
    if U::Lanes::N == 1 {
        let mut bits = [0];
        index.store(&mut bits);
        let [a, b, c, d] = &POINTS[set as usize];
        let bits = |from: u32| (bits[0] >> from) as usize % 16;
        // References: copies of the arrays would go through memory.
        let (a, b, c, d) = (&a[bits(28)], &b[bits(24)], &c[bits(20)], &d[bits(16)]);
        for i in 0..4 {
            point[i] = index.lanes().splat_u(a[i] ^ b[i] ^ c[i] ^ d[i]);
        }
    } else {
        let [a, b, c, d] = &TABLES[set as usize];
        let (first, second, third, last) = (index >> 28, index >> 24, index >> 20, index >> 16);
        for i in 0..4 {
            point[i] = first.lookup(&a[i]) ^ second.lookup(&b[i]) ^ third.lookup(&c[i]) ^ last.lookup(&d[i]);
        }
    }
    point
}

/// For each four of the index's sixteen (reversed) bits, what these add to the point in four dimensions.
type PointsOfBits = [[[u32; 4]; 16]; 4];

/// Of every set of four dimensions; 64 KiB.
static POINTS: LazyLock<Box<[PointsOfBits]>> = LazyLock::new(|| {
    let point = |set: u32, bits: u32| array::from_fn(|i| sobol_rev(bits, 4 * set + i as u32));
    let of_set = |set| array::from_fn(|four| array::from_fn(|bits| point(set, (bits as u32) << (28 - 4 * four))));
    (0..NUM_DIMENSION_SETS_4D).map(of_set).collect()
});

/// The same with a table for each dimension, as [`Unsigned::lookup`] takes them.
type TablesOfBits = [[[u32; 16]; 4]; 4];

/// Of every set of four dimensions; 64 KiB. One lane would have to read sixteen numbers from as many places of these,
/// and a block would take it a third longer.
static TABLES: LazyLock<Box<[TablesOfBits]>> = LazyLock::new(|| {
    let of_dimensions = |points: &[[u32; 4]; 16]| array::from_fn(|i| points.map(|point| point[i]));
    POINTS.iter().map(|of_set| of_set.each_ref().map(of_dimensions)).collect()
});

#[cfg(test)]
mod tests {
    use sobol_burley::parts::u32_to_f32_norm;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    use super::*;
    use crate::{
        lanes::{Arrays, Float, Mask},
        sampling::Chance,
    };

    /// The first dimensions of `blocks`, of sample `sample`.
    fn take(pixel: u32, sample: u32, stream: Stream, blocks: &[Block]) -> Vec<f32> {
        let mut s = Sobol::new(7, pixel, sample, stream);
        let four = |s: &mut Sobol, block| {
            s.start(block);
            [(); 4].map(|()| s.next_1d())
        };
        blocks.iter().flat_map(|block| four(&mut s, *block)).collect()
    }

    const BLOCKS: [Block; 5] =
        [Block::START, Block::scattering(1), Block::scattering(70), Block::passing(1), Block::repeated(1, 1)];

    #[test]
    fn a_number_is_a_pure_function_of_its_place() {
        let base = take(3, 5, Stream::Camera, &BLOCKS);
        assert_eq!(base, take(3, 5, Stream::Camera, &BLOCKS));
        let others = [
            take(4, 5, Stream::Camera, &BLOCKS),
            take(3, 4, Stream::Camera, &BLOCKS),
            take(3, 5, Stream::Light, &BLOCKS),
        ];
        assert!(others.iter().all(|other| other.iter().zip(&base).all(|(a, b)| a != b)));
        // A block does not depend on what was taken before it.
        assert_eq!(take(3, 5, Stream::Camera, &BLOCKS[1..2]), base[4..8]);
        // Beyond the points of a sequence comes another.
        assert_ne!(take(3, 5 + (2 << LENGTH), Stream::Camera, &BLOCKS), base);
    }

    #[test]
    fn points_are_those_of_the_library() {
        for (i, seed) in [0, 1, 0x9e37_79b9, u32::MAX, 12_345].into_iter().enumerate() {
            for index in (i as u32..1 << LENGTH).step_by(97) {
                let set = index % NUM_DIMENSION_SETS_4D;
                let words = sample_4d(index.reverse_bits(), set, seed);
                assert_eq!(words.map(u32_to_f32_norm), sobol_burley::sample_4d(index, set, seed));
            }
        }
    }

    /// Blocks of every kind, with low and high numbers.
    const KINDS: [Block; 14] = [
        Block::START,
        Block::scattering(1),
        Block::scattering(70),
        Block::scattering(40_000),
        Block::scattering(2).of_branch(0),
        Block::scattering(2).of_branch(3),
        Block::passing(1),
        Block::passing(511),
        Block::passing(2).of_branch(5),
        Block::connection(2, 3, 0),
        Block::connection(500, 17, 9),
        Block::chosen_end(3, 12),
        Block::repeated(1, 0),
        Block::repeated(1, 1),
    ];

    /// Holds two words of each lane to what the sampler of that lane takes alone.
    fn same<U: Unsigned>(alone: &mut [Sobol], ours: [U; 2], theirs: impl Fn(&mut Sobol) -> [u32; 2]) {
        let mut words = [[0; 32]; 2];
        ours[0].store(&mut words[0]);
        ours[1].store(&mut words[1]);
        for (k, alone) in alone.iter_mut().enumerate() {
            assert_eq!([words[0][k], words[1][k]], theirs(alone), "lane {k}");
        }
    }

    /// What every lane takes is what a sampler alone takes, to the bit.
    fn lanes_agree<L: Lanes>(lanes: L) {
        let bits = |x: [L::F; 2]| x.map(|x| lanes.whole_numbers(|k| x.lane(k as u32).to_bits()));
        for i in 0..200_u32 {
            let stream = Stream::ALL[i as usize % 4];
            let seed = u64::from(hash(i)) << 32 | u64::from(hash(!i));
            // Neighbours and others, of the first sequence and of further ones.
            let pixel = |k: usize| if i % 3 == 0 { k as u32 } else { hash(hash(i) ^ k as u32) };
            let sample = |k: usize| hash(pixel(k) ^ 77) >> [0, 14, 28][(k + i as usize) % 3];
            let [pixels, samples] = [lanes.whole_numbers(pixel), lanes.whole_numbers(sample)];
            let mut all = <Sobol<L> as Sampler<L>>::new(seed, pixels, samples, stream);
            let mut alone: Vec<_> = (0..L::N).map(|k| Sobol::new(seed, pixel(k), sample(k), stream)).collect();
            for block in KINDS.into_iter().chain([Block::joint(i)]) {
                all.start(block);
                alone.iter_mut().for_each(|alone| alone.start(block));
                // Three times as many as there are.
                same(&mut alone, [all.next_word(); 2], |alone| [alone.next_word(); 2]);
                same(&mut alone, bits([all.next_1d(); 2]), |alone| [alone.next_1d().to_bits(); 2]);
                same(&mut alone, all.next_choice_words(), |alone| {
                    let choice = alone.next_choice().bits();
                    [(choice >> 32) as u32, choice as u32]
                });
                same(&mut alone, all.next_square().0, |alone| alone.next_square().0);
                let place = all.next_square().coordinates();
                same(&mut alone, bits(place), |alone| alone.next_square().place().to_array().map(f32::to_bits));
                same(&mut alone, bits(all.next_two()), |alone| alone.next_2d().to_array().map(f32::to_bits));
                let [x, y, z] = all.next_three();
                same(&mut alone, bits([x, y]), |alone| alone.clone().next_2d().to_array().map(f32::to_bits));
                same(&mut alone, bits([z; 2]), |alone| [alone.next_3d().z.to_bits(); 2]);
            }
        }
    }

    /// The same of chances, which probabilities close to their number decide.
    fn chances_agree<L: Lanes>(lanes: L) {
        let given = |k: u32| [0, 1, u32::MAX, 1 << 31, hash(k), hash(k) >> 20][k as usize % 6];
        for i in 0..1000 {
            let number = |k: usize| given(hash(i + 1000 * k as u32));
            let probability = |k: usize| {
                let p = (f64::from(number(k)) / (1_u64 << 32) as f64) as f32;
                [p, p.next_up(), p.next_down().max(0.0), 0.0, 1.0][(i as usize + k) % 5]
            };
            let falls = Chance(lanes.whole_numbers(number)).falls_below(lanes.numbers(probability));
            for k in 0..L::N {
                let exact = f64::from(number(k)) < f64::from(probability(k)) * 4_294_967_296.0;
                assert_eq!(falls.bits() >> k & 1 == 1, exact, "{} below {}", number(k), probability(k));
                assert_eq!(Chance(number(k)).falls_below(probability(k)), exact);
            }
        }
    }

    #[test]
    fn each_lane_has_the_numbers_of_a_sampler_alone() {
        fn agree<L: Lanes>(lanes: L) {
            lanes_agree(lanes);
            chances_agree(lanes);
        }
        agree(One);
        agree(Arrays::<1>);
        agree(Arrays::<8>);
        agree(Arrays::<16>);
        // Where there are none, the tests of lanes say so.
        #[cfg(target_arch = "x86_64")]
        if let Some(eight) = crate::lanes::Eight::detect() {
            agree(eight);
        }
        #[cfg(target_arch = "x86_64")]
        if let Some(sixteen) = crate::lanes::Sixteen::detect() {
            agree(sixteen);
        }
    }

    #[test]
    fn each_half_fills_every_dimension_and_the_pairs_of_a_block_evenly() {
        let n = 256_u32;
        for half in 0..2 {
            let points: Vec<_> = (0..n).map(|k| take(11, 2 * k + half, Stream::Light, &BLOCKS)).collect();
            for d in 0..points[0].len() {
                let mut strata: Vec<_> = points.iter().map(|p| (p[d] * n as f32) as u32).collect();
                strata.sort_unstable();
                assert!(strata.into_iter().eq(0..n), "dimension {d}");
            }
            // The first two dimensions are a (0,2)-sequence: every elementary interval of area 1/n has one point.
            for columns in [4, 16, 64] {
                let cell =
                    |p: &Vec<f32>| (p[0] * columns as f32) as u32 + columns * (p[1] * (n / columns) as f32) as u32;
                let mut cells: Vec<_> = points.iter().map(cell).collect();
                cells.sort_unstable();
                assert!(cells.into_iter().eq(0..n), "{columns} columns");
            }
        }
    }

    /// p-value of even counts over `cells` cells.
    fn p_of_even_counts(counts: &[u32]) -> f64 {
        let total: u32 = counts.iter().sum();
        let expected = f64::from(total) / counts.len() as f64;
        let chi2: f64 = counts.iter().map(|c| (f64::from(*c) - expected).powi(2) / expected).sum();
        1.0 - ChiSquared::new(counts.len() as f64 - 1.0).unwrap().cdf(chi2)
    }

    /// The bits of a choice below its dimension's word, across pixels and along a pixel's sequence: even, and
    /// independent of the word's own and of another choice's.
    #[test]
    fn the_lower_bits_of_choices_are_even_and_independent() {
        let choices = |pixel: u32, sample: u32| {
            let mut s = Sobol::new(7, pixel, sample, Stream::Light);
            [Block::START, Block::scattering(1)].map(|block| {
                s.start(block);
                s.next_choice().bits()
            })
        };
        let of_pixels: Vec<_> = (0..40_000).map(|i| choices((i / 256) << 16 | (i % 256), 6)).collect();
        let of_samples: Vec<_> = (0..40_000).map(|i| choices(77, 2 * i)).collect();
        let (mut smallest, mut tests) = (1.0_f64, 0);
        for points in [of_pixels, of_samples] {
            // Nibbles: of one choice the word's highest and lowest, and the lower word's highest and lowest; of the
            // other the latter.
            let nibbles = |[a, b]: &[u64; 2]| [a >> 60, a >> 32, a >> 28, *a, b >> 28, *b].map(|x| (x % 16) as usize);
            let points: Vec<_> = points.iter().map(nibbles).collect();
            // The word's own are not independent along a sequence, but even.
            for (a, b) in [(0, 2), (0, 3), (1, 2), (1, 3), (2, 3), (2, 4), (3, 5), (2, 5)] {
                let mut counts = vec![0; 256];
                for p in &points {
                    counts[p[a] * 16 + p[b]] += 1;
                }
                smallest = smallest.min(p_of_even_counts(&counts));
                tests += 1;
            }
        }
        assert!(smallest * f64::from(tests) > 1e-3, "{smallest:e} is the smallest of {tests} p-values");
    }

    /// Across pixels, one sample of each: what is correlated between streams, blocks, halves or neighbours would crowd
    /// into part of the cells of its pair of numbers.
    #[test]
    fn numbers_of_different_pixels_streams_and_halves_are_independent() {
        const SIDE: usize = 12;
        let pixels = 30_000_u32;
        let numbers = |pixel| {
            // Pixels as the renderer names them: neighbours differ in one bit or a few.
            let pixel = (pixel / 256) << 16 | (pixel % 256);
            let mut all = take(pixel, 6, Stream::Camera, &BLOCKS);
            all.extend(take(pixel, 7, Stream::Camera, &BLOCKS[..1]));
            all.extend(take(pixel, 6, Stream::Light, &BLOCKS[..1]));
            all.extend(take(pixel, 6, Stream::Connection, &BLOCKS[..1]));
            all.extend(take(pixel + 1, 6, Stream::Camera, &BLOCKS[..1]));
            all.extend(take(pixel + (1 << 16), 6, Stream::Camera, &BLOCKS[..1]));
            all
        };
        let points: Vec<_> = (0..pixels).map(numbers).collect();
        let (dimensions, mut smallest, mut tests) = (points[0].len(), 1.0_f64, 0);
        for a in 0..dimensions {
            for b in 0..=a {
                let mut counts = vec![0; if a == b { SIDE } else { SIDE * SIDE }];
                for p in &points {
                    let cell = |x: f32| (x * SIDE as f32) as usize;
                    counts[if a == b { cell(p[a]) } else { cell(p[a]) * SIDE + cell(p[b]) }] += 1;
                }
                smallest = smallest.min(p_of_even_counts(&counts));
                tests += 1;
            }
        }
        assert!(smallest * f64::from(tests) > 1e-3, "{smallest:e} is the smallest of {tests} p-values");
    }
}
