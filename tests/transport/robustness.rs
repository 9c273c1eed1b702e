//! Scenes of any size and anywhere: nothing leaks, and nothing shadows itself.

use glam::{DAffine3, DQuat, DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    path::{Densities, JoinedPath},
    render::Settings,
    sampling::Filter,
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::Geometry,
        material::Material,
    },
};

use crate::{
    agreement::{Run, assert_agree, settings, with_the_first},
    exactness::estimate,
    instances::{Copies, Part, place},
    scenes,
};

/// The furnace of albedo 1/2 as a turned cube of half this size around `size · offset`.
fn furnace(size: f64, offset: f64, copies: Copies, sensor: Sensor) -> Scene {
    let corner = |i: u32| Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|bit| 2.0 * bit as f32 - 1.0));
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, c, b], [a, d, c]]).collect();
    let walls: [Part; 1] = [((0..8).map(corner).collect(), None, triangles, 0)];
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 0.7);
    let center = DVec3::new(1.0, -0.7, 0.4) * offset * size;
    let at = DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn, center);
    let mut g = Geometry::default();
    place(&mut g, &walls, &[at], copies);
    let wall = Material::diffuse("wall", Rgb::splat(0.5)).emitting(Rgb::ONE);
    let seen = |p: DVec3| at.transform_point3(p).as_vec3();
    let camera =
        Camera::look_at(seen(DVec3::new(0.2, -0.1, 0.7)), seen(DVec3::new(-0.3, 0.2, -0.9)), Vec3::Y, 1.2, sensor);
    Scene::new(g, vec![wall], &[], camera)
}

/// 1 + a + a² in a closed room, whatever its size and wherever it stands. Where a room stands so far away that its
/// coordinates have 1/128 of its size as their smallest step, points on one wall round onto the next; what that loses
/// is bounded.
#[test]
fn a_furnace_is_as_bright_at_any_size_and_anywhere() {
    let sensor = scenes::square(8, Filter::Box);
    for copies in [Copies::Flat, Copies::Instances] {
        for (size, offset, loss) in
            [(1e-4, 0.0, 0.0), (1.0, 0.0, 0.0), (1e6, 0.0, 0.0), (1.0, 1e2, 1e-3), (1e-2, 1e4, 1e-2), (1.0, 1e5, 5e-2)]
        {
            let scene = furnace(size, offset, copies, sensor);
            for integrator in [IntegratorKind::Path, IntegratorKind::Bdpt] {
                let settings = Settings { integrator, max_depth: 3, ..Settings::new(sensor) };
                let found = estimate(&scene, &settings, 24, 12);
                let p = found.p_of_mean(1.75);
                let off = found.image_mean() / 1.75 - 1.0;
                println!("{copies:?} {integrator}, size {size}, {offset} sizes away: off by {off:+.5}, p = {p:.1e}");
                assert!(
                    p > 1e-4 || off.abs() < loss,
                    "{copies:?} {integrator}, size {size}, {offset} sizes away: {off}"
                );
                assert!(off.abs() < 0.05);
            }
        }
    }
}

/// A lamp that a file holds twice, one with another lamp on its back, and one on the back of a black card that comes
/// first in the file: what rays meet shines, and nothing else. Sampling directions, light area and both find the same.
#[test]
fn a_lamp_that_is_there_twice_shines_once() {
    use IntegratorKind::{Bdpt, Path, PathHemisphere, PathLight};
    let v = Vec3::new;
    let mut g = Geometry::default();
    let lamp = |g: &mut Geometry, x: f32, materials: &[u32]| {
        let mut corners = [v(x, 1., -0.5), v(x + 0.9, 1., -0.5), v(x + 0.9, 1., 0.5), v(x, 1., 0.5)];
        for material in materials {
            scenes::quad(g, corners, *material);
            corners.reverse();
            corners.rotate_left(1); // cut along the same diagonal
        }
    };
    lamp(&mut g, -1.5, &[1, 1, 1]);
    lamp(&mut g, -0.45, &[1, 2]);
    lamp(&mut g, 0.6, &[0, 2]);
    for y in [0.0, 2.0] {
        scenes::quad(&mut g, [v(-2., y, -1.), v(-2., y, 1.), v(2., y, 1.), v(2., y, -1.)], 3);
    }
    let materials = vec![
        Material::diffuse("card", Rgb::ZERO),
        Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::ONE),
        Material::diffuse("other lamp", Rgb::ZERO).emitting(Rgb::new(3.0, 0.0, 0.0)),
        Material::diffuse("plane", Rgb::splat(0.5)),
    ];
    let camera = Camera::look_at(v(0., 1., 6.), v(0., 1., 0.), Vec3::Y, 0.7, scenes::square(12, Filter::Box));
    let scene = Scene::new(g, materials, &[], camera);
    assert_eq!(scene.lights().all().len(), 6, "two triangles each of three lamps");
    // A lamp that shone twice would be 50 % off: 4 % is fine enough.
    let reflected = |path: &JoinedPath| (2..=3).contains(&path.edges());
    let settings = [Bdpt, Path, PathHemisphere, PathLight].map(|kind| (kind, settings(&scene, kind, 0)));
    let mut runs = settings.each_ref().map(|(kind, settings)| Run::new(&scene, settings, kind.name(), &reflected));
    assert_agree("doubled lamps", 0.04, &mut runs, &with_the_first(4));
}
