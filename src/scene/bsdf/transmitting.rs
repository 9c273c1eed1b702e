//! What surfaces that transmit have in common, with a volume behind them or none.

use glam::Vec3;

use super::{
    Scatter,
    albedo::Split,
    fresnel,
    layer::{Coat, Grazing, MEAN_SCHLICK_WEIGHT, Ways, product_lobe, ratio, smooth_lobe},
};
use crate::math::Rgb;

/// glTF's fresnel_mix of an interface over mix(diffuse, btdf, t), which is the mixture of two surfaces: t of a clear
/// boundary, with exact Fresnel reflectance, and 1 − t of plastic, a [`Coat`] over a Lambertian base. Each keeps all
/// light that is not tinted away.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transmitting {
    /// The tint of what the base reflects and transmits.
    pub color: Rgb,
    /// The fraction t.
    pub transmission: f32,
    /// The interface of the plastic.
    pub coat: Coat,
    /// GGX's α; 0 for everything that is smooth.
    pub alpha: f32,
}

/// What is known of the plastic before any direction is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plastic {
    average: Split,
    multiple: f32,
}

/// What a clear boundary does with light that arrives on one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clear {
    /// Reflectance of the smooth boundary towards the direction.
    pub fresnel: f32,
    /// The part that meets a second facet.
    pub missing: f32,
    /// The fraction of it that comes out on the other side, the same from all directions of a side.
    pub crosses: f32,
}

/// One end of a path: a direction, and about how much light each way of sampling finds from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub direction: Vec3,
    pub clear: Clear,
    pub ways: Ways,
    split: Split,
}

impl Transmitting {
    /// The transmittance of the base, without the interface.
    #[inline]
    pub fn transmittance(self) -> Rgb {
        self.color * self.transmission
    }

    /// The fraction of plastic.
    #[inline]
    fn plastic_fraction(self) -> f32 {
        1.0 - self.transmission
    }

    /// The albedo of the diffuse base, without the interface.
    #[inline]
    pub fn albedo(self) -> Rgb {
        self.color * self.plastic_fraction()
    }

    /// Reflectance of a (micro)surface whose clear part reflects `fresnel` at the cosine `cos`.
    #[inline]
    pub fn reflectance(self, fresnel: f32, cos: f32) -> f32 {
        if self.transmission == 1.0 {
            return fresnel;
        }
        let Coat { f0, f90 } = self.coat;
        self.transmission * fresnel + self.plastic_fraction() * (f0 + (f90 - f0) * fresnel::schlick_power(cos))
    }

    /// The probability of reflection rather than transmission at such a (micro)surface, the same from both ends of a
    /// reflection.
    #[inline]
    pub fn reflection_probability(self, fresnel: f32, cos: f32) -> f32 {
        ratio(self.reflectance(fresnel, cos), (1.0 - fresnel) * self.transmittance().max_element())
    }

    /// The probability of transmission: what [`Self::reflection_probability`] leaves, and 0 if nothing passes.
    #[inline]
    pub fn transmission_probability(self, fresnel: f32, cos: f32) -> f32 {
        ratio((1.0 - fresnel) * self.transmittance().max_element(), self.reflectance(fresnel, cos))
    }

    /// The plastic's averages, if there is any plastic.
    #[inline]
    pub fn plastic(self) -> Option<Plastic> {
        (self.transmission < 1.0).then(|| {
            let average = Split::average(self.alpha);
            Plastic { average, multiple: self.coat.multiple(average) }
        })
    }

    /// The end in `direction`, where the clear boundary does what `clear` says. The plastic's albedos are looked up
    /// only if there is any.
    #[inline]
    pub fn end(self, direction: Vec3, clear: Clear, plastic: Option<Plastic>) -> End {
        let passed = self.transmittance().max_element();
        let through = (1.0 - clear.fresnel) * passed;
        let mut end = End {
            direction,
            clear,
            ways: Ways {
                facets: (self.transmission * clear.fresnel + through) * (1.0 - clear.missing),
                base: 0.0,
                back: self.transmission * clear.missing * (1.0 - clear.crosses),
                across: passed * clear.missing * clear.crosses,
            },
            split: Split { normal: 0.0, grazing: 0.0, missing: 0.0 },
        };
        if let Some(Plastic { multiple, .. }) = plastic {
            let split = Split::towards(direction.z.abs(), self.alpha);
            // A rough lobe sees facets at all angles, and must not be left to cosines where the macroscopic surface
            // reflects nothing.
            let grazing = split.grazing.max(self.alpha * MEAN_SCHLICK_WEIGHT);
            end.split = split;
            end.ways.facets += self.plastic_fraction() * self.coat.single(Split { grazing, ..split });
            end.ways.base = self.albedo().max_element() * self.coat.passed(split, multiple);
            end.ways.back += self.plastic_fraction() * (multiple * split.missing);
        }
        end
    }

    /// The diffuse base, with the densities of all that is sampled without facets, and what comes out after several
    /// facets on the same side, 1/sr.
    #[inline]
    pub fn smooth_lobes(self, camera: &End, light: &End, plastic: Option<Plastic>) -> (Scatter, f32) {
        let same_side = camera.direction.z * light.direction.z > 0.0;
        let (mut base, mut multiple) = (0.0, 0.0);
        if same_side && let Some(plastic) = plastic {
            let passed = |split| self.coat.passed(split, plastic.multiple);
            base = product_lobe(passed(camera.split), passed(light.split), passed(plastic.average));
            multiple = self.plastic_fraction()
                * plastic.multiple
                * product_lobe(camera.split.missing, light.split.missing, plastic.average.missing);
        }
        let [from_camera, from_light] = [camera, light].map(|end| (end.direction.z, &end.ways));
        (smooth_lobe(self.albedo() * base, Grazing::new(self.alpha), from_camera, from_light), multiple)
    }
}
