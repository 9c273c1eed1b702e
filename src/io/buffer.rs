//! The bytes behind a document: the GLB chunk, data URIs, and files beside the document.

use std::{
    fs,
    path::{Component, Path, PathBuf},
};

use base64::{Engine as _, engine::general_purpose};
use gltf_json::Root;
use percent_encoding::percent_decode_str;
use sha2::{Digest, Sha256};

use super::{
    error::{Fault, quoted},
    limits::{Limit, Outside, Place},
};

/// The bytes of every buffer; `None` for one without a source, which is an error only once it is read.
pub(super) type Buffers = Vec<Option<Vec<u8>>>;

/// A hash over everything that was read, each piece with its length so that bytes cannot move between pieces.
pub(super) struct Hash(Sha256);

impl Hash {
    pub(super) fn new() -> Self {
        Self(Sha256::new())
    }

    pub(super) fn add(&mut self, bytes: &[u8]) {
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    pub(super) fn hex(self) -> String {
        self.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// Reads every buffer; `hash` takes in the files that are read.
pub(super) fn read(root: &Root, bin: Option<&[u8]>, place: Place<'_>, hash: &mut Hash) -> Result<Buffers, Fault> {
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (i, buffer) in root.buffers.iter().enumerate() {
        let at = format!("/buffers/{i}");
        let declared = buffer.byte_length.0;
        let bytes = match &buffer.uri {
            None if i == 0 => bin.map(<[u8]>::to_vec),
            None => None,
            Some(uri) if uri.starts_with("data:") => Some(data_uri(uri, &at)?),
            Some(uri) => {
                let bytes = beside(uri, place, "buffer", &at)?;
                hash.add(&bytes);
                Some(bytes)
            }
        };
        if let Some(bytes) = bytes.as_ref().filter(|bytes| (bytes.len() as u64) < declared) {
            let what = format!("the buffer should have {declared} bytes and has {}", bytes.len());
            return Err(Fault::invalid(format!("{at}/byteLength"), what));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// The bytes that a data URI holds.
pub(super) fn data_uri(uri: &str, at: &str) -> Result<Vec<u8>, Fault> {
    let fail = |what: &str| Fault::invalid(format!("{at}/uri"), what);
    let (head, body) = uri.split_once(',').ok_or_else(|| fail("the data URI has no comma"))?;
    if !head.ends_with(";base64") {
        return Ok(percent_decode_str(body).collect());
    }
    let body: Vec<u8> = percent_decode_str(body).collect();
    // Exporters disagree about the padding.
    let body = body.trim_ascii_end();
    let body = &body[..body.len() - body.iter().rev().take_while(|&&c| c == b'=').count()];
    general_purpose::STANDARD_NO_PAD.decode(body).map_err(|e| fail(&format!("the data URI is not base64: {e}")))
}

/// The file that a relative URI names, a `kind` of thing. Unless that is [`Outside::Allowed`], it lies in the
/// document's folder or below, never above or elsewhere, and no link leads out.
pub(super) fn beside(uri: &str, place: Place<'_>, kind: &str, at: &str) -> Result<Vec<u8>, Fault> {
    let fail = |what: String| Fault::resource(format!("{at}/uri"), what);
    let decoded: Vec<u8> = percent_decode_str(uri).collect();
    let relative = String::from_utf8(decoded).map_err(|_| fail(format!("the URI {} is not UTF-8", quoted(uri))))?;
    if relative.is_empty() || relative.contains(['\\', ':', '\0']) {
        return Err(fail(format!("the URI {} leads out of the model's folder and is not followed", quoted(uri))));
    }
    let path: PathBuf = place.folder.join(&relative);
    let inside = Path::new(&relative).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if place.outside == Outside::Refused && !(inside && stays_in(place.folder, &path)) {
        let what = "leads out of the model's folder and is not followed (--allow-outside follows it)";
        return Err(fail(format!("the URI {} {what}", quoted(uri))));
    }
    file(&path, place.limits.file_bytes)
        .map_err(|reason| fail(format!("cannot read the {kind} {}: {reason}", quoted(&relative))))
}

/// Whether following the links on its way leaves `path` below `folder`. What is not there leads nowhere.
fn stays_in(folder: &Path, path: &Path) -> bool {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match (fs::canonicalize(folder), fs::canonicalize(path)) {
        (Ok(folder), Ok(path)) => path.starts_with(folder),
        _ => true,
    }
}

/// A whole regular file of at most so many bytes, or why not.
pub(super) fn file(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    let meta = fs::metadata(path).map_err(|e| e.to_string())?;
    if !meta.is_file() {
        return Err("it is not a regular file".to_owned());
    }
    if meta.len() > most {
        return Err(format!("it has {} bytes, and {}", meta.len(), Limit("file-bytes", most)));
    }
    fs::read(path).map_err(|e| e.to_string())
}
