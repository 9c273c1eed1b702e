//! A render from Python: the program's, with other eyes on it.

use std::{
    cell::RefCell,
    ffi::OsString,
    ops::ControlFlow,
    time::{Duration, Instant},
};

use pathspace::{
    denoise::Denoiser,
    film::{Exposure, Format, encode_png},
    io::Loaded,
    render::Renderer,
};
use pyo3::{prelude::*, types::PyBytes};

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
    ear::Ear,
    picture::{Halves, Picture},
    scene::Scene,
    talk::speaking,
};

/// Renders a scene by the options in `words`. `progress` is called now and then with (fraction, samples per pixel,
/// seconds, noise, line, picture); the picture is a .png file where it is `live`, and now and then.
#[pyfunction]
#[pyo3(signature = (scene, words, progress=None, live=false))]
pub fn render(
    py: Python<'_>,
    scene: &Scene,
    words: Vec<OsString>,
    progress: Option<Py<PyAny>>,
    live: bool,
) -> PyResult<Picture> {
    let live = live.then(|| Live { next: Instant::now() });
    let mut watcher = Watcher { ear: Ear::new(progress), live };
    let rendered = speaking(py, |terminal| {
        let args = scene.render_args(&words)?;
        let denoiser = refuse(&args)?;
        // What a file could hold, an object in memory can.
        let memory = Outputs(vec![("image.exr".into(), Format::Exr)]);
        args.layers.check(&memory)?;
        args.data.check(args.part.shard, args.spp, &memory)?;
        run(&scene.loaded, &args, denoiser.as_ref(), &mut watcher, terminal)
    });
    watcher.ear.end(rendered)
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
    let watcher = RefCell::new(watcher);
    let hear = &mut |part| watcher.borrow_mut().hear_of_choice(part);
    with_renderer(args, opened, &pool, (&mut Phases::start(), hear), terminal, |ready, _| {
        let Ready { job, recorded, mut renderer } = ready;
        let quality = args.noise.map(Quality::new);
        let ended = pass_loop::run(&mut renderer, &pool, (wanted(args).goal, quality), *watcher.borrow_mut());
        if let Some(exit) = ended.interrupted {
            return Err(Failure { exit, ..Failure::interrupted() });
        }
        watcher.borrow_mut().hear_of_end(&ended.moment);
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

/// Python's eyes.
struct Watcher {
    ear: Ear,
    /// Whether it wants to see the image, too.
    live: Option<Live>,
}

impl Watcher {
    /// The pilot that chooses an integrator.
    fn hear_of_choice(&mut self, part: f64) -> ControlFlow<()> {
        let line = format!("choosing an integrator, {:.0} %", 100.0 * part);
        self.ear.hear(|_| -> Arguments { (0.0, 0, 0.0, None, line, None) })
    }

    /// After the last pass, which a goal in seconds does not know beforehand.
    fn hear_of_end(&mut self, moment: &Moment) {
        if self.ear.is_listening() {
            // What it raises is the render's error; there is nothing left to end.
            let _ = self.ear.hear_now(|py| arguments(py, 1.0, moment, None));
        }
    }
}

impl Watch for Watcher {
    fn after_pass(&mut self, renderer: &Renderer<'_>, next: Next, moment: &mut dyn FnMut() -> Moment) -> Option<Exit> {
        let Self { ear, live } = self;
        let picture = live.as_mut().filter(|_| next == Next::Pass).and_then(|live| live.picture(renderer));
        let told = |py: Python<'_>| {
            let moment = moment();
            arguments(py, moment.fraction(), &moment, picture.as_deref())
        };
        let flow = if picture.is_some() { ear.hear_now(told) } else { ear.hear(told) };
        flow.is_break().then_some(Exit::Interrupted)
    }
}

/// (fraction, samples per pixel, seconds, noise, line, picture).
type Arguments = (f64, u32, f64, Option<f64>, String, Option<Py<PyBytes>>);

fn arguments(py: Python<'_>, fraction: f64, moment: &Moment, picture: Option<&[u8]>) -> Arguments {
    let picture = picture.map(|png| PyBytes::new(py, png).unbind());
    (fraction, moment.passes, moment.elapsed.as_secs_f64(), moment.noise, moment.to_string(), picture)
}

/// The image as it comes, as .png files: one about each second, and less often where they take longer.
struct Live {
    next: Instant,
}

impl Live {
    const WAIT: Duration = Duration::from_secs(1);
    /// So much longer than it took to make one is the time to the next.
    const PAUSE: u32 = 20;

    fn picture(&mut self, renderer: &Renderer<'_>) -> Option<Vec<u8>> {
        let start = Instant::now();
        if start < self.next {
            return None;
        }
        let image = renderer.film().image(renderer.passes());
        let png = encode_png(&image, renderer.alpha().as_deref(), Exposure::Auto).ok();
        self.next = Instant::now() + Self::WAIT.max(Self::PAUSE * start.elapsed());
        png
    }
}
