#![cfg_attr(
    target_arch = "x86_64",
    expect(clippy::print_stderr, reason = "what a test could not look at must be said")
)]

use glam::Vec3;
use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::*;

/// Numbers of every kind, for as many lanes as there may be.
fn numbers(r: &mut StdRng) -> [f32; 32] {
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
    // Of NaN, the sign and the payload are the processor's own.
    to.map(|x| if x.is_nan() { f32::NAN } else { x }.to_bits())
}

fn words_of<const N: usize>(u: impl Unsigned) -> [u32; N] {
    let mut to = [0; N];
    u.store(&mut to);
    to
}

/// All bits: the upper 32, and what is left.
fn halves_of<L: Lanes, const N: usize>(lanes: L, d: L::D) -> [[u32; N]; 2] {
    let known = d.lt(lanes.splat_d(1.0)) | lanes.splat_d(0.0).lt(d);
    let d = known.select(d, lanes.splat_d(0.5));
    let upper = d.upper_half();
    [words_of(upper), bits_of(L::F::from_f64(d - L::D::of_upper_half(upper)))]
}

/// The numbers that all lanes of a test get: of each kind two.
type Given = ([f32; 32], [f32; 32], [u32; 32], [u32; 32]);

/// The results of every operation.
fn results<L: Lanes, const N: usize>(lanes: L, (x, y, u, v): &Given) -> Vec<[u32; N]> {
    let (a, b, scale) = (lanes.load(x), lanes.load(y), x[0]);
    let (i, j, table) = (lanes.load_u(u), lanes.load_u(v), v.first_chunk().unwrap());
    let rows: [&[f32; 8]; 2] = [x[..8].try_into().unwrap(), x[8..16].try_into().unwrap()];
    let (wide, by) = (f64::from(scale), u[1] % 32);
    let some = lanes.mask(u[0]);
    // Of all 53 bits.
    let (d, e) = (a.to_f64() / lanes.splat_d(3.0), b.to_f64() / j.to_f64());
    let floats = [
        a + b,
        a - b,
        a * b,
        a / b,
        -a,
        a * scale,
        lanes.splat(scale),
        a.lanes().splat(scale),
        i.lanes().splat(scale),
        a.min(b),
        a.max(b),
        a.abs(),
        a.copysign(b),
        a.sqrt(),
        a.abs().sqrt(),
        L::F::from_f64(a.to_f64() + b.to_f64()),
        L::F::from_f64(a.to_f64() - b.to_f64()),
        L::F::from_f64(a.to_f64() * b.to_f64()),
        L::F::from_f64(a.to_f64() / b.to_f64()),
        L::F::from_f64((a.to_f64() - wide) * wide),
        L::F::from_f64(L::D::of_upper_half(i)),
        lanes.pick([rows[0], rows[1], rows[0]], 5, i & lanes.splat_u(1)),
        some.select(a, b),
        (i >> 1).to_f32(),
        lanes.numbers(|k| x[k] * y[k]),
        L::F::of_bits(i),
        lanes.load(&a.all()),
    ];
    let doubles = [
        d,
        e,
        d + e,
        d - e,
        d * e,
        d / e,
        (d - wide) * wide,
        d.sqrt(),
        lanes.splat_d(wide / 3.0),
        some.select(d, e),
        i.to_f64(),
        i.to_f64().sqrt(),
        L::D::of_upper_half(i),
    ];
    let masks = [
        a.lt(b),
        a.le(b),
        a.eq(b),
        a.eq(a),
        d.lt(e),
        e.lt(d),
        d.lt(d),
        a.to_f64().lt(b.to_f64()),
        i.lt(j),
        i.eq(j),
        some,
        !some,
        lanes.first(u[0] as usize % 40),
        a.lt(b) & some,
        lanes.condition(|k| x[k] < y[k]),
        a.lt(b) | some,
    ];
    let (low, high) = i.wide_mul(v[1]);
    let records: Vec<_> = (0..32).map(|r| Record(std::array::from_fn(|k| x[k % N] * (r + k) as f32))).collect();
    let places = lanes.load_u(&std::array::from_fn::<_, N, _>(|k| u[k] % 32));
    let mut changed = records.clone();
    let odd = lanes.load_u(&std::array::from_fn::<_, N, _>(|k| 2 * (k as u32 % 16) + 1));
    lanes.put_records(lanes.records(&records, places), &mut changed, odd, some);
    let all = [lanes.records(&records, places), lanes.records(&changed, odd)].concat();
    let floats: Vec<_> = floats.into_iter().chain(all).collect();
    let words = [
        i,
        a.to_bits(),
        lanes.load_u(&i.all()),
        some.select(i, j),
        lanes.splat_u(u[1]),
        i & j,
        i | j,
        i ^ j,
        i << by,
        i >> by,
        // Where the number is known when it is compiled.
        i << 7,
        i >> 16,
        i.wrapping_add(j),
        i.wrapping_mul(j),
        low,
        high,
        i.reverse_bits(),
        i.lookup(table),
        L::D::of_upper_half(i).upper_half(),
        lanes.whole_numbers(|k| u[k] ^ v[k]),
    ];
    let vectors = [
        lanes.splat_v([x[1], x[2], x[3]]),
        lanes.vectors(|k| [x[k], y[k], scale]),
        some.select(L::V::new(a, b, a), L::V::new(b, a, a)),
    ];
    let mut all: Vec<_> = floats.into_iter().map(bits_of).collect();
    all.extend(doubles.into_iter().flat_map(|d| halves_of::<L, N>(lanes, d)));
    all.extend(masks.into_iter().map(|m| std::array::from_fn(|k| m.bits() >> k & 1)));
    all.extend(masks.into_iter().map(|m| [u32::from(m.any()); N]));
    all.extend(words.into_iter().map(words_of::<N>));
    all.extend(vectors.into_iter().flat_map(|v| v.coordinates()).map(bits_of));
    all.extend(masks.into_iter().flat_map(|m| compressed::<L, N>(m, a, i)));

    let alone: Vec<_> = (0..N as u32).map(|k| a.lane(k)).collect();
    assert_eq!(bits_of::<N>(a), bits_of(lanes.load(&alone)), "lane by lane");
    assert_eq!(a.lane(N as u32 + 1).to_bits(), x[1 % N].to_bits());
    let each = lanes.each(|k| (k, u[k]));
    for (k, word) in u.iter().enumerate().take(N) {
        assert_eq!([L::lane(&each, k), L::lane(&each, k + N)], [(k, *word); 2], "lane by lane");
    }
    all
}

/// What the lanes have where `which` holds, and how many these are.
fn compressed<L: Lanes, const N: usize>(which: L::M, a: L::F, i: L::U) -> [[u32; N]; 3] {
    let (mut numbers, mut words) = ([f32::NAN; N], [0; N]);
    a.compress(which, &mut numbers);
    i.compress(which, &mut words);
    let mut lanes = [0; N];
    let mut len = 0;
    for k in which.lanes() {
        lanes[len] = k as u32 + 1;
        len += 1;
    }
    // Behind them there may be anything.
    numbers[len..].fill(0.0);
    words[len..].fill(0);
    [bits_of(a.lanes().numbers(|k| numbers[k])), words, lanes]
}

/// Holds a set of lanes to another, in every operation.
fn agree<L: Lanes, M: Lanes, const N: usize>(lanes: L, others: M) {
    assert_eq!((L::N, M::N), (N, N));
    let mut r = StdRng::seed_from_u64(3);
    for _ in 0..20_000 {
        let (x, y) = (numbers(&mut r), numbers(&mut r));
        // Some of both are the same, some are large.
        let mut name = |_| if r.random() { r.random_range(0..4) } else { r.random() };
        let given = (x, y, std::array::from_fn(&mut name), std::array::from_fn(&mut name));
        let (ours, theirs) = (results::<L, N>(lanes, &given), results::<M, N>(others, &given));
        let first = ours.iter().zip(&theirs).position(|(a, b)| a != b);
        assert_eq!(first, None, "{ours:?} and {theirs:?} of {given:?}");
    }
}

/// Holds the vectors of a set of lanes to glam's.
fn vectors_agree<L: Lanes>(lanes: L) {
    let mut r = StdRng::seed_from_u64(5);
    for _ in 0..20_000 {
        let [ax, ay, az, bx, by, bz, factors]: [[f32; 32]; 7] = std::array::from_fn(|_| numbers(&mut r));
        let of = |x: &[f32; 32], y: &[f32; 32], z: &[f32; 32]| L::V::new(lanes.load(x), lanes.load(y), lanes.load(z));
        let (a, b, c) = (of(&ax, &ay, &az), of(&bx, &by, &bz), lanes.load(&factors));
        let vectors = [a + b, a - b, a * b, a * c, a / c, -a, a.abs(), a.normalize()].map(L::V::coordinates);
        let floats = [a.dot(b), a.max_element(), a.min_element()];
        for k in 0..L::N {
            let (a, b, c) = (Vec3::new(ax[k], ay[k], az[k]), Vec3::new(bx[k], by[k], bz[k]), factors[k]);
            let theirs = [a + b, a - b, a * b, a * c, a / c, -a, a.abs(), a.normalize()];
            let same = |ours: L::F, theirs: f32| {
                let ours = ours.lane(k as u32);
                ours.to_bits() == theirs.to_bits() || ours.is_nan() && theirs.is_nan()
            };
            for (i, (ours, theirs)) in vectors.into_iter().zip(theirs).enumerate() {
                let all = ours.into_iter().zip(theirs.to_array()).all(|(ours, theirs)| same(ours, theirs));
                assert!(all, "vector {i} of {a}, {b} and {c}: {theirs} instead of {ours:?}");
            }
            for (i, (ours, theirs)) in floats.into_iter().zip([a.dot(b), a.max_element(), a.min_element()]).enumerate()
            {
                assert!(same(ours, theirs), "number {i} of {a} and {b}: {theirs} instead of {ours:?}");
            }
        }
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
    let picked =
        lanes.pick([&[5.0; 8], &[6.0; 8], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]], 3, lanes.load_u(&[2, 1, 0, 2]));
    assert_eq!(all(picked), [4.0, 6.0, 5.0, 4.0]);
    assert_eq!([0, 1, 4, 32].map(|n| lanes.first(n).bits()), [0, 1, 15, 15]);
    assert_eq!(all(lanes.mask(0b0101).select(a, b))[..3], [1.0, 0.5, 0.0]);
}

#[test]
fn one_lane_agrees_with_arrays() {
    agree::<_, _, 1>(One, Arrays::<1>);
}

#[test]
fn vectors_agree_with_those_of_glam() {
    vectors_agree(One);
    vectors_agree(Arrays::<4>);
    #[cfg(target_arch = "x86_64")]
    if let Some(eight) = Eight::detect() {
        vectors_agree(eight);
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(sixteen) = Sixteen::detect() {
        vectors_agree(sixteen);
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn eight_lanes_agree_with_arrays() {
    match Eight::detect() {
        Some(eight) => agree::<_, _, 8>(eight, Arrays::<8>),
        None => eprintln!("SKIPPED: this processor has no AVX2"),
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn sixteen_lanes_agree_with_arrays() {
    match Sixteen::detect() {
        Some(sixteen) => {
            agree::<_, _, 16>(sixteen, Arrays::<16>);
            agree::<_, _, 8>(sixteen.eight(), Arrays::<8>);
        }
        None => eprintln!("SKIPPED: this processor has no AVX-512"),
    }
}
