//! Keyword arguments are the options of the command line, and are read by the command line.

use std::ffi::{OsStr, OsString};

use clap::{CommandFactory, Parser};
use pyo3::{exceptions::PyKeyError, prelude::*};

use crate::cli::{Cli, Command, one_sentence, shared::exit::Failure};

/// The command that these words are, without the program's name.
pub fn parsed(words: &[OsString]) -> Result<Command, Failure> {
    let all = [OsStr::new("pathspace")].into_iter().chain(words.iter().map(OsString::as_os_str));
    let parsed = Cli::try_parse_from(all).map_err(|error| Failure::usage(one_sentence(&error.render().to_string())))?;
    Ok(parsed.command)
}

/// The options of a command: name without its dashes, whether it takes a value, and its default as the command line
/// has it.
#[pyfunction]
pub fn options(command: &str) -> PyResult<Vec<(String, bool, Option<String>)>> {
    let mut program = Cli::command();
    program.build();
    let found = program.find_subcommand(command).ok_or_else(|| PyKeyError::new_err(command.to_owned()))?;
    let described = |argument: &clap::Arg| {
        let name = argument.get_long()?.to_owned();
        let default = argument.get_default_values().first().map(|value| value.to_string_lossy().into_owned());
        Some((name, argument.get_action().takes_values(), default))
    };
    Ok(found.get_arguments().filter_map(described).collect())
}
