//! `pathspace render`.

pub mod args;
mod black;
pub mod data;
mod denoise;
mod foretell;
mod frames;
pub mod keep;
pub mod pass_loop;
pub mod rendered;
pub mod stats;
mod viewer;

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::{ControlFlow, Range},
    path::{Path, PathBuf},
};

use pathspace::{
    choice::Say,
    denoise::Denoiser,
    film::{AlphaSums, Contents, Crop, DENOISED, Film, Format},
    io::{Limits, read_attributes},
    path::JoinedPath,
    render::{Background, MergeRadius, Renderer, Settings},
    scene::{Scene, camera::Sensor},
};
use rayon::ThreadPool;
use serde_json::{Value, json};

use crate::cli::{
    render::{
        args::RenderArgs,
        black::Black,
        foretell::foretell,
        keep::Keeper,
        pass_loop::{Next, Quality, Watch},
        rendered::{Rendered, image_header},
        stats::Phases,
        viewer::Viewer,
    },
    shared::{
        camera,
        choice::{Chosen, Task},
        exit::{Exit, Failure},
        header::{self, CHOICE, Job},
        image::{DEFAULT_SPP, DEFAULT_WIDTH, check_light_samples, check_light_subpaths},
        interrupt::Interrupt,
        listening::listening,
        opened::{self, Opened},
        pictures::Outputs,
        progress::{Goal, MOST_PASSES, Moment, Progress},
        saved,
        terminal::Terminal,
        values::Shard,
    },
};

/// With `--noise`: some images have tiles that never become quiet.
const MOST_FOR_NOISE: u32 = 1 << 16;
/// Besides the film's sums: the image, two halves while the noise is estimated, and the files before they are written.
const IMAGE_BYTES_PER_PIXEL: u64 = 52;
/// The same of the alpha channel.
const ALPHA_BYTES_PER_PIXEL: u64 = 12;

/// Renders as `args` say. What can be refused is refused before the first ray: wrong options, outputs that cannot be
/// written, scenes that cannot be read, images that do not fit into memory, checkpoints of something else.
pub fn run(args: &RenderArgs) -> Result<Exit, Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let interrupt = Interrupt::watch().map_err(|error| Failure::usage(format!("cannot watch for signals: {error}")))?;
    let denoiser = refuse(args)?;
    let pool = args.image.paths.thread_pool()?;
    let with = (&pool, denoiser.as_ref(), &interrupt);
    let image = |args: &RenderArgs, said: &mut BTreeSet<String>| image(args, said, with, terminal);
    match args.frames.frames {
        Some(frames) => frames::run(args, frames, (&interrupt, terminal), image),
        None => image(args, &mut BTreeSet::new()),
    }
}

/// Renders one image. What `said` has is not warned of again.
fn image(
    args: &RenderArgs,
    said: &mut BTreeSet<String>,
    (pool, denoiser, interrupt): (&ThreadPool, Option<&Denoiser>, &Interrupt),
    terminal: Terminal,
) -> Result<Exit, Failure> {
    let outputs = outputs(args)?;
    check_places(args, &outputs)?;
    let mut phases = Phases::start();

    let loaded = opened::load_after(&args.scene, said, terminal)?;
    let opened = Opened::new(loaded, &args.scene, terminal)?;
    phases.end("read");
    let go_on = &mut |_| ControlFlow::Continue(());
    with_renderer(args, opened, pool, (&mut phases, go_on), terminal, |ready, phases| {
        let Ready { job, recorded, mut renderer } = ready;
        let Wanted { goal, whole, .. } = wanted(args);
        if let Some(file) = finished(args, &outputs, (job, recorded), &renderer) {
            terminal.say(format_args!("'{}' is finished: left as it is", file.display()));
            return Ok(Exit::Done);
        }
        let mut keeper = Keeper::new(&args.part, &outputs, job.sensor, recorded, whole);
        let mut progress = Progress::new(args.progress, terminal);
        progress.event(|| started(args, job, &renderer, whole));
        let quality = args.noise.map(Quality::new);
        let mut viewer = Viewer::connect(args.display.as_deref(), shown_as(args), terminal);
        interrupt.spare(terminal);
        let mut watchers =
            Watchers { progress: &mut progress, viewer: &mut viewer, keeper: &mut keeper, interrupt, terminal };
        let ended = pass_loop::run(&mut renderer, pool, (goal, quality), &mut watchers);
        interrupt.settle();
        progress.finish();
        viewer.show(&renderer, terminal);
        pass_loop::summarise(&renderer, &ended.moment, terminal);
        let black = black(job, &renderer);
        let (outputs, renderer, keeper) = (&outputs, &renderer, &keeper);
        let rendered = Rendered { args, job, recorded, whole, outputs, renderer, ended, black, keeper, pool, denoiser };
        rendered.finish(&progress, phases, terminal)
    })
}

/// Refuses options that contradict each other, before anything is read; what denoises, if that is asked for.
pub fn refuse(args: &RenderArgs) -> Result<Option<Denoiser>, Failure> {
    args.image.candidates()?;
    args.denoise.load(args.part.shard, &args.layers)
}

/// A render before its first pass.
pub struct Ready<'a> {
    pub job: &'a Job<'a>,
    /// What the header says whatever the number of samples.
    pub recorded: &'a BTreeMap<String, String>,
    pub renderer: Renderer<'a>,
}

/// Makes what renders of a scene and the options, and hands it to `then`: it borrows from what is made here. `hear` is
/// told on this thread how far a pilot is, and may end it.
pub fn with_renderer<R>(
    args: &RenderArgs,
    mut opened: Opened,
    pool: &ThreadPool,
    (phases, hear): (&mut Phases, &mut Say<'_>),
    terminal: Terminal,
    then: impl FnOnce(Ready<'_>, &mut Phases) -> Result<R, Failure>,
) -> Result<R, Failure> {
    let candidates = args.image.candidates()?;
    let sensor = camera::sensor(&args.image.size, DEFAULT_WIDTH, args.image.filter.padding(), &opened.view);
    let crop = crop(args, sensor)?;
    // What is checked here is the same for all candidates.
    let settings = args.image.settings(candidates[0], crop)?;
    let of_image = check_memory(args, &settings)?;
    check_light_subpaths(&settings)?;
    let announced = announced(args, sensor).filter(|_| args.scene.build.is_none());
    announced.into_iter().for_each(|samples| opened.loaded.geometry.set_effort_for(samples));
    let (view, scene_hash) = (opened.view.clone(), opened.loaded.hash.clone());
    let (shown, variant, at) = (opened.shown, opened.loaded.summary.variant, opened.at.clone());
    let (scene, environment) = opened.into_scene(&args.scene, sensor, pool, terminal)?;
    let lights = args.image.paths.lights.unwrap_or_else(|| candidates[0].integrator.choice_among(scene.lights()));
    let mut scene = scene.choosing_lights(lights);
    check_light_samples(&scene, &settings)?;
    phases.end("build");
    let kept = args.image.kept(&scene)?;
    let task = Task { image: &args.image, candidates, crop, hash: &scene_hash, of_image, kept: kept.as_ref() };
    let Chosen { settings, reason, estimates } = listening(pool, |say| task.choose(&mut scene, terminal, say), hear)?;
    let keep = |path: &JoinedPath| kept.as_ref().is_none_or(|(_, kept)| kept.holds(&scene, path));
    let paths = kept.as_ref().map(|(text, _)| text.clone());
    let merging = settings.integrator.merges().then(|| MergeRadius::of(&scene, settings.merge_radius));
    let job = Job {
        scene: &scene,
        scene_hash,
        shown,
        variant,
        at,
        camera: &view,
        sensor,
        settings: &settings,
        estimates,
        merging,
        lights,
        paths,
        environment,
    };
    foretell(&job, &scene, args.image.max_depth(), terminal);

    let renderer = pool.install(|| Renderer::new(&scene, &settings));
    // The pilot of weights is among what is made with the renderer.
    phases.end("choose");
    args.image.check_light_vertices((settings.integrator, renderer.integrator()), &scene, of_image)?;
    let recorded = recorded(args, &job, &scene, reason);
    let pixels = renderer.film().crop().pixels();
    let beside = args.data.memory(pixels, args.denoise.is_asked()) + args.denoise.memory(pixels);
    let layers = args.layers.choose(&args.image.size, beside, &scene, &renderer)?;
    let renderer = if layers.is_empty() { renderer } else { renderer.with_layers(&layers) };
    let renderer = if kept.is_some() { renderer.keeping(&keep) } else { renderer };
    let renderer = at_first_pass(renderer, args, sensor, &recorded)?;
    phases.end("resume");
    then(Ready { job: &job, recorded: &recorded, renderer }, phases)
}

/// Where it has to begin, or to go on.
fn at_first_pass<'a>(
    renderer: Renderer<'a>,
    args: &RenderArgs,
    sensor: Sensor,
    recorded: &BTreeMap<String, String>,
) -> Result<Renderer<'a>, Failure> {
    let passes = wanted(args).passes;
    match &args.part.resume {
        None => Ok(renderer.starting_at(passes.start)),
        Some(path) => saved::resume(renderer, path, sensor, recorded, passes),
    }
}

/// Why the image is black, if it is.
pub fn black(job: &Job<'_>, renderer: &Renderer<'_>) -> Option<String> {
    Black { scene: job.scene, settings: job.settings, kept: job.paths.as_deref() }.why(renderer)
}

/// Who sees a render of the command line.
struct Watchers<'w, 'a> {
    progress: &'w mut Progress,
    viewer: &'w mut Viewer,
    keeper: &'w mut Keeper<'a>,
    interrupt: &'w Interrupt,
    terminal: Terminal,
}

impl Watch for Watchers<'_, '_> {
    fn after_pass(&mut self, renderer: &Renderer<'_>, next: Next, moment: &mut dyn FnMut() -> Moment) -> Option<Exit> {
        if self.progress.is_due() {
            self.progress.show(&moment());
        }
        self.viewer.after_pass(renderer, self.terminal);
        if next == Next::Nothing {
            return None;
        }
        let asked = self.interrupt.asked();
        if asked.is_none() {
            self.keeper.after_pass(renderer, self.terminal);
        }
        asked
    }
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
    format!("{scene}, {} (pathspace)", args.image.integrator.name())
}

/// The first object of `--progress json`.
fn started(args: &RenderArgs, job: &Job<'_>, renderer: &Renderer<'_>, whole: Option<u32>) -> Value {
    json!({
        "event": "start",
        "layout": stats::LAYOUT,
        "version": env!("CARGO_PKG_VERSION"),
        "scene": job.scene_hash,
        "frame": args.frames.this.as_ref().map(|frame| frame.number),
        "width": job.sensor.width,
        "height": job.sensor.height,
        "integrator": job.settings.integrator.name(),
        "whole_spp": whole,
        "first_sample": renderer.range().start,
        "resumed_spp": renderer.passes(),
    })
}

/// Which passes are to be rendered.
pub struct Wanted {
    pub passes: Range<u32>,
    pub goal: Goal,
    /// How many there are in the whole image, if that is known.
    pub whole: Option<u32>,
}

pub fn wanted(args: &RenderArgs) -> Wanted {
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

/// The output that is finished already: of the same settings, with all samples that are wanted, among frames that are
/// gone on with. Another format than OpenEXR does not say what it is.
fn finished<'o>(
    args: &RenderArgs,
    outputs: &'o Outputs,
    of: (&Job<'_>, &BTreeMap<String, String>),
    renderer: &Renderer<'_>,
) -> Option<&'o Path> {
    if !args.frames.goes_on {
        return None;
    }
    let is_there = outputs.paths().all(|path| path.exists());
    let (path, _) = outputs.0.iter().find(|(_, format)| *format == Format::Exr).filter(|_| is_there)?;
    let found = read_attributes(&Limits::default(), path).ok()?;
    let mut header = image_header(args, of, renderer, None).attributes;
    header.retain(|(name, _)| !header::OF_SAMPLES.contains(&name.as_str()));
    header.push((header::SPP.to_owned(), wanted(args).passes.len().to_string()));
    let same = header.iter().all(|(name, value)| name == CHOICE || found.get(name) == Some(value));
    let known = |name: &str| name == DENOISED || header::OF_SAMPLES.contains(&name);
    let more = found.keys().any(|name| !known(name) && !header.iter().any(|(known, _)| known == name));
    let as_asked = found.contains_key(DENOISED) == args.denoise.is_asked();
    (same && !more && as_asked).then_some(path)
}

/// The files to write.
fn outputs(args: &RenderArgs) -> Result<Outputs, Failure> {
    let outputs = Outputs::check(output_paths(args))?;
    if args.part.shard.is_some() && !args.output.is_empty() {
        outputs.refuse_png("a shard")?;
    }
    Ok(outputs)
}

/// Their names.
fn output_paths(args: &RenderArgs) -> Vec<PathBuf> {
    if !args.output.is_empty() {
        return args.output.clone();
    }
    let stem = args.scene.file.file_stem().unwrap_or("pathspace".as_ref());
    let integrator = args.image.integrator.name();
    let ends = match args.part.shard {
        Some(Shard { index, count }) => vec![format!("-{integrator}-{index}-of-{count}.exr")],
        None => [".exr", ".png"].map(|extension| format!("-{integrator}{extension}")).to_vec(),
    };
    let name = |end: String| {
        let mut name = stem.to_owned();
        name.push(end);
        PathBuf::from(name)
    };
    ends.into_iter().map(name).collect()
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
    let needed = needed + args.data.memory(pixels, args.denoise.is_asked()) + args.denoise.memory(pixels);
    args.image.size.check_memory(needed, settings.crop)?;
    Ok(needed)
}

/// What the image's header says whatever the number of samples.
fn recorded(args: &RenderArgs, job: &Job<'_>, scene: &Scene, reason: Option<String>) -> BTreeMap<String, String> {
    let mut recorded = header::settings(job);
    if let Some(reason) = reason {
        recorded.insert(CHOICE.to_owned(), format!("auto: {reason}"));
    }
    if scene.culls_back_faces() {
        recorded.insert("back-faces".to_owned(), "culled for the camera".to_owned());
    }
    args.layers.record(&mut recorded);
    recorded
}
