//! Every kind of light at once between integrators, and skies alone.

use std::{f32::consts::FRAC_PI_2, sync::Arc};

use glam::{Mat3, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    path::Densities,
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, MetallicRoughness},
        camera::{Camera, Sensor},
        geometry::Geometry,
        light::{EnvironmentMap, Goniometric, Light, Profile, Spot},
        material::{Material, MaterialId},
    },
    statistics::{Comparison, Estimate, Regions, regions},
};

use crate::{agreement, identity, scenes};

/// The integrators that cover every kind of light where nothing is specular.
const KINDS: [IntegratorKind; 4] =
    [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt];

/// A bright patch in a sky that is blue above and brown below, turned by `rotation` about +y.
pub fn sky(rotation: f32) -> Light {
    let (width, height) = (16, 8);
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let base = if y < 4 { Rgb::new(0.2, 0.3, 0.5) } else { Rgb::new(0.15, 0.1, 0.05) };
        // A hole in the sky, too: black texels have density zero.
        let hole = if (11..13).contains(&x) && y == 3 { 0.0 } else { 1.0 };
        base * hole + if (4..6).contains(&x) && y == 2 { Rgb::new(3.0, 2.5, 1.5) } else { Rgb::ZERO }
    };
    let map = EnvironmentMap::new(width, (0..width * height).map(texel).collect(), rotation).unwrap();
    Light::EnvironmentMap(Arc::new(map))
}

/// A terrace under a lamp of finite size, a point, a spot, a sun and a sky, all turned by `turn` radians about +y.
pub fn terrace(turn: f32, sensor: Sensor) -> Scene {
    let turned = Mat3::from_rotation_y(turn);
    let v = |x: f32, y: f32, z: f32| turned * Vec3::new(x, y, z);
    let varnished = Bsdf::MetallicRoughness(MetallicRoughness::new(Rgb::new(0.6, 0.3, 0.2), 0.0, 0.36));
    let materials = vec![
        Material::diffuse("floor", Rgb::new(0.6, 0.55, 0.5)),
        Material::diffuse("lamp", Rgb::splat(0.2)).emitting(Rgb::new(3.0, 2.5, 2.0)),
        Material::new("varnished", varnished),
    ];
    let mut g = Geometry::default();
    scenes::quad(&mut g, [v(-2., 0., -2.), v(-2., 0., 2.), v(2., 0., 2.), v(2., 0., -2.)], 0);
    scenes::quad(&mut g, [v(-2., 0., -2.), v(2., 0., -2.), v(2., 1.5, -2.), v(-2., 1.5, -2.)], 0);
    scenes::quad(&mut g, [v(0.4, 1.8, -0.6), v(1.4, 1.8, -0.6), v(1.4, 1.8, 0.4), v(0.4, 1.8, 0.4)], 1);
    g.add_sphere(v(-0.6, 0.5, -0.3), 0.5, MaterialId(2));
    let lights = [
        Light::Point { position: v(-1.2, 1.6, 0.8), intensity: Rgb::new(1.0, 1.2, 1.5) },
        Light::Spot(Spot::new(v(1.0, 2.5, 1.5), v(-0.48, -0.8, -0.36), Rgb::new(9.0, 7.0, 5.0), 0.2, 0.5)),
        Light::Directional { towards: v(-0.48, 0.8, 0.36), irradiance: Rgb::splat(1.0) },
        sky(turn),
    ];
    let camera = Camera::look_at(v(0.3, 1.6, 3.6), v(0.0, 0.6, -0.4), Vec3::Y, 0.85, sensor);
    Scene::new(g, materials, &lights, camera)
}

/// A corner under a lamp with a profile of two wings and one that shines upwards alone, beside a point.
pub fn corner(sensor: Sensor) -> Scene {
    let materials = vec![
        Material::diffuse("floor", Rgb::new(0.6, 0.55, 0.5)),
        Material::new("varnished", Bsdf::MetallicRoughness(MetallicRoughness::new(Rgb::new(0.6, 0.3, 0.2), 0.0, 0.36))),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    scenes::quad(&mut g, [v(-2., 0., -2.), v(-2., 0., 2.), v(2., 0., 2.), v(2., 0., -2.)], 0);
    scenes::quad(&mut g, [v(-2., 0., -2.), v(2., 0., -2.), v(2., 2.5, -2.), v(-2., 2.5, -2.)], 0);
    g.add_sphere(v(-0.6, 0.5, -0.3), 0.5, MaterialId(1));
    let table = |polar: [f64; 4], values: [[f32; 4]; 4]| {
        let azimuths = [0.0, 90.0, 180.0, 270.0, 360.0].map(f64::to_radians);
        Arc::new(Profile::new(&polar.map(f64::to_radians), &azimuths, |i, j| values[i][j % 4]).unwrap())
    };
    let wings = table([0., 30., 60., 90.], [[1.; 4], [2., 0.5, 4., 0.5], [1., 0., 6., 0.], [0.; 4]]);
    let uplight = table([90., 120., 150., 180.], [[0.; 4], [3., 1., 0., 1.], [2.; 4], [1.; 4]]);
    let down = Mat3::from_rotation_x(-FRAC_PI_2);
    let mirrored = down * Mat3::from_rotation_z(0.5) * Mat3::from_diagonal(v(1.0, -1.0, 1.0));
    let lamp =
        |at, to_world, color, profile| Light::Goniometric(Arc::new(Goniometric::new(at, to_world, color, profile)));
    let lights = [
        lamp(v(0.6, 2.0, -0.6), mirrored, Rgb::new(1.0, 0.8, 0.6), wings),
        lamp(v(-1.2, 0.8, -1.6), Mat3::from_rotation_y(0.3) * down, Rgb::new(0.3, 0.5, 0.8), uplight),
        Light::Point { position: v(-1.2, 1.6, 0.8), intensity: Rgb::splat(0.2) },
    ];
    let camera = Camera::look_at(v(0.3, 1.6, 3.6), v(0.0, 0.8, -0.4), Vec3::Y, 0.85, sensor);
    Scene::new(g, materials, &lights, camera)
}

#[test]
fn with_profiles_are_the_definition() {
    identity::assert_identity_by(&KINDS, "corner", &corner(scenes::square(32, Filter::BlackmanHarris)), 3);
}

#[test]
fn with_profiles_agree_between_integrators() {
    agreement::where_all_cover("corner", &corner(scenes::square(24, Filter::Box)), &KINDS, 1..=4);
}

#[test]
fn of_every_kind_at_once_are_the_definition() {
    identity::assert_identity("terrace", &terrace(0.0, scenes::square(32, Filter::BlackmanHarris)), 3);
}

#[test]
fn of_every_kind_at_once_agree_between_integrators() {
    agreement::agreement(
        "terrace",
        &terrace(0.0, scenes::square(24, Filter::Box)),
        &agreement::ALL,
        agreement::Compared::Scattered,
    );
}

/// The mean image over seeds, from paths of the lengths that `keep` says.
fn estimate(
    scene: &Scene,
    integrator: IntegratorKind,
    spp: u32,
    seeds: u64,
    edges: std::ops::RangeInclusive<u32>,
) -> Estimate {
    let replicate = |seed| -> Regions {
        let settings = Settings { integrator, seed, max_depth: *edges.end(), ..Settings::new(scene.camera.sensor()) };
        let mut renderer = Renderer::new(scene, &settings);
        (0..spp).for_each(|_| renderer.pass_where(&|path| edges.contains(&path.edges())));
        assert!(renderer.statistics().rejected.is_empty() && renderer.film().errors().is_empty());
        regions(&renderer.film().image(spp))
    };
    Estimate::new(&(0..seeds).map(|r| replicate(500 + r)).collect::<Vec<_>>())
}

#[test]
fn turning_the_scene_and_its_sky_together_changes_nothing() {
    let sensor = scenes::square(24, Filter::Box);
    let straight = estimate(&terrace(0.0, sensor), IntegratorKind::Bdpt, 48, 16, 1..=4);
    let turned = estimate(&terrace(2.0, sensor), IntegratorKind::Bdpt, 48, 16, 1..=4);
    let comparison = Comparison::new(&straight, &turned);
    println!("turned: {comparison}");
    assert!(!comparison.differs() && comparison.visible_bias < 0.02, "{comparison}");
}

/// Design trap 8: an environment with nothing in it is seen, at every pixel, by every integrator.
#[test]
fn an_environment_without_a_scene_is_seen() {
    let sensor = scenes::square(16, Filter::Box);
    let camera = |forward: Vec3| {
        Camera::look_at(Vec3::new(5.0, 1.0, 2.0), Vec3::new(5.0, 1.0, 2.0) + forward, Vec3::Y, 1.0, sensor)
    };
    let scene = |light, forward| Scene::new(Geometry::default(), Vec::new(), &[light], camera(forward));
    for kind in KINDS {
        let constant = scene(Light::Environment { radiance: Rgb::splat(0.75) }, Vec3::NEG_Z);
        let found = estimate(&constant, kind, 64, 12, 1..=3);
        println!("nothing but light, {kind}: {:.4}", found.image_mean());
        assert!(found.p_of_mean(0.75) > 1e-4 && (found.image_mean() / 0.75 - 1.0).abs() < 0.02, "{kind}");
    }
    // With a map: what path tracing sees is what the map holds there, and the others agree.
    let view = || scene(sky(0.3), Vec3::new(0.2, 0.3, -1.0));
    let path = estimate(&view(), IntegratorKind::Path, 192, 12, 1..=2);
    for kind in [IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt] {
        let comparison = Comparison::new(&path, &estimate(&view(), kind, 192, 12, 1..=2));
        println!("sky, {kind}: {comparison}");
        assert!(!comparison.differs() && comparison.visible_bias < 0.02, "{kind}: {comparison}");
    }
}

/// The middle of the picture of a map's texel, by a camera that looks where the convention says it is.
#[test]
fn a_gltf_camera_looks_at_the_maps_first_quarter() {
    let (width, height) = (16, 8);
    let mut texels = vec![Rgb::ZERO; width * height];
    // u = ¼ lies between the columns 3 and 4, the horizon between the rows 3 and 4.
    for (x, y) in [(3, 3), (4, 3), (3, 4), (4, 4)] {
        texels[y * width + x] = Rgb::ONE;
    }
    for (rotation, forward) in [(0.0, Vec3::NEG_Z), (FRAC_PI_2, Vec3::NEG_X), (-FRAC_PI_2, Vec3::X)] {
        let map = EnvironmentMap::new(width, texels.clone(), rotation).unwrap();
        let camera = Camera::look_at(Vec3::ZERO, forward, Vec3::Y, 0.2, scenes::square(4, Filter::Box));
        let light = Light::EnvironmentMap(Arc::new(map));
        let found =
            estimate(&Scene::new(Geometry::default(), Vec::new(), &[light], camera), IntegratorKind::Path, 4, 4, 1..=1);
        assert!(found.image_mean() > 0.99, "{rotation}: {}", found.image_mean());
    }
}
