//! Reading Radiance pictures (`.hdr`, `.pic`): the header here, the pixels by the image crate.
//!
//! The header's lines say what was done to the pixels ("Radiance File Formats", G. Ward; color.h of Radiance). In the
//! order in which they are undone here: GAMMA, a power that other programs than Radiance write; COLORCORR, factors of
//! the channels; PRIMARIES, or a FORMAT of CIE XYZ. EXPOSURE is said and not undone, as in all programs that show such
//! files.

use std::io::{Cursor, Read};

use image::{ImageDecoder, codecs::hdr::HdrDecoder};

use super::{
    error::quoted,
    openexr::{Picture, Refusal, check_size},
    primaries::{Colors, Primaries},
};
use crate::math::Rgb;

/// Reads a picture of at most `limit` pixels, as linear Rec. 709.
pub(super) fn radiance(bytes: &[u8], limit: u64, warnings: &mut Vec<String>) -> Result<Picture, Refusal> {
    let damaged =
        |error: image::ImageError| Refusal::Damaged(format!("its Radiance picture cannot be decoded ({error})"));
    let (header, rest) = Header::read(bytes, warnings)?;
    // The decoder gets no header but the empty line after it: it knows one format, and would skip what it cannot read.
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(b"\n").chain(rest)).map_err(damaged)?;
    let meta = decoder.metadata();
    let (width, height) = check_size(meta.width as usize, meta.height as usize, limit)?;
    if header.exposure != 1.0 {
        warnings.push(format!(
            "the environment map states an exposure of {}, which is not undone (--env-scale {} would)",
            header.exposure,
            header.exposure.recip()
        ));
    }
    let mut raw = vec![0; width * height * size_of::<[f32; 3]>()];
    decoder.read_image(&mut raw).map_err(damaged)?;
    let channel = |bytes: &[u8]| f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let mut texels: Vec<_> =
        raw.chunks_exact(12).map(|t| Rgb::new(channel(t), channel(&t[4..]), channel(&t[8..]))).collect();
    if header.gamma != 1.0 {
        texels.iter_mut().for_each(|texel| *texel = texel.map(|c| c.powf(header.gamma)));
    }
    if header.correction != Rgb::ONE {
        texels.iter_mut().for_each(|texel| *texel /= header.correction);
    }
    header.colors.convert(&mut texels);
    Ok(Picture { width, texels, colors: header.colors })
}

/// What the lines before the pixels say of them.
struct Header {
    /// The pixels were raised to the power of 1 over this.
    gamma: f32,
    /// Before that, their channels were multiplied by this.
    correction: Rgb,
    /// And by this.
    exposure: f32,
    colors: Colors,
}

impl Header {
    /// The header, and what follows it: the line of the size, and the pixels.
    fn read<'a>(bytes: &'a [u8], warnings: &mut Vec<String>) -> Result<(Self, &'a [u8]), Refusal> {
        let mut header = Self { gamma: 1.0, correction: Rgb::ONE, exposure: 1.0, colors: Colors::Rec709 };
        let (mut xyz, mut primaries) = (false, None);
        let mut rest = bytes;
        loop {
            let Some(end) = rest.iter().position(|byte| *byte == b'\n') else {
                let what = "its Radiance picture cannot be decoded (its header has no end)";
                return Err(Refusal::Damaged(what.to_owned()));
            };
            let line = String::from_utf8_lossy(&rest[..end]);
            let line = line.trim();
            rest = &rest[end + 1..];
            if line.is_empty() {
                break;
            }
            // Others are comments, and the commands that made the picture.
            let Some((name, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) else { continue };
            let unusable =
                |why: &str| Refusal::Damaged(format!("its header line {} cannot be used: {why}", quoted(line)));
            let factors = "factors are positive numbers";
            match name.trim() {
                "FORMAT" => match value.trim() {
                    "32-bit_rle_rgbe" => xyz = false,
                    "32-bit_rle_xyze" => xyz = true,
                    _ => return Err(unusable("pixels are 32-bit_rle_rgbe or 32-bit_rle_xyze")),
                },
                // Each of these two says what was done to the pixels since the line before.
                "EXPOSURE" => {
                    let [exposure] = positive(value).ok_or_else(|| unusable(factors))?;
                    header.exposure *= exposure;
                }
                "COLORCORR" => {
                    let correction = positive(value).ok_or_else(|| unusable("it has three positive numbers"))?;
                    header.correction *= Rgb::from_array(correction);
                }
                "GAMMA" => [header.gamma] = positive(value).ok_or_else(|| unusable(factors))?,
                "PRIMARIES" => {
                    let stated = numbers(value).ok_or_else(|| unusable("it has eight numbers"))?;
                    // Photoshop writes zeros for what it does not know.
                    if stated == [0.0; 8] {
                        continue;
                    }
                    let colors = Primaries::of(stated.map(f64::from)).to_rec_709();
                    primaries = Some(colors.map_err(unusable)?);
                }
                _ => {}
            }
        }
        header.colors = match (xyz, primaries) {
            (false, stated) => stated.unwrap_or(Colors::Rec709),
            (true, stated) => {
                if stated.is_some() {
                    warnings
                        .push("the environment map is in CIE XYZ: the PRIMARIES it states are not its own".to_owned());
                }
                Primaries::XYZ.to_rec_709().map_err(|why| Refusal::Damaged(why.to_owned()))?
            }
        };
        Ok((header, rest))
    }
}

/// Exactly so many finite numbers, with spaces between them.
fn numbers<const N: usize>(text: &str) -> Option<[f32; N]> {
    let numbers: Option<Vec<f32>> = text.split_whitespace().map(|number| number.parse().ok()).collect();
    numbers?.try_into().ok().filter(|numbers: &[f32; N]| numbers.iter().all(|x| x.is_finite()))
}

/// The same, of numbers above 0.
fn positive<const N: usize>(text: &str) -> Option<[f32; N]> {
    numbers(text).filter(|numbers| numbers.iter().all(|x| *x > 0.0))
}
