//! A clear coat (`KHR_materials_clearcoat`): a GGX interface of index 1.5 over all else, with a normal of its own.

use glam::{Vec2, Vec3};

use super::{COAT, End, Part, Stack, Surface, base::mirror};
use crate::{
    math::{Frame, Rgb},
    scene::{
        bsdf::{albedo::Split, fresnel, layer::product_lobe},
        tilt::Tilt,
    },
};

/// The axes of a coat whose normal is not N_s.
pub(super) struct Axes {
    frame: Frame,
    /// The map that has bent directions over N_s, where the coat lies flat.
    bent: Option<Tilt>,
}

impl Axes {
    /// Around a normal of which x and y are known, in the frame around N_s.
    pub(super) fn new(normal: Vec2, is_flat: bool) -> Self {
        let normal = upright(normal);
        Self { frame: Frame::around(normal), bent: is_flat.then(|| Tilt::between(Vec3::Z, normal, false)) }
    }

    /// The direction over the coat of one over N_s, and dω_s/dω.
    pub(super) fn over(&self, up: Vec3) -> (Vec3, f32) {
        let (w, stretch) = self.bent.as_ref().map_or((up, 1.0), |bent| {
            let met = bent.to_surface(up);
            (met.direction, met.jacobian)
        });
        (self.frame.to_local(w), stretch)
    }

    /// The direction over N_s of one over the coat.
    fn under(&self, w: Vec3) -> Vec3 {
        let w = self.frame.to_world(w).normalize();
        self.bent.as_ref().map_or(w, |bent| bent.to_shading(w).direction)
    }
}

/// The unit normal with this x and y.
fn upright(normal: Vec2) -> Vec3 {
    let rest = (1.0 - normal.length_squared()).max(0.01).sqrt();
    normal.extend(rest).normalize()
}

/// What the coat leaves of the light that `surface` emits below it in the direction `w` over N_s:
/// 1 − coat · F(|ω·N_coat|), F after Schlick (`KHR_materials_clearcoat`, "Emission"). Its roughness does not count.
pub(super) fn passes_emission(surface: &Surface, w: Vec3) -> f32 {
    let cos = if surface.coat_normal == Vec2::ZERO { w.z } else { w.dot(upright(surface.coat_normal)) };
    1.0 - surface.coat * (COAT.f0 + (COAT.f90 - COAT.f0) * fresnel::schlick_power(cos.abs()))
}

/// The cosine-weighted mean of [`passes_emission`] over the hemisphere: Schlick's (1 − cos)⁵ has the mean 1/21.
pub(super) fn passes_emission_on_average(surface: &Surface) -> f32 {
    1.0 - surface.coat * (COAT.f0 + (COAT.f90 - COAT.f0) / 21.0)
}

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

/// |ω·N_coat|/|ω_s·N_s| dω/dω_s of the second direction: see [`super`].
fn bent(s: &Stack, light: &End) -> f32 {
    if s.coat_axes.is_some() { light.over_coat.z.max(0.0) / (light.up.z * light.coat_stretch) } else { 1.0 }
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
        s.coat_axes.as_ref().map_or(w, |axes| axes.under(w))
    }

    fn density(&self, s: &Stack, from: &End, to: &End) -> f32 {
        s.coat_facets.reflect(from.over_coat, to.over_coat).forward / to.coat_stretch
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
