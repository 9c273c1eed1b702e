//! Lamps near by: their places are sampled uniformly in the solid angle that the lamp subtends.
//!
//! Uniform in area, a place is too rare by cos/d² where the lamp is close, and an estimate as noisy as cos/d² varies
//! over the lamp. Which of the two it is depends on the lamp and on the point from which it is seen, on nothing else:
//! so the density of a place can be found again from both.

use std::f32::consts::PI;

use glam::{DVec3, Vec2, Vec3};

use super::{Light, LightId, Lights};
use crate::{
    lanes::{Float, Lanes, Select, Vector, Work},
    sampling::{Remainder, Square, warp},
    scene::{
        geometry::{Geometry, PrimitiveId, Surface},
        material::{EmissionSides, Material},
        point::{Place, Point},
    },
};

/// A triangle is near where the squared distance of its centre is below so many times its area.
const NEAR: f32 = 8.0;
/// The least squared sine of the angle at which a corner is seen over the triangle's plane: below, rounding decides the
/// solid angle.
const LOWEST: f32 = 1e-6;
/// The least squared ratio of twice a triangle's area to its longest side's square: of thinner ones, f32 does not know
/// the area well.
const THINNEST: f32 = 1e-3;
/// A place of a near triangle is nearer than so many times its area, squared: √NEAR and two thirds of the longest side
/// that [`THINNEST`] allows.
const REACH: f32 = 67.0;
/// How far from a sphere, in radii, it is seen as a cone.
const CLEAR: f64 = 1e-4;

/// A triangle as it stands before a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outlook<V: Vector> {
    /// The vectors to the corners.
    corners: [V; 3],
    /// The squares of their lengths.
    squares: [V::F; 3],
    /// The product of these vectors: six times the volume between point and triangle.
    product: V::F,
    /// The square of twice the area.
    four_areas_squared: V::F,
    /// Where its places are chosen by solid angle.
    pub is_near: <V::Lanes as Lanes>::M,
}

impl<V: Vector> Outlook<V> {
    /// The outlook from a point on the triangle with these corners.
    #[inline(always)]
    pub fn of([p, q, r]: [V; 3], from: V) -> Self {
        let (u, v) = (q - p, r - p);
        let (p, q, r) = (p - from, q - from, r - from);
        let normal = cross(u, v);
        let (across, product) = (normal.dot(normal), normal.dot(p));
        let lanes = product.lanes();
        // Nine times the centre's squared distance, whose square is below that of 9 NEAR times the area.
        let center = p + q + r;
        let distance = center.dot(center);
        let squares = [p.dot(p), q.dot(q), r.dot(r)];
        let farthest = squares[0].max(squares[1]).max(squares[2]);
        let third = v - u;
        let longest = u.dot(u).max(v.dot(v)).max(third.dot(third));
        let is_close = (distance * distance).lt(across * (20.25 * NEAR * NEAR));
        let is_over_plane = (farthest * across * LOWEST).lt(product * product);
        let is_wide = (longest * longest * THINNEST).lt(across);
        let is_finite = across.lt(lanes.splat(f32::INFINITY));
        let is_near = is_close & is_over_plane & is_wide & is_finite;
        Self { corners: [p, q, r], squares, product, four_areas_squared: across, is_near }
    }

    /// The barycentric coordinates of a place uniform in solid angle, for such coordinates of one that is uniform in
    /// area; and A/Ω.
    #[inline(always)]
    pub fn place(self, b: [V::F; 2]) -> ([V::F; 2], V::F) {
        self.product.lanes().call(Placed { outlook: self, b })
    }

    /// A/Ω.
    #[inline(always)]
    pub fn area_of_solid_angle(self) -> V::F {
        self.product.lanes().call(Measured { outlook: self })
    }

    #[inline(always)]
    fn view(&self) -> View<V> {
        let [p, q, r] = self.corners;
        let one = self.product.lanes().splat(1.0);
        let [x, y, z] = self.squares;
        let nearness = [one / x.sqrt(), one / y.sqrt(), one / z.sqrt()];
        let [p, q, r] = [p * nearness[0], q * nearness[1], r * nearness[2]];
        let volume = self.product.abs() * nearness[0] * nearness[1] * nearness[2];
        let (pq, qr, pr) = (p.dot(q), q.dot(r), p.dot(r));
        let half = warp::angle([one + pq + qr + pr, volume]);
        let area_of_solid_angle = self.four_areas_squared.sqrt() * 0.5 / (half * 2.0);
        View { directions: [p, q, r], nearness, volume, cosines: [pq, qr, pr], half, area_of_solid_angle }
    }
}

/// [`Outlook::place`] as a function of its own: few places are near.
struct Placed<V: Vector> {
    outlook: Outlook<V>,
    b: [V::F; 2],
}

impl<V: Vector> Work for Placed<V> {
    type Output = ([V::F; 2], V::F);

    #[inline(always)]
    fn work(self) -> Self::Output {
        let view = self.outlook.view();
        (view.place(self.b), view.area_of_solid_angle)
    }
}

/// [`Outlook::area_of_solid_angle`].
struct Measured<V: Vector> {
    outlook: Outlook<V>,
}

impl<V: Vector> Work for Measured<V> {
    type Output = V::F;

    #[inline(always)]
    fn work(self) -> V::F {
        self.outlook.view().area_of_solid_angle
    }
}

/// The density of a place in area over that of a uniform choice, A cos/(d² Ω), with A/Ω.
#[inline(always)]
pub(crate) fn density<V: Vector>(area_of_solid_angle: V::F, from: V, position: V, normal: V) -> V::F {
    let towards = position - from;
    let distance_squared = towards.dot(towards);
    let cos = normal.dot(towards / distance_squared.sqrt()).abs();
    area_of_solid_angle * cos / distance_squared
}

/// A triangle on the sphere of directions around a point.
#[derive(Clone, Copy, Debug)]
struct View<V: Vector> {
    /// To the corners p, q and r.
    directions: [V; 3],
    /// The reciprocals of their distances.
    nearness: [V::F; 3],
    /// The product of the directions.
    volume: V::F,
    /// Of the angles between p and q, q and r, p and r.
    cosines: [V::F; 3],
    /// Half the solid angle Ω: tan Ω/2 = [p q r]/(1 + p·q + q·r + p·r) (Van Oosterom & Strackee 1983).
    half: V::F,
    /// A/Ω.
    area_of_solid_angle: V::F,
}

impl<V: Vector> View<V> {
    /// The barycentric coordinates of a place uniform in solid angle, for such coordinates `[b, c]` of one that is
    /// uniform in area.
    ///
    /// Arvo's map (1995, *Stratified Sampling of Spherical Triangles*) in the form of Peters (2021, *BRDF Importance
    /// Sampling for Polygonal Lights*), which takes no differences of nearly equal numbers: r′ on the arc from q to r
    /// cuts off a part of the solid angle, and the place lies between p and r′. The two numbers it takes are the plane
    /// triangle's, c/(b + c) and (b + c)², so that nearly the same place comes out where the triangle is far away.
    #[inline(always)]
    fn place(&self, [b, c]: [V::F; 2]) -> [V::F; 2] {
        let lanes = b.lanes();
        let (zero, one, two) = (lanes.splat(0.0), lanes.splat(1.0), lanes.splat(2.0));
        let [p, q, r] = self.directions;
        let [pq, qr, pr] = self.cosines;
        let along = b + c;
        let part = along.eq(zero).select(zero, c / along);
        let (sin, cos) = warp::sine_and_cosine(self.half * part);
        // r′ is q, mirrored in this multiple of q and this one of r.
        let of_q = self.volume * cos - (qr + pr) * sin;
        let of_r = (one + pq) * sin;
        let length_squared = of_q * of_q + of_q * of_r * qr * 2.0 + of_r * of_r;
        let scale = (of_q + of_r * qr) * 2.0 / length_squared;
        let (in_q, in_r) = ((scale * of_q - one).max(zero), (scale * of_r).max(zero));
        // 1 − p·r′, and how much of r′ and p there is.
        let apart = q * in_q + r * in_r - p;
        let versine = apart.dot(apart) * 0.5;
        let square = along * along;
        let of_arc = along * ((two - versine * square) / (two - versine)).max(zero).sqrt();
        let of_p = (one - of_arc + versine * (of_arc - square)).max(zero);
        let [x, y, z] = self.nearness;
        let (x, y, z) = (of_p * x, of_arc * in_q * y, of_arc * in_r * z);
        let sum = x + y + z;
        [y / sum, z / sum]
    }
}

#[inline(always)]
fn cross<V: Vector>(a: V, b: V) -> V {
    let ([x, y, z], [u, v, w]) = (a.coordinates(), b.coordinates());
    V::new(y * w - z * v, z * u - x * w, x * v - y * u)
}

/// A sphere as it is seen from outside: a cone of directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// To the centre.
    axis: DVec3,
    /// The sine of its half angle.
    sin: f64,
    /// One minus the cosine, without cancellation for distant spheres.
    versine: f64,
    radius: f32,
}

impl Cone {
    /// That of a sphere; `None` from within and from where rounding would decide.
    pub fn of((center, radius): (Vec3, f32), from: Vec3) -> Option<Self> {
        let (to, r) = (center.as_dvec3() - from.as_dvec3(), f64::from(radius));
        let d = to.length();
        let gap = d - r;
        let sin = r / d;
        let cos = (gap * (d + r)).max(0.0).sqrt() / d;
        (gap > CLEAR * r && d.is_finite()).then(|| Self { axis: to / d, sin, versine: sin * sin / (1.0 + cos), radius })
    }

    /// The direction from the centre towards the place that is seen in a direction uniform in the cone.
    pub fn sample(&self, u: Vec2) -> DVec3 {
        let [x, y] = warp::disk(u.to_array()).map(f64::from);
        let square = (x * x + y * y).min(1.0);
        // One minus the cosine of the direction, its sine, and the cosine at which it meets the sphere.
        let versine = square * self.versine;
        let sin = (versine * (2.0 - versine)).sqrt();
        let meets = ((1.0 - square) * (2.0 - self.versine * (1.0 + square)) / (2.0 - self.versine)).max(0.0).sqrt();
        let cos = 1.0 - versine;
        // The angle at the centre is that at the sphere less that at the point.
        let sin_at_sphere = sin / self.sin;
        let (along, across) = (cos * meets + sin * sin_at_sphere, sin_at_sphere * cos - meets * sin);
        let (i, j) = self.axis.any_orthonormal_pair();
        let radial = if square > 0.0 { (i * x + j * y) / square.sqrt() } else { i };
        radial * across - self.axis * along
    }

    /// The density of a place in area over that of a uniform choice: A cos/(d² Ω), zero on the side that is not seen.
    pub fn density(&self, from: Vec3, position: Vec3, normal: Vec3) -> f32 {
        let towards = position - from;
        let distance_squared = towards.length_squared();
        let cos = (-normal).dot(towards / distance_squared.sqrt()).max(0.0);
        let area = 4.0 * PI * self.radius * self.radius;
        area * cos / (distance_squared * 2.0 * PI * self.versine as f32)
    }
}

/// How a place was chosen.
enum Way {
    /// Uniformly in area.
    Area,
    /// Uniformly in a sphere's cone.
    Cone(Cone),
    /// Uniformly in a triangle's solid angle Ω: A/Ω.
    Triangle(f32),
}

impl Lights {
    /// The primitive of a light whose places may be chosen by solid angle: one that emits the same everywhere, and no
    /// sphere that is also lit from within.
    #[inline(always)]
    fn subtending(&self, geometry: &Geometry, id: LightId) -> Option<PrimitiveId> {
        match self.get(id) {
            Light::Area { primitive, map: None, sides, .. } => {
                (*sides == EmissionSides::Front || !geometry.is_sphere(*primitive)).then_some(*primitive)
            }
            _ => None,
        }
    }

    /// A point of the light `id` for a next-event estimate at `from`, and its [`Self::density_from`]; `rest` is what
    /// the light's choice has left.
    #[inline(always)]
    pub(super) fn sample_from(
        &self,
        (geometry, materials): (&Geometry, &[Material]),
        id: LightId,
        from: Vec3,
        (u, rest): (Square, Remainder),
    ) -> (Point, f32) {
        let Some(primitive) = self.subtending(geometry, id) else {
            return (self.sample_position(geometry, materials, id, u, rest), 1.0);
        };
        let (surface, way) = self.surface_from(geometry, (id, primitive), from, u.place());
        let point = Point::on_surface(geometry, materials, primitive, &surface, Some(id));
        let density = match way {
            Way::Area => 1.0,
            Way::Cone(cone) => cone.density(from, point.position, point.normal),
            Way::Triangle(area_of_solid_angle) => density(area_of_solid_angle, from, point.position, point.normal),
        };
        (point, density)
    }

    /// The surface at a place of the light's primitive, and how it was chosen. Out of line: one text for both.
    #[inline(never)]
    fn surface_from(
        &self,
        geometry: &Geometry,
        (id, primitive): (LightId, PrimitiveId),
        from: Vec3,
        u: Vec2,
    ) -> (Surface, Way) {
        if let Some(sphere) = geometry.sphere_of(primitive) {
            return match Cone::of(sphere, from) {
                Some(cone) => (geometry.surface_of_sphere(primitive, cone.sample(u)), Way::Cone(cone)),
                None => (geometry.sample(primitive, u), Way::Area),
            };
        }
        let b = warp::triangle(u.to_array());
        let surface = geometry.surface_at_place(primitive, b.into());
        if !self.may_be_near(id, from, surface.position) {
            return (surface, Way::Area);
        }
        let outlook = Outlook::of(geometry.corners(primitive), from);
        if !outlook.is_near {
            return (surface, Way::Area);
        }
        let (b, area_of_solid_angle) = outlook.place(b);
        (geometry.surface_at_place(primitive, b.into()), Way::Triangle(area_of_solid_angle))
    }

    /// Whether a triangle with this place may be near: what can be said without its corners.
    #[inline(always)]
    fn may_be_near(&self, id: LightId, from: Vec3, position: Vec3) -> bool {
        matches!(self.get(id), Light::Area { area, .. } if (position - from).length_squared() <= REACH * area)
    }

    /// How dense next-event estimation from `from` chooses the place on the light `id`, over a uniform choice from its
    /// area; 1 wherever that is how it chooses, and of lights without an area.
    pub(crate) fn density_from(
        &self,
        geometry: &Geometry,
        id: LightId,
        from: Vec3,
        [position, normal]: [Vec3; 2],
    ) -> f32 {
        let Some(primitive) = self.subtending(geometry, id) else { return 1.0 };
        if let Some(sphere) = geometry.sphere_of(primitive) {
            return Cone::of(sphere, from).map_or(1.0, |cone| cone.density(from, position, normal));
        }
        if !self.may_be_near(id, from, position) {
            return 1.0;
        }
        let outlook = Outlook::of(geometry.corners(primitive), from);
        if outlook.is_near { density(outlook.area_of_solid_angle(), from, position, normal) } else { 1.0 }
    }

    /// The same for points in all lanes.
    #[inline(always)]
    pub(super) fn densities_from<L: Lanes, B>(
        &self,
        geometry: &Geometry,
        point: &Point<L, B>,
        from: &Point<L, B>,
    ) -> L::F {
        let lanes = point.alpha.lanes();
        if point.place != Place::Surface {
            return lanes.splat(1.0);
        }
        let (from, position, normal) = (from.position.all(), point.position.all(), point.normal.all());
        lanes.numbers(|k| match L::lane(&point.light, k) {
            Some(id) => self.density_from(geometry, id, from[k].into(), [position[k].into(), normal[k].into()]),
            None => 1.0,
        })
    }
}
