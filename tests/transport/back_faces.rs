//! Back faces that the camera alone does not see: the first edge of every path passes them, all other edges meet them.

use glam::Vec3;
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::Geometry,
        material::{AlphaMode, BackFaces, EmissionSides, Material, MaterialId},
    },
};

use crate::{
    alpha::assert_radiance,
    identity::assert_identity,
    scenes::{WEIGHTED, cube_inside, quad},
};

const SENSOR: Sensor = Sensor { width: 16, height: 16, padding: 0 };
const ALBEDO: f32 = 0.5;

fn single_sided(material: Material) -> Material {
    Material { back_faces: BackFaces::Culled, ..material }
}

/// Looks at a closed room of walls that face inward, from outside.
fn dolls_house(furniture: impl FnOnce(&mut Geometry), others: Vec<Material>) -> Scene {
    let wall = single_sided(Material::diffuse("wall", Rgb::splat(ALBEDO)).emitting(Rgb::ONE));
    let mut g = Geometry::default();
    cube_inside(&mut g, 1.0, [0; 6]);
    furniture(&mut g);
    let camera = Camera::look_at(Vec3::new(0.3, 0.2, 3.0), Vec3::ZERO, Vec3::Y, 0.3, SENSOR);
    Scene::new(g, [vec![wall], others].concat(), &[], camera)
}

/// In a closed furnace every path length has its power of the albedo, and so it has when one looks in through a wall;
/// were the wall away for light as well, half of what it sends would be missing.
#[test]
fn a_furnace_seen_through_its_wall_is_a_furnace() {
    let scene = dolls_house(|_| {}, vec![]).culling_back_faces();
    assert!(scene.first_sight().back_faces == 0.0);
    for edges in 1..=2 {
        let expected = f64::from(ALBEDO).powi(edges as i32 - 1);
        assert_radiance("a furnace through its wall", &scene, &WEIGHTED, edges, 16, expected);
    }
    assert_radiance("the same by area", &scene, &[IntegratorKind::Area], 1, 64, 1.0);
    let closed = dolls_house(|_| {}, vec![]);
    assert!(closed.first_sight().back_faces == 1.0);
}

/// With a mirror that shows the walls from behind as well, cards that face away or are there in part, and a ball.
#[test]
fn every_path_past_back_faces_is_as_defined() {
    let half = AlphaMode::Blend { factor: 0.5 };
    let mut both = Material::diffuse("both sides", Rgb::splat(0.3)).emitting(Rgb::splat(0.5));
    both.emission_sides = EmissionSides::Both;
    let others = vec![
        single_sided(Material::mirror("mirror", Rgb::splat(0.9))),
        single_sided(Material::diffuse("card", Rgb::splat(0.6)).covering(half)),
        single_sided(both),
        Material::glass("ball", 1.5),
    ];
    let furnish = |g: &mut Geometry| {
        let v = Vec3::new;
        // Two face the camera, two face away from it.
        for (x, z, material) in [(-0.6, 0.5, 1), (-0.3, 0.3, 2), (0.0, 0.1, 3)] {
            let corners = [v(x, -0.4, z), v(x + 0.3, -0.4, z), v(x + 0.3, 0.4, z), v(x, 0.4, z)];
            quad(g, corners, material);
            let [a, b, c, d] = corners.map(|p| p + v(0.4, 0.1, -0.2));
            quad(g, [d, c, b, a], material);
        }
        g.add_sphere(v(0.1, -0.5, 0.4), 0.2, MaterialId(4));
    };
    assert_identity("past back faces", &dolls_house(furnish, others).culling_back_faces(), 6);
}
