//! Closed furnaces: L = L_e Σ_k a^k, path length by path length and in the truncated sum; and a lamp in a sphere.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind::{self, Area, Light, PathHemisphere, PathLight},
    math::Rgb,
    path::{Densities, JoinedPath},
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        bsdf::Directions,
        camera::Camera,
        geometry::Geometry,
        light,
        material::{Material, MaterialId},
    },
    statistics::regions,
};
use rayon::prelude::*;

use super::{
    REPLICATES, TO_POINTS, UNBIASED, WEIGHTED, assert_image, constant, converge, expected,
    tally::{Expectation, assert_bins},
};
use crate::scenes;

const ALBEDO: f64 = 0.5;

/// The bin of a path is its number of edges, less one.
fn by_length(path: &JoinedPath) -> Option<usize> {
    Some(path.edges() as usize - 1)
}

/// L_e a^(n−1) for each length n.
fn powers(depth: u32) -> Vec<Expectation> {
    (0..depth).map(|k| ALBEDO.powi(k as i32).into()).collect()
}

fn sum(depth: u32) -> f64 {
    powers(depth).iter().map(|e| e.value).sum()
}

/// K^i L_e is L_e a^i everywhere: every path length of every integrator has its own closed form.
#[test]
fn every_path_length_has_its_power_of_the_albedo() {
    let scene = scenes::furnace(ALBEDO as f32, 1.0, scenes::square(8, Filter::Box));
    assert_bins("box", &scene, &WEIGHTED, 5, 0.015, (&by_length, &powers(5)));
    assert_bins("box", &scene, &[PathHemisphere], 5, 0.015, (&by_length, &powers(5)));
}

/// Inside a sphere G is the same between any two points, 1/(4R²): the one closed room in which unweighted connections
/// have a variance, and none at that.
#[test]
fn every_path_length_has_its_power_of_the_albedo_in_a_sphere() {
    let scene = scenes::sphere_furnace(ALBEDO as f32, 1.0, scenes::square(8, Filter::Box));
    assert_bins("sphere", &scene, &UNBIASED, 4, 0.01, (&by_length, &powers(4)));
}

#[test]
fn the_sum_ends_where_it_is_told_to() {
    for (name, scene, kinds) in [
        ("box", scenes::furnace(ALBEDO as f32, 1.0, scenes::square(16, Filter::Box)), WEIGHTED.to_vec()),
        (
            "sphere",
            scenes::sphere_furnace(ALBEDO as f32, 1.0, scenes::square(16, Filter::Box)),
            vec![Light, PathLight, PathHemisphere, Area],
        ),
    ] {
        for depth in [1, 2, 4] {
            assert_image(&format!("{name}, {depth} edges"), &scene, &kinds, depth, 0.01, &constant(sum(depth)));
        }
    }
}

/// The wide filter and the uniform rule for directions change nothing either.
#[test]
fn neither_filters_nor_uniform_directions_change_it() {
    let sensor = scenes::square(16, Filter::BlackmanHarris);
    let scene = scenes::furnace(ALBEDO as f32, 1.0, sensor);
    let variants = [(IntegratorKind::Bdpt, Directions::Bsdf), (PathHemisphere, Directions::Uniform)];
    for (kind, hemisphere) in variants {
        let all: Vec<_> = (0..REPLICATES)
            .map(|seed| Settings {
                integrator: kind,
                hemisphere,
                filter: Filter::BlackmanHarris,
                max_depth: 4,
                seed,
                ..Settings::new(sensor)
            })
            .collect();
        let mut renderers: Vec<_> = all.iter().map(|s| Renderer::new(&scene, s)).collect();
        let outcome = converge(0.01, |passes| {
            renderers.par_iter_mut().for_each(|r| {
                while r.passes() < passes {
                    r.pass();
                }
            });
            renderers.iter().map(|r| regions(&r.film().image(passes))).collect()
        });
        outcome.assert(&format!("wide filter, {kind} {hemisphere:?}"), &constant(sum(4)), 0.01);
    }
}

/// A sphere of albedo [`ALBEDO`] around point lights, seen from inside.
fn lamp_in_a_sphere(radius: f32, lamps: &[(Vec3, f32)]) -> Scene {
    let mut g = Geometry::default();
    g.add_sphere(Vec3::ZERO, radius, MaterialId(0));
    let lamps: Vec<_> = lamps
        .iter()
        .map(|(position, intensity)| light::Light::Point { position: *position, intensity: Rgb::splat(*intensity) })
        .collect();
    let from = radius * Vec3::new(0.3, -0.1, 0.4);
    let camera = Camera::look_at(from, Vec3::new(-0.3, 0.2, -1.0), Vec3::Y, 1.2, scenes::square(8, Filter::Box));
    Scene::new(g, vec![Material::diffuse("wall", Rgb::splat(ALBEDO as f32))], &lamps, camera)
}

/// A point light in the middle: L = I/(πr²) Σ_{k≥1} a^k; and four of a quarter in the same place.
#[test]
fn a_lamp_in_the_middle_of_a_sphere() {
    let (radius, intensity) = (1.5_f32, 2.0_f32);
    let unit = f64::from(intensity / (radius * radius)) / PI;
    let truth: Vec<Expectation> =
        (0..5).map(|k| if k == 0 { 0.0.into() } else { (unit * ALBEDO.powi(k)).into() }).collect();
    for (name, lamps) in [("lamp", vec![(Vec3::ZERO, intensity)]), ("four lamps", vec![(Vec3::ZERO, 0.5); 4])] {
        let scene = lamp_in_a_sphere(radius, &lamps);
        assert_bins(name, &scene, &TO_POINTS, 5, 0.01, (&by_length, &truth));
    }
}

/// Anywhere else in the sphere, light of two edges varies, a I |cos θ|/(π d²); but the sphere spreads what it scatters
/// evenly, so that what has scattered twice or more is what it is with the lamp in the middle.
#[test]
fn a_lamp_off_the_middle_of_a_sphere() {
    let (radius, intensity, lamp) = (1.5_f32, 2.0_f32, Vec3::new(-0.4, 0.3, -0.5));
    let scene = lamp_in_a_sphere(radius, &[(lamp, intensity)]);
    let camera = scene.camera;
    let r = f64::from(radius);
    // What the camera sees at a place of the image: the sphere's far side along the ray.
    let direct = |u: f64, v: f64| {
        let lens = camera.lens_point();
        let raster = pathspace::scene::camera::Raster(glam::Vec2::new(8.0 * u as f32, 8.0 * v as f32));
        let (o, w) = (lens.position.as_dvec3(), camera.direction(&lens, raster).as_dvec3());
        let b = o.dot(w);
        let p = o + w * (-b + (b * b - o.length_squared() + r * r).sqrt());
        let to_lamp = lamp.as_dvec3() - p;
        let cos = -to_lamp.normalize().dot(p) / r;
        DVec3::splat(ALBEDO / PI * f64::from(intensity) * cos / to_lamp.length_squared())
    };
    assert_image("lamp off the middle, 2 edges", &scene, &TO_POINTS, 2, 0.01, &expected(16, direct));
    let unit = f64::from(intensity) / (r * r) / PI;
    let indirect: Vec<Expectation> = (2..5).map(|k| (unit * ALBEDO.powi(k)).into()).collect();
    let scattered = |path: &JoinedPath| (path.edges() as usize).checked_sub(3);
    assert_bins("lamp off the middle", &scene, &TO_POINTS, 5, 0.01, (&scattered, &indirect));
}

/// The sum to infinity, 1/(1 − a), is where roulette has to leave the mean alone: 60 edges are infinity to 1e-18.
#[test]
fn roulette_leaves_the_infinite_sum_alone() {
    let scene = scenes::sphere_furnace(ALBEDO as f32, 1.0, scenes::square(8, Filter::Box));
    assert_image("sphere, roulette", &scene, &WEIGHTED, 60, 0.01, &constant(1.0 / (1.0 - ALBEDO)));
}
