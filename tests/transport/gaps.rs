//! What an integrator's table says that it lacks, from which the command line foretells black pixels, is what it does
//! not cover path by path.

use std::sync::Mutex;

use pathspace::{
    integrator::{Gap, Integrator, IntegratorKind},
    path::{Densities, JoinedPath},
    render::{Renderer, Settings},
    sampling::Filter,
    scene::{Scene, camera::Sensor, point::Place},
};

use crate::{
    islands::{Around, Content, Lamp, View, islands},
    scenes,
};

const DEPTH: u32 = 4;

/// Whether the path is of the light that the gap is about.
fn is_of(gap: Gap, path: &JoinedPath) -> bool {
    let n = path.edges();
    let place = path.vertex(n).point.place;
    let smooth = |i: u32| !path.is_delta(i);
    match gap {
        Gap::SpecularSeen => n >= 2 && path.is_delta(1),
        Gap::ParallelBackground => n == 1 && place == Place::Infinite,
        Gap::LightsWithoutExtent => place == Place::Degenerate && n >= 2 && (1..n).all(smooth),
        Gap::CausticsOfPoints => place == Place::Degenerate && n >= 3 && smooth(1) && path.is_delta(n - 1),
        Gap::LightsInSpace => place != Place::Surface,
    }
}

/// Paths of each gap that are looked at, at least.
const ENOUGH: u32 = 20;

/// Of the paths of a gap that bdpt finds in a scene: how many an integrator covers, and how many there are.
fn covered(scene: &Scene, kind: IntegratorKind, gap: Gap) -> (u32, u32) {
    let settings = Settings { max_depth: DEPTH, ..Settings::new(scene.camera.sensor()) };
    let integrator = Integrator::new(kind, scene.camera.sensor(), DEPTH, settings.roulette);
    let count = Mutex::new((0, 0));
    let mut renderer = Renderer::new(scene, &settings);
    while renderer.passes() < 1024 && count.lock().unwrap().1 < ENOUGH {
        renderer.pass_where(&|path| {
            if is_of(gap, path) {
                let mut count = count.lock().unwrap();
                count.0 += u32::from(integrator.covers(path));
                count.1 += 1;
            }
            true
        });
    }
    count.into_inner().unwrap()
}

#[test]
fn a_gap_is_what_the_integrator_does_not_cover() {
    let room = |content, lamp, view| move |sensor: Sensor| islands(content, lamp, view, Around::Nothing, sensor);
    let cases: [(Gap, &dyn Fn(Sensor) -> Scene); 5] = [
        (Gap::SpecularSeen, &room(Content::Mirror, Lamp::Area, View::Pinhole)),
        (Gap::ParallelBackground, &room(Content::Diffuse, Lamp::Map, View::Orthographic)),
        (Gap::LightsWithoutExtent, &room(Content::Diffuse, Lamp::Point, View::Pinhole)),
        (Gap::CausticsOfPoints, &room(Content::Mirror, Lamp::Point, View::Pinhole)),
        (Gap::LightsInSpace, &room(Content::Diffuse, Lamp::Map, View::Pinhole)),
    ];
    for (gap, scene) in cases {
        let scene = scene(scenes::square(24, Filter::Box));
        for kind in IntegratorKind::ALL {
            let (covered, all) = covered(&scene, kind, gap);
            println!("{gap:?}: {kind} covers {covered} of {all}");
            assert!(all >= ENOUGH, "{gap:?}: {all} paths");
            assert_eq!(kind.lacks(gap), covered == 0, "{gap:?}: {kind} covers {covered} of {all} paths");
        }
    }
}
