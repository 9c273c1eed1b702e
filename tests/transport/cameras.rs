//! Thin lenses and orthographic cameras: held to the definition, to closed forms, to each other and to a pinhole.

use glam::Vec3;
use pathspace::{
    film::Image,
    integrator::IntegratorKind,
    math::Rgb,
    render::Settings,
    sampling::Filter,
    scene::{
        Scene,
        camera::{Blades, Camera, Sensor},
        geometry::Geometry,
        light::Light,
        material::Material,
    },
    statistics::Comparison,
};

use crate::{
    agreement::{ALL, Compared, agreement, where_all_cover_within},
    exactness::{assert_crops_are_slices, assert_threads_do_not_matter, estimate, render},
    identity::assert_identity,
    scenes,
};

#[allow(non_snake_case)] // a vector reads as one
const fn V(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// The same scene through another camera.
fn seen_by(mut scene: Scene, camera: Camera) -> Scene {
    scene.camera = camera;
    scene
}

/// Inside the zoo, with a lens wide enough that everything but the pyramid is blurred.
fn zoo_through_a_lens(sensor: Sensor) -> Scene {
    let camera = Camera::look_at(V(0.1, 0.1, 0.9), V(0.0, -0.1, -1.0), Vec3::Y, 1.4, sensor).with_lens(0.15, 1.2);
    seen_by(scenes::zoo(sensor), camera)
}

/// Inside the zoo: the film cuts the room in two, and half of its lights lie behind it.
fn orthographic_zoo(sensor: Sensor) -> Scene {
    let camera = Camera::orthographic(V(0.1, 0.1, 0.55), V(0.05, -0.1, -1.0), Vec3::Y, 1.6, sensor);
    seen_by(scenes::zoo(sensor), camera)
}

/// From outside, with much sky in view.
fn open_zoo(sensor: Sensor, orthographic: bool) -> Scene {
    let (from, to) = (V(0.0, 1.4, 3.0), V(0.0, 0.4, 0.0));
    let camera = if orthographic {
        Camera::orthographic(from, to, Vec3::Y, 3.0, sensor)
    } else {
        Camera::look_at(from, to, Vec3::Y, 0.9, sensor).with_lens(0.3, 2.5)
    };
    seen_by(scenes::open_zoo(sensor), camera)
}

#[test]
fn every_path_through_a_lens_is_as_defined() {
    assert_identity("zoo through a lens", &zoo_through_a_lens(scenes::square(32, Filter::BlackmanHarris)), 2);
    assert_identity("open zoo through a lens", &open_zoo(scenes::square(32, Filter::Box), false), 2);
}

#[test]
fn every_orthographic_path_is_as_defined() {
    assert_identity("orthographic zoo", &orthographic_zoo(scenes::square(32, Filter::BlackmanHarris)), 2);
    assert_identity("orthographic open zoo", &open_zoo(scenes::square(32, Filter::Box), true), 3);
}

#[test]
fn every_camera_is_exact() {
    for scene in [zoo_through_a_lens, orthographic_zoo] {
        assert_threads_do_not_matter(scene);
        assert_crops_are_slices(scene);
    }
}

/// In a furnace every camera sees the same radiance everywhere, with walls behind its film and before its focus.
#[test]
fn a_furnace_is_as_bright_through_every_camera() {
    let sensor = scenes::square(16, Filter::Box);
    let (from, to) = (V(0.2, -0.1, 0.3), V(-0.3, 0.2, -1.0));
    let cameras = [
        Camera::look_at(from, to, Vec3::Y, 1.2, sensor).with_lens(0.3, 0.5),
        Camera::orthographic(from, to, Vec3::Y, 0.9, sensor),
    ];
    for (k, camera) in cameras.into_iter().enumerate() {
        let scene = seen_by(scenes::furnace(0.5, 1.0, sensor), camera);
        for integrator in scenes::WEIGHTED {
            let settings = Settings { integrator, max_depth: 3, ..Settings::new(sensor) };
            let found = estimate(&scene, &settings, 32, 12);
            let p = found.p_of_mean(1.75);
            println!("camera {k}, {integrator}: {:.4}, p = {p:.2e}", found.image_mean());
            assert!(p > 1e-4 && (found.image_mean() / 1.75 - 1.0).abs() < 0.02, "camera {k}, {integrator}");
        }
    }
}

/// A cube with a bright wall, a hole towards the sky and a box of another colour: little noise, and structure that a
/// misplaced splat or a wrong blur would move.
fn room(camera: Camera) -> Scene {
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.6, 0.55, 0.5)),
        Material::diffuse("blue", Rgb::new(0.2, 0.3, 0.7)),
        Material::diffuse("lamp", Rgb::splat(0.2)).emitting(Rgb::new(3.0, 3.0, 2.5)),
    ];
    let mut g = Geometry::default();
    let corner = |i: u8| V((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into()) * 2.0 - 1.0;
    for (corners, material) in
        [([0, 2, 6, 4], 2), ([1, 5, 7, 3], 0), ([0, 4, 5, 1], 0), ([4, 6, 7, 5], 1), ([2, 3, 7, 6], 0)]
    {
        scenes::quad(&mut g, corners.map(corner), material);
    }
    // The far wall, z = −1, is open above its middle.
    scenes::quad(&mut g, [V(-1., -1., -1.), V(1., -1., -1.), V(1., 0., -1.), V(-1., 0., -1.)], 0);
    scenes::quad(&mut g, [V(0.1, -0.9, -0.3), V(0.7, -0.9, -0.1), V(0.7, 0.3, -0.1), V(0.1, 0.3, -0.3)], 1);
    Scene::new(g, materials, &[Light::Environment { radiance: Rgb::splat(0.5) }], camera)
}

const ROOM_FROM: Vec3 = V(0.2, 0.2, 0.9);
const ROOM_TO: Vec3 = V(-0.1, -0.1, -1.0);

#[test]
fn integrators_agree_through_a_lens() {
    let sensor = scenes::square(16, Filter::Box);
    let camera = Camera::look_at(ROOM_FROM, ROOM_TO, Vec3::Y, 1.4, sensor).with_lens(0.15, 1.1);
    agreement("room through a lens", &room(camera), &ALL, Compared::All);
}

#[test]
fn integrators_agree_orthographically() {
    let sensor = scenes::square(16, Filter::Box);
    // Half of the room is behind the film.
    let camera = Camera::orthographic(V(0.1, 0.1, 0.1), ROOM_TO, Vec3::Y, 1.8, sensor);
    agreement("orthographic room", &room(camera), &ALL, Compared::All);
}

/// The part of the pixels that differ by more than rounding.
fn different(a: &Image, b: &Image) -> f32 {
    let differs = |(p, q): (&Rgb, &Rgb)| (*p - *q).abs().max_element() > 1e-3 * (p.max_element() + 0.1);
    a.pixels.iter().zip(&b.pixels).filter(|pair| differs(*pair)).count() as f32 / a.pixels.len() as f32
}

#[test]
fn an_orthographic_image_does_not_depend_on_the_cameras_distance() {
    let sensor = scenes::square(32, Filter::BlackmanHarris);
    let at = |distance: f32| {
        let towards = V(0.25, 0.5, 1.0);
        let target = V(0.0, 0.5, 0.0);
        seen_by(
            scenes::open_zoo(sensor),
            Camera::orthographic(target + distance * towards, target, Vec3::Y, 2.5, sensor),
        )
    };
    for integrator in scenes::WEIGHTED {
        let settings = Settings { integrator, filter: Filter::BlackmanHarris, ..Settings::new(sensor) };
        let [near, far] = [4.0, 16.0].map(|distance| render(&at(distance), &settings, 2));
        assert!(near.mean().min_element() > 0.1);
        let share = different(&near, &far);
        println!("{integrator}: {:.2} % of the pixels differ", 100.0 * share);
        assert!(share < 0.02, "{integrator}: {share}");
    }
}

/// Camera paths start on the polygon that light paths are connected to.
#[test]
fn integrators_agree_through_an_iris() {
    let sensor = scenes::square(24, Filter::Box);
    let camera = Camera::look_at(ROOM_FROM, ROOM_TO, Vec3::Y, 1.4, sensor).with_lens(0.3, 0.6);
    let scene = room(camera.with_blades(Blades::new(3, 0.5)));
    assert_identity("room through an iris", &scene, 2);
    let kinds = [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Bdpt];
    where_all_cover_within(0.02, "room through an iris", &scene, &kinds, 2..=4);
}

#[test]
fn a_lens_without_width_is_a_pinhole() {
    let sensor = scenes::square(24, Filter::Box);
    let pinhole = Camera::look_at(ROOM_FROM, ROOM_TO, Vec3::Y, 1.4, sensor);
    let lens = pinhole.with_lens(1e-5, 1.0);
    let settings = Settings { integrator: IntegratorKind::Light, ..Settings::new(sensor) };
    let images = [pinhole, lens].map(|camera| render(&room(camera), &settings, 4));
    let share = different(&images[0], &images[1]);
    assert!(share < 0.02, "light tracing with the same light paths: {share}");
    // A camera subpath draws its lens point from its own sequence, so that only the means can agree.
    let settings = Settings { integrator: IntegratorKind::Path, ..settings };
    let [a, b] = [pinhole, lens].map(|camera| estimate(&room(camera), &settings, 24, 12));
    let comparison = Comparison::new(&a, &b);
    println!("path: {comparison}");
    assert!(!comparison.differs() && comparison.visible_bias < 0.02, "{comparison}");
}
