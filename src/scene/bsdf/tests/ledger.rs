//! The flux ledger of an interface: what arrives is reflected, transmitted or absorbed, whichever way a walk goes.
//!
//! Oracle: Fresnel's equations, Schlick's and Lambert's in f64, and the reciprocity of flux: from a direction the same
//! parts are reflected and transmitted by walks of radiance, with the η² that they gain (Veach 5.2), and of importance,
//! without. It would catch an η² on the wrong side or missing, a transmittance that forgets its tint, and a loss at the
//! critical angle.

use super::*;

/// Unpolarised Fresnel reflectance at |cos θ| for the relative index η across, 1 under total reflection.
pub(in crate::scene::bsdf) fn reflectance(cos: f64, eta: f64) -> f64 {
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let inside = (1.0 - sin2).sqrt();
    let s = (cos - eta * inside) / (cos + eta * inside);
    let p = (eta * cos - inside) / (eta * cos + inside);
    0.5 * (s * s + p * p)
}

/// Parts of the flux from `known` in one channel: reflected and transmitted, each with its standard error.
fn parts(bsdf: &Bsdf, transport: Transport, known: Vec3, channel: usize, random: &mut Independent) -> [(f64, f64); 2] {
    const SAMPLES: u32 = 20_000;
    let mut sums = [(0.0, 0.0); 2];
    for _ in 0..SAMPLES {
        let Some(sample) = bsdf.sample(known, transport, random.next_3d()) else { continue };
        let (pdf, _) = sample.scatter.forward_reverse(transport);
        let sides = transport.sides(known, sample.direction);
        let w = power(bsdf, transport, sides, f64::from(sample.scatter.f[channel]) / f64::from(pdf.0));
        let sum = &mut sums[usize::from(known.z * sample.direction.z < 0.0)];
        *sum = (sum.0 + w, sum.1 + w * w);
    }
    let n = f64::from(SAMPLES);
    sums.map(|(sum, squares)| {
        let mean = sum / n;
        (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt())
    })
}

/// The parts that are known: of everything smooth, and Lambert's.
fn known_parts(bsdf: &Bsdf, known: Vec3, channel: usize) -> [Option<f64>; 2] {
    let cos = f64::from(known.z.abs());
    match bsdf {
        Bsdf::Diffuse(d) => [Some(f64::from(d.albedo[channel])), Some(0.0)],
        Bsdf::MetallicRoughness(m) if m.alpha == 0.0 && m.metallic == 1.0 => {
            let f0 = f64::from(m.base_color[channel]);
            [Some(f0 + (1.0 - f0) * (1.0 - cos).powi(5)), Some(0.0)]
        }
        Bsdf::MetallicRoughness(_) => [None, Some(0.0)],
        Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission }) if *alpha == 0.0 => {
            let eta = if known.z > 0.0 { f64::from(*ior) } else { 1.0 / f64::from(*ior) };
            let r = reflectance(cos, eta);
            let passed = (1.0 - r) * f64::from(color[channel] * *transmission);
            [(*transmission == 1.0).then_some(r), Some(passed)]
        }
        Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission }) if *alpha == 0.0 => {
            let r = reflectance(cos, f64::from(*ior));
            let passed = (1.0 - r) * f64::from(color[channel] * *transmission);
            [(*transmission == 1.0).then_some(r), Some(passed)]
        }
        _ => [None, None],
    }
}

#[test]
fn flux_is_reflected_transmitted_or_absorbed() {
    let (mut number, mut closed_forms) = (0, 0);
    for (name, bsdf) in table() {
        for known in known_directions() {
            let channel = number as usize % 3;
            let [radiance, importance] = TRANSPORTS.map(|transport| {
                number += 1;
                parts(&bsdf, transport, known, channel, &mut Independent::new(2, number, 0, Stream::Camera))
            });
            let truth = known_parts(&bsdf, known, channel);
            for (i, part) in ["reflected", "transmitted"].into_iter().enumerate() {
                let ((a, a_error), (b, b_error)) = (radiance[i], importance[i]);
                let error = a_error.hypot(b_error);
                assert!((a - b).abs() < 5.0 * error + 1e-4, "{name} from {known}: {part} {a} and {b} ± {error}");
                if let Some(truth) = truth[i] {
                    closed_forms += 1;
                    for (x, e) in [(a, a_error), (b, b_error)] {
                        assert!((x - truth).abs() < 5.0 * e + 1e-4, "{name} from {known}: {part} {x}, not {truth}");
                    }
                }
            }
            let absorbed = 1.0 - radiance[0].0 - radiance[1].0;
            let error = radiance[0].1.hypot(radiance[1].1);
            assert!(absorbed > -5.0 * error - 1e-4, "{name} from {known}: absorbs {absorbed}");
        }
    }
    assert!(closed_forms > 100, "{closed_forms}");
}
