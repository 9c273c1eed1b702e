//! What the layers of a surface let through of the light that it emits.

use glam::Vec3;

use super::{Bsdf, Bsdfs};
use crate::lanes::{Float, Lanes, MOST, Mask, One, Vector};

/// BSDFs over surfaces that emit.
pub trait OverEmission<L: Lanes> {
    /// By how much the surfaces with the unit normals N_s darken what they emit in the unit world direction `w`:
    /// factors in [0, 1]. `None` if none of them does.
    ///
    /// A clear coat lets through 1 − coat · F(|ω·N_coat|) (`KHR_materials_clearcoat`); nothing else lies over emission.
    fn emission_factor(&self, n_s: L::V, w: L::V) -> Option<L::F>;
}

impl OverEmission<One> for Bsdf {
    #[inline(always)]
    fn emission_factor(&self, n_s: Vec3, w: Vec3) -> Option<f32> {
        match self {
            Self::Layered(_) => Some(alone(self, n_s, w)),
            _ => None,
        }
    }
}

impl<L: Lanes> OverEmission<L> for Bsdfs<L> {
    #[inline(always)]
    fn emission_factor(&self, n_s: L::V, w: L::V) -> Option<L::F> {
        let Self::Each(bsdfs, which) = self else { return None };
        let lanes = n_s.max_element().lanes();
        let (n_s, w) = (n_s.all(), w.all());
        let mut factors = [1.0; MOST];
        for k in which.lanes() {
            factors[k] = alone(&L::lane(bsdfs, k), n_s[k].into(), w[k].into());
        }
        Some(lanes.load(&factors))
    }
}

/// Out of line, for one lane of many.
#[inline(never)]
fn alone(bsdf: &Bsdf, n_s: Vec3, w: Vec3) -> f32 {
    match bsdf {
        Bsdf::Layered(layered) => layered.emission_factor(n_s, w),
        _ => 1.0,
    }
}

impl Bsdf {
    /// The mean of [`OverEmission::emission_factor`] over the hemisphere, weighted by the cosine: what the layers leave
    /// of the emitted power. The coat's normal counts as N_s.
    pub fn mean_emission_factor(&self) -> f32 {
        match self {
            Self::Layered(layered) => layered.mean_emission_factor(),
            _ => 1.0,
        }
    }
}
