//! Any bytes as an environment map: read, or refused in one line.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pathspace::io::{self, Limits};

fuzz_target!(|bytes: &[u8]| {
    let limits = Limits { environment_texels: 1 << 16, ..Limits::default() };
    match io::read_environment(&limits, bytes, "fuzzed", 1.0, 0.5) {
        Ok(sky) => assert!(sky.warnings.iter().all(|warning| !warning.contains(char::is_control))),
        Err(error) => assert!(!error.to_string().contains(char::is_control), "{error}"),
    }
});
