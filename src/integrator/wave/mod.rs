//! Waves: the paths of a task all at once, stage by stage, each in its own lane.
//!
//! What happens at a vertex and a joint is the text of [`crate::path`], in as many lanes as the processor has; here is
//! what comes between: which paths are where, in queues side by side. All paths of a wave are at the same vertex, so
//! that all use the same block of random numbers, the same entries of the table and the same rule for roulette. The
//! numbers are those of [`Integrator::estimate_from_light`] and [`Integrator::estimate_from_camera`], bit by bit, and
//! so is every deposit.

mod arrive;
mod bodies;
mod camera;
mod join;
mod leave;
mod light;
mod merge;
mod queue;
mod store;

use glam::Vec3;

use self::{
    join::CameraEnd,
    merge::Meetings,
    queue::{CONNECTS, Connections, KEEPS, SPLATS, Seen, Walks, has},
    store::VertexStore,
};
use super::{Connects, Integrator, LightStage, LightVertexMap, Splats, Sweep, estimator::has_a_place};
use crate::{
    lanes::{Lanes, MOST, Mask, Record},
    math::Rgb,
    path::{LightVertices, Rivals, Step, Strategy, Technique},
    sampling::{Numbers, PdfArea, SamplerKind, Stream},
    scene::{
        Scene,
        bsdf::{Bsdfs, Transport},
        camera::Raster,
        geometry::Hits,
        light::Emission,
        media::Inside,
        point::Point,
    },
};

/// What becomes of the paths of a wave.
pub trait WaveSink {
    /// A path's share of one pass, as [`super::Sink::deposit`] gets it.
    fn deposit(&mut self, strategy: Strategy, raster: Raster, value: Rgb);

    /// Something will be deposited there soon.
    fn announce(&mut self, lanes: impl Lanes, raster: Raster);

    /// A contribution that is not finite or negative.
    fn reject(&mut self, technique: Technique);

    /// Rays of connections were traced.
    fn shadow_rays(&mut self, rays: usize);

    /// Walks have come to a vertex.
    fn walked(&mut self, transport: Transport, walks: usize);

    /// Camera vertices have looked for light vertices, and found so many.
    fn looked(&mut self, lookups: usize, found: usize);

    /// Walks have ended because N_s and N_g put a direction on different sides.
    fn lost_to_sides(&mut self, walks: usize);
}

/// The queues of one thread.
#[derive(Debug, Default)]
pub struct Wave {
    walks: Walks,
    hits: Hits,
    obstacles: Hits,
    queues: Queues,
}

impl Wave {
    /// The vertices that its light subpaths have left for merges since this was last asked.
    pub fn take_kept(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.queues.kept)
    }
}

/// What the walks of a wave leave behind at a vertex.
#[derive(Debug, Default)]
struct Queues {
    /// Those that go on from there.
    next: Walks,
    connections: Connections,
    light_vertices: VertexStore,
    /// Those that the pass keeps for merges.
    kept: Vec<Record>,
    meetings: Meetings,
    /// Of each walk what it is in, by its number; where the scene has media.
    inside: Vec<Inside>,
    /// Of each walk from a light the point where it began, by its number; where weights ask for it.
    lights: Vec<Point>,
    points: Points,
    /// The surface points to which those of a group have come that are not plain.
    arrived: Points,
    emissions: Emissions,
    /// What reaches the image.
    seen: Seen,
}

/// Room for a point in each lane, for what is done lane by lane.
#[derive(Debug)]
struct Points([Point; MOST]);

impl Default for Points {
    fn default() -> Self {
        Self([Point::nowhere(Vec3::ZERO); MOST])
    }
}

/// The same for the beginnings of walks.
#[derive(Debug)]
struct Emissions([Emission; MOST]);

impl Default for Emissions {
    fn default() -> Self {
        Self([Emission::nowhere(); MOST])
    }
}

/// Where walks begin: pixels of the padded image.
#[derive(Clone, Debug, Default)]
pub struct Starts {
    /// Their upper left corners.
    corners: [Vec<f32>; 2],
    /// What names them to a sampler.
    keys: Vec<u32>,
    /// [`SPLATS`], [`CONNECTS`] and [`KEEPS`].
    flags: Vec<u32>,
    /// Those that have a light subpath, in their order, and how many there are.
    lit: Vec<u32>,
    light_paths: usize,
    /// The order in which walks from the camera begin.
    order: Vec<u32>,
    len: usize,
}

impl Starts {
    /// Forgets them.
    pub fn clear(&mut self) {
        let [x, y] = &mut self.corners;
        x.clear();
        y.clear();
        self.keys.clear();
        self.flags.clear();
        self.lit.clear();
        (self.light_paths, self.len) = (0, 0);
    }

    /// Adds a pixel; one that connects has a walk from the camera, too.
    #[inline]
    pub fn push(&mut self, corner: glam::Vec2, key: u32, stage: LightStage) {
        let LightStage { connects, splats, keeps, paths } = stage;
        let flag = |flag: u32, is_set: bool| if is_set { flag } else { 0 };
        self.corners[0].push(corner.x);
        self.corners[1].push(corner.y);
        self.keys.push(key);
        let ends = flag(CONNECTS, connects == Connects::Yes) | flag(SPLATS, splats == Splats::Yes);
        self.flags.push(ends | flag(KEEPS, keeps.is_some()));
        if paths > 0 {
            self.lit.push(self.len as u32);
            self.light_paths += 1;
        }
        self.len += 1;
    }

    /// Fills the last lanes, and puts all in order.
    fn pad(&mut self) {
        let room = self.len.next_multiple_of(MOST);
        self.order.clear();
        self.order.extend(0..self.len as u32);
        self.order.resize(room, 0);
        self.lit.resize(self.light_paths.next_multiple_of(MOST), 0);
        self.corners.iter_mut().for_each(|column| column.resize(room, 0.0));
        self.keys.resize(room, 0);
        self.flags.resize(room, 0);
    }
}

/// The most samples that a strategy takes at a vertex, for whose rays the queues of a wave have room.
const MOST_SAMPLES: u32 = 16;

/// So many connections are collected before their rays are traced, or a few more.
const CONNECTIONS: usize = 4096;

/// By so many deposits a place is announced before its turn: what the way to memory takes.
const ANNOUNCED: usize = 16;

/// Where all paths of a wave are, and how they go on from there.
#[derive(Clone, Copy)]
struct Stage<'a, L> {
    lanes: L,
    scene: &'a Scene,
    rivals: &'a Rivals,
    transport: Transport,
    /// The light vertices that walks from the camera merge with.
    map: Option<&'a LightVertexMap>,
    /// Where random numbers come from.
    kind: SamplerKind,
    seed: u64,
    /// The vertices of each subpath, the present one counted.
    vertices: u32,
    /// The most that a subpath from the camera has in the end, and that one from a light has for either end.
    camera_vertices: u32,
    light_vertices: LightVertices,
}

impl<L: Lanes> Stage<'_, L> {
    /// A sequence of random numbers, of which `taken` words have been taken.
    #[inline(always)]
    fn numbers(&self, kept: [L::U; 2], stream: Stream, taken: u32) -> Numbers<L> {
        Numbers::again(self.kind, self.seed, kept, stream, taken)
    }

    /// How many words a walk takes before it scatters at its present vertex.
    fn taken(&self) -> u32 {
        let start = match self.transport {
            Transport::Radiance => 2,
            Transport::Importance => Numbers::<L>::words_of_emission(self.kind),
        };
        start + 4 * (self.vertices - 2)
    }

    /// The pinhole, as the first vertex of all walks from the camera.
    #[inline(always)]
    fn lens(&self) -> Step<L, Bsdfs<L>> {
        let camera = &self.scene.camera;
        let lens = camera.lens_point();
        let point = Point::of_each(self.lanes, self.lanes.first(L::N), lens.place, |_| &lens);
        Step::next_event(point, PdfArea(self.lanes.splat(camera.pdf_lens().0)))
    }

    /// The most vertices that any subpath has in the end.
    fn most(&self) -> u32 {
        match self.transport {
            Transport::Radiance => self.camera_vertices,
            Transport::Importance => self.light_vertices.most(),
        }
    }

    /// Which walks with these flags have a further vertex in the table.
    #[inline(always)]
    fn has_next(&self, flags: L::U) -> L::M {
        let all = |condition| self.lanes.mask(if condition { u32::MAX } else { 0 });
        match self.transport {
            Transport::Radiance => all(self.vertices < self.camera_vertices),
            Transport::Importance => {
                let LightVertices { connected, splatted, merged } = self.light_vertices;
                let connects = has(flags, CONNECTS) & all(self.vertices < connected);
                let keeps = has(flags, KEEPS) & all(self.vertices < merged);
                connects | keeps | (has(flags, SPLATS) & all(self.vertices < splatted))
            }
        }
    }
}

impl Integrator {
    /// Whether waves do what this integrator does in this scene. If not, that is done path by path, with the same
    /// result.
    pub fn makes_waves(&self, scene: &Scene, kind: SamplerKind) -> bool {
        let table = &self.evaluated;
        let plain = self.rivals.is_some()
            && table.area() == 0
            && table.splits() == 1
            && table.light_paths().most() == 1
            && table.shared_light_vertices().is_none()
            && self.connections.is_none()
            && !(scene.camera.has_aperture() || scene.camera.is_orthographic())
            && scene.is_all_there()
            && scene.absorbing_media().is_none()
            && !scene.disperses();
        let samples = scene.lights().next_event_samples();
        let most = table.strategies().map(|x| table.multiplicity(x) * if x.s == 1 { samples } else { 1 }).max();
        // Independent numbers would have to be counted: a walk from the camera takes some at certain vertices only.
        let numbered = kind == SamplerKind::Sobol || table.camera_vertices() == 0;
        plain && numbered && most.is_some_and(|most| most <= MOST_SAMPLES)
    }

    /// Of one sample of each of some pixels the part that `sweep` says: walks their subpaths from lights and from the
    /// camera, joins and deposits them by every strategy of the table, as [`Self::estimate_from_light`] and
    /// [`Self::estimate_from_camera`] do path by path.
    #[inline(always)]
    pub fn estimate_in_waves<L: Lanes>(
        &self,
        lanes: L,
        scene: &Scene,
        (kind, seed, pass): (SamplerKind, u64, u32),
        (sweep, starts): (Sweep<'_>, &mut Starts),
        wave: &mut Wave,
        sink: &mut impl WaveSink,
    ) {
        let Some(rivals) = &self.rivals else { return };
        let map = if let Sweep::Camera(map) = sweep { Some(map) } else { None };
        let (camera_vertices, light_vertices) = (self.evaluated.camera_vertices(), self.evaluated.light_vertices());
        starts.pad();
        wave.queues.light_vertices.clear(starts.len);
        for transport in [Transport::Importance, Transport::Radiance] {
            let vertices = 0;
            let mut stage =
                Stage { lanes, scene, rivals, transport, map, kind, seed, vertices, camera_vertices, light_vertices };
            let is_left_out = transport == Transport::Radiance && matches!(sweep, Sweep::Light);
            if is_left_out || stage.most() == 0 {
                continue;
            }
            match transport {
                Transport::Radiance => {
                    wave.queues.light_vertices.sort(&mut starts.order[..starts.len]);
                    self.start_at_lens(stage, pass, starts, (&mut wave.walks, &mut wave.queues.inside));
                }
                Transport::Importance => {
                    let number = self.evaluated.light_paths().number(pass);
                    self.start_at_lights(stage, number, starts, wave, sink);
                    self.look(stage, wave, sink);
                }
            }
            for vertices in 2..=stage.most() {
                if wave.walks.0.len() == 0 {
                    break;
                }
                stage.vertices = vertices;
                self.step(stage, wave, sink);
            }
        }
    }

    /// Takes all walks to their next vertex, and sees what is to be done there.
    #[inline(always)]
    fn step<L: Lanes>(&self, stage: Stage<'_, L>, wave: &mut Wave, sink: &mut impl WaveSink) {
        stage.scene.geometry().closest_of_each(wave.walks.rays(), &mut wave.hits);
        let len = wave.walks.0.len();
        wave.queues.next.0.clear(len);
        let of_each = self.connections_of_each(stage, &wave.queues.light_vertices);
        let part = (CONNECTIONS / of_each.max(1)).max(1).next_multiple_of(MOST);
        for from in (0..len).step_by(part) {
            wave.queues.connections.clear(part.min(len) * of_each);
            self.arrive(stage, from..len.min(from + part), wave, sink);
            self.look(stage, wave, sink);
        }
        std::mem::swap(&mut wave.walks, &mut wave.queues.next);
    }

    /// Traces the rays of connections, and deposits what nothing blocks.
    #[inline(always)]
    fn look<L: Lanes>(&self, stage: Stage<'_, L>, wave: &mut Wave, sink: &mut impl WaveSink) {
        let Stage { lanes, scene, transport, vertices, .. } = stage;
        let Wave { obstacles, queues: Queues { connections, seen, .. }, .. } = wave;
        let len = connections.0.len();
        if len == 0 {
            return;
        }
        scene.geometry().obstacle_of_each(connections.rays(), obstacles);
        seen.0.clear(len);
        for i in (0..len).step_by(L::N) {
            let blocked = obstacles.any(lanes, i);
            let mut open = !blocked & lanes.first(len - i);
            if scene.geometry().has_coincident() {
                open = open | connections.see_despite(scene, i, blocked & lanes.first(len - i), obstacles, lanes);
            }
            seen.push_of(lanes, connections, i, open);
        }
        let t = if transport == Transport::Radiance { vertices } else { 1 };
        for i in 0..seen.0.len() {
            // Light lands all over the image, and the memory there is far away.
            if t == 1 && i + ANNOUNCED < seen.0.len() {
                let (_, raster, _) = seen.get(i + ANNOUNCED);
                sink.announce(lanes, Raster(raster.into()));
            }
            let (value, raster, s) = seen.get(i);
            deposit(sink, Technique::Bidirectional(Strategy { s, t }), raster, value);
        }
    }

    /// How many connections a vertex takes at most.
    fn connections_of_each<L: Lanes>(&self, stage: Stage<'_, L>, light_vertices: &VertexStore) -> usize {
        let of = |s, t| self.evaluated.multiplicity(Strategy { s, t });
        let connections = match stage.transport {
            Transport::Radiance => {
                let inner: u32 = light_vertices.levels().map(|s| of(s, stage.vertices)).sum();
                self.next_event_samples(stage) + inner
            }
            // The lights themselves are the first.
            Transport::Importance => of(stage.vertices.max(1), 1),
        };
        connections as usize
    }
}

/// The names of the primitives on which points lie.
#[inline(always)]
fn words<L: Lanes, B>(lanes: L, point: &Point<L, B>) -> [L::U; 2] {
    let primitive = |k| L::lane(&point.primitive, k).words();
    [lanes.whole_numbers(|k| primitive(k)[0]), lanes.whole_numbers(|k| primitive(k)[1])]
}

/// In how many lanes the condition holds.
#[inline(always)]
fn count(which: impl Mask) -> usize {
    which.bits().count_ones() as usize
}

/// Deposits what is worth it.
#[inline(always)]
fn deposit(sink: &mut impl WaveSink, technique: Technique, raster: [f32; 2], value: Rgb) {
    let (Technique::Bidirectional(strategy) | Technique::Merged(strategy)) = technique else { return };
    if value == Rgb::ZERO {
        return;
    }
    if has_a_place(value) {
        sink.deposit(strategy, Raster(raster.into()), value);
    } else {
        sink.reject(technique);
    }
}
