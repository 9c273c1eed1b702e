//! Path tracing with next-event estimation and without MIS (lecture, *light-area sampling*): s = 1 wherever it has
//! support, p_{1,t} > 0, and s = 0 for the rest: lights seen directly, in mirrors and through smooth glass.

use super::{
    description::{Description, Landing, LightSampling, Weights},
    path,
};
use crate::{
    path::{Heuristic, Roulette},
    sampling::SamplerKind,
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "path-light",
    what: "Path tracing with next-event estimation wherever it can find the light, without MIS.",
    coverage: path::DESCRIPTION.coverage,
    table: path::DESCRIPTION.table,
    merges: path::DESCRIPTION.merges,
    heuristic: Heuristic::FirstSupported,
    weights: Weights::Plain,
    roulette: Roulette::FromDepth(4),
    sampler: SamplerKind::Sobol,
    light_sampling: LightSampling::Suitable,
    landing: Landing::OwnPixel,
    longest_path: u32::MAX,
};
