//! pathspace: a renderer built on the path-space form of the rendering equation.

pub mod cli;
pub mod film;
pub mod math;
pub mod render;
pub mod sampling;
pub mod scene;
