//! How noisy the parts of an image are: when a render is good enough.

use super::{Film, Half};
use crate::math::Rgb;

/// The part of the tiles that must be good enough.
pub const ENOUGH_TILES: f64 = 0.95;
/// Side of a tile in pixels: as small as an eye that looks for noise, and large enough for an estimate.
const TILE: u32 = 16;
/// What is much darker than this part of the image's mean is compared with it: noise in the dark is not seen beside the
/// rest.
const DARK: f64 = 0.1;

impl Film {
    /// The relative noise that [`ENOUGH_TILES`] of the image's tiles do not exceed after `passes` passes; `None` where
    /// [`Film::noise`] is. Light that is splatted is in it as any other.
    ///
    /// That of a tile is the root of the mean of ((A − B)/2)²/(I² + (Ī/10)²) over its pixels and channels, A and B
    /// being the half images, I their mean and Ī that of the whole image. ((A − B)/2)² has the expectation of the
    /// variance of I. Each pixel is compared with itself, so that the edge of a lamp does not count for all that is
    /// around it.
    pub fn tile_noise(&self, passes: u32) -> Option<f64> {
        let of_half = (passes.is_multiple_of(2) && passes > 0 && !self.is_black()).then_some(passes / 2)?;
        let [a, b] = [Half::Even, Half::Odd].map(|half| self.half_image(half, of_half));
        let sum = |rgb: Rgb| rgb.as_dvec3().element_sum();
        // Nothing is as dark as what is next to black, in which there is no deviation either.
        let dark = (DARK * (sum(a.mean()) + sum(b.mean())) / 6.0).max(f64::MIN_POSITIVE.sqrt());
        let mut noises = Vec::new();
        for (y0, x0) in tiles(a.height).flat_map(|y0| tiles(a.width).map(move |x0| (y0, x0))) {
            let (mut squares, mut count) = (0.0, 0.0);
            for y in y0..(y0 + TILE).min(a.height) {
                for x in x0..(x0 + TILE).min(a.width) {
                    let (a, b) = (a.get(x, y).as_dvec3(), b.get(x, y).as_dvec3());
                    let (deviation, mean) = (0.5 * (a - b), 0.5 * (a + b));
                    squares += (deviation * deviation / (mean * mean + dark * dark)).element_sum();
                    count += 3.0;
                }
            }
            noises.push(f64::sqrt(squares / count));
        }
        noises.sort_by(f64::total_cmp);
        let last = (ENOUGH_TILES * noises.len() as f64).ceil() as usize;
        noises.get(last.saturating_sub(1)).copied()
    }
}

fn tiles(length: u32) -> impl Iterator<Item = u32> + Clone {
    (0..length).step_by(TILE as usize)
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::{
        film::{Crop, FixedPoint},
        sampling::Filter,
        scene::camera::{Raster, Sensor},
    };

    /// 20 tiles in two rows, of which the first `noisy` get 1 ± 0.2 in their halves and the others 1.
    fn film(noisy: u32) -> Film {
        let sensor = Sensor { width: 160, height: 32, padding: 0 };
        let film = Film::new(sensor, Crop::full(sensor), Filter::Box, FixedPoint::with_exponent(-40));
        for (x, y) in (0..160).flat_map(|x| (0..32).map(move |y| (x, y))) {
            let off = if y / 16 * 10 + x / 16 < noisy { 0.2 } else { 0.0 };
            for (half, value) in [(Half::Even, 1.0 + off), (Half::Odd, 1.0 - off)] {
                film.deposit(Raster(Vec2::new(x as f32, y as f32) + 0.5), Rgb::splat(value), half);
            }
        }
        film
    }

    #[test]
    fn one_tile_in_twenty_may_be_noisy() {
        assert_eq!(film(0).tile_noise(2), Some(0.0));
        assert_eq!(film(1).tile_noise(2), Some(0.0));
        let noise = film(2).tile_noise(2).unwrap();
        // Beside brightness 1, a tenth of the mean is next to nothing.
        assert!((noise - 0.2 / f64::sqrt(1.01)).abs() < 1e-6, "{noise}");
        assert_eq!((film(2).tile_noise(0), film(2).tile_noise(3)), (None, None));
    }

    #[test]
    fn nothing_is_known_of_black_images() {
        let sensor = Sensor { width: 5, height: 5, padding: 0 };
        let film = Film::new(sensor, Crop::full(sensor), Filter::Box, FixedPoint::with_exponent(-40));
        assert_eq!((film.tile_noise(16), film.noise(16), film.is_black()), (None, None, true));
        film.deposit(Raster(Vec2::splat(2.5)), Rgb::new(0.0, 0.0, 1.0), Half::Odd);
        assert!(film.noise(16).is_some_and(|noise| noise > 0.0) && !film.is_black());
    }
}
