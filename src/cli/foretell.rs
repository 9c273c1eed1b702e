//! Warnings about what an image will not show.

use super::{header::Job, terminal::Terminal};
use crate::{
    film::Crop,
    integrator::IntegratorKind,
    render::Background,
    scene::{FirstSight, Scene, camera::Sensor, light::Light},
};

/// Says beforehand what would surprise afterwards. `max_depth` is what was asked for.
pub(super) fn foretell(job: &Job<'_>, scene: &Scene, max_depth: u32, terminal: Terminal) {
    let Job { sensor, settings, .. } = job;
    let Sensor { width, height, .. } = sensor;
    let integrator = settings.integrator;
    terminal.detail(format_args!("rendering {width}×{height} pixels with {integrator}"));
    let FirstSight { specular, back_faces } = scene.first_sight();
    if settings.integrator == IntegratorKind::Light && specular > 0.0 {
        let specular = 100.0 * specular;
        terminal.warn(format_args!(
            "mirrors and glass that the camera sees, about {specular:.1} % of the image, will be black: light tracing \
             connects every vertex to the camera, and a mirror reflects a given connection with probability zero (-i \
             bdpt or hybrid see them)"
        ));
    }
    let around = |light: &Light| matches!(light, Light::Environment { .. } | Light::EnvironmentMap(_));
    let background = settings.background == Background::Shown && scene.lights().all().iter().any(around);
    if back_faces > 0.0 {
        let behind = 100.0 * back_faces;
        terminal.say(format_args!(
            "note: about {behind:.1} % of the image shows back faces of single-sided materials, which glTF's rasterizers cull \
             (--cull-backfaces hides them)"
        ));
    }
    if integrator == IntegratorKind::Light && scene.camera.is_orthographic() && background {
        terminal.warn(
            "the environment behind the scene will not be seen: light from it arrives along an orthographic camera's one \
             direction with probability zero (-i path, bdpt or hybrid see it)",
        );
    }
    if scene.lights().is_empty() {
        terminal.warn("the scene has no light, so the image will be black");
    }
    if integrator == IntegratorKind::Area {
        if max_depth > settings.max_depth {
            let longest = settings.max_depth;
            terminal
                .say(format_args!("note: area sampling stops at paths of {longest} edges, whatever --max-depth says"));
        }
        if specular > 0.0 {
            terminal.warn(
                "mirrors and glass will be black: area sampling never finds their one direction (-i path or bdpt do)",
            );
        }
        if !scene.lights().all().iter().all(|light| matches!(light, Light::Area { .. })) {
            terminal.warn(
                "lights that are no surfaces will be dark: area sampling finds emitting surfaces alone (-i bdpt)",
            );
        }
    }
    if settings.integrator == IntegratorKind::PathHemisphere && !scene.lights().all().iter().all(Light::has_extent) {
        terminal.warn(
            "point lights, spots and suns will be dark: path-hemisphere waits until a walk hits a light, and these \
             have no extent (-i path or bdpt sample them)",
        );
    }
    if settings.integrator.traces_from_lights() && settings.crop != Crop::full(*sensor) {
        let part = 100.0 * settings.crop.pixels() as f64 / f64::from(sensor.pixels());
        terminal.say(format_args!(
            "note: the crop is {part:.1} % of the image, but all of its light paths are traced, since any may land there"
        ));
    }
}
