//! Shading normals that tilt: the map between the directions over N_g, where light travels, and those over N_s, where a
//! BSDF is defined.
//!
//! Interpolated normals and normal textures turn N_s away from N_g. Half of the wedge between their two horizons lies
//! above the surface but behind N_s, the other half the other way round. Where f is 0 in the wedge, silhouettes of
//! coarse meshes turn black, and a mirror under a steep normal map sends its light into the surface. So the sphere of
//! directions is bent near the horizons, and only there: each direction ω over N_g has its direction ω_s over N_s, one
//! to one,
//!
//! ```text
//! f̂(ω_c, ω_l) = f_s(ω_c_s, ω_l_s) |ω_l_s·N_s| / |ω_l·N_g| · dω_l_s/dω_l.
//! ```
//!
//! Then ∫ f̂ |ω_l·N_g| dω_l is the albedo of f_s, whatever the tilt: nothing is lost, and a furnace stays what it is
//! under a flat normal. The map knows the two normals alone, neither camera nor light, so that f̂ is the same for every
//! strategy, and it is odd, (−ω)_s = −ω_s, so that what passes straight through a surface still does.
//!
//! **The map.** Let θ be the angle from N_s to N_g, and a(ω) the longitude about the axis N_s × N_g, counted from N_s
//! towards N_g. The latitude stays, so that dω_s/dω = da_s/da. The horizons are a_s = ±90° and a = θ ± 90°. Within m =
//! min(3θ, 90°) of N_s's horizon a shear along the direction a_0 = ±(90° − m) takes one horizon to the other:
//!
//! ```text
//! cot(a − a_0) = cot(a_s − a_0) + const,     da_s/da = sin²(a_s − a_0)/sin²(a − a_0).
//! ```
//!
//! Everywhere else ω_s = ω. The derivative is continuous where the two meet (a shear fixes its axis to first order).

use super::{bsdf::Scatter, point::Point};
use crate::{
    lanes::{Float, Lanes, Mask, One, Select, Vector, Work},
    sampling::PdfSolidAngle,
};

/// The map between directions over N_g and over N_s at a point, in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Tilt<L: Lanes = One> {
    n_s: L::V,
    n_g: L::V,
    /// cos θ.
    cos: L::F,
    /// sin θ cot m: directions with |ω·N_g − cos θ ω·N_s| at most this times |ω·N_s| stay.
    reach: L::F,
    /// Where N_s is N_g: every direction stays.
    is_flat: L::M,
}

/// A direction where the map takes it, in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Tilted<L: Lanes = One> {
    /// Unit.
    pub direction: L::V,
    /// dω_s/dω there, whichever of the two was given; positive.
    pub jacobian: L::F,
    /// ω_s·N_s and ω·N_g. Where N_s is N_g they are one number, which may be 0: there 1 stands for both, so that their
    /// ratio is 1.
    cos_shading: L::F,
    cos_surface: L::F,
}

impl<L: Lanes> Tilted<L> {
    /// Whether ω over N_g and ω_s over N_s lie on the same side, as they do short of rounding at the horizons. Where
    /// they do not, f̂ = 0: the one place that says so.
    #[inline(always)]
    pub fn keeps_side(&self) -> L::M {
        self.cos_surface.lanes().splat(0.0).lt(self.cos_shading * self.cos_surface)
    }

    /// f̂/f_s for this as the light direction: |ω_s·N_s| / |ω·N_g| · dω_s/dω; of a delta lobe, whose coefficients are
    /// with respect to dω, the cosines alone.
    #[inline(always)]
    pub fn factor(&self, is_delta: L::M) -> L::F {
        let cosines = (self.cos_shading / self.cos_surface).abs();
        is_delta.select(cosines, cosines * self.jacobian)
    }
}

/// Which way a direction goes.
#[derive(Clone, Copy)]
enum To {
    Shading,
    Surface,
}

impl<L: Lanes> Tilt<L> {
    /// The map at a point.
    #[inline(always)]
    pub fn at<B>(p: &Point<L, B>) -> Self {
        // Zeros may differ in sign where N_s is N_g, and a frame around them would as well.
        let is_flat = p.is_flat();
        Self::between(is_flat.select(p.normal, p.shading_normal), p.normal, is_flat)
    }

    /// The map between these unit normals, which are one where it `is_flat`.
    #[inline(always)]
    pub fn between(n_s: L::V, n_g: L::V, is_flat: L::M) -> Self {
        let cos = n_s.dot(n_g);
        let lanes = cos.lanes();
        let (square, three) = (cos * 4.0 * cos, lanes.splat(3.0));
        // sin θ cot 3θ; from 30° on m is 90°.
        let below_30 = cos * (square - three) / (square - lanes.splat(1.0));
        let reach = three.lt(square).select(below_30, lanes.splat(0.0));
        Self { n_s, n_g, cos, reach, is_flat }
    }

    /// N_s, as the BSDF has it.
    #[inline(always)]
    pub fn shading_normal(&self) -> L::V {
        self.n_s
    }

    /// ω_s of the unit direction `w`.
    #[inline(always)]
    pub fn to_shading(&self, w: L::V) -> Tilted<L> {
        self.map(w, To::Shading)
    }

    /// The unit direction whose ω_s is `w`.
    #[inline(always)]
    pub fn to_surface(&self, w: L::V) -> Tilted<L> {
        self.map(w, To::Surface)
    }

    #[inline(always)]
    fn map(&self, w: L::V, to: To) -> Tilted<L> {
        let (cos_s, cos_g) = (self.n_s.dot(w), self.n_g.dot(w));
        let one = cos_s.lanes().splat(1.0);
        let unmoved = Tilted {
            direction: w,
            jacobian: one,
            cos_shading: self.is_flat.select(one, cos_s),
            cos_surface: self.is_flat.select(one, cos_g),
        };
        let stays = self.is_flat | (cos_g - self.cos * cos_s).abs().le(self.reach * cos_s.abs());
        if (!stays).any() {
            cos_s.lanes().call(Bend { tilt: self, which: !stays, unmoved: &unmoved, to })
        } else {
            unmoved
        }
    }

    /// The densities of f_s as densities over N_g; f stays. Those of a delta lobe are coefficients with respect to dω
    /// on the light side.
    #[inline(always)]
    pub fn densities(is_delta: L::M, scatter: Scatter<L>, to_camera: &Tilted<L>, to_light: &Tilted<L>) -> Scatter<L> {
        let (camera, light) = (to_camera.jacobian, to_light.jacobian);
        let one = camera.lanes().splat(1.0);
        Scatter {
            to_light: PdfSolidAngle(scatter.to_light.0 * is_delta.select(one, light)),
            to_camera: PdfSolidAngle(scatter.to_camera.0 * is_delta.select(camera / light, camera)),
            ..scatter
        }
    }
}

/// The shear, in the plane of the two normals, of what is `unmoved` in the lanes `which`: a function of its own, for
/// few directions are that near the horizons.
struct Bend<'a, L: Lanes> {
    tilt: &'a Tilt<L>,
    which: L::M,
    unmoved: &'a Tilted<L>,
    to: To,
}

impl<L: Lanes> Work for Bend<'_, L> {
    type Output = Tilted<L>;

    #[inline(always)]
    fn work(self) -> Tilted<L> {
        let Self { tilt: &Tilt { n_s, n_g, cos, .. }, which, unmoved, to } = self;
        let &Tilted { direction: w, cos_shading: y, cos_surface: cos_g, .. } = unmoved;
        let lanes = cos.lanes();
        let (zero, one, two, three) = (lanes.splat(0.0), lanes.splat(1.0), lanes.splat(2.0), lanes.splat(3.0));
        // The part of N_g across N_s, without the cancellation in N_g − cos θ N_s.
        let between = n_g - n_s;
        let across = between - n_s * between.dot(n_s);
        let sin = across.dot(across).sqrt();
        // Not if there is less between them than directions tell apart.
        let which = which & !sin.lt(lanes.splat(1e-6));
        let across = across / sin;
        let x = w.dot(across);
        // The horizon of the quarter in which the direction lies, before or after: N_s's at a_s = 90° (1) or −90° (−1).
        let side = match to {
            To::Shading => cos_g,
            To::Surface => y,
        };
        let horizon = one.copysign(x) * one.copysign(side);
        let below_30 = three.lt(cos * 4.0 * cos);
        let twice = sin * 4.0 * cos * (one - sin * 2.0 * sin);
        let shifted = zero.lt(horizon).select(twice, two * sin * cos);
        let sin_m = below_30.select(sin * (three - sin * 4.0 * sin), one);
        let cos_m = below_30.select(cos * (cos * 4.0 * cos - three), zero);
        let sin_shifted = below_30.select(shifted, cos);
        // The distance from the shear's axis, and how far along it the direction moves.
        let distance = x * sin_m - horizon * y * cos_m;
        let shift = -sin / (sin_shifted * sin_m) * distance;
        let shift = match to {
            To::Shading => -shift,
            To::Surface => shift,
        };
        let (sheared_x, sheared_y) = (x + shift * horizon * cos_m, y + shift * sin_m);
        let (before, after) = (x * x + y * y, sheared_x * sheared_x + sheared_y * sheared_y);
        let stretch = before / after;
        // Not along the axis, where longitudes meet.
        let which = which & zero.lt(stretch) & stretch.lt(lanes.splat(f32::INFINITY));
        let scale = stretch.sqrt();
        let moved = w + across * (sheared_x * scale - x) + n_s * (sheared_y * scale - y);
        let jacobian = match to {
            To::Shading => stretch,
            To::Surface => one / stretch,
        };
        let direction = moved.normalize();
        let (cos_shading, cos_surface) = match to {
            To::Shading => (n_s.dot(direction), cos_g),
            To::Surface => (y, n_g.dot(direction)),
        };
        Tilted {
            direction: which.select(direction, w),
            jacobian: which.select(jacobian, one),
            cos_shading: which.select(cos_shading, y),
            cos_surface: which.select(cos_surface, cos_g),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use glam::Vec3;

    use super::*;

    /// N_s = z and N_g in the x-z plane, turned by `theta`, in degrees.
    fn tilt(theta: f32) -> Tilt {
        let (sin, cos) = theta.to_radians().sin_cos();
        Tilt::at(&Point { normal: Vec3::new(sin, 0.0, cos), ..Point::nowhere(Vec3::ZERO) })
    }

    const ANGLES: [f32; 9] = [0.01, 1.0, 5.0, 15.0, 29.0, 31.0, 45.0, 70.0, 86.0];

    /// Fibonacci's lattice over the sphere.
    fn sphere(n: u32) -> impl Iterator<Item = Vec3> {
        (0..n).map(move |i| {
            let (z, phi) = (1.0 - (2.0 * i as f32 + 1.0) / n as f32, 0.618_034 * i as f32 % 1.0 * TAU);
            ((1.0 - z * z).sqrt() * Vec3::new(phi.cos(), phi.sin(), 0.0)).with_z(z)
        })
    }

    #[test]
    fn the_map_is_one_to_one_odd_and_takes_one_side_to_the_other() {
        for theta in ANGLES {
            let tilt = tilt(theta);
            for w in sphere(5000) {
                let s = tilt.to_shading(w);
                let back = tilt.to_surface(s.direction);
                let precision = 3e-6 * s.jacobian.max(1.0 / s.jacobian);
                assert!(back.direction.distance(w) < precision, "{theta}° {w} {s:?} {back:?}");
                assert!((back.jacobian / s.jacobian - 1.0).abs() < 200.0 * precision, "{theta}° {w} {s:?} {back:?}");
                assert!((tilt.to_shading(-w).direction + s.direction).length() < 1e-6, "{theta}° {w}");
                if tilt.n_g.dot(w).abs() > 1e-5 {
                    assert!(s.keeps_side(), "{theta}° {w} {s:?}");
                }
            }
        }
    }

    #[test]
    fn the_jacobian_is_that_of_solid_angles() {
        for theta in ANGLES.into_iter().filter(|theta| (1.0..75.0).contains(theta)) {
            let (tilt, mut worst) = (tilt(theta), 0.0_f32);
            let n = 20_000;
            // ∫ dω_s/dω dω over the upper half is 2π, and everywhere the ratio of small areas.
            let mut whole = 0.0;
            for w in sphere(n) {
                let s = tilt.to_shading(w);
                if tilt.n_g.dot(w) > 0.0 {
                    whole += s.jacobian * 2.0 / n as f32;
                }
                let h = 2e-3;
                let (a, b) = w.any_orthonormal_pair();
                let at = |d: Vec3| tilt.to_shading((w + d).normalize()).direction;
                let area = (at(a * h) - at(-a * h)).cross(at(b * h) - at(-b * h)).length() / (4.0 * h * h);
                // Away from the kinks.
                if tilt.n_g.dot(w).abs() > 0.1 && w.x.abs() > 0.1 {
                    worst = worst.max((area / s.jacobian - 1.0).abs());
                }
            }
            assert!((whole - 1.0).abs() < 0.02, "{theta}°: {whole}");
            assert!(worst < 0.02, "{theta}°: {worst}");
        }
    }

    #[test]
    fn far_from_the_horizons_nothing_moves() {
        for theta in [1.0, 5.0, 15.0] {
            let (tilt, limit) = (tilt(theta), (3.1 * theta).to_radians().sin());
            for w in sphere(2000).filter(|w| w.z.abs() > limit && tilt.n_g.dot(*w).abs() > limit) {
                assert_eq!((tilt.to_shading(w).direction, tilt.to_shading(w).jacobian), (w, 1.0));
            }
        }
    }
}
