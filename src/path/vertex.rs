//! A vertex p_i of a path: a point of the scene and the lobe with which the path scatters there.

use glam::Vec3;

#[cfg(feature = "mistakes")]
use crate::math::Rgb;
use crate::scene::{
    bsdf::{BsdfSample, Directions, Lobe, Scatter, Transport},
    point::Point,
};

/// One vertex. Its role (lens, surface, light) is its index in the path.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where it is, and what the scene is like there.
    pub point: Point,
    /// The lobe that the path uses here; [`Lobe::Continuous`] at the two ends.
    pub lobe: Lobe,
}

impl Vertex {
    /// A vertex at an end of a path or with the continuous lobe.
    #[inline(always)]
    pub fn new(point: Point) -> Self {
        Self { point, lobe: Lobe::Continuous }
    }

    /// Whether the path passes a delta lobe here, so that nothing can be connected to this vertex.
    #[inline]
    pub fn is_delta(&self) -> bool {
        self.lobe != Lobe::Continuous
    }

    /// f̂/α with the densities of both directions, for unit world directions towards the camera and the light.
    ///
    /// f̂ = f_s |ω_light·N_s| / |ω_light·N_g|: with the geometric cosines of G this scatters over shading normals as
    /// radiance does, whichever way the path was found, so that no strategy needs a correction of its own (Veach 5.3).
    /// Coverage α is left out because a walk that stops here with probability α divides by it again.
    #[inline]
    pub fn scatter(&self, to_camera: Vec3, to_light: Vec3) -> Scatter {
        scatter(&self.point, self.lobe, to_camera, to_light)
    }

    /// Samples the direction across from the unit world direction `known`, the continuous part's by the rule `directions`;
    /// the result is in world space and holds f̂/α.
    #[inline(always)]
    pub fn sample(&self, directions: Directions, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        let p = &self.point;
        if !p.sides_agree(known) {
            return None;
        }
        let sample = p.bsdf.sample_around(p.shading_normal, directions, known, transport, u)?;
        let direction = sample.direction;
        if !p.sides_agree(direction) {
            return None;
        }
        let (_, to_light) = transport.sides(known, direction);
        let f = sample.scatter.f * shading_factor(p, mistake!(to_light, NoShadingFactor => direction));
        Some(BsdfSample { scatter: Scatter { f, ..sample.scatter }, ..sample })
    }

    /// η_light/η_camera across this vertex, for unit world directions; see [`crate::scene::bsdf::Bsdf::relative_ior`].
    #[inline]
    pub fn relative_ior(&self, to_camera: Vec3, to_light: Vec3) -> f32 {
        let z = self.point.shading_normal;
        let local = |w: Vec3| Vec3::new(0.0, 0.0, z.dot(w));
        self.point.bsdf.relative_ior(local(to_camera), local(to_light))
    }

    /// f̂ as a walk from the light has it that takes N_s for the cosine of its own direction: a planted mistake.
    #[cfg(feature = "mistakes")]
    pub(super) fn without_adjoint(&self, f: Rgb, to_camera: Vec3, to_light: Vec3) -> Rgb {
        if f == Rgb::ZERO {
            f
        } else {
            f * (shading_factor(&self.point, to_camera) / shading_factor(&self.point, to_light))
        }
    }
}

/// [`Vertex::scatter`] of a vertex at `p` that uses `lobe`, which a connection asks of many without making them.
#[inline(always)]
pub(super) fn scatter(p: &Point, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
    if !(p.sides_agree(to_camera) && p.sides_agree(to_light)) {
        return Scatter::ZERO;
    }
    let scatter = p.bsdf.eval_around(p.shading_normal, lobe, to_camera, to_light);
    Scatter { f: scatter.f * shading_factor(p, to_light), ..scatter }
}

#[inline(always)]
fn shading_factor(p: &Point, to_light: Vec3) -> f32 {
    // Flat surfaces are the common case, and there the factor is exactly 1.
    if p.normal == p.shading_normal { 1.0 } else { (p.shading_normal.dot(to_light) / p.normal.dot(to_light)).abs() }
}
