//! Where the paths of a pass go: to the film and its layers, or to a collector of one's own.

use super::{Renderer, Statistics};
use crate::{
    film::{Film, Half, TileSums},
    integrator::{Sink, WaveSink},
    lanes::Lanes,
    layers::Layers,
    math::Rgb,
    path::{Densities, JoinedPath, Strategy, Technique},
    scene::{bsdf::Transport, camera::Raster},
};

/// Where the paths of a pass go.
pub trait Collector {
    /// A path and its share of one pass, without h_j: see [`Sink::deposit`].
    fn collect(&mut self, path: &JoinedPath, value: Rgb);
}

/// The layers with their films.
pub(super) struct LayerFilms<'a> {
    pub(super) layers: &'a Layers,
    pub(super) films: Vec<Film>,
}

/// See [`Renderer::pass_where`]. Not a type of its own for each predicate: all of the core is compiled for each of
/// them.
pub type Predicate<'a> = dyn Fn(&JoinedPath) -> bool + Sync + 'a;

/// Where the paths of one task go. Not a type parameter, for the same reason.
pub(super) enum Destination<'a> {
    /// The film, and the films of the layers.
    Film {
        half: Half,
        /// The paths that go there; all, where it is `None`.
        keep: Option<&'a Predicate<'a>>,
    },
    /// See [`Renderer::pass_into`].
    Collector(&'a mut dyn Collector),
}

/// Brings the paths of one task to their destination, and counts.
pub(super) struct TaskSink<'a> {
    pub(super) renderer: &'a Renderer<'a>,
    pub(super) done: Statistics,
    pub(super) destination: Destination<'a>,
    /// The sums of the task's own pixels, where it has some.
    pub(super) sums: Option<&'a mut TileSums>,
}

impl WaveSink for TaskSink<'_> {
    #[inline(always)]
    fn deposit(&mut self, strategy: Strategy, raster: Raster, value: Rgb) {
        let Renderer { settings, film, .. } = self.renderer;
        if strategy.edges() < settings.min_depth {
            return;
        }
        let value = settings.clamped(value);
        if let Destination::Film { half, .. } = self.destination {
            match &mut self.sums {
                Some(sums) => sums.deposit(film, raster, value, half),
                None => film.deposit(raster, value, half),
            }
        }
    }

    #[inline(always)]
    fn announce(&mut self, lanes: impl Lanes, raster: Raster) {
        if let Destination::Film { half, .. } = self.destination {
            self.renderer.film.announce(lanes, raster, half);
        }
    }

    #[cold]
    fn reject(&mut self, technique: Technique) {
        *self.done.rejected.entry(technique).or_default() += 1;
    }

    #[inline(always)]
    fn shadow_rays(&mut self, rays: usize) {
        self.done.rays.visibility += rays as u64;
    }

    #[inline(always)]
    fn looked(&mut self, lookups: usize, found: usize) {
        Sink::looked(self, lookups, found);
    }

    #[inline(always)]
    fn walked(&mut self, transport: Transport, walks: usize) {
        Sink::walked(self, transport, walks);
    }

    #[inline(always)]
    fn lost_to_sides(&mut self, walks: usize) {
        self.done.lost_to_sides += walks as u64;
    }
}

impl Sink for TaskSink<'_> {
    #[inline(always)]
    fn deposit(&mut self, path: &JoinedPath, value: Rgb) {
        let Renderer { scene, settings, integrator, film, layers, alpha_sums, .. } = self.renderer;
        if path.edges() < settings.min_depth || (alpha_sums.is_some() && path.shows_background()) {
            return;
        }
        let value = settings.clamped(value);
        match &mut self.destination {
            Destination::Film { half, keep } => {
                if keep.is_none_or(|keep| keep(path)) {
                    film.deposit(path.raster(), value, *half);
                    if let Some(LayerFilms { layers, films }) = layers {
                        layers.deposit((scene, integrator), path, value, *half, films);
                    }
                }
            }
            Destination::Collector(collector) => collector.collect(path, value),
        }
    }

    #[inline]
    fn deposit_unseen(&mut self, strategy: Strategy, raster: Raster, value: Rgb) -> bool {
        let is_film_alone = matches!(self.destination, Destination::Film { keep: None, .. });
        let unseen = is_film_alone && self.renderer.layers.is_none();
        if unseen {
            WaveSink::deposit(self, strategy, raster, value);
        }
        unseen
    }

    #[cold]
    fn reject(&mut self, path: &JoinedPath, _value: Rgb) {
        WaveSink::reject(self, path.technique());
    }

    #[inline]
    fn shadow_ray(&mut self) {
        self.done.rays.visibility += 1;
    }

    #[inline]
    fn spared_ray(&mut self) {
        self.done.spared += 1;
    }

    #[inline]
    fn lost_to_sides(&mut self, walks: u64) {
        self.done.lost_to_sides += walks;
    }

    #[inline]
    fn looked(&mut self, lookups: usize, found: usize) {
        self.done.lookups.made += lookups as u64;
        self.done.lookups.found += found as u64;
    }

    #[inline]
    fn walked(&mut self, transport: Transport, rays: usize) {
        match transport {
            Transport::Radiance => self.done.rays.camera += rays as u64,
            Transport::Importance => self.done.rays.light += rays as u64,
        }
    }
}
