//! The command line program inside the package.

use std::{
    ffi::OsString,
    io::{Write, stdout},
};

use pyo3::prelude::*;

use crate::cli;

/// Runs the program with these words, its name first, and returns its exit code. Signals are the program's: who calls
/// this has taken Python's handlers away.
#[pyfunction]
pub fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| {
        let exit = cli::run(words);
        // Nothing but the end of a Rust program would.
        let _ = stdout().flush();
        exit as u8
    })
}
