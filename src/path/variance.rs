//! Weights that know their noise: v, by which a technique's n samples are less noisy than n that know nothing of each
//! other (Grittmann et al. 2019, *Variance-Aware Multiple Importance Sampling*).

use super::Strategy;
use crate::lanes::{Float, Lanes};

/// v of the strategies for direct light that walk from the camera, (0,3) and (1,2), by the place on the image: evenly
/// distributed numbers make next-event estimates of a lamp nearly free of noise where it is seen whole, and do little
/// for them in a penumbra or on a mirror.
///
/// It takes the place of nothing in an estimate, and is in the weights alone: (v n p)^β in place of (n p)^β. Whatever
/// it is, the weights of a path sum to 1, since all techniques that could find it look it up at the same place.
#[derive(Clone, Debug, PartialEq)]
pub struct VarianceFactors {
    columns: u32,
    /// Row by row, of (0,3) and of (1,2).
    tiles: Vec<[f32; 2]>,
}

impl VarianceFactors {
    /// The side of a tile, in pixels.
    pub const SIDE: u32 = 32;
    /// The most that one is: what looks free of noise may be so by chance.
    pub const MOST: f32 = 64.0;

    /// Of an image with so many columns of tiles, row by row.
    ///
    /// # Panics
    /// If the last row is not full, or there is none, or a factor is not positive.
    pub fn new(columns: u32, tiles: Vec<[f32; 2]>) -> Self {
        assert!(!tiles.is_empty() && tiles.len().is_multiple_of(columns as usize), "rows of tiles");
        assert!(tiles.iter().flatten().all(|v| (1.0..=Self::MOST).contains(v)), "a factor is 1 or more");
        Self { columns, tiles }
    }

    /// v of a path of two edges that `strategy` finds, at a place on the image; 1 of all others.
    #[inline(always)]
    pub fn of<L: Lanes>(&self, lanes: L, strategy: Strategy, [x, y]: [L::F; 2]) -> L::F {
        let Strategy { s, t } = strategy;
        if s + t != 3 || s > 1 {
            return lanes.splat(1.0);
        }
        let (x, y) = (x.all(), y.all());
        let mut of = [1.0; crate::lanes::MOST];
        for (k, v) in of.iter_mut().enumerate().take(L::N) {
            *v = self.at(x[k], y[k])[s as usize];
        }
        lanes.load(&of)
    }

    /// Of both; the padding has the factors of what it is nearest to.
    #[inline]
    fn at(&self, x: f32, y: f32) -> [f32; 2] {
        let rows = self.tiles.len() as u32 / self.columns;
        let tile = |x: f32, count: u32| ((x.max(0.0) * (1.0 / Self::SIDE as f32)) as u32).min(count - 1);
        self.tiles[(tile(y, rows) * self.columns + tile(x, self.columns)) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::One;

    #[test]
    fn factors_are_those_of_direct_light_at_the_place() {
        let factors = VarianceFactors::new(2, vec![[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]]);
        let (hit, next_event) = (Strategy { s: 0, t: 3 }, Strategy { s: 1, t: 2 });
        for (place, expected) in [
            ([0.0, 0.0], [1.0, 2.0]),
            ([31.9, 31.9], [1.0, 2.0]),
            ([32.0, 0.0], [3.0, 4.0]),
            ([-2.0, 70.0], [5.0, 6.0]),
            ([1e9, 1e9], [7.0, 8.0]),
        ] {
            assert_eq!([hit, next_event].map(|x| factors.of(One, x, place)), expected, "{place:?}");
        }
        for (s, t) in [(2, 1), (1, 1), (0, 2), (0, 4), (1, 3), (2, 2)] {
            assert_eq!(factors.of(One, Strategy { s, t }, [40.0, 40.0]), 1.0);
        }
    }
}
