//! Power from one black emitter to another surface, π L A_1 F_12, by Howell's configuration factors
//! (*A Catalog of Radiation Heat Transfer Configuration Factors*: C-11 to C-15, C-41, and sphere to disk).

use std::f64::consts::PI;

use glam::{DQuat, DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    sampling::Filter,
    scene::{
        Scene,
        camera::Camera,
        geometry::Geometry,
        material::{Material, MaterialId},
    },
};

use super::{UNBIASED, WEIGHTED, assert_image, of_tiles, receiver::Receiver};
use crate::scenes;

/// A rectangle's extent along its two axes: [x_1, x_2], [y_1, y_2].
pub type Rectangle = [[f64; 2]; 2];

fn area([[x1, x2], [y1, y2]]: Rectangle) -> f64 {
    (x2 - x1) * (y2 - y1)
}

/// Σ (−1)^{i+j+k+l} G(x_i, y_j, η_k, ξ_l), as both factors below are made.
fn alternating(a: Rectangle, b: Rectangle, g: impl Fn(f64, f64, f64, f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for n in 0..16_usize {
        let [i, j, k, l] = [n & 1, n >> 1 & 1, n >> 2 & 1, n >> 3];
        let sign = if n.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * g(a[0][i], a[1][j], b[1][k], b[0][l]);
    }
    sum / (2.0 * PI)
}

/// A_1 F_12 of two facing rectangles in parallel planes at the distance `gap`, in the same coordinates (C-12).
pub fn parallel(a: Rectangle, b: Rectangle, gap: f64) -> f64 {
    alternating(a, b, |x, y, eta, xi| {
        let (dx, dy) = (x - xi, y - eta);
        let (px, py) = (dx.hypot(gap), dy.hypot(gap));
        dy * px * (dy / px).atan() + dx * py * (dx / py).atan() - 0.5 * gap * gap * (dx * dx + py * py).ln()
    })
}

/// A_1 F_12 of two rectangles in planes that meet at a right angle (C-15): x and ξ are distances from the line where
/// they meet, y and η places along it.
pub fn perpendicular(a: Rectangle, b: Rectangle) -> f64 {
    alternating(a, b, |x, y, eta, xi| {
        let (d, r2) = (y - eta, x * x + xi * xi);
        let r = r2.sqrt();
        let slope = if r > 0.0 { d * r * (d / r).atan() } else { 0.0 };
        let all = r2 + d * d;
        let logarithm = if all > 0.0 { 0.25 * (r2 - d * d) * all.ln() } else { 0.0 };
        slope - logarithm
    })
}

/// F_12 of coaxial disks with the radii r_1, r_2 at the distance h (C-41).
fn disks(r1: f64, r2: f64, h: f64) -> f64 {
    let (a, b) = (r1 / h, r2 / h);
    let x = 1.0 + (1.0 + b * b) / (a * a);
    0.5 * (x - (x * x - 4.0 * (b / a).powi(2)).sqrt())
}

/// F_12 from a sphere to a coaxial disk of radius r, whose middle is at the distance h from the sphere's.
fn sphere_to_disk(r: f64, h: f64) -> f64 {
    0.5 * (1.0 - (1.0 + (r / h).powi(2)).sqrt().recip())
}

const UNIT: Rectangle = [[0.0, 1.0], [0.0, 1.0]];

/// The formulas, against their own tables and the sum over all walls of a box.
#[test]
fn the_catalogue_is_written_down_rightly() {
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-7, "{a} instead of {b}");
    let two = [[0.0, 2.0], [0.0, 1.0]];
    close(parallel(UNIT, UNIT, 1.0), 0.199_824_9);
    close(parallel(two, two, 1.0) / 2.0, 0.285_875_4);
    close(parallel(UNIT, UNIT, 0.5), 0.415_253_3);
    close(perpendicular(UNIT, UNIT), 0.200_043_8);
    close(perpendicular(UNIT, two), 0.232_852_6);
    close(perpendicular(UNIT, [[0.0, 0.5], [0.0, 1.0]]), 0.146_186_7);
    close(disks(1.0, 1.0, 1.0), 0.381_966_0);
    close(disks(0.5, 1.0, 1.0), 0.468_871_1);
    close(disks(1.0, 2.0, 2.0), 0.468_871_1);
    close(parallel(UNIT, UNIT, 1.0) + 4.0 * perpendicular(UNIT, UNIT), 1.0);
    // Of a part of a wall in a box that is no cube, too: everything it sends arrives somewhere.
    let part = [[0.2, 0.5], [0.7, 1.1]];
    let turned = |[x, y]: Rectangle| [y, x];
    let mirrored = |[[x1, x2], y]: Rectangle, width: f64| [[width - x2, width - x1], y];
    let (width, depth, height) = (1.5, 1.2, 0.7);
    let all = parallel(part, [[0.0, width], [0.0, depth]], height)
        + perpendicular(part, [[0.0, height], [0.0, depth]])
        + perpendicular(mirrored(part, width), [[0.0, height], [0.0, depth]])
        + perpendicular(turned(part), [[0.0, height], [0.0, width]])
        + perpendicular(mirrored(turned(part), depth), [[0.0, height], [0.0, width]]);
    close(all / area(part), 1.0);
}

/// A receiver of 1 × 1 in the plane y = 0 with its corner at the origin, seen whole through an orthographic camera at
/// `height`, and a black emitter of radiance 3.
fn square_and(height: f64, emitter: impl FnOnce(&mut Geometry)) -> Scene {
    let receiver = Receiver::new(DVec3::new(0.5, 0.0, 0.5), DQuat::IDENTITY, 0.5);
    let mut g = Geometry::default();
    receiver.add(&mut g, 0);
    emitter(&mut g);
    let camera = receiver.orthographic(height, scenes::square(8, Filter::Box));
    Scene::new(g, vec![Receiver::material(), emitting()], &[], camera)
}

const RADIANCE: f64 = 3.0;

fn emitting() -> Material {
    Material::diffuse("emitter", Rgb::ZERO).emitting(Rgb::splat(RADIANCE as f32))
}

/// The tiles of the unit square, as the image shows them: each is a rectangle with a factor of its own. ρ/π · π L F_21.
fn tiles(factor: impl Fn(Rectangle) -> f64) -> pathspace::statistics::Regions {
    let side = |i: usize| [i as f64 / 4.0, (i + 1) as f64 / 4.0];
    let tile = |k: usize| [side(k % 4), side(k / 4)];
    of_tiles(
        &(0..16).map(tile).map(|t| DVec3::splat(Receiver::ALBEDO * RADIANCE * factor(t) / area(t))).collect::<Vec<_>>(),
    )
}

#[test]
fn between_parallel_rectangles() {
    for (name, emitter, gap) in [
        ("parallel, side 1, gap 1", UNIT, 1.0),
        ("parallel, side 1, gap 1/2", UNIT, 0.5),
        ("parallel and to the side", [[0.8, 2.3], [-0.5, 0.4]], 0.7),
    ] {
        let scene = square_and(0.3, |g| {
            let [[x1, x2], [z1, z2]] = emitter;
            let at = |x: f64, z: f64| DVec3::new(x, gap, z).as_vec3();
            scenes::quad(g, [at(x1, z1), at(x2, z1), at(x2, z2), at(x1, z2)], 1);
        });
        let truth = tiles(|tile| parallel(tile, emitter, gap));
        assert_image(name, &scene, &UNBIASED, 2, 0.01, &truth);
    }
}

/// They touch: next-event estimation alone and area sampling have no variance there.
#[test]
fn between_perpendicular_rectangles() {
    for (name, height) in [("perpendicular 1 : 1", 1.0), ("wall 2", 2.0), ("wall 1/2", 0.5)] {
        let scene = square_and(0.3, |g| {
            let at = |y: f64, z: f64| DVec3::new(0.0, y, z).as_vec3();
            scenes::quad(g, [at(0.0, 0.0), at(height, 0.0), at(height, 1.0), at(0.0, 1.0)], 1);
        });
        let truth = tiles(|tile| perpendicular(tile, [[0.0, height], [0.0, 1.0]]));
        let kinds = [&WEIGHTED[..], &[IntegratorKind::PathHemisphere]].concat();
        assert_image(name, &scene, &kinds, 2, 0.01, &truth);
    }
}

/// A disk around the y axis, of so many corners that the missing area does not show (7e-5).
fn disk(g: &mut Geometry, radius: f64, height: f64, side: f64, material: u32) {
    const CORNERS: u32 = 300;
    let corner = |i: u32| {
        let (sin, cos) = (2.0 * PI * f64::from(i) / f64::from(CORNERS)).sin_cos();
        Vec3::new((radius * cos) as f32, height as f32, (radius * sin) as f32)
    };
    let positions: Vec<_> = (0..CORNERS).map(corner).chain([Vec3::new(0.0, height as f32, 0.0)]).collect();
    let triangle = |i: u32| if side < 0.0 { [CORNERS, i, (i + 1) % CORNERS] } else { [CORNERS, (i + 1) % CORNERS, i] };
    g.add_triangles(&positions, None, &(0..CORNERS).map(triangle).collect::<Vec<_>>(), MaterialId(material));
}

/// The image is as wide as the disk and black around it, so that its mean is ρ L F_21 A_2/(2 r_2)².
fn assert_on_disk(name: &str, r2: f64, power: f64, emitter: impl FnOnce(&mut Geometry)) {
    let mut g = Geometry::default();
    disk(&mut g, r2, 0.0, 1.0, 0);
    emitter(&mut g);
    let width = 2.0 * r2;
    let camera = Camera::orthographic(
        Vec3::new(0.0, 0.2, 0.0),
        Vec3::ZERO,
        Vec3::NEG_Z,
        1.01 * width as f32,
        scenes::square(8, Filter::Box),
    );
    let scene = Scene::new(g, vec![Receiver::material(), emitting()], &[], camera);
    let mean = Receiver::ALBEDO / PI * power / (1.01 * width).powi(2);
    assert_image(name, &scene, &UNBIASED, 2, 0.012, &vec![mean; 3]);
}

#[test]
fn between_disks() {
    for (name, r1, r2, h) in [("disks, r = r = h", 1.0, 1.0, 1.0), ("disks 1/2, 1, 1", 0.5, 1.0, 1.0)] {
        let power = PI * RADIANCE * PI * r1 * r1 * disks(r1, r2, h);
        assert_on_disk(name, r2, power, |g| disk(g, r1, h, -1.0, 1));
    }
}

#[test]
fn from_a_sphere_to_a_disk() {
    let (radius, r2, h) = (0.4, 1.0, 0.9);
    let power = PI * RADIANCE * 4.0 * PI * radius * radius * sphere_to_disk(r2, h);
    assert_on_disk("sphere and disk", r2, power, |g| {
        g.add_sphere(Vec3::new(0.0, h as f32, 0.0), radius as f32, MaterialId(1));
    });
}
