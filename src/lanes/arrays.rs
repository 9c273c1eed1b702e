//! Lanes that every processor has: arrays, for the compiler to make the best of.

use std::{
    fmt::Debug,
    ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Shl, Shr, Sub},
};

use super::{Double, Float, Lanes, Mask, Record, Select, Three, Unsigned, Work};

/// N lanes on any processor.
#[derive(Clone, Copy, Debug)]
pub struct Arrays<const N: usize>;

/// What each of N lanes holds.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Each<T, const N: usize>([T; N]);

impl<T: Copy, const N: usize> Each<T, N> {
    #[inline(always)]
    fn map<U: Copy>(self, f: impl Fn(T) -> U) -> Each<U, N> {
        Each(std::array::from_fn(|i| f(self.0[i])))
    }

    #[inline(always)]
    fn with<U: Copy, V>(self, other: Each<U, N>, f: impl Fn(T, U) -> V) -> Each<V, N> {
        Each(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

macro_rules! operators {
    ($t:ty: $($trait:ident $name:ident)*) => { $(
        impl<const N: usize> $trait for Each<$t, N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                self.with(other, |a, b| a.$name(b))
            }
        }
    )* };
    ($t:ty, by $one:ty: $($trait:ident $name:ident)*) => { $(
        impl<const N: usize> $trait<$one> for Each<$t, N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: $one) -> Self {
                self.map(|a| a.$name(other))
            }
        }
    )* };
}

operators!(f32: Add add Sub sub Mul mul Div div);
operators!(f32, by f32: Mul mul);
operators!(f64: Add add Sub sub Mul mul Div div);
operators!(f64, by f64: Sub sub Mul mul);
operators!(u32: BitAnd bitand BitOr bitor BitXor bitxor);
operators!(u32, by u32: Shl shl Shr shr);
operators!(bool: BitAnd bitand BitOr bitor);

impl<const N: usize> Neg for Each<f32, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const N: usize> Not for Each<bool, N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self.map(|a| !a)
    }
}

impl<const N: usize> Lanes for Arrays<N> {
    const N: usize = N;
    type F = Each<f32, N>;
    type D = Each<f64, N>;
    type U = Each<u32, N>;
    type M = Each<bool, N>;
    type V = Three<Self::F>;
    type Each<T: Copy + Debug> = [T; N];

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        Each([x; N])
    }
    #[inline(always)]
    fn splat_d(self, x: f64) -> Self::D {
        Each([x; N])
    }
    #[inline(always)]
    fn splat_u(self, x: u32) -> Self::U {
        Each([x; N])
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        Each(*from.first_chunk().expect("a number for each lane"))
    }
    #[inline(always)]
    fn load_u(self, from: &[u32]) -> Self::U {
        Each(*from.first_chunk().expect("a number for each lane"))
    }
    #[inline(always)]
    fn mask(self, bits: u32) -> Self::M {
        Each(std::array::from_fn(|i| bits >> i & 1 == 1))
    }
    #[inline(always)]
    fn pick(self, of: [&[f32; 8]; 3], k: usize, which: Self::U) -> Self::F {
        which.map(|i| of[i as usize][k % 8])
    }
    #[inline(always)]
    fn records(self, from: &[Record], at: Self::U) -> [Self::F; 16] {
        std::array::from_fn(|i| at.map(|at| from[at as usize].0[i]))
    }
    #[inline(always)]
    fn each<T: Copy + Debug>(self, f: impl FnMut(usize) -> T) -> [T; N] {
        std::array::from_fn(f)
    }
    #[inline(always)]
    fn lane<T: Copy + Debug>(each: &[T; N], i: usize) -> T {
        each[i % N]
    }
    #[inline(never)]
    fn call<W: Work>(self, work: W) -> W::Output {
        work.work()
    }
}

/// Those where the condition holds, in their order, before the others.
#[inline(always)]
fn compressed<T: Copy, const N: usize>(from: [T; N], which: [bool; N], to: &mut [T]) {
    let to: &mut [T; N] = to.first_chunk_mut().expect("a place for each lane");
    let mut len = 0;
    for i in 0..N {
        to[len] = from[i];
        len += usize::from(which[i]);
    }
}

impl<const N: usize> Float for Each<f32, N> {
    type Lanes = Arrays<N>;

    #[inline(always)]
    fn lanes(self) -> Arrays<N> {
        Arrays
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        *to.first_chunk_mut().expect("a place for each lane") = self.0;
    }
    #[inline(always)]
    fn compress(self, which: Each<bool, N>, to: &mut [f32]) {
        compressed(self.0, which.0, to);
    }
    #[inline(always)]
    fn lane(self, i: u32) -> f32 {
        self.0[i as usize % N]
    }
    #[inline(always)]
    fn to_bits(self) -> Each<u32, N> {
        self.map(f32::to_bits)
    }
    #[inline(always)]
    fn of_bits(bits: Each<u32, N>) -> Self {
        bits.map(f32::from_bits)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.with(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.with(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f32::abs)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.with(sign, f32::copysign)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Each<bool, N> {
        self.with(other, |a, b| a < b)
    }
    #[inline(always)]
    fn le(self, other: Self) -> Each<bool, N> {
        self.with(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Each<bool, N> {
        self.with(other, |a, b| a == b)
    }
    #[inline(always)]
    fn to_f64(self) -> Each<f64, N> {
        self.map(f64::from)
    }
    #[inline(always)]
    fn from_f64(x: Each<f64, N>) -> Self {
        x.map(|x| x as f32)
    }
}

impl<const N: usize> Double for Each<f64, N> {
    type Lanes = Arrays<N>;

    #[inline(always)]
    fn lanes(self) -> Arrays<N> {
        Arrays
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Each<bool, N> {
        self.with(other, |a, b| a < b)
    }
    #[inline(always)]
    fn upper_half(self) -> Each<u32, N> {
        self.map(|x| x.upper_half())
    }
    #[inline(always)]
    fn of_upper_half(bits: Each<u32, N>) -> Self {
        bits.map(f64::of_upper_half)
    }
}

impl<const N: usize> Unsigned for Each<u32, N> {
    type Lanes = Arrays<N>;

    #[inline(always)]
    fn lanes(self) -> Arrays<N> {
        Arrays
    }
    #[inline(always)]
    fn store(self, to: &mut [u32]) {
        *to.first_chunk_mut().expect("a place for each lane") = self.0;
    }
    #[inline(always)]
    fn compress(self, which: Each<bool, N>, to: &mut [u32]) {
        compressed(self.0, which.0, to);
    }
    #[inline(always)]
    fn wrapping_add(self, other: Self) -> Self {
        self.with(other, u32::wrapping_add)
    }
    #[inline(always)]
    fn wrapping_mul(self, other: Self) -> Self {
        self.with(other, u32::wrapping_mul)
    }
    #[inline(always)]
    fn wide_mul(self, other: u32) -> (Self, Self) {
        (self.map(|x| x.wide_mul(other).0), self.map(|x| x.wide_mul(other).1))
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        self.map(u32::reverse_bits)
    }
    #[inline(always)]
    fn lookup(self, table: &[u32; 16]) -> Self {
        self.map(|x| table[x as usize % 16])
    }
    #[inline(always)]
    fn to_f32(self) -> Each<f32, N> {
        self.map(|x| x as f32)
    }
    #[inline(always)]
    fn to_f64(self) -> Each<f64, N> {
        self.map(f64::from)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Each<bool, N> {
        self.with(other, |a, b| a < b)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Each<bool, N> {
        self.with(other, |a, b| a == b)
    }
}

impl<const N: usize> Mask for Each<bool, N> {
    #[inline(always)]
    fn bits(self) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(self.0[i]) << i)
    }
}

impl<T: Copy, const N: usize> Select<Each<T, N>> for Each<bool, N> {
    #[inline(always)]
    fn select(self, yes: Each<T, N>, no: Each<T, N>) -> Each<T, N> {
        Each(std::array::from_fn(|i| if self.0[i] { yes.0[i] } else { no.0[i] }))
    }
}
