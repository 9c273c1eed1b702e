//! How the surfaces at points scatter: f̂ and its densities, and the directions that a walk samples, in any lanes.

use std::fmt::Debug;

use glam::Vec3;

use crate::{
    lanes::{Float, Lanes, MOST, Mask, One, Vector},
    math::Rgb,
    sampling::PdfSolidAngle,
    scene::{
        bsdf::{Bsdf, BsdfSample, Bsdfs, Diffuse, Directions, Lobe, Scatter, Transport},
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
    const LOST: Self = Self { lost_to_sides: true, ..Self::NOTHING };

    #[inline(always)]
    fn of(BsdfSample { direction, lobe, scatter }: BsdfSample) -> Self {
        let is_delta = lobe != Lobe::Continuous;
        Self { direction, lobe, is_delta, scatter, some: true, lost_to_sides: false }
    }
}

/// The BSDFs at the points in all lanes.
pub trait Surfaces<L: Lanes>: Copy + Debug {
    /// f̂/α of `lobe` with the densities of both directions, for unit world directions: see
    /// [`Vertex::scatter`](super::Vertex::scatter).
    fn scatter_at(at: &Point<L, Self>, lobe: Lobe, to_camera: L::V, to_light: L::V) -> Scatter<L>;

    /// See [`Vertex::sample`](super::Vertex::sample).
    fn sample_at(
        at: &Point<L, Self>,
        directions: Directions,
        known: L::V,
        transport: Transport,
        u: [L::F; 3],
    ) -> Sampled<L>;

    /// η_light/η_camera across the surface: see [`Bsdf::relative_ior`].
    fn relative_ior_at(at: &Point<L, Self>, to_camera: L::V, to_light: L::V) -> L::F;
}

impl Surfaces<One> for Bsdf {
    #[inline(always)]
    fn scatter_at(at: &Point, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        if at.is_flat() {
            at.bsdf.eval_around(at.normal, lobe, to_camera, to_light)
        } else {
            scatter_tilted(at, lobe, to_camera, to_light)
        }
    }

    #[inline(always)]
    fn sample_at(at: &Point, directions: Directions, known: Vec3, transport: Transport, u: [f32; 3]) -> Sampled {
        if !at.is_flat() {
            return sample_tilted(at, directions, known, transport, u.into());
        }
        // Within the surface's plane there is no side to go to.
        match at.bsdf.sample_around(at.normal, directions, known, transport, u.into()) {
            Some(sample) if at.normal.dot(sample.direction) != 0.0 => Sampled::of(sample),
            _ => Sampled::NOTHING,
        }
    }

    #[inline(always)]
    fn relative_ior_at(at: &Point, to_camera: Vec3, to_light: Vec3) -> f32 {
        let local = |w: Vec3| Vec3::new(0.0, 0.0, at.normal.dot(w));
        at.bsdf.relative_ior(local(to_camera), local(to_light))
    }
}

#[inline(never)]
fn scatter_tilted(p: &Point, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
    let tilt = Tilt::at(p);
    let (camera, light) = (tilt.to_shading(to_camera), tilt.to_shading(to_light));
    if !(camera.keeps_side() && light.keeps_side()) {
        return Scatter::ZERO;
    }
    let scatter = p.bsdf.eval_around(p.shading_normal, lobe, camera.direction, light.direction);
    let f = scatter.f * light.factor(lobe);
    Tilt::densities(lobe, Scatter { f, ..scatter }, &camera, &light)
}

#[inline(never)]
fn sample_tilted(p: &Point, directions: Directions, known: Vec3, transport: Transport, u: Vec3) -> Sampled {
    let tilt = Tilt::at(p);
    let before = tilt.to_shading(known);
    if !before.keeps_side() {
        return Sampled::LOST;
    }
    let sample = p.bsdf.sample_around(p.shading_normal, directions, before.direction, transport, u);
    let Some(BsdfSample { direction, lobe, scatter }) = sample else { return Sampled::NOTHING };
    let after = tilt.to_surface(direction);
    if !after.keeps_side() {
        return Sampled::LOST;
    }
    let (camera, light) = match transport {
        Transport::Radiance => (before, after),
        Transport::Importance => (after, before),
    };
    let f = scatter.f * light.factor(lobe);
    let scatter = Tilt::densities(lobe, Scatter { f, ..scatter }, &camera, &light);
    Sampled::of(BsdfSample { direction: after.direction, lobe, scatter })
}

impl<L: Lanes> Surfaces<L> for Bsdfs<L> {
    #[inline(always)]
    fn scatter_at(at: &Point<L, Self>, lobe: Lobe, to_camera: L::V, to_light: L::V) -> Scatter<L> {
        match at.bsdf {
            Self::Diffuse(diffuse) if lobe == Lobe::Continuous && !(!at.is_flat()).any() => {
                diffuse.between(at.normal.dot(to_camera), at.normal.dot(to_light))
            }
            _ => scatter_each(at, lobe, to_camera, to_light),
        }
    }

    #[inline(always)]
    fn sample_at(
        at: &Point<L, Self>,
        directions: Directions,
        known: L::V,
        transport: Transport,
        u: [L::F; 3],
    ) -> Sampled<L> {
        match at.bsdf {
            Self::Diffuse(diffuse) if directions == Directions::Bsdf && !(!at.is_flat()).any() => {
                sample_diffuse(at, diffuse, known, transport, u)
            }
            _ => sample_each(at, directions, known, transport, u),
        }
    }

    #[inline(always)]
    fn relative_ior_at(at: &Point<L, Self>, to_camera: L::V, to_light: L::V) -> L::F {
        let lanes = at.alpha.lanes();
        match at.bsdf {
            Self::Diffuse(_) => lanes.splat(1.0),
            Self::Each(_, which) => {
                let (to_camera, to_light) = (to_camera.all(), to_light.all());
                let mut each = [1.0; MOST];
                for (k, point) in at.each(which) {
                    each[k] = Bsdf::relative_ior_at(&point, to_camera[k].into(), to_light[k].into());
                }
                lanes.load(&each)
            }
        }
    }
}

/// Lambert's law on flat surfaces: as [`Surfaces::sample_at`] of one lane has it.
#[inline(always)]
fn sample_diffuse<L: Lanes, B>(
    at: &Point<L, B>,
    diffuse: Diffuse<L::V>,
    known: L::V,
    transport: Transport,
    [x, y, _]: [L::F; 3],
) -> Sampled<L> {
    let lanes = x.lanes();
    let (direction, scatter) = diffuse.sample_around(at.normal, known, transport, [x, y]);
    let (zero, (forward, _)) = (lanes.splat(0.0), scatter.forward_reverse(transport));
    let some = !scatter.f.is_black() & zero.lt(forward.0) & !at.normal.dot(direction).eq(zero);
    let (lobe, none) = (lanes.each(|_| Lobe::Continuous), lanes.mask(0));
    Sampled { direction, lobe, is_delta: none, scatter, some, lost_to_sides: none }
}

/// One lane's, out of line: a copy in each place where lanes ask would make the core several times as large.
#[inline(never)]
fn scatter_alone(at: &Point, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
    Bsdf::scatter_at(at, lobe, to_camera, to_light)
}

#[inline(never)]
fn sample_alone(at: &Point, directions: Directions, known: Vec3, transport: Transport, u: [f32; 3]) -> Sampled {
    Bsdf::sample_at(at, directions, known, transport, u)
}

/// [`Surfaces::scatter_at`] lane by lane.
#[inline(always)]
fn scatter_each<L: Lanes>(at: &Point<L, Bsdfs<L>>, lobe: Lobe, to_camera: L::V, to_light: L::V) -> Scatter<L> {
    let lanes = at.alpha.lanes();
    let (to_camera, to_light) = (to_camera.all(), to_light.all());
    let mut each = [Scatter::ZERO; MOST];
    for (k, point) in at.each(at.bsdf.which(lanes)) {
        each[k] = scatter_alone(&point, lobe, to_camera[k].into(), to_light[k].into());
    }
    scatter_of_each(lanes, |k| each[k])
}

/// [`Surfaces::sample_at`] lane by lane.
#[inline(always)]
fn sample_each<L: Lanes>(
    at: &Point<L, Bsdfs<L>>,
    directions: Directions,
    known: L::V,
    transport: Transport,
    u: [L::F; 3],
) -> Sampled<L> {
    let lanes = at.alpha.lanes();
    let (known, u) = (known.all(), L::V::new(u[0], u[1], u[2]).all());
    let mut each = [Sampled::NOTHING; MOST];
    for (k, point) in at.each(at.bsdf.which(lanes)) {
        each[k] = sample_alone(&point, directions, known[k].into(), transport, u[k]);
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
