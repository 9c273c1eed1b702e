//! Where the library may be.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

/// The names by which the system finds the library: the one with a version first, as others are for compilers.
pub(super) const SYSTEM_NAMES: &[&str] = if cfg!(target_os = "windows") {
    &["OpenImageDenoise.dll"]
} else if cfg!(target_os = "macos") {
    &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"]
} else {
    &["libOpenImageDenoise.so.2", "libOpenImageDenoise.so"]
};

/// The library in a folder, or in the one for libraries below it.
pub(super) fn in_folder(folder: &Path) -> Option<PathBuf> {
    let below = ["", "lib", "bin"].map(|name| folder.join(name));
    below.iter().flat_map(|folder| SYSTEM_NAMES.iter().map(|name| folder.join(name))).find(|file| file.is_file())
}

/// The libraries of the Python package `pyoidn`, in these folders of packages and then in the usual ones.
pub(super) fn wheels(packages: &[PathBuf]) -> Vec<PathBuf> {
    let usual = prefixes().into_iter().flat_map(|prefix| packages_below(&prefix));
    let folders = packages.iter().cloned().chain(usual);
    folders.filter_map(|folder| in_folder(&folder.join("pyoidn").join("oidn"))).collect()
}

/// Where Pythons live: the active environment, the user's packages, the system's.
fn prefixes() -> Vec<PathBuf> {
    let active = ["VIRTUAL_ENV", "CONDA_PREFIX"].into_iter().filter_map(env::var_os).map(PathBuf::from);
    let user = env::home_dir().map(|home| home.join(".local"));
    active.chain(user).chain(["/usr/local".into(), "/usr".into()]).collect()
}

/// The folders of packages of a Python at `prefix`: PREFIX/lib/python3.11/site-packages, or Debian's dist-packages.
fn packages_below(prefix: &Path) -> Vec<PathBuf> {
    let library = prefix.join(if cfg!(windows) { "Lib" } else { "lib" });
    let entries = fs::read_dir(&library).into_iter().flatten().flatten();
    let mut pythons: Vec<_> = entries.map(|entry| entry.path()).filter(|path| is_python(path)).collect();
    pythons.sort();
    pythons.push(library);
    pythons.iter().flat_map(|python| ["site-packages", "dist-packages"].map(|name| python.join(name))).collect()
}

fn is_python(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("python3"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_is_found_in_folders_and_wheels() {
        let base = tempfile::tempdir().unwrap();
        let packages = base.path().join("lib/python3.11/site-packages");
        let folder = packages.join("pyoidn/oidn/lib");
        fs::create_dir_all(&folder).unwrap();
        assert_eq!(in_folder(&folder), None);
        assert!(packages_below(base.path()).contains(&packages));
        // The older name is there too: what programs load comes first.
        for name in SYSTEM_NAMES.iter().rev() {
            fs::write(folder.join(name), "").unwrap();
            let file = folder.join(name);
            assert_eq!(in_folder(&folder), Some(file.clone()));
            assert_eq!(in_folder(&packages.join("pyoidn/oidn")), Some(file.clone()));
            assert_eq!(wheels(std::slice::from_ref(&packages)).first(), Some(&file));
        }
    }
}
