//! What can be animated: the properties that are read, by their JSON pointers.

use serde_json::{Map, Value, json};

/// What a property is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) enum Kind {
    /// So many numbers; one is not in an array.
    Numbers(usize),
    /// A unit quaternion.
    Rotation,
    /// As many numbers as there are morph targets.
    Weights,
    /// True or false.
    Flag,
}

const ONE: Kind = Kind::Numbers(1);
const COLOR: Kind = Kind::Numbers(3);

/// The properties, with `{}` for an index. Nothing else is changed: what the document was checked for stays true.
pub(in crate::io) const PROPERTIES: &[(&str, Kind)] = &[
    ("/nodes/{}/translation", Kind::Numbers(3)),
    ("/nodes/{}/rotation", Kind::Rotation),
    ("/nodes/{}/scale", Kind::Numbers(3)),
    ("/nodes/{}/weights", Kind::Weights),
    ("/nodes/{}/weights/{}", ONE),
    ("/nodes/{}/extensions/KHR_node_visibility/visible", Kind::Flag),
    ("/nodes/{}/extensions/PATHSPACE_sphere/radius", ONE),
    ("/meshes/{}/weights", Kind::Weights),
    ("/meshes/{}/weights/{}", ONE),
    ("/cameras/{}/perspective/yfov", ONE),
    ("/cameras/{}/perspective/aspectRatio", ONE),
    ("/cameras/{}/orthographic/xmag", ONE),
    ("/cameras/{}/orthographic/ymag", ONE),
    ("/cameras/{}/extensions/PATHSPACE_thin_lens/aperture", ONE),
    ("/cameras/{}/extensions/PATHSPACE_thin_lens/focusDistance", ONE),
    ("/extensions/KHR_lights_punctual/lights/{}/color", COLOR),
    ("/extensions/KHR_lights_punctual/lights/{}/intensity", ONE),
    ("/extensions/KHR_lights_punctual/lights/{}/spot/innerConeAngle", ONE),
    ("/extensions/KHR_lights_punctual/lights/{}/spot/outerConeAngle", ONE),
    ("/materials/{}/alphaCutoff", ONE),
    ("/materials/{}/emissiveFactor", COLOR),
    ("/materials/{}/normalTexture/scale", ONE),
    ("/materials/{}/pbrMetallicRoughness/baseColorFactor", Kind::Numbers(4)),
    ("/materials/{}/pbrMetallicRoughness/metallicFactor", ONE),
    ("/materials/{}/pbrMetallicRoughness/roughnessFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_anisotropy/anisotropyRotation", ONE),
    ("/materials/{}/extensions/KHR_materials_anisotropy/anisotropyStrength", ONE),
    ("/materials/{}/extensions/KHR_materials_clearcoat/clearcoatFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale", ONE),
    ("/materials/{}/extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", COLOR),
    ("/materials/{}/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_dispersion/dispersion", ONE),
    ("/materials/{}/extensions/KHR_materials_emissive_strength/emissiveStrength", ONE),
    ("/materials/{}/extensions/KHR_materials_ior/ior", ONE),
    ("/materials/{}/extensions/KHR_materials_iridescence/iridescenceFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_iridescence/iridescenceIor", ONE),
    ("/materials/{}/extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", ONE),
    ("/materials/{}/extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", ONE),
    ("/materials/{}/extensions/KHR_materials_pbrSpecularGlossiness/diffuseFactor", Kind::Numbers(4)),
    ("/materials/{}/extensions/KHR_materials_pbrSpecularGlossiness/glossinessFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_pbrSpecularGlossiness/specularFactor", COLOR),
    ("/materials/{}/extensions/KHR_materials_sheen/sheenColorFactor", COLOR),
    ("/materials/{}/extensions/KHR_materials_sheen/sheenRoughnessFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_specular/specularColorFactor", COLOR),
    ("/materials/{}/extensions/KHR_materials_specular/specularFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_transmission/transmissionFactor", ONE),
    ("/materials/{}/extensions/KHR_materials_volume/attenuationColor", COLOR),
    ("/materials/{}/extensions/KHR_materials_volume/attenuationDistance", ONE),
    ("/materials/{}/extensions/KHR_materials_volume/thicknessFactor", ONE),
];

/// What a reference to a texture in a material can have at its end.
const TEXTURE_TRANSFORM: &[(&str, Kind)] = &[
    ("Texture/extensions/KHR_texture_transform/offset", Kind::Numbers(2)),
    ("Texture/extensions/KHR_texture_transform/rotation", ONE),
    ("Texture/extensions/KHR_texture_transform/scale", Kind::Numbers(2)),
];

/// What is at this pointer; `None` if it is nothing that is read and can be animated.
pub(super) fn kind(pointer: &str) -> Option<Kind> {
    let is = |pattern: &str| {
        let (mut ours, mut theirs) = (pattern.split('/'), pointer.split('/'));
        loop {
            match (ours.next(), theirs.next()) {
                (None, None) => return true,
                (Some("{}"), Some(index)) if is_index(index) => {}
                (Some(a), Some(b)) if a == b => {}
                _ => return false,
            }
        }
    };
    let found = PROPERTIES.iter().find(|(pattern, _)| is(pattern));
    let of_texture = || TEXTURE_TRANSFORM.iter().find(|(end, _)| pointer.ends_with(end));
    found.or_else(|| of_texture().filter(|_| pointer.starts_with("/materials/"))).map(|(_, kind)| *kind)
}

/// Whether it is an index as RFC 6901 has it, so that one thing has one pointer.
fn is_index(text: &str) -> bool {
    text.parse::<usize>().is_ok_and(|index| index.to_string() == text)
}

/// Gives the property at `pointer`, which is of this kind, its value. What is not there and has a default comes into
/// being.
///
/// # Errors
/// What is wrong with the place, in words that follow its name.
pub(super) fn set(document: &mut Value, pointer: &str, kind: Kind, value: &[f64]) -> Result<(), &'static str> {
    let (owner, member) = pointer.rsplit_once('/').unwrap_or_default();
    let has_matrix = |node: &Value| node.get("matrix").is_some_and(|matrix| !matrix.is_null());
    if owner.starts_with("/nodes/") && is_moved(member) && document.pointer(owner).is_some_and(has_matrix) {
        return Err("and the node has a matrix, which must not be animated");
    }
    let place = place(document, pointer).ok_or("which the file does not have")?;
    *place = match (kind, value) {
        (Kind::Flag, [flag, ..]) => json!(*flag != 0.0),
        (Kind::Numbers(1), [number, ..]) => json!(number),
        _ => json!(value),
    };
    Ok(())
}

/// The place of a property, made if it is not there: the members of an object have defaults, and so have extensions
/// and the parameters of a material. Textures, cameras and elements of arrays do not, nor do this project's extensions,
/// each of which is a thing of its own.
fn place<'a>(document: &'a mut Value, pointer: &str) -> Option<&'a mut Value> {
    let mut at = document;
    let mut parts = pointer.split('/').skip(1).peekable();
    let mut before = "";
    while let Some(part) = parts.next() {
        let is_extension = before == "extensions" && !part.starts_with("PATHSPACE_");
        let has_default =
            parts.peek().is_none() || matches!(part, "extensions" | "pbrMetallicRoughness") || is_extension;
        at = match at {
            Value::Array(array) => array.get_mut(part.parse::<usize>().ok()?)?,
            Value::Object(members) => {
                if has_default && !members.contains_key(part) {
                    members.insert(part.to_owned(), Value::Object(Map::new()));
                }
                members.get_mut(part)?
            }
            _ => return None,
        };
        before = part;
    }
    Some(at)
}

/// Whether a member of a node is a part of its transform.
fn is_moved(member: &str) -> bool {
    matches!(member, "translation" | "rotation" | "scale")
}
