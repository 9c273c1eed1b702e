//! Which sums a render has, and what they are called in a file.

use crate::film::{Coverage, Film, Half};

/// All exact sums of a render.
#[derive(Clone)]
pub struct Sums<'a> {
    /// Those of the image.
    pub film: &'a Film,
    /// Those of its alpha channel, where the background is transparent.
    pub coverage: Option<&'a Coverage>,
    /// Those of images beside it, by their names.
    pub layers: Vec<(&'a str, &'a Film)>,
}

impl Sums<'_> {
    /// Which they are.
    pub fn contents(&self) -> Contents {
        let mut layers: Vec<_> = self.layers.iter().map(|(name, _)| (*name).to_owned()).collect();
        layers.sort();
        Contents { transparent: self.coverage.is_some(), layers }
    }

    /// All of them, with their names.
    pub(super) fn all(&self) -> Vec<(String, Sum)> {
        all(self.coverage.is_some(), self.layers.iter().map(|(name, _)| *name))
    }

    fn film(&self, number: usize) -> &Film {
        number.checked_sub(1).map_or(self.film, |layer| self.layers[layer].1)
    }

    pub(super) fn get(&self, sum: Sum, pixel: usize) -> u64 {
        match sum {
            Sum::Light(film, half, channel) => self.film(film).sum(half, pixel, channel),
            Sum::Coverage(channel) => self.coverage.map_or(0, |coverage| coverage.sum(pixel, channel)),
        }
    }

    pub(super) fn add(&self, sum: Sum, pixel: usize, value: u64) {
        match sum {
            Sum::Light(film, half, channel) => self.film(film).add_sum(half, pixel, channel, value),
            Sum::Coverage(channel) => {
                if let Some(coverage) = self.coverage {
                    coverage.add_sum(pixel, channel, value);
                }
            }
        }
    }
}

/// Which sums there are besides the image's.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Contents {
    /// Whether there are those of an alpha channel.
    pub transparent: bool,
    /// The names of the layers, sorted.
    pub layers: Vec<String>,
}

impl Contents {
    /// What the sums take in a file, and again while they are read or written, in bytes.
    pub fn bytes(&self, pixels: u64) -> u64 {
        let sums = 6 * (1 + self.layers.len() as u64) + if self.transparent { 2 } else { 0 };
        8 * pixels.saturating_mul(sums)
    }

    /// What a file with these channels has; `None` if they are not those of a render.
    pub(super) fn of(mut channels: Vec<String>) -> Option<Self> {
        let layers = channels.iter().filter_map(|name| name.strip_prefix(LAYER)?.strip_suffix(".even.R.low"));
        let mut contents = Self { transparent: false, layers: layers.map(str::to_owned).collect() };
        contents.layers.sort();
        contents.transparent = channels.iter().any(|name| name == "coverage.all.low");
        let own = all(contents.transparent, contents.layers.iter().map(String::as_str));
        let mut own: Vec<_> = own.iter().flat_map(|(name, _)| words(name)).collect();
        own.sort();
        channels.sort();
        (own == channels).then_some(contents)
    }
}

/// Before the names of layers, so that none is taken for a sum of the image.
const LAYER: &str = "layer.";

/// The channels with the high and the low word of a sum.
pub(super) fn words(name: &str) -> [String; 2] {
    ["high", "low"].map(|part| format!("{name}.{part}"))
}

/// One of the sums of every pixel.
#[derive(Clone, Copy)]
pub(super) enum Sum {
    /// Of the image (0) or a layer (its place and one).
    Light(usize, Half, usize),
    Coverage(usize),
}

fn all<'a>(transparent: bool, layers: impl Iterator<Item = &'a str>) -> Vec<(String, Sum)> {
    let prefixes = [String::new()].into_iter().chain(layers.map(|name| format!("{LAYER}{name}.")));
    let mut all = Vec::new();
    for (film, prefix) in prefixes.enumerate() {
        for (half, name) in [(Half::Even, "even"), (Half::Odd, "odd")] {
            let channels = ["R", "G", "B"].into_iter().enumerate();
            all.extend(channels.map(|(c, letter)| (format!("{prefix}{name}.{letter}"), Sum::Light(film, half, c))));
        }
    }
    if transparent {
        all.extend(["all", "hit"].into_iter().enumerate().map(|(c, of)| (format!("coverage.{of}"), Sum::Coverage(c))));
    }
    all
}
