//! How a walk leaves a vertex: its direction, what is left of F/p, and roulette.

use super::{Roulette, Step, scattering::Surfaces};
use crate::{
    lanes::{Float, Lanes, Mask, One, Vector},
    math::Rgb,
    sampling::{Chance, PdfArea, PdfSolidAngle},
    scene::{
        Scene,
        bsdf::{Directions, Lobe, Transport},
        camera::{Camera, Seen},
        point::Place,
    },
};

/// A walk on its way from one vertex to the next.
#[derive(Clone, Copy, Debug)]
pub struct Departure<L: Lanes = One> {
    /// Where its ray starts.
    pub origin: L::V,
    /// Its unit direction.
    pub direction: L::V,
    /// The density of that direction.
    pub pdf: PdfSolidAngle<L::F>,
    /// The prefix of F/p, with everything at the vertex that it leaves.
    pub beta: Rgb<L::V>,
    /// The product of roulette's survival probabilities so far.
    pub survival: L::F,
}

impl<L: Lanes> Departure<L> {
    /// From the first vertex `lens` of a walk from the camera, through `raster`; and whether the padded image holds
    /// that place, which rounding may put outside.
    #[inline(always)]
    pub fn from_lens<B: Surfaces<L>>(camera: &Camera, lens: &Step<L, B>, raster: [L::F; 2]) -> (Self, L::M) {
        let p = &lens.vertex.point;
        let direction = camera.direction_through(p, raster);
        let Seen { we, pdf, some, .. } = camera.look_in_lanes(p, direction);
        let beta = lens.beta.times(we * p.normal.dot(direction) / pdf.0);
        (Self { origin: p.position, direction, pdf, beta, survival: lens.survival }, some)
    }

    /// From the first vertex `end` of a walk from a light, in a unit direction of this density. The ray starts at
    /// `origin`.
    #[inline(always)]
    pub fn from_light<B: Surfaces<L>>(
        scene: &Scene,
        end: &Step<L, B>,
        direction: L::V,
        pdf: PdfSolidAngle<L::F>,
        origin: L::V,
    ) -> Self {
        let p = &end.vertex.point;
        let cos = if p.place == Place::Surface { p.normal.dot(direction).abs() } else { p.alpha.lanes().splat(1.0) };
        let beta = (end.beta * scene.le(p, direction)).times(p.alpha * cos / pdf.0);
        Self { origin, direction, pdf, beta, survival: end.survival }
    }
}

/// By which rules a walk goes on.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// Which side it comes from.
    pub transport: Transport,
    /// How it samples directions.
    pub directions: Directions,
    /// When it may end.
    pub roulette: Roulette,
}

/// A walk that has scattered at its last vertex.
#[derive(Clone, Copy, Debug)]
pub struct Scattered<L: Lanes = One> {
    /// How it leaves the vertex.
    pub departure: Departure<L>,
    /// The lobe that it has used.
    pub lobe: L::Each<Lobe>,
    /// Whether that is a delta lobe.
    pub is_delta: L::M,
    /// The predecessor's other-side density, which the two directions at the vertex decide.
    pub reverse: PdfArea<L::F>,
    /// What [`Roulette::ByThroughput`] compares with from here on.
    pub whole: L::F,
    /// Whether it goes on at all; if not, the fields above mean nothing.
    pub goes_on: L::M,
    /// See [`super::scattering::Sampled::lost_to_sides`].
    pub lost_to_sides: L::M,
}

impl<L: Lanes, B: Surfaces<L>> Step<L, B> {
    /// Samples how a walk leaves this vertex, its last so far, which has `edges` edges behind it.
    #[inline(always)]
    pub fn scatter(
        &self,
        Rules { transport, directions, roulette }: Rules,
        edges: u32,
        mut whole: L::F,
        u: [L::F; 3],
        survive: Chance<L::U>,
    ) -> Scattered<L> {
        let lanes = whole.lanes();
        let p = &self.vertex.point;
        let known = self.back.direction;
        let sample = self.vertex.sample(directions, known, transport, u);
        let (forward, reverse) = sample.scatter.forward_reverse(transport);
        let cos = p.normal.dot(sample.direction).abs();
        let ratio = sample.scatter.f.times(cos / forward.0);
        // No closures from here on: what they do may be called instead of compiled for the lanes.
        let plays = match roulette {
            Roulette::Off => false,
            Roulette::FromDepth(depth) | Roulette::ByThroughput(depth) => edges >= depth,
        };
        // Radiance shrinks by η² on entering a medium and grows again on leaving it: no reason to stop inside.
        let mut scale = lanes.splat(1.0);
        if transport == Transport::Radiance && (plays || matches!(roulette, Roulette::ByThroughput(_))) {
            let (to_camera, to_light) = transport.sides(known, sample.direction);
            let eta = B::relative_ior_at(p, to_camera, to_light);
            scale = eta * eta;
        }
        let kept = match roulette {
            Roulette::Off | Roulette::FromDepth(_) => ratio.max_element() * scale,
            Roulette::ByThroughput(_) => {
                whole = whole / scale;
                (self.beta * ratio).max_element() / whole
            }
        };
        let (mut survival, mut goes_on) = (self.survival, sample.some);
        if plays && goes_on.any() {
            // A ratio that is NaN gives q = 0.95, for `min` passes over it: the walk goes on and the film counts it.
            let q = kept.min(lanes.splat(Roulette::SUREST));
            goes_on = goes_on & survive.falls_below(q);
            survival = survival * q;
        }
        let played = self.survival / survival;
        let departure = Departure {
            origin: p.ray_origin(sample.direction),
            direction: sample.direction,
            pdf: forward,
            beta: (self.beta * ratio).times(played),
            survival,
        };
        Scattered {
            departure,
            lobe: sample.lobe,
            is_delta: sample.is_delta,
            reverse: reverse.to_area(&self.back),
            whole,
            goes_on,
            lost_to_sides: sample.lost_to_sides,
        }
    }
}
