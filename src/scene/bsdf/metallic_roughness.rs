//! Placeholder.
use super::{BsdfSample, Lobe, Scatter, ScatterEvent, Transport};
use crate::math::Rgb;
use glam::Vec3;

/// Placeholder.
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness {
    /// Placeholder.
    pub base_color: Rgb,
    /// Placeholder.
    pub metallic: f32,
    /// Placeholder.
    pub alpha: f32,
    /// Placeholder.
    pub dielectric_f0: Rgb,
    /// Placeholder.
    pub dielectric_f90: f32,
}

impl MetallicRoughness {
    pub fn metal(base_color: Rgb, alpha: f32) -> Self {
        Self { base_color, metallic: 1.0, alpha, dielectric_f0: Rgb::splat(0.04), dielectric_f90: 1.0 }
    }
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
}
