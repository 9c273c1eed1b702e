//! Spot lights: points that shine into a cone.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use crate::{
    math::{Frame, Rgb},
    sampling::PdfSolidAngle,
};

/// A spot with the falloff of `KHR_lights_punctual`. Never seen directly.
///
/// With θ the angle from the axis, the intensity is I·a(θ)², where a falls linearly in cos θ from 1 at the inner angle
/// to 0 at the outer one: a = clamp(cos θ · s + o, 0, 1), s = 1/max(0.001, cos θ_inner − cos θ_outer), o = −s cos
/// θ_outer. Where the extension's 0.001 takes effect, the light is full only inside of the inner angle; a cone narrower
/// than 2.6° nowhere.
///
/// Angles are kept as 1 − cos θ = |ω − axis|²/2, in which a narrow cone has digits left.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    position: Vec3,
    axis: Vec3,
    intensity: Rgb,
    /// 1 − cos θ_outer.
    outer: f32,
    /// 1 − cos θ up to which a = 1; zero if that is nowhere.
    full: f32,
    /// s.
    scale: f32,
    /// ∫ a² dω, sr.
    integral: f32,
    /// The part of that integral in which a < 1.
    ramp_share: f32,
}

impl Spot {
    /// A spot at `position` that shines along the unit vector `axis` with `intensity`, W/sr or candela.
    /// The half angles are in radians.
    ///
    /// # Panics
    /// Unless 0 ≤ `inner` ≤ `outer` ≤ π/2 and `outer` > 0.
    pub fn new(position: Vec3, axis: Vec3, intensity: Rgb, inner: f32, outer: f32) -> Self {
        let right_angle = std::f32::consts::FRAC_PI_2;
        assert!(
            0.0 <= inner && inner <= outer && outer > 0.0 && outer <= right_angle,
            "a cone from {inner} to {outer}"
        );
        let below_one = |angle: f32| 2.0 * (0.5 * f64::from(angle)).sin().powi(2);
        let (inner, outer) = (below_one(inner), below_one(outer));
        let width = (outer - inner).max(1e-3);
        let scale = width.recip();
        // The ramp's part inside of the cone: a narrow one ends before a reaches 1.
        let ramp = width.min(outer);
        let full = outer - ramp;
        let ramp_integral = scale * scale * ramp.powi(3) / 3.0;
        Self {
            position,
            axis,
            intensity,
            outer: outer as f32,
            full: full as f32,
            scale: scale as f32,
            integral: TAU * (ramp_integral + full) as f32,
            ramp_share: (ramp_integral / (ramp_integral + full)) as f32,
        }
    }

    /// Where it is.
    #[inline]
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// The unit vector along which it shines.
    pub fn axis(&self) -> Vec3 {
        self.axis
    }

    /// The angles from the axis up to which a = 1, and from which it is 0, in radians.
    pub fn half_angles(&self) -> (f32, f32) {
        let angle = |below_one: f32| 2.0 * (0.5 * below_one).sqrt().min(1.0).asin();
        (angle(self.full), angle(self.outer))
    }

    /// Intensity that a(θ) scales, W/sr or candela.
    pub fn intensity(&self) -> Rgb {
        self.intensity
    }

    /// ∫ a² dω: the emitted power for an intensity of 1, sr.
    pub fn solid_angle(&self) -> f32 {
        self.integral
    }

    /// The intensity in the unit direction `w`, W/sr or candela.
    #[inline]
    pub fn intensity_towards(&self, w: Vec3) -> Rgb {
        self.intensity * self.attenuation(w)
    }

    /// The density of [`Spot::sample`], in proportion to the intensity: positive exactly where that is.
    #[inline]
    pub fn pdf(&self, w: Vec3) -> PdfSolidAngle {
        PdfSolidAngle(self.attenuation(w) / self.integral)
    }

    /// A unit direction with density a²/∫a² dω, by inversion of the integral over 1 − cos θ.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let below_one = if u.x < self.ramp_share {
            self.outer - (self.outer - self.full) * (u.x / self.ramp_share).cbrt()
        } else {
            self.full * (u.x - self.ramp_share) / (1.0 - self.ramp_share)
        };
        let sin = (below_one * (2.0 - below_one)).max(0.0).sqrt();
        let (y, x) = (TAU * u.y).sin_cos();
        Frame::around(self.axis).to_world(Vec3::new(sin * x, sin * y, 1.0 - below_one))
    }

    /// a².
    #[inline]
    fn attenuation(&self, w: Vec3) -> f32 {
        let below_one = 0.5 * (w - self.axis).length_squared();
        let a = ((self.outer - below_one) * self.scale).clamp(0.0, 1.0);
        a * a
    }
}
