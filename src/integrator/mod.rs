//! Integrators: each a table of techniques and a weight rule. The estimator below is the same for all of them.

mod area;
mod bdpt;
mod connection_roulette;
mod hybrid;
mod light;
mod path;
mod path_hemisphere;
mod path_light;

use std::{fmt, str::FromStr};

pub use connection_roulette::{ConnectionRoulette, RelativeRoulette};

use crate::{
    math::{Rgb, luminance},
    path::{
        Densities, Heuristic, JoinedPath, LightVertices, Rivals, Roulette, Step, Strategy, Subpath, Technique,
        Techniques,
    },
    sampling::{Block, Sampler, SamplerKind},
    scene::{
        Scene,
        bsdf::{Directions, Transport},
        camera::{Raster, Sensor},
        light::{LightChoice, Lights},
    },
};

/// The integrators that a person can choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// Path tracing with next-event estimation: s ≤ 1.
    Path,
    /// Light tracing: t = 1.
    Light,
    /// Path and light tracing in one, weighted: s ≤ 1 or t = 1.
    Hybrid,
    /// Bidirectional path tracing: every strategy with t ≥ 1.
    Bdpt,
    /// Directional sampling alone: s = 0.
    PathHemisphere,
    /// Next-event estimation without MIS: s = 1, and s = 0 where that has no support.
    PathLight,
    /// Every vertex on its own, over the area of the surfaces.
    Area,
}

impl IntegratorKind {
    /// All of them, in the order of the documentation.
    pub const ALL: [Self; 7] =
        [Self::Path, Self::Light, Self::Hybrid, Self::Bdpt, Self::PathHemisphere, Self::PathLight, Self::Area];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => path::NAME,
            Self::Light => light::NAME,
            Self::Hybrid => hybrid::NAME,
            Self::Bdpt => bdpt::NAME,
            Self::PathHemisphere => path_hemisphere::NAME,
            Self::PathLight => path_light::NAME,
            Self::Area => area::NAME,
        }
    }

    /// The class of paths that the integrator's table can sample at all, in a sentence.
    pub fn coverage(self) -> &'static str {
        match self {
            Self::Path => path::COVERAGE,
            Self::Light => light::COVERAGE,
            Self::Hybrid => hybrid::COVERAGE,
            Self::Bdpt => bdpt::COVERAGE,
            Self::PathHemisphere => path_hemisphere::COVERAGE,
            Self::PathLight => path_light::COVERAGE,
            Self::Area => area::COVERAGE,
        }
    }

    /// The longest paths that it finds whatever is asked for, in edges.
    pub fn longest_path(self) -> u32 {
        match self {
            Self::Area => area::MAX_EDGES,
            _ => u32::MAX,
        }
    }

    /// The random numbers that give it the least noise in the same time. Where paths land anywhere on the image, nothing fills a pixel evenly.
    pub fn sampler(self) -> SamplerKind {
        match self {
            Self::Light | Self::Area => SamplerKind::Independent,
            _ => SamplerKind::Sobol,
        }
    }

    /// The roulette that gives it the least noise in the same time: early where a vertex costs many connections and its share of the
    /// image has other strategies, later where the walk is all there is.
    pub fn roulette(self) -> Roulette {
        match self {
            Self::Hybrid | Self::Bdpt => Roulette::FromDepth(2),
            _ => Roulette::default(),
        }
    }

    /// How it chooses among these lights with the least noise in the same time. Without next-event estimation nothing asks for more
    /// than the power, by which emission starts.
    pub fn choice_among(self, lights: &Lights) -> LightChoice {
        match self {
            Self::Light | Self::PathHemisphere | Self::Area => LightChoice::Power,
            Self::Path | Self::Hybrid | Self::Bdpt | Self::PathLight => lights.suitable_choice(),
        }
    }

    /// Whether a pass finds paths that may land anywhere on the image.
    pub fn traces_from_lights(self) -> bool {
        match self {
            Self::Path | Self::PathHemisphere | Self::PathLight => false,
            Self::Light | Self::Hybrid | Self::Bdpt | Self::Area => true,
        }
    }

    fn table(self, sensor: Sensor, max_depth: u32) -> Techniques {
        let multiplicity = match self {
            Self::Path => path::multiplicity,
            Self::Light => light::multiplicity,
            Self::Hybrid => hybrid::multiplicity,
            Self::Bdpt => bdpt::multiplicity,
            Self::PathHemisphere => return Techniques::directional(sensor, max_depth, Directions::Bsdf),
            Self::PathLight => path_light::multiplicity,
            Self::Area => return Techniques::by_area(sensor, max_depth.min(area::MAX_EDGES)),
        };
        Techniques::new(sensor, max_depth, multiplicity)
    }

    /// The rule that weighs its table.
    fn heuristic(self) -> Heuristic {
        match self {
            Self::PathLight => Heuristic::FirstSupported,
            _ => Heuristic::Power,
        }
    }
}

impl fmt::Display for IntegratorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for IntegratorKind {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|kind| kind.name() == s).ok_or_else(|| {
            let known: Vec<_> = Self::ALL.into_iter().map(Self::name).collect();
            format!("there is no integrator '{s}'; choose one of {}", known.join(", "))
        })
    }
}

/// How the deposits of a single strategy are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// With its share of the whole table: the images of all strategies add up to the integrator's.
    Weighted,
    /// As if it were the only one: each image is an estimate of its own of whatever the strategy can find.
    Unweighted,
}

/// An integrator: which techniques are evaluated, and the table and rule that weigh them.
#[derive(Clone, Debug)]
pub struct Integrator {
    evaluated: Techniques,
    weighed: Techniques,
    heuristic: Heuristic,
    /// Where the table and the rule have them.
    rivals: Option<Rivals>,
    roulette: Roulette,
    connections: Option<ConnectionRoulette>,
}

impl Integrator {
    /// The integrator `kind` for an image and paths of at most `max_depth` edges.
    pub fn new(kind: IntegratorKind, sensor: Sensor, max_depth: u32, roulette: Roulette) -> Self {
        Self::from_table(kind.table(sensor, max_depth), kind.heuristic(), roulette)
    }

    /// [`IntegratorKind::PathHemisphere`] with a rule of one's own for directions.
    pub fn path_hemisphere(sensor: Sensor, max_depth: u32, roulette: Roulette, directions: Directions) -> Self {
        let table = Techniques::directional(sensor, max_depth, directions);
        Self::from_table(table, IntegratorKind::PathHemisphere.heuristic(), roulette)
    }

    /// An integrator of one's own.
    pub fn from_table(table: Techniques, heuristic: Heuristic, roulette: Roulette) -> Self {
        let rivals = Rivals::of(&table, heuristic);
        Self { evaluated: table.clone(), weighed: table, heuristic, rivals, roulette, connections: None }
    }

    /// The same integrator with so many next-event samples at each camera vertex: n_{1,t} of the lecture's light-area sampling.
    #[must_use]
    pub fn with_light_samples(self, samples: u32) -> Self {
        self.with_tables(|table| table.with_light_samples(samples))
    }

    /// The same integrator with camera subpaths that split at their first surface: see [`Techniques::with_splits`].
    #[must_use]
    pub fn with_splits(self, splits: u32) -> Self {
        self.with_tables(|table| table.with_splits(splits))
    }

    /// The same integrator with so many light subpaths for each pixel: see [`Techniques::with_light_paths`].
    #[must_use]
    pub fn with_light_paths(self, light_paths: u32) -> Self {
        self.with_tables(|table| table.with_light_paths(light_paths))
    }

    fn with_tables(self, change: impl Fn(&Techniques) -> Techniques) -> Self {
        let [evaluated, weighed] = [&self.evaluated, &self.weighed].map(change);
        self.with_weighed(evaluated, weighed)
    }

    /// The same integrator with roulette on its connections, next-event rays among them.
    #[must_use]
    pub fn with_connection_roulette(self, roulette: ConnectionRoulette) -> Self {
        Self { connections: Some(roulette), ..self }
    }

    /// The same integrator with the deposits of one strategy only.
    #[must_use]
    pub fn only(self, strategy: Strategy, weighting: Weighting) -> Self {
        let evaluated = self.evaluated.only(strategy);
        let weighed = match weighting {
            Weighting::Weighted => self.weighed.clone(),
            Weighting::Unweighted => evaluated.clone(),
        };
        self.with_weighed(evaluated, weighed)
    }

    fn with_weighed(self, evaluated: Techniques, weighed: Techniques) -> Self {
        Self { rivals: Rivals::of(&weighed, self.heuristic), evaluated, weighed, ..self }
    }

    /// The table that weighs.
    pub fn techniques(&self) -> &Techniques {
        &self.weighed
    }

    /// The rule that weighs.
    pub fn heuristic(&self) -> Heuristic {
        self.heuristic
    }

    /// w of a path that this integrator's own walks have found.
    #[inline(always)]
    pub fn weight(&self, path: &JoinedPath) -> f32 {
        match &self.rivals {
            Some(rivals) => path.running_weight(&self.weighed, rivals),
            None => self.whole_weight(path),
        }
    }

    /// The weight summed over the whole table. Out of line, since no table of [`IntegratorKind`] needs it for long paths.
    #[inline(never)]
    fn whole_weight(&self, path: &JoinedPath) -> f32 {
        path.mis_weight(&self.weighed, self.heuristic)
    }

    /// Whether the table has a strategy that could find this path: the integrator's coverage, path by path.
    pub fn covers(&self, path: &JoinedPath) -> bool {
        // What found the path has a positive density, and the definition is slow.
        if let Technique::Bidirectional(found) = path.technique()
            && self.weighed.multiplicity(found) > 0
        {
            return true;
        }
        let n = path.edges();
        let path = path.to_path();
        if self.weighed.area() > 0 && n <= self.weighed.max_depth() && path.pdf_area() > 0.0 {
            return true;
        }
        (1..=n + 1)
            .map(|t| Strategy { s: n + 1 - t, t })
            .any(|x| self.weighed.multiplicity(x) > 0 && path.pdf_by(self.weighed.directions(), x) > 0.0)
    }

    /// Whether it walks from the camera: else nothing needs a place on the film to begin with.
    #[inline]
    pub fn walks_from_camera(&self) -> bool {
        self.evaluated.camera_vertices() > 0
    }

    /// Storage for this integrator's subpaths, one per thread.
    pub fn scratch(&self) -> Scratch {
        let LightVertices { connected, splatted } = self.evaluated.light_vertices();
        let rivals = self.rivals.as_ref();
        let light = Subpath::with_capacity(connected.max(splatted))
            .summing(rivals.map(|rivals| rivals.light.clone()).unwrap_or_default());
        Scratch {
            camera: Subpath::with_capacity(self.evaluated.camera_vertices().max(1))
                .sampling(self.evaluated.directions())
                .summing(rivals.map(|rivals| rivals.camera.clone()).unwrap_or_default()),
            lights: vec![light; self.evaluated.light_paths() as usize],
            lens: Subpath::with_capacity(1),
            drawn: Vec::new(),
        }
    }
}

/// The subpaths of one thread.
#[derive(Clone, Debug)]
pub struct Scratch {
    camera: Subpath,
    lights: Vec<Subpath>,
    lens: Subpath,
    drawn: Vec<Step>,
}

/// What becomes of the paths that are found.
pub trait Sink {
    /// A path and its share w F/(n p) of one pass, without h_j: the value to spread around `path.raster()`.
    /// It is finite and not negative.
    fn deposit(&mut self, path: &JoinedPath, value: Rgb);

    /// A contribution that is not finite or negative, and so has no place in an image: to be counted, never dropped silently.
    fn reject(&mut self, path: &JoinedPath, value: Rgb);

    /// A connection's ray was traced.
    fn shadow_ray(&mut self) {}

    /// Roulette ended a connection before its ray.
    fn spared_ray(&mut self) {}

    /// A subpath was walked, from the camera (radiance) or from a light (importance), with this many rays.
    fn walked(&mut self, _transport: Transport, _rays: usize) {}
}

/// What one unit of work, a pixel of the padded image, has to do in a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Where the camera subpath starts, or `None` if the pixel is outside the crop.
    pub camera: Option<Raster>,
    /// Whether the pixel's light subpath is one of the N_l that splat.
    pub splats: Splats,
}

/// See [`Unit::splats`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Splats {
    /// A pixel of the image: its light subpath is connected to the lens.
    Yes,
    /// A pixel of the padding, whose light subpath only serves its own camera subpath.
    No,
}

impl Integrator {
    /// Estimates one sample of one pixel: walks its subpaths, joins them by every strategy of the table, and deposits.
    ///
    /// A connection's ray is traced only where something can arrive, and before the path is weighed: V of the connecting edge
    /// is in the other strategies' densities, and what is blocked needs no weight.
    #[inline(always)]
    pub fn estimate<S: Sampler>(
        &self,
        scene: &Scene,
        unit: Unit,
        scratch: &mut Scratch,
        samplers: &mut Samplers<'_, S>,
        sink: &mut impl Sink,
    ) {
        let LightVertices { connected, splatted } = self.evaluated.light_vertices();
        let connected = if unit.camera.is_some() { connected } else { 0 };
        let splatted = if unit.splats == Splats::Yes { splatted } else { 0 };
        let Scratch { camera, lights, lens, drawn } = scratch;
        let anywhere = Raster(glam::Vec2::ZERO);
        let light_paths = if connected.max(splatted) > 0 { self.evaluated.light_paths() } else { 0 };
        for number in 0..light_paths {
            let light = &mut lights[number as usize];
            light.walk_from_light(scene, number, connected.max(splatted), self.roulette, samplers.light);
            sink.walked(Transport::Importance, light.steps().len().saturating_sub(1));
            let splatting = if splatted > 0 { light.steps() } else { &[] };
            for (s, y) in (1..).zip(splatting) {
                let samples = self.evaluated.multiplicity(Strategy { s: s as u32, t: 1 });
                for k in 0..samples {
                    samplers.lens.start(Block::repeated(s as u32 - 1, number * samples + k));
                    if lens.put_lens_towards(scene, &y.vertex.point, samplers.lens) {
                        let path = JoinedPath::inner(scene, lens.steps(), light, s, anywhere);
                        self.consider(path, || samplers.lens.next_1d(), sink);
                    }
                }
            }
        }
        if unit.splats == Splats::Yes {
            for _ in 0..self.evaluated.area() {
                for n in 1..=self.evaluated.max_depth() {
                    self.consider(area::draw(scene, n, drawn, samplers.connection), || 0.0, sink);
                }
            }
        }
        let Some(raster) = unit.camera.filter(|_| self.walks_from_camera()) else { return };
        let vertices = self.evaluated.camera_vertices();
        let of_each = scene.lights().next_event_samples();
        for branch in 0..self.evaluated.splits() {
            // What all branches of a split subpath have in common is joined once.
            let joined = if branch == 0 {
                camera.walk_from_camera(scene, raster, vertices, self.roulette, samplers.camera);
                1
            } else {
                camera.walk_again(scene, branch, vertices, self.roulette, samplers.camera);
                2
            };
            sink.walked(Transport::Radiance, camera.steps().len().saturating_sub(joined));
            for t in joined + 1..=camera.steps().len() {
                let prefix = &camera.steps()[..t];
                for _ in 0..self.evaluated.multiplicity(Strategy { s: 0, t: t as u32 }) {
                    self.consider(JoinedPath::hit(scene, prefix, raster), || 0.0, sink);
                }
                let z = &prefix[t - 1].vertex.point;
                if !z.bsdf.has_continuous() {
                    continue;
                }
                let samples = of_each * self.evaluated.multiplicity(Strategy { s: 1, t: t as u32 });
                let mut nth = 0;
                for k in 0..samples {
                    samplers.connection.start(Block::repeated(t as u32 - 2, branch * samples + k));
                    let u = samplers.connection.next_3d();
                    let sampled = scene.sample_next_event(z, u, nth);
                    nth = if nth + 1 == of_each { 0 } else { nth + 1 };
                    if let Some((point, pdf)) = sampled {
                        let end = Step::next_event(point, pdf);
                        let path = JoinedPath::next_event(scene, prefix, &end, raster);
                        self.consider(path, || samplers.connection.next_1d(), sink);
                    }
                }
                for number in 0..light_paths {
                    let light = &lights[number as usize];
                    for s in 2..=light.steps().len() {
                        for _ in 0..self.evaluated.multiplicity(Strategy { s: s as u32, t: t as u32 }) {
                            let chance = || {
                                let block = Block::connection(s as u32, t as u32, number);
                                samplers.connection.start(block.of_branch(branch));
                                samplers.connection.next_1d()
                            };
                            self.consider(JoinedPath::inner(scene, prefix, light, s, raster), chance, sink);
                        }
                    }
                }
            }
        }
    }

    /// Weighs and deposits a path, if it contributes anything and nothing blocks it. `chance` is a number for roulette.
    #[inline(always)]
    fn consider(&self, path: Option<JoinedPath<'_>>, chance: impl FnOnce() -> f32, sink: &mut impl Sink) {
        let Some(path) = path.filter(|path| path.contribution() != Rgb::ZERO) else { return };
        let mut per_survival = 1.0;
        if path.strategy().s > 0 {
            if let Some(roulette) = &self.connections
                && self.tentative(&path) < roulette.threshold
            {
                if chance() < roulette.end {
                    sink.spared_ray();
                    return;
                }
                per_survival = mistake!(1.0 / (1.0 - roulette.end), TentativeUndivided => 1.0);
            }
            sink.shadow_ray();
        }
        let Some(path) = path.seen() else { return };
        let value = path.contribution() * (self.share(&path) * per_survival);
        if value == Rgb::ZERO {
            return;
        }
        if value.is_finite() && value.min_element() >= 0.0 {
            sink.deposit(&path, value);
        } else {
            sink.reject(&path, value);
        }
    }
}

impl Integrator {
    /// w/n: what a path that was found deposits of F/p.
    #[inline(always)]
    fn share(&self, path: &JoinedPath<'_>) -> f32 {
        self.weight(path) / self.weighed.samples(path.technique())
    }

    /// What the path would contribute to its pixel if nothing were in the way, luminance: w F/(n p) with V = 1. Out of line, since it is
    /// asked for with roulette on connections alone.
    #[inline(never)]
    fn tentative(&self, path: &JoinedPath<'_>) -> f32 {
        luminance(path.contribution()) * self.share(path)
    }
}

/// The sequences of random numbers of one sample, so that none shifts another.
#[derive(Debug)]
pub struct Samplers<'a, S> {
    /// For the camera subpath.
    pub camera: &'a mut S,
    /// For the light subpath.
    pub light: &'a mut S,
    /// For the connections.
    pub connection: &'a mut S,
    /// For the lens points that light subpaths are connected to.
    pub lens: &'a mut S,
}
