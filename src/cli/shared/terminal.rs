//! The one place that writes to the terminal.

use std::{
    fmt::Display,
    io::{self, IsTerminal, Write},
};

/// How much is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors.
    Quiet,
    /// Progress, warnings, results.
    Normal,
    /// What was read and chosen, too.
    Verbose,
}

/// Standard error, or whoever takes its lines, as far as the person wants to hear.
#[derive(Clone, Copy, Debug)]
pub struct Terminal {
    verbosity: Verbosity,
    listener: Listener,
}

/// Who takes lines, from whichever thread they come.
#[derive(Clone, Copy, Debug)]
pub struct Listener {
    /// Called with `id` and the line.
    pub hear: fn(u64, &dyn Display),
    /// Tells listeners with the same function apart.
    pub id: u64,
}

impl Terminal {
    pub fn new(verbosity: Verbosity) -> Self {
        Self::through(verbosity, Listener { hear: |_, line| stderr_line(line), id: 0 })
    }

    /// One whose lines go to `listener`.
    pub fn through(verbosity: Verbosity, listener: Listener) -> Self {
        Self { verbosity, listener }
    }

    pub fn is_quiet(self) -> bool {
        self.verbosity == Verbosity::Quiet
    }

    /// Whether a person watches, so that a line may be drawn over and over.
    pub fn is_interactive(self) -> bool {
        io::stderr().is_terminal()
    }

    pub fn say(self, line: impl Display) {
        self.at_least(Verbosity::Normal, line);
    }

    pub fn warn(self, line: impl Display) {
        self.say(format_args!("warning: {line}"));
    }

    pub fn detail(self, line: impl Display) {
        self.at_least(Verbosity::Verbose, line);
    }

    fn at_least(self, verbosity: Verbosity, line: impl Display) {
        if self.verbosity >= verbosity {
            (self.listener.hear)(self.listener.id, &line);
        }
    }
}

/// An error, said however quiet the program is to be.
pub fn error(sentence: impl Display) {
    stderr_line(format_args!("error: {sentence}"));
}

/// The answer of a subcommand that was asked for one.
pub fn answer(text: impl Display) {
    // A reader that has heard enough (`| head`) is no reason to fail.
    let _ = writeln!(io::stdout().lock(), "{text}");
}

fn stderr_line(line: impl Display) {
    // Nobody is left to be told if this fails.
    let _ = writeln!(io::stderr().lock(), "{line}");
}
