//! Light from images (`EXT_lights_image_based`): the cube map around the scene that is shown.
//!
//! Faces are +x, −x, +y, −y, +z, −z, each what one sees from the middle of the cube: of the first two and the last two
//! with +y at the top, of +y with −z and of −y with +z there. So are the faces of OpenGL after the flip about their
//! vertical axis that the extension asks for. A quaternion turns the cube in the world, and 8-bit colours are sRGB;
//! those of a PNG with alpha are then divided by it (RGBD, as Babylon.js has it).

use glam::{DQuat, DVec3, Vec3};
use gltf_json::Root;
use serde_json::Value;

use super::{
    error::Fault,
    image::Images,
    limits::{Limit, Limits},
};
use crate::{
    math::Rgb,
    scene::{
        light::{EnvironmentMap, NotARadiance},
        texture::{Encoding, Image},
    },
};

const NAME: &str = "EXT_lights_image_based";

/// What the middle, the right and the lower edge of each face are towards.
const FACES: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::NEG_X, DVec3::NEG_Z, DVec3::NEG_Y],
    [DVec3::Y, DVec3::NEG_X, DVec3::Z],
    [DVec3::NEG_Y, DVec3::NEG_X, DVec3::NEG_Z],
    [DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y],
    [DVec3::NEG_Z, DVec3::X, DVec3::NEG_Y],
];
/// Texels along the map's width for each along a face's.
const PER_FACE: usize = 4;
/// Lookups along each edge of a texel of the map.
const LOOKUPS: usize = 2;

/// The environment that a file has: radiance from all directions, as an equirectangular map in the orientation of
/// [`EnvironmentMap`].
#[derive(Clone, Debug)]
pub struct ImageLight {
    width: usize,
    texels: Vec<Rgb>,
}

impl ImageLight {
    /// The map with its radiance multiplied by `scale`.
    ///
    /// # Errors
    /// The first texel that is no radiance then.
    pub fn to_map(&self, scale: f32) -> Result<EnvironmentMap, NotARadiance> {
        EnvironmentMap::new(self.width, self.texels.iter().map(|texel| *texel * scale).collect(), 0.0)
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.width / 2)
    }
}

/// The light around the scene of `root` that is shown, if it has one.
pub(super) fn image_light(root: &Root, images: &mut Images<'_>, limits: &Limits) -> Result<Option<ImageLight>, Fault> {
    let shown = root.scene.map_or(0, |scene| scene.value());
    let reference = root.scenes.get(shown).and_then(|scene| scene.extensions.as_ref()?.others.get(NAME));
    let Some(reference) = reference else { return Ok(None) };
    let Some(index) = index(reference.get("light")) else {
        let at = format!("/scenes/{shown}/extensions/{NAME}/light");
        return Err(Fault::invalid(at, "this is not the number of a light"));
    };
    let at = format!("/extensions/{NAME}/lights/{index}");
    let lights = root.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME)?.get("lights"));
    let Some(light) = lights.and_then(|lights| lights.get(index)) else {
        return Err(Fault::invalid(at, "there is no such light"));
    };
    let cube = Cube::read(light, &at, images)?;
    let side = cube.faces[0].size().0 as usize;
    let (width, height) = (PER_FACE * side, PER_FACE * side / 2);
    let most = limits.environment_texels;
    if (width as u64) * (height as u64) > most {
        let what =
            format!("as a map the light has {width} × {height} texels, and {}", Limit("environment-texels", most));
        return Err(Fault::too_large(at, what));
    }
    let texels = (0..width * height).map(|i| cube.texel(i % width, i / width, height)).collect();
    let light = ImageLight { width, texels };
    let map = light.to_map(1.0).map_err(|NotARadiance { value, .. }| {
        Fault::invalid(at, format!("the light has a radiance of {value} somewhere, which is infinite or above 1e30"))
    })?;
    Ok((map.integral() > 0.0).then_some(light))
}

fn index(value: Option<&Value>) -> Option<usize> {
    usize::try_from(value?.as_u64()?).ok()
}

struct Cube {
    faces: [std::sync::Arc<Image>; 6],
    intensity: f32,
    /// From the world to the cube.
    from_world: DQuat,
}

impl Cube {
    fn read(light: &Value, at: &str, images: &mut Images<'_>) -> Result<Self, Fault> {
        let intensity = match light.get("intensity") {
            None => 1.0,
            Some(value) => value
                .as_f64()
                .filter(|x| *x >= 0.0)
                .ok_or_else(|| Fault::invalid(format!("{at}/intensity"), "this is not a number of at least 0"))?
                as f32,
        };
        let rotation = match light.get("rotation") {
            None => DQuat::IDENTITY,
            Some(value) => quaternion(value)
                .ok_or_else(|| Fault::invalid(format!("{at}/rotation"), "this is no unit quaternion: four numbers"))?,
        };
        // The first level is the sharp one; the others are blurred for rough surfaces.
        let level = light.get("specularImages").and_then(|levels| levels.get(0)?.as_array());
        let at = format!("{at}/specularImages/0");
        let Some(level) = level.filter(|level| level.len() == 6) else {
            return Err(Fault::invalid(at, "these are not the six images of a cube's faces"));
        };
        let mut face = |i: usize| {
            let at = format!("{at}/{i}");
            let index =
                index(Some(&level[i])).ok_or_else(|| Fault::invalid(&at, "this is not the number of an image"))?;
            let image = images.get(index)?;
            let (width, height) = image.size();
            if width != height {
                return Err(Fault::invalid(at, format!("the face is {width} × {height} texels, not square")));
            }
            Ok(image)
        };
        let faces = [face(0)?, face(1)?, face(2)?, face(3)?, face(4)?, face(5)?];
        if let Some(i) = (1..6).find(|&i| faces[i].size() != faces[0].size()) {
            return Err(Fault::invalid(format!("{at}/{i}"), "the faces of the cube differ in size"));
        }
        Ok(Self { faces, intensity, from_world: rotation.inverse() })
    }

    /// The mean over a texel of a map of `height` rows.
    fn texel(&self, column: usize, row: usize, height: usize) -> Rgb {
        let place = |i: usize, k: usize| i as f64 + (k as f64 + 0.5) / LOOKUPS as f64;
        let radiance = |k: usize| {
            let longitude = (place(column, k % LOOKUPS) / height as f64 - 1.0) * std::f64::consts::PI;
            let theta = place(row, k / LOOKUPS) / height as f64 * std::f64::consts::PI;
            let ((z, x), (sin, cos)) = (longitude.sin_cos(), theta.sin_cos());
            self.radiance(self.from_world * DVec3::new(sin * x, cos, sin * z))
        };
        let count = LOOKUPS * LOOKUPS;
        (0..count).map(radiance).sum::<Rgb>() * (self.intensity / count as f32)
    }

    /// From the direction `w` of the cube: between the texels' centres of a face by bilinear interpolation, constant
    /// from the outermost centres to its edges.
    fn radiance(&self, w: DVec3) -> Rgb {
        let axis = w.abs().max_position();
        let face = 2 * axis + usize::from(w[axis] < 0.0);
        let ([towards, right, down], image) = (FACES[face], &self.faces[face]);
        let side = image.size().0;
        let place = |edge: DVec3| {
            let texels = 0.5 * (w.dot(edge) / w.dot(towards) + 1.0) * f64::from(side) - 0.5;
            let texels = texels.clamp(0.0, f64::from(side - 1));
            let first = (texels as u32).min(side.saturating_sub(2));
            (first, (texels - f64::from(first)) as f32)
        };
        let ((i, x), (j, y)) = (place(right), place(down));
        let next = u32::from(side > 1);
        let row = |j: u32| decoded(image, i, j) * (1.0 - x) + decoded(image, i + next, j) * x;
        row(j) * (1.0 - y) + row(j + next) * y
    }
}

/// A texel, of RGBD where there is alpha.
fn decoded(image: &Image, x: u32, y: u32) -> Rgb {
    let texel = image.texel(x, y, Encoding::Srgb);
    let rgb: Vec3 = texel.truncate();
    // Black without alpha is black.
    if rgb == Vec3::ZERO { Rgb::ZERO } else { Rgb::from_array((rgb / texel.w).to_array()) }
}

fn quaternion(value: &Value) -> Option<DQuat> {
    let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(Value::as_f64).collect();
    let quaternion = DQuat::from_array(<[f64; 4]>::try_from(numbers?).ok()?);
    (quaternion.is_finite() && quaternion.length_squared() > 1e-12).then(|| quaternion.normalize())
}
