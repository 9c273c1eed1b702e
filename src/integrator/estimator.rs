//! The estimator: one sample of a pixel by any table, in two stages.

use glam::Vec2;

use super::{Integrator, Kept, Samplers, area};
use crate::{
    lanes::{One, Record},
    math::{Rgb, luminance},
    path::{JoinedPath, LightVertex, LightVertices, SharedLightVertices, Step, Strategy, Subpath, Tail, Technique},
    sampling::{Block, Chance, Sampler},
    scene::{Scene, bsdf::Transport, camera::Raster, wavelength::Wavelength},
};

/// The subpaths of one thread.
#[derive(Clone, Debug)]
pub struct Scratch {
    camera: Subpath,
    /// Those of a pixel, or those of all its pixels so far where a tile shares them; `walked` are in use.
    lights: Vec<Subpath>,
    walked: usize,
    /// Their vertices that a camera subpath can be connected to.
    ends: Vec<End>,
    lens: Subpath,
    drawn: Vec<Step>,
    /// Their vertices that merge, until they are taken.
    kept: Vec<Record>,
    /// The numbers of those that a camera vertex meets.
    met: Vec<u32>,
    /// A light subpath walked again, for who wants to see the path that it is part of.
    again: Subpath,
}

impl Scratch {
    /// The vertices that light subpaths have left for merges since this was last asked.
    #[inline]
    pub fn take_kept(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.kept)
    }

    /// Forgets the light subpaths.
    #[inline]
    pub fn start_over(&mut self) {
        self.walked = 0;
        self.ends.clear();
    }
}

/// The last vertex of a prefix of a light subpath.
#[derive(Clone, Copy, Debug)]
struct End {
    /// Which light subpath.
    number: u32,
    s: u32,
}

/// A prefix of a camera subpath whose last vertex is joined.
#[derive(Clone, Copy)]
struct CameraEnd<'a> {
    prefix: &'a [Step],
    /// Which part of a split subpath it belongs to.
    branch: u32,
    raster: Raster,
}

/// The s ≥ 2 whose vertex may be connected to.
#[inline(always)]
pub(super) fn connectible(light: &[Step]) -> impl Iterator<Item = u32> {
    (1..).zip(light).skip(1).filter(|(_, y)| y.vertex.point.bsdf.has_continuous()).map(|(s, _)| s)
}

/// Whether an image has a place for a contribution: see [`Sink::deposit`].
#[inline(always)]
pub(super) fn has_a_place(value: Rgb) -> bool {
    value.is_finite() && value.min_element() >= 0.0
}

/// Whether one of these vertices lies on a dispersive interface.
#[inline]
fn disperse(scene: &Scene, steps: &[Step]) -> bool {
    scene.dispersing_media().is_some_and(|media| steps.iter().any(|x| media.disperse_at(&x.vertex.point)))
}

/// What becomes of the paths that are found.
pub trait Sink {
    /// A path and its share w F/(n p) of one pass, without h_j: the value to spread around `path.raster()`.
    /// It is finite, and not negative unless the path is dispersed: see [`JoinedPath::colored`].
    fn deposit(&mut self, path: &JoinedPath, value: Rgb);

    /// A contribution that is not finite or negative, and so has no place in an image: to be counted, never dropped
    /// silently.
    fn reject(&mut self, path: &JoinedPath, value: Rgb);

    /// A connection's ray was traced.
    fn shadow_ray(&mut self) {}

    /// Roulette ended a connection before its ray.
    fn spared_ray(&mut self) {}

    /// What [`Sink::deposit`] gets, of a merge, whose light subpath has to be walked again to be seen. Returns whether
    /// it is deposited: if not, its path is.
    fn deposit_unseen(&mut self, _strategy: Strategy, _raster: Raster, _value: Rgb) -> bool {
        false
    }

    /// A subpath was walked, from the camera (radiance) or from a light (importance), with this many rays.
    fn walked(&mut self, _transport: Transport, _rays: usize) {}

    /// Camera vertices have looked for light vertices, and found so many.
    fn looked(&mut self, _lookups: usize, _found: usize) {}

    /// Walks have ended because N_s and N_g put a direction on different sides: light that is lost to shading normals.
    fn lost_to_sides(&mut self, _walks: u64) {}
}

/// What the light subpaths of a pixel of the padded image are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightStage {
    /// Whether camera subpaths are going to be connected to them.
    pub connects: Connects,
    /// Whether they are among the N_l that splat.
    pub splats: Splats,
    /// Where their vertices are kept for merges: the number of the first one in the pass.
    pub keeps: Option<u32>,
    /// How many there are, if the table has a use for them.
    pub paths: u32,
}

/// See [`LightStage::connects`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connects {
    /// A pixel with camera subpaths, or of a tile that shares light vertices.
    Yes,
    /// A pixel outside the crop.
    No,
}

/// See [`LightStage::splats`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Splats {
    /// A pixel of the image: its light subpath is connected to the lens.
    Yes,
    /// A pixel of the padding, whose light subpath only serves its own camera subpath.
    No,
}

impl Integrator {
    /// Storage for this integrator's subpaths, one per thread.
    pub fn scratch(&self) -> Scratch {
        let vertices = self.evaluated.light_vertices();
        let (connected, rivals) = (vertices.connected, self.rivals.as_ref());
        let light = Subpath::with_capacity(vertices.most())
            .summing(rivals.map(|rivals| rivals.light.clone()).unwrap_or_default());
        let light_paths = self.evaluated.light_paths().most() as usize;
        Scratch {
            camera: Subpath::with_capacity(self.evaluated.camera_vertices().max(1))
                .sampling(self.evaluated.directions())
                .summing(rivals.map(|rivals| rivals.camera.clone()).unwrap_or_default()),
            again: light.clone(),
            lights: vec![light; light_paths],
            walked: 0,
            ends: Vec::with_capacity(light_paths * connected as usize),
            lens: Subpath::with_capacity(1),
            drawn: Vec::new(),
            kept: Vec::new(),
            met: Vec::new(),
        }
    }

    /// The first stage of a pixel's sample: walks its light subpaths, beside those that `scratch` has, and deposits by
    /// the strategies that need no camera subpath.
    #[inline(always)]
    pub fn estimate_from_light<S: Sampler>(
        &self,
        scene: &Scene,
        LightStage { connects, splats, keeps, paths }: LightStage,
        scratch: &mut Scratch,
        samplers: &mut Samplers<'_, S>,
        sink: &mut impl Sink,
    ) {
        let LightVertices { connected, splatted, merged } = self.evaluated.light_vertices();
        let connected = if connects == Connects::Yes { connected } else { 0 };
        let splatted = if splats == Splats::Yes { splatted } else { 0 };
        let merged = if keeps.is_some() { merged } else { 0 };
        let (vertices, at) = (connected.max(splatted).max(merged), samplers.wavelength);
        let Scratch { lights, walked, ends, lens, drawn, kept, .. } = scratch;
        for branch in 0..if vertices > 0 { paths } else { 0 } {
            if *walked == lights.len() {
                // Only the first tile that is shared gets here.
                lights.extend_from_within(..1);
            }
            let number = *walked as u32;
            let light = &mut lights[*walked];
            *walked += 1;
            light.set_wavelength(at);
            light.walk_from_light(scene, branch, vertices, self.roulette, samplers.light);
            sink.walked(Transport::Importance, light.steps().len().saturating_sub(1));
            let lost = light.take_lost_to_sides();
            // Where light vertices are kept for merges, there are two walks of a light subpath: the one that splats
            // counts its losses.
            if splats == Splats::Yes || !self.merges() {
                sink.lost_to_sides(lost);
            }
            let steps = light.steps();
            let joined = &steps[..steps.len().min(connected as usize)];
            ends.extend(connectible(joined).map(|s| End { number, s }));
            if let Some(first) = keeps {
                self.keep(scene, light, (merged, first + branch), kept);
            }
            let splatting = if splatted > 0 { steps } else { &[] };
            for (s, y) in (1..).zip(splatting) {
                if s > 1 && !y.vertex.point.bsdf.has_continuous() {
                    continue; // nothing connects to it
                }
                let samples = self.evaluated.multiplicity(Strategy { s: s as u32, t: 1 });
                for k in 0..samples {
                    samplers.lens.start(Block::repeated(s as u32 - 1, branch * samples + k));
                    if lens.put_lens_towards(scene, &y.vertex.point, samplers.lens) {
                        let path = JoinedPath::inner(scene, lens.steps(), light, s, Raster(Vec2::ZERO));
                        self.consider(path, (1.0, at), || samplers.lens.next_chance(), sink);
                    }
                }
            }
        }
        if splats == Splats::Yes {
            for _ in 0..self.evaluated.area() {
                for n in 1..=self.evaluated.max_depth() {
                    self.consider(area::draw(scene, n, drawn, samplers.connection, at), (1.0, at), || Chance(0), sink);
                }
            }
        }
    }

    /// The second stage of a pixel's sample: walks its camera subpaths, joins them with lights and with the light
    /// subpaths that `scratch` has by every strategy of the table, and deposits.
    ///
    /// A connection's ray is traced only where something can arrive, and before the path is weighed: V of the
    /// connecting edge is in the other strategies' densities, and what is blocked needs no weight.
    #[inline(always)]
    pub fn estimate_from_camera<S: Sampler>(
        &self,
        scene: &Scene,
        raster: Raster,
        scratch: &mut Scratch,
        samplers: &mut Samplers<'_, S>,
        kept: Option<&Kept<'_, S>>,
        sink: &mut impl Sink,
    ) {
        if !self.walks_from_camera() {
            return;
        }
        let Scratch { camera, lights, walked, ends, again, met, .. } = scratch;
        let vertices = self.evaluated.camera_vertices();
        camera.set_wavelength(samplers.wavelength);
        for branch in 0..self.evaluated.splits() {
            // What all branches of a split subpath have in common is joined once.
            let joined = if branch == 0 {
                camera.walk_from_camera(scene, raster, vertices, self.roulette, samplers.camera);
                1
            } else {
                camera.walk_again(scene, branch, vertices, self.roulette, samplers.camera);
                2
            };
            sink.walked(Transport::Radiance, camera.steps().len().saturating_sub(joined));
            sink.lost_to_sides(camera.take_lost_to_sides());
            for t in joined + 1..=camera.steps().len() {
                let end = CameraEnd { prefix: &camera.steps()[..t], branch, raster };
                let z = &end.prefix[t - 1].vertex.point;
                if z.light.is_some() {
                    for _ in 0..self.evaluated.multiplicity(Strategy { s: 0, t: t as u32 }) {
                        let path = JoinedPath::hit(scene, end.prefix, raster);
                        self.consider(path, (1.0, samplers.wavelength), || Chance(0), sink);
                    }
                }
                if z.bsdf.has_continuous() {
                    self.estimate_next_event(scene, end, samplers, sink);
                    self.connect_to_ends(scene, end, (&lights[..*walked], ends), samplers, sink);
                    if let Some(kept) = kept {
                        self.merge(scene, end, kept, (again, met), sink);
                    }
                }
            }
        }
    }

    /// s = 1.
    #[inline(always)]
    fn estimate_next_event<S: Sampler>(
        &self,
        scene: &Scene,
        CameraEnd { prefix, branch, raster }: CameraEnd<'_>,
        samplers: &mut Samplers<'_, S>,
        sink: &mut impl Sink,
    ) {
        let (t, z) = (prefix.len() as u32, &prefix[prefix.len() - 1].vertex.point);
        let of_each = scene.lights().next_event_samples();
        let samples = of_each * self.evaluated.multiplicity(Strategy { s: 1, t });
        let mut nth = 0;
        for k in 0..samples {
            samplers.connection.start(Block::repeated(t - 2, branch * samples + k));
            let (u, choice) = (samplers.connection.next_square(), samplers.connection.next_choice());
            let sampled = scene.sample_next_event(z, u, choice, nth);
            nth = if nth + 1 == of_each { 0 } else { nth + 1 };
            if let Some((point, pdf)) = sampled {
                let end = Step::next_event(point, pdf);
                let path = JoinedPath::next_event(scene, prefix, &end, raster);
                let at = samplers.wavelength;
                self.consider(path, (1.0, at), || samplers.connection.next_chance(), sink);
            }
        }
    }

    /// s ≥ 2: with each of the `ends` of these light subpaths once, or with some that are chosen among all of a tile's,
    /// of which each stands for its share.
    #[inline(always)]
    fn connect_to_ends<S: Sampler>(
        &self,
        scene: &Scene,
        CameraEnd { prefix, branch, raster }: CameraEnd<'_>,
        (lights, ends): (&[Subpath], &[End]),
        samplers: &mut Samplers<'_, S>,
        sink: &mut impl Sink,
    ) {
        let t = prefix.len() as u32;
        let (shared, at) = (self.evaluated.shared_light_vertices(), samplers.wavelength);
        let (connections, share) = match shared {
            None => (ends.len() as u32, 1.0),
            Some(_) if ends.is_empty() => (0, 1.0),
            Some(SharedLightVertices { each, of_a_path }) => {
                (each, ends.len() as f32 / (lights.len() as f32 * of_a_path))
            }
        };
        for k in 0..connections {
            let chosen = if shared.is_some() {
                samplers.connection.start(Block::chosen_end(t, k).of_branch(branch));
                samplers.connection.next_choice().among(ends.len())
            } else {
                k as usize
            };
            let End { number, s } = ends[chosen];
            for _ in 0..self.evaluated.multiplicity(Strategy { s, t }) {
                let chance = || {
                    if shared.is_none() {
                        samplers.connection.start(Block::connection(s, t, number).of_branch(branch));
                    }
                    samplers.connection.next_chance()
                };
                let path = JoinedPath::inner(scene, prefix, &lights[number as usize], s as usize, raster);
                self.consider(path, (share, at), chance, sink);
            }
        }
    }

    /// Merges with the vertices of all light subpaths of the pass around the prefix' last.
    #[inline(never)]
    fn merge<S: Sampler>(
        &self,
        scene: &Scene,
        CameraEnd { prefix, raster, .. }: CameraEnd<'_>,
        kept: &Kept<'_, S>,
        (again, met): (&mut Subpath, &mut Vec<u32>),
        sink: &mut impl Sink,
    ) {
        let (table, Some(rivals), Some(x)) = (&self.weighed, &self.rivals, prefix.last()) else { return };
        let (tail, t) = (Tail::of(prefix), prefix.len() as u32);
        if !table.meeting_places().admit_seen(tail.is_seen_by_specular[0]) {
            return;
        }
        let is_dispersed = disperse(scene, &prefix[1..]);
        met.clear();
        kept.map.around(One, x.vertex.point.position, met);
        sink.looked(1, met.len());
        for number in met.iter() {
            let y = LightVertex::of_record(&kept.map.records()[*number as usize]);
            let Some(meeting) = y.met_by(x, y.strategy(t), table).filter(|x| x.contribution != Rgb::ZERO) else {
                continue;
            };
            let weight = y.weight((&tail, raster.0.to_array()), &meeting, table, rivals)
                / table.samples(Technique::Merged(meeting.strategy));
            let spectral = meeting.contribution * weight;
            if spectral == Rgb::ZERO {
                continue;
            }
            let value = match kept.wavelength {
                Some(wavelength) if is_dispersed || y.is_dispersed() => spectral * wavelength.response(),
                _ => spectral,
            };
            if has_a_place(spectral) && sink.deposit_unseen(meeting.strategy, raster, value) {
                continue;
            }
            self.walk_light_again(scene, &y, kept, again);
            let light = &again.steps()[..y.vertices() as usize];
            let path = JoinedPath::merged(scene, prefix, light, again.beginning(), &meeting, raster);
            let path = path.at_wavelength(kept.wavelength);
            if has_a_place(spectral) { sink.deposit(&path, value) } else { sink.reject(&path, value) }
        }
    }

    /// Keeps the vertices of a light subpath that merge, at most the first `merged`; `path` is its number in the pass.
    fn keep(&self, scene: &Scene, light: &Subpath, (merged, path): (u32, u32), kept: &mut Vec<Record>) {
        let Some(rivals) = &self.rivals else { return };
        let steps = light.steps();
        let prefixes = (2..=steps.len().min(merged as usize)).map(|k| &steps[..k]);
        let of = |prefix: &[Step]| {
            let y = LightVertex::of_prefix(prefix, light.beginning(), rivals, path)?;
            Some(y.dispersed(disperse(scene, &prefix[1..prefix.len() - 1])))
        };
        kept.extend(prefixes.filter_map(of).map(|y| y.record()));
    }

    /// Walks the light subpath of a light vertex as it was walked before, with those of its pixel that took numbers
    /// before it.
    fn walk_light_again<S: Sampler>(&self, scene: &Scene, y: &LightVertex, kept: &Kept<'_, S>, again: &mut Subpath) {
        let of_pixel = self.weighed.light_paths().most();
        let (pixel, branch) = (y.path() / of_pixel, y.path() % of_pixel);
        let LightVertices { splatted, merged, .. } = self.evaluated.light_vertices();
        let mut numbers = (kept.numbers)(pixel);
        again.set_wavelength(kept.wavelength);
        for branch in 0..=branch {
            again.walk_from_light(scene, branch, splatted.max(merged), self.roulette, &mut numbers);
        }
    }

    /// Whether light vertices of a pass are kept for merges.
    #[inline]
    pub fn merges(&self) -> bool {
        self.evaluated.radius().is_some()
    }

    /// Whether the pixels of a tile have their light subpaths in common, so that the first stage of all comes before
    /// the second of any.
    #[inline]
    pub fn shares_light_vertices(&self) -> bool {
        self.evaluated.shared_light_vertices().is_some()
    }

    /// Weighs and deposits a path, if it contributes anything and nothing blocks it. It stands for `times` paths, at
    /// this wavelength; `chance` is a number for roulette.
    #[inline(always)]
    fn consider(
        &self,
        path: Option<JoinedPath<'_>>,
        (mut times, wavelength): (f32, Option<Wavelength>),
        chance: impl FnOnce() -> Chance,
        sink: &mut impl Sink,
    ) {
        let Some(path) = path.filter(|path| path.spectral_contribution() != Rgb::ZERO) else { return };
        let path = path.at_wavelength(wavelength);
        if path.strategy().s > 0 {
            if let Some(roulette) = &self.connections
                && times * self.tentative(&path) < roulette.threshold
            {
                if chance().falls_below(roulette.end) {
                    sink.spared_ray();
                    return;
                }
                times *= 1.0 / (1.0 - roulette.end);
            }
            sink.shadow_ray();
        }
        let Some(path) = path.seen() else { return };
        let spectral = path.spectral_contribution() * (self.weight_per_sample(&path) * times);
        if spectral == Rgb::ZERO {
            return;
        }
        let value = path.colored(spectral);
        if has_a_place(spectral) {
            sink.deposit(&path, value);
        } else {
            sink.reject(&path, value);
        }
    }
}

impl Integrator {
    /// w/n: what a path that was found deposits of F/p.
    #[inline(always)]
    fn weight_per_sample(&self, path: &JoinedPath<'_>) -> f32 {
        self.weight(path) / self.weighed.samples(path.technique())
    }

    /// What the path would contribute to its pixel if nothing were in the way, luminance: w F/(n p) with V = 1,
    /// whatever the colour of its wavelength. Out of line, since it is asked for with roulette on connections alone.
    #[inline(never)]
    fn tentative(&self, path: &JoinedPath<'_>) -> f32 {
        luminance(path.spectral_contribution()) * self.weight_per_sample(path)
    }
}
