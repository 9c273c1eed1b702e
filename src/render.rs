//! Rendering: passes over the image, threads, and what a person wants to know meanwhile.

use crate::sampling::Filter;

/// Which of the integrators renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// Path tracing with next-event estimation.
    Path,
    /// Light tracing.
    Light,
    /// Path and light tracing in one, without inner connections.
    Hybrid,
    /// Bidirectional path tracing.
    Bdpt,
}

/// Pixels x0 ≤ x < x1, y0 ≤ y < y1 of the full image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// Column after the last.
    pub x1: u32,
    /// Row after the last.
    pub y1: u32,
}

/// Everything besides the scene that changes pixels (the number of samples apart).
#[derive(Clone, Debug)]
pub struct Settings {
    /// The integrator.
    pub integrator: IntegratorKind,
    /// The longest path, in edges.
    pub max_depth: u32,
    /// From which number of edges on Russian roulette may end a subpath; `None`: never.
    pub roulette: Option<u32>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The reconstruction filter.
    pub filter: Filter,
    /// The part of the image to render.
    pub crop: Crop,
    /// Largest value per channel of a single contribution, if contributions are clamped (which biases the image).
    pub clamp: Option<f32>,
}
