//! The scene: what is there. Geometry, materials, lights and the camera, with the two questions a path asks of
//! them: what does this ray meet, and do these two points see each other.

pub mod bsdf;
pub mod camera;
pub mod geometry;
pub mod light;
pub mod material;
pub mod point;
