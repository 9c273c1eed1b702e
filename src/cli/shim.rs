//! Stand-ins for the loader and the renderer until they are merged: the names that the command line uses, and a picture
//! of nothing. Replaced by `use` lines on merge.

use std::path::Path;

use glam::{Vec2, Vec3};

pub(super) use crate::render::{IntegratorKind, Settings};
use crate::{
    film::{Film, FixedPoint, Half},
    math::Rgb,
    sampling::{Independent, Sampler, Stream},
    scene::{
        camera::{Camera, Raster},
        geometry::Geometry,
        material::Material,
    },
};

pub(super) const INTEGRATORS: [IntegratorKind; 4] =
    [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt];

pub(super) fn integrator_name(kind: IntegratorKind) -> &'static str {
    match kind {
        IntegratorKind::Path => "path",
        IntegratorKind::Light => "light",
        IntegratorKind::Hybrid => "hybrid",
        IntegratorKind::Bdpt => "bdpt",
    }
}

pub(super) fn integrator_named(name: &str) -> Option<IntegratorKind> {
    INTEGRATORS.into_iter().find(|kind| integrator_name(*kind) == name)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Strategy {
    pub(super) s: u32,
    pub(super) t: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Weighting {
    Weighted,
    Unweighted,
}

#[derive(Clone, Debug)]
pub(super) struct NamedCamera {
    pub(super) name: Option<String>,
    pub(super) position: Vec3,
    pub(super) forward: Vec3,
    pub(super) up: Vec3,
    pub(super) yfov: f32,
    pub(super) aspect: Option<f32>,
}

pub(super) struct Loaded {
    pub(super) geometry: Geometry,
    pub(super) materials: Vec<Material>,
    pub(super) cameras: Vec<NamedCamera>,
    pub(super) warnings: Vec<String>,
    pub(super) hash: String,
}

pub(super) fn load(path: &Path) -> Result<Loaded, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("cannot read '{}': {error}", path.display()))?;
    if bytes.is_empty() {
        return Err(format!("'{}' is empty", path.display()));
    }
    Ok(Loaded {
        geometry: Geometry::default(),
        materials: Vec::new(),
        cameras: Vec::new(),
        warnings: vec!["the glTF reader is not here yet: this is a test picture".to_owned()],
        hash: format!("{} bytes", bytes.len()),
    })
}

/// Lights by kind, for `info` and `-v`.
pub(super) fn light_summary(_loaded: &Loaded) -> String {
    "unknown".to_owned()
}

/// To become `scene.camera_sees_specular()`.
pub(super) fn camera_sees_specular(_scene: &Scene) -> bool {
    false
}

pub(super) struct Scene {
    camera: Camera,
}

impl Scene {
    pub(super) fn new(_loaded: Loaded, camera: Camera) -> Self {
        Self { camera }
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct Statistics {
    pub(super) camera_subpaths: u64,
    pub(super) light_subpaths: u64,
    pub(super) rays: u64,
    pub(super) rejected: Vec<((u32, u32), u64)>,
}

pub(super) struct Renderer<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    film: Film,
    passes: u32,
    statistics: Statistics,
}

impl<'a> Renderer<'a> {
    pub(super) fn new(scene: &'a Scene, settings: &'a Settings) -> Self {
        let scale = FixedPoint::for_peak_radiance(1.0);
        let film = Film::new(scene.camera.sensor(), settings.crop, settings.filter, scale);
        Self { scene, settings, film, passes: 0, statistics: Statistics::default() }
    }

    pub(super) fn pass(&mut self) {
        let sensor = self.scene.camera.sensor();
        let half = Half::of_pass(self.passes);
        for pixel in 0..sensor.pixels() {
            let mut sampler = Independent::new(self.settings.seed, pixel, self.passes, Stream::Camera);
            let place = Vec2::new((pixel % sensor.width) as f32, (pixel / sensor.width) as f32) + sampler.next_2d();
            let value = place.extend(40.0) * (0.04 * sampler.next_1d());
            self.film.deposit(Raster(place), Rgb::from(value), half);
        }
        self.passes += 1;
        self.statistics.camera_subpaths += self.settings.crop.pixels();
        self.statistics.rays += 2 * self.settings.crop.pixels();
    }

    pub(super) fn passes(&self) -> u32 {
        self.passes
    }

    pub(super) fn film(&self) -> &Film {
        &self.film
    }

    pub(super) fn statistics(&self) -> Statistics {
        self.statistics.clone()
    }
}
