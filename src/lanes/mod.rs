//! Lanes: one text that computes one number or sixteen at a time, and the same bits for both.
//!
//! A set of lanes is a value that exists only where the processor has its instructions, and so is every number in
//! them: whoever has one may compute with it, and nothing outside this module is `unsafe` for that. Every operation is
//! one exact IEEE operation a lane. Nothing is fused, approximated or reordered, so results do not depend on the set:
//! `tests.rs` compares all of them with [`Arrays`], lane by lane.
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

mod arrays;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(test)]
mod tests;

use std::{
    fmt::Debug,
    ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub},
};

pub use arrays::Arrays;
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

/// A set of lanes.
pub trait Lanes: Copy + Debug + Send + Sync + 'static {
    /// How many there are, at most 32.
    const N: usize;
    /// A number in each.
    type F: Float<Lanes = Self>;
    /// A number in each, of twice the precision.
    type D: Double;
    /// A whole number in each.
    type U: Unsigned<Lanes = Self>;
    /// A condition in each.
    type M: Mask + Select<Self::F> + Select<Self::U>;

    /// The same number in all.
    fn splat(self, x: f32) -> Self::F;
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
    /// In each lane one of three numbers, by the last two bits of `which` (0 where they are 3).
    fn pick(self, of: [f32; 3], which: Self::U) -> Self::F;

    /// The condition that holds in the first `n` lanes, or in all of them.
    #[inline(always)]
    fn first(self, n: usize) -> Self::M {
        self.mask(if n < 32 { (1 << n) - 1 } else { u32::MAX })
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

    /// Writes them to the first N places.
    ///
    /// # Panics
    /// If there are fewer.
    fn store(self, to: &mut [f32]);
    /// What one lane has: that of the number `i` modulo N, the first being 0.
    fn lane(self, i: u32) -> f32;
    /// The smaller one; `other` where one is no number.
    fn min(self, other: Self) -> Self;
    /// The larger one; `other` where one is no number.
    fn max(self, other: Self) -> Self;
    /// Without its sign.
    fn abs(self) -> Self;
    /// With the other's sign.
    fn copysign(self, sign: Self) -> Self;
    /// Where it is less; nowhere beside what is no number.
    fn lt(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// Where it is less or equal; nowhere beside what is no number.
    fn le(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// Where both are equal.
    fn eq(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// The same number with twice the precision.
    fn to_f64(self) -> <Self::Lanes as Lanes>::D;
    /// The nearest number.
    fn from_f64(x: <Self::Lanes as Lanes>::D) -> Self;
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
}

/// A whole number in each lane.
pub trait Unsigned: Copy + Debug {
    /// The set.
    type Lanes: Lanes<U = Self>;

    /// Writes them to the first N places.
    ///
    /// # Panics
    /// If there are fewer.
    fn store(self, to: &mut [u32]);
    /// Where it is less.
    fn lt(self, other: Self) -> <Self::Lanes as Lanes>::M;
    /// Where both are equal.
    fn eq(self, other: Self) -> <Self::Lanes as Lanes>::M;
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
}

/// What a condition chooses from.
pub trait Select<T> {
    /// `yes` where it holds, `no` elsewhere.
    fn select(self, yes: T, no: T) -> T;
}
