//! What a wave of walks from the camera does: it starts at the lens, hits lights, and takes next-event estimates.

use glam::Vec3;

use super::{
    Stage, Starts, WaveSink, count, deposit,
    queue::{Connection, Connections, DELTA, Walk, Walks},
    words,
};
use crate::{
    integrator::Integrator,
    lanes::{Float, Lanes, MOST, Mask, Unsigned, Vector},
    math::Rgb,
    path::{Around, Departure, Joint, RivalSum, Step, Strategy, Tail, are_directions, is_hittable},
    sampling::{Block, Choice, Numbers, PdfArea, Sampler, Square, Stream, warp},
    scene::{
        bsdf::Bsdfs,
        geometry::{PrimitiveId, Ray},
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
        starts: &mut Starts,
        (walks, inside): (&mut Walks, &mut Vec<Inside>),
    ) {
        let Stage { lanes, scene, kind, seed, .. } = stage;
        let camera = &scene.camera;
        let lens = stage.lens();
        let p = &lens.vertex.point;
        starts.pad();
        walks.0.clear(starts.len);
        if let Some(media) = scene.media() {
            let mut start = Inside::NOTHING;
            start.start_at_lens(scene, media, camera.lens_point().position);
            inside.clear();
            inside.resize(starts.len, start);
        }
        let [nothing, _] = PrimitiveId::NONE.words();
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
                flags: lanes.splat_u(0),
                raster,
                scrambles: [kept[0], kept_for_connections[0]],
                index: kept[1],
                number: lanes.whole_numbers(|k| (i + k) as u32),
            };
            walks.push(&walk, some & lanes.first(starts.len - i));
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
        let value = contribution.times(self.share(stage, strategy, walk, &joint, here, (end, here.pdf_fwd)));
        let value = value.channels().all();
        let (x, y) = (walk.raster[0].all(), walk.raster[1].all());
        for k in (lights & !contribution.is_black()).lanes() {
            for _ in 0..times {
                deposit(sink, strategy, [x[k], y[k]], Rgb::from_array(value[k]));
            }
        }
    }

    /// s = 1: next-event estimation at the vertices of the lanes `which`, up to the ray.
    #[inline(always)]
    pub(super) fn connect<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        connections: &mut Connections,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, vertices: t, .. } = stage;
        let (samples, of_each) = (self.connections_of_each(stage), scene.lights().next_event_samples());
        let which = which & here.vertex.point.bsdf.has_continuous(lanes);
        if samples == 0 || !which.any() {
            return;
        }
        for n in 0..samples {
            let mut numbers = stage.numbers([walk.scrambles[1], walk.index], Stream::Connection, 0);
            numbers.start(Block::repeated(t - 2, n));
            let (square, choice) = (numbers.next_square(), numbers.next_choice_words());
            let ends = Ends::sample(stage, here, which, (square, choice, n % of_each));
            for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
                if let Some((end, which)) = ends.at(lanes, place) {
                    self.next_event(stage, walk, [here, &end], which, connections, sink);
                }
            }
        }
    }

    /// The connection of the vertices of the lanes `which` with points of lights.
    #[inline(always)]
    pub(super) fn next_event<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        [here, end]: [&Step<L, Bsdfs<L>>; 2],
        which: L::M,
        connections: &mut Connections,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, .. } = stage;
        let strategy = stage.connecting();
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
            ends: [z.position, y.position],
            value,
            raster: walk.raster,
        };
        connections.push(&connection, open & !z.is_in_one_plane_with(y));
    }

    /// w/n of a path whose camera prefix ends at `here` and whose light is at `end`, where the technique has put it
    /// with the density `pdf_end`.
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
        let is_delta = !(walk.flags & lanes.splat_u(DELTA)).eq(lanes.splat_u(0));
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

/// A vertex on a light in each lane.
type LightStep<L> = Step<L, Bsdfs<L>>;

/// What next-event estimation has sampled.
#[expect(clippy::large_enum_variant, reason = "neither is kept, and the usual one is the smaller")]
enum Ends<L: Lanes> {
    /// Points of few lights, and where there is one.
    Plain(LightStep<L>, L::M),
    /// Points of any lights, their densities, and a bit for each lane that has one.
    Any([Point; MOST], PdfArea<L::F>, u32),
}

impl<L: Lanes> Ends<L> {
    /// A point of a light for each of the lanes `which`.
    #[inline(always)]
    fn sample(
        Stage { lanes, scene, .. }: Stage<'_, L>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        (square, [high, low], nth): (Square<L::U>, [L::U; 2], u32),
    ) -> Self {
        if let Some(lights) = scene.few_lights() {
            let (triangle, density) = lights.choose([high, low]);
            let points = scene.plain_points(lanes, which, triangle, warp::triangle(square.coordinates()));
            let some = which & points.which & lanes.splat(0.0).lt(density);
            return Self::Plain(Step::next_event(points.point, PdfArea(density)), some);
        }
        let receivers = Receiver::all(&here.vertex.point);
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

    /// Those that are such `place`s, and where there is one.
    #[inline(always)]
    fn at(&self, lanes: L, place: Place) -> Option<(LightStep<L>, L::M)> {
        match self {
            Self::Plain(end, some) => (place == Place::Surface && some.any()).then_some((*end, *some)),
            Self::Any(points, density, some) => {
                let which = lanes.condition(|k| some >> k & 1 == 1 && points[k].place == place);
                if !which.any() {
                    return None;
                }
                Some((Step::next_event(Point::of_each(lanes, which, place, |k| &points[k]), *density), which))
            }
        }
    }
}
