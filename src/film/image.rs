//! Finished images, and what two halves of one say about its noise.

use glam::DVec3;

use crate::math::Rgb;

/// A linear RGB image, row after row from the upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width`·`height` pixels.
    pub pixels: Vec<Rgb>,
}

impl Image {
    /// The pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// Outside the image.
    #[inline]
    pub fn get(&self, x: u32, y: u32) -> Rgb {
        assert!(x < self.width, "column {x} of an image of width {}", self.width);
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// The mean of all pixels; zero for an empty image.
    pub fn mean(&self) -> Rgb {
        let sum: DVec3 = self.pixels.iter().map(|p| p.as_dvec3()).sum();
        Rgb::from(sum / self.pixels.len().max(1) as f64)
    }
}

/// The noise of the mean I = (A + B)/2 of two independent, equally long halves of a render: the mean over pixels and
/// channels of ((A − B)/2)²/(I² + 0.01), an estimate of the image's relative mean squared error.
///
/// Var I = Var A/2 and E (A − B)² = 2 Var A, so that ((A − B)/2)² has the expectation Var I.
///
/// # Panics
/// If the images differ in size.
pub fn half_image_rel_mse(a: &Image, b: &Image) -> f64 {
    assert!((a.width, a.height) == (b.width, b.height), "halves of one image have one size");
    let relative = |(a, b): (&Rgb, &Rgb)| {
        let (a, b) = (a.as_dvec3(), b.as_dvec3());
        let (mean, deviation) = (0.5 * (a + b), 0.5 * (a - b));
        (deviation * deviation / (mean * mean + 0.01)).element_sum()
    };
    let sum: f64 = a.pixels.iter().zip(&b.pixels).map(relative).sum();
    sum / (3 * a.pixels.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_estimate_has_the_variance_of_the_mean() {
        // A and B are sums of two fair bits, of variance 1/2 each: Var I = 1/4, around I = 1001.
        let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
        let mut half = || {
            let pixels = (0..40_000)
                .map(|_| {
                    bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    Rgb::splat(1000.0 + ((bits >> 40) & 1) as f32 + ((bits >> 50) & 1) as f32)
                })
                .collect();
            Image { width: 200, height: 200, pixels }
        };
        let (a, b) = (half(), half());
        let noise = half_image_rel_mse(&a, &b) * 1001.0 * 1001.0;
        assert!((noise - 0.25).abs() < 0.01, "{noise}");
        assert_eq!(half_image_rel_mse(&a, &a), 0.0);
    }
}
