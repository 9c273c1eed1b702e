//! The importance tree over lights: next-event estimation chooses one by what it could send to where it is asked from.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Quat, Vec3};

use super::{Light, LightId};
use crate::{
    lanes::{Lanes, Vector},
    sampling::{Part, Remainder},
    scene::{
        geometry::{Bounds, Geometry},
        material::EmissionSides,
        point::{Place, Point},
    },
};

/// What is known of some lights together: where they are, and which way they shine.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightBounds {
    bounds: Bounds,
    /// The axis of a cone with half angle θ_o that holds the normals of all.
    axis: Vec3,
    cos_o: f32,
    /// Light leaves a point at angles up to θ_e from its normal.
    cos_e: f32,
    /// The sum of their largest intensities, W/sr or candela.
    intensity: f32,
    /// Whether the backs shine as well.
    sides: EmissionSides,
}

impl LightBounds {
    /// Of one light, whose mean L_e or intensity has this luminance; `None` if it is infinitely far away or large.
    pub fn of(light: &Light, geometry: &Geometry, luminance: f32) -> Option<Self> {
        let everywhere = |at: Bounds, intensity: f32| Self {
            bounds: at,
            axis: Vec3::Z,
            cos_o: -1.0,
            cos_e: 0.0,
            intensity,
            sides: EmissionSides::Front,
        };
        let point = |p: Vec3| Bounds { min: p, max: p };
        let one = match light {
            Light::Area { primitive, area, .. } if geometry.is_sphere(*primitive) => {
                // What it shows to any side is a disk.
                everywhere(geometry.bounds_of(*primitive), 0.25 * luminance * area)
            }
            Light::Area { primitive, area, sides, .. } => Self {
                bounds: geometry.bounds_of(*primitive),
                axis: geometry.sample(*primitive, glam::Vec2::splat(0.5)).normal,
                cos_o: 1.0,
                cos_e: 0.0,
                intensity: luminance * area,
                sides: *sides,
            },
            Light::Point { position, .. } => everywhere(point(*position), luminance),
            Light::Spot(spot) => {
                let (full, outer) = spot.half_angles();
                let shape = everywhere(point(spot.position()), luminance);
                Self { axis: spot.axis(), cos_o: full.cos(), cos_e: (outer - full).cos(), ..shape }
            }
            Light::Goniometric(lamp) => {
                let (axis, half_angle) = lamp.cone();
                let shape = everywhere(point(lamp.position()), luminance);
                Self { axis, cos_o: half_angle.cos(), cos_e: 1.0, ..shape }
            }
            Light::Directional { .. } | Light::Environment { .. } | Light::EnvironmentMap(_) => return None,
        };
        let Self { bounds: Bounds { min, max }, intensity, .. } = one;
        (intensity > 0.0 && intensity.is_finite() && min.is_finite() && max.is_finite()).then_some(one)
    }

    pub fn union(self, other: Self) -> Self {
        let sides = if self.sides == other.sides { self.sides } else { EmissionSides::Both };
        let (axis, cos_o) = cone_around((self.axis, self.cos_o), (other.axis, other.cos_o), sides);
        Self {
            bounds: self.bounds.union(other.bounds),
            axis,
            cos_o,
            cos_e: self.cos_e.min(other.cos_e),
            intensity: (self.intensity + other.intensity).min(f32::MAX),
            sides,
        }
    }

    fn center(&self) -> Vec3 {
        0.5 * self.bounds.min + 0.5 * self.bounds.max
    }

    /// [`Cluster::importance`] of all together.
    #[cfg(test)]
    pub fn importance_at(&self, from: &Point) -> f32 {
        Cluster::new(self, Content::Halves(0)).importance(&Receiver::at(from))
    }

    /// The square of the distance by which that divides.
    #[cfg(test)]
    pub fn distance_squared(&self, from: Vec3) -> f32 {
        let cluster = Cluster::new(self, Content::Halves(0));
        from.distance_squared(cluster.center).max(cluster.radius_squared)
    }

    /// How much splitting off these lights costs: the surface-area orientation heuristic I M_Ω M_A.
    fn cost(&self) -> f32 {
        let size = self.bounds.max - self.bounds.min;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        let (o, e) = (self.cos_o.clamp(-1.0, 1.0).acos(), self.cos_e.clamp(-1.0, 1.0).acos());
        let w = (o + e).min(PI);
        let solid_angle =
            TAU * (1.0 - o.cos()) + FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos());
        self.intensity * solid_angle * area
    }
}

/// The smallest cone around two, each an axis and the cosine of a half angle.
fn cone_around(a: (Vec3, f32), b: (Vec3, f32), sides: EmissionSides) -> (Vec3, f32) {
    let (a, b) = if a.1 <= b.1 { (a, b) } else { (b, a) };
    // Of what shines from both sides, either is the front.
    let b = if sides == EmissionSides::Both && a.0.dot(b.0) < 0.0 { (-b.0, b.1) } else { b };
    if a.1 <= -1.0 {
        return a;
    }
    let [angle_a, angle_b] = [a.1, b.1].map(|cos| cos.clamp(-1.0, 1.0).acos());
    let between = a.0.angle_between(b.0);
    if between + angle_b <= angle_a {
        return a;
    }
    let angle = 0.5 * (angle_a + angle_b + between);
    let Some(around) = a.0.cross(b.0).try_normalize().filter(|_| angle < PI) else { return (a.0, -1.0) };
    ((Quat::from_axis_angle(around, angle - angle_a) * a.0).normalize(), angle.cos())
}

/// Where light is to arrive.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    position: Vec3,
    /// N_g of a surface.
    normal: Option<Vec3>,
}

impl Receiver {
    /// At a point.
    #[inline(always)]
    pub fn at(from: &Point) -> Self {
        Self { position: from.position, normal: (from.place == Place::Surface).then_some(from.normal) }
    }

    /// Where it is.
    #[inline(always)]
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// At the points in all lanes, by the lane's number.
    #[inline(always)]
    pub fn all<L: Lanes, B>(from: &Point<L, B>) -> impl Fn(usize) -> Self {
        let (positions, normals, on_surface) = (from.position.all(), from.normal.all(), from.place == Place::Surface);
        move |k| Self { position: positions[k].into(), normal: on_surface.then(|| normals[k].into()) }
    }
}

/// [`LightBounds`] as far as a choice depends on them, with a sphere in place of the box.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    center: Vec3,
    radius_squared: f32,
    axis: Vec3,
    cos_o: f32,
    sin_o: f32,
    cos_e: f32,
    intensity: f32,
    sides: EmissionSides,
    content: Content,
}

#[derive(Clone, Copy, Debug)]
enum Content {
    Light(LightId),
    /// The index of two more clusters.
    Halves(u32),
}

/// Of a cosine: the rim of a cone that ends abruptly belongs to it.
const ROUNDING: f32 = 1e-4;

impl Cluster {
    fn new(lights: &LightBounds, content: Content) -> Self {
        let LightBounds { bounds, axis, cos_o, cos_e, intensity, sides } = *lights;
        Self {
            center: lights.center(),
            radius_squared: 0.25 * (bounds.max - bounds.min).length_squared(),
            axis,
            cos_o,
            sin_o: sine(cos_o),
            cos_e,
            intensity,
            sides,
            content,
        }
    }

    /// The largest irradiance at `at` by any arrangement of the lights in the cluster, up to a constant and to the
    /// clamp of the distance: I |cos θ′| |cos θ| / d², with the angles that are the most favourable (PBRT, 12.6.3).
    #[inline(always)]
    fn importance(&self, at: &Receiver) -> f32 {
        let from = at.position - self.center;
        let distance_squared = from.length_squared();
        if distance_squared <= self.radius_squared {
            return (self.intensity / self.radius_squared.max(f32::MIN_POSITIVE)).min(f32::MAX);
        }
        let away = from * distance_squared.sqrt().recip().min(f32::MAX);
        // The half angle at which the cluster is seen.
        let sin_squared = self.radius_squared / distance_squared;
        let seen = (sin_squared.sqrt(), (1.0 - sin_squared).max(0.0).sqrt());
        let cos_w = match self.sides {
            EmissionSides::Front => self.axis.dot(away),
            EmissionSides::Both => self.axis.dot(away).abs(),
        };
        let cos_light = if cos_w >= self.cos_o {
            1.0
        } else {
            let sin_w = sine(cos_w);
            let (sin_x, cos_x) =
                (sin_w * self.cos_o - cos_w * self.sin_o, (cos_w * self.cos_o + sin_w * self.sin_o).min(1.0));
            less((sin_x, cos_x), seen)
        };
        if cos_light < self.cos_e - ROUNDING {
            return 0.0;
        }
        let cos_receiver = at.normal.map_or(1.0, |n| {
            let cos = n.dot(away).abs().min(1.0);
            less((sine(cos), cos), seen)
        });
        (self.intensity * cos_light.max(0.0) * cos_receiver / distance_squared).min(f32::MAX)
    }
}

/// √(1 − cos²).
#[inline(always)]
fn sine(cos: f32) -> f32 {
    (1.0 - cos * cos).max(0.0).sqrt()
}

/// The cosine of max(0, a − b), from the sines and cosines of a in [0, π] and b in [0, π/2].
#[inline(always)]
fn less((sin_a, cos_a): (f32, f32), (sin_b, cos_b): (f32, f32)) -> f32 {
    if cos_a > cos_b { 1.0 } else { cos_a * cos_b + sin_a * sin_b }
}

/// A binary tree over the lights with a place (Conty Estevez and Kulla 2018, *Importance Sampling of Many Lights with
/// Adaptive Tree Splitting*). A choice walks down from the root, to each half in proportion to its importance.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    root: Content,
    halves: Vec<[Cluster; 2]>,
    /// The way from the root to each light by its id, the first turn in the lowest bit.
    ways: Vec<Way>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Way {
    /// The light is not in the tree.
    #[default]
    None,
    Turns(u64),
}

/// From this depth on nodes are halved, so that the turns of every way have room: 2³² lights are halved at most 32
/// times.
const DEEP: u32 = 32;
const BUCKETS: usize = 12;
/// So many lights are cut along their widest axis, and their parts grow at the same time.
const MANY: usize = 1 << 12;

impl LightTree {
    /// A tree over these of `count` lights; `None` if there are none.
    pub fn new(mut lights: Vec<(LightId, LightBounds)>, count: usize) -> Option<Self> {
        if lights.is_empty() {
            return None;
        }
        let mut halves = Vec::with_capacity(lights.len() - 1);
        let root = add(&mut halves, &mut lights, 0).content;
        let mut ways = vec![Way::None; count];
        let mut open = vec![(root, 0_u64, 0)];
        while let Some((content, way, depth)) = open.pop() {
            match content {
                Content::Light(id) => ways[id.index()] = Way::Turns(way),
                Content::Halves(i) => {
                    let turns = halves[i as usize].iter().zip([0_u64, 1]);
                    open.extend(
                        turns.map(|(half, turn): (&Cluster, _)| (half.content, way | turn << depth, depth + 1)),
                    );
                }
            }
        }
        Some(Self { root, halves, ways })
    }

    /// The light that is chosen for `at` by a place in the integers that the tree divides, and the place in the
    /// light's share of them.
    ///
    /// Nothing is rescaled on the way: the share is divided where it stands, so that no bit is lost, and its width is
    /// the probability.
    pub fn sample(&self, at: &Receiver, mut place: Remainder) -> (LightId, Remainder) {
        let mut content = self.root;
        loop {
            let halves = match content {
                Content::Light(id) => return (id, place),
                Content::Halves(i) => &self.halves[i as usize],
            };
            let (half, part) = place.split(first_of(place.width(), halves, at));
            place = part;
            content = match half {
                Part::First => halves[0].content,
                Part::Second => halves[1].content,
            };
        }
    }

    /// How many of so many integers lead to the light `id` for `at`; `None` if it is not in the tree.
    pub fn width(&self, at: &Receiver, id: LightId, mut width: u64) -> Option<u64> {
        let Way::Turns(mut way) = self.ways[id.index()] else { return None };
        let mut content = self.root;
        while let Content::Halves(i) = content {
            let halves = &self.halves[i as usize];
            let first = first_of(width, halves, at);
            width = if way & 1 == 0 { first } else { width - first };
            content = halves[(way & 1) as usize].content;
            way >>= 1;
        }
        Some(width)
    }
}

/// What a part of the tree holds.
struct Added {
    lights: LightBounds,
    content: Content,
}

/// Adds a tree over the lights, at least one, to `halves`: its own halves first, so that the top of the tree stays
/// together.
fn add(halves: &mut Vec<[Cluster; 2]>, lights: &mut [(LightId, LightBounds)], depth: u32) -> Added {
    if let [(id, bounds)] = lights {
        return Added { lights: *bounds, content: Content::Light(*id) };
    }
    let many = lights.len() >= MANY;
    let border = split(lights, depth);
    let at = halves.len();
    // Its place; what it is follows from its parts.
    halves.push([Cluster::new(&lights[0].1, Content::Light(lights[0].0)); 2]);
    let (first, second) = lights.split_at_mut(border);
    let both = if many {
        let grow = |lights| {
            let mut own = Vec::new();
            let added = add(&mut own, lights, depth + 1);
            (own, added)
        };
        let (first, second) = rayon::join(|| grow(first), || grow(second));
        [append(halves, first), append(halves, second)]
    } else {
        [add(halves, first, depth + 1), add(halves, second, depth + 1)]
    };
    halves[at] = both.each_ref().map(|half| Cluster::new(&half.lights, half.content));
    let [a, b] = both;
    Added { lights: a.lights.union(b.lights), content: Content::Halves(at as u32) }
}

/// Appends a part that counts its halves from 0.
fn append(halves: &mut Vec<[Cluster; 2]>, (part, added): (Vec<[Cluster; 2]>, Added)) -> Added {
    let offset = halves.len() as u32;
    let moved = |content| match content {
        Content::Halves(i) => Content::Halves(i + offset),
        light @ Content::Light(_) => light,
    };
    halves.extend(part.into_iter().map(|both| both.map(|half| Cluster { content: moved(half.content), ..half })));
    Added { content: moved(added.content), ..added }
}

/// How many of `width` integers lead on to the first of two halves: by importance, and half of them where both may send
/// nothing.
#[inline(always)]
fn first_of(width: u64, halves: &[Cluster; 2], at: &Receiver) -> u64 {
    let [a, b] = halves.each_ref().map(|half| half.importance(at));
    let (small, large) = (a.min(b), a.max(b));
    // The smaller part, up to ½ and in units of 2⁻⁶³: of the larger one, f32 would lose what it lacks to 1.
    let ratio = if large > 0.0 { small / large } else { 1.0 };
    let part = (ratio / (1.0 + ratio) * (1_u64 << 63) as f32) as i64 as u64;
    let of_small = ((u128::from(width) * u128::from(part)) >> 63) as u64;
    if a < b { of_small } else { width - of_small }
}

/// Puts the lights of the cheaper two groups in order, and says where the second begins.
fn split(lights: &mut [(LightId, LightBounds)], depth: u32) -> usize {
    let middle = lights.len() / 2;
    if depth >= DEEP {
        return middle;
    }
    let centers = lights.iter().map(|(_, b)| b.center());
    let (low, high) = centers.fold((Vec3::MAX, Vec3::MIN), |(low, high), c| (low.min(c), high.max(c)));
    let all = lights.iter().map(|(_, b)| b.bounds).reduce(Bounds::union);
    let size = all.map_or(Vec3::ZERO, |b| b.max - b.min);
    let bucket_of = |b: &LightBounds, axis: usize| {
        let part = (b.center()[axis] - low[axis]) / (high[axis] - low[axis]);
        ((part * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    let widest = (high - low).max_position();
    // Of many lights, any cut says little of the orientations: one axis does.
    let tried = |axis: &usize| high[*axis] > low[*axis] && (lights.len() < MANY || *axis == widest);
    let axes: Vec<_> = (0..3).filter(tried).collect();
    for axis in axes {
        let mut buckets = [None; BUCKETS];
        for (_, b) in &*lights {
            let bucket = &mut buckets[bucket_of(b, axis)];
            *bucket = Some(bucket.map_or(*b, |all: LightBounds| all.union(*b)));
        }
        let joined = |part: &[Option<LightBounds>]| {
            part.iter().flatten().copied().reduce(LightBounds::union).map_or(0.0, |b| b.cost())
        };
        // Thin boxes are not cut along.
        let shape = size.max_element() / size[axis];
        for border in 1..BUCKETS {
            let (first, second) = buckets.split_at(border);
            if first.iter().flatten().next().is_none() || second.iter().flatten().next().is_none() {
                continue;
            }
            let cost = shape * (joined(first) + joined(second));
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, border));
            }
        }
    }
    let Some((_, axis, border)) = best else { return middle };
    lights.sort_by_key(|(_, b)| bucket_of(b, axis) >= border);
    lights.partition_point(|(_, b)| bucket_of(b, axis) < border)
}
