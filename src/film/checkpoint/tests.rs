use std::ops::Range;

use glam::Vec2;

use super::*;
use crate::{
    film::{AlphaSums, DepositErrors, ExactSum, FixedPoint, Half, Image},
    math::Rgb,
    sampling::{Filter, Independent, Sampler, Stream},
    scene::camera::{Raster, Sensor},
};

const CROP: Crop = Crop { x0: 2, y0: 1, x1: 9, y1: 6 };
const SENSOR: Sensor = Sensor { width: 9, height: 7, padding: 0 };

/// What is in memory of a render.
struct Rendered {
    film: Film,
    alpha_sums: AlphaSums,
    /// Two layers, in an order that is not that of their names.
    layers: [(&'static str, Film); 2],
}

impl Rendered {
    fn sums(&self) -> Sums<'_> {
        let layers = self.layers.iter().map(|(name, film)| (*name, film)).collect();
        Sums { film: &self.film, alpha_sums: Some(&self.alpha_sums), layers }
    }

    fn image(&self) -> Image {
        self.film.image(2)
    }
}

/// Samples of the passes, of all sizes and either sign, and one of them faulty.
fn rendered(passes: Range<u32>) -> Rendered {
    rendered_by(SCALE, passes)
}

const SCALE: i32 = -40;

/// The same with words elsewhere.
fn rendered_by(exponent: i32, passes: Range<u32>) -> Rendered {
    let film = || Film::new(SENSOR, CROP, Filter::Box, FixedPoint::with_exponent(exponent));
    let layers = [("red", film()), ("Bounces.1", film())];
    let Rendered { film, alpha_sums, layers } =
        Rendered { film: film(), alpha_sums: AlphaSums::new(CROP, Filter::Box), layers };
    for pass in passes {
        for i in 0..200 {
            let mut sampler = Independent::new(3, i, pass, Stream::Camera);
            let place = Raster(sampler.next_2d() * Vec2::new(9.0, 7.0));
            let factor = match i {
                7 => f32::NAN,
                8 => -1e25,
                9..12 => 1e-34,
                12 => 1e33,
                13..23 => -1.0,
                _ => 1e4,
            };
            let value = sampler.next_3d() * factor;
            film.deposit(place, value.into(), Half::of_pass(pass));
            layers[i as usize % 2].1.deposit(place, value.into(), Half::of_pass(pass));
            alpha_sums.deposit(place, 0.25);
        }
    }
    Rendered { film, alpha_sums, layers }
}

fn header(passes: Range<u32>) -> CheckpointHeader {
    let settings = [("scene", "0123"), ("only-strategy", "1,2 weighted"), ("environment", "é 'x'")];
    let text = |(name, value): (&str, &str)| (name.to_owned(), value.to_owned());
    let errors = DepositErrors { non_finite: passes.len() as u64, ..DepositErrors::default() };
    let counts = BTreeMap::from([text(("samples", "12")), text(("empty", ""))]);
    let settings = settings.into_iter().map(text).collect();
    let scale = FixedPoint::with_exponent(SCALE);
    CheckpointHeader { sensor: SENSOR, crop: CROP, settings, scale, passes, whole: Some(9), errors, counts }
}

fn bytes(passes: Range<u32>) -> Vec<u8> {
    encode_checkpoint(&rendered(passes.clone()).sums(), &header(passes)).unwrap()
}

fn open(bytes: &[u8]) -> Result<CheckpointFile, CheckpointError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    std::fs::write(&path, bytes).unwrap();
    CheckpointFile::open(&path)
}

/// What reading and adding to nothing does.
fn add(bytes: &[u8]) -> Result<Rendered, CheckpointError> {
    let empty = rendered(0..0);
    open(bytes)?.add_to(&empty.sums())?;
    Ok(empty)
}

/// All of a render's sums of light, and of its alpha channel.
fn all(rendered: &Rendered) -> (Vec<ExactSum>, Vec<u64>) {
    let of = |film: &Film| {
        let channels = (0..film.pixels()).flat_map(|pixel| [0, 1, 2].map(|channel| (pixel, channel)));
        channels.flat_map(|(p, c)| [Half::Even, Half::Odd].map(|half| film.sum(half, p, c))).collect::<Vec<_>>()
    };
    let films = [&rendered.film].into_iter().chain(rendered.layers.iter().map(|(_, film)| film));
    let alpha_sums =
        (0..rendered.film.pixels()).flat_map(|i| [0, 1].map(|channel| rendered.alpha_sums.sum(i, channel)));
    (films.flat_map(of).collect(), alpha_sums.collect())
}

#[test]
fn parts_add_up_to_the_whole_to_the_bit() {
    // Where the words of the part that is added to lie does not matter, nor in which sums are written.
    for exponent in [SCALE, -70, 20] {
        let (whole, parts) = (rendered(0..9), rendered_by(exponent, 0..0));
        for part in [3..7, 0..3, 9..9, 7..9] {
            let file = open(&bytes(part.clone())).unwrap();
            assert_eq!((file.header(), file.contents()), (&header(part.clone()), &whole.sums().contents()));
            assert_eq!(file.entries > 0, !part.is_empty(), "a table is needed");
            let plain = file.contents().bytes(35);
            assert_eq!(file.bytes(), plain + file.entries * (48 + Film::WIDEST_SUM));
            file.add_to(&parts.sums()).unwrap();
        }
        assert!(all(&whole) == all(&parts));
        let (film, [(_, red), (_, other)]) = (&parts.film, &parts.layers);
        assert_eq!(film.errors(), whole.film.errors());
        assert_eq!(film.image(9), whole.film.image(9));
        assert!(film.wide_memory() > 0 && film.image(9).mean().min_element() > 1e30);
        for (i, c) in (0..35).flat_map(|i| [0, 1, 2].map(|c| (i, c))) {
            let [film, red, other] = [film, red, other].map(|film| film.sum(Half::Odd, i, c));
            assert_eq!(red.checked_add(other), Some(film));
        }
    }
}

#[test]
fn a_file_does_not_depend_on_how_its_sums_were_made() {
    let (whole, parts) = (rendered(0..4), rendered(0..0));
    for part in [2..4, 0..2] {
        open(&bytes(part)).unwrap().add_to(&parts.sums()).unwrap();
    }
    assert!(encode_checkpoint(&parts.sums(), &header(0..4)).unwrap() == bytes(0..4));
    let elsewhere = rendered_by(3, 0..4);
    assert!(encode_checkpoint(&elsewhere.sums(), &header(0..4)).unwrap() == bytes(0..4));
    assert_eq!(whole.image(), elsewhere.image());
}

#[test]
fn a_layer_is_never_taken_for_another_sum() {
    let film = || Film::new(SENSOR, CROP, Filter::Box, FixedPoint::with_exponent(-40));
    for name in ["even", "coverage", "coverage.all", "layer.even", "a.even.R.low", "wide.00000", "Z", "ä"] {
        let (image, layer) = (film(), film());
        layer.deposit(Raster(Vec2::splat(3.5)), Rgb::ONE, Half::Even);
        let bytes = encode_checkpoint(&sums(&image, &[(name, &layer)]), &header(0..1)).unwrap();
        let file = open(&bytes).unwrap();
        assert_eq!(*file.contents(), Contents { transparent: false, layers: vec![name.to_owned()] });
        let (other_image, other_layer) = (film(), film());
        file.add_to(&sums(&other_image, &[(name, &other_layer)])).unwrap();
        assert_eq!((other_image.image(1), other_layer.image(1)), (image.image(1), layer.image(1)), "{name}");
    }
}

fn sums<'a>(film: &'a Film, layers: &[(&'a str, &'a Film)]) -> Sums<'a> {
    Sums { film, alpha_sums: None, layers: layers.to_vec() }
}

#[test]
fn sums_without_room_are_counted() {
    let film = || Film::new(SENSOR, CROP, Filter::Box, FixedPoint::with_exponent(0));
    let (full, sum) = (film(), film());
    full.add_sum(Half::Odd, 3, 1, ExactSum::shifted(1, 317));
    let bytes = encode_checkpoint(&sums(&full, &[]), &header(1..2)).unwrap();
    for overflows in [0, 0, 0, 1] {
        let before = sum.errors().overflow;
        open(&bytes).map(|file| file.add_to(&sums(&sum, &[]))).unwrap().unwrap();
        assert_eq!(sum.errors().overflow - before, overflows, "four times 2³¹⁷ pass 2³¹⁹ − 1 once");
    }
}

#[test]
fn other_layouts_are_said_to_be_such() {
    // The number of the layout, in the header of a file whose checksum nobody looks at yet.
    let mut file = bytes(0..1);
    let name = b"pathspace.state.layout\0string\0\x01\0\0\0";
    let place = file.windows(name.len()).position(|bytes| bytes == name).unwrap() + name.len();
    assert_eq!(file[place], b'2');
    file[place] = b'1';
    let error = open(&file).map(drop).unwrap_err();
    assert_eq!(error, CheckpointError::OtherLayout(1));
    let sentence = error.to_string();
    assert!(sentence.contains("number 1") && sentence.contains("reads 2"), "{sentence}");
}

#[test]
fn the_same_sums_are_the_same_file_of_integers() {
    let file = bytes(0..2);
    assert!((0..8).all(|_| file == bytes(0..2)), "hash maps have their own order each time");
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_buffered(Cursor::new(&file)).unwrap();
    let names: Vec<_> = image.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    let wide = names.iter().filter(|name| name.starts_with("wide.")).count();
    assert_eq!((names.len(), wide > 0), (wide + 4 + 3 * 18, true));
    assert!(names.contains(&"even.R.fine".to_owned()) && names.contains(&"coverage.hit.low".to_owned()));
    assert!(names.contains(&"layer.Bounces.1.odd.B.low".to_owned()));
    assert!(image.layer_data.channel_data.list.iter().all(|c| matches!(c.sample_data, FlatSamples::U32(_))));
}

#[test]
fn damage_is_noticed_wherever_it_is() {
    let whole = bytes(0..2);
    assert!(add(&whole).is_ok());
    // Every byte of the header, and some of the sums. An attribute of another program's may change unnoticed; no sum
    // may.
    let wide = open(&whole).unwrap().entries as usize;
    let header_end = whole.len() - 35 * (4 + 3 * 18) * 4 - (wide * 12).div_ceil(35) * 35 * 4;
    let places = (0..header_end).chain((header_end..whole.len()).step_by(37));
    let expected = add(&whole).unwrap().image();
    for place in places {
        let mut file = whole.clone();
        file[place] ^= 0x10;
        if let Ok(film) = std::panic::catch_unwind(|| open(&file).map(drop).and_then(|()| same_pixels(&file))).unwrap()
        {
            assert_eq!(film.image(), expected, "byte {place}");
        }
    }
    for length in (0..whole.len()).step_by(101) {
        assert!(add(&whole[..length]).is_err(), "the first {length} bytes");
    }
}

/// As [`add`], unless the file is of other pixels, which a caller refuses.
fn same_pixels(bytes: &[u8]) -> Result<Rendered, CheckpointError> {
    let file = open(bytes)?;
    let empty = rendered(0..0);
    if file.header().crop != CROP || *file.contents() != empty.sums().contents() {
        return Err(CheckpointError::Foreign("other pixels".to_owned()));
    }
    file.add_to(&empty.sums()).map(|()| empty)
}

#[test]
fn other_files_are_said_to_be_what_they_are() {
    let says = |bytes: &[u8]| open(bytes).map(drop).unwrap_err().to_string();
    for other in [&b""[..], b"\x89PNG\r\n\x1a\n", b"v/1\x01 but no OpenEXR file"] {
        assert!(says(other).contains("no checkpoint or shard"), "{}", says(other));
    }
    let image = rendered(0..1).film.image(1);
    let header = |attributes| Header { sensor: SENSOR, crop: CROP, attributes };
    let finished = vec![("spp".to_owned(), "1".to_owned())];
    let finished = crate::film::encode_exr(&image, None, &[], &[], &header(finished)).unwrap();
    assert!(says(&finished).contains("a finished image"), "{}", says(&finished));
    let strange = crate::film::encode_exr(&image, None, &[], &[], &header(Vec::new())).unwrap();
    assert!(says(&strange).contains("another program"), "{}", says(&strange));
    assert!(CheckpointFile::open(Path::new("/no/such")).is_err_and(|e| matches!(e, CheckpointError::Unreadable(_))));
}
