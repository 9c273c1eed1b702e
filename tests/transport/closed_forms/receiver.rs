//! A diffuse square that fills the image: what falls on it is what the picture shows.

use glam::{DQuat, DVec3};
use pathspace::{
    math::Rgb,
    scene::{
        camera::{Camera, Sensor},
        geometry::Geometry,
        material::Material,
    },
    statistics::Regions,
};

use crate::scenes;

/// A square of which the image shows the part with half the side `half`; the surface goes on a little beyond.
pub struct Receiver {
    center: DVec3,
    /// To the image's right.
    right: DVec3,
    /// To the image's bottom.
    down: DVec3,
    half: f64,
}

/// How much larger the surface is than what is seen of it: a ray through the border of the image must not miss it.
const MARGIN: f64 = 1.05;

impl Receiver {
    pub const ALBEDO: f64 = 0.8;

    /// The square around `center` in the plane of x and z, turned by `rotation`; it faces +y before that.
    pub fn new(center: DVec3, rotation: DQuat, half: f64) -> Self {
        Self { center, right: rotation * DVec3::X, down: rotation * DVec3::Z, half }
    }

    pub fn normal(&self) -> DVec3 {
        self.down.cross(self.right)
    }

    /// The point that the image shows at (u, v).
    pub fn at(&self, u: f64, v: f64) -> DVec3 {
        self.center + (self.right * (2.0 * u - 1.0) + self.down * (2.0 * v - 1.0)) * self.half
    }

    pub fn material() -> Material {
        Material::diffuse("receiver", Rgb::splat(Self::ALBEDO as f32))
    }

    pub fn add(&self, geometry: &mut Geometry, material: u32) {
        let far = 0.5 + 0.5 * MARGIN;
        let near = 1.0 - far;
        let corners = [(near, near), (near, far), (far, far), (far, near)].map(|(u, v)| self.at(u, v).as_vec3());
        scenes::quad(geometry, corners, material);
    }

    /// A pinhole at `height` above the middle that sees exactly the square.
    pub fn pinhole(&self, height: f64, sensor: Sensor) -> Camera {
        let from = self.center + self.normal() * height;
        let view = 2.0 * (self.half / height).atan();
        Camera::look_at(from.as_vec3(), self.center.as_vec3(), -self.down.as_vec3(), view as f32, sensor)
    }

    /// An orthographic camera that sees exactly the square, with its film at `height`.
    pub fn orthographic(&self, height: f64, sensor: Sensor) -> Camera {
        let from = self.center + self.normal() * height;
        let size = 2.0 * self.half;
        Camera::orthographic(from.as_vec3(), self.center.as_vec3(), -self.down.as_vec3(), size as f32, sensor)
    }

    /// The image of the irradiance E(p): L = ρ E/π.
    pub fn expected(&self, fine: usize, irradiance: impl Fn(DVec3) -> f64) -> Regions {
        let radiance = |u, v| DVec3::splat(Self::ALBEDO / std::f64::consts::PI * irradiance(self.at(u, v)));
        super::expected(fine, radiance)
    }
}
