//! The program's failures as Python's exceptions.

use pyo3::prelude::*;

use crate::cli::shared::exit::{Exit, Failure};

/// The exception of the package that stands for a failure, with its sentence.
pub fn exception(py: Python<'_>, failure: &Failure) -> PyErr {
    let name = match failure.exit {
        Exit::Usage => "UsageError",
        Exit::Input => "InputError",
        Exit::Output => "OutputError",
        _ => "Error",
    };
    let made = || py.import("pathspace._errors")?.getattr(name)?.call1((&failure.sentence,));
    made().map_or_else(|error| error, PyErr::from_value)
}
