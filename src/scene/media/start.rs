//! What lights and lenses lie in: found once where it is the same all over them, else where a walk starts.

use glam::{Vec2, Vec3};

use super::{Boundary, Media, MediumId, Within};
use crate::scene::{
    Scene,
    geometry::{Bounds, Geometry},
    light::{Emission, Light, LightId, Lights},
    point::Place,
};

/// What a light or the lens lies in.
#[derive(Clone, Debug)]
pub(super) enum Start {
    Nothing,
    Known(Box<Within>),
    /// It differs from point to point, or might.
    Anywhere,
}

impl Media {
    /// Whether a place is seen at once to lie in empty space: outside of a box around all bodies.
    #[inline(always)]
    pub fn is_clear(&self, place: Vec3) -> bool {
        let Bounds { min, max } = self.bodies;
        (place.cmplt(min) | place.cmpgt(max)).any()
    }

    /// Whether the light `id` is known to lie in empty space, wherever a path leaves it.
    #[inline(always)]
    pub fn light_is_clear(&self, id: LightId) -> bool {
        matches!(self.lights[id.index()], Start::Nothing)
    }

    /// What is around the lens of `scene` at the point `lens`.
    #[inline(never)]
    pub fn around_lens(&self, scene: &Scene, lens: Vec3) -> Within {
        match self.lens(scene) {
            Start::Nothing => Within::NOTHING,
            Start::Known(within) => **within,
            Start::Anywhere => self.around(scene.geometry(), lens, None),
        }
    }

    /// Its medium alone.
    #[inline(always)]
    pub fn medium_at_lens(&self, scene: &Scene, lens: Vec3) -> MediumId {
        if self.is_clear(lens) { MediumId::EMPTY } else { self.around_lens(scene, lens).medium() }
    }

    /// Found when first asked for.
    fn lens(&self, scene: &Scene) -> &Start {
        let (geometry, bounds) = (scene.geometry(), scene.camera.lens_bounds());
        let start = || {
            let mut places = Places::new(self, geometry, vec![self.bodies]);
            let point = bounds.min == bounds.max;
            if point { places.at(bounds.min) } else { places.start(bounds, 0.5 * (bounds.min + bounds.max)) }
        };
        let (known, start) = self.camera.get_or_init(|| (bounds, start()));
        // Nothing is known of a camera that has been put in another's place.
        if *known == bounds { start } else { &Start::Anywhere }
    }

    /// What a light path that leaves a light is in.
    #[inline(never)]
    pub fn around_emission(&self, scene: &Scene, emission: &Emission) -> Within {
        let p = &emission.point;
        match p.light.map(|id| &self.lights[id.index()]) {
            None | Some(Start::Nothing) => Within::NOTHING,
            Some(Start::Known(within)) => **within,
            Some(Start::Anywhere) => {
                let w = emission.direction;
                let normal = p.normal * 1.0_f32.copysign(p.normal.dot(w));
                let side = (p.place == Place::Surface).then_some(normal);
                self.around(scene.geometry(), emission.origin.unwrap_or_else(|| p.ray_origin(w)), side)
            }
        }
    }
}

/// Finds what lights and lenses lie in.
pub(super) struct Places<'a> {
    media: &'a Media,
    geometry: &'a Geometry,
    /// Together they hold all bodies.
    boxes: Vec<Bounds>,
    /// Those of the bodies' primitives, once somebody asks.
    surfaces: Option<Vec<Bounds>>,
    tests: u64,
}

impl<'a> Places<'a> {
    /// Among bodies of which each is in one of the `boxes`.
    pub(super) fn new(media: &'a Media, geometry: &'a Geometry, boxes: Vec<Bounds>) -> Self {
        Self { media, geometry, boxes, surfaces: None, tests: 0 }
    }

    /// Of each light.
    pub(super) fn of_lights(&mut self, lights: &Lights) -> Vec<Start> {
        let start = |light: &Light| match light {
            Light::Area { primitive, .. } => {
                let middle = self.geometry.sample(*primitive, Vec2::splat(0.5)).position;
                self.start(self.geometry.bounds_of(*primitive), middle)
            }
            Light::Point { position, .. } => self.at(*position),
            Light::Spot(spot) => self.at(spot.position()),
            Light::Goniometric(lamp) => self.at(lamp.position()),
            Light::Directional { .. } | Light::Environment { .. } | Light::EnvironmentMap(_) => Start::Nothing,
        };
        lights.all().iter().map(start).collect()
    }

    /// Of one place alone.
    fn at(&self, place: Vec3) -> Start {
        let point = Bounds { min: place, max: place };
        if !self.boxes.iter().any(|b| b.meets(point)) {
            return Start::Nothing;
        }
        Start::Known(Box::new(self.media.around(self.geometry, place, None)))
    }

    /// Of everything in a box: the same everywhere unless a boundary may cut it.
    fn start(&mut self, all: Bounds, middle: Vec3) -> Start {
        const MOST_TESTS: u64 = 100_000_000;
        if !self.boxes.iter().any(|b| b.meets(all)) {
            return Start::Nothing;
        }
        let (media, geometry) = (self.media, self.geometry);
        let surfaces = self.surfaces.get_or_insert_with(|| {
            let body = |id| matches!(media.boundary(id), Boundary::Body(_));
            geometry.with_material(&body).map(|id| geometry.bounds_of(id)).collect()
        });
        self.tests += surfaces.len() as u64;
        // Boundaries that touch the box may coincide with what is in it.
        let margin = Vec3::splat(1e-5 * all.min.abs().max(all.max.abs()).max_element());
        let wide = Bounds { min: all.min - margin, max: all.max + margin };
        if self.tests > MOST_TESTS || surfaces.iter().any(|b| b.meets(wide)) {
            return Start::Anywhere;
        }
        self.at(middle)
    }
}
