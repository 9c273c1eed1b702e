//! Rendering: passes over the image, spread over threads, that bring integrator and film together.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod data;
mod deposit;
mod merge_radius;
mod padded;
mod portable;
mod settings;
mod statistics;
mod variance;
mod wavelength;
mod waves;

use std::{
    ops::Range,
    sync::{Arc, Mutex},
};

use glam::Vec2;
use rayon::prelude::*;

pub use self::{
    data::Data,
    deposit::{Collector, Predicate},
    merge_radius::MergeRadius,
    settings::{Background, Settings},
    statistics::{Lookups, Rays, Statistics},
    waves::Width,
};
use self::{
    deposit::{Destination, LayerFilms, TaskSink},
    padded::{PaddedImage, Pixel},
};

use crate::{
    film::{AlphaSums, Crop, Film, FixedPoint, Half, Sums},
    integrator::{
        Connects, Integrator, Kept, LightStage, LightVertexMap, Samplers, Scratch, Sink, Splats, Sweep, Weights,
    },
    lanes::Instructions,
    layers::Layers,
    path::LightPaths,
    sampling::{Block, Independent, Sampler, SamplerKind, Sobol},
    scene::{
        Scene,
        camera::Raster,
        point::{Place, Point},
        wavelength::Wavelength,
    },
};

/// A render in progress: the film and how far it is.
pub struct Renderer<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    integrator: Integrator,
    /// Where something merges.
    merge_radius: Option<MergeRadius>,
    /// Whether waves can do this, and the lanes for them.
    waves_serve: bool,
    lanes: Instructions,
    rooms: waves::Rooms,
    film: Film,
    /// Of a transparent background.
    alpha_sums: Option<AlphaSums>,
    layers: Option<LayerFilms<'a>>,
    /// The paths that are in the image; all, where it is `None`.
    keep: Option<&'a Predicate<'a>>,
    /// The first pass of this part of the render, and the next one.
    passes: Range<u32>,
    /// What the tasks so far have done.
    done: Mutex<Statistics>,
}

impl<'a> Renderer<'a> {
    /// A render of `scene` without a sample yet.
    ///
    /// # Panics
    /// If the crop does not fit the camera's sensor, or the sensor has too little padding for the filter; and if pixels
    /// share light vertices, where not every sample has a light subpath.
    pub fn new(scene: &'a Scene, settings: &'a Settings) -> Self {
        let sensor = scene.camera.sensor();
        let mut integrator = Integrator::new(settings.integrator, sensor, settings.max_depth, settings.roulette)
            .with_directions(settings.hemisphere);
        if settings.light_samples != 1 {
            integrator = integrator.with_light_samples(settings.light_samples);
        }
        if settings.splits != 1 {
            integrator = integrator.with_splits(settings.splits);
        }
        if settings.light_paths != LightPaths::ONE {
            integrator = integrator.with_light_paths(settings.light_paths);
        }
        if let Some(each) = settings.light_vertices {
            assert!(settings.light_paths.is_with_each(), "a tile could have no light vertex to share");
            integrator = integrator.with_light_vertices(scene, each);
        }
        if let Some(roulette) = settings.connection_roulette {
            integrator = integrator.with_connection_roulette(roulette.with_unit(scene.spread_radiance()));
        }
        if let Some((strategy, weighting)) = settings.only {
            integrator = integrator.only(strategy, weighting);
        }
        Self::with_integrator(scene, settings, integrator)
    }

    /// The same with an integrator of one's own in place of the settings'.
    ///
    /// # Panics
    /// As [`Renderer::new`].
    pub fn with_integrator(scene: &'a Scene, settings: &'a Settings, integrator: Integrator) -> Self {
        let scale = FixedPoint::for_radiance(scene.lights().typical_radiance());
        let film = Film::new(scene.camera.sensor(), settings.crop, settings.filter, scale);
        let alpha_sums = match settings.background {
            Background::Shown => None,
            Background::Transparent => Some(AlphaSums::new(settings.crop, settings.filter)),
        };
        let merges = integrator.techniques().radius().is_some();
        let merge_radius = merges.then(|| MergeRadius::of(scene, settings.merge_radius));
        let renderer = Self {
            scene,
            settings,
            merge_radius,
            waves_serve: integrator.makes_waves(scene, settings.sampler),
            lanes: waves::suitable(),
            rooms: waves::Rooms::default(),
            integrator,
            film,
            alpha_sums,
            layers: None,
            keep: None,
            passes: 0..0,
            done: Mutex::default(),
        };
        renderer.with_weights(settings.weights)
    }

    fn with_weights(self, weights: Weights) -> Self {
        if weights == Weights::Plain || !variance::would_use_factors(&self.integrator) {
            return self;
        }
        let factors = Arc::new(variance::measured(&self));
        Self { integrator: self.integrator.clone().with_variance_factors(&factors), ..self }
    }

    /// Makes an image of each of `layers` beside the image itself.
    #[must_use]
    pub fn with_layers(self, layers: &'a Layers) -> Self {
        let Settings { crop, filter, .. } = *self.settings;
        let film = || Film::new(self.scene.camera.sensor(), crop, filter, self.film.scale());
        let films = std::iter::repeat_with(film).take(layers.len()).collect();
        Self { layers: Some(LayerFilms { layers, films }), ..self }
    }

    /// Leaves out of the image, and of its layers, every path for which `keep` does not hold.
    #[must_use]
    pub fn keeping(self, keep: &'a Predicate<'a>) -> Self {
        Self { keep: Some(keep), ..self }
    }

    /// The films of the layers, in the order of [`Layers::names`]; none without layers.
    pub fn layer_films(&self) -> &[Film] {
        self.layers.as_ref().map_or(&[], |layers| &layers.films)
    }

    /// All sums so far.
    pub fn sums(&self) -> Sums<'_> {
        let layers = self.layers.iter().flat_map(|layers| layers.layers.names().zip(&layers.films)).collect();
        Sums { film: &self.film, alpha_sums: self.alpha_sums.as_ref(), layers }
    }

    /// Makes `first` the next pass: what comes is a part of a longer render, whose other parts have the passes before
    /// and after.
    ///
    /// # Panics
    /// If there is a pass already.
    #[must_use]
    pub fn starting_at(self, first: u32) -> Self {
        assert!(self.passes.is_empty(), "a render has started already");
        Self { passes: first..first, ..self }
    }

    /// Goes on after these passes, whose sums have been added to [`Renderer::sums`], and in which `done` was done.
    #[must_use]
    pub fn resumed(self, passes: Range<u32>, done: &Statistics) -> Self {
        let this = Self { passes, ..self };
        this.count(done);
        this
    }

    /// Adds one sample per pixel, on the current rayon pool. The sums do not depend on the pool.
    pub fn pass(&mut self) {
        self.pass_of(self.keep);
    }

    /// The same with only those paths deposited for which `keep` holds, in place of [`Renderer::keeping`]: a predicate
    /// on paths makes an image of its own.
    pub fn pass_where(&mut self, keep: &Predicate<'_>) {
        self.pass_of(Some(keep));
    }

    fn pass_of(&mut self, keep: Option<&Predicate<'_>>) {
        let half = Half::of_pass(self.passes.end);
        self.set_radius();
        match self.waves().filter(|_| keep.is_none()) {
            Some(lanes) => self.pass_in_waves(lanes, half),
            None => drop(self.tasks(|part, scratch| self.task(part, scratch, Destination::Film { half, keep }))),
        }
        self.passes.end += 1;
    }

    /// A pass whose paths go to collectors of one's own instead of the film: `new` makes one for each task. They are
    /// returned in the order of tasks, which no number of threads changes.
    pub fn pass_into<C: Collector + Send>(&mut self, new: impl Fn() -> C + Sync) -> Vec<C> {
        self.set_radius();
        let collectors = self.tasks(|part, scratch| {
            let mut collector = new();
            self.task(part, scratch, Destination::Collector(&mut collector));
            collector
        });
        self.passes.end += 1;
        collectors
    }

    /// The radius of merges in the present pass.
    fn set_radius(&mut self) {
        if let Some(radius) = self.merge_radius {
            self.integrator = self.integrator.clone().merging_within(radius.of_pass(self.passes.end));
        }
    }

    /// One pass, with a task for each tile; where light vertices are kept for merges, two: all of them come first.
    fn tasks<T: Send>(&self, task: impl Fn(Part<'_>, &mut Scratch) -> T + Sync) -> Vec<T> {
        let Some(radius) = self.integrator.techniques().radius().filter(|_| self.integrator.merges()) else {
            return self.sweep(Sweep::Whole, |part, scratch| task(part, scratch));
        };
        let from_light = self.sweep(Sweep::Light, |part, scratch| (task(part, scratch), scratch.take_kept()));
        let (mut results, kept): (Vec<_>, Vec<_>) = from_light.into_iter().unzip();
        let map = LightVertexMap::new(&kept, radius);
        drop(kept);
        results.extend(self.sweep(Sweep::Camera(&map), task));
        results
    }

    fn sweep<T: Send>(&self, sweep: Sweep<'_>, task: impl Fn(Part<'_>, &mut Scratch) -> T + Sync) -> Vec<T> {
        self.image()
            .tiles()
            .into_par_iter()
            .map_init(|| self.integrator.scratch(), |scratch, tile| task(Part { tile, sweep }, scratch))
            .collect()
    }

    /// Brings one sample of each pixel of a tile to `destination`.
    fn task<'s>(&'s self, part: Part<'_>, scratch: &mut Scratch, destination: Destination<'s>) {
        let mut sink = TaskSink { renderer: self, done: Statistics::default(), destination, sums: None };
        sink.done.samples = match self.settings.sampler {
            SamplerKind::Independent => self.tile_by::<Independent>(part, scratch, &mut sink),
            SamplerKind::Sobol => self.tile_by::<Sobol>(part, scratch, &mut sink),
        };
        self.count(&sink.done);
    }

    fn image(&self) -> PaddedImage {
        PaddedImage { sensor: self.scene.camera.sensor(), side: PaddedImage::TILE }
    }

    fn tile_by<S: Sampler>(&self, part: Part<'_>, scratch: &mut Scratch, sink: &mut TaskSink) -> u64 {
        match Instructions::detect() {
            Instructions::Portable => self.tile_portable::<S>(part, scratch, sink),
            // SAFETY: a set of lanes exists only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(_) | Instructions::Avx512(_) => unsafe { self.tile_avx2::<S>(part, scratch, sink) },
        }
    }

    /// One sample of each pixel of a tile, in the present pass. Returns the number of samples that this counts as.
    #[inline(always)]
    fn tile<S: Sampler>(&self, Part { tile, sweep }: Part<'_>, scratch: &mut Scratch, sink: &mut TaskSink) -> u64 {
        let rounds: &[Stages] = match sweep {
            Sweep::Light => &[Stages::Light],
            _ if self.integrator.shares_light_vertices() => &[Stages::Light, Stages::Camera],
            _ => &[Stages::Both],
        };
        let numbers = |number| {
            let [_, light, ..] = self.streams::<S>(Pixel::of_number(number, self.scene.camera.sensor()));
            light
        };
        let shared = self.wavelength_of_tile(tile);
        let kept = match sweep {
            Sweep::Camera(map) => Some(Kept { map, numbers: &numbers, wavelength: shared }),
            _ => None,
        };
        let mut samples = 0;
        scratch.start_over();
        for stages in rounds {
            for pixel in self.image().tile(tile) {
                let stages = (*stages, shared);
                samples += self.sample::<S>(pixel, stages, scratch, sink, (sweep, kept.as_ref()));
            }
        }
        samples
    }

    /// One sample of one pixel of the padded image, or a stage of it; at the wavelength that its tile shares, if it
    /// does. Returns the number of samples that this counts as.
    #[inline(always)]
    fn sample<S: Sampler>(
        &self,
        pixel: Pixel,
        (stages, shared): (Stages, Option<Wavelength>),
        scratch: &mut Scratch,
        sink: &mut TaskSink,
        (sweep, kept): (Sweep<'_>, Option<&Kept<'_, S>>),
    ) -> u64 {
        let mut streams = self.streams::<S>(pixel);
        let wavelength = shared.or_else(|| self.wavelength_of_sample(pixel));
        let samplers = &mut Samplers::of(&mut streams, wavelength);
        let serves_crop = self.serves_crop(pixel);
        if stages == Stages::Both || matches!(sweep, Sweep::Light) {
            scratch.start_over();
        }
        if stages != Stages::Camera {
            let mut stage = self.light_stage(pixel, sweep);
            if stages == Stages::Light && !matches!(sweep, Sweep::Light) {
                stage.connects = Connects::Yes;
            }
            self.integrator.estimate_from_light(self.scene, stage, scratch, samplers, sink);
        }
        if stages == Stages::Light || !serves_crop {
            return 0;
        }
        if self.integrator.walks_from_camera() || self.alpha_sums.is_some() {
            samplers.camera.start(Block::START);
            let raster = Raster(pixel.corner() + samplers.camera.next_2d());
            if let Some(alpha_sums) = &self.alpha_sums {
                alpha_sums.deposit(raster, self.covered(raster, samplers.camera.clone()));
                sink.shadow_ray();
            }
            self.integrator.estimate_from_camera(self.scene, raster, scratch, samplers, kept, sink);
        }
        1
    }

    /// What the light subpaths of a pixel are for, where they are its own.
    #[inline]
    fn light_stage(&self, pixel: Pixel, sweep: Sweep<'_>) -> LightStage {
        let sensor = self.scene.camera.sensor();
        let connects = if self.serves_crop(pixel) { Connects::Yes } else { Connects::No };
        let splats = if pixel.is_inside(sensor) { Splats::Yes } else { Splats::No };
        let light_paths = self.integrator.techniques().light_paths();
        let paths = light_paths.of_pixel([pixel.x, pixel.y], self.settings.seed, self.passes.end);
        let first = || pixel.number(sensor) * light_paths.most();
        // Where only some light subpaths merge, the walk that is kept does not splat: the second one does.
        let merging = self.integrator.techniques().merging_light_paths();
        let splats_first = merging.is_with_each();
        match sweep {
            Sweep::Whole => LightStage { connects, splats, keeps: None, paths },
            Sweep::Light => {
                // Turns that know nothing of those of light subpaths: other numbers, and rows for columns.
                let seed = self.settings.seed ^ 0x2545_f491_4f6c_dd1d;
                let merges = merging.of_pixel([pixel.y, pixel.x], seed, self.passes.end) > 0;
                let keeps = (splats == Splats::Yes && merges).then(first);
                let splats = if splats_first { splats } else { Splats::No };
                LightStage { connects: Connects::No, splats, keeps, paths: if merges { paths } else { 0 } }
            }
            Sweep::Camera(_) => {
                let splats = if splats_first { Splats::No } else { splats };
                LightStage { connects, splats, keeps: None, paths }
            }
        }
    }

    /// The random numbers of one sample of one pixel, in the present pass.
    #[inline(always)]
    fn streams<S: Sampler>(&self, pixel: Pixel) -> [S; 4] {
        let numbered = pixel;
        let seed = self.settings.seed;
        let (pass, light_paths) = (self.passes.end, self.integrator.techniques().light_paths());
        let mut streams = S::streams(seed, numbered.key(), pass);
        if !light_paths.is_with_each() {
            let [_, light, _, lens] = S::streams(seed, numbered.key(), light_paths.number(pass));
            (streams[1], streams[3]) = (light, lens);
        }
        streams
    }

    /// 1 − V towards infinity in the direction that the camera subpath through `raster` takes, with the same numbers.
    ///
    /// It has a ray of its own, so that every integrator has the same alpha, also one without camera subpaths.
    fn covered(&self, raster: Raster, mut sampler: impl Sampler) -> f32 {
        let camera = &self.scene.camera;
        let u = if camera.has_aperture() { sampler.next_2d() } else { Vec2::ZERO };
        let lens = camera.sample_lens(raster, u);
        let sky = Point { place: Place::Infinite, ..Point::nowhere(camera.direction(&lens, raster)) };
        1.0 - self.scene.visible_from_camera(&lens, &sky)
    }

    /// Whether a camera sample in `pixel` can reach the crop through the filter.
    fn serves_crop(&self, pixel: Pixel) -> bool {
        let reach = self.settings.filter.padding() as i32;
        let Crop { x0, y0, x1, y1 } = self.settings.crop;
        (x0 as i32 - reach..x1 as i32 + reach).contains(&pixel.x)
            && (y0 as i32 - reach..y1 as i32 + reach).contains(&pixel.y)
    }

    /// Samples per pixel so far.
    pub fn passes(&self) -> u32 {
        self.passes.len() as u32
    }

    /// The passes that the film holds: from 0, unless this is a part of a longer render.
    pub fn range(&self) -> Range<u32> {
        self.passes.clone()
    }

    /// The integrator with its table.
    pub fn integrator(&self) -> &Integrator {
        &self.integrator
    }

    /// The film with the sums so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The sums behind alpha, if the background is transparent.
    pub fn alpha_sums(&self) -> Option<&AlphaSums> {
        self.alpha_sums.as_ref()
    }

    /// Alpha, pixel by pixel in the crop, if the background is transparent.
    pub fn alpha(&self) -> Option<Vec<f32>> {
        self.alpha_sums.as_ref().map(AlphaSums::alpha)
    }

    /// What was done so far.
    pub fn statistics(&self) -> Statistics {
        self.done.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }

    fn count(&self, done: &Statistics) {
        self.done.lock().unwrap_or_else(|e| e.into_inner()).add(done);
    }
}

/// A tile's part of a pass.
#[derive(Clone, Copy)]
struct Part<'a> {
    tile: u32,
    sweep: Sweep<'a>,
}

/// The part of a pixel's sample that is done at once.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stages {
    Both,
    /// The first, of all pixels of a tile before the second of any: these share their light vertices.
    Light,
    Camera,
}
