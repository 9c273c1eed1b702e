//! What lies around the scene: `--env`, `--env-color`, or grey light where there would be none at all.

use std::{path::PathBuf, sync::Arc};

use super::{exit::Failure, terminal::Terminal, values};
use crate::{
    io::{self, Loaded},
    math::Rgb,
    scene::light::Light,
};

/// The radiance around a scene that has no light and was given none.
pub(super) const NEUTRAL: Rgb = Rgb::ONE;

#[derive(Debug, clap::Args)]
pub(super) struct EnvironmentArgs {
    /// Environment map around the scene, equirectangular, .hdr or .exr: +y up, +x in the middle, +z to its right [default: none;
    /// radiance 1 from everywhere if the scene has no light at all]
    #[arg(long, value_name = "FILE", conflicts_with = "env_color")]
    env: Option<PathBuf>,

    /// The same radiance from everywhere in place of a map, linear RGB or one number
    #[arg(long, value_name = "R,G,B", allow_negative_numbers = true, value_parser = values::radiance)]
    env_color: Option<Rgb>,

    /// Turn the map about +y, counter-clockwise seen from above: with 90, what was towards +z comes from +x
    #[arg(
        long,
        value_name = "DEGREES",
        requires = "env",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = values::finite
    )]
    env_rotate: f32,

    /// Multiply the environment's radiance
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true, value_parser = values::positive)]
    env_scale: f32,
}

/// The environment of a render.
pub(super) struct Environment {
    /// As the scene takes it.
    pub(super) light: Option<Light>,
    /// As the image's header states it, for it changes pixels.
    pub(super) recorded: Option<String>,
}

/// The environment that the options ask for, or a neutral one for a scene without light.
pub(super) fn choose(args: &EnvironmentArgs, loaded: &Loaded, terminal: Terminal) -> Result<Environment, Failure> {
    if let Some(path) = &args.env {
        let file = io::load_environment(path, args.env_scale, args.env_rotate.to_radians())
            .map_err(|error| Failure::input(error.to_string()))?;
        for warning in &file.warnings {
            terminal.warn(warning);
        }
        let recorded = format!("map {} rotate {} scale {}", file.hash, args.env_rotate, args.env_scale);
        return Ok(Environment { light: Some(Light::EnvironmentMap(Arc::new(file.map))), recorded: Some(recorded) });
    }
    if let Some(color) = args.env_color {
        return Ok(constant(color * args.env_scale));
    }
    if loaded.is_lit() {
        return Ok(Environment { light: None, recorded: None });
    }
    terminal.say(format_args!(
        "note: the scene has no light, so an environment of radiance {} lights it (--env or --env-color choose another)",
        NEUTRAL.x * args.env_scale
    ));
    Ok(constant(NEUTRAL * args.env_scale))
}

fn constant(radiance: Rgb) -> Environment {
    let recorded = format!("constant {},{},{}", radiance.x, radiance.y, radiance.z);
    Environment { light: Some(Light::Environment { radiance }), recorded: Some(recorded) }
}
