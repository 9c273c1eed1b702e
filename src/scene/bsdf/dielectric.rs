//! Placeholder.
use super::{BsdfSample, Lobe, Scatter, ScatterEvent, Transport};
use crate::math::Rgb;
use glam::Vec3;

/// Placeholder.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// Placeholder.
    pub color: Rgb,
    /// Placeholder.
    pub ior: f32,
    /// Placeholder.
    pub alpha: f32,
    /// Placeholder.
    pub transmission: f32,
}

impl Dielectric {
    pub fn eval(&self, _lobe: Lobe, _to_camera: Vec3, _to_light: Vec3) -> Scatter {
        Scatter::ZERO
    }
    pub fn sample(&self, _known: Vec3, _transport: Transport, _u: Vec3) -> Option<BsdfSample> {
        None
    }
    pub fn has_continuous(&self) -> bool {
        false
    }
    pub fn delta_count(&self) -> u8 {
        0
    }
    pub fn continuous_event(&self, _to_camera: Vec3, _to_light: Vec3) -> ScatterEvent {
        ScatterEvent::Glossy
    }
    pub fn relative_ior(&self, _to_camera: Vec3, _to_light: Vec3) -> f32 {
        1.0
    }
}
