//! Spots, profiles and environment maps: their densities against counts, integrals and closed forms.

use std::{
    f64::consts::{FRAC_PI_2, PI, TAU},
    sync::Arc,
};

use glam::{DVec2, Mat3, Vec2, Vec3};
use proptest::{prelude::prop_assert, proptest};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{BRIGHTEST, EnvironmentMap, Goniometric, Light, Lights, Profile, Spot};
use crate::{
    math::{Frame, Rgb, luminance},
    sampling::{Choice, Independent, PdfSolidAngle, Sampler, Stream},
    scene::{
        geometry::Geometry,
        material::{Material, MaterialId},
    },
};

/// Bins of the sphere of equal solid angle: rows even in cos θ and columns even in longitude, both about `axis`, with
/// rows from cos θ = 1 down to `lowest`.
pub(super) struct Bins {
    frame: Frame,
    lowest: f64,
    side: usize,
}

impl Bins {
    pub fn around(axis: Vec3, lowest: f64) -> Self {
        Self { frame: Frame::around(axis), lowest, side: 12 }
    }

    fn of(&self, w: Vec3) -> usize {
        let local = self.frame.to_local(w);
        let down = (1.0 - f64::from(local.z)) / (1.0 - self.lowest);
        let right = f64::from(local.y).atan2(f64::from(local.x)) / TAU + 0.5;
        let index = |x: f64| ((x * self.side as f64) as usize).min(self.side - 1);
        index(down) * self.side + index(right)
    }

    /// ∫p dω over each bin, by the midpoint rule with `fine`² places in it.
    fn integrals(&self, fine: usize, p: impl Fn(Vec3) -> PdfSolidAngle) -> Vec<f64> {
        let n = self.side * fine;
        let solid_angle = TAU * (1.0 - self.lowest) / (n * n) as f64;
        let mut sums = vec![0.0; self.side * self.side];
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let place = DVec2::new(j as f64 + 0.5, i as f64 + 0.5) / n as f64;
            let cos = 1.0 - place.y * (1.0 - self.lowest);
            let (y, x) = (TAU * (place.x - 0.5)).sin_cos();
            let sin = (1.0 - cos * cos).sqrt();
            let w = self.frame.to_world(Vec3::new((sin * x) as f32, (sin * y) as f32, cos as f32));
            sums[i / fine * self.side + j / fine] += f64::from(p(w).0) * solid_angle;
        }
        sums
    }

    /// The p-value of `n` samples against their density, which must integrate to 1.
    pub fn p_value(
        &self,
        fine: usize,
        n: usize,
        sample: impl Fn(Vec2) -> Vec3,
        p: impl Fn(Vec3) -> PdfSolidAngle,
    ) -> f64 {
        let expected = self.integrals(fine, &p);
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 2e-3, "∫p dω = {total}");
        let mut random = Independent::new(5, 0, 0, Stream::Light);
        let mut observed = vec![0.0; expected.len()];
        for _ in 0..n {
            let w = sample(random.next_2d());
            assert!((w.length() - 1.0).abs() < 1e-5 && p(w).0 > 0.0, "{w}: {:?}", p(w));
            observed[self.of(w)] += 1.0;
        }
        // Bins in which too few are expected count together.
        let (mut chi2, mut freedom, mut rest) = (0.0, -1.0, (0.0, 0.0));
        let mut add = |observed: f64, expected: f64| {
            chi2 += (observed - expected).powi(2) / expected;
            freedom += 1.0;
        };
        for (observed, share) in observed.into_iter().zip(expected) {
            let expected = n as f64 * share;
            if expected < 10.0 {
                rest = (rest.0 + observed, rest.1 + expected);
            } else {
                add(observed, expected);
            }
        }
        if rest.1 > 5.0 {
            add(rest.0, rest.1);
        } else {
            assert!(rest.0 < 25.0, "{rest:?}: samples where there should be none");
        }
        1.0 - ChiSquared::new(freedom).unwrap().cdf(chi2)
    }
}

const CONES: [(f64, f64); 6] =
    [(0.0, PI / 4.0), (0.3, 0.8), (0.5, 0.5), (0.0, FRAC_PI_2), (1.2, FRAC_PI_2), (0.01, 0.03)];

fn spot((inner, outer): (f64, f64)) -> Spot {
    let axis = Vec3::new(0.48, -0.6, 0.64);
    Spot::new(Vec3::ZERO, axis, Rgb::new(1.0, 2.0, 3.0), inner as f32, outer as f32)
}

/// The extension's formula as it stands there, in f64.
fn specified((inner, outer): (f64, f64), cd: f64) -> f64 {
    let scale = 1.0 / f64::max(0.001, inner.cos() - outer.cos());
    let offset = -outer.cos() * scale;
    (cd * scale + offset).clamp(0.0, 1.0).powi(2)
}

#[test]
fn a_spot_falls_off_as_specified() {
    for cone in CONES {
        let spot = spot(cone);
        let frame = Frame::around(Vec3::new(0.48, -0.6, 0.64));
        for i in 0..200 {
            let theta = 1.2 * cone.1 * (f64::from(i) + 0.3) / 200.0;
            let w = frame.to_world(Vec3::new(theta.sin() as f32, 0.0, theta.cos() as f32));
            let expected = specified(cone, theta.cos());
            let found = spot.intensity_towards(w);
            assert!((f64::from(found.r()) - expected).abs() < 1e-3, "{cone:?} at {theta}: {found} for {expected}");
            assert!((found - found.r() * Rgb::new(1.0, 2.0, 3.0)).abs().element_sum() < 1e-6);
            assert_eq!(spot.pdf(w).0 > 0.0, found.r() > 0.0, "{cone:?} at {theta}");
        }
    }
}

#[test]
fn a_spots_power_is_its_integral() {
    for cone in CONES {
        let n = 200_000;
        let step = (1.0 - cone.1.cos()) / f64::from(n);
        let integral: f64 = (0..n).map(|i| specified(cone, 1.0 - (f64::from(i) + 0.5) * step) * step * TAU).sum();
        let found = f64::from(spot(cone).solid_angle());
        assert!((found / integral - 1.0).abs() < 1e-5, "{cone:?}: {found} for {integral}");
    }
}

#[test]
fn a_spots_samples_follow_its_intensity() {
    for cone in CONES {
        let spot = spot(cone);
        let bins = Bins::around(Vec3::new(0.48, -0.6, 0.64), cone.1.cos());
        let p = bins.p_value(24, 200_000, |u| spot.sample(u), |w| spot.pdf(w));
        assert!(p > 1e-4, "{cone:?}: p = {p:.2e}");
    }
}

/// Polar angles and azimuths of tables, degrees: all around, half, beside the axis; coarse and fine.
const WEBS: [(&[f64], &[f64]); 4] = [
    (&[0.0, 30.0, 45.0, 90.0], &[0.0, 360.0]),
    (&[0.0, 90.0, 180.0], &[0.0, 90.0, 135.0, 300.0, 360.0]),
    (&[90.0, 100.0, 101.0, 180.0], &[90.0, 180.0, 270.0, 360.0, 450.0]),
    (&[20.0, 20.5, 40.0], &[0.0, 1.0, 200.0, 360.0]),
];

/// An intensity for each angle: some dark, and the last azimuth as the first.
fn intensity(azimuths: usize, i: usize, j: usize) -> f32 {
    [0.0, 3.0, 1.0, 0.5, 8.0, 0.0, 2.0][(3 * i + 2 * (j % (azimuths - 1))) % 7]
}

fn radians(angles: &[f64]) -> Vec<f64> {
    angles.iter().map(|angle| angle.to_radians()).collect()
}

fn lamp((polar, azimuths): (&[f64], &[f64]), to_world: Mat3) -> Goniometric {
    let profile = Profile::new(&radians(polar), &radians(azimuths), |i, j| intensity(azimuths.len(), i, j)).unwrap();
    Goniometric::new(Vec3::ZERO, to_world, Rgb::new(1.0, 2.0, 3.0), Arc::new(profile))
}

/// Intensity between the angles as tables of a goniometer are read, in degrees.
fn interpolated((polar, azimuths): (&[f64], &[f64]), theta: f64, phi: f64) -> f64 {
    let phi = azimuths[0] + (phi - azimuths[0]).rem_euclid(360.0);
    let place = |angles: &[f64], x: f64| {
        let i = angles.partition_point(|angle| *angle <= x).clamp(1, angles.len() - 1) - 1;
        (i, (x - angles[i]) / (angles[i + 1] - angles[i]))
    };
    if theta < polar[0] || theta > polar[polar.len() - 1] {
        return 0.0;
    }
    let ((i, down), (j, right)) = (place(polar, theta), place(azimuths, phi));
    let at = |i, j| f64::from(intensity(azimuths.len(), i, j));
    let row = |i| at(i, j) * (1.0 - right) + at(i, j + 1) * right;
    row(i) * (1.0 - down) + row(i + 1) * down
}

#[test]
fn a_profile_is_linear_between_the_angles_of_its_table() {
    for web in WEBS {
        let lamp = lamp(web, Mat3::IDENTITY);
        let mut sum = 0.0;
        let (n, m) = (720, 180);
        for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
            let (theta, phi) =
                ((f64::from(i) + 0.4) * 180.0 / f64::from(n), (f64::from(j) + 0.3) * 360.0 / f64::from(m));
            let (sin, cos) = theta.to_radians().sin_cos();
            let (y, x) = phi.to_radians().sin_cos();
            let found = lamp.intensity_towards(Vec3::new((sin * x) as f32, (sin * y) as f32, -cos as f32));
            let expected = interpolated(web, theta, phi);
            sum += expected * sin * PI / f64::from(n) * TAU / f64::from(m);
            // Rows 1° apart: a quarter of what the steepest rises there next to a pole.
            let (off, from_pole) = ((f64::from(found.r()) - expected).abs(), theta.min(180.0 - theta));
            assert!(off < 0.3 * (1.0 + from_pole).recip() + 0.01, "{web:?} at {theta}, {phi}: {found} for {expected}");
            assert!((found - found.r() * Rgb::new(1.0, 2.0, 3.0)).abs().element_sum() < 1e-5);
        }
        let flux = f64::from(lamp.power().r());
        assert!((flux / sum - 1.0).abs() < 5e-3, "{web:?}: {flux} lm for {sum}");
    }
}

#[test]
fn a_profiles_samples_follow_its_intensity() {
    let turned = Mat3::from_rotation_x(0.7) * Mat3::from_rotation_z(0.4);
    let mirrored = turned * Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0));
    for (web, to_world) in WEBS.into_iter().zip([turned, Mat3::IDENTITY, mirrored, turned]) {
        let lamp = lamp(web, to_world);
        let (axis, half_angle) = lamp.cone();
        let bins = Bins::around(axis, f64::from(half_angle.cos()));
        let p = bins.p_value(64, 200_000, |u| lamp.sample(choices(u)), |w| lamp.pdf(w));
        assert!(p > 1e-4, "{web:?}: p = {p:.2e}");
        let mut random = Independent::new(4, 0, 0, Stream::Light);
        for _ in 0..2000 {
            let w = lamp.sample(choices(random.next_2d()));
            let estimate = lamp.intensity_towards(w).r() / lamp.pdf(w).0;
            assert!((estimate / lamp.power().r() - 1.0).abs() < 1e-5, "{web:?} at {w}: {estimate}");
            assert!(w.angle_between(axis) < half_angle + 1e-3, "{web:?}: {w} outside of the cone");
        }
    }
}

#[test]
fn a_dark_profile_is_none() {
    assert!(Profile::new(&[0.0, PI], &[0.0, TAU], |_, _| 0.0).is_none());
}

/// A map with detail at every texel: black ones, tinted ones and a sun.
fn rugged(width: usize, height: usize, rotation: f32) -> EnvironmentMap {
    let mut random = Independent::new(9, 0, 0, Stream::Camera);
    let mut texels: Vec<_> = (0..width * height)
        .map(|_| {
            let [a, b, c] = random.next_3d().to_array();
            if a < 0.3 { Rgb::ZERO } else { Rgb::new(a, b * b, c.powi(4)) }
        })
        .collect();
    texels[width * height / 3] = Rgb::new(90.0, 80.0, 60.0);
    EnvironmentMap::new(width, texels, rotation).unwrap()
}

fn choices(u: Vec2) -> [Choice; 2] {
    u.to_array().map(Choice::from)
}

const SIZES: [(usize, usize); 8] = [(16, 8), (15, 7), (1, 1), (2, 1), (1, 2), (5, 2), (3, 40), (40, 3)];

#[test]
fn a_maps_samples_follow_its_luminance() {
    for (width, height) in SIZES {
        let map = rugged(width, height, 0.7);
        let p = Bins::around(Vec3::Y, -1.0).p_value(48, 200_000, |u| map.sample(choices(u)), |w| map.pdf(w));
        assert!(p > 1e-4, "{width} × {height}: p = {p:.2e}");
    }
}

#[test]
fn a_map_is_sampled_without_variance_where_it_is_grey() {
    let mut random = Independent::new(3, 0, 0, Stream::Light);
    for (width, height) in SIZES.into_iter().chain([(512, 256)]) {
        let map = rugged(width, height, -1.0);
        for _ in 0..2000 {
            let w = map.sample(choices(random.next_2d()));
            let estimate = luminance(map.radiance(w)) / map.pdf(w).0;
            assert!((estimate / map.integral() - 1.0).abs() < 1e-5, "{width} × {height} at {w}: {estimate}");
        }
    }
}

#[test]
fn a_constant_map_is_the_constant_environment() {
    let radiance = Rgb::new(0.5, 0.25, 1.0);
    for (width, height) in SIZES {
        let map = EnvironmentMap::new(width, vec![radiance; width * height], 0.3).unwrap();
        assert!((f64::from(map.integral()) / (4.0 * PI * f64::from(luminance(radiance))) - 1.0).abs() < 1e-6);
        let mut random = Independent::new(2, 0, 0, Stream::Light);
        for w in (0..500).map(|_| crate::sampling::warp::sphere(random.next_2d())).chain([Vec3::Y, Vec3::NEG_Y]) {
            assert!((map.radiance(w) - radiance).abs().element_sum() < 1e-6);
            assert!((f64::from(map.pdf(w).0) * 4.0 * PI - 1.0).abs() < 1e-5, "{w}: {:?}", map.pdf(w));
        }
    }
}

/// A map of 8 × 4 texels whose texel at (x, y) alone is lit.
fn one(x: usize, y: usize, rotation: f32) -> EnvironmentMap {
    let mut texels = vec![Rgb::ZERO; 32];
    texels[y * 8 + x] = Rgb::ONE;
    EnvironmentMap::new(8, texels, rotation).unwrap()
}

/// The direction of the place (u, v) of an unrotated map, by the formulas of its convention.
fn direction(u: f64, v: f64) -> Vec3 {
    let (phi, theta) = (TAU * (u - 0.5), PI * v);
    Vec3::new((theta.sin() * phi.cos()) as f32, theta.cos() as f32, (theta.sin() * phi.sin()) as f32)
}

#[test]
fn directions_are_where_the_convention_says() {
    // The middle of the map is towards +x, its quarter towards −z, its top towards +y.
    assert!((direction(0.5, 0.5) - Vec3::X).length() < 1e-6);
    assert!((direction(0.25, 0.5) - Vec3::NEG_Z).length() < 1e-6);
    assert!((direction(0.75, 0.5) - Vec3::Z).length() < 1e-6);
    for (x, y) in [(0, 0), (3, 1), (4, 2), (7, 3)] {
        let centre = direction((x as f64 + 0.5) / 8.0, (y as f64 + 0.5) / 4.0);
        assert!((one(x, y, 0.0).radiance(centre) - Rgb::ONE).abs().element_sum() < 1e-5);
        // Turned by 90° about +y, what was towards +z comes from +x.
        let turned = Vec3::new(centre.z, centre.y, -centre.x);
        assert!((one(x, y, std::f32::consts::FRAC_PI_2).radiance(turned) - Rgb::ONE).abs().element_sum() < 1e-5);
    }
}

#[test]
fn the_seam_and_the_poles_are_continuous() {
    let map = rugged(16, 8, 0.0);
    let close = |a: Vec3, b: Vec3| {
        let (x, y) = (map.radiance(a), map.radiance(b));
        // Next to the sun it is steep: 90 within a sixteenth of the map.
        assert!((x - y).abs().element_sum() < 1e-2, "{a} {x}, {b} {y}");
    };
    let e = 1e-6;
    for i in 0..64 {
        let t = (f64::from(i) + 0.4) / 64.0;
        close(direction(e, t), direction(1.0 - e, t));
        // Every texel's border, and every line of centres.
        close(direction((f64::from(i % 32)) / 32.0 - e, t), direction((f64::from(i % 32)) / 32.0 + e, t));
        close(direction(t, (f64::from(i % 15) + 1.0) / 16.0 - e), direction(t, (f64::from(i % 15) + 1.0) / 16.0 + e));
    }
    // The seam's texels are each other's neighbours: half way between them is half of either.
    assert!((one(0, 1, 0.0).radiance(direction(0.0, 0.375)) - Rgb::splat(0.5)).abs().element_sum() < 1e-5);
    assert!((one(7, 1, 0.0).radiance(direction(1.0, 0.375)) - Rgb::splat(0.5)).abs().element_sum() < 1e-5);
    for pole in [Vec3::Y, Vec3::NEG_Y] {
        assert!(map.radiance(pole).is_finite() && map.pdf(pole).0.is_finite());
    }
}

#[test]
fn texels_that_are_no_radiance_are_refused_with_their_place() {
    for bad in [f32::NAN, f32::INFINITY, -1.0, 1e31] {
        let mut texels = vec![Rgb::ONE; 12];
        texels[7] = Rgb::new(1.0, bad, 1.0);
        let error = EnvironmentMap::new(4, texels, 0.0).unwrap_err();
        assert_eq!((error.x, error.y), (3, 1));
    }
    let black = EnvironmentMap::new(4, vec![Rgb::ZERO; 12], 0.0).unwrap();
    assert_eq!((black.integral(), black.pdf(Vec3::X)), (0.0, PdfSolidAngle::ZERO));
}

proptest! {
    #[test]
    fn density_and_radiance_of_any_direction_are_in_proportion(
        x in -1.0_f32..1.0, y in -1.0_f32..1.0, z in -1.0_f32..1.0, tilt in 0.0_f32..1e-4, rotation in -7.0_f32..7.0,
    ) {
        let map = rugged(31, 16, rotation);
        for w in [Vec3::new(x, y, z), Vec3::new(tilt * x, 1.0, tilt * z), Vec3::new(tilt * x, -1.0, tilt * z)] {
            let Some(w) = w.try_normalize() else { continue };
            let (radiance, p) = (map.radiance(w), map.pdf(w).0);
            prop_assert!(radiance.is_finite() && radiance.min_element() >= 0.0 && p.is_finite());
            prop_assert!((radiance == Rgb::ZERO) == (p == 0.0));
        }
    }
}

#[test]
fn samples_at_the_edge_of_what_is_black_are_numbers() {
    // Columns 1 to 3 are black, and so is the cell between any two of them; u = 0 is at its border.
    for x in [0, 4] {
        let map = one(x, 2, 0.0);
        for u in [Vec2::ZERO, Vec2::X * 0.5, Vec2::Y * 0.5, Vec2::splat(1.0_f32.next_down())] {
            let w = map.sample(choices(u));
            assert!(w.is_finite() && map.pdf(w).0 >= 0.0, "{x}, {u}: {w}");
        }
    }
    assert!((0..10).all(|i| super::environment::linear(i as f32 / 10.0, 0.0, 0.0) == i as f32 / 10.0));
}

#[test]
fn the_brightest_lights_have_a_choice_among_them() {
    let white = Rgb::splat(BRIGHTEST);
    let mut geometry = Geometry::default();
    for radius in [1e3, 1e18] {
        geometry.add_sphere(Vec3::ZERO, radius, MaterialId(0));
    }
    let materials = [Material::diffuse("", Rgb::ZERO).emitting(white)];
    let others = [
        Light::Point { position: Vec3::ZERO, intensity: white },
        Light::Spot(Spot::new(Vec3::ZERO, Vec3::X, white, 0.0, 1.0)),
        Light::Directional { towards: Vec3::X, irradiance: white },
        Light::Environment { radiance: white },
    ];
    let lights = Lights::new(&geometry, &materials, &others);
    for i in 0..6 {
        let p = lights.choice.probability(i);
        assert!(p > 0.0 && p < 1.0, "{i}: {p}");
    }
}
