//! What a sample takes.

use crate::{render::Statistics, scene::camera::Sensor};

/// Counts per sample of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Rays of walks from the camera.
    pub camera: f64,
    /// Of walks from lights.
    pub light: f64,
    /// Between two known points.
    pub visibility: f64,
    /// Vertices of walks from the camera that look for light vertices around them.
    pub lookups: f64,
    /// Light vertices that they find.
    pub merges: f64,
    /// Not of a sample but of a whole pass: light subpaths whose vertices are kept for merges.
    pub kept_paths: f64,
}

/// What each takes with all that belongs to it (shading, weights, deposits), a camera ray being 1: after a fit to user
/// times of all candidates in ten scenes of this repository (`benches/notes/choices.md`).
const PRICES: Work = Work { camera: 1.0, light: 1.2, visibility: 0.7, lookups: 0.6, merges: 1.2, kept_paths: 0.0 };

/// Of so many light subpaths, those of an image of 192 × 192 pixels, a merge has that price; of twice as many it costs
/// so much more, since they are farther away (measured at 192 and 512 pixels: `benches/notes/choices.md`).
const NEAR: f64 = 192.0 * 192.0;
const FARTHER: f64 = 0.1;

impl Work {
    /// Of so many passes over an image.
    pub(super) fn of(Statistics { rays, lookups, .. }: &Statistics, passes: u32, sensor: Sensor) -> Self {
        let per_sample = |count: u64| count as f64 / (f64::from(passes) * f64::from(sensor.pixels()));
        Self {
            camera: per_sample(rays.camera),
            light: per_sample(rays.light),
            visibility: per_sample(rays.visibility),
            lookups: per_sample(lookups.made),
            merges: per_sample(lookups.found),
            kept_paths: 0.0,
        }
    }

    /// All of it, in camera rays.
    pub fn cost(&self) -> f64 {
        self.camera * PRICES.camera
            + self.light * PRICES.light
            + self.visibility * PRICES.visibility
            + (self.lookups * PRICES.lookups + self.merges * PRICES.merges) * self.farther()
    }

    /// How much more than near ones light vertices cost.
    fn farther(&self) -> f64 {
        (1.0 + FARTHER * (self.kept_paths.max(1.0) / NEAR).log2()).max(0.5)
    }
}
