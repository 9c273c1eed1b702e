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
    /// point's coordinates: computed in f64, rounded once, with room for the rounding of a segment that ends there.
    pub fn point(&self, towards: DVec3) -> (Vec3, Vec3, f32) {
        let n = towards.try_normalize().unwrap_or(DVec3::Z);
        let p = (self.center.as_dvec3() + f64::from(self.radius) * n).as_vec3();
        (p, n.as_vec3(), 2.0 * f32::EPSILON * p.abs().max_element())
    }

    /// Where the ray meets the sphere at t > 0, from outside and from inside, in this order.
    ///
    /// The quadratic is solved in f64, with the discriminant from the distance of the line to the centre and the
    /// roots without cancellation (Haines et al. 2019, *Ray Tracing Gems*, chapter 7).
    #[inline]
    pub fn intersect(&self, ray: &Prepared) -> [Option<f32>; 2] {
        let (d, r) = (ray.direction.as_dvec3(), f64::from(self.radius));
        let f = ray.origin.as_dvec3() - self.center.as_dvec3();
        let a = d.length_squared();
        let b = -f.dot(d);
        let discriminant = a * (r * r - (f + (b / a) * d).length_squared());
        if discriminant.is_nan() || discriminant < 0.0 {
            return [None; 2];
        }
        let c = (f.length() - r) * (f.length() + r);
        let q = b + discriminant.sqrt().copysign(b);
        let (s, t) = (c / q, q / a);
        let range = ray.clip(self.bounds());
        if range.near > range.far {
            return [None; 2];
        }
        // A ray that starts on the sphere has a root at 0, which does not count.
        [s.min(t), s.max(t)].map(|t| (t > 0.0).then(|| range.clamp(t)).filter(|&t| t > 0.0))
    }
}
