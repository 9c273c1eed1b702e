//! Path and light tracing in one estimator: s ≤ 1, or t = 1. There are no inner connections, so it costs little more than the
//! two, and the weights leave caustics to the light subpaths.

use crate::path::Strategy;

/// The name on the command line.
pub const NAME: &str = "hybrid";

/// What the table can sample at all.
pub const COVERAGE: &str = "every path, except those that lead from a point light, a spot or a sun through a specular vertex to a camera that sees another one";

/// m_{s,t} of the table.
pub fn multiplicity(strategy: Strategy) -> u32 {
    u32::from((strategy.s <= 1 && strategy.t >= 2) || strategy.t == 1)
}
