//! Path and light tracing in one estimator: s ≤ 1, or t = 1. There are no inner connections, so it costs little more
//! than the two, and the weights leave caustics to the light subpaths.

use super::description::{Description, Landing, LightSampling, Merges, Table, Weights};
use crate::{
    path::{Heuristic, Roulette},
    sampling::SamplerKind,
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "hybrid",
    what: "Path tracing and light tracing in one, weighted by MIS.",
    coverage: "every path, except those that lead from a point light, a spot or a sun through a specular vertex to a \
        camera that sees another one",
    table: Table::Strategies(|x| u32::from((x.s <= 1 && x.t >= 2) || x.t == 1)),
    merges: Merges::No,
    heuristic: Heuristic::Power,
    weights: Weights::VarianceAware,
    roulette: Roulette::FromDepth(2),
    sampler: SamplerKind::Sobol,
    light_sampling: LightSampling::Suitable,
    landing: Landing::Anywhere,
    longest_path: u32::MAX,
};
