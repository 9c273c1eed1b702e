//! Bodies in a constant sky: L = (albedo in the viewing direction) · L_sky, and for clear glass L_sky itself.

use std::{f64::consts::PI, sync::LazyLock};

use glam::{DVec2, DVec3, Vec3};
use pathspace::{
    integrator::{Gap, IntegratorKind},
    math::Rgb,
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, Lobe, MetallicRoughness},
        camera::Camera,
        geometry::Geometry,
        light::Light,
        material::{Material, MaterialId},
    },
};

use super::{WEIGHTED, assert_image, covering, dielectrics::fresnel, expected};
use crate::scenes;

const SKY: f64 = 1.5;

/// A ball of radius 1 that an orthographic image 2.2 m wide shows from +z, alone in the sky.
fn ball(material: Material) -> Scene {
    let mut g = Geometry::default();
    g.add_sphere(Vec3::ZERO, 1.0, MaterialId(0));
    let camera = Camera::orthographic(
        Vec3::new(0.0, 0.0, 3.0),
        Vec3::ZERO,
        Vec3::Y,
        WIDTH as f32,
        scenes::square(16, Filter::Box),
    );
    Scene::new(g, vec![material], &[Light::Environment { radiance: Rgb::splat(SKY as f32) }], camera)
}

const WIDTH: f64 = 2.2;

/// The image by cos θ of the viewing direction on the ball; the sky beside it.
fn by_cosine(radiance: impl Fn(f64) -> DVec3) -> pathspace::statistics::Regions {
    expected(200, |u, v| {
        let b2 = (DVec2::new(u - 0.5, v - 0.5) * WIDTH).length_squared();
        let seen = if b2 < 1.0 { radiance((1.0 - b2).sqrt()) } else { DVec3::ONE };
        seen * SKY
    })
}

/// Those that see an environment behind an orthographic camera's scene.
static KINDS: LazyLock<Vec<IntegratorKind>> = LazyLock::new(|| covering(Gap::ParallelBackground));

#[test]
fn a_diffuse_ball_reflects_its_albedo() {
    let truth = by_cosine(|_| DVec3::splat(0.6));
    assert_image("diffuse ball", &ball(Material::diffuse("grey", Rgb::splat(0.6))), &KINDS, 4, 0.01, &truth);
}

/// ∫ f cos θ dω by quadrature of the BSDF's value: an oracle of transport, not of the BSDF.
fn albedo(bsdf: &Bsdf, cos: f64) -> DVec3 {
    const SIDE: i32 = 160;
    let to_camera = Vec3::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
    let mut sum = DVec3::ZERO;
    for i in 0..SIDE {
        let z2 = (f64::from(i) + 0.5) / f64::from(SIDE);
        for j in 0..SIDE {
            let (sin, x) = (PI * (f64::from(j) + 0.5) / f64::from(SIDE)).sin_cos();
            let r = (1.0 - z2).sqrt();
            let to_light = Vec3::new((r * x) as f32, (r * sin) as f32, z2.sqrt() as f32);
            sum += bsdf.eval(Lobe::Continuous, to_camera, to_light).f.as_dvec3();
        }
    }
    // ∫ f cos θ dω = ∫∫ f/2 d(cos² θ) dφ, and f is even in φ.
    sum * PI / f64::from(SIDE * SIDE)
}

#[test]
fn a_glossy_ball_reflects_its_directional_albedo() {
    let red = Rgb::new(0.9, 0.4, 0.2);
    for (name, bsdf) in [
        ("rough metal", Bsdf::MetallicRoughness(MetallicRoughness::metal(red, 0.5))),
        ("plastic", Bsdf::MetallicRoughness(MetallicRoughness::new(red, 0.0, 0.4))),
    ] {
        // By the cosine at 256 places, and linearly between.
        let table: Vec<_> = (0..=256).map(|i| albedo(&bsdf, (f64::from(i) / 256.0).max(1e-3))).collect();
        let truth = by_cosine(|cos| {
            let i = ((cos * 256.0) as usize).min(255);
            table[i].lerp(table[i + 1], cos * 256.0 - i as f64)
        });
        assert_image(name, &ball(Material::new(name, bsdf)), &KINDS, 3, 0.01, &truth);
    }
}

/// A perfect metal by Schlick: F_0 in the middle of the ball, (1 − cos θ)⁵ of the rest towards its rim.
#[test]
fn a_smooth_metal_ball_reflects_by_schlick() {
    let f0 = Rgb::new(0.9, 0.6, 0.2);
    let truth = by_cosine(|cos| f0.as_dvec3() + (1.0 - f0.as_dvec3()) * (1.0 - cos).powi(5));
    assert_image("smooth metal", &ball(Material::mirror("metal", f0)), &KINDS, 3, 0.01, &truth);
}

/// At normal incidence a metal reflects its base colour, rough or smooth glTF aside: seen in a plane.
#[test]
fn a_metal_plate_reflects_its_base_color() {
    let f0 = Rgb::new(0.95, 0.5, 0.1);
    let mut g = Geometry::default();
    let v = Vec3::new;
    scenes::quad(&mut g, [v(-2., 0., -2.), v(-2., 0., 2.), v(2., 0., 2.), v(2., 0., -2.)], 0);
    let camera = Camera::orthographic(v(0., 1., 0.), Vec3::ZERO, Vec3::NEG_Z, 1.0, scenes::square(8, Filter::Box));
    let sky = Light::Environment { radiance: Rgb::splat(SKY as f32) };
    let scene = Scene::new(g, vec![Material::mirror("metal", f0)], &[sky], camera);
    assert_image("metal plate", &scene, &KINDS, 2, 0.001, &expected(1, |_, _| f0.as_dvec3() * SKY));
}

/// All that falls on clear glass leaves it again, but for what has been reflected inside more often than paths are
/// long: 1 − (1 − R) R^(n−2); with absorption, T² Σ R^k e^(−σ c (k+1)) along chords c and the outer reflection R.
#[test]
fn a_glass_ball_passes_and_reflects_everything() {
    const DEPTH: i32 = 5;
    let ior = 1.5;
    // Loss has to be frequent enough for a mean of it: of three edges, 4 % and more.
    let clear = by_cosine(|cos| {
        let r = fresnel(cos, ior);
        DVec3::splat(1.0 - (1.0 - r) * r)
    });
    assert_image("glass ball", &ball(Material::glass("glass", ior as f32)), &KINDS, 3, 0.01, &clear);
    let sigma = DVec3::new(0.1, 0.5, 1.0);
    let tinted = by_cosine(|cos| {
        let r = fresnel(cos, ior);
        let chord = 2.0 * (1.0 - (1.0 - cos * cos) / (ior * ior)).sqrt();
        let passed = (-sigma * chord).exp();
        let inside: DVec3 = (0..DEPTH - 2).map(|k| (passed * r).map(|x| x.powi(k)) * passed).sum();
        inside * (1.0 - r).powi(2) + r
    });
    let mut glass = Material::glass("tinted glass", ior as f32);
    glass.absorption = sigma.into();
    assert_image("tinted glass ball", &ball(glass), &KINDS, DEPTH as u32, 0.01, &tinted);
}

/// Through a pinhole light tracing sees the sky too, and a convex grey body before it.
#[test]
fn through_a_pinhole_light_tracing_sees_it_too() {
    let mut scene = ball(Material::diffuse("grey", Rgb::splat(0.6)));
    scene.camera = Camera::look_at(Vec3::new(0.0, 0.0, 1.5), Vec3::ZERO, Vec3::Y, 1.0, scenes::square(8, Filter::Box));
    // The ball fills the image: its rim is at asin(1/1.5) = 42°, the corners of the image at 38°.
    assert_image("grey ball close by", &scene, &WEIGHTED, 3, 0.015, &super::constant(0.6 * SKY));
}
