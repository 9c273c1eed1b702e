//! The scenes of `scenes/` with textures, instances and lights of every kind: integrators agree on whatever they cover.

use std::path::Path;

use glam::Vec3;
use pathspace::{
    integrator::IntegratorKind,
    io,
    path::{Densities, JoinedPath},
    sampling::Filter,
    scene::{Scene, bsdf::ScatterEvent, camera::Camera, light::Light},
};

use crate::{
    agreement::{DEPTH, where_all_cover, where_all_cover_and, where_all_cover_within},
    identity, scenes,
};

use IntegratorKind::{Bdpt, Hybrid, Light as LightTracing, Path as PathTracing};

fn gallery(name: &str) -> Scene {
    load(name, None)
}

/// A scene through `camera`, or else its own.
fn load(name: &str, camera: Option<Camera>) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("glb");
    let loaded = io::load(&path).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.warnings, [""; 0], "{name}");
    let sky = (name == "outdoor").then(|| {
        let sky = io::load_environment(&path.with_file_name("outdoor-sky.hdr"), 1.0, 0.0);
        Light::EnvironmentMap(sky.unwrap_or_else(|e| panic!("{e}")).map.into())
    });
    let camera = camera.unwrap_or_else(|| loaded.cameras[0].to_camera(scenes::square(24, Filter::Box)));
    loaded.into_scene(camera, sky)
}

/// Lamps that the camera sees are bright next to the image: what they light is compared, from two edges on.
#[test]
fn four_hundred_lights() {
    where_all_cover("many-lights", &gallery("many-lights"), &[PathTracing, LightTracing, Hybrid, Bdpt], 2..=DEPTH);
}

#[test]
fn a_textured_room() {
    where_all_cover("textured-room", &gallery("textured-room"), &[PathTracing, LightTracing, Hybrid, Bdpt], 2..=DEPTH);
}

#[test]
fn under_sun_and_sky() {
    where_all_cover("outdoor", &gallery("outdoor"), &[PathTracing, LightTracing, Hybrid, Bdpt], 1..=DEPTH);
}

/// No camera path meets a lamp without extent: what `path` misses is compared without it, and what it finds behind a
/// glossy reflection it finds so rarely that only direct light is compared.
#[test]
fn glass_and_metal_under_points_and_spots() {
    let scene = gallery("glass-and-metal");
    where_all_cover("glass-and-metal", &scene, &[LightTracing, Hybrid, Bdpt], 1..=DEPTH);
    where_all_cover("glass-and-metal by path", &scene, &[PathTracing, Bdpt], 1..=2);
}

#[test]
fn a_lamp_and_its_mirror_image() {
    where_all_cover(
        "mirrored-lamps",
        &gallery("mirrored-lamps"),
        &[PathTracing, LightTracing, Hybrid, Bdpt],
        2..=DEPTH,
    );
}

/// Veach's plates are made to be noisy in every single strategy. Lamps as the plates show them are tiny and bright, and
/// light tracing hardly ever meets the camera in them: it is compared on the wall behind.
#[test]
fn veachs_plates() {
    let plates = gallery("mis-plates");
    where_all_cover_within(0.02, "mis-plates", &plates, &[PathTracing, Hybrid, Bdpt], 3..=DEPTH);
    let sensor = plates.camera.sensor();
    let wall = Camera::look_at(Vec3::new(0.0, 2.0, 15.0), Vec3::new(0.0, 5.0, -10.0), Vec3::Y, 0.2, sensor);
    let wall = load("mis-plates", Some(wall));
    where_all_cover_within(0.02, "the wall behind", &wall, &[PathTracing, LightTracing, Hybrid, Bdpt], 2..=DEPTH);
}

/// The lecture's own estimators, and the one that draws every vertex by itself, in every scene that they cover. They
/// are noisier, and a bias of 4 % is what each comparison sees, or 2 % of `area`, whose rare large values would not be
/// met otherwise; 5 % where they meet the plates' lamps by chance alone, in direct light. The smaller lamps there, of
/// one power on down to a two-hundredth of the area, and all mirror images in the metal are too rare for `area`: it is
/// compared on what the largest lamp lights on the gray walls.
#[test]
fn by_the_lectures_estimators() {
    use IntegratorKind::{Area, PathHemisphere, PathLight};
    for (name, kinds, lengths) in [
        ("mis-plates", &[PathLight][..], 3..=DEPTH),
        ("many-lights", &[PathHemisphere, PathLight, Area], 2..=3),
        ("textured-room", &[PathHemisphere, PathLight, Area], 2..=DEPTH),
        ("mirrored-lamps", &[PathHemisphere, PathLight, Area], 2..=DEPTH),
        ("outdoor", &[PathHemisphere, PathLight], 2..=DEPTH),
        ("glass-and-metal", &[PathLight, PathTracing], 2..=DEPTH),
    ] {
        let scene = gallery(name);
        for kind in kinds {
            let visible = if *kind == Area { 0.02 } else { 0.04 };
            where_all_cover_within(visible, &format!("{name} by {kind}"), &scene, &[Bdpt, *kind], lengths.clone());
        }
    }
    let plates = gallery("mis-plates");
    where_all_cover_within(0.05, "mis-plates by chance", &plates, &[Bdpt, PathHemisphere], 2..=2);
    let largest_on_gray = |path: &JoinedPath| {
        path.edges() == 2 && path.event(1) == ScatterEvent::Diffuse && path.vertex(2).point.position.x > 2.5
    };
    where_all_cover_and(0.05, "the largest lamp on gray", &plates, &[Bdpt, PathHemisphere, Area], &largest_on_gray);
}

#[test]
fn identity_in_each() {
    for name in ["mis-plates", "many-lights", "textured-room", "mirrored-lamps"] {
        identity::assert_identity(name, &gallery(name), 8);
    }
    // Under an open sky few light paths come into view, and `area` cannot see the sky at all; `path-hemisphere` and
    // `area` find nothing where no lamp has an extent.
    identity::assert_identity_by(&scenes::WEIGHTED, "outdoor", &gallery("outdoor"), 20);
    identity::assert_identity_by(&scenes::WEIGHTED, "glass-and-metal", &gallery("glass-and-metal"), 4);
}
