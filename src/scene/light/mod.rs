//! Lights: L_e, and every density with which a path can start on one or arrive at one.
//!
//! A light is an endpoint p_n with two kinds of densities. *Emission* densities (of the position, then of the
//! direction) belong to strategies that walk from the light, p_{s≥2} and p_{1,1}; the *next-event* density belongs to
//! p_{1,t≥2} and is conditional on p_{n-1}. Multiple importance sampling needs to know which is which.

mod choice;
mod emission;
mod environment;
mod goniometric;
mod next_event;
mod solid_angle;
#[cfg(test)]
mod solid_angle_tests;
mod source;
mod spot;
mod tree;

#[cfg(test)]
mod coat_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tree_tests;

use std::{collections::HashMap, f32::consts::FRAC_1_PI};

use glam::{Vec2, Vec3};

use self::{
    choice::Family,
    emission::Detail,
    next_event::NextEvent,
    source::{at_infinity, emitter, without_extent},
};
pub use self::{
    choice::LightChoice,
    emission::EmissionMap,
    environment::{EnvironmentMap, NotARadiance},
    goniometric::{Goniometric, Profile},
    source::Light,
    spot::Spot,
};
pub(crate) use self::{
    solid_angle::{Outlook, density},
    tree::Receiver,
};
pub use super::id::LightId;
use super::{
    bsdf::OverEmission,
    geometry::{Geometry, PrimitiveId},
    material::{EmissionSides, Material, MaterialId},
    point::{Place, Point},
};
use crate::{
    lanes::{Float, Lanes, Mask, Select, Vector},
    math::{Frame, Rgb, luminance},
    sampling::{Choice, Discrete, PdfArea, PdfSolidAngle, Remainder, Square, warp},
};

/// More than this in any channel is no radiance, intensity or irradiance of a light that is read: integrals of it would
/// come near the end of what f32 can represent.
pub const BRIGHTEST: f32 = 1e30;

/// Where and how a light subpath starts.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// p_n.
    pub point: Point,
    /// The density of p_n, light choice included.
    pub pdf_position: PdfArea,
    /// The unit direction in which it leaves p_n.
    pub direction: Vec3,
    /// The density of that direction given p_n; see [`PdfSolidAngle`] for infinite lights.
    pub pdf_direction: PdfSolidAngle,
    /// Where the first ray starts if that is not p_n: for infinite lights, on a disk outside the scene.
    pub origin: Option<Vec3>,
}

impl Emission {
    /// From nowhere, and with no density.
    pub(crate) fn nowhere() -> Self {
        Self {
            point: Point::nowhere(Vec3::ZERO),
            pdf_position: PdfArea::ZERO,
            direction: Vec3::Z,
            pdf_direction: PdfSolidAngle::ZERO,
            origin: None,
        }
    }
}

/// All lights of a scene, with the choice among them.
#[derive(Clone, Debug)]
pub struct Lights {
    lights: Vec<Light>,
    /// Where a walk starts: by kind and emitted power.
    choice: Discrete,
    next_event: NextEvent,
    environment: Option<LightId>,
    /// [`Self::pdf_position`] of every light that has the same everywhere; NaN of any other.
    even: Vec<f32>,
    /// Which sides of all lights emit, if all have an area and the same sides do.
    sides: Option<EmissionSides>,
    /// A sphere that contains the scene, from whose silhouette infinite lights shine. Its radius is positive.
    center: Vec3,
    radius: f32,
}

impl Lights {
    /// Collects the emissive primitives of `geometry` and adds `others`.
    ///
    /// # Panics
    /// If `others` holds more than one environment.
    pub fn new(geometry: &Geometry, materials: &[Material], others: &[Light]) -> Self {
        let emits = |id: MaterialId| materials[id.0 as usize].emits();
        let textured =
            |id: MaterialId| emits(id) && materials[id.0 as usize].maps.as_ref().is_some_and(|m| m.vary_emission());
        let detail = Detail::among(geometry.with_material(&textured).count());
        let mut maps = HashMap::new();
        let emitters = geometry
            .with_material(&emits)
            .filter_map(|primitive| emitter(geometry, materials, primitive, detail, &mut maps));
        let lights: Vec<_> = emitters.chain(others.iter().cloned()).collect();
        let mut environments =
            (0..).map(LightId::new).zip(&lights).filter(|(_, l)| l.family() == Family::Environment).map(|(i, _)| i);
        let environment = environments.next();
        assert!(environments.next().is_none(), "a scene has at most one environment");
        let (center, radius) = match geometry.bounds() {
            Some(b) => (0.5 * (b.min + b.max), (0.5 * (b.max - b.min).length() * 1.001).max(f32::MIN_POSITIVE)),
            None => (Vec3::ZERO, 1.0),
        };
        let choice = Discrete::default();
        let (even, sides) = (Vec::new(), EmissionSides::of_all(&lights));
        let mut result =
            Self { lights, choice, next_event: NextEvent::Power, environment, even, sides, center, radius };
        let powers: Vec<_> = result.lights.iter().map(|l| (l.family(), result.power(l))).collect();
        result.choice = choice::by_kind_and_power(&powers);
        let even = |(i, light): (usize, &Light)| match light {
            Light::Area { area, map: None, .. } if !result.is_empty() => result.choice.probability(i) / area,
            _ => f32::NAN,
        };
        result.even = result.lights.iter().enumerate().map(even).collect();
        result
    }

    /// The sum of the emitted powers' luminances, W or lumen: see [`Light`]; of an infinite light, what falls on the
    /// scene's disk.
    pub fn power_of_all(&self) -> f64 {
        self.lights.iter().map(|light| self.power(light)).sum()
    }

    /// The radiance that a sphere around the scene would have if it emitted all that the lights do: Φ/(4π² R²). A scale
    /// of what an image shows, and all around an environment exactly its radiance; zero without lights.
    pub fn typical_radiance(&self) -> f64 {
        self.power_of_all() / (std::f64::consts::TAU * f64::from(self.radius)).powi(2)
    }

    /// The luminance of the power that the light emits, W or lumen.
    pub fn power_of(&self, id: LightId) -> f64 {
        self.power(self.get(id))
    }

    /// The lights, in the order of their ids.
    pub fn all(&self) -> &[Light] {
        &self.lights
    }

    /// Whether no light emits anything.
    pub fn is_empty(&self) -> bool {
        self.choice.is_empty()
    }

    /// The light `id`.
    #[inline(always)]
    pub fn get(&self, id: LightId) -> &Light {
        &self.lights[id.index()]
    }

    /// The id of every area light with its primitive.
    pub fn area_lights(&self) -> impl Iterator<Item = (LightId, PrimitiveId)> {
        (0..).map(LightId::new).zip(&self.lights).filter_map(|(id, l)| match l {
            Light::Area { primitive, .. } => Some((id, *primitive)),
            _ => None,
        })
    }

    /// The luminance of the emitted power Φ, W or lumen. An infinite light counts what falls on the scene's disk, from
    /// every direction in which it shines. Zero for a primitive so large that f32 has no number for its area, and so no
    /// density.
    fn power(&self, light: &Light) -> f64 {
        use std::f64::consts::PI;
        // In f64, since products of what f32 can represent leave it.
        let disk = PI * f64::from(self.radius).powi(2);
        let of = |rgb: Rgb| f64::from(luminance(rgb));
        match light {
            Light::Area { area, .. } if !area.is_finite() => 0.0,
            Light::Area { radiance, sides, area, .. } => {
                of(*radiance) * PI * f64::from(*area) * f64::from(sides.count())
            }
            Light::Point { intensity, .. } => of(*intensity) * 4.0 * PI,
            Light::Spot(spot) => of(spot.intensity()) * f64::from(spot.solid_angle()),
            Light::Goniometric(lamp) => of(lamp.power()),
            Light::Directional { irradiance, .. } => of(*irradiance) * disk,
            Light::Environment { radiance } => of(*radiance) * 4.0 * PI * disk,
            Light::EnvironmentMap(map) => f64::from(map.integral()) * disk,
        }
    }

    /// A radiance that the brightest parts of an image are likely to be near: the largest L_e, and for lights without
    /// one what a white surface reflects (of a point light, at a hundredth of the scene's radius). Zero without lights.
    pub fn peak_radiance(&self) -> f32 {
        let near = 0.01 * self.radius;
        self.lights
            .iter()
            .map(|l| match l {
                Light::Area { map: Some(map), .. } => map.peak(),
                Light::Area { radiance, .. } | Light::Environment { radiance } => radiance.max_element(),
                Light::Point { intensity, .. } => intensity.max_element() * FRAC_1_PI / (near * near),
                Light::Spot(spot) => spot.intensity().max_element() * FRAC_1_PI / (near * near),
                Light::Goniometric(lamp) => lamp.peak().max_element() * FRAC_1_PI / (near * near),
                Light::EnvironmentMap(map) => map.brightest(),
                Light::Directional { irradiance, .. } => irradiance.max_element() * FRAC_1_PI,
            })
            .fold(0.0, f32::max)
    }

    /// L_e/α at `point` in the unit direction `w` away from it: radiance of an area light or environment,
    /// intensity of a point light or a spot, irradiance of a sun. Zero where nothing emits. A coat darkens what is
    /// emitted below it.
    #[inline(always)]
    pub fn le<L: Lanes, B: OverEmission<L>>(&self, point: &Point<L, B>, w: L::V) -> Rgb<L::V> {
        let lanes = point.alpha.lanes();
        if point.place != Place::Surface {
            let (position, w) = (point.position.all(), w.all());
            let of = |k, id| self.get(id).le_off_surfaces(position[k], w[k]).to_array();
            return Rgb::of(lanes.vectors(|k| L::lane(&point.light, k).map_or([0.0; 3], |id| of(k, id))));
        }
        let (front, zero) = (point.normal.dot(w), lanes.splat(0.0));
        let mut shines = zero.lt(front) & point.lies_on_light();
        let behind = front.lt(zero) & point.lies_on_light();
        if behind.any() {
            let both = |id| matches!(self.get(id), Light::Area { sides: EmissionSides::Both, .. });
            shines = shines | (behind & lanes.condition(|k| L::lane(&point.light, k).is_some_and(both)));
        }
        let black = Rgb::of(L::V::new(zero, zero, zero));
        if shines.any()
            && let Some(factor) = point.bsdf.emission_factor(point.shading_normal, w)
        {
            return Rgb::select(shines, point.emission.times(factor), black);
        }
        Rgb::select(shines, point.emission, black)
    }

    /// Whether a ray can meet the light at all; points, spots and suns are met with probability zero, and never seen.
    #[inline(always)]
    pub fn is_hittable(&self, id: LightId) -> bool {
        self.get(id).has_extent()
    }

    /// Whether a ray that leaves the scene reaches a light.
    pub fn has_environment(&self) -> bool {
        self.environment.is_some()
    }

    /// The point at infinity that a ray in the unit direction `w` reaches, if there is an environment.
    #[inline(always)]
    pub fn environment_at(&self, w: Vec3) -> Option<Point> {
        self.environment.map(|id| at_infinity(w, id))
    }

    /// Samples p_n for a next-event estimate at `from`, with its density [`Lights::pdf_next_event`]: the `nth` of
    /// [`Lights::next_event_samples`]. `None` if there is no light, or none where the numbers lead. `choice`
    /// leads to the light, and what it has left to the place on it where that is chosen as well.
    #[inline(always)]
    pub fn sample_next_event(
        &self,
        geometry: &Geometry,
        materials: &[Material],
        from: Receiver,
        u: Square,
        choice: Choice,
        nth: u32,
    ) -> Option<(Point, PdfArea)> {
        let (id, probability, rest) = match &self.next_event {
            NextEvent::Power => {
                self.choose(choice).map(|(id, rest)| (id, self.choice.probability(id.index()), rest))?
            }
            _ => self.choose_at(&from, choice, nth)?,
        };
        let (point, by_solid_angle) = self.sample_from((geometry, materials), id, from.position(), (u, rest));
        let by_area = self.pdf_on(id, point.barycentric, point.position.to_array(), probability);
        let pdf = PdfArea(by_area * by_solid_angle);
        (pdf > PdfArea::ZERO).then_some((point, pdf))
    }

    /// Where the choices of each light begin, if next-event estimation chooses by power; `None` if not, or without
    /// lights.
    pub(crate) fn begins_by_power(&self) -> Option<&[u64]> {
        (matches!(self.next_event, NextEvent::Power) && !self.is_empty()).then(|| self.choice.begins())
    }

    /// The probability of a light by kind and power.
    pub(crate) fn probability_by_power(&self, id: LightId) -> f32 {
        self.choice.probability(id.index())
    }

    /// The primitive, the area and the sides of a light whose points are chosen evenly from its area; `None` of any
    /// other.
    #[inline(always)]
    pub(crate) fn even_area(&self, id: LightId) -> Option<(PrimitiveId, f32, EmissionSides)> {
        match self.get(id) {
            Light::Area { primitive, area, map: None, sides, .. } => Some((*primitive, *area, *sides)),
            _ => None,
        }
    }

    /// The density of [`Lights::sample_next_event`] for the light point `point`, given p_{n-1} = `from`. With a sample
    /// of each light it is the sum over them, and integrates to their number.
    #[inline(always)]
    pub fn pdf_next_event<L: Lanes, B>(
        &self,
        geometry: &Geometry,
        point: &Point<L, B>,
        from: &Point<L, B>,
    ) -> PdfArea<L::F> {
        PdfArea(self.pdf_chosen(point, from).0 * self.densities_from(geometry, point, from))
    }

    /// The density of [`Lights::pdf_next_event`] if places were chosen as emission chooses them.
    #[inline(always)]
    pub(crate) fn pdf_chosen<L: Lanes, B>(&self, point: &Point<L, B>, from: &Point<L, B>) -> PdfArea<L::F> {
        if matches!(self.next_event, NextEvent::Power) {
            return self.pdf_position(point);
        }
        let (position, receivers) = (point.position.all(), Receiver::all(from));
        PdfArea(point.alpha.lanes().numbers(|k| match L::lane(&point.light, k) {
            Some(id) => {
                let choice = self.probability_at(id, &receivers(k));
                self.pdf_on(id, L::lane(&point.barycentric, k), position[k], choice)
            }
            None => 0.0,
        }))
    }

    /// The density with which emission starts at `point`, light choice included.
    #[inline(always)]
    pub fn pdf_position<L: Lanes, B>(&self, point: &Point<L, B>) -> PdfArea<L::F> {
        let lanes = point.alpha.lanes();
        let even = lanes.numbers(|k| L::lane(&point.light, k).map_or(0.0, |id| self.even[id.index()]));
        if !(!even.eq(even)).any() {
            return PdfArea(even);
        }
        let (even, position) = (even.all(), point.position.all());
        PdfArea(lanes.numbers(|k| match L::lane(&point.light, k) {
            Some(id) if even[k].is_nan() => {
                self.pdf_on(id, L::lane(&point.barycentric, k), position[k], self.choice.probability(id.index()))
            }
            _ => even[k],
        }))
    }

    /// The density of a point on the light `id`, which is chosen with the probability `choice`.
    #[inline(always)]
    fn pdf_on(&self, id: LightId, barycentric: Vec2, position: [f32; 3], choice: f32) -> f32 {
        match self.get(id) {
            Light::Area { area, map: None, .. } => choice / area,
            Light::Area { area, map: Some(map), .. } => choice / area * map.density(barycentric),
            Light::Point { .. } | Light::Spot(_) | Light::Goniometric(_) | Light::Directional { .. } => choice,
            Light::Environment { .. } => choice * (0.25 * FRAC_1_PI),
            Light::EnvironmentMap(map) => choice * map.pdf(position.into()).0,
        }
    }

    /// The density with which emission from `point` takes the unit direction `w`, given `point`.
    #[inline(always)]
    pub fn pdf_direction<L: Lanes, B>(&self, point: &Point<L, B>, w: L::V) -> PdfSolidAngle<L::F> {
        let (lanes, cos) = (point.alpha.lanes(), point.normal.dot(w));
        if let Some(sides) = self.sides {
            // No lane has to ask its light.
            let both = if sides == EmissionSides::Both { u32::MAX } else { 0 };
            let pdf = pdf_of_emitted(lanes.mask(both), cos);
            return PdfSolidAngle(point.lies_on_light().select(pdf, lanes.splat(0.0)));
        }
        let (cos, w) = (cos.all(), w.all());
        PdfSolidAngle(lanes.numbers(|k| match L::lane(&point.light, k) {
            Some(id) => self.pdf_direction_of(id, cos[k], w[k]),
            None => 0.0,
        }))
    }

    /// The same of a light; `cos` is the cosine to its normal, if it has one.
    #[inline(always)]
    fn pdf_direction_of(&self, id: LightId, cos: f32, w: [f32; 3]) -> f32 {
        match self.get(id) {
            Light::Area { sides, .. } => pdf_of_emitted(*sides == EmissionSides::Both, cos),
            Light::Point { .. } => 0.25 * FRAC_1_PI,
            Light::Spot(spot) => spot.pdf(w.into()).0,
            Light::Goniometric(lamp) => lamp.pdf(w.into()).0,
            Light::Directional { .. } | Light::Environment { .. } | Light::EnvironmentMap(_) => {
                FRAC_1_PI / (self.radius * self.radius)
            }
        }
    }

    /// Samples the start of a light subpath: the light, the position and then the direction.
    /// `None` if there is no light, or none where the numbers lead.
    #[inline(always)]
    pub fn sample_emission(
        &self,
        geometry: &Geometry,
        materials: &[Material],
        choice: Choice,
        position: Square,
        direction: Vec2,
    ) -> Option<Emission> {
        let (id, rest) = self.choose(choice)?;
        let point = self.sample_position(geometry, materials, id, position, rest);
        let pdf_position = self.pdf_position(&point);
        let emits = pdf_position > PdfArea::ZERO;
        if !emits {
            return None; // rounding brought it just outside of what emits
        }
        let (direction, origin) = match self.get(id) {
            Light::Area { sides, .. } => {
                let both = *sides == EmissionSides::Both;
                (emitted_direction(point.normal, both, direction.to_array()), None)
            }
            Light::Point { .. } => (warp::sphere(direction), None),
            Light::Spot(spot) => (spot.sample(direction), None),
            // Nothing else needs the numbers of the place.
            Light::Goniometric(lamp) => (lamp.sample(position.refined(rest.rest())), None),
            Light::Directional { .. } | Light::Environment { .. } | Light::EnvironmentMap(_) => {
                let offset =
                    Frame::around(point.position).to_world(Vec2::from(warp::disk(direction.to_array())).extend(1.0));
                (-point.position, Some(self.center + self.radius * offset))
            }
        };
        let pdf_direction = self.pdf_direction(&point, direction);
        Some(Emission { point, pdf_position, direction, pdf_direction, origin })
    }

    /// A light by kind and power, and where in its share of the integers the choice lies.
    #[inline(always)]
    fn choose(&self, choice: Choice) -> Option<(LightId, Remainder)> {
        if self.is_empty() {
            return None;
        }
        let (i, rest) = self.choice.sample(choice);
        Some((LightId::new(i as u32), rest))
    }

    /// A point of the light `id`; `rest` is what its choice has left.
    #[inline(always)]
    fn sample_position(
        &self,
        geometry: &Geometry,
        materials: &[Material],
        id: LightId,
        u: Square,
        rest: Remainder,
    ) -> Point {
        match self.get(id) {
            Light::Area { primitive, map, .. } => {
                let textured = map.as_ref().and_then(|map| geometry.surface_at(*primitive, map.sample(u, rest)));
                // Not by `unwrap_or_else`, which is inlined or not as the size of what is around it goes.
                let surface = match textured {
                    Some(surface) => surface,
                    None => geometry.sample(*primitive, u.place()),
                };
                Point::on_surface(geometry, materials, *primitive, &surface, Some(id))
            }
            Light::Point { position, .. } => without_extent(*position, id),
            Light::Spot(spot) => without_extent(spot.position(), id),
            Light::Goniometric(lamp) => without_extent(lamp.position(), id),
            Light::Directional { towards, .. } => at_infinity(*towards, id),
            Light::Environment { .. } => at_infinity(warp::sphere(u.place()), id),
            Light::EnvironmentMap(map) => at_infinity(map.sample(u.refined(rest.rest())), id),
        }
    }
}

/// The unit direction in which a surface with the unit normal `normal` emits by Lambert's law, from its front or, where
/// `both` holds, from either side.
#[inline(always)]
pub(crate) fn emitted_direction<V: Vector>(normal: V, both: <V::Lanes as Lanes>::M, [x, y]: [V::F; 2]) -> V {
    let lanes = x.lanes();
    let one = lanes.splat(1.0);
    let behind = both & !x.lt(lanes.splat(0.5));
    let (side, twice) = (behind.select(-one, one), x * 2.0);
    let x = both.select(behind.select(twice - one, twice), x);
    Frame::around(normal * side).to_world(warp::cosine_hemisphere([x, y]))
}

/// The density of that direction, by its cosine to the normal.
#[inline(always)]
pub(crate) fn pdf_of_emitted<F: Float>(both: <F::Lanes as Lanes>::M, cos: F) -> F {
    let zero = cos.lanes().splat(0.0);
    both.select(cos.abs() * FRAC_1_PI * 0.5, cos.max(zero) * FRAC_1_PI)
}
