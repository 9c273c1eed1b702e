//! A clear coat (`KHR_materials_clearcoat`): a GGX interface of index 1.5 over all else, with a normal of its own.

use glam::Vec3;

use super::{COAT, End, Part, Stack, base::mirror};
use crate::{
    math::Rgb,
    scene::bsdf::{albedo::Split, fresnel, layer::product_lobe},
};

/// What the coat's facets reflect at once.
pub(super) struct Coating;

/// What leaves the coat after several facets.
pub(super) struct BetweenFacets;

/// The coat's albedo towards a direction of this cosine: E, linear in how much of it there is.
pub(super) fn albedo(s: &Stack, cos: f32) -> f32 {
    if s.surface.coat == 0.0 {
        return 0.0;
    }
    let split = Split::towards(cos, s.surface.coat_alpha);
    s.surface.coat * (COAT.single(split) + s.coat_multiple * split.missing)
}

/// |ω·N_coat|/|ω·N_s| of the second direction: see [`super`].
fn bent(s: &Stack, light: &End) -> f32 {
    if s.coat_frame.is_some() { light.over_coat.z.max(0.0) / light.up.z } else { 1.0 }
}

impl Part for Coating {
    fn value(&self, s: &Stack, camera: &End, light: &End) -> Rgb {
        if s.surface.coat == 0.0 {
            return Rgb::ZERO;
        }
        let facet = s.coat_facets.reflect(camera.over_coat, light.over_coat);
        let power = fresnel::schlick_power(facet.cos);
        Rgb::splat(s.surface.coat * (COAT.f0 + (COAT.f90 - COAT.f0) * power) * facet.value * bent(s, light))
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        if from.over_coat.z > 0.0 { s.surface.coat * COAT.single(from.coat_split) } else { 0.0 }
    }

    fn sample(&self, s: &Stack, from: &End, u: [f32; 2]) -> Vec3 {
        let h = s.coat_facets.sample_visible(from.over_coat, u);
        let w = mirror(from.over_coat, h);
        // What goes below the coat would meet another of its facets.
        if w.z <= 0.0 {
            return -Vec3::Z;
        }
        s.coat_frame.as_ref().map_or(w, |frame| frame.to_world(w).normalize())
    }

    fn density(&self, s: &Stack, from: &End, to: &End) -> f32 {
        s.coat_facets.reflect(from.over_coat, to.over_coat).forward
    }
}

impl Part for BetweenFacets {
    fn value(&self, s: &Stack, camera: &End, light: &End) -> Rgb {
        if s.surface.coat == 0.0 || camera.over_coat.z <= 0.0 || light.over_coat.z <= 0.0 {
            return Rgb::ZERO;
        }
        let lobe = product_lobe(camera.coat_split.missing, light.coat_split.missing, s.coat_average.missing);
        Rgb::splat(s.surface.coat * s.coat_multiple * lobe * bent(s, light))
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        s.surface.coat * s.coat_multiple * from.coat_split.missing
    }

    fn sample(&self, s: &Stack, _: &End, u: [f32; 2]) -> Vec3 {
        s.coat_grazing.sample(Vec3::Z, u, true)
    }

    fn density(&self, s: &Stack, _: &End, to: &End) -> f32 {
        s.coat_grazing.pdf(to.up.z)
    }
}
