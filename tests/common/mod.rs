//! Models from elsewhere: finding them, and a camera that sees all of one. Shared by a test and an example.

use std::{
    fs,
    path::{Path, PathBuf},
};

use glam::Vec3;
use pathspace::scene::{
    camera::{Camera, Sensor},
    geometry::Bounds,
};

/// Every `.gltf` and `.glb` below `folder`, sorted.
pub fn models(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    collect(folder, &mut found);
    found.sort();
    found
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
            found.push(path);
        }
    }
}

/// A camera that sees the sphere around `bounds` from the front (+z), a little from above and from the right.
pub fn framing(bounds: Option<Bounds>, sensor: Sensor) -> Camera {
    const YFOV: f32 = 0.7;
    let (center, radius) = match bounds {
        Some(b) => (0.5 * (b.min + b.max), (0.5 * (b.max - b.min).length()).max(1e-3)),
        None => (Vec3::ZERO, 1.0),
    };
    let towards = Vec3::new(0.35, 0.3, 1.0).normalize();
    let position = center + towards * (radius / (0.5 * YFOV).sin());
    Camera::look_at(position, center, Vec3::Y, YFOV, sensor)
}
