//! `--stats`: what a render did and took, as JSON.

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use pathspace::{
    film::{AlphaSums, Film, check_writable, write_atomically},
    render::Renderer,
};
use serde_json::{Map, Value, json};

use crate::cli::{
    render::{keep::Keeper, pass_loop::Ended},
    shared::{choice::described, exit::Failure, header::Job, pictures::Outputs},
};

/// Raised when a key changes its meaning or goes; new keys may come at any time.
pub const LAYOUT: u32 = 2;

/// Refuses a place where no such file can be written, or one that an output takes.
pub fn check(path: Option<&PathBuf>, outputs: &Outputs) -> Result<(), Failure> {
    let Some(path) = path else { return Ok(()) };
    if outputs.paths().any(|output| output == path) {
        let name = path.display();
        return Err(Failure::usage(format!("cannot write '{name}': it is for statistics and an output at once")));
    }
    check_writable(path).map_err(|error| Failure::output(error.to_string()))
}

/// The time that each part of the work took, one after the other.
pub struct Phases {
    last: Instant,
    seconds: Map<String, Value>,
    all: f64,
}

impl Phases {
    pub fn start() -> Self {
        Self { last: Instant::now(), seconds: Map::new(), all: 0.0 }
    }

    /// What was done since the last end was `phase`.
    pub fn end(&mut self, phase: &str) {
        let seconds = self.last.elapsed().as_secs_f64();
        self.seconds.insert(phase.to_owned(), seconds.into());
        self.all += seconds;
        self.last = Instant::now();
    }
}

/// All that is known at the end of a render.
pub struct Stats<'a> {
    pub job: &'a Job<'a>,
    pub renderer: &'a Renderer<'a>,
    pub ended: &'a Ended,
    /// Why the image is black, if it is.
    pub black: Option<&'a str>,
    pub keeper: &'a Keeper<'a>,
    pub phases: &'a Phases,
    pub threads: usize,
}

impl Stats<'_> {
    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        let text = format!("{:#}\n", self.json());
        write_atomically(path, text.as_bytes()).map_err(|error| Failure::output(error.to_string()))
    }

    fn json(&self) -> Value {
        let Self { job, renderer, ended, black, keeper, phases, threads } = self;
        let (statistics, sums) = (renderer.statistics(), renderer.sums());
        let (rays, errors, crop) = (statistics.rays, sums.errors(), sums.film.crop());
        let rejected: Map<_, _> =
            statistics.rejected.iter().map(|(technique, count)| (technique.to_string(), (*count).into())).collect();
        let mut seconds = phases.seconds.clone();
        // They are between the passes, and in their time.
        seconds.insert("checkpoints".to_owned(), keeper.spent().as_secs_f64().into());
        seconds.insert("all".to_owned(), phases.all.into());
        let films = || [sums.film].into_iter().chain(renderer.layer_films());
        let (film, wide) = (films().map(Film::memory_now).sum::<u64>(), films().map(Film::wide_memory).sum::<u64>());
        let alpha_sums = renderer.alpha_sums().map_or(0, |_| AlphaSums::memory(crop.pixels()));
        json!({
            "layout": LAYOUT,
            "version": env!("CARGO_PKG_VERSION"),
            "outcome": ended.outcome(),
            "exit": ended.exit() as u8,
            "scene": job.scene_hash,
            "width": job.sensor.width,
            "height": job.sensor.height,
            "pixels": crop.pixels(),
            "integrator": job.settings.integrator.name(),
            "choice": described(&job.estimates),
            "threads": threads,
            "spp": renderer.passes(),
            "resumed_spp": ended.moment.resumed,
            "first_sample": renderer.range().start,
            "noise": ended.moment.noise,
            "black": black,
            "noise_reached": ended.quality.map(|quality| quality.is_reached()),
            "samples": statistics.samples,
            "rays": {
                "camera": rays.camera,
                "light": rays.light,
                "visibility": rays.visibility,
                "all": rays.total(),
                "spared": statistics.spared,
            },
            "lookups": { "made": statistics.lookups.made, "found": statistics.lookups.found },
            "lost_to_sides": {
                "walks": statistics.lost_to_sides,
                "fraction": statistics.lost_to_sides as f64 / (rays.camera + rays.light).max(1) as f64,
            },
            "this_run": {
                "samples": ended.moment.samples,
                "rays": ended.moment.rays,
                "checkpoints": keeper.written(),
            },
            "seconds": seconds,
            "memory": { "film": film + alpha_sums, "wide_sums": wide, "peak": peak_memory() },
            "rejected": rejected,
            "film_errors": {
                "non_finite": errors.non_finite,
                "overflow": errors.overflow,
            },
        })
    }
}

/// The most memory that the process has had, in bytes, where the system tells.
fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}
