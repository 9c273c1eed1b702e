//! What is diffuse in the base: Lambert's law or a [`rough`] one, and light that passes to the other side
//! (`KHR_materials_diffuse_transmission`).

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::{End, Joins, Part, Passage as Through, Stack, rough};
use crate::{
    math::Rgb,
    scene::bsdf::{ScatterEvent, layer::product_lobe},
};

/// Back to the side from which it comes.
pub(super) struct Reflection;

/// To the other side.
pub(super) struct Passage;

/// The fraction of what is diffuse that lets light through, and the tint of that light.
fn leaf(s: &Stack) -> (f32, Rgb) {
    match s.surface.passage {
        Through::Leaf { fraction, color } => (fraction, color),
        _ => (0.0, Rgb::ZERO),
    }
}

/// The albedo of the diffuse base by itself.
pub(super) fn albedo(s: &Stack) -> Rgb {
    s.surface.base_color * (s.opaque * (1.0 - leaf(s).0))
}

/// The same with what passes to the other side.
pub(super) fn albedo_of_both(s: &Stack) -> Rgb {
    albedo(s) + transmittance(s)
}

fn transmittance(s: &Stack) -> Rgb {
    let (fraction, color) = leaf(s);
    color * (s.opaque * fraction)
}

/// f/ρ of a diffuse base of the colour ρ under all that lies above it, 1/sr, light coming as if from `from` above it.
///
/// What differs from Lambert's law passes as a glossy lobe does: a white base then keeps its albedo where light grazes
/// it, which is where a rough one differs.
fn base(s: &Stack, color: Rgb, a: &End, b: &End, from: Vec3) -> Rgb {
    let mean = if a.covered { s.averages.passed } else { s.interface.passed(s.average, s.interface_multiple) };
    let [to_a, to_b] = [a, b].map(|end| end.passed * end.through);
    let lambert = Rgb::splat(product_lobe(to_a, to_b, mean));
    let r = s.surface.diffuse_roughness;
    if r == 0.0 {
        return lambert;
    }
    let differs = rough::shape(color, r, a.up, from) - Rgb::ONE;
    (lambert + differs * (to_a.min(to_b) * FRAC_1_PI)).max(Rgb::ZERO)
}

impl Part for Reflection {
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb {
        albedo(s) * base(s, s.surface.base_color, a, b, b.up) * (a.tint * b.tint)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        albedo(s).max_element() * from.passed * from.through
    }

    fn sample(&self, s: &Stack, from: &End, u: [f32; 3]) -> Vec3 {
        rough::sample(s.surface.diffuse_roughness, from.up.z, u)
    }

    fn density(&self, s: &Stack, from: &End, to: &End) -> f32 {
        rough::density(s.surface.diffuse_roughness, from.up.z, to.up.z)
    }

    const EVENT: ScatterEvent = ScatterEvent::Diffuse;
}

impl Part for Passage {
    fn value(&self, s: &Stack, a: &End, b: &End) -> Rgb {
        // Light passes as it would be reflected were it mirrored at the surface.
        let mirrored = Vec3::new(-b.up.x, -b.up.y, b.up.z);
        transmittance(s) * base(s, leaf(s).1, a, b, mirrored) * (a.tint * b.tint)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        transmittance(s).max_element() * from.passed * from.through
    }

    fn sample(&self, s: &Stack, from: &End, u: [f32; 3]) -> Vec3 {
        -rough::sample(s.surface.diffuse_roughness, from.up.z, u)
    }

    fn density(&self, s: &Stack, from: &End, to: &End) -> f32 {
        rough::density(s.surface.diffuse_roughness, from.up.z, to.up.z)
    }

    const JOINS: Joins = Joins::OtherSides;
    const EVENT: ScatterEvent = ScatterEvent::Diffuse;
}
