//! A transparent background: the same alpha with every integrator, and over the background again the opaque image.

use glam::Vec3;
use pathspace::{
    film::{Crop, Header, Image, encode_exr},
    integrator::IntegratorKind,
    math::Rgb,
    path::Roulette,
    render::{Background, Renderer, Settings},
    sampling::Filter,
    scene::{
        Scene,
        camera::{Camera, Sensor},
    },
    statistics::{Comparison, Estimate, regions},
};

use crate::scenes;

/// The environment of the open zoo.
const SKY: Rgb = Rgb::new(0.3, 0.4, 0.5);

/// A ball and a ground of which the lens blurs the edges, before the sky.
fn scene(sensor: Sensor) -> Scene {
    let mut scene = scenes::open_zoo(sensor);
    let (from, to) = (Vec3::new(0.0, 1.4, 3.0), Vec3::new(0.0, 0.9, 0.0));
    scene.camera = Camera::look_at(from, to, Vec3::Y, 1.1, sensor).with_lens(0.4, 1.5);
    scene
}

fn settings(integrator: IntegratorKind, filter: Filter, sensor: Sensor) -> Settings {
    Settings { integrator, filter, background: Background::Transparent, ..Settings::new(sensor) }
}

fn render(scene: &Scene, settings: &Settings, spp: u32) -> (Image, Option<Vec<f32>>) {
    let mut renderer = Renderer::new(scene, settings);
    (0..spp).for_each(|_| renderer.pass());
    (renderer.film().image(spp), renderer.alpha())
}

#[test]
fn alpha_is_exact_and_the_same_with_every_integrator() {
    for filter in [Filter::Box, Filter::BlackmanHarris] {
        let sensor = Sensor { width: 40, height: 30, padding: filter.padding() };
        let scene = scene(sensor);
        let mut first: Option<Vec<f32>> = None;
        for integrator in IntegratorKind::ALL {
            let full = settings(integrator, filter, sensor);
            let files = [1, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let (image, alpha) = pool.install(|| render(&scene, &full, 3));
                let header = Header { sensor, crop: full.crop, attributes: Vec::new() };
                encode_exr(&image, alpha.as_deref(), &[], &[], &header).unwrap()
            });
            assert!(files[0] == files[1], "{integrator} {filter}");

            let (image, alpha) = render(&scene, &full, 3);
            let alpha = alpha.expect("an alpha channel");
            assert!(alpha.contains(&0.0) && alpha.contains(&1.0) && alpha.iter().any(|a| 0.0 < *a && *a < 1.0));
            let empty = |(p, a): (&Rgb, &f32)| *a > 0.0 || filter != Filter::Box || *p == Rgb::ZERO;
            assert!(
                integrator != IntegratorKind::Path || image.pixels.iter().zip(&alpha).all(empty),
                "what is not covered adds nothing"
            );
            let crop = Crop { x0: 7, y0: 9, x1: 30, y1: 30 };
            let (part, part_alpha) = render(&scene, &Settings { crop, ..full }, 3);
            let part_alpha = part_alpha.unwrap();
            for (i, pixel) in part.pixels.iter().enumerate() {
                let (x, y) = (i as u32 % part.width + crop.x0, i as u32 / part.width + crop.y0);
                assert_eq!(*pixel, image.get(x, y), "{integrator} {filter}");
                assert_eq!(part_alpha[i], alpha[(y * sensor.width + x) as usize], "{integrator} {filter}");
            }
            assert_eq!(first.get_or_insert(alpha.clone()), &alpha, "{integrator} {filter}");
        }
    }
}

#[test]
fn over_its_own_background_path_tracing_is_the_opaque_image() {
    let sensor = scenes::square(32, Filter::Box);
    for scene in [scene(sensor), scenes::zoo(sensor)] {
        let transparent = settings(IntegratorKind::Path, Filter::Box, sensor);
        let opaque = Settings { background: Background::Shown, ..transparent.clone() };
        let ((image, alpha), (whole, none)) = (render(&scene, &transparent, 8), render(&scene, &opaque, 8));
        assert!(none.is_none());
        for ((p, a), expected) in image.pixels.iter().zip(alpha.unwrap()).zip(&whole.pixels) {
            let over = *p + (1.0 - a) * SKY;
            assert!(
                (over - *expected).abs().max_element() < 1e-5 * (1.0 + expected.max_element()),
                "{over} {expected}"
            );
        }
    }
}

#[test]
fn the_other_integrators_leave_the_same_background_out() {
    let sensor = scenes::square(16, Filter::Box);
    let scene = scene(sensor);
    let estimate = |integrator, background| {
        let replicates = (0..12).map(|seed| {
            let roulette = Roulette::Off;
            let base =
                Settings { background, seed, roulette, max_depth: 1, ..settings(integrator, Filter::Box, sensor) };
            let (image, alpha) = render(&scene, &base, 200);
            let sky = alpha.map(|alpha| alpha.into_iter().map(|a| (1.0 - a) * SKY).collect::<Vec<_>>());
            let pixels =
                image.pixels.iter().enumerate().map(|(i, p)| *p + sky.as_ref().map_or(Rgb::ZERO, |sky| sky[i]));
            let mut regions = regions(&Image { pixels: pixels.collect(), ..image });
            // The lowest tiles show the sky through slivers, which light tracing meets less than once in a replicate:
            // no t-test.
            regions.truncate(3 + 12);
            regions
        });
        Estimate::new(&replicates.collect::<Vec<_>>())
    };
    for integrator in [IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt] {
        let (over, opaque) = (estimate(integrator, Background::Transparent), estimate(integrator, Background::Shown));
        let comparison = Comparison::new(&over, &opaque);
        println!("{integrator}: {comparison}");
        assert!(!comparison.differs() && comparison.visible_bias < 0.05, "{integrator}: {comparison}");
    }
}
