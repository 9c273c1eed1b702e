//! Merging: a camera subpath and a light subpath whose last vertices lie near each other, as one path (Georgiev et al.
//! 2012, *Light Transport Simulation with Vertex Connection and Merging*; Hachisuka et al. 2012).

use super::{Beginning, Densities, RivalSum, Rivals, Step, Strategy, Tail, Techniques, scattering::Surfaces};
use crate::{
    lanes::{Float, Lanes, Mask, One, Record, Vector},
    math::{Rgb, octahedral},
    sampling::PdfArea,
    scene::bsdf::Lobe,
};

/// The last vertex q of a light subpath of two vertices or more, as a pass keeps it for all camera subpaths: a
/// [`Record`].
#[derive(Clone, Copy, Debug)]
pub struct LightVertex<L: Lanes = One> {
    /// Where it is.
    pub position: L::V,
    /// The unit direction to its predecessor, the light's side.
    to_light: L::V,
    /// The prefix of F/p up to here, over α: both subpaths stop here, and F has α once.
    beta: Rgb<L::V>,
    /// l_i, its own density.
    pdf: PdfArea<L::F>,
    /// What makes the density of going to the predecessor an area density there.
    to_area: L::F,
    /// What the techniques that have the predecessor from the camera come to, over that one's own density: c_{i+1}
    /// times it is the sum in the units of [`Rivals::towards_camera`].
    beyond: RivalSum<L::U>,
    /// How many times the edge to the predecessor counts as one that can be connected, the table's count apart.
    connects: L::F,
    /// N_g, packed.
    normal: L::U,
    /// The vertices of the subpath; and [`DISPERSED`].
    vertices: L::U,
    /// Which light subpath of the pass.
    path: L::U,
}

/// Where two subpaths meet: the factors of F/p at p_i and what changes there.
#[derive(Clone, Copy, Debug)]
pub struct Meeting<L: Lanes = One> {
    /// The strategy that would connect the camera's vertex to the light vertex's predecessor.
    pub strategy: Strategy,
    /// F/p without h_j, over roulette's survival probability; black where nothing passes.
    pub contribution: Rgb<L::V>,
    /// c_{i+1}.
    pub camera_density: PdfArea<L::F>,
    /// l_i and l_{i−1}.
    pub light_density: [PdfArea<L::F>; 2],
}

/// Of [`LightVertex::vertices`] the bit that says that a vertex before the last, and after the light, lies on a
/// dispersive interface.
const DISPERSED: u32 = 1 << 31;

/// Two normals farther apart than this angle's cosine are those of different surfaces.
const SAME_SURFACE: f32 = 0.5;

/// Whether the kernel takes a light vertex for a vertex of the camera's: within the radius, on a surface that faces the
/// same way, and lit from the same side. So no light leaks around corners or through walls; it does between surfaces
/// that lie over each other within the radius, and under what stands on one.
#[inline(always)]
pub fn is_met<V: Vector>(
    radius: f32,
    [x, q]: [V; 2],
    [normal_at_x, normal_at_q]: [V; 2],
    to_light: V,
) -> <V::Lanes as Lanes>::M {
    let lanes = normal_at_x.dot(to_light).lanes();
    let same_surface = lanes.splat(SAME_SURFACE).le(normal_at_x.dot(normal_at_q));
    let same_side = lanes.splat(0.0).lt(normal_at_x.dot(to_light) * normal_at_q.dot(to_light));
    is_near(radius, x, q) & same_surface & same_side
}

/// Whether the distance alone lets two vertices merge.
#[inline(always)]
pub fn is_near<V: Vector>(radius: f32, x: V, q: V) -> <V::Lanes as Lanes>::M {
    let apart = x - q;
    let squared = apart.dot(apart);
    squared.le(squared.lanes().splat(radius * radius))
}

impl<L: Lanes> LightVertex<L> {
    /// The last vertex of a prefix of so many `vertices` of a light subpath. Nothing can meet one without a continuous
    /// lobe.
    ///
    /// `tail` is the prefix', `beginning` the subpath's, and `path` its number in the pass.
    #[inline(always)]
    pub fn of<B: Surfaces<L>>(
        (here, tail): (&Step<L, B>, &Tail<L>),
        vertices: u32,
        beginning: Beginning<L::F>,
        rivals: &Rivals,
        path: L::U,
    ) -> Self {
        let (p, back) = (&here.vertex.point, &here.back);
        let lanes = p.alpha.lanes();
        let (j, [here_pdf, from_pdf], [from_is_delta, _]) = (vertices as usize - 2, tail.pdf_fwd, tail.is_delta);
        let connects = beginning.connects(j, tail.is_delta);
        let beyond = rivals.light.up_to(j, from_pdf, connects, !from_is_delta, tail.rivals);
        Self {
            position: p.position,
            to_light: back.direction,
            beta: here.beta.times(lanes.splat(1.0) / p.alpha),
            pdf: here_pdf,
            to_area: back.visibility * back.alpha_b * back.cos_b / back.distance_squared,
            beyond: RivalSum::nearest(beyond / from_pdf.0.to_f64()),
            connects: beginning.connects(j + 1, [lanes.mask(0), from_is_delta]),
            normal: octahedral::pack(p.normal),
            vertices: lanes.splat_u(vertices),
            path,
        }
    }

    /// The vertices as they are kept, one to a record.
    #[inline(always)]
    pub fn columns(&self) -> [L::F; 16] {
        let [a, b, c] = self.position.coordinates();
        let [d, e, f] = self.to_light.coordinates();
        let [r, g, b_] = self.beta.channels().coordinates();
        let words = [self.beyond.word(), self.normal, self.vertices, self.path];
        let [beyond, normal, vertices, path] = words.map(L::F::of_bits);
        [a, b, c, d, e, f, r, g, b_, self.pdf.0, self.to_area, beyond, self.connects, normal, vertices, path]
    }

    /// The vertices that are kept so.
    #[inline(always)]
    pub fn of_columns(x: [L::F; 16]) -> Self {
        let v = |i: usize| L::V::new(x[i], x[i + 1], x[i + 2]);
        Self {
            position: v(0),
            to_light: v(3),
            beta: Rgb::of(v(6)),
            pdf: PdfArea(x[9]),
            to_area: x[10],
            beyond: RivalSum::of_word(x[11].to_bits()),
            connects: x[12],
            normal: x[13].to_bits(),
            vertices: x[14].to_bits(),
            path: x[15].to_bits(),
        }
    }

    /// Where the last vertex x of camera subpaths meets these, all of them of `strategy`.
    #[inline(always)]
    pub fn met_by<B: Surfaces<L>>(
        &self,
        x: &Step<L, B>,
        strategy: Strategy,
        techniques: &Techniques,
    ) -> Option<Meeting<L>> {
        let (p, radius) = (&x.vertex.point, techniques.radius()?);
        if strategy.edges() > techniques.max_depth() {
            return None;
        }
        let normals = [p.normal, octahedral::unpack(self.normal)];
        let met = is_met(radius, [p.position, self.position], normals, self.to_light);
        met.any().then(|| Meeting::at(x, strategy, (self, met), techniques))
    }

    /// The weights of paths that [`Self::met_by`] has found; of the camera's subpaths the tail, and where they begin on
    /// the image.
    #[inline(always)]
    pub fn weight(
        &self,
        (camera, raster): (&Tail<L>, [L::F; 2]),
        meeting: &Meeting<L>,
        techniques: &Techniques,
        rivals: &Rivals,
    ) -> L::F {
        let Strategy { s, t } = meeting.strategy;
        let near = CameraPart { camera, meeting, raster };
        let towards_camera = rivals.towards_camera(&near, t, techniques, camera.rivals);
        let mut towards_light = meeting.camera_density.0.to_f64() * self.beyond.root();
        let in_units = |count: f32| f64::from(count) / f64::from(rivals.unit());
        let mut connected = self.connects.to_f64() * in_units(techniques.count(Strategy { s, t }));
        if let Some(factors) = techniques.variance_factors()
            && near.edges() == 2
        {
            // Beyond the light there is nothing but a hit of it.
            let [hit, next_event] = [Strategy { s: 0, t: 3 }, Strategy { s: 1, t: 2 }];
            towards_light = towards_light * factors.of(near.lanes(), hit, raster).to_f64();
            connected = connected * factors.of(near.lanes(), next_event, raster).to_f64();
        }
        let own = self.pdf.0.to_f64() * in_units(techniques.merging_factor(t));
        rivals.share(own, [connected, towards_camera, towards_light])
    }
}

impl LightVertex {
    /// The last vertex of a prefix of one light subpath; `None` where nothing can meet it, or nothing is to.
    pub fn of_prefix(prefix: &[Step], beginning: Beginning, rivals: &Rivals, path: u32) -> Option<Self> {
        let (len, fewest) = (prefix.len() as u32, rivals.light.meeting_places().fewest_light_vertices());
        let here = prefix.last().filter(|here| len >= fewest && here.vertex.point.bsdf.has_continuous())?;
        Some(Self::of((here, &Tail::of(prefix)), len, beginning, rivals, path))
    }

    /// The same, said to have come over a dispersive interface or not.
    #[must_use]
    pub fn dispersed(self, is_dispersed: bool) -> Self {
        Self { vertices: self.vertices() | if is_dispersed { DISPERSED } else { 0 }, ..self }
    }

    /// Whether a path that meets it is dispersed whatever the camera's part is.
    #[inline]
    pub fn is_dispersed(&self) -> bool {
        self.vertices & DISPERSED != 0
    }

    /// The vertex that is kept so.
    #[inline]
    pub fn of_record(record: &Record) -> Self {
        Self::of_columns(record.0)
    }

    /// As it is kept.
    #[inline]
    pub fn record(&self) -> Record {
        Record(self.columns())
    }

    /// One at this place, of the given number, for tests of what looks for places alone.
    #[cfg(test)]
    pub(crate) fn at(position: glam::Vec3, path: u32) -> Self {
        Self {
            position,
            to_light: glam::Vec3::Y,
            beta: Rgb::ONE,
            pdf: PdfArea(1.0),
            to_area: 1.0,
            beyond: RivalSum::ZERO,
            connects: 1.0,
            normal: octahedral::pack(glam::Vec3::Y),
            vertices: 2,
            path,
        }
    }

    /// The vertices of the subpath.
    #[inline]
    pub fn vertices(&self) -> u32 {
        self.vertices & !DISPERSED
    }

    /// Which light subpath of the pass.
    #[inline]
    pub fn path(&self) -> u32 {
        self.path
    }

    /// What merges with it at the `t`-th vertex of a camera subpath.
    #[inline]
    pub fn strategy(&self, t: u32) -> Strategy {
        Strategy { s: self.vertices() - 1, t }
    }
}

impl<L: Lanes> Meeting<L> {
    /// At `x` with the light vertices `q`, in the lanes `met`.
    #[inline(always)]
    fn at<B: Surfaces<L>>(
        x: &Step<L, B>,
        strategy: Strategy,
        (q, met): (&LightVertex<L>, L::M),
        techniques: &Techniques,
    ) -> Self {
        let scatter = B::scatter_at(&x.vertex.point, Lobe::Continuous, x.back.direction, q.to_light);
        let lanes = q.to_area.lanes();
        let kernel = 1.0 / techniques.merging_area();
        let contribution = (x.beta * scatter.f * q.beta).times(lanes.splat(kernel));
        Self {
            strategy,
            contribution: Rgb::select(met, contribution, Rgb::grey(lanes.splat(0.0))),
            camera_density: PdfArea(scatter.to_light.0 * q.to_area),
            light_density: [q.pdf, scatter.to_camera.to_area(&x.back)],
        }
    }
}

/// The camera's part of a path that has merged, as far as a weight looks at it beside the light vertex.
struct CameraPart<'a, L: Lanes> {
    camera: &'a Tail<L>,
    meeting: &'a Meeting<L>,
    raster: [L::F; 2],
}

impl<L: Lanes> Densities<L> for CameraPart<'_, L> {
    #[inline(always)]
    fn lanes(&self) -> L {
        self.meeting.camera_density.0.lanes()
    }

    #[inline(always)]
    fn edges(&self) -> u32 {
        self.meeting.strategy.edges()
    }

    #[inline(always)]
    fn camera_density(&self, i: u32) -> PdfArea<L::F> {
        self.camera.pdf_fwd[(self.meeting.strategy.t - 1 - i) as usize]
    }

    #[inline(always)]
    fn light_density(&self, i: u32) -> PdfArea<L::F> {
        self.meeting.light_density[(self.meeting.strategy.t - 1 - i) as usize]
    }

    #[inline(always)]
    fn next_event_ratio(&self) -> L::F {
        self.lanes().splat(1.0) // of strategies with s ≥ 2 alone
    }

    #[inline(always)]
    fn is_delta(&self, i: u32) -> L::M {
        let t = self.meeting.strategy.t;
        if i + 1 == t { self.lanes().mask(0) } else { self.camera.is_delta[(t - 2 - i) as usize] }
    }

    #[inline(always)]
    fn is_seen_by_specular(&self, i: u32) -> L::M {
        self.camera.is_seen_by_specular[(self.meeting.strategy.t - 1 - i) as usize]
    }

    #[inline(always)]
    fn light_is_hittable(&self) -> L::M {
        self.lanes().mask(u32::MAX)
    }

    #[inline(always)]
    fn raster(&self) -> [L::F; 2] {
        self.raster
    }

    #[inline(always)]
    fn ends_are_directions(&self) -> L::M {
        self.lanes().mask(0)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_record_keeps_all_of_a_light_vertex() {
        let mut words = [0.0; 16];
        for (i, word) in words.iter_mut().enumerate() {
            *word = 1.0 + i as f32;
        }
        assert_eq!(LightVertex::of_record(&Record(words)).record(), Record(words));
    }

    #[test]
    fn the_kernel_asks_for_distance_normal_and_side() {
        let met = |q: Vec3, normal: Vec3, to_light: Vec3| is_met(0.1, [Vec3::ZERO, q], [Vec3::Y, normal], to_light);
        assert!(met(Vec3::new(0.09, 0.0, 0.0), Vec3::Y, Vec3::Y));
        assert!(!met(Vec3::new(0.11, 0.0, 0.0), Vec3::Y, Vec3::Y));
        // A wall's other surface, and the wall beside a floor.
        assert!(!met(Vec3::ZERO, -Vec3::Y, Vec3::Y));
        assert!(!met(Vec3::ZERO, Vec3::X, Vec3::new(0.6, 0.8, 0.0)));
        // A wall's other surface that is not quite parallel, lit along both.
        let behind = Vec3::new(-0.34, -0.94, 0.0).normalize();
        assert!(!met(Vec3::ZERO, behind, Vec3::new(-0.95, 0.1, 0.0).normalize()));
        // Lit from below on one of them, where both are nearly parallel.
        let tilted = Vec3::new(0.5, 0.8, 0.0).normalize();
        assert!(!met(Vec3::ZERO, tilted, Vec3::new(-0.9, 0.1, 0.0).normalize()));
    }
}
