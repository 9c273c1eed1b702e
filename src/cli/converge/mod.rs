//! `pathspace converge`.

pub mod page;

use std::{ops::ControlFlow, path::PathBuf, time::Duration};

use pathspace::{
    converge::{PYRAMID_DEPTH, Plan, Report, Stage, converge},
    film::{Crop, Film, Image, check_writable, write_atomically},
    integrator::IntegratorKind,
    io::{ImageError, Limits, read_image},
    scene::{Scene, camera::Sensor, light::LightChoice},
    verify::Budget,
};
use rayon::ThreadPool;

use crate::cli::{
    info,
    render::keep::this_command,
    shared::{
        args::{BudgetArgs, PathArgs, SceneArgs, SizeArgs, VerbosityArgs, check_distinct},
        camera,
        denoised::is_denoised,
        exit::{Exit, Failure},
        interrupt::Interrupt,
        listening::listening,
        opened::Opened,
        progress::{Progress, Step, Style},
        terminal::Terminal,
        values,
    },
};

const DEFAULT_WIDTH: u32 = 256;
const DEFAULT_TIME: Duration = Duration::from_secs(20);
/// Of the reference, in budgets of an integrator.
const LONGER: u32 = 8;

/// What `pathspace converge` is asked for.
#[derive(Debug, clap::Args)]
pub struct ConvergeArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// The page to write, .html; all numbers go beside it as .json and .csv [default: SCENE-converge.html in the
    /// working directory]
    #[arg(short, long, value_name = "PAGE")]
    output: Option<PathBuf>,

    /// Integrators to measure
    #[arg(
        short,
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = "path,light,bdpt",
        value_parser = values::comparable()
    )]
    integrators: Vec<IntegratorKind>,

    #[command(flatten)]
    budget: BudgetArgs,

    /// Measure errors against this image, .exr, instead of a long bdpt run
    #[arg(long, value_name = "R")]
    reference: Option<PathBuf>,

    /// Time of that bdpt run [default: 8 times that of an integrator, or 8 times the samples]
    #[arg(long, value_name = "TIME", conflicts_with = "reference", value_parser = values::duration)]
    reference_time: Option<Duration>,

    #[command(flatten)]
    size: SizeArgs,

    #[command(flatten)]
    pub paths: PathArgs,

    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// Measures, and writes the page. What can be refused is refused before the first ray.
pub fn run(args: &ConvergeArgs) -> Result<Exit, Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let interrupt = Interrupt::watch().map_err(|error| Failure::usage(format!("cannot watch for signals: {error}")))?;
    refuse(args)?;
    let title = args.scene.file.file_stem().unwrap_or("pathspace".as_ref()).to_string_lossy().into_owned();
    let files = files(args, &title)?;
    let pool = args.paths.thread_pool()?;
    let given = given(args)?;

    let opened = Opened::read(&args.scene, terminal)?;
    let seen = seen(args, given.as_ref(), opened, &pool, terminal)?;
    let plan = plan(args);
    let mut progress = Progress::new(Style::Auto, terminal);
    interrupt.spare(terminal);
    let hear = |stage| {
        if progress.is_due() {
            progress.show(&stage);
        }
        if interrupt.asked().is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let report = listening(&pool, |say| converge(&seen.scene, &plan, given, say), hear);
    interrupt.settle();
    progress.finish();
    let report = report.map_err(|error| Failure::usage(error.to_string()))?;
    let facts = seen.facts((title, this_command()), args, &plan, &pool);
    write(&files, &facts, &report)?;
    terminal.say(format_args!("wrote {} with its .json and .csv", files[0].display()));
    match interrupt.asked().filter(|_| report.ended_early) {
        Some(exit) => {
            terminal.say("interrupted: the page has what was measured by then");
            Ok(exit)
        }
        None => Ok(Exit::Done),
    }
}

/// Refuses what contradicts itself.
pub fn refuse(args: &ConvergeArgs) -> Result<(), Failure> {
    check_distinct(&args.integrators)
}

/// The scene, and what the page says of it.
pub struct Seen {
    pub scene: Scene,
    scene_hash: String,
    environment: Option<String>,
    lights: LightChoice,
}

impl Seen {
    /// What a page says of a measurement by this plan besides its results, under a title and with the command that made
    /// it.
    pub fn facts<'a>(
        &self,
        (title, command): (String, String),
        args: &'a ConvergeArgs,
        plan: &'a Plan,
        pool: &ThreadPool,
    ) -> page::Facts<'a> {
        page::Facts {
            title,
            command,
            scene: info::counts(&self.scene),
            scene_hash: self.scene_hash.clone(),
            environment: self.environment.clone(),
            lights: self.lights,
            threads: pool.current_num_threads(),
            plan,
            given: args.reference.as_deref(),
        }
    }
}

/// The scene as the options show it.
pub fn seen(
    args: &ConvergeArgs,
    given: Option<&Image>,
    opened: Opened,
    pool: &ThreadPool,
    terminal: Terminal,
) -> Result<Seen, Failure> {
    let sensor = camera::sensor(&args.size, DEFAULT_WIDTH, 0, &opened.view);
    check_sizes(args, given, sensor)?;
    let scene_hash = opened.loaded.hash.clone();
    let (scene, environment) = opened.into_scene(&args.scene, sensor, pool, terminal)?;
    let lights = args.paths.lights.unwrap_or_else(|| scene.lights().suitable_choice());
    Ok(Seen { scene: scene.choosing_lights(lights), scene_hash, environment, lights })
}

/// The page, its JSON and its CSV: places that can be written.
fn files(args: &ConvergeArgs, title: &str) -> Result<[PathBuf; 3], Failure> {
    let page = args.output.clone().unwrap_or_else(|| format!("{title}-converge.html").into());
    if page.extension().is_none_or(|extension| extension != "html") {
        return Err(Failure::usage(format!("cannot write '{}': the page is an .html file", page.display())));
    }
    let files = [page.clone(), page.with_extension("json"), page.with_extension("csv")];
    files.iter().try_for_each(|file| check_writable(file)).map_err(|error| Failure::output(error.to_string()))?;
    Ok(files)
}

/// The image of `--reference`.
pub fn given(args: &ConvergeArgs) -> Result<Option<Image>, Failure> {
    let Some(path) = &args.reference else { return Ok(None) };
    let unreadable = |error: ImageError| Failure::input(error.to_string());
    if is_denoised(path).map_err(unreadable)? {
        let path = path.display();
        return Err(Failure::input(format!("'{path}' is denoised, and no error can be measured against its bias")));
    }
    read_image(&Limits::default(), path).map(Some).map_err(unreadable)
}

/// Refuses a reference of another size, and images that do not fit into memory.
fn check_sizes(args: &ConvergeArgs, given: Option<&Image>, sensor: Sensor) -> Result<(), Failure> {
    if let (Some(image), Some(path)) = (given, &args.reference)
        && (image.width, image.height) != (sensor.width, sensor.height)
    {
        let (path, w, h) = (path.display(), image.width, image.height);
        let (width, height) = (sensor.width, sensor.height);
        return Err(Failure::input(format!("'{path}' has {w} × {h} pixels and the image {width} × {height}")));
    }
    let films = 4 * args.integrators.len() as u64 + u64::from((PYRAMID_DEPTH + 1) * (PYRAMID_DEPTH + 2));
    args.size.check_memory(films * Film::memory(Crop::full(sensor).pixels()), Crop::full(sensor))
}

/// What the options ask for.
pub fn plan(args: &ConvergeArgs) -> Plan {
    let budget = args.budget.budget(DEFAULT_TIME);
    let longer = match budget {
        _ if args.reference.is_some() => budget,
        Budget::Time(time) => Budget::Time(time.saturating_mul(LONGER)),
        Budget::Passes(passes) => Budget::Passes(passes * LONGER),
    };
    Plan {
        integrators: args.integrators.clone(),
        max_depth: args.paths.max_depth,
        roulette: args.paths.roulette,
        seed: args.paths.seed,
        budget,
        reference: args.reference_time.map_or(longer, Budget::Time),
    }
}

/// Writes the page, its JSON and its CSV.
fn write(files: &[PathBuf; 3], facts: &page::Facts<'_>, report: &Report) -> Result<(), Failure> {
    let cannot = |error| Failure::output(format!("cannot write '{}': {error}", files[0].display()));
    let json = page::json(facts, report);
    let html = page::html(facts, report, &json).map_err(cannot)?;
    let contents = [html, format!("{json:#}\n"), page::csv(report)];
    for (file, text) in files.iter().zip(contents) {
        write_atomically(file, text.as_bytes()).map_err(|error| Failure::output(error.to_string()))?;
    }
    Ok(())
}

impl Step for Stage {
    fn fraction(&self) -> f64 {
        self.part
    }

    fn json(&self) -> serde_json::Value {
        serde_json::json!({ "event": "progress", "stage": self.what, "fraction": self.part })
    }
}
