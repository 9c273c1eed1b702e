//! Bidirectional path tracing (Veach & Guibas 1994; Lafortune & Willems 1993): every strategy with t ≥ 1.

use crate::path::Strategy;

/// The name on the command line.
pub const NAME: &str = "bdpt";

/// What the table can sample at all.
pub const COVERAGE: &str =
    "every path with two neighbouring vertices that are not specular, or whose light has an extent";

/// m_{s,t} of the table.
pub fn multiplicity(strategy: Strategy) -> u32 {
    u32::from(strategy.t >= 1)
}
