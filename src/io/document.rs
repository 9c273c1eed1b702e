//! From bytes to a checked document: the GLB container, the JSON, and every rule that later code leans on.
//!
//! The document is gltf-json's `Root` and not the gltf crate's wrapper around it: the wrapper refuses extensions that
//! it could read, and panics on what it did not check (so does gltf-json's own validation, on a position accessor out
//! of range: that is checked before it is asked).

use std::collections::HashSet;

use gltf_json::{
    Path as JsonPath, Root,
    mesh::Semantic,
    validation::{Checked, Error as Rule, Validate},
};
use serde_json::Value;

use super::{
    error::{Fault, LoadError, one_line, quoted},
    extensions, features,
    limits::{Policy, Required},
};

/// A GLB's two chunks; the JSON alone for a `.gltf`.
pub(super) struct Chunks<'a> {
    pub(super) json: &'a [u8],
    pub(super) bin: Option<&'a [u8]>,
    pub(super) binary: bool,
}

/// Takes the container apart (glTF 2.0 specification, chapter 4), whatever the file is called.
pub(super) fn chunks<'a>(bytes: &'a [u8], file: &str) -> Result<Chunks<'a>, LoadError> {
    let fail = |offset: usize, what: String| LoadError::Container { file: file.to_owned(), offset, what };
    if bytes.is_empty() {
        return Err(LoadError::Unreadable { file: file.to_owned(), reason: "the file is empty".to_owned() });
    }
    if !bytes.starts_with(b"glTF") {
        return Ok(Chunks { json: bytes, bin: None, binary: false });
    }
    let word = |at: usize| {
        let word = bytes.get(at..)?.first_chunk::<4>()?;
        Some(u32::from_le_bytes(*word))
    };
    let missing = |at: usize, what: &str| fail(at.min(bytes.len()), format!("the file ends within {what}"));
    let version = word(4).ok_or_else(|| missing(4, "its header"))?;
    if version != 2 {
        return Err(fail(4, format!("the container has version {version}")));
    }
    let length = word(8).ok_or_else(|| missing(8, "its header"))? as usize;
    if length > bytes.len() {
        return Err(fail(
            bytes.len(),
            format!("the file ends here, but its header announces {length} bytes (a truncated copy?)"),
        ));
    }
    let (mut at, mut json, mut bin) = (12, None, None);
    while at < length {
        let size = word(at).ok_or_else(|| missing(at, "a chunk header"))? as usize;
        let kind = word(at + 4).ok_or_else(|| missing(at, "a chunk header"))?;
        let body = bytes[..length].get(at + 8..).and_then(|rest| rest.get(..size));
        let body = body.ok_or_else(|| fail(at, format!("a chunk of {size} bytes reaches beyond the end")))?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() && at == 12 => json = Some(body),
            b"BIN\0" if bin.is_none() && json.is_some() => bin = Some(body),
            b"JSON" | b"BIN\0" => return Err(fail(at, "a second or misplaced JSON or BIN chunk".to_owned())),
            _ => {} // Unknown chunks are to be ignored.
        }
        at += 8 + size.next_multiple_of(4);
    }
    let json = json.ok_or_else(|| fail(12, "there is no JSON chunk".to_owned()))?;
    Ok(Chunks { json, bin, binary: true })
}

/// Parses the JSON and checks the document; what is merely odd goes to `warnings`.
pub(super) fn parse(json: &[u8], policy: Policy, file: &str, warnings: &mut Vec<String>) -> Result<Root, LoadError> {
    let root = match serde_json::from_slice::<Root>(json) {
        Ok(root) => root,
        Err(error) => repaired(json).ok_or_else(|| json_error(&error, json, file))?,
    };
    check(&root, policy, warnings).map_err(|fault| fault.at(file))?;
    Ok(root)
}

/// gltf-json insists on `nodes` in every scene and on a `node` for every animation to move, glTF does not: an empty
/// scene is a legal one, and extensions animate other things. (What channels animate is read from the JSON.)
///
/// It is read from text again, not from the value: the code that reads a document is large, and compiled once this way.
fn repaired(json: &[u8]) -> Option<Root> {
    let mut value: Value = serde_json::from_slice(json).ok()?;
    for scene in value.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        scene.as_object_mut()?.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    }
    for animation in value.get_mut("animations").and_then(Value::as_array_mut).into_iter().flatten() {
        let channels = animation.get_mut("channels").and_then(Value::as_array_mut);
        if let Some(channels) = channels {
            channels.retain(|channel| channel.pointer("/target").is_none_or(|target| target.get("node").is_some()));
        }
    }
    serde_json::from_slice(&serde_json::to_vec(&value).ok()?).ok()
}

fn json_error(error: &serde_json::Error, json: &[u8], file: &str) -> LoadError {
    let (line, column) = (error.line(), error.column());
    // serde_json repeats the place at the end of its message.
    let text = error.to_string();
    let what = text.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&text);
    let version = serde_json::from_slice::<Value>(json).ok();
    let version = version.as_ref().and_then(|v| v.pointer("/asset/version")?.as_str());
    let what = match version {
        Some(version) if !version.starts_with("2.") => format!("this is glTF {}, not 2.0", quoted(version)),
        _ => one_line(what),
    };
    LoadError::Json { file: file.to_owned(), line, column, what }
}

fn check(root: &Root, policy: Policy, warnings: &mut Vec<String>) -> Result<(), Fault> {
    if !root.asset.version.starts_with("2.") {
        return Err(Fault::unsupported(
            "/asset/version",
            format!("this is glTF {}, not 2.0", quoted(&root.asset.version)),
        ));
    }
    if let Some(version) = root.asset.min_version.as_deref().filter(|&version| version != "2.0") {
        return Err(Fault::unsupported("/asset/minVersion", format!("a reader of glTF {} is needed", quoted(version))));
    }
    honoured(root, policy, warnings)?;
    positions_in_range(root)?;
    validate(root)
}

/// The policy: what is required must be supported, and what is optional and is not is named.
fn honoured(root: &Root, policy: Policy, warnings: &mut Vec<String>) -> Result<(), Fault> {
    let unknown = |name: &&String| !features::is_read(name, policy.drafts);
    let required: Vec<_> = root.extensions_required.iter().filter(unknown).map(String::as_str).collect();
    let mut seen = HashSet::new();
    let only_materials = required.iter().all(|name| extensions::is_of_materials(name));
    if policy.required == Required::MaterialsIgnored && only_materials {
        for name in required {
            if seen.insert(name) {
                warnings.push(extensions::ignored(name));
            }
        }
    } else if !required.is_empty() {
        return Err(Fault::unsupported("/extensionsRequired", extensions::refused(&required)));
    }
    for name in root.extensions_used.iter().filter(unknown).filter(|name| seen.insert(name.as_str())) {
        warnings.push(extensions::left_out(name));
    }
    Ok(())
}

/// What gltf-json's validation takes for granted.
fn positions_in_range(root: &Root) -> Result<(), Fault> {
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let accessor = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            if let Some(index) = accessor.filter(|index| index.value() >= root.accessors.len()) {
                return Err(Fault::invalid(
                    format!("/meshes/{m}/primitives/{p}/attributes/POSITION"),
                    format!("there is no accessor {}, the file has {}", index.value(), root.accessors.len()),
                ));
            }
        }
    }
    Ok(())
}

/// gltf-json's validation: indices in range, enumerations known, required members there.
fn validate(root: &Root) -> Result<(), Fault> {
    let mut first = None;
    let mut more = 0;
    root.validate(root, JsonPath::new, &mut |path, rule| {
        let path = path();
        let path = path.as_str();
        // Extensions have a policy of their own; a position accessor's bounds and even the positions are not needed;
        // an accessor without a view is all zeros (3.6.2.3); attributes of names that are not glTF's own (`_ID`) say
        // nothing of what is seen.
        let needless = [".min", ".max", ".attributes[\"POSITION\"]", ".attributes[\"<invalid semantic name>\"]"];
        let needless = needless.iter().any(|end| path.ends_with(end))
            || path.starts_with("accessors[") && path.ends_with("].bufferView");
        if rule == Rule::Unsupported || needless && rule != Rule::IndexOutOfBounds {
            return;
        }
        if first.is_none() {
            first = Some((pointer(path), rule));
        } else {
            more += 1;
        }
    });
    let Some((pointer, rule)) = first else { return Ok(()) };
    let what = match rule {
        Rule::IndexOutOfBounds => "this index points to nothing that the file has",
        Rule::Missing => "a required value is missing here",
        Rule::Oversize => "this size exceeds the machine's address space",
        Rule::Invalid | Rule::Unsupported => "this value is not one that glTF 2.0 allows",
    };
    let others = if more == 0 { String::new() } else { format!(" (and {more} more like it elsewhere)") };
    Err(Fault::invalid(pointer, format!("{what}{others}")))
}

/// `meshes[0].attributes["A"]`, as gltf-json writes it, as the JSON pointer `/meshes/0/attributes/A`.
fn pointer(path: &str) -> String {
    let mut out = String::from("/");
    for part in path.split(['.', '[', ']', '"']).filter(|part| !part.is_empty()) {
        if out.len() > 1 {
            out.push('/');
        }
        out.push_str(&one_line(part));
    }
    out
}
