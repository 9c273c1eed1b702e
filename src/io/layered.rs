//! OpenEXR images with everything that is beside them in their files, to be written again with other pixels.

use std::{collections::BTreeMap, io, io::Cursor, path::Path};

use exr::{
    image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, write::WritableImage},
    meta::{
        attribute::{AttributeValue, Text},
        header::Header,
    },
    prelude::{Blocks, Compression, LineOrder, MetaData, ReadChannels, ReadLayers, Vec2, read},
};

use super::{
    buffer,
    limits::Limits,
    openexr::{ImageError, check_size},
    primaries::Colors,
};
use crate::{
    film::{Image, PREFIX, sort_attributes},
    math::Rgb,
};

/// An OpenEXR file of one part: R, G and B, and all other channels and attributes.
#[derive(Clone, Debug)]
pub struct Layered {
    file: exr::image::Image<Layer<AnyChannels<FlatSamples>>>,
    rgb: Image,
}

/// Reads an OpenEXR file of one flat part with the channels R, G and B of Rec. 709.
///
/// # Errors
/// As [`read_image`](super::read_image); and for several parts, other `chromaticities`, and subsampled channels.
pub fn read_layered(limits: &Limits, path: &Path) -> Result<Layered, ImageError> {
    let refuse = |what: String| ImageError::new(path, &what);
    let bytes = buffer::file(path, limits.file_bytes).map_err(refuse)?;
    let meta = metadata(&bytes).map_err(refuse)?;
    let [header] = &meta.headers[..] else {
        return Err(refuse(format!(
            "it has {} parts, and only files of one are read with all channels",
            meta.headers.len()
        )));
    };
    if check_size(header.layer_size.x(), header.layer_size.y(), limits.texels).is_err() {
        return Err(refuse(format!("it has no pixels, or more than {}", limits.texels)));
    }
    let layers = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let file = layers.from_buffered(Cursor::new(&bytes[..])).map_err(|error| refuse(undecodable(&error)))?;
    let stated = super::openexr::colors(file.attributes.chromaticities).map_err(refuse)?;
    if !matches!(stated, Colors::Rec709) {
        return Err(refuse("its chromaticities are not those of Rec. 709".to_owned()));
    }
    let (width, height) = (file.layer_data.size.width(), file.layer_data.size.height());
    if file.layer_data.channel_data.list.iter().any(|channel| channel.sample_data.len() != width * height) {
        return Err(refuse("it has channels with fewer samples than pixels".to_owned()));
    }
    let rgb = Image { width: width as u32, height: height as u32, pixels: Vec::new() };
    let mut layered = Layered { file, rgb };
    let pixels = layered.three(&["R", "G", "B"].map(str::to_owned)).map_err(refuse)?;
    let pixels = pixels.ok_or_else(|| refuse("it has no channels R, G and B".to_owned()))?;
    layered.rgb.pixels = pixels.into_iter().map(Rgb::from_array).collect();
    Ok(layered)
}

/// The attributes `pathspace.NAME` of an OpenEXR file by NAME, of any of its parts: what its header says of the image.
///
/// # Errors
/// If it is no such file, or larger than `limits` allow.
pub fn read_attributes(limits: &Limits, path: &Path) -> Result<BTreeMap<String, String>, ImageError> {
    let refuse = |what: String| ImageError::new(path, &what);
    let bytes = buffer::file(path, limits.file_bytes).map_err(refuse)?;
    let meta = metadata(&bytes).map_err(refuse)?;
    Ok(attributes(&meta))
}

/// What the headers say of the image.
pub(super) fn attributes(meta: &MetaData) -> BTreeMap<String, String> {
    let of_header = |header: &Header| {
        let all = header.shared_attributes.other.iter().chain(&header.own_attributes.other);
        all.filter_map(|(name, value)| own(name, value)).collect::<Vec<_>>()
    };
    meta.headers.iter().flat_map(of_header).collect()
}

fn metadata(bytes: &[u8]) -> Result<MetaData, String> {
    if !bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Err("it is no OpenEXR file".to_owned());
    }
    MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| undecodable(&error))
}

fn undecodable(error: &exr::error::Error) -> String {
    format!("its OpenEXR image cannot be decoded ({error})")
}

/// An attribute of ours, by its name without the prefix.
fn own(name: &Text, value: &AttributeValue) -> Option<(String, String)> {
    let name = name.to_string();
    let AttributeValue::Text(value) = value else { return None };
    Some((name.strip_prefix(PREFIX)?.to_owned(), value.to_string()))
}

impl Layered {
    /// R, G and B.
    pub fn rgb(&self) -> &Image {
        &self.rgb
    }

    /// Column and row of its first pixel: where a crop is in its image.
    pub fn corner(&self) -> (i32, i32) {
        let Vec2(x, y) = self.file.layer_data.attributes.layer_position;
        (x, y)
    }

    /// The channel A, if there is one.
    pub fn alpha(&self) -> Option<Vec<f32>> {
        self.channel("A").map(|samples| samples.values_as_f32().collect())
    }

    /// The three channels of these names, if all are there.
    ///
    /// # Errors
    /// If a number is not finite: which.
    pub fn three(&self, names: &[String; 3]) -> Result<Option<Vec<[f32; 3]>>, String> {
        let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|i| self.channel(&names[i])) else { return Ok(None) };
        for (name, samples) in names.iter().zip([a, b, c]) {
            if let Some((i, odd)) = samples.values_as_f32().enumerate().find(|(_, x)| !x.is_finite()) {
                let (x, y) = (i % self.rgb.width as usize, i / self.rgb.width as usize);
                return Err(format!("channel {name} is {odd} in column {x}, row {y}"));
            }
        }
        let values = a.values_as_f32().zip(b.values_as_f32()).zip(c.values_as_f32());
        Ok(Some(values.map(|((a, b), c)| [a, b, c]).collect()))
    }

    /// Whether there is a channel of this name.
    pub fn has(&self, name: &str) -> bool {
        self.channel(name).is_some()
    }

    /// The attribute `pathspace.NAME`.
    pub fn attribute(&self, name: &str) -> Option<String> {
        let all = self.file.attributes.other.iter().chain(&self.file.layer_data.attributes.other);
        all.filter_map(|(name, value)| own(name, value)).find(|(found, _)| found == name).map(|(_, value)| value)
    }

    fn channel(&self, name: &str) -> Option<&FlatSamples> {
        let found = self.file.layer_data.channel_data.list.iter().find(|channel| channel.name.to_string() == name)?;
        Some(&found.sample_data)
    }

    /// The file with `image` for its image, whose channels become those of the layer `name`, bit by bit, and with these
    /// attributes besides its own. Everything else stays as it is; the file is compressed without loss.
    ///
    /// # Errors
    /// If the format cannot hold that.
    ///
    /// # Panics
    /// If the image has another size.
    pub fn encode_with(&self, image: &Image, name: &str, attributes: &[(String, String)]) -> io::Result<Vec<u8>> {
        assert_eq!((image.width, image.height), (self.rgb.width, self.rgb.height), "one size");
        let mut file = self.file.clone();
        let layer = &mut file.layer_data;
        layer.encoding =
            Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        let mut channels = std::mem::take(&mut layer.channel_data.list);
        for (i, letter) in ["R", "G", "B"].into_iter().enumerate() {
            for channel in channels.iter_mut().filter(|channel| channel.name == *letter) {
                *channel = AnyChannel::new(format!("{name}.{letter}").as_str(), channel.sample_data.clone());
            }
            let samples = image.pixels.iter().map(|pixel| pixel[i]).collect();
            channels.push(AnyChannel::new(letter, FlatSamples::F32(samples)));
        }
        layer.channel_data = AnyChannels::sort(channels);
        for (name, value) in attributes {
            let name = Text::from_slice_unchecked(format!("{PREFIX}{name}").as_bytes());
            layer.attributes.other.insert(name, AttributeValue::Text(Text::from_slice_unchecked(value.as_bytes())));
        }
        let mut bytes = Vec::new();
        let written = file.write().non_parallel().to_buffered(Cursor::new(&mut bytes));
        written.map_err(|error| io::Error::other(error.to_string()))?;
        sort_attributes(&mut bytes).ok_or_else(|| io::Error::other("unexpected OpenEXR header"))?;
        Ok(bytes)
    }
}
