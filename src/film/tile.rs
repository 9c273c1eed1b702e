//! Sums of one task: what it adds again and again to its own pixels, before all of it goes to the film at once.

use super::{Film, Half, plane::Plane};
use crate::{math::Rgb, sampling::Filter, scene::camera::Raster};

/// Words of a square of pixels that one thread adds to alone: no other thread waits for them, nor they for memory.
#[derive(Clone, Debug, Default)]
pub struct TileSums {
    /// The upper left pixel, and the side of the square.
    corner: [i64; 2],
    side: i64,
    words: Vec<[i64; 3]>,
}

impl TileSums {
    /// Empty sums for a square of pixels of the image.
    pub fn start(&mut self, corner: [i32; 2], side: u32) {
        (self.corner, self.side) = (corner.map(i64::from), side.into());
        // Those of the tile before have been flushed.
        self.words.resize((side * side) as usize, [0; 3]);
    }

    /// Adds to these sums what [`Film::deposit`] would add to a word of theirs; all else goes to the film.
    #[inline(always)]
    pub fn deposit(&mut self, film: &Film, raster: Raster, value: Rgb, half: Half) {
        let (x, y) = (raster.0.x.floor() as i64 - self.corner[0], raster.0.y.floor() as i64 - self.corner[1]);
        let within = (0..self.side).contains(&x) && (0..self.side).contains(&y);
        let plane = &film.halves[half as usize];
        if film.filter == Filter::Box && within && value.is_finite() {
            let [r, g, b] = value.to_array();
            let word = &mut self.words[(y * self.side + x) as usize];
            if let (Some(r), Some(g), Some(b)) = (quanta(plane, r), quanta(plane, g), quanta(plane, b))
                && let (Some(r), Some(g), Some(b)) =
                    (word[0].checked_add(r), word[1].checked_add(g), word[2].checked_add(b))
            {
                *word = [r, g, b];
                return;
            }
        }
        film.deposit(raster, value, half);
    }

    /// Adds all of it to the film. The sums are the same as if each deposit had gone there.
    pub fn flush(&mut self, film: &Film, half: Half) {
        for (i, words) in (0..).zip(&mut self.words) {
            let words = std::mem::take(words);
            let (x, y) = (self.corner[0] + i % self.side, self.corner[1] + i / self.side);
            if words != [0; 3]
                && let Some(pixel) = film.crop.index(x, y)
            {
                let overflows = film.halves[half as usize].add_quanta(pixel, words);
                if overflows > 0 {
                    film.count(super::Fault::Overflow, overflows);
                }
            }
        }
    }
}

/// A black channel adds nothing.
#[inline(always)]
fn quanta(plane: &Plane, x: f32) -> Option<i64> {
    if x == 0.0 { Some(0) } else { plane.quanta(x) }
}
