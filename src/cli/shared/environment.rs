//! What lies around the scene: `--env`, `--env-color`, or grey light where there would be none at all.

use std::{path::PathBuf, sync::Arc};

use pathspace::{
    io::{self, Limits, Loaded},
    math::Rgb,
    scene::light::{BRIGHTEST, Light, NotARadiance},
};

use crate::cli::shared::{exit::Failure, terminal::Terminal, values};

/// The radiance around a scene that has no light and was given none.
pub const NEUTRAL: Rgb = Rgb::ONE;

#[derive(Clone, Debug, clap::Args)]
pub struct EnvironmentArgs {
    /// Environment map around the scene, equirectangular, .hdr or .exr: +y up, +x in the middle, +z to its right
    /// [default: that of the file, if it has one; radiance 1 from everywhere if the scene has no light at all]
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

    /// Multiply the environment's radiance [default: 1]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = values::positive)]
    env_scale: Option<f32>,
}

/// The environment of a render.
pub struct Environment {
    /// As the scene takes it.
    pub light: Option<Light>,
    /// As the image's header states it, for it changes pixels.
    pub recorded: Option<String>,
}

/// The environment that the options ask for, else that of the file, or a neutral one for a scene without light.
pub fn choose(
    args: &EnvironmentArgs,
    limits: &Limits,
    loaded: &Loaded,
    terminal: Terminal,
) -> Result<Environment, Failure> {
    let scale = args.env_scale.unwrap_or(1.0);
    if loaded.environment.is_some() && (args.env.is_some() || args.env_color.is_some()) {
        terminal.warn("the file's own environment (EXT_lights_image_based) is left out: the options choose another");
    }
    if let Some(path) = &args.env {
        let file = io::load_environment_within(limits, path, scale, args.env_rotate.to_radians())
            .map_err(|error| Failure::input(error.to_string()))?;
        for warning in &file.warnings {
            terminal.warn(warning);
        }
        let recorded = format!("map {} rotate {} scale {}", file.hash, args.env_rotate, scale);
        return Ok(Environment { light: Some(Light::EnvironmentMap(Arc::new(file.map))), recorded: Some(recorded) });
    }
    if let Some(color) = args.env_color {
        return constant(color * scale);
    }
    if let Some(light) = &loaded.environment {
        let map = light.to_map(scale).map_err(|NotARadiance { value, .. }| {
            Failure::usage(format!("the file's environment has a radiance of {value} by this --env-scale: lower it"))
        })?;
        let recorded = format!("of the file scale {scale}");
        return Ok(Environment { light: Some(Light::EnvironmentMap(Arc::new(map))), recorded: Some(recorded) });
    }
    if loaded.is_lit() {
        if args.env_scale.is_some() {
            terminal.warn(
                "--env-scale has no effect: the scene has lights of its own and no environment (--env, --env-color)",
            );
        }
        return Ok(Environment { light: None, recorded: None });
    }
    terminal.say(format_args!(
        "note: the scene has no light, so an environment of radiance {} lights it (--env or --env-color choose \
         another)",
        NEUTRAL.r() * scale
    ));
    constant(NEUTRAL * scale)
}

fn constant(radiance: Rgb) -> Result<Environment, Failure> {
    let brightest = radiance.max_element();
    if brightest > BRIGHTEST {
        return Err(Failure::usage(format!(
            "the environment's radiance is {brightest:e}, and {BRIGHTEST:e} is the limit (a lower --env-scale helps)"
        )));
    }
    let recorded = format!("constant {},{},{}", radiance.r(), radiance.g(), radiance.b());
    Ok(Environment { light: Some(Light::Environment { radiance }), recorded: Some(recorded) })
}
