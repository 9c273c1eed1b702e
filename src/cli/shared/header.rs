//! What an image file says about how it was made: everything that changes pixels, and nothing else. No paths,
//! threads, hosts, dates or timings, so that the same image is the same file wherever it was rendered.

use std::{collections::BTreeMap, ops::Range};

use pathspace::{
    choice::Estimate,
    film::{Crop, Film, Header, Sums},
    integrator::{RelativeRoulette, Weighting, Weights},
    io::{NamedCamera, ThinLens, View},
    path::{LightPaths, Roulette, Strategy},
    render::{Background, MergeRadius, Settings},
    sampling::Filter,
    scene::{Scene, bsdf::Directions, camera::Sensor, light::LightChoice},
};

use crate::cli::shared::passes::Passes;

/// The instructions that the arithmetic uses. Images are comparable to the bit only within one such path.
const INSTRUCTIONS: &str = "scalar";

/// What was rendered.
pub struct Job<'a> {
    pub scene: &'a Scene,
    pub scene_hash: String,
    /// Which scene of a file with several.
    pub shown: Option<usize>,
    /// Which variant of its materials.
    pub variant: Option<usize>,
    /// When its animations are shown, and which.
    pub at: Option<String>,
    pub camera: &'a NamedCamera,
    pub sensor: Sensor,
    pub settings: &'a Settings,
    /// Of a pilot that has chosen the integrator.
    pub estimates: Vec<Estimate>,
    /// Within which radii paths merge, if they do.
    pub merging: Option<MergeRadius>,
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
    let Job { settings, camera, .. } = job;
    let always = [
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
    let unusual = unusual(job).into_iter().filter_map(|(name, value)| Some((name, value?)));
    always.into_iter().chain(unusual).map(|(name, value)| (name.to_owned(), value)).collect()
}

/// What a header has only where it is not as usual.
fn unusual(job: &Job<'_>) -> [(&'static str, Option<String>); 19] {
    let Job { settings, lights, .. } = job;
    let unless_one = |count: u32| (count != 1).then(|| count.to_string());
    let relative = |RelativeRoulette { threshold, end }| format!("{threshold},{end}");
    let is_transparent = settings.background == Background::Transparent;
    [
        ("min-depth", unless_one(settings.min_depth)),
        ("light-samples", unless_one(settings.light_samples)),
        ("splits", unless_one(settings.splits)),
        ("light-paths", (settings.light_paths != LightPaths::ONE).then(|| settings.light_paths.to_string())),
        ("light-vertices", settings.light_vertices.map(|each| each.to_string())),
        (MERGE_RADIUS, job.merging.map(|radius| radius.to_string())),
        ("connection-roulette", settings.connection_roulette.map(relative)),
        ("weights", (settings.weights != Weights::Plain).then(|| settings.weights.name().to_owned())),
        ("lights", (*lights != LightChoice::default()).then(|| lights.to_string())),
        ("paths", job.paths.clone()),
        ("hemisphere", (settings.hemisphere != Directions::Bsdf).then(|| settings.hemisphere.name().to_owned())),
        ("scene-index", job.shown.map(|index| index.to_string())),
        ("variant", job.variant.map(|index| index.to_string())),
        ("at", job.at.clone()),
        ("environment", job.environment.clone()),
        ("clamp", settings.clamp.map(|clamp| clamp.to_string())),
        ("background", is_transparent.then(|| "transparent".to_owned())),
        (ONLY, settings.only.map(only)),
        ("crop", (settings.crop != Crop::full(job.sensor)).then(|| crop(settings.crop))),
    ]
}

/// The filter, as [`settings`] says it.
pub fn filter_of(settings: &BTreeMap<String, String>) -> Option<Filter> {
    settings.get(FILTER)?.parse().ok()
}

const FILTER: &str = "filter";
const ONLY: &str = "only-strategy";
const MERGE_RADIUS: &str = "merge-radius";

/// Why a pilot has chosen the integrator, if one has.
pub const CHOICE: &str = "choice";

/// What a header says of the bias of merging, where there is any.
pub const BIAS: &str = "bias";

/// The number of samples per pixel.
pub const SPP: &str = "spp";

/// What a header says of the samples, and not of how they are made.
pub const OF_SAMPLES: [&str; 5] = [BIAS, SPP, "noise", "passes", "errors"];

/// What merging does to the mean of these passes.
fn bias(radius: MergeRadius, passes: &Range<u32>) -> Option<String> {
    let last = passes.end.checked_sub(1)?;
    let [first, last] = [passes.start, last].map(|pass| radius.of_pass(pass));
    Some(match radius {
        MergeRadius::Fixed(radius) => format!("not consistent: paths merge within {radius} m in every pass"),
        MergeRadius::Shrinking { .. } => {
            format!("consistent, not unbiased: paths merge within {first} m in the first pass and {last} m in the last")
        }
    })
}

/// The header of the image that is the mean of `passes`.
pub fn header(sensor: Sensor, settings: &BTreeMap<String, String>, sums: &Sums<'_>, passes: &Passes) -> Header {
    let mut attributes: Vec<_> = settings.clone().into_iter().collect();
    let mut add = |name: &str, value| attributes.push((name.to_owned(), value));
    // What one strategy finds has a weight that knows of merges, and no bias.
    let radius = if settings.contains_key(ONLY) { None } else { settings.get(MERGE_RADIUS) };
    if let Some(bias) = radius.and_then(|radius| bias(radius.parse().ok()?, &passes.span())) {
        add(BIAS, bias);
    }
    add(SPP, passes.count().to_string());
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
        View::Perspective { yfov, lens: Some(ThinLens { aperture, focus, blades }) } => {
            let blades = blades.map(|blades| format!(" blades {} rotation {}", blades.count(), blades.rotation()));
            format!("yfov {yfov} aperture {aperture} focus {focus}{}", blades.unwrap_or_default())
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

fn only((strategy, weighting): (Strategy, Weighting)) -> String {
    let weighting = match weighting {
        Weighting::Weighted => "weighted",
        Weighting::Unweighted => "unweighted",
    };
    format!("{},{} {weighting}", strategy.s, strategy.t)
}

fn crop(Crop { x0, y0, x1, y1 }: Crop) -> String {
    format!("{x0},{y0},{x1},{y1}")
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
