//! The camera: where paths end, as W_e, its densities, and the raster.

use glam::{Vec2, Vec3};

use super::{
    geometry::PrimitiveId,
    material::MaterialId,
    point::{Place, Point},
};
use crate::{
    math::Rgb,
    sampling::PdfSolidAngle,
    scene::bsdf::{Bsdf, Diffuse},
};

/// A place on the image in pixels: x to the right, y downwards, (0, 0) the upper left corner of the upper left pixel.
/// In the padding around the image, coordinates are negative or beyond its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster(pub Vec2);

/// The size of an image in pixels, and the padding around it that a filter wider than a pixel needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sensor {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Pixels of padding on every side: the filter's radius beyond half a pixel, rounded up.
    pub padding: u32,
}

impl Sensor {
    /// N_l by default: the pixels of the unpadded image.
    pub fn pixels(&self) -> u32 {
        self.width * self.height
    }

    /// N_c: one camera subpath per pixel of the padded image.
    pub fn padded_pixels(&self) -> u32 {
        (self.width + 2 * self.padding) * (self.height + 2 * self.padding)
    }
}

/// A pinhole camera: its film lies at unit distance, its density is uniform over the padded film.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    sensor: Sensor,
    /// Side of a pixel on the film at unit distance.
    pixel: f32,
}

impl Camera {
    /// A camera at `position` that looks at `target`, with a vertical field of view of `yfov` radians over the
    /// (unpadded) image height. Pixels are square.
    ///
    /// # Panics
    /// If `position` equals `target`; if `up` is parallel to the viewing direction another one is chosen.
    pub fn look_at(position: Vec3, target: Vec3, up: Vec3, yfov: f32, sensor: Sensor) -> Self {
        assert!(position != target, "a camera cannot look at its own position");
        let forward = (target - position).normalize();
        let right = forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        let up = right.cross(forward);
        Self { position, right, up, forward, sensor, pixel: 2.0 * (0.5 * yfov).tan() / sensor.height as f32 }
    }

    /// The image that this camera looks through.
    pub fn sensor(&self) -> Sensor {
        self.sensor
    }

    /// p_0 as a point of the scene: its normal is the viewing direction, its place the lens plane.
    pub fn lens_point(&self) -> Point {
        Point {
            position: self.position,
            normal: self.forward,
            shading_normal: self.forward,
            error: 0.0,
            place: Place::Surface,
            primitive: PrimitiveId::NONE,
            material: MaterialId(0),
            light: None,
            bsdf: Bsdf::Diffuse(Diffuse { albedo: Rgb::ZERO }),
        }
    }

    /// The unit direction in which the pinhole sees `raster`.
    #[inline]
    pub fn direction(&self, raster: Raster) -> Vec3 {
        let size = Vec2::new(self.sensor.width as f32, self.sensor.height as f32);
        let film = (raster.0 - 0.5 * size) * self.pixel;
        (self.forward + self.right * film.x - self.up * film.y).normalize()
    }

    /// Where the unit direction `w` from the pinhole meets the padded image, `None` outside it.
    #[inline]
    pub fn raster(&self, w: Vec3) -> Option<Raster> {
        let cos = w.dot(self.forward);
        if cos <= 0.0 {
            return None;
        }
        let film = Vec2::new(w.dot(self.right), -w.dot(self.up)) / (cos * self.pixel);
        let size = Vec2::new(self.sensor.width as f32, self.sensor.height as f32);
        let raster = film + 0.5 * size;
        let padding = Vec2::splat(self.sensor.padding as f32);
        let inside = raster.cmpge(-padding).all() && raster.cmplt(size + padding).all();
        inside.then_some(Raster(raster))
    }

    /// W_e without its filter h_j: 1/(A_px cos⁴ θ), 1/sr, in the unit direction `w`; zero outside the padded image.
    /// (A pinhole: δ(p_0) replaces 1/A_lens. Veach 8.2, with the film at unit distance.)
    #[inline]
    pub fn we(&self, w: Vec3) -> f32 {
        if self.raster(w).is_none() {
            return 0.0;
        }
        let cos = w.dot(self.forward);
        1.0 / (self.pixel * self.pixel * (cos * cos) * (cos * cos))
    }

    /// The density of a camera subpath's first direction: uniform over the padded film, 1/(A_film cos³ θ).
    #[inline]
    pub fn pdf(&self, w: Vec3) -> PdfSolidAngle {
        if self.raster(w).is_none() {
            return PdfSolidAngle::ZERO;
        }
        let cos = w.dot(self.forward);
        let film = self.pixel * self.pixel * self.sensor.padded_pixels() as f32;
        PdfSolidAngle(1.0 / (film * cos * cos * cos))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let sensor = Sensor { width: 40, height: 30, padding: 2 };
        Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 1.0, 0.5), Vec3::Y, 0.8, sensor)
    }

    #[test]
    fn raster_inverts_direction_up_to_the_padding() {
        let c = camera();
        for (x, y) in [(0.25, 0.5), (39.5, 29.75), (-1.9, 31.5), (20.0, 15.0)] {
            let r = c.raster(c.direction(Raster(Vec2::new(x, y)))).unwrap();
            assert!((r.0 - Vec2::new(x, y)).length() < 1e-3, "{r:?}");
        }
        assert!(c.raster(c.direction(Raster(Vec2::new(42.5, 3.0)))).is_none());
        assert!(c.raster(-c.forward).is_none());
    }

    #[test]
    fn the_density_integrates_to_one_over_the_padded_film() {
        let c = camera();
        let n = 400;
        // dω = cos³ θ dA on a film at unit distance.
        let film = Vec2::new(44.0, 34.0) * c.pixel;
        let cell = film.x * film.y / (n * n) as f32;
        let mut sum = 0.0_f64;
        for i in 0..n * n {
            let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
            let w = c.direction(Raster(u * Vec2::new(44.0, 34.0) - Vec2::splat(2.0)));
            let cos = w.dot(c.forward);
            sum += f64::from(c.pdf(w).0 * cos * cos * cos * cell);
            let weight = c.we(w) * cos / c.pdf(w).0;
            assert!((weight - 44.0 * 34.0).abs() < 0.1, "W_e cos/p counts the camera subpaths of a pass: {weight}");
        }
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    }
}
