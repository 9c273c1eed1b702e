//! Models that nobody here made, each under a white sky and its own lights: finite, not black, and the same by path
//! tracing and by bidirectional path tracing. What must be refused is refused, with the sentence that stands here.

#![allow(clippy::print_stdout, clippy::print_stderr)] // a test says what it measured, and what it could not look at

mod common;

use std::{
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use pathspace::{
    integrator::{Integrator, IntegratorKind},
    io,
    math::Rgb,
    path::{Densities, JoinedPath},
    render::{Renderer, Settings},
    scene::{Scene, camera::Sensor, light::Light},
    statistics::{Comparison, Estimate, Regions, regions},
};

const SENSOR: Sensor = Sensor { width: 64, height: 64, padding: 0 };
const DEPTH: u32 = 6;
const REPLICATES: u64 = 8;
/// Samples per pixel of a replicate, for path tracing and bdpt: about as long each.
const SPP: [u32; 2] = [8, 4];
/// The probability that all models together fail by chance.
const SIGNIFICANCE: f64 = 1e-3;

fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/public/gltf");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED: {} is not here, so no real model was read or rendered", folder.display());
    None
}

/// The model's name below `folder`, written the same everywhere.
fn name(folder: &Path, file: &Path) -> String {
    let parts = file.strip_prefix(folder).expect("below the folder").components();
    parts.map(|part| part.as_os_str().to_string_lossy().into_owned()).collect::<Vec<_>>().join("/")
}

fn load(file: &Path) -> Result<Scene, io::LoadError> {
    let loaded = io::load(file)?;
    let camera = common::framing(loaded.geometry.bounds(), SENSOR);
    Ok(loaded.into_scene(camera, Some(Light::Environment { radiance: Rgb::ONE })))
}

/// The estimate of one integrator, of the paths that `keep` keeps.
fn estimate(scene: &Scene, kind: IntegratorKind, spp: u32, keep: &(impl Fn(&JoinedPath) -> bool + Sync)) -> Estimate {
    let replicates: Vec<Regions> = (0..REPLICATES)
        .map(|seed| {
            let seed = 1000 * kind as u64 + seed;
            let settings = Settings { integrator: kind, max_depth: DEPTH, seed, ..Settings::new(SENSOR) };
            let mut renderer = Renderer::new(scene, &settings);
            (0..spp).for_each(|_| renderer.pass_where(keep));
            assert!(renderer.statistics().rejected.is_empty(), "{kind}: {:?}", renderer.statistics().rejected);
            assert!(renderer.film().errors().is_empty(), "{kind}: {:?}", renderer.film().errors());
            let image = renderer.film().image(spp);
            assert!(image.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0), "{kind}");
            regions(&image)
        })
        .collect();
    Estimate::new(&replicates)
}

#[test]
fn every_model_is_the_same_by_path_tracing_and_by_bdpt() {
    let Some(folder) = folder() else { return };
    let files = common::models(&folder);
    assert!(files.len() > 20, "only {} models", files.len());
    let start = Instant::now();
    let mut failures = Vec::new();
    for file in &files {
        let name = name(&folder, file);
        let scene = match load(file) {
            Ok(scene) => scene,
            Err(error) => {
                failures.push(error.to_string());
                continue;
            }
        };
        // Path tracing does not find the caustics of lights without an extent, nor shows through what it cannot
        // connect.
        let table = Integrator::new(IntegratorKind::Path, SENSOR, DEPTH, Settings::new(SENSOR).roulette);
        let deltas = scene.materials().iter().any(|m| m.bsdf.delta_count() > 0);
        let covered_alone = deltas && !scene.lights().all().iter().all(Light::has_extent);
        let keep = |path: &JoinedPath| !covered_alone || path.edges() <= 2 || table.covers(path);
        let path = estimate(&scene, IntegratorKind::Path, SPP[0], &keep);
        let bdpt = estimate(&scene, IntegratorKind::Bdpt, SPP[1], &keep);
        let comparison = Comparison::new(&path, &bdpt);
        println!("{name}: mean {:.3}; {comparison}", bdpt.image_mean());
        if !(bdpt.image_mean() > 1e-3 && path.image_mean() > 1e-3) {
            failures.push(format!("{name} is black"));
        }
        if comparison.p < SIGNIFICANCE / files.len() as f64 {
            failures.push(format!(
                "{name}: {} by path, {} by bdpt: {comparison}",
                path.image_mean(),
                bdpt.image_mean()
            ));
        }
    }
    println!("{} models in {:.0} s", files.len(), start.elapsed().as_secs_f32());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn no_model_asks_for_an_extension_that_is_left_out() {
    let Some(folder) = folder() else { return };
    for file in common::models(&folder) {
        let loaded = io::load(&file).unwrap_or_else(|error| panic!("{error}"));
        let left_out: Vec<_> =
            loaded.warnings.iter().filter(|w| w.contains("not supported") || w.contains("not applied")).collect();
        assert!(left_out.is_empty(), "{}: {left_out:?}", name(&folder, &file));
    }
}

#[test]
fn what_cannot_be_read_is_refused_with_a_sentence() {
    let Some(folder) = folder() else { return };
    let model = folder.join("meshopt/pipeline/meshopt-fallback/meshopt-fallback.gltf");
    let (_copy, file) = changed(&model, |json| json["extensionsRequired"] = serde_json::json!(["EXT_of_nobody"]));
    let error = io::load(&file).map(|_| ()).expect_err("refused").to_string();
    let sentence = "the required extension “EXT_of_nobody” is not supported; export it without that";
    assert!(error.contains(sentence), "{error}");
    let output = Command::new(env!("CARGO_BIN_EXE_pathspace")).arg("info").arg(&file).output().expect("pathspace");
    assert_eq!(output.status.code(), Some(3));
    assert_eq!(String::from_utf8_lossy(&output.stderr).lines().count(), 1);
}

/// What `change` makes of a model's JSON, beside copies of its other files.
fn changed(model: &Path, change: impl Fn(&mut serde_json::Value)) -> (tempfile::TempDir, PathBuf) {
    let copy = tempfile::tempdir().expect("a folder");
    for entry in std::fs::read_dir(model.parent().expect("a folder")).expect("readable").flatten() {
        std::fs::write(copy.path().join(entry.file_name()), std::fs::read(entry.path()).expect("a file"))
            .expect("copied");
    }
    let mut json = serde_json::from_slice(&std::fs::read(model).expect("a model")).expect("JSON");
    change(&mut json);
    let path = copy.path().join("changed.gltf");
    std::fs::write(&path, json.to_string()).expect("written");
    (copy, path)
}

fn pixels(file: &Path) -> Vec<Rgb> {
    let scene = load(file).expect("read");
    let settings = Settings::new(SENSOR);
    let mut renderer = Renderer::new(&scene, &settings);
    (0..4).for_each(|_| renderer.pass());
    renderer.film().image(4).pixels
}

/// Its plain data have normals as they were before the filter, and triangles that begin at other corners: what is the
/// same is the light on the faces.
#[test]
fn a_model_compressed_by_meshopt_is_its_plain_one() {
    let Some(folder) = folder() else { return };
    let pipeline = folder.join("meshopt/pipeline");
    let mean = |image: &[Rgb]| image.iter().map(|pixel| pixel.g()).sum::<f32>() / image.len() as f32;
    let faces = |json: &mut serde_json::Value| {
        for mesh in json["meshes"].as_array_mut().expect("meshes") {
            mesh["primitives"][0]["attributes"].as_object_mut().expect("attributes").remove("NORMAL");
        }
    };
    let (_plain, plain) = changed(&pipeline.join("meshopt-fallback/meshopt-fallback.gltf"), |json| {
        faces(json);
        json["extensionsUsed"] = serde_json::json!(["KHR_mesh_quantization"]);
        for view in json["bufferViews"].as_array_mut().expect("views") {
            view.as_object_mut().expect("a view").remove("extensions");
        }
    });
    let [with, without] = ["meshopt-fallback", "meshopt-no-fallback"].map(|name| {
        let model = pipeline.join(name).join(format!("{name}.gltf"));
        let (_copy, copy) = changed(&model, faces);
        assert_eq!(pixels(&model).len(), pixels(&copy).len(), "it is read as it is, too");
        pixels(&copy)
    });
    assert!(with == without, "the same data, with a fallback and without");
    let plain = pixels(&plain);
    let [have, want] = [mean(&with), mean(&plain)];
    assert!(want > 0.1 && (have - want).abs() < 1e-3 * want, "{have} and {want}");
}

#[test]
fn a_model_compressed_by_draco_is_its_plain_one_within_its_quantisation() {
    let Some(folder) = folder() else { return };
    for (compressed, plain) in [
        ("khronos-extensions/Box-Draco/Box.gltf", "khronos/Box/Box.gltf"),
        ("draco-testdata/Box_Draco.glb", "khronos/Box/Box.gltf"),
        ("gltf-transform-ext/BoxDraco.gltf", "khronos/Box/Box.gltf"),
    ] {
        let [compressed, plain] = [compressed, plain].map(|file| io::load(&folder.join(file)).expect(file));
        assert_eq!(compressed.geometry.triangle_count(), plain.geometry.triangle_count());
        let [have, want] = [&compressed, &plain].map(|loaded| loaded.geometry.bounds().expect("triangles"));
        let off = (have.min - want.min).abs().max((have.max - want.max).abs()).max_element();
        assert!(off < 1.0 / 2047.0, "{off}");
    }
}
