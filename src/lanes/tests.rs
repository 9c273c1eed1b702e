#![cfg_attr(
    target_arch = "x86_64",
    expect(clippy::print_stderr, reason = "what a test could not look at must be said")
)]

use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::*;

/// Numbers of every kind.
fn numbers<const N: usize>(r: &mut StdRng) -> [f32; N] {
    const SPECIAL: [f32; 12] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        f32::MIN_POSITIVE,
        1e-42,
        f32::MAX,
        0.1,
        16_777_217.0,
    ];
    std::array::from_fn(|_| match r.random_range(0..4) {
        0 => SPECIAL[r.random_range(0..SPECIAL.len())],
        1 => f32::from_bits(r.random()),
        _ => r.random_range(-2.0..2.0),
    })
}

fn bits_of<const N: usize>(x: impl Float) -> [u32; N] {
    let mut to = [0.0; N];
    x.store(&mut to);
    // Of no number, the sign and the payload are the processor's own.
    to.map(|x| if x.is_nan() { f32::NAN } else { x }.to_bits())
}

/// The results of every operation.
fn results<L: Lanes, const N: usize>(lanes: L, x: [f32; N], y: [f32; N], u: [u32; N], v: [u32; N]) -> Vec<[u32; N]> {
    let (a, b, scale) = (lanes.load(&x), lanes.load(&y), x[0]);
    let (i, j) = (lanes.load_u(&u), lanes.load_u(&v));
    let wide = f64::from(scale);
    let some = lanes.mask(u[0]);
    let floats = [
        a + b,
        a - b,
        a * b,
        a / b,
        -a,
        a * scale,
        lanes.splat(scale),
        a.min(b),
        a.max(b),
        a.abs(),
        a.copysign(b),
        L::F::from_f64(a.to_f64() + b.to_f64()),
        L::F::from_f64(a.to_f64() - b.to_f64()),
        L::F::from_f64(a.to_f64() * b.to_f64()),
        L::F::from_f64(a.to_f64() / b.to_f64()),
        L::F::from_f64((a.to_f64() - wide) * wide),
        lanes.pick([x[1], x[2], x[3]], i),
        some.select(a, b),
    ];
    let masks = [a.lt(b), a.le(b), a.eq(b), a.eq(a), i.lt(j), i.eq(j), some, !some, lanes.first(u[0] as usize % 40)];
    let both = [a.lt(b) & some, a.lt(b) | some];
    let alone: Vec<_> = (0..N as u32).map(|k| a.lane(k)).collect();
    assert_eq!(bits_of::<N>(a), bits_of(lanes.load(&alone)), "lane by lane");
    let names = [i, some.select(i, j), lanes.splat_u(u[1])];
    let mut all: Vec<_> = floats.into_iter().map(bits_of).collect();
    all.extend(masks.into_iter().chain(both).map(|m| std::array::from_fn(|k| m.bits() >> k & 1)));
    all.push([u32::from(some.any()); N]);
    all.extend(names.into_iter().map(|u| {
        let mut to = [0; N];
        u.store(&mut to);
        to
    }));
    all
}

/// Holds a set of lanes to [`Arrays`], in every operation.
fn agrees_with_arrays<L: Lanes, const N: usize>(lanes: L) {
    assert_eq!(L::N, N);
    let mut r = StdRng::seed_from_u64(3);
    for _ in 0..20_000 {
        let (x, y) = (numbers(&mut r), numbers(&mut r));
        // Some of both are the same, some are large.
        let mut name = |_| if r.random() { r.random_range(0..4) } else { r.random() };
        let (u, v) = (std::array::from_fn(&mut name), std::array::from_fn(&mut name));
        let (ours, theirs) = (results::<L, N>(lanes, x, y, u, v), results(Arrays::<N>, x, y, u, v));
        assert_eq!(ours, theirs, "of {x:?}, {y:?}, {u:?} and {v:?}");
    }
}

#[test]
fn arrays_do_to_each_lane_what_scalars_do() {
    let lanes = Arrays::<4>;
    let (a, b) = (lanes.load(&[1.0, -2.0, 0.0, f32::NAN]), lanes.load(&[3.0, 0.5, -0.0, 7.0]));
    let all = |x: Each<f32>| bits_of::<4>(x).map(f32::from_bits);
    type Each<T> = arrays::Each<T, 4>;
    assert_eq!(all(a + b)[..3], [4.0, -1.5, 0.0]);
    assert_eq!(all(a / b)[..2], [1.0 / 3.0, -4.0]);
    assert_eq!(all(a.copysign(b))[..3], [1.0, 2.0, -0.0]);
    // Beside no number it is the second that is taken.
    assert_eq!((all(a.min(b))[3], all(a.max(b))[3]), (7.0, 7.0));
    assert_eq!((a.lt(b).bits(), a.le(b).bits(), a.eq(a).bits()), (0b0011, 0b0111, 0b0111));
    let picked = lanes.pick([5.0, 6.0, 7.0], lanes.load_u(&[2, 1, 0, 6]));
    assert_eq!(all(picked), [7.0, 6.0, 5.0, 7.0]);
    assert_eq!([0, 1, 4, 32].map(|n| lanes.first(n).bits()), [0, 1, 15, 15]);
    assert_eq!(all(lanes.mask(0b0101).select(a, b))[..3], [1.0, 0.5, 0.0]);
}

#[cfg(target_arch = "x86_64")]
#[test]
fn eight_lanes_agree_with_arrays() {
    match Eight::detect() {
        Some(eight) => agrees_with_arrays::<_, 8>(eight),
        None => eprintln!("SKIPPED: this processor has no AVX2"),
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn sixteen_lanes_agree_with_arrays() {
    match Sixteen::detect() {
        Some(sixteen) => {
            agrees_with_arrays::<_, 16>(sixteen);
            agrees_with_arrays::<_, 8>(sixteen.eight());
        }
        None => eprintln!("SKIPPED: this processor has no AVX-512"),
    }
}
