//! Which of a file's material variants is shown (`KHR_materials_variants`).

use gltf_json::{Index, Root};
use serde_json::Value;

use super::error::{Fault, LoadError, one_line, quoted};

const NAME: &str = "KHR_materials_variants";

/// Gives primitives the materials of the variant that `wanted` names, or numbers. Without a wish they keep their own,
/// as the extension says.
///
/// Returns the variant's number.
pub(super) fn choose(root: &mut Root, wanted: Option<&str>, file: &str) -> Result<Option<usize>, LoadError> {
    let Some(wanted) = wanted else { return Ok(None) };
    let names = names(root);
    // A name goes first: it was given by a person.
    let named = names.iter().position(|name| name == wanted);
    let index = named.or_else(|| wanted.parse().ok().filter(|&index| index < names.len())).ok_or_else(|| {
        let what = format!("there is no variant {}: {}", quoted(wanted), list(&names));
        LoadError::NoSuchVariant { file: file.to_owned(), what }
    })?;
    let count = root.materials.len();
    for (m, mesh) in root.meshes.iter_mut().enumerate() {
        for (p, primitive) in mesh.primitives.iter_mut().enumerate() {
            let extension = primitive.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
            let mappings = extension.and_then(|extension| extension.get("mappings")?.as_array());
            let has = |mapping: &Value| {
                mapping
                    .get("variants")
                    .and_then(Value::as_array)
                    .is_some_and(|list| list.iter().any(|variant| variant.as_u64() == Some(index as u64)))
            };
            let Some((i, mapping)) = mappings.into_iter().flatten().enumerate().find(|(_, mapping)| has(mapping))
            else {
                continue;
            };
            let material = mapping.get("material").and_then(Value::as_u64).filter(|&index| index < count as u64);
            let material = material.ok_or_else(|| {
                let at = format!("/meshes/{m}/primitives/{p}/extensions/{NAME}/mappings/{i}/material");
                Fault::invalid(at, "this index points to no material of the file").at(file)
            })?;
            primitive.material = Some(Index::new(material as u32));
        }
    }
    Ok(Some(index))
}

/// The variants' names; that of one without a name is empty.
pub(super) fn names(root: &Root) -> Vec<String> {
    let extension = root.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
    let variants = extension.and_then(|extension| extension.get("variants")?.as_array()).into_iter().flatten();
    variants.map(|variant| one_line(variant.get("name").and_then(Value::as_str).unwrap_or_default())).collect()
}

fn list(names: &[String]) -> String {
    /// More would be no sentence.
    const MOST: usize = 20;
    let known: Vec<_> = names.iter().enumerate().map(|(i, name)| format!("{i} {}", quoted(name))).take(MOST).collect();
    match names.len() {
        0 => "the file has none".to_owned(),
        count if count > MOST => format!("the file has {}, and {} more", known.join(", "), count - MOST),
        _ => format!("the file has {}", known.join(", ")),
    }
}
