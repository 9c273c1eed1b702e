//! KTX2 images (`KHR_texture_basisu`): ETC1S with BasisLZ, and UASTC, plain or with Zstandard. basisu decodes the first
//! level to 8 bits a channel; the container is checked here before, since basisu counts on it.

use std::ops::Range;

use basisu::{DecodeFlags, TargetFormat, Transcoder};

use super::{
    error::Fault,
    limits::{Limit, Limits},
};
use crate::scene::texture::{Image, Texels};

/// How a KTX2 file begins.
const MAGIC: &[u8] = b"\xABKTX 20\xBB\r\n\x1A\n";

/// Where the header says where the list of keys is.
const KEYS: Range<usize> = 56..64;

/// The Khronos Data Format's models of colour.
const ETC1S: u32 = 163;
const UASTC: u32 = 166;

/// Supercompression schemes.
const NOTHING: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTANDARD: u32 = 2;

/// Whether `bytes` are to be a KTX2 file.
pub(super) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// The image. `texels` counts those of all images of the document.
pub(super) fn decode(bytes: &[u8], texels: &mut u64, limits: &Limits, at: &str) -> Result<Image, Fault> {
    let ([width, height], rgba) = rgba(bytes, texels, limits, at)?;
    Ok(Image::new(width, height, Texels::U8(rgba)))
}

/// Its size, and four numbers a texel.
pub(super) fn rgba(bytes: &[u8], texels: &mut u64, limits: &Limits, at: &str) -> Result<([u32; 2], Vec<u8>), Fault> {
    let broken = |what: &str| Fault::invalid(at, format!("the KTX2 image is broken: {what}"));
    let [width, height] = Container { bytes, at }.checked(texels, limits)?;
    let mut bytes = bytes.to_vec();
    // No key is needed, and basisu reads beyond the end of lists that are not aligned.
    bytes[KEYS].fill(0);
    let image = Transcoder::new(&bytes).map_err(|_| broken("its format or its codebooks cannot be read"))?;
    let decoded = image.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE);
    let decoded = decoded.map_err(|_| broken("its texels cannot be decoded"))?;
    if decoded.len() as u64 != 4 * u64::from(width) * u64::from(height) {
        return Err(broken("it has texels for another size"));
    }
    Ok(([width, height], decoded))
}

/// A KTX2 file (KTX 2.0 specification, chapter 3) whose bytes are not trusted.
struct Container<'a> {
    bytes: &'a [u8],
    at: &'a str,
}

impl Container<'_> {
    fn broken(&self, what: &str) -> Fault {
        Fault::invalid(self.at, format!("the KTX2 image is broken: {what}"))
    }

    fn word(&self, at: u64) -> Result<u32, Fault> {
        let word = usize::try_from(at).ok().and_then(|at| self.bytes.get(at..)?.first_chunk::<4>());
        word.map(|word| u32::from_le_bytes(*word)).ok_or_else(|| self.broken("it ends too early"))
    }

    fn long(&self, at: u64) -> Result<u64, Fault> {
        Ok(u64::from(self.word(at)?) | u64::from(self.word(at + 4)?) << 32)
    }

    /// Where so many bytes from `offset` on end, which is within the file.
    fn within(&self, offset: u64, length: u64, what: &str) -> Result<u64, Fault> {
        let end = offset.checked_add(length).filter(|&end| end <= self.bytes.len() as u64);
        end.ok_or_else(|| self.broken(&format!("{what} reaches beyond its end")))
    }

    /// The size of an image of a kind that is read, all of whose parts are within the file, and which takes no memory
    /// that its size does not explain.
    fn checked(&self, texels: &mut u64, limits: &Limits) -> Result<[u32; 2], Fault> {
        let [format, width, height, depth] = [self.word(12)?, self.word(20)?, self.word(24)?, self.word(28)?];
        let [layers, faces, levels, scheme] = [self.word(32)?, self.word(36)?, self.word(40)?, self.word(44)?];
        let unsupported = |what: &str| Err(Fault::unsupported(self.at, format!("the KTX2 image {what}")));
        if depth != 0 || height == 0 || layers > 1 || faces != 1 {
            return unsupported("is an array, a cube or has another number of dimensions than two");
        }
        let size = u64::from(width) * u64::from(height);
        *texels = texels.saturating_add(size);
        if *texels > limits.texels {
            let limit = Limit("texels", limits.texels);
            let what = format!("with the image's {width} × {height} there are {texels} texels, and {limit}");
            return Err(Fault::too_large(self.at, what));
        }
        if size == 0 || !(1..=32).contains(&levels) {
            return Err(self.broken("it has no texels or levels"));
        }
        let descriptor = u64::from(self.word(48)?);
        self.within(descriptor, u64::from(self.word(52)?).max(44), "its format descriptor")?;
        let model = self.word(descriptor + 12)? & 255;
        let blocks = u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4));
        let [offset, length, plain] = [self.long(80)?, self.long(88)?, self.long(96)?];
        self.within(80, 24 * u64::from(levels), "its list of levels")?;
        self.within(offset, length, "its first level")?;
        match (format, model, scheme) {
            (0, ETC1S, BASIS_LZ) => self.codebooks(levels)?,
            (0, UASTC, NOTHING) if length == 16 * blocks => {}
            (0, UASTC, ZSTANDARD) if plain == 16 * blocks => {}
            (0, UASTC, NOTHING | ZSTANDARD) => return Err(self.broken("its first level has another size")),
            _ => return unsupported("is neither ETC1S with BasisLZ nor UASTC, as KHR_texture_basisu has it"),
        }
        Ok([width, height])
    }

    /// Checks the global data of BasisLZ (3.12.2).
    fn codebooks(&self, levels: u32) -> Result<(), Fault> {
        let (offset, length) = (self.long(64)?, self.long(72)?);
        let what = "its codebooks";
        self.within(offset, length.max(20), what)?;
        let parts = [4, 8, 12].map(|at| self.word(offset + at).map(u64::from));
        let mut inside = 20 + 20 * u64::from(levels);
        for part in parts {
            inside += part?;
        }
        self.within(offset, inside, what)?;
        if inside > length {
            return Err(self.broken("its codebooks are longer than announced"));
        }
        Ok(())
    }
}
