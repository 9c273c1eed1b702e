//! Media: what lies inside bodies, and which of them a place is in.
//!
//! The closed surfaces of a material that bounds a volume are one *body*. A place is in it if its winding number is positive: along a
//! ray from outside, entering through a front counts +1 and leaving through a back −1, so that an inner surface turned inwards is a
//! bubble. Where several bodies overlap, the one that encloses the smaller volume is there, and of equal ones that of the lower
//! material: a stone in resin, or water that reaches into its glass, however deep they are nested. In place of a body whose surface
//! is not closed stands a local rule; see [`Boundary`].

use std::sync::OnceLock;

use glam::Vec3;

use super::{
    Scene,
    bsdf::Bsdf,
    geometry::{Bounds, Form, Geometry, PrimitiveId, Ray, Shells},
    light::{Emission, Light, Lights},
    material::{Coverage, Material, MaterialId},
    point::{Place, Point},
};
use crate::math::Rgb;

/// A medium: empty space, or a body, in the order of their priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MediumId(u8);

impl MediumId {
    /// Empty space.
    pub const EMPTY: Self = Self(0);
}

/// The most bodies that walks keep track of.
pub const MOST_BODIES: usize = 64;

/// The winding numbers of all bodies at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Within {
    counts: [i8; MOST_BODIES],
    /// A bit for each body whose number is positive.
    inside: u64,
}

impl Within {
    /// Outside of everything.
    pub const NOTHING: Self = Self { counts: [0; MOST_BODIES], inside: 0 };

    /// The medium there: the body of the highest priority.
    #[inline]
    pub fn medium(&self) -> MediumId {
        MediumId(if self.inside == 0 { 0 } else { self.inside.trailing_zeros() as u8 + 1 })
    }

    fn add(&mut self, body: MediumId, change: i8) {
        let i = usize::from(body.0) - 1;
        self.set(i, self.counts[i].saturating_add(change));
    }

    fn set(&mut self, i: usize, count: i8) {
        self.counts[i] = count;
        self.inside = (self.inside & !(1 << i)) | (u64::from(count > 0) << i);
    }
}

/// What a material's surfaces bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// No volume, or the material has no surface.
    Nothing,
    /// A body.
    Body(MediumId),
    /// A volume that is no body, for the reason that [`Fault`] gives. A segment lies in it if one of its ends is this surface seen from
    /// behind; the end nearer the camera is asked first, and before the bodies. In front of the surface is the medium that is there,
    /// and behind it its own, whatever the bodies say.
    Local,
}

/// Why a volume is no body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The surface is not closed: so many edges are its border, or part a front from a back.
    Open(u64),
    /// The surface's front looks into what it encloses.
    InsideOut,
    /// Rays may pass the surface where its coverage is below 1.
    CutOut,
    /// There are more than [`MOST_BODIES`].
    OneTooMany,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Open(1) => write!(f, "its surface is not closed (1 edge has nothing on its other side)"),
            Self::Open(edges) => {
                write!(f, "its surface is not closed ({edges} edges have nothing on their other side)")
            }
            Self::InsideOut => write!(f, "its surface is inside out"),
            Self::CutOut => write!(f, "its alphaMode lets light pass its surface"),
            Self::OneTooMany => write!(f, "it comes after {MOST_BODIES} others, the most that are kept track of"),
        }
    }
}

/// The bodies of a scene before their order is known.
#[derive(Clone, Debug)]
struct Survey {
    shells: Shells,
    /// By shell.
    faults: Vec<Option<Fault>>,
}

impl Survey {
    fn new(geometry: &Geometry, materials: &[Material]) -> Self {
        let of = |id: MaterialId| &materials[id.0 as usize];
        let shells = geometry.shells(&|id| of(id).volume_ior().is_some());
        let mut bodies = 0;
        let faults = shells.all.iter().map(|shell| match (of(shell.material).coverage, shell.form) {
            (_, Form::Open { edges }) => Some(Fault::Open(edges)),
            (_, Form::InsideOut) => Some(Fault::InsideOut),
            (coverage, _) if coverage != Coverage::Opaque => Some(Fault::CutOut),
            (_, Form::Closed) => {
                bodies += 1;
                (bodies > MOST_BODIES).then_some(Fault::OneTooMany)
            }
        });
        Self { faults: faults.collect(), shells }
    }
}

/// The volumes of a geometry that are no bodies, with the reason.
pub fn faults(geometry: &Geometry, materials: &[Material]) -> Vec<(MaterialId, Fault)> {
    if materials.iter().all(|m| m.volume_ior().is_none()) {
        return Vec::new();
    }
    let Survey { shells, faults } = Survey::new(geometry, materials);
    shells.all.iter().zip(faults).filter_map(|(shell, fault)| Some((shell.material, fault?))).collect()
}

/// The media of a scene in which some surface bounds a volume.
#[derive(Clone, Debug)]
pub struct Media {
    /// Of each medium, that of empty space first.
    media: Vec<Medium>,
    boundaries: Vec<Boundary>,
    /// Of each material's volume.
    volumes: Vec<Medium>,
    /// Whether surfaces of bodies may coincide, so that a ray that leaves one passes another.
    meet: bool,
    absorb: bool,
    camera: OnceLock<(Bounds, Start)>,
    /// Of each light.
    lights: Vec<Start>,
}

/// What fills a volume.
#[derive(Clone, Copy, Debug)]
struct Medium {
    ior: f32,
    /// σ_a, 1/m.
    absorption: Rgb,
}

/// What a light or the lens lies in.
#[derive(Clone, Debug)]
enum Start {
    Nothing,
    Known(Box<Within>),
    /// It differs from point to point, or might.
    Anywhere,
}

impl Media {
    /// The media of a built geometry; `None` if no surface bounds a volume.
    pub(super) fn new(geometry: &Geometry, materials: &[Material], lights: &Lights) -> Option<Self> {
        if materials.iter().all(|m| m.volume_ior().is_none()) {
            return None;
        }
        let Survey { shells, faults } = Survey::new(geometry, materials);
        if shells.all.is_empty() {
            return None;
        }
        let mut boundaries = vec![Boundary::Nothing; materials.len()];
        for shell in &shells.all {
            boundaries[shell.material.0 as usize] = Boundary::Local;
        }
        let mut bodies: Vec<_> = shells.all.iter().zip(&faults).filter(|(_, fault)| fault.is_none()).collect();
        // A stable sort: of equal volumes the lower material comes first.
        bodies.sort_by(|(a, _), (b, _)| a.volume.total_cmp(&b.volume));
        let volume = |m: &Material| Medium { ior: m.volume_ior().unwrap_or(1.0), absorption: m.absorption };
        let volumes: Vec<_> = materials.iter().map(volume).collect();
        let mut media = vec![Medium { ior: 1.0, absorption: Rgb::ZERO }];
        for (shell, _) in &bodies {
            let id = shell.material.0 as usize;
            boundaries[id] = Boundary::Body(MediumId(media.len() as u8));
            media.push(volumes[id]);
        }
        let absorb = shells.all.iter().any(|shell| materials[shell.material.0 as usize].absorption != Rgb::ZERO);
        let mut result =
            Self { media, boundaries, volumes, meet: shells.meet, absorb, camera: OnceLock::new(), lights: Vec::new() };
        let boxes = bodies.iter().map(|(shell, _)| shell.bounds).collect();
        let mut places = Places { media: &result, geometry, boxes, surfaces: None, tests: 0 };
        let start = |light: &Light| match light {
            Light::Area { primitive, .. } => {
                let middle = geometry.sample(*primitive, glam::Vec2::splat(0.5)).position;
                places.start(geometry.bounds_of(*primitive), middle)
            }
            Light::Point { position, .. } => places.at(*position),
            Light::Spot(spot) => places.at(spot.position()),
            Light::Directional { .. } | Light::Environment { .. } | Light::EnvironmentMap(_) => Start::Nothing,
        };
        let lights = lights.all().iter().map(start).collect();
        result.lights = lights;
        Some(result)
    }

    /// What the surfaces of a material bound.
    #[inline]
    pub fn boundary(&self, material: MaterialId) -> Boundary {
        self.boundaries.get(material.0 as usize).copied().unwrap_or(Boundary::Nothing)
    }

    /// Whether any volume absorbs.
    #[inline]
    pub(super) fn absorb(&self) -> bool {
        self.absorb
    }

    /// σ_a of a medium, 1/m.
    #[inline]
    pub fn absorption(&self, medium: MediumId) -> Rgb {
        self.media[usize::from(medium.0)].absorption
    }

    /// η of a medium.
    pub fn ior(&self, medium: MediumId) -> f32 {
        self.media[usize::from(medium.0)].ior
    }

    /// The index of refraction of a material's own volume.
    pub fn ior_behind(&self, material: MaterialId) -> f32 {
        self.volumes[material.0 as usize].ior
    }

    /// σ_a of a material's own volume, 1/m: what [`Boundary::Local`] asks for.
    pub fn absorption_behind(&self, material: MaterialId) -> Rgb {
        self.volumes[material.0 as usize].absorption
    }

    /// Changes what is around when a ray passes `primitive`, and so leaves what lies behind it or enters it.
    #[inline]
    fn pass(&self, within: &mut Within, geometry: &Geometry, primitive: PrimitiveId, leaves: bool) {
        let mut one = |material, leaves| {
            if let Boundary::Body(body) = self.boundary(material) {
                within.add(body, if leaves { -1 } else { 1 });
            }
        };
        one(geometry.material(primitive), leaves);
        if self.meet {
            geometry.copies(primitive).for_each(|(material, turned)| one(material, leaves != turned));
        }
    }

    /// What is around `origin`, by everything that a ray from there to infinity passes.
    fn along(&self, geometry: &Geometry, origin: Vec3, direction: Vec3) -> Within {
        let ray = Ray { origin, direction, t_max: f32::INFINITY };
        let mut within = Within::NOTHING;
        let _ = geometry.crossings(&ray, [PrimitiveId::NONE; 2], |hit| {
            let bounds = |(id, _)| self.boundary(id) != Boundary::Nothing;
            let material = geometry.material(hit.primitive);
            if bounds((material, false)) || (self.meet && geometry.copies(hit.primitive).any(bounds)) {
                let leaves = geometry.surface(&ray, hit).normal.dot(direction) > 0.0;
                // From outside to here.
                self.pass(&mut within, geometry, hit.primitive, !leaves);
            }
            std::ops::ControlFlow::Continue(())
        });
        within
    }

    /// What is around a place, by the surfaces between it and infinity along oblique rays: the winding number from its definition. The
    /// place keeps a little distance from all surfaces; with a `side` the rays start to that side of it. Of three rays two have to agree,
    /// since one may meet an edge, where it passes two triangles.
    pub fn around(&self, geometry: &Geometry, place: Vec3, side: Option<Vec3>) -> Within {
        const RAYS: [Vec3; 3] = [
            Vec3::new(0.271_826_3, 0.927_183_1, 0.257_734_9),
            Vec3::new(-0.702_141_7, 0.480_931_2, 0.525_047_3),
            Vec3::new(0.419_735_2, 0.391_871_4, -0.818_692_8),
        ];
        let ray = |i: usize| match side {
            Some(n) if n.dot(RAYS[i]) < 0.0 => -RAYS[i],
            _ => RAYS[i],
        };
        let found = |i| self.along(geometry, place, ray(i));
        let (a, b) = (found(0), found(1));
        if a == b {
            return a;
        }
        if found(2) == b { b } else { a }
    }

    /// What is around the lens of `scene` at the point `lens`.
    pub fn around_lens(&self, scene: &Scene, lens: Vec3) -> Within {
        match self.lens(scene) {
            Start::Nothing => Within::NOTHING,
            Start::Known(within) => **within,
            Start::Anywhere => self.around(scene.geometry(), lens, None),
        }
    }

    /// Its medium alone.
    pub fn medium_at_lens(&self, scene: &Scene, lens: Vec3) -> MediumId {
        match self.lens(scene) {
            Start::Nothing => MediumId::EMPTY,
            Start::Known(within) => within.medium(),
            Start::Anywhere => self.around(scene.geometry(), lens, None).medium(),
        }
    }

    /// Found when first asked for.
    fn lens(&self, scene: &Scene) -> &Start {
        let (geometry, bounds) = (scene.geometry(), scene.camera.lens_bounds());
        let start = || {
            let body = |id| matches!(self.boundary(id), Boundary::Body(_));
            let all = geometry.with_material(&body).map(|id| geometry.bounds_of(id)).reduce(Bounds::union);
            let boxes = all.into_iter().collect();
            let mut places = Places { media: self, geometry, boxes, surfaces: None, tests: 0 };
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

    /// Puts the scattering between two media in place of that between a volume and empty space: η at a boundary is that of the two media
    /// beside it, `front` and `behind`. Where both are the same, the boundary lies in a body that comes before its own, and all light
    /// passes.
    pub fn settle(&self, bsdf: &mut Bsdf, material: MaterialId, [front, behind]: [MediumId; 2]) {
        let Bsdf::Dielectric(boundary) = bsdf else { return };
        let before = mistake!(self.ior(front), IndexAgainstVacuum => 1.0);
        let ratio = |behind: f32| if before > 0.0 { behind / before } else { behind };
        match self.boundary(material) {
            Boundary::Body(_) if front == behind => {
                boundary.color = Rgb::ONE;
                boundary.ior = 1.0;
                boundary.alpha = 0.0;
                boundary.transmission = 1.0;
            }
            Boundary::Body(_) => boundary.ior = ratio(self.ior(behind)),
            Boundary::Local => boundary.ior = ratio(self.ior_behind(material)),
            Boundary::Nothing => {}
        }
    }
}

/// Finds what lights and lenses lie in.
struct Places<'a> {
    media: &'a Media,
    geometry: &'a Geometry,
    /// Together they hold all bodies.
    boxes: Vec<Bounds>,
    /// Those of the bodies' primitives, once somebody asks.
    surfaces: Option<Vec<Bounds>>,
    tests: u64,
}

impl Places<'_> {
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

/// What a walk is in: on its way, and at its last vertex on the other side.
#[derive(Clone, Copy, Debug)]
pub struct Inside {
    within: Within,
    /// Whether there may be something else on the other side; else `beyond` says nothing.
    parts: bool,
    beyond: Within,
}

impl Inside {
    /// A walk that starts outside of everything.
    pub const NOTHING: Self = Self::starting(Within::NOTHING);

    /// A walk that starts there.
    pub const fn starting(within: Within) -> Self {
        Self { within, parts: false, beyond: within }
    }

    /// The medium that the walk is in.
    pub fn medium(&self) -> MediumId {
        self.within.medium()
    }

    /// The walk arrives at `point` in the unit direction `w`: finds the media on both sides, and settles how it scatters there. Returns the
    /// medium that the walk has come through.
    #[inline(never)]
    pub fn arrive(&mut self, scene: &Scene, media: &Media, point: &mut Point, w: Vec3) -> MediumId {
        let toward = point.normal.dot(w);
        let leaves = mistake!(toward > 0.0, AbsorptionOutside => toward < 0.0);
        let transmits = matches!(point.bsdf, Bsdf::Dielectric(_) | Bsdf::Thin(_));
        let boundary = media.boundary(point.material);
        if let Boundary::Body(body) = boundary
            && leaves
        {
            // Whoever sees a boundary from behind is in its body, also if a ray has slipped past an edge on its way in.
            let i = usize::from(body.0) - 1;
            self.within.set(i, self.within.counts[i].max(1));
        }
        self.parts = matches!(boundary, Boundary::Body(_)) || (transmits && media.meet);
        if self.parts {
            self.beyond = self.within;
            self.cross(scene, media, point, w, leaves);
        }
        let near = self.within.medium();
        let far = if self.parts { self.beyond.medium() } else { near };
        point.media = if toward > 0.0 { [far, near] } else { [near, far] };
        media.settle(&mut point.bsdf, point.material, point.media);
        near
    }

    /// Finds what lies beyond the surface at `point`, and beyond whatever coincides with it: a ray that goes on starts behind all of that.
    fn cross(&mut self, scene: &Scene, media: &Media, point: &Point, w: Vec3, leaves: bool) {
        let geometry = scene.geometry();
        media.pass(&mut self.beyond, geometry, point.primitive, mistake!(leaves, ExitKept => false));
        if !media.meet {
            return;
        }
        let ray = Ray::between(point.ray_origin(-w), point.ray_origin(w));
        let _ = geometry.crossings(&ray, [point.primitive, PrimitiveId::NONE], |hit| {
            let other = geometry.surface(&ray, hit);
            // A sphere is not flat, and is met again by a ray through it.
            if hit.primitive != point.primitive {
                media.pass(&mut self.beyond, geometry, hit.primitive, other.normal.dot(w) > 0.0);
            }
            std::ops::ControlFlow::Continue(())
        });
    }

    /// The walk goes on through the surface that it has reached.
    #[inline(never)]
    pub fn go_through(&mut self) {
        if self.parts {
            self.within = self.beyond;
        }
    }
}
