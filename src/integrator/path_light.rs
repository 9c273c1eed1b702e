//! Path tracing with next-event estimation and without MIS (lecture, *light-area sampling*): s = 1 wherever it has support,
//! p_{1,t} > 0, and s = 0 for the rest: lights seen directly, in mirrors and through smooth glass.

use crate::path::Strategy;

/// The name on the command line.
pub const NAME: &str = "path-light";

/// What the table can sample at all.
pub const COVERAGE: &str = super::path::COVERAGE;

/// m_{s,t} of the table.
pub fn multiplicity(strategy: Strategy) -> u32 {
    super::path::multiplicity(strategy)
}
