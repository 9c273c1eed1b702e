use std::f32::consts::TAU;

use super::*;

const SENSOR: Sensor = Sensor { width: 40, height: 30, padding: 2 };

fn pinhole() -> Camera {
    Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 1.0, 0.5), Vec3::Y, 0.8, SENSOR)
}

fn thin_lens() -> Camera {
    pinhole().with_lens(0.4, 2.5)
}

fn orthographic() -> Camera {
    Camera::orthographic(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 1.0, 0.5), Vec3::Y, 3.0, SENSOR)
}

fn iris() -> Camera {
    thin_lens().with_blades(Blades::new(5, 0.3))
}

fn all() -> [Camera; 4] {
    [pinhole(), thin_lens(), iris(), orthographic()]
}

/// Well distributed numbers in the unit square.
fn lattice(i: u32, n: u32) -> Vec2 {
    Vec2::new((i as f32 + 0.5) / n as f32, (i as f32 * 0.618_034).fract())
}

/// Points over the whole padded image.
fn rasters(n: u32) -> impl Iterator<Item = Raster> {
    (0..n).map(move |i| Raster(lattice(i, n) * Vec2::new(43.9, 33.9) - Vec2::splat(1.95)))
}

#[test]
fn raster_inverts_direction_up_to_the_padding() {
    for c in all() {
        for (k, (x, y)) in [(0.25, 0.5), (39.5, 29.75), (-1.9, 31.5), (20.0, 15.0)].into_iter().enumerate() {
            let raster = Raster(Vec2::new(x, y));
            let lens = c.sample_lens(raster, lattice(k as u32, 4));
            let r = c.raster(&lens, c.direction(&lens, raster)).unwrap();
            assert!((r.0 - Vec2::new(x, y)).length() < 1e-3, "{r:?}");
        }
        let outside = Raster(Vec2::new(42.5, 3.0));
        let lens = c.sample_lens(outside, Vec2::splat(0.3));
        assert!(c.raster(&lens, c.direction(&lens, outside)).is_none());
        assert!(c.raster(&c.lens_point(), -c.forward).is_none());
    }
}

#[test]
fn what_the_light_side_connects_to_is_found_where_the_camera_sees_it() {
    for c in all() {
        for raster in rasters(50) {
            let lens = c.sample_lens(raster, Vec2::new(0.1, 0.7));
            let seen = Point::nowhere(lens.position + 1.7 * c.direction(&lens, raster));
            // The same numbers choose the same point of a lens.
            let from_light = c.sample_lens_towards(&seen, Vec2::new(0.1, 0.7)).unwrap();
            assert!((from_light.position - lens.position).length() < 1e-5);
            let found = c.raster(&from_light, (seen.position - from_light.position).normalize()).unwrap();
            assert!((found.0 - raster.0).length() < 1e-3, "{found:?} instead of {raster:?}");
        }
    }
    let ortho = orthographic();
    let behind = Point::nowhere(ortho.position - ortho.forward);
    assert!(ortho.sample_lens_towards(&behind, Vec2::ZERO).is_none());
    let infinite = Point { place: Place::Infinite, ..Point::nowhere(ortho.forward) };
    assert!(ortho.sample_lens_towards(&infinite, Vec2::ZERO).is_none());
}

#[test]
fn directions_from_every_point_of_the_lens_have_density_one() {
    for c in [pinhole(), thin_lens()] {
        for k in 0..5 {
            let lens = c.sample_lens(Raster(Vec2::ZERO), lattice(k, 5));
            // Over the sphere, which knows nothing of films and lenses.
            let n = 1200;
            let cell = 4.0 * std::f64::consts::PI / f64::from(n * n);
            let sum: f64 = (0..n * n)
                .map(|i| {
                    let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
                    f64::from(c.pdf(&lens, warp::sphere(u)).0) * cell
                })
                .sum();
            assert!((sum - 1.0).abs() < 5e-3, "{sum}");
        }
    }
    // Places on the film of an orthographic camera, which is 3·44/30 by 3·34/30 metres with its padding.
    let c = orthographic();
    let n = 1000;
    let size = Vec2::new(6.0, 5.0);
    let sum: f64 = (0..n * n)
        .map(|i| {
            let d = (Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32 - 0.5) * size;
            let seen = Point::nowhere(c.position + c.right * d.x + c.up * d.y + 2.0 * c.forward);
            let lens = c.sample_lens_towards(&seen, Vec2::ZERO).unwrap();
            f64::from(c.pdf(&lens, c.forward).0 * size.x * size.y / (n * n) as f32)
        })
        .sum();
    assert!((sum - 1.0).abs() < 5e-3, "{sum}");
}

#[test]
fn points_of_the_lens_are_uniform_on_a_disk_of_the_apertures_diameter() {
    let c = thin_lens();
    let n = 4000;
    let (mut second, mut largest) = (0.0_f32, 0.0_f32);
    for i in 0..n {
        let d = c.sample_lens(Raster(Vec2::ZERO), lattice(i, n)).position - c.position;
        assert!(d.dot(c.forward).abs() < 1e-6, "the lens plane is perpendicular to the axis");
        second += d.length_squared() / n as f32;
        largest = largest.max(d.length());
    }
    // E r² = R²/2 on a disk.
    assert!((second / 0.02 - 1.0).abs() < 0.01, "{second}");
    assert!(largest <= 0.2 * (1.0 + 1e-5) && largest > 0.198, "{largest}");
    assert!((c.pdf_lens().0 * PI * 0.2 * 0.2 - 1.0).abs() < 1e-6);
}

#[test]
fn importance_over_density_counts_the_camera_subpaths_of_a_pass() {
    for c in all() {
        for (i, raster) in rasters(200).enumerate() {
            let lens = c.sample_lens(raster, lattice(i as u32, 200));
            let w = c.direction(&lens, raster);
            let cos = w.dot(c.forward);
            let area = c.we(&lens, w) * cos / (c.pdf(&lens, w).0 * c.pdf_lens().0);
            assert!((area / (44.0 * 34.0) - 1.0).abs() < 1e-5, "{area}");
        }
    }
}

#[test]
fn a_point_in_the_focus_plane_is_sharp_and_one_at_twice_its_distance_is_not() {
    let (sharp, lens_camera) = (pinhole(), thin_lens());
    for raster in rasters(30) {
        let w = sharp.direction(&sharp.lens_point(), raster);
        let place = |distance: f32| sharp.position + w * (distance / w.dot(sharp.forward));
        let (mut in_focus, mut blurred) = (0.0_f32, 0.0_f32);
        for k in 0..20 {
            let lens = lens_camera.sample_lens(raster, lattice(k, 20));
            let off = |seen: Vec3| {
                let w = (seen - lens.position).normalize();
                let cos = w.dot(lens_camera.forward);
                // On the unbounded film: the image may cut the blur off.
                let film = Vec2::new(w.dot(lens_camera.right), -w.dot(lens_camera.up)) / cos;
                let film = film + Vec2::from(lens_camera.offset(&lens)) / 2.5;
                (film / lens_camera.pixel + 0.5 * SENSOR.size() - raster.0).length()
            };
            in_focus = in_focus.max(off(place(2.5)));
            blurred = blurred.max(off(place(5.0)));
        }
        assert!(in_focus < 1e-3, "{in_focus}");
        // The circle of confusion: r |1/focus − 1/distance| on the film at unit distance.
        let expected = 0.2 * (1.0 / 2.5 - 1.0 / 5.0) / lens_camera.pixel;
        assert!((blurred / expected - 1.0).abs() < 0.1, "{blurred} instead of {expected}");
    }
}

/// Points of the lens, right and up, over the radius of the disk.
fn on_the_lens(camera: &Camera, n: u32) -> impl Iterator<Item = Vec2> {
    (0..n).map(move |i| {
        let d = camera.sample_lens(Raster(Vec2::splat(9.0)), lattice(i, n)).position - camera.position;
        Vec2::new(d.dot(camera.right), d.dot(camera.up)) / 0.2
    })
}

#[test]
fn an_iris_is_a_polygon_of_the_area_of_its_disk() {
    for (count, rotation) in [(3, 0.0), (5, 0.3), (6, -1.0), (9, 40.0), (64, 0.0)] {
        let blades = Blades::new(count, rotation).unwrap();
        let camera = thin_lens().with_blades(Some(blades));
        assert_eq!(camera.pdf_lens(), thin_lens().pdf_lens());
        // Inside of all edges, which lie at R cos(π/N) across from the middles between corners.
        let (half, n) = (PI / count as f32, 40_000);
        let inner = blades.reach() * half.cos();
        let area = count as f32 * inner * inner * half.tan();
        assert!((area / PI - 1.0).abs() < 1e-5, "{count}: {area}");
        // Equal parts of the area: sectors of a blade, and each of two halves by the distance to its edge.
        let mut counts = vec![0_u32; 4 * count as usize];
        let mut reach = 0.0_f32;
        for q in on_the_lens(&camera, n) {
            let angle = (q.to_angle() - rotation).rem_euclid(TAU);
            let sector = ((angle / half) as usize).min(2 * count as usize - 1);
            let outward = Vec2::from_angle(rotation + half * (2 * (sector / 2) + 1) as f32);
            let out = q.dot(outward) / inner;
            assert!(out < 1.0 + 1e-5, "{count}: {q} outside of its edge");
            counts[2 * sector + usize::from(out > 0.5_f32.sqrt())] += 1;
            reach = reach.max(q.length());
            assert!(
                camera.lens_bounds().max.cmpge(camera.position + 0.2 * (camera.right * q.x + camera.up * q.y)).all()
            );
        }
        assert!(reach > 0.97 * blades.reach(), "{count}: {reach}");
        let expected = f64::from(n) / counts.len() as f64;
        let chi2: f64 = counts.iter().map(|found| (f64::from(*found) - expected).powi(2) / expected).sum();
        // Regular numbers scatter less than independent ones, whose χ² is about the number of bins.
        assert!(chi2 < counts.len() as f64, "{count}: χ² {chi2} of {} bins: {counts:?}", counts.len());
    }
    // A corner is to the right, and the next one counter-clockwise from it.
    let far = on_the_lens(&thin_lens().with_blades(Blades::new(4, 0.0)), 40_000).max_by(|a, b| a.x.total_cmp(&b.x));
    assert!((far.unwrap() - Vec2::new(PI.sqrt() / 2.0_f32.sqrt(), 0.0)).length() < 0.05, "{far:?}");
    assert!(Blades::new(2, 0.0).is_none() && Blades::new(65, 0.0).is_none() && Blades::new(5, f32::NAN).is_none());
    assert!(!pinhole().with_blades(Blades::new(5, 0.0)).has_aperture());
}

#[test]
fn a_small_lens_is_a_pinhole() {
    let (pinhole, small) = (pinhole(), pinhole().with_lens(1e-6, 2.5));
    assert!(small.has_aperture() && !self::pinhole().with_lens(0.0, 2.5).has_aperture());
    for (i, raster) in rasters(50).enumerate() {
        let lens = small.sample_lens(raster, lattice(i as u32, 50));
        let (a, b) = (pinhole.direction(&pinhole.lens_point(), raster), small.direction(&lens, raster));
        assert!((a - b).length() < 2e-6);
        let (pa, pb) = (pinhole.pdf(&pinhole.lens_point(), a).0, small.pdf(&lens, b).0);
        assert!((pa / pb - 1.0).abs() < 1e-5);
        let of_lens = small.we(&lens, b) / small.pdf_lens().0;
        assert!((pinhole.we(&pinhole.lens_point(), a) / of_lens - 1.0).abs() < 1e-5);
    }
}

#[test]
fn weights_are_finite_for_the_smallest_lens_before_the_narrowest_view() {
    let sensor = Sensor { width: 40, height: 1 << 16, padding: 2 };
    let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 1e-5, sensor);
    for aperture in [3e-9, 1e-9, 1e-15, 1e-20] {
        let camera = camera.with_lens(aperture, 1.0);
        assert_eq!(camera.has_aperture(), aperture > 2e-9);
        let w = camera.direction(&camera.lens_point(), Raster(0.5 * sensor.size()));
        assert!(camera.we(&camera.lens_point(), w).is_finite(), "{aperture}");
    }
}

/// A smaller image of the same shape has each direction at the same part of its width and height.
#[test]
fn another_sensor_sees_the_same() {
    for c in all() {
        let small = c.with_sensor(Sensor { width: 8, height: 6, padding: 0 });
        for part in (0..9).map(|i| lattice(i, 9)) {
            let [of_large, of_small] = [(c, Vec2::new(40.0, 30.0)), (small, Vec2::new(8.0, 6.0))].map(|(c, size)| {
                let raster = Raster(part * size);
                let lens = c.sample_lens(raster, Vec2::splat(0.3));
                (lens.position, c.direction(&lens, raster))
            });
            assert!(of_large.0.distance(of_small.0) < 1e-5 && of_large.1.distance(of_small.1) < 1e-5, "{of_small:?}");
        }
        assert_eq!(small.sensor().pixels(), 48);
    }
}
