//! The scenes that the tests render: those of `scenes/`, and small ones built here.

use std::{path::Path, sync::Arc};

use glam::{Vec2, Vec3};
use pathspace::{
    integrator::IntegratorKind,
    io,
    math::Rgb,
    sampling::Filter,
    scene::{
        Scene,
        bsdf::{Bsdf, Dielectric, MetallicRoughness},
        camera::{Camera, Sensor},
        geometry::{Attributes, Geometry},
        light::Light,
        material::{AlphaMode, EmissionSides, Maps, Material, MaterialId, Parameters, VertexColors},
        texture::{Encoding, Image, Texels, Texture},
    },
};

/// The committed scenes.
pub const FILES: [&str; 6] =
    ["cornell-box", "cornell-spheres", "veach-room", "caustic-ring", "caustic-sphere", "furnace"];

/// The integrators with a low variance wherever surfaces touch: multiple importance sampling tames every strategy of
/// theirs.
pub const WEIGHTED: [IntegratorKind; 4] =
    [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt];

/// The integrators whose every pass estimates the image itself.
pub const UNBIASED: [IntegratorKind; 7] = [
    IntegratorKind::Path,
    IntegratorKind::Light,
    IntegratorKind::Hybrid,
    IntegratorKind::Bdpt,
    IntegratorKind::PathHemisphere,
    IntegratorKind::PathLight,
    IntegratorKind::Area,
];

#[test]
fn all_that_do_not_merge_are_unbiased() {
    let rest: Vec<_> = IntegratorKind::ALL.into_iter().filter(|kind| !kind.merges()).collect();
    assert_eq!(rest, UNBIASED);
}

/// A square sensor with the padding of `filter`.
pub fn square(side: u32, filter: Filter) -> Sensor {
    Sensor { width: side, height: side, padding: filter.padding() }
}

/// A scene of `scenes/` with its first camera, looked at through `sensor`.
pub fn load(name: &str, sensor: Sensor) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("glb");
    load_file(&path, sensor)
}

/// Any glTF file with its first camera.
pub fn load_file(path: &Path, sensor: Sensor) -> Scene {
    let loaded = io::load(path).unwrap_or_else(|e| panic!("{e}"));
    let camera = loaded.cameras[0].to_camera(sensor);
    Scene::new(loaded.geometry, loaded.materials, &[], camera)
}

/// Two triangles a, b, c and a, c, d; front where they are counter-clockwise.
pub fn quad(geometry: &mut Geometry, corners: [Vec3; 4], material: u32) {
    geometry.add_triangles(&corners, None, &[[0, 1, 2], [0, 2, 3]], MaterialId(material));
}

/// The inside of the cube [−half, half]³ (its fronts face inwards), each side with the material of the same place in
/// `materials`: −x, +x, −y, +y, −z, +z.
pub fn cube_inside(geometry: &mut Geometry, half: f32, materials: [u32; 6]) {
    cube_inside_at(geometry, Vec3::ZERO, half, materials);
}

/// The same around `middle`.
pub fn cube_inside_at(geometry: &mut Geometry, middle: Vec3, half: f32, materials: [u32; 6]) {
    let v = |x: f32, y: f32, z: f32| middle + half * Vec3::new(x, y, z);
    let sides = [
        [v(-1., -1., -1.), v(-1., 1., -1.), v(-1., 1., 1.), v(-1., -1., 1.)],
        [v(1., -1., -1.), v(1., -1., 1.), v(1., 1., 1.), v(1., 1., -1.)],
        [v(-1., -1., -1.), v(-1., -1., 1.), v(1., -1., 1.), v(1., -1., -1.)],
        [v(-1., 1., -1.), v(1., 1., -1.), v(1., 1., 1.), v(-1., 1., 1.)],
        [v(-1., -1., -1.), v(1., -1., -1.), v(1., 1., -1.), v(-1., 1., -1.)],
        [v(-1., -1., 1.), v(-1., 1., 1.), v(1., 1., 1.), v(1., -1., 1.)],
    ];
    for (corners, material) in sides.into_iter().zip(materials) {
        quad(geometry, corners, material);
    }
}

fn glossy(base_color: Rgb, metallic: f32, roughness: f32) -> Bsdf {
    Bsdf::MetallicRoughness(MetallicRoughness::new(base_color, metallic, roughness * roughness))
}

/// A small room with one of every material, every light that a scene can hold, smooth normals and an absorbing volume:
/// not pretty, but every term of the core differs from 1 in it.
pub fn zoo(sensor: Sensor) -> Scene {
    let rough_glass =
        Bsdf::Dielectric(Dielectric { color: Rgb::new(0.9, 1.0, 0.8), ior: 1.4, alpha: 0.2, transmission: 1.0 });
    let mut glass = Material::glass("tinted glass", 1.5);
    glass.absorption = Rgb::new(0.2, 0.9, 2.0);
    let mut lamp = Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(9.0, 7.0, 4.0));
    lamp.emission_sides = EmissionSides::Both;
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.7, 0.72, 0.68)),
        Material::new("plastic", glossy(Rgb::new(0.6, 0.1, 0.1), 0.0, 0.5)),
        Material::new("brass", glossy(Rgb::new(0.9, 0.7, 0.3), 1.0, 0.4)),
        Material::new("varnish", glossy(Rgb::new(0.2, 0.3, 0.7), 0.0, 0.0)),
        Material::mirror("mirror", Rgb::splat(0.9)),
        glass,
        Material::new("frosted glass", rough_glass),
        Material::pane("pane", 1.5),
        lamp,
    ];
    let mut g = Geometry::default();
    cube_inside(&mut g, 1.0, [1, 2, 0, 0, 3, 0]);
    let v = Vec3::new;
    // A pyramid with smooth normals: N_s and N_g differ everywhere on it.
    let positions =
        [v(-0.9, -1.0, -0.9), v(-0.1, -1.0, -0.9), v(-0.1, -1.0, -0.1), v(-0.9, -1.0, -0.1), v(-0.5, -0.4, -0.5)];
    let normals = positions.map(|p| (p - v(-0.5, -0.9, -0.5)).normalize());
    g.add_triangles(&positions, Some(&normals), &[[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]], MaterialId(2));
    g.add_sphere(v(0.45, -0.65, -0.4), 0.3, MaterialId(5));
    g.add_sphere(v(-0.5, 0.2, -0.5), 0.25, MaterialId(6));
    g.add_sphere(v(0.55, 0.1, -0.6), 0.25, MaterialId(4));
    quad(&mut g, [v(-0.3, -0.9, 0.2), v(0.3, -0.9, 0.1), v(0.3, -0.3, 0.1), v(-0.3, -0.3, 0.2)], 7);
    quad(&mut g, [v(-0.3, 0.8, -0.3), v(0.3, 0.8, -0.3), v(0.3, 0.85, 0.3), v(-0.3, 0.85, 0.3)], 8);
    g.add_sphere(v(0.7, -0.8, 0.3), 0.1, MaterialId(8));
    let others = [
        Light::Point { position: v(-0.6, 0.6, 0.6), intensity: Rgb::new(0.5, 0.6, 0.9) },
        Light::Directional { towards: v(0.3, 0.8, 0.4).normalize(), irradiance: Rgb::splat(2.0) },
        Light::Environment { radiance: Rgb::new(0.3, 0.4, 0.5) },
    ];
    let camera = Camera::look_at(v(0.1, 0.1, 0.95), v(0.0, -0.1, -1.0), Vec3::Y, 1.4, sensor);
    Scene::new(g, materials, &others, camera)
}

/// The pyramid, the spheres and the lights of [`zoo`] without its walls: rays leave the scene.
pub fn open_zoo(sensor: Sensor) -> Scene {
    let materials = vec![
        Material::diffuse("ground", Rgb::new(0.5, 0.45, 0.4)),
        Material::glass("glass", 1.5),
        Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::new(20.0, 15.0, 9.0)),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    quad(&mut g, [v(-2., 0., -2.), v(-2., 0., 2.), v(2., 0., 2.), v(2., 0., -2.)], 0);
    g.add_sphere(v(0.0, 0.6, 0.0), 0.5, MaterialId(1));
    quad(&mut g, [v(0.8, 1.5, -0.2), v(1.2, 1.5, -0.2), v(1.2, 1.5, 0.2), v(0.8, 1.5, 0.2)], 2);
    let others = [
        Light::Point { position: v(-1.0, 1.2, 0.6), intensity: Rgb::new(1.5, 1.6, 2.0) },
        Light::Directional { towards: v(0.3, 0.8, 0.4).normalize(), irradiance: Rgb::splat(1.0) },
        Light::Environment { radiance: Rgb::new(0.3, 0.4, 0.5) },
    ];
    let camera = Camera::look_at(v(0.0, 1.4, 3.0), v(0.0, 0.4, 0.0), Vec3::Y, 0.9, sensor);
    Scene::new(g, materials, &others, camera)
}

/// A diffuse material whose texture's alpha takes several values, among them 0 and 1, and is multiplied by vertex
/// colours.
pub fn leafy(name: &str, emission: Rgb) -> Material {
    let texels = [[200, 90, 60, 255], [90, 180, 90, 0], [60, 90, 200, 120], [220, 220, 120, 200]];
    let image = Image::new(2, 2, Texels::U8(texels.as_flattened().to_vec()));
    let mut maps = Maps::new(Parameters::LAMBERT);
    maps.base_color = Some(Texture::new(Arc::new(image), Encoding::Srgb));
    maps.vertex_colors = VertexColors::BaseColor;
    Material::varying(name, maps).emitting(emission)
}

/// A quad with texture coordinates, and vertex colours whose alpha varies.
pub fn leaf(geometry: &mut Geometry, corners: [Vec3; 4], material: u32) {
    let uv = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|uv| uv * 1.5);
    let colors = [[65535; 4], [65535, 40000, 65535, 50000], [40000, 65535, 65535, 65535], [65535; 4]];
    let attributes =
        Attributes { uv: [uv.to_vec(), vec![], vec![], vec![]], colors: colors.to_vec(), ..Attributes::default() };
    geometry.add_triangles_with(&corners, None, &attributes, &[[0, 1, 2], [0, 2, 3]], MaterialId(material));
}

/// A room of surfaces that are there in part: before the camera, before the lights, between all else and across each
/// other; of one of every material, among them a lamp and glass, and masked ones that are there wholly or not at all.
pub fn veiled(sensor: Sensor) -> Scene {
    let blend = |material: Material, factor| material.covering(AlphaMode::Blend { factor });
    let mask = |material: Material, factor| material.covering(AlphaMode::Mask { factor, cutoff: 0.5 });
    let gloss = Bsdf::MetallicRoughness(MetallicRoughness::new(Rgb::new(0.7, 0.4, 0.3), 0.3, 0.2));
    let mut glass = Material::glass("glass", 1.5);
    glass.absorption = Rgb::new(0.2, 0.9, 2.0);
    let mut lamp = Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(9.0, 7.0, 4.0));
    lamp.emission_sides = EmissionSides::Both;
    let white = Material::diffuse("white", Rgb::new(0.7, 0.72, 0.68));
    let materials = vec![
        white.clone(),
        blend(Material::diffuse("veil", Rgb::new(0.3, 0.5, 0.7)), 0.4),
        blend(Material::new("gloss", gloss), 0.7),
        blend(glass, 0.5),
        blend(lamp.clone(), 0.6),
        mask(white.clone(), 0.8),
        mask(white, 0.3),
        blend(Material::pane("pane", 1.5), 0.5),
        mask(lamp.clone(), 0.2),
        lamp,
        blend(leafy("leaves", Rgb::ZERO), 0.9),
        mask(leafy("holes", Rgb::ZERO), 0.9),
        blend(leafy("shining leaves", Rgb::new(2.0, 3.0, 1.0)), 0.9),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    leaf(&mut g, [v(-0.9, -0.6, 0.3), v(0.9, -0.6, 0.2), v(0.9, 0.8, 0.2), v(-0.9, 0.8, 0.3)], 10);
    leaf(&mut g, [v(-0.9, -0.7, 0.0), v(0.4, -0.7, -0.5), v(0.4, 0.5, -0.5), v(-0.9, 0.5, 0.0)], 11);
    leaf(&mut g, [v(-0.6, 0.5, -0.5), v(0.6, 0.5, -0.5), v(0.6, 0.55, 0.5), v(-0.6, 0.55, 0.5)], 12);
    // The sky shines in through a ceiling and a wall that are there in part.
    cube_inside(&mut g, 1.0, [0, 2, 0, 1, 0, 0]);
    quad(&mut g, [v(-1., -1., 0.6), v(1., -1., 0.6), v(1., 1., 0.6), v(-1., 1., 0.6)], 1);
    quad(&mut g, [v(-1., -1., 0.4), v(1., -1., 0.7), v(1., 1., 0.7), v(-1., 1., 0.4)], 2);
    quad(&mut g, [v(-0.9, -0.4, -0.9), v(0.9, -0.4, -0.9), v(0.9, -0.3, 0.3), v(-0.9, -0.3, 0.3)], 1);
    quad(&mut g, [v(-0.4, 0.9, -0.4), v(0.4, 0.9, -0.4), v(0.4, 0.9, 0.4), v(-0.4, 0.9, 0.4)], 9);
    quad(&mut g, [v(-0.5, 0.7, -0.5), v(0.5, 0.75, -0.5), v(0.5, 0.7, 0.5), v(-0.5, 0.75, 0.5)], 1);
    quad(&mut g, [v(-0.8, -0.2, -0.7), v(-0.4, -0.2, -0.8), v(-0.4, 0.4, -0.8), v(-0.8, 0.4, -0.7)], 4);
    quad(&mut g, [v(0.1, -0.9, -0.1), v(0.6, -0.9, -0.2), v(0.6, -0.5, -0.2), v(0.1, -0.5, -0.1)], 5);
    quad(&mut g, [v(-0.3, -0.2, 0.1), v(0.3, -0.2, 0.0), v(0.3, 0.3, 0.0), v(-0.3, 0.3, 0.1)], 6);
    quad(&mut g, [v(-0.7, -0.9, 0.1), v(-0.1, -0.9, 0.2), v(-0.1, -0.5, 0.2), v(-0.7, -0.5, 0.1)], 7);
    quad(&mut g, [v(0.3, 0.0, -0.8), v(0.8, 0.0, -0.7), v(0.8, 0.4, -0.7), v(0.3, 0.4, -0.8)], 8);
    g.add_sphere(v(-0.45, -0.65, -0.4), 0.3, MaterialId(3));
    g.add_sphere(v(0.55, -0.1, -0.5), 0.25, MaterialId(2));
    g.add_sphere(v(0.0, 0.2, -0.6), 0.15, MaterialId(4));
    let others = [
        Light::Point { position: v(-0.6, 0.6, 0.3), intensity: Rgb::new(0.5, 0.6, 0.9) },
        Light::Directional { towards: v(0.3, 0.8, 0.4).normalize(), irradiance: Rgb::splat(2.0) },
        Light::Environment { radiance: Rgb::new(0.6, 0.8, 1.0) },
    ];
    let camera = Camera::look_at(v(0.1, 0.1, 0.95), v(0.0, -0.1, -1.0), Vec3::Y, 1.4, sensor);
    Scene::new(g, materials, &others, camera)
}

/// A closed cube whose walls all have this albedo and emit this radiance, seen from inside: L = L_e Σ a^k everywhere.
pub fn furnace(albedo: f32, radiance: f32, sensor: Sensor) -> Scene {
    scaled_furnace(albedo, radiance, 1.0, sensor)
}

/// The same in a cube of another size, with the camera at the same place in it.
pub fn scaled_furnace(albedo: f32, radiance: f32, scale: f32, sensor: Sensor) -> Scene {
    let mut g = Geometry::default();
    cube_inside(&mut g, scale, [0; 6]);
    let wall = Material::diffuse("wall", Rgb::splat(albedo)).emitting(Rgb::splat(radiance));
    let camera =
        Camera::look_at(scale * Vec3::new(0.2, -0.1, 0.7), scale * Vec3::new(-0.3, 0.2, -1.0), Vec3::Y, 1.2, sensor);
    Scene::new(g, vec![wall], &[], camera)
}

/// The same inside a sphere, which emits on both sides; the camera is off its middle.
pub fn sphere_furnace(albedo: f32, radiance: f32, sensor: Sensor) -> Scene {
    let mut g = Geometry::default();
    g.add_sphere(Vec3::new(0.3, 0.2, -0.1), 1.5, MaterialId(0));
    let mut wall = Material::diffuse("wall", Rgb::splat(albedo)).emitting(Rgb::splat(radiance));
    wall.emission_sides = EmissionSides::Both;
    let camera = Camera::look_at(Vec3::new(0.8, -0.1, 0.7), Vec3::new(-0.3, 0.2, -1.0), Vec3::Y, 1.2, sensor);
    Scene::new(g, vec![wall], &[], camera)
}

/// A room open to the sky, in which the first integrators of the lecture have a low variance: most walks end in light,
/// its lamp is large and touches nothing. Every kind of material is there, deltas beside continuous parts among them.
pub fn courtyard(others: &[Light], sensor: Sensor) -> Scene {
    let materials = vec![
        Material::diffuse("white", Rgb::new(0.7, 0.72, 0.68)),
        Material::new("plastic", glossy(Rgb::new(0.6, 0.1, 0.1), 0.0, 0.7)),
        Material::new("brass", glossy(Rgb::new(0.9, 0.7, 0.3), 1.0, 0.8)),
        Material::new("varnish", glossy(Rgb::new(0.2, 0.3, 0.7), 0.0, 0.0)),
        Material::mirror("mirror", Rgb::splat(0.9)),
        Material::new(
            "frosted glass",
            Bsdf::Dielectric(Dielectric { color: Rgb::new(0.9, 1.0, 0.8), ior: 1.4, alpha: 0.6, transmission: 0.3 }),
        ),
        Material::diffuse("lamp", Rgb::splat(0.3)).emitting(Rgb::new(2.0, 1.5, 1.0)),
    ];
    let mut g = Geometry::default();
    let v = Vec3::new;
    quad(&mut g, [v(-1., -1., -1.), v(-1., -1., 1.), v(1., -1., 1.), v(1., -1., -1.)], 0);
    quad(&mut g, [v(-1., -1., -1.), v(-1., 0.2, -1.), v(-1., 0.2, 1.), v(-1., -1., 1.)], 1);
    quad(&mut g, [v(1., -1., -1.), v(1., -1., 1.), v(1., 0.2, 1.), v(1., 0.2, -1.)], 2);
    quad(&mut g, [v(-1., -1., -1.), v(1., -1., -1.), v(1., 0.2, -1.), v(-1., 0.2, -1.)], 3);
    quad(&mut g, [v(-0.6, 0.7, -0.6), v(0.6, 0.7, -0.6), v(0.6, 0.7, 0.6), v(-0.6, 0.7, 0.6)], 6);
    g.add_sphere(v(-0.45, -0.5, -0.4), 0.3, MaterialId(4));
    g.add_sphere(v(0.45, -0.5, -0.4), 0.3, MaterialId(5));
    let sky = Light::Environment { radiance: Rgb::new(0.4, 0.5, 0.6) };
    let camera = Camera::look_at(v(0.1, 0.3, 1.6), v(0.0, -0.4, -1.0), Vec3::Y, 0.9, sensor);
    Scene::new(g, materials, &[&[sky], others].concat(), camera)
}
