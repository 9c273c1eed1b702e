//! Textures and skies out of arithmetic that rounds alike everywhere: no sines.

use image::{
    ExtendedColorType, ImageEncoder, Rgb,
    codecs::{hdr::HdrEncoder, png::PngEncoder},
};

use crate::shapes::unit;

/// A square PNG with 8 bits a channel.
pub fn png(side: u32, pixel: impl Fn(u32, u32) -> [u8; 3]) -> Vec<u8> {
    let pixels: Vec<u8> = (0..side * side).flat_map(|i| pixel(i % side, i / side)).collect();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&pixels, side, side, ExtendedColorType::Rgb8)
        .expect("writing to memory does not fail");
    bytes
}

/// An equirectangular Radiance file, 2·`height` pixels wide; `radiance` takes u to the right and v downwards, in (0,
/// 1).
pub fn sky(height: usize, radiance: impl Fn(f64, f64) -> [f64; 3]) -> Vec<u8> {
    let width = 2 * height;
    let middle = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let pixel = |i: usize| Rgb(radiance(middle(i % width, width), middle(i / width, height)).map(|x| x as f32));
    let pixels: Vec<_> = (0..width * height).map(pixel).collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes).encode(&pixels, width, height).expect("writing to memory does not fail");
    bytes
}

/// A wall of `rows` courses of bricks, each shifted by half a brick: the number of the brick at pixel `[x, y]` of a
/// square image of `side`, and the slopes there, which are 0 on the face of a brick and ±1 in the joints.
pub fn brick([x, y]: [u32; 2], side: u32, rows: u32) -> (u32, [i32; 2]) {
    let height = side / rows;
    let course = y / height;
    let width = 2 * height;
    let shifted = (x + course % 2 * height) % side;
    let inside = |at: u32, length: u32| {
        let joint = (height / 8) as i32;
        let (from, to) = (at as i32, length as i32 - 1 - at as i32);
        if from < joint {
            1
        } else if to < joint {
            -1
        } else {
            0
        }
    };
    (course * 16 + shifted / width, [inside(shifted % width, width), inside(y % height, height)])
}

/// A pixel of a tangent-space normal map; the slopes are in units of the surface.
pub fn normal([du, dv]: [f64; 2]) -> [u8; 3] {
    unit([du, dv, 1.0]).map(|x| ((0.5 * x + 0.5) * 255.0).round() as u8)
}

/// A number in 0…255 that looks random.
pub fn hash(x: u32) -> u8 {
    let x = (x ^ 61).wrapping_mul(0x27d4_eb2d);
    ((x ^ (x >> 15)).wrapping_mul(0x85eb_ca6b) >> 24) as u8
}
