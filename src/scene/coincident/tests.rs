use glam::{DMat3, DQuat, DVec2, DVec3, Quat, Vec2, Vec3};
use rand::{RngExt, SeedableRng, rngs::StdRng};

use crate::{
    math::Rgb,
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::{BuildEffort, Geometry, Mesh, Placement, PrimitiveId, Ray},
        material::{AlphaMode, BackFaces, Material, MaterialId},
        point::Point,
    },
};

const OPAQUE: u32 = 0;
const LAMP: u32 = 1;
const VEIL: u32 = 2;
const PANE: u32 = 3;
const GLASS: u32 = 4;

fn scene_of(g: Geometry) -> Scene {
    let materials = vec![
        Material::diffuse("opaque", Rgb::splat(0.5)),
        Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::ONE),
        Material::diffuse("veil", Rgb::ONE).covering(AlphaMode::Blend { factor: 0.5 }),
        Material::pane("pane", 1.5),
        Material::glass("glass", 1.5),
    ];
    let sensor = Sensor { width: 1, height: 1, padding: 0 };
    Scene::new(g, materials, &[], Camera::look_at(Vec3::ZERO, Vec3::Z, Vec3::Y, 1.0, sensor))
}

/// A plane that f32 has no exact points of.
struct Tilted {
    turn: DMat3,
    origin: DVec3,
    scale: f64,
}

impl Tilted {
    fn new(r: &mut StdRng) -> Self {
        let axis = DVec3::new(r.random(), r.random(), r.random()) - 0.5;
        let turn = DMat3::from_quat(DQuat::from_axis_angle(axis.normalize(), r.random::<f64>() * 6.0));
        let scale = 10_f64.powi(r.random_range(-2..4));
        Self { turn, origin: scale * (DVec3::new(r.random(), r.random(), r.random()) * 4.0 - 2.0), scale }
    }

    fn place(&self, p: DVec2, height: f64) -> DVec3 {
        self.origin + self.turn * (self.scale * p.extend(height))
    }
}

/// Whether the triangle contains p: `None` where that is less than clear.
fn contains(corners: [DVec2; 3], p: DVec2) -> Option<bool> {
    let [a, b, c] = corners;
    let turned = (b - a).perp_dot(c - a).signum();
    let side = |p: DVec2, q: DVec2, x: DVec2| turned * (q - p).normalize().perp_dot(x - p);
    let inside = side(a, b, p).min(side(b, c, p)).min(side(c, a, p));
    (inside.abs() > 1e-4).then_some(inside > 0.0)
}

/// Cards in one plane: triangles of a material each.
struct Cards {
    plane: Tilted,
    /// Their corners in the plane, and their materials.
    each: Vec<([DVec2; 3], u32)>,
}

fn in_square(r: &mut StdRng) -> DVec2 {
    DVec2::new(r.random(), r.random()) * 2.0 - 1.0
}

impl Cards {
    /// Twelve cards, all opaque in every second case, and the scene of them.
    fn dealt(case: usize, r: &mut StdRng) -> (Self, Scene) {
        let plane = Tilted::new(r);
        let mut g = Geometry::default();
        let mut each = Vec::new();
        while each.len() < 12 {
            let corners = [in_square(r), in_square(r), in_square(r)];
            if (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]).abs() > 0.3 {
                let material =
                    if case.is_multiple_of(2) { OPAQUE } else { [OPAQUE, LAMP, VEIL, PANE][r.random_range(0..4)] };
                let placed = corners.map(|p| plane.place(p, 0.0).as_vec3());
                g.add_triangles(&placed, None, &[[0, 1, 2]], MaterialId(material));
                each.push((corners, material));
            }
        }
        g.set_effort(BuildEffort::ALL[case % 3 % 2]);
        (Self { plane, each }, scene_of(g))
    }

    fn is_veil(&self, id: u32) -> bool {
        self.each[id as usize].1 == VEIL
    }

    /// The cards at p in the order of their ranks, with how much of each is there; `None` at an edge.
    fn there(&self, p: DVec2) -> Option<Vec<(u32, f32)>> {
        let mut here = Vec::new();
        for (id, &(corners, material)) in (0..).zip(&self.each) {
            if contains(corners, p)? {
                here.push(((material != LAMP, material == PANE), id));
            }
        }
        here.sort_unstable();
        let mut left = 1.0;
        let share = |&(_, id): &(_, u32)| {
            let alpha = if self.is_veil(id) { 0.5 } else { 1.0 };
            let share = left * alpha;
            left -= share;
            (id, share)
        };
        Some(here.iter().map(share).collect())
    }

    /// Holds a ray from `from` to the cards at p to what is `there`, and what is left of the point that it meets;
    /// returns which card stops it. The ray passes the first veil.
    fn expect_stop(&self, scene: &Scene, from: Vec3, p: DVec2, there: &[(u32, f32)]) -> Option<u32> {
        let w = (self.plane.place(p, 0.0) - from.as_dvec3()).normalize().as_vec3();
        let mut depth = 0;
        let stopped = scene.trace_ray(from, w, PrimitiveId::NONE, |_| {
            depth += 1;
            depth > 1
        });
        let mut veils = 0;
        let mut stops = |id: u32| {
            let veil = self.is_veil(id);
            veils += u32::from(veil);
            !veil || veils > 1
        };
        let expected = there.iter().map(|(id, _)| *id).find(|id| stops(*id));
        assert_eq!(stopped.hit.map(|hit| hit.primitive.index()), expected, "{there:?}");
        if let Some(hit) = stopped.hit {
            let q = scene.point_at(&stopped.ray, &hit);
            let share = there.iter().find(|(id, _)| *id == hit.primitive.index()).map(|(_, share)| *share);
            assert_eq!(Some(q.alpha), share);
            // Leaving to either side, it meets nothing of the plane again.
            let again = scene.trace_ray(q.ray_origin(-w), -w, q.primitive, |_| true);
            assert!(again.hit.is_none() && again.visibility == 1.0, "{:?}", again.hit);
            assert_eq!(scene.visible(&q, &Point::nowhere(from)), 1.0);
            assert_eq!(scene.visible(&Point::nowhere(from), &q), 1.0);
        }
        expected
    }

    /// Holds a segment from `from` through all cards at p to what is `there`; returns how much passes.
    fn expect_passage(&self, scene: &Scene, from: Vec3, p: DVec2, there: &[(u32, f32)]) -> f32 {
        let beyond = Point::nowhere((2.0 * self.plane.place(p, 0.0) - from.as_dvec3()).as_vec3());
        let passes = 1.0 - there.iter().map(|(_, share)| share).sum::<f32>();
        assert_eq!(scene.visible(&Point::nowhere(from), &beyond), passes);
        passes
    }

    /// Holds a sampled point of a card, whether it is there or not, to what is there; returns how much of it is.
    fn expect_sample(&self, scene: &Scene, id: u32, r: &mut StdRng) -> Option<f32> {
        let plane = &self.plane;
        let q = scene.point_on(PrimitiveId::world(id), Vec2::new(r.random(), r.random()));
        let local = plane.turn.transpose() * (q.position.as_dvec3() - plane.origin) / plane.scale;
        let there = self.there(local.truncate())?;
        let (_, share) = *there.iter().find(|(other, _)| *other == id)?;
        assert_eq!(q.alpha, share, "card {id}: {there:?}");
        let above = Point::nowhere(plane.place(local.truncate(), 1.0).as_vec3());
        assert_eq!(scene.visible(&q, &above), if share > 0.0 { 1.0 } else { 0.0 });
        Some(share)
    }
}

/// The rule, asked of every triangle in two dimensions and in f64: what rays from either side stop on, what is left of
/// sampled points, and what sees what.
#[test]
fn what_is_there_is_what_asking_every_surface_finds() {
    let mut r = StdRng::seed_from_u64(3);
    let (mut met, mut hidden, mut passed) = (0, 0, 0);
    for case in 0..60 {
        let (cards, scene) = Cards::dealt(case, &mut r);
        assert!(scene.geometry().has_coincident(), "case {case}");
        for _ in 0..300 {
            let p = in_square(&mut r);
            let Some(there) = cards.there(p) else { continue };
            // From both sides, and never along the plane.
            let from = cards.plane.place(in_square(&mut r), [0.3, -0.3, 2.0, -2.0][r.random_range(0..4)]).as_vec3();
            met += u32::from(cards.expect_stop(&scene, from, p, &there).is_some());
            let passes = cards.expect_passage(&scene, from, p, &there);
            passed += u32::from(passes > 0.0 && passes < 1.0);
        }
        for id in 0..12 {
            for _ in 0..20 {
                hidden += u32::from(cards.expect_sample(&scene, id, &mut r) == Some(0.0));
            }
        }
    }
    assert!(met > 3000 && hidden > 1000 && passed > 50, "{met} {hidden} {passed}");
}

/// Two squares of a material each, the second shifted by `gap` along the normal; ids in that order.
fn pair(materials: [u32; 2], gap: f32) -> Geometry {
    let mut g = Geometry::default();
    let turn = Quat::from_rotation_x(0.7) * Quat::from_rotation_y(0.3);
    for (i, material) in materials.into_iter().enumerate() {
        let size = 1.0 - 0.3 * i as f32;
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| {
            turn * (size * Vec3::new(x, y, 0.0) + Vec3::new(0.1, 0.2, gap * i as f32)) + Vec3::new(0.3, 1.7, -0.9)
        });
        g.add_triangles(&corners, None, &[[0, 1, 2], [0, 2, 3]], MaterialId(material));
    }
    g
}

fn first_along_normal(scene: &Scene) -> u32 {
    let target = scene.point_on(PrimitiveId::world(2), Vec2::splat(0.3));
    let from = Point::nowhere(target.position + target.normal);
    scene.trace(&from, -target.normal).expect("a card").material.0
}

#[test]
fn an_emitter_comes_first_and_what_transmits_last() {
    for (materials, expected) in [
        ([OPAQUE, LAMP], LAMP),
        ([LAMP, OPAQUE], LAMP),
        ([PANE, OPAQUE], OPAQUE),
        ([OPAQUE, GLASS], OPAQUE),
        ([GLASS, OPAQUE], OPAQUE),
        ([GLASS, LAMP], LAMP),
        ([PANE, GLASS], PANE),
    ] {
        let scene = scene_of(pair(materials, 0.0));
        assert!(scene.geometry().has_coincident(), "{materials:?}");
        assert_eq!(first_along_normal(&scene), expected, "{materials:?}");
    }
    // The boundaries of two volumes stay.
    assert!(!scene_of(pair([GLASS, GLASS], 0.0)).geometry().has_coincident());
}

#[test]
fn what_is_further_apart_than_its_error_does_not_coincide() {
    assert!(scene_of(pair([OPAQUE, LAMP], 2e-7)).geometry().has_coincident());
    assert!(!scene_of(pair([OPAQUE, LAMP], 1e-4)).geometry().has_coincident());
    let mut g = Geometry::default();
    // A tessellated plane and a cube: triangles that touch.
    let turn = Quat::from_rotation_x(0.7) * Quat::from_rotation_y(0.3);
    let grid: Vec<Vec3> = (0..400).map(|i| turn * Vec3::new((i % 20) as f32, (i / 20) as f32, 0.0) * 0.37).collect();
    let cells = (0..361).map(|i| i / 19 * 20 + i % 19).flat_map(|i| [[i, i + 1, i + 21], [i, i + 21, i + 20]]);
    g.add_triangles(&grid, None, &cells.collect::<Vec<_>>(), MaterialId(OPAQUE));
    let cube: Vec<Vec3> =
        (0..8).map(|i| turn * Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32 + 0.5)).collect();
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let sides = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    g.add_triangles(&cube, None, &sides.collect::<Vec<_>>(), MaterialId(OPAQUE));
    assert!(!scene_of(g).geometry().has_coincident());
    // Rough ground: neighbours at a vertex that are nearly parallel.
    let mut r = StdRng::seed_from_u64(5);
    let rough: Vec<Vec3> =
        (0..400).map(|i| Vec3::new((i % 20) as f32, (i / 20) as f32, 0.5 * r.random::<f32>())).collect();
    let mut g = Geometry::default();
    let cells = (0..361).map(|i| i / 19 * 20 + i % 19).flat_map(|i| [[i, i + 1, i + 20], [i + 1, i + 21, i + 20]]);
    g.add_triangles(&rough, None, &cells.collect::<Vec<_>>(), MaterialId(OPAQUE));
    assert!(!scene_of(g).geometry().has_coincident());
}

/// Flush faces of instances, of instances and the world, and within a mesh.
#[test]
fn instances_that_touch_coincide() {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.3);
    let square = |size: f32| [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| size * Vec3::new(x, y, 0.0));
    let mesh_of = |material: u32| {
        let mut mesh = Mesh::default();
        mesh.add_triangles(&square(1.0), None, &[[0, 1, 2], [0, 2, 3]], MaterialId(material));
        mesh
    };
    let place = |p: DVec3, scale: f64| {
        let m = glam::DAffine3::from_scale_rotation_translation(DVec3::splat(scale), turn, DVec3::new(0.3, 5.0, -2.0));
        Placement::new(m * glam::DAffine3::from_translation(p)).expect("usable")
    };
    let trace = |scene: &Scene, w: f64| {
        let at = |z: f64| DVec3::new(0.3, 5.0, -2.0) + turn * DVec3::new(0.11, 0.23, z);
        let d = (at(-w) - at(w)).normalize().as_vec3();
        scene.trace(&Point::nowhere(at(w).as_vec3()), d).expect("a card")
    };
    let mut g = Geometry::default();
    let [opaque, lamp] = [OPAQUE, LAMP].map(|m| g.add_mesh(mesh_of(m)));
    g.add_instance(opaque, place(DVec3::ZERO, 1.0));
    g.add_instance(lamp, place(DVec3::new(0.2, 0.1, 0.0), 0.7));
    let scene = scene_of(g);
    assert!([1.0, -1.0].map(|w| trace(&scene, w).material.0) == [LAMP; 2]);

    let mut g = Geometry::default();
    let corners = square(0.5).map(|p| (DVec3::new(0.3, 5.0, -2.0) + turn * p.as_dvec3()).as_vec3());
    let lamp = g.add_mesh(mesh_of(LAMP));
    g.add_triangles(&corners, None, &[[0, 1, 2], [0, 2, 3]], MaterialId(OPAQUE));
    g.add_instance(lamp, place(DVec3::ZERO, 1.0));
    let scene = scene_of(g);
    let q = scene.point_on(PrimitiveId::world(0), Vec2::splat(0.3));
    assert!(q.alpha == 0.0 && trace(&scene, 1.0).material.0 == LAMP);

    let mut g = Geometry::default();
    let mut mesh = mesh_of(OPAQUE);
    mesh.add_triangles(&square(0.6), None, &[[0, 1, 2], [0, 2, 3]], MaterialId(LAMP));
    let mesh = g.add_mesh(mesh);
    g.add_instance(mesh, place(DVec3::ZERO, 1.0));
    assert_eq!(trace(&scene_of(g), -1.0).material.0, LAMP);
}

/// A quick look never takes what lies in the plane that a ray leaves for something met, as far apart as the two may be.
#[test]
fn what_lies_in_the_plane_that_a_ray_leaves_gets_a_closer_look() {
    let mut r = StdRng::seed_from_u64(11);
    let mut looked = 0;
    for _ in 0..2000 {
        let plane = Tilted::new(&mut r);
        let corners = [DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::new(0.0, 1.5)];
        let card = |height: f64| corners.map(|p| plane.place(p, height).as_vec3());
        let mut alone = Geometry::default();
        alone.add_triangles(&card(0.0), None, &[[0, 1, 2]], MaterialId(OPAQUE));
        let q = scene_of(alone).point_on(PrimitiveId::world(0), Vec2::splat(0.3));
        let error = f64::from(q.error * q.normal.abs().element_sum()) / plane.scale;
        let height = error * (r.random::<f64>() * 4.0 - 2.0);
        let mut g = Geometry::default();
        g.add_triangles(&card(0.0), None, &[[0, 1, 2]], MaterialId(OPAQUE));
        g.add_triangles(&card(height), None, &[[0, 1, 2]], MaterialId(OPAQUE));
        let scene = scene_of(g);
        let g = scene.geometry();
        let left = PrimitiveId::world(0);
        let Some(its_plane) = g.shared_plane(left, q.position) else { continue };
        // From where an origin is moved to, and from the surface itself: other roundings may leave it there.
        let towards = DVec3::new(r.random::<f64>() - 0.5, r.random::<f64>() - 0.5, height.signum() * r.random::<f64>());
        let direction = (plane.turn * towards).normalize().as_vec3();
        for origin in [q.ray_origin(direction), q.position] {
            let ray = Ray { origin, direction, t_max: f32::INFINITY };
            if let Some(hit) = g.closest(&ray, left)
                && g.is_in(&its_plane, &hit)
            {
                looked += 1;
                assert!(!g.is_met_first(&ray, left, &hit), "{height} errors apart: {hit:?}");
                let [from, to] = [ray, Ray { t_max: 2.0 * hit.t, ..ray }];
                assert!(g.may_be_in_plane_of_end(&from, [left, PrimitiveId::NONE], &hit));
                assert!(g.may_be_in_plane_of_end(&to, [PrimitiveId::NONE, left], &hit));
            }
        }
    }
    assert!(looked > 300, "{looked}");
}

/// Ten thousand cards on top of each other: a triangle with too many boxes counts as hidden everywhere.
#[test]
fn many_coincident_surfaces_take_little_time() {
    let mut r = StdRng::seed_from_u64(5);
    let mut g = Geometry::default();
    for _ in 0..10_000 {
        let corners: [Vec3; 3] = std::array::from_fn(|_| Vec3::new(r.random(), 0.0, r.random()));
        g.add_triangles(&corners, None, &[[0, 1, 2]], MaterialId(OPAQUE));
    }
    let start = std::time::Instant::now();
    let scene = scene_of(g);
    assert!(scene.geometry().has_coincident() && start.elapsed().as_secs_f32() < 5.0, "{:?}", start.elapsed());
}

/// A floor with as many lamps on it as it may have boxes is hidden below them alone; with one more, everywhere. The
/// lamps are the world's own or instances.
#[test]
fn with_too_many_boxes_a_triangle_counts_as_hidden_everywhere() {
    let at = |x: f32, y: f32, size: f32| {
        [(0.0, 0.0), (size, 0.0), (0.0, size)].map(|(dx, dy)| Vec3::new(x + dx, y + dy, 2.0))
    };
    for instanced in [false, true] {
        let hidden = [64, 65].map(|lamps| {
            let mut g = Geometry::default();
            g.add_triangles(&at(-1.0, -1.0, 40.0), None, &[[0, 1, 2]], MaterialId(OPAQUE));
            let mut lamp = Mesh::default();
            lamp.add_triangles(&at(0.0, 0.0, 0.5), None, &[[0, 1, 2]], MaterialId(LAMP));
            let mesh = g.add_mesh(lamp);
            for (x, y) in (0..lamps).map(|i| ((i % 9) as f32, (i / 9) as f32)) {
                if instanced {
                    let there = glam::DAffine3::from_translation(DVec3::new(x.into(), y.into(), 0.0));
                    g.add_instance(mesh, Placement::new(there).expect("usable"));
                } else {
                    g.add_triangles(&at(x, y, 0.5), None, &[[0, 1, 2]], MaterialId(LAMP));
                }
            }
            let scene = scene_of(g);
            let is_hidden = |p| scene.geometry().may_be_hidden_at(PrimitiveId::world(0), p);
            [Vec3::new(3.1, 2.1, 2.0), Vec3::new(3.7, 2.7, 2.0)].map(is_hidden)
        });
        assert_eq!(hidden, [[true, false], [true, true]], "instances: {instanced}");
    }
}

/// What there was no time to compare counts as hidden everywhere, and every ray still meets what it meets otherwise.
#[test]
fn what_is_not_compared_changes_no_hit() {
    let square = |size: f32| [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| size * Vec3::new(x, y, 0.0));
    let cards = |most: Option<u64>| {
        let mut g = Geometry::default();
        g.add_triangles(&square(1.5), None, &[[0, 1, 2], [0, 2, 3]], MaterialId(OPAQUE));
        let [opaque, lamp, alone] = [OPAQUE, LAMP, LAMP].map(|material| {
            let mut mesh = Mesh::default();
            mesh.add_triangles(&square(1.0), None, &[[0, 1, 2], [0, 2, 3]], MaterialId(material));
            g.add_mesh(mesh)
        });
        for (mesh, x, y, size) in [(opaque, 0.6, -0.2, 0.8), (lamp, 0.1, -0.2, 0.6), (alone, -0.9, 1.0, 0.4)] {
            let size = DVec3::new(size, size, 1.0);
            let there = glam::DAffine3::from_scale_rotation_translation(size, DQuat::IDENTITY, DVec3::new(x, y, 0.0));
            g.add_instance(mesh, Placement::new(there).expect("usable"));
        }
        let mut scene = scene_of(g);
        if let Some(most) = most {
            let roles = scene.materials.iter().map(Material::role).collect();
            scene.geometry.find_coincident_by(roles, most);
        }
        scene
    };
    let (whole, cut) = (cards(None), cards(Some(0)));
    // It lies on the floor alone.
    let alone = PrimitiveId::of(2, 0);
    assert!(!whole.geometry().may_be_hidden(alone) && cut.geometry().may_be_hidden(alone));
    let apart = Vec3::new(-1.4, -1.4, 0.0);
    let [found, all] = [&whole, &cut].map(|scene| scene.geometry().may_be_hidden_at(PrimitiveId::world(0), apart));
    assert!(!found && all);
    let mut r = StdRng::seed_from_u64(17);
    let mut met = [0; 2];
    for _ in 0..2000 {
        let mut number = |size: f32| size * (2.0 * r.random::<f32>() - 1.0);
        let (from, to) = (Vec3::new(number(2.0), number(2.0), 2.0), Vec3::new(number(1.6), number(1.6), 0.0));
        let [a, b] = [&whole, &cut].map(|scene| {
            let direction = (to - from).normalize();
            scene.trace(&Point::nowhere(from), direction).map(|q| (q.primitive, q.position, q.alpha, q.material))
        });
        assert_eq!(a, b, "from {from} to {to}");
        if let Some((.., material)) = a {
            met[usize::from(material == MaterialId(LAMP))] += 1;
        }
    }
    assert!(met.iter().all(|n| *n > 300), "{met:?}");
}

/// The camera passes a single-sided back face, alone or with a copy that faces the same way, and none that shares its
/// place with what it would see.
#[test]
fn what_shares_its_place_is_not_culled() {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 2.0));
    let square = |size: f32, order: [usize; 4], material: u32| (size, order, material);
    let [away, towards] = [[0, 1, 2, 3], [0, 3, 2, 1]];
    let seen = |squares: &[(f32, [usize; 4], u32)]| {
        let mut g = Geometry::default();
        for (size, order, material) in squares {
            let corners = order.map(|i| (corners[i].truncate() * *size).extend(2.0));
            g.add_triangles(&corners, None, &[[0, 1, 2], [0, 2, 3]], MaterialId(*material));
        }
        let single = |name| Material { back_faces: BackFaces::Culled, ..Material::diffuse(name, Rgb::ONE) };
        let materials = vec![single("first"), single("second"), Material::diffuse("double", Rgb::ONE)];
        let sensor = Sensor { width: 1, height: 1, padding: 0 };
        let camera = Camera::look_at(Vec3::ZERO, Vec3::Z, Vec3::Y, 1.0, sensor);
        let scene = Scene::new(g, materials, &[], camera).culling_back_faces();
        let w = Vec3::new(0.1, 0.05, 1.0).normalize();
        let lens = Point::nowhere(Vec3::ZERO);
        let seen = scene.trace_from_camera(Vec3::ZERO, w, PrimitiveId::NONE, |_| true);
        let hit = seen.hit.map(|hit| scene.point_at(&seen.ray, &hit));
        // What the lens sees of points agrees.
        for id in 0..scene.geometry().world_len() {
            let q = scene.point_on(PrimitiveId::world(id), Vec2::new(0.6, 0.3));
            let there = hit.is_some_and(|p| p.material == q.material) && q.alpha > 0.0;
            assert_eq!(scene.visible_from_camera(&lens, &q) > 0.0, there, "{squares:?}, {id}");
        }
        hit.map(|p| p.material.0)
    };
    assert_eq!(seen(&[square(1.0, away, 0)]), None);
    assert_eq!(seen(&[square(1.0, towards, 0)]), Some(0));
    assert_eq!(seen(&[square(1.0, away, 0), square(1.0, away, 0), square(1.0, away, 1)]), None);
    assert_eq!(seen(&[square(1.0, away, 0), square(1.0, towards, 1)]), Some(0));
    assert_eq!(seen(&[square(1.0, away, 0), square(1.0, away, 2)]), Some(0));
    assert_eq!(seen(&[square(1.0, away, 0), square(0.7, towards, 1)]), Some(0));
    assert_eq!(seen(&[square(0.7, towards, 1), square(1.0, away, 0)]), Some(1));
}
