//! Sixteen lanes: AVX-512 as all server processors have had it since Skylake.

use std::{
    arch::x86_64::*,
    fmt::Debug,
    ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Shl, Shr, Sub},
};

use super::{
    Double, Eight, Float, Lanes, Mask, Record, Select, Three, Unsigned, Work,
    avx2::{REVERSED_BITS, REVERSED_BYTES, each},
    transpose::transposed_16,
};

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
operators!(U: BitAnd bitand _mm512_and_si512 BitOr bitor _mm512_or_si512 BitXor bitxor _mm512_xor_si512);
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

impl Shl<u32> for U {
    type Output = Self;
    #[inline(always)]
    fn shl(self, by: u32) -> Self {
        Self(unsafe { _mm512_sll_epi32(self.0, _mm_cvtsi32_si128(by.cast_signed())) })
    }
}

impl Shr<u32> for U {
    type Output = Self;
    #[inline(always)]
    fn shr(self, by: u32) -> Self {
        Self(unsafe { _mm512_srl_epi32(self.0, _mm_cvtsi32_si128(by.cast_signed())) })
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
    type V = Three<F>;
    type Each<T: Copy + Debug> = [T; 16];

    #[inline(always)]
    fn splat(self, x: f32) -> F {
        F(unsafe { _mm512_set1_ps(x) })
    }
    #[inline(always)]
    fn splat_d(self, x: f64) -> D {
        let x = unsafe { _mm512_set1_pd(x) };
        D(x, x)
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
    fn pick(self, [x, y, z]: [&[f32; 8]; 3], k: usize, which: U) -> F {
        // The place in all three rows: 8 · which + k.
        F(unsafe {
            let at = _mm512_add_epi32(_mm512_slli_epi32::<3>(which.0), _mm512_set1_epi32(k as i32 % 8));
            let (x, y, z) = (_mm256_loadu_ps(x.as_ptr()), _mm256_loadu_ps(y.as_ptr()), _mm256_loadu_ps(z.as_ptr()));
            let xy = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(x), y);
            _mm512_permutex2var_ps(xy, at, _mm512_castps256_ps512(z))
        })
    }
    #[inline(always)]
    fn records(self, from: &[Record], at: U) -> [F; 16] {
        let at = at.all();
        let mut rows = [self.splat(0.0).0; 16];
        for k in 0..16 {
            rows[k] = unsafe { _mm512_load_ps(from[at[k] as usize].0.as_ptr()) };
        }
        let rows = unsafe { transposed_16(rows) };
        let mut columns = [self.splat(0.0); 16];
        for (column, row) in columns.iter_mut().zip(rows) {
            *column = F(row);
        }
        columns
    }
    #[inline(always)]
    fn put_records(self, columns: [F; 16], to: &mut [Record], at: U, which: M) {
        let (at, mut rows) = (at.all(), [self.splat(0.0).0; 16]);
        for (row, column) in rows.iter_mut().zip(columns) {
            *row = column.0;
        }
        let rows = unsafe { transposed_16(rows) };
        for k in which.lanes() {
            unsafe { _mm512_store_ps(to[at[k] as usize].0.as_mut_ptr(), rows[k]) }
        }
    }
    #[inline(always)]
    fn each<T: Copy + Debug>(self, f: impl FnMut(usize) -> T) -> [T; 16] {
        each(f)
    }
    #[inline(always)]
    fn lane<T: Copy + Debug>(each: &[T; 16], i: usize) -> T {
        each[i % 16]
    }
    #[inline(always)]
    fn prefetch<T>(self, of: &T) {
        self.eight().prefetch(of);
    }
    #[inline(always)]
    fn call<W: Work>(self, work: W) -> W::Output {
        // SAFETY: these lanes exist only where the processor has the instructions.
        unsafe { compiled(work) }
    }
}

impl Float for F {
    type Lanes = Sixteen;

    #[inline(always)]
    fn lanes(self) -> Sixteen {
        Sixteen(())
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to: &mut [f32; 16] = to.first_chunk_mut().expect("a place for each lane");
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn compress(self, which: M, to: &mut [f32]) {
        // In a register, because compressing into memory is microcode on Zen 4.
        Self(unsafe { _mm512_maskz_compress_ps(which.0, self.0) }).store(to);
    }
    #[inline(always)]
    fn lane(self, i: u32) -> f32 {
        unsafe { _mm512_cvtss_f32(_mm512_permutexvar_ps(_mm512_set1_epi32(i.cast_signed()), self.0)) }
    }
    #[inline(always)]
    fn to_bits(self) -> U {
        U(unsafe { _mm512_castps_si512(self.0) })
    }
    #[inline(always)]
    fn of_bits(bits: U) -> Self {
        Self(unsafe { _mm512_castsi512_ps(bits.0) })
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
    fn sqrt(self) -> Self {
        Self(unsafe { _mm512_sqrt_ps(self.0) })
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

impl Double for D {
    type Lanes = Sixteen;

    #[inline(always)]
    fn lanes(self) -> Sixteen {
        Sixteen(())
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { Self(_mm512_sqrt_pd(self.0), _mm512_sqrt_pd(self.1)) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M {
        let less = |a, b| u16::from(unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b) });
        M(less(self.0, other.0) | less(self.1, other.1) << 8)
    }
    #[inline(always)]
    fn upper_half(self) -> U {
        U(unsafe {
            let half = _mm512_set1_epi64(1 << 31);
            let low = _mm512_add_epi64(_mm512_castpd_si512(self.0), half);
            let high = _mm512_add_epi64(_mm512_castpd_si512(self.1), half);
            let odd = _mm512_set_epi32(31, 29, 27, 25, 23, 21, 19, 17, 15, 13, 11, 9, 7, 5, 3, 1);
            _mm512_permutex2var_epi32(low, odd, high)
        })
    }
    #[inline(always)]
    fn of_upper_half(bits: U) -> Self {
        let (low, high) = bits.halves();
        unsafe {
            let low = _mm512_slli_epi64::<32>(_mm512_cvtepu32_epi64(low));
            let high = _mm512_slli_epi64::<32>(_mm512_cvtepu32_epi64(high));
            Self(_mm512_castsi512_pd(low), _mm512_castsi512_pd(high))
        }
    }
}

impl U {
    /// The first eight, and the others.
    #[inline(always)]
    fn halves(self) -> (__m256i, __m256i) {
        unsafe { (_mm512_castsi512_si256(self.0), _mm512_extracti32x8_epi32::<1>(self.0)) }
    }
}

impl Unsigned for U {
    type Lanes = Sixteen;

    #[inline(always)]
    fn lanes(self) -> Sixteen {
        Sixteen(())
    }
    #[inline(always)]
    fn store(self, to: &mut [u32]) {
        let to: &mut [u32; 16] = to.first_chunk_mut().expect("a place for each lane");
        unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn compress(self, which: M, to: &mut [u32]) {
        Self(unsafe { _mm512_maskz_compress_epi32(which.0, self.0) }).store(to);
    }
    #[inline(always)]
    fn wrapping_add(self, other: Self) -> Self {
        Self(unsafe { _mm512_add_epi32(self.0, other.0) })
    }
    #[inline(always)]
    fn wrapping_mul(self, other: Self) -> Self {
        Self(unsafe { _mm512_mullo_epi32(self.0, other.0) })
    }
    #[inline(always)]
    fn wide_mul(self, other: u32) -> (Self, Self) {
        const ODD: u16 = 0b1010_1010_1010_1010;
        unsafe {
            let other = _mm512_set1_epi32(other.cast_signed());
            let even = _mm512_mul_epu32(self.0, other);
            let odd = _mm512_mul_epu32(_mm512_srli_epi64::<32>(self.0), other);
            let low = _mm512_mask_blend_epi32(ODD, even, _mm512_slli_epi64::<32>(odd));
            let high = _mm512_mask_blend_epi32(ODD, _mm512_srli_epi64::<32>(even), odd);
            (Self(low), Self(high))
        }
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        Self(unsafe {
            let table = |of: &[u8; 16]| _mm512_broadcast_i32x4(_mm_loadu_si128(of.as_ptr().cast()));
            let (bits, half) = (table(&REVERSED_BITS), _mm512_set1_epi8(15));
            let bytes = _mm512_shuffle_epi8(self.0, table(&REVERSED_BYTES));
            let lower = _mm512_shuffle_epi8(bits, _mm512_and_si512(bytes, half));
            let upper = _mm512_shuffle_epi8(bits, _mm512_and_si512(_mm512_srli_epi32::<4>(bytes), half));
            _mm512_or_si512(_mm512_slli_epi32::<4>(lower), upper)
        })
    }
    #[inline(always)]
    fn lookup(self, table: &[u32; 16]) -> Self {
        Self(unsafe { _mm512_permutexvar_epi32(self.0, _mm512_loadu_si512(table.as_ptr().cast())) })
    }
    #[inline(always)]
    fn to_f32(self) -> F {
        F(unsafe { _mm512_cvtepi32_ps(self.0) })
    }
    #[inline(always)]
    fn to_f64(self) -> D {
        let (low, high) = self.halves();
        unsafe { D(_mm512_cvtepu32_pd(low), _mm512_cvtepu32_pd(high)) }
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

impl Select<D> for M {
    #[inline(always)]
    fn select(self, yes: D, no: D) -> D {
        let (low, high) = (self.0 as u8, (self.0 >> 8) as u8);
        unsafe { D(_mm512_mask_blend_pd(low, no.0, yes.0), _mm512_mask_blend_pd(high, no.1, yes.1)) }
    }
}

impl Select<U> for M {
    #[inline(always)]
    fn select(self, yes: U, no: U) -> U {
        U(unsafe { _mm512_mask_blend_epi32(self.0, no.0, yes.0) })
    }
}

compiled!("avx512f,avx512vl,avx512dq,avx512bw,avx512cd,avx2,bmi1,bmi2,lzcnt,popcnt");
