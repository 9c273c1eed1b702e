//! Columns from rows: what [`Lanes::records`](super::Lanes::records) is made of.

use std::arch::x86_64::*;

/// Columns of the rows: pairs first, then fours, then quarters of a register.
#[inline(always)]
pub(super) unsafe fn transposed_16(rows: [__m512; 16]) -> [__m512; 16] {
    unsafe {
        let (mut pairs, mut fours) = (rows, rows);
        for k in 0..8 {
            pairs[2 * k] = _mm512_unpacklo_ps(rows[2 * k], rows[2 * k + 1]);
            pairs[2 * k + 1] = _mm512_unpackhi_ps(rows[2 * k], rows[2 * k + 1]);
        }
        for k in 0..4 {
            for half in 0..2 {
                let a = _mm512_castps_pd(pairs[4 * k + half]);
                let b = _mm512_castps_pd(pairs[4 * k + half + 2]);
                fours[4 * k + 2 * half] = _mm512_castpd_ps(_mm512_unpacklo_pd(a, b));
                fours[4 * k + 2 * half + 1] = _mm512_castpd_ps(_mm512_unpackhi_pd(a, b));
            }
        }
        let mut columns = rows;
        for c in 0..4 {
            let (a, b, d, e) = (fours[c], fours[4 + c], fours[8 + c], fours[12 + c]);
            let (even, odd) = (_mm512_shuffle_f32x4::<0x88>(a, b), _mm512_shuffle_f32x4::<0xdd>(a, b));
            let (other_even, other_odd) = (_mm512_shuffle_f32x4::<0x88>(d, e), _mm512_shuffle_f32x4::<0xdd>(d, e));
            columns[c] = _mm512_shuffle_f32x4::<0x88>(even, other_even);
            columns[4 + c] = _mm512_shuffle_f32x4::<0x88>(odd, other_odd);
            columns[8 + c] = _mm512_shuffle_f32x4::<0xdd>(even, other_even);
            columns[12 + c] = _mm512_shuffle_f32x4::<0xdd>(odd, other_odd);
        }
        columns
    }
}

/// Columns of the rows: pairs first, then fours, then halves of a register.
#[inline(always)]
pub(super) unsafe fn transposed_8(rows: [__m256; 8]) -> [__m256; 8] {
    unsafe {
        let (mut pairs, mut fours) = (rows, rows);
        for k in 0..4 {
            pairs[2 * k] = _mm256_unpacklo_ps(rows[2 * k], rows[2 * k + 1]);
            pairs[2 * k + 1] = _mm256_unpackhi_ps(rows[2 * k], rows[2 * k + 1]);
        }
        for k in 0..2 {
            for half in 0..2 {
                let (a, b) = (pairs[4 * k + half], pairs[4 * k + half + 2]);
                fours[4 * k + 2 * half] = _mm256_shuffle_ps::<0x44>(a, b);
                fours[4 * k + 2 * half + 1] = _mm256_shuffle_ps::<0xee>(a, b);
            }
        }
        let mut columns = rows;
        for c in 0..4 {
            columns[c] = _mm256_permute2f128_ps::<0x20>(fours[c], fours[4 + c]);
            columns[4 + c] = _mm256_permute2f128_ps::<0x31>(fours[c], fours[4 + c]);
        }
        columns
    }
}
