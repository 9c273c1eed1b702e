//! What the layered BSDFs share: one compensated interface over one base, and how to choose between lobes.

use std::f32::consts::{FRAC_1_PI, TAU};

use super::{Scatter, albedo::Split, cosine_on_side, functions, microfacet::SMOOTH_ALPHA};
use crate::{
    lanes::{Float, Lanes, Mask, Select, Vector},
    math::Rgb,
    sampling::{PdfSolidAngle, warp},
};

/// An interface that reflects by Schlick's approximation, as an albedo: what lies below sees the rest of the light.
///
/// What its facets reflect at once is F0·A + F90·B; of what meets another facet, 1 − E₁, it reflects the fraction
/// [`multiple`](Self::multiple). So its albedo is E = F0·A + F90·B + F_ms (1 − E₁), whatever lies below.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat<F = f32> {
    /// Reflectance at normal incidence.
    pub f0: F,
    /// Reflectance at grazing incidence.
    pub f90: F,
}

impl<F: Float> Coat<F> {
    /// glTF's dielectric interface of the index `ior` against its surroundings, in either order; 1 reflects nothing.
    #[inline(always)]
    pub fn of_ior(ior: F, is_matched: <F::Lanes as Lanes>::M) -> Self {
        let (zero, one) = (ior.lanes().splat(0.0), ior.lanes().splat(1.0));
        let r = (ior - one) / (ior + one);
        Self { f0: r * r, f90: is_matched.select(zero, one) }
    }

    /// F_ms, the part of the light between facets that comes out again: see [`multiple`].
    #[inline(always)]
    pub fn multiple(self, average: Split<F>) -> F {
        multiple(mean_reflectance(self.f0, self.f90), self.f0.lanes().splat(1.0) - average.missing)
    }

    /// What facets reflect at once, towards the direction of `split` or on average.
    #[inline(always)]
    pub fn single(self, split: Split<F>) -> F {
        self.f0 * split.normal + self.f90 * split.grazing
    }

    /// 1 − E, what the base gets, towards the direction of `split` or on average. Every term is positive, so that
    /// nothing cancels.
    #[inline(always)]
    pub fn passed(self, split: Split<F>, multiple: F) -> F {
        let one = multiple.lanes().splat(1.0);
        (one - self.f0) * split.normal + (one - self.f90) * split.grazing + (one - multiple) * split.missing
    }
}

/// Schlick's reflectance averaged over the cosine-weighted hemisphere.
#[inline(always)]
pub(super) fn mean_reflectance<F: Float>(f0: F, f90: F) -> F {
    f0 + (f90 - f0) * MEAN_SCHLICK_WEIGHT
}

/// Mean of Schlick's weight (1 − cos θ)⁵ over the cosine-weighted hemisphere.
pub(super) const MEAN_SCHLICK_WEIGHT: f32 = 1.0 / 21.0;

/// F_ms = F² E₁/(1 − F(1 − E₁)), averages all: the part of the light that meets a second facet which is reflected by it
/// and by as many more as it takes to get out (Kulla & Conty 2017, *Revisiting Physically Based Shading at
/// Imageworks*). 1 for F = 1.
#[inline(always)]
pub(super) fn multiple<F: Float>(fresnel: F, e1: F) -> F {
    let one = e1.lanes().splat(1.0);
    fresnel * fresnel * e1 / (one - fresnel * (one - e1))
}

/// f of a lobe c·a(camera)·a(light) whose albedo towards a direction is c·a, `average` being a's cosine-weighted mean,
/// 1/sr (Kelemen & Szirmay-Kalos 2001): a product, hence reciprocal. What is nothing everywhere has no lobe.
#[inline(always)]
pub(super) fn product_lobe<F: Float>(camera: F, light: F, average: F) -> F {
    let zero = average.lanes().splat(0.0);
    zero.lt(average).select(camera * (light / average) * FRAC_1_PI, zero)
}

/// Ways of sampling the direction across from `known`, weighted by about how much light each finds.
///
/// Weights that follow the light make a lobe that is hardly ever chosen one that hardly matters, so that the 24 bits
/// that choose suffice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ways<F = f32> {
    /// By facets, which are for others to sample.
    pub facets: F,
    /// By the cosine, on the side of `known`: the base.
    pub base: F,
    /// By [`Grazing`], on the side of `known`: what comes back after several facets.
    pub back: F,
    /// By [`Grazing`], on the other side: what passes after several facets.
    pub across: F,
}

impl<F: Float> Ways<F> {
    /// The probability of sampling a facet.
    #[inline(always)]
    pub fn facet_probability(&self) -> F {
        ratio(self.facets, self.base + self.back + self.across)
    }

    /// A direction by any way but facets, in the lanes `which`, whose numbers `w` have not chosen them.
    #[inline(always)]
    pub fn sample(
        &self,
        known: <F::Lanes as Lanes>::V,
        grazing: Grazing<F>,
        [u, v, w]: [F; 3],
        which: <F::Lanes as Lanes>::M,
    ) -> <F::Lanes as Lanes>::V {
        let zero = u.lanes().splat(0.0);
        let z = w * (self.facets + self.base + self.back + self.across) - self.facets;
        let smooth = self.back + self.across;
        let by_cosine = smooth.eq(zero) | z.lt(self.base) & zero.lt(self.base);
        let cosine = cosine_on_side(known, [u, v]);
        let several = which & !by_cosine;
        if !several.any() {
            return cosine;
        }
        let returns = self.across.eq(zero) | z.lt(self.base + self.back) & zero.lt(self.back);
        by_cosine.select(cosine, grazing.sample(returns.select(known, -known), [u, v], several))
    }

    /// The density of [`Self::sample`] for the cosine `cos` on the same side as the known direction or the other, 1/sr,
    /// with the probability of the way.
    #[inline(always)]
    fn pdf(&self, same_side: <F::Lanes as Lanes>::M, cos: F, grazing: Grazing<F>) -> F {
        let zero = cos.lanes().splat(0.0);
        let total = self.facets + self.base + self.back + self.across;
        let cosine = same_side.select(self.base * warp::cosine_hemisphere_pdf(cos.abs()).0, zero);
        let several = same_side.select(self.back, self.across);
        total.eq(zero).select(zero, (cosine + several * grazing.pdf(cos)) / total)
    }
}

/// A lobe of the value `f` that is sampled by [`Ways`] other than facets, from either end, whose cosines are given.
#[inline(always)]
pub(super) fn smooth_lobe<V: Vector>(
    f: Rgb<V>,
    grazing: Grazing<V::F>,
    (cos_camera, from_camera): (V::F, &Ways<V::F>),
    (cos_light, from_light): (V::F, &Ways<V::F>),
) -> Scatter<V::Lanes> {
    let same_side = cos_camera.lanes().splat(0.0).lt(cos_camera * cos_light);
    Scatter {
        f,
        to_light: PdfSolidAngle(from_camera.pdf(same_side, cos_light, grazing)),
        to_camera: PdfSolidAngle(from_light.pdf(same_side, cos_camera, grazing)),
    }
}

/// Directions with density μ/(π L (μ² + α²)), L = ln(1 + 1/α²): about as light leaves after several facets, of which
/// there is μ (1 − E₁(μ)) ∝ α²/μ above μ ≈ α. For small α it is at the horizon, where the cosine would hardly ever
/// look.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grazing<F = f32> {
    square: F,
    logarithm: F,
}

impl<F: Float> Grazing<F> {
    /// For an interface of this α; a smooth one has no such light, and its density is 0.
    #[inline(always)]
    pub fn new(alpha: F) -> Self {
        let (one, infinity) = (alpha.lanes().splat(1.0), alpha.lanes().splat(f32::INFINITY));
        let is_smooth = alpha.lt(alpha.lanes().splat(SMOOTH_ALPHA));
        let square = is_smooth.select(one, alpha * alpha);
        Self { square, logarithm: is_smooth.select(infinity, functions::ln_1p(one / square)) }
    }

    #[inline(always)]
    pub fn pdf(self, cos: F) -> F {
        cos.abs() * FRAC_1_PI / (self.logarithm * (cos * cos + self.square))
    }

    /// A direction on the side of `side` in the lanes `which`: (μ²/α² + 1) = (1 + 1/α²)^u.
    #[inline(always)]
    pub fn sample(
        self,
        side: <F::Lanes as Lanes>::V,
        [u, v]: [F; 2],
        which: <F::Lanes as Lanes>::M,
    ) -> <F::Lanes as Lanes>::V {
        let one = u.lanes().splat(1.0);
        let square = (self.square * functions::exp_m1(u * self.logarithm, which)).min(one);
        let [sin, cos] = functions::sin_cos(v * TAU, which);
        let r = (one - square).sqrt();
        let [_, _, z] = side.coordinates();
        Vector::new(r * cos, r * sin, square.sqrt().copysign(z))
    }
}

/// a/(a + b) for weights that are not negative; 0 if both are.
#[inline(always)]
pub(super) fn ratio<F: Float>(a: F, b: F) -> F {
    let zero = a.lanes().splat(0.0);
    zero.lt(a).select(a / (a + b), zero)
}
