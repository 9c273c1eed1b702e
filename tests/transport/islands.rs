//! Scenes whose surfaces float apart, so that ∫G² is finite and every strategy has a finite variance by itself: one of
//! each kind of material, of light and of camera.

use glam::{DAffine3, DQuat, DVec3, Vec3};
use pathspace::{
    math::Rgb,
    scene::{
        Scene,
        bsdf::{Bsdf, MetallicRoughness},
        camera::{Camera, Sensor},
        geometry::Geometry,
        light::{Light, Spot},
        material::{AlphaMode, EmissionSides, Maps, Material, MaterialId, Parameters},
    },
};

use crate::{
    instances::{Copies, Part, place},
    lights::sky,
    textures::{coarse_sphere, quad, textured_lamp, waves},
};

/// What the ball and the panel are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    Diffuse,
    Glossy,
    Mirror,
    Glass,
    NormalMapped,
    Veiled,
}

impl Content {
    pub const ALL: [Self; 6] =
        [Self::Diffuse, Self::Glossy, Self::Mirror, Self::Glass, Self::NormalMapped, Self::Veiled];
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    Area,
    Textured,
    Point,
    Spot,
    Sun,
    Environment,
    Map,
    Mixed,
}

impl Lamp {
    pub const ALL: [Self; 8] =
        [Self::Area, Self::Textured, Self::Point, Self::Spot, Self::Sun, Self::Environment, Self::Map, Self::Mixed];
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    Pinhole,
    Lens,
    Orthographic,
}

impl View {
    pub const ALL: [Self; 3] = [Self::Pinhole, Self::Lens, Self::Orthographic];

    fn camera(self, sensor: Sensor) -> Camera {
        let (eye, target) = (v(0.2, 0.3, 1.7), v(0.0, -0.4, -0.3));
        match self {
            Self::Pinhole => Camera::look_at(eye, target, Vec3::Y, 1.3, sensor),
            Self::Lens => Camera::look_at(eye, target, Vec3::Y, 1.3, sensor).with_lens(0.15, 2.0),
            Self::Orthographic => Camera::orthographic(eye, target, Vec3::Y, 1.6, sensor),
        }
    }
}

/// What is around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Around {
    /// A sphere seen from inside that glows: no walk ends in the dark, and G between its points is constant.
    Wall,
    Nothing,
}

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// The materials that every scene has: the ground, the lamp, the wall.
fn common(lamp: Lamp) -> Vec<Material> {
    let mut wall = Material::diffuse("wall", Rgb::new(0.4, 0.45, 0.5)).emitting(Rgb::new(0.6, 0.5, 0.4));
    wall.emission_sides = EmissionSides::Both;
    let radiance = Rgb::new(3.0, 2.5, 2.0);
    let lamp = match lamp {
        Lamp::Textured => textured_lamp("lamp", 2.0 * radiance),
        _ => Material::diffuse("lamp", Rgb::splat(0.3)).emitting(radiance),
    };
    vec![Material::diffuse("ground", Rgb::new(0.6, 0.5, 0.45)), lamp, wall]
}

fn around(g: &mut Geometry, around: Around) {
    if around == Around::Wall {
        g.add_sphere(Vec3::ZERO, 2.0, MaterialId(2));
    }
}

fn ground(g: &mut Geometry) {
    quad(g, [v(-1., -1., 1.), v(1., -1., 1.), v(1., -1., -1.), v(-1., -1., -1.)], 2.0, 0);
}

/// A ball and a panel over a ground, lit by `lamp`.
pub fn islands(content: Content, lamp: Lamp, view: View, surroundings: Around, sensor: Sensor) -> Scene {
    let gloss = |color, metallic, alpha| Bsdf::MetallicRoughness(MetallicRoughness::new(color, metallic, alpha));
    let green = Material::diffuse("green", Rgb::new(0.3, 0.6, 0.4));
    let red = Material::diffuse("red", Rgb::new(0.6, 0.3, 0.2));
    let veiled = |material: Material, factor| material.covering(AlphaMode::Blend { factor });
    let (ball, panel) = match content {
        Content::Diffuse | Content::NormalMapped => (green, red),
        Content::Glossy => (
            Material::new("brass", gloss(Rgb::new(0.9, 0.7, 0.4), 1.0, 0.4)),
            Material::new("plastic", gloss(Rgb::new(0.6, 0.2, 0.1), 0.0, 0.3)),
        ),
        Content::Mirror => (Material::mirror("mirror", Rgb::splat(0.9)), red),
        Content::Glass => {
            let mut glass = Material::glass("glass", 1.5);
            glass.absorption = Rgb::new(0.2, 0.4, 0.9);
            (glass, red)
        }
        Content::Veiled => (veiled(green, 0.6), veiled(red, 0.4)),
    };
    let mut materials = common(lamp);
    if content == Content::NormalMapped {
        let mut maps = Maps::new(Parameters { base_color: Rgb::splat(0.6), ..Parameters::LAMBERT });
        maps.normal = Some(waves(1.0));
        materials[0] = Material::varying("waves", maps);
    }
    materials.extend([ball, panel]);
    let mut g = Geometry::default();
    around(&mut g, surroundings);
    ground(&mut g);
    if content == Content::NormalMapped {
        coarse_sphere(&mut g, v(-0.4, -0.35, -0.3), 0.4, 3);
    } else {
        g.add_sphere(v(-0.4, -0.35, -0.3), 0.4, MaterialId(3));
    }
    quad(&mut g, [v(0.25, -0.7, -0.4), v(0.85, -0.7, -0.5), v(0.85, 0.0, -0.6), v(0.25, 0.0, -0.5)], 1.0, 4);
    if matches!(lamp, Lamp::Area | Lamp::Textured | Lamp::Mixed) {
        quad(&mut g, [v(-0.6, 1.0, -0.7), v(0.6, 1.1, -0.7), v(0.6, 1.0, 0.5), v(-0.6, 0.9, 0.5)], 1.0, 1);
    }
    let point = Light::Point { position: v(-0.9, 0.9, 0.6), intensity: Rgb::new(1.0, 1.2, 1.5) };
    let axis = v(-0.48, -0.8, -0.36);
    let spot = Light::Spot(Spot::new(v(0.9, 0.8, 0.6), axis, Rgb::new(5.0, 4.0, 3.0), 0.4, 0.8));
    let sun = Light::Directional { towards: v(-0.48, 0.8, 0.36), irradiance: Rgb::splat(1.5) };
    let others = match lamp {
        Lamp::Area | Lamp::Textured => vec![],
        Lamp::Point => vec![point],
        Lamp::Spot => vec![spot],
        Lamp::Sun => vec![sun],
        Lamp::Environment => vec![Light::Environment { radiance: Rgb::new(0.5, 0.6, 0.7) }],
        Lamp::Map => vec![sky(0.0)],
        Lamp::Mixed => vec![point, spot, sun, sky(0.5)],
    };
    Scene::new(g, materials, &others, view.camera(sensor))
}

/// Two lamps and two pyramids of one mesh each, all mirrored, stretched or turned.
pub fn mirrored_instances(sensor: Sensor) -> Scene {
    let mut materials = common(Lamp::Area);
    let gloss = MetallicRoughness::new(Rgb::new(0.9, 0.7, 0.4), 1.0, 0.4);
    materials.push(Material::new("brass", Bsdf::MetallicRoughness(gloss)));
    let mut g = Geometry::default();
    around(&mut g, Around::Wall);
    ground(&mut g);
    let turn = |angle: f64| DQuat::from_axis_angle(DVec3::new(0.2, 1.0, 0.1).normalize(), angle);
    let at = |s: [f64; 3], angle: f64, t: [f64; 3]| {
        DAffine3::from_scale_rotation_translation(s.into(), turn(angle), t.into())
    };
    let panel = vec![v(-1., 0., -1.), v(1., 0., -1.), v(1., 0.3, 1.), v(-1., 0.3, 1.)];
    let lamp: [Part; 1] = [(panel, None, vec![[0, 1, 2], [0, 2, 3]], 1)];
    place(
        &mut g,
        &lamp,
        &[at([-0.4, 0.5, 0.4], 0.4, [-0.5, 0.9, 0.0]), at([0.4, 0.3, 0.3], 1.2, [0.5, 0.9, -0.2])],
        Copies::Instances,
    );
    let p = [v(-1., 0., -1.), v(1., 0., -1.), v(1., 0., 1.), v(-1., 0., 1.), v(0., 1.5, 0.)];
    let n = p.map(|p| (p - v(0.0, 0.2, 0.0)).normalize()).to_vec();
    let pyramid: [Part; 1] = [(p.to_vec(), Some(n), vec![[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]], 3)];
    let pyramids = [at([0.3, 0.3, 0.3], 0.3, [-0.4, -0.6, -0.3]), at([0.25, 0.5, -0.35], 0.9, [0.45, -0.7, -0.2])];
    place(&mut g, &pyramid, &pyramids, Copies::Instances);
    Scene::new(g, materials, &[], View::Pinhole.camera(sensor))
}
