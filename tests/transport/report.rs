//! What a failing test leaves behind to look at.

use std::path::PathBuf;

use pathspace::{
    film::{Crop, Exposure, Header, Image, encode_exr, encode_png},
    math::Rgb,
    scene::camera::Sensor,
};

/// The mean of equally sized images.
pub fn mean(images: impl ExactSizeIterator<Item = Image>) -> Image {
    let n = images.len() as f32;
    images
        .reduce(|mut sum, image| {
            sum.pixels.iter_mut().zip(image.pixels).for_each(|(s, p)| *s += p);
            sum
        })
        .map(|mut sum| {
            sum.pixels.iter_mut().for_each(|p| *p /= n);
            sum
        })
        .expect("at least one image")
}

/// Writes each image, and the difference of the first and the last around grey, into a folder of the target directory.
pub fn write(name: &str, images: &[(String, Image)]) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name.replace(' ', "-"));
    std::fs::create_dir_all(&folder).expect("a folder for the images of a failure");
    let exposure = Exposure::Ev(Exposure::Auto.ev(&images[0].1));
    for (label, image) in images {
        let png = encode_png(image, None, exposure).expect("PNG");
        std::fs::write(folder.join(label.replace(' ', "-")).with_extension("png"), png).expect("writing an image");
        let sensor = Sensor { width: image.width, height: image.height, padding: 0 };
        let header = Header { sensor, crop: Crop::full(sensor), attributes: Vec::new() };
        let exr = encode_exr(image, None, &[], &[], &header).expect("EXR");
        std::fs::write(folder.join(label.replace(' ', "-")).with_extension("exr"), exr).expect("writing an image");
    }
    if let [(_, a), .., (_, b)] = images {
        let mut difference = a.clone();
        let scale = a.mean().max_element();
        for (p, q) in difference.pixels.iter_mut().zip(&b.pixels) {
            *p = Rgb::splat(0.18) + (*p - *q) / scale;
        }
        let png = encode_png(&difference, None, Exposure::Ev(0.0)).expect("PNG");
        std::fs::write(folder.join("difference.png"), png).expect("writing an image");
    }
    folder
}
