//! What a wave of walks from lights does: it starts on them, and connects every vertex to the lens.

use glam::{Vec2, Vec3};

use super::{
    CameraEnd, Queues, Stage, Starts, Wave, WaveSink,
    queue::{Connections, HITTABLE, SPLATS, Walk, Walks, flag, flag_of, has},
    store::LightEnd,
    words,
};
use crate::{
    integrator::Integrator,
    lanes::{Float, Lanes, MOST, Mask, Select, Unsigned, Vector},
    path::{Departure, RivalSum, Step, Strategy, Tail, is_hittable},
    sampling::{Block, Choice, Numbers, PdfArea, PdfSolidAngle, Sampler, Square, Stream, warp},
    scene::{
        Scene,
        bsdf::Bsdfs,
        light::{Emission, emitted_direction, pdf_of_emitted},
        media::Inside,
        point::{Place, Point},
        records::FewLights,
    },
};

/// The beginnings of walks, all at the same kind of place.
#[derive(Clone, Copy)]
struct Emitted<L: Lanes> {
    point: Point<L, Bsdfs<L>>,
    pdf_position: PdfArea<L::F>,
    direction: L::V,
    pdf_direction: PdfSolidAngle<L::F>,
    /// Where the rays start.
    origin: L::V,
    which: L::M,
}

/// What was sampled for all lanes.
enum Drawn<L: Lanes> {
    /// Of few lights, in empty space.
    Plain(Emitted<L>),
    /// Of any, which are elsewhere: a bit for each lane that has one.
    Any(u32),
}

impl Integrator {
    /// Every path's light, and the connections of the lights themselves to the lens.
    #[inline(always)]
    pub(super) fn start_at_lights<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        sample: u32,
        starts: &Starts,
        wave: &mut Wave,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, kind, seed, .. } = stage;
        let Wave { walks, queues, .. } = wave;
        walks.0.clear(starts.light_paths);
        queues.connections.clear(starts.light_paths * self.connections_of_each(stage, &queues.light_vertices));
        if stage.scene.media().is_some() {
            queues.inside.clear();
            queues.inside.resize(starts.len, Inside::NOTHING);
        }
        queues.lights.clear();
        if self.weighs_camera_walks() && stage.scene.lights().begins_by_power().is_none() {
            queues.lights.resize(starts.len, Point::nowhere(Vec3::ZERO));
        }
        let few = few_lights_in_the_open(stage.scene);
        for i in (0..starts.light_paths).step_by(L::N) {
            let number = lanes.load_u(&starts.lit[i..]);
            let of = number.all();
            let key = lanes.whole_numbers(|k| starts.keys[of[k] as usize]);
            let flags = lanes.whole_numbers(|k| starts.flags[of[k] as usize]);
            let kept = Numbers::<L>::keep(kind, seed, key, sample, Stream::Light);
            let which = stage.has_next(flags) & lanes.first(starts.light_paths - i);
            let drawn = Drawn::sample(stage, few, kept, which, &mut queues.emissions.0);
            for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
                if let Some(emitted) = drawn.at(lanes, place, &queues.emissions.0) {
                    // The first vertex is there.
                    let stage = Stage { vertices: 1, ..stage };
                    if few.is_none() {
                        note_lights(stage.scene, &of, emitted.which, queues);
                    }
                    self.begin(stage, (number, kept, flags), &emitted, (walks, queues), sink);
                }
            }
        }
    }

    /// The same for such beginnings.
    #[inline(always)]
    fn begin<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        (number, kept, flags): (L::U, [L::U; 2], L::U),
        emitted: &Emitted<L>,
        (walks, queues): (&mut Walks, &mut Queues),
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, .. } = stage;
        let Emitted { point, pdf_position, direction, pdf_direction, origin, which } = *emitted;
        let (is_hittable, one) = (is_hittable(scene, &point), lanes.splat(1.0));
        let first = LightEnd {
            step: Step::next_event(point, pdf_position),
            tail: Tail::of_one(pdf_position),
            is_hittable,
            next_event_ratio: one,
        };
        self.splat(stage, &first, which & has(flags, SPLATS), &mut queues.connections, sink);
        let zero = lanes.splat(0.0);
        let leaves = which & stage.has_next(flags) & zero.lt(pdf_direction.0) & zero.lt(point.alpha);
        if !leaves.any() {
            return;
        }
        let departure = Departure::from_light(scene, &first.step, direction, pdf_direction, origin);
        let walk = Walk::<L> {
            departure,
            whole: departure.beta.max_element(),
            position: point.position,
            normal: point.normal,
            primitive: words(lanes, &point),
            pdf_fwd: pdf_position,
            rivals: RivalSum::none(lanes),
            next_event_ratio: one,
            flags: flags | flag(lanes, HITTABLE, is_hittable) | lanes.splat_u(flag_of(point.place)),
            raster: [zero; 2],
            scrambles: [kept[0]; 2],
            index: kept[1],
            number,
        };
        walks.push(&walk, leaves);
    }

    /// Whether weights see what next-event estimation would do.
    pub(super) fn weighs_camera_walks(&self) -> bool {
        self.weighed.camera_vertices() > 0
    }

    /// At the second vertex of walks that have come `from` such a place: the ratio of the two densities of their
    /// lights.
    #[inline(always)]
    pub(super) fn next_event_ratio<L: Lanes>(
        &self,
        Stage { lanes, scene, .. }: Stage<'_, L>,
        walk: &Walk<L>,
        (place, which): (Place, L::M),
        here: &Step<L, Bsdfs<L>>,
        lights: &[Point],
    ) -> L::F {
        if lights.is_empty() {
            if place != Place::Surface || !self.weighs_camera_walks() {
                return walk.next_event_ratio;
            }
            // Next-event estimation chooses the lights as emission does, but not always the places on them.
            let places = (here.vertex.point.position, walk.position, walk.normal);
            return scene.next_event_ratio::<L>(which, walk.primitive, places, walk.pdf_fwd);
        }
        let number = which.select(walk.number, lanes.splat_u(0)).all();
        let end = Point::of_each(lanes, which, place, |k| &lights[number[k] as usize]);
        scene.pdf_next_event(&end, &here.vertex.point).0 / walk.pdf_fwd.0
    }

    /// t = 1: the connections of the ends of the lanes `which` to the lens, up to the rays.
    #[inline(always)]
    pub(super) fn splat<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        end: &LightEnd<L>,
        which: L::M,
        connections: &mut Connections,
        sink: &mut impl WaveSink,
    ) {
        let strategy = Strategy { s: stage.vertices, t: 1 };
        // (1,1) does not show points and suns, which have no extent on the image.
        let which = if strategy.s == 1 { which & end.is_hittable } else { which };
        let times = self.evaluated.multiplicity(strategy);
        if times == 0 || !which.any() {
            return;
        }
        let lens = stage.lens();
        let nowhere = [stage.lanes.splat(0.0); 2];
        let z = CameraEnd { step: &lens, tail: Tail::of_one(lens.pdf_fwd), raster: nowhere };
        self.join(stage, strategy, (&z, end), (which, times), connections, sink);
    }
}

/// The few lights of a scene, where walks that leave them are in nothing.
fn few_lights_in_the_open(scene: &Scene) -> Option<&FewLights> {
    let clear = |id| scene.media().is_none_or(|media| media.light_is_clear(id));
    scene.few_lights().filter(|lights| lights.ids().all(clear))
}

/// [`Scene::sample_emission`] out of line: for one lane of many.
#[inline(never)]
fn sample_alone(scene: &Scene, choice: Choice, place: Square, direction: Vec2) -> Option<Emission> {
    scene.sample_emission(choice, place, direction)
}

/// Notes, of walks of the lanes `which` with these numbers, on which lights and in what they begin.
#[inline(always)]
fn note_lights(scene: &Scene, numbers: &[u32; MOST], which: impl Mask, queues: &mut Queues) {
    let Queues { lights, inside, emissions, .. } = queues;
    for k in which.lanes() {
        let (emission, number) = (&emissions.0[k], numbers[k] as usize);
        if let Some(light) = lights.get_mut(number) {
            *light = emission.point;
        }
        if let Some(media) = scene.media() {
            inside[number].start_at_light(scene, media, emission);
        }
    }
}

impl<L: Lanes> Emitted<L> {
    /// Those of the lanes `which`, all of which start at such a `place`.
    #[inline(always)]
    fn of_each(lanes: L, which: L::M, place: Place, each: &[Emission; MOST]) -> Self {
        let point = Point::of_each(lanes, which, place, |k| &each[k].point);
        let direction = lanes.vectors(|k| each[k].direction.to_array());
        let has_origin = lanes.condition(|k| each[k].origin.is_some());
        let far = lanes.vectors(|k| each[k].origin.unwrap_or_default().to_array());
        Self {
            point,
            pdf_position: PdfArea(lanes.numbers(|k| each[k].pdf_position.0)),
            direction,
            pdf_direction: PdfSolidAngle(lanes.numbers(|k| each[k].pdf_direction.0)),
            origin: has_origin.select(far, point.ray_origin(direction)),
            which,
        }
    }
}

impl<L: Lanes> Drawn<L> {
    /// Where and how the walks of the lanes `which` start: of `few` lights, or of any, which are put into `each`.
    #[inline(always)]
    fn sample(
        stage: Stage<'_, L>,
        few: Option<&FewLights>,
        kept: [L::U; 2],
        which: L::M,
        each: &mut [Emission; MOST],
    ) -> Self {
        let Stage { lanes, scene, .. } = stage;
        let mut numbers = stage.numbers(kept, Stream::Light, 0);
        numbers.start(Block::START);
        let (square, u) = (numbers.next_square(), numbers.next_two());
        let [high, low] = numbers.next_choice_words();
        if let Some(lights) = few {
            let light = lights.choose([high, low]);
            let points = scene.plain_points(lanes, which, light.triangle, warp::triangle(square.coordinates()));
            let (point, pdf_position) = (points.point, scene.lights().pdf_position(&points.point));
            let direction = emitted_direction(point.normal, light.both, u);
            return Self::Plain(Emitted {
                point,
                pdf_position,
                direction,
                pdf_direction: PdfSolidAngle(pdf_of_emitted(light.both, point.normal.dot(direction))),
                origin: point.ray_origin(direction),
                which: which & points.which & lanes.splat(0.0).lt(pdf_position.0),
            });
        }
        let (high, low, [x, y]) = (high.all(), low.all(), [u[0].all(), u[1].all()]);
        let (s, t) = (square.0[0].all(), square.0[1].all());
        let mut some = 0;
        for k in which.lanes() {
            let (choice, place) = (Choice::of_words(high[k], low[k]), Square([s[k], t[k]]));
            if let Some(emission) = sample_alone(scene, choice, place, Vec2::new(x[k], y[k])) {
                each[k] = emission;
                some |= 1 << k;
            }
        }
        Self::Any(some)
    }

    /// Those that start at such a `place`, if there are any.
    #[inline(always)]
    fn at(&self, lanes: L, place: Place, each: &[Emission; MOST]) -> Option<Emitted<L>> {
        match self {
            Self::Plain(emitted) => (place == Place::Surface && emitted.which.any()).then_some(*emitted),
            Self::Any(some) => {
                let which = lanes.condition(|k| some >> k & 1 == 1 && each[k].point.place == place);
                which.any().then(|| Emitted::of_each(lanes, which, place, each))
            }
        }
    }
}
