//! Rays that leave a surface.

use glam::{DQuat, DVec3, vec3};
use rand::rngs::StdRng;

use super::*;

/// Follows diffuse bounces inside; `near_edge` says where rounding may have put a point beyond another face.
fn bounce(g: &Geometry, start: Vec3, r: &mut StdRng, near_edge: impl Fn(&Surface) -> bool, self_hit: f32) {
    let (mut origin, mut skip, mut d) = (start, PrimitiveId::NONE, vec3(0.3, 0.5, 0.7));
    for i in 0..20_000 {
        let ray = ray(origin, d);
        let hit = g.closest(&ray, skip).unwrap_or_else(|| panic!("bounce {i} escaped from {origin} along {d}"));
        let s = g.surface(&ray, &hit);
        assert!(s.position.distance(origin) > self_hit || i == 0, "bounce {i} hit itself at {origin} along {d}");
        if near_edge(&s) {
            (origin, skip, d) = (start, PrimitiveId::NONE, cube(r));
            continue;
        }
        let side = -d.dot(s.normal).signum() * s.normal;
        // Some as grazing as f32 directions go.
        let mut local = warp::cosine_hemisphere(square(r).to_array());
        if i % 3 == 0 {
            local.z *= 1e-4;
        }
        d = Frame::around(side).to_world(local.normalize());
        if d.dot(side) <= 0.0 {
            d = side;
        }
        origin = offset_origin(s.position, s.normal, s.error, d);
        skip = hit.primitive;
    }
}

#[test]
fn bounces_inside_a_box_neither_escape_nor_hit_their_own_wall() {
    let mut r = rng();
    for (size, center) in
        [(1e-4, Vec3::ZERO), (1.0, Vec3::ZERO), (1e6, Vec3::ZERO), (10.0, vec3(1e4, -1e4, 1e4)), (1e-4, Vec3::ONE)]
    {
        let corner = |i: u32| center + size * (2.0 * vec3((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) - 1.0);
        let p: Vec<Vec3> = (0..8).map(corner).collect();
        let quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let t: Vec<_> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mut g = Geometry::default();
        g.add_triangles(&p, None, &t, M);
        g.build();
        let near_edge = |s: &Surface| {
            let margin = 8.0 * s.error + 1e-3 * size;
            (0..3).filter(|&k| (s.position[k] - p[0][k]).abs().min((s.position[k] - p[7][k]).abs()) < margin).count()
                > 1
        };
        bounce(&g, center, &mut r, near_edge, 1e-5 * size);
    }
}

#[test]
fn bounces_inside_a_sphere_neither_escape_nor_hit_themselves() {
    let mut r = rng();
    for (radius, center) in
        [(1e-4, Vec3::ZERO), (1.0, Vec3::ZERO), (1e6, Vec3::ZERO), (10.0, vec3(1e4, -1e4, 1e4)), (1e-4, Vec3::ONE)]
    {
        let mut g = Geometry::default();
        g.add_sphere(center, radius, M);
        g.build();
        bounce(&g, center, &mut r, |_| false, 1e-6 * radius);
    }
}

#[test]
fn rays_that_leave_a_sphere_do_not_meet_it_again() {
    let mut r = rng();
    for (radius, center) in
        [(1e-4, Vec3::ZERO), (1.0, Vec3::ZERO), (1e6, Vec3::ZERO), (1.0, vec3(1e4, -1e4, 1e4)), (1e-2, Vec3::ONE)]
    {
        let mut g = Geometry::default();
        g.add_sphere(center, radius, M);
        g.build();
        for i in 0..20_000 {
            let s = g.sample(PrimitiveId::world(0), square(&mut r));
            let mut local = warp::cosine_hemisphere(square(&mut r).to_array());
            local.z *= [1.0, 1e-2, 1e-4, 1e-6][i % 4];
            let out = Frame::around(s.normal).to_world(local.normalize());
            if out.dot(s.normal) <= 0.0 {
                continue;
            }
            let from = |d| ray(offset_origin(s.position, s.normal, s.error, d), d);
            assert!(!g.occluded(&from(out), [PrimitiveId::NONE; 2]), "reflected at {s:?} along {out}");
            // Transmitted: the far side and nothing else; then out of it.
            let inner = from(out - 2.0 * out.dot(s.normal) * s.normal);
            if inner.direction.dot(s.normal) < 0.0 {
                let hit = g.closest(&inner, PrimitiveId::world(0)).expect("the far side");
                let far = g.surface(&inner, &hit);
                let again = ray(offset_origin(far.position, far.normal, far.error, far.normal), far.normal);
                assert!(g.closest(&again, PrimitiveId::NONE).is_none());
            }
        }
    }
}

/// A sphere of flat triangles as the world's own or as an instance, around `center` and of this size.
fn ball(size: f32, center: Vec3, instanced: bool) -> Geometry {
    let mut g = Geometry::default();
    if instanced {
        let (p, t) = icosphere(3, Vec3::ZERO, 1.0);
        let mut mesh = Mesh::default();
        mesh.add_triangles(&p, None, &t, M);
        let mesh = g.add_mesh(mesh);
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::splat(size.into()),
            DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0),
            center.as_dvec3(),
        );
        g.add_instance(mesh, Placement::new(place).expect("usable"));
    } else {
        let (p, t) = icosphere(3, center, size);
        g.add_triangles(&p, None, &t, M);
    }
    built(g)
}

/// Light from everywhere outside reaches every point of a convex mesh: no acne, with a sun or a lamp near or far.
#[test]
fn a_convex_mesh_does_not_shadow_itself() {
    let mut r = rng();
    let places = [
        (1e-4, Vec3::ZERO),
        (1.0, Vec3::ZERO),
        (1e6, Vec3::ZERO),
        (1.0, vec3(1e3, -2e3, 3e3)),
        (10.0, vec3(1e6, 1e6, -1e6)),
        (1e-4, vec3(10.0, -10.0, 10.0)),
    ];
    for (size, center) in places {
        for instanced in [false, true] {
            let g = ball(size, center, instanced);
            let ids = ids(&g);
            let mut tested = 0;
            for i in 0..40_000 {
                let id = ids[r.random_range(0..ids.len())];
                let s = g.sample(id, square(&mut r));
                let out = Frame::around(s.normal).to_world(warp::cosine_hemisphere(square(&mut r).to_array()));
                if s.normal.dot(out) < 1e-3 {
                    continue;
                }
                let origin = offset_origin(s.position, s.normal, s.error, out);
                let lamp = s.position + out * size * [0.1, 1.0, 30.0, 3000.0][i % 4];
                let sun = ray(origin, out);
                assert!(!g.occluded(&sun, [id, PrimitiveId::NONE]), "{size} {center} {instanced}: sun at {s:?}");
                let from_lamp = Ray::between(lamp, origin);
                // A lamp within the offset of the surface, or one whose coordinates are too coarse for its direction,
                // says nothing.
                let to_lamp = lamp - s.position;
                if s.normal.dot(to_lamp) < (8.0 * s.error).max(1e-2 * to_lamp.length()) {
                    continue;
                }
                tested += 1;
                assert!(
                    !g.occluded(&from_lamp, [PrimitiveId::NONE, id]),
                    "{size} {center} {instanced}: lamp {lamp} at {s:?}"
                );
            }
            assert!(tested > 20_000, "{size} {center}: {tested}");
        }
    }
}
