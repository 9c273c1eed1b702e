//! `pathspace render`.

use std::{path::PathBuf, time::Instant};

use rayon::ThreadPool;

use super::{
    args::RenderArgs,
    camera,
    exit::Failure,
    header::{Job, header},
    opened::Opened,
    progress::{Clock, Goal, Moment, Progress},
    terminal::Terminal,
};
use crate::{
    film::{Coverage, Crop, Exposure, Film, Format, check_writable, encode_exr, encode_png, write_atomically},
    integrator::{IntegratorKind, Weighting},
    path::Strategy,
    render::{Background, Renderer, Settings},
    scene::{Scene, camera::Sensor, light::Light},
};

const DEFAULT_SPP: u32 = 64;
const DEFAULT_WIDTH: u32 = 512;
/// Besides the film's sums: the image, two halves while the noise is estimated, and the files before they are written.
const IMAGE_BYTES_PER_PIXEL: u64 = 52;
/// The same of the alpha channel.
const ALPHA_BYTES_PER_PIXEL: u64 = 12;

/// Renders as `args` say. What can be refused is refused before the first ray: wrong options, outputs that cannot be
/// written, scenes that cannot be read, images that do not fit into memory.
pub(super) fn run(args: &RenderArgs) -> Result<(), Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let only = only(args)?;
    if args.hemisphere.is_some() && args.integrator != IntegratorKind::PathHemisphere {
        let name = args.integrator;
        return Err(Failure::usage(format!("--hemisphere says how -i path-hemisphere samples, and this is -i {name}")));
    }
    let outputs = outputs(args)?;
    let pool = args.paths.thread_pool()?;

    let opened = Opened::read(&args.scene, terminal)?;
    let sensor = camera::sensor(&args.size, DEFAULT_WIDTH, args.filter.padding(), &opened.view);
    let settings = settings(args, crop(args, sensor)?, only);
    check_memory(args, &settings)?;
    let (view, shown, scene_hash) = (opened.view.clone(), opened.shown, opened.loaded.hash.clone());
    let (scene, environment) = opened.into_scene(&args.scene, sensor, terminal)?;
    let job = Job { scene_hash, shown, camera: &view, sensor, settings: &settings, environment };
    foretell(&job, &scene, args.paths.max_depth, terminal);

    let mut renderer = pool.install(|| Renderer::new(&scene, &settings));
    let goal = args.time.map_or(Goal::Passes(args.spp.unwrap_or(DEFAULT_SPP)), Goal::Time);
    let last = render(&mut renderer, &pool, goal, terminal);
    summarise(&renderer, &last, terminal);
    write(args, &outputs, &job, &renderer, terminal)
}

fn only(args: &RenderArgs) -> Result<Option<(Strategy, Weighting)>, Failure> {
    let Some(strategy) = args.only_strategy else { return Ok(None) };
    if args.integrator == IntegratorKind::Area {
        return Err(Failure::usage(
            "area sampling has no strategies (s,t): leave --only-strategy out, or choose -i bdpt",
        ));
    }
    if strategy.s + strategy.t - 1 > args.paths.max_depth {
        let Strategy { s, t } = strategy;
        let edges = s + t - 1;
        return Err(Failure::usage(format!(
            "strategy ({s},{t}) makes paths of {edges} edges, more than --max-depth {}",
            args.paths.max_depth
        )));
    }
    Ok(Some((strategy, if args.unweighted { Weighting::Unweighted } else { Weighting::Weighted })))
}

/// The files to write, each of a known format and in a place where files can be created.
fn outputs(args: &RenderArgs) -> Result<Vec<(PathBuf, Format)>, Failure> {
    let mut paths = args.output.clone();
    if paths.is_empty() {
        let mut stem = args.scene.file.file_stem().unwrap_or("pathspace".as_ref()).to_owned();
        stem.push("-");
        stem.push(args.integrator.name());
        for extension in [".exr", ".png"] {
            let mut name = stem.clone();
            name.push(extension);
            paths.push(name.into());
        }
    }
    let with_format = |path: PathBuf| {
        let refuse = |reason| Failure::usage(format!("cannot write '{}': {reason}", path.display()));
        let format = Format::of(&path).map_err(refuse)?;
        Ok((path, format))
    };
    let outputs = paths.into_iter().map(with_format).collect::<Result<Vec<_>, Failure>>()?;
    for (path, _) in &outputs {
        check_writable(path).map_err(|error| Failure::output(error.to_string()))?;
    }
    Ok(outputs)
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
    Settings {
        integrator: args.integrator,
        hemisphere: args.hemisphere.unwrap_or_default(),
        max_depth: args.paths.max_depth.min(args.integrator.longest_path()),
        roulette: args.paths.roulette.unwrap_or(args.integrator.roulette()),
        only,
        sampler: args.sampler.unwrap_or(args.integrator.sampler()),
        seed: args.paths.seed,
        filter: args.filter,
        crop,
        clamp: args.clamp,
        background: if args.transparent { Background::Transparent } else { Background::Shown },
    }
}

fn check_memory(args: &RenderArgs, settings: &Settings) -> Result<(), Failure> {
    let pixels = settings.crop.pixels();
    let alpha = match settings.background {
        Background::Shown => 0,
        Background::Transparent => Coverage::memory(pixels) + ALPHA_BYTES_PER_PIXEL * pixels,
    };
    let needed = Film::memory(pixels) + IMAGE_BYTES_PER_PIXEL * pixels + alpha;
    args.size.check_memory(needed, settings.crop)
}

/// Says beforehand what would surprise afterwards. `max_depth` is what was asked for.
fn foretell(job: &Job<'_>, scene: &Scene, max_depth: u32, terminal: Terminal) {
    let Job { sensor, settings, .. } = job;
    let Sensor { width, height, .. } = sensor;
    let integrator = settings.integrator;
    terminal.detail(format_args!("rendering {width}×{height} pixels with {integrator}"));
    let specular = 100.0 * scene.seen_specular_fraction();
    if settings.integrator == IntegratorKind::Light && specular > 0.0 {
        terminal.warn(format_args!(
            "mirrors and glass that the camera sees, about {specular:.1} % of the image, will be black: light tracing \
             connects every vertex to the camera, and a mirror reflects a given connection with probability zero (-i \
             bdpt or hybrid see them)"
        ));
    }
    let around = |light: &Light| matches!(light, Light::Environment { .. } | Light::EnvironmentMap(_));
    let background = settings.background == Background::Shown && scene.lights().all().iter().any(around);
    if integrator == IntegratorKind::Light && scene.camera.is_orthographic() && background {
        terminal.warn(
            "the environment behind the scene will not be seen: light from it arrives along an orthographic camera's one \
             direction with probability zero (-i path, bdpt or hybrid see it)",
        );
    }
    if scene.lights().is_empty() {
        terminal.warn("the scene has no light, so the image will be black");
    }
    if integrator == IntegratorKind::Area {
        if max_depth > settings.max_depth {
            let longest = settings.max_depth;
            terminal
                .say(format_args!("note: area sampling stops at paths of {longest} edges, whatever --max-depth says"));
        }
        if specular > 0.0 {
            terminal.warn(
                "mirrors and glass will be black: area sampling never finds their one direction (-i path or bdpt do)",
            );
        }
        if !scene.lights().all().iter().all(|light| matches!(light, Light::Area { .. })) {
            terminal.warn(
                "lights that are no surfaces will be dark: area sampling finds emitting surfaces alone (-i bdpt)",
            );
        }
    }
    if settings.integrator == IntegratorKind::PathHemisphere && !scene.lights().all().iter().all(Light::has_extent) {
        terminal.warn(
            "point lights, spots and suns will be dark: path-hemisphere waits until a walk hits a light, and these \
             have no extent (-i path or bdpt sample them)",
        );
    }
    if settings.integrator.traces_from_lights() && settings.crop != Crop::full(*sensor) {
        let part = 100.0 * settings.crop.pixels() as f64 / f64::from(sensor.pixels());
        terminal.say(format_args!(
            "note: the crop is {part:.1} % of the image, but all of its light paths are traced, since any may land there"
        ));
    }
}

fn render(renderer: &mut Renderer<'_>, pool: &ThreadPool, goal: Goal, terminal: Terminal) -> Moment {
    let start = Instant::now();
    let mut progress = Progress::new(terminal);
    let mut noise = None;
    while !goal.is_reached(renderer.passes(), start.elapsed()) {
        pool.install(|| renderer.pass());
        if progress.is_due() {
            noise = renderer.film().noise(renderer.passes()).or(noise);
            let moment = moment(renderer, goal, start, noise);
            progress.show(moment.fraction(), &moment);
        }
    }
    progress.finish();
    let end = moment(renderer, goal, start, None);
    Moment { noise: renderer.film().noise(end.passes), ..end }
}

fn moment(renderer: &Renderer<'_>, goal: Goal, start: Instant, noise: Option<f64>) -> Moment {
    let passes = renderer.passes();
    let samples = renderer.film().crop().pixels() * u64::from(passes);
    Moment { goal, passes, elapsed: start.elapsed(), samples, rays: renderer.statistics().rays, noise }
}

/// What was done, what is known about the noise, and what went wrong.
fn summarise(renderer: &Renderer<'_>, end: &Moment, terminal: Terminal) {
    let statistics = renderer.statistics();
    terminal.detail(format_args!("{} samples, {} rays", statistics.samples, statistics.rays));
    for (technique, count) in statistics.rejected {
        terminal.warn(format_args!("technique {technique} made {count} contributions that are no number, left out"));
    }
    let errors = renderer.film().errors();
    let faults = [
        (errors.non_finite, "contributions were not finite and are left out"),
        (errors.negative, "contributions were negative and are left out"),
        (errors.out_of_range, "contributions were too large for the film and are left out"),
        (errors.overflow, "sums of pixels overflowed: these pixels are wrong"),
    ];
    for (count, what) in faults.into_iter().filter(|(count, _)| *count > 0) {
        terminal.warn(format_args!("{count} {what}"));
    }
    let noise = match end.noise {
        Some(noise) => format!("noise {noise:.2e} (relMSE, from two half images)"),
        None if end.passes == 1 => "noise unknown (one sample per pixel)".to_owned(),
        None => "noise unknown (odd number of samples)".to_owned(),
    };
    terminal.say(format_args!("{} spp in {}, {noise}", end.passes, Clock(end.elapsed)));
}

fn write(
    args: &RenderArgs,
    outputs: &[(PathBuf, Format)],
    job: &Job<'_>,
    renderer: &Renderer<'_>,
    terminal: Terminal,
) -> Result<(), Failure> {
    let (film, passes) = (renderer.film(), renderer.passes());
    let (image, alpha) = (film.image(passes), renderer.alpha());
    let exposure = args.exposure.map_or(Exposure::Auto, Exposure::Ev);
    for (path, format) in outputs {
        let bytes = match format {
            Format::Exr => encode_exr(&image, alpha.as_deref(), &header(job, film, passes)),
            Format::Png => {
                terminal.detail(format_args!("exposure {:+.2} EV", exposure.ev(&image)));
                encode_png(&image, alpha.as_deref(), exposure)
            }
        };
        let refuse = |error| Failure::output(format!("cannot write '{}': {error}", path.display()));
        write_atomically(path, &bytes.map_err(refuse)?).map_err(|error| Failure::output(error.to_string()))?;
    }
    let names: Vec<_> = outputs.iter().map(|(path, _)| path.display().to_string()).collect();
    terminal.say(format_args!("wrote {}", names.join(" and ")));
    Ok(())
}
