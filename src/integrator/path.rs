//! Path tracing with next-event estimation and MIS (lecture, *Path tracing*): s ≤ 1, t ≥ 2.

use super::description::{Description, Landing, LightSampling, Merges, Table, Weights};
use crate::{
    path::{Heuristic, Roulette},
    sampling::SamplerKind,
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "path",
    what: "Path tracing with next-event estimation, weighted by MIS.",
    coverage: "every path, except those on which a point light, a spot or a sun follows a specular vertex (their \
        caustics)",
    table: Table::Strategies(|x| u32::from(x.s <= 1 && x.t >= 2)),
    merges: Merges::No,
    heuristic: Heuristic::Power,
    weights: Weights::Plain,
    roulette: Roulette::FromDepth(4),
    sampler: SamplerKind::Sobol,
    light_sampling: LightSampling::Suitable,
    landing: Landing::OwnPixel,
    longest_path: u32::MAX,
};
