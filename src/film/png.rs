//! PNG: the image as a person sees it.

use std::io;

use ::image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use super::{Image, tone::Look};
use crate::math::{Rgb, luminance};

/// How radiances become brightnesses of a display: times 2^EV.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// The image's mean luminance becomes a middle grey; highlights clip.
    Auto,
    /// 2^EV, stops above the radiances as they are.
    Ev(f32),
}

impl Exposure {
    /// What automatic exposure makes of the log-average luminance: the middle grey of photographers
    /// (Reinhard et al. 2002, *Photographic Tone Reproduction for Digital Images*).
    const MIDDLE_GREY: f64 = 0.18;
    /// The part of the non-black pixels at either end that automatic exposure leaves out: a few fireflies, the
    /// light sources themselves, or a nearly black corner would otherwise decide.
    const TRIMMED: f64 = 0.05;

    /// The exposure value for `image`.
    pub fn ev(self, image: &Image) -> f32 {
        match self {
            Self::Ev(ev) => ev,
            Self::Auto => {
                let mut luminances: Vec<f32> =
                    image.pixels.iter().map(|p| luminance(*p)).filter(|l| l.is_normal() && *l > 0.0).collect();
                luminances.sort_unstable_by(f32::total_cmp);
                let trimmed = (Self::TRIMMED * luminances.len() as f64) as usize;
                let kept = &luminances[trimmed..luminances.len() - trimmed];
                if kept.is_empty() {
                    return 0.0;
                }
                let log_mean = kept.iter().map(|l| f64::from(*l).log2()).sum::<f64>() / kept.len() as f64;
                (Self::MIDDLE_GREY.log2() - log_mean) as f32
            }
        }
    }
}

/// Encodes `image` as an 8-bit sRGB PNG, with an alpha channel where `alpha` has one number per pixel. PNG's colours
/// are not premultiplied, so those of `image` are divided by it; light in a pixel that nothing covers is lost.
///
/// # Errors
/// If the format cannot hold the image.
pub fn encode_png(image: &Image, alpha: Option<&[f32]>, look: impl Into<Look>) -> io::Result<Vec<u8>> {
    let look = look.into();
    let (samples, channels): (Vec<u8>, _) = match alpha {
        None => (srgb_codes(image, look), ExtendedColorType::Rgb8),
        Some(alpha) => {
            let shown = look.of(image);
            let straight = |(p, a): (&Rgb, &f32)| {
                let (p, coverage) = if *a > 0.0 { (*p, *a) } else { (Rgb::ZERO, 1.0) };
                let [r, g, b] = shown(p, coverage).to_array().map(srgb);
                [r, g, b, (255.0 * a).round() as u8]
            };
            (image.pixels.iter().zip(alpha).flat_map(straight).collect(), ExtendedColorType::Rgba8)
        }
    };
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(&samples, image.width, image.height, channels).map_err(io::Error::other)?;
    Ok(bytes)
}

/// The image as 8-bit sRGB, red, green and blue of a pixel after those of another: what a display shows of it.
pub fn srgb_codes(image: &Image, look: impl Into<Look>) -> Vec<u8> {
    let shown = look.into().of(image);
    image.pixels.iter().flat_map(|p| shown(*p, 1.0).to_array().map(srgb)).collect()
}

/// The 8-bit sRGB code of a linear value (IEC 61966-2-1).
fn srgb(linear: f32) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: Vec<Rgb>) -> Image {
        Image { width: pixels.len() as u32, height: 1, pixels }
    }

    #[test]
    fn srgb_codes_are_those_of_the_standard() {
        assert_eq!([0.0, 0.18, 0.5, 1.0, 7.0].map(srgb), [0, 118, 188, 255, 255]);
    }

    #[test]
    fn automatic_exposure_makes_the_usual_pixel_grey() {
        let mut pixels = vec![Rgb::splat(36.0); 1000];
        pixels[..20].fill(Rgb::splat(1e9));
        pixels[20..30].fill(Rgb::splat(1e-9));
        pixels.resize(5000, Rgb::ZERO);
        let ev = Exposure::Auto.ev(&image(pixels));
        assert!((ev - (0.18_f32 / 36.0).log2()).abs() < 1e-4, "{ev}");
        assert_eq!(Exposure::Auto.ev(&image(vec![Rgb::ZERO; 9])), 0.0);
        assert_eq!(Exposure::Auto.ev(&image(vec![])), 0.0);
    }

    #[test]
    fn a_png_holds_the_exposed_codes() {
        let bytes =
            encode_png(&image(vec![Rgb::splat(0.25), Rgb::new(1.0, 0.0, 0.045)]), None, Exposure::Ev(2.0)).unwrap();
        let decoded = ::image::load_from_memory(&bytes).unwrap().into_rgb8();
        assert_eq!(decoded.as_raw(), &[255, 255, 255, 255, 0, 118]);
    }

    #[test]
    fn colours_beside_alpha_are_straight() {
        let pixels = vec![Rgb::splat(0.09), Rgb::new(1.0, 0.18, 0.0), Rgb::splat(0.3)];
        let bytes = encode_png(&image(pixels), Some(&[0.5, 1.0, 0.0]), Exposure::Ev(0.0)).unwrap();
        let decoded = ::image::load_from_memory(&bytes).unwrap().into_rgba8();
        assert_eq!(decoded.as_raw(), &[118, 118, 118, 128, 255, 118, 0, 255, 0, 0, 0, 0]);
    }
}
