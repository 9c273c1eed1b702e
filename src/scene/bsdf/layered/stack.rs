//! What the lobes of a layered surface share: what does not depend on any direction, and what is known of one.

use glam::{Vec2, Vec3};

use super::{
    Averages, LEAST_ALPHA, SheenPlace, Surface, base, brushed, clear, coat, facets::Facets, film::Film, sheen, spread,
};
use crate::{
    math::Rgb,
    scene::bsdf::{
        albedo::Split,
        layer::{Coat, Grazing, multiple},
    },
};

/// The surface with what does not depend on any direction.
pub(super) struct Stack {
    pub surface: Surface,
    pub averages: Averages,
    pub facets: Facets,
    pub coat_facets: Facets,
    /// The coat's interface, and its index.
    pub coat: Coat,
    /// The axes of the coat where its normal is not the surface's.
    pub coat_axes: Option<coat::Axes>,
    /// The root of what light keeps that goes to and fro under the coat.
    pub darkening: Rgb,
    /// How much of a sheen there is to what lies below.
    pub sheen_cover: f32,
    /// Cosine and sine of the grain's angle.
    pub grain: [f32; 2],
    pub film: Option<Film>,
    /// The clear boundary, where there is any.
    pub clear: Option<clear::Boundary>,
    /// The fraction of the base that is a dielectric and diffuse below its interface.
    pub opaque: f32,
    /// Means of the splits of the base's light and of the coat's.
    pub average: Split,
    pub coat_average: Split,
    /// The base's mean reflectance, and what it reflects of the light between facets: of what is not clear.
    pub mean: Rgb,
    pub multiple: Rgb,
    /// The base's hue: its mean reflectance with the brightest channel at 1.
    pub tint: Rgb,
    /// The dielectric's interface by its brightest channel, and what it reflects of the light between facets.
    pub interface: Coat,
    pub interface_multiple: f32,
    pub coat_multiple: f32,
    pub grazing: Grazing,
    pub coat_grazing: Grazing,
}

/// What is known of one direction.
pub(super) struct End {
    /// The direction, or from behind its opposite: what leans on a surface leans to the same side for both.
    pub up: Vec3,
    /// Whether it lies above the surface.
    pub above: bool,
    /// Whether it sees the layers: a volume has none on its inner side.
    pub covered: bool,
    /// The direction as it meets the coat, in the coat's frame, and the ratio of solid angles, dω_s/dω, there.
    pub over_coat: Vec3,
    pub coat_stretch: f32,
    /// The direction along the grain.
    pub along_grain: Vec3,
    /// The split of the coat's light.
    pub coat_split: Split,
    /// The albedo of a white sheen.
    pub sheen: f32,
    /// What of the light reaches the coat, what reaches the sheen, and what reaches the base.
    pub to_coat: f32,
    pub to_sheen: f32,
    pub through: f32,
    /// The hue of what the coat lets pass, one way.
    pub tint: Rgb,
    /// The split of the base's light, and the cosine of its typical facet.
    pub split: Split,
    pub facet_cos: f32,
    /// The part of what reaches the base that reaches what is diffuse in it.
    pub passed: f32,
    /// What [`spread`] gives back.
    pub spread: f32,
    /// What the clear boundary does with light between its facets.
    pub clear: clear::Between,
}

impl Stack {
    pub fn new(surface: Surface, averages: Averages) -> Self {
        let s = &surface;
        let along = s.alpha + (1.0 - s.alpha) * s.anisotropy * s.anisotropy;
        let facets = Facets { x: along, y: s.alpha };
        let average = if s.anisotropy > 0.0 { brushed::average(facets) } else { Split::average(s.alpha) };
        let (coat, coat_average) = (Coat { f0: s.coat_f0, f90: 1.0 }, Split::average(s.coat_alpha));
        let outside = 1.0 + (coat::ior(s.coat_f0) - 1.0) * s.coat;
        let film = (s.film > 0.0).then_some(Film { ior: s.film_ior, thickness: s.film_thickness, outside });
        let tilted = s.coat > 0.0 && s.coat_normal != Vec2::ZERO;
        let (sin, cos) = s.tangent.sin_cos();
        let clear = clear::Boundary::of(s, facets, average);
        let mut stack = Self {
            averages,
            facets,
            coat_facets: Facets { x: s.coat_alpha, y: s.coat_alpha },
            coat,
            coat_axes: tilted.then(|| coat::Axes::new(s.coat_normal, s.coat_is_flat)),
            darkening: Rgb::ONE,
            sheen_cover: s.sheen_cover(),
            grain: [cos, sin],
            film,
            clear,
            opaque: (1.0 - s.metallic) * (1.0 - s.clear_fraction()),
            average,
            coat_average,
            mean: Rgb::ZERO,
            multiple: Rgb::ZERO,
            tint: Rgb::ZERO,
            interface: Coat { f0: s.f0.max_element(), f90: s.f90 },
            interface_multiple: 0.0,
            coat_multiple: coat.multiple(coat_average),
            grazing: Grazing::new((facets.x * facets.y).sqrt()),
            coat_grazing: Grazing::new(s.coat_alpha),
            surface,
        };
        stack.between_facets();
        stack.darkening = coat::darkening(&stack).map(f32::sqrt);
        stack
    }

    /// Fills in what the base reflects on average and after several facets.
    fn between_facets(&mut self) {
        let e1 = 1.0 - self.average.missing;
        let [dielectric, metal] = base::means(self);
        let several = |mean: Rgb| mean.map(|f| multiple(f, e1));
        let (m, d) = (self.surface.metallic, self.opaque);
        self.mean = dielectric * d + metal * m;
        self.multiple = several(dielectric) * d + several(metal) * m;
        self.interface_multiple = multiple(dielectric.max_element(), e1);
        let clear = self.clear.as_ref().map_or(Rgb::ZERO, |boundary| boundary.meets_layers_again(self, dielectric));
        let all = self.mean + clear;
        self.tint = all * (1.0 / all.max_element().max(f32::MIN_POSITIVE));
    }

    /// What coat and sheen let through towards a direction of this cosine, the coat lying flat.
    pub fn through(&self, cos: f32) -> f32 {
        (1.0 - coat::albedo(self, cos)) * (1.0 - sheen::taken(self, cos))
    }

    /// The direction `up` along the grain, and from there.
    pub fn along_grain(&self, up: Vec3) -> Vec3 {
        let [cos, sin] = self.grain;
        if self.surface.anisotropy > 0.0 {
            Vec3::new(cos * up.x + sin * up.y, cos * up.y - sin * up.x, up.z)
        } else {
            up
        }
    }

    pub fn out_of_grain(&self, w: Vec3) -> Vec3 {
        let [cos, sin] = self.grain;
        if self.surface.anisotropy > 0.0 { Vec3::new(cos * w.x - sin * w.y, cos * w.y + sin * w.x, w.z) } else { w }
    }

    pub fn end(&self, w: Vec3) -> End {
        let s = &self.surface;
        let above = w.z > 0.0;
        let up = w * 1.0_f32.copysign(w.z);
        let along_grain = self.along_grain(up);
        let split =
            if s.anisotropy > 0.0 { brushed::split(self.facets, along_grain) } else { Split::towards(up.z, s.alpha) };
        let mut end = End {
            up,
            above,
            covered: above || !s.bounds_volume(),
            over_coat: up,
            coat_stretch: 1.0,
            along_grain,
            coat_split: Split { normal: 0.0, grazing: 0.0, missing: 0.0 },
            sheen: 0.0,
            to_coat: 1.0,
            to_sheen: 1.0,
            through: 1.0,
            tint: Rgb::ONE,
            split,
            facet_cos: base::typical_cosine(split),
            passed: 0.0,
            spread: 0.0,
            clear: clear::Between::default(),
        };
        if end.covered {
            self.cover(&mut end);
        }
        end.passed = base::passed(self, &end);
        if let Some(boundary) = &self.clear {
            end.clear = boundary.between(up.z * if above { 1.0 } else { -1.0 }, &end.split);
        }
        if end.covered {
            let lacking = spread::lacking(self, up.z, &end.split);
            end.spread =
                if lacking > 0.0 { (base::albedo(self, &end) + clear::albedo(self, &end)) * lacking } else { 0.0 };
        }
        end
    }

    /// What the layers do on the way in direction `end`.
    fn cover(&self, end: &mut End) {
        let s = &self.surface;
        (end.over_coat, end.coat_stretch) = self.coat_axes.as_ref().map_or((end.up, 1.0), |axes| axes.over(end.up));
        // Beyond the coat's own horizon it lets through what it does at a low angle.
        end.coat_split = Split::towards(end.over_coat.z.max(0.25 * end.up.z), s.coat_alpha);
        let coat = s.coat * (self.coat.single(end.coat_split) + self.coat_multiple * end.coat_split.missing);
        end.sheen = if self.sheen_cover == 0.0 { 0.0 } else { sheen::albedo(s.sheen_alpha, end.up.z) };
        let below_sheen = 1.0 - self.sheen_cover * end.sheen;
        match s.sheen_place {
            SheenPlace::UnderCoat => end.to_sheen = 1.0 - coat,
            SheenPlace::OverAll { .. } => end.to_coat = below_sheen,
        }
        end.through = (1.0 - coat) * below_sheen;
        if s.coat > 0.0 {
            end.tint = coat::tint(self, end.up.z) * self.darkening;
        }
    }
}

/// The surface as a BSDF can sample it: nothing is smoother than the smoothest lobe.
pub(super) fn no_smoother(surface: Surface) -> Surface {
    Surface {
        alpha: surface.alpha.max(LEAST_ALPHA),
        coat_alpha: surface.coat_alpha.max(LEAST_ALPHA),
        sheen_alpha: surface.sheen_alpha.max(sheen::LEAST_ALPHA),
        ..surface
    }
}
