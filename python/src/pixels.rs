//! Images to be compared.

use std::path::PathBuf;

use pathspace::{
    compare::{Measured, Metric, brightness_difference, p_of_no_bias},
    film::Image,
    io::{Limits, read_halves, read_image},
    math::Rgb,
};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyBytes};

use crate::{
    cli::shared::{denoised::is_denoised, exit::Failure},
    errors::exception,
    picture::colours,
};

/// An image, and its halves where it has some.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Pixels {
    image: Image,
    halves: Option<[Image; 2]>,
    is_denoised: bool,
}

/// An image of 32-bit floats in the machine's order, three a pixel.
fn image(width: u32, height: u32, bytes: &[u8]) -> PyResult<Image> {
    let (pixels, rest) = bytes.as_chunks::<12>();
    if !rest.is_empty() || pixels.len() as u64 != u64::from(width) * u64::from(height) || pixels.is_empty() {
        return Err(PyValueError::new_err("an image has width × height pixels of three 32-bit floats, and some"));
    }
    let number = |pixel: &[u8; 12], i: usize| f32::from_ne_bytes([0, 1, 2, 3].map(|k| pixel[4 * i + k]));
    let pixels = pixels.iter().map(|pixel| Rgb::from_array([0, 1, 2].map(|i| number(pixel, i)))).collect();
    Ok(Image { width, height, pixels })
}

#[pymethods]
impl Pixels {
    #[new]
    #[pyo3(signature = (width, height, rgb, halves=None, is_denoised=false))]
    fn new(
        width: u32,
        height: u32,
        rgb: &[u8],
        halves: Option<(Vec<u8>, Vec<u8>)>,
        is_denoised: bool,
    ) -> PyResult<Self> {
        let halves = match halves {
            Some((even, odd)) => Some([image(width, height, &even)?, image(width, height, &odd)?]),
            None => None,
        };
        Ok(Self { image: image(width, height, rgb)?, halves, is_denoised })
    }

    /// The image of an .exr file, with its halves from `data=halves`.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = py.detach(|| {
            let image = read_image(&Limits::default(), &path)?;
            let size = (image.width, image.height);
            let halves = read_halves(&Limits::default(), &path)?;
            let halves = halves.filter(|halves| halves.iter().all(|half| (half.width, half.height) == size));
            Ok(Self { image, halves, is_denoised: is_denoised(&path)? })
        });
        read.map_err(|error: pathspace::io::ImageError| exception(py, &Failure::input(error.to_string())))
    }

    /// (height, width).
    #[getter]
    fn shape(&self) -> (u32, u32) {
        (self.image.height, self.image.width)
    }

    fn rgb<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        colours(py, &self.image.pixels)
    }

    fn halves<'py>(&self, py: Python<'py>) -> Option<[Bound<'py, PyBytes>; 2]> {
        let halves = self.halves.as_ref()?;
        Some([0, 1].map(|half: usize| colours(py, &halves[half].pixels)))
    }

    /// The errors against a reference of the same size by name, and by which part this is brighter.
    fn errors(&self, py: Python<'_>, reference: &Self) -> PyResult<(Vec<(&'static str, f64)>, f64)> {
        self.check_size(reference)?;
        Ok(py.detach(|| {
            let error = |metric: Metric| (metric.name(), metric.between(&self.image, &reference.image));
            (Metric::ALL.map(error).to_vec(), brightness_difference(&self.image, &reference.image))
        }))
    }

    /// The probability of what differs if both have the same expectation.
    fn p_of_no_bias(&self, other: &Self) -> PyResult<Option<f64>> {
        self.check_size(other)?;
        // A denoised image has a bias, and no halves that tell its noise.
        if self.is_denoised || other.is_denoised {
            return Ok(None);
        }
        Ok(p_of_no_bias(self.measured(), other.measured()))
    }
}

impl Pixels {
    fn measured(&self) -> Measured<'_> {
        Measured { image: &self.image, halves: self.halves.as_ref() }
    }

    fn check_size(&self, other: &Self) -> PyResult<()> {
        if self.shape() == other.shape() { Ok(()) } else { Err(PyValueError::new_err("images of one size")) }
    }
}
