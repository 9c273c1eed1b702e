use std::thread;

use proptest::{collection::vec, prelude::*};

use super::*;

/// Digits of 32 bits, each with room for all carries until it is asked for: a sum as one would write it by hand.
#[derive(Clone, Default)]
struct ByHand([i128; 10]);

impl ByHand {
    fn of(values: &[f32]) -> Self {
        let mut sum = Self::default();
        for value in values {
            // f64 has all bits of an f32, subnormal or not, as a normal number.
            let bits = f64::from(*value).to_bits();
            let exponent = (bits >> 52 & 0x7ff) as i32 - 1075;
            let mantissa = i128::from(bits & ((1 << 52) - 1) | 1 << 52);
            let sign = if *value < 0.0 { -1 } else { 1 };
            if *value != 0.0 {
                // Of its 53 bits those below the smallest f32 are zeros.
                let (mantissa, place) = (mantissa >> 29, exponent + 29 + 149);
                let (mantissa, place) = if place < 0 { (mantissa >> -place, 0) } else { (mantissa, place) };
                sum.0[place as usize / 32] += sign * (mantissa << (place % 32));
            }
        }
        sum
    }

    fn words(mut self) -> [u64; 5] {
        for i in 0..10 {
            if i < 9 {
                self.0[i + 1] += self.0[i] >> 32;
            }
            self.0[i] &= 0xffff_ffff;
        }
        std::array::from_fn(|i| (self.0[2 * i] | self.0[2 * i + 1] << 32) as u64)
    }
}

fn plane(exponent: i32) -> Plane {
    Plane::new(FixedPoint::with_exponent(exponent), 3)
}

fn add(plane: &Plane, values: &[f32]) {
    values.iter().for_each(|value| assert_eq!(plane.add(1, [0.0, *value, -0.0]), 0));
}

fn added(exponent: i32, values: &[f32]) -> Plane {
    let plane = plane(exponent);
    add(&plane, values);
    plane
}

/// Any finite f32, and more often than by their bits those that are alike, so that sums of theirs run over.
fn finite() -> impl Strategy<Value = f32> {
    let any = any::<u32>().prop_map(f32::from_bits);
    let extreme = prop::sample::select(vec![f32::MAX, f32::MIN, f32::from_bits(1), -f32::from_bits(1), 0.0, -0.0]);
    prop_oneof![2 => any, 2 => -10.0_f32..10.0, 1 => extreme].prop_filter("finite", |value| value.is_finite())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_finite_f32_counts_exactly_in_any_order(
        values in vec((finite(), 1_usize..40), 1..40),
        exponents in (-200..200, -200..200),
        seed in any::<u64>(),
    ) {
        let mut values: Vec<_> = values.into_iter().flat_map(|(value, times)| vec![value; times]).collect();
        let expected = ByHand::of(&values).words();
        let first = added(exponents.0, &values);
        prop_assert_eq!(first.sum(1, 1).words(), expected);
        prop_assert!(first.sum(1, 0).is_zero() && first.sum(1, 2).is_zero() && first.sum(0, 1).is_zero());

        // In another order, in another place, from threads, and in parts that are put together.
        values.sort_by_key(|value| u64::from(value.to_bits()).wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let second = plane(exponents.1);
        thread::scope(|scope| {
            for part in values.chunks(values.len().div_ceil(3)) {
                scope.spawn(|| add(&second, part));
            }
        });
        prop_assert_eq!(second.sum(1, 1).words(), expected);
        let (a, b) = values.split_at(values.len() / 2);
        let parts = added(exponents.0, a);
        prop_assert_eq!(parts.add_sum(1, 1, added(exponents.1, b).sum(1, 1)), Ok(()));
        prop_assert_eq!(parts.sum(1, 1).words(), expected);
        // Whatever the parts are, their value is that of the sum.
        prop_assert_eq!(parts.value(1)[1], first.sum(1, 1).to_f64());
        let halves = (added(exponents.0, a), added(exponents.0, b));
        prop_assert_eq!(halves.0.value_with(&halves.1, 1)[1], first.sum(1, 1).to_f64());
        // It can be undone.
        values.iter().for_each(|value| assert_eq!(second.add(1, [0.0, -value, 0.0]), 0));
        prop_assert!(second.sum(1, 1).is_zero());
        prop_assert_eq!(second.value(1)[1], 0.0);
    }
}

#[test]
fn carries_of_either_sign_spill() {
    // The largest deposits that a word takes, and then fine ones: 2⁶¹ quanta, and 2⁵⁵ fine units of which 2⁸ fill a
    // word.
    for (value, times) in [(2.0_f32.powi(61), 100), (2.0_f32.powi(23) - 0.5, 2000)] {
        for sign in [1.0, -1.0] {
            let plane = plane(0);
            for n in 1..=times {
                add(&plane, &[sign * value]);
                assert_eq!(plane.sum(1, 1), product(sign * value, n), "{n} · {}", sign * value);
            }
            let spilt = plane.wide.get(1).is_some();
            assert_eq!(spilt, value > 1e9, "fine words spill into words");
            // Back over the same edges and as far to the other side.
            for n in (-times..times).rev() {
                add(&plane, &[-sign * value]);
                assert_eq!(plane.sum(1, 1), product(sign * value, n), "{n} · {}", sign * value);
            }
        }
    }
}

fn product(value: f32, n: i32) -> ExactSum {
    let (mantissa, place) = integer(value);
    ExactSum::shifted(i128::from(mantissa) * i128::from(n), place)
}

#[test]
fn common_deposits_take_a_word_and_only_what_is_far_from_them_takes_more() {
    let scale = FixedPoint::for_radiance(1.0);
    let plane = Plane::new(scale, 1000);
    let empty = plane.memory();
    assert_eq!(empty.1, 0);
    for typical in [1.0, 0.3, 1e-6, -1e5] {
        assert_eq!(plane.add(500, [typical; 3]), 0);
    }
    assert_eq!(plane.memory(), empty);
    assert_eq!(plane.add(500, [1e-9, 0.0, 0.0]), 0);
    assert_eq!(plane.memory(), (empty.0 + 64 * 24, 0));
    assert_eq!(plane.add(500, [0.0, 1e-30, 0.0]), 0);
    let wide = 8 * 3 * 40;
    assert_eq!(plane.memory(), (empty.0 + 64 * 24 + wide, wide));
    assert_eq!(wide, Plane::WIDEST);
    assert_eq!(plane.add(500, [0.0, 1e30, 0.0]), 0);
    assert_eq!(plane.memory().1, wide);
}

#[test]
fn sums_without_room_are_said() {
    let plane = plane(0);
    let most = ExactSum::from_words([u64::MAX, u64::MAX, u64::MAX, u64::MAX, i64::MAX as u64]);
    assert_eq!(plane.add_sum(1, 1, most), Ok(()));
    assert_eq!(plane.sum(1, 1), most);
    assert_eq!(plane.add_sum(1, 1, ExactSum::of(f32::from_bits(1)).unwrap()), Err(Overflow));
    assert_eq!(plane.add_sum(2, 1, ExactSum::of(1.0).unwrap()), Ok(()));
    assert_eq!(plane.value(2)[1], 1.0);
}
