//! Denoised images: the library, what guides it, and what the file says of the image.

use std::{
    env,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use pathspace::{
    denoise::{DenoiseError, Denoiser, Guides},
    film::{DENOISED, Header, Image, Samples},
    io::{ImageError, Limits, read_attributes},
    math::Rgb,
};

use crate::cli::shared::{exit::Failure, pictures::Picture};

/// The layer that has the image as it was rendered.
pub const NOISY: &str = "noisy";

/// Where the library is, besides the places where anybody would look.
const VARIABLE: &str = "OIDN_LIBRARY";
const HOW: &str = "'pip install pyoidn' installs it, and --oidn PATH or OIDN_LIBRARY says where else its library is";

/// The folder of the packages of the Python that the program is a part of, if it is.
static PACKAGES: OnceLock<PathBuf> = OnceLock::new();

/// Looks for the library there, too.
#[allow(dead_code, reason = "the program is a part of no Python; the package is")]
pub fn look_among(packages: PathBuf) {
    PACKAGES.get_or_init(|| packages);
}

/// Which library denoises.
#[derive(Clone, Debug, clap::Args)]
pub struct OidnArgs {
    /// The shared library of Open Image Denoise (version 2), or the folder that has it [default: the environment
    /// variable OIDN_LIBRARY, else the system's, else the one in Python's package pyoidn]
    #[arg(long, value_name = "PATH")]
    pub oidn: Option<PathBuf>,
}

impl OidnArgs {
    /// Loads the library.
    pub fn load(&self) -> Result<Denoiser, Failure> {
        let named = self.oidn.clone().or_else(|| env::var_os(VARIABLE).filter(|path| !path.is_empty()).map(Into::into));
        let loaded = match named {
            Some(path) => Denoiser::load(&path),
            None => Denoiser::find(PACKAGES.get().map_or(&[], std::slice::from_ref)),
        };
        loaded.map_err(|error| match error {
            DenoiseError::Failed(_) => Failure::usage(format!("{error}")),
            DenoiseError::NotFound => Failure::usage(format!("{error}: {HOW}")),
            _ => Failure::usage(format!("{error}; if Open Image Denoise is not there, {HOW}")),
        })
    }
}

/// What went wrong while an image was denoised.
pub fn failed(error: &DenoiseError) -> Failure {
    Failure::output(format!("cannot denoise the image: {error}"))
}

/// The guides among channels, of which `three` finds those of a layer by its name and their letters: normals count
/// beside albedo alone.
pub fn guides<E>(three: impl Fn(&str, [&str; 3]) -> Result<Option<Vec<[f32; 3]>>, E>) -> Result<Option<Guides>, E> {
    let Some(albedo) = three("albedo", ["R", "G", "B"])? else { return Ok(None) };
    let normals = three("normal", ["X", "Y", "Z"])?;
    Ok(Some(Guides {
        albedo: albedo.into_iter().map(Rgb::from_array).collect(),
        normals: normals.map(|normals| normals.into_iter().map(Into::into).collect()),
    }))
}

/// The guides among the data channels of a picture.
pub fn guides_among(data: &[(String, Samples)]) -> Option<Guides> {
    let floats = |name: String| match data.iter().find(|(found, _)| *found == name)? {
        (_, Samples::Float(samples)) => Some(samples),
        _ => None,
    };
    let three = |layer: &str, letters: [&str; 3]| {
        let [a, b, c] = letters.map(|letter| floats(format!("{layer}.{letter}")));
        let found = a.zip(b).zip(c);
        Ok::<_, std::convert::Infallible>(
            found.map(|((a, b), c)| a.iter().zip(b).zip(c).map(|((a, b), c)| [*a, *b, *c]).collect()),
        )
    };
    let Ok(guides) = guides(three);
    guides
}

/// By what an image is denoised, in words.
pub fn fed(guides: Option<&Guides>) -> &'static str {
    match guides {
        None => "its colours alone",
        Some(Guides { normals: None, .. }) => "colours and albedo",
        Some(_) => "colours, albedo and normals",
    }
}

/// What the header of a denoised image says.
pub fn attribute(denoiser: &Denoiser, guides: Option<&Guides>) -> (String, String) {
    let (version, fed) = (denoiser.version(), fed(guides));
    let value = format!(
        "by Open Image Denoise {version}, from {fed}; biased: the image as rendered is {NOISY}.R, {NOISY}.G, {NOISY}.B"
    );
    (DENOISED.to_owned(), value)
}

/// Denoises the image of a picture, on so many threads, and keeps the one that was rendered as a layer. Whatever else
/// is beside it stays as rendered.
pub fn denoise(
    picture: &mut Picture,
    header: &mut Header,
    denoiser: &Denoiser,
    guides: Option<&Guides>,
    threads: Option<usize>,
) -> Result<(), Failure> {
    let image: Image = denoiser.denoise(&picture.image, guides, threads).map_err(|error| failed(&error))?;
    let noisy = std::mem::replace(&mut picture.image, image);
    picture.layers.push((NOISY.to_owned(), noisy));
    header.attributes.push(attribute(denoiser, guides));
    Ok(())
}

/// Whether the image of a file is denoised.
pub fn is_denoised(path: &Path) -> Result<bool, ImageError> {
    Ok(read_attributes(&Limits::default(), path)?.contains_key(DENOISED))
}
