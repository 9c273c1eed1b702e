//! Agreement: integrators that cover the same paths give the same image, region by region, within what chance allows,
//! and where light tracing does not cover, the difference is exactly the uncovered class.

use std::{ops::RangeInclusive, time::Instant};

use pathspace::{
    integrator::{Integrator, IntegratorKind},
    path::{Densities, JoinedPath},
    render::{Renderer, Settings},
    sampling::Filter,
    scene::Scene,
    statistics::{Comparison, Estimate, Regions, regions},
};

use crate::{report, scenes};

/// The bias of the whole image that every comparison must be able to see.
const VISIBLE: f64 = 0.01;
/// 0.68² + 0.68² < 1: see [`Refined`].
const EVENLY: f64 = 0.68 * VISIBLE;

/// How far the estimates are refined, as the bias that each could see against an exact one. Two of them together see
/// less than [`VISIBLE`].
#[derive(Clone, Copy)]
enum Refined {
    /// All by [`EVENLY`].
    Evenly,
    /// For caustics, where path tracing is the slow one and the others leave it most of the budget: 0.8² + 0.5² < 1.
    PathLess,
}

impl Refined {
    fn of(self, kind: IntegratorKind) -> f64 {
        match (self, kind) {
            // Cheap, and what it does not cover is still to be added.
            (_, IntegratorKind::Light) => 0.005,
            (Self::Evenly, _) => EVENLY,
            (Self::PathLess, IntegratorKind::Path) => 0.008,
            (Self::PathLess, _) => 0.005,
        }
    }
}

/// The longest paths, in edges: caustics seen in mirrors and through glass, and some indirect light, are among them.
pub const DEPTH: u32 = 6;
/// Independent replicates of each estimate. More would not cost more samples, and make the variances more certain.
const REPLICATES: u64 = 24;
/// Where a scene's variance makes the visible bias unreachable, that is a failure and not a reason to go on forever.
const MOST_SPP: u32 = 1 << 15;

/// One estimate of a scene, from replicates whose seeds follow a fixed rule.
pub struct Run<'a> {
    pub name: String,
    keep: &'a (dyn Fn(&JoinedPath) -> bool + Sync),
    renderers: Vec<Renderer<'a>>,
}

impl<'a> Run<'a> {
    pub fn new(
        scene: &'a Scene,
        settings: &'a [Settings],
        name: &str,
        keep: &'a (dyn Fn(&JoinedPath) -> bool + Sync),
    ) -> Self {
        Self { name: name.to_owned(), keep, renderers: settings.iter().map(|s| Renderer::new(scene, s)).collect() }
    }

    /// Renders until the image's mean shows a bias of `refined` against an exact estimate.
    pub fn converge(mut self, refined: f64) -> Self {
        let start = Instant::now();
        let mut spp = 8;
        loop {
            self.advance(spp);
            let estimate = self.estimate();
            let visible = Comparison::new(&estimate, &estimate.exact()).visible_bias;
            if visible < refined || spp >= MOST_SPP {
                break;
            }
            // The error falls as the square root; a little more saves a round, and too much more costs time.
            spp = (f64::from(spp) * (1.1 * (visible / refined).powi(2)).clamp(1.3, 3.0)) as u32;
        }
        for renderer in &self.renderers {
            assert!(renderer.statistics().rejected.is_empty(), "{}: {:?}", self.name, renderer.statistics().rejected);
            assert!(renderer.film().errors().is_empty(), "{}: {:?}", self.name, renderer.film().errors());
        }
        println!("  {}: {} × {spp} spp in {:.1} s", self.name, self.renderers.len(), start.elapsed().as_secs_f32());
        self
    }

    /// Brings every replicate to `spp` passes.
    fn advance(&mut self, spp: u32) {
        for renderer in &mut self.renderers {
            while renderer.passes() < spp {
                renderer.pass_where(&|path| (self.keep)(path));
            }
        }
    }

    fn replicates(&self) -> Vec<Regions> {
        self.renderers.iter().map(|r| regions(&r.film().image(r.passes()))).collect()
    }

    /// What the replicates say together.
    pub fn estimate(&self) -> Estimate {
        Estimate::new(&self.replicates())
    }

    /// The mean image.
    pub fn image(&self) -> pathspace::film::Image {
        let images = self.renderers.iter().map(|r| r.film().image(r.passes()));
        report::mean(images)
    }
}

pub fn settings(scene: &Scene, kind: IntegratorKind, salt: u64) -> Vec<Settings> {
    let base = Settings { integrator: kind, max_depth: DEPTH, ..Settings::new(scene.camera.sensor()) };
    (0..REPLICATES).map(|r| Settings { seed: 10_000 * (1 + salt) + 100 * kind as u64 + r, ..base.clone() }).collect()
}

/// Compares two estimates, and shows that a bias of 1 % in either would have been found.
pub fn assert_agree(
    scene: &str,
    a: (&str, &Estimate),
    b: (&str, &Estimate),
    images: impl Fn() -> Vec<(String, pathspace::film::Image)>,
) {
    assert_agree_within(VISIBLE, scene, a, b, images);
}

/// The same with another bias than 1 %.
fn assert_agree_within(
    visible: f64,
    scene: &str,
    a: (&str, &Estimate),
    b: (&str, &Estimate),
    images: impl Fn() -> Vec<(String, pathspace::film::Image)>,
) {
    let comparison = Comparison::new(a.1, b.1);
    println!("  {scene}: {} = {}? {comparison}", a.0, b.0);
    if comparison.differs() {
        let folder = report::write(&format!("{scene}-{}-{}", a.0, b.0), &images());
        panic!("{scene}: {} and {} differ: {comparison}; images in {}", a.0, b.0, folder.display());
    }
    assert!(comparison.visible_bias < visible, "{scene}: {} and {} are too noisy to tell: {comparison}", a.0, b.0);
    for bias in [visible, -visible] {
        let planted = Comparison::new(&a.1.biased(bias), b.1);
        // A difference by chance may hide a planted bias of one sign in part; it cannot hide both.
        let found = planted.differs() || Comparison::new(&a.1.biased(-bias), b.1).differs();
        assert!(found, "{scene}: a bias of {bias} in {} went unnoticed: {planted}", a.0);
    }
}

/// Compares estimates pair by pair.
fn assert_pairs_agree(visible: f64, scene: &str, runs: &[Run]) {
    let images = || runs.iter().map(|r| (r.name.clone(), r.image())).collect::<Vec<_>>();
    for (i, a) in runs.iter().enumerate() {
        for b in &runs[i + 1..] {
            assert_agree_within(visible, scene, (&a.name, &a.estimate()), (&b.name, &b.estimate()), images);
        }
    }
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
    let runs: Vec<_> = (kinds.iter().zip(&settings))
        .map(|(kind, settings)| Run::new(scene, settings, kind.name(), &keep).converge(EVENLY * visible / VISIBLE))
        .collect();
    assert_pairs_agree(visible, name, &runs);
    println!("{name}: {:.0} s", start.elapsed().as_secs_f32());
}

/// Compares the integrators `kinds`, the last of them bdpt, pair by pair; then light tracing, completed by what it does
/// not cover as the first of `kinds` finds it.
fn compare(name: &str, scene: &Scene, kinds: &[IntegratorKind], refined: Refined, compared: Compared) {
    let start = Instant::now();
    let everything = move |path: &JoinedPath| compared.contains(path);
    let all_settings: Vec<_> = IntegratorKind::ALL.into_iter().map(|kind| settings(scene, kind, 0)).collect();
    let run = |kind: IntegratorKind| {
        Run::new(scene, &all_settings[kind as usize], kind.name(), &everything).converge(refined.of(kind))
    };
    let runs: Vec<_> = kinds.iter().copied().map(run).collect();
    assert_pairs_agree(VISIBLE, name, &runs);

    // light = all that it covers: adding the paths that it does not cover, found by path tracing, completes the image.
    let sensor = scene.camera.sensor();
    let table = Integrator::new(IntegratorKind::Light, sensor, DEPTH, Settings::new(sensor).roulette);
    let uncovered = |path: &JoinedPath| compared.contains(path) && !table.covers(path);
    let rest_settings = settings(scene, kinds[0], 1);
    let light = run(IntegratorKind::Light);
    let mut rest = Run::new(scene, &rest_settings, "paths that light does not cover", &uncovered);
    // As precise as bdpt's own estimate leaves it to be.
    let mut spp = LOOK_FOR_UNCOVERED;
    let sum = loop {
        rest.advance(spp);
        let replicates = light.replicates().into_iter().zip(rest.replicates());
        let sums: Vec<Regions> = replicates.map(|(l, r)| l.iter().zip(r).map(|(x, y)| x + y).collect()).collect();
        let sum = Estimate::new(&sums);
        let visible = Comparison::new(&sum, &sum.exact()).visible_bias;
        if visible < 0.98 * (VISIBLE.powi(2) - refined.of(IntegratorKind::Bdpt).powi(2)).sqrt()
            || spp >= MOST_SPP
            || rest.estimate().image_mean() == 0.0
        {
            break sum;
        }
        spp = spp * 3 / 2;
    };
    let missing = rest.estimate().image_mean() / sum.image_mean();
    println!("  {name}: light leaves {:.2} % of the image uncovered", 100.0 * missing);
    let bdpt = &runs[runs.len() - 1];
    assert_agree(name, ("light + uncovered", &sum), (&bdpt.name, &bdpt.estimate()), || {
        vec![("light".into(), light.image()), ("uncovered".into(), rest.image()), ("bdpt".into(), bdpt.image())]
    });
    println!("{name}: {:.0} s", start.elapsed().as_secs_f32());
}

/// Passes after which a scene where not one path was uncovered is taken to have none; if it has some after all, light
/// and bdpt differ.
const LOOK_FOR_UNCOVERED: u32 = 16;

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

/// [`compare`] in a scene where no integrator is much slower than the others.
pub fn agreement(name: &str, scene: &Scene, kinds: &[IntegratorKind], compared: Compared) {
    compare(name, scene, kinds, Refined::Evenly, compared);
}

fn committed(name: &str, refined: Refined, compared: Compared) {
    compare(name, &scenes::load(name, scenes::square(32, Filter::Box)), &ALL, refined, compared);
}

#[test]
fn in_the_cornell_box() {
    committed("cornell-box", Refined::Evenly, Compared::All);
}

#[test]
fn in_the_cornell_box_with_spheres() {
    committed("cornell-spheres", Refined::PathLess, Compared::Scattered);
}

#[test]
fn in_veachs_room() {
    committed("veach-room", Refined::Evenly, Compared::Scattered);
}

#[test]
fn under_the_metal_ring() {
    committed("caustic-ring", Refined::PathLess, Compared::Scattered);
}

#[test]
fn under_the_glass_sphere() {
    committed("caustic-sphere", Refined::PathLess, Compared::Scattered);
}

#[test]
fn in_the_furnace() {
    committed("furnace", Refined::Evenly, Compared::All);
}
