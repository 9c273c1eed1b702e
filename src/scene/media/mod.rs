//! Media: what lies inside bodies, and which of them a place is in.
//!
//! The closed surfaces of a material that bounds a volume are one *body*. A place is in it if its winding number is
//! positive: along a ray from outside, entering through a front counts +1 and leaving through a back −1, so that an
//! inner surface turned inwards is a bubble. Where several bodies overlap, the one that encloses the smaller volume is
//! there, and of equal ones that of the lower material: a stone in resin, or water that reaches into its glass, however
//! deep they are nested. In place of a body whose surface is not closed stands a local rule; see [`Boundary`].

mod start;
mod walk;

use std::sync::OnceLock;

use glam::Vec3;

use self::start::{Places, Start};
pub use self::walk::Inside;
pub use super::id::MediumId;
use super::{
    bsdf::{Bsdf, Dielectric},
    geometry::{Bounds, Form, Geometry, PrimitiveId, Ray, Shells},
    light::Lights,
    material::{AlphaMode, Material, MaterialId},
    wavelength::{Index, Wavelength},
};
use crate::math::Rgb;

/// The most bodies that walks keep track of.
pub const MOST_BODIES: usize = 64;

/// The winding numbers of all bodies at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Within {
    counts: [i8; MOST_BODIES],
    /// A bit for each body whose number is positive.
    inside: u64,
    /// A bit for each body whose number is not 0.
    counted: u64,
}

impl Within {
    /// Outside of everything.
    pub const NOTHING: Self = Self { counts: [0; MOST_BODIES], inside: 0, counted: 0 };

    /// The medium there: the body of the highest priority.
    #[inline]
    pub fn medium(&self) -> MediumId {
        MediumId::first(self.inside)
    }

    /// Whether every number is 0.
    #[inline]
    fn is_nothing(&self) -> bool {
        self.counted == 0
    }

    #[inline]
    fn add(&mut self, body: MediumId, change: i8) {
        self.set(body, self.after(body, change));
    }

    /// The number of `body` after a change. It wraps: trees show the surfaces on a ray in any order, and so perhaps all
    /// ways into many small parts of a body before any way out.
    #[inline]
    fn after(&self, body: MediumId, change: i8) -> i8 {
        self.counts[body.bit()].wrapping_add(change)
    }

    /// The medium that is there after a change.
    #[inline]
    fn medium_after(&self, body: MediumId, change: i8) -> MediumId {
        MediumId::first(body.with(self.inside, self.after(body, change) > 0))
    }

    #[inline]
    fn set(&mut self, body: MediumId, count: i8) {
        self.counts[body.bit()] = count;
        self.inside = body.with(self.inside, count > 0);
        self.counted = body.with(self.counted, count != 0);
    }
}

/// What a material's surfaces bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// No volume, or the material has no surface.
    Nothing,
    /// A body.
    Body(MediumId),
    /// A volume that is no body, for the reason that [`Fault`] gives. A segment lies in it if one of its ends is this
    /// surface seen from behind; the end nearer the camera is asked first, and before the bodies. In front of the
    /// surface is the medium that is there, and behind it its own, whatever the bodies say.
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
        let faults = shells.all.iter().map(|shell| match (of(shell.material).alpha_mode, shell.form) {
            (_, Form::Open { edges }) => Some(Fault::Open(edges)),
            (_, Form::InsideOut) => Some(Fault::InsideOut),
            (mode, _) if mode != AlphaMode::Opaque => Some(Fault::CutOut),
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

/// The box without a place in it.
const NOWHERE: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

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
    /// Whether one that is no body does.
    absorb_locally: bool,
    /// Whether the index of any depends on the wavelength.
    disperse: bool,
    /// A box around all bodies.
    bodies: Bounds,
    camera: OnceLock<(Bounds, Start)>,
    /// Of each light.
    lights: Vec<Start>,
}

/// What fills a volume.
#[derive(Clone, Copy, Debug)]
struct Medium {
    index: Index,
    /// σ_a, 1/m.
    absorption: Rgb,
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
        let index = |m: &Material| m.volume_ior().map_or(Index::EMPTY, |ior| Index::new(ior, m.dispersion));
        let volume = |m: &Material| Medium { index: index(m), absorption: m.absorption };
        let volumes: Vec<_> = materials.iter().map(volume).collect();
        let mut media = vec![Medium { index: Index::EMPTY, absorption: Rgb::ZERO }];
        for (shell, _) in &bodies {
            let id = shell.material.0 as usize;
            boundaries[id] = Boundary::Body(MediumId(media.len() as u8));
            media.push(volumes[id]);
        }
        let absorbs = |material: MaterialId| volumes[material.0 as usize].absorption != Rgb::ZERO;
        let absorb = shells.all.iter().any(|shell| absorbs(shell.material));
        let absorb_locally =
            shells.all.iter().zip(&faults).any(|(shell, fault)| fault.is_some() && absorbs(shell.material));
        let disperse = shells.all.iter().any(|shell| volumes[shell.material.0 as usize].index.disperses());
        let boxes: Vec<_> = bodies.iter().map(|(shell, _)| shell.bounds).collect();
        let mut result = Self {
            media,
            boundaries,
            volumes,
            meet: shells.meet,
            absorb,
            absorb_locally,
            disperse,
            bodies: boxes.iter().copied().reduce(Bounds::union).unwrap_or(NOWHERE),
            camera: OnceLock::new(),
            lights: Vec::new(),
        };
        result.lights = Places::new(&result, geometry, boxes).of_lights(lights);
        Some(result)
    }

    /// What the surfaces of a material bound.
    #[inline]
    pub fn boundary(&self, material: MaterialId) -> Boundary {
        self.boundaries.get(material.0 as usize).copied().unwrap_or(Boundary::Nothing)
    }

    /// Whether a walk through empty space that comes to a surface of this material finds nothing to keep track of:
    /// neither a boundary, nor perhaps another surface at the same place, nor a volume without a body that may have
    /// absorbed something.
    #[inline(always)]
    fn ignore(&self, material: MaterialId) -> bool {
        !(self.meet || self.absorb_locally) && self.boundary(material) == Boundary::Nothing
    }

    /// Whether surfaces of bodies may coincide with others.
    pub fn meet(&self) -> bool {
        self.meet
    }

    /// Whether any volume absorbs.
    #[inline(always)]
    pub fn absorb(&self) -> bool {
        self.absorb
    }

    /// Whether the index of any volume depends on the wavelength.
    #[inline(always)]
    pub fn disperse(&self) -> bool {
        self.disperse
    }

    /// σ_a of a medium, 1/m.
    #[inline]
    pub fn absorption(&self, medium: MediumId) -> Rgb {
        self.media[usize::from(medium.0)].absorption
    }

    /// The index of refraction of a medium.
    pub fn index(&self, medium: MediumId) -> Index {
        self.media[usize::from(medium.0)].index
    }

    /// That of a material's own volume.
    pub fn index_behind(&self, material: MaterialId) -> Index {
        self.volumes[material.0 as usize].index
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

    /// What is around a place, by the surfaces between it and infinity along oblique rays: the winding number from its
    /// definition. The place keeps a little distance from all surfaces; with a `side` the rays start to that side of
    /// it. Of three rays two have to agree, since one may meet an edge, where it passes two triangles.
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

    /// Puts the scattering between two media in place of that between a volume and empty space: η at a boundary is that
    /// of the two media beside it, `front` and `behind`. Where both are the same, the boundary lies in a body that
    /// comes before its own, and all light passes. Indices are those of the wavelength, if there is one.
    pub fn settle(
        &self,
        bsdf: &mut Bsdf,
        material: MaterialId,
        [front, behind]: [MediumId; 2],
        wavelength: Option<Wavelength>,
    ) {
        if !bsdf.bounds_volume() {
            return;
        }
        let before = self.index(front).at(wavelength);
        let ratio = |behind: f32| if before > 0.0 { behind / before } else { behind };
        match self.boundary(material) {
            Boundary::Body(_) if front == behind => {
                *bsdf = Bsdf::Dielectric(Dielectric { color: Rgb::ONE, ior: 1.0, alpha: 0.0, transmission: 1.0 });
            }
            Boundary::Body(_) => bsdf.set_volume_ior(ratio(self.index(behind).at(wavelength))),
            Boundary::Local => bsdf.set_volume_ior(ratio(self.index_behind(material).at(wavelength))),
            Boundary::Nothing => {}
        }
    }

    /// Whether what [`Self::settle`] finds between these media depends on the wavelength.
    #[inline]
    pub fn disperse_between(&self, material: MaterialId, [front, behind]: [MediumId; 2]) -> bool {
        match self.boundary(material) {
            Boundary::Body(_) => front != behind && (self.index(front).disperses() || self.index(behind).disperses()),
            Boundary::Local => self.index(front).disperses() || self.index_behind(material).disperses(),
            Boundary::Nothing => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_count_in_any_order() {
        let body = MediumId::first(1);
        let mut within = Within::NOTHING;
        (0..200).for_each(|_| within.add(body, 1));
        (0..199).for_each(|_| within.add(body, -1));
        assert_eq!(within.medium(), body);
        within.add(body, -1);
        assert_eq!(within, Within::NOTHING);
    }
}
