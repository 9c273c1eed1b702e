//! What Python hears of long work: signals, and how far it is.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use pyo3::{call::PyCallArgs, prelude::*};

/// Asks Python now and then whether there was a signal, and tells a function how far the work is.
pub struct Ear {
    asked: Instant,
    progress: Option<Py<PyAny>>,
    /// What ends the work: KeyboardInterrupt, or what the function raised.
    error: Option<PyErr>,
}

impl Ear {
    /// Between two questions: the interpreter's lock may be another thread's.
    const WAIT: Duration = Duration::from_millis(50);

    pub fn new(progress: Option<Py<PyAny>>) -> Self {
        Self { asked: Instant::now(), progress, error: None }
    }

    /// Signals alone.
    pub fn of_signals() -> Self {
        Self::new(None)
    }

    /// Whether there is a function that is told.
    pub fn is_listening(&self) -> bool {
        self.progress.is_some()
    }

    /// Breaks if the work is to end. The function gets what `moment` makes. Python hears of signals on its main thread
    /// alone, so this has to be called on the thread that Python has called.
    pub fn hear<A>(&mut self, moment: impl FnOnce(Python<'_>) -> A) -> ControlFlow<()>
    where
        A: for<'py> PyCallArgs<'py>,
    {
        if self.error.is_none() && self.asked.elapsed() >= Self::WAIT { self.hear_now(moment) } else { self.flow() }
    }

    /// The same, however short the time since it was last asked.
    pub fn hear_now<A>(&mut self, moment: impl FnOnce(Python<'_>) -> A) -> ControlFlow<()>
    where
        A: for<'py> PyCallArgs<'py>,
    {
        let told = Python::attach(|py| {
            py.check_signals()?;
            self.progress.as_ref().map(|progress| progress.call1(py, moment(py))).transpose()
        });
        self.error = told.err();
        self.asked = Instant::now();
        self.flow()
    }

    fn flow(&self) -> ControlFlow<()> {
        if self.error.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// What the work came to, or what ended it.
    pub fn end<T>(self, done: PyResult<T>) -> PyResult<T> {
        self.error.map_or(done, Err)
    }
}
