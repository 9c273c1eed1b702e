//! The images of `pathspace verify`.

use std::io;

use pathspace::{
    film::{Crop, Exposure, Header, Image, encode_exr, encode_png},
    math::Rgb,
    statistics::TILES,
    verify::{Picture, Report},
};

use crate::cli::{shared::pictures::difference_in_colour, verify::Job};

const DIFFERENCE: &str = "difference";
const P_VALUES: &str = "p-values";
const EXTENSIONS: [&str; 2] = ["exr", "png"];
/// The p-value that the map shows in its last colour.
const SMALLEST_P: f64 = 1e-8;

/// The names of the image files.
pub fn names(report: &Report) -> Vec<String> {
    let images = report.integrators.iter().map(|one| one.kind.name());
    let maps = report.worst.iter().flat_map(|_| [DIFFERENCE, P_VALUES]);
    images.chain(maps).flat_map(|stem| EXTENSIONS.map(|extension| format!("{stem}.{extension}"))).collect()
}

/// The mean image of every integrator; for the most different pair the difference and the map of p-values.
pub fn files(job: &Job, report: &Report) -> io::Result<Vec<(String, Vec<u8>)>> {
    // One exposure for all, so that they can be compared by eye: that of the image which shows most.
    let most = report.integrators.iter().min_by(|a, b| a.uncovered.total_cmp(&b.uncovered));
    let exposure = Exposure::Ev(most.map_or(0.0, |one| Exposure::Auto.ev(&one.image)));
    let mut encoded = Vec::new();
    for one in &report.integrators {
        let about = vec![("integrator", one.kind.name().to_owned()), ("spp", one.passes.to_string())];
        encoded.push(exr(job, &one.image, about)?);
        encoded.push(encode_png(&one.image, None, exposure)?);
    }
    if let Some(worst) = &report.worst {
        let (a, b) = (report.integrators[worst.row.pair.0].kind, report.integrators[worst.row.pair.1].kind);
        let about = |what: &str| vec![("shows", format!("{what} of {a} and {b}, {}", worst.row.scope.name()))];
        let shown = difference_in_colour(&worst.difference, report.mean as f32);
        encoded.push(exr(
            job,
            &worst.difference,
            vec![("shows", format!("{a} minus {b}, all paths that both cover"))],
        )?);
        encoded.push(encode_png(&shown, None, Exposure::Ev(0.0))?);
        encoded.push(exr(job, &p_values(worst, |p| Rgb::splat(p as f32)), about("p-values by tile"))?);
        encoded.push(encode_png(&p_values(worst, p_colour), None, Exposure::Ev(0.0))?);
    }
    Ok(names(report).into_iter().zip(encoded).collect())
}

fn exr(job: &Job, image: &Image, about: Vec<(&str, String)>) -> io::Result<Vec<u8>> {
    let mut attributes = vec![
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("scene", job.scene_hash.clone()),
        ("seed", job.plan.seed.to_string()),
        ("max-depth", job.plan.max_depth.to_string()),
    ];
    attributes.extend(about);
    let attributes = attributes.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    encode_exr(image, None, &[], &[], &Header { sensor: job.sensor, crop: Crop::full(job.sensor), attributes })
}

/// An image of the tiles.
fn p_values(worst: &Picture, colour: impl Fn(f64) -> Rgb) -> Image {
    let (width, height) = (worst.difference.width as usize, worst.difference.height as usize);
    let tile = |i: usize| (i / width * TILES / height) * TILES + i % width * TILES / width;
    let pixels = (0..width * height).map(|i| colour(worst.tiles[tile(i)])).collect();
    Image { pixels, ..worst.difference }
}

/// From dark blue (p = 1) over green and yellow to red (p ≤ [`SMALLEST_P`]), by the logarithm.
fn p_colour(p: f64) -> Rgb {
    const STOPS: [Rgb; 5] = [
        Rgb::new(0.02, 0.03, 0.15),
        Rgb::new(0.03, 0.20, 0.35),
        Rgb::new(0.15, 0.55, 0.20),
        Rgb::new(0.95, 0.75, 0.05),
        Rgb::new(0.75, 0.01, 0.01),
    ];
    let x = (p.max(SMALLEST_P).ln() / SMALLEST_P.ln()).clamp(0.0, 1.0) as f32 * (STOPS.len() - 1) as f32;
    let i = (x as usize).min(STOPS.len() - 2);
    STOPS[i].lerp(STOPS[i + 1], x - i as f32)
}
