//! What a pixel is made of: its largest contributions, each as a path with the densities and weights of every technique
//! that could have found it.
//!
//! The samples are those of a render with the same settings, so the pixel's value is the render's to the last bit. What
//! is said of a path comes from its definition ([`Path`]), which shares nothing with the fast form that found it.

mod shares;
mod top;

use std::collections::BTreeMap;

use glam::DVec3;

pub use self::shares::Share;
use self::{shares::Tables, top::Top};
use crate::{
    film::{Crop, Film, Half},
    integrator::{Integrator, IntegratorKind},
    math::{Rgb, luminance},
    path::{Densities, JoinedPath, Path, Strategy, Technique},
    render::{Collector, MergeRadius, Predicate, Renderer, Settings},
    scene::{Scene, bsdf::ScatterEvent, camera::Raster},
};

/// What is known of a pixel after some passes.
pub struct Trace<'a> {
    /// The pixel of the image.
    pub value: Rgb,
    /// Samples per pixel.
    pub passes: u32,
    /// How many contributions it got, in all passes.
    pub contributions: u64,
    /// Their sum in f64: [`Trace::value`] times the passes, the film's rounding apart.
    pub sum: DVec3,
    /// The largest of them by luminance, largest first; of equal ones those first that were found first.
    pub largest: Vec<Contribution<'a>>,
    /// Contributions to any pixel that are no number, and so in no image.
    pub rejected: BTreeMap<Technique, u64>,
}

/// One path's share in a pixel.
pub struct Contribution<'a> {
    /// What it adds to the sum of all passes: w F h/(n p), over roulette's survival probability.
    pub value: Rgb,
    /// The pass, from 0.
    pub pass: u32,
    /// Where on the image it arrives.
    pub raster: Raster,
    /// h of that place for the pixel, in 1/pixel².
    pub filter: f32,
    /// What found it.
    pub technique: Technique,
    /// The path itself.
    pub path: Path<'a>,
    /// What happens at p_1 … p_{n−1}.
    pub events: Vec<Passage>,
    /// The probability with which roulette let both walks come so far.
    pub survival: f32,
    /// The weight by which the fast form has weighed it.
    pub fast_weight: f32,
    /// Of every technique with as many edges: first (s,t) by rising s, then merges.
    pub shares: Vec<Share>,
}

/// What happens to the light at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passage {
    /// By what kind of lobe it is scattered.
    pub event: ScatterEvent,
    /// Whether it passes to the other side of the surface.
    pub transmits: bool,
}

impl Contribution<'_> {
    /// The share of the technique that found it.
    pub fn own(&self) -> &Share {
        self.shares.iter().find(|share| share.technique == self.technique).expect("what found a path has a share in it")
    }

    /// Of all techniques, those of other integrators included, the one that finds this path most often in a pass: the
    /// largest n p. The own one, if it is as good.
    pub fn best(&self) -> &Share {
        self.shares.iter().fold(self.own(), |best, share| {
            if share.expected_anywhere() > best.expected_anywhere() { share } else { best }
        })
    }

    /// w F h/(n p) by definition.
    pub fn defined(&self) -> DVec3 {
        let own = self.own();
        self.path.contribution() * (f64::from(self.filter) * own.weight / own.expected())
    }

    /// By what [`Contribution::value`] exceeds its definition: the reciprocal of [`Contribution::survival`], if neither
    /// roulette on connections, nor shared light vertices, nor a clamp had a part in it.
    pub fn excess(&self) -> f64 {
        let defined = self.defined();
        self.value.as_dvec3().dot(defined) / defined.length_squared()
    }
}

/// A pixel that is being traced, pass by pass.
pub struct Tracer<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    renderer: Renderer<'a>,
    radius: Option<MergeRadius>,
    keep: Option<&'a Predicate<'a>>,
    film: Film,
    found: Found<'a>,
}

/// What was found so far, or by one task.
struct Found<'a> {
    contributions: u64,
    sum: DVec3,
    top: Top<Contribution<'a>>,
}

impl<'a> Tracer<'a> {
    /// Traces the one pixel of the settings' crop, and keeps its `most` largest contributions among those for which
    /// `keep` holds.
    ///
    /// # Panics
    /// If the crop is not one pixel, and as [`Renderer::new`].
    pub fn new(scene: &'a Scene, settings: &'a Settings, keep: Option<&'a Predicate<'a>>, most: usize) -> Self {
        assert_eq!(settings.crop.pixels(), 1, "one pixel is traced");
        let renderer = Renderer::new(scene, settings);
        let film = Film::new(scene.camera.sensor(), settings.crop, settings.filter, renderer.film().scale());
        let radius = renderer.integrator().techniques().radius();
        let radius = radius.map(|_| MergeRadius::of(scene, settings.merge_radius));
        let found = Found { contributions: 0, sum: DVec3::ZERO, top: Top::new(most) };
        Self { scene, settings, renderer, radius, keep, film, found }
    }

    /// The integrator with its table.
    pub fn integrator(&self) -> &Integrator {
        self.renderer.integrator()
    }

    /// Takes one sample per pixel, on the current rayon pool. The result does not depend on the pool.
    pub fn pass(&mut self) {
        let pass = self.renderer.range().end;
        let integrator = in_pass(self.integrator(), self.radius, pass);
        let (settings, scene, film, keep) = (self.settings, self.scene, &self.film, self.keep);
        let least = self.found.top.least();
        let finder = || {
            let found = Found { contributions: 0, sum: DVec3::ZERO, top: Top::above(self.found.top.most(), least) };
            Finder { scene, settings, film, keep, integrator: &integrator, pass, found }
        };
        for Finder { found, .. } in self.renderer.pass_into(finder) {
            self.found.contributions += found.contributions;
            self.found.sum += found.sum;
            self.found.top.take(found.top);
        }
    }

    /// What was found, with the densities and weights of all techniques.
    ///
    /// # Panics
    /// Without a pass.
    pub fn finish(self) -> Trace<'a> {
        let Self { scene, settings, renderer, radius, film, found, .. } = self;
        let kinds = IntegratorKind::ALL.into_iter();
        let others: Vec<_> = kinds
            .map(|kind| (kind, Integrator::new(kind, scene.camera.sensor(), settings.max_depth, settings.roulette)))
            .collect();
        let usual = Some(MergeRadius::of(scene, settings.merge_radius));
        let explained = |found: Contribution<'a>| {
            let elsewhere = others.iter().map(|(kind, x)| (*kind, in_pass(x, usual, found.pass)));
            let tables = Tables {
                own: in_pass(renderer.integrator(), radius, found.pass),
                elsewhere: elsewhere.collect(),
                raster: found.raster,
            };
            Contribution { shares: tables.shares(&found.path, found.technique), ..found }
        };
        let (passes, rejected) = (renderer.passes(), renderer.statistics().rejected);
        let value = film.image(passes).pixels[0];
        let largest = found.top.into_largest_first().map(explained).collect();
        Trace { value, passes, contributions: found.contributions, sum: found.sum, largest, rejected }
    }
}

/// The shares of all techniques in a path that arrives at `raster`, by the table of `integrator` alone: first (s,t) by
/// rising s, then merges. Of area sampling, which shares with nobody, it is the first.
pub fn shares(path: &Path, raster: Raster, integrator: &Integrator) -> Vec<Share> {
    let by_area = integrator.techniques().area() > 0;
    // Of the others, what found the path does not matter.
    let found = if by_area { Technique::Area } else { Technique::Bidirectional(Strategy { s: 0, t: 0 }) };
    Tables { own: integrator.clone(), elsewhere: Vec::new(), raster }.shares(path, found)
}

/// The integrator with the radius that merges have in a pass.
fn in_pass(integrator: &Integrator, radius: Option<MergeRadius>, pass: u32) -> Integrator {
    match radius {
        Some(radius) => integrator.clone().merging_within(radius.of_pass(pass)),
        None => integrator.clone(),
    }
}

/// Sees all paths of one task.
struct Finder<'f, 'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    film: &'f Film,
    keep: Option<&'a Predicate<'a>>,
    integrator: &'f Integrator,
    pass: u32,
    found: Found<'a>,
}

impl Collector for Finder<'_, '_> {
    fn collect(&mut self, path: &JoinedPath, value: Rgb) {
        let filter = self.filter_at(path.raster());
        if filter == 0.0 || self.keep.is_some_and(|keep| !keep(path)) {
            return;
        }
        self.film.deposit(path.raster(), value, Half::of_pass(self.pass));
        let value = value * filter;
        self.found.contributions += 1;
        self.found.sum += value.as_dvec3();
        let size = luminance(value).abs();
        if self.found.top.admits(size) {
            let contribution = self.contribution(path, value, filter);
            self.found.top.insert(size, contribution);
        }
    }
}

impl<'a> Finder<'_, 'a> {
    /// h_j at a place, where the film adds it to the pixel; else zero.
    fn filter_at(&self, raster: Raster) -> f32 {
        let Settings { crop: Crop { x0, y0, .. }, filter, .. } = *self.settings;
        let reaches = |x: f32, pixel: u32| (x.floor() - pixel as f32).abs() <= filter.padding() as f32;
        if !(reaches(raster.0.x, x0) && reaches(raster.0.y, y0)) {
            return 0.0;
        }
        filter.value(raster.0.x - (x0 as f32 + 0.5), raster.0.y - (y0 as f32 + 0.5))
    }

    fn contribution(&self, path: &JoinedPath, value: Rgb, filter: f32) -> Contribution<'a> {
        let events = (1..path.edges()).map(|i| Passage { event: path.event(i), transmits: path.transmits(i) });
        Contribution {
            value,
            pass: self.pass,
            raster: path.raster(),
            filter,
            technique: path.technique(),
            path: self.kept(path),
            events: events.collect(),
            survival: path.survival(),
            fast_weight: self.integrator.weight(path),
            shares: Vec::new(),
        }
    }

    /// The path by its definition, which outlives the subpaths.
    fn kept(&self, path: &JoinedPath) -> Path<'a> {
        let (raster, path) = (path.raster(), path.to_path());
        let kept = Path::new(self.scene, path.vertices().to_vec()).with_visibility(path.visibility().to_vec());
        let kept = kept.arriving_at(raster).at_wavelength(path.wavelength());
        match path.merged() {
            Some((i, q)) => kept.merged_at(i, *q),
            None => kept,
        }
    }
}
