//! Ray origins that have left their surface.

use crate::lanes::{Float, Lanes, Select, Vector};

/// Moves a ray's origin off the surface it lies on, to the side into which `direction` points.
///
/// `position` is a point of the surface with rounding error at most `error` in each coordinate, and `normal` its
/// geometric unit normal ([`super::Surface`]). The error moves a point off its tangent plane by at most
/// `error`·(|nₓ| + |n_y| + |n_z|); the origin goes that far along the normal, and then a float further in each
/// coordinate, since the addition rounds too (Pharr, Jakob & Humphreys, *Physically Based Rendering*, 6.8.6). A ray
/// from there does not meet the surface it leaves, at any scale. Offset both ends of a connection.
#[inline(always)]
pub fn offset_origin<V: Vector>(position: V, normal: V, error: V::F, direction: V) -> V {
    let [a, b, c] = normal.abs().coordinates();
    let distance = error * (a + b + c);
    let offset = normal * distance.copysign(normal.dot(direction));
    let ([x, y, z], [along_x, along_y, along_z]) = ((position + offset).coordinates(), offset.coordinates());
    V::new(away(x, along_x), away(y, along_y), away(z, along_z))
}

/// A float or two further from where `moved` was `offset` ago: ε|p| is at least the distance to the next float, and the
/// smallest number of all where p is 0.
#[inline(always)]
fn away<F: Float>(moved: F, offset: F) -> F {
    let lanes = moved.lanes();
    let step = moved.abs() * f32::EPSILON + lanes.splat(f32::MIN_POSITIVE);
    offset.eq(lanes.splat(0.0)).select(moved, moved + step.copysign(offset))
}
