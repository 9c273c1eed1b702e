//! Lookups against values worked out by hand.

use std::{f32::consts::FRAC_PI_2, sync::Arc};

use glam::{Affine2, Vec2, Vec4};

use super::*;

/// Four grey texels in a row: 0, 1/5, 3/5, 1.
fn row(wrap: Wrap, filter: Filter) -> Texture {
    let image = Image::new(4, 1, Texels::U8(vec![0, 51, 153, 255]));
    Texture { wrap: [wrap; 2], filter, ..Texture::new(Arc::new(image), Encoding::Linear) }
}

fn grey(texture: &Texture, u: f32) -> f32 {
    texture.lookup(Vec2::new(u, 0.3)).x
}

#[test]
fn nearest_takes_the_texel_around_the_place_and_wraps_it() {
    let at = |wrap, u| grey(&row(wrap, Filter::Nearest), u);
    for (u, repeat, mirror, clamp) in [
        (0.0, 0.0, 0.0, 0.0),
        (0.26, 0.2, 0.2, 0.2),
        (0.99, 1.0, 1.0, 1.0),
        (1.0, 0.0, 1.0, 1.0),
        (1.3, 0.2, 0.6, 1.0),
        (-0.1, 1.0, 0.0, 0.0),
        (-0.3, 0.6, 0.2, 0.0),
        (2.3, 0.2, 0.2, 1.0),
        (-1.1, 1.0, 1.0, 0.0),
        (-2.1, 1.0, 0.0, 0.0),
    ] {
        let found = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|wrap| at(wrap, u));
        assert_eq!(found, [repeat, mirror, clamp], "at {u}");
    }
}

#[test]
fn bilinear_interpolates_between_centres_and_across_the_edges() {
    let at = |wrap, u| grey(&row(wrap, Filter::Bilinear), u);
    for (u, repeat, mirror, clamp) in [
        (0.125, 0.0, 0.0, 0.0),
        (0.25, 0.1, 0.1, 0.1),
        (0.4375, 0.3, 0.3, 0.3),
        (0.0, 0.5, 0.0, 0.0),
        (1.0625, 0.25, 1.0, 1.0),
        (1.25, 0.1, 0.8, 1.0),
        (-0.25, 0.8, 0.1, 0.0),
    ] {
        let found = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|wrap| at(wrap, u));
        for (found, expected) in found.into_iter().zip([repeat, mirror, clamp]) {
            assert!((found - expected).abs() < 1e-6, "{found} for {expected} at {u}");
        }
    }
}

#[test]
fn both_axes_interpolate_and_v_goes_down() {
    let image = Image::new(2, 2, Texels::U8(vec![0, 51, 102, 255]));
    let texture = Texture { wrap: [Wrap::Clamp; 2], ..Texture::new(Arc::new(image), Encoding::Linear) };
    let at = |u, v| texture.lookup(Vec2::new(u, v)).x;
    assert!((at(0.5, 0.5) - 0.4).abs() < 1e-6);
    assert_eq!([at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0), at(1.0, 1.0)], [0.0, 0.2, 0.4, 1.0]);
}

#[test]
fn colours_are_decoded_before_they_are_interpolated_and_alpha_is_linear() {
    let image = Image::new(2, 1, Texels::U8(vec![0, 0, 0, 0, 255, 188, 10, 128]));
    let texture = Texture { wrap: [Wrap::Clamp; 2], ..Texture::new(Arc::new(image), Encoding::Srgb) };
    // sRGB 188/255 is 0.50289 linear, 10/255 lies on the straight part: 10/255/12.92.
    let bright = Vec4::new(1.0, 0.502_886, 0.003_035_27, 128.0 / 255.0);
    assert!((texture.lookup(Vec2::new(1.0, 0.5)) - bright).abs().max_element() < 1e-6);
    assert!((texture.lookup(Vec2::new(0.5, 0.5)) - 0.5 * bright).abs().max_element() < 1e-6);
}

#[test]
fn every_layout_spreads_to_four_channels() {
    let texel = |texels| Image::new(1, 1, texels).texel(0, 0, Encoding::Linear);
    assert_eq!(texel(Texels::U8(vec![51])), Vec4::new(0.2, 0.2, 0.2, 1.0));
    assert_eq!(texel(Texels::U8(vec![51, 255])), Vec4::new(0.2, 0.2, 0.2, 1.0));
    assert_eq!(texel(Texels::U8(vec![51, 102, 0])), Vec4::new(0.2, 0.4, 0.0, 1.0));
    assert_eq!(texel(Texels::U16(vec![13107, 0, 65535, 0])), Vec4::new(0.2, 0.0, 1.0, 0.0));
    assert_eq!(texel(Texels::U16(vec![65535, 13107])), Vec4::new(1.0, 1.0, 1.0, 0.2));
    let srgb = Image::new(1, 1, Texels::U16(vec![257 * 188])).texel(0, 0, Encoding::Srgb);
    assert!((srgb.x - 0.502_886).abs() < 1e-6, "{srgb}");
    assert!(Image::new(1, 1, Texels::U8(vec![9, 254])).has_alpha());
    assert!(!Image::new(1, 1, Texels::U8(vec![9, 9, 9, 255])).has_alpha());
}

#[test]
fn a_transform_scales_then_turns_then_moves() {
    let mut texture = row(Wrap::Repeat, Filter::Nearest);
    texture.transform = Affine2::from_scale_angle_translation(Vec2::new(0.5, 1.0), FRAC_PI_2, Vec2::new(0.25, 0.0));
    // (u, v) → (u/2, v) → (−v, u/2) → (1/4 − v, u/2).
    assert_eq!(texture.lookup(Vec2::new(0.7, 0.1)).x, 0.0);
    assert_eq!(texture.lookup(Vec2::new(0.7, -0.3)).x, 0.6);
}

#[test]
fn absurd_coordinates_find_some_texel() {
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        for filter in [Filter::Nearest, Filter::Bilinear] {
            for u in [1e30, -1e30, f32::MAX, f32::NAN, f32::INFINITY, 16_777_216.5, -3e9] {
                let found = grey(&row(wrap, filter), u);
                assert!((0.0..=1.0).contains(&found), "{found} at {u}");
            }
        }
    }
}
