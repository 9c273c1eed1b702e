//! How the program ends.

use std::{fmt::Write, process::ExitCode};

use pathspace::io::LoadError;

/// The exit codes of every subcommand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// A comparison failed.
    ComparisonFailed = 1,
    /// Wrong usage.
    Usage = 2,
    /// The input cannot be rendered.
    Input = 3,
    /// An output cannot be written.
    Output = 4,
    /// Undecided: too noisy to tell.
    Undecided = 5,
    /// Contributions could not be added to the image, which is written without them.
    Incomplete = 6,
    /// A bug of the program itself.
    Bug = 70,
    /// Ended by Ctrl-C (128 + SIGINT).
    Interrupted = 130,
    /// Ended by SIGTERM (128 + SIGTERM).
    Terminated = 143,
}

impl Exit {
    /// Every code, with what it means to whoever called the program.
    pub const TABLE: [(Self, &'static str); 10] = [
        (Self::Done, "done"),
        (Self::ComparisonFailed, "a comparison failed"),
        (Self::Usage, "wrong usage"),
        (Self::Input, "the input cannot be rendered"),
        (Self::Output, "an output cannot be written"),
        (Self::Undecided, "undecided: too noisy to tell"),
        (Self::Incomplete, "written, but contributions are missing that could not be added"),
        (Self::Bug, "a bug of pathspace"),
        (Self::Interrupted, "interrupted by Ctrl-C"),
        (Self::Terminated, "ended by SIGTERM"),
    ];

    /// The table as `--help` shows it.
    pub fn help() -> String {
        let mut text = "Exit codes:\n".to_owned();
        for (exit, meaning) in Self::TABLE {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{:>5}  {meaning}", exit as u8);
        }
        text
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Why a subcommand gave up: an exit code and one sentence.
#[derive(Debug)]
pub struct Failure {
    pub exit: Exit,
    pub sentence: String,
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        match error {
            LoadError::NoSuchScene { .. } | LoadError::NoSuchVariant { .. } | LoadError::NoSuchAnimation { .. } => {
                Self::usage(error.to_string())
            }
            _ => Self::input(error.to_string()),
        }
    }
}

impl Failure {
    pub fn usage(sentence: impl Into<String>) -> Self {
        Self { exit: Exit::Usage, sentence: sentence.into() }
    }

    /// By whoever waited.
    pub fn interrupted() -> Self {
        Self { exit: Exit::Interrupted, sentence: "interrupted".to_owned() }
    }

    pub fn input(sentence: impl Into<String>) -> Self {
        Self { exit: Exit::Input, sentence: sentence.into() }
    }

    pub fn output(sentence: impl Into<String>) -> Self {
        Self { exit: Exit::Output, sentence: sentence.into() }
    }
}
