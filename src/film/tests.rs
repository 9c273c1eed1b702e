use std::thread;

use glam::Vec2;

use super::*;
use crate::sampling::{Independent, Sampler, Stream};

const SCALE: i32 = -30;

fn sensor(filter: Filter) -> Sensor {
    Sensor { width: 9, height: 6, padding: filter.padding() }
}

fn film(filter: Filter, crop: Option<Crop>) -> Film {
    let sensor = sensor(filter);
    Film::new(sensor, crop.unwrap_or(Crop::full(sensor)), filter, FixedPoint::with_exponent(SCALE))
}

/// Deposits all over the padded image and somewhat beyond it, the same ones for the same index.
fn deposit(film: &Film, i: u32) {
    let mut sampler = Independent::new(1, i, 0, Stream::Camera);
    let place = sampler.next_2d() * Vec2::new(14.0, 11.0) - Vec2::splat(2.5);
    film.deposit(Raster(place), (sampler.next_3d() * 3.0).into(), Half::of_pass(i));
}

#[test]
fn constant_radiance_is_constant_up_to_the_border() {
    for filter in Filter::ALL {
        let film = film(filter, None);
        let n = 16;
        let padding = filter.padding() as i32;
        let value = Rgb::new(0.25, 1.0, 3.0) / (n * n) as f32;
        for y in -padding * n..(6 + padding) * n {
            for x in -padding * n..(9 + padding) * n {
                let place = (Vec2::new(x as f32, y as f32) + 0.5) / n as f32;
                film.deposit(Raster(place), value, Half::Even);
            }
        }
        for pixel in film.image(1).pixels {
            assert!((pixel - Rgb::new(0.25, 1.0, 3.0)).abs().max_element() < 1e-3, "{filter}: {pixel}");
        }
    }
}

#[test]
fn the_box_filter_gives_a_sample_to_the_pixel_that_it_lies_in() {
    for (place, pixel) in [(Vec2::new(3.0, 2.0), (3, 2)), (Vec2::new(0.0, 5.999), (0, 5))] {
        let film = film(Filter::Box, None);
        film.deposit(Raster(place), Rgb::new(1.0, 2.0, 0.5), Half::Odd);
        let image = film.half_image(Half::Odd, 1);
        assert_eq!(image.get(pixel.0, pixel.1), Rgb::new(1.0, 2.0, 0.5));
        assert_eq!(image.mean() * 54.0, Rgb::new(1.0, 2.0, 0.5));
        assert_eq!(film.half_image(Half::Even, 1).mean(), Rgb::ZERO);
    }
    let film = film(Filter::Box, None);
    for outside in [Vec2::new(-1e-9, 1.0), Vec2::new(9.0, 1.0), Vec2::new(1.0, -3e38), Vec2::new(1.0, 3e38)] {
        film.deposit(Raster(outside), Rgb::ONE, Half::Even);
    }
    assert_eq!(film.image(1).mean(), Rgb::ZERO);
    assert!(film.errors().is_empty(), "other pixels are no error");
}

#[test]
fn order_and_threads_do_not_change_a_bit() {
    for filter in Filter::ALL {
        let n = 20_000;
        let [forwards, backwards, threaded] = [(); 3].map(|()| film(filter, None));
        (0..n).for_each(|i| deposit(&forwards, i));
        (0..n).rev().for_each(|i| deposit(&backwards, i));
        thread::scope(|scope| {
            for t in 0..5 {
                let film = &threaded;
                scope.spawn(move || (t..n).step_by(5).for_each(|i| deposit(film, i)));
            }
        });
        let image = forwards.image(7);
        assert_eq!(image, backwards.image(7));
        assert_eq!(image, threaded.image(7));
        assert!(image.mean().min_element() > 0.0);
    }
}

#[test]
fn a_crop_is_the_slice_of_the_full_image() {
    for filter in Filter::ALL {
        let crop = Crop { x0: 2, y0: 1, x1: 7, y1: 6 };
        let (full, part) = (film(filter, None), film(filter, Some(crop)));
        for i in 0..5000 {
            deposit(&full, i);
            deposit(&part, i);
        }
        let (full, part) = (full.image(3), part.image(3));
        assert_eq!((part.width, part.height), (5, 5));
        for (x, y) in (0..5).flat_map(|x| (0..5).map(move |y| (x, y))) {
            assert_eq!(part.get(x, y), full.get(x + 2, y + 1));
        }
    }
}

#[test]
fn what_cannot_be_added_is_counted_and_left_out() {
    let film = film(Filter::BlackmanHarris, None);
    let at = Raster(Vec2::new(4.5, 3.5));
    film.deposit(at, Rgb::new(1.0, f32::NAN, 1.0), Half::Even);
    film.deposit(at, Rgb::new(f32::INFINITY, 1.0, 1.0), Half::Even);
    film.deposit(Raster(Vec2::new(f32::NAN, 1.0)), Rgb::ONE, Half::Even);
    film.deposit(at, Rgb::new(-0.0, 0.0, 0.0), Half::Even);
    assert_eq!(film.image(1).mean(), Rgb::ZERO);
    assert_eq!(film.errors(), DepositErrors { non_finite: 3, ..DepositErrors::default() });
    film.add_errors(DepositErrors { non_finite: u64::MAX, overflow: 1 });
    assert_eq!(film.errors(), DepositErrors { non_finite: u64::MAX, overflow: 1 });
}

#[test]
fn no_filter_makes_a_finite_deposit_infinite() {
    for filter in Filter::ALL {
        assert!(filter.value(0.0, 0.0) <= 1.0, "{filter}: Film::spread relies on it");
        let film = film(filter, None);
        film.deposit(Raster(Vec2::new(4.5, 3.5)), Rgb::new(f32::MAX, f32::MIN, 0.0), Half::Even);
        let pixel = film.image(1).get(4, 3);
        assert!(pixel.r() > 0.8 * f32::MAX && pixel.g() == -pixel.r() && pixel.b() == 0.0 && film.errors().is_empty());
    }
}

#[test]
fn no_deposit_is_too_small_too_large_or_too_negative() {
    let film = film(Filter::Box, None);
    let values = [f32::from_bits(1), -1e-30, f32::MAX, 3e-12, -2e20, f32::MAX, f32::MIN, -3.0];
    let value = |i: usize| Rgb::new(values[i], values[(i + 3) % 8], values[(i + 5) % 8]);
    (0..8).for_each(|i| film.deposit(Raster(Vec2::ONE), value(i), Half::Even));
    let sum = values.map(|value| ExactSum::of(value).unwrap());
    let sum = sum.into_iter().reduce(|a, b| a.checked_add(b).unwrap()).unwrap();
    let pixel = 9 + 1;
    assert_eq!([0, 1, 2].map(|channel| film.sum(Half::Even, pixel, channel)), [sum; 3]);
    assert_eq!(film.image(1).get(1, 1), Rgb::splat(f32::MAX));
    assert!(film.errors().is_empty() && film.wide_memory() > 0);
}

#[test]
fn noise_is_known_after_an_even_number_of_passes_only() {
    let film = film(Filter::Box, None);
    (0..4000).for_each(|i| deposit(&film, i));
    assert_eq!(film.noise(0), None);
    assert_eq!(film.noise(1), None);
    assert_eq!(film.noise(7), None);
    let expected = half_image_rel_mse(&film.half_image(Half::Even, 4), &film.half_image(Half::Odd, 4));
    assert_eq!(film.noise(8), Some(expected));
    assert!(expected > 0.0);
}

#[test]
fn passes_go_to_the_half_images_in_turn() {
    let halves = [0, 1, 2, 3, 4].map(Half::of_pass);
    assert_eq!(halves, [Half::Even, Half::Odd, Half::Even, Half::Odd, Half::Even]);
}
