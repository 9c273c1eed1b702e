//! What a rough base lacks under layers, and the means of products over all directions.
//!
//! Under layers that let t(θ) through, min(t(θ), t(θ′)) f has the albedo t(θ) − D(θ), D(θ) = ∫ (t(θ) − t(θ′))⁺ f cos θ′
//! dω′ for a base that reflects everything: light that meets the layers from below at lower angles than it came in.
//! They send it back, and it finds its way out as D(θ) D(θ′)/D̄: reciprocal, and white again.
//!
//! Of a base that reflects less, D is as much less. It needs the distribution of θ′ only, by quantiles that are denser
//! at low angles, which a table has over θ and α: of what facets reflect as at normal incidence, with what leaves after
//! several of them, and of what they reflect because they are met at a grazing angle (Schlick's weight), which is at
//! lower angles.

use std::{f32::consts::FRAC_PI_2, sync::LazyLock};

use glam::Vec3;

use super::{
    Averages, End, Part, Stack,
    base::{grazing_part, mirror},
    facets::Facets,
};
use crate::{
    math::Rgb,
    sampling::warp,
    scene::bsdf::{albedo::Split, fresnel::schlick_power, layer::product_lobe},
};

/// The lobe that gives it back.
pub(super) struct Spread;

impl Part for Spread {
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb {
        if s.averages.spread == 0.0 {
            return Rgb::ZERO;
        }
        s.tint * product_lobe(a.spread, b.spread, s.averages.spread) * (a.tint * b.tint)
    }

    fn weight(&self, _: &Stack, from: &End) -> f32 {
        from.spread
    }

    fn sample(&self, _: &Stack, _: &End, [u, v, _]: [f32; 3]) -> Vec3 {
        warp::cosine_hemisphere([u, v])
    }

    fn density(&self, _: &Stack, _: &End, to: &End) -> f32 {
        warp::cosine_hemisphere_pdf(to.up.z).0
    }
}

/// D of a base that reflects everything, towards a direction of this cosine, in which its light has this split; nothing
/// under a tilted coat, which loses light anyway.
pub(super) fn lacking(s: &Stack, cos: f32, split: &Split) -> f32 {
    if s.coat_axes.is_some() || s.surface.coat == 0.0 && s.sheen_cover == 0.0 {
        return 0.0;
    }
    let (t, grazing) = (s.through(cos), grazing_part(s, split));
    let lacks = |alpha: f32| {
        let of = |kind: usize| {
            let parts = quantiles(cos, alpha, kind).map(|cos| (t - s.through(cos)).max(0.0));
            (0..PARTS).map(|k| parts[k] * (share(k + 1) - share(k))).sum::<f32>()
        };
        // What hardly counts is not looked up.
        if grazing < 0.01 { of(0) } else { of(0) + (of(1) - of(0)) * grazing }
    };
    let Facets { x, y } = s.facets;
    // With a grain the less of both: never more is given back than what lacks.
    if x == y { lacks(x) } else { lacks(x).min(lacks(y)) }
}

/// The cosine-weighted means of what passes to the diffuse base, and of D.
pub(super) fn averages(s: &Stack) -> Averages {
    const COSINES: u8 = 16;
    let turns: u8 = if s.surface.anisotropy > 0.0 { 4 } else { 1 };
    let (mut passed, mut spread) = (0.0, 0.0);
    for i in 0..COSINES {
        let square = (f32::from(i) + 0.5) / f32::from(COSINES);
        let (cos, sin) = (square.sqrt(), (1.0 - square).sqrt());
        let through = s.through(cos);
        for j in 0..turns {
            let phi = s.surface.tangent + (f32::from(j) + 0.5) / f32::from(turns) * FRAC_PI_2;
            let end = s.end(Vec3::new(sin * phi.cos(), sin * phi.sin(), cos));
            passed += end.passed * through / f32::from(turns);
            spread += end.spread / f32::from(turns);
        }
    }
    let n = f32::from(COSINES);
    let is_plain = s.surface.coat == 0.0 && s.sheen_cover == 0.0 && s.film.is_none();
    if is_plain && turns == 1 {
        passed = n * s.interface.passed(s.average, s.interface_multiple);
    }
    Averages { passed: passed / n, spread: spread / n }
}

/// So many parts, part k of them from [`share`]`(k)` of all light on, beginning with the lowest angles.
const PARTS: usize = 8;

fn share(k: usize) -> f32 {
    let x = k as f32 / PARTS as f32;
    x * x
}

/// Columns of the table, over √cos θ, and rows, over √α.
const COLUMNS: usize = 20;
const ROWS: usize = 12;
/// The least cosine and the least √α in it.
const LEAST_COS: f32 = 1e-3;
const LEAST_ROOT: f32 = 0.0325;

/// The mean cosine of each part, for a white base of this α that is met at this cosine: of what it reflects as at
/// normal incidence (0), and for being met at a grazing angle (1).
fn quantiles(cos: f32, alpha: f32, kind: usize) -> [f32; PARTS] {
    static TABLE: LazyLock<Vec<[[f32; PARTS]; 2]>> = LazyLock::new(table);
    let place = |x: f32, n: usize| {
        let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
        let i = (x as usize).min(n - 2);
        (i, x - i as f32)
    };
    let root = (alpha.sqrt() - LEAST_ROOT) / (1.0 - LEAST_ROOT);
    let ((i, u), (j, v)) = (place(cos.sqrt(), COLUMNS), place(root, ROWS));
    let at = |i: usize, j: usize| TABLE[j * COLUMNS + i][kind];
    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
    std::array::from_fn(|k| {
        let (low, high) = (a[k] + (b[k] - a[k]) * u, c[k] + (d[k] - c[k]) * u);
        (cos + low + (high - low) * v).clamp(0.0, 1.0)
    })
}

/// The quantiles' distances from the cosine: none for a mirror.
fn table() -> Vec<[[f32; PARTS]; 2]> {
    let entry = |k: usize| {
        let (i, j) = (k % COLUMNS, k / COLUMNS);
        let root_cos = i as f32 / (COLUMNS - 1) as f32;
        let root_alpha = LEAST_ROOT + (1.0 - LEAST_ROOT) * j as f32 / (ROWS - 1) as f32;
        let cos = (root_cos * root_cos).max(LEAST_COS);
        distributions(cos, root_alpha * root_alpha).map(|parts| parts.map(|quantile| quantile - cos))
    };
    (0..ROWS * COLUMNS).map(entry).collect()
}

/// The mean cosine of each part, by facets visible from there and by what leaves after several of them.
fn distributions(cos: f32, alpha: f32) -> [[f32; PARTS]; 2] {
    const N: usize = 32;
    let facets = Facets { x: alpha, y: alpha };
    let from = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let [mut normal, mut grazing] = [(); 2].map(|()| Vec::with_capacity(N * N + N));
    for k in 0..N * N {
        let u = [(k % N) as f32 + 0.5, (k / N) as f32 + 0.5].map(|x| x / N as f32);
        let to = mirror(from, facets.sample_visible(from, u));
        let facet = facets.reflect(from, to);
        if facet.forward > 0.0 {
            let (weight, power) = (facet.value * to.z / facet.forward / (N * N) as f32, schlick_power(facet.cos));
            normal.push((to.z, weight * (1.0 - power)));
            grazing.push((to.z, weight * power));
        }
    }
    let (own, average) = (Split::towards(cos, alpha).missing, Split::average(alpha).missing);
    for k in 0..N {
        let root = ((k as f32 + 0.5) / N as f32).sqrt();
        let of_lobe = Split::towards(root, alpha).missing / average;
        normal.push((root, if average > 0.0 { own * of_lobe / N as f32 } else { 0.0 }));
    }
    // Met along its normal, a smooth one has no such light.
    let has_grazing = grazing.iter().any(|(_, weight)| *weight > 0.0);
    [normal.clone(), if has_grazing { grazing } else { normal }].map(parts_of)
}

/// The mean cosine of each part of light that leaves at these cosines with these weights.
fn parts_of(mut light: Vec<(f32, f32)>) -> [f32; PARTS] {
    light.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total = light.iter().map(|(_, weight)| weight).sum::<f32>().max(f32::MIN_POSITIVE);
    let (mut sums, mut below, mut part) = ([0.0; PARTS], 0.0, 0);
    for (cos, weight) in light {
        let mut left = weight / total;
        while left > 0.0 {
            let room = if part + 1 < PARTS { share(part + 1) - below } else { left };
            let here = left.min(room.max(0.0));
            sums[part] += cos * here;
            (below, left) = (below + here, left - here);
            part += usize::from(left > 0.0);
        }
    }
    std::array::from_fn(|k| sums[k] / (share(k + 1) - share(k)))
}
