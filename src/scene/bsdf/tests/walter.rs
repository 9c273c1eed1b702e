//! The values of a rough dielectric's lobes against their formulas, in f64 and with angles and tangents where the code
//! has neither.
//!
//! Oracle: Walter et al. 2007, eqs. 20 (reflection), 21 (refraction) and 33 (D), with Smith's Λ of Heitz 2014, eqs. 72
//! and 99. It would catch a wrong shadowing, Jacobian or η² in a value: densities and bounds on the energy see none
//! that only darkens.

use glam::DVec3;

use super::{ledger::reflectance, *};

/// f for unit directions on the glass's two sides, index 1 above and `ior` below, towards `o` from `i`, 1/sr.
fn value(ior: f64, alpha: f64, tint: f64, o: DVec3, i: DVec3) -> f64 {
    let eta = |w: DVec3| if w.z > 0.0 { 1.0 } else { ior };
    let (eta_o, eta_i) = (eta(o), eta(i));
    let refracts = o.z * i.z < 0.0;
    let half = if refracts { o * eta_o + i * eta_i } else { o + i };
    let h = half.normalize() * half.z.signum();
    if o.dot(h) * o.z <= 0.0 || i.dot(h) * i.z <= 0.0 {
        // χ⁺: a facet is seen from its front where the surface is.
        return 0.0;
    }
    let (oh, ih) = (o.dot(h).abs(), i.dot(h).abs());
    let tan2 = |w: DVec3| w.z.abs().acos().tan().powi(2);
    let d = alpha.powi(2) / (std::f64::consts::PI * h.z.powi(4) * (alpha.powi(2) + tan2(h)).powi(2));
    let lambda = |w: DVec3| 0.5 * ((1.0 + alpha.powi(2) * tan2(w)).sqrt() - 1.0);
    let g = 1.0 / (1.0 + lambda(o) + lambda(i));
    let fresnel = reflectance(oh, if o.z > 0.0 { ior } else { 1.0 / ior });
    let projected = (o.z * i.z).abs();
    if refracts {
        oh * ih / projected * eta_o.powi(2) * tint * (1.0 - fresnel) * g * d / half.length_squared()
    } else {
        fresnel * g * d / (4.0 * projected)
    }
}

/// What is added for light that meets a second facet, 1/sr: Kulla & Conty's product of the tables, for both sides.
fn several(ior: f64, alpha: f64, tint: f64, o: DVec3, i: DVec3) -> f64 {
    let across = |w: DVec3| (if w.z > 0.0 { ior } else { 1.0 / ior }) as f32;
    let missing = |w: DVec3| f64::from(albedo::boundary_missing(w.z.abs() as f32, alpha as f32, across(w)));
    let mean = |w: DVec3| f64::from(albedo::boundary_missing_average(alpha as f32, across(w)));
    let crosses = (1.0 - f64::from(fresnel::mean_dielectric(across(o)))) * mean(-o) / mean(o).max(mean(-o));
    let part = if o.z * i.z > 0.0 {
        1.0 - crosses
    } else {
        let eta = if i.z > 0.0 { 1.0 / ior } else { ior };
        crosses * tint / eta.powi(2)
    };
    part * missing(o) * missing(i) / (std::f64::consts::PI * mean(i))
}

#[test]
fn rough_glass_has_the_values_of_the_paper() {
    let bsdfs = [(1.5, 0.12), (1.5, 0.6), (1.8, 0.3), (0.7, 0.3)].map(|(ior, alpha)| {
        let color = Rgb::new(1.0, 0.8, 0.3);
        ("rough glass", Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission: 1.0 }))
    });
    let mut compared = [0; 2];
    each_case(&bsdfs, |case, bsdf, transport, known, random| {
        let Bsdf::Dielectric(glass) = bsdf else { unreachable!("the table above has glass alone") };
        for _ in 0..200 {
            let Some(sample) = bsdf.sample(known, transport, random.next_3d()) else { continue };
            let (o, i) = transport.sides(known, sample.direction);
            let refracts = o.z * i.z < 0.0;
            for channel in 0..3 {
                let tint = f64::from(glass.color[channel]);
                let [once, more] = [value, several]
                    .map(|f| f(f64::from(glass.ior), f64::from(glass.alpha), tint, o.as_dvec3(), i.as_dvec3()));
                let expected = once + more;
                let found = f64::from(sample.scatter.f[channel]);
                let error = (found - expected).abs();
                assert!(
                    error < 1e-3 * expected + 1e-5,
                    "{case}, α = {}: {found} from {i}, not {expected}",
                    glass.alpha
                );
            }
            compared[usize::from(refracts)] += 1;
        }
    });
    assert!(compared.into_iter().all(|n| n > 1000), "reflected, refracted: {compared:?}");
}
