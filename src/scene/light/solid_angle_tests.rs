//! Lamps near by: the places on them and their densities, against counts, integrals and closed forms.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{LightId, Lights, Receiver, density, solid_angle::Outlook, tests::Bins};
use crate::{
    lanes::{Arrays, Float, Lanes, Mask, Vector},
    math::Rgb,
    sampling::{Choice, Independent, PdfSolidAngle, Sampler, Stream, warp},
    scene::{
        geometry::Geometry,
        material::{EmissionSides, Material, MaterialId},
        point::Point,
    },
};

/// The only lamp of a scene, of radiance 1.
struct Lamp {
    geometry: Geometry,
    materials: [Material; 1],
    lights: Lights,
}

impl Lamp {
    fn of(geometry: Geometry, sides: EmissionSides) -> Self {
        let mut material = Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::ONE);
        material.emission_sides = sides;
        let materials = [material];
        let lights = Lights::new(&geometry, &materials, &[]);
        Self { geometry, materials, lights }
    }

    fn triangle(corners: [Vec3; 3]) -> Self {
        let mut geometry = Geometry::default();
        geometry.add_triangles(&corners, None, &[[0, 1, 2]], MaterialId(0));
        Self::of(geometry, EmissionSides::Front)
    }

    fn sphere(center: Vec3, radius: f32) -> Self {
        let mut geometry = Geometry::default();
        geometry.add_sphere(center, radius, MaterialId(0));
        Self::of(geometry, EmissionSides::Front)
    }

    fn sample(&self, from: Vec3, u: Vec2) -> (Point, f32) {
        let receiver = Receiver::at(&Point::nowhere(from));
        let sampled =
            self.lights.sample_next_event(&self.geometry, &self.materials, receiver, u.into(), Choice::new(0), 0);
        let (point, pdf) = sampled.expect("a lamp");
        (point, pdf.0)
    }

    fn pdf(&self, from: Vec3, point: &Point) -> f32 {
        self.lights.pdf_next_event(&self.geometry, point, &Point::nowhere(from)).0
    }

    /// The point of the triangle at these barycentric coordinates.
    fn at(&self, b: Vec2) -> Point {
        let (id, primitive) = self.lights.area_lights().next().expect("a lamp");
        let surface = self.geometry.surface_at_place(primitive, b);
        Point::on_surface(&self.geometry, &self.materials, primitive, &surface, Some(id))
    }

    /// The irradiance at `from` on a plane with the normal `n`, and the largest of the `count` estimates.
    fn irradiance(&self, from: Vec3, n: Vec3, count: u32) -> (f64, f64) {
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        for i in 0..count {
            let (point, pdf) = self.sample(from, even(i, count));
            let towards = point.position.as_dvec3() - from.as_dvec3();
            let (d2, w) = (towards.length_squared(), towards.normalize());
            let cosines = n.as_dvec3().dot(w).max(0.0) * (-point.normal.as_dvec3().dot(w)).max(0.0);
            let estimate = cosines / (d2 * f64::from(pdf));
            (sum, largest) = (sum + estimate / f64::from(count), largest.max(estimate));
        }
        (sum, largest)
    }
}

/// The `i`-th of so many places that cover the square evenly.
fn even(i: u32, count: u32) -> Vec2 {
    let golden = (f64::from(i) * 0.618_033_988_749_895 + 0.3).fract() as f32;
    Vec2::new((i as f32 + 0.5) / count as f32, golden)
}

fn directions([p, q, r]: [Vec3; 3], from: Vec3) -> [DVec3; 3] {
    [p, q, r].map(|p| (p.as_dvec3() - from.as_dvec3()).normalize())
}

/// The solid angle by the angles between the arcs (Girard).
fn solid_angle(corners: [Vec3; 3], from: Vec3) -> f64 {
    let [p, q, r] = directions(corners, from);
    let between = |a: DVec3, b: DVec3, c: DVec3| a.cross(b).angle_between(a.cross(c));
    between(p, q, r) + between(q, r, p) + between(r, p, q) - PI
}

/// Lambert's formula for the irradiance of a triangle above the horizon.
fn lambert(corners: [Vec3; 3], from: Vec3, n: Vec3) -> f64 {
    let d = directions(corners, from);
    let arc = |i: usize| {
        let (a, b) = (d[i], d[(i + 1) % 3]);
        0.5 * a.angle_between(b) * a.cross(b).normalize().dot(n.as_dvec3())
    };
    (arc(0) + arc(1) + arc(2)).abs()
}

const TRIANGLES: [[Vec3; 3]; 3] = [
    [Vec3::ZERO, Vec3::X, Vec3::Y],
    [Vec3::new(-0.3, 0.2, 0.1), Vec3::new(0.9, -0.4, 0.3), Vec3::new(0.1, 0.7, -0.2)],
    [Vec3::new(0.0, 0.0, 0.0), Vec3::new(2.0, 0.1, 0.0), Vec3::new(0.3, 0.3, 0.0)],
];

/// Points before a triangle: close over its middle, a corner and an edge, beside it near its plane, behind it, at some
/// distance and far away.
fn receivers([p, q, r]: [Vec3; 3]) -> [Vec3; 9] {
    let (u, v) = (q - p, r - p);
    let n = u.cross(v).normalize();
    let at = |b: f32, c: f32, h: f32| p + b * u + c * v + h * n;
    [
        at(0.3, 0.3, 0.06),
        at(0.3, 0.3, 0.5),
        at(0.0, 0.0, 0.1),
        at(0.5, 0.5, 0.2),
        at(-0.3, 0.4, 0.01),
        at(0.3, -0.2, -0.3),
        at(0.4, 0.2, -1.0),
        at(1.5, 0.5, 1.5),
        at(0.3, 0.3, 40.0),
    ]
}

fn near(corners: [Vec3; 3], from: Vec3) -> bool {
    Outlook::of(corners, from).is_near
}

/// A p-value of counts against what is expected; bins in which too few are expected count together.
fn p_value(observed: &[f64], expected: &[f64]) -> f64 {
    let (mut chi2, mut freedom, mut rest) = (0.0, -1.0, (0.0, 0.0));
    for (&observed, &expected) in observed.iter().zip(expected) {
        if expected < 10.0 {
            rest = (rest.0 + observed, rest.1 + expected);
        } else {
            chi2 += (observed - expected).powi(2) / expected;
            freedom += 1.0;
        }
    }
    if rest.1 > 5.0 {
        chi2 += (rest.0 - rest.1).powi(2) / rest.1;
        freedom += 1.0;
    } else {
        assert!(rest.0 < 25.0, "{rest:?}: samples where there should be none");
    }
    1.0 - ChiSquared::new(freedom).expect("some bins").cdf(chi2)
}

#[test]
fn places_on_triangles_follow_their_density() {
    const SIDE: usize = 8;
    const FINE: usize = 1 << 10;
    const TRIES: usize = 100_000;
    let bin = |b: Vec2| {
        let index = |x: f32| ((x * SIDE as f32) as usize).min(SIDE - 1);
        index(b.x) * SIDE + index(b.y)
    };
    for (corners, from) in TRIANGLES.into_iter().flat_map(|t| receivers(t).map(|from| (t, from))) {
        let lamp = Lamp::triangle(corners);
        let area = f64::from(lamp.geometry.area(lamp.lights.area_lights().next().unwrap().1));
        let mut expected = [0.0; SIDE * SIDE];
        for k in 0..FINE * FINE {
            // Both triangles of a cell of the grid, as far as they lie on the lamp.
            let (i, j) = ((k / FINE) as f32, (k % FINE) as f32);
            for (part, inside) in [(1.0 / 3.0, k / FINE + k % FINE < FINE), (2.0 / 3.0, k / FINE + k % FINE + 1 < FINE)]
            {
                if inside {
                    let b = Vec2::new(i + part, j + part) / FINE as f32;
                    expected[bin(b)] += f64::from(lamp.pdf(from, &lamp.at(b))) * area / (FINE * FINE) as f64;
                }
            }
        }
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 1e-3, "{corners:?} from {from}: ∫p dA = {total}");
        let (mut random, mut observed) = (Independent::new(7, 0, 0, Stream::Light), [0.0; SIDE * SIDE]);
        for _ in 0..TRIES {
            observed[bin(lamp.sample(from, random.next_2d()).0.barycentric)] += 1.0;
        }
        let p = p_value(&observed, &expected.map(|x| x * TRIES as f64));
        assert!(p > 1e-5, "{corners:?} from {from}: p = {p:.2e}");
    }
}

#[test]
fn places_on_spheres_follow_their_density() {
    let center = Vec3::new(0.3, -0.2, 0.5);
    for (radius, distance) in [(1.0, 1.02), (1.0, 1.5), (0.5, 4.0), (0.01, 50.0)] {
        let lamp = Lamp::sphere(center, radius);
        let axis = Vec3::new(0.48, -0.6, 0.64);
        let from = center + axis * distance;
        let place = |n: Vec3| Point {
            position: center + radius * n,
            normal: n,
            place: super::Place::Surface,
            light: Some(LightId::new(0)),
            ..Point::nowhere(Vec3::ZERO)
        };
        let p = |n| PdfSolidAngle(lamp.pdf(from, &place(n)) * radius * radius);
        let bins = Bins::around(axis, f64::from(radius / distance));
        let p = bins.p_value(60, 200_000, |u| lamp.sample(from, u).0.normal, p);
        assert!(p > 1e-5, "{radius} at {distance}: p = {p:.2e}");
        // Nothing is chosen on the other side.
        assert_eq!(lamp.pdf(from, &place(-axis)), 0.0);
    }
}

#[test]
fn the_density_of_a_sample_is_found_again() {
    let mut random = Independent::new(3, 0, 0, Stream::Light);
    let (mut by_angle, mut by_area) = (0, 0);
    for i in 0..2000 {
        let at = |random: &mut Independent, size: f32| (random.next_3d() - 0.5) * size;
        let corners = [at(&mut random, 2.0), at(&mut random, 2.0), at(&mut random, 2.0)];
        let from = at(&mut random, if i % 2 == 0 { 4.0 } else { 60.0 });
        let lamps = [Lamp::triangle(corners), Lamp::sphere(corners[0], 0.3 + 0.2 * corners[1].x.abs())];
        for lamp in lamps {
            let (point, pdf) = lamp.sample(from, random.next_2d());
            assert_eq!(lamp.pdf(from, &point).to_bits(), pdf.to_bits(), "{from}: {point:?}");
        }
        if near(corners, from) { by_angle += 1 } else { by_area += 1 }
    }
    assert!(by_angle > 400 && by_area > 400, "{by_angle} {by_area}");
}

#[test]
fn triangles_send_what_lamberts_formula_says() {
    for (corners, from) in TRIANGLES.into_iter().flat_map(|t| receivers(t).map(|from| (t, from))) {
        let [p, q, r] = corners;
        let front = (q - p).cross(r - p).dot(from - p) > 0.0;
        // A plane over whose horizon the whole triangle is.
        let n = ((p + q + r) / 3.0 - from).normalize();
        if !front || directions(corners, from).iter().any(|d| d.dot(n.as_dvec3()) < 0.0) {
            continue;
        }
        let (found, largest) = Lamp::triangle(corners).irradiance(from, n, 1 << 14);
        let expected = lambert(corners, from, n);
        assert!((found / expected - 1.0).abs() < 2e-4, "{corners:?} at {from}: {found} for {expected}");
        if near(corners, from) {
            // Of cos/d² nothing is left in the estimates.
            assert!(largest < solid_angle(corners, from) * 1.000_1, "{corners:?} at {from}: {largest}");
        }
    }
}

#[test]
fn spheres_send_what_the_closed_form_says() {
    for (radius, distance) in [(1.0, 1.001), (1.0, 1.2), (0.5, 3.0), (1e-3, 10.0), (1e-5, 30.0)] {
        // Where the whole sphere is over the horizon, E = π (R/d)² cos θ.
        for cos in [1.0, 0.9_f32] {
            let sin = (1.0 - cos * cos).sqrt();
            if radius / distance > cos && cos < 1.0 {
                continue;
            }
            let (found, _) =
                Lamp::sphere(Vec3::ZERO, radius).irradiance(Vec3::Z * distance, Vec3::new(sin, 0.0, -cos), 1 << 14);
            let expected = PI * f64::from(radius / distance).powi(2) * f64::from(cos);
            assert!((found / expected - 1.0).abs() < 3e-4, "{radius} at {distance}, {cos}: {found} for {expected}");
        }
    }
}

#[test]
fn solid_angles_are_right() {
    let mut random = Independent::new(11, 0, 0, Stream::Light);
    let mut tried = 0;
    for i in 0..20_000 {
        let mut at = || random.next_3d() - 0.5;
        let corners = [at(), at(), at()];
        let from = at() * if i % 3 == 0 { 8.0 } else { 1.5 };
        let outlook = Outlook::of(corners, from);
        if outlook.is_near {
            let [p, q, r] = corners.map(|p| p.as_dvec3());
            let [a, b, c] = directions(corners, from);
            let tan = a.dot(b.cross(c)).abs() / (1.0 + a.dot(b) + b.dot(c) + a.dot(c));
            let expected = 2.0 * if tan < 0.0 { tan.atan() + PI } else { tan.atan() };
            // By the density of a place: A cos/(d² Ω).
            let n = (q - p).cross(r - p);
            let (center, x) = ((p + q + r) / 3.0, from.as_dvec3());
            let to = center - x;
            let relative = 0.5 * n.dot(to).abs() / to.length().powi(3) / expected;
            let found =
                f64::from(density(outlook.area_of_solid_angle(), from, center.as_vec3(), n.normalize().as_vec3()));
            let slope = n.normalize().dot(to).abs() / to.length();
            assert!((found / relative - 1.0).abs() < 2e-6 / slope + 1e-5, "{corners:?} {from}: {found} for {relative}");
            tried += 1;
        }
    }
    assert!(tried > 5000, "{tried}");
}

#[test]
fn the_map_is_continuous_and_meets_that_of_the_area() {
    let corners = TRIANGLES[1];
    let place = |from: Vec3, u: Vec2| Vec2::from(Outlook::of(corners, from).place(warp::triangle(u.to_array())).0);
    const N: u32 = 200;
    let at = |i: u32, j: u32| Vec2::new(i as f32, j as f32) / N as f32;
    let squares = || (0..N * N).map(|k| (k / N, k % N));
    for from in receivers(corners).into_iter().take(8) {
        let largest = squares()
            .map(|(i, j)| {
                let [a, b, c] = [at(i, j), at(i + 1, j), at(i, j + 1)].map(|u| place(from, u));
                assert!(a.min_element() >= 0.0 && a.x + a.y <= 1.000_001, "{a}");
                a.distance(b).max(a.distance(c))
            })
            .fold(0.0, f32::max);
        assert!(largest < 0.12, "{from}: {largest}");
    }
    // From far away both maps are one.
    let far = receivers(corners)[8];
    for (i, j) in squares() {
        let by_area = Vec2::from(warp::triangle(at(i, j).to_array()));
        assert!(place(far, at(i, j)).distance(by_area) < 0.02, "{i} {j}: {} {by_area}", place(far, at(i, j)));
    }
}

#[test]
fn lanes_have_the_bits_of_one() {
    const N: usize = 8;
    let lanes = Arrays::<N>;
    let mut random = Independent::new(13, 0, 0, Stream::Light);
    for _ in 0..500 {
        let mut of_each = || std::array::from_fn::<_, N, _>(|_| random.next_3d() - 0.5);
        let given = [of_each(), of_each(), of_each(), of_each(), of_each()];
        let vectors = given.map(|each| lanes.vectors(|k| each[k].to_array()));
        let [p, q, r, from, u] = vectors;
        let outlook = Outlook::of([p, q, r], from);
        let [x, y, _] = u.coordinates();
        let b = warp::triangle([x + lanes.splat(0.5), y + lanes.splat(0.5)]);
        let (places, area_of_solid_angle) = outlook.place(b);
        let found = [places[0], places[1], density(area_of_solid_angle, from, p, q)];
        for k in 0..N {
            let [p, q, r, from, u] = given.map(|each| each[k]);
            let one = Outlook::of([p, q, r], from);
            assert_eq!(one.is_near, outlook.is_near.bits() >> k & 1 == 1);
            if one.is_near {
                let ([x, y], area_of_solid_angle) = one.place(warp::triangle([u.x + 0.5, u.y + 0.5]));
                let expected = [x, y, density(area_of_solid_angle, from, p, q)].map(f32::to_bits);
                assert_eq!(found.map(|x| x.all()[k].to_bits()), expected);
                assert_eq!(area_of_solid_angle, one.area_of_solid_angle());
            }
        }
    }
}

#[test]
fn what_is_not_seen_from_outside_is_sampled_by_area() {
    let sphere = |sides| {
        let mut geometry = Geometry::default();
        geometry.add_sphere(Vec3::ZERO, 1.0, MaterialId(0));
        Lamp::of(geometry, sides)
    };
    let evenly = 1.0 / (4.0 * std::f32::consts::PI);
    for (sides, from) in
        [(EmissionSides::Front, Vec3::X * 0.7), (EmissionSides::Front, Vec3::X), (EmissionSides::Both, Vec3::X * 3.0)]
    {
        for i in 0..100 {
            let (point, pdf) = sphere(sides).sample(from, even(i, 100));
            assert!((pdf - evenly).abs() < 1e-6, "{from}: {pdf} at {}", point.position);
        }
    }
    // In its plane a triangle has no solid angle, and far away it does not matter.
    for from in [Vec3::new(0.2, 0.3, 0.0), Vec3::new(3.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 30.0)] {
        let (_, pdf) = Lamp::triangle(TRIANGLES[0]).sample(from, Vec2::new(0.2, 0.6));
        assert_eq!(pdf, 2.0);
    }
}
