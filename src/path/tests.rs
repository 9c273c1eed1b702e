//! Paths built by hand, against numbers worked out by hand.

mod lanes;
mod tilt;

use std::f64::consts::PI;

use glam::{Vec2, Vec3};

use super::{Heuristic, Path, Strategy, Technique, Techniques, Vertex};
use crate::{
    math::Rgb,
    scene::{
        Scene,
        bsdf::{Directions, Lobe},
        camera::{Camera, Raster, Sensor},
        geometry::Geometry,
        light::{Light, Spot},
        material::{Material, MaterialId},
        point::Point,
    },
};

const SENSOR: Sensor = Sensor { width: 20, height: 10, padding: 1 };
const ALBEDO: f64 = 0.6;
/// N_c: W_e |cos θ_0| over the density of the first direction.
const CAMERA: f64 = 22.0 * 12.0;

/// A floor y = 0, seen from (0, 3, 4), under the given lights.
fn floor_under(light: Light) -> Scene {
    scene(Material::diffuse("floor", Rgb::splat(ALBEDO as f32)), &[light])
}

fn scene(floor: Material, lights: &[Light]) -> Scene {
    let mut geometry = Geometry::default();
    let corners = [(-5.0, -5.0), (-5.0, 5.0), (5.0, 5.0), (5.0, -5.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
    geometry.add_triangles(&corners, None, &[[0, 1, 2], [0, 2, 3]], MaterialId(0));
    let camera = Camera::look_at(Vec3::new(0.0, 3.0, 4.0), Vec3::ZERO, Vec3::Y, 0.8, SENSOR);
    Scene::new(geometry, vec![floor], lights, camera)
}

fn lens(scene: &Scene) -> Vertex {
    Vertex::new(scene.camera.lens_point())
}

/// Where the middle of the image sees the floor: (0, 0, 0), from 5 m away, with cos θ = 3/5.
fn seen(scene: &Scene) -> Vertex {
    let lens = scene.camera.lens_point();
    let w = scene.camera.direction(&lens, Raster(Vec2::new(10.0, 5.0)));
    Vertex::new(scene.trace(&lens, w).expect("the floor"))
}

fn sampled(scene: &Scene, next_event: bool) -> Vertex {
    let from = seen(scene).point;
    let point: Point = if next_event {
        scene.sample_next_event(&from, Vec2::new(0.3, 0.4).into(), 0.5.into(), 0).expect("a light").0
    } else {
        scene.sample_emission(0.5.into(), Vec2::new(0.3, 0.4).into(), Vec2::splat(0.5)).expect("a light").point
    };
    Vertex::new(point)
}

fn pdf(path: &Path, s: u32, t: u32) -> f64 {
    path.pdf(Strategy { s, t })
}

#[track_caller]
fn assert_close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 2e-5 * expected.abs(), "{found} instead of {expected}");
}

#[test]
fn a_point_light_has_no_normal_and_is_never_hit() {
    let light = Light::Point { position: Vec3::new(1.0, 2.0, 2.0), intensity: Rgb::splat(7.0) };
    let scene = floor_under(light);
    let path = Path::new(&scene, vec![lens(&scene), seen(&scene), sampled(&scene, true)]);
    // d² = 9, cos θ_1 = 2/3, and cos = 1 at the light.
    let g = 2.0 / 3.0 / 9.0;
    assert_close(path.geometry_term(1), g);
    assert_close(path.throughput().x, ALBEDO / PI * g);
    assert_eq!(pdf(&path, 0, 3), 0.0);
    assert_close(path.contribution().x / pdf(&path, 1, 2), CAMERA * ALBEDO / PI * g * 7.0);
    assert_close(pdf(&path, 2, 1), 1.0 / (4.0 * PI) * (2.0 / 3.0) / 9.0);
    let seen_directly = Path::new(&scene, vec![lens(&scene), sampled(&scene, true)]);
    assert_eq!((pdf(&seen_directly, 0, 2), pdf(&seen_directly, 1, 1)), (0.0, 0.0));
}

#[test]
fn a_spot_shines_into_its_cone_in_proportion_to_its_intensity() {
    // From straight above the floor's middle, 60° off the axis at the outer angle and full within 30°.
    let (inner, outer) = (30.0_f32.to_radians(), 60.0_f32.to_radians());
    let spot = Spot::new(Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.6, -0.8, 0.0), Rgb::splat(7.0), inner, outer);
    let scene = floor_under(Light::Spot(spot));
    let path = Path::new(&scene, vec![lens(&scene), seen(&scene), sampled(&scene, true)]);
    let (co, ci) = (0.5, f64::from(inner).cos());
    let falloff = ((0.8 - co) / (ci - co)).powi(2);
    let g = 1.0 / 4.0;
    assert_close(path.geometry_term(1), g);
    assert_close(path.contribution().x / pdf(&path, 1, 2), CAMERA * ALBEDO / PI * g * 7.0 * falloff);
    // ∫ of the falloff over the sphere: a third of the ramp in cos θ, and all within the inner angle.
    let integral = 2.0 * PI * ((ci - co) / 3.0 + 1.0 - ci);
    assert_close(pdf(&path, 2, 1), falloff / integral * g);
    assert_eq!(pdf(&path, 0, 3), 0.0);
}

#[test]
fn a_sun_shines_along_one_direction_through_the_scenes_disk() {
    let towards = Vec3::new(0.6, 0.8, 0.0);
    let scene = floor_under(Light::Directional { towards, irradiance: Rgb::splat(3.0) });
    let path = Path::new(&scene, vec![lens(&scene), seen(&scene), sampled(&scene, false)]);
    // G is V |cos θ_1|, without d².
    assert_close(path.geometry_term(1), 0.8);
    assert_close(path.contribution().x / pdf(&path, 1, 2), CAMERA * ALBEDO / PI * 0.8 * 3.0);
    let r2 = 50.0 * 1.001_f64.powi(2);
    assert_close(pdf(&path, 2, 1), 0.8 / (PI * r2));
    assert_eq!(pdf(&path, 0, 3), 0.0);
}

#[test]
fn an_environment_is_hit_sampled_and_seen() {
    let scene = floor_under(Light::Environment { radiance: Rgb::splat(2.0) });
    let w = Vec3::new(0.0, 0.6, 0.8);
    let sky = Vertex::new(scene.lights().environment_at(w).expect("the environment"));
    let path = Path::new(&scene, vec![lens(&scene), seen(&scene), sky]);
    // The density of p_n is with respect to solid angle, unconverted, in all three strategies.
    let c1 = pdf(&Path::new(&scene, vec![lens(&scene), sky]), 0, 2).max(1.0);
    assert!(c1 > 0.0);
    assert_close(path.contribution().x / pdf(&path, 0, 3), CAMERA * ALBEDO * 2.0);
    assert_close(path.contribution().x / pdf(&path, 1, 2), CAMERA * ALBEDO / PI * 0.6 * 2.0 * 4.0 * PI);
    let r2 = 50.0 * 1.001_f64.powi(2);
    assert_close(pdf(&path, 2, 1), 1.0 / (4.0 * PI) * 0.6 / (PI * r2));
    // Seen directly, past the floor's edge: (0,2) and (1,1) both find it.
    let up = scene.camera.direction(&scene.camera.lens_point(), Raster(Vec2::new(10.0, 0.0)));
    let direct = Path::new(&scene, vec![lens(&scene), Vertex::new(scene.lights().environment_at(up).unwrap())]);
    assert_close(direct.contribution().x / pdf(&direct, 0, 2), CAMERA * 2.0);
    assert_close(pdf(&direct, 1, 1), 1.0 / (4.0 * PI));
}

#[test]
fn an_orthographic_camera_is_a_sun_at_the_other_end() {
    let mut scene = floor_under(Light::Environment { radiance: Rgb::splat(2.0) });
    scene.camera = Camera::orthographic(Vec3::new(0.0, 3.0, 4.0), Vec3::ZERO, Vec3::Y, 2.0, SENSOR);
    let film = CAMERA * 0.2 * 0.2;
    let sky = Vertex::new(scene.lights().environment_at(Vec3::new(0.0, 0.6, 0.8)).unwrap());
    let path = Path::new(&scene, vec![lens(&scene), seen(&scene), sky]);
    // G is V |cos θ_1| without d², and so is the density of p_1.
    assert_close(path.geometry_term(0), 0.6);
    assert_close(pdf(&path, 1, 2), 0.6 / film / (4.0 * PI));
    assert_close(path.contribution().x / pdf(&path, 0, 3), CAMERA * ALBEDO * 2.0);
    // p_0 follows from p_1: nothing but the light's densities is left of (2,1).
    let r2 = 50.0 * 1.001_f64.powi(2);
    assert_close(pdf(&path, 2, 1), 1.0 / (4.0 * PI) * 0.6 / (PI * r2));
    // Two ends that are directions alone: the camera's ray finds the sky, and the sky's finds no camera.
    let forward = scene.camera.direction(&scene.camera.lens_point(), Raster(Vec2::ZERO));
    let direct = vec![lens(&scene), Vertex::new(scene.lights().environment_at(forward).unwrap())];
    let direct = Path::new(&scene, direct);
    assert_close(direct.contribution().x / pdf(&direct, 0, 2), CAMERA * 2.0);
    assert_eq!(pdf(&direct, 1, 1), 0.0);
}

#[test]
fn a_lens_adds_its_area_to_every_density_and_to_the_importance() {
    let light = Light::Point { position: Vec3::new(1.0, 2.0, 2.0), intensity: Rgb::splat(7.0) };
    let mut scene = floor_under(light);
    let vertices = |scene: &Scene| vec![lens(scene), seen(scene), sampled(scene, true)];
    let pinhole = scene.clone();
    let pinhole = Path::new(&pinhole, vertices(&pinhole));
    scene.camera = scene.camera.with_lens(0.2, 5.0);
    // The middle of the lens sees what the pinhole sees.
    let path = Path::new(&scene, vertices(&scene));
    let area = PI * 0.1 * 0.1;
    for (s, t) in [(1, 2), (2, 1)] {
        assert_close(pdf(&path, s, t), pdf(&pinhole, s, t) / area);
    }
    assert_close(path.contribution().x, pinhole.contribution().x / area);
    // From the rim, the floor's middle still is in the image's: it lies in the focus plane, at the distance 5.
    let rim = scene.camera.sample_lens_towards(&seen(&scene).point, Vec2::new(0.999_999, 0.5)).unwrap();
    let offset = rim.position.distance(scene.camera.lens_point().position);
    let path = Path::new(&scene, vec![Vertex::new(rim), seen(&scene), sampled(&scene, true)]);
    let cos = 5.0 / f64::from(25.0 + offset * offset).sqrt();
    // W_e = 1/(A_px A_lens cos⁴ θ) and G(p_0, p_1) with d = 5/cos θ, over 1/A_lens and p_1's density.
    let pixel2 = CAMERA / f64::from(22 * 12) * f64::from(2.0 * 0.4_f32.tan() / 10.0).powi(2);
    let we = path.contribution() / (path.geometry_term(0) * path.throughput() * 7.0);
    assert_close(we.x, 1.0 / (pixel2 * area * cos.powi(4)));
}

#[test]
fn coverage_enters_v_f_le_and_the_densities_of_walks() {
    let scene = floor_under(Light::Environment { radiance: Rgb::splat(2.0) });
    let sky = Vertex::new(scene.lights().environment_at(Vec3::new(0.0, 0.6, 0.8)).unwrap());
    let opaque = Path::new(&scene, vec![lens(&scene), seen(&scene), sky]);
    let mut thin = seen(&scene);
    thin.point.alpha = 0.5;
    let (v0, v1) = (0.3, 0.7);
    let path = Path::new(&scene, vec![lens(&scene), thin, sky]).with_visibility(vec![v0, v1]);
    assert_close(path.geometry_term(1), v1 * opaque.geometry_term(1));
    assert_close(path.contribution().x, 0.5 * v0 * v1 * opaque.contribution().x);
    // A camera walk passes v0, stops at α, passes v1; next-event estimation tests v1 and does not sample it.
    assert_close(pdf(&path, 0, 3), v0 * 0.5 * v1 * pdf(&opaque, 0, 3));
    assert_close(pdf(&path, 1, 2), v0 * 0.5 * pdf(&opaque, 1, 2));
    assert_close(pdf(&path, 2, 1), v1 * 0.5 * pdf(&opaque, 2, 1));
}

#[test]
fn a_refraction_keeps_its_jacobian_in_both_densities() {
    // From air (above) into glass of index 1.5 below the floor; the light is an environment seen through it.
    let floor = Material::glass("water", 1.5);
    let scene = scene(floor, &[Light::Environment { radiance: Rgb::splat(2.0) }]);
    let surface = Vertex { lobe: Lobe::Delta(1), ..seen(&scene) };
    // sin θ_air = 4/5, cos θ_air = 3/5.
    let sin = 0.8 / 1.5_f32;
    let cos = f64::from((1.0 - sin * sin).sqrt());
    let into_glass = Vec3::new(0.0, -cos as f32, -sin);
    let sky = Vertex::new(scene.lights().environment_at(into_glass).unwrap());
    let path = Path::new(&scene, vec![lens(&scene), surface, sky]);
    // Fresnel at 3/5 from air into 1.5.
    let rs = (0.6 - 1.5 * cos) / (0.6 + 1.5 * cos);
    let rp = (1.5 * 0.6 - cos) / (1.5 * 0.6 + cos);
    let transmitted = 1.0 - 0.5 * (rs * rs + rp * rp);
    // The walk chooses the refraction with probability T, so what remains of the radiance is the 1/η².
    assert_close(path.contribution().x / pdf(&path, 0, 3), CAMERA * 2.0 / (1.5 * 1.5));
    // From the light the same lobe has T |dω_B/dω_A| with dω_B/dω_A = η_A² cos θ_A / (η_B² cos θ_B), A the air.
    let r2 = 50.0 * 1.001_f64.powi(2);
    let camera_end = path.geometry_term(0); // cos θ_0 cos θ_1 / d², and cos θ_0 = 1 in the middle of the image
    let to_lens = camera_end / 0.6;
    let reverse = transmitted * 0.6 / (1.5 * 1.5 * cos);
    let emission = 1.0 / (4.0 * PI) * cos / (PI * r2);
    assert!(pdf(&path, 2, 1) == 0.0 && pdf(&path, 1, 2) == 0.0, "nothing connects to a delta lobe");
    let smooth = Path::new(&scene, vec![lens(&scene), Vertex { lobe: Lobe::Delta(1), ..surface }, sky]);
    assert_close(smooth.light_density(0, Strategy { s: 3, t: 0 }, Directions::Bsdf), reverse * to_lens);
    assert_close(smooth.light_density(1, Strategy { s: 3, t: 0 }, Directions::Bsdf) / (4.0 * PI), emission);
}

#[test]
fn weights_of_the_definition_sum_to_one() {
    let scene = floor_under(Light::Environment { radiance: Rgb::splat(2.0) });
    let sky = Vertex::new(scene.lights().environment_at(Vec3::new(0.0, 0.6, 0.8)).unwrap());
    let path = Path::new(&scene, vec![lens(&scene), seen(&scene), sky]);
    let table = Techniques::new(SENSOR, 4, |x| 1 + x.s % 2);
    for heuristic in [Heuristic::Balance, Heuristic::Power, Heuristic::FirstSupported] {
        let sum: f64 = (1..=3)
            .map(|t| path.mis_weight(Technique::Bidirectional(Strategy { s: 3 - t, t }), &table, heuristic))
            .sum();
        assert_close(sum, 1.0);
    }
}

/// A little more than two cache lines; what a walk knows of it besides is half as much.
#[test]
fn a_vertex_takes_136_bytes() {
    assert_eq!((size_of::<Vertex>(), size_of::<crate::path::Step>()), (136, 200));
}
