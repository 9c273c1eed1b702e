//! Files that are either whole or not there.

use std::{
    ffi::OsStr,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use tempfile::{Builder, NamedTempFile};

/// An image file format, chosen by a file name's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: linear, lossless, with the settings in its header.
    Exr,
    /// PNG: 8-bit sRGB, to look at.
    Png,
}

/// A file name's extension was none that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("images are written as .exr or .png")]
pub struct UnknownFormat;

impl Format {
    /// The format that `path`'s extension names, in capitals or not.
    ///
    /// # Errors
    /// If it names none.
    pub fn of(path: &Path) -> Result<Self, UnknownFormat> {
        match path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(UnknownFormat),
        }
    }
}

/// Why a file cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write '{}': {reason}", path.display())]
pub struct OutputError {
    path: PathBuf,
    reason: String,
}

impl OutputError {
    pub(super) fn new(path: &Path, reason: impl Into<String>) -> Self {
        Self { path: path.to_owned(), reason: reason.into() }
    }
}

/// Checks that [`write_atomically`] can write to `path`, as far as that can be known before. Leaves nothing behind, and
/// an existing file as it is.
///
/// # Errors
/// If the folder does not exist or nothing can be created in it, or if `path` is something else than a file that may
/// be replaced.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    let target = resolved(path);
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => return Err(OutputError::new(path, "it is a folder")),
        Ok(found) if !found.is_file() => return Err(OutputError::new(path, "it is not a regular file")),
        Ok(found) if found.permissions().readonly() => {
            return Err(OutputError::new(path, "the file there is read-only"));
        }
        _ => {}
    }
    temporary_beside(&target).map(drop).map_err(|error| OutputError::new(path, explain(&target, &error)))
}

/// Writes `bytes` to `path` so that, whatever happens, the file there is the old one or the new one: into a temporary
/// file beside it, which is synced and then takes its name.
///
/// # Errors
/// If any of this fails; the old file, if any, is then untouched.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let target = resolved(path);
    let write = || {
        let mut file = temporary_beside(&target)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(&target).map_err(|error| error.error)?;
        sync_name(&target);
        Ok(())
    };
    write().map_err(|error| OutputError::new(path, explain(&target, &error)))
}

/// Makes a new name last, as far as the system can: the file itself is safe already, under the old name or the new one.
fn sync_name(path: &Path) {
    if cfg!(unix) {
        let _ = fs::File::open(folder_of(path)).and_then(|folder| folder.sync_all());
    }
}

/// Follows links, so that a link to an image stays one.
pub(super) fn resolved(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn temporary_beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".pathspace-").suffix(".part");
    // Temporary files are private by default; the image gets the permissions of any new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(path))
}

pub(super) fn explain(path: &Path, error: &io::Error) -> String {
    // The error itself names the temporary file, which nobody asked for.
    match error.kind() {
        io::ErrorKind::NotFound => format!("there is no folder '{}'", folder_of(path).display()),
        io::ErrorKind::NotADirectory => format!("'{}' is not a folder", folder_of(path).display()),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        io::ErrorKind::StorageFull => "the disk is full".to_owned(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_names_the_format() {
        assert_eq!(Format::of(Path::new("a/b.EXR")), Ok(Format::Exr));
        assert_eq!(Format::of(Path::new("b.x.png")), Ok(Format::Png));
        for bad in ["b", "b.jpg", ".png", "exr"] {
            assert_eq!(Format::of(Path::new(bad)), Err(UnknownFormat), "{bad}");
        }
    }

    #[test]
    fn a_check_leaves_everything_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.exr");
        check_writable(&file).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        fs::write(&file, "old").unwrap();
        check_writable(&file).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"old");
        write_atomically(&file, b"new").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_cannot_be_written_is_said_in_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let says = |path: &Path| {
            let error = check_writable(path).unwrap_err().to_string();
            assert_eq!(error.lines().count(), 1);
            assert!(write_atomically(path, b"").is_err());
            error
        };
        assert!(says(&folder.path().join("no/a.exr")).contains("there is no folder"));
        assert!(says(folder.path()).contains("folder"));
        fs::write(folder.path().join("file"), "").unwrap();
        assert!(says(&folder.path().join("file/a.exr")).contains("not a folder"));
        let locked = folder.path().join("locked.png");
        fs::write(&locked, "kept").unwrap();
        let mut permissions = fs::metadata(&locked).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&locked, permissions).unwrap();
        assert!(check_writable(&locked).unwrap_err().to_string().contains("read-only"));
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_links() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("a.exr"), folder.path().join("latest.exr"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomically(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
    }
}
