//! The white furnace: a surface that absorbs nothing sends back all of a uniform light, at every roughness, index and angle.
//!
//! Oracle: 1, and no table of ours: weights f cos/pdf of samples, whose numbers fill the unit cube evenly. It would catch a lobe that
//! is missing or counted twice, a base that is not divided by the mean of what reaches it, and tables that are wrong or too coarse.

use super::*;

const ROUGHNESS: [f32; 10] = [0.0, 0.032, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0];
const COSINES: [f32; 9] = [1.0, 0.9, 0.7, 0.45, 0.3, 0.1, 0.03, 0.01, 0.001];

/// The directional albedo from `n` evenly spread samples of the BSDF and as many that are dense at grazing angles, where light after
/// several facets of a nearly smooth surface is: each sample over the sum of both densities (the balance heuristic, Veach 9.2).
fn albedo(bsdf: &Bsdf, known: Vec3, transport: Transport, n: u32) -> f64 {
    let steps = [0.819_172_513_396_164_5, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    let sides = if bsdf.continuous_transmits() { 2.0 } else { 1.0 };
    // cos θ = z³ and any azimuth.
    let grazing_pdf = |cos: f64| 1.0 / (6.0 * std::f64::consts::PI * cos.powf(2.0 / 3.0) * sides);
    let weigh = |direction: Vec3, scatter: Scatter| {
        let pdf = f64::from(scatter.forward_reverse(transport).0.0) + grazing_pdf(f64::from(direction.z.abs()));
        power(bsdf, transport, transport.sides(known, direction), f64::from(scatter.f.y) / pdf)
    };
    let weights = (0..n).map(|i| {
        let u = steps.map(|step| (0.5 + step * f64::from(i)).fract());
        let by_bsdf = Vec3::from_array(u.map(|u| u as f32)).min(Vec3::splat(1.0 - f32::EPSILON / 2.0));
        let own = bsdf.sample(known, transport, by_bsdf).map_or(0.0, |s| match s.lobe {
            Lobe::Continuous => weigh(s.direction, s.scatter),
            // Of a delta, f and the density are coefficients of one measure, which cancels.
            Lobe::Delta(_) => {
                let f = f64::from(s.scatter.f.y) / f64::from(s.scatter.forward_reverse(transport).0.0);
                power(bsdf, transport, transport.sides(known, s.direction), f)
            }
        });
        let cos = u[0].powi(3) as f32;
        let (y, x) = (u[1] * std::f64::consts::TAU).sin_cos();
        let side = if u[2] < 1.0 / sides { known.z.signum() } else { -known.z.signum() };
        let sin = f64::from(1.0 - cos * cos).max(0.0).sqrt();
        let direction = Vec3::new((sin * x) as f32, (sin * y) as f32, cos * side);
        let (to_camera, to_light) = transport.sides(known, direction);
        own + weigh(direction, bsdf.eval(Lobe::Continuous, to_camera, to_light))
    });
    weights.sum::<f64>() / f64::from(n)
}

/// Asserts that all that `bsdfs` make of white light is white, and returns the least and the largest albedo.
fn assert_white(bsdfs: impl Iterator<Item = Bsdf>) -> (f64, f64) {
    let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
    let mut wrong = Vec::new();
    for (number, bsdf) in bsdfs.enumerate() {
        for (i, cos) in COSINES.into_iter().enumerate() {
            for side in [1.0, -1.0] {
                if side < 0.0 && !bsdf.continuous_transmits() {
                    continue;
                }
                let known = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, side * cos);
                let transport = TRANSPORTS[(number + i) % 2];
                let white = 0.996..1.001;
                let mut found = albedo(&bsdf, known, transport, 2048);
                for n in [16384, 65536] {
                    if !white.contains(&found) {
                        found = albedo(&bsdf, known, transport, n);
                    }
                }
                if !(0.995..=1.002).contains(&found) {
                    wrong.push(format!("{bsdf:?}, {transport:?} from cos θ = {cos}, side {side}: {found}"));
                }
                (least, largest) = (least.min(found), largest.max(found));
            }
        }
    }
    assert!(wrong.is_empty(), "{} are not white:\n{}", wrong.len(), wrong.join("\n"));
    (least, largest)
}

#[test]
fn white_plastic_and_metal_lose_nothing() {
    let mut bsdfs = Vec::new();
    for alpha in ROUGHNESS.map(|roughness| roughness * roughness) {
        for metallic in [0.0, 0.3, 1.0] {
            // Indices 1, 1.5, 2.4 and infinite, and half of `specular`.
            for (f0, f90) in [(0.0, 1.0), (0.04, 1.0), (0.17, 1.0), (1.0, 1.0), (0.02, 0.5), (1.0, 0.3)] {
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
    println!("{:?}", assert_white(bsdfs.into_iter()));
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
    println!("{:?}", assert_white(bsdfs.into_iter()));
}

/// What no white surface shows: a tinted metal darkens by its own colour between facets, as Kulla & Conty's series has it.
#[test]
fn light_between_facets_takes_on_the_colour_of_a_metal() {
    let metal = |color| Bsdf::MetallicRoughness(MetallicRoughness::metal(Rgb::splat(color), 1.0));
    let known = Vec3::Z;
    // E₁ = 1 − ln 2 towards the normal; F_avg = c + (1 − c)/21; E₁'s mean from the furnace of a white metal, E₁ + (1 − E₁) = 1.
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
