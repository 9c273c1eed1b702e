//! Alpha: what is there in part scatters and shines in part, and camera rays, shadow rays and light paths pass the
//! rest alike.

use glam::Vec3;
use pathspace::{
    film::Image,
    integrator::IntegratorKind,
    math::Rgb,
    path::{Densities, Roulette},
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::Geometry,
        light::Light,
        material::{AlphaMode, EmissionSides, Material},
    },
    statistics::{Estimate, regions},
};

use crate::{
    agreement::{ALL, Compared, agreement},
    scenes::{self, cube_inside, quad},
};

const SENSOR: Sensor = Sensor { width: 16, height: 16, padding: 0 };

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

fn blend(material: Material, factor: f32) -> Material {
    material.covering(AlphaMode::Blend { factor })
}

fn mask(material: Material, factor: f32) -> Material {
    material.covering(AlphaMode::Mask { factor, cutoff: 0.5 })
}

/// Black, so that nothing but coverage shows.
fn veil(factor: f32) -> Material {
    blend(Material::diffuse("veil", Rgb::ZERO), factor)
}

/// A square across the z axis, 3.6 m wide, its front towards +z, tilted by `tilt` per metre of x.
fn across(geometry: &mut Geometry, z: f32, tilt: f32, material: u32) {
    let corner = |x: f32, y: f32| v(x, y, z + tilt * x);
    quad(geometry, [corner(-1.8, -1.8), corner(1.8, -1.8), corner(1.8, 1.8), corner(-1.8, 1.8)], material);
}

fn render(scene: &Scene, settings: &Settings, spp: u32, longest: Option<u32>) -> Image {
    let mut renderer = Renderer::new(scene, settings);
    (0..spp).for_each(|_| renderer.pass_where(&|path| longest.is_none_or(|n| path.edges() == n)));
    assert!(renderer.statistics().rejected.is_empty(), "{:?}", renderer.statistics().rejected);
    renderer.film().image(spp)
}

/// Every one of `kinds` finds the radiance `expected` in the whole image, from paths of `edges` edges.
pub fn assert_radiance(name: &str, scene: &Scene, kinds: &[IntegratorKind], edges: u32, spp: u32, expected: f64) {
    for &integrator in kinds {
        // What light tracing finds is spread over all directions, and needs more samples to say as much.
        let spp = if integrator == IntegratorKind::Light { 12 * spp } else { spp };
        let base = Settings {
            integrator,
            max_depth: edges,
            roulette: Roulette::FromDepth(2),
            ..Settings::new(scene.camera.sensor())
        };
        let image = |seed| regions(&render(scene, &Settings { seed, ..base.clone() }, spp, Some(edges)));
        let estimate = Estimate::new(&(0..12).map(image).collect::<Vec<_>>());
        let p = estimate.p_of_mean(expected);
        println!("{name}, {integrator}: {:.5}, expected {expected:.5}, p = {p:.2e}", estimate.image_mean());
        assert!(p > 1e-4, "{name}, {integrator}: {} instead of {expected}", estimate.image_mean());
        assert!((estimate.image_mean() / expected - 1.0).abs() < 0.03, "{name}, {integrator}: too noisy to tell");
    }
}

/// L (1 − α)^k behind k panes, also where they cross each other; panes that shine add αL_e behind those in front of
/// them.
#[test]
fn of_a_lamp_every_pane_leaves_its_part() {
    let lamp = |radiance| Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(radiance));
    let materials = vec![lamp(2.0), veil(0.3), blend(lamp(5.0), 0.4), mask(lamp(7.0), 0.2)];
    /// The camera looks along −z: z, tilt and material of a pane.
    type Pane = (f32, f32, u32);
    let stacks: [(&str, &[Pane], f64); 5] = [
        ("one pane", &[(-2.0, 0.0, 1)], 0.7 * 2.0),
        ("three panes", &[(-1.0, 0.0, 1), (-1.01, 0.0, 1), (-2.0, 0.1, 1)], 0.343 * 2.0),
        ("crossing panes", &[(-2.0, 0.5, 1), (-2.0, -0.5, 1), (-2.0, 0.0, 1)], 0.343 * 2.0),
        ("a shining pane", &[(-1.0, 0.0, 1), (-2.0, 0.0, 2), (-3.0, 0.0, 1)], 0.7 * (0.4 * 5.0 + 0.6 * 0.7 * 2.0)),
        ("a lamp that is not there", &[(-1.0, 0.0, 3), (-2.0, 0.0, 1)], 0.7 * 2.0),
    ];
    for (name, panes, expected) in stacks {
        let mut g = Geometry::default();
        across(&mut g, -4.0, 0.0, 0);
        panes.iter().for_each(|&(z, tilt, material)| across(&mut g, z, tilt, material));
        let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 0.8, SENSOR);
        assert_radiance(name, &Scene::new(g, materials.clone(), &[], camera), &scenes::WEIGHTED, 1, 48, expected);
    }
}

/// A floor under a sun or a sky that shines through two level panes and two that cross: E (1 − α)⁴ for light and shadow
/// rays.
#[test]
fn light_and_shadow_rays_pass_crossing_panes() {
    let materials = vec![Material::diffuse("floor", Rgb::splat(0.6)), veil(0.2)];
    let mut g = Geometry::default();
    across(&mut g, -2.0, 0.0, 0);
    for (z, tilt) in [(0.5, 0.0), (1.0, 0.0), (3.0, 0.2), (3.0, -0.2)] {
        across(&mut g, z, tilt, 1);
    }
    let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 0.8, SENSOR);
    let sun = Light::Directional { towards: Vec3::Z, irradiance: Rgb::splat(3.0) };
    let expected = 0.6 / std::f64::consts::PI * 3.0 * 0.8_f64.powi(4);
    let connecting = [
        IntegratorKind::Path,
        IntegratorKind::PathLight,
        IntegratorKind::Light,
        IntegratorKind::Hybrid,
        IntegratorKind::Bdpt,
    ];
    assert_radiance("sun through panes", &Scene::new(g, materials, &[sun], camera), &connecting, 2, 96, expected);
}

/// A closed furnace with panes and a ball in it that are there in part: every point of theirs is as bright as the
/// walls, so L = L_e Σ aᵏ still holds, path length by path length.
#[test]
fn panes_in_a_furnace_cannot_be_seen() {
    let albedo = 0.5_f64;
    let mut wall = Material::diffuse("wall", Rgb::splat(albedo as f32)).emitting(Rgb::ONE);
    wall.emission_sides = EmissionSides::Both;
    let materials = vec![wall.clone(), blend(wall, 0.4)];
    let mut g = Geometry::default();
    cube_inside(&mut g, 1.0, [0; 6]);
    quad(&mut g, [v(-0.8, -0.8, 0.1), v(0.8, -0.8, 0.3), v(0.8, 0.8, 0.1), v(-0.8, 0.8, 0.2)], 1);
    quad(&mut g, [v(-0.8, -0.8, 0.3), v(0.8, -0.8, 0.1), v(0.8, 0.8, 0.0), v(-0.8, 0.8, 0.3)], 1);
    g.add_sphere(v(0.2, -0.1, -0.3), 0.4, pathspace::scene::material::MaterialId(1));
    let camera = Camera::look_at(v(0.2, -0.1, 0.7), v(-0.3, 0.2, -1.0), Vec3::Y, 1.2, SENSOR);
    let scene = Scene::new(g, materials, &[], camera);
    for edges in 1..=4 {
        assert_radiance("furnace", &scene, &scenes::WEIGHTED, edges, 48, albedo.powi(edges as i32 - 1));
    }
}

/// A mask decides without chance: what it leaves is exactly the opaque surface, and what it takes away was never there.
#[test]
fn a_mask_leaves_all_or_nothing() {
    let sensor = scenes::square(24, Filter::Box);
    let room = |cards: [Option<Material>; 2]| {
        let mut materials = vec![
            Material::diffuse("white", Rgb::splat(0.7)),
            Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(5.0)),
        ];
        let mut g = Geometry::default();
        cube_inside(&mut g, 1.0, [0, 0, 0, 1, 0, 0]);
        for (card, z) in cards.into_iter().zip([-0.5, 0.2]) {
            if let Some(material) = card {
                let id = materials.len() as u32;
                quad(&mut g, [v(-0.7, -0.9, z), v(0.5, -0.9, z), v(0.5, 0.6, z + 0.1), v(-0.7, 0.6, z)], id);
                materials.push(material);
            }
        }
        let camera = Camera::look_at(v(0.2, -0.1, 0.95), v(0.0, 0.0, -1.0), Vec3::Y, 1.2, sensor);
        Scene::new(g, materials, &[Light::Environment { radiance: Rgb::ONE }], camera)
    };
    let grey = Material::diffuse("card", Rgb::splat(0.4));
    let reference = room([Some(grey.clone()), None]);
    let masked = room([Some(mask(grey.clone(), 0.5)), Some(mask(grey, 0.49))]);
    for integrator in scenes::WEIGHTED {
        let settings = Settings { integrator, max_depth: 6, ..Settings::new(sensor) };
        let [a, b] = [&reference, &masked].map(|scene| render(scene, &settings, 8, None));
        assert!(a.mean().min_element() > 0.1);
        assert!(a.pixels == b.pixels, "{integrator}");
    }
}

/// A room lit by a lamp behind a veil, with crossing veils in the middle, one before the camera, a lamp that is there
/// in part and a card with a mask.
fn cards() -> Scene {
    let glow = Material::diffuse("glow", Rgb::splat(0.5)).emitting(Rgb::new(1.0, 1.5, 2.0));
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.5, 0.52, 0.48)),
        blend(Material::diffuse("veil", Rgb::new(0.7, 0.5, 0.3)), 0.5),
        blend(glow, 0.6),
        Material::diffuse("lamp", Rgb::splat(0.2)).emitting(Rgb::splat(2.0)),
        mask(Material::diffuse("card", Rgb::new(0.3, 0.6, 0.3)), 0.9),
    ];
    let mut g = Geometry::default();
    cube_inside(&mut g, 1.0, [0, 0, 0, 3, 0, 0]);
    quad(&mut g, [v(-0.9, 0.7, -0.8), v(0.8, 0.7, -0.8), v(0.8, 0.7, 0.8), v(-0.9, 0.7, 0.8)], 1);
    quad(&mut g, [v(-0.7, -0.8, -0.6), v(0.6, -0.8, 0.0), v(0.6, 0.4, 0.0), v(-0.7, 0.4, -0.6)], 1);
    quad(&mut g, [v(-0.7, -0.8, 0.0), v(0.6, -0.8, -0.6), v(0.6, 0.4, -0.6), v(-0.7, 0.4, 0.0)], 1);
    quad(&mut g, [v(-0.9, -0.9, 0.2), v(0.9, -0.9, 0.2), v(0.9, 0.9, 0.2), v(-0.9, 0.9, 0.2)], 1);
    quad(&mut g, [v(-0.8, -0.5, -0.8), v(0.1, -0.5, -0.8), v(0.1, 0.3, -0.8), v(-0.8, 0.3, -0.8)], 2);
    quad(&mut g, [v(0.3, -0.9, -0.8), v(0.8, -0.9, -0.7), v(0.8, -0.2, -0.7), v(0.3, -0.2, -0.8)], 4);
    let camera = Camera::look_at(v(0.1, 0.0, 0.97), v(0.0, -0.1, -1.0), Vec3::Y, 1.1, scenes::square(32, Filter::Box));
    Scene::new(g, materials, &[], camera)
}

#[test]
fn integrators_agree_on_cards() {
    agreement("alpha-cards", &cards(), &ALL, Compared::All);
}

#[test]
fn any_number_of_threads_gives_the_same_veils() {
    let sensor = scenes::square(40, Filter::BlackmanHarris);
    let scene = scenes::veiled(sensor);
    let settings = Settings { filter: Filter::BlackmanHarris, ..Settings::new(sensor) };
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, &settings, 2, None))
    });
    assert!(one.pixels == three.pixels);
}
