//! Reading OpenEXR images: the channels R, G and B of the first part that has them, as linear Rec. 709 whatever
//! `chromaticities` the file states.

use std::{io::Cursor, path::Path};

use exr::{
    meta::attribute::Chromaticities,
    prelude::{MetaData, ReadChannels, ReadLayers, read},
};

use super::{
    buffer,
    error::one_line,
    layered::attributes,
    limits::Limits,
    primaries::{Colors, Primaries},
};
use crate::{
    film::{DENOISED, Image},
    math::Rgb,
};

/// The pixels of a file, row by row from the top.
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) texels: Vec<Rgb>,
    /// What the texels were before they were taken to Rec. 709.
    pub(super) colors: Colors,
}

/// Why a file could not be decoded.
pub(super) enum Refusal {
    Damaged(String),
    TooLarge(usize, usize),
}

/// Why an image could not be read. Its message is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cannot read the image {file}: {what}")]
pub struct ImageError {
    file: String,
    what: String,
}

impl ImageError {
    pub(super) fn new(path: &Path, what: &str) -> Self {
        Self { file: one_line(&path.display().to_string()), what: one_line(what) }
    }
}

/// Reads the channels R, G and B of an OpenEXR file: its data window, without the display window around it. A file with
/// other `chromaticities` than those of Rec. 709 is converted, and colours outside of that gamut have negative channels
/// then.
///
/// # Errors
/// If it is no such file, is larger than `limits` allow (`file-bytes`, `texels`), has a channel that is not finite, or
/// `chromaticities` that are none.
pub fn read_image(limits: &Limits, path: &Path) -> Result<Image, ImageError> {
    let refuse = |what: String| ImageError::new(path, &what);
    let bytes = buffer::file(path, limits.file_bytes).map_err(refuse)?;
    if !bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Err(refuse("it is no OpenEXR file, and others do not hold linear radiance".to_owned()));
    }
    let picture = openexr(&bytes, limits.texels).map_err(|refusal| match refusal {
        Refusal::Damaged(what) => refuse(what),
        Refusal::TooLarge(width, height) => {
            refuse(format!("it has {width} × {height} pixels, and {} is the limit", limits.texels))
        }
    })?;
    let (width, height) = (picture.width, picture.texels.len() / picture.width);
    if let Some(odd) = picture.texels.iter().position(|texel| !texel.is_finite()) {
        let (x, y) = (odd % width, odd / width);
        return Err(refuse(format!("column {x}, row {y} is {}, which is not finite", picture.texels[odd])));
    }
    Ok(Image { width: width as u32, height: height as u32, pixels: picture.texels })
}

/// Reads the half images that `pathspace render --data halves` writes beside an image: `None` if the file has none,
/// or if its image is denoised, so that it is not their mean.
///
/// # Errors
/// As [`read_image`].
pub fn read_halves(limits: &Limits, path: &Path) -> Result<Option<[Image; 2]>, ImageError> {
    let refuse = |what: String| ImageError::new(path, &what);
    let bytes = buffer::file(path, limits.file_bytes).map_err(refuse)?;
    let decode = |error: exr::error::Error| refuse(format!("its OpenEXR image cannot be decoded ({error})"));
    let meta = MetaData::read_from_buffered(Cursor::new(&bytes[..]), false).map_err(decode)?;
    if attributes(&meta).contains_key(DENOISED) {
        return Ok(None);
    }
    for header in &meta.headers {
        if check_size(header.layer_size.x(), header.layer_size.y(), limits.texels).is_err() {
            return Err(refuse(format!("it has no pixels, or more than {}", limits.texels)));
        }
    }
    let layers = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = layers.from_buffered(Cursor::new(&bytes[..])).map_err(decode)?;
    let colors = colors(image.attributes.chromaticities).map_err(refuse)?;
    let layer = image.layer_data;
    let (width, height) = (layer.size.width() as u32, layer.size.height() as u32);
    let channel = |name: String| {
        let found = layer.channel_data.list.iter().find(|c| c.name.to_string() == name)?;
        Some(found.sample_data.values_as_f32().collect::<Vec<_>>())
    };
    let half = |name: &str| {
        let [r, g, b] = ["R", "G", "B"].map(|letter| channel(format!("{name}.{letter}")));
        let (r, g, b) = (r?, g?, b?);
        let mut pixels: Vec<_> = r.into_iter().zip(g).zip(b).map(|((r, g), b)| Rgb::new(r, g, b)).collect();
        colors.convert(&mut pixels);
        Some(Image { width, height, pixels })
    };
    let halves = half("even").zip(half("odd")).map(|(even, odd)| [even, odd]);
    if halves.iter().flatten().any(|half| half.pixels.iter().any(|p| !p.is_finite())) {
        return Err(refuse("a half image is not finite".to_owned()));
    }
    Ok(halves)
}

fn damaged(error: &exr::error::Error) -> Refusal {
    Refusal::Damaged(format!("its OpenEXR image cannot be decoded ({error})"))
}

fn headers(bytes: &[u8]) -> Result<MetaData, Refusal> {
    MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| damaged(&error))
}

/// Refuses an image that is a part of a larger one.
pub(super) fn refuse_parts(bytes: &[u8]) -> Result<(), Refusal> {
    for header in &headers(bytes)?.headers {
        let display = header.shared_attributes.display_window;
        if display.size != header.layer_size || display.position != header.own_attributes.layer_position {
            return Err(Refusal::Damaged(
                "it is a part of a larger image, its data and display windows differ".to_owned(),
            ));
        }
    }
    Ok(())
}

/// The pixels of a file of at most `limit` of them.
pub(super) fn openexr(bytes: &[u8], limit: u64) -> Result<Picture, Refusal> {
    let meta = headers(bytes)?;
    let wanted =
        |name: &str| meta.headers.iter().any(|h| h.channels.list.iter().any(|c| c.name.eq_case_insensitive(name)));
    if !["R", "G", "B"].into_iter().all(wanted) {
        return Err(Refusal::Damaged("it has no channels R, G and B".to_owned()));
    }
    for header in &meta.headers {
        check_size(header.layer_size.x(), header.layer_size.y(), limit)?;
    }
    let create = |size: exr::math::Vec2<usize>, _: &_| Picture {
        width: size.width(),
        texels: vec![Rgb::ZERO; size.width() * size.height()],
        colors: Colors::Rec709,
    };
    let set = |picture: &mut Picture, at: exr::math::Vec2<usize>, (r, g, b): (f32, f32, f32)| {
        picture.texels[at.y() * picture.width + at.x()] = Rgb::new(r, g, b);
    };
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(create, set)
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| damaged(&error))?;
    let mut picture = image.layer_data.channel_data.pixels;
    let colors = colors(image.attributes.chromaticities).map_err(Refusal::Damaged)?;
    colors.convert(&mut picture.texels);
    Ok(Picture { colors, ..picture })
}

/// What the channels are; without the attribute, Rec. 709 (OpenEXR's "Standard Optional Attributes").
pub(super) fn colors(stated: Option<Chromaticities>) -> Result<Colors, String> {
    let Some(Chromaticities { red, green, blue, white }) = stated else { return Ok(Colors::Rec709) };
    let [r, g, b, w] = [red, green, blue, white].map(|c| [f64::from(c.x()), f64::from(c.y())]);
    let primaries = Primaries::of([r[0], r[1], g[0], g[1], b[0], b[1], w[0], w[1]]);
    let refuse = |why| format!("its chromaticities cannot be used: {why}");
    primaries.to_rec_709().map_err(refuse)
}

/// Refuses no pixels, and more than `limit`.
pub(super) fn check_size(width: usize, height: usize, limit: u64) -> Result<(usize, usize), Refusal> {
    match (width as u64).checked_mul(height as u64) {
        Some(0) => Err(Refusal::Damaged("it has no pixels".to_owned())),
        Some(texels) if texels <= limit => Ok((width, height)),
        _ => Err(Refusal::TooLarge(width, height)),
    }
}
