//! Images: PNG, JPEG, WebP and KTX2, from files beside the document, data URIs and buffer views.

use std::{io::Cursor, sync::Arc};

use gltf_json::Root;
use image::{DynamicImage, ImageDecoder as _, ImageFormat, ImageReader};

use super::{
    buffer::{self, Buffers, Hash},
    error::{Fault, one_line},
    ktx2,
    limits::{Limit, Limits, Place},
};
use crate::scene::texture::{Image, Texels};

/// What a decoder may take besides the texels, bytes.
const DECODER_MEMORY: u64 = 1 << 30;

/// The images of a document, each decoded when it is first asked for.
pub(super) struct Images<'a> {
    root: &'a Root,
    buffers: &'a Buffers,
    place: Place<'a>,
    hash: &'a mut Hash,
    decoded: Vec<Option<Arc<Image>>>,
    texels: u64,
}

impl<'a> Images<'a> {
    /// The images of `root`, whose buffers are `buffers` and which lies at `place`; `hash` takes in the files that are
    /// read.
    pub(super) fn new(root: &'a Root, buffers: &'a Buffers, place: Place<'a>, hash: &'a mut Hash) -> Self {
        Self { root, buffers, place, hash, decoded: vec![None; root.images.len()], texels: 0 }
    }

    /// The image at an index that the document has.
    pub(super) fn get(&mut self, index: usize) -> Result<Arc<Image>, Fault> {
        let at = format!("/images/{index}");
        match self.decoded.get(index) {
            Some(Some(image)) => return Ok(image.clone()),
            Some(None) => {}
            None => return Err(Fault::invalid(at, "the file has no such image")),
        }
        let image = Arc::new(match self.source(index, &at)? {
            Bytes::Borrowed(bytes) => decode(bytes, &mut self.texels, &self.place.limits, &at)?,
            Bytes::Owned(bytes) => decode(&bytes, &mut self.texels, &self.place.limits, &at)?,
        });
        self.decoded[index] = Some(image.clone());
        Ok(image)
    }

    fn source(&mut self, index: usize, at: &str) -> Result<Bytes<'a>, Fault> {
        let source = &self.root.images[index];
        if let Some(uri) = &source.uri {
            if uri.starts_with("data:") {
                return Ok(Bytes::Owned(buffer::data_uri(uri, at)?));
            }
            let bytes = buffer::beside(uri, self.place, "image", at)?;
            self.hash.add(&bytes);
            return Ok(Bytes::Owned(bytes));
        }
        let Some(view) = source.buffer_view else {
            return Err(Fault::invalid(at, "the image has neither a URI nor a buffer view"));
        };
        Ok(Bytes::Borrowed(self.buffers.view(self.root, view.value())?))
    }
}

enum Bytes<'a> {
    Borrowed(&'a [u8]),
    Owned(Vec<u8>),
}

/// Decodes an image, whatever its file name and MIME type say it is. Colour profiles and orientation are ignored, as
/// glTF asks. `texels` counts those of all images.
fn decode(bytes: &[u8], texels: &mut u64, limits: &Limits, at: &str) -> Result<Image, Fault> {
    if ktx2::is_ktx2(bytes) {
        return ktx2::decode(bytes, texels, limits, at);
    }
    let (format, most) = (image::guess_format(bytes).ok(), limits.texels);
    let Some(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) = format else {
        return Err(Fault::unsupported(at, "the image is neither PNG, JPEG, WebP nor KTX2"));
    };
    let broken = |error: &image::ImageError| {
        let name = format.extensions_str().first().copied().unwrap_or_default().to_uppercase();
        Fault::invalid(at, format!("the {name} image is broken: {}", one_line(&error.to_string())))
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.no_limits();
    let mut decoder = reader.into_decoder().map_err(|error| broken(&error))?;
    let (width, height) = decoder.dimensions();
    let size = u64::from(width) * u64::from(height);
    *texels = texels.saturating_add(size);
    if *texels > most {
        let what =
            format!("with the image's {width} × {height} there are {texels} texels, and {}", Limit("texels", most));
        return Err(Fault::too_large(at, what));
    }
    if size == 0 {
        return Err(Fault::invalid(at, "the image has no texels"));
    }
    let mut memory = image::Limits::no_limits();
    memory.max_alloc = Some(8 * size + DECODER_MEMORY);
    decoder.set_limits(memory).map_err(|error| broken(&error))?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|error| broken(&error))?;
    let texels = match decoded {
        DynamicImage::ImageLuma8(image) => Texels::U8(image.into_raw()),
        DynamicImage::ImageLumaA8(image) => Texels::U8(image.into_raw()),
        DynamicImage::ImageRgb8(image) => Texels::U8(image.into_raw()),
        DynamicImage::ImageRgba8(image) => Texels::U8(image.into_raw()),
        DynamicImage::ImageLuma16(image) => Texels::U16(image.into_raw()),
        DynamicImage::ImageLumaA16(image) => Texels::U16(image.into_raw()),
        DynamicImage::ImageRgb16(image) => Texels::U16(image.into_raw()),
        DynamicImage::ImageRgba16(image) => Texels::U16(image.into_raw()),
        other => Texels::U8(other.into_rgba8().into_raw()),
    };
    Ok(Image::new(width, height, texels))
}
