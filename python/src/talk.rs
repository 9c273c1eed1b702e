//! What the program would say on standard error goes to Python: warnings to `warnings`, the rest to `logging`.

use std::{cell::RefCell, fmt::Display};

use pyo3::prelude::*;

use crate::{
    cli::shared::{
        exit::Failure,
        terminal::{Terminal, Verbosity},
    },
    errors::exception,
};

thread_local! {
    /// What was said on this thread and not yet heard.
    static SAID: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// A terminal whose lines wait for [`speaking`].
pub fn terminal() -> Terminal {
    let keep = |line: &dyn Display| SAID.with_borrow_mut(|said| said.push(line.to_string()));
    Terminal::through(Verbosity::Verbose, keep)
}

/// Does `work` without the interpreter's lock, and hands what it said to Python, whether or not it failed.
pub fn speaking<T: Send>(py: Python<'_>, work: impl Send + FnOnce(Terminal) -> Result<T, Failure>) -> PyResult<T> {
    let done = py.detach(|| work(terminal()));
    let said = SAID.take();
    if !said.is_empty() {
        py.import("pathspace._messages")?.getattr("heard")?.call1((said,))?;
    }
    done.map_err(|failure| exception(py, &failure))
}
