//! Environment maps made by hand, good and bad.
#![expect(clippy::print_stderr, reason = "what a test could not look at must be said")]

use std::{io::Cursor, path::Path};

use exr::prelude::WritableImage;
use glam::Vec3;

use crate::{
    io::{
        EnvironmentError, Limits, LoadedEnvironment,
        environment::{load_environment, read_environment},
    },
    math::Rgb,
};

/// A Radiance file without compression whose pixels are all `rgbe`, but for the one at (x, y).
fn radiance_file(width: usize, height: usize, rgbe: [u8; 4], (x, y, other): (usize, usize, [u8; 4])) -> Vec<u8> {
    let mut file = format!("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for i in 0..width * height {
        file.extend(if i == y * width + x { other } else { rgbe });
    }
    file
}

/// An OpenEXR file with this colour everywhere but in one pixel.
fn openexr_file(width: usize, height: usize, colour: Rgb, (x, y, other): (usize, usize, Rgb)) -> Vec<u8> {
    let pixel = |at: exr::math::Vec2<usize>| {
        let c = if (at.x(), at.y()) == (x, y) { other } else { colour };
        (c.x, c.y, c.z)
    };
    let image = exr::image::Image::from_channels((width, height), exr::image::SpecificChannels::rgb(pixel));
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file).unwrap();
    file.into_inner()
}

fn read(bytes: &[u8]) -> Result<LoadedEnvironment, EnvironmentError> {
    read_environment(&Limits::default(), bytes, "sky", 1.0, 0.0)
}

/// The direction of the middle of the texel (x, y) of a map of this size.
fn middle(x: usize, y: usize, width: usize, height: usize) -> Vec3 {
    let phi = std::f32::consts::TAU * ((x as f32 + 0.5) / width as f32 - 0.5);
    let theta = std::f32::consts::PI * (y as f32 + 0.5) / height as f32;
    Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
}

#[test]
fn both_formats_hold_the_same_map() {
    // 0.5, 1 and 2 with the exponent of 2.
    let dim = [32, 64, 128, 130];
    let bright = [0, 0, 128, 140];
    let files = [
        radiance_file(8, 4, dim, (5, 1, bright)),
        openexr_file(8, 4, Rgb::new(0.5, 1.0, 2.0), (5, 1, Rgb::new(0.0, 0.0, 2048.0))),
    ];
    for file in files {
        let loaded = read(&file).unwrap();
        assert_eq!(loaded.warnings, Vec::<String>::new());
        let at = |x, y| loaded.map.radiance(middle(x, y, 8, 4));
        assert!((at(2, 2) - Rgb::new(0.5, 1.0, 2.0)).length() < 1e-5, "{}", at(2, 2));
        assert!((at(5, 1) - Rgb::new(0.0, 0.0, 2048.0)).length() < 0.1, "{}", at(5, 1));
        let scaled = read_environment(&Limits::default(), &file, "sky", 4.0, 0.0).unwrap();
        assert!((scaled.map.radiance(middle(2, 2, 8, 4)) - Rgb::new(2.0, 4.0, 8.0)).length() < 1e-4);
        assert_eq!(scaled.hash, loaded.hash);
    }
}

#[test]
fn what_is_odd_is_said() {
    let square = read(&radiance_file(4, 4, [9, 9, 9, 128], (0, 0, [9, 9, 9, 128]))).unwrap();
    assert!(square.warnings.len() == 1 && square.warnings[0].contains("4 × 4"), "{:?}", square.warnings);
    let negative = read(&openexr_file(8, 4, Rgb::ONE, (3, 2, Rgb::new(-0.25, 1.0, 1.0)))).unwrap();
    let said = &negative.warnings;
    assert!(said.len() == 1 && said[0].contains("1 pixels") && said[0].contains("column 3, row 2"), "{said:?}");
    assert!(negative.map.radiance(middle(3, 2, 8, 4)).x < 1e-6);
}

#[test]
fn each_fault_is_a_sentence() {
    let whole = radiance_file(8, 4, [9, 9, 9, 128], (0, 0, [9, 9, 9, 128]));
    let nan = openexr_file(8, 4, Rgb::ONE, (3, 2, Rgb::new(f32::NAN, 1.0, 1.0)));
    let infinite = openexr_file(8, 4, Rgb::ONE, (7, 3, Rgb::new(1.0, f32::INFINITY, 1.0)));
    let huge = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n".to_vec();
    let exr = openexr_file(8, 4, Rgb::ONE, (0, 0, Rgb::ONE));
    let negative_infinity = openexr_file(8, 4, Rgb::ONE, (1, 1, Rgb::new(1.0, f32::NEG_INFINITY, 1.0)));
    for (file, parts) in [
        (Vec::new(), &["neither"][..]),
        (b"\x89PNG".to_vec(), &["neither"]),
        (whole[..whole.len() - 5].to_vec(), &["cannot be decoded"]),
        (whole[..20].to_vec(), &["cannot be decoded"]),
        (exr[..exr.len() - 20].to_vec(), &["cannot be decoded"]),
        (exr[..30].to_vec(), &["cannot be decoded"]),
        (nan, &["column 3, row 2", "NaN"]),
        (infinite, &["column 7, row 3", "inf"]),
        (negative_infinity, &["column 1, row 1", "inf"]),
        (huge, &["60000 × 60000", "scale it down"]),
    ] {
        let error = read(&file).unwrap_err().to_string();
        assert!(error.starts_with("sky") && !error.contains('\n'), "{error}");
        assert!(parts.iter().all(|part| error.contains(part)), "{parts:?}: {error}");
    }
    let bright = read_environment(&Limits::default(), &whole, "sky", 1e32, 0.0).unwrap_err().to_string();
    assert!(bright.contains("column 0, row 0") && bright.contains("after scaling"), "{bright}");
    assert!(load_environment(Path::new("nowhere.hdr"), 1.0, 0.0).unwrap_err().to_string().starts_with("cannot read"));
}

#[test]
fn files_cut_short_anywhere_are_refused_without_a_panic() {
    for file in
        [radiance_file(8, 4, [9, 9, 9, 128], (0, 0, [2, 2, 0, 8])), openexr_file(8, 4, Rgb::ONE, (0, 0, Rgb::ONE))]
    {
        for end in 0..file.len() {
            assert!(read(&file[..end]).is_err(), "{end} of {} bytes", file.len());
        }
    }
}

#[test]
fn public_maps_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/public/hdr");
    let mut seen = 0;
    for name in ["studio.hdr", "sunset.hdr", "royal_esplanade_256.hdr", "venice_sunset_256.hdr"] {
        let path = folder.join(name);
        if !path.is_file() {
            eprintln!("NOT TESTED: there is no {}", path.display());
            continue;
        }
        let loaded = load_environment(&path, 1.0, 0.0).unwrap();
        let mean = loaded.map.integral() / (4.0 * std::f32::consts::PI);
        eprintln!("{name}: mean luminance {mean:.3}, brightest {:.1}, {:?}", loaded.map.brightest(), loaded.warnings);
        assert!((0.01..10.0).contains(&mean) && loaded.map.brightest() > mean, "{name}: {mean}");
        seen += 1;
    }
    let windows = folder.join("openexr-images/DisplayWindow/t02.exr");
    if seen == 4 && windows.is_file() {
        let error = load_environment(&windows, 1.0, 0.0).unwrap_err().to_string();
        eprintln!("{error}");
    }
}
