//! Eight lanes: AVX2, and the bit counts of its time.

use std::{
    arch::x86_64::*,
    ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub},
};

use super::{Double, Float, Lanes, Mask, Select, Unsigned};

/// Eight lanes, on a processor with `avx2`, `bmi1`, `bmi2`, `lzcnt` and `popcnt`.
#[derive(Clone, Copy, Debug)]
pub struct Eight(());

/// Eight numbers.
#[derive(Clone, Copy, Debug)]
pub struct F(__m256);

/// Eight numbers of twice the precision: the first four, and the others.
#[derive(Clone, Copy, Debug)]
pub struct D(__m256d, __m256d);

/// Eight whole numbers.
#[derive(Clone, Copy, Debug)]
pub struct U(__m256i);

/// Eight conditions: all bits of a lane, or none.
#[derive(Clone, Copy, Debug)]
pub struct M(__m256);

impl Eight {
    /// Asks the processor.
    pub fn detect() -> Option<Self> {
        detected!("avx2" "bmi1" "bmi2" "lzcnt" "popcnt").then_some(Self(()))
    }

    /// For a set that includes these instructions.
    pub(super) fn included() -> Self {
        Self(())
    }
}

// SAFETY, of all blocks below: `Eight`, and with it every number in its lanes, exists only where `detect` found the
// instructions; loads and stores have checked how long their slices are.

operators!(F: Add add _mm256_add_ps Sub sub _mm256_sub_ps Mul mul _mm256_mul_ps Div div _mm256_div_ps);
operators!(M: BitAnd bitand _mm256_and_ps BitOr bitor _mm256_or_ps);
operators!(D, in halves: Add add _mm256_add_pd Sub sub _mm256_sub_pd Mul mul _mm256_mul_pd Div div _mm256_div_pd);

impl Neg for F {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
    }
}

impl Mul<f32> for F {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f32) -> Self {
        self * Self(unsafe { _mm256_set1_ps(other) })
    }
}

impl Sub<f64> for D {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        let other = unsafe { _mm256_set1_pd(other) };
        self - Self(other, other)
    }
}

impl Mul<f64> for D {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        let other = unsafe { _mm256_set1_pd(other) };
        self * Self(other, other)
    }
}

impl Not for M {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(unsafe { _mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1))) })
    }
}

impl Lanes for Eight {
    const N: usize = 8;
    type F = F;
    type D = D;
    type U = U;
    type M = M;

    #[inline(always)]
    fn splat(self, x: f32) -> F {
        F(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn splat_u(self, x: u32) -> U {
        U(unsafe { _mm256_set1_epi32(x.cast_signed()) })
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> F {
        let from: &[f32; 8] = from.first_chunk().expect("a number for each lane");
        F(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }
    #[inline(always)]
    fn load_u(self, from: &[u32]) -> U {
        let from: &[u32; 8] = from.first_chunk().expect("a number for each lane");
        U(unsafe { _mm256_loadu_si256(from.as_ptr().cast()) })
    }
    #[inline(always)]
    fn mask(self, bits: u32) -> M {
        M(unsafe {
            let bit = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits.cast_signed()), bit);
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, bit))
        })
    }
    #[inline(always)]
    fn pick(self, [x, y, z]: [f32; 3], which: U) -> F {
        F(unsafe {
            let of = _mm_set_ps(0.0, z, y, x);
            _mm256_permutevar_ps(_mm256_set_m128(of, of), which.0)
        })
    }
}

impl Float for F {
    type Lanes = Eight;

    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to: &mut [f32; 8] = to.first_chunk_mut().expect("a place for each lane");
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn lane(self, i: u32) -> f32 {
        let mut all = [0.0; 8];
        self.store(&mut all);
        all[i as usize % 8]
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(unsafe { _mm256_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let sign = unsafe { _mm256_and_ps(_mm256_set1_ps(-0.0), sign.0) };
        Self(unsafe { _mm256_or_ps(self.abs().0, sign) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M {
        M(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> M {
        M(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M {
        M(unsafe { _mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn to_f64(self) -> D {
        unsafe {
            let (low, high) = (_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            D(_mm256_cvtps_pd(low), _mm256_cvtps_pd(high))
        }
    }
    #[inline(always)]
    fn from_f64(D(low, high): D) -> Self {
        Self(unsafe { _mm256_set_m128(_mm256_cvtpd_ps(high), _mm256_cvtpd_ps(low)) })
    }
}

impl Double for D {}

impl Unsigned for U {
    type Lanes = Eight;

    #[inline(always)]
    fn store(self, to: &mut [u32]) {
        let to: &mut [u32; 8] = to.first_chunk_mut().expect("a place for each lane");
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M {
        M(unsafe {
            // There is an order of signed numbers alone.
            let shift = _mm256_set1_epi32(i32::MIN);
            let (a, b) = (_mm256_xor_si256(self.0, shift), _mm256_xor_si256(other.0, shift));
            _mm256_castsi256_ps(_mm256_cmpgt_epi32(b, a))
        })
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M {
        M(unsafe { _mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0)) })
    }
}

impl Mask for M {
    #[inline(always)]
    fn bits(self) -> u32 {
        unsafe { _mm256_movemask_ps(self.0) }.cast_unsigned()
    }
}

impl Select<F> for M {
    #[inline(always)]
    fn select(self, yes: F, no: F) -> F {
        F(unsafe { _mm256_blendv_ps(no.0, yes.0, self.0) })
    }
}

impl Select<U> for M {
    #[inline(always)]
    fn select(self, yes: U, no: U) -> U {
        U(unsafe {
            let (yes, no) = (_mm256_castsi256_ps(yes.0), _mm256_castsi256_ps(no.0));
            _mm256_castps_si256(_mm256_blendv_ps(no, yes, self.0))
        })
    }
}
