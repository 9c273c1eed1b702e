//! Shading normals that tilt: what a surface reflects does not depend on how far N_s and N_g lie apart, and every
//! strategy has the same f̂ there.

use std::sync::Arc;

use glam::Vec3;
use pathspace::{
    film::Image as Film,
    integrator::IntegratorKind,
    math::Rgb,
    render::{Renderer, Settings, Statistics},
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, Dielectric, MetallicRoughness, ThinDielectric},
        camera::{Camera, Sensor},
        geometry::Geometry,
        light::Light,
        material::{Boundary, Maps, Material, MaterialId, NormalMap, Parameters},
        texture::{Encoding, Image, Texels, Texture},
    },
};

use crate::{
    agreement::where_all_cover_within,
    identity::assert_identity,
    scenes,
    textures::{coarse_sphere, quad},
};

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// A normal map of one direction in the tangent frame.
fn constant(n: Vec3) -> NormalMap {
    let texels = n.normalize().to_array().map(|x| (127.5 + 127.5 * x).round() as u8);
    let image = Arc::new(Image::new(1, 1, Texels::U8(texels.to_vec())));
    NormalMap { texture: Texture::new(image, Encoding::Linear), scale: 1.0 }
}

const WHITE: Parameters = Parameters { base_color: Rgb::ONE, ..Parameters::LAMBERT };

fn metal(roughness: f32) -> Parameters {
    Parameters { metallic: 1.0, roughness, ..WHITE }
}

fn plastic(roughness: f32) -> Parameters {
    Parameters { specular: 1.0, roughness, ..WHITE }
}

fn pane(ior: f32, roughness: f32) -> Parameters {
    Parameters { transmission: 1.0, specular: 1.0, ior, roughness, boundary: Boundary::Thin, ..WHITE }
}

/// A quad of these parameters in a white furnace, seen from `towards`.
fn furnace(parameters: Parameters, normal: Option<NormalMap>, towards: Vec3) -> Scene {
    let mut maps = Maps::new(parameters);
    maps.normal = normal;
    let mut g = Geometry::default();
    quad(&mut g, [v(-1., -1., 0.), v(1., -1., 0.), v(1., 1., 0.), v(-1., 1., 0.)], 1.0, 0);
    let sensor = scenes::square(8, Filter::Box);
    let camera = Camera::look_at(towards * 10.0, Vec3::ZERO, Vec3::Y, 1e-3, sensor);
    Scene::new(g, vec![Material::varying("quad", maps)], &[Light::Environment { radiance: Rgb::ONE }], camera)
}

fn render(scene: &Scene, integrator: IntegratorKind, max_depth: u32, spp: u32) -> (Film, Statistics) {
    let settings = Settings { integrator, max_depth, ..Settings::new(scene.camera.sensor()) };
    let mut renderer = Renderer::new(scene, &settings);
    (0..spp).for_each(|_| renderer.pass());
    (renderer.film().image(spp), renderer.statistics())
}

fn mean(image: &Film) -> f32 {
    image.pixels.iter().map(|pixel| pixel.element_sum() / 3.0).sum::<f32>() / image.pixels.len() as f32
}

/// Whatever a flat surface reflects, one with a normal map of 45° reflects, too: as much as the flat one does where ω_s
/// lies. From N_g, cot a_s = cot 45° + tan 45°.
#[test]
fn a_normal_map_of_45_degrees_keeps_what_a_flat_surface_reflects() {
    let tilt = v(1.0, 0.0, 1.0);
    let shading = 0.5_f32.atan();
    let angle = v(shading.sin(), 0.0, shading.cos());
    let cases = [0.0, 0.1, 0.3, 0.6, 1.0].map(|r| ("metal", metal(r)));
    let cases = cases.into_iter().chain([0.0, 0.4, 1.0].map(|r| ("plastic", plastic(r))));
    let cases = cases.chain([("diffuse", WHITE), ("pane", pane(1.5, 0.0)), ("rough pane", pane(1.5, 0.5))]);
    for (name, parameters) in cases {
        let (image, statistics) =
            render(&furnace(parameters, Some(constant(tilt)), Vec3::Z), IntegratorKind::Path, 2, 256);
        let (flat, _) = render(&furnace(parameters, None, angle), IntegratorKind::Path, 2, 256);
        let (found, expected) = (mean(&image), mean(&flat));
        println!("{name}, roughness {}: {found:.4}, flat {expected:.4}", parameters.roughness);
        // The map's bytes turn the normal by a quarter of a degree; a smooth surface has no noise.
        assert!(
            (found / expected - 1.0).abs() < 0.008,
            "{name}, roughness {}: {found} {expected}",
            parameters.roughness
        );
        assert_eq!(statistics.lost_to_sides, 0, "{name}");
    }
    let (image, _) = render(&furnace(metal(0.0), Some(constant(tilt)), Vec3::Z), IntegratorKind::Path, 2, 4);
    assert!((mean(&image) - 1.0).abs() < 1e-4, "{}", mean(&image));
}

/// A ball in a white furnace: an octahedron with smooth normals, or a sphere.
fn ball(material: Material, coarse: bool, sensor: Sensor) -> Scene {
    let mut g = Geometry::default();
    if coarse {
        coarse_sphere(&mut g, Vec3::ZERO, 0.6, 0);
    } else {
        g.add_sphere(Vec3::ZERO, 0.6, MaterialId(0));
    }
    let camera = Camera::look_at(v(0.7, 0.9, 2.4), Vec3::ZERO, Vec3::Y, 0.6, sensor);
    Scene::new(g, vec![material], &[Light::Environment { radiance: Rgb::ONE }], camera)
}

/// Where a true sphere is bright, so is a coarse one: no black crescent where the camera, or a mirror's image, lies
/// between the horizons of both normals.
#[test]
fn a_coarse_ball_has_no_black_crescents() {
    let darkest = |image: &Film| image.pixels.iter().map(|p| p.min_element()).fold(f32::INFINITY, f32::min);
    // By directions alone, without noise where a sample keeps all: a bound on every pixel.
    for (name, parameters, depth) in
        [("mirror", metal(0.0), 2), ("white", WHITE, 2), ("pane", pane(1.5, 0.0), 40), ("no pane", pane(1.0, 0.0), 8)]
    {
        let material = Material::new(name, parameters.bsdf());
        let (image, statistics) =
            render(&ball(material, true, scenes::square(48, Filter::Box)), IntegratorKind::PathHemisphere, depth, 16);
        let rays = statistics.rays.camera as f64;
        println!("{name}: darkest pixel {}, lost {} of {rays}", darkest(&image), statistics.lost_to_sides);
        let tolerance = if name == "pane" { 0.05 } else { 1e-4 };
        assert!((darkest(&image) - 1.0).abs() < tolerance, "{name}: {}", darkest(&image));
        assert!(statistics.lost_to_sides as f64 <= 1e-5 * rays, "{name}: {}", statistics.lost_to_sides);
    }
    for (name, parameters) in [("metal", metal(0.4)), ("plastic", plastic(0.0)), ("rough plastic", plastic(0.6))] {
        let [coarse, fine] = [true, false].map(|coarse| {
            let material = Material::new(name, parameters.bsdf());
            darkest(&render(&ball(material, coarse, scenes::square(24, Filter::Box)), IntegratorKind::Path, 2, 256).0)
        });
        println!("{name}: darkest pixel {coarse} of a coarse ball, {fine} of a sphere");
        assert!(coarse > 0.93 * fine, "{name}: {coarse} {fine}");
    }
}

/// An interface that neither reflects nor bends cannot be seen, on smooth normals as on flat ones.
#[test]
fn an_invisible_pane_has_no_rim() {
    let volume = Dielectric { color: Rgb::ONE, ior: 1.0, alpha: 0.0, transmission: 1.0 };
    let thin = ThinDielectric { color: Rgb::ONE, ior: 1.0, alpha: 0.0, transmission: 1.0 };
    for (name, bsdf) in [("volume", Bsdf::Dielectric(volume)), ("pane", Bsdf::Thin(thin))] {
        let scene = ball(Material::new(name, bsdf), true, scenes::square(64, Filter::Box));
        let (image, _) = render(&scene, IntegratorKind::Path, 8, 8);
        for pixel in &image.pixels {
            assert!((*pixel - Rgb::ONE).abs().max_element() < 1e-4, "{name}: {pixel}");
        }
    }
}

/// A room of coarse balls and a steep normal map, one of every kind of lobe, so that N_s and N_g are far apart all
/// over.
fn tilted_room(sensor: Sensor) -> Scene {
    let gloss =
        |metallic, alpha| Bsdf::MetallicRoughness(MetallicRoughness::new(Rgb::new(0.9, 0.8, 0.6), metallic, alpha));
    let mut steep = Maps::new(Parameters { base_color: Rgb::splat(0.7), roughness: 0.5, specular: 1.0, ..WHITE });
    steep.normal = Some(constant(v(0.8, 0.3, 0.6)));
    let frosted = ThinDielectric { color: Rgb::splat(0.9), ior: 1.4, alpha: 0.2, transmission: 0.8 };
    let mut lamp = Material::diffuse("lamp", Rgb::splat(0.2)).emitting(Rgb::splat(6.0));
    lamp.emission_sides = pathspace::scene::material::EmissionSides::Both;
    let rough_glass = Dielectric { color: Rgb::ONE, ior: 1.4, alpha: 0.2, transmission: 1.0 };
    let materials = vec![
        Material::diffuse("wall", Rgb::new(0.7, 0.72, 0.68)),
        Material::mirror("mirror", Rgb::splat(0.9)),
        Material::new("brass", gloss(1.0, 0.15)),
        Material::new("plastic", gloss(0.0, 0.2)),
        Material::glass("glass", 1.5),
        Material::pane("pane", 1.5),
        Material::new("frosted pane", Bsdf::Thin(frosted)),
        Material::varying("steep", steep),
        lamp,
        Material::new("frosted glass", Bsdf::Dielectric(rough_glass)),
        Material::diffuse("white", Rgb::splat(0.8)),
    ];
    let mut g = Geometry::default();
    scenes::cube_inside(&mut g, 1.0, [0, 0, 0, 0, 0, 0]);
    quad(&mut g, [v(-0.95, -0.95, 0.95), v(0.95, -0.95, 0.95), v(0.95, -0.95, -0.95), v(-0.95, -0.95, -0.95)], 1.0, 7);
    quad(&mut g, [v(-0.4, 0.9, -0.4), v(0.4, 0.9, -0.4), v(0.4, 0.9, 0.4), v(-0.4, 0.9, 0.4)], 1.0, 8);
    let places = [
        (-0.6, -0.5, -0.6),
        (0.0, -0.5, -0.6),
        (0.6, -0.5, -0.6),
        (-0.6, 0.1, -0.7),
        (0.0, 0.1, -0.7),
        (0.6, 0.1, -0.7),
    ];
    for ((x, y, z), material) in places.into_iter().zip([1, 2, 3, 4, 5, 6]) {
        coarse_sphere(&mut g, v(x, y, z), 0.25, material);
    }
    coarse_sphere(&mut g, v(-0.35, -0.6, 0.0), 0.2, 9);
    coarse_sphere(&mut g, v(0.35, -0.6, 0.0), 0.2, 10);
    let camera = Camera::look_at(v(0.1, 0.1, 0.9), v(0.0, -0.2, -1.0), Vec3::Y, 1.2, sensor);
    let others = [
        Light::Point { position: v(-0.3, 0.4, 0.3), intensity: Rgb::splat(0.3) },
        Light::Directional { towards: v(0.3, 0.8, 0.4).normalize(), irradiance: Rgb::splat(1.0) },
    ];
    Scene::new(g, materials, &others, camera)
}

#[test]
fn every_path_over_tilted_normals_is_as_defined() {
    assert_identity("tilted room", &tilted_room(scenes::square(24, Filter::Box)), 2);
}

/// A mirror, brass, plastic and a steep normal map before a lamp, whatever of it all integrators cover.
#[test]
fn integrators_agree_over_tilted_normals() {
    let mut steep = Maps::new(Parameters { base_color: Rgb::splat(0.7), roughness: 0.5, specular: 1.0, ..WHITE });
    steep.normal = Some(constant(v(0.8, 0.3, 0.6)));
    let brass = Bsdf::MetallicRoughness(MetallicRoughness::metal(Rgb::new(0.9, 0.8, 0.6), 0.3));
    let materials = vec![
        Material::varying("steep", steep),
        Material::new("brass", brass),
        Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(4.0)),
        Material::diffuse("white", Rgb::splat(0.8)),
        Material::new("plastic", plastic(0.6).bsdf()),
        Material::mirror("mirror", Rgb::splat(0.9)),
    ];
    let mut g = Geometry::default();
    quad(&mut g, [v(-1.2, -0.7, 1.2), v(1.2, -0.7, 1.2), v(1.2, -0.7, -1.2), v(-1.2, -0.7, -1.2)], 1.0, 0);
    coarse_sphere(&mut g, v(-0.6, 0.0, 0.0), 0.5, 1);
    coarse_sphere(&mut g, v(0.6, 0.0, 0.0), 0.5, 3);
    coarse_sphere(&mut g, v(0.0, 0.0, -0.7), 0.5, 4);
    coarse_sphere(&mut g, v(0.0, -0.3, 0.6), 0.3, 5);
    quad(&mut g, [v(-1., 1.5, -1.), v(1., 1.5, -1.), v(1., 1.5, 1.), v(-1., 1.5, 1.)], 1.0, 2);
    let camera = Camera::look_at(v(0.3, 0.9, 2.4), v(0.0, -0.2, 0.0), Vec3::Y, 0.8, scenes::square(16, Filter::Box));
    let scene = Scene::new(g, materials, &[], camera);
    let kinds = [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt];
    where_all_cover_within(0.02, "tilted normals", &scene, &kinds, 2..=4);
}
