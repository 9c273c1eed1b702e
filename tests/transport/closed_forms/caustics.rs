//! Where a ball lens puts the sun: focal length and caustic against geometric optics.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use pathspace::{
    math::Rgb,
    path::{Densities, JoinedPath},
    sampling::Filter,
    scene::{
        Scene,
        camera::Camera,
        geometry::Geometry,
        light::Light,
        material::{Material, MaterialId},
    },
};

use super::{
    FROM_LIGHT,
    dielectrics::fresnel,
    tally::{Expectation, assert_bins},
};
use crate::scenes;

const IOR: f64 = 1.5;
const ALBEDO: f64 = 0.8;
const IRRADIANCE: f64 = 3.0;

/// Where a ray parallel to the axis, at the distance b from it, meets the plane at `depth` behind the middle of a ball
/// of radius 1: its distance from the axis, negative beyond the axis. It turns by 2(θ − θ').
fn landing(b: f64, depth: f64) -> f64 {
    let (outer, inner) = (b.asin(), (b / IOR).asin());
    // It leaves the ball at the angle `exit` from the axis, and goes on at the angle `turn` towards it.
    let exit = 2.0 * inner - outer;
    let turn = 2.0 * (outer - inner);
    let (x, z) = (exit.sin(), exit.cos());
    x - (depth - z) * turn.tan()
}

/// A ball above a screen at `depth` below its middle, under a sun straight above; the orthographic camera's film lies
/// between ball and screen and shows a square of the given width.
fn lens(depth: f64, width: f64) -> Scene {
    let mut g = Geometry::default();
    g.add_sphere(Vec3::ZERO, 1.0, MaterialId(0));
    let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).as_vec3();
    let (s, y) = (0.52 * width, -depth);
    scenes::quad(&mut g, [v(-s, y, -s), v(-s, y, s), v(s, y, s), v(s, y, -s)], 1);
    let sun = Light::Directional { towards: Vec3::Y, irradiance: Rgb::splat(IRRADIANCE as f32) };
    let materials = vec![Material::glass("ball", IOR as f32), Material::diffuse("screen", Rgb::splat(ALBEDO as f32))];
    let film = Vec3::new(0.0, (-0.5 * (1.0 + depth)) as f32, 0.0);
    let camera = Camera::orthographic(film, film - Vec3::Y, Vec3::NEG_Z, width as f32, scenes::square(8, Filter::Box));
    Scene::new(g, materials, &[sun], camera)
}

/// The part of the image's mean in each ring of the screen, by rays at every b: L = ρ E/π, E dA = E_0 (1−R)² 2π b db.
fn rings(edges: &[f64], depth: f64, stop: f64, width: f64) -> Vec<Expectation> {
    const STEPS: i32 = 400_000;
    let mut sums = vec![0.0; edges.len()];
    for i in 0..STEPS {
        let b = (f64::from(i) + 0.5) / f64::from(STEPS) * stop;
        let power =
            IRRADIANCE * (1.0 - fresnel((1.0 - b * b).sqrt(), IOR)).powi(2) * 2.0 * PI * b * stop / f64::from(STEPS);
        if let Some(ring) = ring(landing(b, depth).abs(), edges) {
            sums[ring] += power * ALBEDO / PI / (width * width);
        }
    }
    sums.into_iter().map(Expectation::from).collect()
}

/// The ring between two of the radii `edges` (the first from 0 on).
fn ring(radius: f64, edges: &[f64]) -> Option<usize> {
    edges.iter().position(|edge| radius < *edge)
}

/// Compares the rings, of light that enters the ball within `stop` from the axis.
#[track_caller]
fn assert_rings(name: &str, depth: f64, stop: f64, width: f64, edges: &[f64]) {
    let truth = rings(edges, depth, stop, width);
    let scene = lens(depth, width);
    let axial = |p: Vec3| f64::from(p.x).hypot(f64::from(p.z));
    // Camera, screen, out of the ball, into the ball, sun.
    let bin = |path: &JoinedPath| {
        let at = |i: u32| axial(path.vertex(i).point.position);
        if path.edges() == 4 && at(3) < stop { ring(at(1), edges) } else { None }
    };
    let (cheap, dear): (Vec<_>, Vec<_>) = FROM_LIGHT.iter().copied().partition(|kind| !kind.has(|x| x.t >= 2));
    assert_bins(name, &scene, &cheap, 4, 0.03, (&bin, &truth));
    // The same light paths, one pass of which costs more here.
    assert_bins(name, &scene, &dear, 4, 0.06, (&bin, &truth));
}

/// The paraxial focal length is n D/(4(n−1)) from the middle of the ball: 1.5 radii for n = 1.5. Within half of the
/// ball's radius light crosses the axis before that, by the spherical aberration of exact rays, and is nowhere beyond
/// the outermost of them.
#[test]
fn a_ball_lens_focuses_where_geometric_optics_says() {
    let focal = IOR * 2.0 / (4.0 * (IOR - 1.0));
    assert!((focal - 1.5).abs() < 1e-12);
    assert!((landing(1e-4, focal) / 1e-4).abs() < 1e-6, "exact rays go through the paraxial focus");
    let stop = 0.5;
    for (name, depth) in [("before the focus", 1.3), ("in the focus", focal)] {
        let outermost = (0..=100).map(|i| landing(stop * f64::from(i) / 100.0, depth).abs()).fold(0.0, f64::max);
        println!("  {name}: outermost ray at {outermost:.5}");
        assert_rings(name, depth, stop, 4.0 * outermost, &[0.5 * outermost, 1.001 * outermost, 2.0 * outermost]);
    }
}

/// All of the ball, shortly behind it: bright in the middle, with a rim where rays turn back, dρ/db = 0.
#[test]
fn a_balls_caustic_has_its_rim_where_rays_turn() {
    let depth = 1.15;
    let rim = (0..900).map(|i| landing(f64::from(i) / 1000.0, depth)).fold(0.0, f64::max);
    println!("  rim at {rim:.4}");
    assert_rings("behind the ball", depth, 0.9, 2.4 * rim, &[0.5 * rim, 0.8 * rim, 1.001 * rim, 1.2 * rim]);
}
