//! What the walks of a wave are in: carried from vertex to vertex for one lane after the other.

use super::{Stage, queue::Walk};
use crate::{
    lanes::{Float, Lanes, MOST, Mask, Unsigned, Vector},
    math::Rgb,
    scene::{
        bsdf::{Bsdf, Bsdfs, Diffuse},
        media::Inside,
        point::Point,
    },
};

/// How what transmits at `point`, to which the walks of the lanes `which` come, scatters between the media beside it.
#[inline(always)]
pub(super) fn come_to_bodies<L: Lanes>(
    Stage { lanes, scene, .. }: Stage<'_, L>,
    walk: &Walk<L>,
    which: L::M,
    point: &Point<L, Bsdfs<L>>,
    inside: &mut [Inside],
) -> Bsdfs<L> {
    let Some(media) = scene.media() else { return point.bsdf };
    let leaves = lanes.splat(0.0).lt(point.normal.dot(walk.departure.direction)).bits();
    let (number, bsdf) = (walk.number.all(), point.bsdf.all(lanes));
    let mut bsdfs = [Bsdf::Diffuse(Diffuse { albedo: Rgb::ZERO }); MOST];
    for k in which.lanes() {
        bsdfs[k] = bsdf(k);
        let (inside, material) = (&mut inside[number[k] as usize], L::lane(&point.material, k));
        inside.arrive_alone(media, &mut bsdfs[k], material, leaves >> k & 1 == 1);
    }
    Bsdfs::new(lanes, which, |k| &bsdfs[k])
}

/// Takes the walks of the lanes `through` to the other side of their surface.
#[inline(always)]
pub(super) fn go_through<L: Lanes>(walk: &Walk<L>, through: L::M, inside: &mut [Inside]) {
    let number = walk.number.all();
    for k in through.lanes() {
        inside[number[k] as usize].go_through();
    }
}
