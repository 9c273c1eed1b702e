//! Densities with their measures as types, so that an area density cannot be taken for an angular one.

/// A probability density with respect to surface area, in 1/m².
///
/// Of an infinite vertex (environment, sun) it is the density with respect to solid angle, 1/sr, since there dA(p_n)
/// becomes dω; of a vertex without extent (pinhole, point light) it is the coefficient of δ(p), without unit, and of an
/// orthographic film that of δ(ω). Densities of one vertex always share their measure, so their ratio never has a unit.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct PdfArea<F = f32>(pub F);

/// A probability density with respect to solid angle, in 1/sr.
///
/// At a delta lobe it is the coefficient of the delta, with respect to solid angle on the *light side* whichever way
/// the lobe was sampled: one base measure for the throughput and for every density.
///
/// Of a direction that leaves an infinite vertex or an orthographic film it is the density of the ray's place on the
/// plane perpendicular to it, in 1/m²; together with the edge's squared distance of 1 it converts to area like any
/// other.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct PdfSolidAngle<F = f32>(pub F);

impl PdfArea {
    /// What cannot be sampled at all: a true zero, never remapped.
    pub const ZERO: Self = Self(0.0);
}

impl PdfSolidAngle {
    /// What cannot be sampled at all: a true zero, never remapped.
    pub const ZERO: Self = Self(0.0);
}
