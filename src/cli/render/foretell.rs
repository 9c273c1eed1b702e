//! Warnings about what an image will not show.

use pathspace::{
    film::Crop,
    integrator::{Gap, IntegratorKind},
    render::{Background, Settings},
    scene::{FirstSight, Scene, camera::Sensor, light::Light},
};

use crate::cli::shared::{header::Job, terminal::Terminal};

/// Says beforehand what would surprise afterwards. `max_depth` is what was asked for.
pub fn foretell(job: &Job<'_>, scene: &Scene, max_depth: u32, terminal: Terminal) {
    let Job { sensor, settings, .. } = job;
    let Sensor { width, height, .. } = sensor;
    let integrator = settings.integrator;
    terminal.detail(format_args!("rendering {width}×{height} pixels with {integrator}"));
    let FirstSight { specular, back_faces } = scene.first_sight();
    foretell_gaps(settings, scene, specular, terminal);
    if back_faces > 0.0 {
        let behind = 100.0 * back_faces;
        terminal.say(format_args!(
            "note: about {behind:.1} % of the image shows back faces of single-sided materials, which glTF's \
             rasterizers cull (--cull-backfaces hides them)"
        ));
    }
    if scene.lights().is_empty() {
        terminal.warn("the scene has no light, so the image will be black");
    }
    if max_depth > settings.max_depth {
        let longest = settings.max_depth;
        terminal.say(format_args!("note: {integrator} stops at paths of {longest} edges, whatever --max-depth says"));
    }
    if settings.integrator.lands_anywhere() && settings.crop != Crop::full(*sensor) {
        let part = 100.0 * settings.crop.pixels() as f64 / f64::from(sensor.pixels());
        terminal.say(format_args!(
            "note: the crop is {part:.1} % of the image, but all of its light paths are traced, since any may land \
             there"
        ));
    }
}

/// Warns of what the scene has and the integrator cannot show. `specular` is the part of the image in which the camera
/// sees mirrors and glass.
fn foretell_gaps(settings: &Settings, scene: &Scene, specular: f32, terminal: Terminal) {
    let integrator = settings.integrator;
    let has = |wanted: &dyn Fn(&Light) -> bool| scene.lights().all().iter().any(wanted);
    let around = |light: &Light| matches!(light, Light::Environment { .. } | Light::EnvironmentMap(_));
    let is_background = settings.background == Background::Shown && has(&around);
    let by_percent = 100.0 * specular;
    let surprises = [
        (
            specular > 0.0,
            Gap::SpecularSeen,
            format!(
                "mirrors and glass that the camera sees, about {by_percent:.1} % of the image, will be black: \
                 {integrator} follows no path from the camera, and a mirror reflects a given connection with \
                 probability zero"
            ),
        ),
        (
            is_background && scene.camera.is_orthographic(),
            Gap::ParallelBackground,
            "the environment behind the scene will not be seen: light from it arrives along an orthographic camera's \
             one direction with probability zero"
                .to_owned(),
        ),
        (
            has(&|light| !light.has_extent()),
            Gap::LightsWithoutExtent,
            format!("point lights, spots and suns will be dark: no path of {integrator} hits what has no extent"),
        ),
        (
            has(&|light| light.has_extent() && !matches!(light, Light::Area { .. })),
            Gap::LightsInSpace,
            format!("lights that are no surfaces will be dark: {integrator} finds emitting surfaces alone"),
        ),
    ];
    for (is_there, gap, what) in surprises {
        if is_there && integrator.lacks(gap) {
            let others = IntegratorKind::ALL.into_iter().filter(|kind| !kind.lacks(gap)).take(3);
            let others: Vec<_> = others.map(IntegratorKind::name).collect();
            terminal.warn(format_args!("{what} (choose -i {})", others.join(", ")));
        }
    }
}
