//! Any bytes as a checkpoint or shard: added to a film, or refused in one line.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use pathspace::{
    film::{AlphaSums, CheckpointFile, Film, FixedPoint, Sums},
    sampling::Filter,
};

fuzz_target!(|bytes: &[u8]| {
    let added = CheckpointFile::from_reader(Cursor::new(bytes)).and_then(|file| {
        let (sensor, crop, contents) = (file.header().sensor, file.header().crop, file.contents().clone());
        // As `merge` does: what is too large is refused by the header.
        if file.bytes() > 1 << 21 {
            return Ok(());
        }
        let film = || Film::new(sensor, crop, Filter::Box, FixedPoint::with_exponent(-40));
        let (image, layers) = (film(), contents.layers.iter().map(|_| film()).collect::<Vec<_>>());
        let alpha_sums = contents.transparent.then(|| AlphaSums::new(crop, Filter::Box));
        let layers = contents.layers.iter().map(String::as_str).zip(&layers).collect();
        file.add_to(&Sums { film: &image, alpha_sums: alpha_sums.as_ref(), layers })
    });
    if let Err(error) = added {
        assert!(!error.to_string().contains(char::is_control), "{error}");
    }
});
