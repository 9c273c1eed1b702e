//! Light tracing: every vertex of a light subpath is connected to the lens, t = 1 (lecture, *Sum over paths: implications*).

use crate::path::Strategy;

/// The name on the command line.
pub const NAME: &str = "light";

/// What the table can sample at all.
pub const COVERAGE: &str = "paths whose first surface after the camera scatters continuously, and lights seen directly; what the camera sees in mirrors and glass stays black, and an environment that an orthographic camera sees";

/// m_{s,t} of the table.
pub fn multiplicity(strategy: Strategy) -> u32 {
    u32::from(strategy.t == 1)
}
