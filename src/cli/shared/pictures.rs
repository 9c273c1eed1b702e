//! The image files of a command: checked before anything is rendered, written at the end.

use std::{io, path::PathBuf};

use pathspace::{
    film::{Format, Header, Image, Look, Samples, check_writable, encode_exr, encode_png, write_atomically},
    math::{Rgb, luminance},
};

use crate::cli::shared::{exit::Failure, terminal::Terminal};

/// Files to write, each of a known format and in a place where files can be created.
pub struct Outputs(pub Vec<(PathBuf, Format)>);

/// An image and what is beside it in its file.
#[derive(Clone)]
pub struct Picture {
    pub image: Image,
    pub alpha: Option<Vec<f32>>,
    /// By their names.
    pub layers: Vec<(String, Image)>,
    pub data: Vec<(String, Samples)>,
}

impl Outputs {
    /// Refuses names of no known format, and places where nothing can be written.
    pub fn check(paths: Vec<PathBuf>) -> Result<Self, Failure> {
        let with_format = |path: PathBuf| {
            let refuse = |reason| Failure::usage(format!("cannot write '{}': {reason}", path.display()));
            let format = Format::of(&path).map_err(refuse)?;
            Ok((path, format))
        };
        let outputs = paths.into_iter().map(with_format).collect::<Result<Vec<_>, Failure>>()?;
        for (path, _) in &outputs {
            check_writable(path).map_err(|error| Failure::output(error.to_string()))?;
        }
        Ok(Self(outputs))
    }

    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.0.iter().map(|(path, _)| path)
    }

    /// Refuses files of a format that holds no exact sums, which `what` is.
    pub fn refuse_png(&self, what: &str) -> Result<(), Failure> {
        let Some((png, _)) = self.0.iter().find(|(_, format)| *format == Format::Png) else { return Ok(()) };
        let why = format!("{what} is exact sums for 'pathspace merge', which only an .exr file can hold");
        Err(Failure::usage(format!("cannot write '{}': {why}", png.display())))
    }

    /// Whether a file can hold more than one image.
    pub fn holds_layers(&self) -> bool {
        self.0.iter().any(|(_, format)| *format == Format::Exr)
    }

    /// Writes the picture to all of them, and what is beside the image to those that can hold it.
    pub fn write(
        &self,
        picture: &Picture,
        header: &Header,
        look: impl Into<Look>,
        terminal: Terminal,
    ) -> Result<(), Failure> {
        let Picture { image, alpha, layers, data } = picture;
        let (alpha, look) = (alpha.as_deref(), look.into());
        self.write_each(|format| match format {
            Format::Exr => encode_exr(image, alpha, layers, data, header),
            Format::Png => {
                terminal.detail(format_args!("exposure {:+.2} EV", look.exposure.ev(image)));
                encode_png(image, alpha, look)
            }
        })
    }

    /// Writes the same bytes to all of them, if they could be made.
    pub fn write_bytes(&self, bytes: io::Result<Vec<u8>>) -> Result<(), Failure> {
        let bytes = bytes.map_err(|error| Failure::output(format!("cannot encode the file: {error}")))?;
        let write = |path| write_atomically(path, &bytes).map_err(|error| Failure::output(error.to_string()));
        self.paths().try_for_each(|path| write(path))
    }

    /// Writes to each what `encode` makes for its format.
    pub fn write_each(&self, encode: impl Fn(Format) -> io::Result<Vec<u8>>) -> Result<(), Failure> {
        for (path, format) in &self.0 {
            let refuse = |error| Failure::output(format!("cannot write '{}': {error}", path.display()));
            let bytes = encode(*format).map_err(refuse)?;
            write_atomically(path, &bytes).map_err(|error| Failure::output(error.to_string()))?;
        }
        Ok(())
    }

    /// The last line of a command that wrote them.
    pub fn said(&self) -> String {
        format!("wrote {}", self.paths().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" and "))
    }
}

/// White where two images agree, red where the first and blue where the second is brighter: fully so by `mean`.
pub fn difference_in_colour(difference: &Image, mean: f32) -> Image {
    let colour = |difference: &Rgb| {
        let x = if mean > 0.0 { (luminance(*difference) / mean).clamp(-1.0, 1.0) } else { 0.0 };
        if x > 0.0 { Rgb::new(1.0, 1.0 - x, 1.0 - x) } else { Rgb::new(1.0 + x, 1.0 + x, 1.0) }
    };
    Image { pixels: difference.pixels.iter().map(colour).collect(), ..*difference }
}
