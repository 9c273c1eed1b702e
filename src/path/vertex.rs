//! A vertex p_i of a path: a point of the scene and the lobe with which the path scatters there.

use glam::Vec3;

use super::scattering::{Sampled, Surfaces};
use crate::{
    lanes::{Float, Lanes, One},
    scene::{
        bsdf::{Bsdf, Directions, Lobe, Scatter, Transport},
        point::Point,
    },
};

/// One vertex. Its role (lens, surface, light) is its index in the path.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<L: Lanes = One, B = Bsdf> {
    /// Where it is, and what the scene is like there.
    pub point: Point<L, B>,
    /// The lobe that the path uses here; [`Lobe::Continuous`] at the two ends.
    pub lobe: L::Each<Lobe>,
}

impl<L: Lanes, B: Surfaces<L>> Vertex<L, B> {
    /// A vertex at an end of a path or with the continuous lobe.
    #[inline(always)]
    pub fn new(point: Point<L, B>) -> Self {
        let lobe = point.alpha.lanes().each(|_| Lobe::Continuous);
        Self { point, lobe }
    }

    /// Whether the path passes a delta lobe here, so that nothing can be connected to this vertex.
    #[inline(always)]
    pub fn is_delta(&self) -> L::M {
        self.point.alpha.lanes().condition(|k| L::lane(&self.lobe, k) != Lobe::Continuous)
    }

    /// Samples the direction across from the unit world direction `known`, the continuous part's by the rule
    /// `directions`; the result is in world space and holds f̂/α.
    #[inline(always)]
    pub fn sample(&self, directions: Directions, known: L::V, transport: Transport, u: [L::F; 3]) -> Sampled<L> {
        B::sample_at(&self.point, directions, known, transport, u)
    }
}

impl Vertex {
    /// f̂/α with the densities of both directions, for unit world directions towards the camera and the light.
    ///
    /// f̂ = f_s |ω_light·N_s| / |ω_light·N_g|, with both directions as [`Tilt`](crate::scene::tilt::Tilt) maps them
    /// near the horizons: with the geometric cosines of G this scatters over shading normals as radiance does,
    /// whichever way the path was found, so that no strategy needs a correction of its own (Veach 5.3). α is left out
    /// because a walk that stops here with probability α divides by it again.
    #[inline]
    pub fn scatter(&self, to_camera: Vec3, to_light: Vec3) -> Scatter {
        Bsdf::scatter_at(&self.point, self.lobe, to_camera, to_light)
    }

    /// η_light/η_camera across this vertex, for unit world directions; see [`crate::scene::bsdf::Bsdf::relative_ior`].
    #[inline]
    pub fn relative_ior(&self, to_camera: Vec3, to_light: Vec3) -> f32 {
        Bsdf::relative_ior_at(&self.point, to_camera, to_light)
    }
}
