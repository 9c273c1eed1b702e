//! Exactness: the same bytes for any number of threads, a crop that is a slice, and a brightness that depends on the
//! scene alone.

use pathspace::{
    film::{Crop, Half, Header, Image, encode_exr},
    integrator::IntegratorKind,
    render::{Renderer, Settings},
    sampling::{Filter, SamplerKind},
    scene::{Scene, camera::Sensor},
    statistics::{Comparison, Estimate, regions},
};
use rayon::prelude::*;

use crate::scenes;

pub fn render(scene: &Scene, settings: &Settings, spp: u32) -> Image {
    let mut renderer = Renderer::new(scene, settings);
    (0..spp).for_each(|_| renderer.pass());
    renderer.film().image(spp)
}

fn bytes(image: &Image, sensor: Sensor, crop: Crop) -> Vec<u8> {
    encode_exr(image, None, &[], &[], &Header { sensor, crop, attributes: Vec::new() }).unwrap()
}

/// Every integrator with every sampler.
fn every_kind() -> impl Iterator<Item = (IntegratorKind, SamplerKind)> {
    IntegratorKind::ALL.into_iter().flat_map(|integrator| SamplerKind::ALL.map(|sampler| (integrator, sampler)))
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    assert_threads_do_not_matter(scenes::zoo);
}

pub fn assert_threads_do_not_matter(scene: impl Fn(Sensor) -> Scene) {
    let sensor = Sensor { width: 70, height: 50, padding: Filter::BlackmanHarris.padding() };
    let scene = scene(sensor);
    for (integrator, sampler) in every_kind() {
        let (filter, weights) = (Filter::BlackmanHarris, integrator.description().weights);
        let settings = Settings { integrator, sampler, filter, weights, ..Settings::new(sensor) };
        let files = [1, 2, 5].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut renderer = pool.install(|| Renderer::new(&scene, &settings));
            pool.install(|| (0..3).for_each(|_| renderer.pass()));
            let film = renderer.film();
            // The halves too: a pass in the wrong one leaves the sum as it is.
            [film.image(3), film.half_image(Half::Even, 2), film.half_image(Half::Odd, 1)]
                .map(|image| bytes(&image, sensor, settings.crop))
        });
        assert!(files[0] == files[1] && files[0] == files[2], "{integrator} {sampler}");
    }
}

#[test]
fn a_crop_is_a_slice_of_the_full_image() {
    assert_crops_are_slices(scenes::zoo);
}

pub fn assert_crops_are_slices(scene: impl Fn(Sensor) -> Scene) {
    for filter in [Filter::Box, Filter::BlackmanHarris] {
        let sensor = Sensor { width: 48, height: 40, padding: filter.padding() };
        let scene = scene(sensor);
        for (integrator, sampler) in every_kind() {
            let weights = integrator.description().weights;
            let full = Settings { integrator, sampler, filter, weights, ..Settings::new(sensor) };
            let crop = Crop { x0: 9, y0: 17, x1: 30, y1: 40 };
            let part = render(&scene, &Settings { crop, ..full.clone() }, 2);
            let whole = render(&scene, &full, 2);
            for y in 0..part.height {
                for x in 0..part.width {
                    assert_eq!(
                        part.get(x, y),
                        whole.get(x + crop.x0, y + crop.y0),
                        "{integrator} {sampler} {filter} at {x}, {y}"
                    );
                }
            }
        }
    }
}

/// The estimate of the mean image from replicates.
pub fn estimate(scene: &Scene, settings: &Settings, spp: u32, replicates: u64) -> Estimate {
    let images = (0..replicates).into_par_iter().map(|r| {
        let settings = Settings { seed: settings.seed + r, ..settings.clone() };
        regions(&render(scene, &settings, spp))
    });
    Estimate::new(&images.collect::<Vec<_>>())
}

#[test]
fn brightness_depends_neither_on_spp_nor_on_resolution() {
    let sensor = scenes::square(24, Filter::Box);
    for integrator in scenes::WEIGHTED {
        let base = Settings { integrator, max_depth: 5, ..Settings::new(sensor) };
        let room = |sensor| scenes::load("cornell-box", sensor);
        // The others see a bias ten times as small with as many.
        let spp = if integrator == IntegratorKind::Path { 96 } else { 12 };
        let reference = estimate(&room(sensor), &base, spp, 32);
        let few = estimate(&room(sensor), &Settings { seed: 100, ..base.clone() }, 1, 32 * u64::from(spp));
        let large = scenes::square(48, Filter::Box);
        let large =
            estimate(&room(large), &Settings { crop: Crop::full(large), seed: 300, ..base.clone() }, spp / 4, 32);
        for (what, other) in [("1 spp", &few), ("48²", &large)] {
            let comparison = Comparison::new(&reference, other);
            println!("{integrator} {what}: {comparison}");
            assert!(!comparison.differs(), "{integrator} {what}: {comparison}");
            assert!(comparison.visible_bias < 0.03, "{integrator} {what}: {comparison}");
        }
    }
}

#[test]
fn brightness_depends_neither_on_distance_nor_on_the_filter() {
    // A furnace fills every image with the same radiance, however near or far its walls are, and whatever the zoom.
    let filter = Filter::BlackmanHarris;
    let sensor = scenes::square(16, filter);
    for integrator in scenes::WEIGHTED {
        let settings = Settings { integrator, filter, max_depth: 3, ..Settings::new(sensor) };
        for scale in [1e-3_f32, 1.0, 1e3] {
            let scene = scenes::scaled_furnace(0.5, 1.0, scale, sensor);
            let found = estimate(&scene, &settings, 32, 12);
            let p = found.p_of_mean(1.75);
            println!("{integrator} at scale {scale}: {:.4}, p = {p:.2e}", found.image_mean());
            assert!(p > 1e-4 && (found.image_mean() / 1.75 - 1.0).abs() < 0.02, "{integrator} at scale {scale}");
        }
    }
}
