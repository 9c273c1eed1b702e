//! How a wave joins prefixes: the connection of two vertices in each lane, its weight, and its ray.

use super::{
    Stage, WaveSink, count,
    queue::{Connection, Connections, Ends},
    store::LightEnd,
    words,
};
use crate::{
    integrator::Integrator,
    lanes::{Float, Lanes, Vector, Work},
    path::{Around, Joint, Step, Strategy, Tail, are_directions, is_hittable},
    sampling::PdfArea,
    scene::{Scene, bsdf::Bsdfs, geometry::Ray, point::Point},
};

/// A camera prefix in each lane, as a connection to its last vertex sees it.
#[derive(Clone, Copy, Debug)]
pub struct CameraEnd<'a, L: Lanes> {
    /// Its last vertex z_t.
    pub step: &'a Step<L, Bsdfs<L>>,
    /// What a weight sees from there on.
    pub tail: Tail<L>,
    /// Where on the image it began.
    pub raster: [L::F; 2],
}

impl<L: Lanes> LightEnd<L> {
    /// A point of a light alone, sampled with the density `pdf` as next-event estimation does.
    #[inline(always)]
    pub fn next_event(scene: &Scene, point: Point<L, Bsdfs<L>>, pdf: PdfArea<L::F>) -> Self {
        Self {
            step: Step::next_event(point, pdf),
            tail: Tail::of_one(pdf),
            is_hittable: is_hittable(scene, &point),
            next_event_ratio: pdf.0 / scene.lights().pdf_position(&point).0,
        }
    }
}

/// The connection of two prefixes in some lanes, so many times each, up to the rays.
struct Join<'a, L: Lanes, S> {
    integrator: &'a Integrator,
    stage: Stage<'a, L>,
    strategy: Strategy,
    z: &'a CameraEnd<'a, L>,
    y: &'a LightEnd<L>,
    which: L::M,
    times: u32,
    connections: &'a mut Connections,
    sink: &'a mut S,
}

impl<L: Lanes, S: WaveSink> Work for Join<'_, L, S> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { integrator, stage, strategy, z, y, which, times, connections, sink } = self;
        let Stage { lanes, scene, .. } = stage;
        let Some(joint) = Joint::connect(scene, strategy, [z.step, &y.step], y.next_event_ratio) else { return };
        let contribution = joint.contribution(z.step.beta, Some(y.step.beta));
        let open = which & !contribution.is_black();
        sink.shadow_rays(count(open) * times as usize);
        let (lens, end) = (&z.step.vertex.point, &y.step.vertex.point);
        let share = integrator.share(stage, strategy, &joint, z, (end, &y.tail, y.is_hittable));
        let ray = Ray::joining(lens, end);
        let mut ends = None;
        if scene.geometry().has_coincident() {
            let cosines = [lens.normal.dot(ray.direction), end.normal.dot(ray.direction)];
            ends = Some(Ends { positions: [lens.position, end.position], cosines });
        }
        let connection = Connection::<L> {
            ray,
            primitives: [words(lanes, lens), words(lanes, end)],
            ends,
            value: contribution.times(share),
            raster: joint.raster.unwrap_or(z.raster),
            strategy,
        };
        let zero = lanes.splat(0.0);
        let open = open & zero.lt(lens.alpha) & zero.lt(end.alpha) & !lens.is_in_one_plane_with(end);
        for _ in 0..times {
            connections.push(&connection, open);
        }
    }
}

impl Integrator {
    /// Connects two prefixes in the lanes `which` by this strategy, so many times each, up to the rays.
    #[inline(always)]
    pub(super) fn join<L: Lanes>(
        &self,
        stage: Stage<'_, L>,
        strategy: Strategy,
        (z, y): (&CameraEnd<'_, L>, &LightEnd<L>),
        (which, times): (L::M, u32),
        connections: &mut Connections,
        sink: &mut impl WaveSink,
    ) {
        stage.lanes.call(Join { integrator: self, stage, strategy, z, y, which, times, connections, sink });
    }

    /// w/n of a path with this joint. Of the light's prefix: its last vertex, its tail, and whether a ray can meet its
    /// light.
    #[inline(always)]
    pub(super) fn share<L: Lanes>(
        &self,
        Stage { lanes, rivals, .. }: Stage<'_, L>,
        strategy: Strategy,
        joint: &Joint<L>,
        z: &CameraEnd<'_, L>,
        (end, light, light_is_hittable): (&Point<L, Bsdfs<L>>, &Tail<L>, L::M),
    ) -> L::F {
        let ends_are_directions = are_directions(&z.step.vertex.point, end);
        let raster = joint.raster.unwrap_or(z.raster);
        let around = Around { strategy, joint, camera: &z.tail, light, light_is_hittable, ends_are_directions, raster };
        around.weight(rivals, &self.weighed) / lanes.splat(self.weighed.count(strategy))
    }
}
