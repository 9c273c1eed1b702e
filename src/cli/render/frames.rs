//! `--frames`: an image for each frame of the scene's animations.
//!
//! A frame is the render of the same options with `--at` its time and `--seed` plus its number, into files that have
//! its number: nothing else, so that each can be rendered by itself, on any machine.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use crate::cli::{
    render::{args::RenderArgs, output_paths},
    shared::{
        exit::{Exit, Failure},
        interrupt::Interrupt,
        terminal::Terminal,
        values::{self, Frames},
    },
};

/// Which frames, and when they are.
#[derive(Clone, Debug, clap::Args)]
pub struct FrameArgs {
    /// Render frames A to B, both included, of the scene's animations, each into a file of its own: out.0001.exr for -o
    /// out.exr, or the number in place of #### in a name. Frame f is what --at f/FPS and --seed S + f render; with
    /// --resume, frames whose .exr files are finished are left as they are
    #[arg(
        long,
        value_name = "A..B",
        group = "posed",
        conflicts_with = "shard",
        value_parser = values::frames
    )]
    pub frames: Option<Frames>,

    /// Frames per second of --frames
    #[arg(
        long,
        value_name = "N",
        default_value = "24",
        requires = "frames",
        value_parser = values::positive
    )]
    fps: f32,

    /// Which of the frames this is a render of.
    #[arg(skip)]
    pub this: Option<Frame>,

    /// Whether frames that are finished are left as they are.
    #[arg(skip)]
    pub goes_on: bool,
}

/// A frame that is being rendered.
#[derive(Clone, Debug)]
pub struct Frame {
    pub number: u32,
    /// What --resume takes to go on after an interruption; `None` where what is finished cannot be told.
    pub resume: Option<PathBuf>,
    /// The last frame.
    last: u32,
}

/// Renders one frame after the other with `render`, which renders an image and gets the warnings that were said before.
pub fn run(
    args: &RenderArgs,
    frames: Frames,
    (interrupt, terminal): (&Interrupt, Terminal),
    render: impl Fn(&RenderArgs, &mut BTreeSet<String>) -> Result<Exit, Failure>,
) -> Result<Exit, Failure> {
    let tells = args.time.is_none() && args.noise.is_none();
    if args.part.resume.is_some() && !tells {
        return Err(Failure::usage(
            "--resume cannot tell which frames of --time or --noise are finished: leave it out, and name the frames \
             that are missing (--frames)",
        ));
    }
    if !time(frames.last, args.frames.fps).is_finite() {
        return Err(Failure::usage("so few --fps put the last frame beyond all times"));
    }
    let mut said = BTreeSet::new();
    let mut exit = Exit::Done;
    for number in frames.first..=frames.last {
        let of_frame = args.of_frame(number, frames.last);
        if let Some(asked) = interrupt.asked() {
            terminal.say(format_args!("interrupted; to go on: {}", rest(number, frames.last)));
            return Ok(asked);
        }
        terminal.say(format_args!("frame {number} of {frames}, {} s", of_frame.scene.load.at.unwrap_or_default()));
        let rendered = render(&of_frame, &mut said)
            .map_err(|failure| Failure { sentence: format!("frame {number}: {}", failure.sentence), ..failure })?;
        match rendered {
            Exit::Done => {}
            Exit::Incomplete => exit = rendered,
            interrupted => return Ok(interrupted),
        }
    }
    Ok(exit)
}

impl RenderArgs {
    /// The render of one frame.
    fn of_frame(&self, number: u32, last: u32) -> Self {
        let mut args = self.clone();
        let outputs = output_paths(self);
        args.scene.load.at = Some(time(number, self.frames.fps));
        args.image.paths.seed = self.image.paths.seed.wrapping_add(number.into());
        args.output = outputs.iter().map(|path| numbered(path, number)).collect();
        args.stats = self.stats.as_deref().map(|path| numbered(path, number));
        args.part.checkpoint = self.part.checkpoint.as_deref().map(|path| numbered(path, number));
        // Frames that were not begun have none.
        let begun = |path: &Path| Some(numbered(path, number)).filter(|path| path.exists());
        args.part.resume = self.part.resume.as_deref().and_then(begun);
        let checkpoint = || outputs.first().map(|path| pattern(path).with_extension("checkpoint.exr"));
        let resume = self.part.checkpoint.clone().or_else(checkpoint);
        let tells = self.time.is_none() && self.noise.is_none();
        args.frames.goes_on = self.part.resume.is_some();
        args.frames.this = Some(Frame { number, resume: resume.filter(|_| tells), last });
        args
    }
}

impl Frame {
    /// What renders the frames that are missing.
    pub fn rest(&self) -> String {
        rest(self.number, self.last)
    }
}

/// What renders these frames.
fn rest(first: u32, last: u32) -> String {
    format!("the same command with --frames {first}..{last}")
}

/// When a frame is, seconds.
fn time(number: u32, fps: f32) -> f32 {
    (f64::from(number) / f64::from(fps)) as f32
}

/// A name with its place for a number: `out.exr` is `out.####.exr`.
fn pattern(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if name.contains('#') {
        return path.to_owned();
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map(|extension| format!(".{}", extension.to_string_lossy()));
    path.with_file_name(format!("{stem}.####{}", extension.unwrap_or_default()))
}

/// The name with a number in place of its last row of #, as long as that at least.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let path = pattern(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let end = name.rfind('#').map_or(0, |last| last + 1);
    let start = name[..end].trim_end_matches('#').len();
    let width = end - start;
    path.with_file_name(format!("{}{number:0width$}{}", &name[..start], &name[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_goes_before_the_extension_or_where_a_name_has_room_for_it() {
        let name = |text: &str, number| numbered(Path::new(text), number).display().to_string();
        assert_eq!(name("a/out.exr", 7), "a/out.0007.exr");
        assert_eq!(name("out.v2.exr", 12345), "out.v2.12345.exr");
        assert_eq!(name("out", 0), "out.0000");
        assert_eq!(name("a#b/f##.exr", 3), "a#b/f03.exr");
        assert_eq!(name("##_######.png", 3), "##_000003.png");
        assert_eq!(name("bild-ä#", 10), "bild-ä10");
        assert_eq!(
            pattern(Path::new("out.exr")).with_extension("checkpoint.exr"),
            Path::new("out.####.checkpoint.exr")
        );
    }
}
