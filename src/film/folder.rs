//! Folders of results: all of them, or what was there before.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use tempfile::{Builder, TempDir};

use super::output::{OutputError, explain, folder_of, resolved};

/// Checks that [`write_folder`] can write to `path`, as far as that can be known before. Leaves nothing behind.
///
/// # Errors
/// If `path` is something else than a folder, if nothing can be created in it, or, where there is none, beside it.
pub fn check_folder(path: &Path) -> Result<(), OutputError> {
    let target = target(path);
    let check = || {
        if fs::metadata(&target).is_ok_and(|found| !found.is_dir()) {
            return Err(io::Error::other("it is not a folder"));
        }
        if target.is_dir() {
            temporary_in(&target)?;
        } else {
            temporary_in(folder_of(&target))?;
        }
        Ok(())
    };
    check().map_err(|error| OutputError::new(path, explain(&target, &error)))
}

/// Writes files into the folder `path`, which is made if it does not exist, and then appears with all of them at once.
/// In a folder that exists each file takes its name when all are written; other files there stay as they are.
///
/// # Errors
/// If any of this fails. Nothing is half-written, and where writing itself fails, nothing has changed.
pub fn write_folder(path: &Path, files: &[(String, Vec<u8>)]) -> Result<(), OutputError> {
    let target = target(path);
    let write = || {
        let exists = target.is_dir();
        let folder = temporary_in(if exists { &target } else { folder_of(&target) })?;
        for (name, bytes) in files {
            let file = folder.path().join(name);
            fs::write(&file, bytes)?;
            fs::File::open(&file)?.sync_all()?;
        }
        if !exists {
            fs::rename(folder.path(), &target)?;
            // It has a new name: there is nothing to clean up under the old one.
            let _ = folder.keep();
            return Ok(());
        }
        files.iter().try_for_each(|(name, _)| fs::rename(folder.path().join(name), target.join(name)))
    };
    write().map_err(|error| OutputError::new(path, explain(&target, &error)))
}

/// Without a separator at its end, after which there is no name.
fn target(path: &Path) -> PathBuf {
    resolved(&path.components().collect::<PathBuf>())
}

fn temporary_in(folder: &Path) -> io::Result<TempDir> {
    let mut builder = Builder::new();
    builder.prefix(".pathspace-").suffix(".part");
    // Temporary folders are private by default; this one is to stay.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    builder.tempdir_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_new_folder_appears_whole_and_an_old_one_keeps_what_is_not_replaced() {
        let base = tempfile::tempdir().unwrap();
        let folder = base.path().join("results");
        let files = |text: &str| ["a", "b"].map(|name| (name.to_owned(), text.as_bytes().to_vec()));
        check_folder(&folder).unwrap();
        assert!(names(base.path()).is_empty());
        write_folder(&folder, &files("1")).unwrap();
        assert_eq!((names(base.path()), names(&folder)), (vec!["results".to_owned()], vec!["a".into(), "b".into()]));
        fs::write(folder.join("mine"), "kept").unwrap();
        let with_separator = PathBuf::from(format!("{}/", folder.display()));
        check_folder(&with_separator).unwrap();
        write_folder(&with_separator, &files("2")).unwrap();
        assert_eq!(names(&folder), ["a", "b", "mine"]);
        assert_eq!(
            (fs::read(folder.join("a")).unwrap(), fs::read(folder.join("mine")).unwrap()),
            (b"2".into(), b"kept".into())
        );
    }

    #[test]
    fn what_cannot_be_a_folder_is_refused() {
        let base = tempfile::tempdir().unwrap();
        fs::write(base.path().join("file"), "kept").unwrap();
        for (name, about) in
            [("file", "not a folder"), ("file/below", "not a folder"), ("no/where", "there is no folder")]
        {
            let error = check_folder(&base.path().join(name)).unwrap_err().to_string();
            assert!(error.contains(about) && error.lines().count() == 1, "{error}");
            assert!(write_folder(&base.path().join(name), &[]).is_err(), "{name}");
        }
        assert_eq!(fs::read(base.path().join("file")).unwrap(), b"kept");
    }
}
