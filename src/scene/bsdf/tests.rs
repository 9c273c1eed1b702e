//! One table of BSDFs, run through every oracle. A new BSDF adds its lines to [`table`].

mod density;
mod furnace;
pub(super) mod ledger;
mod walter;

use glam::Vec3;
use proptest::{prelude::*, test_runner::RngSeed};

use super::*;
use crate::sampling::{Independent, Sampler, Stream};

/// Instances that cover every lobe, alone and mixed, smooth, rough and black.
fn table() -> Vec<(&'static str, Bsdf)> {
    let gray = Rgb::splat(0.8);
    let red = Rgb::new(0.9, 0.3, 0.1);
    let plastic = |metallic, alpha, f0: f32, f90| {
        let (base_color, dielectric_f0) = (red, Rgb::splat(f0));
        Bsdf::MetallicRoughness(MetallicRoughness { base_color, metallic, alpha, dielectric_f0, dielectric_f90: f90 })
    };
    let metal = |color, alpha| Bsdf::MetallicRoughness(MetallicRoughness::metal(color, alpha));
    let glass = |color, ior, alpha, transmission| Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission });
    let pane = |color, ior, alpha, transmission| Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission });
    vec![
        ("diffuse", Bsdf::Diffuse(Diffuse { albedo: red })),
        ("plastic, smooth", plastic(0.0, 0.0, 0.04, 1.0)),
        ("plastic, glossy", plastic(0.0, 0.1, 0.04, 1.0)),
        ("plastic, rough", plastic(0.0, 1.0, 0.04, 1.0)),
        ("plastic, index-matched", plastic(0.0, 0.3, 0.0, 1.0)),
        ("plastic, without a coat", plastic(0.0, 0.3, 0.0, 0.0)),
        ("plastic, strong coat", plastic(0.0, 0.25, 1.0, 1.0)),
        ("half metal, glossy", plastic(0.5, 0.2, 0.04, 0.7)),
        ("half metal, smooth", plastic(0.5, 0.0, 0.04, 1.0)),
        ("metal, smooth", metal(red, 0.0)),
        ("metal, glossy", metal(red, 0.15)),
        ("metal, white and rough", metal(Rgb::ONE, 0.7)),
        ("metal, black", metal(Rgb::ZERO, 0.5)),
        ("glass, smooth", glass(Rgb::ONE, 1.5, 0.0, 1.0)),
        ("glass, glossy", glass(Rgb::ONE, 1.5, 0.12, 1.0)),
        ("glass, rough", glass(Rgb::ONE, 1.5, 0.6, 1.0)),
        ("glass, tinted", glass(red, 1.8, 0.3, 1.0)),
        ("glass, mostly diffuse", glass(gray, 1.33, 0.3, 0.25)),
        ("glass, smooth and half diffuse", glass(red, 1.5, 0.0, 0.5)),
        ("glass, opaque", glass(red, 1.5, 0.2, 0.0)),
        ("glass, index-matched", glass(red, 1.0, 0.5, 0.75)),
        ("bubble", glass(Rgb::ONE, 0.7, 0.3, 1.0)),
        ("pane, smooth", pane(Rgb::ONE, 1.5, 0.0, 1.0)),
        ("pane, glossy", pane(Rgb::ONE, 1.5, 0.12, 1.0)),
        ("pane, rough and half diffuse", pane(red, 1.8, 0.6, 0.5)),
        ("pane, smooth and half diffuse", pane(red, 1.5, 0.0, 0.5)),
        ("pane, black", pane(Rgb::ZERO, 1.5, 0.3, 1.0)),
    ]
    .into_iter()
    .chain(layered())
    .collect()
}

/// Layered surfaces with each lobe.
fn layered() -> impl Iterator<Item = (&'static str, Bsdf)> {
    let red = Rgb::new(0.9, 0.3, 0.1);
    let plastic = Surface { base_color: red, f0: Rgb::splat(0.04), f90: 1.0, alpha: 0.3, ..Surface::LAMBERT };
    let metal = Surface { base_color: red, metallic: 1.0, alpha: 0.2, ..plastic };
    let coat = Surface { coat: 1.0, coat_alpha: 0.1, ..plastic };
    let sheen = Surface { sheen: Rgb::new(1.0, 0.8, 0.6), sheen_alpha: 0.2, ..plastic };
    let film = Surface { film: 1.0, film_ior: 1.5, film_thickness: 450.0, ..metal };
    let grain = Surface { anisotropy: 0.7, tangent: 0.6, ..metal };
    let leaf = Surface { passage: Passage::Leaf { fraction: 0.6, color: Rgb::new(0.2, 0.9, 0.3) }, ..plastic };
    let clear = Clear { fraction: 1.0, ior: 1.5 };
    let coloured = Surface { coat_f0: 0.09, coat_color: red, coat_darkening: 0.8, ..coat };
    let all = Surface {
        coat: 0.6,
        coat_alpha: 0.2,
        sheen: Rgb::new(0.3, 0.2, 0.5),
        sheen_alpha: 0.4,
        film: 0.7,
        film_ior: 1.8,
        film_thickness: 300.0,
        anisotropy: 0.5,
        tangent: 2.0,
        metallic: 0.4,
        ..leaf
    };
    [
        ("coat over plastic", coat),
        ("coat over metal", Surface { coat: 0.7, coat_alpha: 0.25, ..metal }),
        ("sheen over plastic", sheen),
        ("sheen, rough, over metal", Surface { sheen: Rgb::ONE, sheen_alpha: 1.0, ..metal }),
        ("metal with a grain", grain),
        ("plastic with a grain", Surface { metallic: 0.0, anisotropy: 1.0, ..grain }),
        ("metal under a film", film),
        ("plastic under a film", Surface { metallic: 0.0, film: 0.8, ..film }),
        ("gold", Surface { measured: Metal::named("Au"), alpha: 0.2, ..Surface::LAMBERT }),
        ("tungsten, rough", Surface { measured: Metal::named("W"), alpha: 0.8, ..Surface::LAMBERT }),
        ("chromium under a coat", Surface { measured: Metal::named("Cr"), ..coat }),
        ("leaf", leaf),
        ("coat over glass", Surface { passage: Passage::Volume(clear), ..coat }),
        ("coat over half of a pane", Surface { passage: Passage::Wall(Clear { fraction: 0.5, ..clear }), ..coat }),
        ("sheen over glass", Surface { passage: Passage::Volume(clear), ..sheen }),
        ("film on glass", Surface { passage: Passage::Volume(clear), metallic: 0.0, ..film }),
        ("film on a pane", Surface { passage: Passage::Wall(clear), metallic: 0.0, ..film }),
        ("glass with a grain", Surface { passage: Passage::Volume(clear), metallic: 0.0, ..grain }),
        (
            "glass, tinted specular",
            Surface { f0: Rgb::new(0.04, 0.02, 0.0), passage: Passage::Volume(clear), ..plastic },
        ),
        ("between metal and glass", Surface { passage: Passage::Volume(clear), metallic: 0.4, ..coat }),
        ("rough diffuse", Surface { diffuse_roughness: 1.0, alpha: 0.5, ..plastic }),
        ("rough leaf", Surface { diffuse_roughness: 0.7, ..leaf }),
        ("coloured coat", coloured),
        ("fuzz", Surface { sheen_place: SheenPlace::OverAll { cover: 0.9 }, coat: 0.7, coat_alpha: 0.3, ..sheen }),
        ("all layers", all),
    ]
    .map(|(name, surface)| (name, Bsdf::Layered(Layered::new(&surface))))
    .into_iter()
}

/// Lobes too narrow for the quadratures, for the oracles that need none.
fn narrow() -> Vec<(&'static str, Bsdf)> {
    let mut narrow = Vec::new();
    for alpha in [1.01e-3, 0.01] {
        let (color, ior) = (Rgb::new(0.9, 0.6, 0.3), 1.5);
        narrow.push(("metal, narrow", Bsdf::MetallicRoughness(MetallicRoughness::metal(color, alpha))));
        narrow.push(("glass, narrow", Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission: 0.9 })));
        narrow.push(("pane, narrow", Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission: 0.9 })));
    }
    narrow
}

const TRANSPORTS: [Transport; 2] = [Transport::Radiance, Transport::Importance];

/// Directions above and below the surface, from the normal to grazing, around the critical angle of glass among them.
fn known_directions() -> Vec<Vec3> {
    [(1.0, 0.0), (0.6, 2.0), (0.2, 4.0), (0.03, 1.0), (-0.9, 5.0), (-0.72, 1.3), (-0.4, 3.0)]
        .map(|(z, phi): (f32, f32)| ((1.0 - z * z).sqrt() * Vec3::new(phi.cos(), phi.sin(), 0.0)).with_z(z).normalize())
        .to_vec()
}

/// Runs `check` on every BSDF, transport and known direction, with the name of the case and random numbers of its own.
fn each_case(bsdfs: &[(&str, Bsdf)], mut check: impl FnMut(&str, &Bsdf, Transport, Vec3, &mut Independent)) {
    let mut number = 0;
    for (name, bsdf) in bsdfs {
        for transport in TRANSPORTS {
            for known in known_directions() {
                number += 1;
                let case = format!("{name}, {transport:?} from {known}");
                check(&case, bsdf, transport, known, &mut Independent::new(1, number, 0, Stream::Camera));
            }
        }
    }
}

/// The fraction of the power carried through a pair of directions, from the value `f` and the density `pdf` of either
/// walk: radiance gains η² where it enters a denser medium without any gain of power (Veach 5.2), importance does not.
fn power(bsdf: &Bsdf, transport: Transport, (to_camera, to_light): (Vec3, Vec3), f: f64) -> f64 {
    match transport {
        Transport::Radiance => f * f64::from(to_light.z.abs() * bsdf.relative_ior(to_camera, to_light).powi(2)),
        Transport::Importance => f * f64::from(to_camera.z.abs()),
    }
}

#[test]
fn smooth_clear_glass_loses_nothing() {
    for (name, bsdf) in table() {
        if !matches!(name, "glass, smooth" | "pane, smooth") {
            continue;
        }
        each_case(&[(name, bsdf)], |case, bsdf, transport, known, random| {
            for _ in 0..200 {
                let sample = bsdf.sample(known, transport, random.next_3d()).expect("nothing is absorbed");
                let (mut to_camera, mut to_light) = transport.sides(known, sample.direction);
                let estimate = sample.scatter.f / sample.scatter.forward_reverse(transport).0.0;
                let estimate = power(bsdf, transport, (to_camera, to_light), f64::from(estimate.r()));
                assert!((estimate - 1.0).abs() < 2e-5, "{case}: {estimate}");
                if transport == Transport::Importance {
                    (to_camera, to_light) = (to_light, to_camera);
                }
                assert_eq!(
                    bsdf.relative_ior(to_camera, to_light) != 1.0,
                    name.starts_with("glass") && to_camera.z * to_light.z < 0.0
                );
            }
        });
    }
}

#[test]
fn glass_lies_below_the_surface() {
    let glass = Bsdf::Dielectric(Dielectric { color: Rgb::ONE, ior: 1.5, alpha: 0.0, transmission: 1.0 });
    let to_camera = Vec3::new(0.6, 0.0, 0.8);
    let down = follow(&glass, Lobe::Delta(1), to_camera, Transport::Radiance).unwrap();
    assert!((down.direction.x + 0.4).abs() < 1e-6 && down.direction.z < 0.0, "{}", down.direction);
    assert_eq!(glass.relative_ior(to_camera, down.direction), 1.5);
    // Radiance that leaves the glass spreads by Snell's law: f cos = T/η², Veach 5.2.
    let (cos, transmitted) = (-down.direction.z, 1.0 - fresnel::dielectric(0.8, 1.5));
    assert!((down.scatter.f.r() * cos - transmitted / 2.25).abs() < 1e-6);
    assert!(follow(&glass, Lobe::Delta(1), -to_camera.with_x(0.9).normalize(), Transport::Radiance).is_none());
}

fn close(a: f32, b: f32, tolerance: f32) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs()) + 1e-12
}

#[test]
fn continuous_scattering_is_reciprocal() {
    let bsdfs = [table(), narrow()].concat();
    each_case(&bsdfs, |case, bsdf, transport, known, random| {
        for _ in 0..200 {
            let Some(sample) = bsdf.sample(known, transport, random.next_3d()) else { continue };
            if sample.lobe != Lobe::Continuous {
                continue;
            }
            let (c, l) = transport.sides(known, sample.direction);
            let (ab, ba) = (bsdf.eval(sample.lobe, c, l), bsdf.eval(sample.lobe, l, c));
            let eta2 = bsdf.relative_ior(c, l).powi(2);
            let (forward, backward) = (ab.f * eta2, ba.f);
            for i in 0..3 {
                assert!(close(forward[i], backward[i], 1e-4), "{case}: {forward} to {l}, {backward} back");
            }
            assert!(close(ab.to_light.0, ba.to_camera.0, 1e-4) && close(ab.to_camera.0, ba.to_light.0, 1e-4), "{case}");
            assert_eq!(bsdf.event(sample.lobe, c, l), bsdf.event(sample.lobe, l, c), "{case}");
        }
    });
}

#[test]
fn a_sample_carries_what_eval_returns() {
    let bsdfs = [table(), narrow()].concat();
    each_case(&bsdfs, |case, bsdf, transport, known, random| {
        for _ in 0..200 {
            let Some(sample) = bsdf.sample(known, transport, random.next_3d()) else { continue };
            let (to_camera, to_light) = transport.sides(known, sample.direction);
            assert_eq!(sample.scatter, bsdf.eval(sample.lobe, to_camera, to_light), "{case}");
            assert!((sample.direction.length() - 1.0).abs() < 1e-5, "{case}");
            assert!(sample.lobe != Lobe::Continuous || bsdf.has_continuous(), "{case}");
        }
    });
}

/// The direction that a delta lobe leads to, found by sampling.
fn follow(bsdf: &Bsdf, lobe: Lobe, known: Vec3, transport: Transport) -> Option<BsdfSample> {
    (0..512).find_map(|i| {
        bsdf.sample(known, transport, Vec3::new(0.5, 0.5, (i as f32 + 0.5) / 512.0)).filter(|s| s.lobe == lobe)
    })
}

#[test]
fn deltas_lead_back_and_carry_their_jacobian() {
    let mut checked = 0;
    each_case(&table(), |case, bsdf, transport, known, _| {
        for k in 0..bsdf.delta_count() {
            let lobe = Lobe::Delta(k);
            let Some(there) = follow(bsdf, lobe, known, transport) else { continue };
            let other = TRANSPORTS[usize::from(transport == Transport::Radiance)];
            let back = follow(bsdf, lobe, there.direction, other).expect("light goes both ways");
            let tolerance = 1e-6 / known.z.abs().min(there.direction.z.abs());
            assert!((back.direction - known).length() < tolerance, "{case}: back to {}", back.direction);
            let (s, t) = (there.scatter, back.scatter);
            assert!(close(s.f.r(), t.f.r(), 1e-3) && close(s.to_light.0, t.to_light.0, 1e-3), "{case}: {s:?} {t:?}");
            assert!(close(s.to_camera.0, t.to_camera.0, 1e-3), "{case}: {s:?} {t:?}");

            // The Jacobian by finite differences of the direction itself, in radiance form, from known to its image.
            if transport == Transport::Importance {
                continue;
            }
            let frame = Frame::around(known);
            let step = 0.05 * known.z.abs().min(there.direction.z.abs()).min(0.2);
            let image = |x: f32, y: f32| {
                follow(bsdf, lobe, frame.to_world(Vec3::new(x, y, 1.0)).normalize(), transport).unwrap().direction
            };
            let dx = (image(step, 0.0) - image(-step, 0.0)) / (2.0 * step);
            let dy = (image(0.0, step) - image(0.0, -step)) / (2.0 * step);
            let measured = dx.cross(dy).length();
            // P(lobe) from the light's side is the forward density of the same walk begun there.
            let p = bsdf.eval(lobe, there.direction, known).to_light.0;
            assert!(close(s.to_camera.0, p * measured, 1e-2), "{case}: {} against {}", s.to_camera.0, p * measured);
            checked += 1;
        }
    });
    assert!(checked > 40, "{checked}");
}

#[test]
fn without_a_coat_plastic_is_lambertian_and_a_smooth_metal_is_a_mirror() {
    let (base_color, f0) = (Rgb::new(0.9, 0.3, 0.1), Rgb::ZERO);
    let lambert = Bsdf::Diffuse(Diffuse { albedo: base_color });
    for alpha in [0.0, 0.4] {
        let plastic = MetallicRoughness { base_color, metallic: 0.0, alpha, dielectric_f0: f0, dielectric_f90: 0.0 };
        assert_eq!(plastic.delta_count(), 0);
        each_case(&[("", Bsdf::MetallicRoughness(plastic))], |_, bsdf, transport, known, random| {
            let u = random.next_3d();
            let (ours, lamberts) = (bsdf.sample(known, transport, u), lambert.sample(known, transport, u));
            assert_eq!(ours.unwrap().direction, lamberts.unwrap().direction);
            assert_eq!(ours.unwrap().scatter, lamberts.unwrap().scatter);
            let (c, l) = (known, lamberts.unwrap().direction);
            assert_eq!(bsdf.event(Lobe::Continuous, c, l), ScatterEvent::Diffuse);
        });
    }
    let mirror = MetallicRoughness::metal(base_color, 0.0);
    assert!(!mirror.has_continuous() && mirror.delta_count() == 1);
}

fn direction() -> impl Strategy<Value = Vec3> {
    // Heights down to the last bits above the surface, where the divisions are.
    (-1.0..1.0_f32, 0..9, 0.0..6.3_f32).prop_map(|(z, exponent, phi)| {
        let z = z * 0.1_f32.powi(exponent);
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    })
}

fn any_bsdf() -> impl Strategy<Value = Bsdf> {
    let unit = || prop_oneof![Just(0.0_f32), Just(1.0), 0.0..1.0_f32];
    let alpha = prop_oneof![Just(0.0_f32), Just(1.0), Just(microfacet::SMOOTH_ALPHA), 0.0..1.0_f32];
    let ior = prop_oneof![Just(1.0_f32), 0.9998..1.0002_f32, 0.3..4.0_f32];
    (0..5, [unit(), unit(), unit()], alpha, ior, unit(), [unit(), unit()]).prop_map(
        |(kind, color, alpha, ior, fraction, [f0, f90])| {
            let color = Rgb::from_array(color);
            match kind {
                0 => Bsdf::Diffuse(Diffuse { albedo: color }),
                1 => Bsdf::MetallicRoughness(MetallicRoughness {
                    base_color: color,
                    metallic: fraction,
                    alpha,
                    dielectric_f0: Rgb::new(f0 * f90, 0.5 * f0 * f90, 0.04 * f90),
                    dielectric_f90: f90,
                }),
                2 => Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission: fraction }),
                3 => Bsdf::Layered(Layered::new(&Surface {
                    base_color: color,
                    f0: Rgb::splat(0.04 * f90),
                    f90,
                    metallic: f0,
                    alpha,
                    coat: fraction,
                    coat_alpha: alpha * f0,
                    sheen: Rgb::splat(f0 * f90),
                    sheen_alpha: alpha,
                    film: f90 * fraction,
                    film_ior: ior.max(1.0),
                    film_thickness: 1000.0 * fraction,
                    anisotropy: f0 * fraction,
                    tangent: ior,
                    diffuse_roughness: f0,
                    coat_color: color,
                    coat_darkening: f90,
                    sheen_place: if f90 == 1.0 { SheenPlace::OverAll { cover: f0 } } else { SheenPlace::UnderCoat },
                    passage: match (f0 < 0.3, f90 < 0.5) {
                        (true, true) => Passage::Wall(Clear { fraction, ior }),
                        (true, false) => Passage::Volume(Clear { fraction, ior }),
                        _ => Passage::Leaf { fraction, color },
                    },
                    ..Surface::LAMBERT
                })),
                _ => Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission: fraction }),
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 20_000,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn everything_is_finite_and_nothing_negative(
        bsdf in any_bsdf(), a in direction(), b in direction(), u in [0.0..1.0_f32, 0.0..1.0, 0.0..1.0],
    ) {
        let check = |s: Scatter| s.f.is_finite() && s.f.min_element() >= 0.0
            && s.to_light.0.is_finite() && s.to_light.0 >= 0.0
            && s.to_camera.0.is_finite() && s.to_camera.0 >= 0.0;
        for lobe in [Lobe::Continuous, Lobe::Delta(0), Lobe::Delta(1)] {
            for b in [b, a, -a, mirrored(a), -mirrored(a)] {
                let s = bsdf.eval(lobe, a, b);
                prop_assert!(check(s), "{:?} {:?}", lobe, s);
                // Only deltas are told apart from nothing by the lobe; what scatters can be sampled from both ends.
                if lobe == Lobe::Continuous && s.f.max_element() > 1e-6 {
                    prop_assert!(s.to_light.0 > 0.0 && s.to_camera.0 > 0.0, "{:?}", s);
                }
            }
        }
        for transport in TRANSPORTS {
            if let Some(sample) = bsdf.sample(a, transport, Vec3::from_array(u)) {
                let (c, l) = transport.sides(a, sample.direction);
                prop_assert!(check(sample.scatter), "{:?}", sample);
                prop_assert!(sample.direction.is_finite() && (sample.direction.length() - 1.0).abs() < 1e-4);
                prop_assert!(sample.scatter.forward_reverse(transport).0.0 > 0.0 && sample.scatter.f != Rgb::ZERO);
                prop_assert_eq!(sample.scatter, bsdf.eval(sample.lobe, c, l));
            }
        }
    }
}
