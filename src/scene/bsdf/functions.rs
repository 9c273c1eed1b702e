//! Functions of the system's library, lane by lane.

use crate::lanes::{Float, Lanes, MOST, Mask, Select};

/// sin x and cos x in the lanes `which`.
#[inline(always)]
pub(super) fn sin_cos<F: Float>(x: F, which: <F::Lanes as Lanes>::M) -> [F; 2] {
    let (lanes, x) = (x.lanes(), x.all());
    let (mut sin, mut cos) = ([0.0; MOST], [0.0; MOST]);
    for k in which.lanes() {
        (sin[k], cos[k]) = alone::sin_cos(x[k]);
    }
    [lanes.load(&sin), lanes.load(&cos)]
}

/// eˣ − 1 in the lanes `which`.
#[inline(always)]
pub(super) fn exp_m1<F: Float>(x: F, which: <F::Lanes as Lanes>::M) -> F {
    let (lanes, x) = (x.lanes(), x.all());
    let mut exp = [0.0; MOST];
    for k in which.lanes() {
        exp[k] = alone::exp_m1(x[k]);
    }
    lanes.load(&exp)
}

/// ln(1 + x), for numbers of which many are the same.
#[inline(always)]
pub(super) fn ln_1p<F: Float>(x: F) -> F {
    let (lanes, all) = (x.lanes(), x.all());
    let (mut left, mut logarithm) = (lanes.first(F::Lanes::N).bits(), x);
    while left != 0 {
        let k = left.trailing_zeros();
        let number = all[k as usize];
        let same = x.eq(lanes.splat(number));
        logarithm = same.select(lanes.splat(alone::ln_1p(number)), logarithm);
        // NaN is not even the same as itself.
        left &= !(same.bits() | 1 << k);
    }
    logarithm
}

/// Out of line, for one lane of many.
mod alone {
    #[inline(never)]
    pub fn sin_cos(x: f32) -> (f32, f32) {
        x.sin_cos()
    }

    #[inline(never)]
    pub fn exp_m1(x: f32) -> f32 {
        x.exp_m1()
    }

    #[inline(never)]
    pub fn ln_1p(x: f32) -> f32 {
        x.ln_1p()
    }
}
