//! Ray origins that have left their surface.

use glam::Vec3;

/// Moves a ray's origin off the surface it lies on, to the side into which `direction` points.
///
/// `position` is a point of the surface with rounding error at most `error` in each coordinate, and `normal` its
/// geometric unit normal ([`super::Surface`]). The error moves a point off its tangent plane by at most
/// `error`·(|nₓ| + |n_y| + |n_z|); the origin goes that far along the normal, and then a float further in each
/// coordinate, since the addition rounds too (Pharr, Jakob & Humphreys, *Physically Based Rendering*, 6.8.6). A ray
/// from there does not meet the surface it leaves, at any scale. Offset both ends of a connection.
#[inline(always)]
pub fn offset_origin(position: Vec3, normal: Vec3, error: f32, direction: Vec3) -> Vec3 {
    let distance = error * normal.abs().element_sum();
    let offset = normal * distance.copysign(normal.dot(direction));
    let moved = position + offset;
    // One float or two: ε|p| is at least the distance to the next, and the smallest number of all where p is 0.
    let step = moved.abs() * f32::EPSILON + f32::MIN_POSITIVE;
    let away = |p: f32, step: f32, o: f32| if o == 0.0 { p } else { p + step.copysign(o) };
    Vec3::new(away(moved.x, step.x, offset.x), away(moved.y, step.y, offset.y), away(moved.z, step.z, offset.z))
}
