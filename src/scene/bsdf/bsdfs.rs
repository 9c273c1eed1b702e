//! BSDFs in several lanes.

use super::{Bsdf, Diffuse};
use crate::{
    lanes::{Lanes, Mask, Vector},
    math::Rgb,
};

/// A BSDF in each lane. The kinds that have been written for lanes are side by side where all are of that kind; any
/// others are evaluated one after the other, by the same text.
#[derive(Clone, Copy, Debug)]
pub enum Bsdfs<L: Lanes> {
    /// Lambert in all lanes.
    Diffuse(Diffuse<L::V>),
    /// Of any kind, in some lanes.
    Each(L::Each<Bsdf>, L::M),
}

impl<L: Lanes> Bsdfs<L> {
    /// Those that `bsdf` has for the lanes `which`; anything in the others.
    #[inline(always)]
    pub fn new<'a>(lanes: L, which: L::M, bsdf: impl Fn(usize) -> &'a Bsdf) -> Self {
        if which.lanes().all(|k| matches!(bsdf(k), Bsdf::Diffuse(_))) {
            let albedo = |k| if let Bsdf::Diffuse(Diffuse { albedo }) = bsdf(k) { albedo.to_array() } else { [0.0; 3] };
            Self::Diffuse(Diffuse { albedo: Rgb::of(lanes.vectors(albedo)) })
        } else {
            Self::Each(lanes.each(|k| *bsdf(k)), which)
        }
    }

    /// Those of all lanes, by their number.
    #[inline(always)]
    pub fn all(&self) -> impl Fn(usize) -> Bsdf {
        let albedo = if let Self::Diffuse(Diffuse { albedo }) = self { Some(albedo.channels().all()) } else { None };
        move |k| match self {
            Self::Diffuse(_) => {
                Bsdf::Diffuse(Diffuse { albedo: albedo.map_or(Rgb::ZERO, |all| Rgb::from_array(all[k])) })
            }
            Self::Each(bsdfs, _) => L::lane(bsdfs, k),
        }
    }

    /// The lanes in which there is one.
    #[inline(always)]
    pub fn which(&self, lanes: L) -> L::M {
        match self {
            Self::Diffuse(_) => lanes.first(L::N),
            Self::Each(_, which) => *which,
        }
    }

    /// See [`Bsdf::has_continuous`].
    #[inline(always)]
    pub fn has_continuous(&self, lanes: L) -> L::M {
        match self {
            Self::Diffuse(Diffuse { albedo }) => !albedo.is_black(),
            Self::Each(bsdfs, which) => *which & lanes.condition(|k| L::lane(bsdfs, k).has_continuous()),
        }
    }
}
