//! What makes the value of a pixel, besides the scene and the number of samples: the options that `render` and `trace`
//! have in common, so that one explains what the other shows.

use std::{path::PathBuf, str::FromStr};

use pathspace::{
    choice::{CANDIDATES, Candidate},
    film::{Crop, check_writable},
    integrator::{BYTES_OF_A_LIGHT_VERTEX, Integrator, IntegratorKind, RelativeRoulette, Weighting, Weights},
    layers::{Expression, PathClasses},
    path::{Heuristic, LightPaths, Strategy},
    render::{Background, Settings},
    sampling::{Filter, SamplerKind},
    scene::{Scene, bsdf::Directions, light::LightChoice},
};

use crate::cli::shared::{
    args::{PathArgs, SizeArgs},
    exit::Failure,
    values::{self, Asked, Preset},
};

pub const DEFAULT_SPP: u32 = 64;
pub const DEFAULT_WIDTH: u32 = 512;
/// What a ray tracer of 1980 shows (Whitted, *An Improved Illumination Model for Shaded Display*).
const WHITTED: &str = "CS*[DG]?L";
/// From one vertex to lights: nobody waits for more.
const MOST_RAYS: u64 = 1 << 20;
/// Light vertices of a pass have numbers of 32 bits; an estimate may be off by half.
const MOST_KEPT: u64 = BYTES_OF_A_LIGHT_VERTEX << 31;
/// Beyond this the light paths of a tile are no longer what a thread should keep.
const MOST_LIGHT_SUBPATHS: u64 = 256 << 20;

// A constant and no comment: rustdoc takes brackets for links.
const PRESET: &str = "A choice of paths: direct light alone (direct: --max-depth 2), or with what mirrors and glass \
    show of it \
    (whitted: --paths 'CS*[DG]?L')";
const PATHS: &str =
    "Only the paths that a light path expression holds for, as with --layer: 'C.*[DG]S+L' renders caustics alone";

/// Which paths make a pixel, and how they are sampled.
#[derive(Clone, Debug, clap::Args)]
pub struct ImageArgs {
    /// How paths are sampled
    #[arg(short, long, value_name = "NAME", default_value = "auto", value_parser = values::integrator())]
    pub integrator: Asked,

    /// With -i auto: choose none that merges paths, so that the image has no bias
    #[arg(long)]
    pub unbiased: bool,

    /// With -i auto: take the choice from this JSON file, or write it there if there is none yet
    #[arg(long, value_name = "FILE")]
    pub choice: Option<PathBuf>,

    /// With -i path-hemisphere: directions by the BSDF, or uniform over the hemisphere
    #[arg(long, value_name = "RULE", value_parser = values::directions())]
    pub hemisphere: Option<Directions>,

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

    /// Light paths for each pixel; 1/N for one in N samples of a pixel [default: 1]
    #[arg(long, value_name = "N", value_parser = LightPaths::from_str)]
    pub light_paths: Option<LightPaths>,

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
    /// direct light are, which a pilot measures (variance-aware) [default: variance-aware with hybrid, bdpt, bdpt-sds
    /// and vcm]
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

    /// Clamp every contribution to X per channel, which biases the image; recorded in the file [default: off]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = values::positive)]
    pub clamp: Option<f32>,

    /// Only the paths that this strategy samples: s vertices from the light, t from the camera
    #[arg(long, value_name = "s,t", value_parser = values::strategy)]
    pub only_strategy: Option<Strategy>,

    /// With --only-strategy: the strategy by itself, not weighted against the others
    #[arg(long, requires = "only_strategy")]
    pub unweighted: bool,
}

impl ImageArgs {
    /// The longest paths, in edges.
    pub fn max_depth(&self) -> u32 {
        if self.preset == Some(Preset::Direct) { 2 } else { self.paths.max_depth }
    }

    /// The paths that are in the image, with their expression; `None` for all.
    pub fn kept(&self, scene: &Scene) -> Result<Option<(String, PathClasses)>, Failure> {
        let whitted = || Expression::parse(WHITTED).map_err(|error| Failure::usage(error.to_string()));
        let expression = match self.preset {
            Some(Preset::Whitted) => Some(whitted()?),
            _ => self.kept.clone(),
        };
        let compile = |expression: Expression| {
            let classes = PathClasses::new(&expression, scene);
            Ok((expression.to_string(), classes.map_err(|error| Failure::usage(format!("--paths: {error}")))?))
        };
        expression.map(compile).transpose()
    }

    /// The integrators to choose among, at least one: with `auto` those that have a use for all options.
    pub fn candidates(&self) -> Result<Vec<Candidate>, Failure> {
        self.check_depths()?;
        if let Asked::One(kind) = self.integrator {
            if self.unbiased || self.choice.is_some() {
                return Err(Failure::usage(format!("--unbiased and --choice are for -i auto, and this is -i {kind}")));
            }
            self.refuse_needless(kind)?;
            self.only(kind)?;
            return Ok(vec![Candidate::new(kind, self.light_paths.unwrap_or(LightPaths::ONE))]);
        }
        if let Some(file) = self.choice.as_deref().filter(|file| !file.exists()) {
            check_writable(file).map_err(|error| Failure::output(error.to_string()))?;
        }
        let admitted = |x: &Candidate| !(x.integrator.merges() && self.unbiased);
        let suits = |x: &Candidate| self.refuse_needless(x.integrator).is_ok();
        let serves_tiles = |x: &Candidate| self.light_vertices.is_none() || x.light_paths.is_with_each();
        // The pilot's pixels are larger, and a radius that somebody gives is not: it cannot tell how much would merge.
        let is_foreseen =
            |x: &Candidate| self.merge_radius.is_none() || self.light_paths.is_some() || x.light_paths.is_with_each();
        let asked = |x: Candidate| Candidate { light_paths: self.light_paths.unwrap_or(x.light_paths), ..x };
        let mut candidates = Vec::new();
        for x in CANDIDATES.into_iter().map(asked) {
            if admitted(&x) && suits(&x) && serves_tiles(&x) && is_foreseen(&x) && !candidates.contains(&x) {
                candidates.push(x);
            }
        }
        let merges = |x: &&Candidate| x.integrator.merges();
        let Some(widest) = candidates.iter().rev().find(|x| !merges(x)).or(candidates.last()).copied() else {
            // What the one with the most techniques has no use for.
            self.refuse_needless(IntegratorKind::Bdpt)?;
            return Err(Failure::usage("-i auto has no integrator for all of these options: choose one by -i"));
        };
        if self.only_strategy.is_some() {
            candidates = vec![widest];
            self.only(widest.integrator)?;
        }
        if let ([only], Some(_)) = (&candidates[..], &self.choice) {
            return Err(Failure::usage(format!(
                "--choice keeps what a pilot chooses, and these options leave nothing but -i {only} to choose"
            )));
        }
        Ok(candidates)
    }

    /// Refuses options that the integrator has no use for: somebody expects something of them.
    fn refuse_needless(&self, kind: IntegratorKind) -> Result<(), Failure> {
        if self.hemisphere.is_some() && (!kind.has_strategies() || kind.has(|x| x.s > 0)) {
            return Err(Failure::usage(format!(
                "--hemisphere says how -i path-hemisphere samples, and this is -i {kind}"
            )));
        }
        let none = |what: &str| Err(Failure::usage(format!("-i {kind} {what}")));
        let by_area = !kind.has_strategies();
        let walks_from_camera = kind.has(|x| x.t >= 2);
        let samples_lights = kind.has(|x| x.s == 1 && x.t >= 2);
        if self.splits.is_some() && !walks_from_camera {
            return none("walks no paths from the camera that --splits could split");
        }
        if self.light_samples.is_some() && by_area {
            return none("takes one sample of each length of paths: --light-samples is for others");
        }
        if (self.light_samples.is_some() || self.paths.lights.is_some()) && !samples_lights && !by_area {
            return none("samples no lights at the vertices of a path: --light-samples and --lights are for others");
        }
        if self.connection_roulette.is_some() && !kind.has(|x| x.s >= 1) {
            return none("has no connections that --connection-roulette could end");
        }
        if by_area && matches!(self.paths.lights, Some(LightChoice::All | LightChoice::Tree)) {
            return none("draws points of all emitters: --lights uniform or power");
        }
        if self.light_paths.is_some() && !kind.has(|x| x.t == 1 || x.s >= 2) {
            return none("walks no paths from lights that --light-paths could count");
        }
        if self.light_vertices.is_some() && !kind.has(|x| x.s >= 2 && x.t >= 2) {
            return none("connects no vertices of light paths that --light-vertices could choose");
        }
        if self.light_vertices.is_some() && self.light_paths.is_some_and(|paths| !paths.is_with_each()) {
            return Err(Failure::usage(
                "--light-vertices chooses among the light paths of pixels nearby, which may have none with \
                 --light-paths below 1: leave one of the two out",
            ));
        }
        if self.merge_radius.is_some() && (!kind.merges() || self.unweighted) {
            return none("merges no paths: --merge-radius is for -i bdpt-sds and vcm");
        }
        if self.rays.is_some() && !walks_from_camera {
            return none("has no rays at the first surface that --rays could count");
        }
        Ok(())
    }

    /// Refuses ranges of lengths with no path in them.
    fn check_depths(&self) -> Result<(), Failure> {
        let (least, most) = (self.min_depth, self.max_depth());
        if least > most {
            return Err(Failure::usage(format!(
                "no path has {least} edges or more and {most} at most: raise --max-depth"
            )));
        }
        Ok(())
    }

    fn only(&self, kind: IntegratorKind) -> Result<Option<(Strategy, Weighting)>, Failure> {
        let Some(strategy) = self.only_strategy else { return Ok(None) };
        if !kind.has_strategies() {
            return Err(Failure::usage(
                "area sampling has no strategies (s,t): leave --only-strategy out, or choose -i bdpt",
            ));
        }
        if strategy.s + strategy.t - 1 > self.max_depth() {
            let Strategy { s, t } = strategy;
            let edges = s + t - 1;
            return Err(Failure::usage(format!(
                "strategy ({s},{t}) makes paths of {edges} edges, more than --max-depth {}",
                self.max_depth()
            )));
        }
        Ok(Some((strategy, if self.unweighted { Weighting::Unweighted } else { Weighting::Weighted })))
    }

    /// Of one of the candidates.
    pub fn settings(&self, candidate: Candidate, crop: Crop) -> Result<Settings, Failure> {
        let Candidate { integrator: kind, light_paths } = candidate;
        let (description, only) = (kind.description(), self.only(kind)?);
        let samples_lights = kind.has(|x| x.s == 1 && x.t >= 2);
        // Without MIS, next-event samples alone count for direct light: splitting adds none.
        let follows_directions = description.heuristic != Heuristic::FirstSupported;
        Ok(Settings {
            integrator: kind,
            hemisphere: self.hemisphere.unwrap_or_default(),
            max_depth: self.max_depth().min(description.longest_path),
            min_depth: self.min_depth,
            light_samples: self.rays.filter(|_| samples_lights).or(self.light_samples).unwrap_or(1),
            splits: self.rays.filter(|_| follows_directions).or(self.splits).unwrap_or(1),
            light_paths,
            light_vertices: self.light_vertices,
            merge_radius: self.merge_radius,
            connection_roulette: self.connection_roulette,
            roulette: self.paths.roulette.unwrap_or(description.roulette),
            only,
            weights: self.weights.unwrap_or(description.weights),
            sampler: self.sampler.unwrap_or(description.sampler),
            seed: self.paths.seed,
            filter: self.filter,
            crop,
            clamp: self.clamp,
            background: if self.transparent { Background::Transparent } else { Background::Shown },
        })
    }

    /// Refuses more light vertices for merges than there is room for.
    pub fn check_light_vertices(
        &self,
        (kind, integrator): (IntegratorKind, &Integrator),
        scene: &Scene,
        of_image: u64,
    ) -> Result<(), Failure> {
        let kept = integrator.kept_memory(scene);
        let limit = self.size.memory_limit.0.saturating_sub(of_image).min(MOST_KEPT);
        // Light paths have numbers of 32 bits, too.
        let table = integrator.techniques();
        let [paths, numbers] = [f64::from(table.merging_per_sample()), f64::from(table.light_paths().most())]
            .map(|of_pixel| (f64::from(scene.camera.sensor().pixels()) * of_pixel).ceil() as u64);
        if kept == 0 || (kept <= limit && numbers <= u64::from(u32::MAX)) {
            return Ok(());
        }
        Err(Failure::usage(format!(
            "-i {kind} would keep the light vertices of {paths} light paths in a pass, about {} MiB, where {} MiB are \
             left: a smaller image, fewer --light-paths, a lower --max-depth, or --memory-limit",
            kept >> 20,
            limit >> 20
        )))
    }
}

/// Refuses light paths that a thread would have to keep and has no room for.
pub fn check_light_subpaths(settings: &Settings) -> Result<(), Failure> {
    let of_a_thread = settings.light_subpath_memory();
    if of_a_thread > MOST_LIGHT_SUBPATHS {
        return Err(Failure::usage(format!(
            "--light-vertices would keep {} MB of light paths for each thread: fewer --light-paths, or a lower \
             --max-depth",
            of_a_thread >> 20
        )));
    }
    Ok(())
}

/// Refuses more samples of lights at a vertex than anybody waits for.
pub fn check_light_samples(scene: &Scene, settings: &Settings) -> Result<(), Failure> {
    let samples = u64::from(scene.lights().next_event_samples()) * u64::from(settings.light_samples);
    if samples > MOST_RAYS {
        return Err(Failure::usage(format!(
            "{samples} samples of lights at a vertex are too many: --lights tree, or fewer --light-samples"
        )));
    }
    Ok(())
}
