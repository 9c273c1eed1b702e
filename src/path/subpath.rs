//! Subpaths: the random walks from the camera and from a light, with the prefix products that the fast form needs.

use glam::{Vec2, Vec3};

use super::{
    Beginning, MeetingPlaces, RivalSum, Roulette, RunningSum, Step,
    absorption::walked_transmittance,
    departure::{Departure, Rules},
};
use crate::{
    lanes::One,
    sampling::{Block, Chance, PdfArea, PdfSolidAngle, Sampler},
    scene::{
        Scene, Traced,
        bsdf::{Directions, Transport},
        camera::Raster,
        media::{Inside, Media},
        point::Point,
        wavelength::Wavelength,
    },
};

/// A subpath from the camera (p_0 p_1 …) or from a light (p_n p_{n−1} …).
#[derive(Clone, Debug)]
pub struct Subpath {
    /// Room for all vertices, so that each is written in its place: a vector would have them copied there.
    room: Box<[Step]>,
    len: usize,
    directions: Directions,
    /// What [`Roulette::ByThroughput`] compares with: the largest channel that the prefix would have, had every step
    /// kept everything.
    whole: f32,
    beginning: Beginning,
    rivals: RunningSum,
    /// Where the scene has media: what the walk is in.
    inside: Inside,
    /// What a walk from the camera was in on arriving at its second vertex; `None` for empty space without a boundary.
    inside_at_second: Option<Inside>,
    wavelength: Option<Wavelength>,
    lost_to_sides: u64,
}

/// Whether the camera sees the last vertex of a prefix by vertices that pass delta lobes alone, one at least.
pub fn is_seen_by_specular(prefix: &[Step]) -> bool {
    let [_, between @ .., _] = prefix else { return false };
    !between.is_empty() && between.iter().all(|step| step.vertex.is_delta())
}

/// Where a walk comes from and when it ends.
#[derive(Clone, Copy)]
struct Way {
    transport: Transport,
    /// The most that there may be in the end.
    vertices: u32,
    roulette: Roulette,
    /// Of several walks with one sampler: the parts of a split camera subpath, the light subpaths of a pixel.
    branch: u32,
}

impl Subpath {
    /// An empty subpath with room for so many vertices.
    pub fn with_capacity(vertices: u32) -> Self {
        let nothing = Step::first(Point::nowhere(Vec3::ZERO), PdfArea(1.0));
        let room = vec![nothing; vertices as usize].into_boxed_slice();
        Self {
            room,
            len: 0,
            directions: Directions::Bsdf,
            whole: 1.0,
            beginning: Beginning::plain(One),
            rivals: RunningSum::default(),
            inside: Inside::NOTHING,
            inside_at_second: None,
            wavelength: None,
            lost_to_sides: 0,
        }
    }

    /// The same storage for walks that sample by another rule than the BSDF.
    ///
    /// A walk's densities then are the rule's; those of a connection are the BSDF's. [`Techniques`](super::Techniques)
    /// has another rule only where nothing connects.
    #[must_use]
    pub fn sampling(self, directions: Directions) -> Self {
        Self { directions, ..self }
    }

    /// The same storage for walks that sum up, for the weights, what connects further back: see [`super::Rivals`].
    #[must_use]
    pub fn summing(self, rivals: RunningSum) -> Self {
        Self { rivals, ..self }
    }

    /// Gives the walks to come a wavelength: all that are joined with each other need the same.
    #[inline(always)]
    pub fn set_wavelength(&mut self, wavelength: Option<Wavelength>) {
        self.wavelength = wavelength;
    }

    /// The vertices with their prefix products.
    #[inline(always)]
    pub fn steps(&self) -> &[Step] {
        &self.room[..self.len]
    }

    #[inline(always)]
    fn push(&mut self, step: Step) {
        // Field by field: else a whole step is built elsewhere and copied.
        let Step { vertex, back, beta, pdf_fwd, pdf_rev, survival, rivals } = step;
        let slot = &mut self.room[self.len];
        slot.vertex.point = vertex.point;
        slot.vertex.lobe = vertex.lobe;
        slot.back = back;
        slot.beta = beta;
        slot.pdf_fwd = pdf_fwd;
        slot.pdf_rev = pdf_rev;
        slot.survival = survival;
        slot.rivals = rivals;
        self.len += 1;
    }

    /// How many walks have ended since this was last asked because N_s and N_g put a direction on different sides.
    #[inline(always)]
    pub fn take_lost_to_sides(&mut self) -> u64 {
        std::mem::take(&mut self.lost_to_sides)
    }

    /// See [`super::Densities::next_event_ratio`]: for this light subpath's own p_n and p_{n−1}.
    #[inline]
    pub fn next_event_ratio(&self) -> f32 {
        self.beginning.next_event_ratio
    }

    /// What the subpath's first two edges count as in running sums.
    #[inline]
    pub fn beginning(&self) -> Beginning {
        self.beginning
    }

    /// Walks from the lens through `raster`, to at most `vertices` vertices. Where a ray leaves the scene, an
    /// environment's point becomes the last vertex.
    ///
    /// # Panics
    /// If there is no room for so many.
    #[inline(always)]
    pub fn walk_from_camera(
        &mut self,
        scene: &Scene,
        raster: Raster,
        vertices: u32,
        roulette: Roulette,
        sampler: &mut impl Sampler,
    ) {
        let camera = &scene.camera;
        let u = if camera.has_aperture() { sampler.next_2d() } else { Vec2::ZERO };
        self.put_lens(scene, camera.sample_lens(raster, u));
        if let Some(media) = scene.media() {
            let lens = &mut self.room[0].vertex.point;
            lens.media = [self.inside.start_at_lens(scene, media, lens.position); 2];
            self.inside_at_second = None;
        }
        let (departure, some) = Departure::from_lens(camera, &self.room[0], raster.0.to_array());
        if some {
            self.whole = departure.beta.max_element();
            self.walk(scene, departure, Way { transport: Transport::Radiance, vertices, roulette, branch: 0 }, sampler);
        }
    }

    /// Walks on from p_1 once more, where a walk from the camera has been: the `branch`-th of several, counted from 0.
    ///
    /// # Panics
    /// If there is no room for so many.
    #[inline(never)]
    pub fn walk_again(
        &mut self,
        scene: &Scene,
        branch: u32,
        vertices: u32,
        roulette: Roulette,
        sampler: &mut impl Sampler,
    ) {
        self.len = self.len.min(2);
        if self.len < 2 {
            return;
        }
        self.whole = self.room[1].beta.max_element();
        self.inside = self.inside_at_second.unwrap_or(Inside::NOTHING);
        let way = Way { transport: Transport::Radiance, vertices, roulette, branch };
        if let Some(departure) = self.depart(way, sampler) {
            self.walk(scene, departure, way, sampler);
        }
    }

    /// The subpath that is only a p_0 from which `seen` is to be seen, for t = 1. False if there is none.
    ///
    /// Each connection has a p_0 of its own: for an orthographic camera it follows from `seen`, and on a lens
    /// independent points keep the vertices of one light subpath from being blurred to the same side.
    #[inline(always)]
    pub fn put_lens_towards(&mut self, scene: &Scene, seen: &Point, sampler: &mut impl Sampler) -> bool {
        let camera = &scene.camera;
        let u = if camera.has_aperture() { sampler.next_2d() } else { Vec2::ZERO };
        let Some(lens) = camera.sample_lens_towards(seen, u) else { return false };
        self.put_lens(scene, lens);
        // Nothing else asks for the medium of a lens that no walk leaves.
        if let Some(media) = scene.absorbing_media() {
            let lens = &mut self.room[0].vertex.point;
            lens.media = [media.medium_at_lens(scene, lens.position); 2];
        }
        true
    }

    #[inline(always)]
    fn put_lens(&mut self, scene: &Scene, lens: Point) {
        self.len = 0;
        self.push(Step::first(lens, scene.camera.pdf_lens()));
    }

    /// Walks from a light, to at most `vertices` vertices; empty if the scene has no light. It is the `branch`-th of
    /// several walks with one sampler, counted from 0.
    ///
    /// # Panics
    /// If there is no room for so many.
    #[inline(always)]
    pub fn walk_from_light(
        &mut self,
        scene: &Scene,
        branch: u32,
        vertices: u32,
        roulette: Roulette,
        sampler: &mut impl Sampler,
    ) {
        self.len = 0;
        self.beginning = Beginning::plain(One);
        if vertices == 0 {
            return;
        }
        sampler.start(Block::START.of_branch(branch));
        let (position, direction, choice) = (sampler.next_square(), sampler.next_2d(), sampler.next_choice());
        let Some(emission) = scene.sample_emission(choice, position, direction) else { return };
        let p = emission.point;
        self.beginning.hittable = f32::from(p.light.is_some_and(|id| scene.lights().is_hittable(id)));
        self.push(Step::first(p, emission.pdf_position));
        let leaves = emission.pdf_direction > PdfSolidAngle::ZERO && p.alpha > 0.0;
        if vertices == 1 || !leaves {
            return;
        }
        let origin = emission.origin.unwrap_or_else(|| p.ray_origin(emission.direction));
        let (direction, pdf) = (emission.direction, emission.pdf_direction);
        let departure = Departure::from_light(scene, &self.room[0], direction, pdf, origin);
        self.whole = departure.beta.max_element();
        if let Some(media) = scene.media() {
            self.inside.start_at_light(scene, media, &emission);
        }
        self.walk(scene, departure, Way { transport: Transport::Importance, vertices, roulette, branch }, sampler);
    }

    /// Goes on from the last vertex: trace, arrive, scatter, play roulette, depart.
    #[inline(always)]
    fn walk(&mut self, scene: &Scene, mut departure: Departure, way: Way, sampler: &mut impl Sampler) {
        while self.len < way.vertices as usize {
            if !self.arrive(scene, &departure, way, sampler) {
                return;
            }
            if way.transport == Transport::Importance && self.len == 2 {
                let [end, before] = [&self.room[0], &self.room[1]];
                let next_event = scene.pdf_next_event(&end.vertex.point, &before.vertex.point);
                self.beginning.next_event_ratio = next_event.0 / end.pdf_fwd.0;
            }
            if self.len == way.vertices as usize {
                return;
            }
            let Some(next) = self.depart(way, sampler) else { return };
            departure = next;
        }
    }

    /// Leaves the last vertex, if the walk goes on.
    #[inline(always)]
    fn depart(&mut self, way: Way, sampler: &mut impl Sampler) -> Option<Departure> {
        sampler.start(Block::scattering(self.len as u32 - 1).of_branch(way.branch));
        let u = sampler.next_3d();
        let survive = sampler.next_chance();
        let departure = self.scatter(way, u, survive)?;
        self.sum_rivals();
        Some(departure)
    }

    /// Adds the vertex that the departing ray reaches. False if it leaves the scene.
    ///
    /// At a surface with 0 < α < 1 the walk stops with probability α, which takes one random number; else it passes.
    #[inline(always)]
    fn arrive(
        &mut self,
        scene: &Scene,
        departure: &Departure,
        Way { transport, branch, .. }: Way,
        sampler: &mut impl Sampler,
    ) -> bool {
        let from = &self.room[self.len - 1].vertex.point;
        // Only surfaces with 0 < α < 1 take numbers.
        let (passing, mut started) = (Block::passing(self.len as u32).of_branch(branch), false);
        let mut stops = |alpha| {
            if !std::mem::replace(&mut started, true) {
                sampler.start(passing);
            }
            sampler.next_chance().falls_below(alpha)
        };
        let Departure { origin, direction, .. } = *departure;
        let leaves_lens = transport == Transport::Radiance && self.len == 1;
        let Traced { ray, hit, visibility } = if leaves_lens && scene.culls_back_faces() {
            scene.trace_from_camera(origin, direction, from.primitive, &mut stops)
        } else {
            scene.trace_ray(origin, direction, from.primitive, &mut stops)
        };
        if let Some(hit) = hit {
            self.add(scene, departure, scene.point_at(&ray, &hit), visibility, transport);
            return true;
        }
        if transport == Transport::Radiance
            && let Some(sky) = scene.lights().environment_at(departure.direction)
        {
            self.add(scene, departure, sky, visibility, transport);
        }
        false
    }

    /// Adds the vertex at `point`.
    #[inline(always)]
    fn add(&mut self, scene: &Scene, departure: &Departure, point: Point, visibility: f32, transport: Transport) {
        let from = &self.room[self.len - 1].vertex.point;
        self.push(Step::arriving(departure, from, point, visibility));
        if let Some(media) = scene.media()
            && !self.inside.may_pass_over(media, &self.room[self.len - 1].vertex.point)
        {
            self.come_through(scene, media, departure.direction, transport);
        }
    }

    /// Finds the media on both sides of the vertex that was added last, to which the walk has come in this direction,
    /// and takes away what was absorbed on the way.
    #[inline(never)]
    fn come_through(&mut self, scene: &Scene, media: &Media, direction: Vec3, transport: Transport) {
        let [.., from, here] = &mut self.room[..self.len] else { return };
        let medium = self.inside.arrive(scene, media, &mut here.vertex.point, direction, self.wavelength);
        if transport == Transport::Radiance && self.len == 2 {
            self.inside_at_second = Some(self.inside);
        }
        if media.absorb() {
            here.beta *= walked_transmittance(scene, from, here, transport, medium);
        }
    }

    /// Adds to the running sum of the last vertex but one, now that its other-side density is known.
    #[inline(always)]
    fn sum_rivals(&mut self) {
        if self.rivals.is_empty() {
            return;
        }
        let [.., from, _] = self.steps() else { return };
        let (j, densities) = (self.len - 2, [from.pdf_rev, from.pdf_fwd]);
        let (before_is_delta, before) = match self.steps() {
            [.., before, _, _] => (before.vertex.is_delta(), before.rivals),
            _ => (false, RivalSum::ZERO),
        };
        let connects = self.beginning.connects(j, [from.vertex.is_delta(), before_is_delta]);
        self.room[j].rivals = if self.rivals.has_merges() {
            let places = self.rivals.meeting_places();
            let is_seen = places == MeetingPlaces::SeenBySpecular && is_seen_by_specular(&self.steps()[..=j]);
            let merges = places.admit(is_seen, from.vertex.is_delta());
            self.rivals.next_merging(j, densities, connects, merges, before)
        } else {
            self.rivals.next(j, densities, connects, before)
        };
    }

    /// Samples how the walk leaves its last vertex, and fills in what that decides: the vertex's lobe and its
    /// predecessor's other-side density.
    #[inline(always)]
    fn scatter(&mut self, Way { transport, roulette, .. }: Way, u: Vec3, survive: Chance) -> Option<Departure> {
        let edges = self.len as u32 - 1;
        let [.., before, here] = &mut self.room[..self.len] else { return None };
        let rules = Rules { transport, directions: self.directions, roulette };
        let scattered = here.scatter(rules, edges, self.whole, u.to_array(), survive);
        self.lost_to_sides += u64::from(scattered.lost_to_sides);
        if !scattered.goes_on {
            return None;
        }
        (here.vertex.lobe, before.pdf_rev, self.whole) = (scattered.lobe, scattered.reverse, scattered.whole);
        let n = here.vertex.point.normal;
        if self.inside.is_at_boundary() && n.dot(scattered.departure.direction) * n.dot(here.back.direction) < 0.0 {
            self.inside.go_through();
        }
        Some(scattered.departure)
    }
}
