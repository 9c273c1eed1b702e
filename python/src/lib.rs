//! The extension module `pathspace._native`: what of the renderer Python sees, without Python's manners. The package
//! around it, in `python/pathspace`, has the names, types and units.
//!
//! Options come as the words of the command line and are parsed by the program's own modules, so that a render from
//! Python is the program's render: same defaults, same sentences, same bytes.

// A path and no dependency: the program is no part of the library, whose builds it would make slower.
mod by_hand;
#[path = "../../src/cli/mod.rs"]
mod cli;
mod ear;
mod errors;
mod options;
mod path;
mod picture;
mod pixels;
mod program;
mod render;
mod reports;
mod scene;
mod settings;
mod talk;

use pyo3::prelude::*;

/// See the package `pathspace`.
#[pymodule]
fn _native(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<scene::Scene>()?;
    m.add_class::<picture::Picture>()?;
    m.add_class::<settings::Settings>()?;
    m.add_class::<path::Path>()?;
    m.add_class::<pixels::Pixels>()?;
    m.add_function(wrap_pyfunction!(options::options, m)?)?;
    m.add_function(wrap_pyfunction!(picture::look_among, m)?)?;
    m.add_function(wrap_pyfunction!(render::render, m)?)?;
    m.add_function(wrap_pyfunction!(settings::prepare, m)?)?;
    m.add_function(wrap_pyfunction!(settings::sample_paths, m)?)?;
    m.add_function(wrap_pyfunction!(by_hand::lay, m)?)?;
    m.add_function(wrap_pyfunction!(reports::verify, m)?)?;
    m.add_function(wrap_pyfunction!(reports::converge, m)?)?;
    m.add_function(wrap_pyfunction!(program::main, m)?)?;
    Ok(())
}
