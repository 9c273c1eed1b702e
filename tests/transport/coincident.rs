//! Coincident surfaces: coplanar faces of different triangles show every integrator the same picture.

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, MetallicRoughness},
        camera::{Camera, Sensor},
        geometry::{Geometry, Mesh, Placement},
        light::Light,
        material::{AlphaMode, EmissionSides, Material, MaterialId},
    },
};

use crate::{
    agreement::where_all_cover_within,
    closed_forms::{assert_image, constant, expected},
    identity::assert_identity,
    scenes,
};

/// Where a scene is put, so that hardly any of its coordinates is a number that f32 has.
fn tilted(scale: f64) -> DAffine3 {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.3);
    DAffine3::from_scale_rotation_translation(DVec3::splat(scale), turn, scale * DVec3::new(0.7, -1.3, 2.1))
}

fn put(place: &DAffine3, p: DVec3) -> Vec3 {
    place.transform_point3(p).as_vec3()
}

fn looking(place: &DAffine3, from: DVec3, to: DVec3, yfov: f32, sensor: Sensor) -> Camera {
    let up = place.transform_vector3(if (to - from).normalize().y.abs() > 0.9 { DVec3::Z } else { DVec3::Y });
    Camera::look_at(put(place, from), put(place, to), up.normalize().as_vec3(), yfov, sensor)
}

/// A horizontal rectangle that faces up, or down.
fn sheet(g: &mut Geometry, place: &DAffine3, (low, high): (DVec2, DVec2), y: f64, up: bool, material: u32) {
    let corner = |x: f64, z: f64| put(place, DVec3::new(x, y, z));
    let mut corners = [corner(low.x, low.y), corner(low.x, high.y), corner(high.x, high.y), corner(high.x, low.y)];
    if !up {
        corners.reverse();
    }
    scenes::quad(g, corners, material);
}

const ALBEDO: f64 = 0.5;
const RADIANCE: f64 = 10.0;

/// A lamp of 1 m² in a ceiling of 4.2² m², 1 m above a floor; flush, and in the order of `first`.
fn flush_lamp(place: &DAffine3, lamp_first: bool, camera: Camera) -> Scene {
    let materials = vec![
        Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(RADIANCE as f32)),
        Material::diffuse("ceiling", Rgb::splat(0.7)),
        Material::diffuse("floor", Rgb::splat(ALBEDO as f32)),
    ];
    let mut g = Geometry::default();
    let mut lamp = [(0.5, 0), (2.1, 1)];
    if !lamp_first {
        lamp.reverse();
    }
    for (half, material) in lamp {
        sheet(&mut g, place, (DVec2::splat(-half), DVec2::splat(half)), 1.0, false, material);
    }
    sheet(&mut g, place, (DVec2::splat(-2.0), DVec2::splat(2.0)), 0.0, true, 2);
    Scene::new(g, materials, &[], camera)
}

/// The radiance of a floor under a rectangular lamp 1 m above it: ρ L F, with the form factor of a parallel rectangle
/// to a small element (Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*, B-3), summed over its four
/// quarters.
fn under_lamp(x: f64, z: f64) -> f64 {
    let quarter = |a: f64, b: f64| {
        let part = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
        (part(a, b) + part(b, a)) / std::f64::consts::TAU
    };
    let factor = |x: f64, z: f64| -> f64 {
        [0.5 - x, 0.5 + x].iter().flat_map(|&a| [0.5 - z, 0.5 + z].map(|b| quarter(a, b))).sum()
    };
    ALBEDO * RADIANCE * factor(x, z)
}

const KINDS: [IntegratorKind; 7] = [
    IntegratorKind::Path,
    IntegratorKind::PathLight,
    IntegratorKind::PathHemisphere,
    IntegratorKind::Light,
    IntegratorKind::Hybrid,
    IntegratorKind::Bdpt,
    IntegratorKind::Area,
];

#[test]
fn a_flush_lamp_shines_whatever_the_order_and_the_integrator() {
    assert!((under_lamp(0.0, 0.0) - 1.197).abs() < 5e-4, "{}", under_lamp(0.0, 0.0));
    for (scale, lamp_first, visible) in [(1.0, true, 0.02), (1.0, false, 0.02), (1e-2, false, 0.04), (1e3, true, 0.04)]
    {
        let place = tilted(scale);
        let sensor = scenes::square(8, Filter::Box);
        let camera = looking(&place, DVec3::new(0.0, 0.8, 0.0), DVec3::ZERO, 1.6, sensor);
        let scene = flush_lamp(&place, lamp_first, camera);
        let reach = 0.8 * 0.8_f64.tan();
        let truth = expected(16, |u, v| DVec3::splat(under_lamp((2.0 * u - 1.0) * reach, (2.0 * v - 1.0) * reach)));
        let name = format!("flush lamp, scale {scale}, lamp first: {lamp_first}");
        assert_image(&name, &scene, &KINDS, 2, visible, &truth);
    }
}

/// The exact centre, which a narrow camera sees from beside the lamp's middle; and the lamp itself.
#[test]
fn below_a_flush_lamp_it_is_1_197() {
    for lamp_first in [true, false] {
        let place = DAffine3::IDENTITY;
        let sensor = scenes::square(4, Filter::Box);
        let from_camera = &KINDS[..3];
        let centre = looking(&place, DVec3::new(0.0, 0.5, 0.0), DVec3::ZERO, 0.02, sensor);
        let centre = flush_lamp(&place, lamp_first, centre);
        assert_image("centre", &centre, from_camera, 2, 0.02, &constant(under_lamp(0.0, 0.0)));
        let lamp = looking(&place, DVec3::new(0.1, 0.0, 0.2), DVec3::new(0.1, 1.0, 0.1), 0.4, sensor);
        assert_image("lamp", &flush_lamp(&place, lamp_first, lamp), from_camera, 1, 0.01, &constant(RADIANCE));
    }
}

#[test]
fn both_orders_of_a_flush_lamp_give_the_same_image() {
    let image = |lamp_first| {
        let place = tilted(1.0);
        let camera =
            looking(&place, DVec3::new(0.0, 0.6, 2.6), DVec3::new(0.0, 0.4, 0.0), 0.9, scenes::square(24, Filter::Box));
        let scene = flush_lamp(&place, lamp_first, camera);
        let settings = Settings { max_depth: 4, ..Settings::new(scene.camera.sensor()) };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..4).for_each(|_| renderer.pass());
        renderer.film().image(4).pixels
    };
    // Which of the two a ray is found to hit first is a rounding, and the lamp's point is found from there.
    let (a, b) = (image(true), image(false));
    let apart: f32 = a.iter().zip(&b).map(|(a, b)| (*a - *b).abs().element_sum()).sum();
    let all: f32 = a.iter().map(|a| a.element_sum()).sum();
    assert!(all > 0.0 && apart < 1e-4 * all, "{apart} of {all}");
}

/// Cards on a floor and lamps in a ceiling, of any kind and overlapping as they come; a glass and an instance that
/// stand on the floor, and veils.
fn cards(place: &DAffine3, sensor: Sensor) -> Scene {
    let mut both = Material::diffuse("both", Rgb::splat(0.4)).emitting(Rgb::new(2.0, 3.0, 5.0));
    both.emission_sides = EmissionSides::Both;
    let veil = |material: Material, factor| material.covering(AlphaMode::Blend { factor });
    let gloss = Bsdf::MetallicRoughness(MetallicRoughness::new(Rgb::new(0.9, 0.6, 0.3), 0.8, 0.5));
    let materials = vec![
        Material::diffuse("white", Rgb::splat(0.8)),
        Material::diffuse("red", Rgb::new(0.8, 0.1, 0.1)),
        Material::diffuse("black", Rgb::ZERO),
        Material::new("gloss", gloss),
        Material::diffuse("lamp", Rgb::splat(0.2)).emitting(Rgb::new(8.0, 7.0, 5.0)),
        both,
        veil(Material::diffuse("veil", Rgb::new(0.1, 0.7, 0.3)), 0.5),
        veil(Material::diffuse("shine", Rgb::splat(0.3)).emitting(Rgb::new(3.0, 1.0, 1.0)), 0.25),
        Material::pane("pane", 1.5),
    ];
    let r = |x: f64, z: f64, w: f64, d: f64| (DVec2::new(x, z), DVec2::new(x + w, z + d));
    let mut g = Geometry::default();
    let floor = [
        (r(-0.9, -0.9, 0.7, 0.8), true, 1),
        (r(-0.6, -0.5, 0.9, 0.4), false, 2),
        (r(-1.0, -1.0, 2.0, 2.0), true, 0),
        (r(-0.5, -0.3, 0.8, 0.9), true, 6),
        (r(0.0, 0.1, 0.7, 0.6), true, 3),
        (r(0.2, -0.8, 0.6, 0.9), true, 6),
        (r(0.4, -0.6, 0.5, 0.5), true, 7),
        (r(-0.8, 0.3, 0.4, 0.5), true, 8),
    ];
    let ceiling = [
        (r(-1.0, -1.0, 2.0, 2.0), false, 0),
        (r(-0.6, -0.5, 0.7, 0.8), false, 4),
        (r(-0.2, -0.2, 0.7, 0.6), false, 5),
        (r(0.0, -0.7, 0.5, 0.8), true, 4),
        (r(-0.9, 0.2, 0.8, 0.5), false, 7),
    ];
    floor.iter().for_each(|(area, up, material)| sheet(&mut g, place, *area, -1.0, *up, *material));
    ceiling.iter().for_each(|(area, up, material)| sheet(&mut g, place, *area, 1.0, *up, *material));
    // Two boxes that stand flush on the floor and against each other.
    let mut mesh = Mesh::default();
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
    let corners: Vec<_> = (0..8).map(corner).collect();
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for (material, side) in [0, 1, 0, 3, 0, 1].into_iter().zip(sides) {
        let [a, b, c, d] = side;
        mesh.add_triangles(&corners, None, &[[a, b, c], [a, c, d]], MaterialId(material));
    }
    let mesh = g.add_mesh(mesh);
    for x in [-0.2, 0.1] {
        let size = DAffine3::from_translation(DVec3::new(x, -1.0, -0.4))
            * DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(0.3, 0.5, 0.35)));
        g.add_instance(mesh, Placement::new(*place * size).expect("usable"));
    }
    let scale = place.transform_vector3(DVec3::X).length_squared() as f32;
    let point = Light::Point { position: put(place, DVec3::new(0.4, 0.2, 0.6)), intensity: Rgb::splat(0.7 * scale) };
    let camera = looking(place, DVec3::new(0.2, 0.1, 2.9), DVec3::new(0.0, -0.2, 0.0), 0.9, sensor);
    Scene::new(g, materials, &[point], camera)
}

#[test]
fn every_path_among_coincident_surfaces_is_as_defined() {
    let place = tilted(1.0);
    assert_identity("cards", &cards(&place, scenes::square(16, Filter::Box)), 1);
}

#[test]
fn all_integrators_see_the_same_of_coincident_surfaces() {
    let kinds = [IntegratorKind::Path, IntegratorKind::Hybrid, IntegratorKind::Light, IntegratorKind::Bdpt];
    for scale in [1e-2, 1.0, 1e3] {
        let scene = cards(&tilted(scale), scenes::square(8, Filter::Box));
        let (visible, lengths) = if scale == 1.0 { (0.02, 1..=4) } else { (0.04, 1..=2) };
        where_all_cover_within(visible, &format!("cards, scale {scale}"), &scene, &kinds, lengths);
    }
    let scene = cards(&tilted(1.0), scenes::square(8, Filter::Box));
    let kinds = [IntegratorKind::Path, IntegratorKind::PathHemisphere, IntegratorKind::PathLight, IntegratorKind::Area];
    where_all_cover_within(0.05, "cards from areas", &scene, &kinds, 1..=2);
}
