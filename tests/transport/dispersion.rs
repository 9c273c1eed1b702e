//! Dispersion: one wavelength for all subpaths that can be joined, and the colour of each for the paths that it bends.

use std::{collections::BTreeMap, f64::consts::PI, sync::Mutex};

use glam::{DVec2, DVec3, Vec3};
use pathspace::{
    film::Image,
    integrator::{
        Integrator,
        IntegratorKind::{self, Area, Bdpt, BdptSds, Hybrid, Light as LightTracing, Path, Vcm},
    },
    math::Rgb,
    path::{Densities, JoinedPath, Technique},
    render::{Collector, Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, Dielectric},
        camera::{Camera, Sensor},
        geometry::Geometry,
        light::{Light, Spot},
        material::{Material, MaterialId},
        wavelength::Wavelength,
    },
};

use crate::{
    agreement::{self, Run},
    identity, scenes, shards,
};

/// Abbe's number of what disperses here: 10, about that of rutile.
const DISPERSION: f32 = 2.0;

fn glass(ior: f32) -> Material {
    Material { dispersion: DISPERSION, ..Material::glass("flint", ior) }
}

fn frosted(alpha: f32) -> Material {
    let rough = Dielectric { color: Rgb::new(0.95, 1.0, 0.9), ior: 1.6, alpha, transmission: 0.8 };
    let absorption = Rgb::new(0.2, 0.1, 0.4);
    Material { dispersion: DISPERSION, absorption, ..Material::new("frosted flint", Bsdf::Dielectric(rough)) }
}

/// Two balls on a floor under a wide lamp, of which one is frosted and the other has a ball of other glass in it.
fn balls(sensor: Sensor) -> Scene {
    let materials = vec![
        Material::diffuse("floor", Rgb::new(0.6, 0.55, 0.5)),
        glass(1.5),
        frosted(0.2),
        Material::glass("crown", 1.3),
        Material::diffuse("lamp", Rgb::splat(0.2)).emitting(Rgb::new(4.0, 3.5, 3.0)),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    scenes::quad(&mut g, [v(-1.2, 0., -1.2), v(-1.2, 0., 1.2), v(1.2, 0., 1.2), v(1.2, 0., -1.2)], 0);
    scenes::quad(&mut g, [v(-0.8, 1.6, -0.8), v(0.8, 1.6, -0.8), v(0.8, 1.6, 0.8), v(-0.8, 1.6, 0.8)], 4);
    g.add_sphere(v(-0.4, 0.5, 0.0), 0.35, MaterialId(1));
    g.add_sphere(v(-0.45, 0.5, 0.05), 0.15, MaterialId(3));
    g.add_sphere(v(0.5, 0.45, 0.1), 0.3, MaterialId(2));
    let camera = Camera::look_at(v(0.1, 1.1, 2.6), v(0.0, 0.35, 0.0), Vec3::Y, 0.75, sensor);
    Scene::new(g, materials, &[], camera)
}

#[test]
fn every_dispersed_path_is_as_defined() {
    let scene = balls(scenes::square(24, Filter::BlackmanHarris));
    let kinds = [Path, LightTracing, Hybrid, Bdpt, Vcm, Area];
    identity::assert_identity_by(&kinds, "dispersion", &scene, 3);
}

/// A path is dispersed by any vertex on the interface, whether it reflects or refracts there, and by nothing else.
#[test]
fn a_dispersed_path_has_the_colour_of_its_wavelength() {
    let scene = balls(scenes::square(16, Filter::Box));
    let settings = Settings { integrator: Bdpt, max_depth: 6, ..Settings::new(scene.camera.sensor()) };
    // By whether the interface reflects, whether it transmits, and whether the colour is there.
    let seen = Mutex::new(BTreeMap::<[bool; 3], u32>::new());
    let mut renderer = Renderer::new(&scene, &settings);
    for _ in 0..8 {
        renderer.pass_where(&|path| {
            let name = |i: u32| scene.material(path.point(i).material).name.contains("flint");
            let at: Vec<_> = (1..path.edges()).filter(|i| name(*i)).map(|i| path.transmits(i)).collect();
            let colored = path.colored(Rgb::ONE) != Rgb::ONE;
            *seen.lock().unwrap().entry([at.contains(&false), at.contains(&true), colored]).or_default() += 1;
            true
        });
    }
    let seen = seen.into_inner().unwrap();
    println!("{seen:?}");
    let kinds = [[false, false, false], [false, true, true], [true, false, true], [true, true, true]];
    assert!(kinds.iter().all(|kind| seen.get(kind).is_some_and(|count| *count > 100)), "{seen:?}");
    // A crossing into the inner ball is one between flint and crown.
    let others: u32 = seen.iter().filter(|(kind, _)| !kinds.contains(kind)).map(|x| x.1).sum();
    let inner: u32 = seen.get(&[false, false, true]).copied().unwrap_or(0);
    assert_eq!(others, inner, "{seen:?}");
}

/// What is deposited is the path's contribution times its weight, whichever way its colour was found: a merge knows no
/// path.
#[test]
fn merges_are_coloured_as_their_paths_are() {
    let scene = balls(scenes::square(16, Filter::Box));
    let radius = 0.2;
    let settings = Settings { integrator: Vcm, merge_radius: Some(radius), ..Settings::new(scene.camera.sensor()) };
    let mut renderer = Renderer::new(&scene, &settings);
    let integrator = renderer.integrator().clone().merging_within(radius);
    let checked = |_| renderer.pass_into(|| Checked { integrator: &integrator, coloured: [0; 2] });
    let seen: Vec<_> = (0..16).flat_map(checked).collect();
    let coloured = |i: usize| seen.iter().map(|x| x.coloured[i]).sum::<u32>();
    println!("{} merges are dispersed, and {} are not", coloured(1), coloured(0));
    assert!(coloured(0) > 1000 && coloured(1) > 1000);
}

struct Checked<'a> {
    integrator: &'a Integrator,
    /// Merges whose path is not dispersed, and those whose is.
    coloured: [u32; 2],
}

impl Collector for Checked<'_> {
    fn collect(&mut self, path: &JoinedPath, value: Rgb) {
        let technique = path.technique();
        let weight = self.integrator.weight(path) / self.integrator.techniques().samples(technique);
        let expected = path.contribution() * weight;
        let off = (value - expected).abs().max_element();
        assert!(off <= 1e-3 * expected.abs().max_element(), "{technique}: {value} instead of {expected}");
        if matches!(technique, Technique::Merged(_)) {
            self.coloured[usize::from(path.colored(Rgb::ONE) != Rgb::ONE)] += 1;
        }
    }
}

#[test]
fn strategies_and_merges_agree_on_rainbows() {
    let scene = balls(scenes::square(16, Filter::Box));
    let scattered = |path: &JoinedPath| (1..path.edges()).any(|i| !path.is_delta(i));
    let table = Integrator::new(
        LightTracing,
        scene.camera.sensor(),
        agreement::DEPTH,
        Settings::new(scene.camera.sensor()).roulette,
    );
    let uncovered = |path: &JoinedPath| scattered(path) && !table.covers(path);
    let of = |kind, salt| agreement::settings(&scene, kind, salt);
    let change = |all: Vec<Settings>, change: fn(&mut Settings)| -> Vec<Settings> {
        all.into_iter()
            .map(|mut one| {
                change(&mut one);
                one
            })
            .collect()
    };
    let [path, bdpt, light, rest] = [of(Path, 0), of(Bdpt, 0), of(LightTracing, 0), of(Path, 1)];
    let shared = change(of(Bdpt, 2), |x| x.light_vertices = Some(4));
    // So narrow that what merges misses is far less than what is visible.
    let [vcm, sds] = [Vcm, BdptSds].map(|kind| change(of(kind, 0), |x| x.merge_radius = Some(0.01)));
    let mut runs = vec![
        Run::new(&scene, &bdpt, "bdpt", &scattered),
        Run::new(&scene, &path, "path", &scattered),
        Run::new(&scene, &shared, "bdpt of tiles", &scattered),
        Run::new(&scene, &vcm, "vcm", &scattered),
        Run::new(&scene, &light, "light", &scattered),
        Run::new(&scene, &rest, "uncovered", &uncovered),
        Run::new(&scene, &sds, "bdpt-sds", &scattered),
    ];
    let pairs = [vec![1], vec![2], vec![3], vec![4, 5], vec![6]].map(|other| [vec![0], other]);
    agreement::assert_agree("dispersion", 0.02, &mut runs, &pairs);
}

fn image(scene: &Scene, settings: &Settings, passes: u32) -> Image {
    let mut renderer = Renderer::new(scene, settings);
    (0..passes).for_each(|_| renderer.pass());
    let statistics = renderer.statistics();
    assert!(renderer.film().errors().is_empty() && statistics.rejected.is_empty(), "{:?}", statistics.rejected);
    renderer.film().image(passes)
}

/// In a white world glass is not seen, whatever it does with which wavelength; single samples are coloured.
#[test]
fn white_stays_white() {
    let sensor = scenes::square(24, Filter::Box);
    // Frosted, it reflects and transmits 0.995 to 1 of the light, depending on its index.
    for (material, slack) in [(glass(1.5), 2e-3), (Material { absorption: Rgb::ZERO, ..frosted(0.1) }, 8e-3)] {
        let white = match material.bsdf {
            Bsdf::Dielectric(boundary) => Bsdf::Dielectric(Dielectric { color: Rgb::ONE, ..boundary }),
            other => other,
        };
        let mut g = Geometry::default();
        g.add_sphere(Vec3::ZERO, 1.0, MaterialId(0));
        let sky = Light::Environment { radiance: Rgb::ONE };
        let camera = Camera::look_at(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, Vec3::Y, 0.6, sensor);
        let scene = Scene::new(g, vec![Material { bsdf: white, ..material }], &[sky], camera);
        for integrator in [Path, Bdpt] {
            let settings = Settings { integrator, max_depth: 40, ..Settings::new(sensor) };
            let coloured = image(&scene, &settings, 1);
            assert!(coloured.pixels.iter().any(|p| p.min_element() < 0.0), "no negative channel is there");
            let mean = image(&scene, &settings, 512).mean().as_dvec3();
            println!("{integrator}: {mean}");
            assert!((mean - 1.0).abs().max_element() < slack, "{integrator}: {mean}");
        }
    }
}

/// With merges a pass has one wavelength, and passes take them evenly; else each sample has its own.
#[test]
fn what_can_be_joined_has_one_wavelength() {
    let scene = balls(scenes::square(20, Filter::Box));
    let wavelengths = |settings: &Settings, passes: u32| -> Vec<Vec<u32>> {
        let mut renderer = Renderer::new(&scene, settings);
        let of_pass = |_| {
            let seen = Mutex::new(Vec::new());
            renderer.pass_where(&|path| {
                let wavelength = path.to_path().wavelength().expect("a wavelength");
                seen.lock().unwrap().push(wavelength.nanometres().to_bits());
                true
            });
            let mut seen = seen.into_inner().unwrap();
            seen.sort_unstable();
            seen.dedup();
            seen
        };
        (0..passes).map(of_pass).collect()
    };
    let base = Settings { max_depth: 4, ..Settings::new(scene.camera.sensor()) };
    for integrator in [BdptSds, Vcm] {
        let merging = wavelengths(&Settings { integrator, ..base.clone() }, 16);
        assert!(merging.iter().all(|pass| pass.len() == 1), "{integrator}: {merging:?}");
        for half in 0..2 {
            let mut parts: Vec<_> = (merging.iter().skip(half).step_by(2))
                .map(|pass| (1..8).filter(|i| f32::from_bits(pass[0]) >= quantile(*i as f32 / 8.0)).count())
                .collect();
            parts.sort_unstable();
            let all: Vec<_> = (0..8).collect();
            assert_eq!(parts, all, "{integrator}: the passes of half {half} leave parts of the spectrum out");
        }
    }
    // Two rows of tiles of 16 pixels.
    let tiles = wavelengths(&Settings { integrator: Bdpt, light_vertices: Some(2), ..base.clone() }, 2);
    assert!(tiles.iter().all(|pass| pass.len() == 4), "{tiles:?}");
    let single = wavelengths(&Settings { integrator: Bdpt, ..base }, 1);
    assert!((200..=400).contains(&single[0].len()), "{}", single[0].len());
}

/// The wavelength below which this part of what is drawn lies, nm.
fn quantile(u: f32) -> f32 {
    Wavelength::sample(u).nanometres()
}

#[test]
fn shards_and_threads_give_the_same_sums() {
    let sensor = Sensor { width: 21, height: 17, padding: Filter::BlackmanHarris.padding() };
    let scene = balls(sensor);
    let base = Settings { filter: Filter::BlackmanHarris, max_depth: 6, ..Settings::new(sensor) };
    let of = |integrator| Settings { integrator, ..base.clone() };
    for settings in [of(Path), of(LightTracing), of(Bdpt), Settings { light_vertices: Some(2), ..of(Bdpt) }, of(Vcm)] {
        let run = |threads: usize, passes: std::ops::Range<u32>| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut renderer = Renderer::new(&scene, &settings).starting_at(passes.start);
            pool.install(|| passes.for_each(|_| renderer.pass()));
            renderer
        };
        let whole = run(1, 0..5);
        let merged = Renderer::new(&scene, &settings);
        for passes in [3..5, 0..1, 1..3] {
            shards::add(&run(3, passes), &merged, sensor, 5);
        }
        assert_eq!(merged.film().image(5), whole.film().image(5), "{}", settings.integrator);
        assert_ne!(whole.film().image(5), run(2, 0..4).film().image(4));
    }
}

/// A clamp bounds negative channels as well.
#[test]
fn a_clamp_bounds_both_signs() {
    let scene = balls(scenes::square(12, Filter::Box));
    let settings = Settings { clamp: Some(0.05), ..Settings::new(scene.camera.sensor()) };
    let mut renderer = Renderer::new(&scene, &settings);
    let bounds = renderer.pass_into(|| Extremes([0.0; 2]));
    let least = bounds.iter().map(|x| x.0[0]).fold(0.0, f32::min);
    let most = bounds.iter().map(|x| x.0[1]).fold(0.0, f32::max);
    assert_eq!([least, most], [-0.05, 0.05]);
}

struct Extremes([f32; 2]);

impl Collector for Extremes {
    fn collect(&mut self, _: &JoinedPath, value: Rgb) {
        self.0 = [self.0[0].min(value.min_element()), self.0[1].max(value.max_element())];
    }
}

/// An equilateral prism of side 0.2 whose upper edge is the z axis raised by its height; `axis` leads a beam through
/// its middle, parallel to the base at n = 1.5.
struct Bench {
    at: DVec3,
    axis: DVec3,
}

const SIDE: f64 = 0.2;
/// Where the wall is, and what is seen of it.
const WALL: f64 = 1.5;
const ROWS: u32 = 64;
const COLUMNS: u32 = 8;
const HEIGHT: f64 = 0.56;
const MIDDLE: f64 = -0.47;
/// The half angle of the beam, radians.
const BEAM: f32 = 0.004;

impl Bench {
    fn new() -> Self {
        let angle = (1.5 * 0.5_f64).asin() - PI / 6.0;
        let axis = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let entry = DVec3::new(-SIDE / 4.0, SIDE * 3.0_f64.sqrt() / 4.0, 0.0);
        Self { at: entry - axis, axis }
    }

    fn spot(&self) -> Spot {
        Spot::new(self.at.as_vec3(), self.axis.as_vec3(), Rgb::splat(1e6), 0.0, BEAM)
    }

    fn scene(&self) -> Scene {
        let (half, height) = (0.5 * SIDE as f32, (SIDE * 3.0_f64.sqrt() / 2.0) as f32);
        let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let ends = [half, -half].map(|z| [corner(-half, 0.0, z), corner(half, 0.0, z), corner(0.0, height, z)]);
        let mut g = Geometry::default();
        let faces = [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]];
        g.add_triangles(&ends.concat(), None, &faces, MaterialId(0));
        let (x, y) = (WALL as f32, 1.2);
        let wall = [corner(x, -y, -y), corner(x, -y, y), corner(x, y, y), corner(x, y, -y)];
        scenes::quad(&mut g, wall, 1);
        let sensor = Sensor { width: COLUMNS, height: ROWS, padding: 0 };
        let eye = corner(x - 0.3, MIDDLE as f32, 0.0);
        let camera = Camera::orthographic(eye, eye + Vec3::X, Vec3::Y, HEIGHT as f32, sensor);
        let materials = vec![glass(1.5), Material::diffuse("wall", Rgb::ONE)];
        Scene::new(g, materials, &[Light::Spot(self.spot())], camera)
    }

    /// Where a ray from the spot in this direction comes to the wall, its height, and what is left of it, by Snell and
    /// Fresnel with the index `n`.
    fn through(&self, direction: DVec3, n: f64) -> (f64, f64) {
        let top = DVec3::new(0.0, SIDE * 3.0_f64.sqrt() / 2.0, 0.0);
        let [entry, exit] = [-1.0, 1.0].map(|x| DVec3::new(x * (PI / 6.0).cos(), 0.5, 0.0));
        let reach = |p: DVec3, w: DVec3, normal: DVec3| p + w * ((top - p).dot(normal) / w.dot(normal));
        let p = reach(self.at, direction, entry);
        let (inside, first) = refract(direction, -entry, 1.0 / n);
        let p = reach(p, inside, exit);
        let (outside, second) = refract(inside, exit, n);
        (p.y + outside.y * (WALL - p.x) / outside.x, first * second)
    }
}

/// The refracted direction of one that goes along `normal`'s side, with η before over η behind, and what is not
/// reflected.
fn refract(w: DVec3, normal: DVec3, eta: f64) -> (DVec3, f64) {
    let cos = w.dot(normal);
    let behind = (1.0 - eta * eta * (1.0 - cos * cos)).sqrt();
    let across = eta * (w - cos * normal);
    let r = [(eta * cos - behind) / (eta * cos + behind), (cos - eta * behind) / (cos + eta * behind)];
    (across + behind * normal, 1.0 - 0.5 * (r[0] * r[0] + r[1] * r[1]))
}

/// n(λ) as the extension's page has it, with its rounded constants; λ in nm.
fn page(nanometres: f64) -> f64 {
    let abbe = 20.0 / f64::from(DISPERSION);
    f64::max(1.5 + 0.5 / abbe * (523_655.0 / (nanometres * nanometres) - 1.516_8), 1.0)
}

/// The light that a beam through a prism brings to each row of a wall, in W for 1 W that leaves the lamp.
fn spectrum(bench: &Bench) -> Vec<DVec3> {
    const WAVELENGTHS: u32 = 4096;
    const DIRECTIONS: u32 = 128;
    let (x, y) = bench.axis.any_orthonormal_pair();
    let outer = 2.0 * (0.5 * f64::from(BEAM)).sin().powi(2);
    let mut rows = vec![DVec3::ZERO; ROWS as usize];
    for i in 0..WAVELENGTHS {
        let wavelength = Wavelength::sample((i as f32 + 0.5) / WAVELENGTHS as f32);
        let n = page(wavelength.nanometres().into());
        for j in 0..DIRECTIONS {
            let turn = DVec2::from_angle(2.0 * PI * (f64::from(i * DIRECTIONS + j) * 0.618_033_988_75).fract());
            // The intensity falls as (outer − (1 − cos θ))², see `Spot`.
            let below_one = outer * (1.0 - (1.0 - (f64::from(j) + 0.5) / f64::from(DIRECTIONS)).cbrt());
            let sin = (below_one * (2.0 - below_one)).sqrt();
            let direction = (x * turn.x + y * turn.y) * sin + bench.axis * (1.0 - below_one);
            let (height, left) = bench.through(direction, n);
            let row = (0.5 - (height - MIDDLE) / HEIGHT) * f64::from(ROWS);
            assert!((0.0..f64::from(ROWS)).contains(&row), "the wall is wide enough: {row}");
            rows[row as usize] += wavelength.response().as_dvec3() * left;
        }
    }
    rows.iter().map(|row| row / f64::from(WAVELENGTHS * DIRECTIONS)).collect()
}

#[test]
fn a_prism_spreads_a_beam_by_the_extensions_formula() {
    let bench = Bench::new();
    let (scene, expected) = (bench.scene(), spectrum(&bench));
    let power = 1e6 * f64::from(bench.spot().solid_angle());
    let integrator = IntegratorKind::Light;
    let settings = Settings { integrator, min_depth: 4, max_depth: 4, ..Settings::new(scene.camera.sensor()) };
    let image = image(&scene, &settings, 1024);
    // Of what a white wall of radiance L receives, π L, the area of a pixel is its part.
    let pixel = PI * (HEIGHT / f64::from(ROWS)).powi(2) / power;
    let found: Vec<DVec3> =
        (0..ROWS).map(|y| (0..COLUMNS).map(|x| image.get(x, y).as_dvec3()).sum::<DVec3>() * pixel).collect();
    let largest = expected.iter().fold(DVec3::ZERO, |most, x| most.max(x.abs())).max_element();
    for (row, (found, expected)) in found.iter().zip(&expected).enumerate() {
        println!("{row}: {found:.5} of {expected:.5}");
        let off = (found - expected).abs().max_element();
        assert!(off < 0.04 * largest, "row {row}: {found} instead of {expected}");
    }
    let dark = |rows: &[DVec3]| rows.iter().filter(|x| x.min_element() < -0.05 * largest).count();
    assert!(dark(&found) > 5, "the colours of a spectrum are outside of what a display shows");
    let [found, expected] = [found, expected].map(|rows| rows.into_iter().sum::<DVec3>());
    assert!((found / expected - 1.0).abs().max_element() < 3e-3, "{found} instead of {expected}");
    // All of it together is as white as what the prism lets pass at one wavelength, but for Fresnel's part in it.
    let (_, left) = bench.through(bench.axis, 1.5);
    assert!((found / left - 1.0).abs().max_element() < 0.04, "{found} of {left}");
}
