//! Lights without a surface (`KHR_lights_punctual`, `EXT_lights_ies`), in world space.

use std::{
    f32::consts::{FRAC_1_PI, FRAC_PI_2, PI},
    sync::Arc,
};

use glam::{DVec3, Mat3, Vec3};
use gltf_json::{
    Root,
    extensions::scene::khr_lights_punctual::{self, Type},
    validation::Checked,
};

use super::{Loaded, error::Fault, placed::Placed};
use crate::{
    math::{Rgb, luminance},
    scene::{
        light::{BRIGHTEST, Goniometric, Light, Profile, Spot},
        material::MaterialId,
    },
};

/// A light of `KHR_lights_punctual` or `EXT_lights_ies` in world space, in the extension's units.
#[derive(Clone, Debug, PartialEq)]
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
    /// A point that shines as a table says (`EXT_lights_ies`).
    Profile {
        /// Where it is, metres.
        position: Vec3,
        /// The unit axes of the profile's frame, whose −z is the lamp's axis; mirrored if the node is.
        to_world: Mat3,
        /// What the profile's intensities are multiplied by.
        color: Rgb,
        /// Luminous intensity by direction, candela.
        profile: Arc<Profile>,
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
            Self::Profile { position, to_world, color, ref profile } => {
                Light::Goniometric(Arc::new(Goniometric::new(position, to_world, color, profile.clone())))
            }
        }
    }
}

/// Emission up to this radiance may have been meant as “bright” and not in nits: without
/// `KHR_materials_emissive_strength` it is at most 1.
const FEW_NITS: f32 = 10.0;
/// Emission that many times below what lamps make white surfaces reflect cannot be told from black.
const LOST: f32 = 100.0;

/// For surfaces that emit a few nits beside lamps that light the scene with thousands of lux: the brightest of their
/// materials, and what to say of it. Only materials that some surface has and that are `lit` count: an unlit one is as
/// bright as its colour, whatever lamps there are.
///
/// Measured by what the lamps make a white surface reflect: E/π, with the sun's E, and with I/R² for lamps at the
/// radius R of the scene (which is Φ/4πR², its power over the sphere around the scene).
pub(super) fn outshone(loaded: &Loaded, lit: impl Fn(MaterialId) -> bool) -> Option<(MaterialId, String)> {
    let bounds = loaded.geometry.bounds()?;
    let distance2 = (0.25 * (bounds.max - bounds.min).length_squared()).max(f32::MIN_POSITIVE);
    let irradiance = |light: &PunctualLight| match light {
        PunctualLight::Point { intensity, .. } | PunctualLight::Spot { intensity, .. } => {
            luminance(*intensity) / distance2
        }
        PunctualLight::Profile { color, profile, .. } => {
            luminance(*color) * profile.integral() / (4.0 * PI * distance2)
        }
        PunctualLight::Directional { irradiance, .. } => luminance(*irradiance),
    };
    let reflected = loaded.lights.iter().map(irradiance).sum::<f32>() * FRAC_1_PI;
    let emission = |id: MaterialId| luminance(loaded.materials[id.0 as usize].brightest());
    let emits = |id: MaterialId| loaded.materials[id.0 as usize].emits() && lit(id);
    let emitters = loaded.geometry.with_material(&emits).map(|primitive| loaded.geometry.material(primitive));
    let id = emitters.max_by(|a, b| emission(*a).total_cmp(&emission(*b)))?;
    let brightest = emission(id);
    (brightest <= FEW_NITS && reflected > LOST * brightest).then(|| {
        let what = format!(
            "the brightest emission is {brightest:.3} nit, and the lamps make white surfaces reflect about \
             {reflected:.0} nit: \
             it will look black; raise KHR_materials_emissive_strength, or lower the lights' intensity"
        );
        (id, what)
    })
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
    let intensity = Rgb::from_array(light.color) * light.intensity;
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(Fault::invalid(at, "the colour times the intensity is not a finite, non-negative light"));
    }
    if intensity.max_element() > BRIGHTEST {
        let what =
            format!("the colour times the intensity is {:e}, and {BRIGHTEST:e} is the limit", intensity.max_element());
        return Err(Fault::invalid(at, what));
    }
    if intensity == Rgb::ZERO {
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
            PunctualLight::Spot {
                position,
                direction,
                intensity,
                inner: inner.min(FRAC_PI_2),
                outer: outer.min(FRAC_PI_2),
            }
        }
        Checked::Invalid => return Err(Fault::invalid(format!("{at}/type"), "this type of light does not exist")),
    }))
}
