//! What walks of a wave do where they come to: kind by kind of what is there.

use super::{
    Queues, Stage, Wave, WaveSink,
    bodies::come_to_bodies,
    count,
    leave::Leave,
    merge::keep,
    queue::{CONNECTS, HITTABLE, KEEPS, SPLATS, Walk, Walks, has},
    store::LightEnd,
};
use crate::{
    integrator::Integrator,
    lanes::{Lanes, Mask, Set, Vector, Work},
    path::Step,
    scene::{
        Scene,
        bsdf::{Bsdfs, Kind, Transport},
        geometry::Hits,
        point::{Place, Point},
    },
};

/// What is done at a time of the lanes of a group.
#[derive(Clone, Copy)]
enum Group {
    /// Plain points of one kind.
    Plain(Kind),
    /// Other surfaces: those of this number in [`Others`].
    Others(usize),
    /// What has left the scene.
    Sky,
}

const KINDS: usize = Kind::ALL.len();

impl Group {
    const SKY: usize = 2 * KINDS + 1;

    /// All of them, by a number: a set of groups has a bit for each.
    #[inline(always)]
    fn of_number(n: usize) -> Self {
        match n {
            Self::SKY => Self::Sky,
            n if n < KINDS => Self::Plain(Kind::ALL[n]),
            n => Self::Others(n - KINDS),
        }
    }
}

/// In which lanes surfaces have a BSDF of each kind, and last in which of none: a bit for each lane.
type Others = [u32; KINDS + 1];

/// The numbers of the groups that there may be, as a set of bits, among `plain` points of some kinds and among others.
#[inline(always)]
fn groups(plain: u32, others: &Others, sees_sky: bool) -> u32 {
    let set = |kind: usize| u32::from(others[kind] != 0) << (KINDS + kind);
    plain | (0..=KINDS).map(set).sum::<u32>() | u32::from(sees_sky) << Group::SKY
}

/// Where the walks of the lanes `which` of the group from the `at`-th on come to; and in which lanes there is a
/// surface.
#[inline(always)]
fn come_to_others(
    scene: &Scene,
    walks: &Walks,
    (at, which): (usize, impl Mask),
    hits: &Hits,
    Queues { inside, arrived, .. }: &mut Queues,
) -> (Others, u32) {
    let mut others = [0; KINDS + 1];
    let some = if which.any() { walks.arrive_each(scene, at, which, hits, inside, &mut arrived.0) } else { 0 };
    for k in Set::of_bits(some) {
        others[Kind::of(&arrived.0[k].bsdf).map_or(KINDS, |kind| kind as usize)] |= 1 << k;
    }
    (others, some)
}

/// Whether walks that leave the scene come to a sky.
#[inline(always)]
fn sees_sky<L: Lanes>(stage: Stage<'_, L>) -> bool {
    stage.transport == Transport::Radiance && stage.scene.lights().has_environment()
}

impl Integrator {
    /// What happens at the vertices to which the rays of some walks have come.
    #[inline(always)]
    pub(super) fn arrive<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        these: std::ops::Range<usize>,
        wave: &mut Wave,
        sink: &mut impl WaveSink,
    ) {
        let Stage { lanes, scene, .. } = stage;
        let Wave { walks, hits, queues, .. } = wave;
        for i in these.clone().step_by(L::N) {
            let walk = walks.get(lanes, i);
            let all = lanes.first(these.end - i);
            let mut met = hits.any(lanes, i) & all;
            let (in_world, index, b) = hits.places(lanes, i);
            let mut plain = scene.plain_points(lanes, met & in_world, index, b);
            plain.which = self.met_first(stage, (walks, &walk), hits, i, plain.which);
            let (which_others, some) = come_to_others(scene, walks, (i, met & !plain.which), hits, queues);
            met = plain.which | lanes.mask(some);
            // One call for all: each would be a copy of what it does.
            for n in Set::of_bits(groups(scene.plain_kinds(), &which_others, sees_sky(stage))) {
                let other;
                let (which, point) = match Group::of_number(n) {
                    Group::Plain(kind) => {
                        let which = plain.of_kind(kind);
                        if !which.any() {
                            continue;
                        }
                        plain.turn_to(kind);
                        if kind.transmits() {
                            plain.point.bsdf = come_to_bodies(stage, &walk, which, &plain.point, &mut queues.inside);
                        }
                        (which, &plain.point)
                    }
                    Group::Others(kind) => {
                        let which = lanes.mask(which_others[kind]);
                        other = Point::of_each(lanes, which, Place::Surface, |k| &queues.arrived.0[k]);
                        (which, &other)
                    }
                    Group::Sky => {
                        let which = all & !met;
                        if !which.any() {
                            continue;
                        }
                        walks.leave_each(scene, i, which, &mut queues.points.0);
                        other = Point::of_each(lanes, which, Place::Infinite, |k| &queues.points.0[k]);
                        (which, &other)
                    }
                };
                if which.any() {
                    self.arrive_at(stage, &walk, (which, point), queues, sink);
                }
            }
        }
    }

    /// Of the walks in the lanes `plain` of the group from the `at`-th on, those that have come to what is met first.
    #[inline(always)]
    fn met_first<L: Lanes>(
        &self,
        Stage { lanes, scene, .. }: Stage<'_, L>,
        (walks, walk): (&Walks, &Walk<L>),
        hits: &Hits,
        at: usize,
        plain: L::M,
    ) -> L::M {
        if !scene.geometry().has_coincident() {
            return plain;
        }
        // Nothing hides plain points.
        let cos = walk.normal.dot(walk.departure.direction);
        let close = plain & scene.geometry().may_be_in_planes(hits.distances(lanes, at), cos);
        let mut first = 0;
        for k in close.lanes() {
            let (ray, left) = (walks.ray(at + k), walks.left(at + k));
            let is_first = |hit| scene.geometry().is_met_first(&ray, left, &hit);
            first |= u32::from(hits.get(at + k).is_some_and(is_first)) << k;
        }
        plain & (!close | lanes.mask(first))
    }

    /// What the walks of the lanes `which` do at `point`.
    #[inline(always)]
    fn arrive_at<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        walk: &Walk<L>,
        (which, point): (L::M, &Point<L, Bsdfs<L>>),
        queues: &mut Queues,
        sink: &mut impl WaveSink,
    ) {
        // Lights are of all kinds; all that comes after them lies on surfaces.
        let first = stage.transport == Transport::Importance && stage.vertices == 2;
        for place in [Place::Surface, Place::Degenerate, Place::Infinite] {
            let which = if first { which & walk.leaves(place) } else { which };
            if (first || place == Place::Surface) && which.any() {
                let integrator = self;
                stage.lanes.call(Arrive {
                    integrator,
                    stage,
                    walk,
                    place,
                    which,
                    point,
                    queues: &mut *queues,
                    sink: &mut *sink,
                });
            }
        }
    }
}

/// What the walks of the lanes `which` do at `point`, to which all come from such a `place`.
struct Arrive<'a, L: Lanes, S> {
    integrator: &'a Integrator,
    stage: Stage<'a, L>,
    walk: &'a Walk<L>,
    place: Place,
    which: L::M,
    point: &'a Point<L, Bsdfs<L>>,
    queues: &'a mut Queues,
    sink: &'a mut S,
}

impl<L: Lanes, S: WaveSink> Work for Arrive<'_, L, S> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { integrator, stage, walk, place, which, point, queues, sink } = self;
        let Stage { lanes, vertices, transport, light_vertices, .. } = stage;
        let mut next_event_ratio = walk.next_event_ratio;
        let from = walk.from(place);
        let here = Step::arriving(&walk.departure, &from, *point, lanes.splat(1.0));
        sink.walked(transport, count(which));
        match transport {
            Transport::Radiance => {
                integrator.hit(stage, walk, &from, &here, which, sink);
                if point.place == Place::Infinite {
                    return;
                }
                integrator.connect(stage, walk, &here, which, queues, sink);
            }
            Transport::Importance => {
                if vertices == 2 {
                    next_event_ratio = integrator.next_event_ratio(stage, walk, (place, which), &here, &queues.lights);
                }
                let which = which & here.vertex.point.bsdf.has_continuous(lanes);
                let end = LightEnd {
                    step: here,
                    tail: walk.tail(&here),
                    is_hittable: has(walk.flags, HITTABLE),
                    next_event_ratio,
                };
                integrator.splat(stage, &end, which & has(walk.flags, SPLATS), &mut queues.connections, sink);
                let kept = which & has(walk.flags, CONNECTS);
                if vertices <= light_vertices.connected && kept.any() {
                    queues.light_vertices.put(vertices, &end, walk.number, kept);
                }
                let merges = which & has(walk.flags, KEEPS);
                let fewest = stage.rivals.light.meeting_places().fewest_light_vertices();
                if (fewest..=light_vertices.merged).contains(&vertices) && merges.any() {
                    keep(stage, &end, walk, merges, &mut queues.kept);
                }
            }
        }
        let goes_on = which & stage.has_next(walk.flags);
        if goes_on.any() {
            let Queues { next, inside, .. } = queues;
            let here = &here;
            lanes.call(Leave { integrator, stage, walk, here, next_event_ratio, which: goes_on, next, inside, sink });
        }
    }
}
