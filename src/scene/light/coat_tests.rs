//! Lamps under clear coats: their radiance by angle and their power against the formula of the extension's page in f64,
//! and lanes against one lane.

use glam::{Vec2, Vec3};

use super::Lights;
use crate::{
    lanes::{Arrays, Lanes, Vector},
    math::Rgb,
    sampling::{Independent, Sampler, Stream, warp},
    scene::{
        bsdf::{Bsdf, Layered, Surface},
        geometry::{Geometry, PrimitiveId},
        material::{EmissionSides, Material, MaterialId},
        point::{Place, Point},
    },
};

const RADIANCE: Rgb = Rgb::new(4.0, 2.0, 1.0);

/// `emission * (1 - clearcoat * clearcoat_fresnel)` of the page.
fn expected(coat: f64, cos: f64) -> f64 {
    1.0 - coat * (0.04 + (1.0 - 0.04) * (1.0 - cos.abs()).powi(5))
}

/// A lamp in the plane of x and y that shines to both sides.
fn lamp(surface: &Surface) -> (Lights, Point, f64) {
    let mut material = Material::new("lamp", Bsdf::Layered(Layered::new(surface))).emitting(RADIANCE);
    material.emission_sides = EmissionSides::Both;
    let mut geometry = Geometry::default();
    geometry.add_triangles(&[Vec3::ZERO, Vec3::X, Vec3::Y], None, &[[0, 1, 2]], MaterialId(0));
    let materials = [material];
    let lights = Lights::new(&geometry, &materials, &[]);
    let id = PrimitiveId::world(0);
    let light = lights.area_lights().next().map(|(light, _)| light);
    let point = Point::on_surface(&geometry, &materials, id, &geometry.sample(id, Vec2::splat(0.3)), light);
    (lights, point, f64::from(geometry.area(id)))
}

/// Kept by the record of layers as it is.
fn coated(coat: f32) -> Surface {
    Surface { coat, coat_alpha: 0.04, ..Surface::LAMBERT }
}

#[test]
fn a_coat_darkens_what_is_emitted_below_it_by_its_fresnel_reflectance() {
    for coat in [0.2_f32, 0.6, 1.0] {
        let (lights, point, _) = lamp(&coated(coat));
        for degrees in [0.0_f64, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0] {
            for (side, turn) in [(1.0, 0.3_f64), (1.0, 2.0), (-1.0, 4.0)] {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let w = Vec3::new((sin * turn.cos()) as f32, (sin * turn.sin()) as f32, (side * cos) as f32);
                let le = lights.le(&point, w);
                for (channel, full) in le.to_array().into_iter().zip(RADIANCE.to_array()) {
                    let expected = f64::from(full) * expected(f64::from(coat), cos);
                    let error = (f64::from(channel) - expected).abs();
                    assert!(error < 1e-5 * f64::from(full), "{coat}, {degrees}°: {channel}, not {expected}");
                }
            }
        }
    }
}

#[test]
fn a_coat_with_its_own_normal_darkens_by_the_angle_to_that() {
    let n = Vec3::new(0.4, -0.3, 0.85).normalize();
    let surface = Surface { coat_normal: n.truncate(), coat_is_flat: false, ..coated(1.0) };
    let (lights, point, _) = lamp(&surface);
    let n = crate::math::Frame::around(Vec3::Z).to_world(n);
    for w in [n, Vec3::Z, Vec3::new(-0.6, 0.5, 0.3).normalize(), -n] {
        let le = f64::from(lights.le(&point, w).g());
        let expected = 2.0 * expected(1.0, f64::from(w.dot(n)));
        assert!((le - expected).abs() < 2e-3, "{w}: {le}, not {expected}"); // 12 bits of the normal
    }
}

#[test]
fn without_a_coat_layers_leave_emission_as_it_is() {
    let velvet = Surface { sheen: Rgb::ONE, sheen_alpha: 0.3, film: 1.0, film_thickness: 400.0, ..Surface::LAMBERT };
    let (lights, point, area) = lamp(&velvet);
    assert_eq!(lights.le(&point, Vec3::new(0.8, 0.0, 0.6)), RADIANCE);
    let power = 2.0 * std::f64::consts::PI * area * f64::from(crate::math::luminance(RADIANCE));
    assert!((lights.power_of_all() / power - 1.0).abs() < 1e-6);
}

#[test]
fn a_coated_lamps_power_is_its_radiance_over_all_directions() {
    for coat in [0.2_f32, 1.0] {
        let (lights, point, area) = lamp(&coated(coat));
        let n = 100_000;
        let cosine = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
        let le = |cos: f64| {
            let w = Vec3::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
            f64::from(crate::math::luminance(lights.le(&point, w)))
        };
        let flux = (0..n).map(|i| le(cosine(i)) * cosine(i)).sum::<f64>() * std::f64::consts::TAU / f64::from(n);
        let power = 2.0 * area * flux;
        assert!((lights.power_of_all() / power - 1.0).abs() < 1e-5, "{coat}: {}, not {power}", lights.power_of_all());
    }
}

#[test]
fn lamps_in_lanes_emit_as_each_does_alone() {
    const N: usize = 8;
    let mut random = Independent::new(3, 0, 0, Stream::Light);
    let tilted = Surface { coat_normal: Vec2::new(0.2, -0.5), coat_is_flat: true, ..coated(0.6) };
    let plain = Bsdf::Diffuse(crate::scene::bsdf::Diffuse { albedo: Rgb::ONE });
    let (lights, point, _) = lamp(&tilted);
    let mut alone = [point; N];
    for (k, point) in alone.iter_mut().enumerate() {
        match k % 4 {
            0 => point.bsdf = plain,
            1 => point.bsdf = Bsdf::Layered(Layered::new(&coated(1.0))),
            2 => point.shading_normal = Vec3::new(0.3, 0.1, 0.9).normalize(),
            _ => point.light = None,
        }
    }
    let together = Point::of_each(Arrays::<N>, Arrays::<N>.first(N), Place::Surface, |k| &alone[k]);
    for _ in 0..100 {
        let w: [Vec3; N] = std::array::from_fn(|_| warp::sphere(random.next_2d()));
        let all = lights.le(&together, Arrays::<N>.vectors(|k| w[k].to_array())).channels().all();
        for k in 0..N {
            assert_eq!(all[k], lights.le(&alone[k], w[k]).to_array(), "lane {k} towards {}", w[k]);
        }
    }
}
