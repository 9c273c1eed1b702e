//! A clear coat: a GGX interface over all else, with a normal of its own. That of `KHR_materials_clearcoat` has an
//! index of 1.5; that of `KHR_materials_coat` has one of its own, and a colour, and darkens what lies below.

use glam::{Vec2, Vec3};

use super::{Emission, End, Part, Stack, Surface, base, base::mirror};
use crate::{
    math::{Frame, Rgb},
    scene::{
        bsdf::{
            albedo::Split,
            fresnel,
            layer::{mean_reflectance, product_lobe},
        },
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
    if surface.emission == Emission::OverAll {
        return 1.0;
    }
    let cos = if surface.coat_normal == Vec2::ZERO { w.z } else { w.dot(upright(surface.coat_normal)) };
    1.0 - surface.coat * (surface.coat_f0 + (1.0 - surface.coat_f0) * fresnel::schlick_power(cos.abs()))
}

/// The cosine-weighted mean of [`passes_emission`] over the hemisphere: Schlick's (1 − cos)⁵ has the mean 1/21.
pub(super) fn passes_emission_on_average(surface: &Surface) -> f32 {
    if surface.emission == Emission::OverAll {
        return 1.0;
    }
    1.0 - surface.coat * mean_reflectance(surface.coat_f0, 1.0)
}

/// The index of refraction of an interface with this reflectance at normal incidence.
pub(super) fn ior(f0: f32) -> f32 {
    let root = f0.min(0.999).sqrt();
    (1.0 + root) / (1.0 - root)
}

/// The hue of what a coloured coat lets pass, one way: the root of mix(1, colour^(1/cos θ_t), coat), since the colour
/// is that of light which crosses the coat twice along its normal, and the way through it grows as 1/cos θ_t
/// (`KHR_materials_coat`, "View-Dependent Absorption").
pub(super) fn tint(s: &Stack, cos: f32) -> Rgb {
    let color = s.surface.coat_color;
    if color == Rgb::ONE {
        return color;
    }
    let cos_t = fresnel::refracted_cos(cos, ior(s.surface.coat_f0)).max(1e-3);
    Rgb::ONE.lerp(color.map(|c| c.powf(1.0 / cos_t)), s.surface.coat).map(f32::sqrt)
}

/// What is left of light that goes to and fro between coat and base, to the extent that the surface has that
/// (OpenPBR 1.1, "Coat darkening"): (1 − K)/(1 − E K) for a base of albedo E. The coat sends the fraction K back down:
/// of diffuse light 1 − (1 − F)/η², F its mean reflectance from above, since what is beyond the critical angle never
/// gets out; of what a smooth base mirrors, F.
pub(super) fn darkening(s: &Stack) -> Rgb {
    let p = &s.surface;
    let amount = p.coat * p.coat_darkening;
    if amount == 0.0 {
        return Rgb::ONE;
    }
    let (mean, eta) = (mean_reflectance(p.coat_f0, 1.0), ior(p.coat_f0));
    let diffuse = 1.0 - (1.0 - mean) / (eta * eta);
    let rough = s.opaque + (1.0 - s.opaque) * p.alpha.sqrt();
    // Less than 1, also of a coat that reflects everything.
    let back = (mean + (diffuse - mean) * rough).min(0.999);
    base::albedo_of_all(s).map(|e| 1.0 + amount * ((1.0 - back) / (1.0 - e * back) - 1.0))
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
    s.surface.coat * (s.coat.single(split) + s.coat_multiple * split.missing)
}

/// |ω·N_coat|/|ω_s·N_s| dω/dω_s of the second direction: see [`super`].
fn bent(s: &Stack, light: &End) -> f32 {
    if s.coat_axes.is_some() { light.over_coat.z.max(0.0) / (light.up.z * light.coat_stretch) } else { 1.0 }
}

impl Part for Coating {
    fn value(&self, s: &Stack, camera: &End, light: &End) -> Rgb {
        if s.surface.coat == 0.0 || !camera.covered {
            return Rgb::ZERO;
        }
        let facet = s.coat_facets.reflect(camera.over_coat, light.over_coat);
        let power = fresnel::schlick_power(facet.cos);
        let reflectance = s.coat.f0 + (s.coat.f90 - s.coat.f0) * power;
        let reaches = camera.to_coat.min(light.to_coat);
        Rgb::splat(s.surface.coat * reflectance * facet.value * bent(s, light) * reaches)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        let is_met = from.covered && from.over_coat.z > 0.0;
        if is_met { s.surface.coat * s.coat.single(from.coat_split) * from.to_coat } else { 0.0 }
    }

    fn sample(&self, s: &Stack, from: &End, [u, v, _]: [f32; 3]) -> Vec3 {
        let h = s.coat_facets.sample_visible(from.over_coat, [u, v]);
        let w = mirror(from.over_coat, h);
        // What goes below the coat would meet another of its facets.
        if w.z <= 0.0 {
            return Vec3::ZERO;
        }
        s.coat_axes.as_ref().map_or(w, |axes| axes.under(w))
    }

    fn density(&self, s: &Stack, from: &End, to: &End) -> f32 {
        s.coat_facets.reflect(from.over_coat, to.over_coat).forward / to.coat_stretch
    }
}

impl Part for BetweenFacets {
    fn value(&self, s: &Stack, camera: &End, light: &End) -> Rgb {
        if s.surface.coat == 0.0 || !camera.covered || camera.over_coat.z <= 0.0 || light.over_coat.z <= 0.0 {
            return Rgb::ZERO;
        }
        let lobe = product_lobe(camera.coat_split.missing, light.coat_split.missing, s.coat_average.missing);
        Rgb::splat(s.surface.coat * s.coat_multiple * lobe * bent(s, light) * camera.to_coat.min(light.to_coat))
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        s.surface.coat * s.coat_multiple * from.coat_split.missing * from.to_coat
    }

    fn sample(&self, s: &Stack, _: &End, [u, v, _]: [f32; 3]) -> Vec3 {
        s.coat_grazing.sample(Vec3::Z, [u, v], true)
    }

    fn density(&self, s: &Stack, _: &End, to: &End) -> f32 {
        s.coat_grazing.pdf(to.up.z)
    }
}
