use std::ops::Range;

use glam::Vec2;

use super::*;
use crate::{
    film::{Coverage, DepositErrors, Film, FixedPoint, Half, Image},
    math::Rgb,
    sampling::{Filter, Independent, Sampler, Stream},
    scene::camera::{Raster, Sensor},
};

const CROP: Crop = Crop { x0: 2, y0: 1, x1: 9, y1: 6 };
const SENSOR: Sensor = Sensor { width: 9, height: 7, padding: 0 };

/// What is in memory of a render.
struct Rendered {
    film: Film,
    coverage: Coverage,
    /// Two layers, in an order that is not that of their names.
    layers: [(&'static str, Film); 2],
}

impl Rendered {
    fn sums(&self) -> Sums<'_> {
        let layers = self.layers.iter().map(|(name, film)| (*name, film)).collect();
        Sums { film: &self.film, coverage: Some(&self.coverage), layers }
    }

    fn image(&self) -> Image {
        self.film.image(2)
    }
}

/// Samples of the passes, some of them faulty.
fn rendered(passes: Range<u32>) -> Rendered {
    let film = || Film::new(SENSOR, CROP, Filter::Box, FixedPoint::with_exponent(-40));
    let layers = [("red", film()), ("Bounces.1", film())];
    let Rendered { film, coverage, layers } =
        Rendered { film: film(), coverage: Coverage::new(CROP, Filter::Box), layers };
    for pass in passes {
        for i in 0..200 {
            let mut sampler = Independent::new(3, i, pass, Stream::Camera);
            let place = Raster(sampler.next_2d() * Vec2::new(9.0, 7.0));
            let value = sampler.next_3d() * if i == 7 { -1.0 } else { 1e4 };
            film.deposit(place, value, Half::of_pass(pass));
            layers[i as usize % 2].1.deposit(place, value, Half::of_pass(pass));
            coverage.deposit(place, 0.25);
        }
    }
    Rendered { film, coverage, layers }
}

fn header(passes: Range<u32>) -> CheckpointHeader {
    let settings = [("scene", "0123"), ("only-strategy", "1,2 weighted"), ("environment", "é 'x'")];
    let text = |(name, value): (&str, &str)| (name.to_owned(), value.to_owned());
    let errors = DepositErrors { negative: passes.len() as u64, ..DepositErrors::default() };
    let counts = BTreeMap::from([text(("samples", "12")), text(("empty", ""))]);
    let settings = settings.into_iter().map(text).collect();
    CheckpointHeader { sensor: SENSOR, crop: CROP, settings, passes, whole: Some(9), errors, counts }
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

#[test]
fn parts_add_up_to_the_whole_to_the_bit() {
    let (whole, parts) = (rendered(0..9), rendered(0..0));
    for part in [3..7, 0..3, 9..9, 7..9] {
        let file = open(&bytes(part.clone())).unwrap();
        assert_eq!((file.header(), file.contents()), (&header(part), &whole.sums().contents()));
        file.add_to(&parts.sums()).unwrap();
    }
    let all = |rendered: &Rendered| {
        let sums = rendered.sums();
        let pixels = 0..sums.film.pixels();
        let all = sums.all().into_iter().flat_map(|(_, sum)| pixels.clone().map(move |i| (sum, i)));
        all.map(|(sum, i)| sums.get(sum, i)).collect::<Vec<_>>()
    };
    assert_eq!(all(&whole), all(&parts));
    assert!(all(&whole).iter().any(|sum| *sum > u64::from(u32::MAX)), "high words are needed");
    let film = parts.film;
    assert_eq!(film.errors(), whole.film.errors());
    assert_eq!(film.image(9).pixels.len(), 35);
    assert!(film.image(9).mean().min_element() > 1.0, "{}", Rgb::ONE);
    let [red, other] = parts.layers.map(|(_, film)| film.image(9).mean());
    assert!((red + other - film.image(9).mean()).abs().max_element() < 1e-3 && red != other);
}

#[test]
fn a_layer_is_never_taken_for_another_sum() {
    let film = || Film::new(SENSOR, CROP, Filter::Box, FixedPoint::with_exponent(-40));
    for name in ["even", "coverage", "coverage.all", "layer.even", "a.even.R.low", "Z", "ä"] {
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
    Sums { film, coverage: None, layers: layers.to_vec() }
}

#[test]
fn sums_that_wrap_around_in_adding_are_counted() {
    let full = || {
        let film = Film::new(SENSOR, CROP, Filter::Box, FixedPoint::with_exponent(0));
        (0..9).for_each(|_| film.deposit(Raster(Vec2::splat(3.5)), Rgb::X * 2.0_f32.powi(59), Half::Odd));
        film
    };
    let film = full();
    let bytes = encode_checkpoint(&sums(&full(), &[]), &header(1..2)).unwrap();
    for wraps in [0, 0, 1] {
        let before = film.errors().overflow;
        open(&bytes).map(|file| file.add_to(&sums(&film, &[]))).unwrap().unwrap();
        assert_eq!(film.errors().overflow - before, wraps, "9 · 2⁵⁹ four times pass 2⁶⁴ once");
    }
}

#[test]
fn the_same_sums_are_the_same_file_of_integers() {
    let file = bytes(0..2);
    assert!((0..8).all(|_| file == bytes(0..2)), "hash maps have their own order each time");
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_buffered(Cursor::new(&file)).unwrap();
    let names: Vec<_> = image.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names.len(), 16 + 2 * 12);
    assert!(names.contains(&"even.R.high".to_owned()) && names.contains(&"coverage.hit.low".to_owned()));
    assert!(names.contains(&"layer.Bounces.1.odd.B.low".to_owned()));
    assert!(image.layer_data.channel_data.list.iter().all(|c| matches!(c.sample_data, FlatSamples::U32(_))));
}

#[test]
fn damage_is_noticed_wherever_it_is() {
    let whole = bytes(0..2);
    assert!(add(&whole).is_ok());
    // Every byte of the header, and some of the sums. An attribute of another program's may change unnoticed; no sum may.
    let header_end = whole.len() - 35 * 40 * 4;
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
