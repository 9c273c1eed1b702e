//! The boundary of a refracting volume, smooth or rough.

use glam::Vec3;

use super::{
    BsdfSample, GRAZING, Glass, Lobe, Scatter, ScatterEvent, Transport, albedo, fresnel,
    layer::{Coat, Grazing, Ways, product_lobe},
    microfacet::{Ggx, SMOOTH_ALPHA},
    mirrored,
    transmitting::{Clear, End, Transmitting},
};
use crate::math::Rgb;

/// A dielectric boundary: index 1 outside (z > 0), `ior` inside. To the fraction `transmission` it is clear, with exact
/// Fresnel reflection, and to the rest plastic, which scatters what enters it diffusely back to the side it came from.
///
/// Smooth, it has `Delta(0)`, the reflection, and `Delta(1)`, the refraction; rough, it is that of Walter et al. 2007,
/// *Microfacet Models for Refraction through Rough Surfaces*, with visible normals (Heitz 2014), and what meets a
/// second facet is scattered to both sides (Kulla & Conty 2017), so that clear glass loses nothing.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// The tint of refraction and of the diffuse remainder, in [0, 1] per channel.
    pub color: Rgb,
    /// The index of refraction inside, positive. Within 1e-4 of 1 the boundary only tints.
    pub ior: f32,
    /// GGX's α, the square of glTF's roughness; smooth below 1e-3.
    pub alpha: f32,
    /// The fraction of the base that refracts, in [0, 1].
    pub transmission: f32,
}

impl Dielectric {
    #[inline]
    fn surface(&self) -> Transmitting {
        Transmitting {
            color: self.color,
            transmission: self.transmission,
            coat: Coat::of_ior(self.ior, self.is_matched()),
            alpha: if self.is_smooth() { 0.0 } else { self.alpha },
        }
    }

    /// The boundary, if it were smooth and clear: what bends light is the same in any case.
    #[inline(always)]
    fn smooth(&self) -> Glass {
        Glass { color: self.color, ior: self.ior }
    }

    /// The boundary, if there is nothing else: smooth and clear, whatever the index inside. The common case.
    #[inline(always)]
    pub(super) fn glass(&self) -> Option<Glass> {
        (self.transmission == 1.0 && self.alpha < SMOOTH_ALPHA).then_some(self.smooth())
    }

    #[inline]
    fn is_matched(&self) -> bool {
        self.smooth().is_matched()
    }

    #[inline]
    fn is_smooth(&self) -> bool {
        self.alpha < SMOOTH_ALPHA || self.is_matched()
    }

    /// The index of refraction on the side of `w`.
    #[inline]
    fn eta(&self, w: Vec3) -> f32 {
        self.smooth().eta(w.z)
    }

    /// η across the boundary over η on the side of `w`.
    #[inline]
    fn eta_across(&self, w: Vec3) -> f32 {
        self.smooth().eta_across(w.z)
    }

    /// Reflectance of the smooth boundary towards `w`.
    #[inline]
    fn fresnel(&self, w: Vec3) -> f32 {
        fresnel::dielectric(w.z.abs(), self.eta_across(w))
    }

    /// What is known of the rough clear boundary before any direction is; nothing where there is none.
    ///
    /// Of the light between facets, the fraction c (1 − F_avg) M' crosses, M' the mean of what is missing on the other
    /// side: as η² (1 − F_avg) is the same from both sides, so is η² M c (1 − F_avg) M', as reciprocity asks. c makes
    /// the larger of M and M' one.
    #[inline]
    fn between(&self) -> Option<[Between; 2]> {
        if self.is_smooth() || self.transmission == 0.0 {
            return None;
        }
        let eta = [self.eta_across(Vec3::Z), self.eta_across(-Vec3::Z)];
        let missing = eta.map(|eta| albedo::boundary_missing_average(self.alpha, eta));
        let most = missing[0].max(missing[1]);
        let side = |i: usize| Between {
            average: missing[i],
            crosses: (1.0 - fresnel::mean_dielectric(eta[i])) * missing[1 - i] / most,
        };
        Some([side(0), side(1)])
    }

    /// What the clear boundary does with light from `w`, of which the smooth one reflects `fresnel`.
    #[inline]
    fn clear(&self, w: Vec3, fresnel: f32, between: Option<&[Between; 2]>) -> Clear {
        let Some(between) = between else {
            return Clear { fresnel, missing: 0.0, crosses: 0.0 };
        };
        let missing = albedo::boundary_missing(w.z.abs(), self.alpha, self.eta_across(w));
        Clear { fresnel, missing, crosses: between[side(w)].crosses }
    }

    /// The ways of sampling from `w`; `fresnel` is what the smooth boundary reflects.
    #[inline(never)]
    fn ways(&self, surface: Transmitting, w: Vec3, fresnel: f32) -> Ways {
        surface.end(w, self.clear(w, fresnel, self.between().as_ref()), surface.plastic()).ways
    }

    /// The probability of sampling a facet from `w`; `fresnel` is what the smooth boundary reflects.
    #[inline(always)]
    fn facet_probability(&self, surface: Transmitting, w: Vec3, fresnel: f32) -> f32 {
        if self.glass().is_some() { 1.0 } else { self.ways(surface, w, fresnel).facet_probability() }
    }

    /// What leaves the clear boundary after several facets, 1/sr, before the tint.
    #[inline]
    fn multiple(&self, camera: &End, light: &End, between: &[Between; 2]) -> f32 {
        let (c, l) = (camera.clear, light.clear);
        let lobe = product_lobe(c.missing, l.missing, between[side(light.direction)].average);
        if side(camera.direction) == side(light.direction) {
            (1.0 - c.crosses) * lobe
        } else {
            let eta = self.relative_ior(camera.direction, light.direction);
            c.crosses * lobe / (eta * eta)
        }
    }

    /// The diffuse and the rough specular lobe.
    #[inline]
    fn lobes(&self, to_camera: Vec3, to_light: Vec3) -> (Scatter, Scatter) {
        let surface = self.surface();
        let plastic = surface.plastic();
        let between = self.between();
        let end = |w: Vec3| surface.end(w, self.clear(w, self.fresnel(w), between.as_ref()), plastic);
        let (camera, light) = (end(to_camera), end(to_light));
        let (diffuse, multiple) = surface.smooth_lobes(&camera, &light, plastic);
        if self.is_smooth() {
            return (diffuse, Scatter::ZERO);
        }
        let (p_camera, p_light) = (camera.ways.facet_probability(), light.ways.facet_probability());
        let clear = between.map_or(0.0, |between| self.multiple(&camera, &light, &between));
        let ggx = Ggx::<Vec3> { alpha: self.alpha };
        let specular = if to_camera.z * to_light.z > 0.0 {
            let facet = ggx.reflect(to_camera, to_light);
            let f = fresnel::dielectric(facet.cos_camera, self.eta_across(to_camera));
            let q = surface.reflection_probability(f, facet.cos_camera);
            let mut lobe =
                facet.scatter(Rgb::splat(surface.reflectance(f, facet.cos_camera)), p_camera * q, p_light * q);
            lobe.f += Rgb::splat(multiple + self.transmission * clear);
            lobe
        } else {
            let facet = ggx.refract(to_camera, to_light, self.eta(to_camera), self.eta(to_light));
            let f = fresnel::dielectric_pair(facet.cos_camera, facet.cos_light, self.eta_across(to_camera));
            let q = |cos| surface.transmission_probability(f, cos);
            let mut lobe = facet.scatter(
                surface.transmittance() * (1.0 - f),
                p_camera * q(facet.cos_camera),
                p_light * q(facet.cos_light),
            );
            lobe.f += surface.transmittance() * clear;
            lobe
        };
        (diffuse, specular)
    }

    /// See [`super::Bsdf::eval`].
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        let same_side = to_camera.z * to_light.z > 0.0;
        let Lobe::Delta(k) = lobe else {
            let (diffuse, specular) = self.lobes(to_camera, to_light);
            return Scatter::sum(diffuse, specular);
        };
        if !self.is_smooth() || k != u8::from(!same_side) {
            return Scatter::ZERO;
        }
        if let Some(glass) = self.glass() {
            return glass.between(to_camera.z, to_light.z);
        }
        let surface = self.surface();
        let (cos_camera, cos_light) = (to_camera.z.abs(), to_light.z.abs());
        if same_side {
            let f = self.fresnel(to_camera);
            let p = self.facet_probability(surface, to_camera, f) * surface.reflection_probability(f, cos_camera);
            Scatter::delta(Rgb::splat(surface.reflectance(f, cos_camera)), to_light.z, p, p, 1.0)
        } else {
            let f = fresnel::dielectric_pair(cos_camera, cos_light, self.eta_across(to_camera));
            let p = |w: Vec3| self.facet_probability(surface, w, f) * surface.transmission_probability(f, w.z.abs());
            let p = [p(to_camera), p(to_light)];
            self.smooth().refraction((surface.transmittance(), f), p, to_camera.z, to_light.z)
        }
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if known.z.abs() < GRAZING {
            return None;
        }
        if let Some(glass) = self.glass() {
            let (direction, refracts, scatter) = glass.sample(known, transport, u.z);
            return BsdfSample::checked(direction, Lobe::Delta(refracts.into()), scatter, transport);
        }
        let surface = self.surface();
        let ways = self.ways(surface, known, self.fresnel(known));
        let p = ways.facet_probability();
        let (direction, lobe) = if u.z >= p {
            (ways.sample(known, Grazing::new(surface.alpha), u.into(), true), Lobe::Continuous)
        } else {
            let smooth = self.is_smooth();
            let h = if smooth {
                Vec3::Z.copysign(Vec3::splat(known.z))
            } else {
                Ggx::<Vec3> { alpha: self.alpha }.sample_visible(known, [u.x, u.y], true)
            };
            let (cos, eta) = (known.dot(h), self.eta_across(known));
            let cos_t = fresnel::refracted_cos(cos, eta);
            let f = fresnel::dielectric_pair(cos, cos_t, eta);
            let reflects = u.z < p * surface.reflection_probability(f, cos);
            let direction = match (smooth, reflects) {
                (true, true) => mirrored(known),
                (true, false) => fresnel::refracted(known, cos_t, eta),
                (false, true) => fresnel::reflect(known, h, cos),
                (false, false) => fresnel::refract(known, h, cos, cos_t, eta),
            };
            // A facet may send light to the wrong side of the surface, where it would meet another facet: lost here.
            if (direction.z * known.z > 0.0) != reflects {
                return None;
            }
            (direction, if smooth { Lobe::Delta(u8::from(!reflects)) } else { Lobe::Continuous })
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
        if !self.is_smooth() {
            return 1.0;
        }
        1.0 - self.facet_probability(self.surface(), known, self.fresnel(known))
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

    /// See [`super::Bsdf::relative_ior`].
    #[inline]
    pub fn relative_ior(&self, to_camera: Vec3, to_light: Vec3) -> f32 {
        self.smooth().relative_ior(to_camera.z, to_light.z)
    }
}

/// What happens on one side of a rough clear boundary to light that meets a second facet.
#[derive(Clone, Copy, Debug)]
struct Between {
    /// The cosine-weighted mean part of all light that does.
    average: f32,
    /// The fraction of it that comes out on the other side.
    crosses: f32,
}

/// Which of [`Dielectric::between`]'s sides `w` is on: 0 above.
#[inline]
fn side(w: Vec3) -> usize {
    usize::from(w.z <= 0.0)
}
