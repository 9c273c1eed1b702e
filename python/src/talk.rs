//! What the program would say on standard error goes to Python: warnings to `warnings`, the rest to `logging`.

use std::{
    collections::BTreeMap,
    fmt::Display,
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
};

use pyo3::prelude::*;

use crate::{
    cli::shared::{
        exit::Failure,
        terminal::{Listener, Terminal, Verbosity},
    },
    errors::exception,
};

/// What each call has said and Python not yet heard. By calls and not by threads: a call speaks from those of its pool,
/// too.
static SAID: Mutex<BTreeMap<u64, Vec<String>>> = Mutex::new(BTreeMap::new());

fn keep(call: u64, line: &dyn Display) {
    let mut said = SAID.lock().unwrap_or_else(|e| e.into_inner());
    said.entry(call).or_default().push(line.to_string());
}

/// Does `work` without the interpreter's lock, and hands what it said to Python, whether or not it failed.
pub fn speaking<T: Send>(py: Python<'_>, work: impl Send + FnOnce(Terminal) -> Result<T, Failure>) -> PyResult<T> {
    static CALLS: AtomicU64 = AtomicU64::new(0);
    let call = CALLS.fetch_add(1, Relaxed);
    let listener = Listener { hear: keep, id: call };
    let done = py.detach(|| work(Terminal::through(Verbosity::Verbose, listener)));
    let said = SAID.lock().unwrap_or_else(|e| e.into_inner()).remove(&call);
    if let Some(said) = said {
        py.import("pathspace._messages")?.getattr("heard")?.call1((said,))?;
    }
    done.map_err(|failure| exception(py, &failure))
}
