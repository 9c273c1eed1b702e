//! The choices among lights: probabilities, frequencies, and what the tree's bounds promise.

use glam::{Vec2, Vec3};

use super::{
    Light, LightChoice, LightId, Lights, Spot,
    tree::{LightBounds, Receiver},
};
use crate::{
    math::Rgb,
    sampling::{Block, Choice, Independent, PdfArea, Remainder, Sampler, Sobol, Stream},
    scene::{
        geometry::Geometry,
        material::{EmissionSides, Material, MaterialId},
        point::{Place, Point},
    },
};

/// Lamps of every kind, of very different powers, strewn over a few metres; and two that emit nothing.
fn strewn() -> (Geometry, Vec<Material>, Vec<Light>) {
    let mut random = Independent::new(21, 0, 0, Stream::Light);
    let mut both = Material::diffuse("both", Rgb::ZERO).emitting(Rgb::new(1.0, 2.0, 3.0));
    both.emission_sides = EmissionSides::Both;
    let bright = Material::diffuse("bright", Rgb::ZERO).emitting(Rgb::splat(40.0));
    let front = Material::diffuse("front", Rgb::ZERO).emitting(Rgb::ONE);
    let mut geometry = Geometry::default();
    let place = |random: &mut Independent| 4.0 * (random.next_3d() - 0.5);
    for i in 0..60 {
        let p = place(&mut random);
        let [u, v] = [random.next_3d() - 0.5, random.next_3d() - 0.5];
        geometry.add_triangles(&[p, p + u, p + v], None, &[[0, 1, 2]], MaterialId(i % 3));
    }
    for _ in 0..5 {
        geometry.add_sphere(place(&mut random), 0.2, MaterialId(2));
    }
    let mut others = vec![
        Light::Directional { towards: Vec3::new(0.6, 0.8, 0.0), irradiance: Rgb::splat(2.0) },
        Light::Environment { radiance: Rgb::splat(0.1) },
        Light::Point { position: Vec3::ONE, intensity: Rgb::ZERO },
    ];
    for i in 0..10 {
        let (position, axis) = (place(&mut random), (random.next_3d() - 0.5).normalize());
        let intensity = Rgb::splat(0.1 + i as f32);
        others.push(Light::Point { position: place(&mut random), intensity });
        let outer = 0.1 + 0.15 * i as f32;
        others.push(Light::Spot(Spot::new(position, axis, intensity, outer * (i % 3) as f32 * 0.5, outer)));
    }
    (geometry, vec![both, bright, front], others)
}

fn lights(choice: LightChoice) -> (Geometry, Vec<Material>, Lights) {
    let (geometry, materials, others) = strewn();
    let mut lights = Lights::new(&geometry, &materials, &others);
    lights.choose_by(choice, &geometry);
    (geometry, materials, lights)
}

/// Points on surfaces among the lamps, beside them, and in no surface.
fn receivers() -> impl Iterator<Item = Point> {
    let mut random = Independent::new(4, 0, 0, Stream::Camera);
    (0..24).map(move |i| {
        let position = (random.next_3d() - 0.5) * if i < 16 { 4.0 } else { 40.0 };
        let normal = (random.next_3d() - 0.5).normalize();
        let place = if i % 6 == 5 { Place::Degenerate } else { Place::Surface };
        Point { normal, shading_normal: normal, place, ..Point::nowhere(position) }
    })
}

/// The probability of the light `id` in a next-event estimate at `from`.
fn probability(lights: &Lights, from: &Point, id: LightId) -> f64 {
    let p = Point { light: Some(id), ..Point::nowhere(Vec3::Z) };
    let without_choice = f64::from(lights.pdf_on(id, p.barycentric, p.position.to_array(), 1.0));
    f64::from(lights.pdf_chosen(&p, from).0) / without_choice
}

#[test]
fn lights_are_chosen_as_often_as_their_probability_says() {
    const TRIES: u32 = 1 << 16;
    for choice in [LightChoice::Uniform, LightChoice::Power, LightChoice::Tree] {
        let (.., lights) = lights(choice);
        assert_eq!(lights.choice(), choice);
        let n = lights.all().len();
        for from in receivers() {
            let mut found = vec![0_u32; n];
            for k in 0..TRIES {
                let u = Choice::from((k as f32 + 0.5) / TRIES as f32);
                let (id, p, _) = lights.choose_at(&Receiver::at(&from), u, 0).expect("there are lights");
                let expected = probability(&lights, &from, id);
                assert!((f64::from(p) / expected - 1.0).abs() < 1e-5, "{choice}: {p} {expected}");
                found[id.index()] += 1;
            }
            let all: Vec<_> = (0..n as u32).map(|i| probability(&lights, &from, LightId::new(i))).collect();
            let sum: f64 = all.iter().sum();
            assert!((sum - 1.0).abs() < 1e-4, "{choice}: Σ = {sum}");
            for (i, (p, found)) in all.iter().zip(found).enumerate() {
                // With even numbers, a light is missed or found too often by the ends of its intervals alone.
                let expected = p * f64::from(TRIES);
                assert!(
                    (f64::from(found) - expected).abs() < 3.0 + 1e-3 * expected,
                    "{choice} {i}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn a_sample_of_each_light_has_the_density_of_all() {
    let (geometry, materials, lights) = lights(LightChoice::All);
    assert_eq!(lights.next_event_samples() as usize, lights.all().len());
    let from = receivers().next().unwrap();
    let mut black = 0;
    for nth in 0..lights.next_event_samples() {
        let id = LightId::new(nth);
        match lights.sample_next_event(
            &geometry,
            &materials,
            Receiver::at(&from),
            Vec2::splat(0.4).into(),
            Choice::from(0.4),
            nth,
        ) {
            Some((point, pdf)) => {
                assert_eq!(point.light, Some(id));
                let by_area = lights.pdf_on(id, point.barycentric, point.position.to_array(), 1.0);
                let place = [point.position, point.normal];
                let by_solid_angle = lights.density_from(&geometry, id, from.position, place);
                assert_eq!(pdf, PdfArea(by_area * by_solid_angle));
                assert_eq!(pdf, lights.pdf_next_event(&geometry, &point, &from));
            }
            None => black += 1,
        }
    }
    assert_eq!(black, 1);
}

/// How many of the choice's integers from 0 to `end` lead to each light at `from`: counted share by share, every one.
fn shares(lights: &Lights, from: &Point, end: u64) -> Vec<u64> {
    let (mut found, mut begin) = (vec![0; lights.all().len()], 0);
    while begin < end {
        let (id, _, place) = lights.choose_at(&Receiver::at(from), Choice::new(begin), 0).expect("there are lights");
        assert!(place.width() > 0 && place == Remainder::new(0, place.width()), "{place:?} at its first integer");
        // The last integer of the share leads there too.
        let last = lights
            .choose_at(&Receiver::at(from), Choice::new(begin + (place.width() - 1)), 0)
            .expect("there are lights");
        assert_eq!((last.0, last.2), (id, Remainder::new(place.width() - 1, place.width())));
        found[id.index()] += place.width();
        begin += place.width();
    }
    assert_eq!(begin, end);
    found
}

/// That as many integers lead to each light as its probability says, to none without one, and to each with one.
fn assert_shares(lights: &Lights, from: &Point) {
    let by_tree = lights.integers_of_tree();
    let found = shares(lights, from, by_tree.unwrap_or(Choice::COUNT));
    for (id, width) in (0..).map(LightId::new).zip(found) {
        let of_all = f64::from(lights.choice_of(id));
        // The part by power has been counted by itself; there is no light outside of the tree.
        let expected = match by_tree {
            Some(_) => (width as f64 * 2_f64.powi(-64)) + of_all / 64.0,
            None => width as f64 * 2_f64.powi(-64),
        };
        let said = if lights.emits(id) { probability(lights, from, id) } else { 0.0 };
        assert!((said - expected).abs() <= 2e-6 * expected, "{id:?}: {said} for {expected}");
        assert_eq!(expected > 0.0, lights.emits(id), "{id:?}");
    }
}

/// Lamps of 50 orders of magnitude: float shares of the tree have nothing left for the faint ones.
#[test]
fn lights_of_any_power_are_chosen_as_their_probability_says() {
    let mut random = Independent::new(22, 0, 0, Stream::Light);
    let others: Vec<_> = (0..120)
        .map(|i| Light::Point {
            position: 4.0 * (random.next_3d() - 0.5),
            intensity: Rgb::splat(10_f32.powf(50.0 * random.next_1d() - 25.0)) * f32::from(u8::from(i % 17 > 0)),
        })
        .collect();
    let mut lights = Lights::new(&Geometry::default(), &[], &others);
    for choice in [LightChoice::Uniform, LightChoice::Power, LightChoice::Tree] {
        lights.choose_by(choice, &Geometry::default());
        receivers().for_each(|from| assert_shares(&lights, &from));
    }
}

/// 600 bright triangles to each lamp, which their power all but hides: a lamp's probability is less than half of 2⁻²⁴,
/// and the shares stand where numbers of 24 bits miss every one of the lamps.
#[test]
fn a_crowd_hides_no_lamp() {
    const LAMPS: u32 = 1024;
    const CROWD: u32 = 600;
    let mut geometry = Geometry::default();
    for lamp in 0..LAMPS {
        let place = |i: u32, y: f32| Vec3::new(i as f32, 32.0 * y, 8.0 * lamp as f32) / 128.0;
        let corners = |i, y| [Vec3::ZERO, Vec3::X, Vec3::Z].map(|d| place(i, y) + d / 256.0);
        let crowd: Vec<_> = (0..CROWD).flat_map(|i| corners(i, -36.0)).collect();
        let triangles: Vec<_> = (0..CROWD).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        geometry.add_triangles(&crowd, None, &triangles, MaterialId(0));
        geometry.add_triangles(&corners(lamp % CROWD, 4.0), None, &[[0, 1, 2]], MaterialId(1));
    }
    let emitting = |radiance| Material::diffuse("", Rgb::ZERO).emitting(Rgb::splat(radiance));
    let mut lights = Lights::new(&geometry, &[emitting(1e6), emitting(1e-6)], &[]);
    let is_lamp = |id: LightId| id.index() as u32 % (CROWD + 1) == CROWD;
    let lamps = || (0..LAMPS * (CROWD + 1)).map(LightId::new).filter(|id| is_lamp(*id));
    let from = Point { normal: Vec3::Y, place: Place::Surface, ..Point::nowhere(Vec3::new(3.0, 0.9, 30.0)) };
    assert_eq!(lights.all().len() as u32, LAMPS * (CROWD + 1));
    assert!(lamps().all(|id| lights.choice_of(id) < 0.5 / 16_777_216.0));

    for choice in [LightChoice::Power, LightChoice::Tree] {
        lights.choose_by(choice, &geometry);
        let found = shares(&lights, &from, lights.integers_of_tree().unwrap_or(Choice::COUNT));
        for id in lamps() {
            let share = found[id.index()] as f64 * 2_f64.powi(-64);
            let by_power = f64::from(lights.choice_of(id));
            let expected = if choice == LightChoice::Tree { share + by_power / 64.0 } else { share };
            let said = probability(&lights, &from, id);
            assert!(
                found[id.index()] > 0 && (said / expected - 1.0).abs() < 1e-5,
                "{choice} {id:?}: {said} {expected}"
            );
        }
    }

    // By the samplers' own numbers: the lamps together, 111 expected.
    lights.choose_by(LightChoice::Power, &geometry);
    let tries = 1 << 22;
    let expected = f64::from(tries) * lamps().map(|id| f64::from(lights.choice_of(id))).sum::<f64>();
    let mut independent = Independent::new(1, 0, 0, Stream::Light);
    let sobol = (0..tries).map(|i| {
        let mut sobol = Sobol::new(1, (i / 64) as u32, i as u32 % 64, Stream::Light);
        sobol.start(Block::START);
        sobol.next_choice()
    });
    for found in [
        count(&lights, &from, is_lamp, (0..tries).map(|_| independent.next_choice())),
        count(&lights, &from, is_lamp, sobol),
    ] {
        assert!((f64::from(found) - expected).abs() < 4.0 * expected.sqrt(), "{found} for {expected}");
    }
}

/// How many of the choices lead to such a light.
fn count(lights: &Lights, from: &Point, such: impl Fn(LightId) -> bool, choices: impl Iterator<Item = Choice>) -> u32 {
    choices.filter(|choice| lights.choose_at(&Receiver::at(from), *choice, 0).is_some_and(|(id, ..)| such(id))).count()
        as u32
}

/// Under a ceiling of small lamps, the tree comes much nearer than power to choosing in proportion to what arrives.
#[test]
fn the_tree_follows_what_arrives() {
    let mut random = Independent::new(8, 0, 0, Stream::Connection);
    let mut geometry = Geometry::default();
    for _ in 0..200 {
        let p = Vec3::new(20.0 * (random.next_1d() - 0.5), 2.0, 20.0 * (random.next_1d() - 0.5));
        let downwards = [p, p + 0.1 * Vec3::X, p + 0.1 * Vec3::Z];
        geometry.add_triangles(&downwards, None, &[[0, 1, 2]], MaterialId(0));
    }
    let material = Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::ONE);
    let mut lights = Lights::new(&geometry, &[material], &[]);
    lights.choose_by(LightChoice::Tree, &geometry);
    // Σ p log(p/q) against the ideal choice, by power and by the tree.
    let (mut by_power, mut by_tree) = (0.0, 0.0);
    for _ in 0..50 {
        let place = Vec3::new(16.0 * (random.next_1d() - 0.5), -1.0, 16.0 * (random.next_1d() - 0.5));
        let from = Point { normal: Vec3::Y, place: Place::Surface, ..Point::nowhere(place) };
        let arriving = lights.area_lights().map(|(id, primitive)| {
            let to = geometry.bounds_of(primitive).min - from.position;
            (id, f64::from(to.y * to.y / to.length_squared().powi(2)))
        });
        let arriving: Vec<_> = arriving.collect();
        let all: f64 = arriving.iter().map(|(_, e)| e).sum();
        for (id, e) in arriving {
            by_power += e / all * (e / all / f64::from(lights.choice_of(id))).ln();
            by_tree += e / all * (e / all / probability(&lights, &from, id)).ln();
        }
    }
    assert!(by_tree < 0.4 * by_power, "{by_power} {by_tree}");
}

/// Whatever arrives from a light, each cluster that holds it promises at least as much of it.
#[test]
fn clusters_promise_enough() {
    let (geometry, materials, others) = strewn();
    let lights = Lights::new(&geometry, &materials, &others);
    let bounds = |id: u32| {
        let light = lights.get(LightId::new(id));
        LightBounds::of(light, &geometry, light.brightness()).filter(|_| lights.emits(LightId::new(id)))
    };
    let mut random = Independent::new(13, 0, 0, Stream::Connection);
    let mut checked = 0;
    for from in receivers().filter(|from| from.place == Place::Surface) {
        for id in 0..lights.all().len() as u32 {
            let Some(own) = bounds(id) else { continue };
            let other = bounds((id * 7 + 3) % 60).expect("a triangle");
            let p = lights.sample_position(
                &geometry,
                &materials,
                LightId::new(id),
                random.next_square(),
                random.next_choice().whole(),
            );
            let to = p.position - from.position;
            let w = to.normalize();
            let intensity = match lights.get(LightId::new(id)) {
                Light::Area { area, .. } if p.place == Place::Surface && id >= 60 => 0.25 * area,
                Light::Area { area, .. } => area * p.normal.dot(w).abs(),
                _ => 1.0,
            };
            let arriving = crate::math::luminance(lights.le(&p, -w)) * intensity * from.normal.dot(w).abs();
            for cluster in [own, own.union(other), other.union(own)] {
                let promised = cluster.importance_at(&from);
                // The distance is clamped to the cluster's radius, from its centre.
                let nearest = cluster.distance_squared(from.position);
                assert!(promised * nearest >= 0.999 * arriving, "{id}: {promised} for {arriving}");
                checked += 1;
            }
        }
    }
    assert!(checked > 3000, "{checked}");
}
