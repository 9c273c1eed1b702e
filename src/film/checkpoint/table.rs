//! The sums that the words of a film do not hold, as a table in channels of its own.

use std::{collections::BTreeMap, iter};

use super::CheckpointError;
use crate::film::ExactSum;

/// A sum of light by its number in the order of names, the pixel, and what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) sum: u32,
    pub(super) pixel: u32,
    pub(super) value: ExactSum,
}

/// Words of 32 bits in an entry.
const WORDS: usize = 2 + 2 * ExactSum::WORDS;

/// The name of a channel before its number.
const NAME: &str = "wide.";

fn name(number: u64) -> String {
    // In the order of their names, whatever their number.
    format!("{NAME}{number:05}")
}

/// The channels of `entries` in an image of so many pixels: one entry after the other, and zeros behind the last.
pub(super) fn channels(entries: &[Entry], pixels: usize) -> impl Iterator<Item = (String, Vec<u32>)> {
    let words = |entry: &Entry| {
        let value = entry.value.words().into_iter().flat_map(|word| [word as u32, (word >> 32) as u32]);
        [entry.sum, entry.pixel].into_iter().chain(value)
    };
    let mut words = entries.iter().flat_map(words);
    (0..count(entries.len() as u64, pixels as u64))
        .map(move |number| (name(number), words.by_ref().chain(iter::repeat(0)).take(pixels).collect()))
}

/// How many channels so many entries take.
fn count(entries: u64, pixels: u64) -> u64 {
    entries.saturating_mul(WORDS as u64).div_ceil(pixels)
}

/// Takes the names of the table's channels out of all `names`; `None` if they are not those of so many entries.
pub(super) fn without_channels(mut names: Vec<String>, entries: u64, pixels: u64) -> Option<Vec<String>> {
    let all = names.len();
    names.retain(|name| !name.starts_with(NAME));
    let own = (all - names.len()) as u64;
    // Their names are looked at when the table is read.
    (own == count(entries, pixels)).then_some(names)
}

/// Reads `entries` of them, of the first `sums` sums, from the file's channels.
pub(super) fn read(
    samples: &BTreeMap<String, &Vec<u32>>,
    entries: u64,
    sums: usize,
    pixels: usize,
) -> Result<Vec<Entry>, CheckpointError> {
    let damaged = |what: &str| CheckpointError::Damaged(format!("its table of wide sums {what}"));
    let mut words = Vec::new();
    for number in 0..count(entries, pixels as u64) {
        words.push(samples.get(&name(number)).ok_or_else(|| damaged("lacks a channel"))?.iter().copied());
    }
    let mut words = words.into_iter().flatten();
    let mut table: Vec<Entry> = Vec::new();
    for _ in 0..entries {
        let Some(words) = next(&mut words) else { return Err(damaged("is too short")) };
        let [sum, pixel, ..] = words;
        let value = std::array::from_fn(|i| u64::from(words[2 + 2 * i]) | u64::from(words[3 + 2 * i]) << 32);
        let after = table.last().is_none_or(|last| (last.sum, last.pixel) < (sum, pixel));
        if sum as usize >= sums || pixel as usize >= pixels || !after {
            return Err(damaged("has an entry for no sum"));
        }
        table.push(Entry { sum, pixel, value: ExactSum::from_words(value) });
    }
    Ok(table)
}

fn next(words: &mut impl Iterator<Item = u32>) -> Option<[u32; WORDS]> {
    let mut entry = [0; WORDS];
    for word in &mut entry {
        *word = words.next()?;
    }
    Some(entry)
}
