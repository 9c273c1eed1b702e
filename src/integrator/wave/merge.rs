//! How a wave merges: walks from lights keep their vertices, and walks from the camera meet those of the whole pass.

use super::{
    CameraEnd, Stage, WaveSink, count, deposit,
    queue::{SPLATS, Walk, has},
    store::{Held, LightEnd, VertexStore},
};
use crate::{
    integrator::{Integrator, LightVertexMap},
    lanes::{Float, Lanes, MOST, Mask, Record, Unsigned, Vector, Work},
    math::Rgb,
    path::{LightVertex, Strategy, Technique},
    scene::bsdf::Transport,
};

/// Keeps the vertices of the lanes `which`.
#[inline(always)]
pub(super) fn keep<L: Lanes>(
    stage: Stage<'_, L>,
    end: &LightEnd<L>,
    walk: &Walk<L>,
    which: L::M,
    kept: &mut Vec<Record>,
) {
    let Stage { lanes, rivals, vertices, .. } = stage;
    // Waves do not ask which light subpath it was.
    let path = lanes.splat_u(0);
    let beginning = walk.beginning(end.next_event_ratio);
    let light = LightVertex::of((&end.step, &end.tail), vertices, beginning, rivals, path);
    let (len, mut places) = (kept.len(), [0; MOST]);
    kept.resize(len + count(which), Record([0.0; 16]));
    for (place, k) in (len as u32..).zip(which.lanes()) {
        places[k] = place;
    }
    lanes.put_records(light.columns(), kept, lanes.load_u(&places), which);
}

/// Camera vertices of a group of lanes, and the light vertices that they meet.
#[derive(Debug, Default)]
pub struct Meetings {
    /// The camera vertices, by their lanes.
    camera: VertexStore,
    /// Those that one of them meets.
    found: Vec<u32>,
    /// Pairs by the number of vertices of the light subpath.
    pairs: Vec<Pairs>,
}

/// Camera vertices by their lanes, and light vertices by their numbers in the map.
#[derive(Debug, Default)]
struct Pairs {
    camera: Vec<u32>,
    light: Vec<u32>,
}

/// In a store of camera vertices of the same number, which one that is does not matter: the first.
const LEVEL: u32 = 2;

impl Meetings {
    /// Finds all pairs of the camera vertices at `places` in the lanes `which` and light vertices around them.
    #[inline(always)]
    fn find<L: Lanes>(&mut self, lanes: L, map: &LightVertexMap, places: L::V, which: L::M) {
        for Pairs { camera, light } in &mut self.pairs {
            camera.clear();
            light.clear();
        }
        let places = places.all();
        for k in which.lanes() {
            self.found.clear();
            map.around(lanes, places[k].into(), &mut self.found);
            for number in &self.found {
                lanes.prefetch(&map.records()[*number as usize]);
                let vertices = map.vertices(*number) as usize;
                if self.pairs.len() <= vertices {
                    self.pairs.resize_with(vertices + 1, Pairs::default);
                }
                let Pairs { camera, light } = &mut self.pairs[vertices];
                camera.push(k as u32);
                light.push(*number);
            }
        }
    }
}

/// The merges of the camera vertices in the lanes `which`.
pub(super) struct Merge<'a, L: Lanes, S> {
    pub integrator: &'a Integrator,
    pub stage: Stage<'a, L>,
    pub map: &'a LightVertexMap,
    pub z: &'a CameraEnd<'a, L>,
    pub which: L::M,
    pub meetings: &'a mut Meetings,
    pub sink: &'a mut S,
}

impl<L: Lanes, S: WaveSink> Work for Merge<'_, L, S> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { integrator, stage, map, z, which, meetings, sink } = self;
        let Stage { lanes, vertices: t, .. } = stage;
        let point = &z.step.vertex.point;
        meetings.find(lanes, map, point.position, which);
        sink.looked(count(which), meetings.pairs.iter().map(|pairs| pairs.camera.len()).sum());
        let Meetings { camera, pairs, .. } = meetings;
        let nothing = lanes.mask(0);
        let end = LightEnd { step: *z.step, tail: z.tail, is_hittable: nothing, next_event_ratio: lanes.splat(1.0) };
        camera.clear(MOST);
        camera.put(LEVEL, &end, lanes.whole_numbers(|k| k as u32), which);
        let (held, [x, y]) = (Held::of(lanes, &point.bsdf), [z.raster[0].all(), z.raster[1].all()]);
        for (vertices, pairs) in (0..).zip(pairs).filter(|(_, pairs)| !pairs.camera.is_empty()) {
            let strategy = Strategy { s: vertices - 1, t };
            let len = pairs.camera.len();
            pairs.camera.resize(len + MOST, 0);
            pairs.light.resize(len + MOST, 0);
            for at in (0..len).step_by(L::N) {
                let number = lanes.load_u(&pairs.camera[at..]);
                let which = lanes.first(len - at);
                let met = camera.get(lanes, LEVEL, held, number, which);
                let kept = lanes.records(map.records(), lanes.load_u(&pairs.light[at..]));
                let all = number.all();
                let raster = [lanes.numbers(|k| x[all[k] as usize]), lanes.numbers(|k| y[all[k] as usize])];
                let values = integrator.merged(stage, (&met, raster), &LightVertex::of_columns(kept), strategy);
                let Some((value, open)) = values else { continue };
                let value = value.channels().all();
                for k in (open & which).lanes() {
                    let raster = [x[all[k] as usize], y[all[k] as usize]];
                    deposit(sink, Technique::Merged(strategy), raster, Rgb::from_array(value[k]));
                }
            }
        }
    }
}

impl Integrator {
    /// What camera vertices and the light vertices `y` that they meet deposit, and in which lanes there is anything.
    #[inline(always)]
    fn merged<L: Lanes>(
        &self,
        Stage { lanes, rivals, .. }: Stage<'_, L>,
        (z, raster): (&LightEnd<L>, [L::F; 2]),
        y: &LightVertex<L>,
        strategy: Strategy,
    ) -> Option<(Rgb<L::V>, L::M)> {
        let meeting = y.met_by(&z.step, strategy, &self.weighed)?;
        let open = !meeting.contribution.is_black();
        if !open.any() {
            return None;
        }
        let samples = self.weighed.samples(Technique::Merged(strategy));
        let weight = y.weight((&z.tail, raster), &meeting, &self.weighed, rivals) / lanes.splat(samples);
        Some((meeting.contribution.times(weight), open))
    }

    /// Which walks count light that is lost to shading normals: of walks that are made once to be kept and once more to
    /// be connected, those that are splatted.
    #[inline(always)]
    pub(super) fn counts_losses<L: Lanes>(&self, stage: Stage<'_, L>, walk: &Walk<L>) -> L::M {
        let lanes = stage.lanes;
        if stage.transport == Transport::Radiance || !self.merges() {
            return lanes.first(L::N);
        }
        has(walk.flags, SPLATS)
    }
}
