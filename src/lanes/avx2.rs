//! Eight lanes: AVX2, and the bit counts of its time.

use std::{
    arch::x86_64::*,
    fmt::Debug,
    mem::MaybeUninit,
    ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Shl, Shr, Sub},
};

use super::{Double, Float, Lanes, Mask, Record, Select, Three, Unsigned, Work, transpose::transposed_8};

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
operators!(U: BitAnd bitand _mm256_and_si256 BitOr bitor _mm256_or_si256 BitXor bitxor _mm256_xor_si256);
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

impl Shl<u32> for U {
    type Output = Self;
    #[inline(always)]
    fn shl(self, by: u32) -> Self {
        Self(unsafe { _mm256_sll_epi32(self.0, _mm_cvtsi32_si128(by.cast_signed())) })
    }
}

impl Shr<u32> for U {
    type Output = Self;
    #[inline(always)]
    fn shr(self, by: u32) -> Self {
        Self(unsafe { _mm256_srl_epi32(self.0, _mm_cvtsi32_si128(by.cast_signed())) })
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
    type V = Three<F>;
    type Each<T: Copy + Debug> = [T; 8];

    #[inline(always)]
    fn splat(self, x: f32) -> F {
        F(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn splat_d(self, x: f64) -> D {
        let x = unsafe { _mm256_set1_pd(x) };
        D(x, x)
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
    fn pick(self, [x, y, z]: [&[f32; 8]; 3], k: usize, which: U) -> F {
        F(unsafe {
            let of = _mm_set_ps(0.0, z[k % 8], y[k % 8], x[k % 8]);
            _mm256_permutevar_ps(_mm256_set_m128(of, of), which.0)
        })
    }
    #[inline(always)]
    fn prefetch<T>(self, of: &T) {
        for line in 0..size_of::<T>().div_ceil(64) {
            unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(of).cast::<i8>().wrapping_add(64 * line)) }
        }
    }
    #[inline(always)]
    fn records(self, from: &[Record], at: U) -> [F; 16] {
        let at = at.all();
        let mut columns = [self.splat(0.0); 16];
        for half in [0, 8] {
            let mut rows = [self.splat(0.0).0; 8];
            for k in 0..8 {
                rows[k] = unsafe { _mm256_load_ps(from[at[k] as usize].0[half..].as_ptr()) };
            }
            let eight = unsafe { transposed_8(rows) };
            for (column, row) in columns[half..half + 8].iter_mut().zip(eight) {
                *column = F(row);
            }
        }
        columns
    }
    #[inline(always)]
    fn each<T: Copy + Debug>(self, f: impl FnMut(usize) -> T) -> [T; 8] {
        each(f)
    }
    #[inline(always)]
    fn lane<T: Copy + Debug>(each: &[T; 8], i: usize) -> T {
        each[i % 8]
    }
    #[inline(always)]
    fn call<W: Work>(self, work: W) -> W::Output {
        // SAFETY: these lanes exist only where the processor has the instructions.
        unsafe { compiled(work) }
    }
}

/// What `f` makes of each number. Closures of the standard library's arrays are not compiled for these instructions.
#[inline(always)]
pub(super) fn each<T: Copy, const N: usize>(mut f: impl FnMut(usize) -> T) -> [T; N] {
    let mut all = [const { MaybeUninit::uninit() }; N];
    for (i, one) in all.iter_mut().enumerate() {
        one.write(f(i));
    }
    // SAFETY: all have been written.
    unsafe { (&raw const all).cast::<[T; N]>().read() }
}

/// For each set of eight lanes, a byte for each that it has: the lane's number.
static PACKED: [u64; 256] = {
    let mut all = [0; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut len) = (0, 0);
        while lane < 8 {
            if set >> lane & 1 == 1 {
                all[set] |= lane << len;
                len += 8;
            }
            lane += 1;
        }
        set += 1;
    }
    all
};

impl M {
    /// The permutation that brings the lanes where it holds to the front.
    #[inline(always)]
    fn packed(self) -> __m256i {
        let lanes = PACKED[self.bits() as usize % 256];
        unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes.cast_signed())) }
    }

    /// Of the two halves' 64-bit conditions.
    #[inline(always)]
    fn of_wide(low: __m256d, high: __m256d) -> Self {
        Self(unsafe { _mm256_castsi256_ps(joined::<0b10_00_10_00>(low, high)) })
    }
}

/// The bits of four the other way round.
pub(super) const REVERSED_BITS: [u8; 16] = [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15];

/// The bytes of four numbers, of each the other way round.
pub(super) const REVERSED_BYTES: [u8; 16] = [3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12];

/// The lower or the upper 32 bits of each number of twice the width, as `PARTS` of two numbers and two more say.
#[inline(always)]
fn joined<const PARTS: i32>(low: __m256d, high: __m256d) -> __m256i {
    unsafe {
        // Pairs of lanes: 0 1, 4 5, 2 3, 6 7.
        let pairs = _mm256_shuffle_ps::<PARTS>(_mm256_castpd_ps(low), _mm256_castpd_ps(high));
        _mm256_permute4x64_epi64::<0b11_01_10_00>(_mm256_castps_si256(pairs))
    }
}

impl Float for F {
    type Lanes = Eight;

    #[inline(always)]
    fn lanes(self) -> Eight {
        Eight(())
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to: &mut [f32; 8] = to.first_chunk_mut().expect("a place for each lane");
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn compress(self, which: M, to: &mut [f32]) {
        Self(unsafe { _mm256_permutevar8x32_ps(self.0, which.packed()) }).store(to);
    }
    #[inline(always)]
    fn lane(self, i: u32) -> f32 {
        let mut all = [0.0; 8];
        self.store(&mut all);
        all[i as usize % 8]
    }
    #[inline(always)]
    fn to_bits(self) -> U {
        U(unsafe { _mm256_castps_si256(self.0) })
    }
    #[inline(always)]
    fn of_bits(bits: U) -> Self {
        Self(unsafe { _mm256_castsi256_ps(bits.0) })
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
    fn sqrt(self) -> Self {
        Self(unsafe { _mm256_sqrt_ps(self.0) })
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

impl Double for D {
    type Lanes = Eight;

    #[inline(always)]
    fn lanes(self) -> Eight {
        Eight(())
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { Self(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M {
        let less = |a, b| unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(a, b) };
        M::of_wide(less(self.0, other.0), less(self.1, other.1))
    }
    #[inline(always)]
    fn upper_half(self) -> U {
        U(unsafe {
            let half = _mm256_set1_epi64x(1 << 31);
            let low = _mm256_add_epi64(_mm256_castpd_si256(self.0), half);
            let high = _mm256_add_epi64(_mm256_castpd_si256(self.1), half);
            joined::<0b11_01_11_01>(_mm256_castsi256_pd(low), _mm256_castsi256_pd(high))
        })
    }
    #[inline(always)]
    fn of_upper_half(bits: U) -> Self {
        let (low, high) = bits.widened();
        unsafe {
            let (low, high) = (_mm256_slli_epi64::<32>(low), _mm256_slli_epi64::<32>(high));
            Self(_mm256_castsi256_pd(low), _mm256_castsi256_pd(high))
        }
    }
}

impl U {
    /// With 32 zeros above each: of the first four, and of the others.
    #[inline(always)]
    fn widened(self) -> (__m256i, __m256i) {
        unsafe {
            let (low, high) = (_mm256_castsi256_si128(self.0), _mm256_extracti128_si256::<1>(self.0));
            (_mm256_cvtepu32_epi64(low), _mm256_cvtepu32_epi64(high))
        }
    }
}

impl Unsigned for U {
    type Lanes = Eight;

    #[inline(always)]
    fn lanes(self) -> Eight {
        Eight(())
    }
    #[inline(always)]
    fn store(self, to: &mut [u32]) {
        let to: &mut [u32; 8] = to.first_chunk_mut().expect("a place for each lane");
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn compress(self, which: M, to: &mut [u32]) {
        Self(unsafe { _mm256_permutevar8x32_epi32(self.0, which.packed()) }).store(to);
    }
    #[inline(always)]
    fn wrapping_add(self, other: Self) -> Self {
        Self(unsafe { _mm256_add_epi32(self.0, other.0) })
    }
    #[inline(always)]
    fn wrapping_mul(self, other: Self) -> Self {
        Self(unsafe { _mm256_mullo_epi32(self.0, other.0) })
    }
    #[inline(always)]
    fn wide_mul(self, other: u32) -> (Self, Self) {
        unsafe {
            let other = _mm256_set1_epi32(other.cast_signed());
            let even = _mm256_mul_epu32(self.0, other);
            let odd = _mm256_mul_epu32(_mm256_srli_epi64::<32>(self.0), other);
            let low = _mm256_blend_epi32::<0b1010_1010>(even, _mm256_slli_epi64::<32>(odd));
            let high = _mm256_blend_epi32::<0b1010_1010>(_mm256_srli_epi64::<32>(even), odd);
            (Self(low), Self(high))
        }
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        Self(unsafe {
            let table = |of: &[u8; 16]| _mm256_broadcastsi128_si256(_mm_loadu_si128(of.as_ptr().cast()));
            let (bits, half) = (table(&REVERSED_BITS), _mm256_set1_epi8(15));
            let bytes = _mm256_shuffle_epi8(self.0, table(&REVERSED_BYTES));
            let lower = _mm256_shuffle_epi8(bits, _mm256_and_si256(bytes, half));
            let upper = _mm256_shuffle_epi8(bits, _mm256_and_si256(_mm256_srli_epi32::<4>(bytes), half));
            _mm256_or_si256(_mm256_slli_epi32::<4>(lower), upper)
        })
    }
    #[inline(always)]
    fn lookup(self, table: &[u32; 16]) -> Self {
        Self(unsafe {
            let half = |i| {
                let half = _mm256_loadu_si256(table.as_ptr().cast::<__m256i>().add(i));
                _mm256_castsi256_ps(_mm256_permutevar8x32_epi32(half, self.0))
            };
            let which = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(self.0));
            _mm256_castps_si256(_mm256_blendv_ps(half(0), half(1), which))
        })
    }
    #[inline(always)]
    fn to_f32(self) -> F {
        F(unsafe { _mm256_cvtepi32_ps(self.0) })
    }
    #[inline(always)]
    fn to_f64(self) -> D {
        // No instruction has unsigned ones: they are what a double of 2⁵² and more has in its last 32 bits.
        let (low, high) = self.widened();
        unsafe {
            let exponent = _mm256_set1_pd((1_u64 << 52) as f64);
            let of = |x| _mm256_sub_pd(_mm256_or_pd(_mm256_castsi256_pd(x), exponent), exponent);
            D(of(low), of(high))
        }
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

impl Select<D> for M {
    #[inline(always)]
    fn select(self, yes: D, no: D) -> D {
        unsafe {
            let lanes = _mm256_castps_si256(self.0);
            let low = _mm256_castsi256_pd(_mm256_cvtepi32_epi64(_mm256_castsi256_si128(lanes)));
            let high = _mm256_castsi256_pd(_mm256_cvtepi32_epi64(_mm256_extracti128_si256::<1>(lanes)));
            D(_mm256_blendv_pd(no.0, yes.0, low), _mm256_blendv_pd(no.1, yes.1, high))
        }
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

compiled!("avx2,bmi1,bmi2,lzcnt,popcnt");
