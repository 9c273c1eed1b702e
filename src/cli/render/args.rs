//! The options of `pathspace render`.

use std::{path::PathBuf, time::Duration};

use pathspace::{
    film::Crop,
    integrator::{IntegratorKind, RelativeRoulette, Weights},
    layers::Expression,
    path::Strategy,
    sampling::{Filter, SamplerKind},
    scene::bsdf::Directions,
};

use crate::cli::{
    render::data::DataArgs,
    shared::{
        args::{PathArgs, SceneArgs, SizeArgs, VerbosityArgs},
        layers::LayerArgs,
        progress::{MOST_PASSES, Style},
        values::{self, Preset, Shard},
    },
};

// A constant and no comment: rustdoc takes brackets for links.
const PRESET: &str = "A choice of paths: direct light alone (direct: --max-depth 2), or with what mirrors and glass \
    show of it \
    (whitted: --paths 'CS*[DG]?L')";
const PATHS: &str =
    "Only the paths that a light path expression holds for, as with --layer: 'C.*[DG]S+L' renders caustics alone";

/// What `pathspace render` is asked for.
#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Image to write, .exr (linear, lossless) or .png; may be given several times [default: SCENE-INTEGRATOR.exr and
    /// .png in the working directory]
    #[arg(short, long, value_name = "OUT")]
    pub output: Vec<PathBuf>,

    /// How paths are sampled
    #[arg(short, long, value_name = "NAME", default_value = "bdpt", value_parser = values::integrator())]
    pub integrator: IntegratorKind,

    /// With -i path-hemisphere: directions by the BSDF, or uniform over the hemisphere
    #[arg(long, value_name = "RULE", value_parser = values::directions())]
    pub hemisphere: Option<Directions>,

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
    pub size: SizeArgs,

    #[command(flatten)]
    pub paths: PathArgs,

    /// Shortest path, in edges: K^i L_e alone with --min-depth and --max-depth of i + 1
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=255))]
    pub min_depth: u32,

    #[arg(long, value_name = "NAME", value_parser = values::preset(), help = PRESET)]
    pub preset: Option<Preset>,

    #[arg(
        long = "paths",
        value_name = "EXPR",
        value_parser = Expression::parse,
        conflicts_with = "preset",
        help = PATHS
    )]
    pub kept: Option<Expression>,

    /// Samples of the lights at each vertex of a camera path [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub light_samples: Option<u32>,

    /// Split camera paths at their first surface into so many, each with a direction and a rest of its own [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub splits: Option<u32>,

    /// Light paths for each pixel [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub light_paths: Option<u32>,

    /// Connect each vertex of a camera path to so many vertices of light paths, chosen among those of all pixels nearby
    /// [default: to each of its own pixel's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub light_vertices: Option<u32>,

    /// Merge paths within R metres in all passes [default: a few pixels, and less in each further pass]
    #[arg(long, value_name = "R", value_parser = values::merge_radius)]
    pub merge_radius: Option<f32>,

    /// So many rays at the first surface of each kind that the integrator has: --light-samples N and --splits N
    #[arg(
        long,
        value_name = "N",
        conflicts_with_all = ["light_samples", "splits"],
        value_parser = clap::value_parser!(u32).range(1..=1024)
    )]
    pub rays: Option<u32>,

    /// Russian roulette before the rays of connections: what would contribute less than T is ended with the probability
    /// P, such as 0.1,50%. T is in units of what all surfaces would show if the lights' power were spread evenly over
    /// them [default: off]
    #[arg(long, value_name = "T,P", allow_hyphen_values = true, value_parser = values::connection_roulette)]
    pub connection_roulette: Option<RelativeRoulette>,

    /// Weights of MIS: of densities and numbers of samples alone (plain), or also of how even a technique's samples of
    /// direct light are, which a pilot measures (variance-aware) [default: variance-aware with hybrid, bdpt and vcm]
    #[arg(long, value_name = "RULE", value_parser = values::weights())]
    pub weights: Option<Weights>,

    /// Random numbers: independent of each other, or evenly distributed over a pixel's samples (sobol) [default: sobol;
    /// independent with -i light]
    #[arg(long, value_name = "NAME", value_parser = values::sampler())]
    pub sampler: Option<SamplerKind>,

    /// Reconstruction filter
    #[arg(long, value_name = "NAME", default_value = "box", value_parser = values::filter())]
    pub filter: Filter,

    /// Leave the background out of the image, which gets an alpha channel: premultiplied in .exr, straight in .png. An
    /// environment still lights the scene
    #[arg(long)]
    pub transparent: bool,

    /// Exposure of PNG images: radiances times 2^EV [default: automatic]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = values::finite)]
    pub exposure: Option<f32>,

    /// Render only the pixels x0 ≤ x < x1, y0 ≤ y < y1: exactly that part of the full image
    #[arg(long, value_name = "x0,y0,x1,y1", allow_hyphen_values = true, value_parser = values::crop)]
    pub crop: Option<Crop>,

    /// Clamp every contribution to X per channel, which biases the image; recorded in the file [default: off]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = values::positive)]
    pub clamp: Option<f32>,

    /// Only the paths that this strategy samples: s vertices from the light, t from the camera
    #[arg(long, value_name = "s,t", value_parser = values::strategy)]
    pub only_strategy: Option<Strategy>,

    /// With --only-strategy: the strategy by itself, not weighted against the others
    #[arg(long, requires = "only_strategy")]
    pub unweighted: bool,

    #[command(flatten)]
    pub layers: LayerArgs,

    #[command(flatten)]
    pub data: DataArgs,

    #[command(flatten)]
    pub part: PartArgs,

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
#[derive(Debug, clap::Args)]
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
