//! What a file may ask for: how much memory, and which other files.

use std::{fmt, path::Path};

/// Sizes above which a file is refused, before memory is taken for what it announces. A file that is not hostile can be
/// larger than the defaults, which therefore can be raised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of a file: the document, a buffer, an image, an environment map.
    pub file_bytes: u64,
    /// Bytes of all compressed geometry of a document together, when it is decompressed.
    pub decoded_bytes: u64,
    /// Texels of all images of a document together.
    pub texels: u64,
    /// Texels of an environment map.
    pub environment_texels: u64,
    /// Elements of an accessor: vertices or indices of a mesh.
    pub vertices: u64,
    /// Elements of an accessor without a buffer view, which are zeros and take no bytes of the file.
    pub zeros: u64,
    /// Triangles in memory: a shared mesh counts once. Also emissive triangles, each of which is a light in every
    /// instance.
    pub triangles: u64,
    /// Instances of meshes.
    pub instances: u64,
    /// Nodes from a root of the scene to a leaf.
    pub depth: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file_bytes: 8 << 30,
            decoded_bytes: 4 << 30,
            // A gigabyte of 8-bit RGBA.
            texels: 1 << 28,
            // 16384 × 8192, two gigabytes.
            environment_texels: 1 << 27,
            vertices: 1 << 27,
            zeros: 1 << 22,
            triangles: 1 << 26,
            instances: 1 << 25,
            // Nothing recurses; no hierarchy that anybody made is as deep.
            depth: 1 << 16,
        }
    }
}

impl Limits {
    /// The names of the limits, in the order of [`Limits`].
    pub const NAMES: [&str; 9] = [
        "file-bytes",
        "decoded-bytes",
        "texels",
        "environment-texels",
        "vertices",
        "zeros",
        "triangles",
        "instances",
        "depth",
    ];

    /// The limit of this name, if there is one.
    pub fn get_mut(&mut self, name: &str) -> Option<&mut u64> {
        let all = [
            &mut self.file_bytes,
            &mut self.decoded_bytes,
            &mut self.texels,
            &mut self.environment_texels,
            &mut self.vertices,
            &mut self.zeros,
            &mut self.triangles,
            &mut self.instances,
            &mut self.depth,
        ];
        Self::NAMES.iter().position(|known| *known == name).and_then(|i| all.into_iter().nth(i))
    }
}

/// The end of a sentence about something too large: which limit, and how it is raised.
pub(super) struct Limit(pub(super) &'static str, pub(super) u64);

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is the limit (--limit {}=N)", self.1, self.0)
    }
}

/// Which files a document may point to. What a model from the net points at is not for it to choose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outside {
    /// Only those in its folder and below.
    #[default]
    Refused,
    /// Any file of this machine.
    Allowed,
}

/// What becomes of a document that requires an extension which is not supported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Required {
    /// It is refused, as glTF asks.
    #[default]
    Honoured,
    /// Extensions of materials are ignored with a warning. Without any other, geometry would be missing or garbled:
    /// those are refused.
    MaterialsIgnored,
}

/// What becomes of extensions that are drafts: their pages may change, and files with them with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Drafts {
    /// They are not supported.
    #[default]
    LeftOut,
    /// They are read as their pages are now.
    Read,
}

/// How a document is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadOptions<'a> {
    /// The scene to show, by name or number, if it is not to be the file's default.
    pub scene: Option<&'a str>,
    /// The variant of materials to show (`KHR_materials_variants`), by name or number, if any.
    pub variant: Option<&'a str>,
    /// The time at which animations are shown; without one, what they move is at rest.
    pub at: Option<PosedAt<'a>>,
    /// What is too large.
    pub limits: Limits,
    /// Which other files it may point to.
    pub outside: Outside,
    /// What becomes of a file that requires an extension which is not supported.
    pub required: Required,
    /// What becomes of extensions that are drafts.
    pub drafts: Drafts,
}

impl LoadOptions<'_> {
    /// Which extensions are honoured.
    pub(super) fn policy(&self) -> Policy {
        Policy { required: self.required, drafts: self.drafts }
    }
}

/// Which extensions are honoured, and what becomes of a file that requires others.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Policy {
    pub(super) required: Required,
    pub(super) drafts: Drafts,
}

/// A time of a file's animations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosedAt<'a> {
    /// Seconds. Before its first key and after its last an animated value is that of the key.
    pub seconds: f32,
    /// The animation to show, by name or number. Without one all are shown together, or the first where several move
    /// the same thing.
    pub animation: Option<&'a str>,
}

/// Where a document lies, and what it may ask for from there.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) folder: &'a Path,
    pub(super) limits: Limits,
    pub(super) outside: Outside,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_has_a_name() {
        let mut limits = Limits::default();
        for (i, name) in Limits::NAMES.iter().enumerate() {
            *limits.get_mut(name).unwrap() = i as u64;
        }
        let Limits { file_bytes, decoded_bytes, texels, environment_texels, vertices, .. } = limits;
        assert_eq!([file_bytes, decoded_bytes, texels, environment_texels, vertices], [0, 1, 2, 3, 4]);
        let Limits { zeros, triangles, instances, depth, .. } = limits;
        assert_eq!([zeros, triangles, instances, depth], [5, 6, 7, 8]);
        assert_eq!(limits.get_mut("width"), None);
    }
}
