//! The energy ledger of a closed scene: [outgoing] − [incoming] = [emitted] − [absorbed], material by material.
//!
//! Oracle: conservation of energy (lecture 14, *Energy balance*). Particles of light subpaths carry power; of what
//! arrives at a surface the fraction that it absorbs is known without sampling (1 − albedo by Lambert, Schlick, Fresnel
//! or a quadrature), and the lamps' power by their formulas. It would catch power that a walk gains or loses: η² on the
//! wrong side, a roulette that forgets its probability, absorption along the wrong edges, a lamp that emits more than
//! it says, a leak between surfaces.

use std::{f64::consts::PI, sync::Arc};

use glam::{DVec3, Vec2, Vec3};
use pathspace::{
    math::{Frame, Rgb},
    path::{Roulette, Step, Subpath},
    sampling::{Filter, Independent, Stream},
    scene::{
        Scene,
        bsdf::{Bsdf, Dielectric, Lobe, MetallicRoughness},
        camera::Camera,
        geometry::{Attributes, Geometry},
        light::{Light, Spot},
        material::{Maps, Material, MaterialId, Parameters},
        point::Point,
        texture::{Encoding, Image, Texels, Texture},
    },
    statistics::{Comparison, Estimate, Regions},
};
use rayon::prelude::*;

use crate::scenes;

const LAMP: Rgb = Rgb::new(5.0, 4.0, 3.0);
const BULB: Rgb = Rgb::new(0.5, 0.6, 0.9);
const SPOT: Rgb = Rgb::new(3.0, 2.0, 2.5);

/// A lamp whose texture is dark in one corner.
fn textured_lamp() -> Material {
    let texels = [[255_u8, 200, 180, 255], [90, 120, 200, 255], [20, 30, 10, 255], [200, 255, 220, 255]];
    let image = Image::new(2, 2, Texels::U8(texels.as_flattened().to_vec()));
    let factors = Parameters { base_color: Rgb::splat(0.3), ..Parameters::LAMBERT };
    let mut maps = Maps::new(factors);
    maps.emission = Some(Texture::new(Arc::new(image), Encoding::Srgb));
    Material::varying("textured lamp", maps).emitting(LAMP)
}

/// What absorbs: everything in one closed box. The walls are the first six.
fn materials() -> Vec<Material> {
    let glossy = |color, metallic, alpha| Bsdf::MetallicRoughness(MetallicRoughness::new(color, metallic, alpha));
    let frosted = Dielectric { color: Rgb::new(0.9, 1.0, 0.8), ior: 1.4, alpha: 0.4, transmission: 0.8 };
    let mut tinted = Material::glass("tinted glass", 1.5);
    tinted.absorption = Rgb::new(0.2, 0.9, 2.0);
    vec![
        Material::diffuse("white", Rgb::new(0.8, 0.7, 0.75)),
        Material::diffuse("dark", Rgb::new(0.1, 0.2, 0.3)),
        Material::new("plastic", glossy(Rgb::new(0.6, 0.2, 0.1), 0.0, 0.3)),
        Material::new("rough metal", glossy(Rgb::new(0.9, 0.7, 0.3), 1.0, 0.4)),
        Material::mirror("mirror", Rgb::new(0.9, 0.8, 0.6)),
        Material::diffuse("grey", Rgb::splat(0.5)),
        tinted,
        Material::new("frosted glass", Bsdf::Dielectric(frosted)),
        Material::pane("pane", 1.5),
        textured_lamp(),
    ]
}

fn room() -> Scene {
    let mut g = Geometry::default();
    scenes::cube_inside(&mut g, 1.0, [0, 1, 2, 3, 4, 5]);
    let v = Vec3::new;
    g.add_sphere(v(-0.45, -0.5, -0.4), 0.35, MaterialId(6));
    g.add_sphere(v(0.45, -0.5, 0.3), 0.35, MaterialId(7));
    scenes::quad(&mut g, [v(-0.3, 0.0, 0.2), v(0.4, 0.0, 0.1), v(0.4, 0.6, 0.1), v(-0.3, 0.6, 0.2)], 8);
    let corners = [v(-0.5, 0.8, -0.6), v(0.5, 0.8, -0.6), v(0.5, 0.85, 0.2), v(-0.5, 0.85, 0.2)];
    let uv = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let attributes = Attributes { uv: [uv.to_vec(), vec![], vec![], vec![]], ..Attributes::default() };
    g.add_triangles_with(&corners, None, &attributes, &[[0, 1, 2], [0, 2, 3]], MaterialId(9));
    let lights = [
        // Inside of the tinted glass.
        Light::Point { position: v(-0.4, -0.45, -0.35), intensity: BULB },
        Light::Spot(Spot::new(v(0.6, 0.6, 0.6), v(-0.6, -0.64, -0.48), SPOT, 0.3, 0.7)),
    ];
    let camera = Camera::look_at(v(0.0, 0.0, 0.9), Vec3::ZERO, Vec3::Y, 1.0, scenes::square(8, Filter::Box));
    Scene::new(g, materials(), &lights, camera)
}

/// The lamps' power: π ∫ L dA, 4π I, and I ∫ a² dω = 2π I (1 − cos θ_i + (cos θ_i − cos θ_o)/3).
fn emitted(scene: &Scene) -> DVec3 {
    const SIDE: u32 = 256;
    let lamp: DVec3 = scene
        .lights()
        .area_lights()
        .map(|(_, primitive)| {
            let at = |i: u32| (i as f32 + 0.5) / SIDE as f32;
            let place = |k: u32| scene.point_on(primitive, Vec2::new(at(k % SIDE), at(k / SIDE))).emission.as_dvec3();
            let mean = (0..SIDE * SIDE).map(place).sum::<DVec3>() / f64::from(SIDE * SIDE);
            mean * PI * f64::from(scene.geometry().area(primitive))
        })
        .sum();
    let (inner, outer) = (0.3_f64.cos(), 0.7_f64.cos());
    let cone = 2.0 * PI * (1.0 - inner + (inner - outer) / 3.0);
    lamp + BULB.as_dvec3() * 4.0 * PI + SPOT.as_dvec3() * cone
}

/// What a material sends on of the power that arrives from a direction, by the cosine against N_g (negative from
/// behind).
enum Albedo {
    /// The same from everywhere.
    Constant(DVec3),
    /// F_0 + (1 − F_0)(1 − cos θ)⁵.
    Schlick(DVec3),
    /// A quadrature of the BSDF at the cosines ±(i/N)².
    Table(Vec<[DVec3; 2]>),
}

const NODES: usize = 64;

impl Albedo {
    fn of(material: &Material) -> Self {
        match (material.name.as_str(), material.bsdf) {
            // Clear surfaces pass or reflect everything.
            ("tinted glass" | "pane", _) => Self::Constant(DVec3::ONE),
            ("mirror", _) => Self::Schlick(DVec3::new(0.9, 0.8, 0.6)),
            (_, Bsdf::Diffuse(diffuse)) => Self::Constant(diffuse.albedo.as_dvec3()),
            (_, bsdf) => Self::Table(
                (0..=NODES)
                    .into_par_iter()
                    .map(|i| {
                        let cos = (i as f64 / NODES as f64).powi(2).max(1e-4);
                        [cos, -cos].map(|z| directional(&bsdf, z))
                    })
                    .collect(),
            ),
        }
    }

    fn at(&self, cos: f64) -> DVec3 {
        match self {
            Self::Constant(a) => *a,
            Self::Schlick(f0) => *f0 + (1.0 - *f0) * (1.0 - cos.abs()).powi(5),
            Self::Table(table) => {
                let x = cos.abs().sqrt() * NODES as f64;
                let i = (x as usize).min(NODES - 1);
                let side = usize::from(cos < 0.0);
                table[i][side].lerp(table[i + 1][side], x - i as f64)
            }
        }
    }
}

/// The part of the power from a direction at the cosine z that leaves again, to either side: ∫ f |cos θ_camera|
/// dω_camera.
fn directional(bsdf: &Bsdf, z: f64) -> DVec3 {
    const SIDE: i32 = 192;
    let to_light = Vec3::new((1.0 - z * z).sqrt() as f32, 0.0, z as f32);
    let mut sum = DVec3::ZERO;
    for i in 0..SIDE {
        let cos2 = (f64::from(i) + 0.5) / f64::from(SIDE);
        for j in 0..SIDE {
            let (sin, x) = (PI * (f64::from(j) + 0.5) / f64::from(SIDE)).sin_cos();
            let r = (1.0 - cos2).sqrt();
            for up in [1.0, -1.0] {
                let to_camera = Vec3::new((r * x) as f32, (r * sin) as f32, (up * cos2.sqrt()) as f32);
                sum += bsdf.eval(Lobe::Continuous, to_camera, to_light).f.as_dvec3();
            }
        }
    }
    sum * PI / f64::from(SIDE * SIDE)
}

/// The part of light that passes from one vertex to the next: they lie in glass if either boundary is seen from behind.
fn transmittance(materials: &[Material], a: &Point, b: &Point) -> DVec3 {
    let ab = b.position.as_dvec3() - a.position.as_dvec3();
    let behind = |p: &Point, w: DVec3| matches!(p.bsdf, Bsdf::Dielectric(_)) && p.normal.as_dvec3().dot(w) < 0.0;
    let glass = [(b, -ab), (a, ab)].into_iter().find(|(p, w)| behind(p, *w));
    let sigma = glass.map_or(DVec3::ZERO, |(p, _)| materials[p.material.0 as usize].absorption.as_dvec3());
    (-sigma * ab.length()).exp()
}

/// What particles brought to one material, took away, and should have left there.
#[derive(Clone, Copy, Default)]
struct Account {
    incoming: DVec3,
    outgoing: DVec3,
    absorbed: DVec3,
}

/// All accounts of one replicate.
struct Ledger {
    emitted: DVec3,
    in_glass: DVec3,
    accounts: Vec<Account>,
}

impl Ledger {
    fn of(scene: &Scene, albedos: &[Albedo], seed: u64, particles: u32) -> Self {
        let mut ledger =
            Self { emitted: DVec3::ZERO, in_glass: DVec3::ZERO, accounts: vec![Account::default(); albedos.len()] };
        let mut subpath = Subpath::with_capacity(LONGEST);
        for i in 0..particles {
            let mut sampler = Independent::new(seed, i, 0, Stream::Light);
            subpath.walk_from_light(scene, 0, LONGEST, Roulette::FromDepth(5), &mut sampler);
            ledger.enter(scene.materials(), albedos, subpath.steps());
        }
        let n = f64::from(particles);
        ledger.emitted /= n;
        ledger.in_glass /= n;
        for a in &mut ledger.accounts {
            *a = Account { incoming: a.incoming / n, outgoing: a.outgoing / n, absorbed: a.absorbed / n };
        }
        ledger
    }

    fn enter(&mut self, materials: &[Material], albedos: &[Albedo], steps: &[Step]) {
        for (k, pair) in steps.windows(2).enumerate() {
            let [from, to] = [&pair[0], &pair[1]];
            let passed = transmittance(materials, &from.vertex.point, &to.vertex.point);
            let arriving = to.beta.as_dvec3();
            let leaving = arriving / passed;
            self.in_glass += leaving - arriving;
            match k {
                0 => self.emitted += leaving,
                _ => self.accounts[from.vertex.point.material.0 as usize].outgoing += leaving,
            }
            let p = &to.vertex.point;
            let account = &mut self.accounts[p.material.0 as usize];
            account.incoming += arriving;
            let cos = Frame::around(p.normal).to_local(to.back.direction).z;
            account.absorbed += arriving * (1.0 - albedos[p.material.0 as usize].at(f64::from(cos)));
        }
    }

    fn absorbed(&self) -> DVec3 {
        self.in_glass + self.accounts.iter().map(|a| a.absorbed).sum::<DVec3>()
    }
}

/// So many vertices that what walks still carry there is nothing.
const LONGEST: u32 = 250;

/// Holds a balance that should be zero, in parts of `scale`, to that; a bias of `visible` of the scale must show.
#[track_caller]
fn assert_balance(what: &str, balances: &[DVec3], scale: DVec3, visible: f64) {
    let parts: Vec<Regions> = balances.iter().map(|b| (1.0 + *b / scale).to_array().to_vec()).collect();
    let estimate = Estimate::new(&parts);
    let p = |bias: f64| estimate.biased(bias).p_of_mean(1.0);
    let seen = Comparison::new(&estimate, &estimate.exact()).visible_bias;
    let off = 100.0 * (estimate.image_mean() - 1.0);
    println!("  {what}: of {:.4}, off by {off:.3} %, p = {:.1e}, visible {:.2} %", scale.x, p(0.0), 100.0 * seen);
    assert!(p(0.0) > 1e-4, "{what}: {off} % are missing");
    assert!(p(visible).min(p(-visible)) < 1e-4, "{what}: a bias of {visible} would go unnoticed ({seen})");
}

#[test]
fn energy_is_conserved_material_by_material() {
    let scene = room();
    let albedos: Vec<_> = scene.materials().iter().map(Albedo::of).collect();
    let ledgers: Vec<_> = (0..24_u64).into_par_iter().map(|r| Ledger::of(&scene, &albedos, 4000 + r, 40_000)).collect();
    let of = |f: &dyn Fn(&Ledger) -> DVec3| ledgers.iter().map(f).collect::<Vec<_>>();
    let mean = |f: &dyn Fn(&Ledger) -> DVec3| of(f).iter().sum::<DVec3>() / ledgers.len() as f64;
    let power = emitted(&scene);
    assert_balance("emitted, by the lamps' formulas", &of(&|l| l.emitted - power), power, 0.005);
    assert_balance("emitted less absorbed", &of(&|l| l.emitted - l.absorbed()), power, 0.005);
    assert_balance("the lamps' power less absorbed", &of(&|l| power - l.absorbed()), power, 0.005);
    for (i, material) in scene.materials().iter().enumerate() {
        let balance = |l: &Ledger| {
            let a = l.accounts[i];
            a.outgoing + a.absorbed - a.incoming
        };
        let incoming = mean(&|l: &Ledger| l.accounts[i].incoming);
        assert_balance(&material.name, &of(&balance), incoming, 0.005);
    }
    let glass = mean(&|l: &Ledger| l.in_glass);
    println!("  the tinted glass keeps {glass:.4} of {power:.4}");
    assert!(glass.min_element() > 0.01 * power.min_element(), "absorption has to matter");
}
