//! Light tracing: every vertex of a light subpath is connected to the lens, t = 1 (lecture, *Sum over paths:
//! implications*).

use super::description::{Description, Landing, LightSampling, Merges, Table, Weights};
use crate::{
    path::{Heuristic, Roulette},
    sampling::SamplerKind,
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "light",
    what: "Light tracing: each vertex of a light path is connected to the lens.",
    coverage: "paths whose first surface after the camera scatters continuously, and lights seen directly; what the \
        camera sees in mirrors and glass stays black, and an environment that an orthographic camera sees",
    table: Table::Strategies(|x| u32::from(x.t == 1)),
    merges: Merges::No,
    heuristic: Heuristic::Power,
    weights: Weights::Plain,
    roulette: Roulette::FromDepth(4),
    sampler: SamplerKind::Independent,
    light_sampling: LightSampling::Power,
    landing: Landing::Anywhere,
    longest_path: u32::MAX,
};
