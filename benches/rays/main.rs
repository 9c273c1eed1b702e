//! `cargo bench --bench rays`: rays per second, in batches and one by one, against Embree's single-ray queries, on the
//! same meshes and rays, by one thread.
//!
//! `EMBREE_LIBRARY` names Embree 4's shared library; the wheel `embreex==4.4.0` holds one
//! (`embreex.libs/libembree4*.so*`). Without it there is nothing to compare with, and only our own figures are printed.
//! Rounds are interleaved; a figure is the median. Compare figures of one run only. Arguments choose meshes (`cornell`,
//! `interior`, `terrain`) or the count of leaks (`leaks`).

#![allow(clippy::print_stdout)] // the report of a benchmark

mod embree;
mod meshes;

use std::{hint::black_box, rc::Rc, time::Instant};

use embree::{Embree, HIGH_FAST, HIGH_ROBUST, MEDIUM_FAST, MEDIUM_ROBUST, Mode};
use glam::{Vec3, vec3};
use libloading::Library;
use meshes::{Random, Soup};
use pathspace::scene::{
    geometry::{Geometry, Hits, PrimitiveId, Ray, Rays},
    material::MaterialId,
};

const ROUNDS: usize = 5;
const SIDE: u32 = 512;

/// How many rays a batch has: as many as a wave of paths.
const BATCH: usize = 2048;

enum Engine {
    Batches(Rc<Geometry>),
    Single(Rc<Geometry>),
    Embree(Embree),
}

impl Engine {
    /// How many of the rays hit something, by the query that `set` is for, and the seconds that this takes.
    fn count(&self, set: &Set) -> (usize, f64) {
        let rays = set.rays.iter();
        let start = Instant::now();
        let hits = match (self, set.query) {
            (Self::Batches(g), query) => return count_in_batches(g, query, &set.rays),
            (Self::Single(g), Query::Closest) => rays.filter(|r| g.closest(r, PrimitiveId::NONE).is_some()).count(),
            (Self::Single(g), Query::Any) => rays.filter(|r| g.obstacle(r, [PrimitiveId::NONE; 2]).is_some()).count(),
            (Self::Embree(e), Query::Closest) => rays.filter(|r| e.closest(r).is_some()).count(),
            (Self::Embree(e), Query::Any) => rays.filter(|r| e.occluded(r)).count(),
        };
        (black_box(hits), start.elapsed().as_secs_f64())
    }
}

fn built(soup: &Soup) -> Rc<Geometry> {
    let mut geometry = Geometry::default();
    geometry.add_triangles(&soup.positions, None, &soup.triangles, MaterialId(0));
    geometry.build();
    Rc::new(geometry)
}

/// That the rays already lie side by side, as one stage of a wave leaves them to the next, takes no time here.
fn count_in_batches(geometry: &Geometry, query: Query, rays: &[Ray]) -> (usize, f64) {
    let (mut batch, mut hits, mut found) = (Rays::default(), Hits::default(), Hits::default());
    let (mut count, mut seconds) = (0, 0.0);
    for rays in rays.chunks(BATCH) {
        batch.clear();
        batch.extend(rays, |_| [PrimitiveId::NONE; 2]);
        let start = Instant::now();
        count += match query {
            Query::Closest => {
                geometry.closest_of_each(batch.columns(), &mut hits);
                hits.iter().flatten().count()
            }
            Query::Any => {
                geometry.obstacle_of_each(batch.columns(), &mut found);
                found.iter().flatten().count()
            }
        };
        seconds += start.elapsed().as_secs_f64();
    }
    (black_box(count), seconds)
}

#[derive(Clone, Copy)]
enum Query {
    Closest,
    Any,
}

struct Set {
    name: &'static str,
    query: Query,
    rays: Vec<Ray>,
}

fn cosine(normal: Vec3, random: &mut Random) -> Vec3 {
    let (angle, z) = (random.within(0.0, std::f32::consts::TAU), random.within(-1.0, 1.0));
    let s = (1.0 - z * z).sqrt();
    (1.0005 * normal + vec3(s * angle.cos(), s * angle.sin(), z)).normalize()
}

/// Every other bit of `i`: with `i >> 1` for the other, pixels in Morton order.
fn every_other_bit(i: u32) -> f32 {
    (0..16).map(|k| (i >> (2 * k) & 1) << k).sum::<u32>() as f32
}

fn primary(soup: &Soup, random: &mut Random) -> Vec<Ray> {
    let forward = (soup.target - soup.eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let mut at = |i: u32| 2.0 * (every_other_bit(i) + random.unit()) / SIDE as f32 - 1.0;
    (0..SIDE * SIDE)
        .map(|i| {
            let direction = (forward + 0.45 * (right * at(i) - up * at(i >> 1))).normalize();
            Ray { origin: soup.eye, direction, t_max: f32::INFINITY }
        })
        .collect()
}

/// Cosine-distributed rays from where `rays` hit, off the surface by an ample distance.
fn bounce(geometry: &Geometry, soup: &Soup, rays: &[Ray], random: &mut Random) -> Vec<Ray> {
    let reach = soup.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    rays.iter()
        .filter_map(|ray| {
            let hit = geometry.closest(ray, PrimitiveId::NONE)?;
            let normal = geometry.surface(ray, &hit).normal;
            let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
            let origin = ray.origin + hit.t * ray.direction + 2e-5 * reach * normal;
            Some(Ray { origin, direction: cosine(normal, random), t_max: f32::INFINITY })
        })
        .collect()
}

/// The inner part of a segment.
fn between(a: Vec3, b: Vec3) -> Ray {
    Ray { origin: a + 1e-3 * (b - a), direction: 0.998 * (b - a), t_max: 1.0 }
}

/// Segments between points that are uniform over the surface, without grazing ones, whose answer is ill-conditioned.
fn pairs(soup: &Soup, random: &mut Random) -> Vec<Ray> {
    let mut total = 0.0;
    let sums: Vec<f64> = (0..soup.triangles.len())
        .map(|i| {
            let [a, b, c] = soup.corners(i);
            total += f64::from((b - a).cross(c - a).length());
            total
        })
        .collect();
    let mut point = || {
        let u = total * (random.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        let [a, b, c] = soup.corners(sums.partition_point(|s| *s <= u));
        let (s, v) = (random.unit().sqrt(), random.unit());
        (a * (1.0 - s) + b * (s * (1.0 - v)) + c * (s * v), (b - a).cross(c - a).normalize_or_zero())
    };
    (0..250_000)
        .filter_map(|_| {
            let ((a, n), (b, m)) = (point(), point());
            let cosine = n.dot(b - a).abs().min(m.dot(b - a).abs());
            (cosine > 0.02 * a.distance(b)).then(|| between(a, b))
        })
        .collect()
}

fn sets(geometry: &Geometry, soup: &Soup) -> [Set; 5] {
    let mut random = Random(11);
    let primary = primary(soup, &mut random);
    let first = bounce(geometry, soup, &primary, &mut random);
    let mut shuffled = bounce(geometry, soup, &first, &mut random);
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, (random.bits() % (i as u64 + 1)) as usize);
    }
    let low = soup.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let size = soup.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max) - low;
    let light = first
        .iter()
        .map(|ray| {
            let at = vec3(random.within(0.35, 0.65), 0.98, random.within(0.35, 0.65));
            between(ray.origin, low + at * size)
        })
        .collect();
    let pairs = pairs(soup, &mut random);
    [
        Set { name: "primary", query: Query::Closest, rays: primary },
        Set { name: "bounce", query: Query::Closest, rays: first },
        Set { name: "shuffled", query: Query::Closest, rays: shuffled },
        Set { name: "pairs", query: Query::Any, rays: pairs },
        Set { name: "light", query: Query::Any, rays: light },
    ]
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn compare(name: &str, soup: &Soup, library: Option<&'static Library>, modes: &[(&str, Mode)]) {
    let geometry = built(soup);
    let sets = sets(&geometry, soup);
    let [batches, single] = [Engine::Batches(Rc::clone(&geometry)), Engine::Single(geometry)];
    let mut engines = vec![("batches", &batches), ("one by one", &single)];
    let others: Vec<_> = library
        .map(|l| modes.iter().map(|&(name, mode)| (name, Engine::Embree(Embree::new(l, soup, mode)))).collect())
        .unwrap_or_default();
    engines.extend(others.iter().map(|(name, e)| (*name, e)));
    println!(
        "\n{name}: {} triangles; Mrays/s, median of {ROUNDS} interleaved rounds (batches over it)",
        soup.triangles.len()
    );
    let mut rows = vec![String::new(); engines.len()];
    for set in &sets {
        let mut seconds = vec![Vec::new(); engines.len()];
        let mut hits = vec![0; engines.len()];
        for _ in 0..ROUNDS {
            for (i, (_, engine)) in engines.iter().enumerate() {
                let (count, time) = engine.count(set);
                hits[i] = count;
                seconds[i].push(time);
            }
        }
        let speeds: Vec<f64> = seconds.into_iter().map(|s| set.rays.len() as f64 * 1e-6 / median(s)).collect();
        for (i, row) in rows.iter_mut().enumerate() {
            let odd = hits[i].abs_diff(hits[0]);
            // An engine that finds other surfaces would not be worth timing; a few rays graze edges.
            assert!(odd * 200 <= set.rays.len(), "{}: {odd} of the {} rays hit otherwise", engines[i].0, set.name);
            *row += &format!("  {} {:6.2} ({:4.2})", set.name, speeds[i], speeds[0] / speeds[i]);
        }
    }
    for ((name, _), row) in engines.iter().zip(rows) {
        println!("  {name:13}{row}");
    }
}

/// Aims at vertices and edges of a closed sphere from inside: a ray that finds nothing leaked.
fn leaks(library: Option<&'static Library>) {
    for center in [Vec3::ZERO, vec3(1000.0, 50.0, -300.0)] {
        let soup = meshes::sphere(center);
        let mut random = Random(9);
        let rays: Vec<Ray> = (0..1_000_000)
            .map(|i| {
                let [a, b, _] = soup.corners((random.bits() % soup.triangles.len() as u64) as usize);
                let target = a + (b - a) * if i % 4 == 0 { 0.0 } else { random.unit() };
                let inside = vec3(random.within(-0.5, 0.5), random.within(-0.5, 0.5), random.within(-0.5, 0.5));
                let origin = center + inside;
                Ray { origin, direction: (target - origin).normalize(), t_max: f32::INFINITY }
            })
            .collect();
        let set = Set { name: "leaks", query: Query::Closest, rays };
        let count = |e: Engine| set.rays.len() - e.count(&set).0;
        println!("\nsphere at {center}: leaks of {} rays", set.rays.len());
        let geometry = built(&soup);
        println!("  batches       {}", count(Engine::Batches(Rc::clone(&geometry))));
        println!("  one by one    {}", count(Engine::Single(geometry)));
        for (name, mode) in [("fast", MEDIUM_FAST), ("robust", MEDIUM_ROBUST)] {
            if let Some(l) = library {
                println!("  Embree {name:6} {}", count(Engine::Embree(Embree::new(l, &soup, mode))));
            }
        }
    }
}

fn main() {
    let library = std::env::var_os("EMBREE_LIBRARY").map(|path| {
        // SAFETY: whoever sets the variable vouches for the library.
        let library = unsafe { Library::new(&path) }.unwrap_or_else(|e| panic!("cannot load EMBREE_LIBRARY: {e}"));
        &*Box::leak(Box::new(library))
    });
    if library.is_none() {
        println!("SKIPPED: Embree, because EMBREE_LIBRARY does not name its shared library");
    }
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let asked = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    let medium = [("medium fast", MEDIUM_FAST), ("medium robust", MEDIUM_ROBUST)];
    let high = [("high fast", HIGH_FAST), ("high robust", HIGH_ROBUST)];
    if asked("cornell") {
        compare("cornell", &meshes::cornell(), library, &medium);
    }
    if asked("interior") {
        compare("interior", &meshes::interior(), library, &high);
    }
    if asked("terrain") {
        compare("terrain", &meshes::terrain(), library, &medium);
    }
    if asked("leaks") {
        leaks(library);
    }
}
