//! Cameras, in world space.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use gltf_json::{
    Root,
    camera::{Camera as Json, Orthographic, Perspective},
};
use serde_json::Value;

use super::{
    error::{Fault, quoted},
    placed::Placed,
};
use crate::scene::camera::{Blades, Camera, Sensor};

/// Our extension of perspective cameras.
const THIN_LENS: &str = "PATHSPACE_thin_lens";

/// The least vertical field of view, radians: W_e of a narrower camera may leave what f32 can hold.
const NARROWEST: f32 = 1e-5;

/// A camera of the file, in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCamera {
    /// The camera's name, else that of its node, else `camera N`.
    pub name: String,
    /// The pinhole, the middle of the lens or of the orthographic film, metres.
    pub position: Vec3,
    /// The unit viewing direction.
    pub forward: Vec3,
    /// The unit direction that is up in the image.
    pub up: Vec3,
    /// What it sees from there.
    pub view: View,
    /// Width over height, where the file says.
    pub aspect: Option<f32>,
}

/// How a camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// In perspective.
    Perspective {
        /// The vertical field of view, radians.
        yfov: f32,
        /// The lens; a pinhole without one.
        lens: Option<ThinLens>,
    },
    /// Along one direction.
    Orthographic {
        /// The height of what is seen, metres: twice glTF's `ymag`.
        height: f32,
    },
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinLens {
    /// Its diameter, metres.
    pub aperture: f32,
    /// The distance along the axis at which things are sharp, metres.
    pub focus: f32,
    /// The blades of its iris; `None` for a disk.
    pub blades: Option<Blades>,
}

impl ThinLens {
    /// A round lens of the diameter `aperture`, at most 1000 km, sharp at the distance `focus`, from a micrometre to
    /// 10⁹ km: beyond, areas leave what f32 can hold.
    ///
    /// # Errors
    /// What is wrong with the lengths, in words.
    pub fn new(aperture: f32, focus: f32) -> Result<Self, &'static str> {
        if !(0.0..=1e6).contains(&aperture) {
            return Err("the aperture is no diameter of a lens, from 0 to 1000000 m");
        }
        if !(1e-6..=1e12).contains(&focus) {
            return Err("the focus distance lies between 0.000001 and 1000000000000 m");
        }
        Ok(Self { aperture, focus, blades: None })
    }
}

impl NamedCamera {
    /// The scene's camera over an image of `sensor`'s size: the vertical extent of the view is kept, the horizontal one
    /// follows from the sensor.
    pub fn to_camera(&self, sensor: Sensor) -> Camera {
        // Far from the origin, a target at unit distance would round to the position itself.
        let target = self.position + self.forward * 1.0_f32.max(self.position.abs().max_element());
        match self.view {
            View::Perspective { yfov, lens } => {
                let camera = Camera::look_at(self.position, target, self.up, yfov, sensor);
                lens.map_or(camera, |lens| camera.with_lens(lens.aperture, lens.focus).with_blades(lens.blades))
            }
            View::Orthographic { height } => Camera::orthographic(self.position, target, self.up, height, sensor),
        }
    }
}

/// The camera at a node.
pub(super) fn camera(
    root: &Root,
    node: &Placed,
    index: usize,
    warnings: &mut Vec<String>,
) -> Result<NamedCamera, Fault> {
    let at = format!("/cameras/{index}");
    let Some(camera) = root.cameras.get(index) else { return Err(Fault::invalid(at, "there is no such camera")) };
    let node_name = root.nodes.get(node.index).and_then(|node| node.name.clone());
    let name = camera.name.clone().or(node_name).unwrap_or_else(|| format!("camera {index}"));
    let (view, aspect) = match (&camera.perspective, &camera.orthographic) {
        (Some(lens), _) => perspective(camera, lens, &at)?,
        (None, Some(film)) => orthographic(camera, film, &at, &name, warnings)?,
        (None, None) => return Err(Fault::invalid(at, "the camera is neither perspective nor orthographic")),
    };
    let (position, forward, up) = (node.origin(), node.axis(DVec3::NEG_Z)?, node.axis(DVec3::Y)?);
    Ok(NamedCamera { name, position, forward, up, view, aspect })
}

fn perspective(camera: &Json, view: &Perspective, at: &str) -> Result<(View, Option<f32>), Fault> {
    if !(view.yfov > 0.0 && view.yfov < PI) {
        let what = format!("the field of view is {} radians, not between 0 and π", view.yfov);
        return Err(Fault::invalid(format!("{at}/perspective/yfov"), what));
    }
    if view.yfov < NARROWEST {
        let what = format!("the field of view is {} radians, and {NARROWEST} is the least", view.yfov);
        return Err(Fault::invalid(format!("{at}/perspective/yfov"), what));
    }
    if view.aspect_ratio.is_some_and(|aspect| !(aspect > 0.0 && aspect.is_finite())) {
        return Err(Fault::invalid(format!("{at}/perspective/aspectRatio"), "the aspect ratio is not positive"));
    }
    let lens = thin_lens(camera).map(|lens| read_lens(lens, &format!("{at}/extensions/{THIN_LENS}"))).transpose()?;
    Ok((View::Perspective { yfov: view.yfov, lens }, view.aspect_ratio))
}

fn orthographic(
    camera: &Json,
    film: &Orthographic,
    at: &str,
    name: &str,
    warnings: &mut Vec<String>,
) -> Result<(View, Option<f32>), Fault> {
    let extent = |member: &str, half: f32| {
        let extent = half.abs();
        // The square of a pixel has to stay in f32.
        if (1e-12..=1e12).contains(&extent) {
            return Ok(extent);
        }
        Err(Fault::invalid(format!("{at}/orthographic/{member}"), format!("{half} is no extent of a film")))
    };
    let (x, y) = (extent("xmag", film.xmag)?, extent("ymag", film.ymag)?);
    if film.xmag < 0.0 || film.ymag < 0.0 {
        let name = quoted(name);
        warnings
            .push(format!("{at}/orthographic: the film of the camera {name} has a negative extent, taken as positive"));
    }
    if thin_lens(camera).is_some() {
        return Err(Fault::invalid(format!("{at}/extensions/{THIN_LENS}"), "an orthographic camera has no lens"));
    }
    Ok((View::Orthographic { height: 2.0 * y }, Some(x / y)))
}

fn thin_lens(camera: &Json) -> Option<&Value> {
    camera.extensions.as_ref()?.others.get(THIN_LENS)
}

fn read_lens(lens: &Value, at: &str) -> Result<ThinLens, Fault> {
    let length = |member: &str| {
        let value = lens.get(member).and_then(Value::as_f64).map(|value| value as f32);
        value
            .filter(|value| value.is_finite())
            .ok_or_else(|| Fault::invalid(format!("{at}/{member}"), "a lens needs this length in metres"))
    };
    let (aperture, focus) = (length("aperture")?, length("focusDistance")?);
    let lens_of = ThinLens::new(aperture, focus).map_err(|what| Fault::invalid(at, what))?;
    let Some(count) = lens.get("blades") else {
        return match lens.get("rotation") {
            None => Ok(lens_of),
            Some(_) => Err(Fault::invalid(format!("{at}/rotation"), "a lens without blades has no rotation")),
        };
    };
    let [least, most] = Blades::COUNTS;
    let number = |value: &Value| value.as_f64().map(|value| value as f32);
    let rotation = lens
        .get("rotation")
        .map_or(Some(0.0), number)
        .filter(|angle| angle.is_finite())
        .ok_or_else(|| Fault::invalid(format!("{at}/rotation"), "this is no angle in radians"))?;
    let count = count.as_u64().and_then(|count| u32::try_from(count).ok());
    let blades = count.and_then(|count| Blades::new(count, rotation)).ok_or_else(|| {
        Fault::invalid(format!("{at}/blades"), format!("the number of blades is not one of {least} to {most}"))
    })?;
    Ok(ThinLens { blades: Some(blades), ..lens_of })
}
