//! Path and light tracing in one estimator: s ≤ 1, or t = 1. No inner connections, so it costs little more than both, and their weights leave caustics to the light subpaths.

use crate::path::Strategy;

/// The name on the command line.
pub const NAME: &str = "hybrid";

/// What the table can sample at all.
pub const COVERAGE: &str =
    "every path, except that a point light or sun seen only through specular surfaces has no strategy";

/// m_{s,t} of the table.
pub fn multiplicity(strategy: Strategy) -> u32 {
    u32::from((strategy.s <= 1 && strategy.t >= 2) || strategy.t == 1)
}
