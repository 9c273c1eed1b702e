use std::{ops::ControlFlow, path::Path};

use super::{contest::sample, *};
use crate::{
    io,
    path::{JoinedPath, Strategy, is_covered},
    render::Renderer,
    scene::camera::Sensor,
};

const KINDS: [IntegratorKind; 4] =
    [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid, IntegratorKind::Bdpt];

fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("glb");
    let loaded = io::load(&path).unwrap();
    let camera = loaded.cameras[0].to_camera(Sensor { width: 24, height: 18, padding: 0 });
    loaded.into_scene(camera, None)
}

fn plan(kinds: &[IntegratorKind], passes: u32) -> Plan {
    let budget = Budget::Passes(passes);
    Plan { integrators: kinds.to_vec(), max_depth: 8, roulette: Roulette::FromDepth(4), seed: 1, budget, bar: 0.02 }
}

/// What the class is by the letters of the path's definition: read from its documentation, not from its code.
fn by_letters(letters: &str) -> Class {
    let inner = &letters[1..letters.len() - 1];
    let (first, last) = (inner.chars().next(), inner.chars().last());
    match (first, last) {
        (None, _) => Class::LightsSeen,
        _ if inner.chars().all(|c| c == 'S') => Class::LightsReflected,
        (Some('S'), Some('S')) => Class::CausticsReflected,
        (Some('S'), _) => Class::Reflected,
        (_, Some('S')) => Class::Caustics,
        (_, Some('D')) if inner.len() == 1 => Class::DirectDiffuse,
        (_, Some('G')) if inner.len() == 1 => Class::DirectGlossy,
        (_, Some('D')) => Class::Indirect,
        _ => Class::GlossyCaustics,
    }
}

/// For every path that any integrator finds: its class, and who covers it, are those of the definition.
#[test]
fn classes_and_coverage_are_those_of_the_definition() {
    let mut seen = std::collections::BTreeSet::new();
    for name in ["cornell-spheres", "glass-and-metal", "textured-room"] {
        let scene = scene(name);
        let tables =
            IntegratorKind::ALL.map(|kind| Integrator::new(kind, scene.camera.sensor(), 8, Roulette::FromDepth(4)));
        let found = std::sync::Mutex::new(&mut seen);
        for (i, kind) in KINDS.iter().enumerate() {
            let settings =
                Settings { integrator: *kind, max_depth: 8, seed: i as u64, ..Settings::new(scene.camera.sensor()) };
            let check = |path: &JoinedPath| {
                let defined = path.to_path();
                let letters = defined.class().to_string();
                assert_eq!(Class::of(path), by_letters(&letters), "{name}: {letters}");
                found.lock().unwrap().insert(Class::of(path));
                let n = defined.edges() as u32;
                for (kind, table) in IntegratorKind::ALL.iter().zip(&tables) {
                    if *kind == IntegratorKind::Area {
                        continue;
                    }
                    let could = |x: &Strategy| table.techniques().multiplicity(*x) > 0 && defined.pdf(*x) > 0.0;
                    let covered = (1..=n + 1).map(|t| Strategy { s: n + 1 - t, t }).any(|x| could(&x));
                    assert_eq!(is_covered(path, table.techniques()), covered, "{name}: {kind} and {letters}");
                }
                true
            };
            let mut renderer = Renderer::new(&scene, &settings);
            // Path tracing meets the lamps' small images in the balls now and then.
            let passes = if *kind == IntegratorKind::Path { 60 } else { 3 };
            (0..passes).for_each(|_| renderer.pass_where(&check));
        }
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), Class::ALL, "every class has been met");
}

/// A planted bias of 5 % in one class of one integrator is found, there and nowhere else, and confirmed.
#[test]
fn a_planted_bias_is_a_disagreement_where_it_is() {
    let scene = scene("cornell-box");
    let kinds = [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Hybrid];
    let plan = plan(&kinds, 220);
    let tables = kinds.iter().map(|kind| Integrator::new(*kind, scene.camera.sensor(), 8, plan.roulette)).collect();
    let setting = Setting::new(&scene, tables);
    let films: Vec<_> = kinds.iter().map(|_| Films::new()).collect();
    let run = |stage: u64, bias: f64| {
        let settings: Vec<_> = (0..3).map(|i| settings(&scene, &plan, i, stage)).collect();
        let mut found: Vec<_> = kinds.iter().map(|kind| Found::new(*kind, 3)).collect();
        sample(&scene, &setting, &settings, &films, &mut found, plan.budget, &mut |_| ControlFlow::Continue(()));
        let groups = found[1].passes.iter_mut().flatten().filter(|(group, _)| group.class == Class::Indirect);
        groups.for_each(|(_, regions)| regions.iter_mut().for_each(|x| *x *= 1.0 + bias));
        found
    };
    let differing = |found: &[Found]| {
        let mut rows = Evidence::new(&setting, found).compare(plan.bar, 1.0);
        rows.retain(|row| row.differs);
        rows
    };
    assert!(differing(&run(0, 0.0)).is_empty());
    let suspects = differing(&run(0, 0.05));
    assert!(!suspects.is_empty());
    assert!(suspects.iter().all(|row| row.pair.0 == 1 || row.pair.1 == 1), "{suspects:?}");
    assert!(suspects.iter().any(|row| row.scope == Scope::Of(Class::Indirect)), "{suspects:?}");
    assert!(suspects.iter().all(|row| matches!(row.scope, Scope::Of(Class::Indirect) | Scope::Scattered)));
    let indirect: Vec<_> = suspects.into_iter().filter(|row| row.scope == Scope::Of(Class::Indirect)).collect();
    let (honest, biased) = (run(1, 0.0), run(1, 0.05));
    assert!(Evidence::new(&setting, &biased).confirm(&indirect).iter().all(|same| *same));
    assert!(Evidence::new(&setting, &honest).confirm(&indirect).iter().all(|same| !same));
}

/// A caustic that path tracing has hardly met yet is no disagreement: what it would find is predicted from light
/// tracing.
#[test]
fn what_path_tracing_has_not_met_yet_is_no_disagreement() {
    for seed in 0..4 {
        let plan = Plan { seed, ..plan(&[IntegratorKind::Path, IntegratorKind::Light], 16) };
        let report = verify(&scene("caustic-sphere"), &plan, &mut |_| ControlFlow::Continue(()));
        assert_eq!(report.outcome, Outcome::Undecided, "{seed}: {:?}", report.rows);
        let caustics = report.rows.iter().find(|row| row.scope == Scope::Of(Class::Caustics)).unwrap();
        assert_eq!(caustics.verdict, Verdict::TooNoisy, "{caustics:?}");
        assert!(caustics.longer > 10.0 && report.longer >= Some(caustics.longer));
        assert!(report.integrators[1].uncovered > 0.0, "the ball is black to light tracing");
    }
}

/// Merges within a wide radius are biased: that is not held against them, since a wider one tells how large it may be.
/// Within a narrow one a tenth more light is a disagreement.
#[test]
fn the_bias_of_merges_is_bounded() {
    let scene = scene("cornell-box");
    let kinds = [IntegratorKind::Bdpt, IntegratorKind::Vcm];
    let plan = plan(&kinds, 220);
    let films: Vec<_> = kinds.iter().map(|_| Films::new()).collect();
    let run = |radius: f32| {
        let table = |kind: &IntegratorKind| {
            Integrator::new(*kind, scene.camera.sensor(), 8, plan.roulette).merging_within(radius)
        };
        let setting = Setting::new(&scene, kinds.iter().map(table).collect());
        let mut settings: Vec<_> = (0..2).map(|i| settings(&scene, &plan, i, 0)).collect();
        settings[1].merge_radius = Some(radius);
        let mut found: Vec<_> = kinds.iter().map(|kind| Found::new(*kind, 2)).collect();
        sample(&scene, &setting, &settings, &films, &mut found, plan.budget, &mut |_| ControlFlow::Continue(()));
        (setting, found)
    };
    let differs = |setting: &Setting, found: &[Found]| {
        Evidence::new(setting, found).compare(plan.bar, 1.0).iter().any(|row| row.differs)
    };
    let (setting, mut found) = run(0.3);
    assert!(!differs(&setting, &found));
    found[1].wide.clear();
    assert!(differs(&setting, &found), "there is no bias to bound");

    let (setting, mut found) = run(0.02);
    assert!(!differs(&setting, &found));
    let Found { passes, wide, .. } = &mut found[1];
    let regions = passes.iter_mut().chain(wide).flatten().flat_map(|(_, regions)| regions);
    regions.for_each(|x| *x *= 1.1);
    assert!(differs(&setting, &found));
}
