//! Unit vectors in 32 bits: the octahedron's faces unfolded into a square (Cigolle et al. 2014, *A Survey of Efficient
//! Representations for Independent Unit Vectors*).

use glam::{Vec2, Vec3};

const STEPS: f32 = 32767.0;

/// Packs a unit vector; [`unpack`] returns it to within 10⁻⁴.
#[inline]
pub fn pack(v: Vec3) -> u32 {
    let p = v / (v.x.abs() + v.y.abs() + v.z.abs());
    let p = if p.z < 0.0 { folded(p.truncate()) } else { p.truncate() };
    let [x, y] = (p * STEPS).round().to_array().map(|x| u32::from(x as i16 as u16));
    y << 16 | x
}

/// The unit vector that [`pack`] has packed.
#[inline]
pub fn unpack(packed: u32) -> Vec3 {
    let [x, y] = [packed, packed >> 16].map(|half| f32::from(half as u16 as i16) / STEPS);
    let p = Vec2::new(x, y);
    let z = 1.0 - p.x.abs() - p.y.abs();
    let p = if z < 0.0 { folded(p) } else { p };
    p.extend(z).normalize()
}

/// The lower faces lie outside of the upper ones' diamond.
#[inline]
fn folded(p: Vec2) -> Vec2 {
    (1.0 - Vec2::new(p.y, p.x).abs()) * Vec2::ONE.copysign(p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::warp;

    #[test]
    fn vectors_come_back() {
        for i in 0..40 {
            for k in 0..40 {
                let v = warp::sphere(Vec2::new((i as f32 + 0.5) / 40.0, k as f32 / 40.0));
                assert!(unpack(pack(v)).distance(v) < 1e-4, "{v}");
            }
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!([unpack(pack(axis)), unpack(pack(-axis))], [axis, -axis]);
        }
    }
}
