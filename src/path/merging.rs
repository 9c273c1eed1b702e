//! Merging: a camera subpath and a light subpath whose last vertices lie near each other, as one path (Georgiev et al.
//! 2012, *Light Transport Simulation with Vertex Connection and Merging*; Hachisuka et al. 2012).

use glam::Vec3;

use super::{Beginning, Densities, RivalSum, Rivals, Step, Strategy, Techniques, scattering::Surfaces};
use crate::{
    lanes::One,
    math::{Rgb, octahedral},
    sampling::PdfArea,
    scene::bsdf::{Bsdf, Lobe, Scatter},
};

/// The last vertex q of a light subpath of two vertices or more, as a pass keeps it for all camera subpaths: 64 bytes.
#[derive(Clone, Copy, Debug)]
pub struct LightVertex {
    /// Where it is.
    pub position: Vec3,
    /// The unit direction to its predecessor, the light's side.
    to_light: Vec3,
    /// The prefix of F/p up to here, over α: both subpaths stop here, and F has α once.
    beta: Rgb,
    /// l_i, its own density.
    pdf: PdfArea,
    /// What makes the density of going to the predecessor an area density there.
    to_area: f32,
    /// What the techniques that have the predecessor from the camera come to, over that one's own density: c_{i+1}
    /// times it is the sum in the units of [`Rivals::towards_camera`].
    beyond: RivalSum,
    /// How many times the edge to the predecessor counts as one that can be connected, the table's count apart.
    connects: f32,
    /// N_g, packed.
    normal: u32,
    /// The vertices of the subpath.
    vertices: u32,
    /// Which light subpath of the pass.
    path: u32,
}

/// Where two subpaths meet: the factors of F/p at p_i and what changes there.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// The strategy that would connect the camera's vertex to the light vertex's predecessor.
    pub strategy: Strategy,
    /// F/p without h_j, over roulette's survival probability.
    pub contribution: Rgb,
    /// c_{i+1}.
    pub camera_density: PdfArea,
    /// l_i and l_{i−1}.
    pub light_density: [PdfArea; 2],
}

/// Two normals farther apart than this angle's cosine are those of different surfaces.
const SAME_SURFACE: f32 = 0.5;

/// Whether the kernel takes a light vertex for a vertex of the camera's: within the radius, on a surface that faces the
/// same way, and lit from the same side. So no light leaks around corners or through walls; it does between surfaces
/// that lie over each other within the radius, and under what stands on one.
#[inline]
pub fn is_met(radius: f32, [x, q]: [Vec3; 2], [normal_at_x, normal_at_q]: [Vec3; 2], to_light: Vec3) -> bool {
    x.distance_squared(q) <= radius * radius
        && normal_at_x.dot(normal_at_q) >= SAME_SURFACE
        && normal_at_x.dot(to_light) * normal_at_q.dot(to_light) > 0.0
}

impl LightVertex {
    /// The last vertex of a prefix of a light subpath; `None` where nothing can meet it.
    ///
    /// `beginning` is the subpath's, and `path` its number in the pass.
    #[inline]
    pub fn of(prefix: &[Step], beginning: Beginning, rivals: &Rivals, path: u32) -> Option<Self> {
        let [.., from, here] = prefix else { return None };
        let p = &here.vertex.point;
        if !p.bsdf.has_continuous() {
            return None;
        }
        let j = prefix.len() - 2;
        let (from_is_delta, before) = (from.vertex.is_delta(), j.checked_sub(1).map(|k| &prefix[k]));
        let before_is_delta = before.is_some_and(|before| before.vertex.is_delta());
        let connects = beginning.connects(j, [from_is_delta, before_is_delta]);
        let before = before.map_or(RivalSum::ZERO, |before| before.rivals);
        let beyond = rivals.light.up_to(j, from.pdf_fwd, connects, from_is_delta, before);
        let back = &here.back;
        Some(Self {
            position: p.position,
            to_light: back.direction,
            beta: here.beta * (1.0 / p.alpha),
            pdf: here.pdf_fwd,
            to_area: back.visibility * back.alpha_b * back.cos_b / back.distance_squared,
            beyond: RivalSum::nearest(beyond / f64::from(from.pdf_fwd.0)),
            connects: beginning.connects(prefix.len() - 1, [false, from_is_delta]),
            normal: octahedral::pack(p.normal),
            vertices: prefix.len() as u32,
            path,
        })
    }

    /// One at this place, of the given number, for tests of what looks for places alone.
    #[cfg(test)]
    pub(crate) fn at(position: Vec3, path: u32) -> Self {
        Self {
            position,
            to_light: Vec3::Y,
            beta: Rgb::ONE,
            pdf: PdfArea(1.0),
            to_area: 1.0,
            beyond: RivalSum::ZERO,
            connects: 1.0,
            normal: octahedral::pack(Vec3::Y),
            vertices: 2,
            path,
        }
    }

    /// The vertices of the subpath.
    #[inline]
    pub fn vertices(&self) -> u32 {
        self.vertices
    }

    /// Which light subpath of the pass.
    #[inline]
    pub fn path(&self) -> u32 {
        self.path
    }

    /// Where the last vertex x of a camera subpath meets this one, and something passes.
    #[inline]
    pub fn met_by(&self, camera: &[Step], techniques: &Techniques) -> Option<Meeting> {
        let strategy = Strategy { s: self.vertices - 1, t: camera.len() as u32 };
        let (x, radius) = (camera.last()?, techniques.radius()?);
        let p = &x.vertex.point;
        if strategy.edges() > techniques.max_depth()
            || !is_met(radius, [p.position, self.position], [p.normal, octahedral::unpack(self.normal)], self.to_light)
        {
            return None;
        }
        Meeting::at(x, strategy, self.to_light, self.beta, [self.pdf, PdfArea(self.to_area)], techniques)
    }

    /// The weight of a path that [`Self::met_by`] has found.
    #[inline]
    pub fn weight(&self, camera: &[Step], meeting: &Meeting, techniques: &Techniques, rivals: &Rivals) -> f32 {
        let Strategy { s, t } = meeting.strategy;
        let before = if let [.., last, _, _] = camera { last.rivals } else { RivalSum::ZERO };
        let near = CameraPart { camera, meeting };
        let towards_camera = rivals.towards_camera(&near, t, techniques, before);
        let towards_light = f64::from(meeting.camera_density.0) * self.beyond.root();
        let per_unit = 1.0 / f64::from(rivals.unit());
        let connected = f64::from(techniques.count(Strategy { s, t }) * self.connects) * per_unit;
        let own = f64::from(techniques.merging_factor(t)) * per_unit * f64::from(self.pdf.0);
        rivals.share(own, [connected, towards_camera, towards_light])
    }
}

impl Meeting {
    /// At `x` with light from the direction `to_light`: `light` is the light's prefix of F/p, over α, and `pdf` its
    /// last vertex' density and what makes one of going back from there an area density.
    #[inline]
    fn at(
        x: &Step,
        strategy: Strategy,
        to_light: Vec3,
        light: Rgb,
        [pdf, to_area]: [PdfArea; 2],
        techniques: &Techniques,
    ) -> Option<Self> {
        let scatter: Scatter = Bsdf::scatter_at(&x.vertex.point, Lobe::Continuous, x.back.direction, to_light);
        if scatter.f == Rgb::ZERO {
            return None;
        }
        let kernel = 1.0 / techniques.merging_area();
        Some(Self {
            strategy,
            contribution: x.beta * scatter.f * light * kernel,
            camera_density: PdfArea(scatter.to_light.0 * to_area.0),
            light_density: [pdf, scatter.to_camera.to_area(&x.back)],
        })
    }
}

/// The camera's part of a path that has merged, as far as a weight looks at it beside the light vertex.
struct CameraPart<'a> {
    camera: &'a [Step],
    meeting: &'a Meeting,
}

impl Densities for CameraPart<'_> {
    #[inline(always)]
    fn lanes(&self) -> One {
        One
    }

    #[inline(always)]
    fn edges(&self) -> u32 {
        self.meeting.strategy.edges()
    }

    #[inline(always)]
    fn camera_density(&self, i: u32) -> PdfArea {
        self.camera[i as usize].pdf_fwd
    }

    #[inline(always)]
    fn light_density(&self, i: u32) -> PdfArea {
        self.meeting.light_density[(self.camera.len() - 1) - i as usize]
    }

    #[inline(always)]
    fn next_event_ratio(&self) -> f32 {
        1.0 // of strategies with s ≥ 2 alone
    }

    #[inline(always)]
    fn is_delta(&self, i: u32) -> bool {
        i as usize + 1 < self.camera.len() && self.camera[i as usize].vertex.is_delta()
    }

    #[inline(always)]
    fn light_is_hittable(&self) -> bool {
        true
    }

    #[inline(always)]
    fn ends_are_directions(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_vertex_has_the_size_of_a_cache_line() {
        assert_eq!(size_of::<LightVertex>(), 64);
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
