//! Instances: mirrored, stretched and small lamps of one mesh in a room, held to the definition, among the integrators,
//! and to the same room with every triangle in world space.

use glam::{DAffine3, DQuat, DVec3, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    path::{Densities, JoinedPath},
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, MetallicRoughness},
        camera::{Camera, Sensor},
        geometry::{Geometry, Mesh, Placement},
        material::{Material, MaterialId},
    },
};

use crate::{
    agreement::{ALL, Compared, Run, VISIBLE, agreement, assert_agree, each_other, settings},
    identity::assert_identity,
    scenes,
};

/// How the copies of a mesh are there.
#[derive(Clone, Copy, Debug)]
pub enum Copies {
    /// One mesh and an instance for each.
    Instances,
    /// Transformed vertex by vertex; a transform that mirrors turns the winding, as glTF has it.
    Flat,
}

/// The positions, normals and triangles of a part of a mesh, and its material.
pub type Part = (Vec<Vec3>, Option<Vec<Vec3>>, Vec<[u32; 3]>, u32);

/// Puts a mesh where `places` say.
pub fn place(g: &mut Geometry, parts: &[Part], places: &[DAffine3], copies: Copies) {
    if let Copies::Instances = copies {
        let mut mesh = Mesh::default();
        for (p, n, t, material) in parts {
            mesh.add_triangles(p, n.as_deref(), t, MaterialId(*material));
        }
        let mesh = g.add_mesh(mesh);
        places.iter().for_each(|m| g.add_instance(mesh, Placement::new(*m).expect("it can be undone")));
        return;
    }
    for m in places {
        let mirrored = m.matrix3.determinant() < 0.0;
        let normals = m.matrix3.inverse().transpose();
        for (p, n, t, material) in parts {
            let p: Vec<Vec3> = p.iter().map(|p| m.transform_point3(p.as_dvec3()).as_vec3()).collect();
            let n = n
                .as_ref()
                .map(|n| n.iter().map(|n| (normals * n.as_dvec3()).normalize().as_vec3()).collect::<Vec<_>>());
            let t: Vec<_> = t.iter().map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }).collect();
            g.add_triangles(&p, n.as_deref(), &t, MaterialId(*material));
        }
    }
}

/// A room whose only light are three lamps of one mesh, a slanted panel that emits from its front under a shade: one
/// turned, one mirrored and stretched, one sheared; and two smooth, glossy pyramids, one of them mirrored.
fn room(sensor: Sensor, copies: Copies) -> Scene {
    let brass = MetallicRoughness::new(Rgb::new(0.9, 0.7, 0.4), 1.0, 0.25);
    let materials = vec![
        Material::diffuse("white", Rgb::splat(0.6)),
        Material::diffuse("red", Rgb::new(0.6, 0.2, 0.1)),
        Material::diffuse("panel", Rgb::splat(0.2)).emitting(Rgb::new(6.0, 5.0, 4.0)),
        Material::new("brass", Bsdf::MetallicRoughness(brass)),
    ];
    let v = Vec3::new;
    let mut g = Geometry::default();
    scenes::cube_inside(&mut g, 1.0, [1, 0, 0, 0, 0, 0]);
    let panel = vec![v(-1., 0., -1.), v(1., 0., -1.), v(1., 0.3, 1.), v(-1., 0.3, 1.)];
    let shade = panel.iter().map(|p| 1.3 * *p + v(0.0, 0.15, 0.0)).collect();
    let quad = vec![[0, 1, 2], [0, 2, 3]];
    let lamp = [(shade, None, quad.clone(), 1), (panel, None, quad, 2)];
    let turn = |angle: f64| DQuat::from_axis_angle(DVec3::new(0.2, 1.0, 0.1).normalize(), angle);
    let at = |s: [f64; 3], angle: f64, t: [f64; 3]| {
        DAffine3::from_scale_rotation_translation(s.into(), turn(angle), t.into())
    };
    let mut shear = at([0.15, 0.15, 0.15], 2.5, [0.0, 0.5, -0.6]);
    shear.matrix3.y_axis += 0.5 * shear.matrix3.x_axis;
    let lamps = [at([0.25, 0.25, 0.25], 0.4, [-0.5, 0.7, 0.2]), at([-0.5, 0.2, 0.15], 1.2, [0.45, 0.75, 0.0]), shear];
    place(&mut g, &lamp, &lamps, copies);
    let p = [v(-1., 0., -1.), v(1., 0., -1.), v(1., 0., 1.), v(-1., 0., 1.), v(0., 1.5, 0.)];
    let n = p.map(|p| (p - v(0.0, 0.2, 0.0)).normalize()).to_vec();
    let pyramid = [(p.to_vec(), Some(n), vec![[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]], 3)];
    let pyramids = [at([0.3, 0.3, 0.3], 0.3, [-0.4, -0.95, -0.3]), at([0.2, 0.5, -0.35], 0.9, [0.45, -0.9, -0.2])];
    place(&mut g, &pyramid, &pyramids, copies);
    let camera = Camera::look_at(v(0.1, 0.0, 0.95), v(0.0, -0.1, -1.0), Vec3::Y, 1.3, sensor);
    Scene::new(g, materials, &[], camera)
}

#[test]
fn every_path_among_instances_is_as_defined() {
    let scene = room(scenes::square(24, Filter::Box), Copies::Instances);
    assert_eq!((scene.geometry().instance_count(), scene.lights().all().len()), (5, 6));
    assert_identity("instances", &scene, 4);
}

#[test]
fn integrators_agree_on_mirrored_and_stretched_lamps() {
    agreement("instances", &room(scenes::square(16, Filter::Box), Copies::Instances), &ALL, Compared::Scattered);
}

/// The front of a mirrored lamp is where its file says, and every lamp has its world-space area: as without instances.
#[test]
fn instances_look_like_their_flattened_triangles() {
    let [instanced, flat] =
        [Copies::Instances, Copies::Flat].map(|copies| room(scenes::square(16, Filter::Box), copies));
    assert_eq!(flat.geometry().instance_count(), 0);
    // The edges of a lamp on the image would be most of the noise.
    let reflected = |path: &JoinedPath| path.edges() >= 2;
    let settings = [(&instanced, 0), (&flat, 7)].map(|(scene, salt)| settings(scene, IntegratorKind::Bdpt, salt));
    let mut runs = [
        Run::new(&instanced, &settings[0], "instances", &reflected),
        Run::new(&flat, &settings[1], "flattened", &reflected),
    ];
    assert_agree("instances", VISIBLE, &mut runs, &each_other(2));
}
