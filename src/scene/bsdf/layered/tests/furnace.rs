//! The white furnace under each layer, at every roughness and angle, both ways.
//!
//! Oracle: 1, by weights f cos/pdf of samples. It would catch a layer that takes what it does not reflect, or reflects
//! what it does not take.

use super::*;

/// The directional albedo of the green channel from the first `n` points of an Owen-scrambled Sobol sequence: the part
/// of the power that goes on, which radiance that enters a denser medium gains nothing of (Veach 5.2).
pub(super) fn albedo(layered: &Layered, known: Vec3, transport: Transport, n: u32) -> f64 {
    power(layered, known, transport, n, |_| true)
}

/// The part of it in directions that are to be kept.
pub(super) fn power(layered: &Layered, known: Vec3, transport: Transport, n: u32, keep: impl Fn(Vec3) -> bool) -> f64 {
    let weights = (0..n).map(|i| {
        let u = Vec3::from_array([0, 1, 2].map(|dimension| sobol_burley::sample(i, dimension, 17)));
        layered.sample(known, transport, u).filter(|s| keep(s.direction)).map_or(0.0, |s| {
            let (to_camera, to_light) = transport.sides(known, s.direction);
            let cos = match transport {
                Transport::Radiance => to_light.z * layered.relative_ior(to_camera, to_light).powi(2),
                Transport::Importance => to_camera.z,
            };
            f64::from(s.scatter.f.g() * cos.abs()) / f64::from(s.scatter.forward_reverse(transport).0.0)
        })
    });
    weights.sum::<f64>() / f64::from(n)
}

const COSINES: [f32; 7] = [1.0, 0.9, 0.7, 0.45, 0.3, 0.1, 0.03];
const ALPHAS: [f32; 5] = [0.0, 0.01, 0.1, 0.3, 1.0];

/// The least and the greatest albedo of white bases under `layers`, and where they are, over the base's roughness,
/// metal or not, and angles on this side.
fn range(layers: &[Surface], side: f32) -> [(f64, String); 2] {
    let mut range = [f64::INFINITY, 0.0].map(|x| (x, String::new()));
    let mut number = 0;
    for layer in layers {
        let metals = if layer.clear().is_some() { [0.0, 0.3] } else { [0.0, 1.0] };
        for (alpha, metallic) in ALPHAS.into_iter().flat_map(|alpha| metals.map(|metallic| (alpha, metallic))) {
            let layered = Layered::new(&Surface { alpha, metallic, ..*layer });
            for cos in COSINES {
                number += 1;
                let known = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, side * cos);
                let transport = [Transport::Radiance, Transport::Importance][number % 2];
                let is_white = |found: f64| (0.9965..1.0015).contains(&found);
                let mut found = albedo(&layered, known, transport, 512);
                for n in [4096, 16384] {
                    if !is_white(found) {
                        found = albedo(&layered, known, transport, n);
                    }
                }
                let place = || format!("{found:.4} from {known}, {transport:?}, at {:?}", layered.surface());
                if found < range[0].0 {
                    range[0] = (found, place());
                }
                if found > range[1].0 {
                    range[1] = (found, place());
                }
            }
        }
    }
    range
}

fn assert_white(name: &str, layers: &[Surface], bounds: [f64; 2]) {
    assert_white_from(1.0, name, layers, bounds);
}

fn assert_white_from(side: f32, name: &str, layers: &[Surface], [least, most]: [f64; 2]) {
    let [low, high] = range(layers, side);
    assert!(low.0 > least && high.0 < most, "{name}: albedos from {}\nto {}", low.1, high.1);
}

/// A clear boundary of the index, with all of it clear.
fn clear(of: fn(Clear) -> Passage, ior: f32) -> Surface {
    let r = (ior - 1.0) / (ior + 1.0);
    Surface { f0: Rgb::splat(r * r), f90: 1.0, passage: of(Clear { fraction: 1.0, ior }), ..Surface::LAMBERT }
}

const KINDS: [fn(Clear) -> Passage; 2] = [Passage::Wall, Passage::Volume];

#[test]
fn clear_boundaries_lose_nothing() {
    let bare: Vec<_> = KINDS.into_iter().flat_map(|of| [1.0, 1.5, 2.4].map(|ior| clear(of, ior))).collect();
    assert_white("clear", &bare, [0.99, 1.004]);
    assert_white_from(-1.0, "clear, from behind", &bare, [0.99, 1.004]);
}

#[test]
fn a_coat_on_what_is_clear_loses_nothing() {
    let coats: Vec<_> = KINDS
        .into_iter()
        .flat_map(|of| [1.2, 1.5, 2.0].map(|ior| clear(of, ior)))
        .flat_map(|glass| [0.0, 0.3].map(|coat_alpha| Surface { coat: 1.0, coat_alpha, ..glass }))
        .collect();
    assert_white("coat on what is clear", &coats, [0.99, 1.005]);
    // What a rough boundary sends back inside is more than what comes back.
    assert_white_from(-1.0, "coat on what is clear, from behind", &coats, [0.925, 1.005]);
}

/// What light does between facets with a grain is that of facets without one that are as rough.
#[test]
fn a_grain_on_what_is_clear_loses_little() {
    let grains: Vec<_> = KINDS
        .into_iter()
        .flat_map(|of| [0.4, 1.0].map(|anisotropy| Surface { anisotropy, tangent: 0.4, ..clear(of, 1.5) }))
        .collect();
    assert_white("grain on what is clear", &grains, [0.9, 1.03]);
    assert_white_from(-1.0, "grain on what is clear, from behind", &grains, [0.81, 1.1]);
}

#[test]
fn sheen_on_what_is_clear_loses_nothing() {
    let sheens: Vec<_> = KINDS
        .into_iter()
        .flat_map(|of| [0.1, 0.5].map(|sheen_alpha| Surface { sheen: Rgb::ONE, sheen_alpha, ..clear(of, 1.5) }))
        .collect();
    assert_white("sheen on what is clear", &sheens, [0.99, 1.005]);
    assert_white_from(-1.0, "sheen on what is clear, from behind", &sheens, [0.95, 1.006]);
}

/// What a film does not reflect it lets through: of each colour, so that no channel gains or loses at one facet. What
/// light does between rough facets is that of facets without a film.
#[test]
fn a_film_on_what_is_clear_loses_nothing() {
    let films: Vec<_> = KINDS
        .into_iter()
        .flat_map(|of| {
            [150.0, 400.0].map(|film_thickness| Surface { film: 1.0, film_ior: 1.8, film_thickness, ..clear(of, 1.5) })
        })
        .collect();
    assert_white("film on what is clear", &films, [0.945, 1.01]);
    assert_white_from(-1.0, "film on what is clear, from behind", &films, [0.98, 1.035]);
}

/// Nothing is lost that a coat sends to and fro over what absorbs nothing, whatever lies below it.
#[test]
fn a_coat_that_darkens_takes_nothing_from_what_is_white() {
    let coat = Surface { coat: 1.0, coat_alpha: 0.1, coat_darkening: 1.0, ..WHITE };
    let below = [
        clear(Passage::Volume, 1.5),
        clear(Passage::Wall, 1.5),
        Surface { passage: Passage::Leaf { fraction: 0.6, color: Rgb::ONE }, ..WHITE },
    ];
    let coats = below.map(|b| Surface { passage: b.passage, ..coat });
    assert_white("coats that darken", &coats, [0.985, 1.005]);
    let film = Surface { film: 1.0, film_ior: 1.3, film_thickness: 400.0, ..coat };
    let mirror = Surface { coat_f0: 1.0, ..coat };
    for (surface, base) in [film, mirror].into_iter().flat_map(|s| [0.2, 0.7, 1.0].map(|base| (s, base))) {
        for metallic in [0.0, 1.0] {
            let layered = Layered::new(&Surface { base_color: Rgb::splat(base), metallic, ..surface });
            let found = albedo(&layered, Vec3::new(0.6, 0.0, 0.8), Transport::Radiance, 1024);
            assert!(found > 0.0 && found < 1.003, "{found} of {:?}", layered.surface());
        }
    }
}

/// In water or in another glass a surface keeps no more than it receives: what it has of averages is of that index.
#[test]
fn in_another_medium_nothing_is_gained() {
    for (ior, front) in [(1.5, 1.33), (2.4, 1.5), (1.33, 2.4), (1.0, 1.5), (1.5, 1.5)] {
        let glass = clear(Passage::Volume, ior);
        let passage = Passage::Volume(Clear { fraction: 0.4, ior });
        for surface in [
            Surface { coat: 1.0, coat_alpha: 0.2, alpha: 0.2, ..glass },
            Surface { sheen: Rgb::ONE, sheen_alpha: 0.3, alpha: 0.2, ..glass },
            Surface { passage, alpha: 0.2, ..glass },
        ] {
            let layered = Layered::new(&surface).with_volume_ior(ior / front);
            for cos in [0.9_f32, 0.5, 0.2, -0.5, -0.9] {
                let known = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                let found = albedo(&layered, known, Transport::Radiance, 4096);
                assert!((0.93..1.03).contains(&found), "{found} from {known}, {ior} in {front}: {surface:?}");
            }
            let back = layered.with_volume_ior(ior);
            assert_eq!(back, Layered::new(&surface), "{ior} in {front}");
        }
    }
}

#[test]
fn fuzz_and_rough_bases_lose_nothing() {
    let fuzz = [0.1, 0.6].map(|sheen_alpha| Surface {
        sheen: Rgb::ONE,
        sheen_alpha,
        sheen_place: SheenPlace::OverAll { cover: 1.0 },
        ..WHITE
    });
    assert_white("fuzz", &fuzz, [0.99, 1.003]);
    let rough = [0.4, 1.0].map(|diffuse_roughness| Surface { diffuse_roughness, ..WHITE });
    assert_white("rough diffuse bases", &rough, [0.99, 1.008]);
    let coats = [1.2_f32, 2.0].map(|ior| Surface {
        coat: 1.0,
        coat_alpha: 0.1,
        coat_f0: ((ior - 1.0) / (ior + 1.0)).powi(2),
        coat_darkening: 1.0,
        ..WHITE
    });
    assert_white("coats of other indices", &coats, [0.99, 1.002]);
}

#[test]
fn a_coat_loses_nothing() {
    let coats = [0.0, 0.1, 0.5].map(|coat_alpha| Surface { coat: 1.0, coat_alpha, ..WHITE });
    assert_white("coat", &coats, [0.994, 1.002]);
}

#[test]
fn sheen_loses_nothing() {
    let sheens = [0.04, 0.3, 1.0].map(|sheen_alpha| Surface { sheen: Rgb::ONE, sheen_alpha, ..WHITE });
    assert_white("sheen", &sheens, [0.989, 1.002]);
}

#[test]
fn a_grain_loses_nothing() {
    let grains = [0.3, 0.7, 1.0].map(|anisotropy| Surface { anisotropy, tangent: 0.4, ..WHITE });
    assert_white("grain", &grains, [0.985, 1.002]);
}

#[test]
fn a_leaf_loses_nothing() {
    let leaves = [0.5, 1.0].map(|fraction| Surface { passage: Passage::Leaf { fraction, color: Rgb::ONE }, ..WHITE });
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
        passage: Passage::Leaf { fraction: 0.3, color: Rgb::ONE },
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
