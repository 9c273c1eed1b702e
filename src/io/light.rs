//! Lights without a surface (`KHR_lights_punctual`), in world space.

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};
use gltf_json::{
    Root,
    extensions::scene::khr_lights_punctual::{self, Type},
    validation::Checked,
};

use super::{error::Fault, node::Placed};
use crate::{
    math::Rgb,
    scene::light::{Light, Spot},
};

/// A light of `KHR_lights_punctual` in world space, in the extension's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualLight {
    /// A point that shines alike in all directions.
    Point {
        /// Where it is, metres.
        position: Vec3,
        /// Luminous intensity per channel, candela.
        intensity: Rgb,
    },
    /// A point that shines into a cone.
    Spot {
        /// Where it is, metres.
        position: Vec3,
        /// The unit axis of the cone, in the direction of the light's travel.
        direction: Vec3,
        /// Luminous intensity on the axis per channel, candela.
        intensity: Rgb,
        /// The half angle up to which the intensity is full, radians; at most `outer`.
        inner: f32,
        /// The half angle from which it is zero, radians; at most π/2.
        outer: f32,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// The unit direction in which the light travels.
        direction: Vec3,
        /// Illuminance on a surface that faces it, per channel, lux.
        irradiance: Rgb,
    },
}

impl PunctualLight {
    /// The scene's light.
    pub fn to_light(&self) -> Light {
        match *self {
            Self::Point { position, intensity } => Light::Point { position, intensity },
            Self::Directional { direction, irradiance } => Light::Directional { towards: -direction, irradiance },
            Self::Spot { position, direction, intensity, inner, outer } => {
                Light::Spot(Spot::new(position, direction, intensity, inner, outer))
            }
        }
    }
}

/// The light at a node; `None` for one without light.
pub(super) fn light(
    root: &Root,
    node: &Placed,
    index: usize,
    warnings: &mut Vec<String>,
) -> Result<Option<PunctualLight>, Fault> {
    let at = format!("/extensions/KHR_lights_punctual/lights/{index}");
    let lights: &[khr_lights_punctual::Light] = root.as_ref();
    let Some(light) = lights.get(index) else { return Err(Fault::invalid(at, "there is no such light")) };
    let intensity = Vec3::from(light.color) * light.intensity;
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(Fault::invalid(at, "the colour times the intensity is not a finite, non-negative light"));
    }
    if intensity == Vec3::ZERO {
        return Ok(None);
    }
    if light.range.is_some() {
        warnings.push(format!("{at}: “range” is ignored, light falls off with the squared distance and never ends"));
    }
    let position = node.origin();
    Ok(Some(match light.type_ {
        Checked::Valid(Type::Point) => PunctualLight::Point { position, intensity },
        Checked::Valid(Type::Directional) => {
            PunctualLight::Directional { direction: node.axis(DVec3::NEG_Z)?, irradiance: intensity }
        }
        Checked::Valid(Type::Spot) => {
            let cone = light.spot.clone().unwrap_or_default();
            let (inner, outer) = (cone.inner_cone_angle, cone.outer_cone_angle);
            if !(inner >= 0.0 && inner <= outer && outer > 0.0 && outer <= FRAC_PI_2 + 1e-6) {
                let what = format!("the cone's angles are {inner} and {outer}, not 0 ≤ inner ≤ outer ≤ π/2");
                return Err(Fault::invalid(format!("{at}/spot"), what));
            }
            let direction = node.axis(DVec3::NEG_Z)?;
            PunctualLight::Spot { position, direction, intensity, inner, outer: outer.min(FRAC_PI_2) }
        }
        Checked::Invalid => return Err(Fault::invalid(format!("{at}/type"), "this type of light does not exist")),
    }))
}
