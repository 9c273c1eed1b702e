//! What an image file says about how it was made: everything that changes pixels, and nothing else. No paths,
//! threads, hosts, dates or timings, so that the same image is the same file wherever it was rendered.

use std::collections::BTreeMap;

use pathspace::{
    film::{Crop, Film, Header, Sums},
    integrator::{RelativeRoulette, Weighting},
    io::{NamedCamera, ThinLens, View},
    path::Roulette,
    render::{Background, Settings},
    sampling::Filter,
    scene::{bsdf::Directions, camera::Sensor, light::LightChoice},
};

use crate::cli::shared::passes::Passes;

/// The instructions that the arithmetic uses. Images are comparable to the bit only within one such path.
const INSTRUCTIONS: &str = "scalar";

/// What was rendered.
pub struct Job<'a> {
    pub scene_hash: String,
    /// Which scene of a file with several.
    pub shown: Option<usize>,
    pub camera: &'a NamedCamera,
    pub sensor: Sensor,
    pub settings: &'a Settings,
    /// How next-event estimation chooses.
    pub lights: LightChoice,
    /// The expression of the paths that are in the image, if not all are.
    pub paths: Option<String>,
    /// The environment, if the options or their absence chose one.
    pub environment: Option<String>,
}

/// What changes pixels, by its name in the header, whatever the number of samples: two renders for which this is the
/// same, and the size, are parts of one.
pub fn settings(job: &Job<'_>) -> BTreeMap<String, String> {
    let settings = job.settings;
    let camera = job.camera;
    let mut attributes = vec![
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("scene", job.scene_hash.clone()),
        ("camera", format!("at {} to {} up {} {}", camera.position, camera.forward, camera.up, view(camera.view))),
        ("integrator", settings.integrator.to_string()),
        ("sampler", settings.sampler.to_string()),
        ("seed", settings.seed.to_string()),
        ("max-depth", settings.max_depth.to_string()),
        ("roulette", roulette(settings.roulette)),
        (FILTER, settings.filter.to_string()),
        ("instructions", INSTRUCTIONS.to_owned()),
    ];
    if settings.min_depth != 1 {
        attributes.push(("min-depth", settings.min_depth.to_string()));
    }
    if settings.light_samples != 1 {
        attributes.push(("light-samples", settings.light_samples.to_string()));
    }
    if settings.splits != 1 {
        attributes.push(("splits", settings.splits.to_string()));
    }
    if settings.light_paths != 1 {
        attributes.push(("light-paths", settings.light_paths.to_string()));
    }
    if let Some(each) = settings.light_vertices {
        attributes.push(("light-vertices", each.to_string()));
    }
    if let Some(RelativeRoulette { threshold, end }) = settings.connection_roulette {
        attributes.push(("connection-roulette", format!("{threshold},{end}")));
    }
    if job.lights != LightChoice::default() {
        attributes.push(("lights", job.lights.to_string()));
    }
    if let Some(paths) = &job.paths {
        attributes.push(("paths", paths.clone()));
    }
    if settings.hemisphere != Directions::Bsdf {
        attributes.push(("hemisphere", settings.hemisphere.name().to_owned()));
    }
    if let Some(index) = job.shown {
        attributes.push(("scene-index", index.to_string()));
    }
    if let Some(environment) = &job.environment {
        attributes.push(("environment", environment.clone()));
    }
    if let Some(clamp) = settings.clamp {
        attributes.push(("clamp", clamp.to_string()));
    }
    if settings.background == Background::Transparent {
        attributes.push(("background", "transparent".to_owned()));
    }
    if let Some((strategy, weighting)) = settings.only {
        let weighting = match weighting {
            Weighting::Weighted => "weighted",
            Weighting::Unweighted => "unweighted",
        };
        attributes.push(("only-strategy", format!("{},{} {weighting}", strategy.s, strategy.t)));
    }
    if settings.crop != Crop::full(job.sensor) {
        let Crop { x0, y0, x1, y1 } = settings.crop;
        attributes.push(("crop", format!("{x0},{y0},{x1},{y1}")));
    }
    attributes.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// The filter, as [`settings`] says it.
pub fn filter_of(settings: &BTreeMap<String, String>) -> Option<Filter> {
    settings.get(FILTER)?.parse().ok()
}

const FILTER: &str = "filter";

/// The header of the image that is the mean of `passes`.
pub fn header(sensor: Sensor, settings: &BTreeMap<String, String>, sums: &Sums<'_>, passes: &Passes) -> Header {
    let mut attributes: Vec<_> = settings.clone().into_iter().collect();
    let mut add = |name: &str, value| attributes.push((name.to_owned(), value));
    add("spp", passes.count().to_string());
    add("noise", noise(passes.noise(sums.film), passes.count(), sums.film));
    if !passes.is_from_start() {
        add("passes", passes.to_string());
    }
    let errors = sums.errors();
    if !errors.is_empty() {
        add("errors", format!("{errors:?}"));
    }
    Header { sensor, crop: sums.film.crop(), attributes }
}

fn view(view: View) -> String {
    match view {
        View::Perspective { yfov, lens: None } => format!("yfov {yfov}"),
        View::Perspective { yfov, lens: Some(ThinLens { aperture, focus }) } => {
            format!("yfov {yfov} aperture {aperture} focus {focus}")
        }
        View::Orthographic { height } => format!("orthographic height {height}"),
    }
}

fn roulette(roulette: Roulette) -> String {
    match roulette {
        Roulette::Off => "off".to_owned(),
        Roulette::FromDepth(depth) => depth.to_string(),
        Roulette::ByThroughput(depth) => format!("throughput:{depth}"),
    }
}

/// What is known about the noise, in words where it is nothing.
fn noise(noise: Option<f64>, passes: u32, film: &Film) -> String {
    match noise {
        Some(noise) => format!("relMSE {noise:.4e} from two half images"),
        None if film.is_black() => "unknown: no light has arrived".to_owned(),
        None if passes == 1 => "unknown: one sample per pixel".to_owned(),
        None if passes.is_multiple_of(2) => "unknown: the half images differ in length".to_owned(),
        None => "unknown: the half images of an odd number of samples differ in length".to_owned(),
    }
}
