//! `pathspace trace`: which paths make a pixel as bright as it is, and what would have found them better.

mod json;
mod text;

use std::ops::ControlFlow;

use glam::DVec3;
use pathspace::{
    choice::Candidate,
    film::Crop,
    path::JoinedPath,
    scene::{
        Scene,
        camera::Sensor,
        geometry::PrimitiveId,
        point::{Place, Point},
    },
    trace::Tracer,
};

use crate::cli::shared::{
    args::{SceneArgs, VerbosityArgs},
    camera,
    choice::{Chosen, Task},
    exit::{Exit, Failure},
    image::{DEFAULT_SPP, DEFAULT_WIDTH, ImageArgs, check_light_samples, check_light_subpaths},
    opened::Opened,
    progress::{MOST_PASSES, Progress, Step, Style},
    terminal::{self, Terminal},
    values,
};

/// What `pathspace trace` is asked for.
#[derive(Debug, clap::Args)]
pub struct TraceArgs {
    #[command(flatten)]
    scene: SceneArgs,

    /// The pixel: its column and its row, from 0,0 in the upper left
    #[arg(long, value_name = "x,y", allow_hyphen_values = true, value_parser = values::pixel)]
    pixel: [u32; 2],

    /// How many of the largest contributions to show
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    top: u32,

    /// Samples per pixel
    #[arg(
        long,
        value_name = "N",
        default_value_t = DEFAULT_SPP,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_PASSES))
    )]
    spp: u32,

    #[command(flatten)]
    image: ImageArgs,

    /// Answer in JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// Which pixel of what is traced.
struct Job<'a> {
    args: &'a TraceArgs,
    candidate: Candidate,
    sensor: Sensor,
    scene_hash: String,
}

/// Traces a pixel by the samples that `render` would take with the same options.
pub fn run(args: &TraceArgs) -> Result<Exit, Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let image = &args.image;
    let candidates = image.candidates()?;
    let pool = image.paths.thread_pool()?;

    let opened = Opened::read(&args.scene, terminal)?;
    let sensor = camera::sensor(&image.size, DEFAULT_WIDTH, image.filter.padding(), &opened.view);
    let crop = pixel(args, sensor)?;
    let settings = image.settings(candidates[0], crop)?;
    check_light_subpaths(&settings)?;
    let scene_hash = opened.loaded.hash.clone();
    let (scene, _) = opened.into_scene(&args.scene, sensor, &pool, terminal)?;
    let lights = image.paths.lights.unwrap_or_else(|| candidates[0].integrator.choice_among(scene.lights()));
    let mut scene = scene.choosing_lights(lights);
    check_light_samples(&scene, &settings)?;
    let kept = image.kept(&scene)?;
    let task = Task { image, candidates, crop, hash: &scene_hash, of_image: 0, kept: kept.as_ref() };
    let go_on = &mut |_| ControlFlow::Continue(());
    let Chosen { settings, .. } = pool.install(|| task.choose(&mut scene, terminal, go_on))?;
    let keep = |path: &JoinedPath| kept.as_ref().is_none_or(|(_, kept)| kept.holds(&scene, path));
    let mut tracer = pool.install(|| Tracer::new(&scene, &settings, Some(&keep), args.top as usize));
    image.check_light_vertices((settings.integrator, tracer.integrator()), &scene, 0)?;

    let mut progress = Progress::new(Style::Auto, terminal);
    for pass in 0..args.spp {
        if progress.is_due() {
            progress.show(&Passes { done: pass, all: args.spp });
        }
        pool.install(|| tracer.pass());
    }
    progress.finish();

    let trace = tracer.finish();
    for (technique, count) in &trace.rejected {
        terminal.warn(format_args!("technique {technique} made {count} contributions that are no number, left out"));
    }
    let job = Job { args, candidate: Candidate::of(&settings), sensor, scene_hash };
    if args.json {
        terminal::answer(format_args!("{:#}", json::describe(&job, &scene, &trace)));
    } else {
        terminal::answer(text::describe(&job, &scene, &trace).trim_end());
    }
    Ok(Exit::Done)
}

/// The pixel as a part of the image.
fn pixel(args: &TraceArgs, sensor: Sensor) -> Result<Crop, Failure> {
    let ([x, y], Sensor { width, height, .. }) = (args.pixel, sensor);
    if x >= width || y >= height {
        return Err(Failure::usage(format!("the pixel {x},{y} is outside the image of {width}×{height} pixels")));
    }
    Ok(Crop { x0: x, y0: y, x1: x + 1, y1: y + 1 })
}

/// The name of the material of a surface.
fn material<'a>(scene: &'a Scene, point: &Point) -> Option<&'a str> {
    let is_surface = point.primitive != PrimitiveId::NONE;
    is_surface.then(|| scene.material(point.material).name.as_str())
}

/// Whether a point is a direction alone: at infinity, or on the film of an orthographic camera.
fn is_direction(point: &Point) -> bool {
    matches!(point.place, Place::Infinite | Place::Film)
}

/// Where a point is in the file's coordinates, or the direction that it is.
fn place(scene: &Scene, point: &Point) -> DVec3 {
    match point.place {
        Place::Film => point.normal.as_dvec3(),
        Place::Infinite => point.position.as_dvec3(),
        Place::Surface | Place::Degenerate => scene.centre + point.position.as_dvec3(),
    }
}

/// So many passes of all.
struct Passes {
    done: u32,
    all: u32,
}

impl Step for Passes {
    fn fraction(&self) -> f64 {
        f64::from(self.done) / f64::from(self.all)
    }

    fn json(&self) -> serde_json::Value {
        serde_json::json!({ "event": "progress", "spp": self.done, "of": self.all })
    }
}

impl std::fmt::Display for Passes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{} spp", self.done, self.all)
    }
}
