//! What the candidates find often enough in a small image: it is measured.

use super::{Keep, Work};
use crate::{
    film::Film,
    integrator::Integrator,
    math::luminance,
    path::JoinedPath,
    render::{Renderer, Settings},
    scene::{Scene, camera::Sensor},
};

/// Samples per pixel of each of a candidate's two images.
const PASSES: u32 = 6;
/// Of the image that gives the measure for all.
const FIRST_PASSES: u32 = 2;
/// The part of the pixels that are not much brighter than the others.
const USUAL: f64 = 0.99;

/// A candidate's noise in the pilot.
pub struct Measured {
    /// With the table that it has there.
    pub integrator: Integrator,
    /// Of one sample.
    pub work: Work,
    /// Luminances, by random numbers that know nothing of each other.
    images: [Vec<f64>; 2],
}

impl Measured {
    /// Renders twice with contributions clamped to `common`.
    pub fn new(scene: &Scene, settings: &Settings, common: f64, keep: Option<&Keep<'_>>) -> Self {
        let image = |number: u64| {
            // Any seeds but the image's would do.
            let seed = settings.seed ^ number.wrapping_mul(0xd134_2543_de82_ef95);
            let settings = Settings { seed, clamp: Some(common as f32), ..settings.clone() };
            rendered(scene, &settings, PASSES, keep)
        };
        // A pilot of one tile would leave all threads but one idle.
        let (a, b) = rayon::join(|| image(1), || image(2));
        Self { integrator: a.integrator, work: a.work, images: [a.image, b.image] }
    }

    /// The variance of a pixel after [`PASSES`] samples, times their number: that of one sample if its random numbers
    /// were independent.
    pub fn variance(&self, pixel: usize) -> f64 {
        let [a, b] = &self.images;
        0.5 * (a[pixel] - b[pixel]).powi(2) * f64::from(PASSES)
    }

    /// The mean of a pixel.
    pub fn mean(&self, pixel: usize) -> f64 {
        let [a, b] = &self.images;
        0.5 * (a[pixel] + b[pixel])
    }
}

struct Rendered {
    integrator: Integrator,
    work: Work,
    image: Vec<f64>,
}

fn rendered(scene: &Scene, settings: &Settings, passes: u32, keep: Option<&Keep<'_>>) -> Rendered {
    let kept = |path: &JoinedPath| keep.is_none_or(|keep| keep(scene, path));
    let renderer = Renderer::new(scene, settings);
    let mut renderer = if keep.is_some() { renderer.keeping(&kept) } else { renderer };
    for _ in 0..passes {
        renderer.pass();
    }
    let sensor = scene.camera.sensor();
    let work = Work::of(&renderer.statistics(), passes, sensor);
    Rendered { integrator: renderer.integrator().clone(), work, image: luminances(renderer.film(), passes) }
}

fn luminances(film: &Film, passes: u32) -> Vec<f64> {
    film.image(passes).pixels.iter().map(|pixel| f64::from(luminance(*pixel))).collect()
}

/// The mean luminance of what is not much brighter than the rest: the measure of what is large.
pub fn typical_value(scene: &Scene, settings: &Settings, keep: Option<&Keep<'_>>) -> f64 {
    let settings = Settings { seed: settings.seed ^ 0xa076_1d64_78bd_642f, ..settings.clone() };
    let mut image = rendered(scene, &settings, FIRST_PASSES, keep).image;
    image.sort_by(f64::total_cmp);
    image.truncate((USUAL * image.len() as f64).ceil() as usize);
    image.iter().sum::<f64>() / image.len() as f64
}

/// For each pixel the mean of it and its neighbours.
pub fn smooth(of_pixel: impl Fn(usize) -> f64, Sensor { width, height, .. }: Sensor) -> Vec<f64> {
    let means: Vec<_> = (0..width as usize * height as usize).map(of_pixel).collect();
    let around = |at: u32, size: u32| at.saturating_sub(1)..(at + 2).min(size);
    let mean_around = |x: u32, y: u32| {
        let neighbours = around(y, height).flat_map(|y| around(x, width).map(move |x| (y * width + x) as usize));
        let (sum, count) = neighbours.fold((0.0, 0.0), |(sum, count), pixel| (sum + means[pixel], count + 1.0));
        sum / count
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| mean_around(x, y)).collect()
}
