//! Which distribution a walk takes its directions from (lecture, *directional sampling*): the BSDF's own, or none in
//! particular.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::{Bsdf, BsdfSample, GRAZING, Lobe, Scatter, Transport};
use crate::sampling::{PdfSolidAngle, warp};

/// How a walk samples the direction in which it leaves the continuous part of a BSDF. Delta lobes, and their
/// probabilities, are the same for every rule: there is no other way to find them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Directions {
    /// In proportion to the BSDF's lobes: [`Bsdf::sample`].
    #[default]
    Bsdf,
    /// Uniform over the hemisphere that the walk comes from, or over the sphere where the continuous part transmits.
    Uniform,
}

impl Directions {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Bsdf, Self::Uniform];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bsdf => "bsdf",
            Self::Uniform => "uniform",
        }
    }
}

impl Bsdf {
    /// [`Bsdf::eval`] with the densities of walks that sample by the rule `directions`.
    #[inline]
    pub fn eval_by(&self, directions: Directions, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        let scatter = self.eval(lobe, to_camera, to_light);
        match (directions, lobe) {
            (Directions::Uniform, Lobe::Continuous) if scatter != Scatter::ZERO => Scatter {
                to_light: self.uniform_density(to_camera),
                to_camera: self.uniform_density(to_light),
                ..scatter
            },
            _ => scatter,
        }
    }

    /// [`Bsdf::sample`] by the rule `directions`.
    #[inline]
    pub fn sample_by(&self, directions: Directions, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        match directions {
            Directions::Bsdf => self.sample(known, transport, u),
            Directions::Uniform => self.sample_uniform(known, transport, u),
        }
    }

    #[inline(never)]
    fn sample_uniform(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if known.z.abs() < GRAZING {
            return None;
        }
        // Which lobe is left to the BSDF, and of a delta the direction too. It uses `u.z` alone to tell deltas from the
        // rest, and whether its own continuous sample comes to anything does not matter here.
        if self.delta_count() > 0
            && let Some(sample) = self.sample(known, transport, u)
            && sample.lobe != Lobe::Continuous
        {
            return Some(sample);
        }
        let direction = if self.continuous_transmits() {
            warp::sphere(u.truncate())
        } else {
            let up = warp::sphere(u.truncate());
            up.with_z(up.z.abs().copysign(known.z))
        };
        let (to_camera, to_light) = transport.sides(known, direction);
        let scatter = self.eval_by(Directions::Uniform, Lobe::Continuous, to_camera, to_light);
        BsdfSample::checked(direction, Lobe::Continuous, scatter, transport)
    }

    /// The density of each direction that [`Directions::Uniform`] samples from `known`, where light passes.
    #[inline]
    fn uniform_density(&self, known: Vec3) -> PdfSolidAngle {
        let over_solid_angle = if self.continuous_transmits() { 0.25 * FRAC_1_PI } else { 0.5 * FRAC_1_PI };
        PdfSolidAngle(self.continuous_probability(known) * over_solid_angle)
    }
}
