//! What a sample takes.

use crate::{render::Rays, scene::camera::Sensor};

/// Counts per sample of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Rays of walks from the camera.
    pub camera: f64,
    /// Of walks from lights.
    pub light: f64,
    /// Between two known points.
    pub visibility: f64,
    /// Pairs of vertices that merge.
    pub merges: f64,
}

/// What each takes with all that belongs to it (shading, weights, deposits), a camera ray being 1: fitted to the user
/// times of four integrators in the seventeen scenes of this repository (`benches/choice/run`).
const PRICES: Work = Work { camera: 1.0, light: 0.7, visibility: 0.85, merges: 0.35 };

impl Work {
    /// Of the rays of so many passes over an image.
    pub(super) fn of(rays: Rays, passes: u32, sensor: Sensor) -> Self {
        let samples = f64::from(passes) * f64::from(sensor.pixels());
        let [camera, light, visibility] = [rays.camera, rays.light, rays.visibility].map(|x| x as f64 / samples);
        Self { camera, light, visibility, merges: 0.0 }
    }

    /// All of it, in camera rays.
    pub fn cost(&self) -> f64 {
        self.camera * PRICES.camera
            + self.light * PRICES.light
            + self.visibility * PRICES.visibility
            + self.merges * PRICES.merges
    }
}
