//! What the layered BSDFs share: one compensated interface over one base, and how to choose between lobes.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::{Scatter, albedo::Split, cosine_on_side, microfacet::SMOOTH_ALPHA};
use crate::{
    lanes::{Float, Lanes, Select},
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

    /// 1 − E, what the base gets, towards the direction of `split` or on average. Every term is positive, so that
    /// nothing cancels.
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

/// F_ms = F² E₁/(1 − F(1 − E₁)), averages all: the part of the light that meets a second facet which is reflected by it
/// and by as many more as it takes to get out (Kulla & Conty 2017, *Revisiting Physically Based Shading at
/// Imageworks*). 1 for F = 1.
#[inline]
pub(super) fn multiple(fresnel: f32, e1: f32) -> f32 {
    fresnel * fresnel * e1 / (1.0 - fresnel * (1.0 - e1))
}

/// f of a lobe c·a(camera)·a(light) whose albedo towards a direction is c·a, `average` being a's cosine-weighted mean,
/// 1/sr (Kelemen & Szirmay-Kalos 2001): a product, hence reciprocal. What is nothing everywhere has no lobe.
#[inline]
pub(super) fn product_lobe(camera: f32, light: f32, average: f32) -> f32 {
    if average > 0.0 { camera * (light / average) * FRAC_1_PI } else { 0.0 }
}

/// Ways of sampling the direction across from `known`, weighted by about how much light each finds.
///
/// Weights that follow the light make a lobe that is hardly ever chosen one that hardly matters, so that the 24 bits
/// that choose suffice.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ways {
    /// By facets, which are for others to sample.
    pub facets: f32,
    /// By the cosine, on the side of `known`: the base.
    pub base: f32,
    /// By [`Grazing`], on the side of `known`: what comes back after several facets.
    pub back: f32,
    /// By [`Grazing`], on the other side: what passes after several facets.
    pub across: f32,
}

impl Ways {
    /// The probability of sampling a facet.
    #[inline]
    pub fn facet_probability(&self) -> f32 {
        ratio(self.facets, self.base + self.back + self.across)
    }

    /// A direction by any way but facets, for the number `u.z` that has not chosen them.
    #[inline]
    pub fn sample(&self, known: Vec3, alpha: f32, u: Vec3) -> Vec3 {
        let z = u.z * (self.facets + self.base + self.back + self.across) - self.facets;
        let smooth = self.back + self.across;
        if smooth == 0.0 || (z < self.base && self.base > 0.0) {
            return cosine_on_side(known, [u.x, u.y]);
        }
        let returns = self.across == 0.0 || (z < self.base + self.back && self.back > 0.0);
        Grazing::new(alpha).sample(if returns { known } else { -known }, u.truncate())
    }

    /// The density of [`Self::sample`] for `w` on the same side as the known direction or the other, 1/sr, with the
    /// probability of the way.
    #[inline]
    pub fn pdf(&self, same_side: bool, w: Vec3, grazing: Grazing) -> f32 {
        let total = self.facets + self.base + self.back + self.across;
        if total == 0.0 {
            return 0.0;
        }
        let cosine = if same_side { self.base * warp::cosine_hemisphere_pdf(w.z.abs()).0 } else { 0.0 };
        let several = if same_side { self.back } else { self.across };
        (cosine + several * grazing.pdf(w.z)) / total
    }
}

/// A lobe of the value `f` that is sampled by [`Ways`] other than facets, from either end.
#[inline]
pub(super) fn smooth_lobe(
    f: Rgb,
    grazing: Grazing,
    (to_camera, from_camera): (Vec3, &Ways),
    (to_light, from_light): (Vec3, &Ways),
) -> Scatter {
    let same_side = to_camera.z * to_light.z > 0.0;
    Scatter {
        f,
        to_light: PdfSolidAngle(from_camera.pdf(same_side, to_light, grazing)),
        to_camera: PdfSolidAngle(from_light.pdf(same_side, to_camera, grazing)),
    }
}

/// Directions with density μ/(π L (μ² + α²)), L = ln(1 + 1/α²): about as light leaves after several facets, of which
/// there is μ (1 − E₁(μ)) ∝ α²/μ above μ ≈ α. For small α it is at the horizon, where the cosine would hardly ever
/// look.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grazing {
    square: f32,
    logarithm: f32,
}

impl Grazing {
    /// For an interface of this α; a smooth one has no such light, and its density is 0.
    #[inline]
    pub fn new(alpha: f32) -> Self {
        if alpha < SMOOTH_ALPHA {
            return Self { square: 1.0, logarithm: f32::INFINITY };
        }
        let square = alpha * alpha;
        Self { square, logarithm: square.recip().ln_1p() }
    }

    #[inline]
    fn pdf(self, cos: f32) -> f32 {
        FRAC_1_PI * cos.abs() / (self.logarithm * (cos * cos + self.square))
    }

    /// A direction on the side of `side`: (μ²/α² + 1) = (1 + 1/α²)^u.
    #[inline]
    fn sample(self, side: Vec3, u: Vec2) -> Vec3 {
        let square = (self.square * (u.x * self.logarithm).exp_m1()).min(1.0);
        let (sin, cos) = (TAU * u.y).sin_cos();
        let r = (1.0 - square).sqrt();
        Vec3::new(r * cos, r * sin, square.sqrt().copysign(side.z))
    }
}

/// a/(a + b) for weights that are not negative; 0 if both are.
#[inline(always)]
pub(super) fn ratio<F: Float>(a: F, b: F) -> F {
    let zero = a.lanes().splat(0.0);
    zero.lt(a).select(a / (a + b), zero)
}
