//! A render from Python: the program's, with other eyes on it.

use std::{
    ffi::OsString,
    time::{Duration, Instant},
};

use pathspace::{denoise::Denoiser, film::Format, io::Loaded, render::Renderer};
use pyo3::prelude::*;

use crate::{
    cli::{
        render::{
            Ready,
            args::RenderArgs,
            black,
            data::{halves, variance},
            pass_loop::{self, Ended, Next, Quality, Watch},
            refuse,
            rendered::{image_header, picture, warn},
            stats::Phases,
            wanted, with_renderer,
        },
        shared::{
            exit::{Exit, Failure},
            opened::Opened,
            pictures::Outputs,
            progress::{Moment, Step},
            terminal::Terminal,
        },
    },
    picture::{Halves, Picture},
    scene::Scene,
    talk::speaking,
};

/// Renders a scene by the options in `words`. `progress` is called now and then with (fraction, samples per pixel,
/// seconds, noise, line).
#[pyfunction]
#[pyo3(signature = (scene, words, progress=None))]
pub fn render(py: Python<'_>, scene: &Scene, words: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<Picture> {
    let mut watcher = Watcher { heard: Instant::now(), progress, error: None };
    let rendered = speaking(py, |terminal| {
        let args = scene.render_args(&words)?;
        let denoiser = refuse(&args)?;
        // What a file could hold, an object in memory can.
        let memory = Outputs(vec![("image.exr".into(), Format::Exr)]);
        args.layers.check(&memory)?;
        args.data.check(args.part.shard, args.spp, &memory)?;
        run(&scene.loaded, &args, denoiser.as_ref(), &mut watcher, terminal)
    });
    match watcher.error {
        Some(error) => Err(error),
        None => rendered,
    }
}

fn run(
    loaded: &Loaded,
    args: &RenderArgs,
    denoiser: Option<&Denoiser>,
    watcher: &mut Watcher,
    terminal: Terminal,
) -> Result<Picture, Failure> {
    let pool = args.image.paths.thread_pool()?;
    let opened = Opened::new(loaded.clone(), &args.scene, terminal)?;
    with_renderer(args, opened, &pool, &mut Phases::start(), terminal, |ready, _| {
        let Ready { job, recorded, mut renderer } = ready;
        let quality = args.noise.map(Quality::new);
        let ended = pass_loop::run(&mut renderer, &pool, (wanted(args).goal, quality), watcher);
        if let Some(exit) = ended.interrupted {
            return Err(Failure { exit, sentence: "interrupted".to_owned() });
        }
        pass_loop::summarise(&renderer, &ended.moment, terminal);
        warn(black(job, &renderer).as_deref(), &ended, terminal);
        let mut header = image_header(args, (job, recorded), &renderer, ended.quality);
        let (picture, denoised) = picture(args, &renderer, &pool, denoiser, &mut header);
        // The samples are worth more than the filter.
        if let Err(failure) = denoised {
            terminal.warn(format_args!("{}; this is the image as rendered", failure.sentence));
        }
        let Ended { moment, .. } = ended;
        let (halves, statistics) = (halves_of(&renderer), renderer.statistics());
        Ok(Picture { picture, header, halves, seconds: moment.elapsed.as_secs_f64(), statistics })
    })
}

/// The half images, where both have a sample.
fn halves_of(renderer: &Renderer<'_>) -> Option<Halves> {
    (renderer.passes() >= 2).then(|| {
        let images = halves(renderer);
        Halves { variance: variance(&images), images }
    })
}

/// Python's eyes: signals, and whoever wants to hear how far it is.
struct Watcher {
    /// When Python was last asked.
    heard: Instant,
    progress: Option<Py<PyAny>>,
    /// What ends the render: KeyboardInterrupt, or what the callback raised.
    error: Option<PyErr>,
}

impl Watcher {
    /// Between two questions: the interpreter's lock may be another thread's.
    const WAIT: Duration = Duration::from_millis(50);

    fn ask(&self, moment: &mut dyn FnMut() -> Moment) -> PyResult<()> {
        Python::attach(|py| {
            py.check_signals()?;
            let Some(progress) = &self.progress else { return Ok(()) };
            let moment = moment();
            let (spp, seconds) = (moment.passes, moment.elapsed.as_secs_f64());
            progress.call1(py, (moment.fraction(), spp, seconds, moment.noise, moment.to_string()))?;
            Ok(())
        })
    }
}

impl Watch for Watcher {
    fn after_pass(&mut self, _: &Renderer<'_>, next: Next, moment: &mut dyn FnMut() -> Moment) -> Option<Exit> {
        let is_last = next == Next::Nothing && self.progress.is_some();
        if !is_last && self.heard.elapsed() < Self::WAIT {
            return None;
        }
        self.error = self.ask(moment).err();
        self.heard = Instant::now();
        self.error.as_ref().map(|_| Exit::Interrupted)
    }
}
