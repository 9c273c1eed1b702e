//! Path tracing without next-event estimation (lecture, *directional sampling*): s = 0. A light counts when the walk hits it.

/// The name on the command line.
pub const NAME: &str = "path-hemisphere";

/// What the table can sample at all.
pub const COVERAGE: &str =
    "every path to a light with an extent; point lights, spots and suns are never hit, and stay dark";
