//! What a render is asked for.

use super::padded::PaddedImage;
use crate::{
    film::Crop,
    integrator::{IntegratorKind, RelativeRoulette, Weighting, Weights},
    math::Rgb,
    path::{LightPaths, Roulette, Step, Strategy},
    sampling::{Filter, SamplerKind},
    scene::{bsdf::Directions, camera::Sensor},
};

/// What an image shows where the camera sees no surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// The environment, as any other light.
    Shown,
    /// Nothing: the image has an alpha channel ([`Renderer::alpha`](super::Renderer::alpha)), and the environment
    /// lights the scene unseen.
    Transparent,
}

/// Everything besides the scene that changes pixels (the number of samples apart).
#[derive(Clone, Debug)]
pub struct Settings {
    /// The integrator.
    pub integrator: IntegratorKind,
    /// How walks from the camera sample directions, for an integrator with s = 0 alone; of no effect on the others.
    pub hemisphere: Directions,
    /// The longest path, in edges.
    pub max_depth: u32,
    /// The shortest path, in edges: shorter ones are left out of the image. 1 for all.
    pub min_depth: u32,
    /// Next-event samples at each vertex of a camera subpath.
    pub light_samples: u32,
    /// Into how many a camera subpath splits at its first surface.
    pub splits: u32,
    /// Light subpaths for each sample of a pixel.
    pub light_paths: LightPaths,
    /// Connections of each vertex of a camera subpath, to light vertices that are chosen among those of a tile; `None`
    /// for one with each of its own pixel's.
    pub light_vertices: Option<u32>,
    /// The radius of merges in every pass, in metres; `None` for one that begins with the pixels' size and shrinks. Of
    /// no effect where nothing merges.
    pub merge_radius: Option<f32>,
    /// When Russian roulette may end a subpath.
    pub roulette: Roulette,
    /// Russian roulette on connections.
    pub connection_roulette: Option<RelativeRoulette>,
    /// The deposits of one strategy only, and how they are weighted.
    pub only: Option<(Strategy, Weighting)>,
    /// What weights compare.
    pub weights: Weights,
    /// Where random numbers come from.
    pub sampler: SamplerKind,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The reconstruction filter. The camera's sensor must have its padding.
    pub filter: Filter,
    /// The part of the image to render.
    pub crop: Crop,
    /// The largest magnitude per channel of a single contribution, if they are clamped (which biases the image).
    pub clamp: Option<f32>,
    /// What is behind everything.
    pub background: Background,
}

impl Settings {
    /// bdpt for an image of `sensor`'s size. Else the defaults of the command line, 16 edges and box filter; but with
    /// roulette from depth 4, and independent numbers, of which every pass is a replicate. The integrator's
    /// [`Description`](crate::integrator::Description) has the `roulette` and the `sampler` that give less noise.
    pub fn new(sensor: Sensor) -> Self {
        Self {
            integrator: IntegratorKind::Bdpt,
            hemisphere: Directions::Bsdf,
            max_depth: 16,
            min_depth: 1,
            light_samples: 1,
            splits: 1,
            light_paths: LightPaths::ONE,
            light_vertices: None,
            merge_radius: None,
            roulette: Roulette::default(),
            connection_roulette: None,
            only: None,
            weights: Weights::Plain,
            sampler: SamplerKind::default(),
            seed: 0,
            filter: Filter::Box,
            crop: Crop::full(sensor),
            clamp: None,
            background: Background::Shown,
        }
    }
}

impl Settings {
    /// What a contribution counts as.
    #[inline(always)]
    pub(super) fn clamped(&self, value: Rgb) -> Rgb {
        match self.clamp {
            Some(most) => value.min(Rgb::splat(most)).max(Rgb::splat(-most)),
            None => value,
        }
    }

    /// How many bytes of light subpaths a thread keeps at most: of one pixel, or of a tile whose pixels share their
    /// vertices.
    pub fn light_subpath_memory(&self) -> u64 {
        let pixels = if self.light_vertices.is_some() { PaddedImage::TILE.pow(2) } else { 1 };
        let steps = u64::from(pixels) * u64::from(self.light_paths.most()) * u64::from(self.max_depth);
        steps * size_of::<Step>() as u64
    }
}
