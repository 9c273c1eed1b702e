//! Which camera renders.

use glam::{DVec3, Vec3};
use pathspace::{
    io::{Loaded, NamedCamera, ThinLens, View},
    scene::{
        camera::{Blades, Sensor},
        geometry::Bounds,
    },
};

use crate::cli::shared::{
    args::{SceneArgs, SizeArgs},
    exit::Failure,
    terminal::Terminal,
    values::LookAt,
};

/// Width over height where nothing says otherwise.
const DEFAULT_ASPECT: f32 = 4.0 / 3.0;
const DEFAULT_YFOV: f32 = 45.0_f32.to_radians();
const LARGEST_SIDE: f32 = 32_768.0;

/// The camera that the options ask for, or the file's first, or one that frames the whole scene; with the lens of the
/// options.
pub fn choose(args: &SceneArgs, loaded: &Loaded, terminal: Terminal) -> Result<NamedCamera, Failure> {
    let camera = view(args, loaded, terminal)?;
    let target = args.look_at.map(|look_at| look_at.eye.distance(look_at.target) as f32);
    let rotation = args.blade_rotation.unwrap_or(0.0).to_radians();
    // Zero blades are none.
    let blades = args.blades.map(|count| Blades::new(count, rotation));
    let lens = Lens { aperture: args.aperture, focus: args.focus, blades };
    lens.put_on(camera, target).map_err(Failure::usage)
}

fn view(args: &SceneArgs, loaded: &Loaded, terminal: Terminal) -> Result<NamedCamera, Failure> {
    if let Some(look_at) = args.look_at {
        return Ok(looking_at(look_at, loaded.centre, loaded.cameras.first()));
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

/// The image's size: what the options say, the rest by the aspect, and `usual` columns where they say nothing.
pub fn sensor(args: &SizeArgs, usual: u32, padding: u32, camera: &NamedCamera) -> Sensor {
    let aspect = camera.aspect.filter(|a| a.is_finite() && *a > 0.0).unwrap_or(DEFAULT_ASPECT);
    let side = |length: f32| length.round().clamp(1.0, LARGEST_SIDE) as u32;
    let (width, height) = match (args.width, args.height) {
        (Some(width), Some(height)) => (width, height),
        (None, Some(height)) => (side(height as f32 * aspect), height),
        (width, None) => {
            let width = width.unwrap_or(usual);
            (width, side(width as f32 / aspect))
        }
    };
    Sensor { width, height, padding }
}

/// What the options say of the lens, in metres.
struct Lens {
    aperture: Option<f32>,
    focus: Option<f32>,
    /// The blades, or that there are none.
    blades: Option<Option<Blades>>,
}

impl Lens {
    /// `camera` with this lens; what the options leave open is what the file says, and the focus then `target`, a
    /// distance.
    fn put_on(self, camera: NamedCamera, target: Option<f32>) -> Result<NamedCamera, String> {
        let Self { aperture, focus, blades } = self;
        if aperture.is_none() && focus.is_none() && blades.is_none() {
            return Ok(camera);
        }
        let name = &camera.name;
        let View::Perspective { yfov, lens } = camera.view else {
            return Err(format!(
                "the camera '{name}' is orthographic and has no lens for --aperture, --focus or --blades"
            ));
        };
        let aperture = aperture.or(lens.map(|lens| lens.aperture)).ok_or_else(|| {
            let option = if focus.is_some() { "--focus" } else { "--blades" };
            format!(
                "the camera '{name}' is a pinhole, and {option} needs a lens: give its diameter with --aperture METRES"
            )
        })?;
        let focus = focus.or(lens.map(|lens| lens.focus)).or(target);
        let lens = match focus {
            _ if aperture == 0.0 => None,
            Some(focus) => {
                let blades = blades.unwrap_or(lens.and_then(|lens| lens.blades));
                Some(ThinLens { blades, ..ThinLens::new(aperture, focus)? })
            }
            None => return Err("a lens needs the distance at which it is sharp: --focus METRES".to_owned()),
        };
        Ok(NamedCamera { view: View::Perspective { yfov, lens }, ..camera })
    }
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

fn looking_at(look_at: LookAt, centre: DVec3, instead_of: Option<&NamedCamera>) -> NamedCamera {
    let of_the_file = instead_of.and_then(|camera| match camera.view {
        View::Perspective { yfov, .. } => Some(yfov),
        View::Orthographic { .. } => None,
    });
    NamedCamera {
        name: "look-at".to_owned(),
        position: (look_at.eye - centre).as_vec3(),
        forward: (look_at.target - look_at.eye).normalize().as_vec3(),
        up: Vec3::Y,
        view: View::Perspective { yfov: look_at.yfov.or(of_the_file).unwrap_or(DEFAULT_YFOV), lens: None },
        aspect: instead_of.and_then(|camera| camera.aspect),
    }
}

/// A camera that sees the whole bounds in a three-quarter view: from the front (+z, as glTF defines it), 35° to the
/// right of it and 25° above, so that it looks along no side of a box and sees a flat model of any orientation from one
/// of its faces.
///
/// It stands where the corners of the bounds just fit into a square image's middle nine tenths.
fn framing(bounds: Option<Bounds>) -> NamedCamera {
    const MARGIN: f32 = 0.9;
    let (azimuth, elevation) = (35.0_f32.to_radians(), 25.0_f32.to_radians());
    let towards = Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
    let right = Vec3::Y.cross(towards).normalize();
    let up = towards.cross(right);
    let (center, half) = match bounds {
        Some(bounds) => (0.5 * bounds.min + 0.5 * bounds.max, 0.5 * bounds.max - 0.5 * bounds.min),
        None => (Vec3::ZERO, Vec3::splat(0.5)),
    };
    let slope = MARGIN * (0.5 * DEFAULT_YFOV).tan();
    let fits = |corner: Vec3| corner.dot(towards) + corner.dot(right).abs().max(corner.dot(up).abs()) / slope;
    let signs = [-1.0, 1.0];
    let corners = signs.iter().flat_map(|x| signs.iter().flat_map(move |y| signs.map(|z| Vec3::new(*x, *y, z))));
    // A scene of a single point still has a place in front of it.
    let least = (1e-3 * center.length()).max(1e-3) / slope;
    let distance = corners.map(|sign| fits(sign * half)).fold(least, f32::max);
    NamedCamera {
        name: "framing".to_owned(),
        position: center + towards * distance,
        forward: -towards,
        up: Vec3::Y,
        view: View::Perspective { yfov: DEFAULT_YFOV, lens: None },
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
            let camera = view.to_camera(sensor);
            for corner in 0..8 {
                let pick = |bit| if corner >> bit & 1 == 0 { bounds.min } else { bounds.max };
                let corner = Vec3::new(pick(0).x, pick(1).y, pick(2).z);
                let w = (corner - view.position).normalize();
                assert!(camera.raster(&camera.lens_point(), w).is_some(), "{corner}");
            }
        }
        let view = framing(None);
        let camera = view.to_camera(Sensor { width: 1, height: 1, padding: 0 });
        assert!(camera.raster(&camera.lens_point(), view.forward).is_some());
    }

    /// Of a camera that looks along an axis, two of these three are edges.
    #[test]
    fn the_framing_camera_sees_flat_models_of_every_orientation_from_one_side() {
        for axis in 0..3 {
            for size in [1e-3, 1.0, 1e4] {
                let mut half = Vec3::splat(size);
                half[axis] = 0.0;
                let camera = framing(Some(Bounds { min: -half, max: half }));
                let cos = camera.position.normalize()[axis];
                assert!(cos > 0.35, "axis {axis}: seen at a cosine of {cos}");
                let distance = camera.position.length() / size;
                assert!(distance < 4.0, "axis {axis}: {distance} half sides away");
            }
        }
    }

    #[test]
    fn a_lens_is_put_together_from_options_file_and_target() {
        let yfov = DEFAULT_YFOV;
        let pinhole = named("eye");
        let in_file = Some(ThinLens { aperture: 0.1, focus: 4.0, blades: None });
        let with = |lens| NamedCamera { view: View::Perspective { yfov, lens }, ..pinhole.clone() };
        let put = |aperture, focus, on: &NamedCamera, target| {
            Lens { aperture, focus, blades: None }.put_on(on.clone(), target)
        };
        let lens = |aperture, focus| Ok(with(Some(ThinLens { aperture, focus, blades: None })));
        assert_eq!(put(None, None, &pinhole, None), Ok(pinhole.clone()));
        assert_eq!(put(Some(0.2), Some(3.0), &pinhole, Some(9.0)), lens(0.2, 3.0));
        assert_eq!(put(Some(0.2), None, &pinhole, Some(9.0)), lens(0.2, 9.0));
        assert_eq!(put(Some(0.2), None, &with(in_file), None), lens(0.2, 4.0));
        assert_eq!(put(None, Some(3.0), &with(in_file), None), lens(0.1, 3.0));
        assert_eq!(put(Some(0.0), None, &with(in_file), None), Ok(with(None)));
        assert!(put(None, Some(3.0), &pinhole, None).unwrap_err().contains("--aperture"));
        assert!(put(Some(0.2), None, &pinhole, None).unwrap_err().contains("--focus"));
        assert!(put(Some(1e30), Some(3.0), &pinhole, None).unwrap_err().contains("aperture"));
        assert!(put(Some(0.2), Some(1e-30), &pinhole, None).unwrap_err().contains("focus"));
        // Blades of the options, of the file, and none in their place.
        let [five, six] = [5, 6].map(|count| Blades::new(count, 0.3));
        let iris = |blades, on| Lens { aperture: None, focus: None, blades }.put_on(with(on), None);
        let bladed = |blades| Some(ThinLens { aperture: 0.1, focus: 4.0, blades });
        assert_eq!(iris(Some(five), in_file), Ok(with(bladed(five))));
        assert_eq!(iris(Some(six), bladed(five)), Ok(with(bladed(six))));
        assert_eq!(iris(Some(None), bladed(five)), Ok(with(bladed(None))));
        assert_eq!(put(Some(0.1), None, &with(bladed(six)), None), Ok(with(bladed(six))));
        assert!(iris(Some(five), None).unwrap_err().contains("--blades needs a lens"));
        let flat = NamedCamera { view: View::Orthographic { height: 2.0 }, ..pinhole.clone() };
        assert!(put(Some(0.2), Some(3.0), &flat, None).unwrap_err().contains("orthographic"));
    }
}
