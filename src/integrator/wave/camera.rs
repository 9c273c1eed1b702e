//! What a wave of walks from the camera does: it starts at the lens, hits lights, takes next-event estimates, and
//! connects its vertices to those of light subpaths.

use super::{
    CameraEnd, Queues, Stage, Starts, WaveSink, deposit,
    merge::Merge,
    queue::{CONNECTS, Walk, Walks, has},
    store::{Held, LightEnd},
};
use crate::{
    integrator::Integrator,
    lanes::{Float, Lanes, MOST, Mask, Unsigned, Vector},
    math::Rgb,
    path::{Departure, Joint, RivalSum, Step, Strategy, Tail, Technique, is_hittable},
    sampling::{Block, Choice, Numbers, PdfArea, Sampler, Square, Stream, warp},
    scene::{
        bsdf::Bsdfs,
        geometry::PrimitiveId,
        light::Receiver,
        media::Inside,
        point::{Place, Point},
    },
};

impl Integrator {
    /// Every path's way through the lens.
    #[inline(always)]
    pub(super) fn start_at_lens<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        sample: u32,
        starts: &Starts,
        (walks, inside): (&mut Walks, &mut Vec<Inside>),
    ) {
        let Stage { lanes, scene, kind, seed, .. } = stage;
        let camera = &scene.camera;
        let lens = stage.lens();
        let p = &lens.vertex.point;
        walks.0.clear(starts.len);
        if let Some(media) = scene.media() {
            let mut start = Inside::NOTHING;
            start.start_at_lens(scene, media, camera.lens_point().position);
            inside.clear();
            inside.resize(starts.len, start);
        }
        let ([nothing, _], one) = (PrimitiveId::NONE.words(), lanes.splat(1.0));
        let nothing = lanes.splat_u(nothing);
        for i in (0..starts.len).step_by(L::N) {
            let number = lanes.load_u(&starts.order[i..]);
            let ([x, y], of) = (&starts.corners, number.all());
            let corner = [lanes.numbers(|k| x[of[k] as usize]), lanes.numbers(|k| y[of[k] as usize])];
            let key = lanes.whole_numbers(|k| starts.keys[of[k] as usize]);
            let flags = lanes.whole_numbers(|k| starts.flags[of[k] as usize]);
            let kept = Numbers::<L>::keep(kind, seed, key, sample, Stream::Camera);
            let kept_for_connections = Numbers::<L>::keep(kind, seed, key, sample, Stream::Connection);
            let mut numbers = stage.numbers(kept, Stream::Camera, 0);
            numbers.start(Block::START);
            let [x, y] = numbers.next_two();
            let raster = [corner[0] + x, corner[1] + y];
            let (departure, some) = Departure::from_lens(camera, &lens, raster);
            let walk = Walk::<L> {
                departure,
                whole: departure.beta.max_element(),
                position: p.position,
                normal: p.normal,
                primitive: [nothing; 2],
                pdf_fwd: lens.pdf_fwd,
                rivals: RivalSum::none(lanes),
                next_event_ratio: one,
                flags: lanes.splat_u(0),
                raster,
                scrambles: [kept[0], kept_for_connections[0]],
                index: kept[1],
                number,
            };
            walks.push(&walk, some & has(flags, CONNECTS) & lanes.first(starts.len - i));
        }
    }

    /// s = 0: those of the lanes `which` whose vertex lies on a light.
    #[inline(always)]
    pub(super) fn hit<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        from: &Point<L, Bsdfs<L>>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        sink: &mut impl WaveSink,
    ) {
        let Stage { scene, vertices: t, .. } = stage;
        let strategy = Strategy { s: 0, t };
        let times = self.evaluated.multiplicity(strategy);
        let end = &here.vertex.point;
        let lights = which & end.lies_on_light();
        if times == 0 || !lights.any() {
            return;
        }
        let Some(joint) = Joint::hit(scene, from, here) else { return };
        let contribution = joint.contribution(here.beta, None);
        let z = CameraEnd { step: here, tail: walk.tail(here), raster: walk.raster };
        let nothing = Tail::of_one(here.pdf_fwd);
        let share = self.share(stage, strategy, &joint, &z, (end, &nothing, is_hittable(scene, end)));
        let value = contribution.times(share).channels().all();
        let (x, y) = (walk.raster[0].all(), walk.raster[1].all());
        for k in (lights & !contribution.is_black()).lanes() {
            for _ in 0..times {
                deposit(sink, Technique::Bidirectional(strategy), [x[k], y[k]], Rgb::from_array(value[k]));
            }
        }
    }

    /// s ≥ 1: next-event estimation at the vertices of the lanes `which`, and their connections to the light vertices
    /// of their own pixels, up to the rays; and their merges.
    #[inline(always)]
    pub(super) fn connect<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        queues: &mut Queues,
        sink: &mut impl WaveSink,
    ) {
        let which = which & here.vertex.point.bsdf.has_continuous(stage.lanes);
        if which.any() {
            let z = CameraEnd { step: here, tail: walk.tail(here), raster: walk.raster };
            self.connect_to_lights(stage, walk, &z, which, queues, sink);
            self.connect_to_vertices(stage, walk, &z, which, queues, sink);
            let [is_seen, _] = z.tail.is_seen_by_specular;
            let which = which & stage.rivals.camera.meeting_places().admit_seen(is_seen);
            if let Some(map) = stage.map.filter(|_| which.any()) {
                let meetings = &mut queues.meetings;
                stage.lanes.call(Merge { integrator: self, stage, map, z: &z, which, meetings, sink });
            }
        }
    }

    /// s = 1.
    #[inline(always)]
    fn connect_to_lights<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        z: &CameraEnd<'_, L>,
        which: L::M,
        Queues { connections, points, .. }: &mut Queues,
        sink: &mut impl WaveSink,
    ) {
        let strategy = Strategy { s: 1, t: stage.vertices };
        for n in 0..self.next_event_samples(stage) {
            let ends = Ends::sample(stage, walk, z.step, which, n, &mut points.0);
            for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
                if let Some((point, pdf, which)) = ends.at(stage.lanes, place, &points.0) {
                    let end = LightEnd::next_event(stage.scene, point, pdf);
                    self.join(stage, strategy, (z, &end), (which, 1), connections, sink);
                }
            }
        }
    }

    /// s ≥ 2.
    #[inline(always)]
    fn connect_to_vertices<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        z: &CameraEnd<'_, L>,
        which: L::M,
        Queues { connections, light_vertices, .. }: &mut Queues,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, vertices: t, .. } = stage;
        let numbers = walk.number.all();
        for s in light_vertices.levels_of(&numbers, which) {
            let strategy = Strategy { s, t };
            let times = self.evaluated.multiplicity(strategy);
            let kinds = light_vertices.kinds(s, &numbers, which);
            for (kind, which) in Held::ALL.into_iter().zip(kinds) {
                if which != 0 && times > 0 {
                    let which = lanes.mask(which);
                    let end = light_vertices.get(lanes, s, kind, walk.number, which);
                    self.join(stage, strategy, (z, &end), (which, times), connections, sink);
                }
            }
        }
    }

    /// How many next-event estimates a vertex takes.
    pub(super) fn next_event_samples<L: Lanes>(&self, stage: Stage<'_, L>) -> u32 {
        let strategy = Strategy { s: 1, t: stage.vertices };
        self.evaluated.multiplicity(strategy) * stage.scene.lights().next_event_samples()
    }
}

/// Points of lights, their densities, and where there is one.
type Points<L> = (Point<L, Bsdfs<L>>, PdfArea<<L as Lanes>::F>, <L as Lanes>::M);

/// What next-event estimation has sampled.
enum Ends<L: Lanes> {
    /// Of few lights.
    Plain(Points<L>),
    /// Of points of any lights, which are elsewhere, the densities, and a bit for each lane that has one.
    Any(PdfArea<L::F>, u32),
}

impl<L: Lanes> Ends<L> {
    /// The `n`-th point of a light for each of the lanes `which`. Those of any lights are put into `points`.
    #[inline(always)]
    fn sample(
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        n: u32,
        points: &mut [Point; MOST],
    ) -> Self {
        let Stage { lanes, scene, vertices: t, .. } = stage;
        let mut numbers = stage.numbers([walk.scrambles[1], walk.index], Stream::Connection, 0);
        numbers.start(Block::repeated(t - 2, n));
        let (square, [high, low]) = (numbers.next_square(), numbers.next_choice_words());
        if let Some(lights) = scene.few_lights() {
            let light = lights.choose([high, low]);
            let (b, from) = (warp::triangle(square.coordinates()), here.vertex.point.position);
            let (points, pdf) = scene.plain_next_event::<L>(which, &light, from, b);
            return Self::Plain((points.point, pdf, which & points.which & lanes.splat(0.0).lt(pdf.0)));
        }
        let receivers = Receiver::all(&here.vertex.point);
        let nth = n % scene.lights().next_event_samples();
        let (high, low, u, v) = (high.all(), low.all(), square.0[0].all(), square.0[1].all());
        let (mut density, mut some) = ([1.0; MOST], 0);
        for k in which.lanes() {
            let (choice, square) = (Choice::of_words(high[k], low[k]), Square([u[k], v[k]]));
            if let Some((point, pdf)) = scene.sample_light(&receivers(k), square, choice, nth) {
                (points[k], density[k]) = (point, pdf.0);
                some |= 1 << k;
            }
        }
        Self::Any(PdfArea(lanes.load(&density)), some)
    }

    /// Those that are such `place`s, and where there is one.
    #[inline(always)]
    fn at(&self, lanes: L, place: Place, points: &[Point; MOST]) -> Option<Points<L>> {
        match self {
            Self::Plain(points) => {
                let (_, _, some) = points;
                (place == Place::Surface && some.any()).then_some(*points)
            }
            Self::Any(pdf, some) => {
                let which = lanes.condition(|k| some >> k & 1 == 1 && points[k].place == place);
                if !which.any() {
                    return None;
                }
                Some((Point::of_each(lanes, which, place, |k| &points[k]), *pdf, which))
            }
        }
    }
}
