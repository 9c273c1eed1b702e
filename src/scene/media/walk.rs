//! What a walk is in: carried from vertex to vertex, changed where it goes through a boundary.

use std::ops::ControlFlow;

use glam::Vec3;

use super::{Boundary, Media, MediumId, Within};
use crate::scene::{
    Scene,
    bsdf::Bsdf,
    geometry::{PrimitiveId, Ray},
    light::Emission,
    material::MaterialId,
    point::Point,
    wavelength::Wavelength,
};

/// What a walk is in: on its way, and at its last vertex on the other side.
#[derive(Clone, Copy, Debug)]
pub struct Inside {
    within: Within,
    beyond: Beyond,
    /// For [`Beyond::Other`].
    other: Within,
}

/// What lies on the other side of a walk's last vertex.
#[derive(Clone, Copy, Debug)]
enum Beyond {
    /// The same.
    Same,
    /// What differs by one body, whose number changes by so much.
    Changed(MediumId, i8),
    /// [`Inside::other`]: several surfaces may coincide there.
    Other,
}

impl Inside {
    /// A walk that starts outside of everything.
    pub const NOTHING: Self = Self { within: Within::NOTHING, beyond: Beyond::Same, other: Within::NOTHING };

    /// A walk starts within that.
    #[inline(always)]
    fn start(&mut self, within: Within) {
        self.within = within;
        self.beyond = Beyond::Same;
    }

    /// A walk starts at the point `lens` of the lens. Returns the medium there.
    #[inline(always)]
    pub fn start_at_lens(&mut self, scene: &Scene, media: &Media, lens: Vec3) -> MediumId {
        self.start(if media.is_clear(lens) { Within::NOTHING } else { media.around_lens(scene, lens) });
        self.within.medium()
    }

    /// A walk leaves a light.
    #[inline(always)]
    pub fn start_at_light(&mut self, scene: &Scene, media: &Media, emission: &Emission) {
        let clear = emission.point.light.is_none_or(|id| media.light_is_clear(id));
        self.start(if clear { Within::NOTHING } else { media.around_emission(scene, emission) });
    }

    /// Whether the walk may arrive at `point` without [`Self::arrive`], which would change nothing.
    #[inline(always)]
    pub fn may_pass_over(&mut self, media: &Media, point: &Point) -> bool {
        let passes = self.within.is_nothing() && media.ignore(point.material);
        if passes {
            self.beyond = Beyond::Same;
        }
        passes
    }

    /// The walk arrives at `point` in the unit direction `w`: finds the media on both sides, and settles how it
    /// scatters there, at the walk's wavelength if it has one. Returns the medium that the walk has come through.
    pub fn arrive(
        &mut self,
        scene: &Scene,
        media: &Media,
        point: &mut Point,
        w: Vec3,
        wavelength: Option<Wavelength>,
    ) -> MediumId {
        let leaves = point.normal.dot(w) > 0.0;
        let boundary = media.boundary(point.material);
        let near = self.come_near(boundary, leaves);
        let transmits = point.bsdf.transmits();
        let far = if media.meet && (transmits || matches!(boundary, Boundary::Body(_))) {
            self.beyond = Beyond::Other;
            self.other = self.within;
            self.cross(scene, media, point, w, leaves);
            self.other.medium()
        } else {
            self.look_beyond(boundary, leaves)
        };
        point.media = if leaves { [far, near] } else { [near, far] };
        media.settle(&mut point.bsdf, point.material, point.media, wavelength);
        near
    }

    /// The same without a wavelength at a surface with which no other coincides: see [`Media::meet`]. The walk `leaves`
    /// what lies behind the surface, or enters it.
    #[inline(never)]
    pub fn arrive_alone(&mut self, media: &Media, bsdf: &mut Bsdf, material: MaterialId, leaves: bool) {
        let boundary = media.boundary(material);
        let near = self.come_near(boundary, leaves);
        let far = self.look_beyond(boundary, leaves);
        media.settle(bsdf, material, if leaves { [far, near] } else { [near, far] }, None);
    }

    /// The medium through which the walk has come to a surface.
    #[inline(always)]
    fn come_near(&mut self, boundary: Boundary, leaves: bool) -> MediumId {
        if let Boundary::Body(body) = boundary
            && leaves
        {
            // Whoever sees a boundary from behind is in its body, also if a ray has slipped past an edge on its way in.
            self.within.set(body, self.within.counts[body.bit()].max(1));
        }
        self.within.medium()
    }

    /// Finds what lies beyond a surface, if nothing else does, and the medium there.
    #[inline(always)]
    fn look_beyond(&mut self, boundary: Boundary, leaves: bool) -> MediumId {
        match boundary {
            Boundary::Body(body) => {
                let change = if leaves { -1 } else { 1 };
                self.beyond = Beyond::Changed(body, change);
                self.within.medium_after(body, change)
            }
            Boundary::Nothing | Boundary::Local => {
                self.beyond = Beyond::Same;
                self.within.medium()
            }
        }
    }

    /// Passes the surface at `point`, and whatever coincides with it: a ray that goes on starts behind all of that.
    #[inline(never)]
    fn cross(&mut self, scene: &Scene, media: &Media, point: &Point, w: Vec3, leaves: bool) {
        let geometry = scene.geometry();
        media.pass(&mut self.other, geometry, point.primitive, leaves);
        let ray = Ray::between(point.ray_origin(-w), point.ray_origin(w));
        let _ = geometry.crossings(&ray, [point.primitive, PrimitiveId::NONE], |hit| {
            let surface = geometry.surface(&ray, hit);
            // A sphere is not flat, and is met again by a ray through it.
            if hit.primitive != point.primitive {
                media.pass(&mut self.other, geometry, hit.primitive, surface.normal.dot(w) > 0.0);
            }
            ControlFlow::Continue(())
        });
    }

    /// Whether there may be something else on the other side of the last vertex.
    #[inline(always)]
    pub fn is_at_boundary(&self) -> bool {
        !matches!(self.beyond, Beyond::Same)
    }

    /// The walk goes on through the surface that it has reached.
    #[inline(never)]
    pub fn go_through(&mut self) {
        match self.beyond {
            Beyond::Same => {}
            Beyond::Changed(body, change) => self.within.add(body, change),
            Beyond::Other => self.within = self.other,
        }
    }
}
