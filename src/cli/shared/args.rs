//! The options that commands share.

use std::{path::PathBuf, time::Duration};

use pathspace::{
    film::Crop,
    integrator::IntegratorKind,
    io::{Drafts, Limits, LoadOptions, Outside, PosedAt, Required},
    path::Roulette,
    scene::{geometry::BuildEffort, light::LightChoice},
    verify::Budget,
};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::cli::shared::{
    environment::EnvironmentArgs,
    exit::Failure,
    terminal::Verbosity,
    values::{self, Bytes, LookAt},
};

/// Larger images are refused: pixels are numbered by 32 bits, padding included.
const LARGEST_SIDE: i64 = 32_768;

/// Which scene, from where, under which sky: what every command that renders asks for.
#[derive(Clone, Debug, clap::Args)]
pub struct SceneArgs {
    /// The scene, glTF 2.0 (.gltf or .glb)
    #[arg(value_name = "SCENE")]
    pub file: PathBuf,

    /// Scene of a file with several, by name or index [default: the file's default, else the first]
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    pub scene: Option<String>,

    /// Camera of the file, by name or index [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,

    /// A camera at e that looks at t, y upwards, with a vertical field of view in degrees [default: that of the file's
    /// first camera, or 45]
    #[arg(
        long,
        value_name = "ex,ey,ez,tx,ty,tz[,yfov]",
        conflicts_with = "camera",
        allow_hyphen_values = true,
        value_parser = values::look_at
    )]
    pub look_at: Option<LookAt>,

    /// Give the camera a thin lens of this diameter in metres, or none with 0 [default: what the file says, else none]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = values::not_negative)]
    pub aperture: Option<f32>,

    /// The distance along the viewing axis at which a lens is sharp, in metres [default: what the file says; with
    /// --look-at the target]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = values::positive)]
    pub focus: Option<f32>,

    /// Make the lens a polygon by so many straight blades of its iris, 3 to 64, or round with 0; its area stays
    /// [default: what the file says, else round]
    #[arg(long, value_name = "N", value_parser = values::blades)]
    pub blades: Option<u32>,

    /// Turn the blades, counter-clockwise in the image; without it, a corner of the lens is to the right [default: 0]
    #[arg(
        long,
        value_name = "DEGREES",
        requires = "blades",
        allow_negative_numbers = true,
        value_parser = values::finite
    )]
    pub blade_rotation: Option<f32>,

    /// How much time building the tree over the scene may take: little, for previews of large scenes (fast), or what
    /// makes rays fastest (best). The image does not depend on it [default: best; fast where a render asks for too few
    /// samples to be worth the wait]
    #[arg(long, value_name = "EFFORT", value_parser = values::effort())]
    pub build: Option<BuildEffort>,

    /// Hide the back faces of single-sided materials from the camera, as rasterizers do; mirrors, light and shadows
    /// still meet them
    #[arg(long)]
    pub cull_backfaces: bool,

    #[command(flatten)]
    pub environment: EnvironmentArgs,

    #[command(flatten)]
    pub load: LoadArgs,
}

/// What a scene file may ask for.
#[derive(Clone, Debug, clap::Args)]
pub struct LoadArgs {
    /// Variant of a file's materials (KHR_materials_variants), by name or index [default: the materials that they have
    /// without]
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    variant: Option<String>,

    /// Show the scene's animations, with their skins and morph targets, at this time in seconds; before the first and
    /// after the last key they stand still [default: what they move is at rest]
    #[arg(long, value_name = "SECONDS", group = "posed", allow_negative_numbers = true, value_parser = values::finite)]
    pub at: Option<f32>,

    /// Which animation of a file with several, by name or index [default: all of them, or the first if some move the
    /// same things]
    #[arg(long, value_name = "NAME|INDEX", requires = "posed", allow_hyphen_values = true)]
    animation: Option<String>,

    /// Refuse files that have more of something: file-bytes, decoded-bytes (of compressed geometry), texels,
    /// environment-texels, vertices (of an accessor), zeros (without data), triangles, instances or depth (of nodes);
    /// may be given several times, N like 1000 or 64M
    #[arg(long = "limit", value_name = "NAME=N", value_parser = values::limit)]
    limits: Vec<(&'static str, u64)>,

    /// Follow paths in the scene file that lead out of its folder
    #[arg(long)]
    allow_outside: bool,

    /// Read a file although it requires a material extension that is not supported: its materials will look wrong
    #[arg(long)]
    ignore_required: bool,

    /// Read material extensions that are drafts (coat, fuzz, diffuse roughness): what their pages say may still change
    #[arg(long)]
    drafts: bool,
}

impl LoadArgs {
    pub fn limits(&self) -> Limits {
        let mut limits = Limits::default();
        for (name, value) in &self.limits {
            if let Some(limit) = limits.get_mut(name) {
                *limit = *value;
            }
        }
        limits
    }

    /// How to read a file of which this scene is wanted.
    pub fn options<'a>(&'a self, scene: Option<&'a str>) -> LoadOptions<'a> {
        let outside = if self.allow_outside { Outside::Allowed } else { Outside::Refused };
        let required = if self.ignore_required { Required::MaterialsIgnored } else { Required::Honoured };
        let drafts = if self.drafts { Drafts::Read } else { Drafts::LeftOut };
        let at = self.at.map(|seconds| PosedAt { seconds, animation: self.animation.as_deref() });
        let (variant, limits) = (self.variant.as_deref(), self.limits());
        LoadOptions { scene, variant, at, limits, outside, required, drafts }
    }
}

/// How large the image is.
#[derive(Clone, Debug, clap::Args)]
pub struct SizeArgs {
    /// Image width in pixels [default: 512, or 128 for verify; or from --height]
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u32).range(1..=LARGEST_SIDE))]
    pub width: Option<u32>,

    /// Image height in pixels [default: from the width and the camera's aspect, 4:3 where it has none]
    #[arg(long, value_name = "H", value_parser = clap::value_parser!(u32).range(1..=LARGEST_SIDE))]
    pub height: Option<u32>,

    /// Refuse images whose film needs more memory than this
    #[arg(long, value_name = "SIZE", default_value = "4GiB", value_parser = values::bytes)]
    pub memory_limit: Bytes,
}

impl SizeArgs {
    /// Refuses what takes more than the limit, for these pixels.
    pub fn check_memory(&self, needed: u64, pixels: Crop) -> Result<(), Failure> {
        check_memory(needed, self.memory_limit, pixels)
    }
}

/// Refuses what takes more than `limit`, for these pixels.
pub fn check_memory(needed: u64, limit: Bytes, pixels: Crop) -> Result<(), Failure> {
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
#[derive(Clone, Debug, clap::Args)]
pub struct PathArgs {
    /// Longest path, in edges
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=255))]
    pub max_depth: u32,

    /// Russian roulette from this number of edges on, or 'off': by what a step keeps (reflectance:DEPTH, or DEPTH
    /// alone), or by what the path has kept so far (throughput:DEPTH) [default: 2 where light paths are connected as
    /// well, else 4; verify: 4]
    #[arg(long, value_name = "off|DEPTH", value_parser = values::roulette)]
    pub roulette: Option<Roulette>,

    /// Which lights a vertex of a camera path samples: each of them (all), or one, uniformly, by kind and power, or by
    /// what each could send there (tree); -i area: points of emitters by area (uniform) or power [default: tree where
    /// there are more than two lights with a place, else power]
    #[arg(long, value_name = "CHOICE", value_parser = values::lights())]
    pub lights: Option<LightChoice>,

    /// Seed of all random numbers
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,

    /// Threads [default: one for each logical processor]; the image does not depend on it
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

impl PathArgs {
    /// The threads to render with.
    pub fn thread_pool(&self) -> Result<ThreadPool, Failure> {
        let threads = self.threads.map_or(0, usize::from);
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map_err(|error| Failure::usage(format!("cannot start {threads} threads: {error}")))
    }
}

/// How long several integrators are rendered for.
#[derive(Clone, Debug, clap::Args)]
pub struct BudgetArgs {
    /// Time to spend (30s, 5m, 2h): in all for verify [default: 60s], on each integrator for converge [default: 20s]
    #[arg(long, value_name = "TIME", value_parser = values::duration)]
    time: Option<Duration>,

    /// Samples per pixel of each integrator, instead of a time: reproducible
    #[arg(long, value_name = "N", conflicts_with = "time", value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    spp: Option<u32>,
}

impl BudgetArgs {
    /// What was asked for, or else `default`.
    pub fn budget(&self, default: Duration) -> Budget {
        self.spp.map_or(Budget::Time(self.time.unwrap_or(default)), Budget::Passes)
    }
}

/// Refuses a list of integrators that names one twice.
pub fn check_distinct(integrators: &[IntegratorKind]) -> Result<(), Failure> {
    match (1..integrators.len()).find(|i| integrators[..*i].contains(&integrators[*i])) {
        Some(twice) => Err(Failure::usage(format!("-i names {} twice", integrators[twice]))),
        None => Ok(()),
    }
}

/// How much is said.
#[derive(Clone, Debug, clap::Args)]
pub struct VerbosityArgs {
    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    quiet: bool,

    /// Say what was read and chosen
    #[arg(short, long)]
    verbose: bool,
}

impl VerbosityArgs {
    pub fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (_, true) => Verbosity::Verbose,
            _ => Verbosity::Normal,
        }
    }
}
