//! BSDFs in several lanes.

use glam::Vec3;

use super::{Bsdf, Dielectric, Diffuse, Glass, MetallicRoughness, Mirror, Pane, Scatter, ThinDielectric, Transport};
use crate::{
    lanes::{Float, Lanes, MOST, Mask, Vector},
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
    /// [`MetallicRoughness`] that is no mirror alone.
    MetallicRoughness,
    /// [`Dielectric`] that is no smooth clear glass.
    Dielectric,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Diffuse, Self::Glass, Self::Pane, Self::Mirror, Self::MetallicRoughness, Self::Dielectric];

    /// That of a BSDF, if it is of any.
    #[inline(always)]
    pub fn of(bsdf: &Bsdf) -> Option<Self> {
        match bsdf {
            Bsdf::Diffuse(_) => Some(Self::Diffuse),
            Bsdf::Dielectric(dielectric) if dielectric.glass().is_some() => Some(Self::Glass),
            Bsdf::Dielectric(_) => Some(Self::Dielectric),
            Bsdf::MetallicRoughness(metallic) if metallic.mirror().is_some() => Some(Self::Mirror),
            Bsdf::MetallicRoughness(_) => Some(Self::MetallicRoughness),
            Bsdf::Thin(thin) => thin.pane().map(|_| Self::Pane),
            Bsdf::Layered(_) => None,
        }
    }

    /// A set of kinds with this one: a bit for each, by its number.
    pub fn in_set(set: u32, kind: Self) -> u32 {
        set | 1 << kind as u32
    }

    /// Whether light may pass such surfaces.
    #[inline(always)]
    pub fn transmits(self) -> bool {
        matches!(self, Self::Glass | Self::Pane | Self::Dielectric)
    }

    /// The kind that has both BSDFs of this one and of the other, if any has.
    #[inline(always)]
    fn with(self, other: Self) -> Option<Self> {
        match (self, other) {
            _ if self == other => Some(self),
            (Self::Glass, Self::Dielectric) | (Self::Dielectric, Self::Glass) => Some(Self::Dielectric),
            (Self::Mirror, Self::MetallicRoughness) | (Self::MetallicRoughness, Self::Mirror) => {
                Some(Self::MetallicRoughness)
            }
            _ => None,
        }
    }
}

/// The numbers of a BSDF, whatever its kind: those that it does not have are anything. In several lanes those of one in
/// each.
#[derive(Clone, Copy, Debug)]
pub struct Terms<V: Vector = Vec3> {
    /// The albedo, the tint, the base colour, or the reflectance at normal incidence.
    pub color: Rgb<V>,
    /// The index of refraction inside.
    pub ior: V::F,
    /// GGX's α.
    pub alpha: V::F,
    /// The fraction of metal, or of what refracts.
    pub fraction: V::F,
    /// The interface's reflectance at normal incidence.
    pub f0: Rgb<V>,
    /// And at grazing incidence.
    pub f90: V::F,
}

impl<V: Vector> Terms<V> {
    /// Those of what has but a colour.
    #[inline(always)]
    pub fn of_color(color: Rgb<V>) -> Self {
        let lanes = color.max_element().lanes();
        let (zero, one) = (lanes.splat(0.0), lanes.splat(1.0));
        Self { color, ior: one, alpha: zero, fraction: zero, f0: Rgb::grey(zero), f90: zero }
    }

    #[inline(always)]
    fn of_metallic(from: &MetallicRoughness<V>) -> Self {
        let MetallicRoughness { base_color: color, metallic: fraction, alpha, dielectric_f0, dielectric_f90 } = *from;
        Self { alpha, fraction, f0: dielectric_f0, f90: dielectric_f90, ..Self::of_color(color) }
    }

    #[inline(always)]
    fn of_dielectric(Dielectric { color, ior, alpha, transmission }: &Dielectric<V>) -> Self {
        Self { ior: *ior, alpha: *alpha, fraction: *transmission, ..Self::of_color(*color) }
    }

    #[inline(always)]
    fn dielectric(self) -> Dielectric<V> {
        let Self { color, ior, alpha, fraction: transmission, .. } = self;
        Dielectric { color, ior, alpha, transmission }
    }

    #[inline(always)]
    fn metallic(self) -> MetallicRoughness<V> {
        let Self { color, alpha, fraction, f0, f90, .. } = self;
        MetallicRoughness { base_color: color, metallic: fraction, alpha, dielectric_f0: f0, dielectric_f90: f90 }
    }
}

impl Terms {
    /// Those of a BSDF that has a [`Kind`]; of another the colour.
    #[inline(always)]
    pub fn of(bsdf: &Bsdf) -> Self {
        match bsdf {
            Bsdf::Diffuse(Diffuse { albedo }) => Self::of_color(*albedo),
            Bsdf::MetallicRoughness(metallic) => Self::of_metallic(metallic),
            Bsdf::Dielectric(boundary) => Self::of_dielectric(boundary),
            Bsdf::Thin(ThinDielectric { color, ior, .. }) => Self { ior: *ior, ..Self::of_color(*color) },
            Bsdf::Layered(layered) => Self::of_color(layered.color()),
        }
    }

    /// The BSDF of this kind.
    #[inline(always)]
    fn bsdf(self, kind: Kind) -> Bsdf {
        let Self { color, ior, .. } = self;
        match kind {
            Kind::Diffuse => Bsdf::Diffuse(Diffuse { albedo: color }),
            Kind::Glass => Bsdf::Dielectric(Dielectric { color, ior, alpha: 0.0, transmission: 1.0 }),
            Kind::Pane => Bsdf::Thin(ThinDielectric { color, ior, alpha: 0.0, transmission: 1.0 }),
            Kind::Mirror => Bsdf::MetallicRoughness(MetallicRoughness::metal(color, 0.0)),
            Kind::MetallicRoughness => Bsdf::MetallicRoughness(self.metallic()),
            Kind::Dielectric => Bsdf::Dielectric(self.dielectric()),
        }
    }
}

/// A direction across from a known one in each lane, with the value and the densities there.
#[derive(Clone, Copy, Debug)]
pub struct Across<V: Vector = Vec3> {
    /// The direction, in the space of the known one.
    pub direction: V,
    /// Whether it belongs to a delta.
    pub is_delta: <V::Lanes as Lanes>::M,
    /// And which one: the second or the first.
    pub is_second: <V::Lanes as Lanes>::M,
    /// Nothing where there is no such direction.
    pub scatter: Scatter<V::Lanes>,
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
    /// An opaque dielectric or metal in all lanes.
    MetallicRoughness(MetallicRoughness<L::V>),
    /// The boundary of a volume in all lanes.
    Dielectric(Dielectric<L::V>),
    /// Of any kind, in some lanes.
    Each(L::Each<Bsdf>, L::M),
}

impl<L: Lanes> Bsdfs<L> {
    /// Those that `bsdf` has for the lanes `which`; anything in the others.
    #[inline(always)]
    pub fn new<'a>(lanes: L, which: L::M, bsdf: impl Fn(usize) -> &'a Bsdf) -> Self {
        let mut kind = which.lanes().next().map_or(Some(Kind::Diffuse), |k| Kind::of(bsdf(k)));
        for k in which.lanes() {
            kind = match (kind, Kind::of(bsdf(k))) {
                (Some(a), Some(b)) => a.with(b),
                _ => None,
            };
        }
        match kind {
            Some(kind) => Self::of_kind(kind, Self::terms(lanes, which, bsdf)),
            None => Self::Each(lanes.each(|k| *bsdf(k)), which),
        }
    }

    #[inline(always)]
    fn terms<'a>(lanes: L, which: L::M, bsdf: impl Fn(usize) -> &'a Bsdf) -> Terms<L::V> {
        let mut colors = [[0.0; MOST]; 6];
        let mut numbers = [[1.0; MOST], [0.0; MOST], [0.0; MOST], [0.0; MOST]];
        for k in which.lanes() {
            let Terms { color, ior, alpha, fraction, f0, f90 } = Terms::of(bsdf(k));
            let ([r, g, b], [u, v, w]) = (color.to_array(), f0.to_array());
            [colors[0][k], colors[1][k], colors[2][k], colors[3][k], colors[4][k], colors[5][k]] = [r, g, b, u, v, w];
            [numbers[0][k], numbers[1][k], numbers[2][k], numbers[3][k]] = [ior, alpha, fraction, f90];
        }
        let color = |i: usize| {
            Rgb::of(L::V::new(lanes.load(&colors[i]), lanes.load(&colors[i + 1]), lanes.load(&colors[i + 2])))
        };
        Terms {
            color: color(0),
            ior: lanes.load(&numbers[0]),
            alpha: lanes.load(&numbers[1]),
            fraction: lanes.load(&numbers[2]),
            f0: color(3),
            f90: lanes.load(&numbers[3]),
        }
    }

    /// Those of one kind.
    #[inline(always)]
    pub fn of_kind(kind: Kind, terms: Terms<L::V>) -> Self {
        let Terms { color, ior, .. } = terms;
        match kind {
            Kind::Diffuse => Self::Diffuse(Diffuse { albedo: color }),
            Kind::Glass => Self::Glass(Glass { color, ior }),
            Kind::Pane => Self::Pane(Pane { color, ior }),
            Kind::Mirror => Self::Mirror(Mirror { color }),
            Kind::MetallicRoughness => Self::MetallicRoughness(terms.metallic()),
            Kind::Dielectric => Self::Dielectric(terms.dielectric()),
        }
    }

    /// Their kind, if all are of one, and their numbers.
    #[inline(always)]
    pub fn kind_and_terms(&self, lanes: L) -> (Option<Kind>, Terms<L::V>) {
        let of_color = |color| Terms::of_color(color);
        match self {
            Self::Diffuse(Diffuse { albedo }) => (Some(Kind::Diffuse), of_color(*albedo)),
            Self::Glass(Glass { color, ior }) => (Some(Kind::Glass), Terms { ior: *ior, ..of_color(*color) }),
            Self::Pane(Pane { color, ior }) => (Some(Kind::Pane), Terms { ior: *ior, ..of_color(*color) }),
            Self::Mirror(Mirror { color }) => (Some(Kind::Mirror), of_color(*color)),
            Self::MetallicRoughness(metallic) => (Some(Kind::MetallicRoughness), Terms::of_metallic(metallic)),
            Self::Dielectric(boundary) => (Some(Kind::Dielectric), Terms::of_dielectric(boundary)),
            Self::Each(..) => (None, of_color(Rgb::grey(lanes.splat(0.0)))),
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
            Self::Diffuse(_) | Self::MetallicRoughness(_) | Self::Dielectric(_) | Self::Each(..) => None,
        }
    }

    /// Those of all lanes, by their number.
    #[inline(always)]
    pub fn all(&self, lanes: L) -> impl Fn(usize) -> Bsdf {
        let (kind, Terms { color, ior, alpha, fraction, f0, f90 }) = self.kind_and_terms(lanes);
        let (color, f0) = (color.channels().all(), f0.channels().all());
        let (ior, alpha, fraction, f90) = (ior.all(), alpha.all(), fraction.all(), f90.all());
        move |k| match (self, kind) {
            (Self::Each(bsdfs, _), _) => L::lane(bsdfs, k),
            (_, kind) => {
                let [color, f0] = [color[k], f0[k]].map(Rgb::from_array);
                Terms { color, ior: ior[k], alpha: alpha[k], fraction: fraction[k], f0, f90: f90[k] }
                    .bsdf(kind.unwrap_or(Kind::Diffuse))
            }
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
            Self::MetallicRoughness(metallic) => metallic.has_continuous(),
            Self::Dielectric(boundary) => boundary.has_continuous(),
            Self::Each(bsdfs, which) => *which & lanes.condition(|k| L::lane(bsdfs, k).has_continuous()),
        }
    }

    /// Whether light may pass the surfaces.
    #[inline(always)]
    pub fn may_transmit(&self) -> bool {
        matches!(self, Self::Glass(_) | Self::Pane(_) | Self::Dielectric(_) | Self::Each(..))
    }
}
