//! Lamps and cameras inside glass: radiance and importance scale differently across a boundary, and F_j does not care.

use glam::Vec3;
use pathspace::{
    integrator::IntegratorKind::{Bdpt, Hybrid, Path},
    math::Rgb,
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, Dielectric},
        camera::Camera,
        geometry::Geometry,
        material::{Material, MaterialId},
    },
};

use crate::{
    agreement::{ALL, Compared, DEPTH, agreement, where_all_cover},
    identity, scenes,
};

/// A bright box, with a ball of glass around whatever is at the origin.
fn room(glass: Material, radius: f32, lamp: Option<f32>, walls: f32, camera: [Vec3; 2]) -> Scene {
    let materials = vec![
        Material::diffuse("wall", Rgb::new(0.6, 0.55, 0.5)).emitting(walls * Rgb::new(1.0, 0.9, 0.7)),
        Material::diffuse("floor", Rgb::new(0.3, 0.4, 0.5)),
        glass,
        Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(3.0, 2.5, 2.0)),
    ];
    let mut g = Geometry::default();
    scenes::cube_inside(&mut g, 1.0, [1, 1, 1, 0, 1, 1]);
    g.add_sphere(Vec3::ZERO, radius, MaterialId(2));
    if let Some(radius) = lamp {
        g.add_sphere(Vec3::new(0.05, 0.0, 0.0), radius, MaterialId(3));
    }
    let [from, to] = camera;
    Scene::new(g, materials, &[], Camera::look_at(from, to, Vec3::Y, 1.1, scenes::square(16, Filter::Box)))
}

fn tinted() -> Material {
    let mut glass = Material::glass("tinted glass", 1.5);
    glass.absorption = Rgb::new(0.2, 0.5, 0.9);
    glass
}

fn lamp_inside() -> Scene {
    room(tinted(), 0.45, Some(0.35), 0.0, [Vec3::new(0.3, 0.2, 0.95), Vec3::new(0.1, -0.2, 0.0)])
}

fn camera_inside(glass: Material) -> Scene {
    room(glass, 0.4, None, 1.0, [Vec3::new(0.05, -0.1, 0.1), Vec3::new(0.3, -0.3, -1.0)])
}

fn frosted() -> Material {
    let rough = Dielectric { color: Rgb::new(0.95, 1.0, 0.9), ior: 1.4, alpha: 0.3, transmission: 1.0 };
    Material::new("frosted glass", Bsdf::Dielectric(rough))
}

#[test]
fn a_lamp_inside_glass() {
    agreement("lamp inside glass", &lamp_inside(), &ALL, Compared::All);
}

#[test]
fn a_camera_inside_glass() {
    where_all_cover("camera inside glass", &camera_inside(tinted()), &ALL, 1..=DEPTH);
}

#[test]
fn a_camera_inside_frosted_glass() {
    let scene = camera_inside(frosted());
    where_all_cover("camera inside frosted glass", &scene, &[Path, Hybrid, Bdpt], 1..=DEPTH);
}

#[test]
fn every_path_inside_glass_is_as_defined() {
    identity::assert_identity_by(&scenes::WEIGHTED, "lamp inside glass", &lamp_inside(), 6);
    identity::assert_identity_by(&[Path, Hybrid, Bdpt], "camera inside glass", &camera_inside(tinted()), 6);
    // Frosted glass that absorbs: there alone, connections run through a volume.
    let mut absorbing = frosted();
    absorbing.absorption = Rgb::new(0.9, 0.5, 0.2);
    identity::assert_identity_by(&scenes::WEIGHTED, "camera inside frosted glass", &camera_inside(absorbing), 6);
}
