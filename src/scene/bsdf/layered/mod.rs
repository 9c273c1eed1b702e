//! Surfaces in layers: from the outside in a coat, sheen, and a base of metal or of a dielectric over what is diffuse,
//! with a thin film, a grain, or light that passes to the other side.
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
//! So a white surface under white layers stays white. A coat with a normal of its own is to the surface's as N_s is to
//! N_g: its lobe carries |ω_light·N_coat|/|ω_light·N_s|, in every strategy alike, and may lose light at the horizon.
//! A smooth coat over a normal texture sees light as it travels: what [`Tilt`](crate::scene::tilt) bends for N_s is
//! bent back for it.
//!
//! There are no delta lobes: what is smoother than [`LEAST_ALPHA`] counts as that.

mod base;
mod brushed;
mod coat;
mod diffuse;
mod facets;
mod film;
mod record;
mod sheen;
mod spread;
#[cfg(test)]
mod tests;

use glam::{Vec2, Vec3};

use super::{
    BsdfSample, GRAZING, Lobe, Metal, Scatter, ScatterEvent, Transport,
    albedo::Split,
    layer::{Coat, Grazing, multiple},
};
use crate::{
    math::{Frame, Rgb},
    sampling::PdfSolidAngle,
};
use facets::Facets;
use film::Film;
use record::Record;

/// The least α of coat and base: the least of which GGX is no delta, and a little more.
pub(super) const LEAST_ALPHA: f32 = 1.05e-3;
/// The coat's reflectance at normal incidence, and its index (`KHR_materials_clearcoat`).
const COAT: Coat = Coat { f0: 0.04, f90: 1.0 };
const COAT_IOR: f32 = 1.5;

/// The parameters of a layered surface at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The metal's reflectance at normal incidence and the diffuse base's albedo.
    pub base_color: Rgb,
    /// Reflectance of the dielectric's interface at normal incidence.
    pub f0: Rgb,
    /// And at grazing incidence.
    pub f90: f32,
    /// The fraction of metal.
    pub metallic: f32,
    /// GGX's α of the base, across the grain.
    pub alpha: f32,
    /// How much of a coat there is, in [0, 1].
    pub coat: f32,
    /// GGX's α of the coat.
    pub coat_alpha: f32,
    /// x and y of the coat's unit normal in the shading frame.
    pub coat_normal: Vec2,
    /// Whether it is N_g or nearly so, over which light travels without being bent as it is over N_s.
    pub coat_is_flat: bool,
    /// The sheen's colour.
    pub sheen: Rgb,
    /// The sheen's α.
    pub sheen_alpha: f32,
    /// How much of a thin film there is, in [0, 1].
    pub film: f32,
    /// The film's index of refraction.
    pub film_ior: f32,
    /// The film's thickness, nanometres.
    pub film_thickness: f32,
    /// The strength of the grain, in [0, 1]: along it α is mix(α, 1, strength²).
    pub anisotropy: f32,
    /// The angle of the grain from the shading frame's first axis to its second.
    pub tangent: f32,
    /// The fraction of the diffuse base that lets light through.
    pub transmission: f32,
    /// The tint of that light.
    pub transmission_color: Rgb,
    /// The metal that the base is all of, if it is a measured one: base colour, F0, F90 and the fraction of metal then
    /// do not count.
    pub measured: Option<Metal>,
}

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

/// The surface with what does not depend on any direction.
struct Stack {
    surface: Surface,
    averages: Averages,
    facets: Facets,
    coat_facets: Facets,
    /// The axes of the coat where its normal is not the surface's.
    coat_axes: Option<coat::Axes>,
    /// Cosine and sine of the grain's angle.
    grain: [f32; 2],
    film: Option<Film>,
    /// Means of the splits of the base's light and of the coat's.
    average: Split,
    coat_average: Split,
    /// The base's mean reflectance, and what it reflects of the light between facets.
    mean: Rgb,
    multiple: Rgb,
    /// The base's hue: its mean reflectance with the brightest channel at 1.
    tint: Rgb,
    /// The dielectric's interface by its brightest channel, and what it reflects of the light between facets.
    interface: Coat,
    interface_multiple: f32,
    coat_multiple: f32,
    grazing: Grazing,
    coat_grazing: Grazing,
}

/// What is known of one direction.
struct End {
    /// The direction, or from behind its opposite: a surface is the same from both sides, and so is what leans on it.
    up: Vec3,
    /// The direction as it meets the coat, in the coat's frame, and the ratio of solid angles, dω_s/dω, there.
    over_coat: Vec3,
    coat_stretch: f32,
    /// The direction along the grain.
    along_grain: Vec3,
    /// The split of the coat's light.
    coat_split: Split,
    /// The albedo of a white sheen.
    sheen: f32,
    /// What the coat lets through, and what coat and sheen do.
    through_coat: f32,
    through: f32,
    /// The split of the base's light, and the cosine of its typical facet.
    split: Split,
    facet_cos: f32,
    /// The part of what reaches the base that reaches what is diffuse in it.
    passed: f32,
    /// What [`spread`] gives back.
    spread: f32,
}

/// A lobe of the sum.
trait Part {
    /// f towards both directions, 1/sr. They lie on the same side, unless the part [`passes`](Self::PASSES).
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb;
    /// About its albedo from a direction.
    fn weight(&self, s: &Stack, from: &End) -> f32;
    /// A direction above the surface across from `from`.
    fn sample(&self, s: &Stack, from: &End, u: [f32; 2]) -> Vec3;
    /// The density of [`Self::sample`], 1/sr.
    fn density(&self, s: &Stack, from: &End, to: &End) -> f32;
    /// Whether its two directions lie on different sides.
    const PASSES: bool = false;
    /// What a path class calls it.
    const EVENT: ScatterEvent = ScatterEvent::Glossy;
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

impl Surface {
    /// A white Lambertian base under no layer.
    pub const LAMBERT: Self = Self {
        base_color: Rgb::ONE,
        f0: Rgb::ZERO,
        f90: 0.0,
        metallic: 0.0,
        alpha: 1.0,
        coat: 0.0,
        coat_alpha: 0.0,
        coat_normal: Vec2::ZERO,
        coat_is_flat: true,
        sheen: Rgb::ZERO,
        sheen_alpha: 0.0,
        film: 0.0,
        film_ior: 1.3,
        film_thickness: 0.0,
        anisotropy: 0.0,
        tangent: 0.0,
        transmission: 0.0,
        transmission_color: Rgb::ONE,
        measured: None,
    };

    /// The same, with a measured metal's parameters in their places.
    fn settled(self) -> Self {
        let Some(metal) = self.measured else { return self };
        Self { base_color: metal.reflectance(1.0), f0: Rgb::ZERO, f90: 0.0, metallic: 1.0, ..self }
    }
}

impl Layered {
    /// The surface with these parameters, as far as its record keeps them.
    pub fn new(surface: &Surface) -> Self {
        let surface = Surface {
            alpha: surface.alpha.max(LEAST_ALPHA),
            coat_alpha: surface.coat_alpha.max(LEAST_ALPHA),
            sheen_alpha: surface.sheen_alpha.max(sheen::LEAST_ALPHA),
            ..surface.settled()
        };
        // What is averaged is what will be read.
        let kept = Self(Record::new(&surface, Averages::default())).stack();
        Self(Record::new(&kept.surface, spread::averages(&kept)))
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

    fn stack(&self) -> Stack {
        let (mut surface, averages) = self.0.read();
        surface.alpha = surface.alpha.max(LEAST_ALPHA);
        surface.coat_alpha = surface.coat_alpha.max(LEAST_ALPHA);
        surface.sheen_alpha = surface.sheen_alpha.max(sheen::LEAST_ALPHA);
        Stack::new(surface, averages)
    }

    /// See [`super::Bsdf::eval`].
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        if lobe != Lobe::Continuous || to_camera.z.abs() < GRAZING || to_light.z.abs() < GRAZING {
            return Scatter::ZERO;
        }
        let s = self.stack();
        let (camera, light) = (s.end(to_camera), s.end(to_light));
        let passes = to_camera.z * to_light.z < 0.0;
        let values =
            each!(part: Kind => if Kind::PASSES == passes { part.value(&s, &camera, &light) } else { Rgb::ZERO });
        let f = values.into_iter().fold(Rgb::ZERO, |sum, f| sum + f);
        if f == Rgb::ZERO {
            return Scatter::ZERO;
        }
        let density = |from: &End, to: &End| {
            let weights = each!(part: Kind => part.weight(&s, from));
            let densities = each!(part: Kind => if Kind::PASSES == passes { part.density(&s, from, to) } else { 0.0 });
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
        let passes = each!(part: Kind => Kind::PASSES);
        let mut left = u.z * weights.iter().sum::<f32>();
        let mut chosen = weights.iter().rposition(|w| *w > 0.0)?;
        for (i, weight) in weights.into_iter().enumerate().take(chosen) {
            if left < weight {
                chosen = i;
                break;
            }
            left -= weight;
        }
        let mut number = 0;
        let directions = each!(part: Kind => {
            number += 1;
            if number - 1 == chosen { part.sample(&s, &from, [u.x, u.y]) } else { Vec3::ZERO }
        });
        let up = directions[chosen];
        let side = known.z * if passes[chosen] { -1.0 } else { 1.0 };
        let direction = up * 1.0_f32.copysign(side);
        if up.z <= 0.0 {
            return None;
        }
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
        surface.transmission > 0.0 && surface.metallic < 1.0
    }

    /// See [`super::Bsdf::event`].
    pub fn continuous_event(&self, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        let passes = to_camera.z * to_light.z < 0.0;
        if passes {
            return ScatterEvent::Diffuse;
        }
        let s = self.stack();
        let (camera, light) = (s.end(to_camera), s.end(to_light));
        let mut sums = [0.0; 2];
        let values =
            each!(part: Kind => if Kind::PASSES { 0.0 } else { part.value(&s, &camera, &light).max_element() });
        let events = each!(part: Kind => Kind::EVENT);
        for (value, event) in values.into_iter().zip(events) {
            sums[usize::from(event == ScatterEvent::Diffuse)] += value;
        }
        if sums[1] > sums[0] { ScatterEvent::Diffuse } else { ScatterEvent::Glossy }
    }

    /// See [`super::Bsdf::color`].
    pub fn color(&self) -> Rgb {
        let s = self.surface();
        s.base_color.lerp(s.transmission_color, s.transmission * (1.0 - s.metallic))
    }
}

impl Stack {
    fn new(surface: Surface, averages: Averages) -> Self {
        let s = &surface;
        let along = s.alpha + (1.0 - s.alpha) * s.anisotropy * s.anisotropy;
        let facets = Facets { x: along, y: s.alpha };
        let average = if s.anisotropy > 0.0 { brushed::average(facets) } else { Split::average(s.alpha) };
        let coat_average = Split::average(s.coat_alpha);
        let outside = 1.0 + (COAT_IOR - 1.0) * s.coat;
        let film = (s.film > 0.0).then_some(Film { ior: s.film_ior, thickness: s.film_thickness, outside });
        let tilted = s.coat > 0.0 && s.coat_normal != Vec2::ZERO;
        let (sin, cos) = s.tangent.sin_cos();
        let mut stack = Self {
            averages,
            facets,
            coat_facets: Facets { x: s.coat_alpha, y: s.coat_alpha },
            coat_axes: tilted.then(|| coat::Axes::new(s.coat_normal, s.coat_is_flat)),
            grain: [cos, sin],
            film,
            average,
            coat_average,
            mean: Rgb::ZERO,
            multiple: Rgb::ZERO,
            tint: Rgb::ZERO,
            interface: Coat { f0: s.f0.max_element(), f90: s.f90 },
            interface_multiple: 0.0,
            coat_multiple: COAT.multiple(coat_average),
            grazing: Grazing::new((facets.x * facets.y).sqrt()),
            coat_grazing: Grazing::new(s.coat_alpha),
            surface,
        };
        stack.between_facets();
        stack
    }

    /// Fills in what the base reflects on average and after several facets.
    fn between_facets(&mut self) {
        let e1 = 1.0 - self.average.missing;
        let [dielectric, metal] = base::means(self);
        let several = |mean: Rgb| mean.map(|f| multiple(f, e1));
        let m = self.surface.metallic;
        self.mean = dielectric * (1.0 - m) + metal * m;
        self.tint = self.mean * (1.0 / self.mean.max_element().max(f32::MIN_POSITIVE));
        self.multiple = several(dielectric) * (1.0 - m) + several(metal) * m;
        self.interface_multiple = multiple(dielectric.max_element(), e1);
    }

    /// What coat and sheen let through towards a direction of this cosine, the coat lying flat.
    fn through(&self, cos: f32) -> f32 {
        (1.0 - coat::albedo(self, cos)) * (1.0 - sheen::taken(self, cos))
    }

    fn end(&self, w: Vec3) -> End {
        let s = &self.surface;
        let up = w * 1.0_f32.copysign(w.z);
        let (over_coat, coat_stretch) = self.coat_axes.as_ref().map_or((up, 1.0), |axes| axes.over(up));
        let [cos, sin] = self.grain;
        let along_grain =
            if s.anisotropy > 0.0 { Vec3::new(cos * up.x + sin * up.y, cos * up.y - sin * up.x, up.z) } else { up };
        // Beyond the coat's own horizon it lets through what it does at a low angle.
        let coat_split = Split::towards(over_coat.z.max(0.25 * up.z), s.coat_alpha);
        let coat = s.coat * (COAT.single(coat_split) + self.coat_multiple * coat_split.missing);
        let sheen = if s.sheen == Rgb::ZERO { 0.0 } else { sheen::albedo(s.sheen_alpha, up.z) };
        let through_coat = 1.0 - coat;
        let split =
            if s.anisotropy > 0.0 { brushed::split(self.facets, along_grain) } else { Split::towards(up.z, s.alpha) };
        let mut end = End {
            up,
            over_coat,
            coat_stretch,
            along_grain,
            coat_split,
            sheen,
            through_coat,
            through: through_coat * (1.0 - s.sheen.max_element() * sheen),
            split,
            facet_cos: base::typical_cosine(split),
            passed: 0.0,
            spread: 0.0,
        };
        end.passed = base::passed(self, &end);
        end.spread = base::albedo(self, &end) * spread::lacking(self, up.z);
        end
    }
}
