//! Any bytes as a scene file: read at rest and at a time, and built into a scene, or refused in one line.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use pathspace::io::{self, Limits, LoadOptions, PosedAt};

fuzz_target!(|bytes: &[u8]| {
    // Small enough to be fast: what is refused at the limits is tested elsewhere.
    let limits = Limits {
        texels: 1 << 16,
        vertices: 1 << 14,
        zeros: 1 << 12,
        triangles: 1 << 14,
        instances: 1 << 12,
        ..Limits::default()
    };
    for at in [None, Some(PosedAt { seconds: 0.5, animation: None })] {
        let options = LoadOptions { limits, at, ..LoadOptions::default() };
        // A folder in which there is nothing to point to.
        match io::read(bytes, Path::new("/nowhere"), "fuzzed", &options) {
            Ok(loaded) => {
                assert!(loaded.warnings.iter().all(|warning| !warning.contains(char::is_control)));
                let camera = loaded.geometry.bounds().map_or_else(Default::default, |bounds| bounds.max);
                assert!(camera.is_finite());
            }
            Err(error) => assert!(!error.to_string().contains(char::is_control), "{error}"),
        }
    }
});
