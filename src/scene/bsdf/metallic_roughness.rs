//! Opaque dielectrics and metals: glTF's metallic-roughness model.

use glam::Vec3;

use super::{
    BsdfSample, GRAZING, Lobe, Mirror, Scatter, ScatterEvent, Transport,
    albedo::Split,
    fresnel,
    layer::{Coat, Grazing, MEAN_SCHLICK_WEIGHT, Ways, mean_reflectance, multiple, product_lobe, smooth_lobe},
    microfacet::{Ggx, SMOOTH_ALPHA},
    mirrored,
};
use crate::math::Rgb;

/// A GGX reflection over a Lambertian base, (1 − m)·dielectric + m·metal, the same from both sides.
///
/// Either interface is compensated for the light that meets a second facet, and the dielectric's base gets what its
/// interface does not reflect: a white surface reflects everything, at every roughness and angle (DESIGN.md, *Nothing
/// is lost between facets*).
///
/// With `metallic` = 0 and `dielectric_f0` = `dielectric_f90` = 0 it is Lambert's law. Source: glTF 2.0, appendix B.
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness {
    /// Albedo of the dielectric's base, and reflectance of the metal at normal incidence.
    pub base_color: Rgb,
    /// The fraction m of metal, in [0, 1].
    pub metallic: f32,
    /// GGX's α, the square of glTF's roughness; a perfect mirror below 1e-3.
    pub alpha: f32,
    /// Reflectance of the dielectric's interface at normal incidence.
    pub dielectric_f0: Rgb,
    /// Reflectance of the dielectric's interface at grazing incidence.
    pub dielectric_f90: f32,
}

impl MetallicRoughness {
    /// With the interface that glTF gives where no extension says otherwise: index 1.5, which reflects 4 %.
    pub fn new(base_color: Rgb, metallic: f32, alpha: f32) -> Self {
        Self { base_color, metallic, alpha, dielectric_f0: Rgb::splat(0.04), dielectric_f90: 1.0 }
    }

    /// A pure metal of the given reflectance at normal incidence.
    pub fn metal(base_color: Rgb, alpha: f32) -> Self {
        Self::new(base_color, 1.0, alpha)
    }

    /// Reflectance of both interfaces together, by Schlick's power.
    #[inline]
    fn reflectance(&self, power: f32) -> Rgb {
        let dielectric = fresnel::schlick(self.dielectric_f0, Rgb::splat(self.dielectric_f90), power);
        let metal = fresnel::schlick(self.base_color, Rgb::ONE, power);
        dielectric * (1.0 - self.metallic) + metal * self.metallic
    }

    /// Albedo of the base, without the interface.
    #[inline]
    fn albedo(&self) -> Rgb {
        self.base_color * (1.0 - self.metallic)
    }

    /// The dielectric's interface as the base sees it: by its brightest channel, so that no channel gains, and a tinted
    /// reflection does not leave its complement to the base (`KHR_materials_specular`).
    #[inline]
    fn coat(&self) -> Coat {
        Coat { f0: self.dielectric_f0.max_element(), f90: self.dielectric_f90 }
    }

    /// What both interfaces together reflect of the light that meets a second facet.
    #[inline]
    fn multiple(&self, average: Split) -> Rgb {
        let e1 = 1.0 - average.missing;
        let dielectric = self.dielectric_f0.map(|f0| multiple(mean_reflectance(f0, self.dielectric_f90), e1));
        let metal = self.base_color.map(|f0| multiple(mean_reflectance(f0, 1.0), e1));
        dielectric * (1.0 - self.metallic) + metal * self.metallic
    }

    /// What both interfaces and the base do towards all directions alike.
    #[inline]
    fn hemisphere(&self) -> Hemisphere {
        let average = Split::average(self.alpha);
        if self.is_smooth() {
            // No light meets a second facet.
            return Hemisphere { average, multiple: Rgb::ZERO, coat_multiple: 0.0 };
        }
        Hemisphere { average, multiple: self.multiple(average), coat_multiple: self.coat().multiple(average) }
    }

    /// What happens towards `w`.
    #[inline]
    fn end(&self, w: Vec3, hemisphere: &Hemisphere) -> End {
        if !self.is_specular() {
            let ways = Ways { base: self.albedo().max_element(), ..Ways::default() };
            return End { missing: 0.0, passed: 1.0, ways };
        }
        let split = Split::towards(w.z.abs(), self.alpha);
        let passed = self.coat().passed(split, hemisphere.coat_multiple);
        // A rough lobe sees facets at all angles, and must not be left to cosines where the macroscopic surface
        // reflects nothing (f0 = 0, normal incidence).
        let grazing =
            if self.is_smooth() { split.grazing } else { split.grazing.max(self.alpha * MEAN_SCHLICK_WEIGHT) };
        let ways = Ways {
            facets: (self.reflectance(0.0) * split.normal + self.reflectance(1.0) * grazing).max_element(),
            base: self.albedo().max_element() * passed,
            back: hemisphere.multiple.max_element() * split.missing,
            across: 0.0,
        };
        End { missing: split.missing, passed, ways }
    }

    /// The ways of sampling from `w`. A mirror has facets alone.
    #[inline]
    fn ways(&self, w: Vec3) -> Ways {
        if self.mirror().is_some() {
            return Ways { facets: 1.0, ..Ways::default() };
        }
        self.end(w, &self.hemisphere()).ways
    }

    /// The mirror, if there is nothing else.
    #[inline]
    pub(super) fn mirror(&self) -> Option<Mirror> {
        (self.is_smooth() && self.metallic == 1.0).then_some(Mirror { color: self.base_color })
    }

    #[inline]
    fn is_smooth(&self) -> bool {
        self.alpha < SMOOTH_ALPHA
    }

    /// Whether any interface reflects at any angle.
    #[inline]
    fn is_specular(&self) -> bool {
        self.metallic > 0.0 || self.dielectric_f90 > 0.0 || self.dielectric_f0.max_element() > 0.0
    }

    /// The diffuse lobe, and the rough specular one with all that leaves after several facets, of two directions on one
    /// side.
    #[inline]
    fn lobes(&self, to_camera: Vec3, to_light: Vec3) -> (Scatter, Scatter) {
        let hemisphere = self.hemisphere();
        let (camera, light) = (self.end(to_camera, &hemisphere), self.end(to_light, &hemisphere));
        let passed_average =
            if self.is_specular() { self.coat().passed(hemisphere.average, hemisphere.coat_multiple) } else { 1.0 };
        let diffuse = smooth_lobe(
            self.albedo() * product_lobe(camera.passed, light.passed, passed_average),
            Grazing::new(self.alpha),
            (to_camera, &camera.ways),
            (to_light, &light.ways),
        );
        if self.is_smooth() {
            return (diffuse, Scatter::ZERO);
        }
        let facet = Ggx { alpha: self.alpha }.reflect(to_camera, to_light);
        let reflectance = self.reflectance(fresnel::schlick_power(facet.cos_camera));
        let mut specular = facet.scatter(reflectance, camera.ways.facet_probability(), light.ways.facet_probability());
        specular.f += hemisphere.multiple * product_lobe(camera.missing, light.missing, hemisphere.average.missing);
        (diffuse, specular)
    }

    /// See [`super::Bsdf::eval`].
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        if to_camera.z * to_light.z <= 0.0 {
            return Scatter::ZERO;
        }
        match lobe {
            Lobe::Continuous => {
                let (diffuse, specular) = self.lobes(to_camera, to_light);
                Scatter::sum(diffuse, specular)
            }
            Lobe::Delta(0) if self.is_smooth() => {
                if let Some(mirror) = self.mirror() {
                    return mirror.between(to_camera.z, to_light.z);
                }
                let reflectance = self.reflectance(fresnel::schlick_power(to_camera.z.abs()));
                // Mirrored directions have the same cosine.
                let p = self.ways(to_camera).facet_probability();
                Scatter::delta(reflectance, to_light.z, p, p, 1.0)
            }
            Lobe::Delta(_) => Scatter::ZERO,
        }
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if known.z.abs() < GRAZING {
            return None;
        }
        if let Some(mirror) = self.mirror() {
            let (direction, scatter) = mirror.sample(known, transport);
            return BsdfSample::checked(direction, Lobe::Delta(0), scatter, transport);
        }
        let ways = self.ways(known);
        let (direction, lobe) = if u.z >= ways.facet_probability() {
            (ways.sample(known, self.alpha, u), Lobe::Continuous)
        } else if self.is_smooth() {
            (mirrored(known), Lobe::Delta(0))
        } else {
            let h = Ggx { alpha: self.alpha }.sample_visible(known, u.truncate());
            (fresnel::reflect(known, h, known.dot(h)), Lobe::Continuous)
        };
        let (to_camera, to_light) = transport.sides(known, direction);
        BsdfSample::checked(direction, lobe, self.eval(lobe, to_camera, to_light), transport)
    }

    /// See [`super::Bsdf::has_continuous`].
    #[inline]
    pub fn has_continuous(&self) -> bool {
        self.albedo() != Rgb::ZERO || (!self.is_smooth() && self.is_specular())
    }

    /// See [`super::Bsdf::delta_count`].
    #[inline]
    pub fn delta_count(&self) -> u8 {
        u8::from(self.is_smooth() && self.is_specular())
    }

    /// See [`super::Bsdf::continuous_probability`].
    #[inline]
    pub fn continuous_probability(&self, known: Vec3) -> f32 {
        if self.is_smooth() { 1.0 - self.ways(known).facet_probability() } else { 1.0 }
    }

    /// See [`super::Bsdf::event`].
    #[inline]
    pub fn continuous_event(&self, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        if to_camera.z * to_light.z <= 0.0 {
            return ScatterEvent::Glossy;
        }
        let (diffuse, specular) = self.lobes(to_camera, to_light);
        ScatterEvent::dominant(&diffuse, &specular)
    }
}

/// What is the same towards all directions.
struct Hemisphere {
    /// The mean split of the interfaces' light.
    average: Split,
    /// What both interfaces together reflect of the light that meets a second facet.
    multiple: Rgb,
    /// What the dielectric's reflects of it, for the base.
    coat_multiple: f32,
}

/// What is known of one direction.
struct End {
    /// 1 − E₁ of the interfaces.
    missing: f32,
    /// 1 − E of the dielectric's interface: what the base gets.
    passed: f32,
    ways: Ways,
}
