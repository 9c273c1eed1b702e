//! Checkpoints and shards: the film's exact sums as OpenEXR files, so that a render can be stopped, continued and put together
//! from parts without a bit changing.
//!
//! Such a file is an ordinary OpenEXR image of uncompressed 32-bit unsigned integers. A sum has 64 bits and so two channels,
//! `even.R.high` and `even.R.low` for the red of the half image of the even passes, and so on; with a transparent background
//! `coverage.all` and `coverage.hit` join them, and `layer.NAME.even.R` and so on for each layer. The windows are those of the image. The attributes `pathspace.NAME` are
//! those that the image will have as well, whatever the number of samples; `pathspace.state.NAME` say which passes these are
//! and what was counted in them, with a checksum over all of it.

mod header;
mod sums;

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufReader, Cursor, Read, Seek},
    path::Path,
};

use ::exr::{
    block::{self, reader::Reader},
    meta::attribute::LineOrder,
    prelude::{
        AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Layer, ReadChannels, ReadLayers, SmallVec,
        Vec2, WritableImage, read,
    },
};
use sha2::{Digest, Sha256};

pub use self::{
    header::CheckpointHeader,
    sums::{Contents, Sums},
};
use self::{
    header::{CHECKSUM, STATE, parse},
    sums::words,
};
use super::{
    Crop, Header,
    exr::{image_attributes, own_attributes, sort_attributes},
};

/// Why a file of sums cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// It cannot be read.
    #[error("{0}")]
    Unreadable(String),
    /// It is something else.
    #[error("it is no checkpoint or shard of pathspace ({0})")]
    Foreign(String),
    /// It was one.
    #[error("it is damaged ({0})")]
    Damaged(String),
}

/// Encodes the sums of a render: the same bytes for the same arguments.
///
/// # Errors
/// If the format cannot hold them.
///
/// # Panics
/// If a layer or the coverage has other pixels than the film.
pub fn encode_checkpoint(sums: &Sums<'_>, header: &CheckpointHeader) -> io::Result<Vec<u8>> {
    let mut channels = SmallVec::new();
    for (name, sum) in sums.all() {
        let word = |shift: u32| (0..sums.film.pixels()).map(|i| (sums.get(sum, i) >> shift) as u32).collect();
        for (name, shift) in words(&name).into_iter().zip([32, 0]) {
            channels.push(AnyChannel::new(name.as_str(), FlatSamples::U32(word(shift))));
        }
    }
    let channels = AnyChannels::sort(channels);
    let mut attributes = header.attributes();
    let checksum = checksum(header, &attributes, &channels);
    attributes.insert(format!("{STATE}{CHECKSUM}"), checksum);

    let all = Header { sensor: header.sensor, crop: header.crop, attributes: attributes.into_iter().collect() };
    let size = Vec2(header.crop.width() as usize, header.crop.height() as usize);
    // The low words are noise that no compression shortens, and rendering waits for the file.
    let encoding = Encoding {
        compression: Compression::Uncompressed,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(size, own_attributes(&all), encoding, channels);
    let mut bytes = Vec::new();
    ::exr::image::Image::new(image_attributes(&all), layer)
        .write()
        .non_parallel()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|error| io::Error::other(error.to_string()))?;
    sort_attributes(&mut bytes).ok_or_else(|| io::Error::other("unexpected OpenEXR header"))?;
    Ok(bytes)
}

/// SHA-256 of what the file says and holds, however a program stores it.
fn checksum(
    header: &CheckpointHeader,
    attributes: &BTreeMap<String, String>,
    channels: &AnyChannels<FlatSamples>,
) -> String {
    let mut hash = Sha256::new();
    let Crop { x0, y0, x1, y1 } = header.crop;
    for number in [header.sensor.width, header.sensor.height, x0, y0, x1, y1] {
        hash.update(number.to_le_bytes());
    }
    for text in attributes.iter().flat_map(|(name, value)| [name, value]) {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text);
    }
    let mut bytes = Vec::new();
    for channel in &channels.list {
        let FlatSamples::U32(words) = &channel.sample_data else { continue };
        for words in words.chunks(1 << 14) {
            bytes.clear();
            bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
            hash.update(&bytes);
        }
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A file of sums, of which the header has been read and checked.
pub struct CheckpointFile<R = BufReader<File>> {
    header: CheckpointHeader,
    checksum: String,
    contents: Contents,
    chunks: Reader<R>,
}

impl CheckpointFile {
    /// Opens a file as [`CheckpointFile::from_reader`] reads it.
    ///
    /// # Errors
    /// If the file cannot be read or is no file of sums.
    pub fn open(path: &Path) -> Result<Self, CheckpointError> {
        let unreadable = |error: io::Error| CheckpointError::Unreadable(error.to_string());
        let file = File::open(path).map_err(unreadable)?;
        if !file.metadata().map_err(unreadable)?.is_file() {
            return Err(CheckpointError::Unreadable("it is not a regular file".to_owned()));
        }
        Self::from_reader(BufReader::new(file))
    }
}

impl<R: Read + Seek> CheckpointFile<R> {
    /// Reads the header, and takes no more memory than that does.
    ///
    /// # Errors
    /// As [`CheckpointFile::open`].
    pub fn from_reader(reader: R) -> Result<Self, CheckpointError> {
        let chunks = block::read(reader, false).map_err(|error| foreign(&error))?;
        let [only] = chunks.headers() else {
            return Err(CheckpointError::Foreign("it has several parts".to_owned()));
        };
        let (header, checksum) = parse(only)?;
        let names = only.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        let contents = Contents::of(names)
            .ok_or_else(|| CheckpointError::Foreign("its channels are not those of a film".to_owned()))?;
        Ok(Self { header, checksum, contents, chunks })
    }

    /// What it says besides the sums.
    pub fn header(&self) -> &CheckpointHeader {
        &self.header
    }

    /// Which sums it has besides the image's.
    pub fn contents(&self) -> &Contents {
        &self.contents
    }

    /// Adds its sums, and its count of what could not be added, to those of the same pixels.
    ///
    /// # Errors
    /// If it is damaged; nothing has then been added.
    ///
    /// # Panics
    /// If these are the sums of other pixels, or not those that the file has.
    pub fn add_to(self, sums: &Sums<'_>) -> Result<(), CheckpointError> {
        let film = sums.film;
        assert!(self.header.crop == film.crop() && self.contents == sums.contents(), "sums of another image");
        let damaged = |error: ::exr::error::Error| CheckpointError::Damaged(error.to_string());
        let layers = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let image = layers.all_attributes().non_parallel().from_chunks(self.chunks).map_err(damaged)?;
        let channels = image.layer_data.channel_data;
        if checksum(&self.header, &self.header.attributes(), &channels) != self.checksum {
            return Err(CheckpointError::Damaged("its checksum is another".to_owned()));
        }
        let mut samples = BTreeMap::new();
        for channel in &channels.list {
            match &channel.sample_data {
                FlatSamples::U32(words) if words.len() == film.pixels() => {
                    samples.insert(channel.name.to_string(), words);
                }
                _ => return Err(CheckpointError::Damaged(format!("channel {} has no integers", channel.name))),
            }
        }
        for (name, sum) in sums.all() {
            let [Some(high), Some(low)] = words(&name).map(|word| samples.get(&word)) else {
                return Err(CheckpointError::Damaged(format!("there is no channel {name}")));
            };
            for (pixel, (high, low)) in high.iter().zip(low.iter()).enumerate() {
                sums.add(sum, pixel, u64::from(*high) << 32 | u64::from(*low));
            }
        }
        film.add_errors(self.header.errors);
        Ok(())
    }
}

fn foreign(error: &::exr::error::Error) -> CheckpointError {
    match error {
        ::exr::error::Error::Io(error) => CheckpointError::Unreadable(error.to_string()),
        error => CheckpointError::Foreign(error.to_string()),
    }
}

#[cfg(test)]
mod tests;
