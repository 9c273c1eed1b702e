//! `--data`: what the camera sees besides light, and what is known of the image's noise, as channels of the .exr file.

use clap::ValueEnum;
use pathspace::{
    denoise::Guides,
    film::{Half, Image, Samples},
    math::Rgb,
    render::{Data, Renderer},
};
use std::ops::Index;

use crate::cli::shared::{denoised::guides_among, exit::Failure, pictures::Outputs, values::Shard};

/// Data layers as channels of the .exr file.
#[derive(Clone, Debug, clap::Args)]
pub struct DataArgs {
    /// What denoisers and compositors ask for, as channels of the .exr file
    #[arg(long, value_name = "SET", value_delimiter = ',')]
    data: Vec<DataSet>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
enum DataSet {
    /// Colour of the surface: albedo.R, .G, .B
    Albedo,
    /// N_s and N_g in world space: normal.X, .Y, .Z and geometric-normal.X, .Y, .Z
    Normals,
    /// World space, metres: position.X, .Y, .Z
    Position,
    /// Along the camera's axis, metres: depth.Z
    Depth,
    /// Integers from 1, 0 for nothing: id.material, id.primitive, id.instance
    Ids,
    /// Samples per pixel, and the part of them that meets a surface: samples.count and samples.hits
    Samples,
    /// The image of the even and that of the odd samples: even.R … and odd.R …
    Halves,
    /// Of the image, estimated from the two halves: variance.R, .G, .B
    Variance,
}

/// Bytes that the channels of a pixel take while the file is written, whichever they are.
const BYTES_PER_PIXEL: u64 = 600;

impl DataArgs {
    /// Refuses what does not go together.
    pub fn check(&self, shard: Option<Shard>, spp: Option<u32>, outputs: &Outputs) -> Result<(), Failure> {
        if self.data.is_empty() {
            return Ok(());
        }
        if !outputs.holds_layers() {
            return Err(Failure::usage("--data makes channels of an .exr file, and no output is one (-o OUT.exr)"));
        }
        if shard.is_some() {
            return Err(Failure::usage(
                "a shard holds no data channels: leave --data out, and render them with the whole image",
            ));
        }
        let halves = self.data.iter().any(|set| [DataSet::Halves, DataSet::Variance].contains(set));
        if halves && spp == Some(1) {
            return Err(Failure::usage(
                "one sample per pixel has no halves: choose --spp 2 or more, or leave them out",
            ));
        }
        Ok(())
    }

    /// What they take for so many pixels, with those that guide a filter if there is one.
    pub fn memory(&self, pixels: u64, guiding: bool) -> u64 {
        if self.data.is_empty() && !guiding { 0 } else { BYTES_PER_PIXEL * pixels }
    }

    /// What an image's header says of them. They are no setting of the render: it may be resumed with others.
    pub fn attribute(&self) -> Option<(String, String)> {
        let names: Vec<_> = self.data.iter().filter_map(ValueEnum::to_possible_value).collect();
        let names: Vec<_> = names.iter().map(clap::builder::PossibleValue::get_name).collect();
        (!names.is_empty()).then(|| ("data".to_owned(), names.join(" ")))
    }

    /// The channels.
    pub fn channels(&self, renderer: &Renderer<'_>) -> Vec<(String, Samples)> {
        made(self.data.clone(), renderer)
    }

    /// The channels, and what guides a filter, whether or not it is among them.
    pub fn channels_and_guides(&self, renderer: &Renderer<'_>) -> (Vec<(String, Samples)>, Option<Guides>) {
        let mut channels = made([&self.data[..], &GUIDING].concat(), renderer);
        let guides = guides_among(&channels);
        let unasked = |name: &str| GUIDING.iter().any(|set| !self.data.contains(set) && set.makes(name));
        channels.retain(|(name, _)| !unasked(name));
        (channels, guides)
    }
}

/// What guides a filter.
const GUIDING: [DataSet; 2] = [DataSet::Albedo, DataSet::Normals];

impl DataSet {
    /// Whether a channel is one of those that guide, and of this set.
    fn makes(self, channel: &str) -> bool {
        let layers: &[&str] = match self {
            Self::Albedo => &["albedo."],
            Self::Normals => &["normal.", "geometric-normal."],
            _ => &[],
        };
        layers.iter().any(|layer| channel.starts_with(layer))
    }
}

/// The channels of these sets.
fn made(mut sets: Vec<DataSet>, renderer: &Renderer<'_>) -> Vec<(String, Samples)> {
    sets.sort_unstable();
    sets.dedup();
    let needs_rays = sets.iter().any(|set| *set <= DataSet::Samples);
    let seen = if needs_rays { renderer.data() } else { Data::default() };
    let mut channels = Channels(Vec::new());
    for set in sets {
        match set {
            DataSet::Albedo => channels.three("albedo", ["R", "G", "B"], &seen.albedo),
            DataSet::Normals => {
                channels.three("normal", ["X", "Y", "Z"], &seen.shading_normal);
                channels.three("geometric-normal", ["X", "Y", "Z"], &seen.normal);
            }
            DataSet::Position => channels.three("position", ["X", "Y", "Z"], &seen.position),
            DataSet::Depth => channels.float("depth.Z", seen.depth.clone()),
            DataSet::Ids => {
                channels.integer("id.material", seen.material.clone());
                channels.integer("id.primitive", seen.primitive.clone());
                channels.integer("id.instance", seen.instance.clone());
            }
            DataSet::Samples => {
                channels.integer("samples.count", vec![renderer.passes(); seen.hits.len()]);
                channels.float("samples.hits", seen.hits.clone());
            }
            DataSet::Halves => {
                let [even, odd] = halves(renderer);
                channels.three("even", ["R", "G", "B"], &even.pixels);
                channels.three("odd", ["R", "G", "B"], &odd.pixels);
            }
            DataSet::Variance => {
                channels.three("variance", ["R", "G", "B"], &variance(&halves(renderer)));
            }
        }
    }
    channels.0
}

struct Channels(Vec<(String, Samples)>);

impl Channels {
    fn three(&mut self, name: &str, letters: [&str; 3], pixels: &[impl Index<usize, Output = f32>]) {
        for (i, letter) in letters.into_iter().enumerate() {
            self.float(&format!("{name}.{letter}"), pixels.iter().map(|p| p[i]).collect());
        }
    }

    fn float(&mut self, name: &str, samples: Vec<f32>) {
        self.0.push((name.to_owned(), Samples::Float(samples)));
    }

    fn integer(&mut self, name: &str, samples: Vec<u32>) {
        self.0.push((name.to_owned(), Samples::Integer(samples)));
    }
}

/// The variance of the mean of two halves, per pixel and channel, as far as their difference tells.
pub fn variance([even, odd]: &[Image; 2]) -> Vec<Rgb> {
    let half_difference = even.pixels.iter().zip(&odd.pixels).map(|(a, b)| 0.5 * (*a - *b));
    half_difference.map(|d| d * d).collect()
}

/// The images of the even and of the odd samples; black where there is none.
pub fn halves(renderer: &Renderer<'_>) -> [Image; 2] {
    [Half::Even, Half::Odd].map(|half| {
        let passes = renderer.range().filter(|pass| Half::of_pass(*pass) == half).count();
        renderer.film().half_image(half, passes.max(1) as u32)
    })
}
