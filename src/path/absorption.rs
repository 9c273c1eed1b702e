//! What media take away along an edge, as fast as walks and connections need it.

use crate::{
    math::Rgb,
    scene::{
        Scene,
        bsdf::Transport,
        media::MediumId,
        point::{Place, Point},
    },
};

use super::{Edge, Step};

/// exp(−σ_a d) along the edge from `a`, the camera's end, to `b`, in the medium into which `a` sees it leave: of a
/// connection.
#[inline(never)]
pub(super) fn connecting_transmittance(scene: &Scene, a: &Point, ab: &Edge, b: &Point) -> Rgb {
    transmittance(scene, a, ab, b, Transport::Radiance, a.medium_towards(ab.direction))
}

/// exp(−σ_a d) along the edge by which a walk has come through `medium`.
pub(super) fn walked_transmittance(
    scene: &Scene,
    from: &Step,
    here: &Step,
    walked: Transport,
    medium: MediumId,
) -> Rgb {
    transmittance(scene, &from.vertex.point, &here.back.reversed(), &here.vertex.point, walked, medium)
}

/// exp(−σ_a d) along the edge from `a` to `b`: the part of the light that `medium`, in which the edge lies, lets pass,
/// or the local volume in its place. For that the end nearer the camera is asked first, whichever way the edge was
/// found.
fn transmittance(scene: &Scene, a: &Point, ab: &Edge, b: &Point, walked: Transport, medium: MediumId) -> Rgb {
    let absorption = match walked {
        Transport::Radiance => scene.absorption(a, ab.direction, b, medium),
        Transport::Importance => scene.absorption(b, -ab.direction, a, medium),
    };
    if absorption == Rgb::ZERO {
        return Rgb::ONE;
    }
    let distance = match (a.place, b.place) {
        (Place::Infinite, _) | (_, Place::Infinite) => f32::INFINITY,
        (Place::Film, _) | (_, Place::Film) => a.position.distance(b.position),
        _ => ab.distance_squared.sqrt(),
    };
    // A channel that is not absorbed stays whole at any distance, also where 0·∞ would be no number.
    absorption.map(|s| if s == 0.0 { 1.0 } else { (-s * distance).exp() })
}
