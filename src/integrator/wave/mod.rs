//! Waves: the paths of a task all at once, stage by stage, each in its own lane.
//!
//! What happens at a vertex and a joint is the text of [`crate::path`], in as many lanes as the processor has; here is
//! what comes between: which paths are where, in queues side by side. All paths of a wave are at the same vertex, so
//! that all use the same block of random numbers, the same entries of the table and the same rule for roulette. The
//! numbers are those of [`Integrator::estimate_from_camera`], bit by bit, and so is every deposit.

mod bodies;
mod camera;
mod light;
mod queue;

use glam::Vec3;

use self::{
    bodies::{come_to_bodies, go_through},
    queue::{Connections, DELTA, Walk, Walks},
};
use super::{Integrator, estimator::has_a_place};
use crate::{
    lanes::{Float, Lanes, MOST, Mask, Select, Vector},
    math::Rgb,
    path::{Rivals, Rules, Step, Strategy, Techniques},
    sampling::{Block, Chance, Numbers, PdfArea, Sampler, SamplerKind, Stream},
    scene::{
        Scene,
        bsdf::{Bsdfs, Kind, Transport},
        camera::Raster,
        geometry::{Hits, Rays},
        media::Inside,
        point::{Place, Point},
    },
};

/// What becomes of the paths of a wave.
pub trait WaveSink {
    /// A path's share of one pass, as [`super::Sink::deposit`] gets it.
    fn deposit(&mut self, strategy: Strategy, raster: Raster, value: Rgb);

    /// A contribution that is not finite or negative.
    fn reject(&mut self, strategy: Strategy);

    /// Rays of connections were traced.
    fn shadow_rays(&mut self, rays: usize);

    /// Walks have come to a vertex.
    fn walked(&mut self, transport: Transport, walks: usize);

    /// Walks have ended because N_s and N_g put a direction on different sides.
    fn lost_to_sides(&mut self, walks: usize);
}

/// The queues of one thread.
#[derive(Debug, Default)]
pub struct Wave {
    walks: Walks,
    /// Those that go on from the present vertex.
    next: Walks,
    rays: Rays,
    hits: Hits,
    connections: Connections,
    obstacles: Hits,
    /// Of each walk what it is in, by its number; where the scene has media.
    inside: Vec<Inside>,
}

/// Where walks begin: pixels of the padded image.
#[derive(Clone, Debug, Default)]
pub struct Starts {
    /// Their upper left corners.
    corners: [Vec<f32>; 2],
    /// What names them to a sampler.
    keys: Vec<u32>,
    len: usize,
}

impl Starts {
    /// Forgets them.
    pub fn clear(&mut self) {
        let [x, y] = &mut self.corners;
        x.clear();
        y.clear();
        self.keys.clear();
        self.len = 0;
    }

    /// Adds a pixel.
    pub fn push(&mut self, corner: glam::Vec2, key: u32) {
        self.corners[0].push(corner.x);
        self.corners[1].push(corner.y);
        self.keys.push(key);
        self.len += 1;
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Fills the last lanes.
    fn pad(&mut self) {
        let room = self.len.next_multiple_of(MOST);
        self.corners.iter_mut().for_each(|column| column.resize(room, 0.0));
        self.keys.resize(room, 0);
    }
}

/// The most connections of a vertex, for whose rays the queues of a wave have room.
const MOST_CONNECTIONS: u32 = 16;

/// Where all paths of a wave are, and how they go on from there.
#[derive(Clone, Copy)]
struct Stage<'a, L> {
    lanes: L,
    scene: &'a Scene,
    rivals: &'a Rivals,
    transport: Transport,
    /// Where random numbers come from.
    kind: SamplerKind,
    seed: u64,
    /// The vertices of each subpath, the present one counted.
    vertices: u32,
    /// The most that there may be in the end.
    most: u32,
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

    /// What found a connection.
    fn connecting(&self) -> Strategy {
        match self.transport {
            Transport::Radiance => Strategy { s: 1, t: self.vertices },
            Transport::Importance => Strategy { s: self.vertices, t: 1 },
        }
    }
}

impl Integrator {
    /// Which way the walks of a wave go that does what this integrator does in this scene; `None` if none can. That is
    /// done path by path then, with the same result.
    pub fn makes_waves(&self, scene: &Scene, kind: SamplerKind) -> Option<Transport> {
        let plain = self.rivals.is_some()
            && self.evaluated.splits() == 1
            && self.evaluated.light_paths() == 1
            && self.connections.is_none()
            && !(scene.camera.has_aperture() || scene.camera.is_orthographic())
            && scene.is_all_there()
            && scene.absorbing_media().is_none();
        // The table that weighs may be larger: a weight then sees vertices that a wave has forgotten.
        let [evaluated, weighed] = [&self.evaluated, &self.weighed];
        let all = |such: fn(Strategy) -> bool| {
            let alone = |table: &Techniques| table.area() == 0 && table.strategies().all(such);
            plain && evaluated.strategies().next().is_some() && alone(evaluated) && alone(weighed)
        };
        let samples = scene.lights().next_event_samples();
        let most = evaluated.strategies().map(|x| evaluated.multiplicity(x) * if x.s == 1 { samples } else { 1 }).max();
        if most.is_none_or(|most| most > MOST_CONNECTIONS) {
            None
        } else if kind == SamplerKind::Sobol && all(|x| x.s <= 1 && x.t >= 2) {
            // (Independent numbers would have to be counted: such a walk takes some at certain vertices only.)
            Some(Transport::Radiance)
        } else {
            all(|x| x.t == 1).then_some(Transport::Importance)
        }
    }

    /// One sample of each of some pixels: walks their subpaths from the camera or from lights, as
    /// [`Self::makes_waves`] says, joins and deposits them by every strategy of the table, as
    /// [`Self::estimate_from_camera`] and [`Self::estimate_from_light`] do path by path.
    #[inline(always)]
    pub fn estimate_in_waves<L: Lanes>(
        &self,
        lanes: L,
        scene: &Scene,
        (transport, kind, seed, sample): (Transport, SamplerKind, u64, u32),
        starts: &mut Starts,
        wave: &mut Wave,
        sink: &mut impl WaveSink,
    ) {
        let Some(rivals) = &self.rivals else { return };
        let most = match transport {
            Transport::Radiance => self.evaluated.camera_vertices(),
            Transport::Importance => self.evaluated.light_vertices().splatted,
        };
        let mut stage = Stage { lanes, scene, rivals, transport, kind, seed, vertices: 1, most };
        match transport {
            Transport::Radiance => self.start_at_lens(stage, sample, starts, (&mut wave.walks, &mut wave.inside)),
            Transport::Importance => {
                self.start_at_lights(stage, sample, starts, wave, sink);
                self.look(stage, wave, sink);
            }
        }
        for vertices in 2..=most {
            if wave.walks.0.len() == 0 {
                return;
            }
            stage.vertices = vertices;
            wave.walks.put_rays(&mut wave.rays);
            scene.geometry().closest_of_each(&wave.rays, &mut wave.hits);
            self.arrive(stage, wave, sink);
            self.look(stage, wave, sink);
            std::mem::swap(&mut wave.walks, &mut wave.next);
        }
    }

    /// Traces the rays of connections, and deposits what nothing blocks.
    #[inline(always)]
    fn look<L: Lanes>(&self, stage: Stage<'_, L>, wave: &mut Wave, sink: &mut impl WaveSink) {
        let scene = stage.scene;
        let Wave { connections, rays, obstacles, .. } = wave;
        if connections.0.len() == 0 {
            return;
        }
        connections.put_rays(rays);
        scene.geometry().obstacle_of_each(rays, obstacles);
        for i in 0..connections.0.len() {
            let sees = match obstacles.get(i) {
                None => true,
                Some(hit) => scene.geometry().has_coincident() && connections.sees_despite(scene, i, &hit),
            };
            if sees {
                let (value, raster) = connections.value(i);
                deposit(sink, stage.connecting(), raster, value);
            }
        }
    }

    /// What happens at the vertex to which the rays have come.
    #[inline(always)]
    fn arrive<L: Lanes>(&self, stage: Stage<'_, L>, wave: &mut Wave, sink: &mut impl WaveSink) {
        let Stage { lanes, scene, .. } = stage;
        let Wave { walks, next, hits, connections, inside, .. } = wave;
        let len = walks.0.len();
        next.0.clear(len);
        connections.0.clear(len * self.connections_of_each(stage) as usize);
        let mut points = [Point::nowhere(Vec3::ZERO); MOST];
        for i in (0..len).step_by(L::N) {
            let walk = walks.get(lanes, i);
            let all = lanes.first(len - i);
            let mut met = hits.any(lanes, i) & all;
            let (in_world, index, b) = hits.places(lanes, i);
            let mut plain = scene.plain_points(lanes, met & in_world, index, b);
            plain.which = plain.which & self.is_met_first(stage, walks, hits, i, plain.which);
            // One call for all: each would be a copy of what it does.
            for group in Group::ALL {
                let other;
                let (which, point) = match group {
                    Group::Plain(kind) => {
                        let which = plain.of_kind(kind);
                        if !which.any() {
                            continue;
                        }
                        plain.turn_to(kind);
                        if kind.transmits() {
                            plain.point.bsdf = come_to_bodies(stage, &walk, which, &plain.point, inside);
                        }
                        (which, &plain.point)
                    }
                    Group::Others => {
                        let others = met & !plain.which;
                        if !others.any() {
                            continue;
                        }
                        let which = lanes.mask(walks.arrive_each(scene, i, others, hits, inside, &mut points));
                        met = plain.which | which;
                        other = Point::of_each(lanes, which, Place::Surface, |k| &points[k]);
                        (which, &other)
                    }
                    Group::Sky => {
                        let which = all & !met;
                        if !sees_sky(stage) || !which.any() {
                            continue;
                        }
                        walks.leave_each(scene, i, which, &mut points);
                        other = Point::of_each(lanes, which, Place::Infinite, |k| &points[k]);
                        (which, &other)
                    }
                };
                if which.any() {
                    self.arrive_at(stage, &walk, (which, point), next, connections, inside, sink);
                }
            }
        }
    }

    /// How many connections a vertex takes at most.
    fn connections_of_each<L: Lanes>(&self, stage: Stage<'_, L>) -> u32 {
        let samples = self.evaluated.multiplicity(stage.connecting());
        match stage.transport {
            Transport::Radiance => samples * stage.scene.lights().next_event_samples(),
            Transport::Importance => samples,
        }
    }

    /// Where walks come to what is met first, of those in the lanes `plain` whose rays begin at the `at`-th.
    #[inline(always)]
    fn is_met_first<L: Lanes>(
        &self,
        Stage { lanes, scene, .. }: Stage<'_, L>,
        walks: &Walks,
        hits: &Hits,
        at: usize,
        plain: L::M,
    ) -> L::M {
        let mut these = lanes.first(L::N);
        if scene.geometry().has_coincident() {
            let mut first = 0;
            for k in plain.lanes() {
                let (ray, left) = (walks.ray(at + k), walks.left(at + k));
                let is_first = |hit| scene.geometry().is_met_first(&ray, left, &hit);
                first |= u32::from(hits.get(at + k).is_some_and(is_first)) << k;
            }
            these = these & lanes.mask(first);
        }
        these
    }

    /// The same for the lanes `which` of a group.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the queues are borrowed one by one")]
    fn arrive_at<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        (which, point): (L::M, &Point<L, Bsdfs<L>>),
        next: &mut Walks,
        connections: &mut Connections,
        inside: &mut [Inside],
        sink: &mut impl WaveSink,
    ) {
        // Lights are of all kinds; all that comes after them lies on surfaces.
        let first = stage.transport == Transport::Importance && stage.vertices == 2;
        for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
            let which = if first { which & walk.leaves(place) } else { which };
            if (first || place == Place::Surface) && which.any() {
                self.arrive_from(stage, walk, (place, which, point), next, connections, inside, sink);
            }
        }
    }

    /// The same for lanes that come from such a `place`.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the queues are borrowed one by one")]
    fn arrive_from<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        (place, which, point): (Place, L::M, &Point<L, Bsdfs<L>>),
        next: &mut Walks,
        connections: &mut Connections,
        inside: &mut [Inside],
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, vertices, transport, .. } = stage;
        let from = walk.from(place);
        let here = Step::arriving(&walk.departure, &from, *point, lanes.splat(1.0));
        sink.walked(transport, count(which));
        match transport {
            Transport::Radiance => {
                self.hit(stage, walk, &from, &here, which, sink);
                if point.place == Place::Infinite {
                    return;
                }
                self.connect(stage, walk, &here, which, connections, sink);
            }
            Transport::Importance => {
                let which = which & here.vertex.point.bsdf.has_continuous(lanes);
                self.splat(stage, &here, which, connections, sink);
            }
        }
        if vertices == stage.most {
            return;
        }
        self.scatter(stage, walk, &here, which, (next, inside), sink);
    }

    /// How the walks of the lanes `which` leave their vertex.
    #[inline(always)]
    fn scatter<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        (next, inside): (&mut Walks, &mut [Inside]),
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, vertices, transport, .. } = stage;
        let stream = if transport == Transport::Radiance { Stream::Camera } else { Stream::Light };
        let mut numbers = stage.numbers([walk.scrambles[0], walk.index], stream, stage.taken());
        numbers.start(Block::scattering(vertices - 1));
        let u = numbers.next_three();
        let survive: Chance<L::U> = numbers.next_chance();
        let rules = Rules { transport, directions: self.evaluated.directions(), roulette: self.roulette };
        let scattered = here.scatter(rules, vertices - 1, walk.whole, u, survive);
        sink.lost_to_sides(count(scattered.lost_to_sides & which));
        let (p, goes_on) = (&here.vertex.point, scattered.goes_on & which);
        if stage.scene.media().is_some() && p.bsdf.may_transmit() {
            let through = p.normal.dot(scattered.departure.direction) * p.normal.dot(here.back.direction);
            go_through(walk, goes_on & through.lt(lanes.splat(0.0)), inside);
        }
        let onwards = Walk {
            departure: scattered.departure,
            whole: scattered.whole,
            position: p.position,
            normal: p.normal,
            primitive: words(lanes, p),
            flags: scattered.is_delta.select(lanes.splat_u(DELTA), lanes.splat_u(0)),
            ..*walk
        };
        next.push(&onwards, goes_on);
    }
}

/// What is done at a time of the lanes of a group.
#[derive(Clone, Copy)]
enum Group {
    /// Plain points of one kind.
    Plain(Kind),
    /// All other surfaces.
    Others,
    /// What has left the scene.
    Sky,
}

impl Group {
    const ALL: [Self; 6] = {
        let [a, b, c, d] = Kind::ALL;
        [Self::Plain(a), Self::Plain(b), Self::Plain(c), Self::Plain(d), Self::Others, Self::Sky]
    };
}

/// Whether walks that leave the scene come to a sky.
#[inline(always)]
fn sees_sky<L: Lanes>(stage: Stage<'_, L>) -> bool {
    stage.transport == Transport::Radiance && stage.scene.lights().has_environment()
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
fn deposit(sink: &mut impl WaveSink, strategy: Strategy, raster: [f32; 2], value: Rgb) {
    if value == Rgb::ZERO {
        return;
    }
    if has_a_place(value) {
        sink.deposit(strategy, Raster(raster.into()), value);
    } else {
        sink.reject(strategy);
    }
}
