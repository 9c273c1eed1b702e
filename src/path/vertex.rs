//! A vertex p_i of a path: a point of the scene and the lobe with which the path scatters there.

use glam::Vec3;

use crate::scene::{
    bsdf::{BsdfSample, Directions, Lobe, Scatter, Transport},
    point::Point,
    tilt::Tilt,
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
    /// f̂ = f_s |ω_light·N_s| / |ω_light·N_g|, with both directions as [`Tilt`] maps them near the horizons: with the
    /// geometric cosines of G this scatters over shading normals as radiance does, whichever way the path was found, so
    /// that no strategy needs a correction of its own (Veach 5.3). α is left out because a walk that stops
    /// here with probability α divides by it again.
    #[inline]
    pub fn scatter(&self, to_camera: Vec3, to_light: Vec3) -> Scatter {
        scatter(&self.point, self.lobe, to_camera, to_light)
    }

    /// Samples the direction across from the unit world direction `known`, the continuous part's by the rule
    /// `directions`; the result is in world space and holds f̂/α.
    ///
    /// # Errors
    /// What ends the walk here.
    #[inline(always)]
    pub fn sample(
        &self,
        directions: Directions,
        known: Vec3,
        transport: Transport,
        u: Vec3,
    ) -> Result<BsdfSample, Unscattered> {
        let p = &self.point;
        if !p.is_flat() {
            return sample_tilted(p, directions, known, transport, u);
        }
        // Within the surface's plane there is no side to go to.
        let sample = p.bsdf.sample_around(p.normal, directions, known, transport, u);
        sample.filter(|sample| p.normal.dot(sample.direction) != 0.0).ok_or(Unscattered::Nothing)
    }

    /// η_light/η_camera across this vertex, for unit world directions; see [`crate::scene::bsdf::Bsdf::relative_ior`].
    #[inline]
    pub fn relative_ior(&self, to_camera: Vec3, to_light: Vec3) -> f32 {
        let z = self.point.normal;
        let local = |w: Vec3| Vec3::new(0.0, 0.0, z.dot(w));
        self.point.bsdf.relative_ior(local(to_camera), local(to_light))
    }
}

/// Why a walk does not leave a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unscattered {
    /// The BSDF has no direction, or none that light could take.
    Nothing,
    /// It has one, but N_s and N_g do not agree on the side: light that is lost to shading normals.
    Sides,
}

/// [`Vertex::scatter`] of a vertex at `p` that uses `lobe`, which a connection asks of many without making them.
#[inline(always)]
pub(super) fn scatter(p: &Point, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
    if p.is_flat() {
        p.bsdf.eval_around(p.normal, lobe, to_camera, to_light)
    } else {
        scatter_tilted(p, lobe, to_camera, to_light)
    }
}

#[inline(never)]
fn scatter_tilted(p: &Point, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
    let tilt = Tilt::at(p);
    let (camera, light) = (tilt.to_shading(to_camera), tilt.to_shading(to_light));
    if !(camera.keeps_side() && light.keeps_side()) {
        return Scatter::ZERO;
    }
    let scatter = p.bsdf.eval_around(p.shading_normal, lobe, camera.direction, light.direction);
    let f = scatter.f * light.factor(lobe);
    Tilt::densities(lobe, Scatter { f, ..scatter }, &camera, &light)
}

#[inline(never)]
fn sample_tilted(
    p: &Point,
    directions: Directions,
    known: Vec3,
    transport: Transport,
    u: Vec3,
) -> Result<BsdfSample, Unscattered> {
    let tilt = Tilt::at(p);
    let before = tilt.to_shading(known);
    if !before.keeps_side() {
        return Err(Unscattered::Sides);
    }
    let sample = p.bsdf.sample_around(p.shading_normal, directions, before.direction, transport, u);
    let BsdfSample { direction, lobe, scatter } = sample.ok_or(Unscattered::Nothing)?;
    let after = tilt.to_surface(direction);
    if !after.keeps_side() {
        return Err(Unscattered::Sides);
    }
    let (camera, light) = match transport {
        Transport::Radiance => (before, after),
        Transport::Importance => (after, before),
    };
    let f = scatter.f * light.factor(lobe);
    Ok(BsdfSample {
        direction: after.direction,
        lobe,
        scatter: Tilt::densities(lobe, Scatter { f, ..scatter }, &camera, &light),
    })
}
