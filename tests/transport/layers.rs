//! Layers: those of a partition add up to the image in the film's integers, and each is what a render of its paths
//! alone would be.
//!
//! Oracles: the exact sums of the image; renders with one strategy, which know nothing of layers; a path's class and
//! sides from its definition. They would catch a path in two layers or in none, a layer with another rounding, and an
//! expression that reads a path wrongly.

use pathspace::{
    film::{ExactSum, Film, Half},
    integrator::{IntegratorKind, Weighting},
    layers::{Expression, LayerSet, Layers},
    path::{JoinedPath, Path, Technique},
    render::{Renderer, Settings},
    sampling::{Filter, SamplerKind},
    scene::{Scene, camera::Sensor, point::Place},
};

use crate::scenes;

fn sensor() -> Sensor {
    Sensor { width: 24, height: 20, padding: Filter::BlackmanHarris.padding() }
}

fn settings(integrator: IntegratorKind, sampler: SamplerKind) -> Settings {
    Settings { integrator, sampler, max_depth: 7, filter: Filter::BlackmanHarris, ..Settings::new(sensor()) }
}

const SPP: u32 = 3;

/// All sums of a film.
fn sums(film: &Film) -> Vec<ExactSum> {
    let of = |half| (0..film.pixels()).flat_map(move |pixel| (0..3).map(move |channel| (half, pixel, channel)));
    [Half::Even, Half::Odd].into_iter().flat_map(of).map(|(h, p, c)| film.sum(h, p, c)).collect()
}

fn layers(sets: &[LayerSet], own: &[(&str, &str)], scene: &Scene, settings: &Settings) -> Layers {
    let own: Vec<_> = own.iter().map(|(n, e)| ((*n).to_owned(), Expression::parse(e).unwrap())).collect();
    Layers::new(sets, &own, scene, Renderer::new(scene, settings).integrator()).unwrap()
}

/// The sums of the image and of each layer.
fn render(scene: &Scene, settings: &Settings, layers: &Layers) -> (Vec<ExactSum>, Vec<Vec<ExactSum>>) {
    let mut renderer = Renderer::new(scene, settings).with_layers(layers);
    (0..SPP).for_each(|_| renderer.pass());
    (sums(renderer.film()), renderer.layer_films().iter().map(sums).collect())
}

#[test]
fn those_of_a_partition_add_up_to_the_image() {
    for scene in [scenes::zoo(sensor()), scenes::open_zoo(sensor()), scenes::veiled(sensor())] {
        for kind in IntegratorKind::ALL {
            let settings = settings(kind, kind.description().sampler);
            for set in LayerSet::ALL.into_iter().filter(|set| *set != LayerSet::Unweighted) {
                let layers = layers(&[set], &[], &scene, &settings);
                let (image, parts) = render(&scene, &settings, &layers);
                assert!(image.iter().any(|sum| !sum.is_zero()), "{kind}");
                let total: Vec<ExactSum> = if set.is_partition() {
                    let add = |sum: ExactSum, part: ExactSum| sum.checked_add(part).unwrap();
                    (0..image.len()).map(|i| parts.iter().map(|layer| layer[i]).fold(ExactSum::ZERO, add)).collect()
                } else {
                    parts.last().unwrap().clone()
                };
                assert!(total == image, "{kind}, {set}");
            }
        }
    }
}

#[test]
fn a_strategys_layer_is_the_render_of_that_strategy() {
    let scene = scenes::zoo(sensor());
    // Sobol numbers of a vertex are the same whatever was taken before; independent ones are not.
    let settings = settings(IntegratorKind::Bdpt, SamplerKind::Sobol);
    let layers = layers(&[LayerSet::Strategies], &[], &scene, &settings);
    let (_, parts) = render(&scene, &settings, &layers);
    let strategies: Vec<_> = Renderer::new(&scene, &settings).integrator().techniques().strategies().collect();
    assert_eq!(layers.len(), strategies.len());
    for ((strategy, name), layer) in strategies.into_iter().zip(layers.names()).zip(parts) {
        assert_eq!(name, format!("strategies.s{}t{}", strategy.s, strategy.t));
        let alone = Settings { only: Some((strategy, Weighting::Weighted)), ..settings.clone() };
        let mut renderer = Renderer::new(&scene, &alone);
        (0..SPP).for_each(|_| renderer.pass());
        assert!(sums(renderer.film()) == layer, "{strategy}");
    }
}

#[test]
fn a_strategys_unweighted_layer_is_the_render_of_that_strategy_alone() {
    let scene = scenes::zoo(sensor());
    let settings = settings(IntegratorKind::Bdpt, SamplerKind::Sobol);
    let layers = layers(&[LayerSet::Unweighted], &[], &scene, &settings);
    let (_, parts) = render(&scene, &settings, &layers);
    let strategies = Renderer::new(&scene, &settings).integrator().techniques().strategies().collect::<Vec<_>>();
    assert_eq!(layers.len(), strategies.len());
    let mut compared = 0;
    for (strategy, layer) in strategies.into_iter().zip(parts) {
        let alone = Settings { only: Some((strategy, Weighting::Unweighted)), ..settings.clone() };
        let mut renderer = Renderer::new(&scene, &alone);
        (0..SPP).for_each(|_| renderer.pass());
        for (own, other) in sums(renderer.film()).into_iter().zip(layer) {
            // A weight that is multiplied and divided by leaves a few roundings of f32.
            let (own, other) = (own.to_f64(), other.to_f64());
            assert!((own - other).abs() <= 1e-12 + 2e-6 * own, "{strategy}: {own} and {other}");
            compared += usize::from(own > 0.0);
        }
    }
    assert!(compared > 1000, "{compared} sums are not zero");
}

/// Holds the layer of an expression to the render of those paths for which `keep` holds.
fn assert_layer(scene: &Scene, integrator: IntegratorKind, expression: &str, keep: impl Fn(&Path<'_>) -> bool + Sync) {
    let settings = settings(integrator, SamplerKind::Independent);
    let (_, parts) = render(scene, &settings, &layers(&[], &[("own", expression)], scene, &settings));
    let mut renderer = Renderer::new(scene, &settings);
    let keep = |path: &JoinedPath| path.technique() != Technique::Area && keep(&path.to_path());
    (0..SPP).for_each(|_| renderer.pass_where(&keep));
    let alone = sums(renderer.film());
    assert!(alone.iter().any(|sum| !sum.is_zero()), "no path is '{expression}'");
    assert!(alone == parts[0], "'{expression}' by {integrator}");
}

#[test]
fn an_expressions_layer_is_the_render_of_its_paths() {
    let scene = scenes::zoo(sensor());
    // A vertex between two others is passed if these lie on different sides of its surface.
    let passes = |path: &Path<'_>| {
        let at = |i: usize| path.vertices()[i].point.position.as_dvec3();
        // Of an infinite vertex it is the direction already.
        let infinite = |i: usize| path.vertices()[i].point.place == Place::Infinite;
        let towards = |i: usize, j: usize| if infinite(j) { at(j) } else { at(j) - at(i) };
        let side = |i: usize, j: usize| path.vertices()[i].point.normal.as_dvec3().dot(towards(i, j)) > 0.0;
        (1..path.edges()).any(|i| side(i, i - 1) != side(i, i + 1))
    };
    for integrator in [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Bdpt] {
        assert_layer(&scene, integrator, "C.*[DG]S+L", |path| {
            let class = path.class().to_string();
            let before = class.trim_end_matches('L').trim_end_matches('S');
            before.len() + 1 < class.len() && before.ends_with(['D', 'G'])
        });
        assert_layer(&scene, integrator, "CD.{2}L", |path| {
            path.edges() == 4 && path.class().to_string().starts_with("CD")
        });
        assert_layer(&scene, integrator, "C.*T.*L", passes);
        assert_layer(&scene, integrator, "C[^T]*L", |path| !passes(path));
    }
}

#[test]
fn a_name_picks_its_materials() {
    let scene = scenes::load("cornell-box", sensor());
    let name = scene.materials().iter().map(|m| m.name.as_str()).find(|name| name.contains("red")).unwrap_or("red");
    assert_layer(&scene, IntegratorKind::Bdpt, &format!("C<D'{name}'>.*L"), |path| {
        path.edges() >= 2 && scene.material(path.vertices()[1].point.material).name == name
    });
}
