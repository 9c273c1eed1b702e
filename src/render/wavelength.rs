//! Which samples of a pass share a wavelength.

use super::{Renderer, padded::Pixel};
use crate::{
    sampling::{Block, Sampler, Sobol, Stream},
    scene::{Scene, wavelength::Wavelength},
};

/// The key of no pixel: what all of an image share. (Those of pixels lie within 16 of the image, which is smaller.)
const OF_ALL: u32 = u32::MAX;

/// The wavelength of a sample of the pixel with this key; `None` where the scene does not disperse.
///
/// A pixel's samples take them evenly from p, whatever the sampler is: where a whole pass has one, its colour would
/// show for long if they were independent.
pub(super) fn drawn(scene: &Scene, seed: u64, pixel: u32, sample: u32) -> Option<Wavelength> {
    scene.disperses().then(|| {
        let mut numbers = Sobol::new(seed, pixel, sample, Stream::Connection);
        numbers.start(Block::WAVELENGTH);
        Wavelength::sample(numbers.next_1d())
    })
}

impl Renderer<'_> {
    /// The wavelength that all samples of a tile have in the present pass, where subpaths of one are joined with those
    /// of another: with merges it is that of the whole pass, with shared light vertices the tile's own.
    pub(super) fn wavelength_of_tile(&self, tile: u32) -> Option<Wavelength> {
        let key = if self.integrator.merges() {
            OF_ALL
        } else if self.integrator.shares_light_vertices() {
            let [x, y] = self.image().corner(tile);
            Pixel { x, y }.key()
        } else {
            return None;
        };
        self.drawn(key)
    }

    /// The wavelength of a pixel's sample in the present pass, where it shares it with no other.
    pub(super) fn wavelength_of_sample(&self, pixel: Pixel) -> Option<Wavelength> {
        self.drawn(pixel.key())
    }

    fn drawn(&self, key: u32) -> Option<Wavelength> {
        drawn(self.scene, self.settings.seed, key, self.passes.end)
    }
}
