//! A vertex in its walk: with the prefix products that the fast form needs.

use super::{Edge, RivalSum, Vertex, departure::Departure, scattering::Surfaces};
use crate::{
    lanes::{Float, Lanes, One, Vector},
    math::Rgb,
    sampling::PdfArea,
    scene::{bsdf::Bsdf, point::Point},
};

/// A vertex of a subpath with what the walk knows on arriving there.
#[derive(Clone, Copy, Debug)]
pub struct Step<L: Lanes = One, B = Bsdf> {
    /// The vertex.
    pub vertex: Vertex<L, B>,
    /// The edge from this vertex back to its predecessor; meaningless at the subpath's first vertex.
    pub back: Edge<L>,
    /// The prefix of F/p up to this vertex, without f̂ here: Π f̂ G/p, with W_e at the camera or L_e at the light, and
    /// over the survival probabilities of roulette. V and α stand in both F and p of what a walk finds, and cancel;
    /// only the α of the light that a walk starts on does not.
    pub beta: Rgb<L::V>,
    /// Own-side density: of this vertex given its predecessors in the walk.
    pub pdf_fwd: PdfArea<L::F>,
    /// Other-side density: of this vertex when the path is walked the other way. Known once the walk has gone two
    /// vertices further; a connection supplies it for the last two.
    pub pdf_rev: PdfArea<L::F>,
    /// The product of roulette's survival probabilities so far: in the estimate, not in any density.
    pub survival: L::F,
    /// What the strategies that connect before this vertex have against one that connects further on: see
    /// [`Rivals`](super::Rivals). Known, as `pdf_rev` is, once the walk has gone two vertices further.
    pub rivals: RivalSum<L::U>,
}

impl<L: Lanes, B: Surfaces<L>> Step<L, B> {
    /// The first vertex of a subpath, or any that was drawn on its own.
    #[inline(always)]
    pub(super) fn first(point: Point<L, B>, pdf: PdfArea<L::F>) -> Self {
        let lanes = pdf.0.lanes();
        let (zero, one) = (lanes.splat(0.0), lanes.splat(1.0));
        let beta = one / pdf.0;
        Self {
            vertex: Vertex::new(point),
            back: Edge {
                direction: lanes.splat_v([0.0, 0.0, 1.0]),
                distance_squared: one,
                cos_a: one,
                cos_b: one,
                alpha_a: one,
                alpha_b: one,
                visibility: one,
            },
            beta: Rgb::of(L::V::new(beta, beta, beta)),
            pdf_fwd: pdf,
            pdf_rev: PdfArea(zero),
            survival: one,
            rivals: RivalSum::none(lanes),
        }
    }

    /// The vertex at `point`, at which a walk that left `from` has arrived; V = `visibility` on the way there.
    #[inline(always)]
    pub fn arriving(departure: &Departure<L>, from: &Point<L, B>, point: Point<L, B>, visibility: L::F) -> Self {
        let edge = Edge { visibility, ..Edge::between(from, &point) };
        let lanes = visibility.lanes();
        Self {
            vertex: Vertex::new(point),
            back: edge.reversed(),
            beta: departure.beta,
            pdf_fwd: departure.pdf.to_area(&edge),
            pdf_rev: PdfArea(lanes.splat(0.0)),
            survival: departure.survival,
            rivals: RivalSum::none(lanes),
        }
    }

    /// A light vertex p_n sampled by next-event estimation with density `pdf`.
    #[inline(always)]
    pub fn next_event(point: Point<L, B>, pdf: PdfArea<L::F>) -> Self {
        Self::first(point, pdf)
    }
}
