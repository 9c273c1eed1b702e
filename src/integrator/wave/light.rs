//! What a wave of walks from lights does: it starts on them, and connects every vertex to the lens.

use glam::Vec3;

use super::{
    CameraEnd, Queues, Stage, Starts, Wave, WaveSink,
    queue::{Connections, HITTABLE, SPLATS, Walk, Walks, flag, flag_of, has},
    store::LightEnd,
    words,
};
use crate::{
    integrator::Integrator,
    lanes::{Float, Lanes, MOST, Mask, Select, Unsigned},
    path::{Departure, RivalSum, Step, Strategy, Tail, is_hittable},
    sampling::{Block, Choice, Numbers, PdfArea, PdfSolidAngle, Sampler, Square, Stream},
    scene::{
        bsdf::Bsdfs,
        light::Emission,
        media::Inside,
        point::{Place, Point},
    },
};

/// The beginnings of the walks in all lanes.
struct Emissions {
    of_lane: [Emission; MOST],
    /// A bit for each lane that has one.
    some: u32,
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
        walks.0.clear(starts.len);
        queues.connections.0.clear(starts.len * self.connections_of_each(stage, &queues.light_vertices));
        queues.inside.clear();
        queues.inside.resize(starts.len, Inside::NOTHING);
        queues.lights.clear();
        if self.weighs_camera_walks() {
            queues.lights.resize(starts.len, Point::nowhere(Vec3::ZERO));
        }
        for i in (0..starts.len).step_by(L::N) {
            let key = lanes.load_u(&starts.keys[i..]);
            let flags = lanes.load_u(&starts.flags[i..]);
            let kept = Numbers::<L>::keep(kind, seed, key, sample, Stream::Light);
            let emissions = sample_emissions(stage, kept, stage.has_next(flags) & lanes.first(starts.len - i));
            for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
                let such = |k: usize| emissions.some >> k & 1 == 1 && emissions.of_lane[k].point.place == place;
                let which = lanes.condition(such);
                if which.any() {
                    // The first vertex is there.
                    let stage = Stage { vertices: 1, ..stage };
                    self.leave(stage, (i, kept, flags), &emissions, (which, place), (walks, queues), sink);
                }
            }
        }
    }

    /// The same for the lanes `which`, all of whose points are such `place`s.
    #[inline(always)]
    fn leave<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        (at, kept, flags): (usize, [L::U; 2], L::U),
        emissions: &Emissions,
        (which, place): (L::M, Place),
        (walks, queues): (&mut Walks, &mut Queues),
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, .. } = stage;
        let of = |k: usize| &emissions.of_lane[k];
        let point = Point::of_each(lanes, which, place, |k| &of(k).point);
        let pdf_position = PdfArea(lanes.numbers(|k| of(k).pdf_position.0));
        let direction = lanes.vectors(|k| of(k).direction.to_array());
        let pdf = PdfSolidAngle(lanes.numbers(|k| of(k).pdf_direction.0));
        let (is_hittable, one) = (is_hittable(scene, &point), lanes.splat(1.0));
        let first = LightEnd {
            step: Step::next_event(point, pdf_position),
            tail: Tail::of_one(pdf_position),
            is_hittable,
            next_event_ratio: one,
        };
        self.splat(stage, &first, which & has(flags, SPLATS), &mut queues.connections, sink);
        let zero = lanes.splat(0.0);
        let leaves = which & stage.has_next(flags) & zero.lt(pdf.0) & zero.lt(point.alpha);
        if !leaves.any() {
            return;
        }
        let has_origin = lanes.condition(|k| of(k).origin.is_some());
        let far = lanes.vectors(|k| of(k).origin.unwrap_or_default().to_array());
        let origin = has_origin.select(far, point.ray_origin(direction));
        let departure = Departure::from_light(scene, &first.step, direction, pdf, origin);
        for k in leaves.lanes() {
            if let Some(light) = queues.lights.get_mut(at + k) {
                *light = of(k).point;
            }
            if let Some(media) = scene.media() {
                queues.inside[at + k].start_at_light(scene, media, of(k));
            }
        }
        let walk = Walk::<L> {
            departure,
            whole: departure.beta.max_element(),
            position: point.position,
            normal: point.normal,
            primitive: words(lanes, &point),
            pdf_fwd: pdf_position,
            rivals: RivalSum::none(lanes),
            next_event_ratio: one,
            flags: flags | flag(lanes, HITTABLE, is_hittable) | lanes.splat_u(flag_of(place)),
            raster: [zero; 2],
            scrambles: [kept[0]; 2],
            index: kept[1],
            number: lanes.whole_numbers(|k| (at + k) as u32),
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
        if !self.weighs_camera_walks() {
            return walk.next_event_ratio;
        }
        let number = which.select(walk.number, lanes.splat_u(0)).all();
        let end = Point::of_each(lanes, which, place, |k| &lights[number[k] as usize]);
        scene.lights().pdf_next_event(&end, &here.vertex.point).0 / walk.pdf_fwd.0
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

/// Where and how the walks of the lanes `which` start.
#[inline(always)]
fn sample_emissions<L: Lanes>(stage: Stage<'_, L>, kept: [L::U; 2], which: L::M) -> Emissions {
    let mut numbers = stage.numbers(kept, Stream::Light, 0);
    numbers.start(Block::START);
    let (square, direction) = (numbers.next_square(), numbers.next_two());
    let [high, low] = numbers.next_choice_words();
    let (high, low, u, v) = (high.all(), low.all(), square.0[0].all(), square.0[1].all());
    let (x, y) = (direction[0].all(), direction[1].all());
    let mut emissions = Emissions { of_lane: [Emission::nowhere(); MOST], some: 0 };
    for k in which.lanes() {
        let (choice, square) = (Choice::of_words(high[k], low[k]), Square([u[k], v[k]]));
        if let Some(emission) = stage.scene.sample_emission(choice, square, glam::Vec2::new(x[k], y[k])) {
            emissions.of_lane[k] = emission;
            emissions.some |= 1 << k;
        }
    }
    emissions
}
