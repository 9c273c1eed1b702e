//! What a wave of walks from the camera does: it starts at the lens, hits lights, takes next-event estimates, and
//! connects its vertices to those of light subpaths.

use glam::Vec3;

use super::{
    CameraEnd, Queues, Stage, Starts, WaveSink, deposit,
    queue::{CONNECTS, INSIDE, Walk, Walks, has},
    store::{Kind, LightEnd, VertexStore},
};
use crate::{
    integrator::Integrator,
    lanes::{Float, Lanes, MOST, Mask, Unsigned, Vector},
    math::Rgb,
    path::{Departure, Joint, RivalSum, Step, Strategy, Tail, is_hittable},
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
        let mut outside = true;
        if let Some(media) = scene.media() {
            let mut start = Inside::NOTHING;
            start.start_at_lens(scene, media, camera.lens_point().position);
            outside = start.is_nothing();
            inside.clear();
            inside.resize(starts.len, start);
        }
        let ([nothing, _], one) = (PrimitiveId::NONE.words(), lanes.splat(1.0));
        let nothing = lanes.splat_u(nothing);
        for i in (0..starts.len).step_by(L::N) {
            let corner = [lanes.load(&starts.corners[0][i..]), lanes.load(&starts.corners[1][i..])];
            let key = lanes.load_u(&starts.keys[i..]);
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
                flags: lanes.splat_u(if outside { 0 } else { INSIDE }),
                raster,
                scrambles: [kept[0], kept_for_connections[0]],
                index: kept[1],
                number: lanes.whole_numbers(|k| (i + k) as u32),
            };
            let connects = has(lanes.load_u(&starts.flags[i..]), CONNECTS);
            walks.push(&walk, some & connects & lanes.first(starts.len - i));
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
                deposit(sink, strategy, [x[k], y[k]], Rgb::from_array(value[k]));
            }
        }
    }

    /// s ≥ 1: next-event estimation at the vertices of the lanes `which`, and their connections to the light vertices
    /// of their own pixels, up to the rays.
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
        let Stage { lanes, vertices: t, .. } = stage;
        let which = which & here.vertex.point.bsdf.has_continuous(lanes);
        if !which.any() {
            return;
        }
        let samples = self.next_event_samples(stage);
        let levels = queues.light_vertices.levels();
        // One call for all: each would be a copy of what it does.
        for n in 0..samples + 2 * levels.len() as u32 {
            let (s, kind) = match n.checked_sub(samples) {
                None => (1, None),
                Some(i) => (levels.start + i / 2, Some(if i % 2 == 0 { Kind::Lambert } else { Kind::Other })),
            };
            let strategy = Strategy { s, t };
            let times = if s == 1 { 1 } else { self.evaluated.multiplicity(strategy) };
            if times == 0 {
                continue;
            }
            let ends = match kind {
                None => Ends::sample(stage, walk, here, which, n),
                Some(kind) => Ends::kept(stage, &queues.light_vertices, (s, kind), walk, which),
            };
            for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
                if let Some((end, which)) = ends.at(stage, place) {
                    let z = CameraEnd { step: here, tail: walk.tail(here), raster: walk.raster };
                    self.join(stage, strategy, (&z, &end), (which, times), &mut queues.connections, sink);
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

/// To what the vertices of a group are connected.
#[expect(clippy::large_enum_variant, reason = "none is kept, and the usual ones are the smaller")]
enum Ends<L: Lanes> {
    /// Points of few lights, their densities, and where there is one.
    Plain(Point<L, Bsdfs<L>>, PdfArea<L::F>, L::M),
    /// Points of any lights, their densities, and a bit for each lane that has one.
    Any([Point; MOST], PdfArea<L::F>, u32),
    /// Vertices of light subpaths, and where there is one.
    Kept(LightEnd<L>, L::M),
}

impl<L: Lanes> Ends<L> {
    /// The `n`-th point of a light for each of the lanes `which`.
    #[inline(always)]
    fn sample(stage: Stage<'_, L>, walk: &Walk<L>, here: &Step<L, Bsdfs<L>>, which: L::M, n: u32) -> Self {
        let Stage { lanes, scene, vertices: t, .. } = stage;
        let mut numbers = stage.numbers([walk.scrambles[1], walk.index], Stream::Connection, 0);
        numbers.start(Block::repeated(t - 2, n));
        let (square, [high, low]) = (numbers.next_square(), numbers.next_choice_words());
        if let Some(lights) = scene.few_lights() {
            let (triangle, density) = lights.choose([high, low]);
            let (point, plain) = scene.plain_points(lanes, which, triangle, warp::triangle(square.coordinates()));
            let some = which & plain & lanes.splat(0.0).lt(density);
            return Self::Plain(point, PdfArea(density), some);
        }
        let receivers = Receiver::all(&here.vertex.point);
        let nth = n % scene.lights().next_event_samples();
        let (high, low, u, v) = (high.all(), low.all(), square.0[0].all(), square.0[1].all());
        let (mut points, mut density, mut some) = ([Point::nowhere(Vec3::ZERO); MOST], [1.0; MOST], 0);
        for k in which.lanes() {
            let (choice, square) = (Choice::of_words(high[k], low[k]), Square([u[k], v[k]]));
            if let Some((point, pdf)) = scene.sample_light(&receivers(k), square, choice, nth) {
                (points[k], density[k]) = (point, pdf.0);
                some |= 1 << k;
            }
        }
        Self::Any(points, PdfArea(lanes.load(&density)), some)
    }

    /// The s-th light vertices of this kind.
    #[inline(always)]
    fn kept(
        Stage { lanes, .. }: Stage<'_, L>,
        vertices: &VertexStore,
        (s, kind): (u32, Kind),
        walk: &Walk<L>,
        which: L::M,
    ) -> Self {
        let which = vertices.which(lanes, s, kind, walk.number, which);
        Self::Kept(vertices.get(lanes, s, kind, walk.number, which), which)
    }

    /// Those that are such `place`s, and where there is one.
    #[inline(always)]
    fn at(&self, Stage { lanes, scene, .. }: Stage<'_, L>, place: Place) -> Option<(LightEnd<L>, L::M)> {
        let of_light = |point, pdf, which| (LightEnd::next_event(scene, point, pdf), which);
        match self {
            Self::Plain(point, pdf, some) => {
                (place == Place::Surface && some.any()).then(|| of_light(*point, *pdf, *some))
            }
            Self::Any(points, pdf, some) => {
                let which = lanes.condition(|k| some >> k & 1 == 1 && points[k].place == place);
                which.any().then(|| of_light(Point::of_each(lanes, which, place, |k| &points[k]), *pdf, which))
            }
            Self::Kept(end, some) => (place == Place::Surface && some.any()).then_some((*end, *some)),
        }
    }
}
