//! Path tracing with next-event estimation and MIS (lecture, *Path tracing*): s ≤ 1, t ≥ 2.

use crate::path::Strategy;

/// The name on the command line.
pub const NAME: &str = "path";

/// What the table can sample at all.
pub const COVERAGE: &str =
    "every path, except those on which a point light, a spot or a sun follows a specular vertex (their caustics)";

/// m_{s,t} of the table.
pub fn multiplicity(strategy: Strategy) -> u32 {
    u32::from(strategy.s <= 1 && strategy.t >= 2)
}
