//! Waves: the paths of a task all at once, stage by stage, each in its own lane.
//!
//! What happens at a vertex and a joint is the text of [`crate::path`], in as many lanes as the processor has; here is
//! what comes between: which paths are where, in queues side by side. All paths of a wave are at the same vertex, so
//! that all use the same block of random numbers, the same entries of the table and the same rule for roulette. The
//! numbers are those of [`Integrator::estimate_from_camera`], bit by bit, and so is every deposit.

mod queue;

use glam::Vec3;

use self::queue::{Connection, Connections, Walk, Walks};
use super::Integrator;
use crate::{
    lanes::{Float, Lanes, MOST, Mask, Select, Unsigned, Vector},
    math::Rgb,
    path::{Around, Departure, Joint, RivalSum, Rivals, Rules, Step, Strategy, Tail, are_directions, is_hittable},
    sampling::{Block, Chance, Choice, PdfArea, Sampler, Sobol, Square, warp},
    scene::{
        Scene,
        bsdf::{Bsdfs, Lobe, Transport},
        camera::Raster,
        geometry::{Hits, PrimitiveId, Ray, Rays},
        light::Receiver,
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
#[derive(Debug)]
pub struct Wave {
    walks: Walks,
    /// Those that go on from the present vertex.
    next: Walks,
    rays: Rays,
    hits: Hits,
    connections: Connections,
    blocked: Vec<bool>,
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

impl Wave {
    /// Empty queues.
    pub fn new() -> Self {
        Self {
            walks: Walks::new(),
            next: Walks::new(),
            rays: Rays::default(),
            hits: Hits::default(),
            connections: Connections::new(),
            blocked: Vec::new(),
        }
    }
}

impl Default for Wave {
    fn default() -> Self {
        Self::new()
    }
}

/// The vertex at which all paths of a wave are.
#[derive(Clone, Copy)]
struct Stage<'a, L> {
    lanes: L,
    scene: &'a Scene,
    rivals: &'a Rivals,
    /// Vertices of the camera prefix, the present one counted.
    t: u32,
}

impl Integrator {
    /// Whether a wave can do what this integrator does in this scene. What it can't is done path by path, with the same
    /// result.
    pub fn makes_waves(&self, scene: &Scene) -> bool {
        let camera_alone = self.evaluated.strategies().all(|x| x.s <= 1 && x.t >= 2) && self.evaluated.area() == 0;
        camera_alone
            && self.walks_from_camera()
            && self.rivals.is_some()
            && self.evaluated.splits() == 1
            && self.connections.is_none()
            && !(scene.camera.has_aperture() || scene.camera.is_orthographic())
            && scene.is_all_there()
            && scene.media().is_none()
    }

    /// One sample of each of some pixels: walks their camera subpaths, joins them with lights by every strategy of the
    /// table, and deposits, as [`Self::estimate_from_camera`] does path by path.
    #[inline(always)]
    pub fn estimate_in_waves<L: Lanes>(
        &self,
        lanes: L,
        scene: &Scene,
        (seed, sample): (u64, u32),
        starts: &mut Starts,
        wave: &mut Wave,
        sink: &mut impl WaveSink,
    ) {
        let Some(rivals) = &self.rivals else { return };
        self.start(lanes, scene, (seed, sample), starts, &mut wave.walks);
        for t in 2..=self.evaluated.camera_vertices() {
            if wave.walks.0.len() == 0 {
                return;
            }
            let stage = Stage { lanes, scene, rivals, t };
            wave.walks.put_rays(&mut wave.rays);
            scene.geometry().closest_of_each(&wave.rays, &mut wave.hits);
            self.arrive(stage, wave, sink);
            let Wave { connections, rays, blocked, .. } = wave;
            if connections.0.len() > 0 {
                connections.put_rays(rays);
                scene.geometry().obstacle_of_each(rays, blocked);
                for (i, _) in blocked.iter().enumerate().filter(|(_, blocked)| !**blocked) {
                    let (value, raster) = connections.value(i);
                    deposit(sink, Strategy { s: 1, t }, raster, value);
                }
            }
            std::mem::swap(&mut wave.walks, &mut wave.next);
        }
    }

    /// Every path's way through the lens.
    #[inline(always)]
    fn start<L: Lanes>(
        &self,
        lanes: L,
        scene: &Scene,
        (seed, sample): (u64, u32),
        starts: &mut Starts,
        walks: &mut Walks,
    ) {
        let camera = &scene.camera;
        let lens_point = camera.lens_point();
        let lens = Point::of_each(lanes, lanes.first(L::N), lens_point.place, |_| &lens_point);
        let beta = 1.0 / camera.pdf_lens().0;
        starts.pad();
        walks.0.clear(starts.len);
        for i in (0..starts.len).step_by(L::N) {
            let corner = [lanes.load(&starts.corners[0][i..]), lanes.load(&starts.corners[1][i..])];
            let key = lanes.load_u(&starts.keys[i..]);
            let [mut numbers, _, connection, _] = Sobol::<L>::streams(seed, key, lanes.splat_u(sample));
            numbers.start(Block::START);
            let [x, y] = numbers.next_two();
            let raster = [corner[0] + x, corner[1] + y];
            let direction = camera.direction_through(&lens, raster);
            // Rounding may put a sample of the padded film's border outside it.
            let seen = camera.look_in_lanes(&lens, direction);
            let beta = (seen.we * lens.normal.dot(direction) / seen.pdf.0) * beta;
            let beta = Rgb::of(L::V::new(beta, beta, beta));
            let ([scramble, index], [connection, _]) = (numbers.place(), connection.place());
            let walk = Walk::<L> {
                departure: Departure {
                    origin: lens.position,
                    direction,
                    pdf: seen.pdf,
                    beta,
                    survival: lanes.splat(1.0),
                },
                whole: beta.max_element(),
                position: lens.position,
                normal: lens.normal,
                primitive: PrimitiveId::NONE.words().map(|word| lanes.splat_u(word)),
                is_delta: lanes.splat_u(0),
                raster,
                scrambles: [scramble, connection],
                index,
            };
            walks.push(&walk, seen.some & lanes.first(starts.len - i));
        }
    }

    /// What happens at the vertex to which the rays have come.
    #[inline(always)]
    fn arrive<L: Lanes>(&self, stage: Stage<'_, L>, wave: &mut Wave, sink: &mut impl WaveSink) {
        let Stage { lanes, scene, t, .. } = stage;
        let Wave { walks, next, hits, connections, .. } = wave;
        let len = walks.0.len();
        next.0.clear(len);
        let multiplicity = self.evaluated.multiplicity(Strategy { s: 1, t });
        connections.0.clear(len * (scene.lights().next_event_samples() * multiplicity) as usize);
        let mut points = [Point::nowhere(Vec3::ZERO); MOST];
        for i in (0..len).step_by(L::N) {
            let walk = walks.get(lanes, i);
            let all = lanes.first(len - i);
            let met = hits.any(lanes, i) & all;
            let plain = met & lanes.condition(|k| scene.is_plain(hits.primitive(i + k)));
            if plain.any() {
                let (index, b) = hits.places(lanes, i);
                let point = scene.plain_points(lanes, plain, index, b);
                self.arrive_at(stage, &walk, (plain, point), next, connections, sink);
            }
            let others = met & !plain;
            if others.any() {
                for k in others.lanes() {
                    if let Some(hit) = hits.get(i + k) {
                        points[k] = scene.point_at(&walks.ray(i + k), &hit);
                    }
                }
                let point = Point::of_each(lanes, others, Place::Surface, |k| &points[k]);
                self.arrive_at(stage, &walk, (others, point), next, connections, sink);
            }
            let missed = all & !met;
            if missed.any() && scene.lights().has_environment() {
                for k in missed.lanes() {
                    if let Some(sky) = scene.lights().environment_at(walks.ray(i + k).direction) {
                        points[k] = sky;
                    }
                }
                let point = Point::of_each(lanes, missed, Place::Infinite, |k| &points[k]);
                self.arrive_at(stage, &walk, (missed, point), next, connections, sink);
            }
        }
    }

    /// The same for the lanes `which` of a group.
    #[inline(always)]
    fn arrive_at<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        (which, point): (L::M, Point<L, Bsdfs<L>>),
        next: &mut Walks,
        connections: &mut Connections,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, t, .. } = stage;
        let from = walk.from(Place::Surface);
        let here = Step::arriving(&walk.departure, &from, point, lanes.splat(1.0));
        sink.walked(Transport::Radiance, count(which));
        self.hit(stage, walk, &from, &here, which, sink);
        if point.place == Place::Infinite {
            return;
        }
        self.connect(stage, walk, &here, which, connections, sink);
        if t == self.evaluated.camera_vertices() {
            return;
        }
        let mut numbers = Sobol::<L>::at(walk.scrambles[0], walk.index);
        numbers.start(Block::scattering(t - 1));
        let u = numbers.next_three();
        let survive: Chance<L::U> = numbers.next_chance();
        let (transport, directions) = (Transport::Radiance, self.evaluated.directions());
        let rules = Rules { transport, directions, roulette: self.roulette };
        let scattered = here.scatter(rules, t - 1, walk.whole, u, survive);
        sink.lost_to_sides(count(scattered.lost_to_sides & which));
        let p = &here.vertex.point;
        let (zero, one) = (lanes.splat_u(0), lanes.splat_u(1));
        let is_delta = lanes.condition(|k| L::lane(&scattered.lobe, k) != Lobe::Continuous);
        let onwards = Walk {
            departure: scattered.departure,
            whole: scattered.whole,
            position: p.position,
            normal: p.normal,
            primitive: words(lanes, p),
            is_delta: is_delta.select(one, zero),
            ..*walk
        };
        next.push(&onwards, scattered.goes_on & which);
    }

    /// s = 0: those of the lanes `which` whose vertex lies on a light.
    #[inline(always)]
    fn hit<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        from: &Point<L, Bsdfs<L>>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, t, .. } = stage;
        let strategy = Strategy { s: 0, t };
        let times = self.evaluated.multiplicity(strategy);
        let end = &here.vertex.point;
        let lights = which & end.lies_on_light();
        if times == 0 || !lights.any() {
            return;
        }
        let Some(joint) = Joint::hit(scene, from, here) else { return };
        let contribution = joint.contribution(here.beta, None);
        let value = contribution.times(self.share(stage, strategy, walk, &joint, here, (end, here.pdf_fwd)));
        let value = value.channels().all();
        let [x, y] = walk.raster.map(Float::all);
        for k in (lights & !contribution.is_black()).lanes() {
            for _ in 0..times {
                deposit(sink, strategy, [x[k], y[k]], Rgb::from_array(value[k]));
            }
        }
    }

    /// s = 1: next-event estimation at the vertices of the lanes `which`, up to the ray.
    #[inline(always)]
    fn connect<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        connections: &mut Connections,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, t, .. } = stage;
        let lights = scene.lights();
        let of_each = lights.next_event_samples();
        let samples = of_each * self.evaluated.multiplicity(Strategy { s: 1, t });
        let which = which & here.vertex.point.bsdf.has_continuous(lanes);
        if samples == 0 || !which.any() {
            return;
        }
        let receivers = Receiver::all(&here.vertex.point);
        let (mut ends, mut pdf, mut triangles) = ([Point::nowhere(Vec3::ZERO); MOST], [1.0; MOST], [0; MOST]);
        for n in 0..samples {
            let mut numbers = Sobol::<L>::at(walk.scrambles[1], walk.index);
            numbers.start(Block::repeated(t - 2, n));
            let square = numbers.next_square();
            let ([high, low], [u, v]) = (numbers.next_choice_words().map(Unsigned::all), square.0.map(Unsigned::all));
            // Plain triangles, and all else.
            let (mut plain, mut others) = (0, 0);
            for k in which.lanes() {
                let choice = Choice::of_words(high[k], low[k]);
                let Some(chosen) = lights.choose_next_event(|| receivers(k), choice, n % of_each) else { continue };
                match lights.even_area(chosen.0) {
                    Some((triangle, area)) if scene.is_plain(triangle) => {
                        (triangles[k], pdf[k]) = (triangle.index(), chosen.1 / area);
                        plain |= u32::from(pdf[k] > 0.0) << k;
                    }
                    _ => {
                        let density;
                        (ends[k], density) = scene.on_chosen_light(chosen, Square([u[k], v[k]]));
                        pdf[k] = density.0;
                        others |= u32::from(pdf[k] > 0.0) << k;
                    }
                }
            }
            let density = PdfArea(lanes.load(&pdf));
            if plain != 0 {
                let (which, b) = (lanes.mask(plain), warp::triangle(square.coordinates()));
                let point = scene.plain_points(lanes, which, lanes.load_u(&triangles), b);
                self.next_event(stage, walk, [here, &Step::next_event(point, density)], which, connections, sink);
            }
            for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
                let which = lanes.condition(|k| others >> k & 1 == 1 && ends[k].place == place);
                if which.any() {
                    let point = Point::of_each(lanes, which, place, |k| &ends[k]);
                    self.next_event(stage, walk, [here, &Step::next_event(point, density)], which, connections, sink);
                }
            }
        }
    }

    /// The connection of the vertices of the lanes `which` with points of lights.
    #[inline(always)]
    fn next_event<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        [here, end]: [&Step<L, Bsdfs<L>>; 2],
        which: L::M,
        connections: &mut Connections,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, t, .. } = stage;
        let strategy = Strategy { s: 1, t };
        let (z, y) = (&here.vertex.point, &end.vertex.point);
        let ratio = end.pdf_fwd.0 / scene.lights().pdf_position(y).0;
        let Some(joint) = Joint::connect(scene, strategy, [here, end], ratio) else { return };
        let contribution = joint.contribution(here.beta, Some(end.beta));
        let open = which & !contribution.is_black();
        sink.shadow_rays(count(open));
        let value = contribution.times(self.share(stage, strategy, walk, &joint, here, (y, end.pdf_fwd)));
        let connection = Connection::<L> {
            ray: Ray::joining(z, y),
            primitives: [words(lanes, z), words(lanes, y)],
            value,
            raster: walk.raster,
        };
        connections.push(&connection, open & !z.is_in_one_plane_with(y));
    }

    /// w/n of a path whose camera prefix ends at `here` and whose light is at `end`, with the density `pdf_end` of the technique.
    #[inline(always)]
    fn share<L: Lanes>(
        &self,
        Stage { lanes, scene, rivals, .. }: Stage<'_, L>,
        strategy: Strategy,
        walk: &Walk<L>,
        joint: &Joint<L>,
        here: &Step<L, Bsdfs<L>>,
        (end, pdf_end): (&Point<L, Bsdfs<L>>, PdfArea<L::F>),
    ) -> L::F {
        let none = lanes.mask(0);
        let is_delta = walk.is_delta.eq(lanes.splat_u(1));
        let of_camera = Tail { pdf_fwd: [here.pdf_fwd; 2], is_delta: [is_delta, none], rivals: RivalSum::none(lanes) };
        let of_light = Tail { pdf_fwd: [pdf_end; 2], is_delta: [none; 2], rivals: RivalSum::none(lanes) };
        let around = Around {
            strategy,
            joint,
            camera: &of_camera,
            light: &of_light,
            light_is_hittable: is_hittable(scene, end),
            ends_are_directions: are_directions(&here.vertex.point, end),
        };
        around.weight(rivals, &self.weighed) / lanes.splat(self.weighed.count(strategy))
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
fn deposit(sink: &mut impl WaveSink, strategy: Strategy, raster: [f32; 2], value: Rgb) {
    if value == Rgb::ZERO {
        return;
    }
    if value.is_finite() && value.min_element() >= 0.0 {
        sink.deposit(strategy, Raster(raster.into()), value);
    } else {
        sink.reject(strategy);
    }
}
