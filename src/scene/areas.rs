//! Points of surfaces, uniform in area: what area sampling draws from.

use glam::Vec3;

use super::{Scene, geometry::PrimitiveId, point::Point};
use crate::sampling::{Discrete, PdfArea};

/// The uniform distribution over the area of some primitives.
#[derive(Clone, Debug)]
pub struct SurfaceAreas {
    primitives: Vec<PrimitiveId>,
    by_area: Discrete,
    /// m².
    total: f64,
}

impl SurfaceAreas {
    pub(super) fn new(scene: &Scene, primitives: impl Iterator<Item = PrimitiveId>) -> Self {
        let primitives: Vec<_> = primitives.collect();
        let areas: Vec<_> = primitives.iter().map(|id| scene.geometry.area(*id)).collect();
        let total = areas.iter().copied().map(f64::from).sum();
        Self { primitives, by_area: Discrete::new(&areas), total }
    }

    /// A point of `scene`, with the density [`SurfaceAreas::pdf`]; `None` where there is no surface. `u.z` chooses the primitive.
    pub fn sample(&self, scene: &Scene, u: Vec3) -> Option<Point> {
        if self.by_area.is_empty() {
            return None;
        }
        let (i, _) = self.by_area.sample(u.z);
        Some(scene.point_on(self.primitives[i], u.truncate()))
    }

    /// The density of every point, one over the whole area.
    pub fn pdf(&self) -> PdfArea {
        PdfArea((1.0 / self.total) as f32)
    }
}
