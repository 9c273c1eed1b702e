//! Edges: the geometry between two vertices, computed once and used by G, T and every density.

use crate::{
    lanes::{Float, Lanes, One, Vector},
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
pub struct Edge<L: Lanes = One> {
    /// The unit direction from a to b.
    pub direction: L::V,
    /// |a − b|², m²; 1 if an end is infinite or an orthographic film.
    pub distance_squared: L::F,
    /// |cos θ_a| against a's geometric normal; 1 if a has none.
    pub cos_a: L::F,
    /// |cos θ_b| against b's geometric normal; 1 if b has none.
    pub cos_b: L::F,
    /// α at a.
    pub alpha_a: L::F,
    /// α at b.
    pub alpha_b: L::F,
    /// V(a↔b) in [0, 1]: the product of 1 − α over what the segment crosses.
    pub visibility: L::F,
}

impl<L: Lanes> Edge<L> {
    /// The edge between two points, at most one of them infinite (and the other then perhaps on a film), with V = 1.
    #[inline(always)]
    pub fn between<B>(a: &Point<L, B>, b: &Point<L, B>) -> Self {
        let one = a.alpha.lanes().splat(1.0);
        let (direction, distance_squared) = match (a.place, b.place) {
            (Place::Film, _) => (a.normal, one),
            (_, Place::Film) => (-b.normal, one),
            (_, Place::Infinite) => (b.position, one),
            (Place::Infinite, _) => (-a.position, one),
            _ => {
                let ab = b.position - a.position;
                let d2 = ab.dot(ab);
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
            visibility: one,
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
    pub fn geometry_factor(&self) -> L::F {
        self.cos_a * self.cos_b / self.distance_squared
    }
}

#[inline(always)]
fn cos_at<L: Lanes, B>(p: &Point<L, B>, w: L::V) -> L::F {
    match p.place {
        Place::Surface => p.normal.dot(w).abs(),
        Place::Degenerate | Place::Infinite | Place::Film => p.alpha.lanes().splat(1.0),
    }
}

impl<F: Float> PdfSolidAngle<F> {
    /// The area density with which a walk that samples a direction at a arrives at the edge's far end b:
    /// p_ω V α_b |cos θ_b| / |a − b|² (lecture, dω = cos θ/r² dA; it passes what lies between, and stops at b).
    #[inline(always)]
    pub fn to_area(self, edge: &Edge<F::Lanes>) -> PdfArea<F> {
        PdfArea(self.0 * (edge.visibility * edge.alpha_b) * edge.cos_b / edge.distance_squared)
    }
}
