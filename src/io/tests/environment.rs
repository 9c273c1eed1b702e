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
        (c.r(), c.g(), c.b())
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
        assert!((at(2, 2) - Rgb::new(0.5, 1.0, 2.0)).abs().element_sum() < 1e-5, "{}", at(2, 2));
        assert!((at(5, 1) - Rgb::new(0.0, 0.0, 2048.0)).abs().element_sum() < 0.1, "{}", at(5, 1));
        let scaled = read_environment(&Limits::default(), &file, "sky", 4.0, 0.0).unwrap();
        assert!((scaled.map.radiance(middle(2, 2, 8, 4)) - Rgb::new(2.0, 4.0, 8.0)).abs().element_sum() < 1e-4);
        assert_eq!(scaled.hash, loaded.hash);
    }
}

/// A Radiance file of one colour whose header has these lines.
fn radiance_with(lines: &str, rgbe: [u8; 4]) -> Vec<u8> {
    let file = radiance_file(8, 4, rgbe, (0, 0, rgbe));
    let rest = file.iter().position(|byte| *byte == b'\n').unwrap();
    [b"#?RADIANCE\n", lines.as_bytes(), &file[rest..]].concat()
}

/// An OpenEXR file of one colour that states these chromaticities.
fn openexr_with(colour: Rgb, [rx, ry, gx, gy, bx, by, wx, wy]: [f32; 8]) -> Vec<u8> {
    use exr::{image::Image, math::Vec2, meta::attribute::Chromaticities};
    let channels = exr::image::SpecificChannels::rgb(|_: Vec2<usize>| (colour.r(), colour.g(), colour.b()));
    let mut image = Image::from_channels((8, 4), channels);
    image.attributes.chromaticities =
        Some(Chromaticities { red: Vec2(rx, ry), green: Vec2(gx, gy), blue: Vec2(bx, by), white: Vec2(wx, wy) });
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file).unwrap();
    file.into_inner()
}

const REC_2020: [f32; 8] = [0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290];

/// What a map of one colour holds.
fn only_colour(file: &[u8]) -> (Rgb, Vec<String>) {
    let loaded = read(file).unwrap_or_else(|error| panic!("{error}"));
    (loaded.map.radiance(middle(3, 2, 8, 4)), loaded.warnings)
}

#[test]
fn primaries_are_honoured() {
    // (0.1, 0.8, 0.2) of Rec. 709 in Rec. 2020 (ITU-R BT.2087-0, annex 2), and D65's XYZ.
    let green = Rgb::new(0.334_6, 0.744_9, 0.251_2);
    let (found, said) = only_colour(&openexr_with(green, REC_2020));
    assert!((found - Rgb::new(0.1, 0.8, 0.2)).abs().max_element() < 1e-3 && said.is_empty(), "{found}, {said:?}");
    let xyz = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0];
    let (found, said) = only_colour(&openexr_with(Rgb::new(0.950_456, 1.0, 1.089_058), xyz));
    assert!((found - Rgb::ONE).abs().max_element() < 2e-3 && said.is_empty(), "{found}, {said:?}");
    let rec_709 = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290];
    assert_eq!(only_colour(&openexr_with(green, rec_709)), (green, vec![]));

    // 86, 191 and 64 in 256: the same green in the eight bits of a Radiance file.
    let primaries = "PRIMARIES=0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290";
    let (found, said) = only_colour(&radiance_with(primaries, [86, 191, 64, 128]));
    assert!((found - Rgb::new(0.1, 0.8, 0.2)).abs().max_element() < 0.01 && said.is_empty(), "{found}, {said:?}");
    let file = radiance_with("SOFTWARE=any", [122, 128, 139, 129]);
    let text = String::from_utf8_lossy(&file);
    assert!(text.contains("_rgbe"));
    let at = file.windows(5).position(|w| w == b"_rgbe").unwrap();
    let file = [&file[..at], b"_xyze", &file[at + 5..]].concat();
    let (found, said) = only_colour(&file);
    assert!((found - Rgb::ONE).abs().max_element() < 0.02 && said.is_empty(), "{found}, {said:?}");
}

#[test]
fn corrections_are_undone() {
    // 0.5, 0.25 and 0.125.
    let stored = [128, 64, 32, 128];
    let cases = [
        ("COLORCORR=2.0 1.0 0.5", Rgb::new(0.25, 0.25, 0.25)),
        ("COLORCORR=2 1 1\nCOLORCORR=1 2 1", Rgb::new(0.25, 0.125, 0.125)),
        ("GAMMA=2", Rgb::new(0.25, 0.0625, 0.015_625)),
        ("GAMMA=2\nCOLORCORR=0.5 1 1", Rgb::new(0.5, 0.0625, 0.015_625)),
        ("GAMMA=1\nPRIMARIES=0 0 0 0 0 0 0 0", Rgb::new(0.5, 0.25, 0.125)),
        ("GAMMA=1.0\nSOFTWARE=whatever=1", Rgb::new(0.5, 0.25, 0.125)),
    ];
    for (lines, expected) in cases {
        let (found, said) = only_colour(&radiance_with(lines, stored));
        assert!((found - expected).abs().max_element() < 1e-5 && said.is_empty(), "{lines}: {found}, {said:?}");
    }
    let (found, said) = only_colour(&radiance_with("EXPOSURE=2\nEXPOSURE=2", stored));
    assert!(found == Rgb::new(0.5, 0.25, 0.125) && said[0].contains("--env-scale 0.25"), "{found}, {said:?}");
}

#[test]
fn colours_that_rec_709_lacks_are_counted() {
    let (found, said) = only_colour(&openexr_with(Rgb::new(0.0, 1.0, 0.0), REC_2020));
    assert!(found.min_element() == 0.0 && found.g() > 1.0, "{found}");
    assert!(said.len() == 1 && said[0].contains("32 pixels") && said[0].contains("gamut"), "{said:?}");
}

#[test]
fn headers_that_say_nothing_usable_are_refused() {
    let chromaticities = openexr_with(Rgb::ONE, [0.64, 0.33, 0.64, 0.33, 0.15, 0.06, 0.3127, 0.3290]);
    let radiance = |lines| radiance_with(lines, [1, 1, 1, 128]);
    let cases = [
        (chromaticities, "chromaticities cannot be used"),
        (radiance("PRIMARIES=0.64 0.33"), "“PRIMARIES=0.64 0.33” cannot be used: it has eight numbers"),
        (radiance("PRIMARIES=0.6 0.3 0.6 0.3 0.1 0.1 0.3 0.3"), "cannot be used: its primaries"),
        (radiance("COLORCORR=1 1"), "three positive numbers"),
        (radiance("COLORCORR=0 1 1"), "three positive numbers"),
        (radiance("GAMMA=-2.2"), "positive"),
        (radiance("GAMMA=nan"), "positive"),
        (radiance("EXPOSURE=bright"), "positive"),
        (radiance("FORMAT=64-bit"), "32-bit_rle_rgbe"),
    ];
    for (file, expected) in cases {
        let error = read(&file).unwrap_err().to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
    }
}

#[test]
fn what_is_odd_is_said() {
    let square = read(&radiance_file(4, 4, [9, 9, 9, 128], (0, 0, [9, 9, 9, 128]))).unwrap();
    assert!(square.warnings.len() == 1 && square.warnings[0].contains("4 × 4"), "{:?}", square.warnings);
    let negative = read(&openexr_file(8, 4, Rgb::ONE, (3, 2, Rgb::new(-0.25, 1.0, 1.0)))).unwrap();
    let said = &negative.warnings;
    assert!(said.len() == 1 && said[0].contains("1 pixels") && said[0].contains("column 3, row 2"), "{said:?}");
    assert!(negative.map.radiance(middle(3, 2, 8, 4)).r() < 1e-6);
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

/// Files that were reported, with what their light is.
#[test]
fn reported_maps_hold_the_light_that_they_say() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/reports");
    let green = Rgb::new(0.1, 0.8, 0.2);
    for (name, expected) in [("rec2020-green", green), ("709-green", green), ("xyz-d65", Rgb::ONE)] {
        let path = folder.join(format!("env-{name}.exr"));
        if !path.is_file() {
            eprintln!("NOT TESTED: there is no {}", path.display());
            continue;
        }
        let loaded = load_environment(&path, 1.0, 0.0).unwrap();
        let found = loaded.map.radiance(Vec3::new(0.6, 0.0, 0.8));
        assert!((found - expected).abs().max_element() < 2e-3 && loaded.warnings.is_empty(), "{name}: {found}");
    }
    let of = |name: &str| load_environment(&folder.join(format!("env-{name}.hdr")), 1.0, 0.0).ok();
    let Some(plain) = of("plain") else { return };
    // A texel's own place: a power of what lies between two is another number.
    let place = middle(2, 1, 16, 8);
    let plain = plain.map.radiance(place);
    for (name, expected) in [("colorcorr", plain * Rgb::new(0.5, 1.0, 1.0)), ("gamma", plain.map(|c| c.powf(2.2)))] {
        let found = of(name).unwrap().map.radiance(place);
        assert!((found - expected).abs().max_element() < 1e-5, "{name}: {found} for {expected}");
    }
    // It is white, and its white is D65.
    assert!((of("primaries").unwrap().map.radiance(place) - plain).abs().element_sum() < 1e-4);
}
