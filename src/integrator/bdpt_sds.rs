//! Bidirectional path tracing, and merges where it cannot connect: at the first vertex that the camera sees in mirrors
//! and through clear glass, of light that has come there from another surface. A path CS⁺DS… has no edge beside D that
//! can be connected; in a corner, CS⁺DD…, one that can is connected badly. Everything else is left to the strategies,
//! which have no bias.

use super::description::{Description, Landing, LightSampling, Merges, Table, Weights};
use crate::{
    path::{Heuristic, LightPaths, MeetingPlaces, Roulette},
    sampling::SamplerKind,
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "bdpt-sds",
    what: "bdpt, and merges of scattered light on what is seen in a mirror or through clear glass. Finds caustics \
           there, where it is consistent, not unbiased; elsewhere it is bdpt.",
    coverage: "every path with a vertex that is not specular, or whose light has an extent",
    table: Table::Strategies(|x| u32::from(x.t >= 1)),
    // Each of them meets the camera subpaths of many pixels.
    merges: Merges::At(MeetingPlaces::SeenBySpecular, LightPaths::one_in(4)),
    heuristic: Heuristic::Power,
    weights: Weights::VarianceAware,
    roulette: Roulette::FromDepth(2),
    sampler: SamplerKind::Sobol,
    light_sampling: LightSampling::Suitable,
    landing: Landing::Anywhere,
    longest_path: u32::MAX,
};
