//! Layers against the formulas of the extensions' pages in f64, and their energy.

mod clear;
mod drafts;
mod furnace;
mod reference;

use super::{facets::Facets, film::Film, *};
use crate::scene::bsdf::{Bsdf, albedo::Split};

/// A white dielectric of index 1.5.
const WHITE: Surface = Surface { f0: Rgb::new(0.04, 0.04, 0.04), f90: 1.0, ..Surface::LAMBERT };

#[test]
fn a_layered_surface_takes_little_more_room_than_any_other() {
    assert_eq!(size_of::<Bsdf>(), 48);
}

#[test]
fn without_layers_it_is_the_plain_surface() {
    use crate::scene::bsdf::MetallicRoughness;
    for (metallic, alpha) in [(0.0, 0.3), (1.0, 0.1), (0.4, 0.6)] {
        let base_color = Rgb::new(0.9, 0.5, 0.2);
        let plain = MetallicRoughness { metallic, ..MetallicRoughness::new(base_color, metallic, alpha) };
        let layered = Layered::new(&Surface { base_color, metallic, alpha, ..WHITE });
        for (a, b) in [(0.9_f32, 0.3_f32), (0.5, 0.6), (0.2, 0.95)] {
            let a = Vec3::new((1.0 - a * a).sqrt(), 0.0, a);
            let b = Vec3::new(-0.8 * (1.0 - b * b).sqrt(), 0.6 * (1.0 - b * b).sqrt(), b);
            let [ours, theirs] =
                [layered.eval(Lobe::Continuous, a, b).f, plain.eval(Lobe::Continuous, a, b).f].map(Vec3::from);
            assert!((ours - theirs).length() < 6e-3 * theirs.length(), "{metallic} {alpha}: {ours}, not {theirs}");
        }
    }
}

#[test]
fn a_tilted_coat_shines_where_its_own_normal_mirrors() {
    let black = Surface { base_color: Rgb::ZERO, f0: Rgb::ZERO, f90: 0.0, ..Surface::LAMBERT };
    let normal = Vec3::new(0.3, -0.2, 0.93).normalize();
    let coated = Surface { coat: 1.0, coat_alpha: 0.01, coat_normal: normal.truncate(), coat_is_flat: false, ..black };
    let layered = Layered::new(&coated);
    let camera = Vec3::new(0.1, 0.2, 0.9).normalize();
    let mirrored = 2.0 * camera.dot(normal) * normal - camera;
    let flat = Vec3::new(-camera.x, -camera.y, camera.z);
    let [there, elsewhere] = [mirrored, flat].map(|light| layered.eval(Lobe::Continuous, camera, light).f.g());
    assert!(there > 50.0 && elsewhere < 1e-2, "{there} {elsewhere}");
}

#[test]
fn a_tilted_coat_shines_from_behind_as_from_the_front() {
    let black = Surface { base_color: Rgb::ZERO, f0: Rgb::ZERO, f90: 0.0, ..Surface::LAMBERT };
    let normal = Vec3::new(0.3, -0.2, 0.93).normalize();
    let coated = Surface { coat: 1.0, coat_alpha: 0.01, coat_normal: normal.truncate(), coat_is_flat: false, ..black };
    let layered = Layered::new(&coated);
    let camera = Vec3::new(0.1, 0.2, -0.9).normalize();
    let light = 2.0 * camera.dot(normal) * normal - camera;
    let f = layered.eval(Lobe::Continuous, camera, light).f.g();
    assert!(f > 30.0, "{f}");
    let sample = layered.sample(camera, Transport::Radiance, Vec3::splat(0.01)).unwrap();
    assert!(sample.direction.dot(light) > 0.9, "{} {light}", sample.direction);
}
