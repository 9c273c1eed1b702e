//! The reports of the command line: verify and converge, as JSON and files in memory.

use std::ffi::OsString;

use pathspace::{
    converge::{Stage, converge as measure},
    verify::verify as judge,
};
use pyo3::prelude::*;

use crate::{
    cli::{
        Command,
        converge::{self as converging, page},
        shared::{exit::Failure, listening::listening, opened::Opened},
        verify::{self as verifying, json},
    },
    ear::Ear,
    options::parsed,
    scene::Scene,
    talk::speaking,
};

/// What was found as JSON, and the files of the command line's folder by name.
type Verified = (String, Vec<(String, Vec<u8>)>);

/// Compares integrators on a scene by the options in `words`.
#[pyfunction]
#[pyo3(signature = (scene, words, progress=None))]
pub fn verify(py: Python<'_>, scene: &Scene, words: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<Verified> {
    let mut ear = Ear::new(progress);
    let verified = speaking(py, |terminal| {
        let Command::Verify(args) = parsed(&scene.command("verify", &words))? else {
            unreachable!("the first word is 'verify'")
        };
        let plan = verifying::plan(&args)?;
        let pool = args.paths.thread_pool()?;
        let opened = Opened::new(scene.loaded.clone(), &args.scene, terminal)?;
        let (job, seen) = verifying::prepared(&args, plan, opened, &pool, terminal)?;
        let hear = |part| ear.hear(|_| (part, "comparing"));
        let report = listening(&pool, |say| judge(&seen, &job.plan, say), hear);
        let answer = json::describe(&job, &report);
        let files = verifying::files(&job, &report, &answer);
        let files = files.map_err(|error| Failure::output(format!("cannot encode the files: {error}")))?;
        Ok((answer.to_string(), files))
    });
    ear.end(verified)
}

/// The numbers as JSON, the page and the table as the command line writes them.
type Converged = (String, String, String);

/// Measures how fast integrators converge on a scene by the options in `words`; the page says that `title` was asked
/// for by `command`.
#[pyfunction]
#[pyo3(signature = (scene, words, title, command, progress=None))]
pub fn converge(
    py: Python<'_>,
    scene: &Scene,
    words: Vec<OsString>,
    title: String,
    command: String,
    progress: Option<Py<PyAny>>,
) -> PyResult<Converged> {
    let mut ear = Ear::new(progress);
    let converged = speaking(py, |terminal| {
        let Command::Converge(args) = parsed(&scene.command("converge", &words))? else {
            unreachable!("the first word is 'converge'")
        };
        converging::refuse(&args)?;
        let pool = args.paths.thread_pool()?;
        let given = converging::given(&args)?;
        let opened = Opened::new(scene.loaded.clone(), &args.scene, terminal)?;
        let seen = converging::seen(&args, given.as_ref(), opened, &pool, terminal)?;
        let plan = converging::plan(&args);
        let hear = |stage: Stage| ear.hear(|_| (stage.part, stage.what));
        let report = listening(&pool, |say| measure(&seen.scene, &plan, given, say), hear);
        let report = report.map_err(|error| Failure::usage(error.to_string()))?;
        let facts = seen.facts((title, command), &args, &plan, &pool);
        let json = page::json(&facts, &report);
        let html = page::html(&facts, &report, &json);
        let html = html.map_err(|error| Failure::output(format!("cannot encode the page: {error}")))?;
        Ok((json.to_string(), html, page::csv(&report)))
    });
    ear.end(converged)
}
