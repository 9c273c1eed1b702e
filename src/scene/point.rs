//! A point of the scene: where a path may scatter, start or end.

use glam::{Vec2, Vec3};

use super::{
    alpha::left_by_others,
    bsdf::{Bsdf, Bsdfs, Diffuse},
    geometry::{Geometry, PrimitiveId, Ray, Surface, offset_origin},
    id::{LightId, MediumId},
    material::{Maps, Material, MaterialId},
};
use crate::{
    lanes::{Float, Lanes, Mask, One, Unsigned, Vector},
    math::Rgb,
};

/// What kind of place a point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On a surface (or on the lens, whose plane counts as one).
    Surface,
    /// Without a normal (point light): cosines there count as 1.
    Degenerate,
    /// Infinitely far away (environment, sun): `position` is the unit direction towards it, dA becomes dω.
    Infinite,
    /// On the film of an orthographic camera, which sees along `normal` alone. As with a sun, that direction is what
    /// counts, and G has neither cosine nor distance there; `position` is where on the film.
    Film,
}

/// A point of the scene with everything about it that does not depend on a path. World space, metres. In several lanes
/// it is a point in each, all of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Point<L: Lanes = One, B = Bsdf> {
    /// The position; of an infinite point, the unit direction towards it.
    pub position: L::V,
    /// N_g, unit: of a triangle by its winding (the front face), of a sphere outward, of the lens the viewing
    /// direction.
    pub normal: L::V,
    /// N_s, unit, on the side of N_g and not lower than [`STEEPEST`](super::geometry::STEEPEST) over its horizon.
    pub shading_normal: L::V,
    /// A bound on the rounding error of each coordinate of `position`.
    pub error: L::F,
    /// The kind of place.
    pub place: Place,
    /// The primitive it lies on, [`PrimitiveId::NONE`] if on none.
    pub primitive: L::Each<PrimitiveId>,
    /// The material of that primitive; meaningless where there is none.
    pub material: L::Each<MaterialId>,
    /// The media in front of the surface, on N_g's side, and behind it, as the walk knows them that has come here: see
    /// [`super::media::Inside`]. Empty space for points that no walk has found.
    pub media: [L::Each<MediumId>; 2],
    /// The light that emits here, if any.
    pub light: L::Each<Option<LightId>>,
    /// α: how much of the surface is there, in [0, 1], after what coincident surfaces leave of it; 1 where there is no
    /// surface. f and L_e of a path's vertex carry it, and V the 1 − α of what a segment crosses.
    pub alpha: L::F,
    /// The BSDF here; black where there is no surface.
    pub bsdf: B,
    /// The radiance that the material emits here from its emitting sides; zero where there is no surface.
    pub emission: Rgb<L::V>,
    /// Barycentric coordinates of a triangle's second and third corner; zero elsewhere.
    pub barycentric: L::Each<Vec2>,
}

impl Point {
    /// The point of a primitive's surface, its material resolved.
    #[inline(always)]
    pub fn on_surface(
        geometry: &Geometry,
        materials: &[Material],
        primitive: PrimitiveId,
        surface: &Surface,
        light: Option<LightId>,
    ) -> Self {
        let id = geometry.material(primitive);
        let material = &materials[id.0 as usize];
        let mut point = Self {
            position: surface.position,
            normal: surface.normal,
            shading_normal: surface.shading_normal,
            error: surface.error,
            place: Place::Surface,
            primitive,
            material: id,
            media: [MediumId::EMPTY; 2],
            light,
            alpha: material.alpha(|| geometry.attributes(primitive, surface.barycentric)),
            bsdf: material.bsdf,
            emission: material.emission,
            barycentric: surface.barycentric,
        };
        if let Some(maps) = &material.maps {
            point.resolve(geometry, maps, surface);
        }
        if geometry.may_be_hidden(primitive) {
            point.alpha *= left_by_others(geometry, materials, primitive, surface.position);
        }
        point
    }

    /// Puts what varies over the surface in place of the material's constants.
    #[inline(never)]
    fn resolve(&mut self, geometry: &Geometry, maps: &Maps, surface: &Surface) {
        let at = geometry.attributes(self.primitive, surface.barycentric);
        if maps.vary_emission() {
            self.emission *= maps.emission(&at);
        }
        let frame = if maps.need_tangents() { geometry.tangent_frame(self.primitive, surface) } else { None };
        if let Some(map) = &maps.normal
            && let Some(frame) = &frame
        {
            self.shading_normal = map.shading_normal(at.uv(map.texture.uv_set), frame, self.normal);
        }
        let mut parameters = maps.parameters(&at);
        if let Some(layers) = &maps.layers {
            let normals = [self.shading_normal, surface.shading_normal, self.normal];
            layers.orient(&mut parameters.layers, &at, frame.as_ref(), normals);
        }
        self.bsdf = parameters.bsdf();
    }

    /// A black point without surface at `position`.
    #[inline(always)]
    pub fn nowhere(position: Vec3) -> Self {
        Self {
            position,
            normal: Vec3::Z,
            shading_normal: Vec3::Z,
            error: 0.0,
            place: Place::Degenerate,
            primitive: PrimitiveId::NONE,
            material: MaterialId(u32::MAX),
            media: [MediumId::EMPTY; 2],
            light: None,
            alpha: 1.0,
            bsdf: Bsdf::Diffuse(Diffuse { albedo: Rgb::ZERO }),
            emission: Rgb::ZERO,
            barycentric: Vec2::ZERO,
        }
    }

    /// The medium into which the direction `w` leads.
    #[inline]
    pub fn medium_towards(&self, w: Vec3) -> MediumId {
        let [front, behind] = self.media;
        if self.normal.dot(w) < 0.0 { behind } else { front }
    }
}

impl<V: Vector> Ray<V> {
    /// The ray from just off `a` towards `b`, which may be infinite.
    #[inline(always)]
    pub fn joining<L: Lanes<V = V, F = V::F>, B>(a: &Point<L, B>, b: &Point<L, B>) -> Self {
        if b.place == Place::Infinite {
            let t_max = a.alpha.lanes().splat(f32::INFINITY);
            return Self { origin: a.ray_origin(b.position), direction: b.position, t_max };
        }
        let ab = b.position - a.position;
        Self::between(a.ray_origin(ab), b.ray_origin(-ab))
    }
}

impl<L: Lanes> Point<L, Bsdfs<L>> {
    /// Black points that lie on nothing, at `position` and with this N_g.
    #[inline(always)]
    pub fn without_surface(position: L::V, normal: L::V, place: Place) -> Self {
        let lanes = position.max_element().lanes();
        let nowhere = Point::nowhere(Vec3::ZERO);
        let black = lanes.splat_v([0.0; 3]);
        Self {
            position,
            normal,
            shading_normal: normal,
            error: lanes.splat(0.0),
            place,
            primitive: lanes.each(|_| nowhere.primitive),
            material: lanes.each(|_| nowhere.material),
            media: nowhere.media.map(|medium| lanes.each(|_| medium)),
            light: lanes.each(|_| None),
            alpha: lanes.splat(1.0),
            bsdf: Bsdfs::Diffuse(Diffuse { albedo: Rgb::of(black) }),
            emission: Rgb::of(black),
            barycentric: lanes.each(|_| Vec2::ZERO),
        }
    }

    /// The points that `point` has for the lanes `which`, all of which are such `place`s; anything in the others.
    #[inline(always)]
    pub fn of_each<'a>(lanes: L, which: L::M, place: Place, point: impl Fn(usize) -> &'a Point) -> Self {
        Self {
            position: lanes.vectors(|k| point(k).position.to_array()),
            normal: lanes.vectors(|k| point(k).normal.to_array()),
            shading_normal: lanes.vectors(|k| point(k).shading_normal.to_array()),
            error: lanes.numbers(|k| point(k).error),
            place,
            primitive: lanes.each(|k| point(k).primitive),
            material: lanes.each(|k| point(k).material),
            media: [lanes.each(|k| point(k).media[0]), lanes.each(|k| point(k).media[1])],
            light: lanes.each(|k| point(k).light),
            alpha: lanes.numbers(|k| point(k).alpha),
            bsdf: Bsdfs::new(lanes, which, |k| &point(k).bsdf),
            emission: Rgb::of(lanes.vectors(|k| point(k).emission.to_array())),
            barycentric: lanes.each(|k| point(k).barycentric),
        }
    }

    /// Those of some lanes, one after the other, with the numbers of their lanes.
    #[inline(always)]
    pub fn each(&self, which: L::M) -> impl Iterator<Item = (usize, Point)> {
        let (position, normal, shading_normal) = (self.position.all(), self.normal.all(), self.shading_normal.all());
        let (error, alpha, emission) = (self.error.all(), self.alpha.all(), self.emission.channels().all());
        let bsdf = self.bsdf.all(self.alpha.lanes());
        which.lanes().map(move |k| {
            let point = Point {
                position: position[k].into(),
                normal: normal[k].into(),
                shading_normal: shading_normal[k].into(),
                error: error[k],
                place: self.place,
                primitive: L::lane(&self.primitive, k),
                material: L::lane(&self.material, k),
                media: [L::lane(&self.media[0], k), L::lane(&self.media[1], k)],
                light: L::lane(&self.light, k),
                alpha: alpha[k],
                bsdf: bsdf(k),
                emission: Rgb::from_array(emission[k]),
                barycentric: L::lane(&self.barycentric, k),
            };
            (k, point)
        })
    }
}

impl<L: Lanes, B> Point<L, B> {
    /// Where a ray in direction `w` (of any length) has to start so as not to meet the surface it leaves. (What lies on
    /// no primitive has no error.)
    #[inline(always)]
    pub fn ray_origin(&self, w: L::V) -> L::V {
        offset_origin(self.position, self.normal, self.error, w)
    }

    /// Whether one of two points lies in the plane of the other's surface, as far as their errors tell.
    #[inline(always)]
    pub fn is_in_one_plane_with(&self, other: &Self) -> L::M {
        let to = other.position - self.position;
        // The components of a unit vector add up to √3 at most. Errors are several ε of the positions, and so cover
        // that of N_g.
        let slack = (self.error + other.error) * 1.75;
        let finite = |place| matches!(place, Place::Surface | Place::Degenerate);
        let both_finite = finite(self.place) && finite(other.place);
        let lanes = slack.lanes();
        let [own, others] = [self.place, other.place];
        let has_plane = |place| if both_finite && place == Place::Surface { u32::MAX } else { 0 };
        let (own, others) = (lanes.mask(has_plane(own)), lanes.mask(has_plane(others)));
        own & self.normal.dot(to).abs().le(slack) | others & other.normal.dot(to).abs().le(slack)
    }

    /// Whether it lies on a light.
    #[inline(always)]
    pub fn lies_on_light(&self) -> L::M {
        let lanes = self.alpha.lanes();
        !lanes.whole_numbers(|k| LightId::successor(L::lane(&self.light, k))).eq(lanes.splat_u(0))
    }

    /// Whether N_s is N_g, as on all flat surfaces: the common case, for which [`Tilt`](super::tilt::Tilt) has nothing
    /// to do.
    #[inline(always)]
    pub fn is_flat(&self) -> L::M {
        let ([x, y, z], [i, j, k]) = (self.normal.coordinates(), self.shading_normal.coordinates());
        x.eq(i) & y.eq(j) & z.eq(k)
    }
}
