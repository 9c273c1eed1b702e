//! Eight numbers at once: the few operations of the box and triangle tests, with AVX2 where the processor has it.
//!
//! Both forms round every operation alike (nothing is fused), so that what a ray hits does not depend on the processor.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256, _CMP_LE_OQ, _CMP_LT_OQ, _mm256_add_ps, _mm256_cmp_ps, _mm256_load_ps, _mm256_max_ps, _mm256_min_ps,
    _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_store_ps, _mm256_sub_ps,
};

#[cfg(target_arch = "x86_64")]
use crate::instructions::Avx2;

/// Eight lanes, aligned for loads.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Lanes(pub [f32; 8]);

/// A set of instructions that is known to be there: whoever holds a value may use them.
pub(super) trait Simd: Copy {
    /// Eight numbers in a register.
    type F: Copy;
    fn splat(self, x: f32) -> Self::F;
    fn load(self, x: &Lanes) -> Self::F;
    fn store(self, x: Self::F) -> Lanes;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// The smaller one; `b` where one is no number.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The larger one; `b` where one is no number.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Bit i: a < b in lane i.
    fn lt(self, a: Self::F, b: Self::F) -> u32;
    /// Bit i: a ≤ b in lane i.
    fn le(self, a: Self::F, b: Self::F) -> u32;
}

/// What every processor has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

#[inline(always)]
fn each(a: Lanes, b: Lanes, f: impl Fn(f32, f32) -> f32) -> Lanes {
    Lanes(std::array::from_fn(|i| f(a.0[i], b.0[i])))
}

#[inline(always)]
fn mask(a: Lanes, b: Lanes, f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..8).fold(0, |mask, i| mask | u32::from(f(a.0[i], b.0[i])) << i)
}

impl Simd for Portable {
    type F = Lanes;

    #[inline(always)]
    fn splat(self, x: f32) -> Lanes {
        Lanes([x; 8])
    }
    #[inline(always)]
    fn load(self, x: &Lanes) -> Lanes {
        *x
    }
    #[inline(always)]
    fn store(self, x: Lanes) -> Lanes {
        x
    }
    #[inline(always)]
    fn add(self, a: Lanes, b: Lanes) -> Lanes {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Lanes, b: Lanes) -> Lanes {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Lanes, b: Lanes) -> Lanes {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn min(self, a: Lanes, b: Lanes) -> Lanes {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Lanes, b: Lanes) -> Lanes {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn lt(self, a: Lanes, b: Lanes) -> u32 {
        mask(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn le(self, a: Lanes, b: Lanes) -> u32 {
        mask(a, b, |a, b| a <= b)
    }
}

// SAFETY, of all blocks below: a value of `Avx2` exists only where `detect` found the instructions.
#[cfg(target_arch = "x86_64")]
impl Simd for Avx2 {
    type F = __m256;

    #[inline(always)]
    fn splat(self, x: f32) -> __m256 {
        unsafe { _mm256_set1_ps(x) }
    }
    #[inline(always)]
    fn load(self, x: &Lanes) -> __m256 {
        unsafe { _mm256_load_ps(x.0.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, x: __m256) -> Lanes {
        let mut lanes = Lanes([0.0; 8]);
        unsafe { _mm256_store_ps(lanes.0.as_mut_ptr(), x) };
        lanes
    }
    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_mul_ps(a, b) }
    }
    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_min_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_max_ps(a, b) }
    }
    #[inline(always)]
    fn lt(self, a: __m256, b: __m256) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u32 }
    }
    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
    }
}
