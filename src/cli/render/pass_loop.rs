//! The loop of `pathspace render`: passes until the goal or an interruption, with progress and checkpoints between
//! them.

use std::{fmt, time::Instant};

use pathspace::{
    film::{DepositErrors, ENOUGH_TILES, Film},
    render::{Renderer, Statistics},
};
use rayon::ThreadPool;

use crate::cli::shared::{
    exit::Exit,
    progress::{Clock, Goal, Moment},
    terminal::Terminal,
};

/// Memory that nobody foretold and somebody may miss, MiB.
const MUCH: u64 = 64;

/// A noise at which a render is good enough before its goal.
#[derive(Clone, Copy)]
pub struct Quality {
    /// As [`Film::tile_noise`].
    pub below: f64,
    /// What it was when it was last looked at.
    found: Option<f64>,
}

impl Quality {
    /// Fewer passes say little of their noise.
    const FIRST: u32 = 16;

    pub fn new(below: f64) -> Self {
        Self { below, found: None }
    }

    /// Looks at the noise after these passes. Only powers of two are looked at, so that the answer depends neither on
    /// threads nor on interruptions, and that a lucky moment is not waited for.
    fn look(&mut self, film: &Film, passes: u32) {
        if passes >= Self::FIRST && passes.is_power_of_two() {
            self.found = film.tile_noise(passes);
        }
    }

    pub fn is_reached(&self) -> bool {
        self.found.is_some_and(|found| found <= self.below)
    }

    /// The passes that it will take, the noise going with their root, but no more than `most`.
    fn expected(&self, passes: u32, most: u32) -> u32 {
        let last = (passes + 1).next_power_of_two() / 2;
        let factor = self.found.map_or(1.0, |found| (found / self.below).powi(2)).max(1.0);
        ((f64::from(last) * factor).min(f64::from(most)) as u32)
            .max(Self::FIRST)
            .next_power_of_two()
            .min(most)
            .max(passes)
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reached = if self.is_reached() { "reached" } else { "not reached" };
        write!(f, "{} on {} % of tiles: {reached}", self.below, 100.0 * ENOUGH_TILES)
    }
}

/// How a render ended.
pub struct Ended {
    pub moment: Moment,
    /// Whether it was to end by its noise, and did.
    pub quality: Option<Quality>,
    /// The exit code of an interruption before the goal.
    pub interrupted: Option<Exit>,
    /// Whether every contribution is in the sums.
    pub complete: bool,
}

impl Ended {
    /// The exit code, if nothing more happens.
    pub fn exit(&self) -> Exit {
        self.interrupted.unwrap_or(if self.complete { Exit::Done } else { Exit::Incomplete })
    }

    /// The same as a word.
    pub fn outcome(&self) -> &'static str {
        match self.interrupted {
            Some(_) => "interrupted",
            None if self.complete => "done",
            None => "incomplete",
        }
    }
}

/// Whether there is a pass to come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    Pass,
    Nothing,
}

/// Who sees a render after every pass.
pub trait Watch {
    /// `moment` says how far it is. With an exit code the render ends here.
    fn after_pass(&mut self, renderer: &Renderer<'_>, next: Next, moment: &mut dyn FnMut() -> Moment) -> Option<Exit>;
}

/// Renders until `goal`, or to the end of the pass after which `watch` ends it.
pub fn run(
    renderer: &mut Renderer<'_>,
    pool: &ThreadPool,
    (goal, mut quality): (Goal, Option<Quality>),
    watch: &mut impl Watch,
) -> Ended {
    let start = Start { at: Instant::now(), passes: renderer.passes(), rays: renderer.statistics().rays.total() };
    let mut noise = None;
    let mut interrupted = None;
    let done = |renderer: &Renderer<'_>, quality: Option<Quality>| {
        start.reached(goal, renderer) || quality.is_some_and(|quality| quality.is_reached())
    };
    // A checkpoint may be where it is good enough.
    if let Some(quality) = &mut quality {
        quality.look(renderer.film(), renderer.passes());
    }
    while interrupted.is_none() && !done(renderer, quality) {
        pool.install(|| renderer.pass());
        let passes = renderer.passes();
        if let Some(quality) = &mut quality {
            quality.look(renderer.film(), passes);
        }
        let next = if done(renderer, quality) { Next::Nothing } else { Next::Pass };
        let mut moment = || {
            noise = renderer.film().noise(passes).or(noise);
            let near = match (goal, quality) {
                (Goal::Passes(most), Some(quality)) => Goal::Passes(quality.expected(passes, most)),
                _ => goal,
            };
            start.moment(renderer, near, noise)
        };
        interrupted = watch.after_pass(renderer, next, &mut moment);
    }
    let moment = start.moment(renderer, goal, renderer.film().noise(renderer.passes()));
    let complete = renderer.sums().errors().is_empty() && renderer.statistics().rejected.is_empty();
    Ended { moment, quality, interrupted, complete }
}

/// Where this run of the program began: a checkpoint's samples are not its own.
struct Start {
    at: Instant,
    passes: u32,
    rays: u64,
}

impl Start {
    fn reached(&self, goal: Goal, renderer: &Renderer<'_>) -> bool {
        goal.is_reached(renderer.passes(), self.passes, self.at.elapsed())
    }

    fn moment(&self, renderer: &Renderer<'_>, goal: Goal, noise: Option<f64>) -> Moment {
        let (passes, resumed) = (renderer.passes(), self.passes);
        let samples = renderer.film().crop().pixels() * u64::from(passes - resumed);
        let rays = renderer.statistics().rays.total() - self.rays;
        Moment { goal, passes, resumed, elapsed: self.at.elapsed(), samples, rays, noise }
    }
}

/// What was done, what is known about the noise, and what went wrong.
pub fn summarise(renderer: &Renderer<'_>, end: &Moment, terminal: Terminal) {
    // The exit code is that of `Ended`, which knows of interruptions.
    let _ = faults(&renderer.statistics(), renderer.sums().errors(), terminal);
    let sums = renderer.sums();
    let films = || [sums.film].into_iter().chain(sums.layers.iter().map(|(_, film)| *film));
    let (all, wide) = (films().map(Film::memory_now).sum::<u64>(), films().map(Film::wide_memory).sum::<u64>());
    let (all, wide) = (all >> 20, wide >> 20);
    if wide > MUCH && wide > all / 2 {
        terminal.say(format_args!("note: deposits of very different sizes took {wide} of the film's {all} MiB"));
    }
    let noise = noise(end.noise, end.passes, renderer.film());
    terminal.say(format_args!("{} spp in {}, {noise}", end.passes, Clock(end.elapsed)));
}

/// Says what went wrong, if anything did, and which exit code that is.
pub fn faults(statistics: &Statistics, errors: DepositErrors, terminal: Terminal) -> Exit {
    terminal.detail(format_args!("{} samples, {} rays", statistics.samples, statistics.rays.total()));
    for (technique, count) in &statistics.rejected {
        terminal.warn(format_args!("technique {technique} made {count} contributions that are no number, left out"));
    }
    let faults = [
        (errors.non_finite, "contributions were not finite and are left out"),
        (errors.overflow, "additions to sums of pixels left the film's range of 2^170: these pixels are wrong"),
    ];
    for (count, what) in faults.into_iter().filter(|(count, _)| *count > 0) {
        terminal.warn(format_args!("{count} {what}"));
    }
    if errors.is_empty() && statistics.rejected.is_empty() { Exit::Done } else { Exit::Incomplete }
}

/// What is known about the noise of a film's image.
pub fn noise(noise: Option<f64>, passes: u32, film: &Film) -> String {
    match noise {
        Some(noise) => format!("noise {noise:.2e} (relMSE, from two half images)"),
        None if passes == 0 => "no samples".to_owned(),
        None if film.is_black() => "noise unknown (no light has arrived anywhere in the image)".to_owned(),
        None if passes == 1 => "noise unknown (one sample per pixel)".to_owned(),
        None if passes.is_multiple_of(2) => "noise unknown (half images of different length)".to_owned(),
        None => "noise unknown (odd number of samples)".to_owned(),
    }
}
