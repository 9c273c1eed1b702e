//! Surfaces that vary: normal textures, smooth normals over coarse meshes, textured materials and emitters.

use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3};
use pathspace::{
    math::Rgb,
    sampling::{Choice, Filter},
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::{Attributes, Geometry, PrimitiveId},
        light::Light,
        material::{Maps, Material, MaterialId, NormalMap, Parameters, VertexColors},
        texture::{Encoding, Image, Texels, Texture, Wrap},
    },
};

use crate::{
    agreement::{ALL, Compared, agreement},
    scenes,
};

const GLOSSY: Parameters = Parameters { roughness: 0.6, specular: 1.0, ..Parameters::LAMBERT };

/// An image whose texel (x, y) of `side`² is `color(x, y)`, 0 to 255.
fn image(side: u32, color: impl Fn(u32, u32) -> [u8; 3]) -> Arc<Image> {
    let texels = (0..side * side).flat_map(|i| color(i % side, i / side)).collect();
    Arc::new(Image::new(side, side, Texels::U8(texels)))
}

/// Waves in both directions, tilted by up to about 25° (to 35° where they cross).
pub fn waves(scale: f32) -> NormalMap {
    let byte = |x: f32| (127.5 + 127.5 * x).round() as u8;
    let slope = |i: u32| 0.45 * (std::f32::consts::TAU * i as f32 / 16.0).sin();
    let texel = |x, y| {
        let n = Vec3::new(slope(x), slope(y), 1.0).normalize();
        [byte(n.x), byte(n.y), byte(n.z)]
    };
    NormalMap { texture: Texture::new(image(16, texel), Encoding::Linear), scale }
}

fn tinted() -> Texture {
    let color = |x, y| [[230, 120, 90], [90, 200, 130], [110, 140, 235], [240, 230, 180]][((x + 2 * y) % 4) as usize];
    Texture { wrap: [Wrap::Mirror, Wrap::Repeat], ..Texture::new(image(4, color), Encoding::Srgb) }
}

/// Two triangles a, b, c and a, c, d with texture coordinates from (0, 0) to (`repeat`, `repeat`), tangents from a to
/// b, and colours.
pub fn quad(geometry: &mut Geometry, corners: [Vec3; 4], repeat: f32, material: u32) {
    let uv = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|uv| uv * repeat);
    let tangent = (corners[1] - corners[0]).normalize().extend(-1.0);
    let colors = [[65535; 4], [65535, 40000, 30000, 65535], [30000, 65535, 65535, 65535], [50000, 50000, 65535, 65535]];
    let attributes =
        Attributes { uv: [uv.to_vec(), vec![], vec![], vec![]], colors: colors.to_vec(), tangents: vec![tangent; 4] };
    geometry.add_triangles_with(&corners, None, &attributes, &[[0, 1, 2], [0, 2, 3]], MaterialId(material));
}

/// An octahedron with the normals of the sphere through its corners: as coarse as a smooth mesh can be.
pub fn coarse_sphere(geometry: &mut Geometry, center: Vec3, radius: f32, material: u32) {
    let normals = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let positions = normals.map(|n| center + radius * n);
    let faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    geometry.add_triangles(&positions, Some(&normals), &faces, MaterialId(material));
}

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// A normal-mapped, slightly glossy plane under a large lamp.
pub fn normal_mapped_plane(sensor: Sensor) -> Scene {
    let mut plane = Maps::new(Parameters { base_color: Rgb::splat(0.7), ..GLOSSY });
    plane.normal = Some(waves(1.0));
    let lamp = Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(4.0));
    let materials = vec![Material::varying("plane", plane), lamp];
    let mut g = Geometry::default();
    quad(&mut g, [v(-1., 0., 1.), v(1., 0., 1.), v(1., 0., -1.), v(-1., 0., -1.)], 2.0, 0);
    quad(&mut g, [v(-1., 1.5, -1.), v(1., 1.5, -1.), v(1., 1.5, 1.), v(-1., 1.5, 1.)], 1.0, 1);
    let camera = Camera::look_at(v(0.0, 1.2, 1.6), v(0.0, 0.0, 0.1), Vec3::Y, 0.7, sensor);
    Scene::new(g, materials, &[], camera)
}

/// A coarse mesh with smooth normals between a floor and a lamp.
pub fn smooth_octahedron(sensor: Sensor) -> Scene {
    let lamp = Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(4.0));
    let materials =
        vec![Material::diffuse("floor", Rgb::splat(0.5)), Material::diffuse("ball", Rgb::new(0.8, 0.7, 0.5)), lamp];
    let mut g = Geometry::default();
    quad(&mut g, [v(-1.2, -0.7, 1.2), v(1.2, -0.7, 1.2), v(1.2, -0.7, -1.2), v(-1.2, -0.7, -1.2)], 1.0, 0);
    coarse_sphere(&mut g, Vec3::ZERO, 0.6, 1);
    quad(&mut g, [v(-1., 1.5, -1.), v(1., 1.5, -1.), v(1., 1.5, 1.), v(-1., 1.5, 1.)], 1.0, 2);
    let camera = Camera::look_at(v(0.3, 0.9, 2.4), v(0.0, -0.2, 0.0), Vec3::Y, 0.7, sensor);
    Scene::new(g, materials, &[], camera)
}

/// A room in which everything varies: tints, roughness and metal, normals, vertex colours, and the light of its
/// ceiling.
pub fn textured_room(sensor: Sensor) -> Scene {
    let mut tint = Maps::new(Parameters { base_color: Rgb::splat(0.9), ..Parameters::LAMBERT });
    tint.base_color = Some(tinted());
    let mut worn = Maps::new(GLOSSY);
    worn.base_color = Some(tinted());
    worn.factors.metallic = 1.0;
    worn.factors.roughness = 1.0;
    let roughness =
        |x: u32, y: u32| [0, if x.is_multiple_of(2) { 255 } else { 150 }, if y.is_multiple_of(2) { 200 } else { 0 }];
    worn.metallic_roughness = Some(Texture::new(image(4, roughness), Encoding::Linear));
    worn.normal = Some(waves(0.5));
    let mut painted = Maps::new(Parameters::LAMBERT);
    painted.vertex_colors = VertexColors::BaseColor;
    let lamp = textured_lamp("lamp", Rgb::new(6.0, 5.0, 4.0));
    let materials = vec![
        Material::varying("tinted", tint),
        Material::varying("worn", worn),
        Material::varying("painted", painted),
        lamp,
    ];
    let mut g = Geometry::default();
    let c = |x: f32, y: f32, z: f32| v(x, y, z);
    quad(&mut g, [c(-1., -1., 1.), c(1., -1., 1.), c(1., -1., -1.), c(-1., -1., -1.)], 1.5, 1);
    quad(&mut g, [c(-1., -1., -1.), c(1., -1., -1.), c(1., 1., -1.), c(-1., 1., -1.)], 1.0, 0);
    quad(&mut g, [c(-1., -1., 1.), c(-1., -1., -1.), c(-1., 1., -1.), c(-1., 1., 1.)], 1.0, 2);
    quad(&mut g, [c(1., -1., -1.), c(1., -1., 1.), c(1., 1., 1.), c(1., 1., -1.)], 2.0, 0);
    quad(&mut g, [c(-0.9, 0.98, -0.9), c(0.9, 0.98, -0.9), c(0.9, 0.98, 0.9), c(-0.9, 0.98, 0.9)], 1.0, 3);
    let camera = Camera::look_at(v(0.0, 0.0, 3.2), v(0.0, -0.1, 0.0), Vec3::Y, 0.75, sensor);
    Scene::new(g, materials, &[], camera)
}

/// A lamp of four by four fields, some of them dark, turned by its texture's transform.
pub fn textured_lamp(name: &str, radiance: Rgb) -> Material {
    let field = |x: u32, y: u32| match (x + 3 * y) % 5 {
        0 => [255, 240, 200],
        1 => [0, 0, 0],
        2 => [90, 120, 160],
        3 => [0, 0, 0],
        _ => [200, 60, 40],
    };
    let mut maps = Maps::new(Parameters { base_color: Rgb::splat(0.2), ..Parameters::LAMBERT });
    let transform = Affine2::from_scale_angle_translation(Vec2::new(1.0, 0.8), 0.3, Vec2::new(0.1, 0.2));
    maps.emission = Some(Texture { transform, ..Texture::new(image(4, field), Encoding::Srgb) });
    Material::varying(name, maps).emitting(radiance)
}

/// A textured lamp close over a plane, so that where it is bright can be seen on the plane, and the lamp itself.
pub fn textured_emitter(sensor: Sensor) -> Scene {
    let materials = vec![Material::diffuse("plane", Rgb::splat(0.6)), textured_lamp("lamp", Rgb::splat(5.0))];
    let mut g = Geometry::default();
    quad(&mut g, [v(-1.5, 0., 1.5), v(1.5, 0., 1.5), v(1.5, 0., -1.5), v(-1.5, 0., -1.5)], 1.0, 0);
    quad(&mut g, [v(-0.8, 0.6, -0.8), v(0.8, 0.6, -0.8), v(0.8, 0.7, 0.8), v(-0.8, 0.7, 0.8)], 1.0, 1);
    let sky = [Light::Environment { radiance: Rgb::splat(0.1) }];
    let camera = Camera::look_at(v(0.0, 0.35, 3.0), v(0.0, 0.3, 0.0), Vec3::Y, 0.8, sensor);
    Scene::new(g, materials, &sky, camera)
}

#[test]
fn agreement_on_a_normal_mapped_plane() {
    agreement("normal-mapped-plane", &normal_mapped_plane(scenes::square(16, Filter::Box)), &ALL, Compared::Scattered);
}

#[test]
fn agreement_on_a_coarse_mesh_with_smooth_normals() {
    agreement("smooth-octahedron", &smooth_octahedron(scenes::square(20, Filter::Box)), &ALL, Compared::Scattered);
}

#[test]
fn agreement_in_a_textured_room() {
    agreement("textured-room", &textured_room(scenes::square(16, Filter::Box)), &ALL, Compared::All);
}

#[test]
fn agreement_under_a_textured_emitter() {
    agreement("textured-emitter", &textured_emitter(scenes::square(16, Filter::Box)), &ALL, Compared::All);
}

/// The light on a plane from a textured emitter, by adding up its texels (Lambert: E = ∫ L cos cos / d² dA).
#[test]
fn a_textured_emitter_lights_a_point_as_its_texels_say() {
    let scene = textured_emitter(scenes::square(16, Filter::Box));
    let traced = scene.trace_ray(v(0.2, 0.1, 0.1), -Vec3::Y, PrimitiveId::NONE, |_| true);
    let at = scene.point_at(&traced.ray, &traced.hit.expect("the plane lies below"));
    // Next-event samples of all lights, those of the lamp counted; the numbers are Roberts's R3 sequence.
    let (count, mut sampled) = (1_u32 << 18, Rgb::ZERO);
    for i in 0..count {
        let fract = |alpha: f64| (0.5 + f64::from(i) * alpha).fract() as f32;
        let u = Vec2::new(fract(0.819_172_513_396_164_4), fract(0.671_043_606_703_789_2));
        let choice = Choice::from(fract(0.549_700_477_901_97));
        let (p, pdf) = scene.sample_next_event(&at, u.into(), choice, 0).expect("there are lights");
        let edge = pathspace::path::Edge::between(&at, &p);
        if at.normal.dot(edge.direction) > 0.0 && p.primitive != PrimitiveId::NONE {
            sampled += scene.le(&p, -edge.direction) * edge.geometry_factor() / pdf.0;
        }
    }
    sampled /= count as f32;
    let lamp = [v(-0.8, 0.6, -0.8), v(0.8, 0.6, -0.8), v(0.8, 0.7, 0.8), v(-0.8, 0.7, 0.8)];
    let texture = scene.materials()[1].maps.as_ref().and_then(|maps| maps.emission.clone()).expect("a textured lamp");
    let (n, mut expected) = (400_u32, Rgb::ZERO);
    let (across, along) = (lamp[1] - lamp[0], lamp[3] - lamp[0]);
    let normal = across.cross(along);
    for i in 0..n * n {
        let uv = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
        let to = lamp[0] + across * uv.x + along * uv.y - at.position;
        let radiance = 5.0 * Rgb::from(texture.lookup(uv).truncate());
        let (d, w) = (to.length_squared(), to.normalize());
        expected += radiance * (w.y * normal.dot(-w).max(0.0) / d) / (n * n) as f32;
    }
    let off = ((sampled - expected) / expected).abs().max_element();
    println!("sampled {sampled}, expected {expected}");
    assert!(off < 0.004, "sampled {sampled}, expected {expected}");
}

/// With the lamp as the only light, its density over its area, choice included, is a density.
#[test]
fn the_density_over_a_textured_emitter_integrates_to_one() {
    let scene = textured_room(scenes::square(16, Filter::Box));
    let (side, mut integral) = (512_u32, 0.0);
    let mut densities = (f32::INFINITY, 0.0_f32);
    for (_, primitive) in scene.lights().area_lights() {
        let area = f64::from(scene.geometry().area(primitive));
        for i in 0..side * side {
            let u = Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) / side as f32;
            let point = scene.point_on(primitive, u);
            let pdf = scene.lights().pdf_position(&point).0;
            densities = (densities.0.min(pdf), densities.1.max(pdf));
            assert!(pdf > 0.0, "at {u}");
            integral += f64::from(pdf) * area / f64::from(side * side);
        }
    }
    assert!((integral - 1.0).abs() < 1e-3, "{integral}");
    assert!(densities.1 > 10.0 * densities.0, "bright fields are sampled more: {densities:?}");
}
