//! BSDFs in several lanes.

use super::{Bsdf, Dielectric, Diffuse, Glass, MetallicRoughness, Mirror, Pane, Scatter, ThinDielectric, Transport};
use crate::{
    lanes::{Float, Lanes, Mask, Vector},
    math::Rgb,
};

/// The kinds of BSDFs that have been written for lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`Diffuse`].
    Diffuse,
    /// [`Glass`].
    Glass,
    /// [`Pane`].
    Pane,
    /// [`Mirror`].
    Mirror,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Diffuse, Self::Glass, Self::Pane, Self::Mirror];

    /// Whether light may pass such surfaces.
    #[inline(always)]
    pub fn transmits(self) -> bool {
        matches!(self, Self::Glass | Self::Pane)
    }
}

/// A BSDF of one of these kinds.
#[derive(Clone, Copy, Debug)]
pub struct InLanes {
    /// Which.
    pub kind: Kind,
    /// The albedo, the tint, or the reflectance at normal incidence.
    pub color: Rgb,
    /// The index of refraction inside; 1 where there is none.
    pub ior: f32,
}

impl InLanes {
    /// What one kind of them says of this one, if it is of any.
    #[inline(always)]
    pub fn of(bsdf: &Bsdf) -> Option<Self> {
        let (kind, color, ior) = match bsdf {
            Bsdf::Diffuse(Diffuse { albedo }) => (Kind::Diffuse, *albedo, 1.0),
            Bsdf::Dielectric(dielectric) => {
                let Glass { color, ior } = dielectric.glass()?;
                (Kind::Glass, color, ior)
            }
            Bsdf::MetallicRoughness(metallic) => (Kind::Mirror, metallic.mirror()?.color, 1.0),
            Bsdf::Thin(thin) => {
                let Pane { color, ior } = thin.pane()?;
                (Kind::Pane, color, ior)
            }
        };
        Some(Self { kind, color, ior })
    }

    /// What reflects nothing.
    pub const BLACK: Self = Self { kind: Kind::Diffuse, color: Rgb::ZERO, ior: 1.0 };
}

impl From<InLanes> for Bsdf {
    #[inline(always)]
    fn from(InLanes { kind, color, ior }: InLanes) -> Self {
        match kind {
            Kind::Diffuse => Self::Diffuse(Diffuse { albedo: color }),
            Kind::Glass => Self::Dielectric(Dielectric { color, ior, alpha: 0.0, transmission: 1.0 }),
            Kind::Pane => Self::Thin(ThinDielectric { color, ior, alpha: 0.0, transmission: 1.0 }),
            Kind::Mirror => Self::MetallicRoughness(MetallicRoughness::metal(color, 0.0)),
        }
    }
}

/// A BSDF in each lane. The kinds that have been written for lanes are side by side where all are of that kind; any
/// others are evaluated one after the other, by the same text.
#[derive(Clone, Copy, Debug)]
pub enum Bsdfs<L: Lanes> {
    /// Lambert in all lanes.
    Diffuse(Diffuse<L::V>),
    /// Smooth clear glass in all lanes.
    Glass(Glass<L::V>),
    /// A smooth clear sheet in all lanes.
    Pane(Pane<L::V>),
    /// A perfect mirror in all lanes.
    Mirror(Mirror<L::V>),
    /// Of any kind, in some lanes.
    Each(L::Each<Bsdf>, L::M),
}

impl<L: Lanes> Bsdfs<L> {
    /// Those that `bsdf` has for the lanes `which`; anything in the others.
    #[inline(always)]
    pub fn new<'a>(lanes: L, which: L::M, bsdf: impl Fn(usize) -> &'a Bsdf) -> Self {
        let first = which.lanes().next().and_then(|k| InLanes::of(bsdf(k)));
        let kind = first.unwrap_or(InLanes::BLACK).kind;
        let same = |k: usize| InLanes::of(bsdf(k)).filter(|of| of.kind == kind);
        if !which.lanes().all(|k| same(k).is_some()) {
            return Self::Each(lanes.each(|k| *bsdf(k)), which);
        }
        let one = |k: usize| same(k).unwrap_or(InLanes::BLACK);
        Self::of_kind(kind, Rgb::of(lanes.vectors(|k| one(k).color.to_array())), lanes.numbers(|k| one(k).ior))
    }

    /// Those of one kind.
    #[inline(always)]
    pub fn of_kind(kind: Kind, color: Rgb<L::V>, ior: L::F) -> Self {
        match kind {
            Kind::Diffuse => Self::Diffuse(Diffuse { albedo: color }),
            Kind::Glass => Self::Glass(Glass { color, ior }),
            Kind::Pane => Self::Pane(Pane { color, ior }),
            Kind::Mirror => Self::Mirror(Mirror { color }),
        }
    }

    /// A direction across from `known`, both in the frames of the surfaces, where it belongs to the second delta and
    /// not to the first, and the value and the densities there; `None` of what has other lobes.
    #[inline(always)]
    pub fn sample_delta(&self, known: L::V, transport: Transport, u: L::F) -> Option<(L::V, L::M, Scatter<L>)> {
        match self {
            Self::Glass(glass) => Some(glass.sample(known, transport, u)),
            Self::Pane(pane) => Some(pane.sample(known, transport, u)),
            Self::Mirror(mirror) => {
                let (direction, scatter) = mirror.sample(known, transport);
                Some((direction, u.lanes().mask(0), scatter))
            }
            Self::Diffuse(_) | Self::Each(..) => None,
        }
    }

    /// Those of all lanes, by their number.
    #[inline(always)]
    pub fn all(&self, lanes: L) -> impl Fn(usize) -> Bsdf {
        let (black, one) = (Rgb::of(lanes.splat_v([0.0; 3])), lanes.splat(1.0));
        let (kind, color, ior) = match self {
            Self::Diffuse(Diffuse { albedo }) => (Kind::Diffuse, *albedo, one),
            Self::Glass(Glass { color, ior }) => (Kind::Glass, *color, *ior),
            Self::Pane(Pane { color, ior }) => (Kind::Pane, *color, *ior),
            Self::Mirror(Mirror { color }) => (Kind::Mirror, *color, one),
            Self::Each(..) => (Kind::Diffuse, black, one),
        };
        let (color, ior) = (color.channels().all(), ior.all());
        move |k| match self {
            Self::Each(bsdfs, _) => L::lane(bsdfs, k),
            _ => InLanes { kind, color: Rgb::from_array(color[k]), ior: ior[k] }.into(),
        }
    }

    /// The lanes in which there is one.
    #[inline(always)]
    pub fn which(&self, lanes: L) -> L::M {
        match self {
            Self::Each(_, which) => *which,
            _ => lanes.first(L::N),
        }
    }

    /// See [`Bsdf::has_continuous`].
    #[inline(always)]
    pub fn has_continuous(&self, lanes: L) -> L::M {
        match self {
            Self::Diffuse(Diffuse { albedo }) => !albedo.is_black(),
            Self::Glass(_) | Self::Pane(_) | Self::Mirror(_) => lanes.mask(0),
            Self::Each(bsdfs, which) => *which & lanes.condition(|k| L::lane(bsdfs, k).has_continuous()),
        }
    }

    /// Whether light may pass the surfaces.
    #[inline(always)]
    pub fn may_transmit(&self) -> bool {
        matches!(self, Self::Glass(_) | Self::Pane(_) | Self::Each(..))
    }
}
