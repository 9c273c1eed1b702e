//! The scenes of `scenes/` whose light passes water or glass, and the one that little light enters: each under a lamp
//! that is wide enough for path tracing to find all of it, and by the definition as it is.

use std::path::Path;

use glam::Vec3;
use pathspace::{
    integrator::IntegratorKind,
    io,
    math::Rgb,
    path::{Densities, JoinedPath},
    render::Settings,
    sampling::Filter,
    scene::{Scene, camera::Sensor, material::Material},
};

use crate::{
    agreement::{self, Run, assert_agree, each_other},
    identity::assert_identity_by,
    scenes,
};

/// How the small lamp of a scene is replaced.
struct Wide {
    scene: &'static str,
    /// The middle of a square lamp that faces down, and half its side; `None` where the scene has a wide one besides.
    lamp: Option<(Vec3, f32)>,
    /// The radius of merges, m.
    radius: f32,
}

const WIDE: [Wide; 5] = [
    Wide { scene: "pool", lamp: Some((Vec3::new(0.0, 2.9, 0.0), 2.5)), radius: 0.04 },
    Wide { scene: "bulb", lamp: Some((Vec3::new(2.1, 2.65, 1.9), 1.5)), radius: 0.02 },
    Wide { scene: "glass-of-water", lamp: None, radius: 0.002 },
    Wide { scene: "door-ajar", lamp: Some((Vec3::new(2.0, 2.55, 4.65), 0.8)), radius: 0.02 },
    Wide { scene: "gem", lamp: None, radius: 0.0005 },
];

impl Wide {
    /// The scene with its small lamp dark.
    fn lit(&self, sensor: Sensor) -> Scene {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(self.scene).with_extension("glb");
        let mut loaded = io::load(&file).unwrap_or_else(|e| panic!("{e}"));
        let small = loaded.materials.iter_mut().find(|material| material.name == "lamp").expect("a lamp");
        small.emission = Rgb::ZERO;
        if let Some((middle, half)) = self.lamp {
            let corner = |x: f32, z: f32| middle + half * Vec3::new(x, 0.0, z);
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            let material = loaded.materials.len() as u32;
            loaded.materials.push(Material::diffuse("wide lamp", Rgb::ZERO).emitting(Rgb::splat(2.0)));
            scenes::quad(&mut loaded.geometry, corners, material);
        }
        let camera = loaded.cameras[0].to_camera(sensor);
        loaded.into_scene(camera, None)
    }
}

#[test]
fn are_the_same_by_every_integrator_under_a_wide_lamp() {
    const VISIBLE: f64 = 0.04;
    let sensor = scenes::square(16, Filter::Box);
    // Lamps that are seen directly, in mirrors and through glass are found by one strategy alone.
    let scattered = |path: &JoinedPath| (1..path.edges()).any(|i| !path.is_delta(i));
    for wide in &WIDE {
        let scene = wide.lit(sensor);
        let kinds = [IntegratorKind::Path, IntegratorKind::Bdpt, IntegratorKind::BdptSds, IntegratorKind::Vcm];
        let within = |settings: Settings| Settings { merge_radius: Some(wide.radius), ..settings };
        let settings =
            kinds.map(|kind| agreement::settings(&scene, kind, 0).into_iter().map(within).collect::<Vec<_>>());
        let runs =
            kinds.iter().zip(&settings).map(|(kind, settings)| Run::new(&scene, settings, kind.name(), &scattered));
        assert_agree(wide.scene, VISIBLE, &mut runs.collect::<Vec<_>>(), &each_other(kinds.len()));
    }
}

/// Water with smooth waves, a bubble in glass, water that reaches into its glass, and facets.
#[test]
fn agree_with_the_definition_path_by_path() {
    for Wide { scene, .. } in &WIDE {
        let loaded = scenes::load(scene, scenes::square(16, Filter::Box));
        let kinds = [IntegratorKind::Bdpt, IntegratorKind::BdptSds, IntegratorKind::Vcm];
        assert_identity_by(&kinds, scene, &loaded, 1);
    }
}

/// Every volume is closed, and nothing else is amiss.
#[test]
fn are_read_without_a_warning() {
    for Wide { scene, .. } in &WIDE {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene).with_extension("glb");
        assert_eq!(io::load(&file).unwrap().warnings, [""; 0], "{scene}");
    }
}
