//! Unit vectors in 32 bits: the octahedron's faces unfolded into a square (Cigolle et al. 2014, *A Survey of Efficient
//! Representations for Independent Unit Vectors*).

use crate::lanes::{Float, Lanes, Select, Unsigned, Vector};

const STEPS: f32 = 32767.0;
/// From here to twice as much the bits of a number below its ulp of 1 are none.
const WHOLE: f32 = 8_388_608.0;

/// Packs a unit vector in each lane; [`unpack`] returns it to within 10⁻⁴.
#[inline(always)]
pub fn pack<V: Vector>(v: V) -> <V::Lanes as Lanes>::U {
    let [x, y, z] = v.coordinates();
    let lanes = x.lanes();
    let sum = x.abs() + y.abs() + z.abs();
    let [x, y] = unfolded([x / sum, y / sum], z);
    let whole = lanes.splat(WHOLE + STEPS);
    let (x, y) = ((x * STEPS + whole).to_bits(), (y * STEPS + whole).to_bits());
    y << 16 | x & lanes.splat_u(0xffff)
}

/// The unit vectors that [`pack`] has packed.
#[inline(always)]
pub fn unpack<U: Unsigned>(packed: U) -> <U::Lanes as Lanes>::V {
    let lanes = packed.lanes();
    let (half, one) = (lanes.splat_u(0xffff), lanes.splat(1.0));
    let (low, high) = ((packed & half).to_f32(), (packed >> 16).to_f32());
    let steps = lanes.splat(STEPS);
    let (x, y) = ((low - steps) / steps, (high - steps) / steps);
    let z = one - x.abs() - y.abs();
    let [x, y] = unfolded([x, y], z);
    <U::Lanes as Lanes>::V::new(x, y, z).normalize()
}

/// The lower faces, where z < 0, lie outside of the upper ones' diamond.
#[inline(always)]
fn unfolded<F: Float>([x, y]: [F; 2], z: F) -> [F; 2] {
    let lanes = z.lanes();
    let (one, lower) = (lanes.splat(1.0), z.lt(lanes.splat(0.0)));
    let outside = [(one - y.abs()).copysign(x), (one - x.abs()).copysign(y)];
    [lower.select(outside[0], x), lower.select(outside[1], y)]
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

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
