//! Batches of rays meet what single rays do.

use super::*;
#[cfg(target_arch = "x86_64")]
use crate::lanes::Eight;
use crate::{
    lanes::{Arrays, Lanes},
    scene::geometry::{
        bvh::{LargestFirst, NearestFirst},
        packet::Met,
        parted::Parting,
    },
};

impl Met {
    fn hit(&self, k: usize) -> Option<Hit> {
        let primitive = PrimitiveId { instance: self.instance[k], index: self.index[k] };
        let barycentric = Vec2::new(self.areas[0][k], self.areas[1][k]) / self.areas[2][k];
        (self.any >> k & 1 == 1).then_some(Hit { t: self.limit[k], primitive, barycentric })
    }
}

/// Packets of a set of lanes, whose rays go on alone where no more than `few` enter a node.
fn packets<L: Lanes>(g: &Geometry, lanes: L, parting: Parting, rays: &Rays) -> (Vec<Option<Hit>>, Vec<bool>) {
    let (mut hits, mut found) = (Vec::new(), Vec::new());
    g.packets::<NearestFirst, _>(lanes, parting, rays.columns(), |_, n, met| hits.extend((0..n).map(|k| met.hit(k))));
    g.packets::<LargestFirst, _>(lanes, parting, rays.columns(), |_, n, met| {
        found.extend((0..n).map(|k| met.any >> k & 1 == 1));
    });
    (hits, found)
}

/// A bundle: `n` rays that differ little, or not at all, from one, in their places and directions.
fn bundle(ray: &Ray, n: usize, r: &mut StdRng) -> Vec<Ray> {
    let spread = [0.0, 1e-3, 0.3][r.random_range(0..3)];
    let near = |p: Vec3, r: &mut StdRng| if r.random() { p } else { p + spread * cube(r) };
    (0..n).map(|_| Ray { origin: near(ray.origin, r), direction: near(ray.direction, r), ..*ray }).collect()
}

#[test]
fn a_ray_meets_the_same_in_a_batch_and_alone() {
    let mut r = rng();
    let mut met = [0; 2];
    for case in 0..48 {
        let g = built_case(case, awkward_geometry(case, &mut r));
        let ids = ids(&g);
        let (mut single, mut batch) = (Vec::<(Ray, [PrimitiveId; 2])>::new(), Rays::default());
        while single.len() < 400 {
            let Some(ray) = awkward_ray(case, &mut r) else { continue };
            let n = r.random_range(1..40);
            for ray in bundle(&ray, n, &mut r) {
                let mut any = || if ids.is_empty() { PrimitiveId::NONE } else { ids[r.random_range(0..ids.len())] };
                single.push((ray, [any(), PrimitiveId::NONE]));
            }
        }
        // In two parts, neither of which fills its last packet.
        let (one, other) = single.split_at(101);
        for part in [one, other] {
            batch.extend(&part.iter().map(|(ray, _)| *ray).collect::<Vec<_>>(), |i| part[i].1);
        }
        let key = |h: Hit| (h.t, h.primitive, h.barycentric);
        let hits: Vec<_> = single.iter().map(|(ray, skip)| g.closest(ray, skip[0]).map(key)).collect();
        let found: Vec<_> = single.iter().map(|(ray, skip)| g.occluded(ray, *skip)).collect();
        met[0] += hits.iter().flatten().count();
        met[1] += found.iter().filter(|found| **found).count();
        let (mut own_hits, mut own_found) = (Hits::default(), Hits::default());
        g.closest_of_each(batch.columns(), &mut own_hits);
        g.obstacle_of_each(batch.columns(), &mut own_found);
        let scattered = [f32::INFINITY, 0.1][case / 4 % 2];
        let (few, many) = (Parting { few: case as u32 % 4, scattered }, [0, 2, 8, 16][case % 4]);
        let ways = [
            (own_hits.iter().collect(), own_found.iter().map(|hit| hit.is_some()).collect()),
            packets(&g, Arrays::<4>, few, &batch),
            packets(&g, Arrays::<16>, Parting { few: many, scattered }, &batch),
        ];
        #[cfg(target_arch = "x86_64")]
        let ways = ways.into_iter().chain(Eight::detect().map(|eight| packets(&g, eight, few, &batch)));
        for (way, (hits_in_batch, found_in_batch)) in ways.into_iter().enumerate() {
            let hits_in_batch: Vec<_> = hits_in_batch.into_iter().map(|hit| hit.map(key)).collect();
            for i in 0..single.len() {
                assert_eq!(hits_in_batch[i], hits[i], "case {case}, way {way}, {:?}", single[i]);
                assert_eq!(found_in_batch[i], found[i], "case {case}, way {way}, {:?}", single[i]);
            }
        }
        assert_eq!((batch.len(), own_hits.get(7).map(key)), (single.len(), hits[7]));
        batch.clear();
        assert!(batch.is_empty());
    }
    assert!(met[0] > 4000 && met[1] > 4000, "{met:?}");
}

#[test]
fn a_batch_passes_by_both_of_what_it_may_pass() {
    let at = |z: f32| [vec3(-1.0, -1.0, z), vec3(1.0, -1.0, z), vec3(0.0, 1.0, z)];
    let g = built(soup(&[at(1.0), at(2.0), at(3.0)]));
    let mut rays = Rays::default();
    let [a, b] = [0, 1].map(PrimitiveId::world);
    let skips = [[PrimitiveId::NONE; 2], [a, PrimitiveId::NONE], [PrimitiveId::NONE, a], [b, a], [a, b]];
    rays.extend(&[Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: 2.5 }; 5], |i| skips[i]);
    let (mut hits, mut obstacles) = (Hits::default(), Hits::default());
    g.closest_of_each(rays.columns(), &mut hits);
    g.obstacle_of_each(rays.columns(), &mut obstacles);
    let found: Vec<_> = obstacles.iter().map(|hit| hit.is_some()).collect();
    assert_eq!(
        hits.iter().map(|hit| hit.map(|h| h.t)).collect::<Vec<_>>(),
        [Some(1.0), Some(2.0), Some(2.0), None, None]
    );
    assert_eq!(found, [true, true, true, false, false]);
    // Nothing to hit, and nothing to trace.
    let mut empty = Geometry::default();
    empty.build();
    empty.closest_of_each(rays.columns(), &mut hits);
    empty.obstacle_of_each(rays.columns(), &mut obstacles);
    assert!(hits.iter().count() == 5 && hits.iter().chain(obstacles.iter()).all(|hit| hit.is_none()));
    g.closest_of_each(Rays::default().columns(), &mut hits);
    assert_eq!(hits.iter().count(), 0);
}
