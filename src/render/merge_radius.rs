//! How near a light vertex has to be to a camera vertex for the two to merge.

use std::{fmt, num::ParseFloatError, str::FromStr};

use glam::Vec2;

use crate::{
    sampling::PdfSolidAngle,
    scene::{
        Scene,
        camera::Raster,
        point::{Place, Point},
    },
};

/// The radius of merges, pass by pass: a function of the scene, the settings and the pass' number alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MergeRadius {
    /// The same in every pass, in metres: each estimates the light within that distance.
    Fixed(f32),
    /// r_k = r_1 k^{(α − 1)/2} in the k-th pass, with α = 3/4: bias and variance both vanish in the limit (Knaus &
    /// Zwicker 2011, *Progressive Photon Mapping: A Probabilistic Approach*).
    Shrinking {
        /// r_1, in metres.
        first: f32,
    },
}

impl MergeRadius {
    /// The radius that a person has `asked` for, or one that begins with three pixels and shrinks.
    pub fn of(scene: &Scene, asked: Option<f32>) -> Self {
        asked.map_or_else(|| Self::Shrinking { first: FOOTPRINTS * footprint(scene) }, Self::Fixed)
    }

    /// That of a pass, counted from 0; m.
    pub fn of_pass(self, pass: u32) -> f32 {
        match self {
            Self::Fixed(radius) => radius,
            Self::Shrinking { first } => (f64::from(first) * (f64::from(pass) + 1.0).powf((ALPHA - 1.0) / 2.0)) as f32,
        }
    }
}

impl fmt::Display for MergeRadius {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixed(radius) => write!(f, "{radius}"),
            Self::Shrinking { first } => write!(f, "{first}{SHRINKING}"),
        }
    }
}

impl FromStr for MergeRadius {
    type Err = ParseFloatError;

    /// What [`Display`](fmt::Display) has written.
    fn from_str(text: &str) -> Result<Self, ParseFloatError> {
        match text.strip_suffix(SHRINKING) {
            None => text.parse().map(Self::Fixed),
            Some(first) => first.parse().map(|first| Self::Shrinking { first }),
        }
    }
}

const SHRINKING: &str = " shrinking";

/// α of r_k² ∝ k^{α − 1}: 1 would keep the bias, and 0 the variance.
const ALPHA: f64 = 0.75;

/// The first radius in sides of a pixel.
const FOOTPRINTS: f32 = 3.0;

/// The side of a pixel where the camera sees a surface, in metres: the median over rays through all of the image.
fn footprint(scene: &Scene) -> f32 {
    const SIDE: u32 = 32;
    let camera = &scene.camera;
    let sensor = camera.sensor();
    let pixels = sensor.padded_pixels() as f32;
    let across = |i: u32| {
        let cell = Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) + 0.5;
        let raster = Raster(cell / SIDE as f32 * Vec2::new(sensor.width as f32, sensor.height as f32));
        let lens = camera.sample_lens(raster, Vec2::ZERO);
        let direction = camera.direction(&lens, raster);
        let hit = scene.trace_from_camera(lens.position, direction, lens.primitive, &mut |_| true);
        let seen: Point = scene.point_at(&hit.ray, &hit.hit?);
        let PdfSolidAngle(pdf) = camera.pdf(&lens, direction);
        Some(match lens.place {
            Place::Film => (camera.pdf_lens().0 * pixels).recip().sqrt(),
            _ => seen.position.distance(lens.position) * (pdf * pixels).recip().sqrt(),
        })
    };
    let mut all: Vec<f32> = (0..SIDE * SIDE).filter_map(across).filter(|side| side.is_finite()).collect();
    all.sort_by(f32::total_cmp);
    // What it sees may lie between these rays.
    let of_scene = || scene.geometry().bounds().map_or(1.0, |b| (b.max - b.min).length() / sensor.width.max(1) as f32);
    all.get(all.len() / 2).copied().filter(|side| *side > 0.0).unwrap_or_else(of_scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_shrink_and_are_read_as_they_were_written() {
        let shrinking = MergeRadius::Shrinking { first: 0.1 };
        assert_eq!(shrinking.of_pass(0), 0.1);
        // Half of it after 2⁸ passes.
        assert!((shrinking.of_pass(255) - 0.05).abs() < 1e-8);
        for radius in [shrinking, MergeRadius::Fixed(0.3), MergeRadius::Shrinking { first: 1.234_567_8e-5 }] {
            assert_eq!(radius.to_string().parse(), Ok(radius));
        }
        assert_eq!(MergeRadius::Fixed(0.3).of_pass(99), 0.3);
    }
}
