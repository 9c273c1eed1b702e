//! The scene: what is there. Geometry, materials, lights and the camera, with the two questions a path asks of
//! them: what does this ray meet, and do these two points see each other.

mod alpha;
pub mod areas;
pub mod bsdf;
pub mod camera;
mod coincident;
pub mod geometry;
mod id;
pub mod layers;
pub mod light;
mod light_index;
pub mod material;
pub mod media;
mod parameters;
pub mod point;
pub(crate) mod records;
pub mod texture;
pub mod tilt;
pub mod wavelength;

use std::{ops::ControlFlow, sync::OnceLock};

use glam::{DVec3, Vec2, Vec3};

use self::{
    alpha::Product,
    areas::SurfaceAreas,
    bsdf::{Bsdf, OverEmission},
    camera::{Camera, Raster},
    coincident::Meetings,
    geometry::{Geometry, Hit, PrimitiveId, Ray},
    light::{Light, LightChoice, Lights, Receiver},
    light_index::LightIndex,
    material::{AlphaMode, BackFaces, Material, MaterialId},
    media::{Boundary, Media, MediumId},
    point::{Place, Point},
    records::Records,
};
use crate::{
    lanes::Lanes,
    math::Rgb,
    sampling::{Choice, PdfArea, Square},
};

/// A scene, immutable while it is rendered.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Where paths end.
    pub camera: Camera,
    /// Where the origin lies in the coordinates of the file, metres: for what is reported, not for rays.
    pub centre: DVec3,
    geometry: Geometry,
    materials: Vec<Material>,
    lights: Lights,
    light_of: LightIndex,
    /// All surfaces and the emitting ones, once somebody asks.
    areas: OnceLock<[SurfaceAreas; 2]>,
    /// What waves load, once there is one.
    records: OnceLock<Records>,
    /// Whether rays may go on behind what they hit first: some primitive's material is not opaque, or surfaces
    /// coincide. A scene without pays nothing for coverage.
    see_through: bool,
    /// Whether some primitive's material is not opaque.
    covers_in_part: bool,
    /// Where some surface bounds a volume: a scene without pays nothing for media.
    media: Option<Box<Media>>,
    /// Whether the camera's rays pass back faces of some material.
    culls: bool,
}

/// What a ray finds; see [`Scene::trace_ray`].
#[derive(Clone, Copy, Debug)]
pub struct Traced {
    /// The ray.
    pub ray: Ray,
    /// Where it stops, for [`Scene::point_at`]; `None` if it leaves the scene.
    pub hit: Option<Hit>,
    /// V of the way there: the product of 1 − α over the surfaces that it passes.
    pub visibility: f32,
}

/// Parts of the image, in [0, 1], by the camera's first surface: see [`Scene::first_sight`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstSight {
    /// Where it has delta lobes: what light tracing cannot connect to the lens.
    pub specular: f32,
    /// Where it is the back face of a single-sided material.
    pub back_faces: f32,
}

impl Scene {
    /// Drops what is in `geometry` twice ([`Geometry::drop_copies`]), builds the trees over the rest, finds what
    /// coincides ([`Geometry::find_coincident`]) and gathers all lights: emissive primitives first, then `others`.
    ///
    /// # Panics
    /// If a primitive's material is not in `materials`, or `others` holds more than one environment.
    pub fn new(mut geometry: Geometry, materials: Vec<Material>, others: &[Light], camera: Camera) -> Self {
        let opaque = |id: MaterialId| materials[id.0 as usize].alpha_mode == AlphaMode::Opaque;
        let roles: Vec<_> = materials.iter().map(Material::role).collect();
        geometry.drop_copies(opaque, |id| roles[id.0 as usize]);
        geometry.build();
        geometry.find_coincident(roles);
        let lights = Lights::new(&geometry, &materials, others);
        let light_of = LightIndex::new(&geometry, &lights);
        let covers_in_part = materials.iter().any(|m| m.alpha_mode != AlphaMode::Opaque)
            && geometry.with_material(&|id| !opaque(id)).next().is_some();
        let see_through = covers_in_part || geometry.has_coincident();
        let media = Media::new(&geometry, &materials, &lights).map(Box::new);
        let (centre, areas) = (DVec3::ZERO, OnceLock::new());
        Self {
            camera,
            centre,
            geometry,
            materials,
            lights,
            light_of,
            areas,
            records: OnceLock::new(),
            see_through,
            covers_in_part,
            media,
            culls: false,
        }
    }

    /// The same scene with another choice among the lights for next-event estimation.
    #[must_use]
    pub fn choosing_lights(mut self, choice: LightChoice) -> Self {
        self.lights.choose_by(choice, &self.geometry);
        self.areas = OnceLock::new();
        self.records = OnceLock::new();
        self
    }

    /// The same scene with the back faces of single-sided materials ([`BackFaces::Culled`]) hidden from the camera, as
    /// glTF asks of a rasterizer: the first edge of a path passes them, and ends on none of them, whichever strategy
    /// finds it. All other edges meet them. The boundary of a volume is never culled: the camera would lose track of
    /// what it is in. Nor is a face that coincides with another, unless both are single-sided copies that face the same
    /// way: one of them stands for both, seen from either side.
    #[must_use]
    pub fn culling_back_faces(mut self) -> Self {
        self.culls = self.materials.iter().any(hides_back_faces);
        self
    }

    /// Whether [`Self::trace_from_camera`] and [`Self::visible_from_camera`] differ from the same questions of other
    /// points.
    #[inline(always)]
    pub fn culls_back_faces(&self) -> bool {
        self.culls
    }

    /// The primitives.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The materials, in the order of their ids.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The lights.
    pub fn lights(&self) -> &Lights {
        &self.lights
    }

    /// The surface point that a ray in the unit direction `w` from `from` meets first, where anything of it is there (α
    /// > 0): tr(p, ω) of the lecture.
    #[inline]
    pub fn trace(&self, from: &Point, w: Vec3) -> Option<Point> {
        let traced = self.trace_ray(from.ray_origin(w), w, from.primitive, |_| true);
        traced.hit.map(|hit| self.point_at(&traced.ray, &hit))
    }

    /// The surface point where a ray in the unit direction `w` from `origin` stops, other than on the flat primitive
    /// `skip`.
    ///
    /// At each surface with 0 < α < 1, front to back, `stops(α)` decides. With α = 1 the ray stops and with α = 0 it
    /// passes, without a question. Surfaces that coincide are met in the order of their [`geometry::Rank`].
    #[inline(always)]
    pub fn trace_ray(&self, origin: Vec3, w: Vec3, skip: PrimitiveId, stops: impl FnMut(f32) -> bool) -> Traced {
        let ray = Ray { origin, direction: w, t_max: f32::INFINITY };
        self.trace_through(ray, skip, self.see_through, stops, |hit| self.alpha(hit))
    }

    /// [`Self::trace_ray`] for a ray that leaves the lens: it passes [culled](Self::culling_back_faces) back faces.
    #[inline(never)]
    pub fn trace_from_camera(
        &self,
        origin: Vec3,
        w: Vec3,
        skip: PrimitiveId,
        stops: impl FnMut(f32) -> bool,
    ) -> Traced {
        let ray = Ray { origin, direction: w, t_max: f32::INFINITY };
        let alpha = |hit: &Hit| self.alpha_for_camera(w, &ray, hit);
        self.trace_through(ray, skip, self.see_through || self.culls, stops, alpha)
    }

    #[inline(always)]
    fn trace_through(
        &self,
        ray: Ray,
        skip: PrimitiveId,
        see_through: bool,
        stops: impl FnMut(f32) -> bool,
        alpha: impl Fn(&Hit) -> f32,
    ) -> Traced {
        let first = self.geometry.closest(&ray, skip);
        let stops_there = !see_through
            || self.all_is_there()
                && match &first {
                    Some(hit) => self.geometry.is_met_first(&ray, skip, hit),
                    None => true,
                };
        if stops_there {
            return Traced { ray, hit: first, visibility: 1.0 };
        }
        self.trace_on(ray, skip, first, stops, alpha)
    }

    /// Whether everything stops every ray, also one from the camera, where it does not share its place.
    pub(crate) fn is_all_there(&self) -> bool {
        self.all_is_there()
    }

    /// Whether everything stops every ray, where it does not share its place.
    #[inline(always)]
    fn all_is_there(&self) -> bool {
        !(self.covers_in_part || self.culls)
    }

    /// Goes on from what the ray hits first.
    #[inline(never)]
    fn trace_on(
        &self,
        ray: Ray,
        skip: PrimitiveId,
        mut next: Option<Hit>,
        mut stops: impl FnMut(f32) -> bool,
        alpha: impl Fn(&Hit) -> f32,
    ) -> Traced {
        let mut visibility = 1.0;
        if self.geometry.has_coincident() {
            if next.is_none_or(|hit| alpha(&hit) == 1.0 && self.geometry.is_met_first(&ray, skip, &hit)) {
                return Traced { ray, hit: next, visibility };
            }
            let mut meetings = Meetings::new(&self.geometry, ray, skip, next);
            while let Some(hit) = meetings.next(&self.geometry) {
                let alpha = alpha(&hit);
                if alpha == 1.0 || (alpha > 0.0 && stops(alpha)) {
                    return Traced { ray, hit: Some(self.settled(&ray, hit)), visibility };
                }
                visibility *= 1.0 - alpha;
            }
            return Traced { ray, hit: None, visibility };
        }
        while let Some(hit) = next {
            let alpha = alpha(&hit);
            if alpha == 1.0 || (alpha > 0.0 && stops(alpha)) {
                break;
            }
            visibility *= 1.0 - alpha;
            next = self.geometry.closest_after(&ray, skip, &hit);
        }
        Traced { ray, hit: next, visibility }
    }

    /// The point of the surface where `ray` hit.
    #[inline(always)]
    pub fn point_at(&self, ray: &Ray, hit: &Hit) -> Point {
        let surface = self.geometry.surface(ray, hit);
        let light = self.light_of.get(hit.primitive);
        Point::on_surface(&self.geometry, &self.materials, hit.primitive, &surface, light)
    }

    /// α in [0, 1] where a ray hits: [`Point::alpha`] of the point there if nothing coincides, without the rest of it.
    #[inline]
    pub fn alpha(&self, hit: &Hit) -> f32 {
        alpha::alpha(&self.geometry, &self.materials, hit)
    }

    /// V(a↔b) in [0, 1]: the product of 1 − α over what the segment between the two points crosses, so 0 or 1 where all
    /// is opaque. At most one of the points is infinite.
    ///
    /// An end that coincident surfaces hide altogether sees nothing. What they leave of an end is its [`Point::alpha`],
    /// so here they do not count: the segment starts off all of them. Nor does an end see what lies in its own plane,
    /// where roundings alone would tell on which side of it the segment runs.
    #[inline(always)]
    pub fn visible(&self, a: &Point, b: &Point) -> f32 {
        let (a, b) = if a.place == Place::Infinite { (b, a) } else { (a, b) };
        self.visibility(&Ray::joining(a, b), a, b, self.see_through, |hit| self.alpha(hit))
    }

    /// [`Self::visible`] of a point on the lens and one that it may see: the segment passes
    /// [culled](Self::culling_back_faces) back faces, and V = 0 if `seen` lies on one.
    #[inline(never)]
    pub fn visible_from_camera(&self, lens: &Point, seen: &Point) -> f32 {
        if !self.culls {
            return self.visible(lens, seen);
        }
        // The segment may run the other way.
        let ray = Ray::joining(lens, seen);
        let w = if seen.place == Place::Infinite { seen.position } else { seen.position - lens.position };
        if seen.place == Place::Surface && self.is_culled(seen.primitive, seen.normal, w) {
            return 0.0;
        }
        self.visibility(&ray, lens, seen, true, |hit| self.alpha_for_camera(w, &ray, hit))
    }

    /// V along `ray` from `a` to `b`; 1 − `alpha` is what a surface lets pass.
    #[inline(always)]
    fn visibility(&self, ray: &Ray, a: &Point, b: &Point, see_through: bool, alpha: impl Fn(&Hit) -> f32) -> f32 {
        let skip = [a.primitive, b.primitive];
        if !see_through || self.all_is_there() {
            return match self.geometry.obstacle(ray, skip) {
                Some(hit) if self.geometry.may_be_in_plane_of_end(ray, skip, &hit) && !a.is_in_one_plane_with(b) => {
                    self.visible_among_coincident(ray, a, b, alpha)
                }
                Some(_) => 0.0,
                None if see_through && (a.alpha == 0.0 || b.alpha == 0.0) => 0.0,
                None if a.is_in_one_plane_with(b) => 0.0,
                None => 1.0,
            };
        }
        if a.is_in_one_plane_with(b) {
            return 0.0;
        }
        if self.geometry.has_coincident() {
            return self.visible_among_coincident(ray, a, b, alpha);
        }
        let mut visibility = Product::ONE;
        let _ = self.geometry.crossings(ray, skip, |hit| {
            visibility.times(1.0 - alpha(hit));
            if visibility.is_zero() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        visibility.value()
    }

    /// [`Self::alpha`] for the camera, which looks along `w`: 0 at a culled back face.
    fn alpha_for_camera(&self, w: Vec3, ray: &Ray, hit: &Hit) -> f32 {
        if self.culls && self.is_culled(hit.primitive, self.geometry.surface(ray, hit).normal, w) {
            return 0.0;
        }
        self.alpha(hit)
    }

    /// Whether the camera does not see a primitive with the normal `n` along its viewing direction `w`.
    fn is_culled(&self, primitive: PrimitiveId, n: Vec3, w: Vec3) -> bool {
        let hides = |id| hides_back_faces(self.material(id));
        n.dot(w) > 0.0
            && hides(self.geometry.material(primitive))
            && !self.geometry.may_coincide(primitive)
            && self.geometry.copies(primitive).all(|(material, turned)| !turned && hides(material))
    }

    /// L_e at `point` in the unit direction `w` away from it; see [`Lights::le`].
    #[inline(always)]
    pub fn le<L: Lanes, B: OverEmission<L>>(&self, point: &Point<L, B>, w: L::V) -> Rgb<L::V> {
        self.lights.le(point, w)
    }

    /// A point of a primitive, uniform in its area for uniform `u`: for building paths by hand.
    pub fn point_on(&self, primitive: PrimitiveId, u: Vec2) -> Point {
        let light = self.light_of.get(primitive);
        Point::on_surface(&self.geometry, &self.materials, primitive, &self.geometry.sample(primitive, u), light)
    }

    /// [`Lights::sample_next_event`] for this scene.
    #[inline(always)]
    pub fn sample_next_event(&self, from: &Point, u: Square, choice: Choice, nth: u32) -> Option<(Point, PdfArea)> {
        self.lights.sample_next_event(&self.geometry, &self.materials, Receiver::at(from), u, choice, nth)
    }

    /// [`Lights::sample_emission`] for this scene.
    #[inline(always)]
    pub fn sample_emission(&self, choice: Choice, position: Square, direction: Vec2) -> Option<light::Emission> {
        self.lights.sample_emission(&self.geometry, &self.materials, choice, position, direction)
    }

    /// The radiance of the scene's surfaces if all that the lights emit were spread evenly over their area: Φ/(π A). A
    /// scale of what an image shows; zero without surfaces.
    pub fn spread_radiance(&self) -> f64 {
        let primitives = self.geometry.with_material(&|_| true);
        let area: f64 = primitives.map(|id| f64::from(self.geometry.area(id))).filter(|area| area.is_finite()).sum();
        if area > 0.0 { self.lights.power_of_all() / (std::f64::consts::PI * area) } else { 0.0 }
    }

    /// Points of all surfaces, uniform in area; found when first asked for.
    pub fn surfaces(&self) -> &SurfaceAreas {
        &self.areas()[0]
    }

    /// Points of all surfaces that emit: uniform in area where lights are chosen uniformly, else in proportion to the
    /// power emitted by each primitive's area.
    pub fn emitters(&self) -> &SurfaceAreas {
        &self.areas()[1]
    }

    fn areas(&self) -> &[SurfaceAreas; 2] {
        self.areas.get_or_init(|| {
            let lights = self.lights.area_lights();
            let emitters = match self.lights.choice() {
                LightChoice::Uniform => SurfaceAreas::uniform(self, lights.map(|(_, primitive)| primitive)),
                _ => SurfaceAreas::weighted(self, lights.map(|(light, id)| (id, self.lights.power_of(light)))),
            };
            [SurfaceAreas::uniform(self, self.geometry.with_material(&|_| true)), emitters]
        })
    }

    /// The media, where some surface bounds a volume.
    #[inline(always)]
    pub fn media(&self) -> Option<&Media> {
        self.media.as_deref()
    }

    /// The media, where one of them absorbs.
    #[inline(always)]
    pub fn absorbing_media(&self) -> Option<&Media> {
        self.media().filter(|media| media.absorb())
    }

    /// σ_a of what fills the segment that leaves `a`, its end nearer the camera, in the unit direction `ab` and ends at
    /// `b`, 1/m; zero for clear space. `medium` is the body that the segment lies in, as walks carry it: no surface of
    /// one is on its way, since none lets a segment pass.
    ///
    /// Volumes that are no bodies are asked first, by the rule of [`Boundary::Local`].
    #[inline(always)]
    pub fn absorption(&self, a: &Point, ab: Vec3, b: &Point, medium: MediumId) -> Rgb {
        self.absorbing_media().map_or(Rgb::ZERO, |media| Self::absorption_amid(media, [a, b], ab, medium))
    }

    #[inline(never)]
    fn absorption_amid(media: &Media, [a, b]: [&Point; 2], ab: Vec3, medium: MediumId) -> Rgb {
        let behind = |p: &Point, w: Vec3| {
            let behind = p.normal.dot(w) < 0.0;
            p.bsdf.bounds_volume() && behind && media.boundary(p.material) == Boundary::Local
        };
        if behind(a, ab) {
            media.absorption_behind(a.material)
        } else if behind(b, -ab) {
            media.absorption_behind(b.material)
        } else {
            media.absorption(medium)
        }
    }

    /// How the surface scatters at `point` where it separates its material's volume from empty space, resolved anew.
    pub fn bsdf_at(&self, point: &Point) -> Bsdf {
        let material = self.material(point.material);
        // Layers know their directions at the point, and a medium changes no more than what is relative to it.
        if matches!(point.bsdf, Bsdf::Layered(_)) {
            let mut bsdf = point.bsdf;
            if let Some(ior) = material.volume_ior() {
                bsdf.set_volume_ior(ior);
            }
            return bsdf;
        }
        material.bsdf_at(|| self.geometry.attributes(point.primitive, point.barycentric))
    }

    /// The material `id`.
    pub fn material(&self, id: MaterialId) -> &Material {
        &self.materials[id.0 as usize]
    }

    /// What the camera sees first. Estimated with one ray for each of 64 × 64 places; a surface with α < 1/2 is
    /// looked through.
    pub fn first_sight(&self) -> FirstSight {
        const SIDE: u32 = 64;
        let sensor = self.camera.sensor();
        let size = Vec2::new(sensor.width as f32, sensor.height as f32);
        let (mut specular, mut back_faces) = (0_u16, 0_u16);
        for i in 0..SIDE * SIDE {
            let place = Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5) / SIDE as f32;
            let raster = Raster(place * size);
            let lens = self.camera.sample_lens(raster, Vec2::splat(0.5));
            let w = self.camera.direction(&lens, raster);
            let seen = self.trace_from_camera(lens.ray_origin(w), w, lens.primitive, |alpha| alpha >= 0.5);
            let Some(hit) = seen.hit else { continue };
            let point = self.point_at(&seen.ray, &hit);
            specular += u16::from(point.bsdf.delta_count() > 0);
            back_faces += u16::from(point.normal.dot(w) > 0.0 && hides_back_faces(self.material(point.material)));
        }
        let fraction = |count| f32::from(count) / (SIDE * SIDE) as f32;
        FirstSight { specular: fraction(specular), back_faces: fraction(back_faces) }
    }
}

/// Whether a scene that culls hides this material's back faces from the camera.
fn hides_back_faces(material: &Material) -> bool {
    material.back_faces == BackFaces::Culled && !material.bsdf.bounds_volume()
}
