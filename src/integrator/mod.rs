//! Integrators: each a table of techniques and a weight rule. The estimator is the same for all of them.

mod connection_roulette;
mod description;
mod estimator;
mod kind;
mod light_vertex_map;
mod samplers;
mod wave;

pub use connection_roulette::{ConnectionRoulette, RelativeRoulette};
pub use description::{Description, Gap, Landing, LightSampling, Merges, Table, Weights};
pub use estimator::{Connects, LightStage, Scratch, Sink, Splats};
pub use light_vertex_map::{BYTES_OF_A_LIGHT_VERTEX, LightVertexMap, Sweep};
pub use samplers::{Kept, Samplers};
pub use wave::{Starts, Wave, WaveSink};

use std::sync::Arc;

use self::estimator::connectible;
use crate::{
    path::{
        Densities, Heuristic, JoinedPath, LightPaths, LightVertices, Rivals, Roulette, Step, Strategy, Subpath,
        Technique, Techniques, VarianceFactors,
    },
    sampling::{Independent, Stream},
    scene::{Scene, bsdf::Directions, camera::Sensor},
};

// An integrator is a file, with a comment that explains it and its `DESCRIPTION`, and a line here.
kind::integrators! {
    Path: path,
    Light: light,
    Hybrid: hybrid,
    Bdpt: bdpt,
    BdptSds: bdpt_sds,
    Vcm: vcm,
    PathHemisphere: path_hemisphere,
    PathLight: path_light,
    Area: area,
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

    /// An integrator of one's own.
    ///
    /// # Panics
    /// If the table merges, and has no running sums ([`Rivals::of`]) that would weigh what has merged.
    pub fn from_table(table: Techniques, heuristic: Heuristic, roulette: Roulette) -> Self {
        let rivals = Rivals::of(&table, heuristic);
        assert!(table.radius().is_none() || rivals.is_some(), "merges are weighed by running sums");
        Self { evaluated: table.clone(), weighed: table, heuristic, rivals, roulette, connections: None }
    }

    /// The same integrator with another rule for the directions of walks from the camera, if all of its strategies are
    /// s = 0: others take densities of the BSDF's own directions for granted, and stay as they are.
    #[must_use]
    pub fn with_directions(self, directions: Directions) -> Self {
        self.with_tables(|table| table.with_directions(directions))
    }

    /// The same integrator with so many next-event samples at each camera vertex: n_{1,t} of the lecture's light-area
    /// sampling.
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
    pub fn with_light_paths(self, light_paths: LightPaths) -> Self {
        self.with_tables(|table| table.with_light_paths(light_paths))
    }

    /// The same integrator with connections from each camera vertex to `each` light vertices, chosen uniformly among
    /// those of a whole tile, in place of all that its own pixel has: see [`Techniques::with_light_vertices`]. To be
    /// asked for after all else that changes light subpaths, since their mean length is in the table.
    #[must_use]
    pub fn with_light_vertices(self, scene: &Scene, each: u32) -> Self {
        let of_a_path = self.mean_ends(scene);
        self.with_tables(|table| table.with_light_vertices(each, of_a_path))
    }

    /// What the light vertices of a pass that are kept for merges will take, about, in bytes.
    pub fn kept_memory(&self, scene: &Scene) -> u64 {
        let fewest = self.weighed.meeting_places().fewest_light_vertices() as usize;
        let ends = |steps: &[Step]| {
            steps.iter().skip(fewest - 1).filter(|step| step.vertex.point.bsdf.has_continuous()).count()
        };
        let of_a_path = if self.merges() { self.mean_of_a_path(scene, ends) } else { 0.0 };
        let paths = f64::from(scene.camera.sensor().pixels()) * f64::from(self.evaluated.merging_per_sample());
        (paths * f64::from(of_a_path)) as u64 * BYTES_OF_A_LIGHT_VERTEX
    }

    /// How many vertices that can be connected a light subpath has in the mean, or 1 where none has any.
    fn mean_ends(&self, scene: &Scene) -> f32 {
        let ends = self.mean_of_a_path(scene, |steps| connectible(steps).count());
        if ends == 0.0 { 1.0 } else { ends }
    }

    /// The mean of a number of a light subpath's vertices. Estimated, always by the same numbers: any would give the
    /// same image, with another noise.
    fn mean_of_a_path(&self, scene: &Scene, of_one: impl Fn(&[Step]) -> usize) -> f32 {
        const SUBPATHS: u32 = 4096;
        let LightVertices { connected, merged, .. } = self.evaluated.light_vertices();
        let vertices = connected.max(merged);
        let mut light = Subpath::with_capacity(vertices);
        let mut ends = 0;
        for i in 0..SUBPATHS {
            light.walk_from_light(scene, 0, vertices, self.roulette, &mut Independent::new(0, i, 0, Stream::Light));
            ends += of_one(light.steps());
        }
        ends as f32 / SUBPATHS as f32
    }

    fn with_tables(self, change: impl Fn(&Techniques) -> Techniques) -> Self {
        let [evaluated, weighed] = [&self.evaluated, &self.weighed].map(change);
        self.with_weighed(evaluated, weighed)
    }

    /// The same integrator with merges within a radius, in metres, if its table has them at all.
    #[must_use]
    pub fn merging_within(self, radius: f32) -> Self {
        let within = |table: &Techniques| table.merging_within(table.radius().map(|_| radius));
        let [evaluated, weighed] = [&self.evaluated, &self.weighed].map(within);
        self.with_weighed(evaluated, weighed)
    }

    /// The same integrator with weights that know these factors.
    #[must_use]
    pub fn with_variance_factors(self, factors: &Arc<VarianceFactors>) -> Self {
        self.with_tables(|table| table.clone().with_variance_factors(factors.clone()))
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
        path.weight(&self.weighed, self.heuristic, self.rivals.as_ref())
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
        let merges = |x: Strategy| path.density_of_merging(x, &self.weighed) > 0.0;
        if self.weighed.merges().filter(|x| x.edges() as usize == n as usize).any(merges) {
            return true;
        }
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
}
