//! A scene file that was read.

use std::ffi::OsString;

use pathspace::io::Loaded;
use pyo3::prelude::*;

use crate::{
    cli::{
        Command,
        render::args::RenderArgs,
        shared::{exit::Failure, opened},
    },
    options::parsed,
    talk::speaking,
};

/// A scene as its file describes it, to be rendered by any number of threads.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Scene {
    /// What the command line would be told of it: the file, and the options that reading it takes.
    words: Vec<OsString>,
    pub loaded: Loaded,
}

impl Scene {
    /// The options of a render of this scene, of which `words` are the further ones.
    pub fn render_args(&self, words: &[OsString]) -> Result<Box<RenderArgs>, Failure> {
        render_args(self.words.iter().chain(words))
    }
}

fn render_args<'a>(words: impl Iterator<Item = &'a OsString>) -> Result<Box<RenderArgs>, Failure> {
    let words: Vec<_> = std::iter::once("render".into()).chain(words.cloned()).collect();
    match parsed(&words)? {
        Command::Render(args) => Ok(args),
        _ => unreachable!("the first word is 'render'"),
    }
}

#[pymethods]
impl Scene {
    /// Reads the file that these words name, with the options among them.
    #[staticmethod]
    fn load(py: Python<'_>, words: Vec<OsString>) -> PyResult<Self> {
        speaking(py, |terminal| {
            let loaded = opened::load(&render_args(words.iter())?.scene, terminal)?;
            Ok(Self { words, loaded })
        })
    }

    #[getter]
    fn words(&self) -> Vec<OsString> {
        self.words.clone()
    }

    #[getter]
    fn hash(&self) -> &str {
        &self.loaded.hash
    }

    #[getter]
    fn cameras(&self) -> Vec<&str> {
        self.loaded.cameras.iter().map(|camera| camera.name.as_str()).collect()
    }

    #[getter]
    fn materials(&self) -> Vec<&str> {
        self.loaded.materials.iter().map(|material| material.name.as_str()).collect()
    }

    #[getter]
    fn warnings(&self) -> Vec<&str> {
        self.loaded.warnings.iter().map(String::as_str).collect()
    }

    #[getter]
    fn triangles(&self) -> u64 {
        self.loaded.geometry.triangle_count()
    }
}
