//! Bidirectional path tracing (Veach & Guibas 1994; Lafortune & Willems 1993): every strategy with t ≥ 1.

use super::description::{Description, Landing, LightSampling, Merges, Table, Weights};
use crate::{
    path::{Heuristic, Roulette},
    sampling::SamplerKind,
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "bdpt",
    what: "Bidirectional path tracing: every connection of a camera path and a light path, weighted by MIS.",
    coverage: "every path with two neighbouring vertices that are not specular, or whose light has an extent",
    table: Table::Strategies(|x| u32::from(x.t >= 1)),
    merges: Merges::No,
    heuristic: Heuristic::Power,
    weights: Weights::VarianceAware,
    roulette: Roulette::FromDepth(2),
    sampler: SamplerKind::Sobol,
    light_sampling: LightSampling::Suitable,
    landing: Landing::Anywhere,
    longest_path: u32::MAX,
};
