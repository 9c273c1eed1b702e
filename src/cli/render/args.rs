//! The options of `pathspace render`.

use std::{path::PathBuf, time::Duration};

use pathspace::film::Crop;

use crate::cli::{
    render::{data::DataArgs, denoise::DenoiseArgs, frames::FrameArgs},
    shared::{
        args::{SceneArgs, VerbosityArgs},
        image::ImageArgs,
        layers::LayerArgs,
        look::LookArgs,
        progress::{MOST_PASSES, Style},
        values::{self, Shard},
    },
};

/// What `pathspace render` is asked for.
#[derive(Clone, Debug, clap::Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Image to write, .exr (linear, lossless) or .png; may be given several times [default: SCENE-INTEGRATOR.exr and
    /// .png in the working directory]
    #[arg(short, long, value_name = "OUT")]
    pub output: Vec<PathBuf>,

    /// Samples per pixel [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_PASSES)))]
    pub spp: Option<u32>,

    /// Render for so long (30s, 5m, 2h) instead of a fixed number of samples
    #[arg(long, value_name = "TIME", conflicts_with = "spp", value_parser = values::duration)]
    pub time: Option<Duration>,

    /// Stop as soon as the relative noise of 95 % of the image's tiles is below this (5%, 0.05), which is looked at
    /// after 16, 32, 64, … samples per pixel; --spp is then the most there may be [default then: 65536]
    #[arg(long, value_name = "X", conflicts_with_all = ["time", "shard"], value_parser = values::noise)]
    pub noise: Option<f64>,

    #[command(flatten)]
    pub image: ImageArgs,

    #[command(flatten)]
    pub look: LookArgs,

    /// Render only the pixels x0 ≤ x < x1, y0 ≤ y < y1: exactly that part of the full image
    #[arg(long, value_name = "x0,y0,x1,y1", allow_hyphen_values = true, value_parser = values::crop)]
    pub crop: Option<Crop>,

    #[command(flatten)]
    pub layers: LayerArgs,

    #[command(flatten)]
    pub data: DataArgs,

    #[command(flatten)]
    pub denoise: DenoiseArgs,

    #[command(flatten)]
    pub part: PartArgs,

    #[command(flatten)]
    pub frames: FrameArgs,

    /// Show progress as a bar or lines, whatever suits (auto), as lines (plain), as a JSON object a line on standard
    /// output (json), or not at all (none)
    #[arg(long, value_name = "STYLE", default_value = "auto", value_parser = values::progress())]
    pub progress: Style,

    /// Show the image as it comes in the viewer tev at this address (tev's own is 127.0.0.1:14158)
    #[arg(long, value_name = "HOST:PORT", value_parser = values::address)]
    pub display: Option<String>,

    /// Write what the render did and took to a JSON file: rays by kind, time by phase, memory, what was left out
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    #[command(flatten)]
    pub verbosity: VerbosityArgs,
}

/// Renders that are stopped, continued or shared among machines.
#[derive(Clone, Debug, clap::Args)]
pub struct PartArgs {
    /// Keep the exact state of the render in this .exr file, to --resume from: now and then, and at the end [default:
    /// none, but Ctrl-C and SIGTERM finish the pass and write OUT.checkpoint.exr; a second one stops at once]
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Time between checkpoints (60s, 5m; a bare number is seconds)
    #[arg(long, value_name = "TIME", default_value = "60s", requires = "checkpoint", value_parser = values::duration)]
    pub checkpoint_every: Duration,

    /// Go on from a checkpoint of the same scene and settings, also to more samples; the image is the same as if
    /// nothing had happened
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,

    /// Render only the I-th of N parts of the samples, I = 1…N, into an .exr file for 'pathspace merge'
    #[arg(long, value_name = "I/N", conflicts_with = "time", value_parser = values::shard)]
    pub shard: Option<Shard>,
}
