//! Colours and frames: the small mathematics everything above shares.

pub mod octahedral;
mod rgb;

use glam::Vec3;

pub use self::rgb::{Rgb, luminance};
use crate::lanes::{Float, Lanes, Vector};

/// An orthonormal right-handed basis around a unit normal, which is its third axis.
#[derive(Clone, Copy, Debug)]
pub struct Frame<V = Vec3> {
    s: V,
    t: V,
    n: V,
}

impl<V: Vector> Frame<V> {
    /// Builds a basis around the unit vector `n` without a branch on its direction
    /// (Duff et al. 2017, *Building an Orthonormal Basis, Revisited*).
    #[inline(always)]
    pub fn around(n: V) -> Self {
        let [x, y, z] = n.coordinates();
        let one = z.lanes().splat(1.0);
        let sign = one.copysign(z);
        let a = -(one / (sign + z));
        let b = x * y * a;
        Self { s: V::new(one + sign * x * x * a, sign * b, -(sign * x)), t: V::new(b, sign + y * y * a, -y), n }
    }

    /// The components of the world vector `v` in this basis.
    #[inline(always)]
    pub fn to_local(&self, v: V) -> V {
        V::new(self.s.dot(v), self.t.dot(v), self.n.dot(v))
    }

    /// The world vector with components `v` in this basis.
    #[inline(always)]
    pub fn to_world(&self, v: V) -> V {
        let [x, y, z] = v.coordinates();
        self.s * x + self.t * y + self.n * z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for n in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.6, -0.64, 0.48), Vec3::new(-0.01, 0.02, -0.9997).normalize()]
        {
            let f = Frame::around(n);
            assert!((f.s.cross(f.t) - n).length() < 1e-5, "{n}");
            let v = Vec3::new(0.3, -2.0, 1.1);
            assert!((f.to_world(f.to_local(v)) - v).length() < 1e-5);
        }
    }
}
