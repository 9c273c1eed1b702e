//! Lights: L_e and every density with which a path can start on one.

/// The index of a light in its scene: every emissive triangle or sphere is one, and so is every point light, sun and environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightId(pub u32);
