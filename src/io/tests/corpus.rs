//! Files that nobody here wrote, good and broken: each is read, or refused with one line. None panics.
#![expect(clippy::print_stderr, reason = "what a test could not look at must be said")]

use std::{
    fs, panic,
    path::{Path, PathBuf},
};

use glam::Vec3;

use crate::io::{LoadOptions, PosedAt};

fn gltf_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            gltf_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
            found.push(path);
        }
    }
}

fn read_all(folder: &str) -> Vec<(PathBuf, Result<crate::io::Loaded, String>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/public").join(folder);
    let mut files = Vec::new();
    gltf_files(&root, &mut files);
    files.sort();
    if files.is_empty() {
        eprintln!("NOT TESTED: there are no files in {}", root.display());
    }
    let read = |path: PathBuf| {
        let result = panic::catch_unwind(|| crate::io::load(&path));
        let result = result.unwrap_or_else(|_| panic!("{} makes the reader panic", path.display()));
        let result = result.map_err(|error| error.to_string());
        let lines: Vec<&String> = match &result {
            Ok(loaded) => loaded.warnings.iter().collect(),
            Err(error) => vec![error],
        };
        let one_line = |text: &&String| text.chars().any(char::is_control);
        assert!(!lines.iter().any(one_line), "{}: {lines:?}", path.display());
        eprintln!("{}: {}", path.display(), result.as_ref().map_or_else(Clone::clone, |l| format!("{:?}", l.warnings)));
        (path, result)
    };
    files.into_iter().map(read).collect()
}

#[test]
fn broken_files_never_panic() {
    let read = read_all("malformed");
    let refused = read.iter().filter(|(_, result)| result.is_err()).count();
    eprintln!("{refused} of {} malformed files are refused", read.len());
}

#[test]
fn real_files_are_read_unless_they_require_what_we_lack() {
    let lacking = ["KHR_", "EXT_", "MESHOPT_", "MSFT_"];
    for (path, result) in read_all("gltf") {
        let error = match result {
            Ok(loaded) if loaded.summary.animations.is_empty() => continue,
            Ok(_) => {
                // What is animated, at any time.
                for seconds in [-1.0, 0.3, 1e30] {
                    let at = Some(PosedAt { seconds, animation: None });
                    let posed = crate::io::load_with(&path, &LoadOptions { at, ..LoadOptions::default() });
                    assert!(posed.is_ok(), "{} at {seconds} s: {:?}", path.display(), posed.err());
                }
                continue;
            }
            Err(error) => error,
        };
        let named = error.contains("/extensionsRequired") && lacking.iter().any(|prefix| error.contains(prefix));
        assert!(named, "{}: {error}", path.display());
    }
}

/// Boxes around all meshes at keys of their animations, as Blender 5.0 imports them (`benches/animation/blender.py`).
const BLENDER: [(&str, f32, [f32; 3], [f32; 3]); 5] = [
    ("khronos/RiggedSimple/RiggedSimple.gltf", 1.041_667, [-1.0, -4.575_078, -2.954_493], [1.0, 4.047_91, 1.0]),
    ("khronos/RiggedSimple/RiggedSimple.gltf", 2.083_333, [-1.0, -4.575_078, -1.0], [1.0, 4.575_078, 1.0]),
    (
        "khronos-extensions/RiggedFigure-Draco/RiggedFigure.gltf",
        1.25,
        [-0.589_461, 0.0, -0.130_85],
        [0.589_176, 1.449_92, 0.194_981],
    ),
    ("khronos/AnimatedMorphCube/AnimatedMorphCube.gltf", 1.0, [-1.0; 3], [1.0, 1.0, -0.294_216]),
    ("khronos/AnimatedMorphCube/AnimatedMorphCube.gltf", 3.0, [-1.0; 3], [1.0, 1.0, 0.767_759]),
];

#[test]
fn posed_models_are_where_blender_has_them() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/public/gltf");
    for (name, seconds, min, max) in BLENDER {
        let path = folder.join(name);
        if !path.exists() {
            eprintln!("NOT TESTED: there is no {}", path.display());
            continue;
        }
        let at = Some(PosedAt { seconds, animation: None });
        let loaded = crate::io::load_with(&path, &LoadOptions { at, ..LoadOptions::default() }).unwrap();
        let found = loaded.geometry.bounds().unwrap();
        let off = (found.min - Vec3::from(min)).abs().max((found.max - Vec3::from(max)).abs()).max_element();
        assert!(off < 5e-6, "{name} at {seconds} s: {found:?} is {off} m off");
    }
}

#[test]
fn our_scenes_are_read_without_a_warning() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files = Vec::new();
    gltf_files(&folder, &mut files);
    assert_eq!(files.len(), 18);
    for path in files {
        let loaded = crate::io::load(&path).unwrap();
        assert!(loaded.warnings.is_empty(), "{}: {:?}", path.display(), loaded.warnings);
        assert_eq!(loaded.cameras.len(), 1, "{}", path.display());
        assert!(loaded.is_lit(), "{}", path.display());
    }
}
