//! Merging: what vcm estimates within a radius comes to the image as the radius shrinks, and no light leaks.

use glam::Vec3;
use pathspace::{
    integrator::IntegratorKind,
    math::Rgb,
    path::{Densities, JoinedPath, LightPaths},
    render::{Renderer, Settings},
    sampling::{Filter, SamplerKind},
    scene::{
        Scene,
        camera::{Camera, Sensor},
        geometry::Geometry,
        material::Material,
    },
    statistics::{Comparison, Estimate, Regions, regions},
};
use rayon::prelude::*;

use crate::scenes;

/// Independent replicates of each estimate.
const REPLICATES: u64 = 48;

/// The regions of replicates of a render with these settings, and of what `keep` holds for.
fn replicates(
    scene: &Scene,
    base: &Settings,
    passes: u32,
    keep: &(dyn Fn(&JoinedPath) -> bool + Sync),
) -> Vec<Regions> {
    let settings = (0..REPLICATES).map(|r| Settings { seed: 9000 + 100 * base.integrator as u64 + r, ..base.clone() });
    let settings: Vec<_> = settings.collect();
    settings
        .par_iter()
        .map(|settings| {
            let mut renderer = Renderer::new(scene, settings);
            (0..passes).for_each(|_| renderer.pass_where(keep));
            assert!(renderer.statistics().rejected.is_empty(), "{:?}", renderer.statistics().rejected);
            regions(&renderer.film().image(passes))
        })
        .collect()
}

/// The paths that are compared.
#[derive(Clone, Copy)]
enum Kept {
    /// Without a specular vertex: what bdpt finds with little noise.
    Rough,
    /// With one, from a light that a walk may meet: what path tracing finds, too, where the light is large.
    Caustics,
    /// Of those all scattered light on what specular vertices alone show: what bdpt-sds merges.
    Mirrored,
}

impl Kept {
    fn has(self, path: &JoinedPath) -> bool {
        let is_rough = (1..path.edges()).all(|i| !path.is_delta(i));
        match self {
            Self::Rough => is_rough,
            Self::Caustics => path.light_is_hittable() && !is_rough,
            Self::Mirrored => {
                let first_rough = (1..path.edges()).find(|i| !path.is_delta(*i));
                path.light_is_hittable() && first_rough.is_some_and(|i| i >= 2 && i + 1 < path.edges())
            }
        }
    }
}

/// The bias is one of r² away from edges, and each radius has numbers of its own: (4 E(r/2) − E(r))/3 has none of it.
#[test]
fn what_remains_as_the_radius_shrinks_is_the_image() {
    let sensor = scenes::square(16, Filter::Box);
    let cases = [
        ("zoo", scenes::zoo(sensor), 0.12, Kept::Rough, 0.02),
        ("zoo with few light paths", scenes::zoo(sensor), 0.12, Kept::Rough, 0.02),
        ("cornell box", scenes::load("cornell-box", sensor), 0.03, Kept::Rough, 0.02),
        ("mirrors and glass of the zoo", scenes::zoo(sensor), 0.12, Kept::Caustics, 0.06),
        ("mirrors of the zoo by bdpt-sds", scenes::zoo(sensor), 0.12, Kept::Mirrored, 0.08),
    ];
    for (name, scene, radius, kept, visible) in cases {
        let integrator = if name.contains("sds") { IntegratorKind::BdptSds } else { IntegratorKind::Vcm };
        // As many passes are no whole number of turns.
        let light_paths = if name.contains("few") { LightPaths::one_in(3) } else { LightPaths::ONE };
        let keep = &|path: &JoinedPath| kept.has(path);
        let base = Settings { max_depth: 5, ..Settings::new(sensor) };
        let bdpt = Estimate::new(&replicates(&scene, &base, 48, keep));
        let within = |radius: f32| {
            replicates(
                &scene,
                &Settings { integrator, merge_radius: Some(radius), light_paths, ..base.clone() },
                40,
                keep,
            )
        };
        let [wide, narrow] = [within(radius), within(0.5 * radius)];
        let limit = |(wide, narrow): (&Regions, &Regions)| -> Regions {
            wide.iter().zip(narrow).map(|(wide, narrow)| (4.0 * narrow - wide) / 3.0).collect()
        };
        let limit = Estimate::new(&wide.iter().zip(&narrow).map(limit).collect::<Vec<_>>());
        let comparison = Comparison::new(&limit, &bdpt);
        let [wide, narrow] = [Estimate::new(&wide), Estimate::new(&narrow)];
        println!(
            "{name}: {:.5} within r, {:.5} within r/2, {:.5} in the limit; bdpt {:.5}: {comparison}",
            wide.image_mean(),
            narrow.image_mean(),
            limit.image_mean(),
            bdpt.image_mean()
        );
        assert!(!comparison.differs(), "{name}: {comparison}");
        assert!(comparison.visible_bias < visible, "{name}: too noisy to tell: {comparison}");
        let planted = [1.2 * visible, -1.2 * visible].map(|bias| Comparison::new(&limit.biased(bias), &bdpt).differs());
        assert_eq!(planted, [true; 2], "{name}: a bias went unnoticed");
        // Within a radius of a few hundredths of the room the bias itself is small.
        assert!((narrow.image_mean() / bdpt.image_mean() - 1.0).abs() < visible, "{name}: the bias within r/2");
    }
}

/// A closed room with a lamp, and above it, a millimetre apart, one that is dark.
#[test]
fn no_light_leaks_into_the_room_next_door() {
    let sensor = scenes::square(16, Filter::Box);
    for (y, lit) in [(1.5, false), (0.0, true)] {
        let mut geometry = Geometry::default();
        scenes::cube_inside(&mut geometry, 1.0, [1, 0, 0, 0, 0, 0]);
        // Narrower than the lower one by more than the radius, so that no walls line up.
        scenes::cube_inside_at(&mut geometry, Vec3::new(0.0, 1.501, 0.0), 0.5, [0; 6]);
        let materials = vec![
            Material::diffuse("white", Rgb::splat(0.7)),
            Material::diffuse("lamp", Rgb::splat(0.7)).emitting(Rgb::splat(5.0)),
        ];
        let eye = Vec3::new(0.0, y, 0.3);
        let camera = Camera::look_at(eye, Vec3::new(0.1, y - 0.4, -0.4), Vec3::Y, 1.5, sensor);
        let scene = Scene::new(geometry, materials, &[], camera);
        let settings = Settings {
            integrator: IntegratorKind::Vcm,
            merge_radius: Some(0.2),
            ..Settings::new(scene.camera.sensor())
        };
        let mut renderer = Renderer::new(&scene, &settings);
        (0..4).for_each(|_| renderer.pass());
        assert_eq!(!renderer.film().is_black(), lit, "the room at {y} m");
    }
}

/// With its path or without, a merge is the same deposit: in no image, in no count, can it be told that somebody looks.
#[test]
fn whoever_looks_at_the_paths() {
    let sensor = Sensor { width: 40, height: 30, padding: Filter::BlackmanHarris.padding() };
    let scene = scenes::zoo(sensor);
    let kinds = [IntegratorKind::BdptSds, IntegratorKind::Vcm];
    for (sampler, integrator) in SamplerKind::ALL.into_iter().flat_map(|sampler| kinds.map(|kind| (sampler, kind))) {
        let filter = Filter::BlackmanHarris;
        let base = Settings {
            integrator,
            sampler,
            filter,
            light_paths: LightPaths::each(2),
            min_depth: 2,
            ..Settings::new(sensor)
        };
        for settings in [Settings { clamp: Some(0.5), ..base.clone() }, Settings { splits: 2, ..base }] {
            let [unseen, seen] = [false, true].map(|looks| {
                let mut renderer = Renderer::new(&scene, &settings);
                for _ in 0..2 {
                    if looks { renderer.pass_where(&|_| true) } else { renderer.pass() }
                }
                (renderer.film().image(2), renderer.statistics())
            });
            assert!(unseen.0.pixels == seen.0.pixels && unseen.1 == seen.1, "{sampler} {integrator}");
        }
    }
}
