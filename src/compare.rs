//! How far one image is from another: the errors that papers on rendering report.

mod bias;

pub use self::bias::{Measured, p_of_no_bias};
use crate::{
    film::Image,
    math::{Rgb, luminance},
};

/// A measure of error, a mean over pixels and channels; 0 for equal images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// (I − R)²: of the radiances' unit, squared.
    Mse,
    /// (I − R)²/(R² + 0.01): an error counts by how much it is of what is there (Rousselle et al. 2011).
    RelMse,
    /// The same without the worst 0.1 % of pixels, on which a few fireflies would decide. It hides caustics that are
    /// missing.
    RelMseTrimmed,
    /// |I − R|/(R + 0.01): the mean absolute percentage error.
    Mape,
    /// How different the two look on a display, alternated at 67 pixels a degree (Andersson et al. 2020, *FLIP: A
    /// Difference Evaluator for Alternating Images*): from 0 to 1. Both at the reference's automatic exposure, as 8-bit
    /// sRGB. With the feature `flip`.
    #[cfg(feature = "flip")]
    Flip,
}

impl Metric {
    /// All of them, in the order of the documentation.
    pub const ALL: [Self; if cfg!(feature = "flip") { 5 } else { 4 }] = [
        Self::Mse,
        Self::RelMse,
        Self::RelMseTrimmed,
        Self::Mape,
        #[cfg(feature = "flip")]
        Self::Flip,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mse => "mse",
            Self::RelMse => "relmse",
            Self::RelMseTrimmed => "relmse-trimmed",
            Self::Mape => "mape",
            #[cfg(feature = "flip")]
            Self::Flip => "flip",
        }
    }

    /// The error of `image` against `reference`.
    ///
    /// # Panics
    /// If the images differ in size, or have no pixels.
    pub fn between(self, image: &Image, reference: &Image) -> f64 {
        assert!((image.width, image.height) == (reference.width, reference.height), "images of one size");
        assert!(!image.pixels.is_empty(), "an image has pixels");
        let error: fn(f64, f64) -> f64 = match self {
            Self::Mse => |i, r| (i - r).powi(2),
            Self::RelMse | Self::RelMseTrimmed => |i, r| (i - r).powi(2) / (r * r + EPSILON),
            Self::Mape => |i, r| (i - r).abs() / (r.abs() + EPSILON),
            #[cfg(feature = "flip")]
            Self::Flip => return flip(image, reference),
        };
        let of_pixel = |(i, r): (&Rgb, &Rgb)| {
            let of_channel = |(i, r): (f32, f32)| error(f64::from(i), f64::from(r));
            i.to_array().into_iter().zip(r.to_array()).map(of_channel).sum::<f64>() / 3.0
        };
        let mut errors: Vec<f64> = image.pixels.iter().zip(&reference.pixels).map(of_pixel).collect();
        if self == Self::RelMseTrimmed {
            errors.sort_by(f64::total_cmp);
            errors.truncate(errors.len() - errors.len() / TRIMMED);
        }
        errors.iter().sum::<f64>() / errors.len() as f64
    }
}

/// [`Metric::Flip`].
#[cfg(feature = "flip")]
fn flip(image: &Image, reference: &Image) -> f64 {
    use crate::film::{Exposure, srgb_codes};

    let exposure = Exposure::Ev(Exposure::Auto.ev(reference));
    let [image, reference] = [image, reference]
        .map(|image| nv_flip::FlipImageRgb8::with_data(image.width, image.height, &srgb_codes(image, exposure)));
    let map = nv_flip::flip(reference, image, nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec();
    map.iter().copied().map(f64::from).sum::<f64>() / map.len() as f64
}

/// What keeps dark pixels from deciding alone.
const EPSILON: f64 = 0.01;
/// One pixel in so many is trimmed.
const TRIMMED: usize = 1000;

/// By how much `image` is brighter than `reference` in the mean of its luminance, as a part of that; 0 if both are
/// black, infinite if only the reference is.
pub fn brightness_difference(image: &Image, reference: &Image) -> f64 {
    let [i, r] = [image, reference].map(|image| f64::from(luminance(image.mean())));
    if i == r { 0.0 } else { i / r - 1.0 }
}

/// I − R, pixel by pixel.
///
/// # Panics
/// If the images differ in size.
pub fn difference(image: &Image, reference: &Image) -> Image {
    assert!((image.width, image.height) == (reference.width, reference.height), "images of one size");
    let pixels = image.pixels.iter().zip(&reference.pixels).map(|(i, r)| *i - *r).collect();
    Image { pixels, ..*image }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: &[[f32; 3]]) -> Image {
        Image { width: pixels.len() as u32, height: 1, pixels: pixels.iter().map(|p| Rgb::from_array(*p)).collect() }
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-6 * b.abs(), "{a}, not {b}");
    }

    #[test]
    fn errors_are_those_worked_out_by_hand() {
        let (a, r) = (image(&[[1.0, 2.0, 0.0], [0.5, 0.5, 0.5]]), image(&[[1.0, 1.0, 1.0], [0.0, 0.5, 1.0]]));
        // Squares 0, 1, 1, 0.25, 0, 0.25; over R² + 0.01 = 1.01, and 0.01 for the black channel.
        close(Metric::Mse.between(&a, &r), 2.5 / 6.0);
        close(Metric::RelMse.between(&a, &r), (2.0 / 1.01 + 0.25 / 0.01 + 0.25 / 1.01) / 6.0);
        close(Metric::Mape.between(&a, &r), (2.0 / 1.01 + 0.5 / 0.01 + 0.5 / 1.01) / 6.0);
        assert!(Metric::ALL.iter().all(|metric| metric.between(&r, &r) == 0.0));
        assert_eq!(difference(&a, &r), image(&[[0.0, 1.0, -1.0], [0.5, 0.0, -0.5]]));
    }

    /// The pattern that the reference implementation was asked about.
    fn pattern(change: impl Fn(u32, u32) -> f32) -> Image {
        let (width, height) = (64, 48);
        let pixel = |i: u32| {
            let (x, y) = (i % width, i / width);
            let base = Rgb::new(x as f32 / 63.0, y as f32 / 47.0, 0.25 + 0.5 * ((x / 8 + y / 8) % 2) as f32);
            base * change(x, y)
        };
        Image { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    /// By `flip-evaluator` 1.x of PyPI: the mean of its map, on these images as 8-bit sRGB at the same exposure.
    const FLIP_SPECKLED: f64 = 0.082_036;
    const FLIP_DARKER: f64 = 0.244_627;

    #[test]
    fn flip_is_that_of_the_reference_implementation() {
        let reference = pattern(|_, _| 1.0);
        assert_eq!(Metric::Flip.between(&reference, &reference), 0.0);
        let speckled = pattern(|x, y| if (x * 7 + y * 13) % 11 == 0 { 0.5 } else { 1.0 });
        let darker = pattern(|_, _| 0.8);
        for (image, expected) in [(speckled, FLIP_SPECKLED), (darker, FLIP_DARKER)] {
            let found = Metric::Flip.between(&image, &reference);
            assert!((found - expected).abs() < 2e-3 * expected, "{found}, not {expected}");
        }
    }

    #[test]
    fn trimming_leaves_out_one_pixel_in_a_thousand() {
        let reference = image(&vec![[1.0; 3]; 2999]);
        let mut spoilt = image(&vec![[1.1; 3]; 2999]);
        spoilt.pixels[7] = Rgb::splat(1e3);
        spoilt.pixels[2000] = Rgb::splat(-1e3);
        close(Metric::RelMseTrimmed.between(&spoilt, &reference), f64::from(1.1_f32 - 1.0).powi(2) / 1.01);
        spoilt.pixels[2001] = Rgb::splat(1e3);
        assert!(Metric::RelMseTrimmed.between(&spoilt, &reference) > 100.0, "two of 2999, and not three");
        assert!(Metric::RelMse.between(&spoilt, &reference) > 900.0);
    }

    #[test]
    fn brightness_is_of_the_whole_image() {
        let (a, r) = (image(&[[3.0; 3], [0.0; 3]]), image(&[[1.0; 3], [1.0; 3]]));
        close(brightness_difference(&a, &r), 0.5);
        let black = image(&[[0.0; 3]; 2]);
        assert_eq!(brightness_difference(&black, &black), 0.0);
        assert_eq!(brightness_difference(&a, &black), f64::INFINITY);
    }
}
