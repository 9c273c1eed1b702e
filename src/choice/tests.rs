use std::{ops::ControlFlow, path::Path};

use super::{
    rare::{Excess, OfOne},
    *,
};
use crate::{
    integrator::IntegratorKind,
    io,
    math::{Rgb, luminance},
    render::{Collector, Renderer},
};

const SENSOR: Sensor = Sensor { width: 192, height: 144, padding: 0 };

fn scene(name: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let loaded = io::load(&file).expect("a scene of this repository");
    let camera = loaded.cameras[0].to_camera(SENSOR);
    let scene = loaded.into_scene(camera, None);
    let lights = scene.lights().suitable_choice();
    scene.choosing_lights(lights)
}

fn candidates() -> Vec<Settings> {
    let usual = |Candidate { integrator, light_paths }| {
        let description = integrator.description();
        Settings {
            integrator,
            light_paths,
            roulette: description.roulette,
            sampler: description.sampler,
            weights: description.weights,
            max_depth: 8,
            ..Settings::new(SENSOR)
        }
    };
    CANDIDATES.into_iter().map(usual).collect()
}

fn estimate(candidate: Candidate, error: f64, missed: f64) -> Estimate {
    Estimate { candidate, error, work: Work { camera: 1.0, ..Work::default() }, missed }
}

#[test]
fn the_best_is_chosen_that_finds_all_light() {
    let [path, hybrid, bdpt, _, _, vcm] = CANDIDATES;
    let chosen = |errors: [f64; 4], missed: [f64; 4]| {
        let all = [path, hybrid, bdpt, vcm].into_iter().zip(errors).zip(missed);
        let all = all.map(|((one, error), missed)| estimate(one, error, missed)).collect();
        Choice::among(all, UNBIASED).candidate()
    };
    assert_eq!(chosen([4.0, 3.0, 2.0, 1.0], [0.0; 4]), vcm);
    assert_eq!(chosen([4.0, 3.0, 2.0, 2.5], [0.0; 4]), bdpt);
    // As good as the best is good enough for a simpler one.
    assert_eq!(chosen([4.0, 2.05, 2.0, 2.5], [0.0; 4]), hybrid);
    // What merges has to be worth its bias.
    assert_eq!(chosen([4.0, 3.0, 2.0, 1.7], [0.0; 4]), bdpt);
    assert_eq!(chosen([4.0, 2.05, 2.0, 1.6], [0.0; 4]), vcm);
    assert_eq!(chosen([1.0, 3.0, 2.0, 4.0], [0.02, 0.0, 0.0, 0.0]), bdpt);
    // If all miss something, those count that miss the least.
    assert_eq!(chosen([1.0, 3.0, 2.0, 4.0], [0.02, 0.02, 0.01, 0.01]), bdpt);
    assert_eq!(chosen([1.0, 3.0, 2.0, 4.0], [0.02; 4]), path);
    // Without any noise the simplest will do.
    assert_eq!(chosen([0.0, 3.0, 2.0, 4.0], [0.0; 4]), path);
    assert_eq!(chosen([0.0; 4], [0.0; 4]), path);
}

#[test]
fn a_choice_says_what_the_others_lack() {
    let [path, hybrid, bdpt, _, few, _] = CANDIDATES;
    let errors = [(path, 1.0, 0.25), (hybrid, 6.0, 0.0), (bdpt, 2.0, 0.0), (few, 3.0, 0.0)];
    let choice = Choice::among(errors.map(|(one, error, missed)| estimate(one, error, missed)).into(), UNBIASED);
    assert_eq!(choice.candidate(), bdpt);
    assert_eq!(
        choice.reason(),
        "for the same noise hybrid needs 3.0 times the work, vcm --light-paths 1/8 needs 1.5 times the work; path \
         misses 25.0 % of the light"
    );
}

#[test]
fn a_pilot_is_small_and_has_the_image_s_shape() {
    let of = |width, height| {
        let Sensor { width, height, .. } = reduced(Sensor { width, height, padding: 2 });
        [width, height]
    };
    assert_eq!(of(512, 512), [64, 64]);
    assert_eq!(of(7680, 4320), [85, 48]);
    assert_eq!(of(256, 256), [32, 32]);
    assert_eq!(of(16, 8), [16, 8]);
    assert_eq!(of(100_000, 1), [12_500, 1]);
}

/// Neither threads nor an earlier pilot make a difference, and the scene stays what it was.
#[test]
fn a_choice_is_a_function_of_scene_and_settings() {
    let mut scene = scene("caustic-ring.glb");
    let pilot = |scene: &mut Scene, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| choose(scene, &candidates(), None, &mut |_| ControlFlow::Continue(())).expect("a choice"))
    };
    let [first, second] = [1, 3].map(|threads| pilot(&mut scene, threads));
    assert_eq!(first, second);
    assert!(first.estimates.iter().all(|x| x.error > 0.01 && x.work.cost() > 1.0), "{first:?}");
    assert_eq!(scene.camera.sensor(), SENSOR);
    // Of an eighth of the light paths, an eighth as many merge with as many that look for them, which walks that end
    // nowhere or on a mirror do not.
    let [.., few, all] = &first.estimates[..] else { panic!("{first:?}") };
    assert!((6.5..9.5).contains(&(all.work.merges / few.work.merges)), "{first:?}");
    assert!((few.work.lookups / all.work.lookups - 1.0).abs() < 0.05, "{first:?}");
    assert!((0.5..0.9).contains(&(few.work.lookups / few.work.camera)), "{first:?}");
    assert!(8.0 * few.work.kept_paths == all.work.kept_paths && 4.0 * few.work.light < all.work.light, "{first:?}");
}

/// Whoever waits may end it between any two steps.
#[test]
fn a_choice_can_be_ended() {
    let mut scene = scene("caustic-ring.glb");
    let mut heard = Vec::new();
    let mut twice = |part| {
        heard.push(part);
        if heard.len() < 2 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    assert_eq!(choose(&mut scene, &candidates(), None, &mut twice), None);
    assert!(heard[0] == 0.0 && heard[1] > 0.0 && heard.len() == 2, "{heard:?}");
    assert_eq!(scene.camera.sensor(), SENSOR);
}

/// The paths that are not in the image make no noise in it.
#[test]
fn what_is_left_out_does_not_count() {
    let mut scene = scene("caustic-ring.glb");
    let error =
        |choice: &Choice, kind| choice.estimates.iter().find(|x| x.candidate.integrator == kind).map(|x| x.error);
    let all = choose(&mut scene, &candidates(), None, &mut |_| ControlFlow::Continue(())).expect("a choice");
    let direct = choose(&mut scene, &candidates(), Some(&|_, path| path.to_path().edges() <= 2), &mut |_| {
        ControlFlow::Continue(())
    })
    .expect("a choice");
    for kind in [IntegratorKind::Path, IntegratorKind::Bdpt] {
        assert!(error(&direct, kind) < error(&all, kind).map(|error| 0.5 * error), "{all:?} {direct:?}");
    }
}

/// Light that is large in every sample is no noise: a lamp that the camera sees.
#[test]
fn what_is_bright_and_steady_is_no_noise() {
    let nothing = OfOne { excess: vec![Excess::default()], missed: (0.0, 0) };
    let mut rare = Rare { candidates: vec![nothing], light: 0.0 };
    let bounds = Bounds { common: 20.0, white: 200.0 };
    rare.candidates[0].excess[0].add(100.0, 100.0, bounds);
    assert_eq!((rare.mean(0, 0), rare.variance(0, 0, 20.0)), (80.0, 0.0));
    // The same light once in ten samples is: σ² of 0 or 1,000, at most 200, is .09 · 200², and clamped .09 · 20².
    rare.candidates[0].excess[0] = Excess::default();
    rare.candidates[0].excess[0].add(100.0, 1000.0, bounds);
    assert!((rare.mean(0, 0) - 18.0).abs() < 1e-9);
    assert!((rare.variance(0, 0, 2.0) - 0.09 * (200.0 * 200.0 - 20.0 * 20.0)).abs() < 1e-6);
}

/// What is whiter than white is missing where no sample of an image has it: all of it if it is rare, and nothing of a
/// lamp that every sample sees.
#[test]
fn what_is_seldom_found_is_missing() {
    let nothing = OfOne { excess: vec![Excess::default()], missed: (0.0, 0) };
    let mut rare = Rare { candidates: vec![nothing], light: 0.0 };
    let bounds = Bounds { common: 20.0, white: 200.0 };
    let mut lost = |finds: u32, light: f64, size: f64| {
        rare.candidates[0].excess[0] = Excess::default();
        (0..finds).for_each(|_| rare.candidates[0].excess[0].add(light, size, bounds));
        rare.lost(0, 0)
    };
    // Once in a million samples: 3 × 10⁸ in the mean 300, of which white dots are no more than .0002.
    assert!((lost(1, 300.0, 3e8) / 300.0 - 1.0).abs() < 1e-3);
    // Once in 64 samples, whoever finds it.
    for finds in [1, 100] {
        let light = 1e5 / 64.0 / f64::from(finds);
        assert!((lost(finds, light, 1e5) / ((1e5 - 200.0) / 64.0) - (-1.0_f64).exp()).abs() < 1e-9);
    }
    assert!(lost(1, 1e5, 1e5) < 1e-9);
    assert_eq!(lost(1, 100.0, 200.0), 0.0);
}

/// Sees what an integrator really deposits.
struct Deposits {
    bounds: Bounds,
    light: f64,
    excess: f64,
}

impl Collector for Deposits {
    fn collect(&mut self, _: &JoinedPath, value: Rgb) {
        let size = f64::from(luminance(value));
        let Bounds { common, white } = self.bounds.by(size / f64::from(value.max_element()));
        self.light += size;
        self.excess += (size.min(white).powi(2) - common * common).max(0.0);
    }
}

/// What all techniques predict of the rare finds of path tracing, the caustic of a glass ball, is what it finds with
/// many more samples.
#[test]
fn rare_finds_are_predicted() {
    let mut scene = scene("caustic-sphere.glb");
    scene.camera = scene.camera.with_sensor(Sensor { width: 32, height: 24, padding: 0 });
    let crop = Crop::full(scene.camera.sensor());
    let candidates: Vec<_> = candidates().into_iter().map(|x| Settings { crop, ..x }).collect();
    let widest = candidates.last().expect("a candidate");
    let typical = frequent::typical_value(&scene, widest, None);
    let bounds = Bounds { common: 4.0 * typical, white: 40.0 * typical };
    let measured: Vec<_> = candidates.iter().map(|x| Measured::new(&scene, x, bounds.common, None)).collect();
    const PILOTS: u32 = 24;
    let of_seed = |seed: u32| {
        let widest = Settings { seed: seed.into(), ..widest.clone() };
        Rare::predict(&scene, &widest, &measured, bounds, None)
    };
    let pilots: Vec<_> = (0..PILOTS).map(of_seed).collect();
    let squares = |pilot: &Rare| pilot.candidates[0].excess.iter().map(|x| x.square).sum::<f64>();
    let predicted = pilots.iter().map(squares).sum::<f64>() / f64::from(PILOTS);
    const PASSES: u32 = 3000;
    let mut renderer = Renderer::new(&scene, &candidates[0]);
    let (mut light, mut excess) = (0.0, 0.0);
    for _ in 0..PASSES {
        for found in renderer.pass_into(|| Deposits { bounds, light: 0.0, excess: 0.0 }) {
            light += found.light;
            excess += found.excess;
        }
    }
    let [light, excess] = [light, excess].map(|sum| sum / f64::from(PASSES));
    assert!((0.8..1.25).contains(&(predicted / excess)), "predicted {predicted}, found {excess}");
    // And all techniques find the light that this one does, but for what merges of a wide radius lose at edges.
    let predicted = pilots.iter().map(|pilot| pilot.light).sum::<f64>() / f64::from(PILOTS);
    assert!((predicted / light - 1.0).abs() < 0.1, "{predicted} {light}");
}
