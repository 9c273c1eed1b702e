//! A render that is prepared and not begun: its scene with the camera, and its table of techniques.

use std::{cell::RefCell, ffi::OsString, ops::ControlFlow, sync::Arc};

use pathspace::{
    film::Crop,
    integrator::Integrator,
    layers::PathClasses,
    math::Rgb,
    path::{JoinedPath, Technique, Vertex},
    render::Collector,
    scene::{self, camera::Raster, point::Point, wavelength::Wavelength},
};
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::{
    cli::{
        render::{Ready, args::RenderArgs, refuse, stats::Phases, with_renderer},
        shared::{exit::Failure, opened::Opened},
    },
    ear::Ear,
    path::{Found, Path},
    scene::Scene,
    talk::speaking,
};

/// What a render would do, for questions about paths.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Settings {
    pub scene: Arc<scene::Scene>,
    /// With the radius that merges have in the first pass.
    pub integrator: Integrator,
    /// Of the file's bytes.
    hash: String,
    words: Vec<OsString>,
}

#[pymethods]
impl Settings {
    /// The options that it was prepared by, as words.
    #[getter]
    fn words(&self) -> Vec<OsString> {
        self.words.clone()
    }

    /// The scene's hash.
    #[getter]
    fn hash(&self) -> &str {
        &self.hash
    }

    /// (width, height) in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        let sensor = self.scene.camera.sensor();
        (sensor.width, sensor.height)
    }
}

/// Prepares a render by the options in `words`.
#[pyfunction]
pub fn prepare(py: Python<'_>, scene: &Scene, words: Vec<OsString>) -> PyResult<Settings> {
    let mut ear = Ear::of_signals();
    let prepared = speaking(py, |terminal| {
        let args = scene.render_args(&words)?;
        refuse(&args)?;
        let pool = args.image.paths.thread_pool()?;
        let opened = Opened::new(scene.loaded.clone(), &args.scene, terminal)?;
        let hear = &mut |_| ear.hear(|_| ());
        with_renderer(&args, opened, &pool, (&mut Phases::start(), hear), terminal, |ready, _| {
            let Ready { job, renderer, .. } = ready;
            let integrator = renderer.integrator().clone();
            let integrator = match job.merging {
                Some(radius) => integrator.merging_within(radius.of_pass(0)),
                None => integrator,
            };
            Ok(Settings { scene: Arc::new(job.scene.clone()), integrator, hash: job.scene_hash.clone(), words })
        })
    });
    ear.end(prepared)
}

/// The first `count` paths that a render by the options in `words` brings to a pixel, fewer if `passes` have no more.
#[pyfunction]
pub fn sample_paths(
    py: Python<'_>,
    scene: &Scene,
    words: Vec<OsString>,
    pixel: (u32, u32),
    count: usize,
    passes: u32,
) -> PyResult<Vec<Path>> {
    let mut ear = Ear::of_signals();
    let found = speaking(py, |terminal| {
        let args = scene.render_args(&words)?;
        refuse(&args)?;
        let pool = args.image.paths.thread_pool()?;
        let opened = Opened::new(scene.loaded.clone(), &args.scene, terminal)?;
        let ear = RefCell::new(&mut ear);
        let hear = || ear.borrow_mut().hear(|_| ());
        with_renderer(&args, opened, &pool, (&mut Phases::start(), &mut |_| hear()), terminal, |ready, _| {
            find(ready, &args, &pool, Wanted { pixel, count, passes }, hear)
        })
    });
    ear.end(found)
}

/// Which paths are looked for.
struct Wanted {
    pixel: (u32, u32),
    count: usize,
    passes: u32,
}

/// On this thread but for the passes, since `hear` has to be called here.
fn find(
    ready: Ready<'_>,
    args: &RenderArgs,
    pool: &ThreadPool,
    wanted: Wanted,
    hear: impl Fn() -> ControlFlow<()>,
) -> Result<Vec<Path>, Failure> {
    let Ready { job, mut renderer, .. } = ready;
    let (x, y) = wanted.pixel;
    let pixel = Crop { x0: x, y0: y, x1: x + 1, y1: y + 1 };
    let kept = args.image.kept(job.scene)?.map(|(_, classes)| classes);
    let scene = Arc::new(job.scene.clone());
    let mut paths = Vec::new();
    while paths.len() < wanted.count && renderer.passes() < wanted.passes {
        let room = wanted.count - paths.len();
        let finder = || Finder { scene: job.scene, pixel, kept: kept.as_ref(), room, found: Vec::new() };
        let finders = pool.install(|| renderer.pass_into(finder));
        let integrator = Arc::new(renderer.integrator().clone());
        let found = finders.into_iter().flat_map(|finder| finder.found).take(room);
        paths.extend(found.map(|seen| seen.owned(&scene, &integrator)));
        if hear().is_break() {
            return Err(Failure::interrupted());
        }
    }
    Ok(paths)
}

/// Takes the paths of a task that arrive in the pixel.
struct Finder<'a> {
    scene: &'a scene::Scene,
    pixel: Crop,
    kept: Option<&'a PathClasses>,
    room: usize,
    found: Vec<Seen>,
}

/// A path that was found, before it owns its scene.
struct Seen {
    vertices: Vec<Vertex>,
    visibility: Vec<f64>,
    merged: Option<(usize, Point)>,
    raster: Raster,
    wavelength: Option<Wavelength>,
    technique: Technique,
    value: Rgb,
    survival: f32,
}

impl Seen {
    fn owned(self, scene: &Arc<scene::Scene>, integrator: &Arc<Integrator>) -> Path {
        let Self { vertices, visibility, merged, raster, wavelength, technique, value, survival } = self;
        let found = Found { technique, value: value.to_array(), survival, integrator: integrator.clone() };
        Path { scene: scene.clone(), vertices, visibility, merged, raster, wavelength, found: Some(found) }
    }
}

impl Collector for Finder<'_> {
    fn collect(&mut self, path: &JoinedPath, value: Rgb) {
        let (place, pixel) = (path.raster().0.floor(), self.pixel);
        let is_here = place.x == pixel.x0 as f32 && place.y == pixel.y0 as f32;
        if !is_here || self.found.len() == self.room || self.kept.is_some_and(|kept| !kept.holds(self.scene, path)) {
            return;
        }
        let (raster, technique, survival) = (path.raster(), path.technique(), path.survival());
        let path = path.to_path();
        self.found.push(Seen {
            vertices: path.vertices().to_vec(),
            visibility: path.visibility().to_vec(),
            merged: path.merged().map(|(i, q)| (i, *q)),
            raster,
            wavelength: path.wavelength(),
            technique,
            value,
            survival,
        });
    }
}
