//! Path tracing without next-event estimation (lecture, *directional sampling*): s = 0. A light counts when the walk
//! hits it.

use super::description::{Description, Landing, LightSampling, Merges, Table, Weights};
use crate::{
    path::{Heuristic, Roulette},
    sampling::SamplerKind,
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "path-hemisphere",
    what: "Path tracing that samples directions alone: a light counts when a path hits it.",
    coverage: "every path to a light with an extent; point lights, spots and suns are never hit, and stay dark",
    table: Table::Strategies(|x| u32::from(x.s == 0)),
    merges: Merges::No,
    heuristic: Heuristic::Power,
    weights: Weights::Plain,
    roulette: Roulette::FromDepth(4),
    sampler: SamplerKind::Sobol,
    light_sampling: LightSampling::Power,
    landing: Landing::OwnPixel,
    longest_path: u32::MAX,
};
