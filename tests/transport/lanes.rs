//! Lanes: the same bytes for one path at a time and for waves of paths in eight lanes or sixteen.

use std::path::Path;

use glam::Vec3;
use pathspace::{
    film::{Crop, ExactSum, Half},
    integrator::{IntegratorKind, Weighting},
    math::Rgb,
    path::{LightPaths, Roulette, Strategy},
    render::{Renderer, Settings, Statistics, Width},
    sampling::{Filter, SamplerKind},
    scene::{
        Scene,
        bsdf::{Bsdf, Dielectric, Directions, MetallicRoughness, ThinDielectric},
        camera::{Camera, Sensor},
        geometry::Geometry,
        light::{Light, LightChoice},
        material::{EmissionSides, Material, MaterialId},
    },
};

use crate::{layered, lights, scenes};

/// Every sum of a film of three passes, with what was counted and whether by waves; `None` if the processor has no such
/// lanes.
fn film(scene: &Scene, settings: &Settings, width: Width) -> Option<(Vec<ExactSum>, Statistics, bool)> {
    let mut renderer = Renderer::new(scene, settings).with_width(width)?;
    (0..3).for_each(|_| renderer.pass());
    let film = renderer.film();
    let halves = [Half::Even, Half::Odd].into_iter();
    let pixels = halves.flat_map(|half| (0..film.pixels()).map(move |pixel| (half, pixel)));
    let sums = pixels.flat_map(|(half, pixel)| [0, 1, 2].map(|channel| film.sum(half, pixel, channel)));
    Some((sums.collect(), renderer.statistics(), renderer.makes_waves()))
}

/// Whether there are waves: films of one path at a time and of any lanes must be the same in any case.
fn widths_do_not_matter(name: &str, scene: &Scene, settings: &Settings) -> bool {
    let (sums, counts, waves) = film(scene, settings, Width::One).expect("one lane");
    assert!(!waves);
    let mut waves = false;
    for width in [Width::Eight, Width::Sixteen] {
        match film(scene, settings, width) {
            Some(film) => {
                assert!(film.0 == sums && film.1 == counts, "{name}, {}: {width:?} lanes", settings.integrator);
                waves = film.2;
            }
            None => eprintln!("SKIPPED: this processor has no {width:?} lanes"),
        }
    }
    waves
}

/// Holds films to each other that waves make, where the processor has lanes for them.
fn assert_waves_do_not_matter(name: &str, scene: &Scene, settings: &Settings) {
    let has_lanes = Renderer::new(scene, settings).with_width(Width::Eight).is_some();
    assert_eq!(widths_do_not_matter(name, scene, settings), has_lanes, "{name}, {}", settings.integrator);
}

/// Those that compute in waves what usual settings ask for.
const WAVES: [IntegratorKind; 6] = [
    IntegratorKind::Path,
    IntegratorKind::Light,
    IntegratorKind::Hybrid,
    IntegratorKind::Bdpt,
    IntegratorKind::BdptSds,
    IntegratorKind::Vcm,
];

/// Not a multiple of a tile, nor of a group of lanes.
const SENSOR: Sensor = Sensor { width: 45, height: 37, padding: 0 };

fn settings(integrator: IntegratorKind) -> Settings {
    let (roulette, weights) = (integrator.description().roulette, integrator.description().weights);
    Settings { integrator, sampler: SamplerKind::Sobol, roulette, weights, ..Settings::new(SENSOR) }
}

/// Without a volume, so that waves go everywhere: Lambertians, flat and smooth, a mirror, lamps of unlike sizes, of two
/// lights each, and perhaps a sky.
fn plain(sensor: Sensor, lamps: usize, sky: &[Light]) -> Scene {
    let mut two_sided = Material::diffuse("two-sided", Rgb::splat(0.4)).emitting(Rgb::new(1.0, 1.5, 2.0));
    two_sided.emission_sides = EmissionSides::Both;
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.7, 0.72, 0.68)),
        Material::mirror("mirror", Rgb::splat(0.9)),
        Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(2.0, 1.5, 1.0)),
        two_sided,
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(-1.0, -1.0, 1.0), v(1.0, -1.0, 1.0), v(1.0, -1.0, -1.0)], 0);
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(1.0, -1.0, -1.0), v(1.0, 0.6, -1.0), v(-1.0, 0.6, -1.0)], 0);
    for i in 0..lamps {
        let x = -0.9 + 1.8 * i as f32 / lamps as f32;
        let (half, material) = (0.02 + 0.1 * (i % 3) as f32, if i % 4 == 2 { 3 } else { 2 });
        let corner = |dx: f32, dz: f32| v(x + dx * half, 0.7, dz * half);
        scenes::quad(&mut g, [corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)], material);
    }
    let positions =
        [v(-0.9, -1.0, -0.9), v(-0.1, -1.0, -0.9), v(-0.1, -1.0, -0.1), v(-0.9, -1.0, -0.1), v(-0.5, -0.3, -0.5)];
    let normals = positions.map(|p| (p - v(-0.5, -1.4, -0.5)).normalize());
    g.add_triangles(&positions, Some(&normals), &[[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]], MaterialId(0));
    g.add_sphere(v(0.45, -0.6, -0.4), 0.4, MaterialId(1));
    // N_g has a zero with a sign, N_s has one without.
    let wall = [v(-1.0, -0.2, -1.0), v(-1.0, 0.6, -1.0), v(-1.0, -1.0, 1.0)];
    g.add_triangles(&wall, Some(&[Vec3::X; 3]), &[[0, 1, 2]], MaterialId(0));
    let camera = Camera::look_at(v(0.1, 0.2, 1.8), v(0.0, -0.4, -1.0), Vec3::Y, 0.9, sensor);
    Scene::new(g, materials, sky, camera)
}

/// An octahedron with the normals of a sphere, which no normal of a face comes near.
fn octahedron(g: &mut Geometry, center: Vec3, radius: f32, material: u32) {
    let normals = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let positions = normals.map(|n| center + n * radius);
    let face = |i: u32| {
        let [x, y, z] = [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2)];
        if i.count_ones().is_multiple_of(2) { [x, y, z] } else { [x, z, y] }
    };
    let faces: Vec<_> = (0..8).map(face).collect();
    g.add_triangles(&positions, Some(&normals), &faces, MaterialId(material));
}

/// Smooth glass and mirrors beside Lambertians: bodies one in another, about a Lambertian and of no other index than
/// what is around, flat and smooth, a lamp in one of them, and open sheets; `touching`, one with a face on the floor.
/// Mirrors glow, and so do glass `sheets`.
fn glassy(sensor: Sensor, eye: Vec3, touching: bool, sky: &[Light], sheets: Rgb) -> Scene {
    let mut bubble = Material::glass("bubble", 1.2);
    if let Bsdf::Dielectric(glass) = &mut bubble.bsdf {
        glass.color = Rgb::new(0.9, 0.7, 0.8);
    }
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.7, 0.72, 0.68)),
        Material::mirror("mirror", Rgb::new(0.9, 0.8, 0.6)).emitting(Rgb::new(0.1, 0.2, 0.1)),
        Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(2.0, 1.5, 1.0)),
        Material::glass("glass", 1.5),
        bubble,
        Material::glass("nothing", 1.0),
        Material::glass("sheet", 1.4).emitting(sheets),
        Material::glass("stand", 1.7),
        Material::pane("pane", 1.5),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(-1.0, -1.0, 1.0), v(1.0, -1.0, 1.0), v(1.0, -1.0, -1.0)], 0);
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(1.0, -1.0, -1.0), v(1.0, 0.6, -1.0), v(-1.0, 0.6, -1.0)], 0);
    scenes::quad(&mut g, [v(-0.4, 0.7, -0.4), v(0.4, 0.7, -0.4), v(0.4, 0.7, 0.4), v(-0.4, 0.7, 0.4)], 2);
    scenes::quad(&mut g, [v(-1.0, -0.9, 0.3), v(-0.4, -0.9, 0.2), v(-0.4, 0.3, 0.2), v(-1.0, 0.3, 0.3)], 6);
    scenes::quad(&mut g, [v(-0.9, -0.5, 0.7), v(0.0, -0.5, 0.6), v(0.0, 0.4, 0.6), v(-0.9, 0.4, 0.7)], 8);
    octahedron(&mut g, v(-0.1, -0.2, -0.2), 0.6, 3);
    octahedron(&mut g, v(-0.1, -0.2, -0.2), 0.35, 4);
    octahedron(&mut g, v(-0.1, -0.25, -0.2), 0.15, 0);
    scenes::quad(
        &mut g,
        [v(-0.15, -0.02, -0.25), v(-0.05, -0.02, -0.25), v(-0.05, -0.02, -0.15), v(-0.15, -0.02, -0.15)],
        2,
    );
    octahedron(&mut g, v(0.1, -0.1, 0.1), 0.3, 5);
    octahedron(&mut g, v(0.7, -0.5, -0.6), 0.4, 1);
    let bottom = if touching { -1.0 } else { -0.99 };
    let corner = |i: usize| v([0.3, 0.7][i & 1], [bottom, -0.7][i >> 1 & 1], [-0.1, 0.3][i >> 2]);
    for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        scenes::quad(&mut g, face.map(corner), 7);
    }
    let camera = Camera::look_at(eye, v(0.0, -0.3, -1.0), Vec3::Y, 0.9, sensor);
    Scene::new(g, materials, sky, camera)
}

fn sky() -> [Light; 1] {
    [Light::Environment { radiance: Rgb::new(0.2, 0.3, 0.5) }]
}

#[test]
fn any_number_of_lanes_gives_the_same_bytes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = std::fs::read_dir(folder).expect("the scenes").map(|entry| entry.expect("an entry").path());
    let files: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "glb")).collect();
    assert!(files.len() > 10);
    let mut waves = 0;
    for file in files {
        let scene = scenes::load_file(&file, SENSOR);
        for integrator in IntegratorKind::ALL {
            let name = file.display().to_string();
            waves += u32::from(widths_do_not_matter(&name, &scene, &settings(integrator)));
        }
    }
    println!("{waves} films were made by waves");
}

#[test]
fn lamps_with_profiles() {
    let scene = lights::corner(SENSOR);
    for kind in [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt] {
        assert_waves_do_not_matter("corner", &scene, &settings(kind));
    }
}

#[test]
fn whatever_is_in_the_scene() {
    let sun = Light::Directional { towards: Vec3::new(0.3, 1.0, 0.4).normalize(), irradiance: Rgb::splat(2.0) };
    let lamp = Light::Point { position: Vec3::new(0.5, 1.5, 0.5), intensity: Rgb::splat(3.0) };
    let lights = [sun, lamp]; // and the courtyard's sky
    let all = [
        ("zoo", scenes::zoo(SENSOR)),
        ("open zoo", scenes::open_zoo(SENSOR)),
        ("veiled", scenes::veiled(SENSOR)),
        ("courtyard", scenes::courtyard(&lights, SENSOR)),
        ("courtyard by tree", scenes::courtyard(&lights, SENSOR).choosing_lights(LightChoice::Tree)),
        ("courtyard, each light", scenes::courtyard(&lights, SENSOR).choosing_lights(LightChoice::All)),
        ("sphere furnace", scenes::sphere_furnace(0.7, 1.0, SENSOR)),
    ];
    for (name, scene) in &all {
        for integrator in IntegratorKind::ALL {
            let waves = widths_do_not_matter(name, scene, &settings(integrator));
            println!("{name}, {integrator}: {}", if waves { "waves" } else { "path by path" });
            let plain = name.starts_with("courtyard") || *name == "sphere furnace";
            let has_lanes = Renderer::new(scene, &settings(integrator)).with_width(Width::Eight).is_some();
            assert!(waves || !has_lanes || !plain || !WAVES.contains(&integrator), "{name}, {integrator}");
        }
    }
    let choices = [LightChoice::Power, LightChoice::Uniform, LightChoice::Tree, LightChoice::All];
    for choice in choices {
        // As many lights as a register has, one pair more, and none.
        for (name, lamps) in [("three lamps", 3), ("sixteen lights", 8), ("eighteen lights", 9), ("a sky alone", 0)] {
            for sky in [&sky()[..], &[]] {
                let scene = plain(SENSOR, lamps, sky).choosing_lights(choice);
                let many = choice == LightChoice::All && 2 * lamps + sky.len() > 16;
                for integrator in WAVES {
                    if many || (lamps == 0 && sky.is_empty()) {
                        widths_do_not_matter(name, &scene, &settings(integrator));
                    } else {
                        assert_waves_do_not_matter(name, &scene, &settings(integrator));
                    }
                }
            }
        }
    }
}

#[test]
fn smooth_glass_and_mirrors() {
    let (outside, inside) = (Vec3::new(0.1, 0.2, 1.8), Vec3::new(-0.1, -0.1, 0.05));
    for (name, eye, touching, sky) in [
        ("outside", outside, false, &[][..]),
        ("outside, under a sky", outside, false, &sky()),
        ("inside", inside, false, &sky()),
        ("touching", outside, true, &[]),
    ] {
        // Glass that glows in a scene with bodies in bodies is no light of few plain ones.
        for (choice, sheets) in [(LightChoice::Power, Rgb::ZERO), (LightChoice::Tree, Rgb::new(0.1, 0.0, 0.3))] {
            let scene = glassy(SENSOR, eye, touching, sky, sheets).choosing_lights(choice);
            for integrator in WAVES.into_iter().chain([IntegratorKind::PathHemisphere]) {
                for roulette in [Roulette::FromDepth(3), Roulette::ByThroughput(2)] {
                    let settings = Settings { roulette, max_depth: 9, ..settings(integrator) };
                    assert_waves_do_not_matter(name, &scene, &settings);
                }
            }
        }
    }
}

/// Rough surfaces of all kinds in one scene, so that groups of lanes are of several: flat and smooth, as lights, as a
/// body with another in it, mixed with smooth ones, on triangles of the world and not.
fn rough(sensor: Sensor, sky: &[Light]) -> Scene {
    let metallic = |name: &str, metallic, alpha: f32, f0, f90| {
        let base_color = Rgb::new(0.9, 0.6, 0.3);
        let (dielectric_f0, dielectric_f90) = (f0, f90);
        let bsdf = MetallicRoughness { base_color, metallic, alpha, dielectric_f0, dielectric_f90 };
        Material::new(name, Bsdf::MetallicRoughness(bsdf))
    };
    let glass = |color, ior, alpha, transmission| {
        Material::new("glass", Bsdf::Dielectric(Dielectric { color, ior, alpha, transmission }))
    };
    let pane = |alpha, transmission| {
        let (color, ior) = (Rgb::new(0.7, 0.8, 0.9), 1.5);
        Material::new("pane", Bsdf::Thin(ThinDielectric { color, ior, alpha, transmission }))
    };
    let tinted = Rgb::new(0.1, 0.05, 0.02);
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.7, 0.72, 0.68)),
        Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(2.0, 1.5, 1.0)),
        metallic("plastic", 0.0, 0.3, Rgb::splat(0.04), 1.0),
        metallic("metal", 1.0, 0.1, Rgb::splat(0.04), 1.0).emitting(Rgb::new(0.1, 0.2, 0.1)),
        metallic("varnish", 0.3, 0.0, tinted, 0.8),
        metallic("satin", 0.6, 0.8, tinted, 0.5),
        glass(Rgb::new(0.9, 0.7, 0.8), 1.5, 0.2, 1.0),
        glass(Rgb::ONE, 1.3, 0.5, 0.6),
        pane(0.3, 1.0),
        pane(0.0, 0.5),
        Material::mirror("mirror", Rgb::splat(0.9)),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(-1.0, -1.0, 1.0), v(1.0, -1.0, 1.0), v(1.0, -1.0, -1.0)], 2);
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(1.0, -1.0, -1.0), v(1.0, 0.6, -1.0), v(-1.0, 0.6, -1.0)], 5);
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(-1.0, 0.6, -1.0), v(-1.0, 0.6, 1.0), v(-1.0, -1.0, 1.0)], 4);
    scenes::quad(&mut g, [v(1.0, -1.0, -1.0), v(1.0, -1.0, 1.0), v(1.0, 0.6, 1.0), v(1.0, 0.6, -1.0)], 0);
    scenes::quad(&mut g, [v(-0.4, 0.7, -0.4), v(0.4, 0.7, -0.4), v(0.4, 0.7, 0.4), v(-0.4, 0.7, 0.4)], 1);
    scenes::quad(&mut g, [v(-0.9, -0.9, 0.4), v(-0.3, -0.9, 0.3), v(-0.3, -0.1, 0.3), v(-0.9, -0.1, 0.4)], 8);
    scenes::quad(&mut g, [v(0.3, -0.9, 0.4), v(0.8, -0.9, 0.5), v(0.8, -0.2, 0.5), v(0.3, -0.2, 0.4)], 9);
    octahedron(&mut g, v(-0.5, -0.6, -0.4), 0.35, 3);
    octahedron(&mut g, v(0.0, -0.3, -0.1), 0.45, 6);
    octahedron(&mut g, v(0.0, -0.3, -0.1), 0.25, 7);
    g.add_sphere(v(0.6, -0.7, -0.5), 0.3, MaterialId(5));
    g.add_sphere(v(0.5, -0.1, -0.6), 0.2, MaterialId(7));
    g.add_sphere(v(-0.6, 0.1, -0.6), 0.2, MaterialId(10));
    let camera = Camera::look_at(v(0.1, 0.2, 1.8), v(0.0, -0.4, -1.0), Vec3::Y, 0.9, sensor);
    Scene::new(g, materials, sky, camera)
}

#[test]
fn rough_surfaces() {
    for sky in [&sky()[..], &[]] {
        for choice in [LightChoice::Power, LightChoice::Tree] {
            let scene = rough(SENSOR, sky).choosing_lights(choice);
            for integrator in WAVES.into_iter().chain([IntegratorKind::PathHemisphere]) {
                for hemisphere in Directions::ALL {
                    assert_waves_do_not_matter("rough", &scene, &Settings { hemisphere, ..settings(integrator) });
                }
            }
        }
    }
}

#[test]
fn layers_and_a_lamp_under_a_coat() {
    let scene = layered::room(SENSOR);
    for integrator in WAVES {
        assert_waves_do_not_matter("layers", &scene, &settings(integrator));
    }
}

/// Where glass goes in lanes, bodies keep apart; what a walk is in matters to those that do not go in lanes.
#[test]
fn a_camera_in_one_of_two_bodies() {
    let mut rough = Material::glass("rough", 1.7);
    if let Bsdf::Dielectric(glass) = &mut rough.bsdf {
        glass.alpha = 0.2;
    }
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.7, 0.72, 0.68)),
        Material::glass("smooth", 1.3),
        rough,
        Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(2.0, 1.5, 1.0)),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(-1.0, -1.0, 1.0), v(1.0, -1.0, 1.0), v(1.0, -1.0, -1.0)], 0);
    scenes::quad(&mut g, [v(-0.4, 0.7, -0.4), v(0.4, 0.7, -0.4), v(0.4, 0.7, 0.4), v(-0.4, 0.7, 0.4)], 3);
    let eye = v(0.0, 0.1, 1.6);
    octahedron(&mut g, eye, 0.4, 1);
    octahedron(&mut g, v(0.1, -0.2, -0.2), 0.6, 2);
    let camera = Camera::look_at(eye, v(0.0, -0.3, -1.0), Vec3::Y, 0.9, SENSOR);
    let scene = Scene::new(g, materials, &[], camera);
    for integrator in WAVES {
        assert_waves_do_not_matter("apart", &scene, &settings(integrator));
    }
}

#[test]
fn a_table_that_weighs_by_more_than_it_evaluates() {
    let scene = plain(SENSOR, 3, &[]);
    for integrator in WAVES {
        for (s, t) in [(0, 3), (1, 2), (1, 3), (1, 4), (2, 1), (3, 1), (2, 2), (3, 3), (4, 2)] {
            for weighting in [Weighting::Weighted, Weighting::Unweighted] {
                let only = Some((Strategy { s, t }, weighting));
                let settings = Settings { only, ..settings(integrator) };
                widths_do_not_matter(&format!("({s},{t}) {weighting:?}"), &scene, &settings);
            }
        }
    }
}

#[test]
fn threads_that_wait_for_each_other() {
    // Enough triangles for what waves load to be divided among threads.
    let scene = scenes::load_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/caustic-sphere.glb"), SENSOR);
    // And one, which goes from tile to tile with what the tile before has left.
    for threads in [16, 1] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for integrator in WAVES {
            pool.install(|| assert_waves_do_not_matter("threads", &scene, &settings(integrator)));
        }
    }
}

#[test]
fn a_lamp_in_the_plane_of_the_ceiling() {
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.7, 0.72, 0.68)),
        Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(2.0, 1.5, 1.0)),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    let ceiling = |h: f32, y: f32| [v(-h, y, -h), v(h, y, -h), v(h, y, h), v(-h, y, h)];
    scenes::quad(&mut g, [v(-1.0, -1.0, -1.0), v(-1.0, -1.0, 1.0), v(1.0, -1.0, 1.0), v(1.0, -1.0, -1.0)], 0);
    // The ceiling is so large that its roundings take it below the lamp, which comes first all the same.
    scenes::quad(&mut g, ceiling(50.0, 0.699_996), 0);
    scenes::quad(&mut g, ceiling(0.3, 0.7), 1);
    let camera = Camera::look_at(v(0.1, 0.0, 2.8), v(0.0, -0.1, -1.0), Vec3::Y, 0.9, SENSOR);
    let scene = Scene::new(g, materials, &[], camera);
    for integrator in WAVES {
        assert_waves_do_not_matter("flush", &scene, &settings(integrator));
    }
}

/// So wide that tiles have factors of their own, after those beside them have been added: dark ones and lit ones.
#[test]
fn factors_of_the_place_on_the_image() {
    let sensor = Sensor { width: 200, height: 16, padding: 0 };
    let scene = scenes::load("cornell-box", sensor);
    for integrator in [IntegratorKind::Hybrid, IntegratorKind::Bdpt, IntegratorKind::Vcm] {
        let weights = integrator.description().weights;
        let settings = Settings { integrator, sampler: SamplerKind::Sobol, weights, ..Settings::new(sensor) };
        assert_waves_do_not_matter("wide", &scene, &settings);
    }
}

#[test]
fn whatever_the_render_is_asked_for() {
    let filter = Filter::BlackmanHarris;
    let padded = Sensor { padding: filter.padding(), ..SENSOR };
    let scene = plain(padded, 3, &sky());
    let crop = Crop { x0: 9, y0: 17, x1: 30, y1: 37 };
    for (integrator, sampler) in [
        (IntegratorKind::Path, SamplerKind::Sobol),
        (IntegratorKind::PathHemisphere, SamplerKind::Sobol),
        (IntegratorKind::Light, SamplerKind::Sobol),
        (IntegratorKind::Light, SamplerKind::Independent),
        (IntegratorKind::Hybrid, SamplerKind::Sobol),
        (IntegratorKind::Bdpt, SamplerKind::Sobol),
        (IntegratorKind::BdptSds, SamplerKind::Sobol),
        (IntegratorKind::Vcm, SamplerKind::Sobol),
    ] {
        let plain = Settings { integrator, sampler, filter, ..Settings::new(padded) };
        for settings in [
            plain.clone(),
            Settings { crop, ..plain.clone() },
            Settings { light_samples: 3, ..plain.clone() },
            Settings { light_paths: LightPaths::one_in(2), ..plain.clone() },
            Settings { light_paths: LightPaths::one_in(5), crop, ..plain.clone() },
            Settings { max_depth: 3, min_depth: 2, clamp: Some(0.5), ..plain.clone() },
            Settings { max_depth: 1, ..plain.clone() },
            Settings { max_depth: 2, filter: Filter::Box, ..plain.clone() },
            Settings { roulette: Roulette::ByThroughput(2), ..plain.clone() },
            Settings { hemisphere: Directions::Uniform, seed: 9, ..plain.clone() },
        ] {
            if settings.max_depth == 1 {
                widths_do_not_matter("one edge", &scene, &settings);
            } else {
                assert_waves_do_not_matter("plain", &scene, &settings);
            }
        }
    }
}
