//! OpenEXR: the image as it is, and what it was made with.

use std::io::{self, Cursor};

use ::exr::{
    meta::{
        attribute::{AttributeValue, Chromaticities, IntegerBounds, LineOrder, Text},
        header::{ImageAttributes, LayerAttributes},
    },
    prelude::{
        AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Layer, SmallVec, Vec2, WritableImage,
    },
};

use super::{Crop, Image};
use crate::scene::camera::Sensor;

/// What an image file says besides its pixels.
#[derive(Clone, Debug)]
pub struct Header {
    /// The full image: the display window.
    pub sensor: Sensor,
    /// The pixels in the file: the data window.
    pub crop: Crop,
    /// Text attributes: name without its prefix `pathspace.`, and value. They hold what changes pixels and nothing
    /// else, so that two renders of the same image are the same file.
    pub attributes: Vec<(String, String)>,
}

/// Channels beside the image's: NAME with one number per pixel each.
#[derive(Clone, Debug)]
pub enum Samples {
    /// Of 32-bit floats.
    Float(Vec<f32>),
    /// Of 32-bit integers.
    Integer(Vec<u32>),
}

/// Encodes `image` as an OpenEXR file of one part with the 32-bit float channels R, G and B, A where `alpha` has one
/// number per pixel, NAME.R, NAME.G and NAME.B for each of `layers`, and each of `data`; without loss, and with the
/// same bytes whenever called with the same arguments. Colours are premultiplied, as OpenEXR wants them: `image` holds
/// what the covered part of each pixel adds.
///
/// # Errors
/// If the format cannot hold the image.
///
/// # Panics
/// If a layer, a channel or `alpha` has another size than the image.
pub fn encode_exr(
    image: &Image,
    alpha: Option<&[f32]>,
    layers: &[(String, Image)],
    data: &[(String, Samples)],
    header: &Header,
) -> io::Result<Vec<u8>> {
    let shared = ImageAttributes { chromaticities: Some(REC_709), ..image_attributes(header) };
    let own = own_attributes(header);
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = Vec2(image.width as usize, image.height as usize);
    let mut channels = SmallVec::new();
    let mut add_samples = |name: &str, samples: FlatSamples| {
        assert_eq!(samples.len(), image.pixels.len(), "every channel has the image's pixels");
        channels.push(AnyChannel::new(name, samples));
    };
    for (name, samples) in data {
        add_samples(
            name,
            match samples {
                Samples::Float(samples) => FlatSamples::F32(samples.clone()),
                Samples::Integer(samples) => FlatSamples::U32(samples.clone()),
            },
        );
    }
    let mut add = |name: &str, samples| add_samples(name, FlatSamples::F32(samples));
    let component = |image: &Image, i: usize| image.pixels.iter().map(|p| p[i]).collect::<Vec<_>>();
    for (i, letter) in ["R", "G", "B"].into_iter().enumerate() {
        add(letter, component(image, i));
        for (name, layer) in layers {
            add(&format!("{name}.{letter}"), component(layer, i));
        }
    }
    if let Some(alpha) = alpha {
        add("A", alpha.to_vec());
    }
    let layer = Layer::new(size, own, encoding, AnyChannels::sort(channels));
    let mut bytes = Vec::new();
    ::exr::image::Image::new(shared, layer)
        .write()
        .non_parallel()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|error| io::Error::other(error.to_string()))?;
    sort_attributes(&mut bytes).ok_or_else(|| io::Error::other("unexpected OpenEXR header"))?;
    Ok(bytes)
}

/// The display window.
pub(super) fn image_attributes(header: &Header) -> ImageAttributes {
    let Sensor { width, height, .. } = header.sensor;
    ImageAttributes::new(IntegerBounds::new((0, 0), (width as usize, height as usize)))
}

/// The data window's place, and what the file says of itself.
pub(super) fn own_attributes(header: &Header) -> LayerAttributes {
    let mut own = LayerAttributes {
        layer_position: Vec2(header.crop.x0 as i32, header.crop.y0 as i32),
        software_name: Some(Text::from(concat!("pathspace ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (name, value) in &header.attributes {
        let name = Text::from_slice_unchecked(format!("{PREFIX}{name}").as_bytes());
        own.other.insert(name, AttributeValue::Text(Text::from_slice_unchecked(value.as_bytes())));
    }
    own
}

/// The attribute of an image that a filter has changed, which is therefore no estimate: by what, and where the estimate
/// is.
pub const DENOISED: &str = "denoised";

/// Before the name of every attribute of ours.
pub(crate) const PREFIX: &str = "pathspace.";

/// The primaries of the renderer's RGB.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Brings the attributes of a single-part file's header into alphabetical order, and sets the flag for long names where
/// there are any. The exr crate keeps custom attributes in a hash map and writes them in another order each time; their
/// total length, and so every offset in the file, stays. It does not look at the names of channels for the flag.
pub(crate) fn sort_attributes(file: &mut [u8]) -> Option<()> {
    // Magic number and version, then (name \0 type \0 length value)… \0.
    const START: usize = 8;
    let text_end = |from: usize| Some(from + file.get(from..)?.iter().position(|b| *b == 0)? + 1);
    let mut attributes = Vec::new();
    let mut at = START;
    while *file.get(at)? != 0 {
        let length_at = text_end(text_end(at)?)?;
        let length = i32::from_le_bytes(file.get(length_at..length_at + 4)?.try_into().ok()?);
        let end = length_at + 4 + usize::try_from(length).ok()?;
        attributes.push(file.get(at..end)?.to_vec());
        at = end;
    }
    attributes.sort();
    file[START..at].copy_from_slice(&attributes.concat());
    if has_long_names(file.get(START..at)?)? {
        // Bit 10 of the version field (OpenEXR file layout, "Version Field").
        file[5] |= 0x04;
    }
    Some(())
}

/// Whether an attribute, its type or a channel has a name that only files with the flag for long names may have.
fn has_long_names(mut attributes: &[u8]) -> Option<bool> {
    const SHORT: usize = 31;
    /// Pixel type, linearity and sampling after a channel's name.
    const OF_A_CHANNEL: usize = 16;
    fn text<'a>(bytes: &mut &'a [u8]) -> Option<&'a [u8]> {
        let end = bytes.iter().position(|byte| *byte == 0)?;
        let text = &bytes[..end];
        *bytes = &bytes[end + 1..];
        Some(text)
    }
    let mut long = false;
    while !attributes.is_empty() {
        let (name, kind) = (text(&mut attributes)?, text(&mut attributes)?);
        let length = i32::from_le_bytes(*attributes.first_chunk::<4>()?);
        let (mut value, rest) = attributes[4..].split_at_checked(usize::try_from(length).ok()?)?;
        attributes = rest;
        long |= name.len() > SHORT || kind.len() > SHORT;
        if kind != b"chlist" {
            continue;
        }
        loop {
            let channel = text(&mut value)?;
            if channel.is_empty() {
                break;
            }
            long |= channel.len() > SHORT;
            value = value.get(OF_A_CHANNEL..)?;
        }
    }
    Some(long)
}

#[cfg(test)]
mod tests {
    use ::exr::prelude::{ReadChannels, ReadLayers, read};

    use super::*;
    use crate::math::Rgb;

    fn example() -> (Image, Header) {
        let crop = Crop { x0: 3, y0: 5, x1: 20, y1: 45 };
        let pixels = (0..17 * 40).map(|i| Rgb::new(i as f32, 0.1 * i as f32, 1e-20)).collect();
        let attributes =
            ["integrator", "spp", "seed", "filter", "noise"].map(|name| (name.to_owned(), format!("a {name} – é")));
        let sensor = Sensor { width: 64, height: 48, padding: 1 };
        (Image { width: 17, height: 40, pixels }, Header { sensor, crop, attributes: attributes.to_vec() })
    }

    #[test]
    fn the_same_image_is_the_same_file() {
        let (image, header) = example();
        let bytes = encode_exr(&image, None, &[], &[], &header).unwrap();
        for _ in 0..8 {
            assert_eq!(
                bytes,
                encode_exr(&image, None, &[], &[], &header).unwrap(),
                "hash maps have their own order each time"
            );
        }
    }

    #[test]
    fn long_names_are_marked_and_short_ones_are_not() {
        let (image, header) = example();
        let marked = |layer: usize, attribute: usize| {
            let mut header = header.clone();
            header.attributes.push(("a".repeat(attribute - PREFIX.len()), "x".repeat(100)));
            let layers = [("l".repeat(layer - ".R".len()), image.clone())];
            let bytes = encode_exr(&image, None, &layers, &[], &header).unwrap();
            let meta = ::exr::meta::MetaData::read_from_buffered(Cursor::new(&bytes[..]), false).unwrap();
            assert_eq!(meta.headers[0].channels.list.len(), 6);
            assert_eq!(bytes[4..8].iter().filter(|byte| **byte & !0x04 != 0).count(), 1, "the version alone");
            bytes[5] == 0x04
        };
        assert_eq!([marked(31, 31), marked(32, 31), marked(31, 32), marked(255, 31)], [false, true, true, true]);
    }

    #[test]
    fn alpha_is_a_channel_of_its_own_beside_untouched_colours() {
        let (image, header) = example();
        let alpha: Vec<f32> = (0..17 * 40).map(|i| i as f32 / 680.0).collect();
        let bytes = encode_exr(&image, Some(&alpha), &[], &[], &header).unwrap();
        let read = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgba_channels(
                |size, _| vec![(Rgb::ZERO, f32::NAN); size.0 * size.1],
                |pixels: &mut Vec<_>, Vec2(x, y), (r, g, b, a): (f32, f32, f32, f32)| {
                    pixels[y * 17 + x] = (Rgb::new(r, g, b), a);
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(&bytes))
            .unwrap();
        let expected: Vec<_> = image.pixels.into_iter().zip(alpha).collect();
        assert_eq!(read.layer_data.channel_data.pixels, expected);
    }

    #[test]
    fn pixels_windows_and_attributes_come_back() {
        let (image, header) = example();
        let bytes = encode_exr(&image, None, &[], &[], &header).unwrap();
        let file = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| Image {
                    width: size.0 as u32,
                    height: size.1 as u32,
                    pixels: vec![Rgb::ZERO; size.0 * size.1],
                },
                |image: &mut Image, Vec2(x, y), (r, g, b): (f32, f32, f32)| {
                    image.pixels[y * image.width as usize + x] = Rgb::new(r, g, b);
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(&bytes))
            .unwrap();
        assert_eq!(file.layer_data.channel_data.pixels, image);
        assert_eq!(file.layer_data.attributes.layer_position, Vec2(3, 5));
        assert_eq!(file.attributes.display_window.size, Vec2(64, 48));
        for (name, value) in header.attributes {
            let AttributeValue::Text(read) = &file.layer_data.attributes.other[format!("pathspace.{name}").as_bytes()]
            else {
                panic!("{name} is no text")
            };
            assert_eq!(read.as_slice(), value.as_bytes());
        }
    }
}
