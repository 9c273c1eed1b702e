//! Samples over tilted shading normals against the densities that f̂ comes with.

use std::f32::consts::TAU;

use glam::Vec3;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::super::{Vertex, tilt as defined};
use crate::{
    math::{Frame, Rgb},
    sampling::{Independent, Sampler, Stream, warp},
    scene::{
        bsdf::{Bsdf, Dielectric, Diffuse, Directions, Layered, Lobe, MetallicRoughness, Surface, Transport},
        point::Point,
        tilt::Tilt,
    },
};

/// A vertex with N_g = z and N_s turned by `degrees`.
fn vertex(bsdf: Bsdf, degrees: f32) -> Vertex {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vertex::new(Point { shading_normal: Vec3::new(0.6 * sin, 0.8 * sin, cos), bsdf, ..Point::nowhere(Vec3::ZERO) })
}

const ROWS: usize = 10;
const COLUMNS: usize = 10;
const FINE: usize = 24;
const SAMPLES: usize = 20_000;

fn bin(w: Vec3) -> usize {
    let row = (((w.z + 1.0) * 0.5 * ROWS as f32) as usize).min(ROWS - 1);
    let turn = (w.y.atan2(w.x) / TAU).rem_euclid(1.0);
    row * COLUMNS + ((turn * COLUMNS as f32) as usize).min(COLUMNS - 1)
}

/// ∫ p dω over each bin; cells are met off their middles.
fn integrals(p: impl Fn(Vec3) -> f32) -> Vec<f64> {
    let mut bins = vec![0.0; ROWS * COLUMNS];
    let (rows, columns) = (ROWS * FINE, COLUMNS * FINE);
    for i in 0..rows {
        for j in 0..columns {
            let z = 2.0 * (i as f32 + (0.5 + 0.618_034 * j as f32).fract()) / rows as f32 - 1.0;
            let (y, x) = (TAU * (j as f32 + (0.5 + 0.618_034 * i as f32).fract()) / columns as f32).sin_cos();
            let w = ((1.0 - z * z).max(0.0).sqrt() * Vec3::new(x, y, 0.0)).with_z(z);
            let solid_angle = 4.0 * std::f64::consts::PI / (rows * columns) as f64;
            bins[i / FINE * COLUMNS + j / FINE] += f64::from(p(w)) * solid_angle;
        }
    }
    bins
}

/// χ² of a vertex's samples from `known` against their density.
fn assert_distributed(case: &str, vertex: &Vertex, transport: Transport, known: Vec3) {
    let density = |w: Vec3| {
        let (to_camera, to_light) = transport.sides(known, w);
        vertex.scatter(to_camera, to_light).forward_reverse(transport).0.0
    };
    let expected = integrals(density);
    let total: f64 = expected.iter().sum();
    let mut random = Independent::new(3, 0, 0, Stream::Camera);
    let mut observed = vec![0.0; expected.len()];
    for _ in 0..SAMPLES {
        let sample = vertex.sample(Directions::Bsdf, known, transport, random.next_3d().to_array());
        if sample.some {
            let w = sample.direction;
            observed[bin(w)] += 1.0;
            let (told, found) = (sample.scatter.forward_reverse(transport).0.0, density(w));
            assert!((told - found).abs() <= 2e-3 * found + 1e-4, "{case}: {told} {found} at {w}");
        }
    }
    let count = SAMPLES as f64;
    let nothing = count - observed.iter().sum::<f64>();
    let (mut chi2, mut freedom, mut rest) = (0.0, -1.0, (nothing, count * (1.0 - total)));
    for (observed, expected) in observed.into_iter().zip(expected.iter().map(|e| e * count)) {
        if expected < 10.0 {
            rest = (rest.0 + observed, rest.1 + expected);
        } else {
            chi2 += (observed - expected).powi(2) / expected;
            freedom += 1.0;
        }
    }
    // The quadrature is good to some counts.
    chi2 += (rest.0 - rest.1).powi(2) / (rest.1.max(0.0) + 40.0);
    let p = 1.0 - ChiSquared::new(freedom + 1.0).unwrap().cdf(chi2);
    assert!(p > 1e-5, "{case}: χ² {chi2:.1} of {freedom}, p {p:.1e}, ∫p {total}");
}

#[test]
fn samples_follow_their_densities_over_tilted_normals() {
    let metal = Bsdf::MetallicRoughness(MetallicRoughness::metal(Rgb::splat(0.9), 0.4));
    let glass = Bsdf::Dielectric(Dielectric { color: Rgb::ONE, ior: 1.5, alpha: 0.4, transmission: 1.0 });
    let bsdfs = [("diffuse", Bsdf::Diffuse(Diffuse { albedo: Rgb::ONE })), ("metal", metal), ("glass", glass)];
    let known = [(0.0, 0.0, 1.0), (0.9, 0.2, 0.15), (-0.8, -0.4, 0.3), (0.5, 0.5, -0.4)];
    for (name, bsdf) in bsdfs {
        for (x, y, z) in known {
            for transport in [Transport::Radiance, Transport::Importance] {
                for degrees in [12.0, 55.0] {
                    let known = Vec3::new(x, y, z).normalize();
                    let case = format!("{name}, {degrees}°, {transport:?} from {known}");
                    assert_distributed(&case, &vertex(bsdf, degrees), transport, known);
                }
            }
        }
    }
}

/// A black surface under a coat with the normal N_g, where N_s is turned by `degrees`.
fn under_flat_coat(degrees: f32) -> Vertex {
    let black =
        Surface { base_color: Rgb::ZERO, f0: Rgb::ZERO, f90: 0.0, coat: 1.0, coat_alpha: 0.2, ..Surface::LAMBERT };
    let turned = vertex(Bsdf::Diffuse(Diffuse { albedo: Rgb::ZERO }), degrees).point;
    let normal = Frame::around(turned.shading_normal).to_local(turned.normal);
    vertex(Bsdf::Layered(Layered::new(&Surface { coat_normal: normal.truncate(), ..black })), degrees)
}

#[test]
fn a_flat_coat_does_not_know_of_the_normal_under_it() {
    let flat = under_flat_coat(0.0);
    for degrees in [12.0, 40.0, 60.0] {
        let tilted = under_flat_coat(degrees);
        for (camera, light) in [
            ([0.3, 0.1, 0.8], [-0.3, -0.2, 0.8]),
            ([0.9, 0.2, 0.3], [-0.9, 0.1, 0.25]),
            ([-0.6, -0.7, -0.4], [0.6, 0.5, -0.4]),
        ] {
            let [camera, light] = [camera, light].map(|w| Vec3::from_array(w).normalize());
            let [f, expected] = [&tilted, &flat].map(|vertex| vertex.scatter(camera, light).f.g());
            assert!((f / expected - 1.0).abs() < 0.02, "{degrees}° {camera} {light}: {f}, not {expected}");
        }
        for (x, y, z) in [(0.0, 0.0, 1.0), (0.9, 0.2, 0.15), (0.5, 0.5, -0.4)] {
            let known = Vec3::new(x, y, z).normalize();
            assert_distributed(&format!("coat, {degrees}° from {known}"), &tilted, Transport::Radiance, known);
        }
    }
}

/// Shears of vectors in f32, and longitudes with cotangents in f64, are one map.
#[test]
fn the_map_is_the_defined_one() {
    let mut random = Independent::new(4, 0, 0, Stream::Camera);
    let diffuse = Bsdf::Diffuse(Diffuse { albedo: Rgb::ONE });
    for degrees in [0.1, 2.0, 12.0, 29.5, 30.5, 55.0, 80.0] {
        let p = vertex(diffuse, degrees).point;
        let tilt = Tilt::at(&p);
        for _ in 0..4000 {
            let w = warp::sphere(random.next_2d());
            let fast = tilt.to_shading(w);
            let n_s = p.shading_normal.as_dvec3().normalize();
            let (direction, jacobian) = defined::to_shading(n_s, p.normal.as_dvec3(), w.as_dvec3().normalize());
            let precision = 2e-6 * jacobian.max(1.0);
            assert!(fast.direction.as_dvec3().distance(direction) < precision, "{degrees}° {w}: {fast:?} {direction}");
            let ratio = f64::from(fast.jacobian) / jacobian;
            assert!((ratio - 1.0).abs() < 1e3 * precision, "{degrees}° {w}: {fast:?} {jacobian}");
        }
    }
}

/// What a delta lobe's coefficients say of a mirror: radiance is kept, and the reverse density has the Jacobian of the
/// whole way.
#[test]
fn a_mirror_keeps_radiance_and_inverts_its_map() {
    let mirror = vertex(Bsdf::MetallicRoughness(MetallicRoughness::metal(Rgb::ONE, 0.0)), 40.0);
    let reflected = |w: Vec3, transport| mirror.sample(Directions::Bsdf, w, transport, [0.5; 3]);
    let mut random = Independent::new(5, 0, 0, Stream::Camera);
    for _ in 0..2000 {
        let known = warp::sphere(random.next_2d());
        let sample = reflected(known, Transport::Radiance);
        if !sample.some {
            assert!(known.z.abs() < 1e-3, "{known}");
            continue;
        }
        let w = sample.direction;
        let kept = sample.scatter.f.r() * w.z.abs() / sample.scatter.to_light.0;
        let low = known.z.abs().min(w.z.abs());
        assert!((kept - 1.0).abs() < 1e-4, "{known}: {kept}");
        let back = reflected(w, Transport::Importance);
        assert!(
            back.some && back.lobe == Lobe::Delta(0) && back.direction.distance(known) < 2e-5 / low,
            "{known} {back:?}"
        );
        // dω_light/dω_camera by differences, off the kinks at the horizons.
        let h = 1e-3;
        let (a, b) = known.any_orthonormal_pair();
        let at = |d: Vec3| {
            let near = reflected((known + d).normalize(), Transport::Radiance);
            if near.some { near.direction } else { w }
        };
        let area = (at(a * h) - at(-a * h)).cross(at(b * h) - at(-b * h)).length() / (4.0 * h * h);
        let told = sample.scatter.to_camera.0;
        assert!(low < 0.15 || (area / told - 1.0).abs() < 0.05, "{known} to {w}: {area} {told}");
    }
}
