//! What the layered BSDFs share: one compensated interface over one base, and how to choose between lobes.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::{Scatter, albedo::Split};
use crate::{
    math::Rgb,
    sampling::{PdfSolidAngle, warp},
};

/// An interface that reflects by Schlick's approximation, as an albedo: what lies below sees the rest of the light.
///
/// What its facets reflect at once is F0·A + F90·B; of what meets another facet, 1 − E₁, it reflects the fraction
/// [`multiple`](Self::multiple). So its albedo is E = F0·A + F90·B + F_ms (1 − E₁), whatever lies below.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    /// Reflectance at normal incidence.
    pub f0: f32,
    /// Reflectance at grazing incidence.
    pub f90: f32,
}

impl Coat {
    /// glTF's dielectric interface of the index `ior` against its surroundings, in either order; 1 reflects nothing.
    #[inline]
    pub fn of_ior(ior: f32, is_matched: bool) -> Self {
        let r = (ior - 1.0) / (ior + 1.0);
        Self { f0: r * r, f90: f32::from(u8::from(!is_matched)) }
    }

    /// F_ms, the part of the light between facets that comes out again: see [`multiple`].
    #[inline]
    pub fn multiple(self, average: Split) -> f32 {
        multiple(mean_reflectance(self.f0, self.f90), 1.0 - average.missing)
    }

    /// What facets reflect at once, towards the direction of `split` or on average.
    #[inline]
    pub fn single(self, split: Split) -> f32 {
        self.f0 * split.normal + self.f90 * split.grazing
    }

    /// 1 − E, what the base gets, towards the direction of `split` or on average. Every term is positive, so that nothing cancels.
    #[inline]
    pub fn passed(self, split: Split, multiple: f32) -> f32 {
        (1.0 - self.f0) * split.normal + (1.0 - self.f90) * split.grazing + (1.0 - multiple) * split.missing
    }
}

/// Schlick's reflectance averaged over the cosine-weighted hemisphere.
#[inline]
pub(super) fn mean_reflectance(f0: f32, f90: f32) -> f32 {
    f0 + (f90 - f0) * MEAN_SCHLICK_WEIGHT
}

/// Mean of Schlick's weight (1 − cos θ)⁵ over the cosine-weighted hemisphere.
pub(super) const MEAN_SCHLICK_WEIGHT: f32 = 1.0 / 21.0;

/// F_ms = F² E₁/(1 − F(1 − E₁)), averages all: the part of the light that meets a second facet which is reflected by it and by as many
/// more as it takes to get out (Kulla & Conty 2017, *Revisiting Physically Based Shading at Imageworks*). 1 for F = 1.
#[inline]
pub(super) fn multiple(fresnel: f32, e1: f32) -> f32 {
    mistake!(fresnel * fresnel * e1 / (1.0 - fresnel * (1.0 - e1)), NoMultipleScattering => 0.0)
}

/// f of a lobe c·a(camera)·a(light) whose albedo towards a direction is c·a, `average` being a's cosine-weighted mean, 1/sr
/// (Kelemen & Szirmay-Kalos 2001): a product, hence reciprocal. What is nothing everywhere has no lobe.
#[inline]
pub(super) fn product_lobe(camera: f32, light: f32, average: f32) -> f32 {
    let share = |light: f32| mistake!(light / average, UndividedProduct => light);
    if average > 0.0 { camera * share(light) * FRAC_1_PI } else { 0.0 }
}

/// A lobe of the value `f` that is sampled by the cosine, with the given probabilities from either end.
#[inline]
pub(super) fn cosine_lobe(f: Rgb, (to_camera, p_camera): (Vec3, f32), (to_light, p_light): (Vec3, f32)) -> Scatter {
    Scatter {
        f,
        to_light: PdfSolidAngle(p_camera * warp::cosine_hemisphere_pdf(to_light.z.abs()).0),
        to_camera: PdfSolidAngle(p_light * warp::cosine_hemisphere_pdf(to_camera.z.abs()).0),
    }
}

/// a/(a + b) for weights that are not negative; 0 if both are.
#[inline]
pub(super) fn ratio(a: f32, b: f32) -> f32 {
    if a > 0.0 { a / (a + b) } else { 0.0 }
}
