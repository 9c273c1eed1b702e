//! `cargo run --release --example contact_sheet -- FOLDER OUT.png [SPP]`: every model below a folder, rendered by bdpt
//! under a white sky and its own lights, in one picture. A text file beside it names them in reading order, and what
//! each was refused for or did not get. Refused models leave their tile grey.

#![allow(clippy::print_stdout, clippy::print_stderr)] // a tool that talks to whoever runs it

#[path = "../tests/common/mod.rs"]
mod common;

use std::{fmt::Write, fs, path::Path, process::ExitCode};

use pathspace::{
    film::{Exposure, Image, encode_png},
    io,
    math::Rgb,
    render::{Background, Renderer, Settings},
    scene::{camera::Sensor, light::Light},
};

const SIDE: u32 = 128;

/// The model under its own lights and a white sky, seen by the file's first camera or by one that frames it.
fn render(loaded: io::Loaded, spp: u32) -> Image {
    let sensor = Sensor { width: SIDE, height: SIDE, padding: 0 };
    let camera = match loaded.cameras.first() {
        Some(camera) => camera.to_camera(sensor),
        None => common::framing(loaded.geometry.bounds(), sensor),
    };
    let scene = loaded.into_scene(camera, Some(Light::Environment { radiance: Rgb::ONE }));
    // White models would drown in a white sky.
    let settings = Settings { max_depth: 8, background: Background::Transparent, ..Settings::new(sensor) };
    let mut renderer = Renderer::new(&scene, &settings);
    (0..spp).for_each(|_| renderer.pass());
    let mut image = renderer.film().image(spp);
    // Each tile has an exposure of its own.
    let scale = Exposure::Auto.ev(&image).exp2();
    for (pixel, alpha) in image.pixels.iter_mut().zip(renderer.alpha().expect("a transparent background")) {
        *pixel = *pixel * scale + Rgb::splat(0.03) * (1.0 - alpha);
    }
    image
}

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let (folder, out, spp) = match arguments.as_slice() {
        [folder, out] => (Path::new(folder), Path::new(out), Some(64)),
        [folder, out, spp] => (Path::new(folder), Path::new(out), spp.parse().ok().filter(|spp| *spp > 0)),
        _ => {
            eprintln!("usage: contact_sheet FOLDER OUT.png [SPP]");
            return ExitCode::from(2);
        }
    };
    let Some(spp) = spp else {
        eprintln!("error: the number of samples is a positive number");
        return ExitCode::from(2);
    };
    let files = common::models(folder);
    let columns = (files.len() as f64).sqrt().ceil().max(1.0) as u32;
    let rows = (files.len() as u32).div_ceil(columns).max(1);
    let (width, height) = (columns * SIDE, rows * SIDE);
    let mut sheet = Image { width, height, pixels: vec![Rgb::splat(0.2); (width * height) as usize] };
    let mut list = String::new();
    for (i, file) in (0..).zip(&files) {
        let name = file.strip_prefix(folder).unwrap_or(file).display();
        println!("{name}");
        // Writing to a string cannot fail.
        let _ = writeln!(list, "row {}, column {}: {name}", i / columns + 1, i % columns + 1);
        let loaded = match io::load(file) {
            Ok(loaded) => loaded,
            Err(error) => {
                let _ = writeln!(list, "    refused: {error}");
                continue;
            }
        };
        for warning in &loaded.warnings {
            let _ = writeln!(list, "    {warning}");
        }
        let image = render(loaded, spp);
        for y in 0..SIDE {
            for x in 0..SIDE {
                let at = (i / columns * SIDE + y) * width + i % columns * SIDE + x;
                sheet.pixels[at as usize] = image.get(x, y);
            }
        }
    }
    let written = encode_png(&sheet, None, Exposure::Ev(0.0))
        .map_err(|e| e.to_string())
        .and_then(|png| fs::write(out, png).map_err(|e| e.to_string()))
        .and_then(|()| fs::write(out.with_extension("txt"), list).map_err(|e| e.to_string()));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: cannot write {}: {error}", out.display());
            ExitCode::from(4)
        }
    }
}
