//! Layered materials: every path as defined, and the same image by every strategy.

use std::sync::Arc;

use glam::{DQuat, DVec3, Vec2, Vec3};
use pathspace::{
    integrator::IntegratorKind::{Bdpt, Hybrid, Light as LightTracing, Path},
    math::Rgb,
    sampling::Filter,
    scene::{
        Scene,
        bsdf::Metal,
        camera::{Camera, Sensor},
        geometry::Geometry,
        layers::{Coating, LayerMaps, Layers},
        light::Light,
        material::{Boundary, Maps, Material, MaterialId, Parameters},
        texture::{Encoding, Image, Texels, Texture},
    },
};

use crate::{
    agreement::where_all_cover_within,
    closed_forms::{UNBIASED, assert_image, constant, receiver::Receiver},
    identity::assert_identity_by,
    scenes,
    textures::{coarse_sphere, quad, waves},
};

const PLASTIC: Parameters =
    Parameters { base_color: Rgb::new(0.6, 0.3, 0.2), specular: 1.0, roughness: 0.6, ..Parameters::LAMBERT };
const METAL: Parameters = Parameters { base_color: Rgb::new(0.9, 0.7, 0.4), metallic: 1.0, ..PLASTIC };

fn material(name: &str, layers: Layers, base: Parameters, textures: LayerMaps) -> Material {
    let mut maps = Maps::new(Parameters { layers, ..base });
    maps.layers = Some(Box::new(textures));
    Material::varying(name, maps)
}

/// A smooth coat.
fn varnish(coat: f32) -> Layers {
    Layers { coat, coat_roughness: 0.2, ..Layers::NONE }
}

/// A room of layers open to the sky: its walls, floor and balls have each lobe, some with textures and normals of their
/// own, leaves stand in it, and its lamp shines through a coat.
pub fn room(sensor: Sensor) -> Scene {
    let image = |texels: Vec<u8>| Arc::new(Image::new(2, 2, Texels::U8(texels)));
    let grain = image(vec![255, 128, 255, 128, 255, 200, 30, 60, 255, 200, 200, 120]);
    let cloudy = image(vec![255, 80, 128, 200, 255, 255, 90, 40, 120, 60, 200, 255]);
    let linear = |image: &Arc<Image>| Some(Texture::new(image.clone(), Encoding::Linear));
    let coated = Layers { coat: 1.0, coat_roughness: 0.5, ..Layers::NONE };
    let coat_maps = LayerMaps { coat: linear(&cloudy), coat_normal: Some(waves(0.5)), ..LayerMaps::default() };
    let brushed = Layers { anisotropy: 0.9, grain: Vec2::from_angle(0.7), ..Layers::NONE };
    let velvet = Layers { sheen: Rgb::new(0.9, 0.8, 1.0), sheen_roughness: 0.5, ..Layers::NONE };
    let soap = Layers { iridescence: 1.0, film_ior: 1.5, film_thickness: 600.0, ..Layers::NONE };
    let green = Rgb::new(0.3, 0.8, 0.2);
    let leaf = Layers { diffuse_transmission: 0.6, diffuse_transmission_color: green, ..Layers::NONE };
    let all = Layers { coat: 0.7, sheen: Rgb::splat(0.4), anisotropy: 0.6, ..soap };
    let none = LayerMaps::default;
    let materials = vec![
        material("lacquer", coated, PLASTIC, coat_maps),
        material("brushed", brushed, METAL, LayerMaps { anisotropy: linear(&grain), ..none() }),
        material("velvet", velvet, Parameters { roughness: 0.9, ..PLASTIC }, none()),
        material("soap", soap, METAL, LayerMaps { film_thickness: linear(&cloudy), ..none() }),
        material("leaf", leaf, PLASTIC, none()),
        material("everything", Layers { coat_roughness: 0.4, sheen_roughness: 0.6, ..all }, METAL, none()),
        material("lamp", varnish(1.0), Parameters { base_color: Rgb::splat(0.3), ..PLASTIC }, none())
            .emitting(Rgb::new(2.0, 1.5, 1.0)),
        material("copper", Layers { metal: Metal::named("Cu"), ..Layers::NONE }, METAL, none()),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    quad(&mut g, [v(-1., -1., 1.), v(1., -1., 1.), v(1., -1., -1.), v(-1., -1., -1.)], 2.0, 0);
    quad(&mut g, [v(-1., -1., 1.), v(-1., -1., -1.), v(-1., 0.2, -1.), v(-1., 0.2, 1.)], 1.0, 1);
    quad(&mut g, [v(1., -1., -1.), v(1., -1., 1.), v(1., 0.2, 1.), v(1., 0.2, -1.)], 1.0, 2);
    quad(&mut g, [v(-1., -1., -1.), v(1., -1., -1.), v(1., 0.2, -1.), v(-1., 0.2, -1.)], 1.0, 3);
    quad(&mut g, [v(-0.2, -0.8, 0.2), v(0.3, -0.8, 0.1), v(0.3, -0.2, 0.1), v(-0.2, -0.2, 0.2)], 1.0, 4);
    scenes::quad(&mut g, [v(-0.6, 0.7, -0.6), v(0.6, 0.7, -0.6), v(0.6, 0.7, 0.6), v(-0.6, 0.7, 0.6)], 6);
    g.add_sphere(v(-0.45, -0.5, -0.4), 0.3, MaterialId(5));
    g.add_sphere(v(-0.1, -0.85, -0.1), 0.12, MaterialId(7));
    coarse_sphere(&mut g, v(0.45, -0.5, -0.4), 0.35, 2);
    let sky = Light::Environment { radiance: Rgb::new(0.4, 0.5, 0.6) };
    // The lamp is above the image: a sliver of a coat at a grazing angle is all outliers by light tracing.
    let camera = Camera::look_at(v(0.1, 0.3, 1.6), v(0.0, -0.5, -1.0), Vec3::Y, 0.9, sensor);
    Scene::new(g, materials, &[sky], camera)
}

#[test]
fn every_path_is_as_defined() {
    let scene = room(scenes::square(24, Filter::BlackmanHarris));
    assert_identity_by(&scenes::WEIGHTED, "layers", &scene, 2);
}

#[test]
fn every_strategy_sees_the_same() {
    let scene = room(scenes::square(16, Filter::Box));
    where_all_cover_within(0.05, "layers", &scene, &[Path, LightTracing, Hybrid, Bdpt], 2..=4);
}

/// Layers on what transmits, under a lamp and a sky: a coated ball that absorbs and disperses, one under a film that
/// lies in another under `velvet`, so that their bodies overlap, one between metal and glass, and a pane of many
/// layers, all on a floor of the layers `floor`.
fn vitrine(sensor: Sensor, floor: Layers, velvet: Layers) -> Scene {
    let glass = Parameters {
        base_color: Rgb::new(0.9, 0.95, 0.8),
        transmission: 1.0,
        roughness: 0.5,
        boundary: Boundary::Volume,
        ..PLASTIC
    };
    let water = Parameters { ior: 1.33, base_color: Rgb::ONE, ..glass };
    let film = Layers { iridescence: 1.0, film_ior: 1.8, film_thickness: 420.0, ..Layers::NONE };
    let brushed = Layers { anisotropy: 0.7, ..varnish(0.8) };
    let none = LayerMaps::default;
    let mut coated = material("coated", varnish(1.0), glass, none());
    (coated.absorption, coated.dispersion) = (Rgb::new(0.5, 1.0, 2.0), 1.0);
    let materials = vec![
        material("floor", floor, PLASTIC, none()),
        coated,
        material("film", film, Parameters { roughness: 0.4, ..glass }, none()),
        material("wet velvet", velvet, Parameters { roughness: 0.6, ..water }, none()),
        material("half metal", varnish(0.5), Parameters { metallic: 0.5, ..glass }, none()),
        material("pane", brushed, Parameters { boundary: Boundary::Thin, transmission: 0.8, ..glass }, none()),
        Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::new(6.0, 5.0, 4.0)),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    quad(&mut g, [v(-1.2, -1., 1.2), v(1.2, -1., 1.2), v(1.2, -1., -1.2), v(-1.2, -1., -1.2)], 2.0, 0);
    g.add_sphere(v(-0.55, -0.6, 0.0), 0.35, MaterialId(1));
    g.add_sphere(v(0.4, -0.55, -0.3), 0.25, MaterialId(2));
    g.add_sphere(v(0.5, -0.5, -0.1), 0.35, MaterialId(3));
    g.add_sphere(v(0.05, -0.8, 0.5), 0.18, MaterialId(4));
    quad(&mut g, [v(-0.9, -0.9, -0.6), v(0.1, -0.9, -0.8), v(0.1, 0.1, -0.8), v(-0.9, 0.1, -0.6)], 1.0, 5);
    scenes::quad(&mut g, [v(-0.7, 1.0, -0.7), v(0.7, 1.0, -0.7), v(0.7, 1.0, 0.7), v(-0.7, 1.0, 0.7)], 6);
    let sky = Light::Environment { radiance: Rgb::new(0.4, 0.5, 0.6) };
    let camera = Camera::look_at(v(0.1, 0.2, 1.9), v(0.0, -0.55, -0.4), Vec3::Y, 0.8, sensor);
    Scene::new(g, materials, &[sky], camera)
}

const VELVET: Layers = Layers { sheen: Rgb::new(0.6, 0.8, 0.7), sheen_roughness: 0.7, ..Layers::NONE };

/// With layers of extensions that are drafts: fuzz, and a rough base under a coloured coat.
fn with_drafts(sensor: Sensor) -> Scene {
    let coating = Some(Coating { ior: 1.7, color: Rgb::new(0.9, 0.7, 0.3), darkening: 0.8 });
    let clay = Layers { diffuse_roughness: 0.9, coat: 0.7, coat_roughness: 0.6, coating, ..Layers::NONE };
    vitrine(sensor, clay, Layers { fuzz: Some(0.8), ..VELVET })
}

#[test]
fn every_path_through_layered_glass_is_as_defined() {
    let scene = with_drafts(scenes::square(24, Filter::BlackmanHarris));
    assert_identity_by(&scenes::WEIGHTED, "layered glass", &scene, 2);
}

#[test]
fn every_strategy_sees_the_same_through_layered_glass() {
    let scene = vitrine(scenes::square(16, Filter::Box), varnish(1.0), VELVET);
    where_all_cover_within(0.05, "layered glass", &scene, &[Path, LightTracing, Hybrid, Bdpt], 2..=4);
}

#[test]
fn every_strategy_of_the_camera_sees_the_same_of_drafts() {
    let scene = with_drafts(scenes::square(16, Filter::Box));
    where_all_cover_within(0.05, "drafts", &scene, &[Path, Hybrid, Bdpt], 2..=4);
}

/// By how much the page of KHR_materials_clearcoat darkens what is emitted at this angle: `1 - clearcoat_fresnel`.
fn through_coat(cos: f64) -> f64 {
    1.0 - (0.04 + (1.0 - 0.04) * (1.0 - cos).powi(5))
}

/// A lamp of radiance 2 under a coat, black else.
fn coated_lamp() -> Material {
    let black = Parameters { base_color: Rgb::ZERO, ..Parameters::LAMBERT };
    material("lamp", varnish(1.0), black, LayerMaps::default()).emitting(Rgb::splat(2.0))
}

#[test]
fn a_coated_lamp_is_darker_towards_the_horizon() {
    for degrees in [0.0_f64, 50.0, 75.0] {
        let mut g = Geometry::default();
        let v = Vec3::new;
        let (sin, cos) = degrees.to_radians().sin_cos();
        // A little more than is seen of it.
        let (x, y) = (0.55 / cos as f32, 0.55);
        scenes::quad(&mut g, [v(-x, -y, 0.0), v(x, -y, 0.0), v(x, y, 0.0), v(-x, y, 0.0)], 0);
        let from = v(2.0 * sin as f32, 0.0, 2.0 * cos as f32);
        let camera = Camera::orthographic(from, Vec3::ZERO, Vec3::Y, 1.0, scenes::square(8, Filter::Box));
        let scene = Scene::new(g, vec![coated_lamp()], &[], camera);
        let expected = constant(2.0 * through_coat(cos));
        assert_image(&format!("a coated lamp at {degrees}°"), &scene, &UNBIASED, 1, 0.01, &expected);
    }
}

#[test]
fn a_coated_lamp_lights_what_stands_beside_it() {
    // The lamp stands upright on the receiver's plane, so that much of its light leaves at low angles.
    let receiver = Receiver::new(DVec3::ZERO, DQuat::IDENTITY, 0.5);
    let [left, width, top] = [-0.7, 1.0, 1.2];
    let mut g = Geometry::default();
    receiver.add(&mut g, 0);
    let corner = |y: f64, z: f64| DVec3::new(left, y, z).as_vec3();
    let half = 0.5 * width;
    scenes::quad(&mut g, [corner(0.1, half), corner(0.1, -half), corner(top, -half), corner(top, half)], 1);
    let camera = receiver.orthographic(2.0, scenes::square(8, Filter::Box));
    let scene = Scene::new(g, vec![Receiver::material(), coated_lamp()], &[], camera);
    let n = 48;
    let irradiance = |p: DVec3| {
        let (dy, dz) = ((top - 0.1) / f64::from(n), width / f64::from(n));
        let at = |i: u32, j: u32| DVec3::new(left, 0.1 + (f64::from(i) + 0.5) * dy, -half + (f64::from(j) + 0.5) * dz);
        let places = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let from = |(i, j)| {
            let to = p - at(i, j);
            let w = to.normalize();
            2.0 * through_coat(w.x) * w.x * -w.y / to.length_squared() * dy * dz
        };
        places.map(from).sum::<f64>()
    };
    let expected = receiver.expected(24, irradiance);
    assert_image("beside a coated lamp", &scene, &UNBIASED, 2, 0.01, &expected);
}
