//! Vertex attributes that materials read: texture coordinates, colours, tangents.

use glam::Vec4;
use gltf_json::{
    Index,
    accessor::Accessor,
    mesh::{Primitive, Semantic},
    validation::Checked,
};

use super::{
    accessor::{self, Accessors},
    error::Fault,
};
use crate::scene::{geometry::Attributes, material::Maps};

/// Reads the attributes of a primitive with `vertices` vertices, as far as `maps` and vertex colours need them.
///
/// Tangents without normals are left out: they belong to normals that the file does not say
/// (glTF 2.0 specification, 3.7.2.1). So are colours that are white everywhere.
///
/// Texture coordinates and colours that are not finite are refused, since nothing else says what they should be.
/// Tangents are not looked at: they can be made anew.
pub(super) fn read(
    accessors: Accessors<'_>,
    primitive: &Primitive,
    vertices: usize,
    maps: &Maps,
    at: &str,
    warnings: &mut Vec<String>,
) -> Result<Attributes, Fault> {
    let find = |semantic| -> Result<Option<Index<Accessor>>, Fault> {
        let name = format!("{at}/attributes/{}", name(&semantic));
        let Some(index) = primitive.attributes.get(&Checked::Valid(semantic)).copied() else { return Ok(None) };
        if accessors.count(index) != vertices {
            let what = format!("there are {} elements for {vertices} positions", accessors.count(index));
            return Err(Fault::invalid(name, what));
        }
        Ok(Some(index))
    };
    let mut attributes = Attributes::default();
    for texture in maps.textures() {
        let set = usize::from(texture.uv_set);
        if !attributes.uv[set].is_empty() {
            continue;
        }
        match find(Semantic::TexCoords(u32::from(texture.uv_set)))? {
            Some(index) => {
                attributes.uv[set] = accessors.vec2(index)?;
                finite(&attributes.uv[set], |uv| uv.is_finite(), index)?;
            }
            None => {
                let what = format!("{at} has no TEXCOORD_{set}, which its material asks for: taken as (0, 0)");
                if !warnings.contains(&what) {
                    warnings.push(what);
                }
            }
        }
    }
    if let Some(index) = find(Semantic::Colors(0))? {
        let colors = accessors.colors(index)?;
        finite(&colors, |color| color.is_finite(), index)?;
        let beyond = colors.iter().filter(|color| **color != color.clamp(Vec4::ZERO, Vec4::ONE)).count();
        if beyond > 0 {
            warnings.push(format!("{at}: {beyond} vertex colours lie outside of [0, 1], and are cut to it"));
        }
        if colors.iter().any(|color| *color != Vec4::ONE) {
            let unit = |c: f32| (c.clamp(0.0, 1.0) * 65535.0).round() as u16;
            attributes.colors = colors.iter().map(|color| color.to_array().map(unit)).collect();
        }
    }
    if maps.need_tangents()
        && primitive.attributes.contains_key(&Checked::Valid(Semantic::Normals))
        && let Some(index) = find(Semantic::Tangents)?
    {
        attributes.tangents = accessors.vec4(index)?;
    }
    Ok(attributes)
}

fn finite<T>(list: &[T], is_finite: impl Fn(&T) -> bool, index: Index<Accessor>) -> Result<(), Fault> {
    match list.iter().position(|element| !is_finite(element)) {
        None => Ok(()),
        Some(i) => Err(Fault::invalid(accessor::pointer(index), format!("element {i} is not finite"))),
    }
}

fn name(semantic: &Semantic) -> String {
    match semantic {
        Semantic::TexCoords(set) => format!("TEXCOORD_{set}"),
        Semantic::Colors(set) => format!("COLOR_{set}"),
        _ => "TANGENT".to_owned(),
    }
}
