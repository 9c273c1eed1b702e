//! `pathspace render`.

pub mod args;
mod black;
pub mod data;
mod foretell;
pub mod keep;
pub mod pass_loop;
mod rendered;
mod stats;
mod viewer;

use std::{collections::BTreeMap, ops::Range, path::PathBuf};

use pathspace::{
    film::{AlphaSums, Contents, Crop, Film},
    integrator::{BYTES_OF_A_LIGHT_VERTEX, Weighting},
    layers::{Expression, PathClasses},
    path::{Heuristic, JoinedPath, Strategy},
    render::{Background, MergeRadius, Renderer, Settings},
    scene::{Scene, camera::Sensor, light::LightChoice},
};
use serde_json::{Value, json};

use crate::cli::{
    render::{
        args::RenderArgs, black::Black, foretell::foretell, keep::Keeper, pass_loop::Quality, rendered::Rendered,
        stats::Phases, viewer::Viewer,
    },
    shared::{
        camera,
        exit::{Exit, Failure},
        header::{self, Job},
        interrupt::Interrupt,
        opened::Opened,
        pictures::Outputs,
        progress::{Goal, MOST_PASSES, Progress},
        saved,
        terminal::Terminal,
        values::{Preset, Shard},
    },
};

const DEFAULT_SPP: u32 = 64;
/// What a ray tracer of 1980 shows (Whitted, *An Improved Illumination Model for Shaded Display*).
const WHITTED: &str = "CS*[DG]?L";
/// With `--noise`: some images have tiles that never become quiet.
const MOST_FOR_NOISE: u32 = 1 << 16;
const DEFAULT_WIDTH: u32 = 512;
/// From one vertex to lights: nobody waits for more.
const MOST_RAYS: u64 = 1 << 20;
/// Light vertices of a pass have numbers of 32 bits; an estimate may be off by half.
const MOST_KEPT: u64 = BYTES_OF_A_LIGHT_VERTEX << 31;
/// Beyond this the light paths of a tile are no longer what a thread should keep.
const MOST_LIGHT_SUBPATHS: u64 = 256 << 20;
/// Besides the film's sums: the image, two halves while the noise is estimated, and the files before they are written.
const IMAGE_BYTES_PER_PIXEL: u64 = 52;
/// The same of the alpha channel.
const ALPHA_BYTES_PER_PIXEL: u64 = 12;

/// Renders as `args` say. What can be refused is refused before the first ray: wrong options, outputs that cannot be
/// written, scenes that cannot be read, images that do not fit into memory, checkpoints of something else.
pub fn run(args: &RenderArgs) -> Result<Exit, Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let interrupt = Interrupt::watch().map_err(|error| Failure::usage(format!("cannot watch for signals: {error}")))?;
    let only = only(args)?;
    refuse_needless(args)?;
    let outputs = outputs(args)?;
    check_places(args, &outputs)?;
    let pool = args.paths.thread_pool()?;
    let mut phases = Phases::start();

    let mut opened = Opened::read(&args.scene, terminal)?;
    phases.end("read");
    let sensor = camera::sensor(&args.size, DEFAULT_WIDTH, args.filter.padding(), &opened.view);
    let settings = settings(args, crop(args, sensor)?, only);
    let of_image = check_memory(args, &settings)?;
    check_light_subpaths(&settings)?;
    if let (None, Some(samples)) = (args.scene.build, announced(args, sensor)) {
        opened.loaded.geometry.set_effort_for(samples);
    }
    let (view, scene_hash) = (opened.view.clone(), opened.loaded.hash.clone());
    let (shown, variant) = (opened.shown, opened.loaded.summary.variant);
    let (scene, environment) = opened.into_scene(&args.scene, sensor, terminal)?;
    let lights = args.paths.lights.unwrap_or_else(|| args.integrator.choice_among(scene.lights()));
    let scene = scene.choosing_lights(lights);
    check_light_samples(&scene, &settings)?;
    let kept = kept(args, &scene)?;
    let keep = |path: &JoinedPath| kept.as_ref().is_none_or(|(_, kept)| kept.holds(&scene, path));
    let (paths, camera) = (kept.as_ref().map(|(text, _)| text.clone()), &view);
    let merging = settings.integrator.merges().then(|| MergeRadius::of(&scene, settings.merge_radius));
    let job =
        Job { scene_hash, shown, variant, camera, sensor, settings: &settings, merging, lights, paths, environment };
    foretell(&job, &scene, max_depth(args), terminal);

    let Wanted { passes, goal, whole } = wanted(args);
    let renderer = pool.install(|| Renderer::new(&scene, &settings));
    phases.end("build");
    check_light_vertices(args, &renderer, &scene, of_image)?;
    let recorded = recorded(args, &job, &scene);
    let layers =
        args.layers.choose(&args.size, args.data.memory(renderer.film().crop().pixels()), &scene, &renderer)?;
    let renderer = if layers.is_empty() { renderer } else { renderer.with_layers(&layers) };
    let renderer = if kept.is_some() { renderer.keeping(&keep) } else { renderer };
    let mut renderer = match &args.part.resume {
        None => renderer.starting_at(passes.start),
        Some(path) => saved::resume(renderer, path, sensor, &recorded, passes)?,
    };
    phases.end("resume");
    let mut keeper = Keeper::new(&args.part, &outputs, sensor, &recorded, whole);
    let mut progress = Progress::new(args.progress, terminal);
    progress.event(|| started(&job, &renderer, whole));
    let quality = args.noise.map(Quality::new);
    let mut viewer = Viewer::connect(args.display.as_deref(), shown_as(args), terminal);
    let watchers = (&mut progress, &mut viewer);
    let ended = pass_loop::run(&mut renderer, &pool, (goal, quality), &mut keeper, &interrupt, watchers, terminal);
    pass_loop::summarise(&renderer, &ended.moment, terminal);
    let black = Black { scene: &scene, settings: &settings, kept: job.paths.as_deref() }.why(&renderer);
    let (job, recorded, outputs, renderer, keeper) = (&job, &recorded, &outputs, &renderer, &keeper);
    let rendered = Rendered { args, job, recorded, whole, outputs, renderer, ended, black, keeper, pool: &pool };
    rendered.finish(&progress, phases, terminal)
}

/// The longest paths, in edges.
fn max_depth(args: &RenderArgs) -> u32 {
    if args.preset == Some(Preset::Direct) { 2 } else { args.paths.max_depth }
}

/// The paths that are in the image, with their expression; `None` for all.
fn kept(args: &RenderArgs, scene: &Scene) -> Result<Option<(String, PathClasses)>, Failure> {
    let whitted = || Expression::parse(WHITTED).map_err(|error| Failure::usage(error.to_string()));
    let expression = match args.preset {
        Some(Preset::Whitted) => Some(whitted()?),
        _ => args.kept.clone(),
    };
    let compile = |expression: Expression| {
        let classes = PathClasses::new(&expression, scene);
        Ok((expression.to_string(), classes.map_err(|error| Failure::usage(format!("--paths: {error}")))?))
    };
    expression.map(compile).transpose()
}

/// Refuses options that the integrator has no use for, and such as contradict each other: somebody expects something of
/// them.
fn refuse_needless(args: &RenderArgs) -> Result<(), Failure> {
    let kind = args.integrator;
    if args.hemisphere.is_some() && (!kind.has_strategies() || kind.has(|x| x.s > 0)) {
        return Err(Failure::usage(format!("--hemisphere says how -i path-hemisphere samples, and this is -i {kind}")));
    }
    let none = |what: &str| Err(Failure::usage(format!("-i {kind} {what}")));
    let by_area = !kind.has_strategies();
    let walks_from_camera = kind.has(|x| x.t >= 2);
    let samples_lights = kind.has(|x| x.s == 1 && x.t >= 2);
    if args.splits.is_some() && !walks_from_camera {
        return none("walks no paths from the camera that --splits could split");
    }
    if args.light_samples.is_some() && by_area {
        return none("takes one sample of each length of paths: --light-samples is for others");
    }
    if (args.light_samples.is_some() || args.paths.lights.is_some()) && !samples_lights && !by_area {
        return none("samples no lights at the vertices of a path: --light-samples and --lights are for others");
    }
    if args.connection_roulette.is_some() && !kind.has(|x| x.s >= 1) {
        return none("has no connections that --connection-roulette could end");
    }
    if by_area && matches!(args.paths.lights, Some(LightChoice::All | LightChoice::Tree)) {
        return none("draws points of all emitters: --lights uniform or power");
    }
    if args.light_paths.is_some() && !kind.has(|x| x.t == 1 || x.s >= 2) {
        return none("walks no paths from lights that --light-paths could count");
    }
    if args.light_vertices.is_some() && !kind.has(|x| x.s >= 2 && x.t >= 2) {
        return none("connects no vertices of light paths that --light-vertices could choose");
    }
    if args.merge_radius.is_some() && (!kind.merges() || args.unweighted) {
        return none("merges no paths: --merge-radius is for -i vcm");
    }
    if args.rays.is_some() && !walks_from_camera {
        return none("has no rays at the first surface that --rays could count");
    }
    check_depths(args)
}

/// Refuses ranges of lengths with no path in them.
fn check_depths(args: &RenderArgs) -> Result<(), Failure> {
    let (least, most) = (args.min_depth, max_depth(args));
    if least > most {
        return Err(Failure::usage(format!("no path has {least} edges or more and {most} at most: raise --max-depth")));
    }
    Ok(())
}

/// Refuses places where what is to be written cannot be.
fn check_places(args: &RenderArgs, outputs: &Outputs) -> Result<(), Failure> {
    Keeper::check(&args.part, outputs)?;
    stats::check(args.stats.as_ref(), outputs)?;
    args.layers.check(outputs)?;
    args.data.check(args.part.shard, args.spp, outputs)
}

/// The image's name in a viewer.
fn shown_as(args: &RenderArgs) -> String {
    let scene = args.scene.file.file_stem().unwrap_or_default().to_string_lossy();
    format!("{scene}, {} (pathspace)", args.integrator)
}

/// The first object of `--progress json`.
fn started(job: &Job<'_>, renderer: &Renderer<'_>, whole: Option<u32>) -> Value {
    json!({
        "event": "start",
        "layout": stats::LAYOUT,
        "version": env!("CARGO_PKG_VERSION"),
        "scene": job.scene_hash,
        "width": job.sensor.width,
        "height": job.sensor.height,
        "integrator": job.settings.integrator.name(),
        "whole_spp": whole,
        "first_sample": renderer.range().start,
        "resumed_spp": renderer.passes(),
    })
}

/// Which passes are to be rendered.
struct Wanted {
    passes: Range<u32>,
    goal: Goal,
    /// How many there are in the whole image, if that is known.
    whole: Option<u32>,
}

fn wanted(args: &RenderArgs) -> Wanted {
    if let Some(time) = args.time {
        return Wanted { passes: 0..MOST_PASSES, goal: Goal::Time(time), whole: None };
    }
    let spp = args.spp.unwrap_or(if args.noise.is_some() { MOST_FOR_NOISE } else { DEFAULT_SPP });
    let passes = args.part.shard.map_or(0..spp, |shard| shard.passes(spp));
    Wanted { goal: Goal::Passes(passes.len() as u32), passes, whole: Some(spp) }
}

/// About how many samples the whole image will have, whichever part of it this is; `None` where nobody can say.
fn announced(args: &RenderArgs, sensor: Sensor) -> Option<u64> {
    /// Of two cores, in small scenes.
    const SAMPLES_A_SECOND: f64 = 1e6;
    match (args.time, args.noise) {
        (Some(time), _) => Some((time.as_secs_f64() * SAMPLES_A_SECOND) as u64),
        (None, Some(_)) => None,
        (None, None) => Some(u64::from(args.spp.unwrap_or(DEFAULT_SPP)) * u64::from(sensor.pixels())),
    }
}

fn only(args: &RenderArgs) -> Result<Option<(Strategy, Weighting)>, Failure> {
    let Some(strategy) = args.only_strategy else { return Ok(None) };
    if !args.integrator.has_strategies() {
        return Err(Failure::usage(
            "area sampling has no strategies (s,t): leave --only-strategy out, or choose -i bdpt",
        ));
    }
    if strategy.s + strategy.t - 1 > max_depth(args) {
        let Strategy { s, t } = strategy;
        let edges = s + t - 1;
        return Err(Failure::usage(format!(
            "strategy ({s},{t}) makes paths of {edges} edges, more than --max-depth {}",
            max_depth(args)
        )));
    }
    Ok(Some((strategy, if args.unweighted { Weighting::Unweighted } else { Weighting::Weighted })))
}

/// The files to write.
fn outputs(args: &RenderArgs) -> Result<Outputs, Failure> {
    if !args.output.is_empty() {
        let outputs = Outputs::check(args.output.clone())?;
        if args.part.shard.is_some() {
            outputs.refuse_png("a shard")?;
        }
        return Ok(outputs);
    }
    let stem = args.scene.file.file_stem().unwrap_or("pathspace".as_ref());
    let integrator = args.integrator;
    let ends = match args.part.shard {
        Some(Shard { index, count }) => vec![format!("-{integrator}-{index}-of-{count}.exr")],
        None => [".exr", ".png"].map(|extension| format!("-{integrator}{extension}")).to_vec(),
    };
    let name = |end: String| {
        let mut name = stem.to_owned();
        name.push(end);
        PathBuf::from(name)
    };
    Outputs::check(ends.into_iter().map(name).collect())
}

fn crop(args: &RenderArgs, sensor: Sensor) -> Result<Crop, Failure> {
    let crop = args.crop.unwrap_or(Crop::full(sensor));
    if crop.fits(sensor) {
        return Ok(crop);
    }
    let Crop { x0, y0, x1, y1 } = crop;
    let Sensor { width, height, .. } = sensor;
    Err(Failure::usage(format!("the crop {x0},{y0},{x1},{y1} reaches beyond the image of {width}×{height} pixels")))
}

fn settings(args: &RenderArgs, crop: Crop, only: Option<(Strategy, Weighting)>) -> Settings {
    let samples_lights = args.integrator.has(|x| x.s == 1 && x.t >= 2);
    // Without MIS, next-event samples alone count for direct light: splitting adds none.
    let follows_directions = args.integrator.description().heuristic != Heuristic::FirstSupported;
    Settings {
        integrator: args.integrator,
        hemisphere: args.hemisphere.unwrap_or_default(),
        max_depth: max_depth(args).min(args.integrator.description().longest_path),
        min_depth: args.min_depth,
        light_samples: args.rays.filter(|_| samples_lights).or(args.light_samples).unwrap_or(1),
        splits: args.rays.filter(|_| follows_directions).or(args.splits).unwrap_or(1),
        light_paths: args.light_paths.unwrap_or(1),
        light_vertices: args.light_vertices,
        merge_radius: args.merge_radius,
        connection_roulette: args.connection_roulette,
        roulette: args.paths.roulette.unwrap_or(args.integrator.description().roulette),
        only,
        weights: args.weights.unwrap_or(args.integrator.description().weights),
        sampler: args.sampler.unwrap_or(args.integrator.description().sampler),
        seed: args.paths.seed,
        filter: args.filter,
        crop,
        clamp: args.clamp,
        background: if args.transparent { Background::Transparent } else { Background::Shown },
    }
}

/// Refuses an image that does not fit; what it needs, in bytes.
fn check_memory(args: &RenderArgs, settings: &Settings) -> Result<u64, Failure> {
    let pixels = settings.crop.pixels();
    let alpha = match settings.background {
        Background::Shown => 0,
        Background::Transparent => AlphaSums::memory(pixels) + ALPHA_BYTES_PER_PIXEL * pixels,
    };
    // A checkpoint is there twice while it is written: as integers, and as the file.
    let transparent = settings.background == Background::Transparent;
    let checkpoint = 2 * Contents { transparent, ..Contents::default() }.bytes(pixels);
    let needed = Film::memory(pixels) + alpha + checkpoint.max(IMAGE_BYTES_PER_PIXEL * pixels);
    let needed = needed + args.data.memory(pixels);
    args.size.check_memory(needed, settings.crop)?;
    Ok(needed)
}

/// Refuses light paths that a thread would have to keep and has no room for.
fn check_light_subpaths(settings: &Settings) -> Result<(), Failure> {
    let of_a_thread = settings.light_subpath_memory();
    if of_a_thread > MOST_LIGHT_SUBPATHS {
        return Err(Failure::usage(format!(
            "--light-vertices would keep {} MB of light paths for each thread: fewer --light-paths, or a lower \
             --max-depth",
            of_a_thread >> 20
        )));
    }
    Ok(())
}

/// Refuses more light vertices for merges than there is room for.
fn check_light_vertices(
    args: &RenderArgs,
    renderer: &Renderer<'_>,
    scene: &Scene,
    of_image: u64,
) -> Result<(), Failure> {
    let kept = renderer.integrator().kept_memory(scene);
    let limit = args.size.memory_limit.0.saturating_sub(of_image).min(MOST_KEPT);
    // Light paths have numbers of 32 bits, too.
    let paths = u64::from(scene.camera.sensor().pixels()) * u64::from(args.light_paths.unwrap_or(1));
    if kept == 0 || (kept <= limit && paths <= u64::from(u32::MAX)) {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "-i {} would keep the light vertices of {paths} light paths in a pass, about {} MiB, where {} MiB are left: a \
         smaller image, fewer --light-paths, a lower --max-depth, or --memory-limit",
        args.integrator,
        kept >> 20,
        limit >> 20
    )))
}

/// Refuses more samples of lights at a vertex than anybody waits for.
fn check_light_samples(scene: &Scene, settings: &Settings) -> Result<(), Failure> {
    let samples = u64::from(scene.lights().next_event_samples()) * u64::from(settings.light_samples);
    if samples > MOST_RAYS {
        return Err(Failure::usage(format!(
            "{samples} samples of lights at a vertex are too many: --lights tree, or fewer --light-samples"
        )));
    }
    Ok(())
}

/// What the image's header says whatever the number of samples.
fn recorded(args: &RenderArgs, job: &Job<'_>, scene: &Scene) -> BTreeMap<String, String> {
    let mut recorded = header::settings(job);
    if scene.culls_back_faces() {
        recorded.insert("back-faces".to_owned(), "culled for the camera".to_owned());
    }
    args.layers.record(&mut recorded);
    recorded
}
