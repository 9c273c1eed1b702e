//! An image with all that is beside it, in memory.

use std::{ffi::OsString, path::PathBuf};

use pathspace::{
    film::{Crop, DENOISED, Format, Header, Image, Look, Samples, encode_exr, encode_png},
    math::Rgb,
    render::{Rays, Statistics},
};
use pyo3::{prelude::*, types::PyBytes};

use crate::{
    cli::{
        Command,
        shared::{
            denoised::{self, NOISY, OidnArgs, denoise, guides_among},
            exit::Failure,
            pictures::{self, Outputs},
        },
    },
    errors::exception,
    options::parsed,
    talk::speaking,
};

/// What a render made. Arrays are bytes of 32-bit numbers in the machine's order, row by row from the top.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Picture {
    pub picture: pictures::Picture,
    pub header: Header,
    pub halves: Option<Halves>,
    pub seconds: f64,
    pub statistics: Statistics,
}

/// The images of the even and the odd samples.
#[derive(Clone)]
pub struct Halves {
    pub images: [Image; 2],
    /// Of their mean.
    pub variance: Vec<Rgb>,
}

/// Looks for Open Image Denoise among these packages of Python, too.
#[pyfunction]
pub fn look_among(packages: PathBuf) {
    denoised::look_among(packages);
}

/// So many numbers as bytes, written to where Python has them.
///
/// # Panics
/// Without memory for them, as [`PyBytes::new`].
fn bytes<'py, const N: usize>(
    py: Python<'py>,
    count: usize,
    numbers: impl Iterator<Item = [u8; N]>,
) -> Bound<'py, PyBytes> {
    let write = |bytes: &mut [u8]| {
        for (place, number) in bytes.as_chunks_mut::<N>().0.iter_mut().zip(numbers) {
            *place = number;
        }
        Ok(())
    };
    PyBytes::new_with(py, N * count, write).expect("memory for an array")
}

/// Three numbers a pixel.
pub fn colours<'py>(py: Python<'py>, pixels: &[Rgb]) -> Bound<'py, PyBytes> {
    bytes(py, 3 * pixels.len(), pixels.iter().flat_map(|pixel| pixel.to_array()).map(f32::to_ne_bytes))
}

/// How a .png file looks by the options of `render` in `words`.
fn look(words: Vec<OsString>) -> Result<Look, Failure> {
    let all: Vec<_> = ["render", "scene.glb"].into_iter().map(OsString::from).chain(words).collect();
    let Command::Render(args) = parsed(&all)? else { unreachable!("the first word is 'render'") };
    Ok(args.look.look())
}

#[pymethods]
impl Picture {
    /// (height, width) of the pixels that are there.
    #[getter]
    fn shape(&self) -> (u32, u32) {
        (self.picture.image.height, self.picture.image.width)
    }

    /// x0, y0, x1, y1 of them in the whole image.
    #[getter]
    fn crop(&self) -> (u32, u32, u32, u32) {
        let Crop { x0, y0, x1, y1 } = self.header.crop;
        (x0, y0, x1, y1)
    }

    fn rgb<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        colours(py, &self.picture.image.pixels)
    }

    fn alpha<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        let alpha = self.picture.alpha.as_ref()?;
        Some(bytes(py, alpha.len(), alpha.iter().map(|a| a.to_ne_bytes())))
    }

    fn halves<'py>(&self, py: Python<'py>) -> Option<[Bound<'py, PyBytes>; 2]> {
        let halves = self.halves.as_ref()?;
        Some([0, 1].map(|half: usize| colours(py, &halves.images[half].pixels)))
    }

    fn variance<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        Some(colours(py, &self.halves.as_ref()?.variance))
    }

    fn layers<'py>(&self, py: Python<'py>) -> Vec<(&str, Bound<'py, PyBytes>)> {
        self.picture.layers.iter().map(|(name, image)| (name.as_str(), colours(py, &image.pixels))).collect()
    }

    /// (name, NumPy's name of the type, bytes) of each channel.
    fn data<'py>(&self, py: Python<'py>) -> Vec<(&str, &'static str, Bound<'py, PyBytes>)> {
        let each = self.picture.data.iter().map(|(name, samples)| match samples {
            Samples::Float(all) => (name.as_str(), "f4", bytes(py, all.len(), all.iter().map(|x| x.to_ne_bytes()))),
            Samples::Integer(all) => (name.as_str(), "u4", bytes(py, all.len(), all.iter().map(|x| x.to_ne_bytes()))),
        });
        each.collect()
    }

    #[getter]
    fn header(&self) -> Vec<(String, String)> {
        self.header.attributes.clone()
    }

    #[getter]
    fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Samples, and rays by kind: camera, light, visibility.
    #[getter]
    fn statistics(&self) -> (u64, u64, u64, u64) {
        let Rays { camera, light, visibility } = self.statistics.rays;
        (self.statistics.samples, camera, light, visibility)
    }

    /// The same with a denoised image, guided by the data channels that are there.
    #[pyo3(signature = (oidn=None))]
    fn denoise(&self, py: Python<'_>, oidn: Option<PathBuf>) -> PyResult<Self> {
        speaking(py, |terminal| {
            let Self { picture, header, halves, seconds, statistics } = self;
            let (mut picture, mut header) = (picture.clone(), header.clone());
            if header.attributes.iter().any(|(name, _)| name == DENOISED) {
                return Err(Failure::usage(format!(
                    "the image is denoised already: as rendered it is layers['{NOISY}']"
                )));
            }
            if picture.layers.iter().any(|(name, _)| name == NOISY) {
                return Err(Failure::usage(format!(
                    "the image has a layer '{NOISY}', which is where it would be kept"
                )));
            }
            let denoiser = OidnArgs { oidn }.load()?;
            let guides = guides_among(&picture.data);
            if guides.is_none() {
                let alone = "the image has no albedo, and is denoised by its colours alone";
                terminal.warn(format_args!("{alone} (render with data=['albedo', 'normals'])"));
            }
            denoise(&mut picture, &mut header, &denoiser, guides.as_ref(), None)?;
            Ok(Self { picture, header, halves: halves.clone(), seconds: *seconds, statistics: statistics.clone() })
        })
    }

    /// The file that [`Picture::write`] would write, by the end of its name: `exr` or `png`.
    fn encode<'py>(&self, py: Python<'py>, format: &str, words: Vec<OsString>) -> PyResult<Bound<'py, PyBytes>> {
        let encoded = py.detach(|| {
            let look = look(words)?;
            let format = Format::of(&PathBuf::from(format!("image.{format}")))
                .map_err(|error| Failure::usage(error.to_string()))?;
            let pictures::Picture { image, alpha, layers, data } = &self.picture;
            let bytes = match format {
                Format::Exr => encode_exr(image, alpha.as_deref(), layers, data, &self.header),
                Format::Png => encode_png(image, alpha.as_deref(), look),
            };
            bytes.map_err(|error| Failure::output(format!("cannot encode the file: {error}")))
        });
        Ok(PyBytes::new(py, &encoded.map_err(|failure: Failure| exception(py, &failure))?))
    }

    /// Writes the file that the command line writes.
    fn write(&self, py: Python<'_>, path: PathBuf, words: Vec<OsString>) -> PyResult<()> {
        speaking(py, |terminal| {
            let outputs = Outputs::check(vec![path])?;
            outputs.write(&self.picture, &self.header, look(words)?, terminal)
        })
    }
}
