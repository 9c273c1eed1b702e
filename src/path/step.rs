//! A vertex in its walk: with the prefix products that the fast form needs.

use glam::Vec3;

use super::{Edge, RivalSum, Vertex};
use crate::{math::Rgb, sampling::PdfArea, scene::point::Point};

/// A vertex of a subpath with what the walk knows on arriving there.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The vertex.
    pub vertex: Vertex,
    /// The edge from this vertex back to its predecessor; meaningless at the subpath's first vertex.
    pub back: Edge,
    /// The prefix of F/p up to this vertex, without f̂ here: Π f̂ G/p, with W_e at the camera or L_e at the light, and
    /// over the survival probabilities of roulette. V and α stand in both F and p of what a walk finds, and cancel;
    /// only the α of the light that a walk starts on does not.
    pub beta: Rgb,
    /// Own-side density: of this vertex given its predecessors in the walk.
    pub pdf_fwd: PdfArea,
    /// Other-side density: of this vertex when the path is walked the other way. Known once the walk has gone two
    /// vertices further; a connection supplies it for the last two.
    pub pdf_rev: PdfArea,
    /// The product of roulette's survival probabilities so far: in the estimate, not in any density.
    pub survival: f32,
    /// What the strategies that connect before this vertex have against one that connects further on: see
    /// [`Rivals`](super::Rivals). Known, as `pdf_rev` is, once the walk has gone two vertices further.
    pub rivals: RivalSum,
}

impl Step {
    /// The first vertex of a subpath, or any that was drawn on its own.
    #[inline(always)]
    pub(super) fn first(point: Point, pdf: PdfArea) -> Self {
        Self {
            vertex: Vertex::new(point),
            back: Edge {
                direction: Vec3::Z,
                distance_squared: 1.0,
                cos_a: 1.0,
                cos_b: 1.0,
                alpha_a: 1.0,
                alpha_b: 1.0,
                visibility: 1.0,
            },
            beta: Rgb::splat(1.0 / pdf.0),
            pdf_fwd: pdf,
            pdf_rev: PdfArea::ZERO,
            survival: 1.0,
            rivals: RivalSum::ZERO,
        }
    }

    /// A light vertex p_n sampled by next-event estimation with density `pdf`.
    #[inline(always)]
    pub fn next_event(point: Point, pdf: PdfArea) -> Self {
        Self::first(point, pdf)
    }
}
