//! The joint of two subpaths: everything that the connection of two vertices decides, in any lanes.

use super::{
    Edge, RivalSum, Rivals, Step, Strategy, Techniques, is_seen_by_specular, mis::Densities, scattering::Surfaces,
};
use crate::{
    lanes::{Float, Lanes, Mask, One, Vector},
    math::Rgb,
    sampling::{PdfArea, PdfSolidAngle},
    scene::{
        Scene,
        bsdf::Lobe,
        point::{Place, Point},
    },
};

/// What the connection of two prefixes changes, in slots of its own: nothing of the prefixes is touched to evaluate it.
///
/// Of the densities along the path only four depend on the connection: the last two camera vertices' from the light,
/// and the last two light vertices' from the camera.
#[derive(Clone, Copy, Debug)]
pub struct Joint<L: Lanes = One> {
    /// The factors of F between the prefixes: f̂ V⁻¹G f̂ for inner connections, with W_e or L_e at a path's end; L_e
    /// alone for s = 0. α cancels where a walk stopped; at an end that was sampled on its own it is in L_e.
    pub value: Rgb<L::V>,
    /// V of the connecting edge, 1 until a ray has found it; it is in this joint's densities.
    pub visibility: L::F,
    /// c_t and c_{t+1}.
    pub camera_density: [PdfArea<L::F>; 2],
    /// l_{t−1} and l_{t−2}.
    pub light_density: [PdfArea<L::F>; 2],
    /// See [`Densities::next_event_ratio`].
    pub next_event_ratio: L::F,
    /// Where the path arrives on the image, if the joint decides that: for t = 1.
    pub raster: Option<[L::F; 2]>,
}

/// One end of the connecting edge: everything there that depends on the edge's direction.
struct Face<L: Lanes> {
    /// f̂, or W_e or L_e at the end of a path.
    value: Rgb<L::V>,
    /// The density of going across the edge from here.
    across: PdfSolidAngle<L::F>,
    /// The density of arriving at this vertex's own predecessor from across the edge.
    back: PdfArea<L::F>,
}

impl<L: Lanes> Joint<L> {
    /// s = 0: the camera subpath's last vertex `end` lies on a light; `before` is the point before it. `None` if it
    /// emits nothing towards there in any lane.
    #[inline(always)]
    pub fn hit<B: Surfaces<L>>(scene: &Scene, before: &Point<L, B>, end: &Step<L, B>) -> Option<Self> {
        let p = &end.vertex.point;
        let to_camera = end.back.direction;
        let value = scene.le(p, to_camera);
        if !(!value.is_black()).any() {
            return None;
        }
        let (lights, lanes) = (scene.lights(), p.alpha.lanes());
        let nothing = PdfArea(lanes.splat(0.0));
        let position = lights.pdf_position(p);
        Some(Self {
            value,
            visibility: lanes.splat(1.0),
            camera_density: [nothing; 2],
            light_density: [position, lights.pdf_direction(p, to_camera).to_area(&end.back)],
            next_event_ratio: scene.pdf_next_event(p, before).0 / position.0,
            raster: None,
        })
    }

    /// s ≥ 1, t ≥ 1: connects the last vertices z of a camera prefix and y of a light prefix, as `strategy` does.
    /// `None` where nothing passes in any lane, before any ray is traced; where it passes in some, `value` is black in
    /// the others.
    #[inline(always)]
    pub fn connect<B: Surfaces<L>>(
        scene: &Scene,
        Strategy { s, t }: Strategy,
        [z, y]: [&Step<L, B>; 2],
        next_event_ratio: L::F,
    ) -> Option<Self> {
        let lanes = next_event_ratio.lanes();
        let passes = |value: &Rgb<L::V>| (!value.is_black()).any();
        let edge = Edge::between(&z.vertex.point, &y.vertex.point);
        let (camera, raster) = if t == 1 {
            let seen = scene.camera.look_in_lanes(&z.vertex.point, edge.direction);
            let black = Rgb::of(lanes.splat_v([0.0; 3]));
            let value = Rgb::select(seen.some, Rgb::of(L::V::new(seen.we, seen.we, seen.we)), black);
            (Face { value, across: seen.pdf, back: PdfArea(lanes.splat(0.0)) }, Some(seen.raster))
        } else {
            (camera_face(z, edge.direction), None)
        };
        if !passes(&camera.value) {
            return None;
        }
        let light = if s == 1 { emitting_face(scene, y, -edge.direction) } else { light_face(y, -edge.direction) };
        let value = camera.value * light.value;
        if !passes(&value) {
            return None;
        }
        Some(Self {
            value: value.times(edge.geometry_factor()),
            visibility: lanes.splat(1.0),
            camera_density: [camera.across.to_area(&edge), light.back],
            light_density: [light.across.to_area(&edge.reversed()), camera.back],
            next_event_ratio,
            raster,
        })
    }

    /// F/p without h_j, over roulette's survival probability, of a path whose prefixes have these betas (of the light's
    /// none for s = 0). With V = 1 until a ray has found it.
    #[inline(always)]
    pub fn contribution(&self, camera: Rgb<L::V>, light: Option<Rgb<L::V>>) -> Rgb<L::V> {
        let mut value = camera * self.value;
        if let Some(light) = light {
            value = value * light;
        }
        value.times(self.visibility)
    }
}

#[inline(always)]
fn camera_face<L: Lanes, B: Surfaces<L>>(z: &Step<L, B>, to_light: L::V) -> Face<L> {
    let scatter = B::scatter_at(&z.vertex.point, Lobe::Continuous, z.back.direction, to_light);
    Face { value: scatter.f, across: scatter.to_light, back: scatter.to_camera.to_area(&z.back) }
}

#[inline(always)]
fn light_face<L: Lanes, B: Surfaces<L>>(y: &Step<L, B>, to_camera: L::V) -> Face<L> {
    let scatter = B::scatter_at(&y.vertex.point, Lobe::Continuous, to_camera, y.back.direction);
    Face { value: scatter.f, across: scatter.to_camera, back: scatter.to_light.to_area(&y.back) }
}

/// Of the light's own p_n.
#[inline(always)]
fn emitting_face<L: Lanes, B: Surfaces<L>>(scene: &Scene, y: &Step<L, B>, to_camera: L::V) -> Face<L> {
    let p = &y.vertex.point;
    let nothing = PdfArea(p.alpha.lanes().splat(0.0));
    Face {
        value: scene.le(p, to_camera).times(p.alpha),
        across: scene.lights().pdf_direction(p, to_camera),
        back: nothing,
    }
}

/// What a weight sees of a prefix beyond its joint, from the last vertex on.
#[derive(Clone, Copy, Debug)]
pub struct Tail<L: Lanes> {
    /// The own-side densities of the last vertex and of the last but one.
    pub pdf_fwd: [PdfArea<L::F>; 2],
    /// Whether the last vertex but one, and the one before it, pass delta lobes.
    pub is_delta: [L::M; 2],
    /// Of a camera subpath: see [`Densities::is_seen_by_specular`], of the last vertex and the one before it.
    pub is_seen_by_specular: [L::M; 2],
    /// The running sum up to the last vertex but two: see [`Rivals`].
    pub rivals: RivalSum<L::U>,
}

impl Tail<One> {
    /// That of a prefix of a subpath, of one vertex at least; what it is too short for is nothing.
    #[inline(always)]
    pub fn of(prefix: &[Step]) -> Self {
        let from_last = |i: usize| prefix.len().checked_sub(1 + i).map(|k| &prefix[k]);
        let pdf_fwd = |i: usize| from_last(i).map_or(PdfArea::ZERO, |step| step.pdf_fwd);
        let is_delta = |i: usize| from_last(i).is_some_and(|step| step.vertex.is_delta());
        Self {
            pdf_fwd: [pdf_fwd(0), pdf_fwd(1)],
            is_delta: [is_delta(1), is_delta(2)],
            is_seen_by_specular: [0, 1].map(|i| is_seen_by_specular(&prefix[..prefix.len().saturating_sub(i)])),
            rivals: from_last(2).map_or(RivalSum::ZERO, |step| step.rivals),
        }
    }
}

impl<L: Lanes> Tail<L> {
    /// That of a prefix of one vertex with this density.
    #[inline(always)]
    pub fn of_one(pdf: PdfArea<L::F>) -> Self {
        let lanes = pdf.0.lanes();
        let nowhere = [lanes.mask(0); 2];
        Self { pdf_fwd: [pdf; 2], is_delta: nowhere, is_seen_by_specular: nowhere, rivals: RivalSum::none(lanes) }
    }
}

/// A path that is known around its joint alone: all that running sums need to weigh it.
#[derive(Clone, Copy, Debug)]
pub struct Around<'a, L: Lanes> {
    /// What found it.
    pub strategy: Strategy,
    /// The joint.
    pub joint: &'a Joint<L>,
    /// The camera prefix.
    pub camera: &'a Tail<L>,
    /// The light prefix; of one without vertices nothing is asked.
    pub light: &'a Tail<L>,
    /// See [`Densities::light_is_hittable`].
    pub light_is_hittable: L::M,
    /// See [`Densities::ends_are_directions`].
    pub ends_are_directions: L::M,
    /// Where the path arrives on the image.
    pub raster: [L::F; 2],
}

impl<L: Lanes> Around<'_, L> {
    /// w of the technique that found the path, by the running sums of its prefixes.
    #[inline(always)]
    pub fn weight(&self, rivals: &Rivals, techniques: &Techniques) -> L::F {
        let sums = [self.camera.rivals, self.light.rivals];
        if techniques.radius().is_some() {
            rivals.weight_among_merges(self, self.strategy, techniques, sums)
        } else {
            rivals.weight(self, self.strategy, techniques, sums)
        }
    }
}

impl<L: Lanes> Densities<L> for Around<'_, L> {
    #[inline(always)]
    fn lanes(&self) -> L {
        self.joint.visibility.lanes()
    }

    #[inline(always)]
    fn edges(&self) -> u32 {
        self.strategy.edges()
    }

    #[inline(always)]
    fn camera_density(&self, i: u32) -> PdfArea<L::F> {
        let t = self.strategy.t;
        if i < t {
            self.camera.pdf_fwd[(t - 1 - i) as usize % 2]
        } else {
            self.joint.camera_density[(i - t) as usize % 2]
        }
    }

    #[inline(always)]
    fn light_density(&self, i: u32) -> PdfArea<L::F> {
        let Strategy { s, t } = self.strategy;
        if i < t {
            return self.joint.light_density[(t - 1 - i) as usize % 2];
        }
        let pdf = self.light.pdf_fwd[(i - t) as usize % 2];
        if s == 1 && t >= 2 { PdfArea(pdf.0 / self.joint.next_event_ratio) } else { pdf }
    }

    #[inline(always)]
    fn next_event_ratio(&self) -> L::F {
        self.joint.next_event_ratio
    }

    #[inline(always)]
    fn is_delta(&self, i: u32) -> L::M {
        let Strategy { s, t } = self.strategy;
        let at_joint = s > 0 && (i + 1 == t || i == t);
        if i == 0 || i == self.edges() || at_joint {
            self.lanes().mask(0)
        } else if i < t {
            self.camera.is_delta[(t - 2).wrapping_sub(i) as usize % 2]
        } else {
            self.light.is_delta[(i - t - 1) as usize % 2]
        }
    }

    #[inline(always)]
    fn is_seen_by_specular(&self, i: u32) -> L::M {
        // From the light's side on there is the joint between them.
        match self.strategy.t.checked_sub(1 + i) {
            Some(back) => self.camera.is_seen_by_specular[back as usize % 2],
            None => self.lanes().mask(0),
        }
    }

    #[inline(always)]
    fn light_is_hittable(&self) -> L::M {
        self.light_is_hittable
    }

    #[inline(always)]
    fn raster(&self) -> [L::F; 2] {
        self.raster
    }

    #[inline(always)]
    fn ends_are_directions(&self) -> L::M {
        self.ends_are_directions
    }
}

/// Whether the light at a point can be met by a ray: see [`Densities::light_is_hittable`].
#[inline(always)]
pub fn is_hittable<L: Lanes, B>(scene: &Scene, end: &Point<L, B>) -> L::M {
    if end.place == Place::Surface {
        return end.lies_on_light();
    }
    let hittable = |id| scene.lights().is_hittable(id);
    end.alpha.lanes().condition(|k| L::lane(&end.light, k).is_some_and(hittable))
}

/// Whether both ends are directions alone: see [`Densities::ends_are_directions`].
#[inline(always)]
pub fn are_directions<L: Lanes, B>(lens: &Point<L, B>, end: &Point<L, B>) -> L::M {
    let both = lens.place == Place::Film && end.place == Place::Infinite;
    lens.alpha.lanes().mask(if both { u32::MAX } else { 0 })
}
