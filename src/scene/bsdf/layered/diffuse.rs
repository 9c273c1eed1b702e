//! What is diffuse in the base: Lambert's law, and light that passes to the other side
//! (`KHR_materials_diffuse_transmission`).

use glam::Vec3;

use super::{End, Part, Stack};
use crate::{
    math::Rgb,
    sampling::warp,
    scene::bsdf::{ScatterEvent, layer::product_lobe},
};

/// Back to the side from which it comes.
pub(super) struct Reflection;

/// To the other side.
pub(super) struct Passage;

fn albedo(s: &Stack) -> Rgb {
    s.surface.base_color * ((1.0 - s.surface.metallic) * (1.0 - s.surface.transmission))
}

fn transmittance(s: &Stack) -> Rgb {
    s.surface.transmission_color * ((1.0 - s.surface.metallic) * s.surface.transmission)
}

/// A white Lambertian base under all that lies above it, 1/sr.
fn white(s: &Stack, a: &End, b: &End) -> f32 {
    product_lobe(a.passed * a.through, b.passed * b.through, s.averages.passed)
}

fn cosine(u: [f32; 2]) -> Vec3 {
    warp::cosine_hemisphere(u)
}

impl Part for Reflection {
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb {
        albedo(s) * white(s, a, b)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        albedo(s).max_element() * from.passed * from.through
    }

    fn sample(&self, _: &Stack, _: &End, u: [f32; 2]) -> Vec3 {
        cosine(u)
    }

    fn density(&self, _: &Stack, _: &End, to: &End) -> f32 {
        warp::cosine_hemisphere_pdf(to.up.z).0
    }

    const EVENT: ScatterEvent = ScatterEvent::Diffuse;
}

impl Part for Passage {
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb {
        transmittance(s) * white(s, a, b)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        transmittance(s).max_element() * from.passed * from.through
    }

    fn sample(&self, _: &Stack, _: &End, u: [f32; 2]) -> Vec3 {
        cosine(u)
    }

    fn density(&self, _: &Stack, _: &End, to: &End) -> f32 {
        warp::cosine_hemisphere_pdf(to.up.z).0
    }

    const PASSES: bool = true;
    const EVENT: ScatterEvent = ScatterEvent::Diffuse;
}
