//! What lies inside: bodies that absorb, one within another, beside another or reaching into it, with cameras, lamps
//! and cards in them.
//!
//! Oracles: Beer–Lambert and Fresnel at normal incidence, layer by layer and with every reflection between them, and
//! the definition, which finds the medium of an edge by crossings from outside while walks carry it along.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind::{self, Area, Bdpt, Hybrid, Light as LightTracing, Path, PathHemisphere, PathLight},
    math::Rgb,
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, Dielectric},
        camera::Camera,
        geometry::{Geometry, Mesh, Placement},
        light::Light,
        material::{AlphaMode, EmissionSides, Material, MaterialId},
        media::{self, Boundary, Fault},
    },
};

use crate::{
    closed_forms::{FROM_CAMERA, TO_POINTS, assert_image, expected},
    identity, scenes,
};

/// The corners and the outward faces of a box.
fn cuboid(min: Vec3, max: Vec3) -> ([Vec3; 8], [[u32; 3]; 12]) {
    let corner = |i: usize| {
        let pick = |k: usize| if i >> k & 1 == 0 { min[k] } else { max[k] };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    let all: Vec<_> = quads.into_iter().flat_map(triangles).collect();
    (std::array::from_fn(corner), all.try_into().expect("twelve"))
}

fn add_box(g: &mut Geometry, min: Vec3, max: Vec3, material: u32) {
    let (corners, faces) = cuboid(min, max);
    g.add_triangles(&corners, None, &faces, MaterialId(material));
}

/// A box between two heights, as wide as `wide` to each side of the axis.
fn add_layer(g: &mut Geometry, wide: f32, [low, high]: [f32; 2], material: u32) {
    add_box(g, Vec3::new(-wide, low, -wide), Vec3::new(wide, high, wide), material);
}

fn glass(ior: f32, absorption: DVec3) -> Material {
    let mut glass = Material::glass("glass", ior);
    glass.absorption = absorption.into();
    glass
}

fn frosted(ior: f32, absorption: Rgb) -> Material {
    let rough = Dielectric { color: Rgb::new(0.95, 1.0, 0.9), ior, alpha: 0.3, transmission: 1.0 };
    Material { absorption, ..Material::new("frosted glass", Bsdf::Dielectric(rough)) }
}

/// Radiance 2 from the front.
fn bright() -> Material {
    Material::diffuse("bright", Rgb::ZERO).emitting(Rgb::splat(2.0))
}

/// Transmittance of parallel layers of `(index, what each lets through)` between `before` and `after`, at normal
/// incidence, with every reflection between them: interfaces are added one by one, T = T₁aT₂/(1 − R₁′a²R₂).
fn layers(before: f64, inner: &[(f64, f64)], after: f64) -> f64 {
    let fresnel = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let first = inner.first().map_or(after, |layer| layer.0);
    // The transmittance so far, and the reflectance from behind.
    let mut sum = (1.0 - fresnel(before, first), fresnel(before, first));
    for (i, &(index, a)) in inner.iter().enumerate() {
        let r = fresnel(index, inner.get(i + 1).map_or(after, |layer| layer.0));
        let again = 1.0 - sum.1 * a * a * r;
        sum = (sum.0 * a * (1.0 - r) / again, r + (1.0 - r).powi(2) * a * a * sum.1 / again);
    }
    sum.0
}

#[test]
fn layers_are_summed_rightly() {
    let (r, a) = (0.04_f64, 0.7_f64);
    let slab = (1.0 - r).powi(2) * a / (1.0 - (r * a).powi(2));
    assert!((layers(1.0, &[(1.5, a)], 1.0) - slab).abs() < 1e-12);
    assert!((layers(1.5, &[(1.5, a), (1.5, a)], 1.5) - a * a).abs() < 1e-12);
}

/// Looks down the axis from `from` on the bright floor at the height −1.
fn looking_down(mut g: Geometry, mut materials: Vec<Material>, from: f32) -> Scene {
    let s = 3.0;
    let v = |x: f32, z: f32| Vec3::new(x, -1.0, z);
    scenes::quad(&mut g, [v(-s, -s), v(-s, s), v(s, s), v(s, -s)], materials.len() as u32);
    materials.push(bright());
    let camera =
        Camera::orthographic(Vec3::new(0.0, from, 0.0), Vec3::NEG_Y, Vec3::Z, 0.5, scenes::square(8, Filter::Box));
    Scene::new(g, materials, &[], camera)
}

const SIGMA: [DVec3; 2] = [DVec3::new(0.0, 1.0, 3.0), DVec3::new(2.0, 0.5, 0.0)];

/// What passes `inner` layers of (index, σ_a, thickness).
fn through(before: f64, inner: &[(f64, DVec3, f64)], after: f64) -> DVec3 {
    let channel = |c: usize| {
        let inner: Vec<_> = inner.iter().map(|(index, sigma, d)| (*index, (-sigma[c] * d).exp())).collect();
        2.0 * layers(before, &inner, after)
    };
    DVec3::new(channel(0), channel(1), channel(2))
}

/// Paths in every stack of layers below are sure to have ended after so many edges, but for parts of 1e-5.
const LONG: u32 = 24;

fn assert_stack(what: &str, scene: &Scene, truth: DVec3) {
    assert_image(what, scene, &FROM_CAMERA, LONG, 0.01, &expected(1, |_, _| truth));
}

#[test]
fn a_closed_slab_absorbs_between_its_reflections() {
    // c^(t/attenuationDistance) = exp(−σ t).
    let (color, distance, thick) = (DVec3::new(1.0, 0.5, 0.1), 0.4, 0.5);
    let mut g = Geometry::default();
    add_layer(&mut g, 2.0, [0.0, thick as f32], 0);
    let scene = looking_down(g, vec![glass(1.5, -color.map(f64::ln) / distance)], 1.0);
    let truth = color.map(|c| {
        let (r, a) = (0.04_f64, c.powf(thick / distance));
        2.0 * (1.0 - r).powi(2) * a / (1.0 - (r * a).powi(2))
    });
    assert_stack("closed slab", &scene, truth);
}

#[test]
fn bodies_lie_within_bodies() {
    let [a, b] = SIGMA;
    let mut g = Geometry::default();
    add_layer(&mut g, 2.0, [-0.4, 0.4], 0);
    add_layer(&mut g, 1.5, [-0.1, 0.2], 1);
    let scene = looking_down(g, vec![glass(1.33, a), glass(1.8, b)], 1.0);
    let truth = through(1.0, &[(1.33, a, 0.2), (1.8, b, 0.3), (1.33, a, 0.3)], 1.0);
    assert_stack("body within a body", &scene, truth);
}

#[test]
fn an_inner_body_of_the_same_index_only_absorbs() {
    let [a, b] = SIGMA;
    let mut g = Geometry::default();
    add_layer(&mut g, 2.0, [-0.4, 0.4], 0);
    add_layer(&mut g, 1.5, [-0.1, 0.2], 1);
    let scene = looking_down(g, vec![glass(1.5, a), glass(1.5, b)], 1.0);
    let truth = through(1.0, &[(1.5, 0.5 * a + 0.3 * b, 1.0)], 1.0);
    assert_stack("inner body of the same index", &scene, truth);
}

#[test]
fn bodies_reach_into_each_other() {
    // The smaller one is there where they overlap, and the larger one's face in it is nothing.
    let [a, b] = SIGMA;
    let mut g = Geometry::default();
    add_layer(&mut g, 2.0, [0.0, 0.4], 0);
    add_layer(&mut g, 1.5, [-0.2, 0.1], 1);
    let scene = looking_down(g, vec![glass(1.5, a), glass(1.2, b)], 1.0);
    let truth = through(1.0, &[(1.5, a, 0.3), (1.2, b, 0.3)], 1.0);
    assert_stack("bodies that overlap", &scene, truth);
}

#[test]
fn bodies_touch() {
    let [a, b] = SIGMA;
    let materials = vec![glass(1.5, a), glass(1.2, b)];
    let truth = through(1.0, &[(1.5, a, 0.3), (1.2, b, 0.3)], 1.0);
    // Of the two faces one is a copy of the other; or only a part of it.
    for (what, wide) in [("the same face", 2.0), ("a part of a face", 1.5)] {
        let mut g = Geometry::default();
        add_layer(&mut g, 2.0, [0.1, 0.4], 0);
        add_layer(&mut g, wide, [-0.2, 0.1], 1);
        assert_stack(&format!("bodies that share {what}"), &looking_down(g, materials.clone(), 1.0), truth);
    }
    // Two of one material are one body.
    let mut g = Geometry::default();
    add_layer(&mut g, 2.0, [0.1, 0.4], 0);
    add_layer(&mut g, 2.0, [-0.2, 0.1], 0);
    let scene = looking_down(g, materials, 1.0);
    assert_stack("halves of a body", &scene, through(1.0, &[(1.5, a, 0.6)], 1.0));
}

#[test]
fn instances_are_bodies() {
    let [a, b] = SIGMA;
    let (corners, faces) = cuboid(Vec3::splat(-1.0), Vec3::ONE);
    let mut g = Geometry::default();
    for (material, scale, at) in [(0, DVec3::new(2.0, 0.4, -2.0), 0.0), (1, DVec3::new(1.5, 0.15, 1.5), 0.05)] {
        let mut mesh = Mesh::default();
        mesh.add_triangles(&corners, None, &faces, MaterialId(material));
        let id = g.add_mesh(mesh);
        let to_world = DAffine3::from_translation(DVec3::Y * at) * DAffine3::from_scale(scale);
        g.add_instance(id, Placement::new(to_world).expect("a placement"));
    }
    let scene = looking_down(g, vec![glass(1.33, a), glass(1.8, b)], 1.0);
    let truth = through(1.0, &[(1.33, a, 0.2), (1.8, b, 0.3), (1.33, a, 0.3)], 1.0);
    assert_stack("instances, one within the other", &scene, truth);
}

#[test]
fn a_camera_in_a_body_sees_a_card_behind_it() {
    // What the near boundary mirrors dies out on its way to the far one.
    let [a, b] = [DVec3::new(3.0, 4.0, 5.0), SIGMA[1]];
    let mut g = Geometry::default();
    add_layer(&mut g, 2.0, [-0.4, 3.0], 0);
    add_layer(&mut g, 1.5, [-0.1, 0.2], 1);
    let scene = looking_down(g, vec![glass(1.33, a), glass(1.8, b)], 0.3);
    // Radiance grows by n² on its way into the camera's medium.
    let truth = (-0.1 * a).map(f64::exp) * through(1.33, &[(1.8, b, 0.3), (1.33, a, 0.3)], 1.0) * 1.33 * 1.33;
    assert_stack("card behind the camera's body", &scene, truth);
}

/// A room full of a medium with a lamp, a card and the camera in it; no other light gets to the card in two edges.
#[test]
fn lamp_card_and_camera_are_in_a_body() {
    const HEIGHT: f64 = 1.0;
    const ALBEDO: f64 = 0.8;
    let sigma = DVec3::new(0.0, 0.5, 2.0);
    let lamp = DVec3::new(0.3, 0.6, 0.1);
    for ior in [1.0, 1.5] {
        let mut g = Geometry::default();
        add_box(&mut g, Vec3::splat(-2.0), Vec3::splat(2.0), 0);
        let v = |x: f32, z: f32| Vec3::new(x, 0.0, z);
        scenes::quad(&mut g, [v(-0.6, -0.6), v(-0.6, 0.6), v(0.6, 0.6), v(0.6, -0.6)], 1);
        let materials = vec![glass(ior, sigma), Material::diffuse("card", Rgb::splat(ALBEDO as f32))];
        let light = Light::Point { position: lamp.as_vec3(), intensity: Rgb::splat(3.0) };
        let from = Vec3::new(0.0, HEIGHT as f32, 0.0);
        // The image's right is x × −y with z up: found by the camera itself below.
        let camera = Camera::orthographic(from, Vec3::ZERO, Vec3::Z, 1.0, scenes::square(8, Filter::Box));
        let scene = Scene::new(g, materials, &[light], camera);
        let truth = expected(8, |u, v| {
            let p = DVec3::new(0.5 - u, 0.0, 0.5 - v);
            let to = lamp - p;
            let (d, cos) = (to.length(), to.normalize().y);
            (-sigma * (d + HEIGHT)).map(f64::exp) * (3.0 * ALBEDO / PI * cos / (d * d))
        });
        assert_image(&format!("lamp and card in a body of index {ior}"), &scene, &TO_POINTS, 2, 0.01, &truth);
    }
}

#[test]
fn a_camera_in_a_body_sees_a_lamp_in_it() {
    let sigma = DVec3::new(0.0, 0.5, 2.0);
    let from = DVec3::new(0.3, 1.2, 0.2);
    let mut g = Geometry::default();
    add_box(&mut g, Vec3::splat(-2.0), Vec3::splat(2.0), 0);
    let v = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    scenes::quad(&mut g, [v(-1.2, -1.2), v(-1.2, 1.2), v(1.2, 1.2), v(1.2, -1.2)], 1);
    let sensor = scenes::square(8, Filter::Box);
    let camera = Camera::look_at(from.as_vec3(), Vec3::ZERO, Vec3::Z, 0.7, sensor);
    let scene = Scene::new(g, vec![glass(1.5, sigma), bright()], &[], camera);
    let truth = expected(16, |u, v| {
        let raster = pathspace::scene::camera::Raster(8.0 * glam::Vec2::new(u as f32, v as f32));
        let w = camera.direction(&camera.lens_point(), raster).as_dvec3();
        2.0 * (sigma * (from.y / w.y)).map(f64::exp)
    });
    let all = [Path, LightTracing, Hybrid, Bdpt, PathHemisphere, PathLight, Area];
    assert_image("lamp in the camera's body", &scene, &all, 1, 0.01, &truth);
}

/// A room in which everything is: a frosted body with a camera in it, one of glass and a card within, lamps inside and
/// outside, a lamp cut by a boundary, bodies that overlap and that touch, and instances.
fn nested(front: AlphaMode) -> Scene {
    let fog = Rgb::new(0.1, 0.3, 0.6);
    let materials = vec![
        Material::diffuse("wall", Rgb::new(0.7, 0.6, 0.5)),
        frosted(1.3, fog).covering(front),
        glass(1.6, DVec3::new(0.5, 0.0, 1.0)),
        Material {
            emission_sides: EmissionSides::Both,
            ..Material::diffuse("lamp", Rgb::splat(0.4)).emitting(Rgb::splat(4.0))
        },
        frosted(1.5, Rgb::new(2.0, 0.3, 0.1)),
        frosted(1.2, Rgb::new(0.1, 2.0, 0.3)),
        Material::diffuse("card", Rgb::splat(0.8)),
    ];
    let v = Vec3::new;
    let mut g = Geometry::default();
    scenes::cube_inside(&mut g, 2.0, [0; 6]);
    g.add_sphere(Vec3::ZERO, 1.1, MaterialId(1));
    // Within it, and reaching out of it.
    g.add_sphere(v(0.3, 0.3, -0.3), 0.25, MaterialId(2));
    g.add_sphere(v(-1.0, 0.4, -0.4), 0.4, MaterialId(4));
    scenes::quad(&mut g, [v(-0.5, -0.5, -0.6), v(0.3, -0.5, -0.7), v(0.3, 0.1, -0.7), v(-0.5, 0.1, -0.6)], 6);
    scenes::quad(&mut g, [v(-0.2, 0.7, -0.2), v(0.2, 0.7, -0.2), v(0.2, 0.72, 0.2), v(-0.2, 0.72, 0.2)], 3);
    // Cut by the ball.
    scenes::quad(&mut g, [v(0.5, -0.6, -0.3), v(1.5, -0.6, -0.3), v(1.5, -0.5, 0.2), v(0.5, -0.5, 0.2)], 3);
    scenes::quad(&mut g, [v(-0.5, 1.8, -0.5), v(0.5, 1.8, -0.5), v(0.5, 1.8, 0.5), v(-0.5, 1.8, 0.5)], 3);
    // Touching: a face and its copy, and an instance on top.
    add_box(&mut g, v(-0.4, -0.8, -0.1), v(-0.1, -0.5, 0.2), 4);
    add_box(&mut g, v(-0.1, -0.8, -0.1), v(0.2, -0.5, 0.2), 5);
    let (corners, faces) = cuboid(v(-0.1, 0.0, -0.1), v(0.1, 0.2, 0.1));
    let mut mesh = Mesh::default();
    mesh.add_triangles(&corners, None, &faces, MaterialId(5));
    let mesh = g.add_mesh(mesh);
    for at in [DVec3::new(-0.25, -0.5, 0.05), DVec3::new(0.7, 0.2, 0.1)] {
        g.add_instance(mesh, Placement::new(DAffine3::from_translation(at)).expect("a placement"));
    }
    let lamp = Light::Point { position: v(0.1, 0.1, 0.3), intensity: Rgb::splat(0.5) };
    let sensor = scenes::square(16, Filter::Box);
    Scene::new(g, materials, &[lamp], Camera::look_at(v(0.0, 0.1, 0.9), v(-0.05, -0.1, -1.0), Vec3::Y, 1.5, sensor))
}

const ALL: [IntegratorKind; 7] = [Path, LightTracing, Hybrid, Bdpt, PathHemisphere, PathLight, Area];

#[test]
fn walks_know_what_crossings_say() {
    let scene = nested(AlphaMode::Opaque);
    let media = scene.media().expect("media");
    assert!((1..6).filter(|m| matches!(media.boundary(MaterialId(*m)), Boundary::Body(_))).count() == 4);
    identity::assert_identity_by(&ALL, "nested bodies", &scene, 3);
}

#[test]
fn one_rule_serves_what_is_no_body() {
    // A surface with holes, around and within bodies; and one that is not closed.
    let scene = nested(AlphaMode::Blend { factor: 0.9 });
    assert_eq!(scene.media().expect("media").boundary(MaterialId(1)), Boundary::Local);
    identity::assert_identity_by(&[Path, LightTracing, Hybrid, Bdpt], "a ball with holes", &scene, 3);
    let open = without_lid();
    assert_eq!(media::faults(open.geometry(), open.materials()), [(MaterialId(1), Fault::Open(4))]);
    identity::assert_identity_by(&ALL, "a box without a lid", &open, 3);
}

/// In a room, an absorbing box of frosted glass that nothing covers, with a lamp, a card and a body of glass in it.
fn without_lid() -> Scene {
    let v = Vec3::new;
    let materials = vec![
        Material::diffuse("wall", Rgb::new(0.7, 0.6, 0.5)),
        frosted(1.4, Rgb::new(0.3, 0.8, 1.5)),
        bright(),
        frosted(1.2, Rgb::new(1.0, 0.2, 0.2)),
    ];
    let mut g = Geometry::default();
    scenes::cube_inside(&mut g, 1.0, [0; 6]);
    let (corners, faces) = cuboid(Vec3::splat(-0.6), Vec3::splat(0.6));
    // The two triangles of the top are the seventh and the eighth.
    let faces: Vec<_> = faces.into_iter().enumerate().filter(|(i, _)| i / 2 != 3).map(|(_, f)| f).collect();
    g.add_triangles(&corners, None, &faces, MaterialId(1));
    scenes::quad(&mut g, [v(-0.3, 0.3, 0.3), v(-0.3, 0.3, -0.3), v(0.3, 0.3, -0.3), v(0.3, 0.3, 0.3)], 2);
    g.add_sphere(v(0.2, -0.2, 0.0), 0.2, MaterialId(3));
    let camera = Camera::look_at(v(0.1, 0.8, 0.9), v(0.0, -0.2, 0.0), Vec3::Y, 1.2, scenes::square(16, Filter::Box));
    Scene::new(g, materials, &[], camera)
}
