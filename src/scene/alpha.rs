//! How much of a surface is there: by its material, and by what coincides with it.

use glam::Vec3;

use super::{
    geometry::{Geometry, Hit, PrimitiveId},
    material::Material,
};

/// The part of the place that the coincident surfaces of a lower rank leave to `primitive`: the product of their 1 − α.
#[inline(never)]
pub(super) fn left_by_others(
    geometry: &Geometry,
    materials: &[Material],
    primitive: PrimitiveId,
    position: Vec3,
) -> f32 {
    let mut left = 1.0;
    if !geometry.may_be_hidden_at(primitive, position) {
        return left;
    }
    let rank = geometry.rank(primitive);
    geometry.coincident_at(primitive, position, |hit| {
        if geometry.rank(hit.primitive) < rank {
            left *= 1.0 - alpha(geometry, materials, &hit);
        }
    });
    left
}

/// α in [0, 1] of the material where a ray hits, whatever coincides there.
#[inline]
pub(super) fn alpha(geometry: &Geometry, materials: &[Material], hit: &Hit) -> f32 {
    let material = &materials[geometry.material(hit.primitive).0 as usize];
    material.alpha(|| geometry.attributes(hit.primitive, hit.barycentric))
}
