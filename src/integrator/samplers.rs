//! What the stages of a sample are given: random numbers, a wavelength, and the light vertices of the pass.

use super::LightVertexMap;
use crate::scene::wavelength::Wavelength;

/// The light vertices that a pass has kept for merges.
pub struct Kept<'a, S> {
    /// Where they are.
    pub map: &'a LightVertexMap,
    /// The random numbers of the light subpaths of a pixel, by its number among those of the image.
    pub numbers: &'a dyn Fn(u32) -> S,
    /// The wavelength of all subpaths of the pass.
    pub wavelength: Option<Wavelength>,
}

/// The sequences of random numbers of one sample, so that none shifts another, and its wavelength.
#[derive(Debug)]
pub struct Samplers<'a, S> {
    /// For the camera subpath.
    pub camera: &'a mut S,
    /// For the light subpath.
    pub light: &'a mut S,
    /// For the connections.
    pub connection: &'a mut S,
    /// For the lens points that light subpaths are connected to.
    pub lens: &'a mut S,
    /// That of all its subpaths, where the scene disperses.
    pub wavelength: Option<Wavelength>,
}

impl<'a, S> Samplers<'a, S> {
    /// Those of all [streams](crate::sampling::Stream), in their order, and this wavelength.
    #[inline(always)]
    pub fn of([camera, light, connection, lens]: &'a mut [S; 4], wavelength: Option<Wavelength>) -> Self {
        Self { camera, light, connection, lens, wavelength }
    }
}
