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

const DRACO: &str =
    "“KHR_draco_mesh_compression” is not supported: “gltf-transform copy IN.glb OUT.glb” decompresses it";
const MESHOPT: &str =
    "“EXT_meshopt_compression” is not supported: “gltf-transform copy IN.glb OUT.glb” decompresses it";

/// The models that cannot be read, and a part of the sentence that says so.
const REFUSED: [(&str, &str); 15] = [
    ("draco-testdata/BoxMetaDraco/glTF/BoxMetaDraco.gltf", DRACO),
    ("draco-testdata/Box_Draco.glb", DRACO),
    ("gltf-transform-ext/BoxDraco.gltf", "KHR_draco_mesh_compression alone: “gltf-transform copy"),
    ("gltf-transform-ext/BoxMeshopt.glb", MESHOPT),
    ("gltf-transform-ext/BoxMeshopt.gltf", MESHOPT),
    ("gltf-transform-ext/DracoSparseMesh.gltf", DRACO),
    (
        "khronos-extensions/AnisotropyBarnLamp-KTX2/AnisotropyBarnLamp.gltf",
        "is KTX2 (KHR_texture_basisu), which is not supported: “gltf-transform ktxdecompress IN.glb OUT.glb”",
    ),
    ("khronos-extensions/Box-Draco/Box.gltf", DRACO),
    ("khronos-extensions/CesiumMilkTruck-Draco/CesiumMilkTruck.gltf", DRACO),
    (
        "khronos-extensions/ClearCoatCarPaint/ClearCoatCarPaint.glb",
        "“KHR_materials_clearcoat” is not supported (--ignore-required renders the file without)",
    ),
    ("khronos-extensions/Duck-Draco/Duck.gltf", DRACO),
    (
        "khronos-extensions/IridescenceSuzanne/IridescenceSuzanne.glb",
        "“KHR_materials_iridescence” is not supported (--ignore-required renders the file without)",
    ),
    ("khronos-extensions/RiggedFigure-Draco/RiggedFigure.gltf", DRACO),
    ("khronos-playcanvas/heart_draco.glb", DRACO),
    ("meshopt/pipeline/meshopt-no-fallback/meshopt-no-fallback.gltf", MESHOPT),
];

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

fn refusal(name: &str) -> Option<&'static str> {
    REFUSED.iter().find(|(refused, _)| *refused == name).map(|(_, sentence)| *sentence)
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
    let files: Vec<_> = common::models(&folder).into_iter().filter(|f| refusal(&name(&folder, f)).is_none()).collect();
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
fn what_cannot_be_read_is_refused_with_a_sentence() {
    let Some(folder) = folder() else { return };
    for (name, sentence) in REFUSED {
        let file = folder.join(name);
        let error = io::load(&file).map(|_| ()).expect_err(name).to_string();
        assert!(error.contains(sentence), "{error}");
        let output = Command::new(env!("CARGO_BIN_EXE_pathspace")).arg("info").arg(&file).output().expect("pathspace");
        assert_eq!(output.status.code(), Some(3), "{name}");
        assert_eq!(String::from_utf8_lossy(&output.stderr).lines().count(), 1, "{name}");
    }
}
