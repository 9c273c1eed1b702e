//! How the surfaces at points scatter: f̂ and its densities, and the directions that a walk samples, in any lanes.

use std::fmt::Debug;

use glam::Vec3;

use crate::{
    lanes::{Float, Lanes, MOST, Mask, One, Vector, Work},
    math::{Frame, Rgb},
    sampling::PdfSolidAngle,
    scene::{
        bsdf::{Across, Bsdf, BsdfSample, Bsdfs, Directions, Lobe, OverEmission, Scatter, Transport},
        point::Point,
        tilt::Tilt,
    },
};

/// A direction in which a walk leaves a vertex, in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<L: Lanes = One> {
    /// The unit world direction.
    pub direction: L::V,
    /// The lobe that it belongs to.
    pub lobe: L::Each<Lobe>,
    /// Whether that is a delta lobe.
    pub is_delta: L::M,
    /// f̂/α with the densities of both directions.
    pub scatter: Scatter<L>,
    /// Whether there is such a direction. There is none where the BSDF scatters nothing, or nothing in a direction that
    /// light could take.
    pub some: L::M,
    /// Whether the BSDF has one, but N_s and N_g do not agree on the side: light that is lost to shading normals.
    pub lost_to_sides: L::M,
}

impl Sampled {
    const NOTHING: Self = Self {
        direction: Vec3::Z,
        lobe: Lobe::Continuous,
        is_delta: false,
        scatter: Scatter::ZERO,
        some: false,
        lost_to_sides: false,
    };

    #[inline(always)]
    fn of(sample: Option<BsdfSample>) -> Self {
        let Some(BsdfSample { direction, lobe, scatter }) = sample else { return Self::NOTHING };
        Self { direction, lobe, is_delta: lobe != Lobe::Continuous, scatter, some: true, lost_to_sides: false }
    }
}

impl<L: Lanes> Sampled<L> {
    /// No direction, in any lane, for want of a side.
    #[inline(always)]
    fn lost(lanes: L) -> Self {
        let none = lanes.mask(0);
        Self {
            direction: lanes.splat_v([0.0, 0.0, 1.0]),
            lobe: lanes.each(|_| Lobe::Continuous),
            is_delta: none,
            scatter: Scatter::nothing(lanes),
            some: none,
            lost_to_sides: lanes.first(L::N),
        }
    }
}

/// The BSDFs at the points in all lanes.
pub trait Surfaces<L: Lanes>: OverEmission<L> + Copy + Debug {
    /// The same, to be asked about in the lanes `which` alone, of which there is one.
    #[must_use]
    fn only(self, which: L::M) -> Self;

    /// f of `lobe` with the densities of both directions, for unit world directions at surfaces with the unit normals
    /// `n`: see [`Bsdf::eval_around`].
    fn scatter_around(&self, n: L::V, lobe: Lobe, to_camera: L::V, to_light: L::V) -> Scatter<L>;

    /// A direction across from the unit world direction `known` at such surfaces: see [`Bsdf::sample_by`].
    fn sample_around(
        &self,
        n: L::V,
        directions: Directions,
        known: L::V,
        transport: Transport,
        u: [L::F; 3],
    ) -> Sampled<L>;

    /// η_light/η_camera across the surfaces, for the cosines of both directions: see [`Bsdf::relative_ior`].
    fn relative_ior_between(&self, cos_camera: L::F, cos_light: L::F) -> L::F;

    /// f̂/α of `lobe` with the densities of both directions, for unit world directions: see
    /// [`Vertex::scatter`](super::Vertex::scatter).
    #[inline(always)]
    fn scatter_at(at: &Point<L, Self>, lobe: Lobe, to_camera: L::V, to_light: L::V) -> Scatter<L> {
        if !(!at.is_flat()).any() {
            at.bsdf.scatter_around(at.normal, lobe, to_camera, to_light)
        } else {
            Self::scatter_tilted(at, lobe, to_camera, to_light)
        }
    }

    /// See [`Vertex::sample`](super::Vertex::sample).
    #[inline(always)]
    fn sample_at(
        at: &Point<L, Self>,
        directions: Directions,
        known: L::V,
        transport: Transport,
        u: [L::F; 3],
    ) -> Sampled<L> {
        if !(!at.is_flat()).any() {
            let sample = at.bsdf.sample_around(at.normal, directions, known, transport, u);
            Sampled { some: sample.some & leaves_plane(at, sample.direction), ..sample }
        } else {
            Self::sample_tilted(at, directions, known, transport, u)
        }
    }

    /// [`Self::scatter_at`] where N_s may not be N_g.
    #[inline(always)]
    fn scatter_tilted(at: &Point<L, Self>, lobe: Lobe, to_camera: L::V, to_light: L::V) -> Scatter<L> {
        scatter_tilted(at, lobe, to_camera, to_light)
    }

    /// [`Self::sample_at`] where N_s may not be N_g.
    #[inline(always)]
    fn sample_tilted(
        at: &Point<L, Self>,
        directions: Directions,
        known: L::V,
        transport: Transport,
        u: [L::F; 3],
    ) -> Sampled<L> {
        sample_tilted(at, directions, known, transport, u)
    }

    /// η_light/η_camera across the surfaces: see [`Bsdf::relative_ior`].
    #[inline(always)]
    fn relative_ior_at(at: &Point<L, Self>, to_camera: L::V, to_light: L::V) -> L::F {
        at.bsdf.relative_ior_between(at.normal.dot(to_camera), at.normal.dot(to_light))
    }
}

/// Where a direction is not within the surface's plane: there is no side to go to.
#[inline(always)]
fn leaves_plane<L: Lanes, B>(at: &Point<L, B>, direction: L::V) -> L::M {
    !at.normal.dot(direction).eq(at.alpha.lanes().splat(0.0))
}

#[inline(always)]
fn scatter_tilted<L: Lanes, B: Surfaces<L>>(
    at: &Point<L, B>,
    lobe: Lobe,
    to_camera: L::V,
    to_light: L::V,
) -> Scatter<L> {
    let tilt = Tilt::at(at);
    let (camera, light) = (tilt.to_shading(to_camera), tilt.to_shading(to_light));
    let lanes = at.alpha.lanes();
    let keep_sides = camera.keeps_side() & light.keeps_side();
    if !keep_sides.any() {
        return Scatter::nothing(lanes);
    }
    let is_delta = lanes.mask(if lobe == Lobe::Continuous { 0 } else { u32::MAX });
    let bsdf = at.bsdf.only(keep_sides);
    let scatter = bsdf.scatter_around(tilt.shading_normal(), lobe, camera.direction, light.direction);
    let f = scatter.f.times(light.factor(is_delta));
    Tilt::densities(is_delta, Scatter { f, ..scatter }, &camera, &light).only(keep_sides)
}

#[inline(always)]
fn sample_tilted<L: Lanes, B: Surfaces<L>>(
    at: &Point<L, B>,
    directions: Directions,
    known: L::V,
    transport: Transport,
    u: [L::F; 3],
) -> Sampled<L> {
    let tilt = Tilt::at(at);
    let before = tilt.to_shading(known);
    // What has no side may have no direction either, or no N_s: nothing that a BSDF says of it counts.
    let keeps_side = before.keeps_side();
    if !keeps_side.any() {
        return Sampled::lost(at.alpha.lanes());
    }
    let bsdf = at.bsdf.only(keeps_side);
    let sample = bsdf.sample_around(tilt.shading_normal(), directions, before.direction, transport, u);
    let after = tilt.to_surface(sample.direction);
    let (camera, light) = transport.sides(before, after);
    let f = sample.scatter.f.times(light.factor(sample.is_delta));
    let scatter = Tilt::densities(sample.is_delta, Scatter { f, ..sample.scatter }, &camera, &light);
    Sampled {
        direction: after.direction,
        scatter,
        some: sample.some & keeps_side & after.keeps_side() & leaves_plane(at, after.direction),
        lost_to_sides: !keeps_side | sample.some & !after.keeps_side(),
        ..sample
    }
}

impl Surfaces<One> for Bsdf {
    #[inline(always)]
    fn only(self, _: bool) -> Self {
        self
    }

    #[inline(always)]
    fn scatter_around(&self, n: Vec3, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        self.eval_around(n, lobe, to_camera, to_light)
    }

    #[inline(always)]
    fn sample_around(
        &self,
        n: Vec3,
        directions: Directions,
        known: Vec3,
        transport: Transport,
        u: [f32; 3],
    ) -> Sampled {
        Sampled::of(Bsdf::sample_around(self, n, directions, known, transport, u.into()))
    }

    #[inline(always)]
    fn relative_ior_between(&self, cos_camera: f32, cos_light: f32) -> f32 {
        self.relative_ior(Vec3::Z * cos_camera, Vec3::Z * cos_light)
    }

    // Out of line: the common case is flat.
    #[inline(never)]
    fn scatter_tilted(at: &Point, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        scatter_tilted(at, lobe, to_camera, to_light)
    }

    #[inline(never)]
    fn sample_tilted(at: &Point, directions: Directions, known: Vec3, transport: Transport, u: [f32; 3]) -> Sampled {
        sample_tilted(at, directions, known, transport, u)
    }
}

impl<L: Lanes> Surfaces<L> for Bsdfs<L> {
    #[inline(always)]
    fn only(self, which: L::M) -> Self {
        match self {
            Self::Each(bsdfs, some) => Self::Each(bsdfs, some & which),
            _ => self,
        }
    }

    #[inline(always)]
    fn scatter_around(&self, n: L::V, lobe: Lobe, to_camera: L::V, to_light: L::V) -> Scatter<L> {
        match self {
            Self::Diffuse(diffuse) if lobe == Lobe::Continuous => diffuse.between(n.dot(to_camera), n.dot(to_light)),
            Self::MetallicRoughness(_) | Self::Dielectric(_) if lobe == Lobe::Continuous => {
                n.max_element().lanes().call(Continuous { bsdfs: self, n, to_camera, to_light })
            }
            _ => scatter_each(self, n, lobe, to_camera, to_light),
        }
    }

    #[inline(always)]
    fn sample_around(
        &self,
        n: L::V,
        directions: Directions,
        known: L::V,
        transport: Transport,
        u: [L::F; 3],
    ) -> Sampled<L> {
        let lanes = u[0].lanes();
        let (none, all) = (lanes.mask(0), lanes.first(L::N));
        let (direction, scatter, lobe, is_delta) = match self {
            Self::Diffuse(diffuse) if directions == Directions::Bsdf => {
                let (direction, scatter) = diffuse.sample_around(n, known, transport, [u[0], u[1]]);
                (direction, scatter, lanes.each(|_| Lobe::Continuous), none)
            }
            Self::MetallicRoughness(_) | Self::Dielectric(_) if directions == Directions::Bsdf => {
                let across = lanes.call(Sampling { bsdfs: self, n, known, transport, u });
                let (delta, second) = (across.is_delta.bits(), across.is_second.bits());
                let lobe = lanes.each(|k| match delta >> k & 1 {
                    0 => Lobe::Continuous,
                    _ => Lobe::Delta((second >> k & 1) as u8),
                });
                (across.direction, across.scatter, lobe, across.is_delta)
            }
            _ => {
                // Deltas are the same by every rule.
                let frame = Frame::around(n);
                let Some(deltas) = self.sample_delta(frame.to_local(known), transport, u[2]) else {
                    return sample_each(self, n, directions, known, transport, u);
                };
                let (direction, second, scatter) = deltas;
                (frame.to_world(direction).normalize(), scatter, which_delta(lanes, second), all)
            }
        };
        let some = scatter.is_sampled(transport);
        Sampled { direction, lobe, is_delta, scatter, some, lost_to_sides: none }
    }

    #[inline(always)]
    fn relative_ior_between(&self, cos_camera: L::F, cos_light: L::F) -> L::F {
        let lanes = cos_camera.lanes();
        match self {
            Self::Diffuse(_) | Self::Pane(_) | Self::Mirror(_) | Self::MetallicRoughness(_) => lanes.splat(1.0),
            Self::Glass(glass) => glass.relative_ior(cos_camera, cos_light),
            Self::Dielectric(boundary) => boundary.smooth().relative_ior(cos_camera, cos_light),
            Self::Each(bsdfs, which) => {
                let (cos_camera, cos_light) = (cos_camera.all(), cos_light.all());
                let mut each = [1.0; MOST];
                for k in which.lanes() {
                    each[k] = L::lane(bsdfs, k).relative_ior_between(cos_camera[k], cos_light[k]);
                }
                lanes.load(&each)
            }
        }
    }
}

/// The second of two deltas where the condition holds, and the first elsewhere.
#[inline(always)]
fn which_delta<L: Lanes>(lanes: L, second: L::M) -> L::Each<Lobe> {
    let second = second.bits();
    lanes.each(|k| Lobe::Delta((second >> k & 1) as u8))
}

/// The continuous part of surfaces with facets and the unit normals `n` between unit world directions.
struct Continuous<'a, L: Lanes> {
    bsdfs: &'a Bsdfs<L>,
    n: L::V,
    to_camera: L::V,
    to_light: L::V,
}

impl<L: Lanes> Work for Continuous<'_, L> {
    type Output = Scatter<L>;

    #[inline(always)]
    fn work(self) -> Scatter<L> {
        let frame = Frame::around(self.n);
        let (to_camera, to_light) = (frame.to_local(self.to_camera), frame.to_local(self.to_light));
        match self.bsdfs {
            Bsdfs::MetallicRoughness(bsdfs) => bsdfs.continuous(to_camera, to_light),
            Bsdfs::Dielectric(bsdfs) => bsdfs.continuous(to_camera, to_light),
            _ => Scatter::nothing(self.n.max_element().lanes()),
        }
    }
}

/// A unit world direction across from `known` at such surfaces.
struct Sampling<'a, L: Lanes> {
    bsdfs: &'a Bsdfs<L>,
    n: L::V,
    known: L::V,
    transport: Transport,
    u: [L::F; 3],
}

impl<L: Lanes> Work for Sampling<'_, L> {
    type Output = Across<L::V>;

    #[inline(always)]
    fn work(self) -> Across<L::V> {
        let Self { bsdfs, n, known, transport, u } = self;
        let frame = Frame::around(n);
        let (known, none) = (frame.to_local(known), u[0].lanes().mask(0));
        let across = match bsdfs {
            Bsdfs::MetallicRoughness(bsdfs) => bsdfs.sample_in_lanes(known, transport, u),
            Bsdfs::Dielectric(bsdfs) => bsdfs.sample_in_lanes(known, transport, u),
            _ => {
                let scatter = Scatter::nothing(u[0].lanes());
                Across { direction: known, is_delta: none, is_second: none, scatter }
            }
        };
        Across { direction: frame.to_world(across.direction).normalize(), ..across }
    }
}

/// One lane's, out of line: a copy in each place where lanes ask would make the core several times as large.
#[inline(never)]
fn scatter_alone(bsdf: &Bsdf, n: Vec3, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
    bsdf.eval_around(n, lobe, to_camera, to_light)
}

#[inline(never)]
fn sample_alone(
    bsdf: &Bsdf,
    n: Vec3,
    directions: Directions,
    known: Vec3,
    transport: Transport,
    u: [f32; 3],
) -> Sampled {
    Surfaces::sample_around(bsdf, n, directions, known, transport, u)
}

/// [`Surfaces::scatter_around`] lane by lane.
#[inline(always)]
fn scatter_each<L: Lanes>(bsdfs: &Bsdfs<L>, n: L::V, lobe: Lobe, to_camera: L::V, to_light: L::V) -> Scatter<L> {
    let lanes = n.max_element().lanes();
    let (n, to_camera, to_light, bsdf) = (n.all(), to_camera.all(), to_light.all(), bsdfs.all(lanes));
    let mut each = [Scatter::ZERO; MOST];
    for k in bsdfs.which(lanes).lanes() {
        each[k] = scatter_alone(&bsdf(k), n[k].into(), lobe, to_camera[k].into(), to_light[k].into());
    }
    scatter_of_each(lanes, |k| each[k])
}

/// [`Surfaces::sample_around`] lane by lane.
#[inline(always)]
fn sample_each<L: Lanes>(
    bsdfs: &Bsdfs<L>,
    n: L::V,
    directions: Directions,
    known: L::V,
    transport: Transport,
    u: [L::F; 3],
) -> Sampled<L> {
    let lanes = u[0].lanes();
    let (n, known, u, bsdf) = (n.all(), known.all(), L::V::new(u[0], u[1], u[2]).all(), bsdfs.all(lanes));
    let mut each = [Sampled::NOTHING; MOST];
    for k in bsdfs.which(lanes).lanes() {
        each[k] = sample_alone(&bsdf(k), n[k].into(), directions, known[k].into(), transport, u[k]);
    }
    Sampled {
        direction: lanes.vectors(|k| each[k].direction.to_array()),
        lobe: lanes.each(|k| each[k].lobe),
        is_delta: lanes.condition(|k| each[k].is_delta),
        scatter: scatter_of_each(lanes, |k| each[k].scatter),
        some: lanes.condition(|k| each[k].some),
        lost_to_sides: lanes.condition(|k| each[k].lost_to_sides),
    }
}

#[inline(always)]
fn scatter_of_each<L: Lanes>(lanes: L, of: impl Fn(usize) -> Scatter) -> Scatter<L> {
    Scatter {
        f: Rgb::of(lanes.vectors(|k| of(k).f.to_array())),
        to_light: PdfSolidAngle(lanes.numbers(|k| of(k).to_light.0)),
        to_camera: PdfSolidAngle(lanes.numbers(|k| of(k).to_camera.0)),
    }
}
