//! Extensions that are not supported: what becomes of the file, and what its owner can do.

use super::{error::quoted, features};

/// What turns a file with this extension into one without it, if something common does.
pub(super) fn remedy(name: &str) -> Option<&'static str> {
    Some(match name {
        "EXT_texture_avif" => "“gltf-transform png IN.glb OUT.glb” turns its textures into PNG",
        "MSFT_texture_dds" => "save its textures as PNG",
        _ => return None,
    })
}

/// Whether an extension adds to materials alone, by its name: `KHR_materials_sheen`, `ADOBE_materials_clearcoat_tint`.
pub(super) fn is_of_materials(name: &str) -> bool {
    name.contains("_materials_")
}

/// The warning about a required extension that is ignored on request.
pub(super) fn ignored(name: &str) -> String {
    format!(
        "THE FILE REQUIRES the extension {}, which is not supported and is ignored as --ignore-required asks: its \
         materials \
         will look wrong",
        quoted(name)
    )
}

/// The complaint about required extensions. `names` is not empty.
pub(super) fn refused(names: &[&str]) -> String {
    let (noun, verb) = if names.len() == 1 { ("extension", "is") } else { ("extensions", "are") };
    let list = names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", ");
    let mut remedies: Vec<_> = names.iter().filter_map(|name| remedy(name)).collect();
    remedies.dedup();
    if names.iter().any(|name| features::is_draft(name)) {
        remedies.push("--drafts reads what is a draft");
    }
    let help = if remedies.is_empty() { String::new() } else { format!(": {}", remedies.join(", ")) };
    let anyway = if names.iter().all(|name| is_of_materials(name)) {
        " (--ignore-required renders the file without)"
    } else {
        ""
    };
    format!("the required {noun} {list} {verb} not supported{anyway}{help}")
}

/// The warning about an optional extension.
pub(super) fn left_out(name: &str) -> String {
    let name_quoted = quoted(name);
    match name {
        "EXT_texture_avif" | "MSFT_texture_dds" => {
            format!("the optional extension {name_quoted} is not supported: the plain images are read in its place")
        }
        _ if features::is_draft(name) => {
            format!("the optional extension {name_quoted} is a draft: what it adds is left out without --drafts")
        }
        _ => format!("the optional extension {name_quoted} is not supported: what it adds is left out"),
    }
}
