//! `--denoise`.

use pathspace::denoise::Denoiser;

use crate::cli::shared::{
    denoised::{NOISY, OidnArgs},
    exit::Failure,
    layers::LayerArgs,
    values::Shard,
};

/// Whether and by what library the image is denoised.
#[derive(Clone, Debug, clap::Args)]
pub struct DenoiseArgs {
    /// Denoise the image with Open Image Denoise, guided by albedo and normals: to look at, as the result is biased. An
    /// .exr file keeps the image as rendered in the layer noisy
    #[arg(long)]
    denoise: bool,

    #[command(flatten)]
    oidn: OidnArgs,
}

/// Bytes that a pixel takes while the image is filtered.
const BYTES_PER_PIXEL: u64 = 200;

impl DenoiseArgs {
    /// Whether the image is to be denoised.
    pub fn is_asked(&self) -> bool {
        self.denoise
    }

    /// Refuses what does not go together, and loads the library if it is needed.
    pub fn load(&self, shard: Option<Shard>, layers: &LayerArgs) -> Result<Option<Denoiser>, Failure> {
        if !self.denoise {
            return match self.oidn.oidn {
                None => Ok(None),
                Some(_) => Err(Failure::usage("--oidn says which library denoises: give --denoise as well")),
            };
        }
        if shard.is_some() {
            return Err(Failure::usage(
                "a shard is exact sums, which nothing may denoise: leave --denoise out, and use 'pathspace denoise' on \
                 the merged image",
            ));
        }
        if layers.has(NOISY) {
            return Err(Failure::usage(format!(
                "--denoise keeps the image as rendered in the layer '{NOISY}'; give yours another name"
            )));
        }
        self.oidn.load().map(Some)
    }

    /// What it takes for so many pixels.
    pub fn memory(&self, pixels: u64) -> u64 {
        if self.denoise { BYTES_PER_PIXEL * pixels } else { 0 }
    }
}
