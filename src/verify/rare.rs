//! Finds that are too rare for a variance to be estimated from them.
//!
//! An integrator that meets a bright, unlikely path once in a thousand passes (path tracing and the caustic of a small
//! lamp) shows a small variance and too dark a mean, until it meets one. Its own replicates cannot tell, and Welch's
//! test would call it biased. But another integrator that covers the same paths meets them often, and for each of them
//! the tables say what the first one *would* deposit on finding it, and so how often it does
//! ([`relative_deposit`](crate::path::relative_deposit)). So the error from all finds of a size that the first one is
//! expected to make fewer than [`FEW`] times is predicted, and added to what its replicates show. Where that matters
//! the comparison becomes blind and says so, which is the truth.

use super::Class;
use crate::statistics::TILES;

/// Expected finds below which a sum is no normal variable in the tails that significance looks at: a Poisson number
/// with this mean falls by 4.6 of its own estimated standard deviations with a probability of 1e-4, and two runs have
/// to.
const FEW: f64 = 100.0;
/// Sizes are told apart by factors of 4, from 2⁻⁴⁰ to 2⁴⁰ times the radiance of the brightest light.
const BINS: usize = 40;
const CELLS: usize = TILES * TILES * BINS;

/// For each class and integrator: how much light comes, tile by tile, in deposits of which size of that integrator.
#[derive(Clone, Debug)]
pub(super) struct Sizes {
    integrators: usize,
    /// Light per class and integrator, at `tile·BINS + bin`; empty until there is some.
    mass: Vec<Vec<f64>>,
}

impl Sizes {
    pub(super) fn new(integrators: usize) -> Self {
        Self { integrators, mass: vec![Vec::new(); Class::ALL.len() * integrators] }
    }

    /// A path that carries `mass`, and that `integrator` would find by deposits of `size`, in units of the brightest
    /// light's radiance.
    pub(super) fn count(&mut self, class: Class, integrator: usize, tile: usize, size: f64, mass: f64) {
        let bin = ((size.log2() + BINS as f64) / 2.0).clamp(0.0, (BINS - 1) as f64) as usize;
        let light = &mut self.mass[class as usize * self.integrators + integrator];
        light.resize(CELLS, 0.0);
        light[tile * BINS + bin] += mass;
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (sum, part) in self.mass.iter_mut().zip(&other.mass).filter(|(_, part)| !part.is_empty()) {
            sum.resize(CELLS, 0.0);
            sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
        }
    }

    /// The squared error of the mean sum of `passes` passes, in each tile and in the image, from the finds that
    /// `integrator` makes fewer than [`FEW`] times in them. `watched` is how many passes were counted here, `unit` the
    /// brightest light's radiance.
    pub(super) fn rare(&self, class: Class, integrator: usize, passes: f64, watched: f64, unit: f64) -> Rare {
        let light = &self.mass[class as usize * self.integrators + integrator];
        if light.is_empty() {
            return Rare::default();
        }
        let mut image = [0.0; BINS];
        light.chunks(BINS).for_each(|tile| image.iter_mut().zip(tile).for_each(|(sum, light)| *sum += light));
        let error2 = |light: &[f64]| rare_error2(light, passes, watched, unit);
        let mut tiles = [0.0; TILES * TILES];
        tiles.iter_mut().zip(light.chunks(BINS)).for_each(|(error, light)| *error = error2(light));
        Rare { tiles, image: error2(&image) }
    }
}

/// See [`Sizes::rare`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rare {
    pub(super) tiles: [f64; TILES * TILES],
    pub(super) image: f64,
}

/// Of light that `watched` passes saw, size by size. What is expected λ ≥ 1 times and carries the light m has the
/// squared error m²/λ, of a Poisson number; what is expected less than once will most likely be missing, all of it
/// together.
fn rare_error2(light: &[f64], passes: f64, watched: f64, unit: f64) -> f64 {
    let (mut finds, mut error2, mut missing) = (0.0, 0.0, 0.0);
    for bin in (0..BINS).rev() {
        let light = light[bin] / watched;
        let size = (2.0 * bin as f64 + 1.0 - BINS as f64).exp2() * unit;
        let expected = passes * light / size;
        finds += expected;
        if finds >= FEW {
            break;
        }
        if finds < 1.0 {
            missing += light;
        } else {
            error2 += light * light / expected.max(1.0);
        }
    }
    error2 + missing * missing
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One find in 10⁴ passes of size 1, beside a steady light of small deposits.
    #[test]
    fn only_what_is_hardly_ever_found_is_rare() {
        let mut sizes = Sizes::new(2);
        for _ in 0..1000 {
            sizes.count(Class::Caustics, 1, 5, 1.0, 1e-4);
            sizes.count(Class::Caustics, 1, 5, 1e-3, 1.0);
        }
        let rare = |passes| sizes.rare(Class::Caustics, 1, passes, 1000.0, 1.0);
        // Bins are a factor of 4 wide: the size is known within a factor of 2.
        let often = rare(1e5).tiles[5];
        assert!((0.49e-9..=2.01e-9).contains(&often), "10 finds, a third of 1e-4: {often}");
        assert!((rare(1000.0).tiles[5] / 1e-8 - 1.0).abs() < 1e-9, "a tenth of a find: all of it will be missing");
        assert_eq!(rare(1e7), Rare::default(), "found a thousand times");
        assert_eq!(rare(1000.0).image, rare(1000.0).tiles[5]);
        assert_eq!(rare(1000.0).tiles[4], 0.0);
        assert_eq!(sizes.rare(Class::Caustics, 0, 1.0, 1.0, 1.0), Rare::default());
        assert_eq!(sizes.rare(Class::Indirect, 1, 1000.0, 1000.0, 1.0), Rare::default());
    }
}
