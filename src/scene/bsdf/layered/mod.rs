//! Surfaces in layers: from the outside in fuzz, a coat, sheen, and a base of metal or of a dielectric over what is
//! diffuse or clear, with a thin film, a grain, or light that passes to the other side.
//!
//! **The sum.** Each lobe is a [`Part`] in a file of its own and a line of the macro `each`. A walk chooses a lobe by
//! its albedo from the known direction, and the densities of both directions come with f.
//!
//! **Layers.** A layer is known by its albedo E(θ) and lets through t(θ) = 1 − E(θ), t of all that lies above the base
//! being their product. What is below reaches the eye in one of two forms, both reciprocal:
//!
//! * a diffuse lobe by the product t(θ) t(θ′), divided by the mean of t: its albedo is t(θ) exactly (Kelemen &
//!   Szirmay-Kalos 2001);
//! * a glossy one by min(t(θ), t(θ′)), as `KHR_materials_sheen` has it (Estevez & Kulla 2017): exact for a mirror, and
//!   never more than t(θ). What a rough one lacks, [`spread`] gives back.
//!
//! The layers of a volume's boundary lie on its outer side, and light that passes the boundary crosses them once: see
//! [`clear`]. So a white surface under white layers stays white. A coat with a normal of its own is to the surface's as
//! N_s is to N_g: its lobe carries |ω_light·N_coat|/|ω_light·N_s|, in every strategy alike, and may lose light at the
//! horizon. A smooth coat over a normal texture sees light as it travels: what [`Tilt`](crate::scene::tilt) bends for
//! N_s is bent back for it.
//!
//! There are no delta lobes: what is smoother than [`LEAST_ALPHA`] counts as that.

mod base;
mod brushed;
mod clear;
mod coat;
mod diffuse;
mod facets;
mod film;
mod record;
mod rough;
mod sheen;
mod spread;
mod stack;
mod surface;
#[cfg(test)]
mod tests;

use glam::Vec3;

use super::{BsdfSample, GRAZING, Glass, Lobe, Metal, Scatter, ScatterEvent, Transport};
use crate::{
    math::{Frame, Rgb},
    sampling::PdfSolidAngle,
};
use record::Record;
use stack::{End, Stack, no_smoother};
pub use surface::{Clear, Emission, Passage, SheenPlace, Surface};

/// The greatest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
/// The least α of coat and base: the least of which GGX is no delta, and a little more.
pub(super) const LEAST_ALPHA: f32 = 1.05e-3;

/// What the lobes need of all directions together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Averages {
    /// The cosine-weighted mean of what reaches the diffuse base.
    passed: f32,
    /// The mean of what [`spread`] gives back.
    spread: f32,
}

/// A layered surface: see the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layered(Record);

/// A lobe of the sum.
trait Part {
    /// f towards camera and light, 1/sr, which lie on sides that the part [joins](Self::JOINS).
    fn value(&self, s: &Stack, camera: &End, light: &End) -> Rgb;
    /// About its albedo from a direction.
    fn weight(&self, s: &Stack, from: &End) -> f32;
    /// A direction across from `from`, as if that lay above the surface; zero if there is none.
    fn sample(&self, s: &Stack, from: &End, u: [f32; 3]) -> Vec3;
    /// The density of [`Self::sample`], 1/sr.
    fn density(&self, s: &Stack, from: &End, to: &End) -> f32;
    /// Which directions it joins.
    const JOINS: Joins = Joins::SameSide;
    /// What a path class calls it.
    const EVENT: ScatterEvent = ScatterEvent::Glossy;
}

/// Which directions a lobe joins.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Joins {
    /// Those on one side of the surface.
    SameSide,
    /// Those on different sides.
    OtherSides,
    /// All.
    All,
}

impl Joins {
    /// Whether it joins directions that are on different sides, or are not.
    fn has(self, crosses: bool) -> bool {
        self == Self::All || crosses == (self == Self::OtherSides)
    }
}

/// An array of the expression for each lobe.
macro_rules! each {
    ($part:ident: $kind:ident => $of_it:expr) => {
        [
            each!(@ coat::Coating, $part, $kind, $of_it),
            each!(@ coat::BetweenFacets, $part, $kind, $of_it),
            each!(@ sheen::Sheen, $part, $kind, $of_it),
            each!(@ base::Reflection, $part, $kind, $of_it),
            each!(@ base::BetweenFacets, $part, $kind, $of_it),
            each!(@ diffuse::Reflection, $part, $kind, $of_it),
            each!(@ diffuse::Passage, $part, $kind, $of_it),
            each!(@ clear::Once, $part, $kind, $of_it),
            each!(@ clear::Several, $part, $kind, $of_it),
            each!(@ spread::Spread, $part, $kind, $of_it),
        ]
    };
    (@ $lobe:path, $part:ident, $kind:ident, $of_it:expr) => {{
        #[allow(dead_code)] // not every expression needs both
        type $kind = $lobe;
        #[allow(unused_variables)]
        let $part = &$lobe;
        $of_it
    }};
}

impl Layered {
    /// The surface with these parameters, as far as its record keeps them.
    pub fn new(surface: &Surface) -> Self {
        let surface = no_smoother(surface.settled());
        Self(Record::new(&surface, Averages::default())).averaged()
    }

    /// The same with the averages of what it keeps.
    fn averaged(self) -> Self {
        let kept = self.stack();
        Self(self.0.with_averages(spread::averages(&kept)))
    }

    /// The parameters.
    pub fn surface(&self) -> Surface {
        self.0.read().0
    }

    /// See [`super::OverEmission::emission_factor`].
    pub fn emission_factor(&self, n_s: Vec3, w: Vec3) -> f32 {
        coat::passes_emission(&self.surface(), Frame::around(n_s).to_local(w))
    }

    /// See [`super::Bsdf::mean_emission_factor`].
    pub fn mean_emission_factor(&self) -> f32 {
        coat::passes_emission_on_average(&self.surface())
    }

    /// Whether a volume lies behind the surface.
    pub fn bounds_volume(&self) -> bool {
        self.surface().bounds_volume()
    }

    /// The index of refraction behind the surface relative to that in front of it; none without a volume.
    pub fn volume_ior(&self) -> Option<f32> {
        match self.surface().passage {
            Passage::Volume(clear) => Some(clear.ior),
            _ => None,
        }
    }

    /// The same surface with the volume behind it of the index `ior` relative to what is in front of it. Its
    /// reflectance at normal incidence keeps its proportion to that of the index.
    #[must_use]
    pub fn with_volume_ior(self, ior: f32) -> Self {
        if self.volume_ior().is_none_or(|before| before == ior) {
            return self;
        }
        Self(self.0.with_ior(ior)).averaged()
    }

    /// See [`super::Bsdf::relative_ior`].
    pub fn relative_ior(&self, to_camera: Vec3, to_light: Vec3) -> f32 {
        match self.volume_ior() {
            Some(ior) => Glass { color: Rgb::ONE, ior }.relative_ior(to_camera.z, to_light.z),
            None => 1.0,
        }
    }

    fn stack(&self) -> Stack {
        let (surface, averages) = self.0.read();
        Stack::new(no_smoother(surface), averages)
    }

    /// See [`super::Bsdf::eval`].
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        if lobe != Lobe::Continuous || to_camera.z.abs() < GRAZING || to_light.z.abs() < GRAZING {
            return Scatter::ZERO;
        }
        let s = self.stack();
        let (camera, light) = (s.end(to_camera), s.end(to_light));
        let crosses = camera.above != light.above;
        let values =
            each!(part: Kind => if Kind::JOINS.has(crosses) { part.value(&s, &camera, &light) } else { Rgb::ZERO });
        let f = values.into_iter().fold(Rgb::ZERO, |sum, f| sum + f);
        if f == Rgb::ZERO {
            return Scatter::ZERO;
        }
        let density = |from: &End, to: &End| {
            let weights = each!(part: Kind => part.weight(&s, from));
            let densities =
                each!(part: Kind => if Kind::JOINS.has(crosses) { part.density(&s, from, to) } else { 0.0 });
            let total = weights.iter().sum::<f32>();
            let sum = weights.into_iter().zip(densities).map(|(w, p)| if w > 0.0 { w * p } else { 0.0 }).sum::<f32>();
            PdfSolidAngle(if total > 0.0 { sum / total } else { 0.0 })
        };
        Scatter { f, to_light: density(&camera, &light), to_camera: density(&light, &camera) }
    }

    /// See [`super::Bsdf::sample`].
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if known.z.abs() < GRAZING {
            return None;
        }
        let s = self.stack();
        let from = s.end(known);
        let weights = each!(part: Kind => part.weight(&s, &from));
        let joins = each!(part: Kind => Kind::JOINS);
        let mut left = u.z * weights.iter().sum::<f32>();
        let mut chosen = weights.iter().rposition(|w| *w > 0.0)?;
        for (i, weight) in weights.into_iter().enumerate().take(chosen) {
            if left < weight {
                chosen = i;
                break;
            }
            left -= weight;
        }
        // What the choice leaves of its number is one more.
        let u = [u.x, u.y, (left / weights[chosen]).min(BELOW_ONE)];
        let mut number = 0;
        let directions = each!(part: Kind => {
            number += 1;
            if number - 1 == chosen { part.sample(&s, &from, u) } else { Vec3::ZERO }
        });
        let up = directions[chosen];
        if up.z == 0.0 || !joins[chosen].has(up.z < 0.0) {
            return None;
        }
        let direction = up * 1.0_f32.copysign(known.z);
        let (to_camera, to_light) = transport.sides(known, direction);
        let scatter = self.eval(Lobe::Continuous, to_camera, to_light);
        BsdfSample::checked(direction, Lobe::Continuous, scatter, transport)
    }

    /// See [`super::Bsdf::has_continuous`].
    pub fn has_continuous(&self) -> bool {
        true
    }

    /// See [`super::Bsdf::delta_count`].
    pub fn delta_count(&self) -> u8 {
        0
    }

    /// See [`super::Bsdf::continuous_probability`].
    pub fn continuous_probability(&self, _known: Vec3) -> f32 {
        1.0
    }

    /// See [`super::Bsdf::continuous_transmits`].
    pub fn continuous_transmits(&self) -> bool {
        let surface = self.surface();
        let fraction = match surface.passage {
            Passage::None => 0.0,
            Passage::Leaf { fraction, .. } => fraction,
            Passage::Wall(clear) | Passage::Volume(clear) => clear.fraction,
        };
        fraction > 0.0 && surface.metallic < 1.0
    }

    /// See [`super::Bsdf::event`].
    pub fn continuous_event(&self, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        let s = self.stack();
        let (camera, light) = (s.end(to_camera), s.end(to_light));
        let crosses = camera.above != light.above;
        let mut sums = [0.0; 2];
        let values = each!(part: Kind =>
            if Kind::JOINS.has(crosses) { part.value(&s, &camera, &light).max_element() } else { 0.0 });
        let events = each!(part: Kind => Kind::EVENT);
        for (value, event) in values.into_iter().zip(events) {
            sums[usize::from(event == ScatterEvent::Diffuse)] += value;
        }
        if sums[1] > sums[0] { ScatterEvent::Diffuse } else { ScatterEvent::Glossy }
    }

    /// See [`super::Bsdf::color`].
    pub fn color(&self) -> Rgb {
        let s = self.surface();
        match s.passage {
            Passage::Leaf { fraction, color } => s.base_color.lerp(color, fraction * (1.0 - s.metallic)),
            _ => s.base_color,
        }
    }
}
