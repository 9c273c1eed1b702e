//! E on a small square, L = ρ E/π: polygons by Lambert's formula, spheres, points, spots, suns and skies, on tilted
//! planes.

use std::{f64::consts::PI, sync::Arc};

use glam::{DMat3, DQuat, DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    sampling::Filter,
    scene::{
        Scene,
        geometry::Geometry,
        light::{EnvironmentMap, Goniometric, Light, Profile, Spot},
        material::{Material, MaterialId},
    },
};

use super::{TO_POINTS, UNBIASED, WEIGHTED, assert_image, receiver::Receiver};
use crate::scenes;

/// E/L at `p` with the normal `n` from a polygon, all of it or the part above the horizon: ½ Σ θ_i Γ_i·n over its
/// edges, θ_i the angle that an edge subtends and Γ_i the unit normal of the plane through it and p (Lambert 1760; Arvo
/// 1995). Positive for a polygon that runs clockwise as seen from p.
fn lambert(p: DVec3, n: DVec3, polygon: &[DVec3]) -> f64 {
    let around: Vec<_> = polygon.iter().map(|c| c - p).collect();
    let polygon = above_horizon(&around, n);
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let edge = |(a, b): (&DVec3, &DVec3)| a.angle_between(*b) * a.cross(*b).normalize_or_zero().dot(n);
    -0.5 * edges.map(edge).sum::<f64>()
}

/// The part of a polygon around the origin with x·n > 0 (Sutherland & Hodgman 1974).
fn above_horizon(polygon: &[DVec3], n: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (x, y) = (a.dot(n), b.dot(n));
        if x > 0.0 {
            kept.push(*a);
        }
        if (x > 0.0) != (y > 0.0) {
            kept.push(*a + (*b - *a) * (x / (x - y)));
        }
    }
    kept
}

/// The same by quadrature of its definition over a parallelogram: Σ cos θ cos θ'/d² dA, one-sided at both ends.
fn by_quadrature(p: DVec3, n: DVec3, [corner, u, v]: [DVec3; 3]) -> f64 {
    const SIDE: u32 = 1000;
    let normal = u.cross(v).normalize();
    let area = u.cross(v).length() / f64::from(SIDE * SIDE);
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
    let cell = |(i, j): (u32, u32)| {
        let d = corner + u * at(i) + v * at(j) - p;
        d.dot(n).max(0.0) * (-d.dot(normal)).max(0.0) / d.length_squared().powi(2)
    };
    (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))).map(cell).sum::<f64>() * area
}

/// The corners of a parallelogram that runs counter-clockwise seen from the side of u × v.
fn corners([corner, u, v]: [DVec3; 3]) -> [DVec3; 4] {
    [corner, corner + u, corner + u + v, corner + v]
}

/// Facing down, around (0, h, 0).
fn ceiling(width: f64, depth: f64, h: f64) -> [DVec3; 3] {
    [DVec3::new(-0.5 * width, h, -0.5 * depth), DVec3::X * width, DVec3::Z * depth]
}

#[test]
fn lamberts_formula_is_written_down_rightly() {
    let at = |tilt: f64| DQuat::from_rotation_z(tilt) * DVec3::Y;
    for (width, depth, h, e) in
        [(1.0, 1.0, 1.0, 0.752_274_7), (2.0, 1.0, 1.5, 0.656_816_7), (0.5, 0.5, 2.0, 0.061_225_76)]
    {
        let found = lambert(DVec3::ZERO, DVec3::Y, &corners(ceiling(width, depth, h)));
        assert!((found - e).abs() < 1e-7, "{found} instead of {e}");
    }
    let wall = [DVec3::new(1.0, 0.0, 0.0), DVec3::Z, DVec3::Y];
    let found = lambert(DVec3::ZERO, DVec3::Y, &corners(wall)) / PI;
    assert!((found - 0.055_734_2).abs() < 1e-7, "{found}");
    for (light, tilt) in [(ceiling(1.0, 1.0, 1.0), 0.7), (ceiling(2.0, 1.0, 0.6), 1.2), (ceiling(1.0, 2.0, 0.8), -1.4)]
    {
        let p = DVec3::new(0.1, 0.05, -0.2);
        let (formula, sum) = (lambert(p, at(tilt), &corners(light)), by_quadrature(p, at(tilt), light));
        assert!((formula / sum - 1.0).abs() < 1e-4, "{formula} instead of {sum}");
    }
}

/// A receiver tilted by `tilt` around the z axis and then turned, under a lamp that is turned with it; 0.25 high is its
/// camera.
fn under(
    tilt: f64,
    (radiance, lights): (f64, &[Light]),
    build: impl FnOnce(&mut Geometry, &dyn Fn(DVec3) -> DVec3),
) -> (Scene, Receiver) {
    let turn = DQuat::from_rotation_y(0.6) * DQuat::from_rotation_x(0.4);
    let receiver = Receiver::new(DVec3::ZERO, turn * DQuat::from_rotation_z(tilt), 0.2);
    let mut g = Geometry::default();
    receiver.add(&mut g, 0);
    build(&mut g, &|p| turn * p);
    let lamp = Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(radiance as f32));
    let camera = receiver.pinhole(0.25, scenes::square(8, Filter::Box));
    (Scene::new(g, vec![Receiver::material(), lamp], lights, camera), receiver)
}

#[test]
fn polygons_by_lamberts_formula() {
    let pentagon: Vec<DVec3> =
        (0..5).map(|i| DVec3::new((1.3 * f64::from(i)).cos(), 0.9, (1.3 * f64::from(i)).sin()) * 0.7).collect();
    for (name, polygon, tilt) in [
        ("square above", corners(ceiling(1.0, 1.0, 0.6)).to_vec(), 0.0),
        ("square above a tilted receiver", corners(ceiling(1.0, 1.0, 0.6)).to_vec(), 0.7),
        ("square partly below the horizon", corners(ceiling(1.2, 1.0, 0.5)).to_vec(), -1.3),
        ("pentagon above a tilted receiver", pentagon, 0.5),
    ] {
        let mut placed = Vec::new();
        // Towards the receiver is the side from which the corners run counter-clockwise.
        let (scene, receiver) = under(tilt, (4.0, &[]), |g, turned| {
            placed = polygon.iter().map(|p| turned(*p)).collect();
            let positions: Vec<_> = placed.iter().map(|p| p.as_vec3()).collect();
            let fan: Vec<_> = (2..positions.len() as u32).map(|i| [0, i - 1, i]).collect();
            g.add_triangles(&positions, None, &fan, MaterialId(1));
        });
        let normal = receiver.normal();
        let truth = receiver.expected(24, |p| 4.0 * lambert(p, normal, &placed));
        assert!(truth[0] > 0.05, "{name}: the lamp faces away, {}", truth[0]);
        assert_image(name, &scene, &UNBIASED, 2, 0.012, &truth);
    }
}

/// E = π L (R/d)² cos θ of a sphere that is above the horizon.
#[test]
fn a_sphere_as_a_disk_of_its_solid_angle() {
    let (radius, at) = (0.25, DVec3::new(0.1, 0.8, 0.1));
    for tilt in [0.0, 0.6] {
        let mut center = at;
        let (scene, receiver) = under(tilt, (4.0, &[]), |g, turned| {
            center = turned(at);
            g.add_sphere(center.as_vec3(), radius as f32, MaterialId(1));
        });
        let normal = receiver.normal();
        let truth = receiver.expected(24, |p| {
            let d = center - p;
            PI * 4.0 * radius * radius * d.normalize().dot(normal) / d.length_squared()
        });
        let kinds = [&WEIGHTED[..], &[IntegratorKind::PathHemisphere, IntegratorKind::PathLight]].concat();
        assert_image(&format!("sphere, tilted by {tilt}"), &scene, &kinds, 2, 0.012, &truth);
    }
}

/// E = I cos θ/d², and of a spot with the attenuation of `KHR_lights_punctual`: (cos − cos_o)²/(cos_i − cos_o)² in its
/// ramp.
#[test]
fn points_and_spots_by_the_square_of_the_distance() {
    let (intensity, place) = (Rgb::splat(2.0), DVec3::new(-0.2, 0.6, 0.1));
    let (inner, outer) = (0.15_f32, 0.6_f32);
    let axis = (DVec3::new(0.02, 0.0, -0.05) - place).normalize();
    for (name, tilt, is_spot) in
        [("point", 0.0, false), ("point, tilted", 0.8, false), ("spot", 0.0, true), ("spot, tilted", -0.5, true)]
    {
        let turn = DQuat::from_rotation_y(0.6) * DQuat::from_rotation_x(0.4);
        let (at, axis) = (turn * place, turn * axis);
        let light = if is_spot {
            Light::Spot(Spot::new(at.as_vec3(), axis.as_vec3(), intensity, inner, outer))
        } else {
            Light::Point { position: at.as_vec3(), intensity }
        };
        let (scene, receiver) = under(tilt, (0.0, &[light]), |_, _| {});
        let normal = receiver.normal();
        let (ci, co) = (f64::from(inner).cos(), f64::from(outer).cos());
        let truth = receiver.expected(48, |p| {
            let d = p - at;
            let ramp = ((d.normalize().dot(axis) - co) / (ci - co)).clamp(0.0, 1.0);
            let falloff = if is_spot { ramp * ramp } else { 1.0 };
            2.0 * falloff * -d.normalize().dot(normal) / d.length_squared()
        });
        assert_image(name, &scene, &TO_POINTS, 2, 0.01, &truth);
    }
}

/// E = I(θ, φ) cos θ/d² of a lamp whose profile is 1 + 2 θ/π at φ = 0, three times that at φ = π, and linear between.
#[test]
fn profiles_by_their_table() {
    let polar: Vec<_> = (0..=4).map(|i| f64::from(i) * PI / 4.0).collect();
    let towards = |theta: f64| 1.0 + theta * 2.0 / PI;
    let value = |i: usize, j: usize| (towards(polar[i]) * if j == 1 { 3.0 } else { 1.0 }) as f32;
    let profile = Arc::new(Profile::new(&polar, &[0.0, PI, 2.0 * PI], value).unwrap());
    for (tilt, mirror) in [(0.0, 1.0), (-0.5, 1.0), (-0.5, -1.0)] {
        let turn = DQuat::from_rotation_y(0.6) * DQuat::from_rotation_x(0.4);
        let at = turn * DVec3::new(-0.2, 0.6, 0.1);
        // Aimed beside the receiver.
        let z = (at - turn * DVec3::new(0.4, 0.0, -0.3)).normalize();
        let x = z.any_orthonormal_vector();
        let frame = DMat3::from_cols(x, z.cross(x) * mirror, z);
        let lamp = Goniometric::new(at.as_vec3(), frame.as_mat3(), Rgb::splat(2.0), profile.clone());
        let (scene, receiver) = under(tilt, (0.0, &[Light::Goniometric(Arc::new(lamp))]), |_, _| {});
        let normal = receiver.normal();
        let truth = receiver.expected(48, |p| {
            let d = p - at;
            let w = frame.transpose() * d.normalize();
            let around = w.y.atan2(w.x).abs() / PI;
            let intensity = 2.0 * towards((-w.z).acos()) * (1.0 + 2.0 * around);
            intensity * -d.normalize().dot(normal) / d.length_squared()
        });
        assert_image(&format!("profile, {tilt}, {mirror}"), &scene, &TO_POINTS, 2, 0.01, &truth);
    }
}

#[test]
fn suns_by_their_cosine() {
    let towards = Vec3::new(0.48, 0.6, 0.64);
    for tilt in [0.0, 0.9] {
        let sun = Light::Directional { towards, irradiance: Rgb::splat(3.0) };
        let (scene, receiver) = under(tilt, (0.0, &[sun]), |_, _| {});
        let cos = receiver.normal().dot(towards.as_dvec3());
        assert!(cos > 0.1);
        assert_image(
            &format!("sun, tilted by {tilt}"),
            &scene,
            &TO_POINTS,
            2,
            0.01,
            &receiver.expected(1, |_| 3.0 * cos),
        );
    }
}

/// E = ∫ L cos θ dω: π L of a constant sky; of L = max(cos θ_y, 0) on a plane that is tilted by t, 2π/3 for t = 0 and
/// otherwise by quadrature.
#[test]
fn skies_by_their_integral() {
    let sky = Rgb::splat(1.5);
    let map = |width, texels| Light::EnvironmentMap(Arc::new(EnvironmentMap::new(width, texels, 0.4).unwrap()));
    let height = 64;
    // Linear in cos θ between the rows of centres, as the map interpolates, and steep enough to be told from a
    // constant.
    let row = |y: usize| (PI * (y as f64 + 0.5) / height as f64).cos().max(0.0);
    let texels: Vec<_> = (0..8 * height).map(|i| Rgb::splat(row(i / 8) as f32)).collect();
    let of_cosine = |n: DVec3| {
        const SIDE: i32 = 600;
        let mut sum = 0.0;
        for i in 0..SIDE {
            let y = (f64::from(i) + 0.5) / f64::from(SIDE);
            for j in 0..SIDE {
                let (sin, cos) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(SIDE)).sin_cos();
                let r = (1.0 - y * y).sqrt();
                sum += y * DVec3::new(r * cos, y, r * sin).dot(n).max(0.0);
            }
        }
        sum * 2.0 * PI / f64::from(SIDE * SIDE)
    };
    assert!((of_cosine(DVec3::Y) / (2.0 * PI / 3.0) - 1.0).abs() < 1e-4);
    let turn = DQuat::from_rotation_y(0.6) * DQuat::from_rotation_x(0.4);
    let kinds = [&WEIGHTED[..], &[IntegratorKind::PathHemisphere, IntegratorKind::PathLight]].concat();
    for (name, light, tilt, e) in [
        ("constant sky", Light::Environment { radiance: sky }, 0.3, 1.5 * PI),
        ("constant map", map(8, vec![sky; 32]), 0.0, 1.5 * PI),
        ("cosine map", map(8, texels.clone()), 0.0, of_cosine(turn * DVec3::Y)),
        ("cosine map, tilted", map(8, texels), -0.6, of_cosine(turn * DQuat::from_rotation_z(-0.6) * DVec3::Y)),
    ] {
        let (scene, receiver) = under(tilt, (0.0, &[light]), |_, _| {});
        assert_image(name, &scene, &kinds, 2, 0.01, &receiver.expected(1, |_| e));
    }
}
