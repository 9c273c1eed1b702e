//! The white furnace: a surface that absorbs nothing sends back all of a uniform light, at every roughness, index and
//! angle.
//!
//! Oracle: 1, and no table of ours: weights f cos/pdf of samples. It would catch a lobe that is missing or counted
//! twice, a base that is not divided by the mean of what reaches it, and tables that are wrong or too coarse.

use super::*;

const ROUGHNESS: [f32; 10] = [0.0, 0.032, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0];
const COSINES: [f32; 9] = [1.0, 0.9, 0.7, 0.45, 0.3, 0.1, 0.03, 0.01, 0.001];

/// The directional albedo from the first `n` points of an Owen-scrambled Sobol sequence.
fn albedo(bsdf: &Bsdf, known: Vec3, transport: Transport, n: u32) -> f64 {
    let weights = (0..n).map(|i| {
        let u = Vec3::from_array([0, 1, 2].map(|dimension| sobol_burley::sample(i, dimension, 17)));
        bsdf.sample(known, transport, u).map_or(0.0, |s| {
            let f = f64::from(s.scatter.f.g()) / f64::from(s.scatter.forward_reverse(transport).0.0);
            power(bsdf, transport, transport.sides(known, s.direction), f)
        })
    });
    weights.sum::<f64>() / f64::from(n)
}

/// Asserts that all that `bsdfs` make of white light is white.
fn assert_white(bsdfs: impl Iterator<Item = Bsdf>) {
    let mut wrong = Vec::new();
    for (number, bsdf) in bsdfs.enumerate() {
        if wrong.len() > 9 {
            break; // and be no slower than where all is right
        }
        for (i, cos) in COSINES.into_iter().enumerate() {
            for side in [1.0, -1.0] {
                if side < 0.0 && !bsdf.continuous_transmits() {
                    continue;
                }
                let known = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, side * cos);
                let transport = TRANSPORTS[(number + i) % 2];
                let white = 0.9965..1.0012;
                let mut found = albedo(&bsdf, known, transport, 1024);
                for n in [4096, 16384, 65536] {
                    if !white.contains(&found) {
                        found = albedo(&bsdf, known, transport, n);
                    }
                }
                if !(0.995..=1.002).contains(&found) {
                    wrong.push(format!("{bsdf:?}, {transport:?} from cos θ = {cos}, side {side}: {found}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "not white, of these or more:\n{}", wrong.join("\n"));
}

#[test]
fn white_plastic_and_metal_lose_nothing() {
    let mut bsdfs = Vec::new();
    for alpha in ROUGHNESS.map(|roughness| roughness * roughness) {
        for metallic in [0.0, 0.3, 1.0] {
            // Indices 1, 1.5, 2.4 and infinite, half of `specular`, and that with a tint beyond white.
            for (f0, f90) in [(0.0, 1.0), (0.04, 1.0), (0.17, 1.0), (1.0, 1.0), (0.02, 0.5), (0.5, 0.5)] {
                bsdfs.push(Bsdf::MetallicRoughness(MetallicRoughness {
                    base_color: Rgb::ONE,
                    metallic,
                    alpha,
                    dielectric_f0: Rgb::splat(f0),
                    dielectric_f90: f90,
                }));
            }
        }
    }
    assert_white(bsdfs.into_iter());
}

#[test]
fn rough_glass_and_panes_lose_nothing() {
    let mut bsdfs = Vec::new();
    let color = Rgb::ONE;
    for alpha in ROUGHNESS.map(|roughness| roughness * roughness) {
        for ior in [0.34, 0.66, 0.89, 0.98, 1.002, 1.03, 1.13, 1.33, 1.5, 1.8, 2.4, 3.0] {
            bsdfs.push(Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission: 1.0 }));
        }
        for ior in [1.0, 1.5, 2.4] {
            for transmission in [0.4, 1.0] {
                bsdfs.push(Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission }));
                bsdfs.push(Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission: 0.8 * transmission }));
            }
        }
    }
    assert_white(bsdfs.into_iter());
}

/// What no white surface shows: a tinted metal darkens by its own colour between facets, as Kulla & Conty's series has
/// it.
#[test]
fn light_between_facets_takes_on_the_colour_of_a_metal() {
    let metal = |color| Bsdf::MetallicRoughness(MetallicRoughness::metal(Rgb::splat(color), 1.0));
    let known = Vec3::Z;
    // E₁ = 1 − ln 2 towards the normal; F_avg = c + (1 − c)/21; E₁'s mean from the furnace of a white metal, E₁ + (1 −
    // E₁) = 1.
    let average = f64::from(albedo::Split::average(1.0).missing);
    for color in [0.2_f32, 0.5, 0.9] {
        let c = f64::from(color);
        let fresnel = c + (1.0 - c) / 21.0;
        // Reflections one after the other: each reflects F and lets the mean part out.
        let (mut between, mut out) = (fresnel, 0.0);
        for _ in 0..1000 {
            out += between * fresnel * (1.0 - average);
            between *= fresnel * average;
        }
        let split = albedo::Split::towards(1.0, 1.0);
        let once = c * f64::from(split.normal) + f64::from(split.grazing);
        let expected = once + out * f64::from(split.missing);
        let found = albedo(&metal(color), known, Transport::Radiance, 65536);
        assert!((found - expected).abs() < 2e-3, "{color}: {found}, not {expected}");
    }
}
