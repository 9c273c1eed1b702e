//! Where random numbers come from: pure functions of (seed, pixel, sample, stream, dimension).

use glam::{Vec2, Vec3};
use rand_philox::philox4x32_10;

/// Numbers in [0, 1) for one sample of one pixel, taken dimension after dimension.
pub trait Sampler {
    /// The next dimension.
    fn next_1d(&mut self) -> f32;

    /// The next two dimensions.
    #[inline]
    fn next_2d(&mut self) -> Vec2 {
        let x = self.next_1d();
        Vec2::new(x, self.next_1d())
    }

    /// The next three dimensions.
    #[inline]
    fn next_3d(&mut self) -> Vec3 {
        self.next_2d().extend(self.next_1d())
    }
}

/// What a sequence of random numbers is used for. Each use has its own sequence, so that a longer camera subpath
/// does not shift the numbers of the light subpath.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// The camera subpath: raster position, lens, scattering.
    Camera,
    /// The light subpath: light, position, direction, scattering.
    Light,
    /// The connections: next-event samples and their like.
    Connection,
    /// The points of the lens to which light subpaths are connected.
    Lens,
}

/// Independent uniform numbers from the counter-based generator Philox4x32-10
/// (Salmon et al. 2011, *Parallel Random Numbers: As Easy as 1, 2, 3*).
#[derive(Clone, Debug)]
pub struct Independent {
    key: [u32; 2],
    counter: [u32; 4],
    block: [u32; 4],
    used: usize,
}

impl Independent {
    /// The sequence of one sample of one pixel. `pixel` is any number that names the pixel of the full image.
    #[inline]
    pub fn new(seed: u64, pixel: u32, sample: u32, stream: Stream) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            counter: [0, stream as u32, pixel, sample],
            block: [0; 4],
            used: 4,
        }
    }
}

impl Sampler for Independent {
    #[inline]
    fn next_1d(&mut self) -> f32 {
        if self.used == 4 {
            self.block = philox4x32_10(self.counter, self.key);
            self.counter[0] += 1;
            self.used = 0;
        }
        let bits = self.block[self.used];
        self.used += 1;
        // 24 bits fill an f32 exactly and can never round up to 1.
        (bits >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_a_pure_function_of_its_place() {
        let take = |pixel, sample, stream| {
            let mut s = Independent::new(7, pixel, sample, stream);
            (0..9).map(|_| s.next_1d()).collect::<Vec<_>>()
        };
        let base = take(3, 5, Stream::Camera);
        assert_eq!(base, take(3, 5, Stream::Camera));
        assert_ne!(base, take(4, 5, Stream::Camera));
        assert_ne!(base, take(3, 6, Stream::Camera));
        assert_ne!(base, take(3, 5, Stream::Light));
        assert!(base.iter().all(|x| (0.0..1.0).contains(x)));
    }
}
