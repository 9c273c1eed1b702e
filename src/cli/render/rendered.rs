//! What follows the last pass of `pathspace render`: warnings, the files, and what is said of them.

use std::{collections::BTreeMap, path::Path};

use pathspace::{denoise::Denoiser, film::Header, render::Renderer};
use rayon::ThreadPool;
use serde_json::{Value, json};

use crate::cli::{
    render::{
        args::RenderArgs,
        keep::{Keeper, resume_command},
        pass_loop::{Ended, Quality},
        stats::{Phases, Stats},
    },
    shared::{
        denoised::{NOISY, denoise},
        exit::{Exit, Failure},
        header::{BIAS, Job, header},
        layers,
        passes::Passes,
        pictures::{Outputs, Picture},
        progress::Progress,
        saved,
        terminal::Terminal,
    },
};

/// A render that has ended, by itself or by a signal.
pub struct Rendered<'a> {
    pub args: &'a RenderArgs,
    pub job: &'a Job<'a>,
    /// What the header says whatever the number of samples.
    pub recorded: &'a BTreeMap<String, String>,
    /// How many passes there are in the whole image, if that is known.
    pub whole: Option<u32>,
    pub outputs: &'a Outputs,
    pub renderer: &'a Renderer<'a>,
    pub ended: Ended,
    /// Why the image is black, if it is.
    pub black: Option<String>,
    pub keeper: &'a Keeper<'a>,
    pub pool: &'a ThreadPool,
    /// What denoises the image, if that is asked for.
    pub denoiser: Option<&'a Denoiser>,
}

/// Says what is wrong with the image.
pub fn warn(black: Option<&str>, ended: &Ended, terminal: Terminal) {
    if let Some(why) = black {
        terminal.warn(format_args!("the image is black: {why}"));
    }
    if let Some(quality) = ended.quality.filter(|quality| !quality.is_reached() && ended.interrupted.is_none()) {
        terminal.warn(format_args!("{} spp are not enough for --noise {}", ended.moment.passes, quality.below));
    }
}

/// The image with what is beside it in its file, denoised if there is a denoiser, which `header` then says. If that
/// fails, the image stays as rendered, and what failed is beside it.
pub fn picture(
    args: &RenderArgs,
    renderer: &Renderer<'_>,
    pool: &ThreadPool,
    denoiser: Option<&Denoiser>,
    header: &mut Header,
) -> (Picture, Result<(), Failure>) {
    let passes = renderer.passes();
    let (data, guides) = pool.install(|| match denoiser {
        None => (args.data.channels(renderer), None),
        Some(_) => args.data.channels_and_guides(renderer),
    });
    let layers = layers::images(&renderer.sums(), passes);
    let mut picture = Picture { image: renderer.film().image(passes), alpha: renderer.alpha(), layers, data };
    let denoised = denoiser.map_or(Ok(()), |denoiser| {
        denoise(&mut picture, header, denoiser, guides.as_ref(), Some(pool.current_num_threads()))
    });
    (picture, denoised)
}

/// What the image's file says of it.
pub fn image_header(
    args: &RenderArgs,
    (job, recorded): (&Job<'_>, &BTreeMap<String, String>),
    renderer: &Renderer<'_>,
    quality: Option<Quality>,
) -> Header {
    let passes = Passes::from(renderer.range());
    let mut header = header(job.sensor, recorded, &renderer.sums(), &passes);
    // It chose the number of samples by what they showed.
    header.attributes.extend(quality.map(|quality| ("noise-target".to_owned(), quality.to_string())));
    header.attributes.extend(args.data.attribute());
    header
}

/// What was written of it.
struct Written<'a> {
    checkpoint: Option<&'a Path>,
    /// `None` for a shard that was interrupted.
    outputs: Option<&'a Outputs>,
    /// Why it is not denoised, if it was to be.
    denoised: Result<(), Failure>,
}

impl Rendered<'_> {
    /// Writes all files, and says what there is to say; the exit code.
    pub fn finish(&self, progress: &Progress, phases: &mut Phases, terminal: Terminal) -> Result<Exit, Failure> {
        warn(self.black.as_deref(), &self.ended, terminal);
        phases.end("render");
        let written = self.write(terminal)?;
        phases.end("write");
        self.write_statistics(phases)?;
        self.say(&written, terminal);
        progress.event(|| self.end(&written));
        written.denoised.map(|()| self.ended.exit())
    }

    fn write(&self, terminal: Terminal) -> Result<Written<'_>, Failure> {
        // The checkpoint first: it is what cannot be made again from the image.
        let checkpoint = match self.ended.interrupted {
            None => self.keeper.at_end(self.renderer)?,
            Some(_) => Some(self.keeper.at_interruption(self.renderer)?),
        };
        let (outputs, denoised) = match (self.args.part.shard, self.ended.interrupted) {
            // Half a shard is none.
            (Some(_), Some(_)) => (None, Ok(())),
            (Some(_), None) => {
                let shard = saved::encode(self.renderer, self.job.sensor, self.recorded, self.whole);
                self.outputs.write_bytes(shard)?;
                (Some(self.outputs), Ok(()))
            }
            (None, _) => (Some(self.outputs), self.write_image(terminal)?),
        };
        Ok(Written { checkpoint, outputs, denoised })
    }

    /// Writes the image and its layers to all outputs; why it is not denoised, if it was to be.
    fn write_image(&self, terminal: Terminal) -> Result<Result<(), Failure>, Failure> {
        let mut header = self.header();
        let (picture, denoised) = picture(self.args, self.renderer, self.pool, self.denoiser, &mut header);
        self.outputs.write(&picture, &header, self.args.look.look(), terminal)?;
        // The samples are worth more than the filter.
        let as_rendered = |Failure { exit, sentence }| Failure {
            exit,
            sentence: format!("{sentence}; {} as rendered", self.outputs.said()),
        };
        Ok(denoised.map_err(as_rendered))
    }

    /// What the image's file says of it.
    fn header(&self) -> Header {
        image_header(self.args, (self.job, self.recorded), self.renderer, self.ended.quality)
    }

    /// Writes the file of `--stats`, if there is to be one.
    fn write_statistics(&self, phases: &Phases) -> Result<(), Failure> {
        let Some(path) = &self.args.stats else { return Ok(()) };
        let Self { job, renderer, ended, keeper, pool, .. } = self;
        let (black, threads) = (self.black.as_deref(), pool.current_num_threads());
        Stats { job, renderer, ended, black, keeper, phases, threads }.write(path)
    }

    /// What was written, and how an interrupted render goes on.
    fn say(&self, written: &Written<'_>, terminal: Terminal) {
        if let Some(outputs) = written.outputs {
            terminal.say(outputs.said());
        }
        if let Some((_, bias)) = self.header().attributes.iter().find(|(name, _)| name == BIAS) {
            terminal.say(format_args!("note: the image is {bias}"));
        }
        if self.denoiser.is_some() && written.outputs.is_some() && written.denoised.is_ok() {
            terminal.say(format_args!(
                "note: the image is denoised, to look at and not to measure; an .exr file has it as rendered in the \
                 layer {NOISY}"
            ));
        }
        if let (Some(_), Some(checkpoint)) = (self.ended.interrupted, written.checkpoint) {
            let goes_on = match &self.args.frames.this {
                None => resume_command(checkpoint),
                Some(frame) => frame.resume.as_deref().map_or_else(|| frame.rest(), resume_command),
            };
            terminal.say(format_args!("interrupted; to go on: {goes_on}"));
        }
    }

    /// The last object of `--progress json`.
    fn end(&self, written: &Written<'_>) -> Value {
        let name = |path: &Path| path.display().to_string();
        let files: Vec<_> = written.outputs.iter().flat_map(|outputs| outputs.paths()).map(|path| name(path)).collect();
        let ended = &self.ended;
        let exit = written.denoised.as_ref().map_or_else(|failure| failure.exit, |()| ended.exit());
        json!({
            "event": "end",
            "outcome": ended.outcome(),
            "exit": exit as u8,
            "spp": ended.moment.passes,
            "elapsed": ended.moment.elapsed.as_secs_f64(),
            "noise": ended.moment.noise,
            "black": self.black,
            "files": files,
            "checkpoint": written.checkpoint.map(name),
        })
    }
}
