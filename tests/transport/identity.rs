//! The safeguard of the core: for every path that any strategy of any integrator finds, the fast form's contribution is
//! F/p and its weight is the definition's.

use std::sync::{
    Mutex,
    atomic::{AtomicU64, Ordering::Relaxed},
};

use glam::{DVec3, Vec3};
use pathspace::{
    integrator::{Integrator, IntegratorKind},
    path::{Edge, JoinedPath, LightPaths, MeetingPlaces, Path, Roulette, Step, Technique, Vertex},
    render::{MergeRadius, Renderer, Settings},
    sampling::{Filter, PdfArea},
    scene::{
        Scene,
        bsdf::{Directions, Lobe},
        point::{Place, Point},
    },
};

use crate::{scenes, textures};

/// What both faces of the core say of one path.
#[derive(Clone, Copy, Debug)]
struct Claim {
    contribution: DVec3,
    weight: f64,
}

fn fast(path: &JoinedPath, integrator: &Integrator) -> Claim {
    Claim {
        contribution: path.contribution().as_dvec3() * f64::from(path.survival()),
        weight: f64::from(integrator.weight(path)),
    }
}

fn defined(path: &Path, technique: Technique, integrator: &Integrator) -> Claim {
    let table = integrator.techniques();
    let contribution = match technique {
        Technique::Bidirectional(strategy) => path.contribution() / path.pdf_by(table.directions(), strategy),
        Technique::Merged(strategy) => {
            let kernel = path.kernel(table.radius().unwrap());
            path.contribution() * kernel / path.pdf_merged(strategy)
        }
        Technique::Area => path.contribution() / path.pdf_area(),
    };
    let weight =
        if technique == Technique::Area { 1.0 } else { path.mis_weight(technique, table, integrator.heuristic()) };
    Claim { contribution, weight }
}

/// By how much f32 may be off on this path: what moving its vertices and turning its normals by a few roundings changes
/// in the *definition*. Short edges, grazing angles and narrow lobes earn their tolerance this way, and nothing else
/// does.
fn condition(scene: &Scene, path: &Path, strategy: Technique, integrator: &Integrator) -> Claim {
    let exact = defined(path, strategy, integrator);
    let mut worst = Claim { contribution: DVec3::ZERO, weight: 0.0 };
    for k in 0..6_usize {
        let vertices = path.vertices().iter().enumerate().map(|(i, v)| perturbed(v, 7 * i + 5 * k)).collect();
        let near = Path::new(scene, vertices).with_visibility(path.visibility().to_vec());
        let near = near.at_wavelength(path.wavelength());
        let near = match path.merged() {
            Some((i, q)) => near.merged_at(i, perturbed(&Vertex::new(*q), 3 * i + k).point),
            None => near,
        };
        let near = near.in_media_of(path);
        let near = defined(&near, strategy, integrator);
        // A perturbation that turns a face away, or leaves the kernel, says nothing about rounding short of that.
        let is_there = near.contribution != DVec3::ZERO;
        if is_there && near.contribution.is_finite() && near.weight.is_finite() {
            worst.contribution = worst.contribution.max((near.contribution - exact.contribution).abs());
            worst.weight = worst.weight.max((near.weight - exact.weight).abs());
        }
    }
    worst
}

/// The relative rounding error of the path's densities. The fast form takes a sampled direction's density from the
/// direction, the definition from the positions it led to: errors that a common perturbation of the positions would
/// cancel in a weight.
fn rounding(path: &Path) -> f64 {
    let edge = |pair: &[Vertex]| {
        let (a, b) = (&pair[0].point, &pair[1].point);
        let e = Edge::between(a, b);
        let size = |p: &Point| 2.0 * p.error + 4.0 * f32::EPSILON * p.position.abs().max_element();
        f64::from((size(a) + size(b)) / (e.distance_squared.sqrt() * e.cos_a.min(e.cos_b)))
    };
    path.vertices().windows(2).map(edge).sum()
}

fn perturbed(v: &Vertex, k: usize) -> Vertex {
    let sign = |bit: usize| if (k >> bit) & 1 == 0 { 1.0_f32 } else { -1.0 };
    let shift = Vec3::new(sign(0), sign(1), sign(2)) * if k.is_multiple_of(3) { 1.0 } else { 0.6 };
    let scale = 4.0 * f32::EPSILON;
    let mut v = *v;
    let p = &mut v.point;
    match p.place {
        // Rays start off the surface by the error bound and land within it.
        Place::Surface | Place::Degenerate => p.position += shift * (2.0 * p.error + scale * p.position.abs()),
        Place::Infinite => p.position = (p.position + shift * scale).normalize(),
        Place::Film => p.normal = (p.normal + shift * scale).normalize(),
    }
    if p.place == Place::Surface {
        p.shading_normal = (p.shading_normal + shift * scale).normalize();
    }
    v
}

/// The complaint about one path, if the two faces disagree on it by more than its condition explains.
fn disagreement(scene: &Scene, path: &JoinedPath, found: Claim, integrator: &Integrator) -> Option<String> {
    let strategy = path.technique();
    let explicit = path.to_path();
    let expected = defined(&explicit, strategy, integrator);
    let slack = condition(scene, &explicit, strategy, integrator);
    // Of a dispersed path a channel may be negative.
    let largest = expected.contribution.abs().max_element();
    let off = (found.contribution - expected.contribution).abs();
    let allowed = 12.0 * slack.contribution + 2e-4 * largest;
    let weight_off = (found.weight - expected.weight).abs();
    // Nothing that has no rival can be weighed wrongly, however grazing its edges are.
    let shared = expected.weight * (1.0 - expected.weight);
    let rounded = if shared > 0.0 { 4.0 * shared * rounding(&explicit) } else { 0.0 };
    let weight_allowed = 12.0 * slack.weight + 2e-4 + rounded;
    let agrees = off.cmple(allowed).all() && weight_off <= weight_allowed;
    (!agrees).then(|| {
        format!(
            "{strategy} {}: fast {found:?}, definition {expected:?}; off by {off} of {allowed} and {weight_off:.3e} of \
             {weight_allowed:.3e}",
            explicit.class()
        )
    })
}

/// Checks every path of a small render, of which so many have to be merges at least; returns how many there were and
/// the complaints.
fn check(scene: &Scene, integrator: Integrator, passes: u32, least_merges: u64) -> (u64, Vec<String>) {
    let merge_radius = integrator.techniques().radius();
    let settings = Settings { seed: 11, merge_radius, ..Settings::new(scene.camera.sensor()) };
    let table = &integrator.clone();
    let seen = Mutex::new((0_u64, Vec::new()));
    let merges = AtomicU64::new(0);
    let mut renderer = Renderer::with_integrator(scene, &settings, integrator);
    let enough = || seen.lock().unwrap().0 >= ENOUGH && merges.load(Relaxed) >= least_merges;
    // Without next-event estimation few walks become paths.
    while renderer.passes() < passes || (renderer.passes() < 1000 * passes && !enough()) {
        renderer.pass_where(&|path| {
            let complaint = disagreement(scene, path, fast(path, table), table);
            merges.fetch_add(u64::from(matches!(path.technique(), Technique::Merged(_))), Relaxed);
            let mut seen = seen.lock().unwrap();
            seen.0 += 1;
            seen.1.extend(complaint);
            true
        });
    }
    assert!(renderer.statistics().rejected.is_empty(), "{:?}", renderer.statistics().rejected);
    let merges = merges.into_inner();
    assert!(merges >= least_merges, "only {merges} merges were checked");
    seen.into_inner().unwrap()
}

/// As many paths are checked at least.
const ENOUGH: u64 = 200;
/// The longest of them, in edges.
const DEPTH: u32 = 7;

/// Every path that every integrator finds, with and without roulette.
pub fn assert_identity(name: &str, scene: &Scene, passes: u32) {
    assert_identity_by(&IntegratorKind::ALL, name, scene, passes);
}

/// The same for these integrators only.
pub fn assert_identity_by(kinds: &[IntegratorKind], name: &str, scene: &Scene, passes: u32) {
    for &kind in kinds {
        for roulette in [Roulette::Off, Roulette::FromDepth(2)] {
            // Far fewer merges than a picture has: each is as slow to check as any path.
            let radius = 0.15 * MergeRadius::of(scene, None).of_pass(0);
            let integrator = Integrator::new(kind, scene.camera.sensor(), DEPTH, roulette).merging_within(radius);
            assert_identity_of(&format!("{name} {kind} {roulette:?}"), scene, integrator, passes);
        }
    }
}

/// Every path that this integrator finds.
pub fn assert_identity_of(name: &str, scene: &Scene, integrator: Integrator, passes: u32) {
    let table = integrator.techniques();
    // Not every scene shows something in a mirror.
    let merges = table.radius().is_some() && table.meeting_places() == MeetingPlaces::Everywhere;
    assert_identity_with(name, scene, integrator, passes, if merges { ENOUGH / 4 } else { 0 });
}

/// Every path that this integrator finds, of which so many have to be merges at least.
fn assert_identity_with(name: &str, scene: &Scene, integrator: Integrator, passes: u32, least_merges: u64) {
    let (paths, complaints) = check(scene, integrator, passes, least_merges);
    println!("{name}: {paths} paths, {} disagree", complaints.len());
    assert!(paths >= ENOUGH, "{name}: only {paths} paths were checked");
    assert!(complaints.is_empty(), "{name}: {} of {paths}, such as\n{}", complaints.len(), complaints[0]);
}

#[test]
fn of_every_path_by_uniform_directions() {
    let sensor = scenes::square(32, Filter::Box);
    let scenes = [("zoo", scenes::zoo(sensor)), ("open zoo", scenes::open_zoo(sensor))];
    for (name, scene) in scenes {
        let integrator = Integrator::new(IntegratorKind::PathHemisphere, sensor, DEPTH, Roulette::FromDepth(3))
            .with_directions(Directions::Uniform);
        assert_identity_of(&format!("{name} uniform"), &scene, integrator, 24);
    }
}

#[test]
fn of_every_path_with_several_samples_of_the_lights() {
    let scene = scenes::zoo(scenes::square(32, Filter::BlackmanHarris));
    for kind in [IntegratorKind::Path, IntegratorKind::PathLight, IntegratorKind::Bdpt] {
        let integrator =
            Integrator::new(kind, scene.camera.sensor(), DEPTH, Roulette::FromDepth(3)).with_light_samples(3);
        assert_identity_of(&format!("zoo {kind} with 3 samples"), &scene, integrator, 4);
    }
    let radius = 0.15 * MergeRadius::of(&scene, None).of_pass(0);
    let merging = Integrator::new(IntegratorKind::Vcm, scene.camera.sensor(), DEPTH, Roulette::FromDepth(3));
    let merging =
        merging.with_light_samples(3).with_splits(2).with_light_paths(LightPaths::each(2)).merging_within(radius);
    assert_identity_of("zoo vcm with 3 samples, split, and 2 light paths", &scene, merging, 2);
}

#[test]
fn of_every_path_where_what_mirrors_and_glass_show_merges() {
    let sensor = scenes::square(24, Filter::BlackmanHarris);
    let files = ["cornell-spheres", "pool"].map(|name| (name, scenes::load(name, sensor)));
    for (name, scene) in files.into_iter().chain([("zoo", scenes::zoo(sensor))]) {
        for roulette in [Roulette::Off, Roulette::FromDepth(2)] {
            let radius = 0.4 * MergeRadius::of(&scene, None).of_pass(0);
            let integrator = Integrator::new(IntegratorKind::BdptSds, sensor, DEPTH, roulette).merging_within(radius);
            assert_identity_with(&format!("{name} {roulette:?}"), &scene, integrator, 1, ENOUGH);
        }
    }
}

#[test]
fn of_every_path_in_the_committed_scenes() {
    for name in scenes::FILES {
        assert_identity(name, &scenes::load(name, scenes::square(24, Filter::Box)), 6);
    }
}

#[test]
fn of_every_path_among_all_materials_and_lights() {
    // The wide filter pads the film, so that N_c and N_l differ.
    assert_identity("zoo", &scenes::zoo(scenes::square(40, Filter::BlackmanHarris)), 3);
    assert_identity("open zoo", &scenes::open_zoo(scenes::square(32, Filter::BlackmanHarris)), 2);
}

#[test]
fn of_every_path_over_textures() {
    assert_identity("textured room", &textures::textured_room(scenes::square(24, Filter::Box)), 2);
    assert_identity("normal-mapped plane", &textures::normal_mapped_plane(scenes::square(32, Filter::Box)), 5);
    assert_identity("textured emitter", &textures::textured_emitter(scenes::square(32, Filter::Box)), 3);
}

#[test]
fn of_every_path_through_and_between_veils() {
    assert_identity("veils", &scenes::veiled(scenes::square(32, Filter::BlackmanHarris)), 3);
}

/// A mistake planted into the fast form's numbers.
#[derive(Clone, Copy, Debug)]
enum Mistake {
    /// A prefix product that forgets one cosine.
    Prefix,
    /// A reverse density left in solid angle.
    Reverse,
    /// A refraction's reverse density without its Jacobian dω_B/dω_A.
    Jacobian,
    /// A reverse density without the probability of passing what lies between.
    Visibility,
    /// The same of a forward density.
    Passing,
    /// A running sum of rivals without its last step.
    Rivals,
}

impl Mistake {
    /// The camera prefix with the mistake in it, or `None` where it has no place.
    fn plant(self, camera: &[Step]) -> Option<Vec<Step>> {
        let mut steps = camera.to_vec();
        match self {
            Self::Prefix => {
                let last = steps.last_mut()?;
                last.beta /= last.back.cos_b;
            }
            Self::Reverse => {
                // The last two are the joint's business.
                let i = steps.len().checked_sub(3).filter(|i| *i >= 1)?;
                let back = steps[i + 1].back;
                steps[i].pdf_rev = PdfArea(steps[i].pdf_rev.0 * back.distance_squared / back.cos_b);
            }
            Self::Jacobian => {
                let i = (1..steps.len() - 1).find(|i| steps[*i].vertex.lobe == Lobe::Delta(1))?;
                let (to_camera, to_light) = (steps[i].back.direction, -steps[i + 1].back.direction);
                let n = steps[i].vertex.point.shading_normal;
                let eta = steps[i].vertex.relative_ior(to_camera, to_light);
                let jacobian = n.dot(to_camera).abs() / (eta * eta * n.dot(to_light).abs());
                steps[i - 1].pdf_rev = PdfArea(steps[i - 1].pdf_rev.0 / jacobian);
            }
            Self::Visibility => {
                let i = (1..steps.len().saturating_sub(2)).find(|i| steps[i + 1].back.visibility < 1.0)?;
                steps[i].pdf_rev = PdfArea(steps[i].pdf_rev.0 / steps[i + 1].back.visibility);
            }
            Self::Passing => {
                let i = (1..steps.len()).find(|i| steps[*i].back.visibility < 1.0)?;
                steps[i].pdf_fwd = PdfArea(steps[i].pdf_fwd.0 / steps[i].back.visibility);
            }
            Self::Rivals => {
                let i = steps.len().checked_sub(3).filter(|i| *i >= 1)?;
                steps[i].rivals = steps[i - 1].rivals;
            }
        }
        Some(steps)
    }
}

#[test]
fn turns_red_for_each_planted_mistake() {
    let sensor = scenes::square(32, Filter::Box);
    let settings = Settings { max_depth: 6, seed: 3, ..Settings::new(sensor) };
    for mistake in
        [Mistake::Prefix, Mistake::Reverse, Mistake::Jacobian, Mistake::Visibility, Mistake::Passing, Mistake::Rivals]
    {
        let scene = match mistake {
            Mistake::Visibility | Mistake::Passing => scenes::veiled(sensor),
            _ => scenes::zoo(sensor),
        };
        let integrator = Integrator::new(IntegratorKind::Bdpt, scene.camera.sensor(), 6, Roulette::Off);
        let table = &integrator.clone();
        let counts = Mutex::new((0, 0));
        let mut renderer = Renderer::with_integrator(&scene, &settings, integrator);
        renderer.pass_where(&|path| {
            let Some(steps) = mistake.plant(path.camera()) else { return true };
            let Some(wrong) = path.with_camera(&steps) else { return true };
            let claim = match mistake {
                Mistake::Rivals => fast(&wrong, table),
                // The running sums were right before the mistake.
                _ => Claim {
                    weight: wrong.mis_weight(table.techniques(), table.heuristic()).into(),
                    ..fast(&wrong, table)
                },
            };
            let complaint = disagreement(&scene, &wrong, claim, table);
            let mut counts = counts.lock().unwrap();
            counts.0 += 1;
            counts.1 += u32::from(complaint.is_some());
            true
        });
        let (tried, caught) = counts.into_inner().unwrap();
        println!("{mistake:?}: {caught} of {tried} paths are found wrong");
        assert!(tried > 50 && caught * 20 > tried, "{mistake:?}: {caught} of {tried}");
    }
}
