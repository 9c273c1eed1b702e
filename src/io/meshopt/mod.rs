//! Compressed buffer views: `EXT_meshopt_compression` and `KHR_meshopt_compression`, which differ in their name alone
//! for what is read here: each stream says its version itself.
//!
//! The decoders are our own, since the crate `meshopt-rs` lacks version 1 of the attributes and the filter for colours.

mod attributes;
mod filters;
mod indices;
mod stream;
#[cfg(test)]
mod tests;

use gltf_json::{Root, buffer::View};
use serde_json::{Map, Value};

use super::{
    error::{Fault, quoted},
    limits::{Limit, Limits},
};
use filters::Filter;

/// The extensions, of which a view has one at most.
const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// What a buffer view says of its compressed form.
pub(super) struct Compressed {
    at: String,
    /// The buffer that has the compressed bytes.
    pub(super) buffer: usize,
    start: usize,
    length: usize,
    count: usize,
    stride: usize,
    mode: Mode,
    filter: Option<Filter>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

impl Compressed {
    /// Of a view of the document, if it is compressed. What it announces is within `limits`, and its bytes are within
    /// the declared size of its buffer.
    pub(super) fn of(root: &Root, index: usize, view: &View, limits: &Limits) -> Result<Option<Self>, Fault> {
        let Some(others) = view.extensions.as_ref().map(|extensions| &extensions.others) else { return Ok(None) };
        let mut named = NAMES.iter().filter_map(|name| Some((name, others.get(*name)?)));
        let Some((name, source)) = named.next() else { return Ok(None) };
        let at = format!("/bufferViews/{index}/extensions/{name}");
        if named.next().is_some() {
            return Err(Fault::invalid(at, "the view is compressed by two extensions, and one must not be there"));
        }
        let none = Map::new();
        let member = Members { source: source.as_object().unwrap_or(&none), at: &at };
        let compressed = Self {
            buffer: member.number("buffer", None)?,
            start: member.number("byteOffset", Some(0))?,
            length: member.number("byteLength", None)?,
            count: member.number("count", None)?,
            stride: member.number("byteStride", None)?,
            mode: member.mode()?,
            filter: member.filter()?,
            at,
        };
        compressed.check(root, view, limits)?;
        Ok(Some(compressed))
    }

    fn check(&self, root: &Root, view: &View, limits: &Limits) -> Result<(), Fault> {
        let fail = |member: &str, what: String| Err(Fault::invalid(format!("{}/{member}", self.at), what));
        let Some(buffer) = root.buffers.get(self.buffer) else {
            return fail("buffer", format!("there is no buffer {}", self.buffer));
        };
        if self.start.checked_add(self.length).is_none_or(|end| end as u64 > buffer.byte_length.0) {
            let (have, index) = (buffer.byte_length.0, self.buffer);
            return fail("byteLength", format!("the bytes reach beyond the {have} bytes of buffer {index}"));
        }
        let stride = self.stride;
        let fits = match self.mode {
            Mode::Attributes => stride.is_multiple_of(4) && (4..=256).contains(&stride),
            Mode::Triangles | Mode::Indices => matches!(stride, 2 | 4),
        };
        if !fits {
            return fail("byteStride", format!("elements of {stride} bytes do not exist in this mode"));
        }
        if self.filter.is_some_and(|filter| self.mode != Mode::Attributes || !filter.fits(stride)) {
            return fail("filter", format!("the filter is not for elements of {stride} bytes in this mode"));
        }
        if self.mode == Mode::Triangles && !self.count.is_multiple_of(3) {
            return fail("count", format!("{} corners make no whole triangles", self.count));
        }
        if self.count as u64 > limits.vertices {
            let what = format!("{} elements are announced, and {}", self.count, Limit("vertices", limits.vertices));
            return Err(Fault::too_large(format!("{}/count", self.at), what));
        }
        let bytes = view.byte_length.0;
        if self.bytes() != bytes {
            return fail("count", format!("{} elements of {stride} bytes are not the view's {bytes}", self.count));
        }
        Ok(())
    }

    /// How many bytes there are when it is decompressed.
    pub(super) fn bytes(&self) -> u64 {
        self.count as u64 * self.stride as u64
    }

    /// The bytes of the view, from those of the buffer that has them compressed.
    pub(super) fn decode(&self, buffer: &[u8]) -> Result<Vec<u8>, Fault> {
        let bytes = buffer.get(self.start..).and_then(|rest| rest.get(..self.length)).unwrap_or(&[]);
        let decoded = match self.mode {
            Mode::Attributes => attributes::decode(bytes, self.count, self.stride),
            Mode::Triangles => indices::triangles(bytes, self.count).map(|list| self.packed(&list)),
            Mode::Indices => indices::sequence(bytes, self.count).map(|list| self.packed(&list)),
        };
        let mut decoded = decoded.map_err(|broken| {
            let what = format!("the compressed data are damaged at their byte {}: {}", broken.at, broken.what);
            Fault::invalid(&self.at, what)
        })?;
        if let Some(filter) = self.filter {
            filter.apply(&mut decoded, self.stride);
        }
        Ok(decoded)
    }

    fn packed(&self, indices: &[u32]) -> Vec<u8> {
        match self.stride {
            2 => indices.iter().flat_map(|&index| (index as u16).to_le_bytes()).collect(),
            _ => indices.iter().flat_map(|&index| index.to_le_bytes()).collect(),
        }
    }
}

/// The members of the extension's object.
struct Members<'a> {
    source: &'a Map<String, Value>,
    at: &'a str,
}

impl Members<'_> {
    fn number(&self, name: &str, default: Option<usize>) -> Result<usize, Fault> {
        let number = match self.source.get(name) {
            None => default,
            Some(value) => value.as_u64().and_then(|number| usize::try_from(number).ok()),
        };
        number.ok_or_else(|| Fault::invalid(format!("{}/{name}", self.at), "this is no whole number from 0 up"))
    }

    fn text(&self, name: &str) -> Result<Option<&str>, Fault> {
        match self.source.get(name) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text)),
            Some(_) => Err(Fault::invalid(format!("{}/{name}", self.at), "this is no text")),
        }
    }

    fn mode(&self) -> Result<Mode, Fault> {
        match self.text("mode")? {
            Some("ATTRIBUTES") => Ok(Mode::Attributes),
            Some("TRIANGLES") => Ok(Mode::Triangles),
            Some("INDICES") => Ok(Mode::Indices),
            mode => {
                let what = format!("the mode {} does not exist", quoted(mode.unwrap_or_default()));
                Err(Fault::invalid(format!("{}/mode", self.at), what))
            }
        }
    }

    fn filter(&self) -> Result<Option<Filter>, Fault> {
        Ok(Some(match self.text("filter")? {
            None | Some("NONE") => return Ok(None),
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some("COLOR") => Filter::Color,
            Some(filter) => {
                let what = format!("the filter {} does not exist", quoted(filter));
                return Err(Fault::invalid(format!("{}/filter", self.at), what));
            }
        }))
    }
}
