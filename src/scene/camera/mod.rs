//! The camera: where paths end, as W_e, its densities, and the raster.
//!
//! | camera | p_0 | first direction |
//! |---|---|---|
//! | pinhole | one point: δ(p_0) | uniform over the film at unit distance |
//! | thin lens | uniform on a disk or polygon | to the point of the focus plane that a pinhole in its middle sees |
//! | orthographic | uniform on the film | one direction: δ(ω) |
//!
//! Of an orthographic path, the direction of the first edge is what p_0 stands for, as for a sun at the other end: its
//! density is the coefficient of δ(ω), G is V|cos θ_1|, and the density of p_1 is |cos θ_1|/A_film. Where on the film
//! such a path arrives follows from p_1, so it is no variable of its own; `position` of p_0 still says it, for rays and
//! rasters.

mod blades;
mod sensor;

#[cfg(test)]
mod tests;

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

pub use self::{
    blades::Blades,
    sensor::{Raster, Sensor},
};
use super::{
    geometry::Bounds,
    point::{Place, Point},
};
use crate::{
    lanes::{Float, Lanes, One, Vector},
    sampling::{PdfArea, PdfSolidAngle, warp},
};

/// A camera: its density is uniform over the padded film and, if it has one, over the lens.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// The pinhole, the middle of the lens, or the middle of the orthographic film.
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    sensor: Sensor,
    /// Side of a pixel on the film: at unit distance, or of an orthographic camera in metres.
    pixel: f32,
    projection: Projection,
}

/// What a camera makes of a direction in which it sees.
#[derive(Clone, Copy, Debug)]
pub struct Seen<L: Lanes = One> {
    /// Where the padded image shows it: see [`Raster`].
    pub raster: [L::F; 2],
    /// W_e without its filter h_j.
    ///
    /// 1/(A_px A_lens cos⁴ θ), 1/(m² sr), with the film at unit distance and θ the angle to the viewing direction
    /// (Veach 8.2); of a pinhole 1/(A_px cos⁴ θ), 1/sr, since δ(p_0) replaces 1/A_lens; orthographic 1/A_px, 1/m², with
    /// δ(ω).
    pub we: L::F,
    /// The density of a camera subpath's first direction, given p_0: uniform over the padded film, 1/(A_film cos³ θ).
    /// Of an orthographic camera 1/A_film, 1/m²: that of the ray's place, see [`PdfSolidAngle`].
    pub pdf: PdfSolidAngle<L::F>,
    /// Whether it does.
    pub some: L::M,
}

/// How the film sees the scene.
#[derive(Clone, Copy, Debug)]
enum Projection {
    /// Through one point.
    Pinhole,
    /// Through a disk of this radius, or a polygon of its area, sharp at the distance `focus` along the axis. Metres.
    ThinLens { radius: f32, focus: f32, blades: Option<Blades> },
    /// Along one direction.
    Orthographic,
}

/// The radius below which a lens is a pinhole, metres: W_e of a smaller one may leave what f32 can hold, and nothing
/// would look different.
const SMALLEST_LENS: f32 = 1e-9;

impl Camera {
    /// A pinhole camera at `position` that looks at `target`, with a vertical field of view of `yfov` radians over the
    /// (unpadded) image height. Pixels are square.
    ///
    /// # Panics
    /// If `position` equals `target`; if `up` is parallel to the viewing direction another one is chosen.
    pub fn look_at(position: Vec3, target: Vec3, up: Vec3, yfov: f32, sensor: Sensor) -> Self {
        let pixel = 2.0 * (0.5 * yfov).tan() / sensor.height as f32;
        Self::aimed(position, target, up, pixel, sensor, Projection::Pinhole)
    }

    /// An orthographic camera that looks from `position`, the middle of its film, towards `target`. The (unpadded) film
    /// is `height` metres high; pixels are square. What lies behind the film's plane is not seen.
    ///
    /// # Panics
    /// As [`Camera::look_at`].
    pub fn orthographic(position: Vec3, target: Vec3, up: Vec3, height: f32, sensor: Sensor) -> Self {
        Self::aimed(position, target, up, height / sensor.height as f32, sensor, Projection::Orthographic)
    }

    fn aimed(position: Vec3, target: Vec3, up: Vec3, pixel: f32, sensor: Sensor, projection: Projection) -> Self {
        assert!(position != target, "a camera cannot look at its own position");
        let forward = (target - position).normalize();
        let right = forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        let up = right.cross(forward);
        Self { position, right, up, forward, sensor, pixel, projection }
    }

    /// The same perspective camera with a thin lens of this diameter (`aperture`) around its pinhole, in focus at the
    /// distance `focus` along its axis; both in metres. With an aperture below two nanometres it is a pinhole.
    ///
    /// # Panics
    /// If `aperture` is negative or not finite, or `focus` is not positive; and on an orthographic camera.
    #[must_use]
    pub fn with_lens(self, aperture: f32, focus: f32) -> Self {
        assert!(!matches!(self.projection, Projection::Orthographic), "an orthographic camera has no lens");
        assert!(
            aperture >= 0.0 && aperture.is_finite() && focus > 0.0,
            "no lens: {aperture} m wide, focus at {focus} m"
        );
        let radius = 0.5 * aperture;
        let projection = if radius >= SMALLEST_LENS {
            Projection::ThinLens { radius, focus, blades: None }
        } else {
            Projection::Pinhole
        };
        Self { projection, ..self }
    }

    /// The same camera with these blades before its lens, if it has one.
    #[must_use]
    pub fn with_blades(self, blades: Option<Blades>) -> Self {
        match self.projection {
            Projection::ThinLens { radius, focus, .. } => {
                Self { projection: Projection::ThinLens { radius, focus, blades }, ..self }
            }
            Projection::Pinhole | Projection::Orthographic => self,
        }
    }

    /// The same camera with an image of another size: as much of the scene over its height, and over its width as the
    /// image's shape has it.
    #[must_use]
    pub fn with_sensor(self, sensor: Sensor) -> Self {
        Self { sensor, pixel: self.pixel * (self.sensor.height as f32 / sensor.height as f32), ..self }
    }

    /// Whether it sees along one direction.
    pub fn is_orthographic(&self) -> bool {
        matches!(self.projection, Projection::Orthographic)
    }

    /// The image that this camera looks through.
    pub fn sensor(&self) -> Sensor {
        self.sensor
    }

    /// How far `position` lies before the camera along its axis, metres.
    pub fn depth(&self, position: Vec3) -> f32 {
        (position - self.position).dot(self.forward)
    }

    /// The middle of the lens (or of the orthographic film) as a point of the scene: its normal is the viewing
    /// direction, its place the lens plane.
    #[inline(always)]
    pub fn lens_point(&self) -> Point {
        self.lens_at(self.position)
    }

    /// Whether p_0 varies for a given raster position, so that choosing it takes two random numbers.
    #[inline(always)]
    pub fn has_aperture(&self) -> bool {
        matches!(self.projection, Projection::ThinLens { .. })
    }

    /// p_0 of a camera subpath through `raster`, with the density [`Camera::pdf_lens`]. `u` chooses the point of the
    /// lens.
    #[inline(always)]
    pub fn sample_lens(&self, raster: Raster, u: Vec2) -> Point {
        match self.projection {
            Projection::Pinhole => self.lens_point(),
            Projection::ThinLens { radius, blades, .. } => self.on_lens(radius, blades, u),
            Projection::Orthographic => {
                let [x, y] = self.film(raster.0.to_array());
                self.lens_at(self.position + self.right * x - self.up * y)
            }
        }
    }

    /// p_0 from which `seen` is to be seen, with the density [`Camera::pdf_lens`]: what a path from the light side is
    /// connected to. An orthographic camera sees each point from one place alone, and nothing behind its film or at
    /// infinity (`None`: there, a path from the light arrives with the one right direction with probability zero).
    #[inline(always)]
    pub fn sample_lens_towards(&self, seen: &Point, u: Vec2) -> Option<Point> {
        match self.projection {
            Projection::Pinhole => Some(self.lens_point()),
            Projection::ThinLens { radius, blades, .. } => Some(self.on_lens(radius, blades, u)),
            Projection::Orthographic => {
                let depth = (seen.position - self.position).dot(self.forward);
                let before = depth > 0.0 && seen.place != Place::Infinite;
                before.then(|| self.lens_at(seen.position - self.forward * depth))
            }
        }
    }

    /// A box around every p_0 of a camera subpath.
    pub(super) fn lens_bounds(&self) -> Bounds {
        let reach = match self.projection {
            Projection::Pinhole => Vec3::ZERO,
            Projection::ThinLens { radius, blades, .. } => {
                radius * blades.map_or(1.0, Blades::reach) * (self.right.abs() + self.up.abs())
            }
            Projection::Orthographic => {
                let padded = self.sensor.size() + 2.0 * self.sensor.padding as f32;
                let half = 0.5 * self.pixel * padded;
                half.x * self.right.abs() + half.y * self.up.abs()
            }
        };
        Bounds { min: self.position - reach, max: self.position + reach }
    }

    fn on_lens(&self, radius: f32, blades: Option<Blades>, u: Vec2) -> Point {
        let q = match blades {
            Some(blades) => radius * blades.sample(u),
            None => radius * Vec2::from(warp::disk(u.to_array())),
        };
        self.lens_at(self.position + self.right * q.x + self.up * q.y)
    }

    #[inline(always)]
    fn lens_at(&self, position: Vec3) -> Point {
        Point {
            normal: self.forward,
            shading_normal: self.forward,
            place: match self.projection {
                Projection::Pinhole | Projection::ThinLens { .. } => Place::Surface,
                Projection::Orthographic => Place::Film,
            },
            ..Point::nowhere(position)
        }
    }

    /// The density of p_0: 1/A_lens, of a disk or a polygon (see [`Blades`]); 1 as the coefficient of a pinhole's
    /// δ(p_0) or of an orthographic camera's δ(ω).
    #[inline(always)]
    pub fn pdf_lens(&self) -> PdfArea {
        match self.projection {
            Projection::Pinhole | Projection::Orthographic => PdfArea(1.0),
            Projection::ThinLens { radius, .. } => PdfArea(1.0 / (PI * radius * radius)),
        }
    }

    /// The unit direction in which `raster` is seen from `lens`, a p_0 of this camera.
    #[inline(always)]
    pub fn direction(&self, lens: &Point, raster: Raster) -> Vec3 {
        self.direction_through(lens, raster.0.to_array())
    }

    /// [`Self::direction`] in any lanes.
    #[inline(always)]
    pub fn direction_through<L: Lanes, B>(&self, lens: &Point<L, B>, raster: [L::F; 2]) -> L::V {
        let lanes = lens.alpha.lanes();
        let axis = |axis: Vec3| lanes.splat_v(axis.to_array());
        let [x, y] = self.film(raster);
        let [x, y] = match self.projection {
            Projection::Pinhole => [x, y],
            // To the point of the focus plane that the middle of the lens would see.
            Projection::ThinLens { focus, .. } => {
                let [right, down] = self.offset(lens);
                let focus = lanes.splat(focus);
                [x - right / focus, y - down / focus]
            }
            Projection::Orthographic => return axis(self.forward),
        };
        (axis(self.forward) + axis(self.right) * x - axis(self.up) * y).normalize()
    }

    /// Where the padded image shows what `lens`, a p_0 of this camera, sees in the unit direction `w`, with W_e and the
    /// density of a walk that goes there; `None` outside it.
    #[inline(always)]
    pub fn look(&self, lens: &Point, w: Vec3) -> Option<Seen> {
        Some(self.look_in_lanes(lens, w)).filter(|seen| seen.some)
    }

    /// [`Self::look`] in any lanes: inside the image where [`Seen::some`] says so.
    #[inline(always)]
    pub fn look_in_lanes<L: Lanes, B>(&self, lens: &Point<L, B>, w: L::V) -> Seen<L> {
        let lanes = lens.alpha.lanes();
        let along = |axis: Vec3| w.dot(lanes.splat_v(axis.to_array()));
        let cos = along(self.forward);
        let [x, y] = match self.projection {
            Projection::Pinhole => [along(self.right) / cos, -along(self.up) / cos],
            // The middle of the lens sees a point of the focus plane at its place on the image, whoever looks there.
            Projection::ThinLens { focus, .. } => {
                let ([x, y], focus) = (self.offset(lens), lanes.splat(focus));
                [along(self.right) / cos + x / focus, -along(self.up) / cos + y / focus]
            }
            Projection::Orthographic => self.offset(lens),
        };
        let (side, size) = (lanes.splat(self.pixel), 0.5 * self.sensor.size());
        let raster = [x / side + lanes.splat(size.x), y / side + lanes.splat(size.y)];
        let pixel = 1.0 / (self.pixel * self.pixel);
        let film = pixel / self.sensor.padded_pixels() as f32;
        let over = |x: f32, y: L::F| lanes.splat(x) / y;
        let cos3 = cos * cos * cos;
        let cos4 = (cos * cos) * (cos * cos);
        let (we, pdf) = match self.projection {
            Projection::Pinhole => (over(pixel, cos4), over(film, cos3)),
            Projection::ThinLens { radius, .. } => (over(pixel, cos4 * (PI * radius * radius)), over(film, cos3)),
            Projection::Orthographic => (lanes.splat(pixel), lanes.splat(film)),
        };
        let some = lanes.splat(0.0).lt(cos) & self.sensor.holds(raster);
        Seen { raster, we, pdf: PdfSolidAngle(pdf), some }
    }

    /// [`Seen::raster`] alone.
    #[inline(always)]
    pub fn raster(&self, lens: &Point, w: Vec3) -> Option<Raster> {
        self.look(lens, w).map(|seen| Raster(seen.raster.into()))
    }

    /// [`Seen::we`] alone; zero outside the padded image.
    #[inline(always)]
    pub fn we(&self, lens: &Point, w: Vec3) -> f32 {
        self.look(lens, w).map_or(0.0, |seen| seen.we)
    }

    /// [`Seen::pdf`] alone; zero outside the padded image.
    #[inline(always)]
    pub fn pdf(&self, lens: &Point, w: Vec3) -> PdfSolidAngle {
        self.look(lens, w).map_or(PdfSolidAngle::ZERO, |seen| seen.pdf)
    }

    /// `raster` on the film, from its middle: x to the right, y downwards.
    #[inline(always)]
    fn film<F: Float>(&self, [x, y]: [F; 2]) -> [F; 2] {
        let (lanes, size) = (x.lanes(), 0.5 * self.sensor.size());
        [(x - lanes.splat(size.x)) * self.pixel, (y - lanes.splat(size.y)) * self.pixel]
    }

    /// Where on the lens (or on the orthographic film) p_0 lies, as [`Camera::film`] has it. Metres.
    #[inline(always)]
    fn offset<L: Lanes, B>(&self, lens: &Point<L, B>) -> [L::F; 2] {
        let axis = |axis: Vec3| lens.alpha.lanes().splat_v(axis.to_array());
        let d = lens.position - axis(self.position);
        [d.dot(axis(self.right)), -d.dot(axis(self.up))]
    }
}
