//! Points of surfaces, each drawn on its own: what area sampling draws from.

use std::collections::HashMap;

use glam::Vec2;

use super::{Scene, geometry::PrimitiveId, point::Point};
use crate::sampling::{Choice, Discrete, PdfArea};

/// A distribution over the points of some primitives, uniform on each of them.
#[derive(Clone, Debug)]
pub struct SurfaceAreas {
    primitives: Vec<PrimitiveId>,
    choice: Discrete,
    density: Density,
}

/// 1/m².
#[derive(Clone, Debug)]
enum Density {
    Everywhere(f32),
    On(HashMap<PrimitiveId, f32>),
}

impl SurfaceAreas {
    /// Uniform in area over all.
    pub(super) fn uniform(scene: &Scene, primitives: impl Iterator<Item = PrimitiveId>) -> Self {
        let primitives: Vec<_> = primitives.collect();
        let areas: Vec<_> = primitives.iter().map(|id| f64::from(scene.geometry.area(*id))).collect();
        let total: f64 = areas.iter().sum();
        Self { primitives, choice: Discrete::new(&areas), density: Density::Everywhere((1.0 / total) as f32) }
    }

    /// In proportion to a weight of each primitive, which is finite and not negative.
    pub(super) fn weighted(scene: &Scene, weighted: impl Iterator<Item = (PrimitiveId, f64)>) -> Self {
        let (primitives, weights): (Vec<_>, Vec<f64>) = weighted.unzip();
        let choice = Discrete::new(&weights);
        let density = |(i, id): (usize, &PrimitiveId)| (*id, choice.probability(i) / scene.geometry.area(*id));
        let chosen = primitives.iter().enumerate().filter(|_| !choice.is_empty());
        let density = Density::On(chosen.map(density).collect());
        Self { primitives, choice, density }
    }

    /// A point of `scene`, with the density [`SurfaceAreas::pdf`]; `None` where there is no surface. `choice` leads to
    /// the primitive.
    pub fn sample(&self, scene: &Scene, u: Vec2, choice: Choice) -> Option<Point> {
        if self.choice.is_empty() {
            return None;
        }
        let (i, _) = self.choice.sample(choice);
        Some(scene.point_on(self.primitives[i], u))
    }

    /// The density of `point`, which lies on one of the primitives.
    pub fn pdf(&self, point: &Point) -> PdfArea {
        PdfArea(match &self.density {
            Density::Everywhere(density) => *density,
            Density::On(densities) => densities.get(&point.primitive).copied().unwrap_or(0.0),
        })
    }
}
