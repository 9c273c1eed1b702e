//! Clear boundaries under layers: without any they are those of plain glass, light crosses the layers once, and what
//! does not cross comes back.

use super::{furnace::power, *};
use crate::scene::bsdf::{Dielectric, ThinDielectric, fresnel};

fn glass(of: fn(Clear) -> Passage, ior: f32) -> Surface {
    let r = (ior - 1.0) / (ior + 1.0);
    let color = Rgb::new(0.9, 0.5, 0.2);
    let passage = of(Clear { fraction: 1.0, ior });
    Surface { base_color: color, f0: Rgb::splat(r * r), f90: 1.0, passage, ..Surface::LAMBERT }
}

/// Pairs of directions on all combinations of sides.
fn pairs() -> Vec<[Vec3; 2]> {
    let at =
        |cos: f32, phi: f32| Vec3::new((1.0 - cos * cos).sqrt() * phi.cos(), (1.0 - cos * cos).sqrt() * phi.sin(), cos);
    let mut pairs = Vec::new();
    for (a, b, phi) in [(0.9, 0.8, 2.9), (0.5, 0.65, 3.3), (0.8, 0.35, 2.5), (0.95, 0.93, 0.7)] {
        for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            pairs.push([at(s * a, 0.2), at(t * b, phi)]);
        }
    }
    pairs
}

#[test]
fn without_layers_it_is_plain_glass_and_a_plain_pane() {
    let mut compared = 0;
    for (ior, alpha) in [(1.5, 0.3), (1.2, 0.5), (2.2, 0.15), (0.7, 0.4)] {
        let of_volume = Bsdf::Layered(Layered::new(&Surface { alpha, ..glass(Passage::Volume, ior) }));
        let of_wall = Bsdf::Layered(Layered::new(&Surface { alpha, ..glass(Passage::Wall, ior) }));
        let color = Rgb::new(0.9, 0.5, 0.2);
        let volume = Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission: 1.0 });
        let wall = Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission: 1.0 });
        for [camera, light] in pairs() {
            for (layered, plain) in [(of_volume, volume), (of_wall, wall)] {
                let [ours, theirs] = [layered, plain].map(|b| Vec3::from(b.eval(Lobe::Continuous, camera, light).f));
                assert!(
                    (ours - theirs).length() < 0.01 * theirs.length() + 1e-5,
                    "{ior} {alpha}: {ours}, not {theirs}, to {camera} from {light}"
                );
                assert_eq!(layered.relative_ior(camera, light), plain.relative_ior(camera, light));
                compared += usize::from(theirs.length() > 1e-3);
            }
        }
    }
    assert!(compared > 90, "{compared}");
}

/// 1 − E of a smooth coat, by Schlick's formula in f64.
fn through(coat: f64, cos: f64) -> f64 {
    1.0 - coat * (0.04 + 0.96 * (1.0 - cos).powi(5))
}

/// Oracle: Snell's law and the formulas of the pages. Into a smooth coated volume 1 − E(θ) of what the bare boundary
/// would pass goes in, and as much comes out, θ being the angle outside.
#[test]
fn light_crosses_a_coat_once() {
    for coat in [0.5_f32, 1.0] {
        let bare = Surface { alpha: 0.0, base_color: Rgb::ONE, ..glass(Passage::Volume, 1.5) };
        let coated = Layered::new(&Surface { coat, coat_alpha: 0.0, ..bare });
        for cos in [1.0_f32, 0.8, 0.5, 0.3] {
            let above = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let inside = fresnel::refracted_cos(cos, 1.5);
            let below = Vec3::new(-above.x / 1.5, 0.0, -inside);
            let expected = through(f64::from(coat), f64::from(cos)) * f64::from(1.0 - fresnel::dielectric(cos, 1.5));
            for known in [above, below] {
                for transport in [Transport::Radiance, Transport::Importance] {
                    let passed = passed(&coated, known, transport);
                    assert!((passed - expected).abs() < 3e-3, "{coat} from {known}: {passed}, not {expected}");
                }
            }
        }
    }
}

/// The part of the power that samples carry to the other side.
fn passed(layered: &Layered, known: Vec3, transport: Transport) -> f64 {
    power(layered, known, transport, 4096, |w| w.z * known.z < 0.0)
}

/// A film of a quarter of a wave of a greater index mirrors its own wavelength, and lets pass what is left of each: a
/// pane under it is tinted by what it does not reflect.
#[test]
fn a_film_lets_pass_what_it_does_not_reflect() {
    for of in [Passage::Wall as fn(Clear) -> Passage, Passage::Volume] {
        let filmed = Surface {
            base_color: Rgb::ONE,
            alpha: 0.0,
            film: 1.0,
            film_ior: 2.2,
            film_thickness: 550.0 / 4.0 / 2.2,
            ..glass(of, 1.5)
        };
        let reflected =
            Film { ior: 2.2, thickness: 550.0 / 4.0 / 2.2, outside: 1.0 }.reflectance(Rgb::splat(0.04), 1.0);
        assert!(reflected.g() > 0.2, "{reflected}");
        let layered = Layered::new(&filmed);
        for known in [Vec3::Z, -Vec3::Z] {
            let passed = passed(&layered, known, Transport::Radiance);
            let expected = f64::from(1.0 - reflected.g());
            assert!((passed - expected).abs() < 4e-3, "from {known}: {passed}, not {expected}");
        }
    }
}

/// `KHR_materials_specular`: f0 = min(((n − 1)/(n + 1))² colour, 1) specular, f90 = specular.
#[test]
fn the_specular_of_glass_is_that_of_its_page() {
    for (specular, tint) in [(0.5_f32, 1.0_f32), (1.0, 2.0), (0.4, 3.0)] {
        let f0 = (0.04 * tint).min(1.0) * specular;
        let surface = Surface { alpha: 0.0, f0: Rgb::splat(f0), f90: specular, ..glass(Passage::Volume, 1.5) };
        let s = Stack::new(no_smoother(surface), Averages::default());
        let boundary = s.clear.as_ref().expect("it is clear");
        for (cos, expected) in [(1.0, f0), (1e-3, specular)] {
            let found = boundary.reflectance(&s, cos).g();
            assert!((found - expected).abs() < 0.01 * expected, "{specular} {tint} at {cos}: {found}, not {expected}");
        }
    }
}

#[test]
fn another_index_in_front_changes_what_is_relative_to_it() {
    let surface = Surface { coat: 1.0, coat_alpha: 0.2, alpha: 0.2, ..glass(Passage::Volume, 1.5) };
    let in_water = Layered::new(&surface).with_volume_ior(1.5 / 1.33);
    let [camera, light] = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.5, 0.0, -0.86).normalize()];
    assert!((in_water.relative_ior(camera, light) - 1.5 / 1.33).abs() < 1e-6);
    let r = (1.5_f32 - 1.33) / (1.5 + 1.33);
    assert!((in_water.surface().f0.g() - r * r).abs() < 2e-4, "{:?}", in_water.surface());
    assert_eq!(in_water.with_volume_ior(1.5 / 1.33), in_water);
    assert_eq!(in_water.with_volume_ior(1.5), Layered::new(&surface));
    // A bubble whose index is that of air, in glass, reflects as any boundary of that index.
    let bubble = Layered::new(&glass(Passage::Volume, 1.0)).with_volume_ior(1.0 / 1.5);
    assert!((bubble.surface().f0.g() - 0.04).abs() < 1e-4, "{:?}", bubble.surface());
}
