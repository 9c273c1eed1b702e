//! Sixteen lanes: AVX-512 as all server processors have had it since Skylake.

use std::{
    arch::x86_64::*,
    ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub},
};

use super::{Double, Eight, Float, Lanes, Mask, Select, Unsigned};

/// Sixteen lanes, on a processor with `avx512f`, `avx512vl`, `avx512dq`, `avx512bw`, `avx512cd` and all that [`Eight`]
/// lanes take.
#[derive(Clone, Copy, Debug)]
pub struct Sixteen(());

/// Sixteen numbers.
#[derive(Clone, Copy, Debug)]
pub struct F(__m512);

/// Sixteen numbers of twice the precision: the first eight, and the others.
#[derive(Clone, Copy, Debug)]
pub struct D(__m512d, __m512d);

/// Sixteen whole numbers.
#[derive(Clone, Copy, Debug)]
pub struct U(__m512i);

/// Sixteen conditions, a bit each.
#[derive(Clone, Copy, Debug)]
pub struct M(u16);

impl Sixteen {
    /// Asks the processor.
    pub fn detect() -> Option<Self> {
        let wide = detected!("avx512f" "avx512vl" "avx512dq" "avx512bw" "avx512cd");
        (wide && Eight::detect().is_some()).then_some(Self(()))
    }

    /// The eight lanes that such a processor has as well.
    #[inline(always)]
    pub fn eight(self) -> Eight {
        Eight::included()
    }
}

// SAFETY, of all blocks below: `Sixteen`, and with it every number in its lanes, exists only where `detect` found the
// instructions; loads and stores have checked how long their slices are.

operators!(F: Add add _mm512_add_ps Sub sub _mm512_sub_ps Mul mul _mm512_mul_ps Div div _mm512_div_ps);
operators!(D, in halves: Add add _mm512_add_pd Sub sub _mm512_sub_pd Mul mul _mm512_mul_pd Div div _mm512_div_pd);

impl Neg for F {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(unsafe { _mm512_xor_ps(self.0, _mm512_set1_ps(-0.0)) })
    }
}

impl Mul<f32> for F {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f32) -> Self {
        self * Self(unsafe { _mm512_set1_ps(other) })
    }
}

impl Sub<f64> for D {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        let other = unsafe { _mm512_set1_pd(other) };
        self - Self(other, other)
    }
}

impl Mul<f64> for D {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        let other = unsafe { _mm512_set1_pd(other) };
        self * Self(other, other)
    }
}

impl BitAnd for M {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for M {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for M {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Lanes for Sixteen {
    const N: usize = 16;
    type F = F;
    type D = D;
    type U = U;
    type M = M;

    #[inline(always)]
    fn splat(self, x: f32) -> F {
        F(unsafe { _mm512_set1_ps(x) })
    }
    #[inline(always)]
    fn splat_u(self, x: u32) -> U {
        U(unsafe { _mm512_set1_epi32(x.cast_signed()) })
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> F {
        let from: &[f32; 16] = from.first_chunk().expect("a number for each lane");
        F(unsafe { _mm512_loadu_ps(from.as_ptr()) })
    }
    #[inline(always)]
    fn load_u(self, from: &[u32]) -> U {
        let from: &[u32; 16] = from.first_chunk().expect("a number for each lane");
        U(unsafe { _mm512_loadu_si512(from.as_ptr().cast()) })
    }
    #[inline(always)]
    fn mask(self, bits: u32) -> M {
        M(bits as u16)
    }
    #[inline(always)]
    fn pick(self, [x, y, z]: [f32; 3], which: U) -> F {
        F(unsafe { _mm512_permutevar_ps(_mm512_broadcast_f32x4(_mm_set_ps(0.0, z, y, x)), which.0) })
    }
}

impl Float for F {
    type Lanes = Sixteen;

    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to: &mut [f32; 16] = to.first_chunk_mut().expect("a place for each lane");
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn lane(self, i: u32) -> f32 {
        unsafe { _mm512_cvtss_f32(_mm512_permutexvar_ps(_mm512_set1_epi32(i.cast_signed()), self.0)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(unsafe { _mm512_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(unsafe { _mm512_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(unsafe { _mm512_andnot_ps(_mm512_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let sign = unsafe { _mm512_and_ps(_mm512_set1_ps(-0.0), sign.0) };
        Self(unsafe { _mm512_or_ps(self.abs().0, sign) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M {
        M(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> M {
        M(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M {
        M(unsafe { _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn to_f64(self) -> D {
        unsafe {
            let (low, high) = (_mm512_castps512_ps256(self.0), _mm512_extractf32x8_ps::<1>(self.0));
            D(_mm512_cvtps_pd(low), _mm512_cvtps_pd(high))
        }
    }
    #[inline(always)]
    fn from_f64(D(low, high): D) -> Self {
        unsafe {
            let (low, high) = (_mm512_cvtpd_ps(low), _mm512_cvtpd_ps(high));
            Self(_mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high))
        }
    }
}

impl Double for D {}

impl Unsigned for U {
    type Lanes = Sixteen;

    #[inline(always)]
    fn store(self, to: &mut [u32]) {
        let to: &mut [u32; 16] = to.first_chunk_mut().expect("a place for each lane");
        unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M {
        M(unsafe { _mm512_cmplt_epu32_mask(self.0, other.0) })
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M {
        M(unsafe { _mm512_cmpeq_epi32_mask(self.0, other.0) })
    }
}

impl Mask for M {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl Select<F> for M {
    #[inline(always)]
    fn select(self, yes: F, no: F) -> F {
        F(unsafe { _mm512_mask_blend_ps(self.0, no.0, yes.0) })
    }
}

impl Select<U> for M {
    #[inline(always)]
    fn select(self, yes: U, no: U) -> U {
        U(unsafe { _mm512_mask_blend_epi32(self.0, no.0, yes.0) })
    }
}
