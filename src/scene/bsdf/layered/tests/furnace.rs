//! The white furnace under each layer, at every roughness and angle, both ways.
//!
//! Oracle: 1, by weights f cos/pdf of samples. It would catch a layer that takes what it does not reflect, or reflects
//! what it does not take.

use super::*;

/// The directional albedo of the green channel from the first `n` points of an Owen-scrambled Sobol sequence.
fn albedo(layered: &Layered, known: Vec3, transport: Transport, n: u32) -> f64 {
    let weights = (0..n).map(|i| {
        let u = Vec3::from_array([0, 1, 2].map(|dimension| sobol_burley::sample(i, dimension, 17)));
        layered.sample(known, transport, u).map_or(0.0, |s| {
            let (to_camera, to_light) = transport.sides(known, s.direction);
            let cos = if transport == Transport::Radiance { to_light.z } else { to_camera.z };
            f64::from(s.scatter.f.g() * cos.abs()) / f64::from(s.scatter.forward_reverse(transport).0.0)
        })
    });
    weights.sum::<f64>() / f64::from(n)
}

const COSINES: [f32; 7] = [1.0, 0.9, 0.7, 0.45, 0.3, 0.1, 0.03];
const ALPHAS: [f32; 5] = [0.0, 0.01, 0.1, 0.3, 1.0];

/// The least and the greatest albedo of white bases under `layers`, over the base's roughness, metal or not, and
/// angles.
fn range(layers: &[Surface]) -> [f64; 2] {
    let mut range = [f64::INFINITY, 0.0_f64];
    let mut number = 0;
    for layer in layers {
        for (alpha, metallic) in ALPHAS.into_iter().flat_map(|alpha| [(alpha, 0.0), (alpha, 1.0)]) {
            let layered = Layered::new(&Surface { alpha, metallic, ..*layer });
            for cos in COSINES {
                number += 1;
                let known = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                let transport = [Transport::Radiance, Transport::Importance][number % 2];
                let is_white = |found: f64| (0.9965..1.0015).contains(&found);
                let mut found = albedo(&layered, known, transport, 512);
                for n in [4096, 16384] {
                    if !is_white(found) {
                        found = albedo(&layered, known, transport, n);
                    }
                }
                range = [range[0].min(found), range[1].max(found)];
            }
        }
    }
    range
}

fn assert_white(name: &str, layers: &[Surface], [least, most]: [f64; 2]) {
    let [low, high] = range(layers);
    assert!(low > least && high < most, "{name}: albedos from {low} to {high}");
}

#[test]
fn a_coat_loses_nothing() {
    let coats = [0.0, 0.1, 0.5].map(|coat_alpha| Surface { coat: 1.0, coat_alpha, ..WHITE });
    assert_white("coat", &coats, [0.99, 1.002]);
}

#[test]
fn sheen_loses_nothing() {
    let sheens = [0.04, 0.3, 1.0].map(|sheen_alpha| Surface { sheen: Rgb::ONE, sheen_alpha, ..WHITE });
    assert_white("sheen", &sheens, [0.988, 1.002]);
}

#[test]
fn a_grain_loses_nothing() {
    let grains = [0.3, 0.7, 1.0].map(|anisotropy| Surface { anisotropy, tangent: 0.4, ..WHITE });
    assert_white("grain", &grains, [0.985, 1.002]);
}

#[test]
fn a_leaf_loses_nothing() {
    let leaves = [0.5, 1.0].map(|transmission| Surface { transmission, ..WHITE });
    assert_white("diffuse transmission", &leaves, [0.995, 1.002]);
}

/// The film's hue is what it takes from other channels: white is only what it does to a white metal.
#[test]
fn a_film_takes_nothing_from_a_white_metal_and_adds_nothing_to_a_dielectric() {
    let films =
        [100.0, 250.0, 550.0].map(|film_thickness| Surface { film: 1.0, film_ior: 1.5, film_thickness, ..WHITE });
    let metals = films.map(|film| Surface { base_color: Rgb::ONE, metallic: 1.0, f0: Rgb::ZERO, f90: 0.0, ..film });
    for (alpha, film) in ALPHAS.into_iter().flat_map(|alpha| metals.map(|film| (alpha, film))) {
        let layered = Layered::new(&Surface { alpha, ..film });
        let found = albedo(&layered, Vec3::new(0.6, 0.0, 0.8), Transport::Radiance, 4096);
        assert!((found - 1.0).abs() < 2e-3, "{alpha}: {found}");
    }
    assert_white("film", &films, [0.96, 1.002]);
}

/// Sheen under a coat loses what the coat keeps of its low angles.
#[test]
fn all_layers_together_gain_nothing() {
    let all = Surface {
        coat: 1.0,
        coat_alpha: 0.05,
        sheen: Rgb::ONE,
        sheen_alpha: 0.3,
        anisotropy: 0.5,
        transmission: 0.3,
        ..WHITE
    };
    assert_white("all", &[all], [0.93, 1.002]);
    let tilted = Vec3::new(0.4, 0.1, 0.9).normalize().truncate();
    for (coat_alpha, coat_is_flat) in [(0.01, false), (0.3, false), (0.01, true), (0.3, true)] {
        let coat = Surface { coat: 1.0, coat_alpha, coat_normal: tilted, coat_is_flat, ..WHITE };
        let layered = Layered::new(&Surface { alpha: 0.2, ..coat });
        for (cos, phi) in COSINES.into_iter().flat_map(|cos| [0.0_f32, 1.5, 3.0].map(|phi| (cos, phi))) {
            let sin = (1.0 - cos * cos).sqrt();
            let known = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
            let found = albedo(&layered, known, Transport::Radiance, 4096);
            assert!(found < 1.004, "tilted coat {coat_alpha} from {known}: {found}");
        }
    }
}

/// Oracle: the metal's own reflectance where facets are as good as smooth, and at most 1 anywhere.
#[test]
fn a_measured_metal_gains_nothing_and_where_it_is_smooth_reflects_as_its_table_says() {
    for metal in Metal::all() {
        for (alpha, cos) in ALPHAS.into_iter().flat_map(|alpha| COSINES.map(|cos| (alpha, cos))) {
            let layered = Layered::new(&Surface { measured: Some(metal), alpha, ..WHITE });
            let known = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let found = albedo(&layered, known, Transport::Radiance, 1024);
            let symbol = metal.symbol();
            assert!(found < 1.002, "{symbol}, {alpha}, {cos}: {found}");
            let expected = f64::from(metal.reflectance(cos).g());
            if alpha == 0.0 {
                assert!((found - expected).abs() < 3e-3, "{symbol} at {cos}: {found}, not {expected}");
            }
        }
    }
}

/// Kulla & Conty 2017: what facets send back and forth is reflected by the mean reflectance each time. Of a metal that
/// is as rough as can be, about that is left of the light that meets several facets.
#[test]
fn a_rough_metal_keeps_what_its_facets_send_to_each_other() {
    for symbol in ["Ag", "Au", "Cr"] {
        let metal = Metal::named(symbol);
        let rough = Layered::new(&Surface { measured: metal, alpha: 1.0, ..WHITE });
        let (mean, e1) = (f64::from(metal.map_or(0.0, |m| m.mean().g())), 1.0 - f64::from(Split::average(1.0).missing));
        let n = 12;
        let cosine = |i: u16| ((f32::from(i) + 0.5) / f32::from(n)).sqrt();
        let towards = |cos: f32| Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let found: f64 = (0..n).map(|i| albedo(&rough, towards(cosine(i)), Transport::Radiance, 1024)).sum();
        let found = found / f64::from(n);
        let expected = mean * e1 + mean * mean * e1 / (1.0 - mean * (1.0 - e1)) * (1.0 - e1);
        assert!((found - expected).abs() < 0.015, "{symbol}: {found}, not {expected}");
    }
}
