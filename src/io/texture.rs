//! glTF textures as [`Texture`]s: which image, sampled how, placed by which texture coordinates.

use glam::{Affine2, Mat2, Vec2};
use gltf_json::{
    Root,
    texture::{Info, MagFilter, WrappingMode},
    validation::Checked,
};
use serde_json::{Map, Value};

use super::{error::Fault, image::Images};
use crate::scene::{
    geometry::UV_SETS,
    texture::{Encoding, Filter, Texture, Wrap},
};

/// A material's reference to a texture; normal textures have a type of their own in the schema.
pub(super) struct Reference<'a> {
    pub(super) texture: usize,
    pub(super) tex_coord: u32,
    pub(super) extensions: Option<&'a Map<String, Value>>,
}

impl<'a> From<&'a Info> for Reference<'a> {
    fn from(info: &'a Info) -> Self {
        let extensions = info.extensions.as_ref().map(|extensions| &extensions.others);
        Self { texture: info.index.value(), tex_coord: info.tex_coord, extensions }
    }
}

/// Reads the texture that the reference at the JSON pointer `at` names; `None`, with a warning, for one that has no
/// image of a kind that is read, or whose texture coordinates are not.
pub(super) fn read(
    root: &Root,
    images: &mut Images<'_>,
    reference: &Reference<'_>,
    encoding: Encoding,
    at: &str,
    warnings: &mut Vec<String>,
) -> Result<Option<Texture>, Fault> {
    let index = reference.texture;
    let Some(source) = root.textures.get(index) else {
        return Err(Fault::invalid(format!("{at}/index"), format!("there is no texture {index}")));
    };
    let others = source.extensions.as_ref().map(|extensions| &extensions.others);
    let other = |name| Some((name, others?.get(name)?));
    let image = match other("KHR_texture_basisu").or_else(|| other("EXT_texture_webp")) {
        Some((name, other)) => {
            let at = format!("/textures/{index}/extensions/{name}/source");
            let image = other.get("source").and_then(Value::as_u64).and_then(|image| usize::try_from(image).ok());
            image.ok_or_else(|| Fault::invalid(at, "this is no index of an image"))?
        }
        None => source.source.value(),
    };
    if image == u32::MAX as usize {
        warnings.push(format!("/textures/{index} has no image of a kind that is read: {at} is left out"));
        return Ok(None);
    }
    let placement = Placement::read(reference, at)?;
    let Some(uv_set) = u8::try_from(placement.tex_coord).ok().filter(|set| usize::from(*set) < UV_SETS) else {
        let set = placement.tex_coord;
        warnings.push(format!("{at} asks for TEXCOORD_{set}, and {UV_SETS} sets are read: it is left out"));
        return Ok(None);
    };
    let sampler = source.sampler.and_then(|sampler| root.samplers.get(sampler.value()));
    let wrap = |mode: Option<Checked<WrappingMode>>| match mode {
        Some(Checked::Valid(WrappingMode::ClampToEdge)) => Wrap::Clamp,
        Some(Checked::Valid(WrappingMode::MirroredRepeat)) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    let filter = match sampler.and_then(|sampler| sampler.mag_filter) {
        Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
        _ => Filter::Bilinear,
    };
    Ok(Some(Texture {
        image: images.get(image)?,
        encoding,
        wrap: [wrap(sampler.map(|s| s.wrap_s)), wrap(sampler.map(|s| s.wrap_t))],
        filter,
        uv_set,
        transform: placement.transform,
    }))
}

struct Placement {
    tex_coord: u32,
    transform: Affine2,
}

impl Placement {
    /// Of the reference itself, or of its `KHR_texture_transform`.
    fn read(reference: &Reference<'_>, at: &str) -> Result<Self, Fault> {
        let plain = Self { tex_coord: reference.tex_coord, transform: Affine2::IDENTITY };
        let Some(source) = reference.extensions.and_then(|others| others.get("KHR_texture_transform")) else {
            return Ok(plain);
        };
        let at = format!("{at}/extensions/KHR_texture_transform");
        let number = |value: &Value, member: &str| {
            let number = value.as_f64().map(|x| x as f32).filter(|x| x.is_finite());
            number.ok_or_else(|| Fault::invalid(format!("{at}/{member}"), "this is no finite number"))
        };
        let pair = |member: &str, default: Vec2| match source.get(member) {
            None => Ok(default),
            Some(Value::Array(pair)) if pair.len() == 2 => {
                Ok(Vec2::new(number(&pair[0], member)?, number(&pair[1], member)?))
            }
            Some(_) => Err(Fault::invalid(format!("{at}/{member}"), "this is no pair of numbers")),
        };
        let angle = source.get("rotation").map_or(Ok(0.0), |angle| number(angle, "rotation"))?;
        let tex_coord = match source.get("texCoord") {
            None => plain.tex_coord,
            Some(set) => set.as_u64().and_then(|set| u32::try_from(set).ok()).ok_or_else(|| {
                Fault::invalid(format!("{at}/texCoord"), "this is no number of a set of texture coordinates")
            })?,
        };
        // Translation · rotation · scale. Angles count counter-clockwise as seen on the image, whose v goes down.
        let (sin, cos) = angle.sin_cos();
        let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        let linear = rotation * Mat2::from_diagonal(pair("scale", Vec2::ONE)?);
        Ok(Self { tex_coord, transform: Affine2::from_mat2_translation(linear, pair("offset", Vec2::ZERO)?) })
    }
}
