//! Placed meshes against the same triangles transformed one by one, in f64 where rounding matters.

use glam::{DQuat, DVec3, vec3};

use super::*;

/// Placements of every kind: rotated, mirrored, stretched, sheared, tiny, huge, far away, and far away in their own
/// space.
fn placements() -> Vec<(&'static str, DAffine3)> {
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.1);
    let srt = |s: DVec3, t: DVec3| DAffine3::from_scale_rotation_translation(s, turn, t);
    let shear = DMat3::from_cols(DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.7, 1.0, -0.3), DVec3::new(0.0, 0.4, 0.8));
    vec![
        ("rotated", srt(DVec3::ONE, DVec3::new(1.0, -2.0, 3.0))),
        ("mirrored", srt(DVec3::new(-1.0, 1.0, 1.0), DVec3::ZERO)),
        ("stretched", srt(DVec3::new(0.1, 3.0, 1.0), DVec3::new(0.3, 0.0, 0.0))),
        ("stretched and mirrored", srt(DVec3::new(2.0, -20.0, 1.0), DVec3::ONE)),
        ("sheared", DAffine3::from_mat3_translation(shear, DVec3::new(5.0, 5.0, 5.0))),
        ("tiny", srt(DVec3::splat(1e-4), DVec3::new(1e-4, 2e-4, 0.0))),
        ("huge", srt(DVec3::splat(1e6), DVec3::splat(-1e6))),
        ("far away", srt(DVec3::ONE, DVec3::new(1e5, -1e5, 1e4))),
        // A mesh that was modelled a thousand of its sizes away from its origin, and brought back.
        ("brought back", srt(DVec3::ONE, DVec3::ZERO) * DAffine3::from_translation(DVec3::splat(-1000.0))),
    ]
}

fn model(center: Vec3, levels: u32) -> (Mesh, Vec<Vec3>, Vec<Vec3>, Vec<[u32; 3]>) {
    let (p, t) = icosphere(levels, center, 1.0);
    let n: Vec<Vec3> = p.iter().map(|&p| (p - center).normalize()).collect();
    let mut mesh = Mesh::default();
    mesh.add_triangles(&p, Some(&n), &t, M);
    (mesh, p, n, t)
}

fn center(name: &str) -> Vec3 {
    if name == "brought back" { Vec3::splat(1000.0) } else { Vec3::ZERO }
}

/// The model as an instance, and as triangles in world space as a reader places them.
fn both(name: &str, to_world: DAffine3) -> (Geometry, Geometry) {
    let (mesh, p, n, t) = model(center(name), 3);
    let mut instanced = Geometry::default();
    let id = instanced.add_mesh(mesh);
    instanced.add_instance(id, Placement::new(to_world).expect("usable"));
    let mut flat = Geometry::default();
    let p: Vec<Vec3> = p.iter().map(|p| to_world.transform_point3(p.as_dvec3()).as_vec3()).collect();
    let normals = to_world.matrix3.inverse().transpose();
    let n: Vec<Vec3> = n.iter().map(|n| (normals * n.as_dvec3()).normalize().as_vec3()).collect();
    let mirrored = to_world.matrix3.determinant() < 0.0;
    let t: Vec<[u32; 3]> = t.iter().map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }).collect();
    flat.add_triangles(&p, Some(&n), &t, M);
    (built(instanced), built(flat))
}

#[test]
fn an_instance_is_what_its_flattened_triangles_are() {
    let mut r = rng();
    for (name, to_world) in placements() {
        let (instanced, flat) = both(name, to_world);
        let middle = to_world.transform_point3(center(name).as_dvec3());
        let b = instanced.bounds().expect("not empty");
        let tight = flat.bounds().expect("not empty");
        assert!(b.min.cmple(tight.min).all() && b.max.cmpge(tight.max).all(), "{name}");
        assert_eq!((instanced.triangle_count(), instanced.world_len()), (flat.triangle_count(), 0));
        // What one rounding of a vertex moves a point, which is what the flattened mesh is off by.
        let grain = 4.0 * f32::EPSILON * b.min.abs().max(b.max.abs()).max_element();
        let (mut same, mut rays) = (0, 0);
        for _ in 0..4000 {
            let at = |v: Vec3| (middle + to_world.matrix3 * v.as_dvec3()).as_vec3();
            let (origin, target) = (at(3.0 * cube(&mut r)), at(0.8 * cube(&mut r)));
            let ray = ray(origin, (target - origin).normalize());
            let hits = (instanced.closest(&ray, PrimitiveId::NONE), flat.closest(&ray, PrimitiveId::NONE));
            let (Some(a), Some(b)) = hits else { continue };
            rays += 1;
            // Beside an edge the other triangle may be hit.
            if a.primitive.index() != b.primitive.index() {
                continue;
            }
            same += 1;
            let (a, b) = (instanced.surface(&ray, &a), flat.surface(&ray, &b));
            let cos = ray.direction.dot(b.normal).abs();
            let off = a.position.distance(b.position);
            let reach = ray.origin.distance(b.position);
            let allowed = (a.error + b.error + grain) * 4.0 / cos + 1e-5 * reach / cos;
            assert!(off <= allowed, "{name}: {off} of {allowed}");
            // Flattened normals suffer from the rounded vertices, most where triangles are small against their place,
            // and interpolated ones from rays that are rounded in the mesh's space.
            let size = tight.max.distance(tight.min);
            let turn = 60.0 * (grain + a.error) / size + 2e-5;
            assert!(a.normal.distance(b.normal) < 20.0 * turn, "{name}: {} {}", a.normal, b.normal);
            assert!(a.shading_normal.distance(b.shading_normal) < 20.0 * turn, "{name}");
            assert!(a.shading_normal.dot(a.normal) > 0.0, "{name}");
        }
        let neighbours = 0.02 + 2.0 * f64::from(grain / tight.max.distance(tight.min));
        assert!(rays > 2000 && f64::from(same) > (1.0 - neighbours) * f64::from(rays), "{name}: {same} of {rays}");
        for i in 0..20 {
            let (x, y) = (instanced.area(PrimitiveId::of(0, i)), flat.area(PrimitiveId::world(i)));
            let allowed = 1e-5 + 5.0 * grain / tight.max.distance(tight.min);
            assert!((x / y - 1.0).abs() < allowed, "{name}: {x} {y}");
        }
    }
}

#[test]
fn the_error_of_a_surface_covers_the_way_out_and_back() {
    let mut r = rng();
    for (name, to_world) in placements() {
        let (g, _) = both(name, to_world);
        let instance = g.instances[0];
        let mesh = &g.meshes[0].mesh;
        for _ in 0..20_000 {
            let index = r.random_range(0..mesh.len());
            let s = g.sample(PrimitiveId::of(0, index), square(&mut r));
            // Off the surface by hardly anything, then back into the mesh's space as a ray's origin goes.
            for side in [1.0, -1.0] {
                let direction = side * s.normal;
                let origin = offset_origin(s.position, s.normal, s.error, direction);
                let back = instance.object_ray(&Prepared::new(&ray(origin, direction)));
                let triangle = mesh.triangle(index);
                let corner = triangle.corners()[0].as_dvec3();
                let height = triangle.cross().normalize().dot(back.origin.as_dvec3() - corner);
                assert!(height * f64::from(side) > 0.0, "{name}: the origin is {height} m off, on the wrong side");
            }
        }
    }
}

#[test]
fn nothing_leaks_out_of_an_instance() {
    let mut r = rng();
    for (name, to_world) in placements() {
        let (mesh, p, _, t) = model(center(name), 3);
        let mut g = Geometry::default();
        let id = g.add_mesh(mesh);
        g.add_instance(id, Placement::new(to_world).expect("usable"));
        g.build();
        let world: Vec<Vec3> = p.iter().map(|p| to_world.transform_point3(p.as_dvec3()).as_vec3()).collect();
        let middle = to_world.transform_point3(center(name).as_dvec3());
        for i in 0..200_000 {
            let origin = (middle + to_world.matrix3 * (0.4 * cube(&mut r)).as_dvec3()).as_vec3();
            let [a, b, _] = t[r.random_range(0..t.len())].map(|i| world[i as usize]);
            let target = if i % 4 == 0 { a } else { a.lerp(b, r.random()) };
            let ray = ray(origin, target - origin);
            assert!(g.closest(&ray, PrimitiveId::NONE).is_some(), "{name}: {ray:?} leaks");
            assert!(g.occluded(&ray, [PrimitiveId::NONE; 2]), "{name}: {ray:?} leaks");
        }
    }
}

#[test]
fn samples_of_a_stretched_instance_are_uniform_in_world_area() {
    let mut mesh = Mesh::default();
    mesh.add_triangles(&[Vec3::ZERO, 3.0 * Vec3::X, vec3(1.0, 2.0, 0.0)], None, &[[0, 1, 2]], M);
    let mut g = Geometry::default();
    let id = g.add_mesh(mesh);
    // Area 3 in the mesh, stretched by 5 in one direction of its plane; the other instance is mirrored.
    for x in [1.0, -1.0] {
        let linear = DMat3::from_diagonal(DVec3::new(x, 5.0, 0.1));
        g.add_instance(id, Placement::new(DAffine3::from_mat3(linear)).expect("usable"));
    }
    g.build();
    let mut r = rng();
    for (n, front) in [(0, Vec3::Z), (1, Vec3::Z)] {
        let id = PrimitiveId::of(n, 0);
        assert!((g.area(id) - 15.0).abs() < 1e-5);
        let mut quarters = [0_u32; 4];
        for _ in 0..100_000 {
            let s = g.sample(id, square(&mut r));
            assert_eq!(s.normal, front, "a node that mirrors in x leaves what faced +z facing +z");
            let (x, y) = (s.position.x.abs(), s.position.y / 5.0);
            let b = Vec2::new((x - 0.5 * y) / 3.0, y / 2.0);
            let corner = if b.x > 0.5 {
                1
            } else if b.y > 0.5 {
                2
            } else {
                3 * usize::from(b.x + b.y >= 0.5)
            };
            quarters[corner] += 1;
        }
        // Chi² over 4 triangles of equal area: 3 degrees of freedom, p ≈ 1e-4.
        let chi2: f64 = quarters.iter().map(|&c| (f64::from(c) - 25_000.0).powi(2) / 25_000.0).sum();
        assert!(chi2 < 21.1, "{quarters:?}");
    }
}

#[test]
fn what_cannot_be_undone_is_no_placement() {
    let scale = |x: f64, y: f64, z: f64| Placement::new(DAffine3::from_scale(DVec3::new(x, y, z)));
    assert!(scale(1.0, -2.0, 0.5).is_some() && scale(1e-5, 1e-5, 1e-5).is_some());
    assert!(scale(1.0, 0.0, 1.0).is_none(), "flat");
    assert!(scale(1.0, 1e-5, 1.0).is_none(), "nearly flat");
    assert!(scale(1e9, 1e9, 1e9).is_none() && scale(1e-9, 1e-9, 1e-9).is_none());
    assert!(Placement::new(DAffine3::from_translation(DVec3::NAN)).is_none());
}

#[test]
fn lights_and_materials_of_instances() {
    let lamp = MaterialId(1);
    let mut mesh = Mesh::default();
    let p = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    mesh.add_triangles(&p, None, &[[0, 1, 2]], M);
    mesh.add_triangles(&p, None, &[[0, 0, 2], [0, 1, 3], [0, 2, 3]], lamp);
    let mut g = soup(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    let id = g.add_mesh(mesh);
    for x in [2.0, 4.0] {
        g.add_instance(id, Placement::new(DAffine3::from_translation(DVec3::X * x)).expect("usable"));
    }
    g.build();
    let picked: Vec<_> = g.with_material(&|m| m == lamp).collect();
    assert_eq!(picked, [(0, 2), (0, 3), (1, 2), (1, 3)].map(|(n, i)| PrimitiveId::of(n, i)));
    assert_eq!(ids(&g).iter().filter(|&&id| g.material(id) == lamp).count(), 6);
    assert_eq!((g.triangle_count(), g.world_len(), g.instance_count()), (9, 1, 2));
}
