//! Whether two images differ by more than their noise.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::{film::Image, math::luminance, statistics::any_of};

/// An image with what is known of its noise.
#[derive(Clone, Copy, Debug)]
pub struct Measured<'a> {
    /// The image.
    pub image: &'a Image,
    /// Two independent images whose mean it is; `None` if it counts as exact.
    pub halves: Option<&'a [Image; 2]>,
}

/// The side of a cell, in pixels: many enough of them make the sums of a region normal.
const CELL: u32 = 4;
/// Regions along each side of the image.
const REGIONS: u32 = 4;

/// The probability of regions' mean luminances that differ as much as these, or more, if both images have the same
/// expectation: by Student's t over each of 4 × 4 regions, and Bonferroni's bound over all. The variance of a cell of 4
/// × 4 pixels is that of its halves, ((even − odd)/2)². `None` if both images count as exact, or are smaller than 16
/// pixels along a side.
///
/// The two have to be independent: renders with one seed share their noise, and seem more alike than they are. Noise of
/// which few samples know (fireflies, caustics by chance) makes variances too small and the answer too sure.
///
/// # Panics
/// If the images or halves differ in size.
pub fn p_of_no_bias(a: Measured<'_>, b: Measured<'_>) -> Option<f64> {
    let (width, height) = (a.image.width, a.image.height);
    let all = [a, b].into_iter().flat_map(|m| m.halves.into_iter().flatten().chain([m.image]));
    assert!(all.into_iter().all(|image| (image.width, image.height) == (width, height)), "images of one size");
    if (a.halves.is_none() && b.halves.is_none()) || width.min(height) < CELL * REGIONS {
        return None;
    }
    let mut regions = [Moments::default(); (REGIONS * REGIONS) as usize];
    for cell_y in 0..height / CELL {
        for cell_x in 0..width / CELL {
            let of = |image: &Image| cell_mean(image, cell_x * CELL, cell_y * CELL);
            let variance = |m: Measured<'_>| m.halves.map_or(0.0, |[even, odd]| (0.5 * (of(even) - of(odd))).powi(2));
            let region = |cell: u32, cells: u32| cell * REGIONS / cells;
            let number = region(cell_y, height / CELL) * REGIONS + region(cell_x, width / CELL);
            regions[number as usize].add(of(a.image) - of(b.image), variance(a) + variance(b));
        }
    }
    let smallest = regions.iter().map(Moments::p).fold(1.0, f64::min);
    Some(any_of(smallest, f64::from(REGIONS * REGIONS)))
}

/// Over the cells of a region.
#[derive(Clone, Copy, Default)]
struct Moments {
    difference: f64,
    variance: f64,
    variance_squared: f64,
}

impl Moments {
    fn add(&mut self, difference: f64, variance: f64) {
        self.difference += difference;
        self.variance += variance;
        self.variance_squared += variance * variance;
    }

    fn p(&self) -> f64 {
        if self.variance == 0.0 {
            return if self.difference == 0.0 { 1.0 } else { 0.0 };
        }
        // Satterthwaite's degrees of freedom; the square of a variance with one degree is three times too large.
        let freedom = 3.0 * self.variance.powi(2) / self.variance_squared;
        let t = self.difference.abs() / self.variance.sqrt();
        StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(1.0, |student| 2.0 * student.sf(t))
    }
}

fn cell_mean(image: &Image, x: u32, y: u32) -> f64 {
    let rows = (y..y + CELL).map(|y| (y * image.width + x) as usize);
    let pixels = rows.flat_map(|start| &image.pixels[start..start + CELL as usize]);
    pixels.map(|p| f64::from(luminance(*p))).sum::<f64>() / f64::from(CELL * CELL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::Rgb,
        sampling::{Independent, Sampler, Stream},
    };

    /// An image of noise around `level`, as a mean of two halves of which each is a mean of four numbers.
    fn noisy(seed: u64, level: f32) -> (Image, [Image; 2]) {
        let half = |half: u32| {
            let pixel = |i| {
                let mut numbers = Independent::new(seed, i, half, Stream::Camera);
                Rgb::splat(level * (0..4).map(|_| 0.5 * numbers.next_1d()).sum::<f32>())
            };
            Image { width: 64, height: 48, pixels: (0..64 * 48).map(pixel).collect() }
        };
        let halves = [half(0), half(1)];
        let pixels = halves[0].pixels.iter().zip(&halves[1].pixels).map(|(a, b)| 0.5 * (*a + *b)).collect();
        (Image { pixels, ..halves[0] }, halves)
    }

    fn p(a: &(Image, [Image; 2]), b: &(Image, [Image; 2])) -> f64 {
        let [a, b] = [a, b].map(|(image, halves)| Measured { image, halves: Some(halves) });
        p_of_no_bias(a, b).expect("they have halves")
    }

    #[test]
    fn noise_is_no_bias_and_a_tenth_is_seen() {
        // Of 200 pairs of one expectation, few may look different: 5 % have p < 0.05 at most, by Bonferroni's bound.
        let pairs: Vec<_> = (0..200).map(|i| p(&noisy(2 * i, 1.0), &noisy(2 * i + 1, 1.0))).collect();
        let below = |bound: f64| pairs.iter().filter(|p| **p < bound).count();
        assert!(below(0.05) <= 20 && below(0.5) >= 40, "{} and {}", below(0.05), below(0.5));
        // A region has 192 pixels of 8 numbers with a relative deviation of 0.58: 1.5 % of noise, of a difference 2.1
        // %.
        let biased: Vec<_> = (0..20).map(|i| p(&noisy(2 * i, 1.0), &noisy(2 * i + 1, 1.1))).collect();
        assert!(biased.iter().all(|p| *p < 1e-3), "{biased:?}");
    }

    #[test]
    fn a_bias_of_one_corner_is_seen() {
        let (a, mut b) = (noisy(1, 1.0), noisy(2, 1.0));
        assert!(p(&a, &b) > 0.01);
        let [even, odd] = &mut b.1;
        for image in [&mut b.0, even, odd] {
            for y in 0..12 {
                image.pixels[64 * y..64 * y + 16].iter_mut().for_each(|p| *p *= 1.15);
            }
        }
        assert!(p(&a, &b) < 1e-3);
    }

    #[test]
    fn exact_images_have_no_noise_to_compare_with() {
        let (image, halves) = noisy(1, 1.0);
        let exact = Measured { image: &image, halves: None };
        assert_eq!(p_of_no_bias(exact, exact), None);
        let level = Image { pixels: vec![Rgb::ONE; image.pixels.len()], ..image };
        let of_level = Measured { image: &level, halves: None };
        assert!(p_of_no_bias(Measured { image: &image, halves: Some(&halves) }, of_level).unwrap() > 0.01);
    }
}
