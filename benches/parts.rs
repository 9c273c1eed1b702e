//! `cargo bench --bench parts`: the parts of a sample, each on its own. Compare figures of one run only.
//!
//! In a render they are compiled for the processor's own instructions, and run in each other's shadow; here they are
//! not. So these figures say which part a change made slower, and not what a render takes.

use std::hint::black_box;

use divan::{Bencher, counter::ItemsCount};
use glam::{Vec2, Vec3};
use pathspace::{
    film::{Film, FixedPoint, Half},
    integrator::{Integrator, IntegratorKind},
    io,
    math::Rgb,
    path::{Heuristic, JoinedPath, Roulette, Subpath},
    sampling::{Block, Filter, Independent, Sampler, Sobol, Stream},
    scene::{
        Scene,
        bsdf::{Bsdf, Dielectric, Diffuse, Lobe, MetallicRoughness, Transport},
        camera::{Raster, Sensor},
        geometry::{PrimitiveId, Ray},
        point::Point,
    },
};

fn main() {
    divan::main();
}

/// How many of a thing one measurement does.
const MANY: u32 = 1024;
const SENSOR: Sensor = Sensor { width: 64, height: 64, padding: 1 };

fn load(name: &str) -> Scene {
    let path = format!("{}/scenes/{name}.glb", env!("CARGO_MANIFEST_DIR"));
    let loaded = io::load(path.as_ref()).unwrap_or_else(|e| panic!("{e}"));
    let camera = loaded.cameras[0].to_camera(SENSOR);
    loaded.into_scene(camera, None)
}

/// Points of the scene's surfaces that the camera's walks find, and the same number of them from its lights.
fn subpaths(scene: &Scene, number: u32) -> (Subpath, Subpath) {
    let (mut camera, mut light) = (Subpath::with_capacity(4), Subpath::with_capacity(4));
    let [mut for_camera, mut for_light, ..] = Independent::streams(1, number, 0);
    let raster = Raster(for_camera.next_2d() * 64.0);
    camera.walk_from_camera(scene, raster, 4, Roulette::Off, &mut for_camera);
    light.walk_from_light(scene, 0, 4, Roulette::Off, &mut for_light);
    (camera, light)
}

fn points(scene: &Scene) -> Vec<Point> {
    let all =
        (0..MANY).flat_map(|i| subpaths(scene, i).0.steps()[1..].iter().map(|s| s.vertex.point).collect::<Vec<_>>());
    all.filter(|p| p.primitive != PrimitiveId::NONE).take(MANY as usize).collect()
}

#[divan::bench(args = ["cornell-box", "caustic-sphere", "veach-room"])]
fn closest_hit(bencher: Bencher<'_, '_>, name: &str) {
    let scene = load(name);
    let points = points(&scene);
    let towards = |a: &Point, b: &Point| Ray {
        origin: a.ray_origin(b.position - a.position),
        direction: b.position - a.position,
        t_max: f32::INFINITY,
    };
    let rays: Vec<_> = points.iter().zip(points.iter().skip(7)).map(|(a, b)| towards(a, b)).collect();
    bencher.counter(ItemsCount::new(rays.len())).bench(|| {
        rays.iter().filter(|ray| scene.geometry().closest(black_box(ray), PrimitiveId::NONE).is_some()).count()
    });
}

#[divan::bench(args = ["cornell-box", "caustic-sphere", "veach-room"])]
fn visibility(bencher: Bencher<'_, '_>, name: &str) {
    let scene = load(name);
    let points = points(&scene);
    let pairs: Vec<_> = points.iter().zip(points.iter().skip(7)).collect();
    bencher
        .counter(ItemsCount::new(pairs.len()))
        .bench(|| pairs.iter().map(|(a, b)| scene.visible(black_box(a), b)).sum::<f32>());
}

fn bsdf(name: &str) -> Bsdf {
    let color = Rgb::new(0.8, 0.5, 0.3);
    let glass = |alpha| Bsdf::Dielectric(Dielectric { color: Rgb::ONE, ior: 1.5, alpha, transmission: 1.0 });
    match name {
        "diffuse" => Bsdf::Diffuse(Diffuse { albedo: color }),
        "metallic-roughness" => Bsdf::MetallicRoughness(MetallicRoughness {
            base_color: color,
            metallic: 0.5,
            alpha: 0.1,
            dielectric_f0: Rgb::splat(0.04),
            dielectric_f90: 1.0,
        }),
        "smooth glass" => glass(0.0),
        _ => glass(0.2),
    }
}

#[divan::bench(args = ["diffuse", "metallic-roughness", "smooth glass", "rough glass"])]
fn bsdf_sample(bencher: Bencher<'_, '_>, name: &str) {
    let bsdf = bsdf(name);
    let known = Vec3::new(0.3, -0.4, 0.866).normalize();
    let mut sampler = Independent::new(1, 0, 0, Stream::Camera);
    let numbers: Vec<_> = (0..MANY).map(|_| sampler.next_3d()).collect();
    bencher.counter(ItemsCount::new(MANY)).bench(|| {
        numbers
            .iter()
            .filter_map(|u| black_box(&bsdf).sample(known, Transport::Radiance, *u))
            .map(|s| s.scatter.f.r())
            .sum::<f32>()
    });
}

#[divan::bench(args = ["diffuse", "metallic-roughness", "rough glass"])]
fn bsdf_eval(bencher: Bencher<'_, '_>, name: &str) {
    let bsdf = bsdf(name);
    let known = Vec3::new(0.3, -0.4, 0.866).normalize();
    let mut sampler = Independent::new(1, 0, 0, Stream::Camera);
    let directions: Vec<_> = (0..MANY).map(|_| (2.0 * sampler.next_3d() - 1.0).normalize()).collect();
    bencher
        .counter(ItemsCount::new(MANY))
        .bench(|| directions.iter().map(|w| black_box(&bsdf).eval(Lobe::Continuous, known, *w).f.r()).sum::<f32>());
}

/// Connections of three camera vertices and three light vertices, without their rays.
#[divan::bench(args = ["cornell-box", "veach-room"])]
fn connection(bencher: Bencher<'_, '_>, name: &str) {
    let scene = load(name);
    let pairs: Vec<_> =
        (0..MANY).map(|i| subpaths(&scene, i)).filter(|(c, l)| c.steps().len() > 2 && l.steps().len() > 2).collect();
    bencher.counter(ItemsCount::new(pairs.len())).bench(|| {
        let joined = |(c, l)| JoinedPath::inner(&scene, c, l, 3, Raster(Vec2::ZERO));
        pairs
            .iter()
            .filter_map(|(c, l): &(Subpath, Subpath)| joined((&c.steps()[..3], l)))
            .map(|p| p.contribution().r())
            .sum::<f32>()
    });
}

/// Weights of such paths in bidirectional path tracing's table.
#[divan::bench(args = ["cornell-box", "veach-room"])]
fn weight(bencher: Bencher<'_, '_>, name: &str) {
    let scene = load(name);
    let bdpt = Integrator::new(IntegratorKind::Bdpt, SENSOR, 8, Roulette::Off);
    let pairs: Vec<_> =
        (0..MANY).map(|i| subpaths(&scene, i)).filter(|(c, l)| c.steps().len() > 2 && l.steps().len() > 2).collect();
    let joined = pairs.iter().filter_map(|(c, l)| JoinedPath::inner(&scene, &c.steps()[..3], l, 3, Raster(Vec2::ZERO)));
    let paths: Vec<_> = joined.filter(|path| path.contribution() != Rgb::ZERO).collect();
    bencher
        .counter(ItemsCount::new(paths.len()))
        .bench(|| paths.iter().map(|p| p.mis_weight(black_box(bdpt.techniques()), Heuristic::Power)).sum::<f32>());
}

#[divan::bench(args = ["box", "blackman-harris"])]
fn film(bencher: Bencher<'_, '_>, filter: &str) {
    let filter: Filter = filter.parse().expect("a filter");
    let crop = pathspace::film::Crop { x0: 0, y0: 0, x1: 64, y1: 64 };
    let film = Film::new(SENSOR, crop, filter, FixedPoint::with_exponent(-40));
    let mut sampler = Independent::new(1, 0, 0, Stream::Light);
    let places: Vec<_> = (0..MANY).map(|_| Raster(sampler.next_2d() * 64.0)).collect();
    bencher.counter(ItemsCount::new(MANY)).bench(|| {
        places.iter().for_each(|place| film.deposit(*place, black_box(Rgb::ONE), Half::Even));
    });
}

#[divan::bench(types = [Independent, Sobol])]
fn four_numbers<S: Sampler>(bencher: Bencher<'_, '_>) {
    bencher.counter(ItemsCount::new(MANY)).bench(|| {
        let mut sampler = S::new(1, black_box(7), 3, Stream::Camera);
        let four = |i| {
            sampler.start(Block::scattering(i));
            sampler.next_3d().x + sampler.next_1d()
        };
        (1..=MANY).map(four).sum::<f32>()
    });
}
