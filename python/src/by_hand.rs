//! Paths that a person lays through a scene.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use pathspace::{
    path::Vertex,
    scene::{
        Scene,
        bsdf::Lobe,
        geometry::PrimitiveId,
        light::{Light, LightId},
        point::{Place, Point},
    },
};
use pyo3::prelude::*;

use crate::{cli::shared::exit::Failure, errors::exception, path::Path, settings::Settings};

/// How far from a surface a place may be to be taken for it, in parts of the way there.
const NEAR: f32 = 1e-3;

/// The path from the middle of the lens over these places, in the coordinates of the file; then in the direction of
/// `sky`, if there is one, to what is infinitely far away.
#[pyfunction]
#[pyo3(signature = (settings, places, sky=None))]
pub fn lay(py: Python<'_>, settings: &Settings, places: Vec<[f64; 3]>, sky: Option<[f64; 3]>) -> PyResult<Path> {
    py.detach(|| laid(&settings.scene, &places, sky)).map_err(|sentence| exception(py, &Failure::usage(sentence)))
}

fn laid(scene: &Arc<Scene>, places: &[[f64; 3]], sky: Option<[f64; 3]>) -> Result<Path, String> {
    if scene.camera.is_orthographic() {
        return Err("an orthographic camera has no lens for a path to begin on".to_owned());
    }
    let mut points = vec![scene.camera.lens_point()];
    for (i, place) in places.iter().enumerate() {
        let target = (DVec3::from_array(*place) - scene.centre).as_vec3();
        let is_last = i + 1 == places.len() && sky.is_none();
        let lamp = if is_last { lamp_at(scene, target) } else { None };
        let point = lamp.or_else(|| surface_at(scene, points[i].position, target));
        points.push(point.ok_or_else(|| format!("there is no surface at {place:?}, place {i} of the path"))?);
    }
    if let Some(sky) = sky {
        points.push(infinity(scene, DVec3::from_array(sky).normalize_or_zero().as_vec3())?);
    }
    if points.len() < 2 {
        return Err("a path has at least one place besides the lens".to_owned());
    }
    let w = direction(&points[0], &points[1]);
    let outside = || "the camera does not see the first place: it is outside the image".to_owned();
    let raster = scene.camera.raster(&points[0], w).ok_or_else(outside)?;
    let seen = |i: usize| {
        let (a, b) = (&points[i], &points[i + 1]);
        f64::from(if i == 0 { scene.visible_from_camera(a, b) } else { scene.visible(a, b) })
    };
    let visibility = (0..points.len() - 1).map(seen).collect();
    let vertices = (0..points.len()).map(|i| Vertex { lobe: lobe(&points, i), ..Vertex::new(points[i]) }).collect();
    Ok(Path { scene: scene.clone(), vertices, visibility, merged: None, raster, wavelength: None, found: None })
}

/// The unit direction from `a` to `b`, which may be infinitely far away.
fn direction(a: &Point, b: &Point) -> Vec3 {
    if b.place == Place::Infinite { b.position } else { (b.position - a.position).normalize() }
}

/// The lobe of a vertex: a delta one where the surface has nothing else, the one that leads on.
fn lobe(points: &[Point], i: usize) -> Lobe {
    let point = &points[i];
    if i == 0 || i + 1 == points.len() || point.bsdf.has_continuous() {
        return Lobe::Continuous;
    }
    let [to_camera, to_light] = [i - 1, i + 1].map(|j| direction(point, &points[j]));
    let leads_on = |k: &u8| {
        let vertex = Vertex { lobe: Lobe::Delta(*k), ..Vertex::new(*point) };
        vertex.scatter(to_camera, to_light).f.max_element() > 0.0
    };
    (0..point.bsdf.delta_count()).find(leads_on).map_or(Lobe::Continuous, Lobe::Delta)
}

/// The surface at `target`, seen from `from`, whatever is between.
fn surface_at(scene: &Scene, from: Vec3, target: Vec3) -> Option<Point> {
    let w = (target - from).try_normalize()?;
    let back = NEAR * target.distance(from);
    let traced = scene.trace_ray(target - back * w, w, PrimitiveId::NONE, |_| true);
    let hit = traced.hit.filter(|hit| hit.t <= 2.0 * back)?;
    Some(scene.point_at(&traced.ray, &hit))
}

/// The point light or spot at `target`.
fn lamp_at(scene: &Scene, target: Vec3) -> Option<Point> {
    let is_there = |position: Vec3| position.distance(target) <= NEAR * NEAR * (1.0 + target.length());
    let mut lights = (0..).map(LightId::new).zip(scene.lights().all());
    lights.find_map(|(id, light)| {
        let position = match light {
            Light::Point { position, .. } => *position,
            Light::Spot(spot) => spot.position(),
            Light::Goniometric(lamp) => lamp.position(),
            _ => return None,
        };
        is_there(position).then(|| Point { place: Place::Degenerate, light: Some(id), ..Point::nowhere(position) })
    })
}

/// The sun in the unit direction `w`, or else the environment there.
fn infinity(scene: &Scene, w: Vec3) -> Result<Point, String> {
    let mut lights = (0..).map(LightId::new).zip(scene.lights().all());
    let sun = lights.find_map(|(id, light)| match light {
        Light::Directional { towards, .. } if towards.distance(w) <= NEAR * NEAR => {
            Some(Point { place: Place::Infinite, light: Some(id), ..Point::nowhere(*towards) })
        }
        _ => None,
    });
    sun.or_else(|| scene.lights().environment_at(w)).ok_or_else(|| "there is no light at infinity there".to_owned())
}
