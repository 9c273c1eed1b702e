//! Colours and frames: the small mathematics everything above shares.

mod rgb;

use glam::Vec3;

pub use self::rgb::{Rgb, luminance};

/// An orthonormal right-handed basis around a unit normal, which is its third axis.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    s: Vec3,
    t: Vec3,
    n: Vec3,
}

impl Frame {
    /// Builds a basis around the unit vector `n` without a branch on its direction
    /// (Duff et al. 2017, *Building an Orthonormal Basis, Revisited*).
    #[inline(always)]
    pub fn around(n: Vec3) -> Self {
        let sign = 1.0_f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// The components of the world vector `v` in this basis.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.s.dot(v), self.t.dot(v), self.n.dot(v))
    }

    /// The world vector with components `v` in this basis.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
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
