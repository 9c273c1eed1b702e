//! pathspace: a renderer built on the path-space form of the rendering equation.

pub mod film;
pub mod integrator;
pub mod math;
pub mod path;
pub mod render;
pub mod sampling;
pub mod scene;
