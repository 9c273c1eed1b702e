//! Which camera renders.

use glam::Vec3;

use super::{args::RenderArgs, exit::Failure, terminal::Terminal, values::LookAt};
use crate::{
    io::{Loaded, NamedCamera},
    scene::{
        camera::{Camera, Sensor},
        geometry::Bounds,
    },
};

/// Width over height where nothing says otherwise.
const DEFAULT_ASPECT: f32 = 4.0 / 3.0;
const DEFAULT_WIDTH: u32 = 512;
const DEFAULT_YFOV: f32 = 45.0_f32.to_radians();
const LARGEST_SIDE: f32 = 32_768.0;

/// The camera that the options ask for, or the file's first, or one that frames the whole scene.
pub(super) fn choose(args: &RenderArgs, loaded: &Loaded, terminal: Terminal) -> Result<NamedCamera, Failure> {
    if let Some(look_at) = args.look_at {
        return Ok(looking_at(look_at, loaded.cameras.first()));
    }
    if let Some(wanted) = &args.camera {
        let camera = find(&loaded.cameras, wanted).cloned();
        return camera.ok_or_else(|| Failure::usage(no_such_camera(&loaded.cameras, wanted)));
    }
    if let Some(first) = loaded.cameras.first() {
        if loaded.cameras.len() > 1 {
            terminal.detail(format_args!("camera: the first of {}", list(&loaded.cameras)));
        }
        return Ok(first.clone());
    }
    terminal.say("note: the scene has no camera, so one that frames all of it is used (--look-at chooses another)");
    Ok(framing(loaded.geometry.bounds()))
}

/// The image's size: what the options say, and the rest by the aspect.
pub(super) fn sensor(args: &RenderArgs, camera: &NamedCamera) -> Sensor {
    let aspect = camera.aspect.filter(|a| a.is_finite() && *a > 0.0).unwrap_or(DEFAULT_ASPECT);
    let side = |length: f32| length.round().clamp(1.0, LARGEST_SIDE) as u32;
    let (width, height) = match (args.width, args.height) {
        (Some(width), Some(height)) => (width, height),
        (None, Some(height)) => (side(height as f32 * aspect), height),
        (width, None) => {
            let width = width.unwrap_or(DEFAULT_WIDTH);
            (width, side(width as f32 / aspect))
        }
    };
    Sensor { width, height, padding: args.filter.padding() }
}

/// The camera itself: the vertical field of view is kept, the horizontal one follows from the sensor.
pub(super) fn build(camera: &NamedCamera, sensor: Sensor) -> Camera {
    // Far from the origin, a target at unit distance would round to the position itself.
    let distance = 1.0_f32.max(camera.position.abs().max_element());
    let target = camera.position + camera.forward * distance;
    Camera::look_at(camera.position, target, camera.up, camera.yfov, sensor)
}

fn find<'a>(cameras: &'a [NamedCamera], wanted: &str) -> Option<&'a NamedCamera> {
    // A name goes first: it was given by a person.
    let named = cameras.iter().find(|camera| camera.name == wanted);
    named.or_else(|| cameras.get(wanted.parse::<usize>().ok()?))
}

fn no_such_camera(cameras: &[NamedCamera], wanted: &str) -> String {
    if cameras.is_empty() {
        return format!("there is no camera '{wanted}': the scene has none (--look-at places one)");
    }
    format!("there is no camera '{wanted}': the scene has {}", list(cameras))
}

/// `0 'front', 1 'top'`.
fn list(cameras: &[NamedCamera]) -> String {
    let one = |(index, camera): (usize, &NamedCamera)| format!("{index} '{}'", camera.name);
    cameras.iter().enumerate().map(one).collect::<Vec<_>>().join(", ")
}

fn looking_at(look_at: LookAt, instead_of: Option<&NamedCamera>) -> NamedCamera {
    NamedCamera {
        name: "look-at".to_owned(),
        position: look_at.eye,
        forward: (look_at.target - look_at.eye).normalize(),
        up: Vec3::Y,
        yfov: look_at.yfov.or(instead_of.map(|camera| camera.yfov)).unwrap_or(DEFAULT_YFOV),
        aspect: instead_of.and_then(|camera| camera.aspect),
    }
}

/// A camera in front of the scene (+z, as glTF defines the front) that sees the sphere around its bounds.
fn framing(bounds: Option<Bounds>) -> NamedCamera {
    let (center, radius) = match bounds {
        Some(bounds) => (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min).length()),
        None => (Vec3::ZERO, 1.0),
    };
    // A scene of a single point still has a place in front of it.
    let radius = radius.max(1e-3 * center.length()).max(1e-3);
    NamedCamera {
        name: "framing".to_owned(),
        position: center + Vec3::Z * (radius / (0.5 * DEFAULT_YFOV).sin()),
        forward: Vec3::NEG_Z,
        up: Vec3::Y,
        yfov: DEFAULT_YFOV,
        aspect: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> NamedCamera {
        NamedCamera { name: name.to_owned(), ..framing(None) }
    }

    #[test]
    fn cameras_are_found_by_name_then_by_index() {
        let cameras = [named("front"), named("top"), named("0")];
        let index = |wanted| find(&cameras, wanted).map(|found| cameras.iter().position(|c| std::ptr::eq(c, found)));
        assert_eq!(index("front"), Some(Some(0)));
        assert_eq!(index("1"), Some(Some(1)));
        assert_eq!(index("0"), Some(Some(2)));
        assert_eq!(index("3"), None);
        assert_eq!(no_such_camera(&cameras, "x"), "there is no camera 'x': the scene has 0 'front', 1 'top', 2 '0'");
    }

    #[test]
    fn the_framing_camera_sees_every_corner() {
        for offset in [0.0, 1e3] {
            let bounds = Bounds { min: Vec3::new(-1.0, 0.0, -3.0) + offset, max: Vec3::new(4.0, 2.0, 5.0) + offset };
            let sensor = Sensor { width: 40, height: 30, padding: 0 };
            let view = framing(Some(bounds));
            let camera = build(&view, sensor);
            for corner in 0..8 {
                let pick = |bit| if corner >> bit & 1 == 0 { bounds.min } else { bounds.max };
                let corner = Vec3::new(pick(0).x, pick(1).y, pick(2).z);
                assert!(camera.raster((corner - view.position).normalize()).is_some(), "{corner}");
            }
        }
        assert!(build(&framing(None), Sensor { width: 1, height: 1, padding: 0 }).raster(Vec3::NEG_Z).is_some());
    }
}
