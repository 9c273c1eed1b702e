//! Which sums a render has, and what they are called in a file.

use crate::film::{AlphaSums, DepositErrors, ExactSum, Film, FixedPoint, Half};

/// All exact sums of a render.
#[derive(Clone)]
pub struct Sums<'a> {
    /// Those of the image.
    pub film: &'a Film,
    /// Those of its alpha channel, where the background is transparent.
    pub alpha_sums: Option<&'a AlphaSums>,
    /// Those of images beside it, by their names.
    pub layers: Vec<(&'a str, &'a Film)>,
}

impl Sums<'_> {
    /// Which they are.
    pub fn contents(&self) -> Contents {
        let mut layers: Vec<_> = self.layers.iter().map(|(name, _)| (*name).to_owned()).collect();
        layers.sort();
        Contents { transparent: self.alpha_sums.is_some(), layers }
    }

    /// What could not be added to any of them.
    pub fn errors(&self) -> DepositErrors {
        self.layers.iter().fold(self.film.errors(), |all, (_, film)| all.plus(film.errors()))
    }

    /// All of them, in the order of their names.
    pub(super) fn all(&self) -> Vec<(String, Sum)> {
        all(self.alpha_sums.is_some(), self.layers.iter().map(|(name, _)| *name))
    }

    fn film(&self, number: usize) -> &Film {
        number.checked_sub(1).map_or(self.film, |layer| self.layers[layer].1)
    }

    /// A sum of light.
    pub(super) fn light(&self, Light(film, half, channel): Light, pixel: usize) -> ExactSum {
        self.film(film).sum(half, pixel, channel)
    }

    /// The same in units of fine words of `scale`, where these make it up.
    #[inline]
    pub(super) fn units(&self, light: Light, pixel: usize, scale: FixedPoint) -> Option<i128> {
        let Light(film, half, channel) = light;
        self.film(film).units(half, pixel, channel, scale)
    }

    #[inline]
    pub(super) fn add_units(&self, light: Light, pixel: usize, units: i128, scale: FixedPoint) {
        let Light(film, half, channel) = light;
        self.film(film).add_units(half, pixel, channel, units, scale);
    }

    pub(super) fn add_light(&self, Light(film, half, channel): Light, pixel: usize, value: ExactSum) {
        self.film(film).add_sum(half, pixel, channel, value);
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
    /// What the sums take in a file, and again while they are read or written, in bytes: without a table of those that
    /// are out of the common.
    pub fn bytes(&self, pixels: u64) -> u64 {
        let light = 3 * 6 * (1 + self.layers.len() as u64);
        let words = light + if self.transparent { 4 } else { 0 };
        4 * pixels.saturating_mul(words)
    }

    /// What a file with these channels has; `None` if they are not those of a render.
    pub(super) fn of(mut channels: Vec<String>) -> Option<Self> {
        let layers = channels.iter().filter_map(|name| name.strip_prefix(LAYER)?.strip_suffix(".even.R.low"));
        let mut contents = Self { transparent: false, layers: layers.map(str::to_owned).collect() };
        contents.layers.sort();
        contents.transparent = channels.iter().any(|name| name == "coverage.all.low");
        let own = all(contents.transparent, contents.layers.iter().map(String::as_str));
        let mut own: Vec<_> = own.iter().flat_map(|(name, sum)| words(name, *sum)).collect();
        own.sort();
        channels.sort();
        (own == channels).then_some(contents)
    }
}

/// Before the names of layers, so that none is taken for a sum of the image.
const LAYER: &str = "layer.";

/// The channels with the words of a sum, the highest first.
pub(super) fn words(name: &str, sum: Sum) -> impl Iterator<Item = String> {
    let parts = match sum {
        Sum::Light(_) => &["high", "low", "fine"][..],
        Sum::Alpha(_) => &["high", "low"],
    };
    parts.iter().map(move |part| format!("{name}.{part}"))
}

/// One of the sums of every pixel.
#[derive(Clone, Copy)]
pub(super) enum Sum {
    Light(Light),
    Alpha(usize),
}

/// One of the image (0) or a layer (its place and one), of a half of it, and of a channel.
#[derive(Clone, Copy)]
pub(super) struct Light(usize, Half, usize);

fn all<'a>(transparent: bool, layers: impl Iterator<Item = &'a str>) -> Vec<(String, Sum)> {
    let prefixes = [String::new()].into_iter().chain(layers.map(|name| format!("{LAYER}{name}.")));
    let mut all = Vec::new();
    for (film, prefix) in prefixes.enumerate() {
        for (half, name) in [(Half::Even, "even"), (Half::Odd, "odd")] {
            let light = |c| Sum::Light(Light(film, half, c));
            let channels = ["R", "G", "B"].into_iter().enumerate();
            all.extend(channels.map(|(c, letter)| (format!("{prefix}{name}.{letter}"), light(c))));
        }
    }
    if transparent {
        all.extend(["all", "hit"].into_iter().enumerate().map(|(c, of)| (format!("coverage.{of}"), Sum::Alpha(c))));
    }
    all.sort_by(|(a, _), (b, _)| a.cmp(b));
    all
}
