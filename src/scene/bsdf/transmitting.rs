//! What surfaces that transmit have in common, with a volume behind them or none.

use glam::Vec3;

use super::{
    Scatter,
    albedo::Split,
    fresnel,
    layer::{Coat, Grazing, MEAN_SCHLICK_WEIGHT, Ways, product_lobe, ratio, smooth_lobe},
};
use crate::{
    lanes::{Float, Lanes, Mask, Select, Vector},
    math::Rgb,
};

/// glTF's fresnel_mix of an interface over mix(diffuse, btdf, t), which is the mixture of two surfaces: t of a clear
/// boundary, with exact Fresnel reflectance, and 1 − t of plastic, a [`Coat`] over a Lambertian base. Each keeps all
/// light that is not tinted away.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transmitting<V: Vector = Vec3> {
    /// The tint of what the base reflects and transmits.
    pub color: Rgb<V>,
    /// The fraction t.
    pub transmission: V::F,
    /// The interface of the plastic.
    pub coat: Coat<V::F>,
    /// GGX's α; 0 for everything that is smooth.
    pub alpha: V::F,
}

/// What is known of the plastic before any direction is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plastic<F = f32> {
    average: Split<F>,
    multiple: F,
}

/// What a clear boundary does with light that arrives on one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clear<F = f32> {
    /// Reflectance of the smooth boundary towards the direction.
    pub fresnel: F,
    /// The part that meets a second facet.
    pub missing: F,
    /// The fraction of it that comes out on the other side, the same from all directions of a side.
    pub crosses: F,
}

/// One end of a path: a direction, and about how much light each way of sampling finds from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct End<V: Vector = Vec3> {
    pub direction: V,
    pub clear: Clear<V::F>,
    pub ways: Ways<V::F>,
    split: Split<V::F>,
}

impl<V: Vector> End<V> {
    /// The cosine of the direction: negative below the surface.
    #[inline(always)]
    pub fn cos(&self) -> V::F {
        let [_, _, z] = self.direction.coordinates();
        z
    }
}

impl<V: Vector> Transmitting<V> {
    /// The transmittance of the base, without the interface.
    #[inline(always)]
    pub fn transmittance(self) -> Rgb<V> {
        self.color.times(self.transmission)
    }

    /// The fraction of plastic.
    #[inline(always)]
    fn plastic_fraction(self) -> V::F {
        self.transmission.lanes().splat(1.0) - self.transmission
    }

    /// The albedo of the diffuse base, without the interface.
    #[inline(always)]
    pub fn albedo(self) -> Rgb<V> {
        self.color.times(self.plastic_fraction())
    }

    /// Reflectance of a (micro)surface whose clear part reflects `fresnel` at the cosine `cos`.
    #[inline(always)]
    pub fn reflectance(self, fresnel: V::F, cos: V::F) -> V::F {
        let Coat { f0, f90 } = self.coat;
        self.transmission * fresnel + self.plastic_fraction() * (f0 + (f90 - f0) * fresnel::schlick_power(cos))
    }

    /// What a (micro)surface lets pass whose clear part reflects `fresnel`, in the brightest channel.
    #[inline(always)]
    fn passed(self, fresnel: V::F) -> V::F {
        (fresnel.lanes().splat(1.0) - fresnel) * self.transmittance().max_element()
    }

    /// The probability of reflection rather than transmission at such a (micro)surface, the same from both ends of a
    /// reflection.
    #[inline(always)]
    pub fn reflection_probability(self, fresnel: V::F, cos: V::F) -> V::F {
        ratio(self.reflectance(fresnel, cos), self.passed(fresnel))
    }

    /// The probability of transmission: what [`Self::reflection_probability`] leaves, and 0 if nothing passes.
    #[inline(always)]
    pub fn transmission_probability(self, fresnel: V::F, cos: V::F) -> V::F {
        ratio(self.passed(fresnel), self.reflectance(fresnel, cos))
    }

    /// The plastic's averages, if there is any plastic.
    #[inline(always)]
    pub fn plastic(self) -> Option<Plastic<V::F>> {
        if !self.transmission.lt(self.transmission.lanes().splat(1.0)).any() {
            return None;
        }
        let average = Split::average(self.alpha);
        Some(Plastic { average, multiple: self.coat.multiple(average) })
    }

    /// The end in `direction`, where the clear boundary does what `clear` says. The plastic's albedos are looked up
    /// only if there is any.
    #[inline(always)]
    pub fn end(self, direction: V, clear: Clear<V::F>, plastic: Option<Plastic<V::F>>) -> End<V> {
        let passed = self.transmittance().max_element();
        let (zero, one) = (passed.lanes().splat(0.0), passed.lanes().splat(1.0));
        let through = (one - clear.fresnel) * passed;
        let mut end = End {
            direction,
            clear,
            ways: Ways {
                facets: (self.transmission * clear.fresnel + through) * (one - clear.missing),
                base: zero,
                back: self.transmission * clear.missing * (one - clear.crosses),
                across: passed * clear.missing * clear.crosses,
            },
            split: Split { normal: zero, grazing: zero, missing: zero },
        };
        if let Some(Plastic { multiple, .. }) = plastic {
            let (split, fraction) = (Split::towards(end.cos().abs(), self.alpha), self.plastic_fraction());
            // A rough lobe sees facets at all angles, and must not be left to cosines where the macroscopic surface
            // reflects nothing.
            let grazing = split.grazing.max(self.alpha * MEAN_SCHLICK_WEIGHT);
            end.split = split;
            end.ways.facets = end.ways.facets + fraction * self.coat.single(Split { grazing, ..split });
            end.ways.base = self.albedo().max_element() * self.coat.passed(split, multiple);
            end.ways.back = end.ways.back + fraction * (multiple * split.missing);
        }
        end
    }

    /// The diffuse base, with the densities of all that is sampled without facets, and what comes out after several
    /// facets on the same side, 1/sr.
    #[inline(always)]
    pub fn smooth_lobes(
        self,
        camera: &End<V>,
        light: &End<V>,
        plastic: Option<Plastic<V::F>>,
        grazing: Grazing<V::F>,
    ) -> (Scatter<V::Lanes>, V::F) {
        let zero = self.alpha.lanes().splat(0.0);
        let (mut base, mut several) = (zero, zero);
        if let Some(Plastic { average, multiple }) = plastic {
            let same_side = zero.lt(camera.cos() * light.cos());
            let [c, l, mean] = [camera.split, light.split, average];
            let [c_passed, l_passed] = [self.coat.passed(c, multiple), self.coat.passed(l, multiple)];
            base = same_side.select(product_lobe(c_passed, l_passed, self.coat.passed(mean, multiple)), zero);
            let lobe = product_lobe(c.missing, l.missing, mean.missing);
            several = same_side.select(self.plastic_fraction() * multiple * lobe, zero);
        }
        let (camera, light) = ((camera.cos(), &camera.ways), (light.cos(), &light.ways));
        (smooth_lobe(self.albedo().times(base), grazing, camera, light), several)
    }
}
