//! Analytic spheres.

use glam::{DVec3, Vec3};

use super::{Bounds, ray::Prepared};

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sphere {
    pub center: Vec3,
    pub radius: f32,
}

impl Sphere {
    /// A box that contains the sphere, rounding included.
    pub fn bounds(&self) -> Bounds {
        let map = |p: Vec3, f: fn(f32) -> f32| Vec3::from_array(p.to_array().map(f));
        Bounds {
            min: map(self.center - self.radius, f32::next_down),
            max: map(self.center + self.radius, f32::next_up),
        }
    }

    /// The area, m².
    pub fn area(&self) -> f32 {
        4.0 * std::f32::consts::PI * self.radius * self.radius
    }

    /// The point in the given direction from the centre, the unit normal there, and a bound on the rounding of the
    /// point's coordinates: computed in f64, rounded once.
    pub fn point(&self, towards: DVec3) -> (Vec3, Vec3, f32) {
        let n = towards.try_normalize().unwrap_or(DVec3::Z);
        let p = (self.center.as_dvec3() + f64::from(self.radius) * n).as_vec3();
        (p, n.as_vec3(), f32::EPSILON * p.abs().max_element())
    }

    /// The first t in 0 < t < `t_max` where the ray meets the sphere, from outside or inside.
    ///
    /// The quadratic is solved in f64, with the discriminant from the distance of the line to the centre and the
    /// roots without cancellation (Haines et al. 2019, *Ray Tracing Gems*, chapter 7).
    #[inline]
    pub fn intersect(&self, ray: &Prepared) -> Option<f32> {
        let (d, r) = (ray.direction.as_dvec3(), f64::from(self.radius));
        let f = ray.origin.as_dvec3() - self.center.as_dvec3();
        let a = d.length_squared();
        let b = -f.dot(d);
        let discriminant = a * (r * r - (f + (b / a) * d).length_squared());
        if discriminant.is_nan() || discriminant < 0.0 {
            return None;
        }
        let c = (f.length() - r) * (f.length() + r);
        let q = b + discriminant.sqrt().copysign(b);
        let (s, t) = (c / q, q / a);
        let range = ray.clip(self.bounds());
        if range.near > range.far {
            return None;
        }
        // The smaller positive root. A ray that starts on the sphere has a root at 0, which does not count.
        let root = [s.min(t), s.max(t)].into_iter().find(|&t| t > 0.0)?;
        let t = range.clamp(root);
        (t > 0.0).then_some(t)
    }
}
