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
    /// The words of a command on this scene, of which `words` are the further ones.
    pub fn command(&self, name: &str, words: &[OsString]) -> Vec<OsString> {
        [name.into()].into_iter().chain(self.words.iter().chain(words).cloned()).collect()
    }

    /// The options of a render of this scene, of which `words` are the further ones.
    pub fn render_args(&self, words: &[OsString]) -> Result<Box<RenderArgs>, Failure> {
        render_args(&self.command("render", words))
    }
}

fn render_args(words: &[OsString]) -> Result<Box<RenderArgs>, Failure> {
    match parsed(words)? {
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
            let command: Vec<_> = [OsString::from("render")].into_iter().chain(words.iter().cloned()).collect();
            let loaded = opened::load(&render_args(&command)?.scene, terminal)?;
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
