//! The boundary of a refracting volume, smooth or rough.

use glam::Vec3;

use super::{
    Across, BsdfSample, Glass, Lobe, Scatter, ScatterEvent, Transport, albedo, fresnel, is_grazing,
    layer::{Coat, Grazing, product_lobe},
    microfacet::{Ggx, SMOOTH_ALPHA},
    mirrored,
    transmitting::{Clear, End, Plastic, Transmitting},
};
use crate::{
    lanes::{Float, Lanes, Mask, Select, Vector},
    math::Rgb,
};

/// A dielectric boundary: index 1 outside (z > 0), `ior` inside. To the fraction `transmission` it is clear, with exact
/// Fresnel reflection, and to the rest plastic, which scatters what enters it diffusely back to the side it came from.
///
/// Smooth, it has `Delta(0)`, the reflection, and `Delta(1)`, the refraction; rough, it is that of Walter et al. 2007,
/// *Microfacet Models for Refraction through Rough Surfaces*, with visible normals (Heitz 2014), and what meets a
/// second facet is scattered to both sides (Kulla & Conty 2017), so that clear glass loses nothing.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric<V: Vector = Vec3> {
    /// The tint of refraction and of the diffuse remainder, in [0, 1] per channel.
    pub color: Rgb<V>,
    /// The index of refraction inside, positive. Within 1e-4 of 1 the boundary only tints.
    pub ior: V::F,
    /// GGX's α, the square of glTF's roughness; smooth below 1e-3.
    pub alpha: V::F,
    /// The fraction of the base that refracts, in [0, 1].
    pub transmission: V::F,
}

impl<V: Vector> Dielectric<V> {
    /// What does not depend on any direction.
    #[inline(always)]
    fn known(&self) -> Known<V> {
        let zero = self.alpha.lanes().splat(0.0);
        let surface = Transmitting {
            color: self.color,
            transmission: self.transmission,
            coat: Coat::of_ior(self.ior, self.smooth().is_matched()),
            alpha: self.is_smooth().select(zero, self.alpha),
        };
        Known { surface, plastic: surface.plastic(), between: self.between(), grazing: Grazing::new(surface.alpha) }
    }

    /// The boundary, if it were smooth and clear: what bends light is the same in any case.
    #[inline(always)]
    pub(crate) fn smooth(&self) -> Glass<V> {
        Glass { color: self.color, ior: self.ior }
    }

    #[inline(always)]
    fn is_smooth(&self) -> <V::Lanes as Lanes>::M {
        self.alpha.lt(self.alpha.lanes().splat(SMOOTH_ALPHA)) | self.smooth().is_matched()
    }

    /// Reflectance of the smooth boundary towards directions of this cosine.
    #[inline(always)]
    fn fresnel(&self, cos: V::F) -> V::F {
        fresnel::dielectric(cos.abs(), self.smooth().eta_across(cos))
    }

    /// What is known of the rough clear boundary before any direction is; nothing where there is none.
    ///
    /// Of the light between facets, the fraction c (1 − F_avg) M' crosses, M' the mean of what is missing on the other
    /// side: as η² (1 − F_avg) is the same from both sides, so is η² M c (1 − F_avg) M', as reciprocity asks. c makes
    /// the larger of M and M' one.
    #[inline(always)]
    fn between(&self) -> Option<Between<V>> {
        let (zero, one) = (self.alpha.lanes().splat(0.0), self.alpha.lanes().splat(1.0));
        let some = !(self.is_smooth() | self.transmission.eq(zero));
        if !some.any() {
            return None;
        }
        let eta = [self.smooth().eta_across(one), self.smooth().eta_across(-one)];
        let missing = [
            albedo::boundary_missing_average(self.alpha, eta[0]),
            albedo::boundary_missing_average(self.alpha, eta[1]),
        ];
        let most = missing[0].max(missing[1]);
        let crosses = [
            (one - fresnel::mean_dielectric(eta[0])) * missing[1] / most,
            (one - fresnel::mean_dielectric(eta[1])) * missing[0] / most,
        ];
        Some(Between { some, average: missing, crosses })
    }

    /// What happens towards `w`, of which the smooth boundary reflects `fresnel`.
    #[inline(always)]
    fn end(&self, known: &Known<V>, w: V, fresnel: V::F) -> End<V> {
        let ([_, _, z], zero) = (w.coordinates(), fresnel.lanes().splat(0.0));
        let mut clear = Clear { fresnel, missing: zero, crosses: zero };
        if let Some(Between { some, crosses, .. }) = known.between {
            let missing = albedo::boundary_missing(z.abs(), self.alpha, self.smooth().eta_across(z));
            clear.missing = some.select(missing, zero);
            clear.crosses = some.select(of_side(z, crosses), zero);
        }
        known.surface.end(w, clear, known.plastic)
    }

    /// [`Self::end`], the smooth boundary being as it is.
    #[inline(always)]
    fn end_towards(&self, known: &Known<V>, w: V) -> End<V> {
        let [_, _, z] = w.coordinates();
        self.end(known, w, self.fresnel(z))
    }

    /// What leaves the clear boundary after several facets, 1/sr, before the tint.
    #[inline(always)]
    fn multiple(&self, camera: &End<V>, light: &End<V>, between: &Between<V>) -> V::F {
        let (c, l) = (camera.clear, light.clear);
        let (zero, one) = (c.missing.lanes().splat(0.0), c.missing.lanes().splat(1.0));
        let lobe = product_lobe(c.missing, l.missing, of_side(light.cos(), between.average));
        let eta = self.smooth().relative_ior(camera.cos(), light.cos());
        let same_side = !(zero.lt(camera.cos()) & light.cos().le(zero) | camera.cos().le(zero) & zero.lt(light.cos()));
        let value = same_side.select((one - c.crosses) * lobe, c.crosses * lobe / (eta * eta));
        between.some.select(value, zero)
    }

    /// The diffuse and the rough specular lobe.
    #[inline(always)]
    fn lobes(&self, known: &Known<V>, camera: &End<V>, light: &End<V>) -> [Scatter<V::Lanes>; 2] {
        let (lanes, surface, smooth) = (self.alpha.lanes(), known.surface, self.is_smooth());
        let (diffuse, multiple) = surface.smooth_lobes(camera, light, known.plastic, known.grazing);
        let nothing = Scatter::nothing(lanes);
        if !(!smooth).any() {
            return [diffuse, nothing];
        }
        let clear = match &known.between {
            Some(between) => self.multiple(camera, light, between),
            None => lanes.splat(0.0),
        };
        let same_side = lanes.splat(0.0).lt(camera.cos() * light.cos());
        let (mut reflected, mut refracted) = (nothing, nothing);
        if same_side.any() {
            reflected = self.reflected(surface, camera, light);
            reflected.f = reflected.f + Rgb::grey(multiple + self.transmission * clear);
        }
        if (!same_side).any() {
            refracted = self.refracted(surface, camera, light);
            refracted.f = refracted.f + surface.transmittance().times(clear);
        }
        [diffuse, Scatter::select(same_side, reflected, refracted).only(!smooth)]
    }

    /// By one facet, which reflects.
    #[inline(always)]
    fn reflected(&self, surface: Transmitting<V>, camera: &End<V>, light: &End<V>) -> Scatter<V::Lanes> {
        let facet = Ggx::<V> { alpha: self.alpha }.reflect(camera.direction, light.direction);
        let f = fresnel::dielectric(facet.cos_camera, self.smooth().eta_across(camera.cos()));
        let q = surface.reflection_probability(f, facet.cos_camera);
        let (p_camera, p_light) = (camera.ways.facet_probability() * q, light.ways.facet_probability() * q);
        facet.scatter(Rgb::grey(surface.reflectance(f, facet.cos_camera)), p_camera, p_light)
    }

    /// By one facet, which refracts.
    #[inline(always)]
    fn refracted(&self, surface: Transmitting<V>, camera: &End<V>, light: &End<V>) -> Scatter<V::Lanes> {
        let eta = [self.smooth().eta(camera.cos()), self.smooth().eta(light.cos())];
        let facet = Ggx::<V> { alpha: self.alpha }.refract(camera.direction, light.direction, eta[0], eta[1]);
        let across = self.smooth().eta_across(camera.cos());
        let f = fresnel::dielectric_pair(facet.cos_camera, facet.cos_light, across);
        let p_camera = camera.ways.facet_probability() * surface.transmission_probability(f, facet.cos_camera);
        let p_light = light.ways.facet_probability() * surface.transmission_probability(f, facet.cos_light);
        facet.scatter(surface.transmittance().times(f.lanes().splat(1.0) - f), p_camera, p_light)
    }

    /// The continuous part between two directions.
    #[inline(always)]
    pub(crate) fn continuous(&self, to_camera: V, to_light: V) -> Scatter<V::Lanes> {
        let known = self.known();
        let (camera, light) = (self.end_towards(&known, to_camera), self.end_towards(&known, to_light));
        let [diffuse, specular] = self.lobes(&known, &camera, &light);
        Scatter::sum(diffuse, specular)
    }

    /// The delta between two directions of which one is the other mirrored or refracted.
    #[inline(always)]
    fn delta(&self, known: &Known<V>, to_camera: V, to_light: V) -> Scatter<V::Lanes> {
        let ([_, _, camera], [_, _, light]) = (to_camera.coordinates(), to_light.coordinates());
        let (zero, one) = (camera.lanes().splat(0.0), camera.lanes().splat(1.0));
        let (same_side, surface) = (zero.lt(camera * light), known.surface);
        let (cos_camera, cos_light) = (camera.abs(), light.abs());
        let eta = self.smooth().eta_across(camera);
        let cos_t = same_side.select(fresnel::refracted_cos(cos_camera, eta), cos_light);
        let f = fresnel::dielectric_pair(cos_camera, cos_t, eta);
        let facets = [
            self.end(known, to_camera, f).ways.facet_probability(),
            self.end(known, to_light, f).ways.facet_probability(),
        ];
        let p = facets[0] * surface.reflection_probability(f, cos_camera);
        let reflection = Scatter::delta(Rgb::grey(surface.reflectance(f, cos_camera)), light, p, p, one);
        let q = [
            facets[0] * surface.transmission_probability(f, cos_camera),
            facets[1] * surface.transmission_probability(f, cos_light),
        ];
        let refraction = self.smooth().refraction((surface.transmittance(), f), q, camera, light);
        Scatter::select(same_side, reflection, refraction)
    }

    /// A direction across from `known`: none for a grazing one, nor where a facet sends light to the wrong side of the
    /// surface, where it would meet another facet.
    #[inline(always)]
    pub(crate) fn sample_in_lanes(&self, from: V, transport: Transport, [u, v, w]: [V::F; 3]) -> Across<V> {
        let ([_, _, z], lanes) = (from.coordinates(), w.lanes());
        let (zero, one) = (lanes.splat(0.0), lanes.splat(1.0));
        let (known, smooth, eta) = (self.known(), self.is_smooth(), self.smooth().eta_across(z));
        let end = self.end_towards(&known, from);
        let p = end.ways.facet_probability();
        let by_facets = !p.le(w);
        let rough = by_facets & !smooth;
        let mut h = V::new(zero, zero, one.copysign(z));
        if rough.any() {
            h = rough.select(Ggx::<V> { alpha: self.alpha }.sample_visible(from, [u, v], rough), h);
        }
        let cos = from.dot(h);
        let cos_t = fresnel::refracted_cos(cos, eta);
        let f = fresnel::dielectric_pair(cos, cos_t, eta);
        let reflects = w.lt(p * known.surface.reflection_probability(f, cos));
        let of_smooth = reflects.select(mirrored(from), fresnel::refracted(from, cos_t, eta));
        let mut direction = of_smooth;
        if rough.any() {
            let of_rough = reflects.select(fresnel::reflect(from, h, cos), fresnel::refract(from, h, cos, cos_t, eta));
            direction = rough.select(of_rough, of_smooth);
        }
        let [_, _, sampled] = direction.coordinates();
        let is_lost = by_facets & (zero.lt(sampled * z) & !reflects | !zero.lt(sampled * z) & reflects);
        if (!by_facets).any() {
            let other = end.ways.sample(from, known.grazing, [u, v, w], !by_facets);
            direction = by_facets.select(direction, other);
        }
        let across = self.end_towards(&known, direction);
        let (camera, light) = transport.sides(&end, &across);
        let [diffuse, specular] = self.lobes(&known, camera, light);
        let (mut scatter, is_delta) = (Scatter::sum(diffuse, specular), by_facets & smooth);
        if is_delta.any() {
            let delta = self.delta(&known, camera.direction, light.direction);
            scatter = Scatter::select(is_delta, delta, scatter);
        }
        let scatter = scatter.only(!(is_lost | is_grazing(z)));
        Across { direction, is_delta, is_second: !reflects, scatter }
    }

    /// See [`super::Bsdf::has_continuous`].
    #[inline(always)]
    pub fn has_continuous(&self) -> <V::Lanes as Lanes>::M {
        !self.is_smooth() | !self.color.times(self.alpha.lanes().splat(1.0) - self.transmission).is_black()
    }
}

impl Dielectric {
    /// The boundary, if there is nothing else: smooth and clear, whatever the index inside. The common case.
    #[inline(always)]
    pub(super) fn glass(&self) -> Option<Glass> {
        (self.transmission == 1.0 && self.alpha < SMOOTH_ALPHA).then_some(self.smooth())
    }

    /// See [`super::Bsdf::eval`].
    #[inline]
    pub fn eval(&self, lobe: Lobe, to_camera: Vec3, to_light: Vec3) -> Scatter {
        let same_side = to_camera.z * to_light.z > 0.0;
        let Lobe::Delta(k) = lobe else { return self.continuous(to_camera, to_light) };
        if !self.is_smooth() || k != u8::from(!same_side) {
            return Scatter::ZERO;
        }
        if let Some(glass) = self.glass() {
            return glass.between(to_camera.z, to_light.z);
        }
        self.delta(&self.known(), to_camera, to_light)
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, known: Vec3, transport: Transport, u: Vec3) -> Option<BsdfSample> {
        if let Some(glass) = self.glass() {
            let (direction, refracts, scatter) = glass.sample(known, transport, u.z);
            return BsdfSample::checked(direction, Lobe::Delta(refracts.into()), scatter, transport);
        }
        let Across { direction, is_delta, is_second, scatter } = self.sample_in_lanes(known, transport, u.into());
        let lobe = if is_delta { Lobe::Delta(is_second.into()) } else { Lobe::Continuous };
        BsdfSample::checked(direction, lobe, scatter, transport)
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
        if self.glass().is_some() {
            return 0.0;
        }
        1.0 - self.end_towards(&self.known(), known).ways.facet_probability()
    }

    /// See [`super::Bsdf::continuous_transmits`].
    #[inline]
    pub fn continuous_transmits(&self) -> bool {
        !self.is_smooth()
    }

    /// See [`super::Bsdf::event`].
    #[inline]
    pub fn continuous_event(&self, to_camera: Vec3, to_light: Vec3) -> ScatterEvent {
        let known = self.known();
        let (camera, light) = (self.end_towards(&known, to_camera), self.end_towards(&known, to_light));
        let [diffuse, specular] = self.lobes(&known, &camera, &light);
        ScatterEvent::dominant(&diffuse, &specular)
    }

    /// See [`super::Bsdf::relative_ior`].
    #[inline]
    pub fn relative_ior(&self, to_camera: Vec3, to_light: Vec3) -> f32 {
        self.smooth().relative_ior(to_camera.z, to_light.z)
    }
}

/// What is the same towards all directions.
#[derive(Clone, Copy, Debug)]
struct Known<V: Vector> {
    surface: Transmitting<V>,
    plastic: Option<Plastic<V::F>>,
    between: Option<Between<V>>,
    grazing: Grazing<V::F>,
}

/// What happens on each side of a rough clear boundary, above first, to light that meets a second facet.
#[derive(Clone, Copy, Debug)]
struct Between<V: Vector> {
    /// Where there is such a boundary.
    some: <V::Lanes as Lanes>::M,
    /// The cosine-weighted mean part of all light that does.
    average: [V::F; 2],
    /// The fraction of it that comes out on the other side.
    crosses: [V::F; 2],
}

/// What is so on the side of a direction of this cosine.
#[inline(always)]
fn of_side<F: Float>(cos: F, [above, below]: [F; 2]) -> F {
    cos.le(cos.lanes().splat(0.0)).select(below, above)
}
