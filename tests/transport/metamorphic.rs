//! Metamorphic relations: what a change of the scene must do to its image, whatever that image is.

use glam::{Affine3A, Quat, Vec3};
use pathspace::{
    math::Rgb,
    render::Settings,
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, MetallicRoughness},
        camera::Camera,
        geometry::Geometry,
        light::Light,
        material::{Material, MaterialId},
    },
    statistics::Comparison,
};

use crate::{
    exactness::{estimate, render},
    scenes,
};

/// The pane before the camera, if there is one.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pane {
    None,
    /// A thin wall of index 1.
    Thin,
    /// A box of index 1.
    Thick,
}

/// Into how many pieces the lamp is cut.
#[derive(Clone, Copy)]
struct Pieces(u32);

/// What may be changed about [`court`].
#[derive(Clone, Copy)]
struct Change {
    /// A similarity that moves everything, camera and lights too.
    motion: Affine3A,
    scale: f32,
    emission: f32,
    lamp: Pieces,
    pane: Pane,
}

const SAME: Change =
    Change { motion: Affine3A::IDENTITY, scale: 1.0, emission: 1.0, lamp: Pieces(1), pane: Pane::None };

/// Two walls, a ground and a varnished ball under a lamp, a point light, a sun and a sky.
fn court(change: Change) -> Scene {
    let Change { motion, scale, emission, .. } = change;
    let at = |x: f32, y: f32, z: f32| motion.transform_point3(Vec3::new(x, y, z));
    let varnish = MetallicRoughness::new(Rgb::new(0.6, 0.3, 0.2), 0.0, 0.3);
    let materials = vec![
        Material::diffuse("ground", Rgb::new(0.5, 0.45, 0.4)),
        Material::new("varnish", Bsdf::MetallicRoughness(varnish)),
        Material::diffuse("lamp", Rgb::splat(0.2)).emitting(emission * Rgb::new(2.0, 1.6, 1.2)),
        match change.pane {
            Pane::Thick => Material::glass("glass of index 1", 1.0),
            _ => Material::pane("pane of index 1", 1.0),
        },
    ];
    let mut g = Geometry::default();
    scenes::quad(&mut g, [at(-2., 0., -2.), at(-2., 0., 2.), at(2., 0., 2.), at(2., 0., -2.)], 0);
    scenes::quad(&mut g, [at(-2., 0., -2.), at(2., 0., -2.), at(2., 2., -2.), at(-2., 2., -2.)], 0);
    scenes::quad(&mut g, [at(-2., 0., 2.), at(-2., 0., -2.), at(-2., 2., -2.), at(-2., 2., 2.)], 0);
    g.add_sphere(at(0.2, 0.5, -0.4), 0.5 * scale, MaterialId(1));
    let n = change.lamp.0;
    let x = |i: u32| 0.4 + 1.2 * i as f32 / n as f32;
    for i in 0..n {
        let (a, b) = (x(i), x(i + 1));
        scenes::quad(&mut g, [at(a, 1.9, -0.8), at(b, 1.9, -0.8), at(b, 1.9, 0.6), at(a, 1.9, 0.6)], 2);
    }
    // Close to the camera, so that as good as no light passes the pane on its way to the scene.
    let pane = |z: f32| [at(0.4, 1.4, z), at(0.6, 1.4, z), at(0.6, 1.6, z), at(0.4, 1.6, z)];
    match change.pane {
        Pane::None => {}
        Pane::Thin => scenes::quad(&mut g, pane(3.5), 3),
        Pane::Thick => {
            scenes::quad(&mut g, pane(3.5), 3);
            let mut back = pane(3.48);
            back.reverse();
            scenes::quad(&mut g, back, 3);
        }
    }
    let lights = [
        Light::Point { position: at(-1.0, 1.6, 0.8), intensity: emission * scale * scale * Rgb::new(1.0, 1.2, 1.5) },
        Light::Directional {
            towards: motion.transform_vector3(Vec3::new(0.48, 0.8, 0.36)).normalize(),
            irradiance: Rgb::splat(emission),
        },
        Light::Environment { radiance: emission * Rgb::new(0.3, 0.4, 0.5) },
    ];
    let up = motion.transform_vector3(Vec3::Y).normalize();
    let camera = Camera::look_at(at(0.5, 1.5, 3.6), at(0.0, 0.6, -0.4), up, 0.8, scenes::square(16, Filter::Box));
    Scene::new(g, materials, &lights, camera)
}

/// Twice the light is twice the image, to the last bit: random choices go by ratios, and the film's scale is a power of
/// two.
#[test]
fn twice_the_emission_is_twice_the_image() {
    let (scene, doubled) = (court(SAME), court(Change { emission: 2.0, ..SAME }));
    for integrator in scenes::WEIGHTED {
        let settings = Settings { integrator, max_depth: 6, ..Settings::new(scene.camera.sensor()) };
        let (once, twice) = (render(&scene, &settings, 4), render(&doubled, &settings, 4));
        assert!(once.pixels.iter().all(|p| p.min_element() > 0.0) || integrator.name() == "light");
        let same = once.pixels.iter().zip(&twice.pixels).all(|(a, b)| *a * 2.0 == *b);
        assert!(same, "{integrator}");
    }
}

/// Changes that no image may show. Each is held against the unchanged scene by other random numbers.
#[test]
fn what_no_image_may_show() {
    let turned = Quat::from_axis_angle(Vec3::new(0.3, 0.5, -0.8).normalize(), 2.0);
    let moved = |scale: f32, shift: Vec3| Change {
        motion: Affine3A::from_scale_rotation_translation(Vec3::splat(scale), turned, shift),
        scale,
        ..SAME
    };
    let changes = [
        ("turned and moved", moved(1.0, Vec3::new(7.0, -3.0, 11.0)), 0),
        ("a thousandth of its size", moved(1e-3, Vec3::new(0.01, -0.02, 0.03)), 0),
        ("a thousand times its size", moved(1e3, Vec3::new(500.0, 900.0, -700.0)), 0),
        ("its lamp cut into three", Change { lamp: Pieces(3), ..SAME }, 0),
        ("seen through a thin pane of index 1", Change { pane: Pane::Thin, ..SAME }, 1),
        ("seen through a thick pane of index 1", Change { pane: Pane::Thick, ..SAME }, 2),
    ];
    let scene = court(SAME);
    for integrator in scenes::WEIGHTED {
        // Without roulette, whose decisions would see the pane's vertices.
        let settings = |seed: u64, more: u32| Settings {
            integrator,
            max_depth: 4 + more,
            roulette: pathspace::path::Roulette::Off,
            seed,
            ..Settings::new(scene.camera.sensor())
        };
        let spp = if integrator.name() == "light" { 320 } else { 48 };
        let reference = estimate(&scene, &settings(0, 0), 2 * spp, 24);
        for (i, (what, change, more)) in changes.into_iter().enumerate() {
            if change.pane != Pane::None && integrator.name() == "light" {
                continue; // the camera sees a specular surface
            }
            let other = estimate(&court(change), &settings(1000 * (i as u64 + 1), more), spp, 24);
            let comparison = Comparison::new(&reference, &other);
            println!("{integrator}, {what}: {comparison}");
            assert!(!comparison.differs(), "{integrator}, {what}: {comparison}");
            assert!(comparison.visible_bias < 0.02, "{integrator}, {what}: too noisy to tell: {comparison}");
        }
    }
}
