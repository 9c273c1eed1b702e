//! Any bytes as a checkpoint or shard: added to a film, or refused in one line.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use pathspace::{
    film::{CheckpointFile, Coverage, Film, FixedPoint},
    sampling::Filter,
};

fuzz_target!(|bytes: &[u8]| {
    let added = CheckpointFile::from_reader(Cursor::new(bytes)).and_then(|file| {
        let (sensor, crop) = (file.header().sensor, file.header().crop);
        // As `merge` does: what is too large is refused by the header.
        if crop.pixels() > 1 << 14 {
            return Ok(());
        }
        let film = Film::new(sensor, crop, Filter::Box, FixedPoint::with_exponent(-40));
        let coverage = file.is_transparent().then(|| Coverage::new(crop, Filter::Box));
        file.add_to(&film, coverage.as_ref())
    });
    if let Err(error) = added {
        assert!(!error.to_string().contains(char::is_control), "{error}");
    }
});
