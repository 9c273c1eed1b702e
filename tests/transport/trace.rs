//! A pixel that is traced: the same samples as a render's, and the oracle's numbers about them.

use pathspace::{
    film::Crop,
    integrator::IntegratorKind,
    path::{LightPaths, Roulette},
    render::{MergeRadius, Renderer, Settings},
    sampling::{Filter, SamplerKind},
    scene::Scene,
    trace::{Trace, Tracer},
};

use crate::scenes;

const PASSES: u32 = 6;

/// With everything that moves random numbers or light, and the wide filter.
fn settings(scene: &Scene, integrator: IntegratorKind) -> Settings {
    Settings {
        integrator,
        filter: Filter::BlackmanHarris,
        roulette: Roulette::FromDepth(2),
        sampler: SamplerKind::Sobol,
        max_depth: 6,
        light_samples: 2,
        splits: 2,
        light_paths: LightPaths::each(2),
        merge_radius: integrator.merges().then(|| 0.5 * MergeRadius::of(scene, None).of_pass(0)),
        ..Settings::new(scene.camera.sensor())
    }
}

fn traced<'a>(scene: &'a Scene, settings: &'a Settings, most: usize, threads: usize) -> Trace<'a> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut tracer = Tracer::new(scene, settings, None, most);
    (0..PASSES).for_each(|_| pool.install(|| tracer.pass()));
    tracer.finish()
}

/// Of every integrator, at the border of the image and within.
#[test]
fn is_the_pixel_of_the_render_and_the_sum_of_its_contributions() {
    let scene = scenes::zoo(scenes::square(12, Filter::BlackmanHarris));
    for kind in IntegratorKind::ALL {
        let settings = settings(&scene, kind);
        let mut renderer = Renderer::new(&scene, &settings);
        (0..PASSES).for_each(|_| renderer.pass());
        let image = renderer.film().image(PASSES);
        for [x, y] in [[0, 0], [11, 6], [5, 7]] {
            let crop = Crop { x0: x, y0: y, x1: x + 1, y1: y + 1 };
            let settings = Settings { crop, ..settings.clone() };
            let trace = traced(&scene, &settings, 5, 2);
            let pixel = image.pixels[(y * 12 + x) as usize];
            assert_eq!(trace.value.to_array(), pixel.to_array(), "{kind} {x},{y}");
            let off = (trace.sum / f64::from(PASSES) - pixel.as_dvec3()).abs().max_element();
            assert!(off <= 1e-5 * pixel.as_dvec3().max_element(), "{kind} {x},{y}: off by {off}");
            let largest: f64 = trace.largest.iter().map(|one| one.value.as_dvec3().element_sum()).sum();
            assert!(trace.largest.len() <= 5 && largest <= 1.000_01 * trace.sum.element_sum());
        }
    }
}

/// Every technique of the table has a share, and w F h/(n p) by definition is what was found.
#[test]
fn has_weights_that_sum_to_one_and_estimates_of_the_definition() {
    let scene = scenes::zoo(scenes::square(12, Filter::BlackmanHarris));
    let crop = Crop { x0: 5, y0: 7, x1: 6, y1: 8 };
    for kind in IntegratorKind::ALL {
        let settings = Settings { crop, ..settings(&scene, kind) };
        let trace = traced(&scene, &settings, 200, 1);
        let all = trace.largest.len();
        let finds_light = kind.has(|x| x.s >= 1 && x.t >= 2);
        assert!(all > if finds_light { 20 } else { 0 }, "{kind}: only {all} contributions");
        let mut agree = 0;
        for one in &trace.largest {
            let sum: f64 = one.shares.iter().map(|share| share.weight).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{kind}: weights of {} sum to {sum}", one.path.class());
            let (own, best) = (one.own(), one.best());
            assert!(own.expected() > 0.0 && own.weight > 0.0 && best.expected_anywhere() >= own.expected());
            // Which paths f32 may be off on is what the identity test judges.
            let excess = one.excess() * f64::from(one.survival);
            let is_near = (excess - 1.0).abs() < 1e-2 && (f64::from(one.fast_weight) - own.weight).abs() < 1e-2;
            agree += usize::from(is_near);
        }
        assert!(20 * agree >= 19 * all, "{kind}: {agree} of {all} agree");
    }
}

#[test]
fn does_not_depend_on_threads() {
    let scene = scenes::zoo(scenes::square(24, Filter::Box));
    for kind in [IntegratorKind::Light, IntegratorKind::Bdpt, IntegratorKind::Vcm] {
        let crop = Crop { x0: 9, y0: 14, x1: 10, y1: 15 };
        let settings = Settings { crop, filter: Filter::Box, ..settings(&scene, kind) };
        let said = |threads| {
            let trace = traced(&scene, &settings, 50, threads);
            let one = |x: &pathspace::trace::Contribution| {
                (x.value.to_array(), x.pass, x.raster.0.to_array(), x.technique, x.path.class())
            };
            (trace.contributions, trace.sum.to_array(), trace.largest.iter().map(one).collect::<Vec<_>>())
        };
        assert_eq!(said(1), said(3), "{kind}");
    }
}
