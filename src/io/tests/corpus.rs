//! Files that nobody here wrote, good and broken: each is read, or refused with one line. None panics.
#![expect(clippy::print_stderr, reason = "what a test could not look at must be said")]

use std::{
    fs, panic,
    path::{Path, PathBuf},
};

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
        let Err(error) = result else { continue };
        let named = error.contains("/extensionsRequired") && lacking.iter().any(|prefix| error.contains(prefix));
        assert!(named, "{}: {error}", path.display());
    }
}

#[test]
fn our_scenes_are_read_without_a_warning() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files = Vec::new();
    gltf_files(&folder, &mut files);
    assert_eq!(files.len(), 17);
    for path in files {
        let loaded = crate::io::load(&path).unwrap();
        assert!(loaded.warnings.is_empty(), "{}: {:?}", path.display(), loaded.warnings);
        assert_eq!(loaded.cameras.len(), 1, "{}", path.display());
        assert!(loaded.is_lit(), "{}", path.display());
    }
}
