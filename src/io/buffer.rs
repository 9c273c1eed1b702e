//! The bytes behind a document: the GLB chunk, data URIs, and files beside the document.

use std::{
    collections::HashMap,
    fs,
    path::{Component, Path, PathBuf},
};

use base64::{Engine as _, engine::general_purpose};
use gltf_json::Root;
use percent_encoding::percent_decode_str;
use sha2::{Digest, Sha256};

use super::{
    draco::{self, Decoded},
    error::{Fault, quoted},
    limits::{Limit, Outside, Place},
    meshopt::Compressed,
};

/// The bytes of a document.
#[derive(Default)]
pub(super) struct Buffers {
    /// Of every buffer; `None` for one without a source, which is an error only once it is read.
    files: Vec<Option<Vec<u8>>>,
    /// Of the buffer views that were compressed.
    views: HashMap<usize, Vec<u8>>,
    /// The primitives that were compressed, by mesh and primitive.
    pub(super) primitives: HashMap<(usize, usize), Decoded>,
    /// The most elements of an accessor that has no bytes.
    pub(super) zeros: u64,
}

impl Buffers {
    /// The bytes of a buffer view of `root`, whose buffers these are.
    pub(super) fn view(&self, root: &Root, index: usize) -> Result<&[u8], Fault> {
        if let Some(bytes) = self.views.get(&index) {
            return Ok(bytes);
        }
        let at = format!("/bufferViews/{index}");
        let view = root.buffer_views.get(index).ok_or_else(|| Fault::invalid(&at, "there is no such buffer view"))?;
        let bytes = self.file(view.buffer.value())?;
        // Views were shown to lie within their buffers when the document was checked.
        let bytes = usize::try_from(view.byte_offset.unwrap_or_default().0).ok().and_then(|start| bytes.get(start..));
        let bytes = bytes.and_then(|bytes| bytes.get(..view.byte_length.0 as usize));
        bytes.ok_or_else(|| Fault::invalid(at, "the view reaches beyond its buffer"))
    }

    fn file(&self, buffer: usize) -> Result<&[u8], Fault> {
        self.files.get(buffer).and_then(Option::as_deref).ok_or_else(|| {
            let what = "the buffer has no URI, and the file no binary chunk for it";
            Fault::invalid(format!("/buffers/{buffer}"), what)
        })
    }
}

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

/// Reads every buffer, and decompresses views and primitives; `hash` takes in the files that are read.
pub(super) fn read(root: &Root, bin: Option<&[u8]>, place: Place<'_>, hash: &mut Hash) -> Result<Buffers, Fault> {
    let views = root.buffer_views.iter().enumerate();
    let compressed = views.map(|(i, view)| Compressed::of(root, i, view, &place.limits));
    let compressed = compressed.collect::<Result<Vec<_>, _>>()?;
    let mut buffers = Buffers { zeros: place.limits.zeros, ..Buffers::default() };
    for (i, (buffer, replaced)) in root.buffers.iter().zip(replaced(root, &compressed)).enumerate() {
        let at = format!("/buffers/{i}");
        let declared = buffer.byte_length.0;
        let bytes = match &buffer.uri {
            _ if replaced => None,
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
        buffers.files.push(bytes);
    }
    let mut bytes = 0_u64;
    for (i, compressed) in compressed.iter().enumerate() {
        let Some(compressed) = compressed else { continue };
        bytes = bytes.saturating_add(compressed.bytes());
        let limit = place.limits.decoded_bytes;
        if bytes > limit {
            let what =
                format!("decompressed, the views up to this one have {bytes} bytes, and {}", Limit(DECODED, limit));
            return Err(Fault::too_large(format!("/bufferViews/{i}"), what));
        }
        let decoded = compressed.decode(buffers.file(compressed.buffer)?)?;
        buffers.views.insert(i, decoded);
    }
    buffers.primitives = draco::all(root, &buffers, &place.limits, bytes)?;
    Ok(buffers)
}

/// The name of the limit on what is decompressed.
pub(super) const DECODED: &str = "decoded-bytes";

/// Which buffers only have in plain what `compressed` views have, too. They need not be there.
fn replaced(root: &Root, compressed: &[Option<Compressed>]) -> Vec<bool> {
    let mut replaced = vec![false; root.buffers.len()];
    let mut mark = |buffer: usize, value| replaced.get_mut(buffer).into_iter().for_each(|slot| *slot = value);
    let with_views = || root.buffer_views.iter().zip(compressed);
    with_views().filter(|(_, of)| of.is_some()).for_each(|(view, _)| mark(view.buffer.value(), true));
    for (view, compressed) in with_views() {
        mark(compressed.as_ref().map_or(view.buffer.value(), |compressed| compressed.buffer), false);
    }
    replaced
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
