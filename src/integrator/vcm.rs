//! Vertex connection and merging (Georgiev et al. 2012; Hachisuka et al. 2012): every strategy of bidirectional path
//! tracing, and merges of its two subpaths wherever they come near each other.

use super::description::{Description, Landing, LightSampling, Merges, Table, Weights};
use crate::{
    path::{Heuristic, LightPaths, MeetingPlaces, Roulette},
    sampling::SamplerKind,
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "vcm",
    what: "Vertex connection and merging: bdpt, and camera and light paths that merge where they nearly meet. Finds \
           caustics seen in mirrors and through glass; consistent, not unbiased.",
    coverage: "every path with a vertex that is not specular, or whose light has an extent",
    table: Table::Strategies(|x| u32::from(x.t >= 1)),
    merges: Merges::At(MeetingPlaces::Everywhere, LightPaths::ONE),
    // Merges that share a light path are correlated, which squares would reward.
    heuristic: Heuristic::Balance,
    weights: Weights::VarianceAware,
    roulette: Roulette::FromDepth(2),
    sampler: SamplerKind::Sobol,
    light_sampling: LightSampling::Suitable,
    landing: Landing::Anywhere,
    longest_path: u32::MAX,
};
