//! Surfaces, areas and samples.

use glam::vec3;

use super::*;

#[test]
fn samples_are_uniform_in_area() {
    let mut g = soup(&[[Vec3::ZERO, 3.0 * Vec3::X, vec3(1.0, 2.0, 0.0)]]);
    g.add_sphere(vec3(1.0, 2.0, 3.0), 2.0, MaterialId(7));
    g.build();
    let (flat, round) = (PrimitiveId::world(0), PrimitiveId::world(1));
    assert!((g.area(flat) - 3.0).abs() < 1e-6 && (g.area(round) - 50.265_48).abs() < 1e-4);
    assert_eq!((g.material(flat), g.material(round), g.world_len()), (M, MaterialId(7), 2));
    let mut r = rng();
    let n = 100_000;
    // Chi² over 4 triangles of equal area, and over 8 octants; 3 and 7 degrees of freedom, p ≈ 1e-4.
    let (mut quarters, mut octants) = ([0_u32; 4], [0_u32; 8]);
    for _ in 0..n {
        let s = g.sample(flat, square(&mut r));
        assert_eq!(s.normal, Vec3::Z);
        let b = Vec2::new((s.position.x - 0.5 * s.position.y) / 3.0, s.position.y / 2.0);
        assert!(b.x > -1e-6 && b.y > -1e-6 && b.x + b.y < 1.0 + 1e-6);
        let corner = if b.x > 0.5 {
            1
        } else if b.y > 0.5 {
            2
        } else {
            3 * usize::from(b.x + b.y >= 0.5)
        };
        quarters[corner] += 1;
        let s = g.sample(round, square(&mut r));
        let v = s.position - vec3(1.0, 2.0, 3.0);
        assert!((v.length() - 2.0).abs() < 1e-6 && v.normalize().dot(s.normal) > 0.999_999);
        octants[usize::from(v.x > 0.0) + 2 * usize::from(v.y > 0.0) + 4 * usize::from(v.z > 0.0)] += 1;
    }
    let chi2 = |counts: &[u32]| {
        let e = f64::from(n) / counts.len() as f64;
        counts.iter().map(|&c| (f64::from(c) - e).powi(2) / e).sum::<f64>()
    };
    assert!(chi2(&quarters) < 21.1 && chi2(&octants) < 29.9, "{quarters:?} {octants:?}");
}

#[test]
fn shading_normals_are_interpolated_and_on_the_side_of_the_winding() {
    let p = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let surface = |n: [Vec3; 3]| {
        let mut g = Geometry::default();
        g.add_triangles(&p, Some(&n), &[[0, 1, 2]], M);
        g.build();
        let ray = ray(vec3(0.25, 0.25, 1.0), -Vec3::Z);
        g.surface(&ray, &g.closest(&ray, PrimitiveId::NONE).expect("hit"))
    };
    let n = [vec3(0.0, 0.0, 1.0), vec3(0.6, 0.0, 0.8), vec3(0.0, 0.6, 0.8)];
    let expected = (0.5 * n[0] + 0.25 * n[1] + 0.25 * n[2]).normalize();
    let s = surface(n);
    assert!(s.normal == Vec3::Z && s.shading_normal.distance(expected) < 1e-6);
    assert_eq!(surface(n.map(|n| -n)).shading_normal, s.shading_normal);
    assert_eq!(surface([Vec3::ZERO; 3]).shading_normal, Vec3::Z);
    assert!(s.error > 0.0 && s.error < 1e-6);
}
