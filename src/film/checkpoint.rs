//! Checkpoints and shards: the film's exact sums as OpenEXR files, so that a render can be stopped, continued and put together
//! from parts without a bit changing.
//!
//! Such a file is an ordinary OpenEXR image of uncompressed 32-bit unsigned integers. A sum has 64 bits and so two channels,
//! `even.R.high` and `even.R.low` for the red of the half image of the even passes, and so on; with a transparent background
//! `coverage.all` and `coverage.hit` join them. The windows are those of the image. The attributes `pathspace.NAME` are
//! those that the image will have as well, whatever the number of samples; `pathspace.state.NAME` say which passes these are
//! and what was counted in them, with a checksum over all of it.

mod header;

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

pub use self::header::CheckpointHeader;
use self::header::{CHECKSUM, STATE, parse};
use super::{
    Coverage, Crop, Film, Half, Header,
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

/// One of the sums of every pixel.
#[derive(Clone, Copy)]
enum Sum {
    Light(Half, usize),
    Coverage(usize),
}

impl Sum {
    fn all(transparent: bool) -> Vec<Self> {
        let light = [Half::Even, Half::Odd].into_iter().flat_map(|half| (0..3).map(move |c| Self::Light(half, c)));
        light.chain((0..if transparent { 2 } else { 0 }).map(Self::Coverage)).collect()
    }

    fn name(self) -> String {
        match self {
            Self::Light(Half::Even, channel) => format!("even.{}", ["R", "G", "B"][channel]),
            Self::Light(Half::Odd, channel) => format!("odd.{}", ["R", "G", "B"][channel]),
            Self::Coverage(channel) => format!("coverage.{}", ["all", "hit"][channel]),
        }
    }

    fn of(self, film: &Film, coverage: Option<&Coverage>, pixel: usize) -> u64 {
        match self {
            Self::Light(half, channel) => film.sum(half, pixel, channel),
            Self::Coverage(channel) => coverage.map_or(0, |coverage| coverage.sum(pixel, channel)),
        }
    }
}

/// Encodes the sums of `film`, and of `coverage` where the background is transparent: the same bytes for the same arguments.
///
/// # Errors
/// If the format cannot hold them.
pub fn encode_checkpoint(film: &Film, coverage: Option<&Coverage>, header: &CheckpointHeader) -> io::Result<Vec<u8>> {
    let mut channels = SmallVec::new();
    for sum in Sum::all(coverage.is_some()) {
        let words = |shift: u32| (0..film.pixels()).map(|i| (sum.of(film, coverage, i) >> shift) as u32).collect();
        for (part, shift) in [("high", 32), ("low", 0)] {
            let name = format!("{}.{part}", sum.name());
            channels.push(AnyChannel::new(name.as_str(), FlatSamples::U32(words(shift))));
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
    transparent: bool,
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
        let names: Vec<_> = only.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        let has = |transparent| {
            let mut expected: Vec<_> = Sum::all(transparent).into_iter().map(Sum::name).collect();
            expected = expected.iter().flat_map(|name| ["high", "low"].map(|part| format!("{name}.{part}"))).collect();
            expected.sort();
            names == expected
        };
        let transparent = match (has(false), has(true)) {
            (true, _) => false,
            (_, true) => true,
            _ => return Err(CheckpointError::Foreign("its channels are not those of a film".to_owned())),
        };
        Ok(Self { header, checksum, transparent, chunks })
    }

    /// What it says besides the sums.
    pub fn header(&self) -> &CheckpointHeader {
        &self.header
    }

    /// Whether it has sums of coverage, too.
    pub fn is_transparent(&self) -> bool {
        self.transparent
    }

    /// Adds its sums, and its count of what could not be added, to a film of the same pixels.
    ///
    /// # Errors
    /// If it is damaged; nothing has then been added.
    ///
    /// # Panics
    /// If the film has other pixels, or `coverage` is there and the file's is not or the other way round.
    pub fn add_to(self, film: &Film, coverage: Option<&Coverage>) -> Result<(), CheckpointError> {
        assert!(self.header.crop == film.crop() && self.transparent == coverage.is_some(), "sums of another image");
        let damaged = |error: ::exr::error::Error| CheckpointError::Damaged(error.to_string());
        let layers = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let image = layers.all_attributes().non_parallel().from_chunks(self.chunks).map_err(damaged)?;
        let channels = image.layer_data.channel_data;
        if checksum(&self.header, &self.header.attributes(), &channels) != self.checksum {
            return Err(CheckpointError::Damaged("its checksum is another".to_owned()));
        }
        let words = |name: String| {
            let channel = channels.list.iter().find(|channel| channel.name.as_slice() == name.as_bytes());
            match channel.map(|channel| &channel.sample_data) {
                Some(FlatSamples::U32(words)) if words.len() == film.pixels() => Ok(words),
                _ => Err(CheckpointError::Damaged(format!("channel {name} has no integers"))),
            }
        };
        for sum in Sum::all(self.transparent) {
            let (high, low) = (words(format!("{}.high", sum.name()))?, words(format!("{}.low", sum.name()))?);
            for (pixel, (high, low)) in high.iter().zip(low).enumerate() {
                let value = u64::from(*high) << 32 | u64::from(*low);
                match (sum, coverage) {
                    (Sum::Light(half, channel), _) => film.add_sum(half, pixel, channel, value),
                    (Sum::Coverage(channel), Some(coverage)) => coverage.add_sum(pixel, channel, value),
                    (Sum::Coverage(_), None) => {}
                }
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
