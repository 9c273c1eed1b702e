//! Lanes: one text that computes one number or sixteen at a time, and the same bits for both.
//!
//! A set of lanes is a value that exists only where the processor has its instructions, and so is every number in
//! them: whoever has one may compute with it. Nothing outside this module is `unsafe` for that, but to
//! enter a function that is compiled for the set. Every operation is
//! one exact IEEE operation a lane. Nothing is fused, approximated or reordered, so results do not depend on the set:
//! `tests.rs` compares all of them with [`Arrays`], lane by lane. [`One`] lane is plain numbers, so that a type with
//! lanes as its parameter is by default what it would be without.
//!
//! What computes in lanes has to be compiled for their instructions: from the `#[target_feature]` function down to
//! here, every function and closure is `#[inline(always)]`. (A single one that is not costs more than lanes gain.)
//!
//! `DESIGN.md` says why this is no crate.

/// Whether the processor has all of these features.
#[cfg(target_arch = "x86_64")]
macro_rules! detected {
    ($($feature:tt)*) => { ($(std::arch::is_x86_feature_detected!($feature) &&)* true) };
}

/// Operators that are one instruction, or one for each half.
#[cfg(target_arch = "x86_64")]
macro_rules! operators {
    ($t:ident: $($trait:ident $name:ident $instruction:ident)*) => { $(
        impl $trait for $t {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    )* };
    ($t:ident, in halves: $($trait:ident $name:ident $instruction:ident)*) => { $(
        impl $trait for $t {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                unsafe { Self($instruction(self.0, other.0), $instruction(self.1, other.1)) }
            }
        }
    )* };
}

/// What does work in a function that is compiled for these instructions.
#[cfg(target_arch = "x86_64")]
macro_rules! compiled {
    ($features:literal) => {
        #[target_feature(enable = $features)]
        #[inline(never)]
        fn compiled<W: Work>(work: W) -> W::Output {
            work.work()
        }
    };
}

mod arrays;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod one;
#[cfg(test)]
mod tests;
mod three;
#[cfg(target_arch = "x86_64")]
mod transpose;

use std::{
    fmt::Debug,
    ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Shl, Shr, Sub},
};

pub use arrays::Arrays;
pub use one::One;
pub use three::Three;
#[cfg(target_arch = "x86_64")]
pub use {avx2::Eight, avx512::Sixteen};

/// The instructions that hot code is compiled for: found when the program runs, so that one binary is right everywhere
/// and fast on what is common.
#[derive(Clone, Copy, Debug)]
pub enum Instructions {
    /// Those of every processor of the architecture.
    Portable,
    /// Those of [`Eight`] lanes.
    #[cfg(target_arch = "x86_64")]
    Avx2(Eight),
    /// Those of [`Sixteen`] lanes.
    #[cfg(target_arch = "x86_64")]
    Avx512(Sixteen),
}

impl Instructions {
    /// The best that this processor has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(sixteen) = Sixteen::detect() {
            return Self::Avx512(sixteen);
        } else if let Some(eight) = Eight::detect() {
            return Self::Avx2(eight);
        }
        Self::Portable
    }
}

/// The most lanes of any set.
pub const MOST: usize = 16;

/// What lanes load together, transposed: sixteen numbers, or words that look like some. A line of the cache.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Record(pub [f32; 16]);

/// Work in lanes that is a function of its own, once for each set: inlined wherever it is wanted, it would take long to
/// compile.
pub trait Work {
    /// What comes of it.
    type Output;

    /// Does it. `#[inline(always)]`, as all that is in lanes.
    fn work(self) -> Self::Output;
}

/// A set of lanes.
pub trait Lanes: Copy + Debug + Send + Sync + 'static {
    /// How many there are, at most [`MOST`].
    const N: usize;
    /// A number in each.
    type F: Float<Lanes = Self>;
    /// A number in each, of twice the precision.
    type D: Double<Lanes = Self>;
    /// A whole number in each.
    type U: Unsigned<Lanes = Self>;
    /// A condition in each.
    type M: Mask + Select<Self::F> + Select<Self::D> + Select<Self::U> + Select<Self::V>;
    /// A vector in each.
    type V: Vector<F = Self::F, Lanes = Self>;
    /// Anything in each, side by side: what no instruction computes with.
    type Each<T: Copy + Debug>: Copy + Debug;

    /// The same number in all.
    fn splat(self, x: f32) -> Self::F;
    /// The same number in all, of twice the precision.
    fn splat_d(self, x: f64) -> Self::D;
    /// The same whole number in all.
    fn splat_u(self, x: u32) -> Self::U;
    /// The first N numbers.
    ///
    /// # Panics
    /// If there are fewer.
    fn load(self, from: &[f32]) -> Self::F;
    /// The first N whole numbers.
    ///
    /// # Panics
    /// If there are fewer.
    fn load_u(self, from: &[u32]) -> Self::U;
    /// The condition that holds in those lanes whose bit is set, the first being the lowest.
    fn mask(self, bits: u32) -> Self::M;
    /// In each lane the `k`-th number, modulo eight, of one of three rows: of which one, `which` says, below 3.
    fn pick(self, of: [&[f32; 8]; 3], k: usize, which: Self::U) -> Self::F;
    /// Of each lane's record, the one at its place of `from`, all sixteen numbers.
    ///
    /// # Panics
    /// If there is none at the place of some lane.
    fn records(self, from: &[Record], at: Self::U) -> [Self::F; 16];
    /// Writes the records of the lanes `which` to their places of `to`.
    ///
    /// # Panics
    /// If there is none at the place of some lane.
    #[inline(always)]
    fn put_records(self, columns: [Self::F; 16], to: &mut [Record], at: Self::U, which: Self::M) {
        let (at, mut all) = (at.all(), [[0.0; MOST]; 16]);
        for (all, column) in all.iter_mut().zip(columns) {
            *all = column.all();
        }
        for k in which.lanes() {
            let record = &mut to[at[k] as usize].0;
            for i in 0..16 {
                record[i] = all[i][k];
            }
        }
    }
    /// Asks memory for what will be needed soon, where the set has an instruction for that.
    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
    /// What `f` makes of the number of each lane.
    fn each<T: Copy + Debug>(self, f: impl FnMut(usize) -> T) -> Self::Each<T>;
    /// What one lane has: that of the number `i` modulo N.
    fn lane<T: Copy + Debug>(each: &Self::Each<T>, i: usize) -> T;
    /// Does it in a function of its own that is compiled for these lanes.
    fn call<W: Work>(self, work: W) -> W::Output;

    /// The condition that holds in the first `n` lanes, or in all of them.
    #[inline(always)]
    fn first(self, n: usize) -> Self::M {
        self.mask(if n < 32 { (1 << n) - 1 } else { u32::MAX })
    }

    /// The same vector in all.
    #[inline(always)]
    fn splat_v(self, [x, y, z]: [f32; 3]) -> Self::V {
        Self::V::new(self.splat(x), self.splat(y), self.splat(z))
    }

    /// The number that `f` makes of that of each lane.
    #[inline(always)]
    fn numbers(self, mut f: impl FnMut(usize) -> f32) -> Self::F {
        let mut numbers = [0.0; MOST];
        for (i, x) in numbers.iter_mut().enumerate().take(Self::N) {
            *x = f(i);
        }
        self.load(&numbers)
    }

    /// The whole number that `f` makes of that of each lane.
    #[inline(always)]
    fn whole_numbers(self, mut f: impl FnMut(usize) -> u32) -> Self::U {
        let mut numbers = [0; MOST];
        for (i, x) in numbers.iter_mut().enumerate().take(Self::N) {
            *x = f(i);
        }
        self.load_u(&numbers)
    }

    /// The condition that holds where `f` says so of the number of the lane.
    #[inline(always)]
    fn condition(self, mut f: impl FnMut(usize) -> bool) -> Self::M {
        let mut bits = 0;
        for i in 0..Self::N {
            bits |= u32::from(f(i)) << i;
        }
        self.mask(bits)
    }

    /// The vector that `f` makes of the number of each lane.
    #[inline(always)]
    fn vectors(self, mut f: impl FnMut(usize) -> [f32; 3]) -> Self::V {
        let (mut x, mut y, mut z) = ([0.0; MOST], [0.0; MOST], [0.0; MOST]);
        for i in 0..Self::N {
            [x[i], y[i], z[i]] = f(i);
        }
        Self::V::new(self.load(&x), self.load(&y), self.load(&z))
    }
}

/// A number in each lane.
pub trait Float:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Mul<f32, Output = Self>
{
    /// The set.
    type Lanes: Lanes<F = Self>;

    /// The set, of which a number is the proof.
    fn lanes(self) -> Self::Lanes;
    /// Writes them to the first N places.
    ///
    /// # Panics
    /// If there are fewer.
    fn store(self, to: &mut [f32]);
    /// Writes those where the condition holds to the first places, in their order, and anything to the rest of N.
    ///
    /// # Panics
    /// If there are fewer places than lanes.
    fn compress(self, which: <Self::Lanes as Lanes>::M, to: &mut [f32]);
    /// What one lane has: that of the number `i` modulo N, the first being 0.
    fn lane(self, i: u32) -> f32;
    /// The bits of each.
    fn to_bits(self) -> <Self::Lanes as Lanes>::U;
    /// The numbers of these bits.
    fn of_bits(bits: <Self::Lanes as Lanes>::U) -> Self;
    /// The smaller one; `other` where one is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger one; `other` where one is NaN.
    fn max(self, other: Self) -> Self;
    /// Without its sign.
    fn abs(self) -> Self;
    /// With the other's sign.
    fn copysign(self, sign: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// Where it is less; nowhere beside NaN.
    fn lt(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// Where it is less or equal; nowhere beside NaN.
    fn le(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// Where both are equal.
    fn eq(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// The same number with twice the precision.
    fn to_f64(self) -> <Self::Lanes as Lanes>::D;
    /// The nearest number.
    fn from_f64(x: <Self::Lanes as Lanes>::D) -> Self;

    /// What all lanes have, the first N.
    #[inline(always)]
    fn all(self) -> [f32; MOST] {
        let mut numbers = [0.0; MOST];
        self.store(&mut numbers);
        numbers
    }
}

/// A number of twice the precision in each lane.
pub trait Double:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// The set.
    type Lanes: Lanes<D = Self>;

    /// The set, of which a number is the proof.
    fn lanes(self) -> Self::Lanes;
    /// The square root.
    fn sqrt(self) -> Self;
    /// Where it is less; nowhere beside NaN.
    fn lt(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// The upper 32 of the 64 bits, rounded to the nearest.
    fn upper_half(self) -> <Self::Lanes as Lanes>::U;
    /// The number with these upper bits, and zeros below.
    fn of_upper_half(bits: <Self::Lanes as Lanes>::U) -> Self;
}

/// A whole number in each lane. Shifts are by less than 32.
pub trait Unsigned:
    Copy
    + Debug
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Shl<u32, Output = Self>
    + Shr<u32, Output = Self>
{
    /// The set.
    type Lanes: Lanes<U = Self>;

    /// The set, of which a number is the proof.
    fn lanes(self) -> Self::Lanes;
    /// Writes them to the first N places.
    ///
    /// # Panics
    /// If there are fewer.
    fn store(self, to: &mut [u32]);
    /// Writes those where the condition holds to the first places, in their order, and anything to the rest of N.
    ///
    /// # Panics
    /// If there are fewer places than lanes.
    fn compress(self, which: <Self::Lanes as Lanes>::M, to: &mut [u32]);
    /// The sum modulo 2³².
    fn wrapping_add(self, other: Self) -> Self;
    /// The product modulo 2³².
    fn wrapping_mul(self, other: Self) -> Self;
    /// The lower and the upper half of the product with the same number in all lanes.
    fn wide_mul(self, other: u32) -> (Self, Self);
    /// Its bits the other way round.
    fn reverse_bits(self) -> Self;
    /// What the table has at the place that the last four bits say.
    fn lookup(self, table: &[u32; 16]) -> Self;
    /// The nearest number, of whole ones below 2³¹.
    fn to_f32(self) -> <Self::Lanes as Lanes>::F;
    /// The same number.
    fn to_f64(self) -> <Self::Lanes as Lanes>::D;
    /// Where it is less.
    fn lt(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// Where both are equal.
    fn eq(self, other: Self) -> <Self::Lanes as Lanes>::M;

    /// What all lanes have, the first N.
    #[inline(always)]
    fn all(self) -> [u32; MOST] {
        let mut numbers = [0; MOST];
        self.store(&mut numbers);
        numbers
    }
}

/// A vector in each lane.
pub trait Vector:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<Output = Self>
    + Mul<<Self as Vector>::F, Output = Self>
    + Div<<Self as Vector>::F, Output = Self>
{
    /// The set.
    type Lanes: Lanes<V = Self, F = Self::F>;
    /// What a coordinate is.
    type F: Float<Lanes = Self::Lanes>;

    /// What all lanes have, the first N.
    #[inline(always)]
    fn all(self) -> [[f32; 3]; MOST] {
        let [x, y, z] = self.coordinates();
        let (x, y, z) = (x.all(), y.all(), z.all());
        let mut vectors = [[0.0; 3]; MOST];
        for k in 0..Self::Lanes::N {
            vectors[k] = [x[k], y[k], z[k]];
        }
        vectors
    }
    /// From its coordinates.
    fn new(x: Self::F, y: Self::F, z: Self::F) -> Self;
    /// Its coordinates.
    fn coordinates(self) -> [Self::F; 3];
    /// x x' + y y' + z z', summed in this order.
    fn dot(self, other: Self) -> Self::F;
    /// The same direction with length 1: the vector times the reciprocal of its length.
    fn normalize(self) -> Self;
    /// Each coordinate without its sign.
    fn abs(self) -> Self;
    /// The largest coordinate.
    fn max_element(self) -> Self::F;
    /// The smallest coordinate.
    fn min_element(self) -> Self::F;
}

/// A condition in each lane.
pub trait Mask: Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// A bit for each lane, the first lane's the lowest.
    fn bits(self) -> u32;

    /// Whether it holds anywhere.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }

    /// The numbers of the lanes in which it holds.
    #[inline(always)]
    fn lanes(self) -> Set {
        Set(self.bits())
    }
}

/// The numbers of some lanes, from the first on.
#[derive(Clone, Copy, Debug)]
pub struct Set(u32);

impl Set {
    /// Those whose bits are set.
    #[inline(always)]
    pub fn of_bits(bits: u32) -> Self {
        Self(bits)
    }
}

impl Iterator for Set {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let next = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (next < 32).then_some(next as usize)
    }
}

/// What a condition chooses from.
pub trait Select<T> {
    /// `yes` where it holds, `no` elsewhere.
    fn select(self, yes: T, no: T) -> T;
}
