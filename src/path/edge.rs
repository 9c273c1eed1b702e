//! Edges: the geometry between two vertices, computed once and used by G, T and every density.

use glam::Vec3;

use crate::{
    sampling::{PdfArea, PdfSolidAngle},
    scene::point::{Place, Point},
};

/// The segment from a vertex a to a vertex b.
///
/// Infinite and degenerate ends fit in by convention (design of the measures): an infinite end has squared distance 1
/// and cosine 1, since there dA becomes dω and G becomes V|cos θ|; a degenerate end has cosine 1. An orthographic film
/// is to the camera what infinity is to a sun.
///
/// V and α are here because densities need it: a walk along the edge passes what lies between with probability V, and
/// stops at the far end with that end's α.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// The unit direction from a to b.
    pub direction: Vec3,
    /// |a − b|², m²; 1 if an end is infinite or an orthographic film.
    pub distance_squared: f32,
    /// |cos θ_a| against a's geometric normal; 1 if a has none.
    pub cos_a: f32,
    /// |cos θ_b| against b's geometric normal; 1 if b has none.
    pub cos_b: f32,
    /// α at a.
    pub alpha_a: f32,
    /// α at b.
    pub alpha_b: f32,
    /// V(a↔b) in [0, 1]: the product of 1 − α over what the segment crosses.
    pub visibility: f32,
}

impl Edge {
    /// The edge between two points, at most one of them infinite (and the other then perhaps on a film), with V = 1.
    #[inline(always)]
    pub fn between(a: &Point, b: &Point) -> Self {
        let (direction, distance_squared) = match (a.place, b.place) {
            (Place::Film, _) => (a.normal, 1.0),
            (_, Place::Film) => (-b.normal, 1.0),
            (_, Place::Infinite) => (b.position, 1.0),
            (Place::Infinite, _) => (-a.position, 1.0),
            _ => {
                let ab = b.position - a.position;
                let d2 = ab.length_squared();
                (ab / d2.sqrt(), d2)
            }
        };
        Self {
            direction,
            distance_squared,
            cos_a: cos_at(a, direction),
            cos_b: cos_at(b, direction),
            alpha_a: a.alpha,
            alpha_b: b.alpha,
            visibility: 1.0,
        }
    }

    /// The same edge from b to a.
    #[inline(always)]
    pub fn reversed(&self) -> Self {
        Self {
            direction: -self.direction,
            cos_a: self.cos_b,
            cos_b: self.cos_a,
            alpha_a: self.alpha_b,
            alpha_b: self.alpha_a,
            ..*self
        }
    }

    /// G(a↔b)/V(a↔b) = |cos θ_a| |cos θ_b| / |a − b|², 1/m² (lecture, *The rendering equation: area form*).
    #[inline(always)]
    pub fn geometry_factor(&self) -> f32 {
        self.cos_a * self.cos_b / self.distance_squared
    }
}

#[inline(always)]
fn cos_at(p: &Point, w: Vec3) -> f32 {
    match p.place {
        Place::Surface => p.normal.dot(w).abs(),
        Place::Degenerate | Place::Infinite | Place::Film => 1.0,
    }
}

impl PdfSolidAngle {
    /// The area density with which a walk that samples a direction at a arrives at the edge's far end b:
    /// p_ω V α_b |cos θ_b| / |a − b|² (lecture, dω = cos θ/r² dA; it passes what lies between, and stops at b).
    #[inline(always)]
    pub fn to_area(self, edge: &Edge) -> PdfArea {
        PdfArea(self.0 * (edge.visibility * edge.alpha_b) * edge.cos_b / edge.distance_squared)
    }
}
