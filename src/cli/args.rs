//! The options of `pathspace render`, and those that it shares with `pathspace verify`.

use std::{path::PathBuf, time::Duration};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::{
    data::DataArgs,
    environment::EnvironmentArgs,
    exit::Failure,
    layers::LayerArgs,
    progress::{MOST_PASSES, Style},
    terminal::Verbosity,
    values::{self, Bytes, LookAt, Preset, Shard},
};
use crate::{
    film::Crop,
    integrator::{IntegratorKind, RelativeRoulette},
    io::{Limits, LoadOptions, Outside, Required},
    layers::Expression,
    path::{Roulette, Strategy},
    sampling::{Filter, SamplerKind},
    scene::{bsdf::Directions, geometry::BuildEffort, light::LightChoice},
};

// A constant and no comment: rustdoc takes brackets for links.
const PRESET: &str = "A choice of paths: direct light alone (direct: --max-depth 2), or with what mirrors and glass show of it \
    (whitted: --paths 'CS*[DG]?L')";
const PATHS: &str =
    "Only the paths that a light path expression holds for, as with --layer: 'C.*[DG]S+L' renders caustics alone";

/// Larger images are refused: pixels are numbered by 32 bits, padding included.
const LARGEST_SIDE: i64 = 32_768;

/// What `pathspace render` is asked for.
#[derive(Debug, clap::Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,

    /// Image to write, .exr (linear, lossless) or .png; may be given several times [default: SCENE-INTEGRATOR.exr and
    /// .png in the working directory]
    #[arg(short, long, value_name = "OUT")]
    pub(super) output: Vec<PathBuf>,

    /// How paths are sampled
    #[arg(short, long, value_name = "NAME", default_value = "bdpt", value_parser = values::integrator())]
    pub(super) integrator: IntegratorKind,

    /// With -i path-hemisphere: directions by the BSDF, or uniform over the hemisphere
    #[arg(long, value_name = "RULE", value_parser = values::directions())]
    pub(super) hemisphere: Option<Directions>,

    /// Samples per pixel [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_PASSES)))]
    pub(super) spp: Option<u32>,

    /// Render for so long (30s, 5m, 2h) instead of a fixed number of samples
    #[arg(long, value_name = "TIME", conflicts_with = "spp", value_parser = values::duration)]
    pub(super) time: Option<Duration>,

    /// Stop as soon as the relative noise of 95 % of the image's tiles is below this (5%, 0.05), which is looked at after 16, 32, 64, …
    /// samples per pixel; --spp is then the most there may be [default then: 65536]
    #[arg(long, value_name = "X", conflicts_with_all = ["time", "shard"], value_parser = values::noise)]
    pub(super) noise: Option<f64>,

    #[command(flatten)]
    pub(super) size: SizeArgs,

    #[command(flatten)]
    pub(super) paths: PathArgs,

    /// Shortest path, in edges: K^i L_e alone with --min-depth and --max-depth of i + 1
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=255))]
    pub(super) min_depth: u32,

    #[arg(long, value_name = "NAME", value_parser = values::preset(), help = PRESET)]
    pub(super) preset: Option<Preset>,

    #[arg(long = "paths", value_name = "EXPR", value_parser = Expression::parse, conflicts_with = "preset", help = PATHS)]
    pub(super) kept: Option<Expression>,

    /// Samples of the lights at each vertex of a camera path [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(super) light_samples: Option<u32>,

    /// Split camera paths at their first surface into so many, each with a direction and a rest of its own [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(super) splits: Option<u32>,

    /// Light paths for each pixel [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(super) light_paths: Option<u32>,

    /// Connect each vertex of a camera path to so many vertices of light paths, chosen among those of all pixels nearby [default: to each
    /// of its own pixel's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(super) light_vertices: Option<u32>,

    /// So many rays at the first surface of each kind that the integrator has: --light-samples N and --splits N
    #[arg(long, value_name = "N", conflicts_with_all = ["light_samples", "splits"], value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(super) rays: Option<u32>,

    /// Russian roulette before the rays of connections: what would contribute less than T is ended with the probability P, such as
    /// 0.1,50%. T is in units of what all surfaces would show if the lights' power were spread evenly over them [default: off]
    #[arg(long, value_name = "T,P", allow_hyphen_values = true, value_parser = values::connection_roulette)]
    pub(super) connection_roulette: Option<RelativeRoulette>,

    /// Random numbers: independent of each other, or evenly distributed over a pixel's samples (sobol) [default: sobol; independent
    /// with -i light]
    #[arg(long, value_name = "NAME", value_parser = values::sampler())]
    pub(super) sampler: Option<SamplerKind>,

    /// Reconstruction filter
    #[arg(long, value_name = "NAME", default_value = "box", value_parser = values::filter())]
    pub(super) filter: Filter,

    /// Leave the background out of the image, which gets an alpha channel: premultiplied in .exr, straight in .png. An
    /// environment still lights the scene
    #[arg(long)]
    pub(super) transparent: bool,

    /// Exposure of PNG images: radiances times 2^EV [default: automatic]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = values::finite)]
    pub(super) exposure: Option<f32>,

    /// Render only the pixels x0 ≤ x < x1, y0 ≤ y < y1: exactly that part of the full image
    #[arg(long, value_name = "x0,y0,x1,y1", allow_hyphen_values = true, value_parser = values::crop)]
    pub(super) crop: Option<Crop>,

    /// Clamp every contribution to X per channel, which biases the image; recorded in the file [default: off]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = values::positive)]
    pub(super) clamp: Option<f32>,

    /// Only the paths that this strategy samples: s vertices from the light, t from the camera
    #[arg(long, value_name = "s,t", value_parser = values::strategy)]
    pub(super) only_strategy: Option<Strategy>,

    /// With --only-strategy: the strategy by itself, not weighted against the others
    #[arg(long, requires = "only_strategy")]
    pub(super) unweighted: bool,

    #[command(flatten)]
    pub(super) layers: LayerArgs,

    #[command(flatten)]
    pub(super) data: DataArgs,

    #[command(flatten)]
    pub(super) part: PartArgs,

    /// Show progress as a bar or lines, whatever suits (auto), as lines (plain), as a JSON object a line on standard output (json),
    /// or not at all (none)
    #[arg(long, value_name = "STYLE", default_value = "auto", value_parser = values::progress())]
    pub(super) progress: Style,

    /// Show the image as it comes in the viewer tev at this address (tev's own is 127.0.0.1:14158)
    #[arg(long, value_name = "HOST:PORT", value_parser = values::address)]
    pub(super) display: Option<String>,

    /// Write what the render did and took to a JSON file: rays by kind, time by phase, memory, what was left out
    #[arg(long, value_name = "FILE")]
    pub(super) stats: Option<PathBuf>,

    #[command(flatten)]
    pub(super) verbosity: VerbosityArgs,
}

/// Renders that are stopped, continued or shared among machines.
#[derive(Debug, clap::Args)]
pub(super) struct PartArgs {
    /// Keep the exact state of the render in this .exr file, to --resume from: now and then, and at the end [default: none, but
    /// Ctrl-C and SIGTERM finish the pass and write OUT.checkpoint.exr; a second one stops at once]
    #[arg(long, value_name = "FILE")]
    pub(super) checkpoint: Option<PathBuf>,

    /// Time between checkpoints (60s, 5m; a bare number is seconds)
    #[arg(long, value_name = "TIME", default_value = "60s", requires = "checkpoint", value_parser = values::duration)]
    pub(super) checkpoint_every: Duration,

    /// Go on from a checkpoint of the same scene and settings, also to more samples; the image is the same as if nothing had
    /// happened
    #[arg(long, value_name = "FILE")]
    pub(super) resume: Option<PathBuf>,

    /// Render only the I-th of N parts of the samples, I = 1…N, into an .exr file for 'pathspace merge'
    #[arg(long, value_name = "I/N", conflicts_with = "time", value_parser = values::shard)]
    pub(super) shard: Option<Shard>,
}

/// Which scene, from where, under which sky: what every command that renders asks for.
#[derive(Debug, clap::Args)]
pub(super) struct SceneArgs {
    /// The scene, glTF 2.0 (.gltf or .glb)
    #[arg(value_name = "SCENE")]
    pub(super) file: PathBuf,

    /// Scene of a file with several, by name or index [default: the file's default, else the first]
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    pub(super) scene: Option<String>,

    /// Camera of the file, by name or index [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub(super) camera: Option<String>,

    /// A camera at e that looks at t, y upwards, with a vertical field of view in degrees [default: that of the file's
    /// first camera, or 45]
    #[arg(
        long,
        value_name = "ex,ey,ez,tx,ty,tz[,yfov]",
        conflicts_with = "camera",
        allow_hyphen_values = true,
        value_parser = values::look_at
    )]
    pub(super) look_at: Option<LookAt>,

    /// Give the camera a thin lens of this diameter in metres, or none with 0 [default: what the file says, else none]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = values::not_negative)]
    pub(super) aperture: Option<f32>,

    /// The distance along the viewing axis at which a lens is sharp, in metres [default: what the file says; with --look-at the
    /// target]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = values::positive)]
    pub(super) focus: Option<f32>,

    /// How much time building the tree over the scene may take: little, for previews of large scenes (fast), or what makes rays
    /// fastest (best). The image does not depend on it
    #[arg(long, value_name = "EFFORT", default_value = BuildEffort::default().name(), value_parser = values::effort())]
    pub(super) build: BuildEffort,

    /// Hide the back faces of single-sided materials from the camera, as rasterizers do; mirrors, light and shadows still meet them
    #[arg(long)]
    pub(super) cull_backfaces: bool,

    #[command(flatten)]
    pub(super) environment: EnvironmentArgs,

    #[command(flatten)]
    pub(super) load: LoadArgs,
}

/// What a scene file may ask for.
#[derive(Debug, clap::Args)]
pub(super) struct LoadArgs {
    /// Refuse files that have more of something: file-bytes, texels, environment-texels, vertices (of an accessor), zeros (without
    /// data), triangles, instances or depth (of nodes); may be given several times, N like 1000 or 64M
    #[arg(long = "limit", value_name = "NAME=N", value_parser = values::limit)]
    limits: Vec<(&'static str, u64)>,

    /// Follow paths in the scene file that lead out of its folder
    #[arg(long)]
    allow_outside: bool,

    /// Read a file although it requires a material extension that is not supported: its materials will look wrong
    #[arg(long)]
    ignore_required: bool,
}

impl LoadArgs {
    pub(super) fn limits(&self) -> Limits {
        let mut limits = Limits::default();
        for (name, value) in &self.limits {
            if let Some(limit) = limits.get_mut(name) {
                *limit = *value;
            }
        }
        limits
    }

    /// How to read a file of which this scene is wanted.
    pub(super) fn options<'a>(&self, scene: Option<&'a str>) -> LoadOptions<'a> {
        let outside = if self.allow_outside { Outside::Allowed } else { Outside::Refused };
        let required = if self.ignore_required { Required::MaterialsIgnored } else { Required::Honoured };
        LoadOptions { scene, limits: self.limits(), outside, required }
    }
}

/// How large the image is.
#[derive(Debug, clap::Args)]
pub(super) struct SizeArgs {
    /// Image width in pixels [default: 512, or 128 for verify; or from --height]
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u32).range(1..=LARGEST_SIDE))]
    pub(super) width: Option<u32>,

    /// Image height in pixels [default: from the width and the camera's aspect, 4:3 where it has none]
    #[arg(long, value_name = "H", value_parser = clap::value_parser!(u32).range(1..=LARGEST_SIDE))]
    pub(super) height: Option<u32>,

    /// Refuse images whose film needs more memory than this
    #[arg(long, value_name = "SIZE", default_value = "4GiB", value_parser = values::bytes)]
    pub(super) memory_limit: Bytes,
}

impl SizeArgs {
    /// Refuses what takes more than the limit, for these pixels.
    pub(super) fn check_memory(&self, needed: u64, pixels: Crop) -> Result<(), Failure> {
        check_memory(needed, self.memory_limit, pixels)
    }
}

/// Refuses what takes more than `limit`, for these pixels.
pub(super) fn check_memory(needed: u64, limit: Bytes, pixels: Crop) -> Result<(), Failure> {
    let limit = limit.0;
    if needed <= limit {
        return Ok(());
    }
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    Err(Failure::usage(format!(
        "{} × {} pixels need {} MiB of memory, more than the limit of {} MiB (--memory-limit, or a smaller image)",
        pixels.width(),
        pixels.height(),
        mib(needed),
        mib(limit)
    )))
}

/// Which paths, and by which random numbers.
#[derive(Debug, clap::Args)]
pub(super) struct PathArgs {
    /// Longest path, in edges
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=255))]
    pub(super) max_depth: u32,

    /// Russian roulette from this number of edges on, or 'off': by what a step keeps (reflectance:DEPTH, or DEPTH alone), or by what the path
    /// has kept so far (throughput:DEPTH) [default: 2 where light paths are connected as well, else 4; verify: 4]
    #[arg(long, value_name = "off|DEPTH", value_parser = values::roulette)]
    pub(super) roulette: Option<Roulette>,

    /// Which lights a vertex of a camera path samples: each of them (all), or one, uniformly, by kind and power, or by what each could send
    /// there (tree); -i area: points of emitters by area (uniform) or power [default: tree where there are more than two lights with a
    /// place, else power]
    #[arg(long, value_name = "CHOICE", value_parser = values::lights())]
    pub(super) lights: Option<LightChoice>,

    /// Seed of all random numbers
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub(super) seed: u64,

    /// Threads [default: one for each logical processor]; the image does not depend on it
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
}

impl PathArgs {
    /// The threads to render with.
    pub(super) fn thread_pool(&self) -> Result<ThreadPool, Failure> {
        let threads = self.threads.map_or(0, usize::from);
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map_err(|error| Failure::usage(format!("cannot start {threads} threads: {error}")))
    }
}

/// How much is said.
#[derive(Debug, clap::Args)]
pub(super) struct VerbosityArgs {
    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    quiet: bool,

    /// Say what was read and chosen
    #[arg(short, long)]
    verbose: bool,
}

impl VerbosityArgs {
    pub(super) fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (_, true) => Verbosity::Verbose,
            _ => Verbosity::Normal,
        }
    }
}
