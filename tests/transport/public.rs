//! Real input that nobody here made, against renders by another renderer. Skipped, loudly, where the files are absent.

use std::path::{Path, PathBuf};

use exr::prelude::{ReadChannels, ReadLayers, read};
use pathspace::{
    film::Image,
    integrator::IntegratorKind,
    math::Rgb,
    render::{Renderer, Settings},
    sampling::Filter,
    scene::camera::Sensor,
};

use crate::scenes;

/// A folder of the shared test data, which users do not have.
fn shared(folder: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/public").join(folder);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is not here, so nothing was compared with another renderer", path.display());
    None
}

fn read_exr(path: &Path) -> Image {
    let pixels = |size: exr::math::Vec2<usize>, _: &_| vec![vec![Rgb::ZERO; size.width()]; size.height()];
    let set = |rows: &mut Vec<Vec<Rgb>>, at: exr::math::Vec2<usize>, (r, g, b): (f32, f32, f32)| {
        rows[at.y()][at.x()] = Rgb::new(r, g, b);
    };
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(pixels, set)
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_file(path)
        .expect("the reference");
    let rows = image.layer_data.channel_data.pixels;
    Image { width: rows[0].len() as u32, height: rows.len() as u32, pixels: rows.concat() }
}

/// The means of 4 × 4 blocks, averaged over channels.
fn blocks(image: &Image) -> [f64; 16] {
    let (w, h) = (image.width as usize, image.height as usize);
    let mut means = [0.0; 16];
    for (i, pixel) in image.pixels.iter().enumerate() {
        means[(i / w * 4 / h) * 4 + i % w * 4 / w] += f64::from(pixel.element_sum()) / 3.0 * 16.0 / (w * h) as f64;
    }
    means
}

/// Tungsten's render of Bitterli's Cornell box (its conversion to glTF is good to 1 %; see the data's own notes).
#[test]
fn bitterlis_cornell_box_is_tungstens() {
    let Some(folder) = shared("transport/bitterli/cornell-box") else { return };
    let expected = blocks(&read_exr(&folder.join("TungstenRender.exr")));
    let scene = scenes::load_file(&folder.join("cornell-box.glb"), scenes::square(256, Filter::Box));
    for (integrator, spp) in [(IntegratorKind::Path, 64), (IntegratorKind::Light, 64), (IntegratorKind::Bdpt, 32)] {
        let settings = Settings { integrator, max_depth: 32, ..Settings::new(scene.camera.sensor()) };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..spp).for_each(|_| renderer.pass());
        let found = blocks(&renderer.film().image(spp));
        let (even, odd) = (
            renderer.film().half_image(pathspace::film::Half::Even, spp / 2),
            renderer.film().half_image(pathspace::film::Half::Odd, spp / 2),
        );
        let (even, odd) = (blocks(&even), blocks(&odd));
        let worst = (0..16).map(|i| (found[i] / expected[i] - 1.0).abs()).fold(0.0, f64::max);
        println!("{integrator}, {spp} spp: worst block is {:.2} % off", 100.0 * worst);
        for i in 0..16 {
            // 2 %, and four standard errors as the half images show them.
            let tolerance = 0.02 * expected[i] + 4.0 * 0.5 * (even[i] - odd[i]).abs();
            let off = (found[i] - expected[i]).abs();
            assert!(off < tolerance, "{integrator}, block {i}: {} instead of {}", found[i], expected[i]);
        }
    }
}

/// Tungsten's direct light in Bitterli's version of Veach's plates. Their conductors are approximated in glTF
/// (Schlick's Fresnel, roughness by its square), so the plates' blocks are only alike; the blocks without a plate
/// agree.
#[test]
fn veachs_plates_are_tungstens_but_for_their_metal() {
    let Some(folder) = shared("transport/bitterli/veach-mis") else { return };
    let expected = blocks(&read_exr(&folder.join("TungstenRender.exr")));
    let sensor = Sensor { width: 320, height: 180, padding: 0 };
    let scene = scenes::load_file(&folder.join("veach-mis.glb"), sensor);
    for integrator in [IntegratorKind::Path, IntegratorKind::Bdpt] {
        let settings = Settings { integrator, max_depth: 2, ..Settings::new(sensor) };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..32).for_each(|_| renderer.pass());
        let found = blocks(&renderer.film().image(32));
        let off: Vec<_> = (0..16).map(|i| found[i] / expected[i] - 1.0).collect();
        for row in off.chunks(4) {
            println!("{integrator}: {}", row.iter().map(|x| format!("{:+6.1} %", 100.0 * x)).collect::<String>());
        }
        for (i, off) in off.into_iter().enumerate() {
            // The wall above the plates; beside and below them their glow is in the block, too.
            let tolerance = if i < 4 { 0.02 } else { 0.16 };
            assert!(off.abs() < tolerance, "{integrator}, block {i}: {:.1} % off", 100.0 * off);
        }
    }
}
