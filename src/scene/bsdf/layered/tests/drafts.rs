//! Lobes of extensions that are drafts, against the formulas of their pages and papers.

use std::f64::consts::PI;

use super::{furnace::albedo, *};

fn direction(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

/// `KHR_materials_coat`, "View-Dependent Absorption": colour^(1/cos θ_t), half of it on each way.
#[test]
fn a_coat_tints_what_lies_below_by_the_way_through_it() {
    let color = Rgb::new(0.9, 0.5, 0.1);
    for ior in [1.0_f32, 1.3, 1.8] {
        let r = (ior - 1.0) / (ior + 1.0);
        let plain = Surface { coat: 1.0, coat_alpha: 0.3, coat_f0: r * r, ..Surface::LAMBERT };
        let base = |surface: &Surface, a: Vec3, b: Vec3| {
            let s = Stack::new(*surface, spread::averages(&Stack::new(*surface, Averages::default())));
            diffuse::Reflection.value(&s, &s.end(a), &s.end(b))
        };
        for (a, b) in [(1.0_f32, 1.0_f32), (0.7, 0.4), (0.3, 0.9)] {
            let (v, l) = (direction(a, 0.3), direction(b, 2.0));
            let [tinted, untinted] = [Surface { coat_color: color, ..plain }, plain].map(|s| base(&s, v, l));
            let way = |cos: f32| 1.0 / (1.0 - (1.0 - f64::from(cos).powi(2)) / f64::from(ior).powi(2)).sqrt();
            for i in 0..3 {
                let expected = f64::from(color[i]).powf(0.5 * (way(a) + way(b)));
                let found = f64::from(tinted[i] / untinted[i]);
                assert!((found - expected).abs() < 2e-3, "{ior} {a} {b}: {found}, not {expected}");
            }
        }
    }
}

/// OpenPBR 1.1: (1 − K)/(1 − E K), K = 1 − (1 − F)/η² under a diffuse base.
#[test]
fn a_coat_darkens_what_reflects_in_part() {
    for (ior, color) in [(1.5_f32, 0.5_f32), (1.5, 0.9), (1.8, 0.2)] {
        let r = (ior - 1.0) / (ior + 1.0);
        let coat = Surface { base_color: Rgb::splat(color), coat: 1.0, coat_f0: r * r, ..Surface::LAMBERT };
        for amount in [0.5_f32, 1.0] {
            let s = Stack::new(Surface { coat_darkening: amount, ..coat }, Averages::default());
            let (f0, eta) = (f64::from(r).powi(2), f64::from(ior));
            let mean = f0 + (1.0 - f0) / 21.0;
            let back = 1.0 - (1.0 - mean) / (eta * eta);
            let full = (1.0 - back) / (1.0 - f64::from(color) * back);
            let expected = 1.0 + f64::from(amount) * (full - 1.0);
            let found = f64::from(s.darkening.g()).powi(2);
            assert!((found - expected).abs() < 1e-4, "{ior} {color}: {found}, not {expected}");
        }
    }
}

/// Fuzz hides what lies below by as much of it as there is, whatever its colour: black fuzz is soot.
#[test]
fn black_fuzz_takes_what_white_fuzz_reflects() {
    let fuzz = |sheen: Rgb, cover: f32| Surface {
        f0: Rgb::ZERO,
        f90: 0.0,
        sheen,
        sheen_alpha: 0.25,
        sheen_place: SheenPlace::OverAll { cover },
        ..Surface::LAMBERT
    };
    for cos in [0.9_f32, 0.5, 0.2] {
        let known = direction(cos, 0.4);
        let of = |sheen: Rgb, cover: f32| albedo(&Layered::new(&fuzz(sheen, cover)), known, Transport::Radiance, 4096);
        let taken = f64::from(sheen::albedo(0.25, cos));
        assert!((of(Rgb::ZERO, 1.0) - (1.0 - taken)).abs() < 6e-3, "{cos}: {}", of(Rgb::ZERO, 1.0));
        assert!((of(Rgb::ZERO, 0.5) - (1.0 - 0.5 * taken)).abs() < 6e-3, "{cos}: {}", of(Rgb::ZERO, 0.5));
        assert!((of(Rgb::ONE, 1.0) - 1.0).abs() < 6e-3, "{cos}: {}", of(Rgb::ONE, 1.0));
    }
}

/// Emission lies over a coat of the draft, and below one of `KHR_materials_clearcoat`.
#[test]
fn a_coat_of_the_draft_does_not_darken_emission() {
    let coat = Surface { coat: 1.0, ..Surface::LAMBERT };
    let [under, over] =
        [Emission::UnderCoat, Emission::OverAll].map(|emission| Layered::new(&Surface { emission, ..coat }));
    assert!((under.emission_factor(Vec3::Z, Vec3::Z) - 0.96).abs() < 1e-3);
    assert_eq!(over.emission_factor(Vec3::Z, direction(0.1, 0.0)), 1.0);
    assert_eq!((over.mean_emission_factor(), under.mean_emission_factor() < 0.96), (1.0, true));
}

/// The paper's model in f64, with its angles as they stand there: FON of eq. 12, and E by quadrature in place of the
/// closed form. A white surface keeps all light.
fn eon(rho: f64, r: f64, v: glam::DVec3, l: glam::DVec3) -> f64 {
    let once = fujii(r, v, l);
    let lost = |w: glam::DVec3| 1.0 - quadrature(|u| fujii(r, w, u));
    let mean = {
        let n: u32 = 48;
        let at = |i: u32| ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
        let towards = |cos: f64| glam::DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        1.0 - (0..n).map(|i| lost(towards(at(i)))).sum::<f64>() / f64::from(n)
    };
    let several = rho * rho * mean / (1.0 - rho * (1.0 - mean));
    rho * once + several / PI * lost(v) * lost(l) / (1.0 - mean)
}

/// Fujii's improved Oren–Nayar model of a white surface, 1/sr.
fn fujii(r: f64, v: glam::DVec3, l: glam::DVec3) -> f64 {
    let sin_v = (1.0 - v.z * v.z).sqrt();
    let sin_l = (1.0 - l.z * l.z).sqrt();
    let phi = v.y.atan2(v.x) - l.y.atan2(l.x);
    let s = sin_v * sin_l * phi.cos();
    let t = if s > 0.0 { v.z.max(l.z) } else { 1.0 };
    (1.0 + r * s / t) / (PI * (1.0 + (0.5 - 2.0 / (3.0 * PI)) * r))
}

/// ∫ f cos θ dω.
fn quadrature(f: impl Fn(glam::DVec3) -> f64) -> f64 {
    let n: u32 = 160;
    let mut sum = 0.0;
    for k in 0..n * n {
        let (x, y) = (f64::from(k % n) + 0.5, f64::from(k / n) + 0.5);
        let (z, phi) = ((x / f64::from(n)).sqrt(), y / f64::from(n) * 2.0 * PI);
        let sin = (1.0 - z * z).sqrt();
        sum += f(glam::DVec3::new(sin * phi.cos(), sin * phi.sin(), z));
    }
    sum * PI / f64::from(n * n)
}

#[test]
fn a_rough_diffuse_base_is_that_of_its_paper() {
    for (rho, r) in [(0.8, 1.0), (0.3, 0.5), (1.0, 0.7)] {
        for (a, b, phi) in [(0.9, 0.7, 0.2), (0.4, 0.5, 0.1), (0.2, 0.3, 3.0), (0.8, 0.1, 1.5)] {
            let (v, l) = (direction(a, 0.5), direction(b, 0.5 + phi));
            let base = Surface { diffuse_roughness: r as f32, base_color: Rgb::splat(rho as f32), ..Surface::LAMBERT };
            let found = f64::from(Layered::new(&base).eval(Lobe::Continuous, v, l).f.g());
            let expected = eon(rho, r, v.as_dvec3(), l.as_dvec3());
            assert!((found - expected).abs() < 6e-3 * expected, "{rho} {r} {a} {b}: {found}, not {expected}");
        }
    }
}
