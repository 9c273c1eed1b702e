//! `pathspace verify`.

pub mod json;
mod pictures;
mod text;

use std::{fmt, ops::ControlFlow, path::PathBuf, time::Duration};

use pathspace::{
    film::{Crop, Film, check_folder, write_folder},
    integrator::IntegratorKind,
    scene::{Scene, camera::Sensor, light::LightChoice},
    verify::{Budget, Outcome, Plan, Report, verify},
};
use rayon::ThreadPool;

use crate::cli::shared::{
    args::{BudgetArgs, PathArgs, SceneArgs, SizeArgs, VerbosityArgs, check_distinct},
    camera,
    exit::{Exit, Failure},
    listening::listening,
    opened::Opened,
    progress::{Clock, Progress, Step, Style},
    terminal::{self, Terminal},
    values,
};

/// The test is statistical: more pixels would not make it see more.
const DEFAULT_WIDTH: u32 = 128;
const DEFAULT_TIME: Duration = Duration::from_secs(60);
/// An integrator has a film for each set of integrators that cover a path; there are hardly ever more.
const FILMS: u64 = 4;

/// What `pathspace verify` is asked for.
#[derive(Debug, clap::Args)]
pub struct VerifyArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Folder for images, difference, p-value map and verify.json; made if it is not there [default: SCENE-verify in
    /// the working directory]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Integrators to compare, two or more
    #[arg(
        short,
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = "path,light,hybrid,bdpt",
        value_parser = values::comparable()
    )]
    integrators: Vec<IntegratorKind>,

    #[command(flatten)]
    budget: BudgetArgs,

    /// The bias that has to be visible for the answer 'agree', as a part of the image's mean
    #[arg(
        long,
        value_name = "PERCENT",
        default_value = "2%",
        allow_hyphen_values = true,
        value_parser = values::percentage
    )]
    bias: f64,

    #[command(flatten)]
    size: SizeArgs,

    #[command(flatten)]
    pub paths: PathArgs,

    /// Answer in JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// Everything about a verification that is no result.
pub struct Job {
    pub plan: Plan,
    pub sensor: Sensor,
    pub scene_hash: String,
    pub environment: Option<String>,
    pub lights: LightChoice,
}

/// Compares the integrators. What can be refused is refused before the first ray.
pub fn run(args: &VerifyArgs) -> Result<Exit, Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let plan = plan(args)?;
    let folder = folder(args);
    check_folder(&folder).map_err(|error| Failure::output(error.to_string()))?;
    let pool = args.paths.thread_pool()?;

    let opened = Opened::read(&args.scene, terminal)?;
    let (job, scene) = prepared(args, plan, opened, &pool, terminal)?;
    let mut progress = Progress::new(Style::Auto, terminal);
    let budget = job.plan.budget;
    let hear = |part| {
        if progress.is_due() {
            progress.show(&Spent { budget, part });
        }
        ControlFlow::Continue(())
    };
    let report = listening(&pool, |say| verify(&scene, &job.plan, say), hear);
    progress.finish();

    let answer = json::describe(&job, &report);
    let files = files(&job, &report, &answer)
        .map_err(|error| Failure::output(format!("cannot write '{}': {error}", folder.display())))?;
    write_folder(&folder, &files).map_err(|error| Failure::output(error.to_string()))?;
    if args.json {
        terminal::answer(&answer);
    } else if !terminal.is_quiet() {
        terminal::answer(text::describe(&job, &report).trim_end());
    }
    terminal.say(format_args!("wrote {} files into {}", files.len(), folder.display()));
    Ok(exit(&report))
}

/// What is compared, and the scene for it.
pub fn prepared(
    args: &VerifyArgs,
    plan: Plan,
    opened: Opened,
    pool: &ThreadPool,
    terminal: Terminal,
) -> Result<(Job, Scene), Failure> {
    let sensor = camera::sensor(&args.size, DEFAULT_WIDTH, 0, &opened.view);
    let pixels = Crop::full(sensor);
    args.size.check_memory(FILMS * plan.integrators.len() as u64 * Film::memory(pixels.pixels()), pixels)?;
    let scene_hash = opened.loaded.hash.clone();
    let (scene, environment) = opened.into_scene(&args.scene, sensor, pool, terminal)?;
    let lights = args.paths.lights.unwrap_or_else(|| scene.lights().suitable_choice());
    let scene = scene.choosing_lights(lights);
    Ok((Job { plan, sensor, scene_hash, environment, lights }, scene))
}

/// What the options ask for.
pub fn plan(args: &VerifyArgs) -> Result<Plan, Failure> {
    let kinds = &args.integrators;
    check_distinct(kinds)?;
    if kinds.len() < 2 {
        return Err(Failure::usage("one integrator has nothing to be compared with: give -i two or more"));
    }
    let budget = args.budget.budget(DEFAULT_TIME);
    Ok(Plan {
        integrators: kinds.clone(),
        max_depth: args.paths.max_depth,
        roulette: args.paths.roulette.unwrap_or_default(),
        seed: args.paths.seed,
        budget,
        bar: args.bias,
    })
}

fn folder(args: &VerifyArgs) -> PathBuf {
    args.output.clone().unwrap_or_else(|| {
        let mut name = args.scene.file.file_stem().unwrap_or("pathspace".as_ref()).to_owned();
        name.push("-verify");
        name.into()
    })
}

/// The part of the budget that is used up.
struct Spent {
    budget: Budget,
    part: f64,
}

impl Step for Spent {
    fn fraction(&self) -> f64 {
        self.part
    }

    fn json(&self) -> serde_json::Value {
        serde_json::json!({ "event": "progress", "fraction": self.part })
    }
}

impl fmt::Display for Spent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.budget {
            Budget::Time(all) => write!(f, "{} of {}", Clock(all.mul_f64(self.part)), Clock(all)),
            Budget::Passes(all) => write!(f, "{:.0} of {all} spp", self.part * f64::from(all)),
        }
    }
}

/// What goes into the folder, by name.
pub fn files(job: &Job, report: &Report, answer: &serde_json::Value) -> std::io::Result<Vec<(String, Vec<u8>)>> {
    let mut files = pictures::files(job, report)?;
    files.push((json::FILE.to_owned(), format!("{answer:#}\n").into_bytes()));
    Ok(files)
}

/// How the program ends.
pub fn exit(report: &Report) -> Exit {
    match report.outcome {
        Outcome::Agree => Exit::Done,
        Outcome::Disagree => Exit::ComparisonFailed,
        Outcome::Undecided => Exit::Undecided,
    }
}
