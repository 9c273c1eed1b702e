//! What a wave of walks from lights does: it starts on them, and connects every vertex to the lens.

use super::{
    Stage, Starts, Wave, WaveSink, count,
    queue::{Connection, Connections, Walk, flag_of},
    words,
};
use crate::{
    integrator::Integrator,
    lanes::{Float, Lanes, MOST, Mask, Select, Unsigned},
    path::{Around, Departure, Joint, RivalSum, Step, Tail, are_directions, is_hittable},
    sampling::{Block, Choice, Numbers, PdfArea, PdfSolidAngle, Sampler, Square, Stream},
    scene::{
        bsdf::Bsdfs,
        geometry::Ray,
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
        starts: &mut Starts,
        wave: &mut Wave,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, kind, seed, .. } = stage;
        starts.pad();
        wave.walks.0.clear(starts.len);
        wave.connections.0.clear(starts.len * self.connections_of_each(stage) as usize);
        wave.inside.clear();
        wave.inside.resize(starts.len, Inside::NOTHING);
        for i in (0..starts.len).step_by(L::N) {
            let key = lanes.load_u(&starts.keys[i..]);
            let kept = Numbers::<L>::keep(kind, seed, key, sample, Stream::Light);
            let emissions = sample_emissions(stage, kept, lanes.first(starts.len - i));
            for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
                let such = |k: usize| emissions.some >> k & 1 == 1 && emissions.of_lane[k].point.place == place;
                let which = lanes.condition(such);
                if which.any() {
                    self.leave(stage, (i, kept), &emissions, (which, place), wave, sink);
                }
            }
        }
    }

    /// The same for the lanes `which`, all of whose points are such `place`s.
    #[inline(always)]
    fn leave<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        (at, kept): (usize, [L::U; 2]),
        emissions: &Emissions,
        (which, place): (L::M, Place),
        wave: &mut Wave,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, .. } = stage;
        let of = |k: usize| &emissions.of_lane[k];
        let point = Point::of_each(lanes, which, place, |k| &of(k).point);
        let first = Step::next_event(point, PdfArea(lanes.numbers(|k| of(k).pdf_position.0)));
        let direction = lanes.vectors(|k| of(k).direction.to_array());
        let pdf = PdfSolidAngle(lanes.numbers(|k| of(k).pdf_direction.0));
        self.splat(stage, &first, which, &mut wave.connections, sink);
        let zero = lanes.splat(0.0);
        let leaves = which & zero.lt(pdf.0) & zero.lt(point.alpha);
        if stage.most == 1 || !leaves.any() {
            return;
        }
        let has_origin = lanes.condition(|k| of(k).origin.is_some());
        let far = lanes.vectors(|k| of(k).origin.unwrap_or_default().to_array());
        let origin = has_origin.select(far, point.ray_origin(direction));
        let departure = Departure::from_light(scene, &first, direction, pdf, origin);
        if let Some(media) = scene.media() {
            for k in leaves.lanes() {
                wave.inside[at + k].start_at_light(scene, media, of(k));
            }
        }
        let walk = Walk::<L> {
            departure,
            whole: departure.beta.max_element(),
            position: point.position,
            normal: point.normal,
            primitive: words(lanes, &point),
            flags: lanes.splat_u(flag_of(place)),
            raster: [zero; 2],
            scrambles: [kept[0]; 2],
            index: kept[1],
            number: lanes.whole_numbers(|k| (at + k) as u32),
        };
        wave.walks.push(&walk, leaves);
    }

    /// t = 1: the connections of the vertices of the lanes `which` to the lens, up to the ray.
    #[inline(always)]
    pub(super) fn splat<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        here: &Step<L, Bsdfs<L>>,
        which: L::M,
        connections: &mut Connections,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, rivals, .. } = stage;
        let strategy = stage.connecting();
        let (y, one, none) = (&here.vertex.point, lanes.splat(1.0), lanes.mask(0));
        // (1,1) does not show points and suns, which have no extent on the image.
        let which = if strategy.s == 1 { which & is_hittable(scene, y) } else { which };
        let samples = self.connections_of_each(stage);
        if samples == 0 || !which.any() {
            return;
        }
        let z = stage.lens();
        let Some(joint) = Joint::connect(scene, strategy, [&z, here], one) else { return };
        let Some(raster) = joint.raster else { return };
        let contribution = joint.contribution(z.beta, Some(here.beta));
        let open = which & !contribution.is_black();
        sink.shadow_rays(count(open) * samples as usize);
        let tail = |pdf| Tail { pdf_fwd: [pdf; 2], is_delta: [none; 2], rivals: RivalSum::none(lanes) };
        let around = Around {
            strategy,
            joint: &joint,
            camera: &tail(z.pdf_fwd),
            light: &tail(here.pdf_fwd),
            light_is_hittable: if strategy.s == 1 { is_hittable(scene, y) } else { none },
            ends_are_directions: are_directions(&z.vertex.point, y),
        };
        let share = around.weight(rivals, &self.weighed) / lanes.splat(self.weighed.count(strategy));
        let lens = &z.vertex.point;
        let connection = Connection::<L> {
            ray: Ray::joining(lens, y),
            primitives: [words(lanes, lens), words(lanes, y)],
            ends: [lens.position, y.position],
            value: contribution.times(share),
            raster,
        };
        for _ in 0..samples {
            connections.push(&connection, open & !lens.is_in_one_plane_with(y));
        }
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
