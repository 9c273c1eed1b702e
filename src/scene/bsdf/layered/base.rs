//! The base's interface: metal and dielectric as in [`MetallicRoughness`](super::super::MetallicRoughness), with a
//! grain (`KHR_materials_anisotropy`) and a thin film (`KHR_materials_iridescence`). What is clear of the dielectric
//! has a boundary of its own, [`clear`](super::clear).

use glam::Vec3;

use super::{End, Part, Stack, diffuse, film::Film};
use crate::{
    math::Rgb,
    scene::bsdf::{
        albedo::Split,
        fresnel,
        layer::{MEAN_SCHLICK_WEIGHT, mean_reflectance, product_lobe},
    },
};

/// What facets reflect at once.
pub(super) struct Reflection;

/// What leaves the base after several facets.
pub(super) struct BetweenFacets;

/// The cosine at which Schlick's reflectance is the mean over the facets that carry light.
pub(super) fn typical_cosine(split: Split) -> f32 {
    let once = split.normal + split.grazing;
    if once > 0.0 { 1.0 - (split.grazing / once).powf(0.2) } else { 0.0 }
}

/// Where the film's mean reflectance over all directions is taken: Schlick's mean weight there is 1/21.
const MEAN_COS: f32 = 0.456;

/// Reflectance of dielectric and metal at a facet met with this cosine.
fn both(s: &Stack, cos: f32) -> [Rgb; 2] {
    let (p, power) = (&s.surface, fresnel::schlick_power(cos));
    let dielectric = fresnel::schlick(p.f0, Rgb::splat(p.f90), power);
    let metal = match p.measured {
        Some(metal) => metal.reflectance(cos),
        None => fresnel::schlick(p.base_color, Rgb::ONE, power),
    };
    with_film(s, [dielectric, metal], cos)
}

fn with_film(s: &Stack, [dielectric, metal]: [Rgb; 2], cos: f32) -> [Rgb; 2] {
    let (p, Some(film)) = (&s.surface, &s.film) else { return [dielectric, metal] };
    [dielectric.lerp(under_film(s, film, cos), p.film), metal.lerp(film.reflectance(p.base_color, cos), p.film)]
}

/// Reflectance of the dielectric wholly under the film.
pub(super) fn under_film(s: &Stack, film: &Film, cos: f32) -> Rgb {
    // f0 holds the factor `specular`, which weighs the film's reflectance as a whole.
    let p = &s.surface;
    let plain = if p.f90 > 0.0 { p.f0 * (1.0 / p.f90) } else { Rgb::ZERO };
    film.reflectance(plain, cos) * p.f90
}

/// Mean reflectance of dielectric and metal over all directions.
pub(super) fn means(s: &Stack) -> [Rgb; 2] {
    let p = &s.surface;
    let dielectric = p.f0.map(|f0| mean_reflectance(f0, p.f90));
    let metal = match p.measured {
        Some(metal) => metal.mean(),
        None => p.base_color.map(|f0| mean_reflectance(f0, 1.0)),
    };
    with_film(s, [dielectric, metal], MEAN_COS)
}

/// Reflectance of a facet met with this cosine.
fn reflectance(s: &Stack, cos: f32) -> Rgb {
    let [dielectric, metal] = both(s, cos);
    dielectric * s.opaque + metal * s.surface.metallic
}

/// 1 − E of the dielectric's interface: what it leaves to what is diffuse.
pub(super) fn passed(s: &Stack, end: &End) -> f32 {
    if s.film.is_none() {
        return s.interface.passed(end.split, s.interface_multiple);
    }
    let [dielectric, _] = both(s, end.facet_cos);
    (1.0 - dielectric.max_element()) * (1.0 - end.split.missing) + (1.0 - s.interface_multiple) * end.split.missing
}

/// About the base's mean albedo: of what it reflects, of what is diffuse below, also of what passes it, and of what is
/// clear, which keeps all light that its colour does.
pub(super) fn albedo_of_all(s: &Stack) -> Rgb {
    let [dielectric, _] = means(s);
    let left = Rgb::splat(1.0 - dielectric.max_element());
    let of_clear =
        s.clear.as_ref().map_or(Rgb::ZERO, |boundary| (dielectric + left * s.surface.base_color) * boundary.fraction);
    (s.mean + diffuse::albedo_of_both(s) * left + of_clear).min(Rgb::ONE)
}

/// E of metal and dielectric, in the brightest channel.
pub(super) fn albedo(s: &Stack, end: &End) -> f32 {
    let once = reflectance(s, end.facet_cos).max_element() * (1.0 - end.split.missing);
    once + s.multiple.max_element() * end.split.missing
}

/// The fraction of what the base sends back to its layers that facets reflect for being met at a grazing angle.
pub(super) fn grazing_part(s: &Stack, split: &Split) -> f32 {
    let at = |cos: f32| {
        let [dielectric, _] = both(s, cos);
        // What comes from the denser side is reflected at many angles as a whole.
        let clear = s.clear.as_ref().map_or(Rgb::ZERO, |boundary| {
            let reflected = if boundary.is_denser_above() { Rgb::ONE } else { dielectric };
            boundary.meets_layers_again(s, reflected)
        });
        (reflectance(s, cos) + clear).max_element()
    };
    let normal = at(1.0) * split.normal + s.multiple.max_element() * split.missing;
    let grazing = at(0.0) * split.grazing;
    grazing / (normal + grazing).max(f32::MIN_POSITIVE)
}

/// `w` mirrored at the facet normal `h`.
pub(super) fn mirror(w: Vec3, h: Vec3) -> Vec3 {
    fresnel::reflect(w, h, w.dot(h))
}

impl Part for Reflection {
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb {
        let facet = s.facets.reflect(a.along_grain, b.along_grain);
        if facet.value == 0.0 {
            return Rgb::ZERO;
        }
        reflectance(s, facet.cos) * (facet.value * a.through.min(b.through)) * (a.tint * b.tint)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        // A rough lobe sees facets at all angles, also where the macroscopic surface reflects nothing.
        let seen = s.mean.max_element() * MEAN_SCHLICK_WEIGHT.max(s.facets.x * 0.1);
        from.through * reflectance(s, from.facet_cos).max_element().max(seen) * (1.0 - from.split.missing)
    }

    fn sample(&self, s: &Stack, from: &End, [u, v, _]: [f32; 3]) -> Vec3 {
        s.out_of_grain(mirror(from.along_grain, s.facets.sample_visible(from.along_grain, [u, v])))
    }

    fn density(&self, s: &Stack, from: &End, to: &End) -> f32 {
        s.facets.reflect(from.along_grain, to.along_grain).forward
    }
}

impl Part for BetweenFacets {
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb {
        let lobe = product_lobe(a.split.missing, b.split.missing, s.average.missing);
        s.multiple * (lobe * a.through.min(b.through)) * (a.tint * b.tint)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        from.through * s.multiple.max_element() * from.split.missing
    }

    fn sample(&self, s: &Stack, _: &End, [u, v, _]: [f32; 3]) -> Vec3 {
        s.grazing.sample(Vec3::Z, [u, v], true)
    }

    fn density(&self, s: &Stack, _: &End, to: &End) -> f32 {
        s.grazing.pdf(to.up.z)
    }
}
