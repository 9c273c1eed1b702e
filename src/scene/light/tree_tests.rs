//! The choices among lights: probabilities, frequencies, and what the tree's bounds promise.

use glam::Vec3;

use super::{Light, LightChoice, LightId, Lights, Spot, tree::LightBounds};
use crate::{
    math::Rgb,
    sampling::{Independent, Sampler, Stream},
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
    let without_choice = f64::from(lights.pdf_on(id, &p, 1.0).0);
    f64::from(lights.pdf_next_event(&p, from).0) / without_choice
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
                let u = (k as f32 + 0.5) / TRIES as f32;
                let (id, p) = lights.choose_at(&from, u, 0).expect("there are lights");
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
        match lights.sample_next_event(&geometry, &materials, &from, Vec3::splat(0.4), nth) {
            Some((point, pdf)) => {
                assert_eq!(point.light, Some(id));
                assert_eq!(pdf, lights.pdf_on(id, &point, 1.0));
                assert_eq!(pdf, lights.pdf_next_event(&point, &from));
            }
            None => black += 1,
        }
    }
    assert_eq!(black, 1);
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
            let p = lights.sample_position(&geometry, &materials, LightId::new(id), random.next_2d());
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
