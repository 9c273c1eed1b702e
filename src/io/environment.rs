//! Reading environment maps: equirectangular Radiance (`.hdr`) and OpenEXR (`.exr`) files.
//!
//! The first bytes say which of the two a file is, not its name. Colours are linear Rec. 709 unless the file says
//! otherwise, and are converted then; radiance is in the units of the scene. [`EnvironmentMap`] states where the map's
//! middle, top and edges are.

use std::path::Path;

use super::{
    buffer::{self, Hash},
    error::one_line,
    limits::Limits,
    openexr::{Picture, Refusal, openexr, refuse_parts},
    primaries::Colors,
    radiance::radiance,
};
use crate::{
    math::Rgb,
    scene::light::{EnvironmentMap, NotARadiance},
};

/// An environment map as its file holds it.
#[derive(Clone, Debug)]
pub struct LoadedEnvironment {
    /// The map, scaled and turned.
    pub map: EnvironmentMap,
    /// SHA-256 of the file, in hexadecimal.
    pub hash: String,
    /// What is odd about the file, one sentence each.
    pub warnings: Vec<String>,
}

/// Why an environment map could not be read. Its message is one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EnvironmentError {
    /// The file itself cannot be read.
    #[error("cannot read {file}: {reason}; check the name and its permissions")]
    Unreadable {
        /// The file.
        file: String,
        /// What the operating system says.
        reason: String,
    },
    /// The file is of another kind.
    #[error("{file} is neither a Radiance nor an OpenEXR file; save the environment map as .hdr or .exr")]
    UnknownFormat {
        /// The file.
        file: String,
    },
    /// The file is damaged, or of a kind that is not read.
    #[error("{file}: {what}; save the environment map again as an RGB image")]
    Damaged {
        /// The file.
        file: String,
        /// What is wrong with it.
        what: String,
    },
    /// More than memory is meant to hold.
    #[error(
        "{file} has {width} × {height} texels, and {limit} is the limit in all; scale it down (or --limit \
         environment-texels=N)"
    )]
    TooLarge {
        /// The file.
        file: String,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// How many there may be.
        limit: u64,
    },
    /// A texel that is not a radiance.
    #[error(
        "{file}, column {x}, row {y}: the radiance {value} is not finite, or above 1e30 after scaling; repair that \
         pixel"
    )]
    Texel {
        /// The file.
        file: String,
        /// The column, from 0.
        x: usize,
        /// The row, from 0 at the top.
        y: usize,
        /// What stands there, scaled.
        value: Rgb,
    },
}

/// Reads an environment map, multiplies its radiance by `scale` and turns it by `rotation` radians about +y.
///
/// # Errors
/// An [`EnvironmentError`] says in one sentence what keeps the file from being read.
pub fn load_environment(path: &Path, scale: f32, rotation: f32) -> Result<LoadedEnvironment, EnvironmentError> {
    load_environment_within(&Limits::default(), path, scale, rotation)
}

/// The same with limits of one's own.
///
/// # Errors
/// As [`load_environment`].
pub fn load_environment_within(
    limits: &Limits,
    path: &Path,
    scale: f32,
    rotation: f32,
) -> Result<LoadedEnvironment, EnvironmentError> {
    let file = one_line(&path.display().to_string());
    match buffer::file(path, limits.file_bytes) {
        Ok(bytes) => read_environment(limits, &bytes, &file, scale, rotation),
        Err(reason) => Err(EnvironmentError::Unreadable { file, reason }),
    }
}

/// The same from memory; `file` is the name in messages.
///
/// # Errors
/// As [`load_environment`].
pub fn read_environment(
    limits: &Limits,
    bytes: &[u8],
    file: &str,
    scale: f32,
    rotation: f32,
) -> Result<LoadedEnvironment, EnvironmentError> {
    let limit = limits.environment_texels;
    let file = file.to_owned();
    let mut warnings = Vec::new();
    let decoded = if bytes.starts_with(b"#?") {
        radiance(bytes, limit, &mut warnings)
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        refuse_parts(bytes).and_then(|()| openexr(bytes, limit))
    } else {
        return Err(EnvironmentError::UnknownFormat { file });
    };
    let mut picture = match decoded {
        Ok(picture) => picture,
        Err(Refusal::Damaged(what)) => return Err(EnvironmentError::Damaged { file, what: one_line(&what) }),
        Err(Refusal::TooLarge(width, height)) => return Err(EnvironmentError::TooLarge { file, width, height, limit }),
    };
    let (width, height) = (picture.width, picture.texels.len() / picture.width);
    if width != 2 * height {
        warnings.push(format!(
            "the environment map is {width} × {height}, not twice as wide as high: it is stretched over the whole \
             sphere"
        ));
    }
    warnings.extend(without_negatives(&mut picture));
    picture.texels.iter_mut().for_each(|texel| *texel *= scale);
    let map = EnvironmentMap::new(width, picture.texels, rotation)
        .map_err(|NotARadiance { x, y, value }| EnvironmentError::Texel { file, x, y, value })?;
    let mut hash = Hash::new();
    hash.add(bytes);
    Ok(LoadedEnvironment { map, hash: hash.hex(), warnings })
}

/// Sharpening filters leave channels a little below zero, and Rec. 709 has none of some colours of wider gamuts; such
/// channels count as zero, and a sentence says so.
fn without_negatives(picture: &mut Picture) -> Option<String> {
    let negative = |texel: &Rgb| texel.to_array().iter().any(|c| *c < 0.0 && c.is_finite());
    let first = picture.texels.iter().position(negative)?;
    let (x, y) = (first % picture.width, first / picture.width);
    let value = picture.texels[first];
    let mut count = 0;
    for texel in picture.texels.iter_mut().filter(|texel| negative(texel)) {
        count += 1;
        *texel = texel.map(|c| if c < 0.0 && c.is_finite() { 0.0 } else { c });
    }
    let why = match picture.colors {
        Colors::Rec709 => "",
        Colors::Other(_) => " after conversion to Rec. 709, whose gamut is smaller than the file's",
    };
    Some(format!(
        "{count} pixels of the environment map have negative channels{why}; these count as zero (the first is {value} \
         in \
         column {x}, row {y})"
    ))
}
