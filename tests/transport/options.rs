//! Options that change how an image is estimated and not what it is: choices among lights, splitting, roulette.

use glam::{DQuat, DVec3, Vec3};
use pathspace::{
    film::Crop,
    integrator::{Integrator, IntegratorKind, RelativeRoulette},
    math::Rgb,
    path::{JoinedPath, LightPaths, Roulette},
    render::{Renderer, Settings},
    sampling::{Filter, SamplerKind},
    scene::{
        Scene,
        geometry::Geometry,
        light::LightChoice,
        material::{Material, MaterialId},
    },
};

use crate::{
    agreement::{Run, VISIBLE, assert_agree, settings, with_the_first},
    closed_forms::receiver::Receiver,
    identity, scenes,
};

/// What differs between two estimates of one image.
pub struct Variant<'a> {
    name: &'a str,
    scene: &'a Scene,
    settings: Vec<Settings>,
}

impl<'a> Variant<'a> {
    pub fn new(name: &'a str, scene: &'a Scene, kind: IntegratorKind, change: impl Fn(&mut Settings)) -> Self {
        // Seeds of their own for each.
        let salt = 20 + name.bytes().map(u64::from).sum::<u64>();
        let mut settings = settings(scene, kind, salt);
        settings.iter_mut().for_each(change);
        Self { name, scene, settings }
    }
}

/// Compares each of the others with the first.
pub fn assert_same_image(scene: &str, variants: &[Variant]) {
    let everything = |_: &JoinedPath| true;
    let mut runs: Vec<_> = variants.iter().map(|v| Run::new(v.scene, &v.settings, v.name, &everything)).collect();
    assert_agree(scene, VISIBLE, &mut runs, &with_the_first(variants.len()));
}

/// A courtyard with a lamp, a point, a sun and a sky.
pub fn courtyard() -> Scene {
    let others = [
        pathspace::scene::light::Light::Point {
            position: Vec3::new(0.3, 0.4, 0.5),
            intensity: Rgb::new(0.4, 0.5, 0.6),
        },
        pathspace::scene::light::Light::Directional {
            towards: Vec3::new(0.3, 0.8, 0.4).normalize(),
            irradiance: Rgb::splat(1.0),
        },
    ];
    scenes::courtyard(&others, scenes::square(16, Filter::Box))
}

#[test]
fn choices_among_lights_change_no_image() {
    let by = LightChoice::ALL.map(|choice| courtyard().choosing_lights(choice));
    for kind in [IntegratorKind::Path, IntegratorKind::PathLight, IntegratorKind::Bdpt] {
        let variants: Vec<_> = (LightChoice::ALL.iter().zip(&by))
            .map(|(choice, scene)| Variant::new(choice.name(), scene, kind, |_| ()))
            .collect();
        assert_same_image(&format!("courtyard-{kind}-lights"), &variants);
    }
}

#[test]
fn every_path_is_as_defined_by_every_choice_among_lights() {
    let kinds = [
        IntegratorKind::Path,
        IntegratorKind::PathLight,
        IntegratorKind::Hybrid,
        IntegratorKind::Bdpt,
        IntegratorKind::Vcm,
    ];
    for choice in [LightChoice::All, LightChoice::Uniform, LightChoice::Tree] {
        let scene = scenes::zoo(scenes::square(32, Filter::BlackmanHarris)).choosing_lights(choice);
        identity::assert_identity_by(&kinds, &format!("zoo {choice}"), &scene, 2);
        let scene = scenes::load("many-lights", scenes::square(16, Filter::Box));
        if choice != LightChoice::All {
            identity::assert_identity_by(&kinds, "many lights", &scene.choosing_lights(choice), 4);
        }
    }
    let islands = scenes::zoo(scenes::square(32, Filter::Box)).choosing_lights(LightChoice::Uniform);
    identity::assert_identity_by(&[IntegratorKind::Area], "zoo area uniform", &islands, 2);
}

#[test]
fn every_path_is_as_defined_where_paths_split() {
    let scene = scenes::zoo(scenes::square(32, Filter::BlackmanHarris));
    for kind in [IntegratorKind::Path, IntegratorKind::PathHemisphere, IntegratorKind::Hybrid, IntegratorKind::Bdpt] {
        for roulette in [Roulette::FromDepth(3), Roulette::ByThroughput(1)] {
            let integrator = Integrator::new(kind, scene.camera.sensor(), 7, roulette).with_splits(3);
            identity::assert_identity_of(&format!("zoo {kind} in three parts"), &scene, integrator, 3);
        }
    }
}

#[test]
fn split_paths_change_no_image() {
    let scene = courtyard();
    for kind in [IntegratorKind::Path, IntegratorKind::Bdpt] {
        let split = |settings: &mut Settings| settings.splits = 4;
        let both = |settings: &mut Settings| (settings.splits, settings.light_samples) = (3, 2);
        let variants = [
            Variant::new("one", &scene, kind, |_| ()),
            Variant::new("four parts", &scene, kind, split),
            Variant::new("three parts and two samples", &scene, kind, both),
        ];
        assert_same_image(&format!("courtyard-{kind}-splits"), &variants);
    }
}

#[test]
fn every_path_is_as_defined_with_several_light_paths() {
    let scene = scenes::zoo(scenes::square(32, Filter::BlackmanHarris));
    for kind in [IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt] {
        let integrator = Integrator::new(kind, scene.camera.sensor(), 7, Roulette::FromDepth(3));
        for paths in [LightPaths::each(3), LightPaths::one_in(3)] {
            let integrator = integrator.clone().with_light_paths(paths).with_splits(2);
            identity::assert_identity_of(&format!("zoo {kind} with {paths} light paths"), &scene, integrator, 2);
        }
    }
}

#[test]
fn several_light_paths_change_no_image() {
    let scene = courtyard();
    for kind in [IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt] {
        let three = |settings: &mut Settings| settings.light_paths = LightPaths::each(3);
        let both = |settings: &mut Settings| (settings.splits, settings.light_paths) = (2, LightPaths::each(2));
        let few = |samples| move |settings: &mut Settings| settings.light_paths = LightPaths::one_in(samples);
        let mut variants = vec![
            Variant::new("one", &scene, kind, |_| ()),
            Variant::new("three", &scene, kind, three),
            Variant::new("one in two", &scene, kind, few(2)),
            Variant::new("one in five", &scene, kind, few(5)),
        ];
        if kind != IntegratorKind::Light {
            variants.push(Variant::new("two and two parts", &scene, kind, both));
        }
        assert_same_image(&format!("courtyard-{kind}-light-paths"), &variants);
    }
}

#[test]
fn every_path_is_as_defined_with_chosen_light_vertices() {
    let scene = scenes::zoo(scenes::square(32, Filter::BlackmanHarris));
    let integrator = Integrator::new(IntegratorKind::Bdpt, scene.camera.sensor(), 7, Roulette::FromDepth(3));
    let integrator = integrator.with_splits(2).with_light_vertices(&scene, 3);
    identity::assert_identity_of("zoo bdpt with three light vertices", &scene, integrator, 2);
}

#[test]
fn chosen_light_vertices_change_no_image() {
    let (courtyard, zoo) = (courtyard(), scenes::zoo(scenes::square(16, Filter::Box)));
    let choose = |each: u32| move |settings: &mut Settings| settings.light_vertices = Some(each);
    let with_all = |settings: &mut Settings| {
        (settings.light_vertices, settings.light_paths, settings.splits) = (Some(2), LightPaths::each(2), 2);
        settings.connection_roulette = Some(RelativeRoulette { threshold: 0.5, end: 0.5 });
    };
    let variants = [
        Variant::new("its own", &courtyard, IntegratorKind::Bdpt, |_| ()),
        Variant::new("one", &courtyard, IntegratorKind::Bdpt, choose(1)),
        Variant::new("with all else", &courtyard, IntegratorKind::Bdpt, with_all),
    ];
    assert_same_image("courtyard-light-vertices", &variants);
    let variants = [
        Variant::new("its own", &zoo, IntegratorKind::Bdpt, |_| ()),
        Variant::new("four", &zoo, IntegratorKind::Bdpt, choose(4)),
    ];
    assert_same_image("zoo-light-vertices", &variants);
}

/// A crop shows what the whole image shows there, though its tiles share light vertices with what lies outside.
#[test]
fn chosen_light_vertices_are_the_same_in_a_crop() {
    let scene = scenes::zoo(scenes::square(32, Filter::Box));
    let sensor = scene.camera.sensor();
    let crop = Crop { x0: 5, y0: 3, x1: 21, y1: 11 };
    let image = |integrator, crop| {
        let settings = Settings { integrator, light_vertices: Some(2), max_depth: 5, crop, ..Settings::new(sensor) };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..2).for_each(|_| renderer.pass());
        renderer.film().image(2)
    };
    // The other one has light vertices for merges, too, of the whole image.
    for integrator in [IntegratorKind::Bdpt, IntegratorKind::BdptSds] {
        let (whole, part) = (image(integrator, Crop::full(sensor)), image(integrator, crop));
        for y in crop.y0..crop.y1 {
            for x in crop.x0..crop.x1 {
                let at = ((y - crop.y0) * (crop.x1 - crop.x0) + x - crop.x0) as usize;
                let there = whole.pixels[(y * sensor.width + x) as usize];
                assert_eq!(part.pixels[at], there, "pixel {x} {y} by {integrator}");
            }
        }
    }
}

/// With one camera ray a pixel, N parts bring the noise of direct light by directions down by N.
#[test]
fn parts_are_independent_samples() {
    let scene = courtyard();
    let variance = |splits: u32| {
        let settings = Settings {
            integrator: IntegratorKind::PathHemisphere,
            max_depth: 2,
            min_depth: 2,
            splits,
            ..Settings::new(scene.camera.sensor())
        };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..512).for_each(|_| renderer.pass());
        renderer.film().noise(512).expect("two halves")
    };
    let (one, many) = (variance(1), variance(64));
    println!("noise {one:.2e} of one direction, {many:.2e} of 64");
    // Edges within a pixel, which the parts share, have a part in it.
    assert!(one / many > 8.0, "{one} {many}");
}

#[test]
fn roulette_by_throughput_changes_no_image() {
    let (courtyard, zoo) = (courtyard(), scenes::furnace(0.6, 1.0, scenes::square(8, Filter::Box)));
    for (name, scene) in [("courtyard", &courtyard), ("furnace", &zoo)] {
        for kind in [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Bdpt] {
            let variants = [
                Variant::new("off", scene, kind, |settings| settings.roulette = Roulette::Off),
                Variant::new("throughput", scene, kind, |settings| settings.roulette = Roulette::ByThroughput(1)),
            ];
            assert_same_image(&format!("{name}-{kind}-roulette"), &variants);
        }
    }
}

#[test]
fn roulette_on_connections_changes_no_image() {
    let scene = courtyard();
    for kind in [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt] {
        let half = |settings: &mut Settings| {
            settings.connection_roulette = Some(RelativeRoulette { threshold: 1.0, end: 0.5 });
        };
        let variants = [Variant::new("every ray", &scene, kind, |_| ()), Variant::new("half", &scene, kind, half)];
        assert_same_image(&format!("courtyard-{kind}-tentative"), &variants);
        let settings = Settings {
            integrator: kind,
            connection_roulette: Some(RelativeRoulette { threshold: 1e9, end: 0.75 }),
            ..Settings::new(scene.camera.sensor())
        };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..16).for_each(|_| renderer.pass());
        let statistics = renderer.statistics();
        let spared = statistics.spared as f64 / (statistics.spared + statistics.rays.visibility) as f64;
        assert!((spared - 0.75).abs() < 0.02, "{kind}: {spared}");
    }
}

/// The tree is there to lower the noise of many lights.
#[test]
fn the_tree_lowers_the_noise_of_many_lights() {
    let noise = |choice| {
        let scene = scenes::load("many-lights", scenes::square(32, Filter::Box)).choosing_lights(choice);
        let settings = Settings {
            integrator: IntegratorKind::PathLight,
            max_depth: 2,
            min_depth: 2,
            ..Settings::new(scene.camera.sensor())
        };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..64).for_each(|_| renderer.pass());
        renderer.film().noise(64).expect("two halves")
    };
    let [uniform, power, tree] = [LightChoice::Uniform, LightChoice::Power, LightChoice::Tree].map(noise);
    println!("noise {uniform:.2e} uniformly, {power:.2e} by power, {tree:.2e} by the tree");
    assert!(tree < 0.4 * power && tree < 0.4 * uniform, "{uniform} {power} {tree}");
}

/// 150 bright triangles that shine away to each lamp above a square. A lamp's probability is less than 2⁻²⁴, and the
/// lamps stand where numbers of 24 bits, or of 23, choose none of them.
#[test]
fn lamps_in_a_crowd_light_what_is_below_them() {
    const SIDE: u32 = 64;
    const RADIANCE: f32 = 1e3;
    let receiver = Receiver::new(DVec3::ZERO, DQuat::IDENTITY, 1.0);
    let mut geometry = Geometry::default();
    receiver.add(&mut geometry, 0);
    // A power of two, as are all places, so that the areas are the same to the last bit.
    let size = 2.0_f32.powi(-13);
    let mut add = |count: u32, at: &dyn Fn(u32) -> Vec3, material| {
        // Facing down.
        let corners: Vec<_> =
            (0..count).flat_map(|i| [Vec3::ZERO, Vec3::X, Vec3::Z].map(|d| at(i) + size * d)).collect();
        let triangles: Vec<_> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        geometry.add_triangles(&corners, None, &triangles, MaterialId(material));
    };
    let place = |lamp: u32| Vec3::new((lamp % SIDE) as f32, 0.0, (lamp / SIDE) as f32) / SIDE as f32 - 0.5;
    for lamp in 0..SIDE * SIDE {
        let crowd = |i: u32| place(lamp) - Vec3::Y * (4.0 + 1e-3 * i as f32);
        add(20, &crowd, 1);
        add(1, &|_| place(lamp) + Vec3::Y, 2);
        add(130, &crowd, 1);
    }
    let lamp = |radiance| Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(radiance));
    let materials = vec![Receiver::material(), lamp(65.0 * RADIANCE), lamp(RADIANCE)];
    let camera = receiver.pinhole(2.0, scenes::square(32, Filter::Box));
    let sensor = camera.sensor();
    let mut scene = Scene::new(geometry, materials, &[], camera);
    let irradiance = |p: DVec3| {
        let of = |l: u32| {
            let d = place(l).as_dvec3() + DVec3::Y - p;
            d.y * d.y / d.length_squared().powi(2)
        };
        (0..SIDE * SIDE).map(of).sum::<f64>() * 0.5 * f64::from(size * size * RADIANCE)
    };
    let fine = 24;
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(fine);
    let sum: f64 = (0..fine * fine).map(|i| irradiance(receiver.at(at(i % fine), at(i / fine)))).sum();
    let expected = Receiver::ALBEDO / std::f64::consts::PI * sum / f64::from(fine * fine);

    use SamplerKind::{Independent, Sobol};
    for (choice, integrator, sampler, passes, tolerance) in [
        (LightChoice::Power, IntegratorKind::Light, Independent, 512, 0.5),
        (LightChoice::Power, IntegratorKind::Path, Sobol, 512, 0.4),
        (LightChoice::Power, IntegratorKind::Bdpt, Sobol, 512, 0.4),
        (LightChoice::Tree, IntegratorKind::Path, Sobol, 32, 0.02),
        (LightChoice::Tree, IntegratorKind::Bdpt, Independent, 32, 0.02),
    ] {
        scene = scene.choosing_lights(choice);
        let settings = Settings { integrator, sampler, max_depth: 2, ..Settings::new(sensor) };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..passes).for_each(|_| renderer.pass());
        let pixels = renderer.film().image(passes).pixels;
        let found = pixels.iter().map(|p| f64::from(p.r())).sum::<f64>() / pixels.len() as f64;
        println!("{integrator}, lights by {choice}: {found:.4e} for {expected:.4e}");
        assert!((found / expected - 1.0).abs() < tolerance, "{integrator} {choice}: {found} for {expected}");
    }
}
