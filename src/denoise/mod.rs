//! Denoising by Open Image Denoise, a library that is loaded at run time where it is installed.
//!
//! A denoised image is biased: what the filter takes for noise is gone, and nothing bounds its error. It is for the
//! eye, and never for a measurement. [`Denoiser::load`] or [`Denoiser::find`] loads the library, and
//! [`Denoiser::denoise`] filters an image, guided by what the camera sees besides light ([`Guides`]).
//!
//! All that is unsafe is in `oidn.rs`.

mod find;
mod oidn;

use std::{
    fmt,
    path::{Path, PathBuf, absolute},
};

use glam::Vec3;

use self::oidn::{Device, Input, Oidn, Refusal};
use crate::{film::Image, math::Rgb, text::one_line};

/// What the first surface that the camera sees is like: edges that the filter keeps.
#[derive(Clone, Debug)]
pub struct Guides {
    /// The colour of the surface, in [0, 1], of every pixel.
    pub albedo: Vec<Rgb>,
    /// N_s, of any length up to 1, of every pixel, if it is known.
    pub normals: Option<Vec<Vec3>>,
}

/// A version of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Version(pub [i32; 3]);

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [major, minor, patch] = self.0;
        write!(f, "{major}.{minor}.{patch}")
    }
}

/// Why an image is not denoised. Its message is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DenoiseError {
    /// None of the usual places has the library.
    #[error("Open Image Denoise is not installed")]
    NotFound,
    /// The system does not load this file.
    #[error("cannot load '{}': {reason}", path.display())]
    Unloadable {
        /// The file.
        path: PathBuf,
        /// In the system's words.
        reason: String,
    },
    /// A library of something else.
    #[error("'{}' is not Open Image Denoise: it has no function {function}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The first function that it does not have.
        function: &'static str,
    },
    /// A version before 2.0, which has other functions.
    #[error("'{}' is too old: version 2 of Open Image Denoise is needed", path.display())]
    TooOld {
        /// The file.
        path: PathBuf,
    },
    /// A version after 2, which may have other functions.
    #[error("'{}' is version {version} of Open Image Denoise, and version 2 is needed", path.display())]
    TooNew {
        /// The file.
        path: PathBuf,
        /// What it says of itself.
        version: Version,
    },
    /// The library itself says what is wrong.
    #[error("Open Image Denoise failed: {0}")]
    Failed(String),
}

/// The library, loaded and asked for its version.
pub struct Denoiser {
    oidn: Oidn,
    version: Version,
}

impl Denoiser {
    /// Loads the library from a file, or from a folder that has it.
    ///
    /// # Errors
    /// If it cannot be loaded, is something else, too old, or does not support this processor.
    pub fn load(path: &Path) -> Result<Self, DenoiseError> {
        let file =
            if path.is_dir() { find::in_folder(path).unwrap_or_else(|| path.to_owned()) } else { path.to_owned() };
        // Of a name alone the system would search its own folders.
        Self::open(&if file.is_file() { absolute(&file).unwrap_or(file) } else { file })
    }

    /// Loads the library that the system finds, or else the one of the Python package `pyoidn`: in one of the folders
    /// `packages` of Python packages, in the active environment, or where the system has such packages.
    ///
    /// # Errors
    /// [`DenoiseError::NotFound`], or why the one that is there is of no use.
    pub fn find(packages: &[PathBuf]) -> Result<Self, DenoiseError> {
        let mut useless = None;
        for name in find::SYSTEM_NAMES {
            match Self::open(Path::new(name)) {
                // A name that the system does not know is no file that somebody has put there.
                Err(DenoiseError::Unloadable { .. }) => {}
                Err(error) => useless = useless.or(Some(error)),
                found => return found,
            }
        }
        for file in find::wheels(packages) {
            match Self::open(&file) {
                Err(error) => useless = useless.or(Some(error)),
                found => return found,
            }
        }
        Err(useless.unwrap_or(DenoiseError::NotFound))
    }

    fn open(file: &Path) -> Result<Self, DenoiseError> {
        let path = file.to_owned();
        let oidn = Oidn::load(file).map_err(|refusal| match refusal {
            Refusal::Unloadable(reason) => DenoiseError::Unloadable { path, reason: one_line(&reason) },
            Refusal::Foreign(function) => DenoiseError::Foreign { path, function },
            Refusal::TooOld => DenoiseError::TooOld { path },
        })?;
        let version = Version(Device::new(&oidn, None).map_err(|sentence| failed(&sentence))?.version());
        if version.0[0] != 2 {
            return Err(DenoiseError::TooNew { path: file.to_owned(), version });
        }
        Ok(Self { oidn, version })
    }

    /// The version of the library.
    pub fn version(&self) -> Version {
        self.version
    }

    /// The image without its noise, as far as the filter can tell, on so many threads, or on all. Guides are noisy
    /// themselves, through lenses and at edges, and are filtered first.
    ///
    /// # Errors
    /// What the library says, such as that there is too little memory.
    ///
    /// # Panics
    /// If the guides have another size than the image.
    pub fn denoise(
        &self,
        image: &Image,
        guides: Option<&Guides>,
        threads: Option<usize>,
    ) -> Result<Image, DenoiseError> {
        let size = [image.width, image.height].map(|side| side as usize);
        let device = Device::new(&self.oidn, threads).map_err(|sentence| failed(&sentence))?;
        let filter = |inputs: &[Input<'_>]| device.filter(size, inputs).map_err(|sentence| failed(&sentence));
        let color = triples(&image.pixels, Rgb::to_array);
        let albedo = guides.map(|guides| triples(&guides.albedo, Rgb::to_array));
        let normals = guides.and_then(|guides| Some(triples(guides.normals.as_ref()?, |n| n.to_array())));
        let albedo = albedo.map(|albedo| filter(&[Input::Albedo(&albedo)])).transpose()?;
        let normals = normals.map(|normals| filter(&[Input::Normal(&normals)])).transpose()?;

        let inputs = [
            Some(Input::Color(&color)),
            albedo.as_ref().map(|albedo| Input::Albedo(albedo)),
            normals.as_ref().map(|normals| Input::Normal(normals)),
        ];
        let inputs: Vec<_> = inputs.into_iter().flatten().collect();
        let pixels = filter(&inputs)?.into_iter().map(Rgb::from_array).collect();
        Ok(Image { pixels, ..*image })
    }
}

fn failed(sentence: &str) -> DenoiseError {
    DenoiseError::Failed(one_line(&sentence.split_whitespace().collect::<Vec<_>>().join(" ")))
}

fn triples<T: Copy>(all: &[T], numbers: impl Fn(T) -> [f32; 3]) -> Vec<[f32; 3]> {
    all.iter().map(|one| numbers(*one)).collect()
}
