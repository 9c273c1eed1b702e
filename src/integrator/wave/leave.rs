//! How the walks of a wave leave a vertex.

use super::{
    Stage, WaveSink,
    bodies::go_through,
    count,
    queue::{
        CONNECTS, DELTA, DELTA_BEFORE, HITTABLE, KEEPS, SEEN_SPECULAR, SEEN_SPECULAR_BEFORE, SPLATS, Walk, Walks, flag,
        has,
    },
    words,
};
use crate::{
    integrator::Integrator,
    lanes::{Float, Lanes, Vector, Work},
    path::{RivalSum, Rules, Step},
    sampling::{Block, Chance, PdfArea, Sampler, Stream},
    scene::{
        bsdf::{Bsdfs, Transport},
        media::Inside,
    },
};

/// How the walks of the lanes `which` scatter at `here`, and which go on.
pub(super) struct Leave<'a, L: Lanes, S> {
    pub integrator: &'a Integrator,
    pub stage: Stage<'a, L>,
    pub walk: &'a Walk<L>,
    pub here: &'a Step<L, Bsdfs<L>>,
    /// See [`Walk::next_event_ratio`]; known since the walk has come here.
    pub next_event_ratio: L::F,
    pub which: L::M,
    pub next: &'a mut Walks,
    pub inside: &'a mut [Inside],
    pub sink: &'a mut S,
}

impl<L: Lanes, S: WaveSink> Work for Leave<'_, L, S> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { integrator, stage, walk, here, next_event_ratio, which, next, inside, sink } = self;
        let Stage { lanes, vertices, transport, .. } = stage;
        let stream = if transport == Transport::Radiance { Stream::Camera } else { Stream::Light };
        let mut numbers = stage.numbers([walk.scrambles[0], walk.index], stream, stage.taken());
        numbers.start(Block::scattering(vertices - 1));
        let u = numbers.next_three();
        let survive: Chance<L::U> = numbers.next_chance();
        let rules = Rules { transport, directions: integrator.evaluated.directions(), roulette: integrator.roulette };
        let scattered = here.scatter(rules, vertices - 1, walk.whole, u, survive);
        sink.lost_to_sides(count(scattered.lost_to_sides & which & integrator.counts_losses(stage, walk)));
        let (p, goes_on) = (&here.vertex.point, scattered.goes_on & which);
        if stage.scene.media().is_some() && p.bsdf.may_transmit() {
            let through = p.normal.dot(scattered.departure.direction) * p.normal.dot(here.back.direction);
            go_through(walk, goes_on & through.lt(lanes.splat(0.0)), inside);
        }
        let flags = walk.flags & lanes.splat_u(SPLATS | CONNECTS | KEEPS | HITTABLE)
            | flag(lanes, DELTA, scattered.is_delta)
            | flag(lanes, DELTA_BEFORE, has(walk.flags, DELTA))
            | flag(
                lanes,
                SEEN_SPECULAR,
                scattered.is_delta
                    & (lanes.mask(if vertices == 2 { u32::MAX } else { 0 }) | has(walk.flags, SEEN_SPECULAR)),
            )
            | flag(lanes, SEEN_SPECULAR_BEFORE, has(walk.flags, SEEN_SPECULAR));
        let onwards = Walk {
            departure: scattered.departure,
            whole: scattered.whole,
            position: p.position,
            normal: p.normal,
            primitive: words(lanes, p),
            pdf_fwd: here.pdf_fwd,
            rivals: rivals_before(stage, walk, scattered.reverse),
            next_event_ratio,
            flags,
            ..*walk
        };
        next.push(&onwards, goes_on);
    }
}

/// The running sum up to the last vertex that `walk` has left, now that its `reverse` density is known.
#[inline(always)]
fn rivals_before<L: Lanes>(stage: Stage<'_, L>, walk: &Walk<L>, reverse: PdfArea<L::F>) -> RivalSum<L::U> {
    let Stage { rivals, transport, vertices, .. } = stage;
    let sum = if transport == Transport::Radiance { &rivals.camera } else { &rivals.light };
    if sum.is_empty() {
        return walk.rivals;
    }
    let (j, is_delta) = (vertices as usize - 2, has(walk.flags, DELTA));
    let connects = walk.beginning(walk.next_event_ratio).connects(j, [is_delta, has(walk.flags, DELTA_BEFORE)]);
    let densities = [reverse, walk.pdf_fwd];
    if sum.has_merges() {
        let is_seen = has(walk.flags, SEEN_SPECULAR_BEFORE);
        let merges = sum.meeting_places().admit(is_seen, is_delta);
        sum.next_merging(j, densities, connects, merges, walk.rivals)
    } else {
        sum.next(j, densities, connects, walk.rivals)
    }
}
