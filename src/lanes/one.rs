//! One lane: plain numbers.

use glam::Vec3;

use super::{Double, Float, Lanes, Mask, Record, Select, Unsigned, Vector, Work};

/// One lane. Numbers in it are numbers, conditions are `bool`, vectors are [`Vec3`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct One;

impl Lanes for One {
    const N: usize = 1;
    type F = f32;
    type D = f64;
    type U = u32;
    type M = bool;
    type V = Vec3;
    type Each<T: Copy + std::fmt::Debug> = T;

    #[inline(always)]
    fn splat(self, x: f32) -> f32 {
        x
    }
    #[inline(always)]
    fn splat_d(self, x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn splat_u(self, x: u32) -> u32 {
        x
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> f32 {
        from[0]
    }
    #[inline(always)]
    fn load_u(self, from: &[u32]) -> u32 {
        from[0]
    }
    #[inline(always)]
    fn mask(self, bits: u32) -> bool {
        bits & 1 == 1
    }
    #[inline(always)]
    fn pick(self, of: [&[f32; 8]; 3], k: usize, which: u32) -> f32 {
        of[which as usize][k % 8]
    }
    #[inline(always)]
    fn records(self, from: &[Record], at: u32) -> [f32; 16] {
        from[at as usize].0
    }
    #[inline(always)]
    fn each<T: Copy + std::fmt::Debug>(self, mut f: impl FnMut(usize) -> T) -> T {
        f(0)
    }
    #[inline(always)]
    fn lane<T: Copy + std::fmt::Debug>(each: &T, _: usize) -> T {
        *each
    }
    #[inline(never)]
    fn call<W: Work>(self, work: W) -> W::Output {
        work.work()
    }
    #[inline(always)]
    fn numbers(self, mut f: impl FnMut(usize) -> f32) -> f32 {
        f(0)
    }
    #[inline(always)]
    fn whole_numbers(self, mut f: impl FnMut(usize) -> u32) -> u32 {
        f(0)
    }
    #[inline(always)]
    fn condition(self, mut f: impl FnMut(usize) -> bool) -> bool {
        f(0)
    }
    #[inline(always)]
    fn vectors(self, mut f: impl FnMut(usize) -> [f32; 3]) -> Vec3 {
        f(0).into()
    }
}

impl Float for f32 {
    type Lanes = One;

    #[inline(always)]
    fn lanes(self) -> One {
        One
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[0] = self;
    }
    #[inline(always)]
    fn compress(self, _: bool, to: &mut [f32]) {
        to[0] = self;
    }
    #[inline(always)]
    fn lane(self, _: u32) -> f32 {
        self
    }
    #[inline(always)]
    fn to_bits(self) -> u32 {
        self.to_bits()
    }
    #[inline(always)]
    fn of_bits(bits: u32) -> Self {
        Self::from_bits(bits)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.copysign(sign)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self.into()
    }
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x as f32
    }
}

impl Double for f64 {
    type Lanes = One;

    #[inline(always)]
    fn lanes(self) -> One {
        One
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn upper_half(self) -> u32 {
        (self.to_bits().wrapping_add(1 << 31) >> 32) as u32
    }
    #[inline(always)]
    fn of_upper_half(bits: u32) -> Self {
        Self::from_bits(u64::from(bits) << 32)
    }
}

impl Unsigned for u32 {
    type Lanes = One;

    #[inline(always)]
    fn lanes(self) -> One {
        One
    }
    #[inline(always)]
    fn store(self, to: &mut [u32]) {
        to[0] = self;
    }
    #[inline(always)]
    fn compress(self, _: bool, to: &mut [u32]) {
        to[0] = self;
    }
    #[inline(always)]
    fn wrapping_add(self, other: Self) -> Self {
        self.wrapping_add(other)
    }
    #[inline(always)]
    fn wrapping_mul(self, other: Self) -> Self {
        self.wrapping_mul(other)
    }
    #[inline(always)]
    fn wide_mul(self, other: u32) -> (Self, Self) {
        let product = u64::from(self) * u64::from(other);
        (product as u32, (product >> 32) as u32)
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        self.reverse_bits()
    }
    #[inline(always)]
    fn lookup(self, table: &[u32; 16]) -> Self {
        table[self as usize % 16]
    }
    #[inline(always)]
    fn to_f32(self) -> f32 {
        self as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self.into()
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }
}

impl Vector for Vec3 {
    type Lanes = One;
    type F = f32;

    #[inline(always)]
    fn new(x: f32, y: f32, z: f32) -> Self {
        Self { x, y, z }
    }
    #[inline(always)]
    fn coordinates(self) -> [f32; 3] {
        self.to_array()
    }
    #[inline(always)]
    fn dot(self, other: Self) -> f32 {
        self.dot(other)
    }
    #[inline(always)]
    fn normalize(self) -> Self {
        self.normalize()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn max_element(self) -> f32 {
        self.max_element()
    }
    #[inline(always)]
    fn min_element(self) -> f32 {
        self.min_element()
    }
}

impl Mask for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.into()
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

macro_rules! select {
    ($($t:ty)*) => { $(
        impl Select<$t> for bool {
            #[inline(always)]
            fn select(self, yes: $t, no: $t) -> $t {
                if self { yes } else { no }
            }
        }
    )* };
}

select!(f32 f64 u32 Vec3);
