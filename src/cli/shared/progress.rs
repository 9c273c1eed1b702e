//! How far a render is.

use std::{
    fmt,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use crate::cli::shared::terminal::{self, Terminal};

/// What the film has room for ([`pathspace::film::AlphaSums`]), and more than anybody has patience for.
pub const MOST_PASSES: u32 = 1 << 24;

/// When a render is finished.
#[derive(Clone, Copy, Debug)]
pub enum Goal {
    /// After so many passes.
    Passes(u32),
    /// After so much time, at the end of a pass.
    Time(Duration),
}

impl Goal {
    /// The part of the work that is done, from 0 to 1.
    fn fraction(self, passes: u32, elapsed: Duration) -> f64 {
        let fraction = match self {
            Self::Passes(all) => f64::from(passes) / f64::from(all.max(1)),
            Self::Time(all) => elapsed.as_secs_f64() / all.as_secs_f64(),
        };
        fraction.clamp(0.0, 1.0)
    }

    /// Whether no further pass is to be made after `passes`, of which `resumed` were there before this run. Under a
    /// time, at least one is made, and one more if at least half of it fits.
    pub fn is_reached(self, passes: u32, resumed: u32, elapsed: Duration) -> bool {
        match self {
            Self::Passes(all) => passes >= all,
            Self::Time(all) => {
                let own = passes - resumed;
                passes >= MOST_PASSES || own > 0 && elapsed + elapsed / own / 2 >= all
            }
        }
    }
}

/// A moment of a render.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    pub goal: Goal,
    pub passes: u32,
    /// Those of them that a checkpoint had.
    pub resumed: u32,
    /// Of this run, as what follows.
    pub elapsed: Duration,
    /// Pixels times passes.
    pub samples: u64,
    pub rays: u64,
    /// The latest noise estimate, if there was one.
    pub noise: Option<f64>,
}

impl Moment {
    /// How long it will take from here, as far as that can be known.
    pub fn left(&self) -> Option<Duration> {
        let (done, before) = (self.fraction(), self.goal.fraction(self.resumed, Duration::ZERO));
        let left = self.elapsed.as_secs_f64() * (1.0 - done) / (done - before);
        (done > before).then(|| Duration::try_from_secs_f64(left).unwrap_or(Duration::MAX))
    }
}

impl Step for Moment {
    fn fraction(&self) -> f64 {
        self.goal.fraction(self.passes, self.elapsed)
    }

    fn json(&self) -> Value {
        let per_second = |count: u64| count as f64 / self.elapsed.as_secs_f64().max(1e-9);
        let of = match self.goal {
            Goal::Passes(all) => Some(all),
            Goal::Time(_) => None,
        };
        json!({
            "event": "progress",
            "spp": self.passes,
            "of": of,
            "fraction": self.fraction(),
            "elapsed": self.elapsed.as_secs_f64(),
            "left": self.left().map(|left| left.as_secs_f64()),
            "noise": self.noise,
            "samples_per_second": per_second(self.samples),
            "rays_per_second": per_second(self.rays),
        })
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.goal {
            Goal::Passes(all) => write!(f, "{}/{all} spp", self.passes)?,
            Goal::Time(all) => write!(f, "{} spp, {} of {}", self.passes, Clock(self.elapsed), Clock(all))?,
        }
        if let Some(left) = self.left() {
            write!(f, ", {} left", Clock(left))?;
        }
        if let Some(noise) = self.noise {
            write!(f, ", noise {noise:.1e}")?;
        }
        let per_second = |count: u64| count as f64 * 1e-6 / self.elapsed.as_secs_f64().max(1e-9);
        write!(f, ", {:.2} Msamples/s, {:.2} Mrays/s", per_second(self.samples), per_second(self.rays))
    }
}

/// A time as a person reads it: `3.1 s`, `2:05`, `1:02:05`.
pub struct Clock(pub Duration);

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.0.as_secs();
        match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
            (0, 0, _) => write!(f, "{:.1} s", self.0.as_secs_f64()),
            (0, minutes, seconds) => write!(f, "{minutes}:{seconds:02}"),
            (hours, minutes, seconds) => write!(f, "{hours}:{minutes:02}:{seconds:02}"),
        }
    }
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A bar to a person who watches, lines to a file, nothing to who wants quiet.
    Auto,
    /// Lines on standard error.
    Plain,
    /// A JSON object a line on standard output.
    Json,
    /// Nothing.
    None,
}

impl Style {
    pub const ALL: [Self; 4] = [Self::Auto, Self::Plain, Self::Json, Self::None];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Plain => "plain",
            Self::Json => "json",
            Self::None => "none",
        }
    }
}

/// What can be shown of work that goes on: a line for people, and the same for programs.
pub trait Step: fmt::Display {
    /// The part of the work that is done, from 0 to 1.
    fn fraction(&self) -> f64;

    fn json(&self) -> Value;
}

/// Shows moments of a render: as a bar, as lines now and then, or not at all.
pub struct Progress {
    display: Display,
    last: Instant,
}

enum Display {
    Nothing,
    Bar(ProgressBar),
    Json,
    Lines { terminal: Terminal, wait: Duration },
}

impl Progress {
    const STEPS: u64 = 1000;
    /// Between redraws of a bar: each costs a noise estimate over the whole film.
    const REDRAW: Duration = Duration::from_millis(500);
    /// Between JSON objects.
    const JSON: Duration = Duration::from_secs(1);
    /// Between lines, at most; the first ones come sooner.
    const LINES: Duration = Duration::from_secs(30);

    pub fn new(style: Style, terminal: Terminal) -> Self {
        let display = match style {
            Style::Json => Display::Json,
            Style::None => Display::Nothing,
            _ if terminal.is_quiet() => Display::Nothing,
            Style::Auto if terminal.is_interactive() => {
                let style = ProgressStyle::with_template("{bar:20} {wide_msg}").unwrap_or(ProgressStyle::default_bar());
                Display::Bar(ProgressBar::new(Self::STEPS).with_style(style))
            }
            Style::Auto | Style::Plain => Display::Lines { terminal, wait: Duration::from_secs(1) },
        };
        Self { display, last: Instant::now() }
    }

    /// Whether it is time to show something.
    pub fn is_due(&self) -> bool {
        let wait = match &self.display {
            Display::Nothing => return false,
            Display::Bar(_) => Self::REDRAW,
            Display::Json => Self::JSON,
            Display::Lines { wait, .. } => *wait,
        };
        self.last.elapsed() >= wait
    }

    /// Shows how far the work is.
    pub fn show(&mut self, step: &dyn Step) {
        match &mut self.display {
            Display::Nothing => {}
            Display::Bar(bar) => {
                bar.set_position((step.fraction() * Self::STEPS as f64) as u64);
                bar.set_message(step.to_string());
            }
            Display::Json => terminal::answer(step.json()),
            Display::Lines { terminal, wait } => {
                terminal.say(step);
                *wait = (*wait * 2).min(Self::LINES);
            }
        }
        self.last = Instant::now();
    }

    /// Says something that is no progress to who reads JSON, and to nobody else.
    pub fn event(&self, event: impl FnOnce() -> Value) {
        if let Display::Json = self.display {
            terminal::answer(event());
        }
    }

    /// Removes the bar from the screen.
    pub fn finish(&self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_reads_well() {
        let mut moment = Moment {
            goal: Goal::Passes(64),
            passes: 16,
            resumed: 0,
            elapsed: Duration::from_secs(10),
            samples: 20_000_000,
            rays: 123_000_000,
            noise: None,
        };
        assert_eq!(moment.to_string(), "16/64 spp, 30.0 s left, 2.00 Msamples/s, 12.30 Mrays/s");
        moment.resumed = 8;
        assert_eq!(moment.left(), Some(Duration::from_secs(60)), "eight passes in ten seconds");
        moment.resumed = 0;
        moment.noise = Some(3.21e-3);
        moment.goal = Goal::Time(Duration::from_secs(3700));
        let text = "16 spp, 10.0 s of 1:01:40, 1:01:30 left, noise 3.2e-3, 2.00 Msamples/s, 12.30 Mrays/s";
        assert_eq!(moment.to_string(), text);
    }

    #[test]
    fn goals_are_reached_at_the_end_of_a_pass() {
        let second = Duration::from_secs(1);
        assert!(!Goal::Passes(2).is_reached(1, 0, second) && Goal::Passes(2).is_reached(2, 0, second));
        let goal = Goal::Time(Duration::from_millis(1600));
        assert!(!goal.is_reached(0, 0, second * 9), "an image has at least one pass");
        assert!(!goal.is_reached(1, 0, second) && goal.is_reached(2, 0, second * 2));
        assert!(!goal.is_reached(9, 9, second * 9) && !goal.is_reached(10, 9, second), "a time is that of one run");
    }
}
