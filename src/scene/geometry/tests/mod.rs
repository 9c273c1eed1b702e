mod batch;
mod instance;
mod offset;
mod surface;

use std::{collections::HashMap, ops::ControlFlow, time::Instant};

use glam::{DAffine3, DMat3, vec3};
use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::{
    binary::BinaryNode,
    bvh::MAX_DEPTH,
    node::{Below, Block, Node, WIDTH},
    ray::Prepared,
    *,
};
use crate::math::Frame;

const M: MaterialId = MaterialId(0);

impl Geometry {
    fn occluded(&self, ray: &Ray, skip: [PrimitiveId; 2]) -> bool {
        self.obstacle(ray, skip).is_some()
    }
}

fn rng() -> StdRng {
    StdRng::seed_from_u64(1)
}

fn square(r: &mut StdRng) -> Vec2 {
    Vec2::new(r.random(), r.random())
}

fn cube(r: &mut StdRng) -> Vec3 {
    2.0 * vec3(r.random(), r.random(), r.random()) - 1.0
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_max: f32::INFINITY }
}

fn built(g: Geometry) -> Geometry {
    built_with(BuildEffort::default(), g)
}

fn built_with(effort: BuildEffort, mut g: Geometry) -> Geometry {
    g.set_effort(effort);
    g.build();
    g
}

fn soup(corners: &[[Vec3; 3]]) -> Geometry {
    let mut g = Geometry::default();
    let indices: Vec<_> = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    g.add_triangles(corners.as_flattened(), None, &indices, M);
    g
}

/// A closed sphere of 20·4ⁿ triangles, outward winding.
fn icosphere(levels: u32, center: Vec3, radius: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let f = 0.5 * (1.0 + 5.0_f32.sqrt());
    let mut p: Vec<Vec3> = [(-1.0, f), (1.0, f), (-1.0, -f), (1.0, -f)]
        .into_iter()
        .flat_map(|(a, b)| [vec3(a, b, 0.0), vec3(0.0, a, b), vec3(b, 0.0, a)])
        .map(Vec3::normalize)
        .collect();
    let close = |a: Vec3, b: Vec3| a.distance(b) < 1.1;
    let mut t = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if close(p[i], p[j]) && close(p[j], p[k]) && close(p[k], p[i]) {
                    let out = (p[j] - p[i]).cross(p[k] - p[i]).dot(p[i]) > 0.0;
                    t.push(if out { [i, j, k] } else { [i, k, j] }.map(|x| x as u32));
                }
            }
        }
    }
    for _ in 0..levels {
        let mut mid = HashMap::new();
        let mut split = |p: &mut Vec<Vec3>, a: u32, b: u32| {
            *mid.entry((a.min(b), a.max(b))).or_insert_with(|| {
                p.push((p[a as usize] + p[b as usize]).normalize());
                p.len() as u32 - 1
            })
        };
        t = t
            .iter()
            .flat_map(|&[a, b, c]| {
                let (x, y, z) = (split(&mut p, a, b), split(&mut p, b, c), split(&mut p, c, a));
                [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
            })
            .collect();
    }
    (p.iter().map(|&p| center + radius * p).collect(), t)
}

/// The closest hit by asking every primitive.
fn brute(g: &Geometry, ray: &Ray, skip: &[PrimitiveId]) -> Option<Hit> {
    brute_all(g, ray, skip).first().copied()
}

/// Everything that the ray meets, in order.
fn brute_all(g: &Geometry, ray: &Ray, skip: &[PrimitiveId]) -> Vec<Hit> {
    let prepared = Prepared::new(ray);
    let world = (0..g.world_len()).filter(|&i| g.area(PrimitiveId::world(i)) > 0.0);
    let intersect = |index| match g.shape(index) {
        Shape::Triangle(t) => [t.intersect(&prepared), None].map(|hit| (index, hit)),
        Shape::Sphere(s) => s.intersect(&prepared).map(|t| (index, t.map(|t| (t, Vec2::ZERO)))),
        Shape::Instance(_) => unreachable!("an instance is no primitive"),
    };
    let hit = |(index, hit): (u32, Option<(f32, Vec2)>)| {
        hit.map(|(t, barycentric)| Hit { t, primitive: PrimitiveId::world(index), barycentric })
    };
    let mut hits: Vec<Hit> = world.flat_map(intersect).filter_map(hit).collect();
    for (n, instance) in (0..).zip(&g.instances) {
        let (range, mesh) = (instance.clip(&prepared), &g.meshes[instance.mesh as usize].mesh);
        let object_ray = instance.object_ray(&prepared);
        for i in (0..mesh.len()).filter(|&i| !mesh.triangle(i).is_degenerate() && range.near <= range.far) {
            let Some((t, barycentric)) = mesh.triangle(i).intersect(&object_ray) else { continue };
            hits.push(Hit { t: range.clamp(f64::from(t)), primitive: PrimitiveId::of(n, i), barycentric });
        }
    }
    hits.retain(|h| g.is_sphere(h.primitive) || !skip.contains(&h.primitive));
    hits.retain(|h| h.t > 0.0 && h.t < ray.t_max);
    hits.sort_by(|a, b| a.order().partial_cmp(&b.order()).expect("no NaN"));
    hits
}

/// Every primitive.
fn ids(g: &Geometry) -> Vec<PrimitiveId> {
    let instanced =
        (0..g.instance_count()).flat_map(|n| (0..g.mesh(g.mesh_of(n)).len()).map(move |i| PrimitiveId::of(n, i)));
    (0..g.world_len()).map(PrimitiveId::world).chain(instanced).collect()
}

#[test]
fn the_tree_answers_as_no_tree_does() {
    let mut r = rng();
    let (mut hits, mut passed) = (0, 0);
    for case in 0..60 {
        let g = built_case(case, awkward_geometry(case, &mut r));
        let ids = ids(&g);
        for _ in 0..500 {
            let Some(ray) = awkward_ray(case, &mut r) else { continue };
            let mut any = || if ids.is_empty() { PrimitiveId::NONE } else { ids[r.random_range(0..ids.len())] };
            let skip = [any(), any()];
            let closest = expect_first_as_brute(case, &g, &ray, skip);
            hits += u32::from(closest.is_some());
            passed += expect_all_as_brute(case, &g, &ray, skip[0], closest);
        }
    }
    assert!(hits > 3000 && passed > 20_000, "{hits} {passed}");
}

/// Small integer coordinates make coplanar, degenerate and duplicate triangles and equal distances common; in two
/// tilted planes most rays see triangles edge-on, where rounding decides.
fn awkward_point(case: usize, r: &mut StdRng) -> Vec3 {
    match case % 3 {
        0 => (3.0 * cube(r)).round(),
        1 => 3.0 * cube(r),
        _ => Frame::around(vec3(0.48, 0.6, 0.64)).to_world((3.0 * cube(r)).round() * vec3(1.0, 1.0, 1e-3)),
    }
}

/// Spheres and triangles, and in every second case instances.
fn awkward_geometry(case: usize, r: &mut StdRng) -> Geometry {
    let mut g = Geometry::default();
    for _ in 0..case % 4 {
        let center = awkward_point(case, r);
        g.add_sphere(center, r.random_range(0.0..1.5), M);
    }
    let corners = awkward_triangles(case, r);
    let indices: Vec<_> = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    g.add_triangles(corners.as_flattened(), None, &indices, M);
    if case.is_multiple_of(2) {
        // The same triangles once more as a mesh: in place, where every hit has an equal one in world space, and
        // elsewhere.
        let mut mesh = Mesh::default();
        mesh.add_triangles(corners.as_flattened(), None, &indices, M);
        let mesh = g.add_mesh(mesh);
        g.add_instance(mesh, Placement::new(DAffine3::IDENTITY).expect("usable"));
        for _ in 0..case % 5 {
            g.add_instance(mesh, random_placement(r));
        }
    }
    g
}

/// Some of them twice, some without an area.
fn awkward_triangles(case: usize, r: &mut StdRng) -> Vec<[Vec3; 3]> {
    let mut corners: Vec<[Vec3; 3]> = Vec::new();
    for _ in 0..case * 3 {
        let c = match r.random_range(0..8) {
            0 if !corners.is_empty() => corners[r.random_range(0..corners.len())],
            1 => {
                let p = awkward_point(case, r);
                [p, p, awkward_point(case, r)]
            }
            _ => [awkward_point(case, r), awkward_point(case, r), awkward_point(case, r)],
        };
        corners.push(c);
    }
    corners
}

fn random_placement(r: &mut StdRng) -> Placement {
    loop {
        let linear = DMat3::from_cols(cube(r).into(), cube(r).into(), cube(r).into());
        if let Some(p) = Placement::new(DAffine3::from_mat3_translation(linear, cube(r).into())) {
            break p;
        }
    }
}

/// With each effort, and in a third of the cases for walks that use what every processor has.
fn built_case(case: usize, g: Geometry) -> Geometry {
    let mut g = built_with(BuildEffort::ALL[case / 3 % 2], g);
    if case % 3 == 1 {
        g.tree = g.tree.map(Tree::portable);
        g.meshes.iter_mut().for_each(|m| m.tree = m.tree.take().map(Tree::portable));
    }
    g
}

/// From one point to another, often along axes; `None` where nothing is left of the direction.
fn awkward_ray(case: usize, r: &mut StdRng) -> Option<Ray> {
    let zeros = [0; 3].map(|_| r.random_range(0..if case % 3 == 2 { 40 } else { 4 }));
    let origin = awkward_point(case, r);
    let target = awkward_point(case, r);
    let mut d = target - origin;
    for k in 0..3 {
        match zeros[k] {
            0 => d[k] = 0.0,
            1 => d[k] = -0.0,
            _ => {}
        }
    }
    if d == Vec3::ZERO {
        return None;
    }
    Some(Ray { origin, direction: d, t_max: [f32::INFINITY, 1.0, 0.4][r.random_range(0..3)] })
}

/// Holds the closest hit, and whether anything is in the way, to what asking every primitive finds; returns the hit.
fn expect_first_as_brute(case: usize, g: &Geometry, ray: &Ray, skip: [PrimitiveId; 2]) -> Option<Hit> {
    let (a, b) = (g.closest(ray, skip[0]), brute(g, ray, &skip[..1]));
    let key = |h: Hit| (h.t, h.primitive, h.barycentric);
    assert_eq!(a.map(key), b.map(key), "case {case}, {ray:?}");
    assert_eq!(g.occluded(ray, skip), brute(g, ray, &skip).is_some(), "case {case}, {ray:?}");
    a
}

/// The same of everything on the way, front to back from the closest hit and at once; returns how much it is.
fn expect_all_as_brute(case: usize, g: &Geometry, ray: &Ray, skip: PrimitiveId, closest: Option<Hit>) -> usize {
    let orders = |hits: Vec<Hit>| hits.iter().map(Hit::order).collect::<Vec<_>>();
    let all = orders(brute_all(g, ray, &[skip]));
    let one_by_one: Vec<_> = std::iter::successors(closest, |hit| g.closest_after(ray, skip, hit)).collect();
    let mut at_once = Vec::new();
    let flow = g.crossings(ray, [skip, PrimitiveId::NONE], |hit| {
        at_once.push(*hit);
        ControlFlow::Continue(())
    });
    assert!(flow.is_continue());
    at_once.sort_by(|a, b| a.order().partial_cmp(&b.order()).expect("no NaN"));
    assert_eq!(orders(at_once), all, "case {case}, {ray:?}");
    assert_eq!(orders(one_by_one), all, "case {case}, {ray:?}");
    all.len()
}

#[test]
fn hits_are_where_f64_says() {
    let mut r = rng();
    for _ in 0..20_000 {
        let c = [cube(&mut r), cube(&mut r), cube(&mut r)];
        let g = built(soup(&[c]));
        let d = cube(&mut r);
        let o = 3.0 * cube(&mut r);
        let p = c.map(|p| p.as_dvec3() - o.as_dvec3());
        let d64 = d.as_dvec3();
        let edge = |i: usize, j: usize| d64.dot(p[i].cross(p[j]));
        let e = [edge(1, 2), edge(2, 0), edge(0, 1)];
        let clear = e.iter().all(|e| e.abs() > 1e-5);
        let n = (p[1] - p[0]).cross(p[2] - p[0]);
        let t = n.dot(p[0]) / n.dot(d64);
        let inside = e.iter().all(|&e| e > 0.0) || e.iter().all(|&e| e < 0.0);
        let hit = g.closest(&ray(o, d), PrimitiveId::NONE);
        if clear {
            assert_eq!(hit.is_some(), inside && t > 0.0);
        }
        if let Some(h) = hit.filter(|_| clear) {
            assert!((f64::from(h.t) - t).abs() <= 1e-6 * t);
            let sum: f64 = e.iter().sum();
            assert!((f64::from(h.barycentric.x) - e[1] / sum).abs() < 1e-2 / sum.abs().min(1.0) * 1e-3);
        }
    }
}

#[test]
fn nothing_leaks_between_the_triangles_of_a_closed_mesh() {
    let mut r = rng();
    for center in [Vec3::ZERO, vec3(1000.0, -2000.0, 500.0)] {
        let (p, t) = icosphere(4, center, 1.0);
        let mut g = Geometry::default();
        g.add_triangles(&p, None, &t, M);
        g.build();
        let mut leaks = 0;
        for i in 0..1_000_000 {
            let origin = center + 0.5 * cube(&mut r);
            let [a, b, _] = t[r.random_range(0..t.len())].map(|i| p[i as usize]);
            let target = if i % 4 == 0 { a } else { a.lerp(b, r.random()) };
            let ray = ray(origin, target - origin);
            let seen = g.closest(&ray, PrimitiveId::NONE).is_some();
            let dark = i % 8 != 0 || g.occluded(&ray, [PrimitiveId::NONE; 2]);
            leaks += u32::from(!seen || !dark);
        }
        assert_eq!(leaks, 0, "around {center}");
    }
}

#[test]
fn a_tree_built_fast_is_another_and_answers_the_same() {
    let (mut positions, mut indices) = icosphere(5, Vec3::ZERO, 1.0);
    // A second sphere that crosses the first, and a third inside both.
    for (levels, center, radius) in [(4, Vec3::X, 0.8), (3, 0.4 * Vec3::X, 0.1)] {
        let base = positions.len() as u32;
        let (p, t) = icosphere(levels, center, radius);
        positions.extend(p);
        indices.extend(t.iter().map(|t| t.map(|i| base + i)));
    }
    let [fast, best] = BuildEffort::ALL.map(|effort| {
        let mut g = Geometry::default();
        g.add_triangles(&positions, None, &indices, M);
        built_with(effort, g)
    });
    let nodes = |g: &Geometry| g.tree.as_ref().map_or(0, |tree| tree.nodes.len());
    assert_ne!(nodes(&fast), nodes(&best), "the effort changes the tree");
    let mut r = rng();
    let mut hits = 0;
    for _ in 0..20_000 {
        let (origin, target) = (2.0 * cube(&mut r), positions[r.random_range(0..positions.len())]);
        // Through vertices, where up to six triangles are hit at the same distance.
        let ray = ray(origin, target - origin);
        let [a, b] = [&fast, &best].map(|g| g.closest(&ray, PrimitiveId::NONE));
        assert_eq!(a.map(|h| (h.t, h.primitive)), b.map(|h| (h.t, h.primitive)), "{ray:?}");
        let short = Ray { t_max: 0.9, ..ray };
        assert_eq!(
            fast.occluded(&short, [PrimitiveId::NONE; 2]),
            best.occluded(&short, [PrimitiveId::NONE; 2]),
            "{ray:?}"
        );
        hits += u32::from(a.is_some());
    }
    assert!(hits > 19_000, "{hits}");
}

#[test]
fn of_equal_hits_the_smaller_id_wins_whatever_the_tree() {
    let t = |z: f32, s: f32| [vec3(-s, -s, z), vec3(s, -s, z), vec3(0.0, s, z)];
    let mut g = soup(&[t(1.0, 1.0), t(0.0, 2.0), t(0.0, 1.0), t(0.0, 1.0), t(0.0, 1.0), t(0.0, 1.0)]);
    g.add_sphere(vec3(0.0, 0.0, 1.0), 1.0, M);
    g.build();
    let r = ray(vec3(0.0, 0.0, -3.0), Vec3::Z);
    let id = |skip| g.closest(&r, PrimitiveId::world(skip)).expect("hit").primitive.index();
    assert_eq!((id(9), id(1), id(2)), (1, 2, 1));
    assert!(g.occluded(&Ray { t_max: 3.5, ..r }, [PrimitiveId::world(1), PrimitiveId::world(2)]));
    assert!(!g.occluded(&Ray { t_max: 3.0, ..r }, [PrimitiveId::NONE; 2]), "the end does not count");
}

#[test]
fn of_copies_the_first_stays_and_those_behind_a_veil() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let (opaque, veil, other) = (MaterialId(0), MaterialId(1), MaterialId(2));
    let lamp = MaterialId(3);
    let role = |m: MaterialId| Role {
        precedence: if m == lamp { Precedence::Emitter } else { Precedence::Opaque },
        bounds_volume: false,
    };
    let materials_of = |added: &[MaterialId]| {
        let mut g = Geometry::default();
        for (turn, material) in added.iter().enumerate() {
            let mut corners = corners;
            corners.rotate_left(turn % 3);
            if turn % 2 == 1 {
                corners.swap(0, 1); // the other way round, and with another zero
                corners = corners.map(|c| c.map(|x| if x == 0.0 { -0.0 } else { x }));
            }
            g.add_triangles(&corners, None, &[[0, 1, 2]], *material);
        }
        g.add_triangles(&corners.map(|c| c + Vec3::Z), None, &[[0, 1, 2]], opaque);
        g.drop_copies(|m| m == opaque || m == lamp, role);
        (0..g.world_len() - 1).map(|i| g.material(PrimitiveId::world(i))).collect::<Vec<_>>()
    };
    assert_eq!(materials_of(&[opaque, opaque, veil, opaque]), [opaque]);
    assert_eq!(materials_of(&[veil, other, veil, other, opaque, other, opaque]), [veil, other, opaque]);
    // An emitter comes before everything else, wherever it is in the file.
    assert_eq!(materials_of(&[opaque, veil, lamp, veil]), [lamp]);

    let mut g = Geometry::default();
    let mut mesh = Mesh::default();
    mesh.add_triangles(&corners, None, &[[0, 1, 2], [2, 1, 0]], opaque);
    let mesh = g.add_mesh(mesh);
    for x in [0.0, 1.0, 0.0] {
        g.add_instance(mesh, Placement::new(DAffine3::from_translation(glam::dvec3(x, 0.0, 0.0))).expect("usable"));
    }
    g.drop_copies(|_| true, role);
    assert_eq!((g.instance_count(), g.triangle_count()), (2, 2));
}

#[test]
fn hostile_scenes_build_quickly_and_keep_to_the_stack() {
    let start = Instant::now();
    let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut r = rng();
    let huge = |p: Vec3| p * 1e18;
    let scenes: [(&str, Vec<[Vec3; 3]>); 6] = [
        ("identical", vec![t; 20_000]),
        ("same box", (0..20_000).map(|_| [Vec3::ZERO, Vec3::ONE, vec3(r.random(), r.random(), 0.5)]).collect()),
        ("nested", (0..4000).map(|i| t.map(|p| p * 0.99_f32.powi(i))).collect()),
        ("growing", (0..250).map(|i| t.map(|p| (p + 1.0) * 2.0_f32.powi(i % 125 - 62))).collect()),
        ("one far away", (0..5000).map(|_| t.map(|p| p + cube(&mut r))).chain([t.map(huge)]).collect()),
        ("huge", (0..5000).map(|_| [huge(cube(&mut r)), huge(cube(&mut r)), huge(cube(&mut r))]).collect()),
    ];
    for ((name, corners), effort) in scenes.iter().flat_map(|s| BuildEffort::ALL.map(|effort| (s, effort))) {
        let g = built_with(effort, soup(corners));
        let tree = g.tree.as_ref().expect("built");
        let mut deepest = 0;
        let mut todo: Vec<_> = tree.root.into_iter().map(|root| (root, 0)).collect();
        while let Some((child, depth)) = todo.pop() {
            deepest = deepest.max(depth);
            if let Below::Node(index) = child.below() {
                let node = &tree.nodes[index as usize];
                let there = (0..WIDTH).filter(|&slot| node.planes[0][0].0[slot] <= node.planes[0][1].0[slot]);
                todo.extend(there.map(|slot| (node.children[slot], depth + 1)));
            }
        }
        assert!(deepest <= MAX_DEPTH, "{name}, {effort:?}: {deepest}");
        for _ in 0..20 {
            let o = cube(&mut r);
            let ray = ray(o, cube(&mut r));
            let [a, b] = [g.closest(&ray, PrimitiveId::world(0)), brute(&g, &ray, &[PrimitiveId::world(0)])];
            assert_eq!(a.map(|h| (h.t, h.primitive)), b.map(|h| (h.t, h.primitive)), "{name}");
        }
    }
    assert!(start.elapsed().as_secs() < 20);
}

#[test]
fn an_empty_scene_is_empty() {
    let g = built(Geometry::default());
    assert!(g.is_empty() && g.bounds().is_none());
    assert!(g.closest(&ray(Vec3::ZERO, Vec3::X), PrimitiveId::NONE).is_none());
    assert!(!g.occluded(&ray(Vec3::ZERO, Vec3::X), [PrimitiveId::NONE; 2]));
}

#[test]
fn the_best_tree_is_for_those_who_trace_enough() {
    let mut mesh = Mesh::default();
    mesh.add_triangles(&[Vec3::ZERO, Vec3::X, Vec3::Y], None, &[[0, 1, 2]; 60], M);
    let mut g = soup(&[[Vec3::ZERO, Vec3::X, Vec3::Y]; 40]);
    let mesh = g.add_mesh(mesh);
    // The trees are over a hundred triangles, however often the mesh is there.
    (0..9).for_each(|_| g.add_instance(mesh, Placement::new(DAffine3::IDENTITY).expect("usable")));
    for (samples, effort) in [(0, BuildEffort::Fast), (999, BuildEffort::Fast), (1000, BuildEffort::Best)] {
        g.set_effort_for(samples);
        assert_eq!(g.effort, effort, "{samples} samples");
    }
}

#[test]
fn sizes_are_what_the_documentation_says() {
    use std::mem::size_of;
    let sizes = [size_of::<Block>(), size_of::<Primitive>(), size_of::<Node>(), size_of::<Instance>()];
    assert_eq!(sizes, [320, 56, 256, 256]);
    assert_eq!((mesh::TRIANGLE_BYTES, size_of::<PrimitiveId>()), (32, 8));
    // Of these there are two for each triangle while trees are built.
    assert_eq!(size_of::<BinaryNode>(), 36);
}
