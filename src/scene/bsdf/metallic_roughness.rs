//! Opaque dielectrics and metals: glTF's metallic-roughness model.

use glam::Vec3;

use super::{
    Across, BsdfSample, Lobe, Mirror, Scatter, ScatterEvent, Transport,
    albedo::Split,
    fresnel, is_grazing,
    layer::{Coat, Grazing, MEAN_SCHLICK_WEIGHT, Ways, mean_reflectance, multiple, product_lobe, smooth_lobe},
    microfacet::{Ggx, SMOOTH_ALPHA},
    mirrored,
};
use crate::{
    lanes::{Float, Lanes, Mask, Select, Vector},
    math::Rgb,
};

/// A GGX reflection over a Lambertian base, (1 − m)·dielectric + m·metal, the same from both sides.
///
/// Either interface is compensated for the light that meets a second facet, and the dielectric's base gets what its
/// interface does not reflect: a white surface reflects everything, at every roughness and angle (DESIGN.md, *Nothing
/// is lost between facets*).
///
/// With `metallic` = 0 and `dielectric_f0` = `dielectric_f90` = 0 it is Lambert's law. Source: glTF 2.0, appendix B.
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness<V: Vector = Vec3> {
    /// Albedo of the dielectric's base, and reflectance of the metal at normal incidence.
    pub base_color: Rgb<V>,
    /// The fraction m of metal, in [0, 1].
    pub metallic: V::F,
    /// GGX's α, the square of glTF's roughness; a perfect mirror below 1e-3.
    pub alpha: V::F,
    /// Reflectance of the dielectric's interface at normal incidence.
    pub dielectric_f0: Rgb<V>,
    /// Reflectance of the dielectric's interface at grazing incidence.
    pub dielectric_f90: V::F,
}

impl<V: Vector> MetallicRoughness<V> {
    /// The fraction that is no metal.
    #[inline(always)]
    fn dielectric(&self) -> V::F {
        self.metallic.lanes().splat(1.0) - self.metallic
    }

    /// Reflectance of both interfaces together, by Schlick's power.
    #[inline(always)]
    fn reflectance(&self, power: V::F) -> Rgb<V> {
        let white = Rgb::grey(power.lanes().splat(1.0));
        let dielectric = fresnel::schlick(self.dielectric_f0, Rgb::grey(self.dielectric_f90), power);
        let metal = fresnel::schlick(self.base_color, white, power);
        dielectric.times(self.dielectric()) + metal.times(self.metallic)
    }

    /// Albedo of the base, without the interface.
    #[inline(always)]
    fn albedo(&self) -> Rgb<V> {
        self.base_color.times(self.dielectric())
    }

    /// The dielectric's interface as the base sees it: by its brightest channel, so that no channel gains, and a tinted
    /// reflection does not leave its complement to the base (`KHR_materials_specular`).
    #[inline(always)]
    fn coat(&self) -> Coat<V::F> {
        Coat { f0: self.dielectric_f0.max_element(), f90: self.dielectric_f90 }
    }

    /// What both interfaces together reflect of the light that meets a second facet.
    #[inline(always)]
    fn multiple(&self, average: Split<V::F>) -> Rgb<V> {
        let one = average.missing.lanes().splat(1.0);
        let e1 = one - average.missing;
        let dielectric = multiple_of(self.dielectric_f0, self.dielectric_f90, e1);
        let metal = multiple_of(self.base_color, one, e1);
        dielectric.times(self.dielectric()) + metal.times(self.metallic)
    }

    /// What both interfaces and the base do towards all directions alike.
    #[inline(always)]
    fn hemisphere(&self) -> Hemisphere<V> {
        let (average, smooth) = (Split::average(self.alpha), self.is_smooth());
        let zero = self.alpha.lanes().splat(0.0);
        Hemisphere {
            average,
            // No light meets a second facet of what is smooth.
            multiple: Rgb::select(smooth, Rgb::grey(zero), self.multiple(average)),
            coat_multiple: smooth.select(zero, self.coat().multiple(average)),
            grazing: Grazing::new(self.alpha),
        }
    }

    /// What happens towards `w`.
    #[inline(always)]
    fn end(&self, w: V, hemisphere: &Hemisphere<V>) -> End<V::F> {
        let ([_, _, z], specular) = (w.coordinates(), self.is_specular());
        let (zero, one) = (z.lanes().splat(0.0), z.lanes().splat(1.0));
        let split = Split::towards(z.abs(), self.alpha);
        let passed = specular.select(self.coat().passed(split, hemisphere.coat_multiple), one);
        // A rough lobe sees facets at all angles, and must not be left to cosines where the macroscopic surface
        // reflects nothing (f0 = 0, normal incidence).
        let seen = split.grazing.max(self.alpha * MEAN_SCHLICK_WEIGHT);
        let grazing = self.is_smooth().select(split.grazing, seen);
        let facets = self.reflectance(zero).times(split.normal) + self.reflectance(one).times(grazing);
        let ways = Ways {
            facets: facets.max_element(),
            base: self.albedo().max_element() * passed,
            back: specular.select(hemisphere.multiple.max_element() * split.missing, zero),
            across: zero,
        };
        End { missing: specular.select(split.missing, zero), passed, ways }
    }

    #[inline(always)]
    fn is_smooth(&self) -> <V::Lanes as Lanes>::M {
        self.alpha.lt(self.alpha.lanes().splat(SMOOTH_ALPHA))
    }

    /// Whether any interface reflects at any angle.
    #[inline(always)]
    fn is_specular(&self) -> <V::Lanes as Lanes>::M {
        let zero = self.alpha.lanes().splat(0.0);
        zero.lt(self.metallic) | zero.lt(self.dielectric_f90) | zero.lt(self.dielectric_f0.max_element())
    }

    /// The diffuse lobe, and the rough specular one with all that leaves after several facets, of two directions on one
    /// side, about each of which an end says more.
    #[inline(always)]
    fn lobes(
        &self,
        hemisphere: &Hemisphere<V>,
        (to_camera, camera): (V, &End<V::F>),
        (to_light, light): (V, &End<V::F>),
    ) -> [Scatter<V::Lanes>; 2] {
        let ([_, _, cos_camera], [_, _, cos_light]) = (to_camera.coordinates(), to_light.coordinates());
        let (lanes, smooth) = (cos_camera.lanes(), self.is_smooth());
        let passed = self.coat().passed(hemisphere.average, hemisphere.coat_multiple);
        let passed = self.is_specular().select(passed, lanes.splat(1.0));
        let diffuse = smooth_lobe(
            self.albedo().times(product_lobe(camera.passed, light.passed, passed)),
            hemisphere.grazing,
            (cos_camera, &camera.ways),
            (cos_light, &light.ways),
        );
        if !(!smooth).any() {
            return [diffuse, Scatter::nothing(lanes)];
        }
        let facet = Ggx::<V> { alpha: self.alpha }.reflect(to_camera, to_light);
        let reflectance = self.reflectance(fresnel::schlick_power(facet.cos_camera));
        let mut specular = facet.scatter(reflectance, camera.ways.facet_probability(), light.ways.facet_probability());
        let several = product_lobe(camera.missing, light.missing, hemisphere.average.missing);
        specular.f = specular.f + hemisphere.multiple.times(several);
        [diffuse, specular.only(!smooth)]
    }

    /// The continuous part between two directions.
    #[inline(always)]
    pub(crate) fn continuous(&self, to_camera: V, to_light: V) -> Scatter<V::Lanes> {
        let hemisphere = self.hemisphere();
        let ends = [self.end(to_camera, &hemisphere), self.end(to_light, &hemisphere)];
        self.between_ends(&hemisphere, (to_camera, &ends[0]), (to_light, &ends[1]))
    }

    #[inline(always)]
    fn between_ends(
        &self,
        hemisphere: &Hemisphere<V>,
        camera: (V, &End<V::F>),
        light: (V, &End<V::F>),
    ) -> Scatter<V::Lanes> {
        let [diffuse, specular] = self.lobes(hemisphere, camera, light);
        Scatter::sum(diffuse, specular).only(!leaves_side(camera.0, light.0))
    }

    /// The delta of a smooth interface, between two directions of which each is the other mirrored.
    #[inline(always)]
    fn mirroring(&self, to_camera: V, to_light: V, end: &End<V::F>) -> Scatter<V::Lanes> {
        let ([_, _, cos], [_, _, cos_light]) = (to_camera.coordinates(), to_light.coordinates());
        let reflectance = self.reflectance(fresnel::schlick_power(cos.abs()));
        // Mirrored directions have the same cosine.
        let p = end.ways.facet_probability();
        Scatter::delta(reflectance, cos_light, p, p, p.lanes().splat(1.0)).only(!leaves_side(to_camera, to_light))
    }

    /// A direction across from `known`: none for a grazing one.
    #[inline(always)]
    pub(crate) fn sample_in_lanes(&self, known: V, transport: Transport, [u, v, w]: [V::F; 3]) -> Across<V> {
        let ([_, _, z], smooth) = (known.coordinates(), self.is_smooth());
        let hemisphere = self.hemisphere();
        let from = self.end(known, &hemisphere);
        let by_facets = !from.ways.facet_probability().le(w);
        let (is_delta, rough) = (by_facets & smooth, by_facets & !smooth);
        let mut direction = mirrored(known);
        if rough.any() {
            let h = Ggx::<V> { alpha: self.alpha }.sample_visible(known, [u, v], rough);
            direction = rough.select(fresnel::reflect(known, h, known.dot(h)), direction);
        }
        if (!by_facets).any() {
            let other = from.ways.sample(known, hemisphere.grazing, [u, v, w], !by_facets);
            direction = by_facets.select(direction, other);
        }
        let across = self.end(direction, &hemisphere);
        let (to_camera, to_light) = transport.sides(known, direction);
        let (camera, light) = transport.sides(&from, &across);
        let mut scatter = self.between_ends(&hemisphere, (to_camera, camera), (to_light, light));
        if is_delta.any() {
            scatter = Scatter::select(is_delta, self.mirroring(to_camera, to_light, &from), scatter);
        }
        Across { direction, is_delta, is_second: w.lanes().mask(0), scatter: scatter.only(!is_grazing(z)) }
    }

    /// See [`super::Bsdf::has_continuous`].
    #[inline(always)]
    pub fn has_continuous(&self) -> <V::Lanes as Lanes>::M {
        !self.albedo().is_black() | !self.is_smooth() & self.is_specular()
    }
}

/// What an interface reflects of the light that meets a second facet, channel by channel.
#[inline(always)]
fn multiple_of<V: Vector>(f0: Rgb<V>, f90: V::F, e1: V::F) -> Rgb<V> {
    let [r, g, b] = f0.channels().coordinates();
    let (r, g, b) = (mean_reflectance(r, f90), mean_reflectance(g, f90), mean_reflectance(b, f90));
    Rgb::of(V::new(multiple(r, e1), multiple(g, e1), multiple(b, e1)))
}

/// Where two directions are not on the same side.
#[inline(always)]
fn leaves_side<V: Vector>(to_camera: V, to_light: V) -> <V::Lanes as Lanes>::M {
    let ([_, _, camera], [_, _, light]) = (to_camera.coordinates(), to_light.coordinates());
    (camera * light).le(camera.lanes().splat(0.0))
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

    /// The mirror, if there is nothing else.
    #[inline]
    pub(super) fn mirror(&self) -> Option<Mirror> {
        (self.is_smooth() && self.metallic == 1.0).then_some(Mirror { color: self.base_color })
    }

    /// See [`super::Bsdf::eval`].
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        if leaves_side(to_camera, to_light) {
            return Scatter::ZERO;
        }
        match lobe {
            Lobe::Continuous => self.continuous(to_camera, to_light),
            Lobe::Delta(0) if self.is_smooth() => {
                if let Some(mirror) = self.mirror() {
                    return mirror.between(to_camera.z, to_light.z);
                }
                self.mirroring(to_camera, to_light, &self.end(to_camera, &self.hemisphere()))
            }
            Lobe::Delta(_) => Scatter::ZERO,
        }
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if let Some(mirror) = self.mirror() {
            let (direction, scatter) = mirror.sample(known, transport);
            return BsdfSample::checked(direction, Lobe::Delta(0), scatter, transport);
        }
        let Across { direction, is_delta, scatter, .. } = self.sample_in_lanes(known, transport, u.into());
        let lobe = if is_delta { Lobe::Delta(0) } else { Lobe::Continuous };
        BsdfSample::checked(direction, lobe, scatter, transport)
    }

    /// See [`super::Bsdf::delta_count`].
    #[inline]
    pub fn delta_count(&self) -> u8 {
        u8::from(self.is_smooth() && self.is_specular())
    }

    /// See [`super::Bsdf::continuous_probability`].
    #[inline]
    pub fn continuous_probability(&self, known: Vec3) -> f32 {
        if !self.is_smooth() {
            return 1.0;
        }
        if self.mirror().is_some() {
            return 0.0;
        }
        1.0 - self.end(known, &self.hemisphere()).ways.facet_probability()
    }

    /// See [`super::Bsdf::event`].
    #[inline]
    pub fn continuous_event(&self, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        if leaves_side(to_camera, to_light) {
            return ScatterEvent::Glossy;
        }
        let hemisphere = self.hemisphere();
        let ends = [self.end(to_camera, &hemisphere), self.end(to_light, &hemisphere)];
        let [diffuse, specular] = self.lobes(&hemisphere, (to_camera, &ends[0]), (to_light, &ends[1]));
        ScatterEvent::dominant(&diffuse, &specular)
    }
}

/// What is the same towards all directions.
struct Hemisphere<V: Vector> {
    /// The mean split of the interfaces' light.
    average: Split<V::F>,
    /// What both interfaces together reflect of the light that meets a second facet.
    multiple: Rgb<V>,
    /// What the dielectric's reflects of it, for the base.
    coat_multiple: V::F,
    grazing: Grazing<V::F>,
}

/// What is known of one direction.
struct End<F> {
    /// 1 − E₁ of the interfaces.
    missing: F,
    /// 1 − E of the dielectric's interface: what the base gets.
    passed: F,
    ways: Ways<F>,
}
