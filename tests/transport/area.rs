//! Area sampling, the oracle that uses nothing but F, V and area densities, against the integrators that walk.

use std::sync::Mutex;

use glam::Vec3;
use pathspace::{
    integrator::{Integrator, IntegratorKind},
    math::Rgb,
    path::{JoinedPath, Technique},
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, MetallicRoughness},
        camera::{Camera, Sensor},
        geometry::Geometry,
        material::{EmissionSides, Material, MaterialId},
        point::Place,
    },
};

use crate::{
    agreement::{Run, VISIBLE, assert_agree, settings, with_the_first},
    scenes,
};

/// A dim sphere seen from inside, between whose points G is constant, with a lamp, a ball and a panel that float apart
/// from it and from each other: no two surfaces touch, so ∫G² is finite.
fn island_room(camera: impl Fn(Sensor) -> Camera, sensor: Sensor) -> Scene {
    let plastic = MetallicRoughness::new(Rgb::new(0.6, 0.2, 0.1), 0.0, 0.5);
    let mut wall = Material::diffuse("wall", Rgb::new(0.5, 0.55, 0.6)).emitting(Rgb::new(0.5, 0.4, 0.3));
    wall.emission_sides = EmissionSides::Both;
    let materials = vec![
        wall,
        Material::new("plastic", Bsdf::MetallicRoughness(plastic)),
        Material::diffuse("ball", Rgb::new(0.3, 0.6, 0.4)),
        Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(3.0, 3.0, 4.0)),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    g.add_sphere(Vec3::ZERO, 2.0, MaterialId(0));
    g.add_sphere(v(-0.5, -0.2, -0.5), 0.5, MaterialId(2));
    scenes::quad(&mut g, [v(-0.8, -1.0, -0.8), v(-0.8, -1.0, 0.4), v(0.9, -1.0, 0.4), v(0.9, -1.0, -0.8)], 1);
    scenes::quad(&mut g, [v(-0.3, 1.0, -0.7), v(0.6, 1.1, -0.7), v(0.6, 1.0, 0.3), v(-0.3, 0.9, 0.3)], 3);
    Scene::new(g, materials, &[], camera(sensor))
}

fn looking(sensor: Sensor) -> Camera {
    Camera::look_at(Vec3::new(0.2, 0.1, 1.7), Vec3::new(0.0, -0.2, -0.5), Vec3::Y, 1.1, sensor)
}

#[test]
fn area_sampling_finds_what_path_tracing_and_bdpt_find() {
    let pinhole: fn(Sensor) -> Camera = looking;
    let lens: fn(Sensor) -> Camera = |sensor| looking(sensor).with_lens(0.2, 2.0);
    for (name, camera) in [("islands", pinhole), ("islands through a lens", lens)] {
        let scene = island_room(camera, scenes::square(16, Filter::Box));
        let everything = |_: &JoinedPath| true;
        let short = |kind| -> Vec<Settings> {
            settings(&scene, kind, 0).into_iter().map(|s| Settings { max_depth: 4, ..s }).collect()
        };
        let all = [IntegratorKind::Area, IntegratorKind::Path, IntegratorKind::Bdpt].map(|kind| (kind, short(kind)));
        let mut runs = all.each_ref().map(|(kind, settings)| Run::new(&scene, settings, kind.name(), &everything));
        assert_agree(name, VISIBLE, &mut runs, &with_the_first(3));
    }
}

/// Light without a surface and paths through deltas are what it does not cover, and says so path by path.
#[test]
fn what_area_sampling_covers_is_what_it_finds() {
    let scene = scenes::zoo(scenes::square(16, Filter::Box));
    let sensor = scene.camera.sensor();
    let settings = Settings { max_depth: 6, ..Settings::new(sensor) };
    let area = Integrator::new(IntegratorKind::Area, sensor, 6, settings.roulette);
    let count = Mutex::new((0, 0));
    let mut renderer = Renderer::new(&scene, &settings);
    renderer.pass_where(&|path| {
        let explicit = path.to_path();
        let n = explicit.edges();
        let smooth = explicit.vertices()[1..].iter().all(|v| !v.is_delta());
        let surfaces = explicit.vertices()[n].point.place == Place::Surface;
        let expected = n <= 4 && smooth && surfaces;
        assert_eq!(area.covers(path), expected, "{} by {}", explicit.class(), path.technique());
        let mut count = count.lock().unwrap();
        *if expected { &mut count.0 } else { &mut count.1 } += 1;
        true
    });
    let (covered, uncovered) = count.into_inner().unwrap();
    assert!(covered > 100 && uncovered > 100, "{covered} covered, {uncovered} not");
    let settings = Settings { integrator: IntegratorKind::Area, ..settings };
    let mut renderer = Renderer::new(&scene, &settings);
    renderer.pass_where(&|path| {
        assert!(area.covers(path) && path.technique() == Technique::Area);
        true
    });
    assert!(renderer.film().image(1).mean().min_element() > 0.0);
}
