//! Smooth glass: slabs and panes with every reflection between their sides, absorption, and cameras and lights inside
//! glass.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    sampling::Filter,
    scene::{
        Scene,
        camera::Camera,
        geometry::Geometry,
        light::Light,
        material::{EmissionSides, Material, MaterialId},
    },
};

use super::{FROM_CAMERA, FROM_LIGHT, assert_image, constant, expected, receiver::Receiver};
use crate::scenes;

/// Unpolarised reflectance at |cos θ| for light that comes from the side of index 1, by Fresnel's equations and Snell's
/// law.
pub fn fresnel(cos: f64, ior: f64) -> f64 {
    let inside = (1.0 - (1.0 - cos * cos) / (ior * ior)).sqrt();
    let s = (cos - ior * inside) / (cos + ior * inside);
    let p = (ior * cos - inside) / (ior * cos + inside);
    0.5 * (s * s + p * p)
}

/// Transmittance and reflectance of a slab that reflects `r` at either side and lets `passed` through from one to the
/// other, of light that crosses it at most `crossings` times: T = (1−R)² τ Σ (Rτ)^{2k}, and R + (1−R)² R τ² Σ
/// (Rτ)^{2k}.
fn slab(r: f64, passed: f64, crossings: i32) -> (f64, f64) {
    let round = |k: i32| (r * passed).powi(k);
    let t: f64 = (0..crossings).step_by(2).map(round).sum();
    let back: f64 = (1..crossings).step_by(2).map(round).sum();
    ((1.0 - r).powi(2) * passed * t, r + (1.0 - r).powi(2) * passed * back)
}

#[test]
fn the_slab_is_summed_rightly() {
    let angles = [0.0_f64, 45.0, 60.0, 80.0];
    for (ior, reflectances) in [
        (1.5, [0.04, 0.050_239_91, 0.089_186_71, 0.387_704_4]),
        (1.33, [0.020_059_31, 0.027_521_38, 0.059_125_6, 0.346_916_1]),
        (1.8, [0.081_632_65, 0.093_523_12, 0.134_643_3, 0.418_749_6]),
    ] {
        for (degrees, r) in angles.into_iter().zip(reflectances) {
            let found = fresnel(degrees.to_radians().cos(), ior);
            assert!((found - r).abs() < 1e-7, "{ior}, {degrees}°: R = {found}");
            let (through, back) = slab(r, 1.0, 200);
            assert!((through - (1.0 - r) / (1.0 + r)).abs() < 1e-12 && (through + back - 1.0).abs() < 1e-12);
        }
    }
    for (degrees, t) in angles.into_iter().zip([0.923_076_9, 0.904_326_8, 0.836_232_5, 0.441_229_2]) {
        let found = slab(fresnel(degrees.to_radians().cos(), 1.5), 1.0, 200).0;
        assert!((found - t).abs() < 1e-7, "{degrees}°: T = {found}");
    }
}

/// Half the extent of what has to be larger than any path inside it gets; but not by much: hits of a triangle 800 m
/// wide are good to 2e-5 m, which turns an edge of 0.1 m by more than Fresnel's reflectance at 80° can bear.
const WIDE: f32 = 12.0;
const THICK: f32 = 0.1;

/// A large square in the plane y = `height` that faces up or down.
fn level(g: &mut Geometry, height: f32, up: f32, material: u32) {
    let v = |x: f32, z: f32| Vec3::new(up * x, height, z);
    scenes::quad(g, [v(-WIDE, -WIDE), v(-WIDE, WIDE), v(WIDE, WIDE), v(WIDE, -WIDE)], material);
}

/// The two sides of a slab whose upper one is at the height 0.
fn add_slab(g: &mut Geometry, material: u32) {
    level(g, 0.0, 1.0, material);
    level(g, -THICK, -1.0, material);
}

/// Seen at an angle θ through a slab: a bright plane below, or the sky mirrored in it above black.
#[test]
fn a_slab_seen_at_an_angle() {
    const DEPTH: u32 = 9;
    let sigma = DVec3::new(0.0, 1.0, 4.0);
    let sensor = scenes::square(16, Filter::Box);
    {
        for (ior, degrees, absorbing) in
            [(1.5, 0.0_f64, false), (1.33, 45.0, false), (1.5, 60.0, true), (1.8, 80.0, true)]
        {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let inside = (1.0 - (sin / ior).powi(2)).sqrt();
            let sigma = if absorbing { sigma } else { DVec3::ZERO };
            let mut glass = Material::glass("glass", ior as f32);
            glass.absorption = sigma.into();
            let materials = vec![
                glass,
                Material::diffuse("bright", Rgb::ZERO).emitting(Rgb::splat(2.0)),
                Material::diffuse("black", Rgb::ZERO),
            ];
            let from = 4.0 * Vec3::new(sin as f32, cos as f32, 0.0);
            let camera = Camera::orthographic(from, Vec3::ZERO, Vec3::Z, 0.5, sensor);
            let scene = |below: u32, lights: &[Light]| {
                let mut g = Geometry::default();
                add_slab(&mut g, 0);
                level(&mut g, -1.0, 1.0, below);
                Scene::new(g, materials.clone(), lights, camera)
            };
            let passed = (-sigma * f64::from(THICK) / inside).exp();
            let r = fresnel(cos, ior);
            // The first crossing makes three edges of two.
            let through = passed.map(|p| 2.0 * slab(r, p, DEPTH as i32 - 2).0);
            let back = passed.map(|p| 2.0 * slab(r, p, DEPTH as i32 - 2).1);
            let name = format!("index {ior}, {degrees}°");
            assert_image(
                &format!("slab, {name}"),
                &scene(1, &[]),
                &FROM_CAMERA,
                DEPTH,
                0.015,
                &expected(1, |_, _| through),
            );
            let sky = Light::Environment { radiance: Rgb::splat(2.0) };
            // A sample sees the reflection seldom at steep angles.
            if degrees >= 60.0 {
                let truth = expected(1, |_, _| back);
                assert_image(&format!("in the slab, {name}"), &scene(2, &[sky]), &FROM_CAMERA, DEPTH, 0.02, &truth);
            }
        }
    }
}

/// Two thin panes are a slab between whose sides nothing is absorbed or bent.
#[test]
fn two_panes_are_a_slab() {
    const DEPTH: u32 = 9;
    let sensor = scenes::square(16, Filter::Box);
    for (ior, degrees) in [(1.5, 45.0_f64), (1.8, 80.0)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let mut g = Geometry::default();
        add_slab(&mut g, 0);
        level(&mut g, -1.0, 1.0, 1);
        let bright = Material::diffuse("bright", Rgb::ZERO).emitting(Rgb::splat(2.0));
        let from = 4.0 * Vec3::new(sin as f32, cos as f32, 0.0);
        let camera = Camera::orthographic(from, Vec3::ZERO, Vec3::Z, 0.5, sensor);
        let scene = Scene::new(g, vec![Material::pane("pane", ior as f32), bright], &[], camera);
        let truth = constant(2.0 * slab(fresnel(cos, ior), 1.0, DEPTH as i32 - 2).0);
        assert_image(&format!("two panes, {ior}, {degrees}°"), &scene, &FROM_CAMERA, DEPTH, 0.015, &truth);
    }
}

/// A sun through a slab: what only light paths find, E = E_0 cos θ T with the same sum.
#[test]
fn a_sun_through_a_slab() {
    let sigma = DVec3::new(0.0, 1.0, 4.0);
    for (ior, degrees) in [(1.5, 0.0_f64), (1.5, 60.0)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let receiver = Receiver::new(DVec3::ZERO, glam::DQuat::IDENTITY, 0.5);
        let mut g = Geometry::default();
        // Few light paths would find a small square under a large slab: this one is as wide as they wander.
        let v = |x: f32, z: f32, y: f32| Vec3::new(x, y, z);
        for (y, up) in [(0.6, 1.0), (0.5, -1.0)] {
            let s = 2.5;
            scenes::quad(&mut g, [v(-up * s, -s, y), v(-up * s, s, y), v(up * s, s, y), v(up * s, -s, y)], 0);
        }
        receiver.add(&mut g, 1);
        let mut glass = Material::glass("glass", ior as f32);
        glass.absorption = sigma.into();
        let sun = Light::Directional { towards: v(sin as f32, 0.0, cos as f32), irradiance: Rgb::splat(3.0) };
        let camera = receiver.orthographic(0.3, scenes::square(8, Filter::Box));
        let scene = Scene::new(g, vec![glass, Receiver::material()], &[sun], camera);
        let inside = (1.0 - (sin / ior).powi(2)).sqrt();
        let passed = (-sigma * 0.1 / inside).exp();
        // Camera, receiver, two sides of the slab, sun: four edges. The receiver's light that glass mirrors back is
        // told apart by its length: longer paths hold it too, so that only the direct ones are compared.
        let r = fresnel(cos, ior);
        let direct = passed.map(|p| (1.0 - r).powi(2) * p);
        let truth = expected(1, |_, _| direct * 3.0 * cos * Receiver::ALBEDO / PI);
        assert_image(&format!("sun through a slab, {ior}, {degrees}°"), &scene, &FROM_LIGHT, 4, 0.05, &truth);
    }
}

/// Inside a glass ball of radius 1, off its middle, the sky is n² times as bright (Veach 5.2): along each ray
/// n² (1−R) τ_1 Σ (R τ)^k, with τ_1 to the first boundary and τ along the chords after it.
#[test]
fn a_camera_inside_glass_sees_the_sky_squeezed() {
    const DEPTH: u32 = 6;
    let (ior, sigma) = (1.5, DVec3::new(0.0, 0.3, 1.0));
    let mut glass = Material::glass("glass", ior as f32);
    glass.absorption = sigma.into();
    let mut g = Geometry::default();
    g.add_sphere(Vec3::ZERO, 1.0, MaterialId(0));
    let from = DVec3::new(0.2, -0.3, 0.25);
    let camera =
        Camera::look_at(from.as_vec3(), Vec3::new(0.1, 0.2, -1.0), Vec3::Y, 1.3, scenes::square(8, Filter::Box));
    let sky = Light::Environment { radiance: Rgb::splat(2.0) };
    let scene = Scene::new(g, vec![glass], &[sky], camera);
    let truth = expected(24, |u, v| {
        let raster = pathspace::scene::camera::Raster(DVec2::new(8.0 * u, 8.0 * v).as_vec2());
        let w = camera.direction(&camera.lens_point(), raster).as_dvec3();
        let b = from.dot(w);
        let half = (b * b - from.length_squared() + 1.0).sqrt();
        // From inside at cos θ = half, so outside sin θ' = n sin θ.
        let outside = (1.0 - ior * ior * (1.0 - half * half)).sqrt();
        let r = fresnel(outside, ior);
        let along = |d: f64| (-sigma * d).exp();
        let sum: DVec3 = (0..DEPTH as i32 - 1).map(|k| (along(2.0 * half) * r).map(|x| x.powi(k))).sum();
        along(half - b) * sum * (ior * ior * (1.0 - r) * 2.0)
    });
    assert!(truth.iter().all(|t| t.is_finite()));
    assert_image("camera in glass", &scene, &FROM_CAMERA, DEPTH, 0.01, &truth);
}

/// A black emitter of radius a around the middle of a glass ball: a ray with the impact parameter b enters with b/n, so
/// that the emitter looks n times as large, and L (1−R) τ/n² bright.
#[test]
fn an_emitter_inside_glass_seen_directly() {
    let (ior, a, sigma) = (1.5, 0.4, DVec3::new(0.0, 0.5, 2.0));
    let scene = glowing_ball(ior, a, sigma, |g| {
        let _ = g;
        Camera::orthographic(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO, Vec3::NEG_Z, 2.2, scenes::square(16, Filter::Box))
    });
    let truth = expected(200, |u, v| {
        let b = (DVec2::new(u - 0.5, v - 0.5) * 2.2).length();
        if b < ior * a { seen(ior, a, sigma, b) } else { DVec3::ZERO }
    });
    assert_image("emitter in glass", &scene, &FROM_CAMERA, 3, 0.01, &truth);
}

/// The same one lights a plane: E = ∫ L cos θ dω over what is seen of it, found by light paths through the glass as
/// well as by camera paths.
#[test]
fn an_emitter_inside_glass_lights_a_plane() {
    let (ior, a, sigma) = (1.5, 0.6, DVec3::splat(0.5));
    let receiver = Receiver::new(DVec3::new(0.2, -1.5, 0.0), glam::DQuat::IDENTITY, 0.8);
    let scene = glowing_ball(ior, a, sigma, |g| {
        receiver.add(g, 2);
        receiver.orthographic(0.4, scenes::square(8, Filter::Box))
    });
    // Of directions at the angle α from the middle of the ball at the distance d, b = d sin α; around it cos θ is on
    // average cos α cos θ_0, for the ball is above the horizon.
    let truth = receiver.expected(8, |p| {
        let (d, cos) = (p.length(), -p.normalize().dot(receiver.normal()));
        const STEPS: i32 = 400;
        let ring = |i: i32| {
            let b = (f64::from(i) + 0.5) / f64::from(STEPS) * (ior * a).min(1.0);
            seen(ior, a, sigma, b).x * b
        };
        // ∫ L cos α sin α dα dφ = 2π/d² ∫ L b db.
        (0..STEPS).map(ring).sum::<f64>() * (ior * a).min(1.0) / f64::from(STEPS) * 2.0 * PI / (d * d) * cos
    });
    let kinds = [FROM_LIGHT[0], FROM_LIGHT[1], FROM_LIGHT[2], IntegratorKind::Path, IntegratorKind::PathHemisphere];
    assert_image("plane under an emitter in glass", &scene, &kinds, 3, 0.015, &truth);
}

const GLOW: f64 = 3.0;

/// Radiance of the emitter in the glass ball, from outside along a ray with the impact parameter b.
fn seen(ior: f64, a: f64, sigma: DVec3, b: f64) -> DVec3 {
    let inside = b / ior;
    let way = (1.0 - inside * inside).sqrt() - (a * a - inside * inside).max(0.0).sqrt();
    (-sigma * way).exp() * (GLOW / (ior * ior) * (1.0 - fresnel((1.0 - b * b).max(0.0).sqrt(), ior)))
}

fn glowing_ball(ior: f64, a: f64, sigma: DVec3, camera: impl FnOnce(&mut Geometry) -> Camera) -> Scene {
    let mut glass = Material::glass("glass", ior as f32);
    glass.absorption = sigma.into();
    let mut emitter = Material::diffuse("emitter", Rgb::ZERO).emitting(Rgb::splat(GLOW as f32));
    emitter.emission_sides = EmissionSides::Front;
    let mut g = Geometry::default();
    g.add_sphere(Vec3::ZERO, 1.0, MaterialId(0));
    g.add_sphere(Vec3::ZERO, a as f32, MaterialId(1));
    let camera = camera(&mut g);
    Scene::new(g, vec![glass, emitter, Receiver::material()], &[], camera)
}

/// A point light in the middle of a glass ball: every ray passes at right angles, reflected ones return through the
/// middle, so that outside it is a point light of the intensity I (1−R) τ Σ (R τ²)^k. Without absorption the glass is
/// as if not there.
#[test]
fn a_point_light_inside_glass() {
    let (ior, sigma) = (1.5, DVec3::new(0.0, 0.5, 2.0));
    let mut glass = Material::glass("glass", ior as f32);
    glass.absorption = sigma.into();
    let receiver = Receiver::new(DVec3::new(0.3, -1.6, 0.0), glam::DQuat::IDENTITY, 0.6);
    let mut g = Geometry::default();
    g.add_sphere(Vec3::ZERO, 1.0, MaterialId(0));
    receiver.add(&mut g, 1);
    let lamp = Light::Point { position: Vec3::ZERO, intensity: Rgb::splat(2.0) };
    let camera = receiver.orthographic(0.4, scenes::square(8, Filter::Box));
    let scene = Scene::new(g, vec![glass, Receiver::material()], &[lamp], camera);
    // Lengths 3 and 4 hold no light that the ball mirrors back to the plane, which takes two edges more and D S D.
    let r = fresnel(1.0, ior);
    let intensity =
        (0..2).map(|k| (-sigma * f64::from(1 + 2 * k)).exp() * r.powi(k)).sum::<DVec3>() * (2.0 * (1.0 - r));
    let truth = expected(24, |u, v| {
        let p = receiver.at(u, v);
        intensity * (-p.normalize().dot(receiver.normal()) / p.length_squared() * Receiver::ALBEDO / PI)
    });
    assert_image("point light in glass", &scene, &FROM_LIGHT, 4, 0.03, &truth);
}
