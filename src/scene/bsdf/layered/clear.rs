//! What is clear in the base: reflection and refraction at the facets of a boundary, of a volume or of a thin wall, by
//! exact Fresnel reflectances (`KHR_materials_transmission`, `KHR_materials_volume`), under whatever lies above.
//!
//! Of a volume the layers lie on the outer side. Light that enters or leaves crosses them once: f is that of the bare
//! boundary times t(θ), θ the angle outside. From inside, what they do not let out they send back by the facet through
//! which it came: to R of a facet is added the fraction 1 − t of what the facet passes, t at the angle at which the
//! light would have left. So a clear boundary under white layers loses nothing from either side, but for what a rough
//! one lacks inside. A thin wall has layers on both sides, and min(t(θ), t(θ′)) as every glossy lobe.

use glam::Vec3;

use super::{
    Clear, End, Joins, LEAST_ALPHA, Part, Stack, Surface, base,
    base::mirror,
    coat,
    facets::{Facet, Facets},
    sheen,
};
use crate::{
    math::Rgb,
    scene::bsdf::{
        Glass,
        albedo::{self, Split},
        fresnel,
        layer::{Grazing, multiple, product_lobe, ratio},
    },
};

/// The boundary with what does not depend on any direction. Of arrays the first is above the surface, the other below.
pub(super) struct Boundary {
    /// The fraction of the base.
    pub fraction: f32,
    /// The boundary, if it were smooth.
    glass: Glass,
    /// Whether a volume lies behind it.
    is_volume: bool,
    facets: Facets,
    /// GGX's α of facets without a grain that are about as rough.
    alpha: f32,
    /// Means of what meets a second facet, and the fractions of it that cross.
    average: [f32; 2],
    crosses: [f32; 2],
    grazing: Grazing,
}

/// The cosine at which layers send back what is diffuse: about the mean.
const DIFFUSE_COS: f32 = 0.6;

/// What happens between the facets to light from one direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Between {
    /// The part that meets a second facet.
    missing: f32,
    /// The fraction of it that crosses.
    crosses: f32,
}

/// What a facet does with light.
struct Optics {
    reflected: Rgb,
    passed: Rgb,
}

/// What facets do at once: reflect or refract.
pub(super) struct Once;

/// What leaves them after several, on either side.
pub(super) struct Several;

/// GGX's α of facets without a grain that miss as much light, `average`, as these do, when they mirror all of it.
fn without_grain(facets: Facets, average: Split) -> f32 {
    let [mut low, mut high] = [facets.x.min(facets.y), facets.x.max(facets.y)];
    while high - low > 1e-3 {
        let middle = 0.5 * (low + high);
        let misses_less = Split::average(middle).missing < average.missing;
        [low, high] = if misses_less { [middle, high] } else { [low, middle] };
    }
    0.5 * (low + high)
}

impl Boundary {
    pub fn of(s: &Surface, facets: Facets, average: Split) -> Option<Self> {
        let Clear { fraction, ior } = s.clear()?;
        let fraction = fraction * (1.0 - s.metallic);
        let glass = Glass { color: s.base_color, ior };
        let is_volume = s.bounds_volume();
        let mut boundary = Self {
            fraction,
            glass,
            is_volume,
            facets,
            alpha: without_grain(facets, average),
            average: [0.0; 2],
            crosses: [0.0; 2],
            grazing: Grazing::new((facets.x * facets.y).sqrt()),
        };
        if is_volume && glass.is_matched() {
            // Nothing is bent by facets of the same index, however rough.
            boundary.facets = Facets { x: LEAST_ALPHA, y: LEAST_ALPHA };
        } else if is_volume {
            // As at a [`Dielectric`](super::super::Dielectric).
            let eta = [1.0, -1.0].map(|side| glass.eta_across(side));
            boundary.average = eta.map(|eta| albedo::boundary_missing_average(boundary.alpha, eta));
            let most = boundary.average[0].max(boundary.average[1]);
            let [above, below] = eta.map(|eta| 1.0 - fresnel::mean_dielectric(eta));
            if most > 0.0 {
                boundary.crosses = [above * boundary.average[1] / most, below * boundary.average[0] / most];
            }
        } else {
            boundary.average = [average.missing; 2];
            boundary.crosses = [1.0 - multiple(fresnel::mean_dielectric(ior), 1.0 - average.missing); 2];
        }
        Some(boundary)
    }

    /// What happens between facets towards a direction of this cosine, negative below the surface, of which the base
    /// has this split.
    pub fn between(&self, cos: f32, split: &Split) -> Between {
        let crosses = self.crosses[usize::from(cos < 0.0)];
        if !self.is_volume {
            return Between { missing: split.missing, crosses };
        }
        if self.glass.is_matched() {
            return Between::default();
        }
        Between { missing: albedo::boundary_missing(cos.abs(), self.alpha, self.glass.eta_across(cos)), crosses }
    }

    /// Whether light that comes from above may be reflected as a whole.
    pub fn is_denser_above(&self) -> bool {
        self.is_volume && self.glass.ior < 1.0
    }

    /// What it does with light that meets layers again, of a mean `reflected`: what a volume reflects, and all of a
    /// thin wall's.
    pub fn meets_layers_again(&self, s: &Stack, reflected: Rgb) -> Rgb {
        let passed = if self.is_volume { Rgb::ZERO } else { (Rgb::ONE - reflected) * s.surface.base_color };
        (reflected + passed) * self.fraction
    }

    /// η on the side of a direction.
    fn eta(&self, above: bool) -> f32 {
        if self.is_volume { self.glass.eta(if above { 1.0 } else { -1.0 }) } else { 1.0 }
    }

    /// η_light/η_camera.
    pub fn relative_ior(&self, camera_above: bool, light_above: bool) -> f32 {
        self.eta(light_above) / self.eta(camera_above)
    }

    /// The cosine beyond the boundary at a facet that is met at this cosine from above or below; 0 where reflection is
    /// total.
    fn beyond(&self, above: bool, cos: f32) -> f32 {
        if self.is_volume { fresnel::refracted_cos(cos, self.eta(!above) / self.eta(above)) } else { cos }
    }

    /// What a facet does that is met at the first cosine, the second being that [`beyond`](Self::beyond) it.
    fn optics(&self, s: &Stack, above: bool, [cos, beyond]: [f32; 2]) -> Optics {
        if beyond == 0.0 {
            return Optics { reflected: Rgb::ONE, passed: Rgb::ZERO };
        }
        let (exact, outside) = if self.is_volume {
            let eta = self.eta(!above) / self.eta(above);
            (fresnel::dielectric_pair(cos, beyond, eta), if above { cos } else { beyond })
        } else {
            (fresnel::dielectric(cos, self.glass.ior), cos)
        };
        let plain = self.tinted(s, exact);
        let passed = Rgb::splat(1.0 - plain.max_element());
        let Some(film) = &s.film else { return Optics { reflected: plain, passed } };
        // What a film does not reflect it lets through, of each wavelength.
        let (filmed, amount) = (base::under_film(s, film, outside), s.surface.film);
        Optics { reflected: plain.lerp(filmed, amount), passed: passed.lerp(Rgb::ONE - filmed, amount) }
    }

    /// What a facet reflects that is met at this cosine from above.
    #[cfg(test)]
    pub fn reflectance(&self, s: &Stack, cos: f32) -> Rgb {
        self.optics(s, true, [cos, self.beyond(true, cos)]).reflected
    }

    /// An exact reflectance with the colour and the strength of `KHR_materials_specular`: f0 and f90 in place of those
    /// of the index, and between them as Fresnel's equations have it.
    fn tinted(&self, s: &Stack, exact: f32) -> Rgb {
        let (least, most) = (Clear { fraction: 1.0, ior: self.glass.ior }.f0(), s.surface.f90);
        if least < 1e-6 || s.surface.f0 == Rgb::ZERO {
            return Rgb::splat(exact * if least < 1e-6 { most } else { 0.0 });
        }
        let at_normal = s.surface.f0 * (1.0 / least);
        (at_normal.lerp(Rgb::splat(most), ((exact - least) / (1.0 - least)).max(0.0)) * exact).min(Rgb::ONE)
    }

    /// What the layers send back of light that would leave the volume by the facet `h`, which it meets from `along`
    /// below: the fraction, and its tint.
    fn returned(&self, s: &Stack, along: Vec3, h: Vec3) -> Rgb {
        if s.surface.coat == 0.0 && s.sheen_cover == 0.0 {
            return Rgb::ZERO;
        }
        let (cos, eta) = (along.dot(h), self.glass.eta_across(-1.0));
        let out = fresnel::refract(along, h, cos, fresnel::refracted_cos(cos, eta), eta);
        // Light that a facet sends below the surface meets another facet: it belongs to what leaves after several.
        if out.z >= 0.0 { Rgb::ZERO } else { sent_back(s, -out.z) }
    }

    /// The facet by which light goes from `a` to `b`, its normal on the side of `a`, and the cosine from there.
    fn facet(&self, a: &End, b: &End) -> (Facet, Vec3) {
        if a.above == b.above {
            return self.facets.reflect_at(a.along_grain, b.along_grain);
        }
        if !self.is_volume || self.glass.is_matched() {
            // A thin wall passes light as it would be reflected were it mirrored at the surface.
            return self.facets.reflect_at(a.along_grain, across(b.along_grain));
        }
        self.facets.refract_at(a.along_grain, -b.along_grain, self.eta(a.above), self.eta(b.above))
    }

    /// The cosines at and [`Self::beyond`] a facet: of one that is crossed both are known, and well conditioned up to
    /// the critical angle.
    fn met(&self, above: bool, crosses: bool, facet: &Facet) -> [f32; 2] {
        [facet.cos, if crosses { facet.beyond } else { self.beyond(above, facet.cos) }]
    }

    /// The probability with which light between the facets is sampled on the other side.
    fn goes_across(&self, s: &Stack, from: &End) -> f32 {
        let passes = s.surface.base_color.max_element() * from.clear.crosses;
        ratio(passes, 1.0 - from.clear.crosses)
    }

    /// The probabilities of reflecting and of refracting at a facet with this normal, from `from`.
    fn probabilities(&self, s: &Stack, from: &End, h: Vec3, cosines: [f32; 2]) -> [f32; 2] {
        let Optics { reflected, passed } = self.optics(s, from.above, cosines);
        let color = s.surface.base_color;
        let (mut back, mut on) = (reflected.max_element(), (passed * color).max_element());
        if !from.covered && on > 0.0 {
            let returned = self.returned(s, from.along_grain, h).max_element();
            back += returned * on;
            on *= 1.0 - returned;
        }
        [ratio(back, on), ratio(on, back)]
    }
}

/// What is sent back between two directions, given the fractions for each: their least would be too little, their
/// harmonic mean too much, so that it is half of each.
fn between_both(a: Rgb, b: Rgb) -> Rgb {
    let sum = (a + b).max(Rgb::splat(f32::MIN_POSITIVE));
    (a.min(b) + a * b * 2.0 / sum) * 0.5
}

/// A direction above the surface in place of the one across from it that a thin wall lets pass.
fn across(up: Vec3) -> Vec3 {
    Vec3::new(-up.x, -up.y, up.z)
}

/// What coat and sheen send back of light from below that would leave them at this cosine. The coat counts as flat and
/// colourless.
fn sent_back(s: &Stack, cos: f32) -> Rgb {
    let (coat, sheen) = (coat::albedo(s, cos), sheen::taken(s, cos));
    let color = s.surface.sheen * (1.0 / s.sheen_cover.max(f32::MIN_POSITIVE));
    Rgb::splat(coat) + color * (sheen * (1.0 - coat))
}

/// The clear boundary's albedo for light that meets layers again, in the brightest channel.
pub(super) fn albedo(s: &Stack, end: &End) -> f32 {
    let Some(boundary) = &s.clear else { return 0.0 };
    let Between { missing, crosses } = end.clear;
    let cosines = [end.facet_cos, boundary.beyond(end.above, end.facet_cos)];
    let once = boundary.optics(s, end.above, cosines).reflected;
    let reflected = once * (1.0 - missing) + Rgb::splat((1.0 - crosses) * missing);
    boundary.meets_layers_again(s, reflected).max_element()
}

impl Part for Once {
    fn value(&self, s: &Stack, camera: &End, light: &End) -> Rgb {
        let Some(boundary) = &s.clear else { return Rgb::ZERO };
        let (facet, h) = boundary.facet(camera, light);
        if facet.value == 0.0 {
            return Rgb::ZERO;
        }
        let crosses = camera.above != light.above;
        let Optics { reflected, passed } =
            boundary.optics(s, camera.above, boundary.met(camera.above, crosses, &facet));
        let color = s.surface.base_color;
        let seen = if crosses {
            passed * color
        } else if camera.covered {
            reflected
        } else {
            let [a, b] = [camera, light].map(|end| boundary.returned(s, end.along_grain, h));
            reflected + passed * color * color * between_both(a, b)
        };
        seen * (boundary.fraction * facet.value * camera.through.min(light.through)) * (camera.tint * light.tint)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        let Some(boundary) = &s.clear else { return 0.0 };
        // Facets reflect whatever they do not let pass.
        let passes = s.surface.base_color.max_element();
        boundary.fraction * (1.0 - from.clear.missing) * from.through * passes.max(0.1)
    }

    fn sample(&self, s: &Stack, from: &End, [u, v, w]: [f32; 3]) -> Vec3 {
        let Some(boundary) = &s.clear else { return Vec3::ZERO };
        let a = from.along_grain;
        let h = boundary.facets.sample_visible(a, [u, v]);
        let cos = a.dot(h);
        let beyond = boundary.beyond(from.above, cos);
        let [reflects, _] = boundary.probabilities(s, from, h, [cos, beyond]);
        let mirrored = mirror(a, h);
        let goes_on = w >= reflects;
        let b = if !goes_on {
            mirrored
        } else if !boundary.is_volume || boundary.glass.is_matched() {
            -across(mirrored)
        } else {
            fresnel::refract(a, h, cos, beyond, boundary.eta(!from.above) / boundary.eta(from.above))
        };
        // What a facet sends to the wrong side of the surface would meet another facet.
        if (b.z < 0.0) == goes_on { s.out_of_grain(b) } else { Vec3::ZERO }
    }

    fn density(&self, s: &Stack, from: &End, to: &End) -> f32 {
        let Some(boundary) = &s.clear else { return 0.0 };
        let (facet, h) = boundary.facet(from, to);
        if facet.forward == 0.0 {
            return 0.0;
        }
        let crosses = from.above != to.above;
        let [reflects, passes] = boundary.probabilities(s, from, h, boundary.met(from.above, crosses, &facet));
        facet.forward * if crosses { passes } else { reflects }
    }

    const JOINS: Joins = Joins::All;
}

impl Part for Several {
    fn value(&self, s: &Stack, camera: &End, light: &End) -> Rgb {
        let Some(boundary) = &s.clear else { return Rgb::ZERO };
        let (c, l) = (camera.clear, light.clear);
        let lobe = product_lobe(c.missing, l.missing, boundary.average[usize::from(!light.above)]);
        let color = s.surface.base_color;
        let seen = if camera.above != light.above {
            let eta = boundary.relative_ior(camera.above, light.above);
            color * (c.crosses / (eta * eta))
        } else if camera.covered {
            Rgb::splat(1.0 - c.crosses)
        } else {
            Rgb::splat(1.0 - c.crosses) + color * color * sent_back(s, DIFFUSE_COS) * c.crosses
        };
        seen * (boundary.fraction * lobe * camera.through.min(light.through)) * (camera.tint * light.tint)
    }

    fn weight(&self, s: &Stack, from: &End) -> f32 {
        s.clear.as_ref().map_or(0.0, |boundary| boundary.fraction * from.clear.missing * from.through)
    }

    fn sample(&self, s: &Stack, from: &End, [u, v, w]: [f32; 3]) -> Vec3 {
        let Some(boundary) = &s.clear else { return Vec3::ZERO };
        let up = boundary.grazing.sample(Vec3::Z, [u, v], true);
        if w < boundary.goes_across(s, from) { -up } else { up }
    }

    fn density(&self, s: &Stack, from: &End, to: &End) -> f32 {
        let Some(boundary) = &s.clear else { return 0.0 };
        let across = boundary.goes_across(s, from);
        boundary.grazing.pdf(to.up.z) * if from.above == to.above { 1.0 - across } else { across }
    }

    const JOINS: Joins = Joins::All;
}
