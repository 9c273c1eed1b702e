//! Agreement: integrators that cover the same paths give the same image, region by region, within what chance allows,
//! and where light tracing does not cover, the difference is exactly the uncovered class.

use std::{ops::RangeInclusive, time::Instant};

use pathspace::{
    film::Image,
    integrator::{Integrator, IntegratorKind},
    path::{Densities, JoinedPath},
    render::{Renderer, Settings},
    sampling::Filter,
    scene::Scene,
    statistics::{Comparison, Estimate, Regions, regions},
};
use rayon::prelude::*;

use crate::{report, scenes};

/// The bias of the whole image that every comparison must be able to see.
pub const VISIBLE: f64 = 0.01;

/// The longest paths, in edges: caustics seen in mirrors and through glass, and some indirect light, are among them.
pub const DEPTH: u32 = 6;
/// Independent replicates of each estimate. With more of them the same samples say more, because t has a lighter tail
/// with more degrees of freedom, until the passes of each become too few for its sampler.
const REPLICATES: u64 = 64;
/// Passes of each replicate before the first look. A run that has found nothing by then is taken to be empty; if that
/// is wrong, its comparison fails.
const FIRST: u32 = 6;
/// Where a scene's variance makes the visible bias unreachable, that is a failure and not a reason to go on forever.
const MOST_PASSES: u32 = 1 << 14;

/// One estimate of a scene, from replicates whose seeds follow a fixed rule.
pub struct Run<'a> {
    pub name: String,
    keep: &'a (dyn Fn(&JoinedPath) -> bool + Sync),
    renderers: Vec<Renderer<'a>>,
    replicates: Vec<Regions>,
    seconds: f32,
}

impl<'a> Run<'a> {
    pub fn new(
        scene: &'a Scene,
        settings: &'a [Settings],
        name: &str,
        keep: &'a (dyn Fn(&JoinedPath) -> bool + Sync),
    ) -> Self {
        let renderers = settings.iter().map(|s| Renderer::new(scene, s)).collect();
        Self { name: name.to_owned(), keep, renderers, replicates: Vec::new(), seconds: 0.0 }
    }

    fn passes(&self) -> u32 {
        self.renderers[0].passes()
    }

    /// Brings every replicate to `passes`.
    fn advance(&mut self, passes: u32) {
        let start = Instant::now();
        self.renderers.par_iter_mut().for_each(|renderer| {
            while renderer.passes() < passes {
                renderer.pass_where(&|path| (self.keep)(path));
            }
        });
        self.replicates = self.renderers.iter().map(|r| regions(&r.film().image(passes))).collect();
        self.seconds += start.elapsed().as_secs_f32();
    }

    /// What this run has cost so far, about, in rays: a measure that does not depend on the machine. A sample counts
    /// too, because area sampling draws its vertices without one.
    fn cost(&self) -> f64 {
        let of = |r: &Renderer| r.statistics().rays.total() as f64 + 4.0 * r.statistics().samples as f64;
        self.renderers.iter().map(of).sum()
    }

    /// What the replicates say together.
    pub fn estimate(&self) -> Estimate {
        Estimate::new(&self.replicates)
    }

    /// The mean image.
    fn image(&self) -> Image {
        report::mean(self.renderers.iter().map(|r| r.film().image(r.passes())))
    }

    fn assert_clean(&self) {
        for renderer in &self.renderers {
            assert!(renderer.statistics().rejected.is_empty(), "{}: {:?}", self.name, renderer.statistics().rejected);
            assert!(renderer.film().errors().is_empty(), "{}: {:?}", self.name, renderer.film().errors());
        }
    }
}

/// Two sums of runs, by their indices, whose images must be the same.
pub type Pair = [Vec<usize>; 2];

/// Every pair of `count` runs.
pub fn each_other(count: usize) -> Vec<Pair> {
    (0..count).flat_map(|b| (0..b).map(move |a| [vec![a], vec![b]])).collect()
}

/// The first of `count` runs with each of the others.
pub fn with_the_first(count: usize) -> Vec<Pair> {
    (1..count).map(|b| [vec![0], vec![b]]).collect()
}

/// The estimate of a sum of runs.
fn sum_of(runs: &[Run], side: &[usize]) -> Estimate {
    let mut sums = runs[side[0]].replicates.clone();
    for run in &side[1..] {
        for (sum, further) in sums.iter_mut().zip(&runs[*run].replicates) {
            sum.iter_mut().zip(further).for_each(|(x, y)| *x += y);
        }
    }
    Estimate::new(&sums)
}

/// Compares the images of each of `pairs`, refined by [`converge`], and shows that a bias of `visible` would have been
/// found.
pub fn assert_agree(scene: &str, visible: f64, runs: &mut [Run], pairs: &[Pair]) {
    converge(visible, runs, pairs);
    for run in &*runs {
        println!("  {}: {} × {} spp in {:.1} s", run.name, run.renderers.len(), run.passes(), run.seconds);
    }
    for pair in pairs {
        assert_equal(scene, visible, runs, pair);
    }
}

/// Renders until the comparison of each of `pairs` can see a bias of `visible`.
///
/// Time goes where it lowers the error most, as Neyman allocates samples to strata: of the pair that sees least, to the
/// run whose squared error is largest for what it has cost. A noisy integrator is compared with precise ones.
pub fn converge(visible: f64, runs: &mut [Run], pairs: &[Pair]) {
    // Below it, so that a pair that is refined further for another's sake stays there.
    let aim = 0.98 * visible;
    runs.iter_mut().for_each(|run| run.advance(FIRST));
    loop {
        let seen = |pair: &Pair| Comparison::new(&sum_of(runs, &pair[0]), &sum_of(runs, &pair[1])).visible_bias;
        let (pair, seen) = (pairs.iter().map(|pair| (pair, seen(pair))))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("something to compare");
        if seen < aim {
            break;
        }
        let error2 = |run: usize| runs[run].estimate().error2()[..3].iter().sum::<f64>();
        let gain = |run: usize| error2(run) / runs[run].cost();
        let all = || pair.iter().flatten().copied();
        let noisiest = all().max_by(|a, b| gain(*a).total_cmp(&gain(*b))).expect("two sides");
        let passes = runs[noisiest].passes();
        if passes >= MOST_PASSES {
            break;
        }
        // As many as would do if only this run went on, in steps, because the variances are estimates too.
        let others = all().map(error2).sum::<f64>() - error2(noisiest);
        let left = (error2(noisiest) + others) * (aim / seen).powi(2) - others;
        let factor = if left > 0.0 { error2(noisiest) / left } else { f64::INFINITY };
        runs[noisiest].advance((f64::from(passes) * factor.clamp(1.1, 1.5)).ceil() as u32);
    }
    runs.iter().for_each(Run::assert_clean);
}

/// Compares two sums of runs, and shows that a bias of `visible` in either would have been found.
fn assert_equal(scene: &str, visible: f64, runs: &[Run], pair: &Pair) {
    let name = |side: &[usize]| side.iter().map(|run| runs[*run].name.as_str()).collect::<Vec<_>>().join(" + ");
    let [a, b] = [sum_of(runs, &pair[0]), sum_of(runs, &pair[1])];
    let [a_name, b_name] = [name(&pair[0]), name(&pair[1])];
    let comparison = Comparison::new(&a, &b);
    println!("  {scene}: {a_name} = {b_name}? {comparison}");
    if comparison.differs() {
        let images: Vec<_> = pair.iter().flatten().map(|run| (runs[*run].name.clone(), runs[*run].image())).collect();
        let folder = report::write(&format!("{scene}-{a_name}-{b_name}"), &images);
        panic!("{scene}: {a_name} and {b_name} differ: {comparison}; images in {}", folder.display());
    }
    assert!(comparison.visible_bias < visible, "{scene}: {a_name} and {b_name} are too noisy to tell: {comparison}");
    for bias in [visible, -visible] {
        let planted = Comparison::new(&a.biased(bias), &b);
        // A difference by chance may hide a planted bias of one sign in part; it cannot hide both.
        let found = planted.differs() || Comparison::new(&a.biased(-bias), &b).differs();
        assert!(found, "{scene}: a bias of {bias} in {a_name} went unnoticed: {planted}");
    }
}

pub fn settings(scene: &Scene, kind: IntegratorKind, salt: u64) -> Vec<Settings> {
    let base = Settings { integrator: kind, max_depth: DEPTH, ..Settings::new(scene.camera.sensor()) };
    (0..REPLICATES).map(|r| Settings { seed: 10_000 * (1 + salt) + 100 * kind as u64 + r, ..base.clone() }).collect()
}

/// Compares the integrators `kinds` pair by pair, on the paths of these lengths that all of them cover.
pub fn where_all_cover(name: &str, scene: &Scene, kinds: &[IntegratorKind], lengths: RangeInclusive<u32>) {
    where_all_cover_within(VISIBLE, name, scene, kinds, lengths);
}

/// The same where a bias of 1 % would take too long to see: every comparison sees one of `visible`.
pub fn where_all_cover_within(
    visible: f64,
    name: &str,
    scene: &Scene,
    kinds: &[IntegratorKind],
    lengths: RangeInclusive<u32>,
) {
    where_all_cover_and(visible, name, scene, kinds, &|path| lengths.contains(&path.edges()));
}

/// The same on the paths that `compared` picks from those that all cover.
pub fn where_all_cover_and(
    visible: f64,
    name: &str,
    scene: &Scene,
    kinds: &[IntegratorKind],
    compared: &(dyn Fn(&JoinedPath) -> bool + Sync),
) {
    let start = Instant::now();
    let sensor = scene.camera.sensor();
    let roulette = Settings::new(sensor).roulette;
    let tables: Vec<_> = kinds.iter().map(|kind| Integrator::new(*kind, sensor, DEPTH, roulette)).collect();
    let keep = |path: &JoinedPath| compared(path) && tables.iter().all(|table| table.covers(path));
    let settings: Vec<_> = kinds.iter().map(|kind| settings(scene, *kind, 0)).collect();
    let mut runs: Vec<_> =
        kinds.iter().zip(&settings).map(|(kind, settings)| Run::new(scene, settings, kind.name(), &keep)).collect();
    assert_agree(name, visible, &mut runs, &each_other(kinds.len()));
    println!("{name}: {:.0} s", start.elapsed().as_secs_f32());
}

/// Compares the integrators `kinds`, the last of them bdpt, pair by pair; and light tracing, completed by the paths
/// that it does not cover as the first of `kinds` finds them, with bdpt.
pub fn agreement(name: &str, scene: &Scene, kinds: &[IntegratorKind], compared: Compared) {
    let start = Instant::now();
    let sensor = scene.camera.sensor();
    let table = Integrator::new(IntegratorKind::Light, sensor, DEPTH, Settings::new(sensor).roulette);
    let everything = move |path: &JoinedPath| compared.contains(path);
    let uncovered = |path: &JoinedPath| compared.contains(path) && !table.covers(path);
    let all_settings: Vec<_> =
        kinds.iter().chain([&IntegratorKind::Light]).map(|kind| settings(scene, *kind, 0)).collect();
    let rest_settings = settings(scene, kinds[0], 1);
    let mut runs: Vec<_> = (all_settings.iter())
        .map(|settings| Run::new(scene, settings, settings[0].integrator.name(), &everything))
        .collect();
    runs.push(Run::new(scene, &rest_settings, "uncovered", &uncovered));
    let (bdpt, light, rest) = (kinds.len() - 1, kinds.len(), kinds.len() + 1);
    let mut pairs = each_other(kinds.len());
    pairs.push([vec![light, rest], vec![bdpt]]);
    assert_agree(name, VISIBLE, &mut runs, &pairs);
    let missing = runs[rest].estimate().image_mean() / sum_of(&runs, &[light, rest]).image_mean();
    println!("  {name}: light leaves {:.2} % of the image uncovered", 100.0 * missing);
    println!("{name}: {:.0} s", start.elapsed().as_secs_f32());
}

/// Which paths of a scene are compared.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Compared {
    /// All.
    All,
    /// Those with a vertex between camera and lamp that is not specular. A lamp seen directly, in a mirror or through
    /// glass is found by the same strategy with the weight 1 in every table with s = 0 (and its path is checked by the
    /// identity), but where it is much brighter than the image, the noise of its edge pixels would be all there is to
    /// see.
    Scattered,
}

impl Compared {
    fn contains(self, path: &JoinedPath) -> bool {
        self == Self::All || (1..path.edges()).any(|i| !path.is_delta(i))
    }
}

pub const ALL: [IntegratorKind; 3] = [IntegratorKind::Path, IntegratorKind::Hybrid, IntegratorKind::Bdpt];

fn committed(name: &str, compared: Compared) {
    agreement(name, &scenes::load(name, scenes::square(32, Filter::Box)), &ALL, compared);
}

#[test]
fn in_the_cornell_box() {
    committed("cornell-box", Compared::All);
}

#[test]
fn in_the_cornell_box_with_spheres() {
    committed("cornell-spheres", Compared::Scattered);
}

#[test]
fn in_veachs_room() {
    committed("veach-room", Compared::Scattered);
}

#[test]
fn under_the_metal_ring() {
    committed("caustic-ring", Compared::Scattered);
}

#[test]
fn under_the_glass_sphere() {
    committed("caustic-sphere", Compared::Scattered);
}

#[test]
fn in_the_furnace() {
    committed("furnace", Compared::All);
}
