//! Checkpoints and shards: the film's exact sums as OpenEXR files, so that a render can be stopped, continued and put
//! together from parts without a bit changing.
//!
//! Such a file is an ordinary OpenEXR image of uncompressed 32-bit unsigned integers. A sum is written with 96 bits of
//! two's complement in three channels, `even.R.high`, `even.R.low` and `even.R.fine` for the red of the half image of
//! the even passes, and so on, of which the first two count the quanta of `pathspace.state.quantum`; with a transparent
//! background `coverage.all` and `coverage.hit` of 64 bits join them, and `layer.NAME.even.R` and so on for each layer.
//!
//! A sum that needs other bits is zero there, and an entry of a table: its number among the sums of light in the order
//! of their names, that of its pixel, and its 320 bits in units of 2⁻¹⁴⁹, the lowest word first. The table's
//! `pathspace.state.wide-sums` entries stand one after the other in the pixels of as many channels `wide.00000` and on
//! as they take, in the order of sums and pixels.
//!
//! The windows are those of the image. The attributes `pathspace.NAME` are those that the image will have as well,
//! whatever the number of samples; `pathspace.state.NAME` say which passes these are and what was counted in them, with
//! a checksum over all of it.

mod header;
mod sums;
mod table;

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
    header::{CHECKSUM, ENTRIES, LAYOUT, STATE, parse},
    sums::{Sum, words},
    table::Entry,
};
use super::{
    Crop, Film, Header,
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
    /// It is one of another version, whose layout has this number.
    #[error(
        "another version of pathspace wrote it (its layout has number {0}, and this version reads {reads}): let that \
         version \
         finish it, or render anew",
        reads = LAYOUT
    )]
    OtherLayout(u32),
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
/// If a layer or the alpha channel has other pixels than the film.
pub fn encode_checkpoint(sums: &Sums<'_>, header: &CheckpointHeader) -> io::Result<Vec<u8>> {
    let pixels = sums.film.pixels();
    if u32::try_from(pixels).is_err() {
        return Err(io::Error::other("it has more pixels than a table of sums can name"));
    }
    let mut channels = SmallVec::new();
    let mut add = |name: &str, words: Vec<u32>| channels.push(AnyChannel::new(name, FlatSamples::U32(words)));
    let mut wide = Vec::new();
    let mut number = 0..;
    for (name, sum) in sums.all() {
        let samples: Vec<Vec<u32>> = match sum {
            Sum::Light(light) => {
                let sum = number.next().unwrap_or(u32::MAX);
                let mut narrow = |pixel| {
                    sums.units(light, pixel, header.scale).unwrap_or_else(|| {
                        wide.push(Entry { sum, pixel: pixel as u32, value: sums.light(light, pixel) });
                        0
                    })
                };
                split((0..pixels).map(&mut narrow), [64, 32, 0])
            }
            Sum::Alpha(channel) => {
                let value = |pixel| sums.alpha_sums.map_or(0, |alpha_sums| alpha_sums.sum(pixel, channel));
                split((0..pixels).map(|pixel| value(pixel).into()), [32, 0])
            }
        };
        for (name, samples) in words(&name, sum).zip(samples) {
            add(&name, samples);
        }
    }
    table::channels(&wide, pixels).for_each(|(name, words)| add(&name, words));
    let channels = AnyChannels::sort(channels);
    let mut attributes = header.attributes();
    attributes.insert(format!("{STATE}{ENTRIES}"), wide.len().to_string());
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

/// The words that begin with these bits, for all values.
fn split<const WORDS: usize>(values: impl Iterator<Item = i128>, shifts: [u32; WORDS]) -> Vec<Vec<u32>> {
    let mut split = vec![Vec::with_capacity(values.size_hint().0); WORDS];
    for value in values {
        split.iter_mut().zip(shifts).for_each(|(words, shift)| words.push((value >> shift) as u32));
    }
    split
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
    /// Of its table of wide sums.
    entries: u64,
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
        let (header, entries, checksum) = parse(only)?;
        let names = only.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        let contents = table::without_channels(names, entries, header.crop.pixels())
            .and_then(Contents::of)
            .ok_or_else(|| CheckpointError::Foreign("its channels are not those of a film".to_owned()))?;
        Ok(Self { header, checksum, contents, entries, chunks })
    }

    /// What it says besides the sums.
    pub fn header(&self) -> &CheckpointHeader {
        &self.header
    }

    /// Which sums it has besides the image's.
    pub fn contents(&self) -> &Contents {
        &self.contents
    }

    /// What reading it takes beside the film, and what its wide sums may add to that, in bytes.
    pub fn bytes(&self) -> u64 {
        let each = size_of::<Entry>() as u64 + Film::WIDEST_SUM;
        self.contents.bytes(self.header.crop.pixels()).saturating_add(self.entries.saturating_mul(each))
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
        let mut attributes = self.header.attributes();
        attributes.insert(format!("{STATE}{ENTRIES}"), self.entries.to_string());
        if checksum(&self.header, &attributes, &channels) != self.checksum {
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
        let all = sums.all();
        let mut words_of = Vec::new();
        for (name, sum) in &all {
            let found = words(name, *sum).map(|word| samples.get(&word).copied()).collect::<Option<Vec<_>>>();
            words_of.push(found.ok_or_else(|| CheckpointError::Damaged(format!("there is no channel {name}")))?);
        }
        let lights = all.iter().filter_map(|(_, sum)| if let Sum::Light(light) = sum { Some(*light) } else { None });
        let lights: Vec<_> = lights.collect();
        let table = table::read(&samples, self.entries, lights.len(), film.pixels())?;
        for ((_, sum), words) in all.iter().zip(words_of) {
            match (sum, &words[..]) {
                (Sum::Light(light), [high, low, fine]) => {
                    for (pixel, ((high, low), fine)) in high.iter().zip(*low).zip(*fine).enumerate() {
                        let units = i128::from(*high as i32) << 64 | i128::from(*low) << 32 | i128::from(*fine);
                        if units != 0 {
                            sums.add_units(*light, pixel, units, self.header.scale);
                        }
                    }
                }
                (Sum::Alpha(channel), [high, low]) => {
                    for (pixel, (high, low)) in high.iter().zip(*low).enumerate() {
                        let value = u64::from(*high) << 32 | u64::from(*low);
                        sums.alpha_sums.iter().for_each(|alpha_sums| alpha_sums.add_sum(pixel, *channel, value));
                    }
                }
                _ => return Err(CheckpointError::Damaged("a sum has other words".to_owned())),
            }
        }
        for Entry { sum, pixel, value } in table {
            sums.add_light(lights[sum as usize], pixel as usize, value);
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
