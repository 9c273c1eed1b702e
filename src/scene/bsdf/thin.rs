//! A thin-walled transmitting surface: glTF's `KHR_materials_transmission` without a volume.

use glam::Vec3;

use super::{
    BsdfSample, GRAZING, Lobe, Pane, Scatter, ScatterEvent, Transport,
    albedo::Split,
    fresnel,
    layer::{Coat, Grazing, multiple, product_lobe},
    microfacet::{Ggx, SMOOTH_ALPHA},
    mirrored,
    pane::through,
    transmitting::{Clear, End, Transmitting},
};
use crate::math::Rgb;

/// A sheet without thickness, the same from both sides: to the fraction `transmission` a clear one that lets through
/// what the exact Fresnel reflection of one interface leaves, as the extension has it, and to the rest plastic, which
/// scatters it diffusely back.
///
/// Smooth, it has `Delta(0)`, the reflection, and `Delta(1)`, straight on; rough, the transmitted lobe is the
/// reflected one mirrored through the surface, and what meets a second facet is scattered to both sides.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    /// The tint of transmission and of the diffuse remainder, in [0, 1] per channel.
    pub color: Rgb,
    /// The index of refraction of the sheet, positive: it sets the reflectance and bends nothing.
    pub ior: f32,
    /// GGX's α, the square of glTF's roughness; smooth below 1e-3.
    pub alpha: f32,
    /// The fraction of the base that transmits, in [0, 1].
    pub transmission: f32,
}

impl ThinDielectric {
    #[inline]
    fn surface(&self) -> Transmitting {
        Transmitting {
            color: self.color,
            transmission: self.transmission,
            coat: Coat::of_ior(self.ior, self.ior == 1.0),
            alpha: if self.is_smooth() { 0.0 } else { self.alpha },
        }
    }

    /// The sheet, if there is nothing else: smooth and clear.
    #[inline(always)]
    pub(super) fn pane(&self) -> Option<Pane> {
        (self.transmission == 1.0 && self.is_smooth()).then_some(Pane { color: self.color, ior: self.ior })
    }

    /// The mean split of what facets reflect that reflect everything; nothing is missing where there is no rough clear
    /// sheet.
    #[inline]
    fn average(&self) -> Split {
        Split::average(if self.transmission == 0.0 { 0.0 } else { self.alpha })
    }

    /// What the clear sheet does with light from `w`. Reflected or let through, it meets the same facets.
    #[inline]
    fn clear(&self, w: Vec3) -> Clear {
        let cos = w.z.abs();
        let fresnel = fresnel::dielectric(cos, self.ior);
        if self.is_smooth() || self.transmission == 0.0 {
            return Clear { fresnel, missing: 0.0, crosses: 0.0 };
        }
        let reflected = multiple(fresnel::mean_dielectric(self.ior), 1.0 - self.average().missing);
        Clear { fresnel, missing: Split::towards(cos, self.alpha).missing, crosses: 1.0 - reflected }
    }

    #[inline]
    fn end(&self, w: Vec3) -> End {
        let surface = self.surface();
        surface.end(w, self.clear(w), surface.plastic())
    }

    #[inline]
    fn is_smooth(&self) -> bool {
        self.alpha < SMOOTH_ALPHA
    }

    /// The diffuse and the rough specular lobe.
    #[inline]
    fn lobes(&self, to_camera: Vec3, to_light: Vec3) -> (Scatter, Scatter) {
        let surface = self.surface();
        let (camera, light) = (self.end(to_camera), self.end(to_light));
        let (diffuse, multiple) = surface.smooth_lobes(&camera, &light, surface.plastic(), Grazing::new(surface.alpha));
        if self.is_smooth() {
            return (diffuse, Scatter::ZERO);
        }
        let same_side = to_camera.z * to_light.z > 0.0;
        let ggx = Ggx::<Vec3> { alpha: self.alpha };
        let facet = ggx.reflect(to_camera, if same_side { to_light } else { through(to_light) });
        let cos = facet.cos_camera;
        let f = fresnel::dielectric(cos, self.ior);
        let clear = product_lobe(camera.clear.missing, light.clear.missing, self.average().missing);
        let crosses = camera.clear.crosses;
        let (color, q, rest) = if same_side {
            let rest = Rgb::splat(multiple + self.transmission * (1.0 - crosses) * clear);
            (Rgb::splat(surface.reflectance(f, cos)), surface.reflection_probability(f, cos), rest)
        } else {
            let transmittance = surface.transmittance();
            (transmittance * (1.0 - f), surface.transmission_probability(f, cos), transmittance * (crosses * clear))
        };
        let mut specular =
            facet.scatter(color, camera.ways.facet_probability() * q, light.ways.facet_probability() * q);
        specular.f += rest;
        (diffuse, specular)
    }

    /// See [`super::Bsdf::eval`].
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        let Lobe::Delta(k) = lobe else {
            let (diffuse, specular) = self.lobes(to_camera, to_light);
            return Scatter::sum(diffuse, specular);
        };
        let same_side = to_camera.z * to_light.z > 0.0;
        if !self.is_smooth() || k != u8::from(!same_side) {
            return Scatter::ZERO;
        }
        if let Some(pane) = self.pane() {
            return pane.between(to_camera.z, to_light.z);
        }
        let surface = self.surface();
        let cos = to_camera.z.abs();
        let f = fresnel::dielectric(cos, self.ior);
        let (value, q) = if same_side {
            (Rgb::splat(surface.reflectance(f, cos)), surface.reflection_probability(f, cos))
        } else {
            (surface.transmittance() * (1.0 - f), surface.transmission_probability(f, cos))
        };
        let p = self.end(to_camera).ways.facet_probability() * q;
        Scatter::delta(value, to_light.z, p, p, 1.0)
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if known.z.abs() < GRAZING {
            return None;
        }
        if let Some(pane) = self.pane() {
            let (direction, passes, scatter) = pane.sample(known, transport, u.z);
            return BsdfSample::checked(direction, Lobe::Delta(passes.into()), scatter, transport);
        }
        let surface = self.surface();
        let end = self.end(known);
        let p = end.ways.facet_probability();
        let (direction, lobe) = if u.z >= p {
            (end.ways.sample(known, Grazing::new(self.alpha), u.into(), true), Lobe::Continuous)
        } else {
            let smooth = self.is_smooth();
            let (mirror, cos) = if smooth {
                (mirrored(known), known.z.abs())
            } else {
                let h = Ggx::<Vec3> { alpha: self.alpha }.sample_visible(known, [u.x, u.y], true);
                let cos = known.dot(h);
                (fresnel::reflect(known, h, cos), cos)
            };
            // Light that a facet sends below the surface would meet another facet: lost here.
            if mirror.z * known.z <= 0.0 {
                return None;
            }
            let reflects = u.z < p * surface.reflection_probability(fresnel::dielectric(cos, self.ior), cos);
            let lobe = if smooth { Lobe::Delta(u8::from(!reflects)) } else { Lobe::Continuous };
            (if reflects { mirror } else { through(mirror) }, lobe)
        };
        let (to_camera, to_light) = transport.sides(known, direction);
        BsdfSample::checked(direction, lobe, self.eval(lobe, to_camera, to_light), transport)
    }

    /// See [`super::Bsdf::has_continuous`].
    #[inline]
    pub fn has_continuous(&self) -> bool {
        !self.is_smooth() || self.surface().albedo() != Rgb::ZERO
    }

    /// See [`super::Bsdf::delta_count`].
    #[inline]
    pub fn delta_count(&self) -> u8 {
        if self.is_smooth() { 2 } else { 0 }
    }

    /// See [`super::Bsdf::continuous_probability`].
    #[inline]
    pub fn continuous_probability(&self, known: Vec3) -> f32 {
        if self.is_smooth() { 1.0 - self.end(known).ways.facet_probability() } else { 1.0 }
    }

    /// See [`super::Bsdf::continuous_transmits`].
    #[inline]
    pub fn continuous_transmits(&self) -> bool {
        !self.is_smooth()
    }

    /// See [`super::Bsdf::event`].
    #[inline]
    pub fn continuous_event(&self, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        let (diffuse, specular) = self.lobes(to_camera, to_light);
        ScatterEvent::dominant(&diffuse, &specular)
    }
}
