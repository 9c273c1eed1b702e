//! What a wave needs of its vertices, in records that lanes load together.

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Scene,
    bsdf::{Bsdfs, Kind, Terms},
    geometry::{Geometry, PrimitiveId, STEEPEST, lifted, surface_of},
    id::{LightId, MediumId},
    light::{Lights, Outlook, Receiver, density},
    light_index::LightIndex,
    material::{AlphaMode, EmissionSides, Material, MaterialId},
    media::Media,
    point::{Place, Point},
};
use crate::{
    lanes::{Float, Lanes, MOST, Mask, Record, Select, Unsigned, Vector},
    math::Rgb,
    sampling::{Choice, PdfArea, Square},
};

/// The world's triangles and all materials, as far as both are plain: opaque and without maps, of a [`Kind`] that is
/// written for lanes, on triangles of the world.
#[derive(Clone, Debug, Default)]
pub(super) struct Records {
    /// The corners p, q and r, and N_g; in the last place of each four the material, the light's successor,
    /// [`NOT_PLAIN`], [`FLAT`] or [`SMOOTH`], and where a smooth one has its normals. Empty if no material is plain.
    triangles: Vec<Record>,
    /// The normals of the corners, in the same places.
    normals: Vec<Record>,
    /// The colour, the emission and F0; in the last place of each four the kind's number, the index of refraction and
    /// F90; then α and the fraction of metal.
    materials: Vec<Record>,
    /// A bit for each kind that a plain triangle has.
    kinds: u32,
    lights: Option<FewLights>,
}

/// What kind of triangle a record has.
const NOT_PLAIN: u32 = 0;
const FLAT: u32 = 1;
const SMOOTH: u32 = 2;
/// Where it says so.
const KIND: usize = 11;

/// Points of plain triangles, in the lanes where there is one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlainPoints<L: Lanes> {
    /// Where, and what is there; black until [`Self::turn_to`] is called.
    pub point: Point<L, Bsdfs<L>>,
    /// In which lanes.
    pub which: L::M,
    kind: L::U,
    terms: Terms<L::V>,
}

impl<L: Lanes> PlainPoints<L> {
    #[inline(always)]
    fn nowhere(lanes: L) -> Self {
        let black = Rgb::of(lanes.splat_v([0.0; 3]));
        let point = Point::without_surface(black.channels(), black.channels(), Place::Surface);
        Self { point, which: lanes.mask(0), kind: lanes.splat_u(0), terms: Terms::of_color(black) }
    }

    /// In which lanes the BSDF is of this kind.
    #[inline(always)]
    pub fn of_kind(&self, kind: Kind) -> L::M {
        self.which & self.kind.eq(self.kind.lanes().splat_u(kind as u32))
    }

    /// Gives `point` the BSDFs of this kind: on the boundary of a volume those between its material and empty space.
    #[inline(always)]
    pub fn turn_to(&mut self, kind: Kind) {
        self.point.bsdf = Bsdfs::of_kind(kind, self.terms);
    }
}

/// So many smooth triangles are plain: more would take too much memory.
const MOST_NORMALS: usize = 1 << 18;

impl Scene {
    #[inline(always)]
    fn records(&self) -> &Records {
        // Made outside of the cell: a thread that waits for its helpers takes up other work, which may come here too.
        let new = || Records::new(&self.geometry, &self.materials, &self.light_of, &self.lights, self.media());
        self.records.get().unwrap_or_else(|| {
            let records = new();
            self.records.get_or_init(|| records)
        })
    }

    /// Makes what waves load, if it is not there yet.
    pub(crate) fn prepare_waves(&self) {
        self.records();
    }

    /// [`Self::sample_next_event`] of what receives light, out of line: for one lane of many.
    #[inline(never)]
    pub(crate) fn sample_light(
        &self,
        from: &Receiver,
        u: Square,
        choice: Choice,
        nth: u32,
    ) -> Option<(Point, PdfArea)> {
        self.lights.sample_next_event(&self.geometry, &self.materials, *from, u, choice, nth)
    }

    /// The points at the barycentric coordinates `b` of the world's primitives `index` in the lanes `which`, as
    /// [`Self::point_at`] has them, where they are plain.
    #[inline(always)]
    pub(crate) fn plain_points<L: Lanes>(&self, lanes: L, which: L::M, index: L::U, b: [L::F; 2]) -> PlainPoints<L> {
        let records = self.records();
        if records.triangles.is_empty() {
            return PlainPoints::nowhere(lanes);
        }
        records.points(lanes, which, index, b)
    }

    /// The kinds that plain points may have: a bit for each, by its number.
    #[inline(always)]
    pub(crate) fn plain_kinds(&self) -> u32 {
        self.records().kinds
    }

    /// Points of lights that were chosen for next-event estimates from `from`, and their densities, as
    /// [`Lights::sample_next_event`] has them; `b` are barycentric coordinates uniform in area.
    #[inline(always)]
    pub(crate) fn plain_next_event<L: Lanes>(
        &self,
        which: L::M,
        light: &Chosen<L::U>,
        from: L::V,
        b: [L::F; 2],
    ) -> (PlainPoints<L>, PdfArea<L::F>) {
        let records = self.records();
        let (which, t) = records.load(b[0].lanes(), which, light.triangle);
        let outlook = Outlook::of(corners_of::<L>(&t), from);
        let near = which & outlook.is_near;
        let (mut b, mut area_of_solid_angle) = (b, light.density);
        if near.any() {
            let ([x, y], of_near) = outlook.place(b);
            (b, area_of_solid_angle) = ([near.select(x, b[0]), near.select(y, b[1])], of_near);
        }
        let points = records.points_of(&t, which, light.triangle, b);
        let mut pdf = light.density;
        if near.any() {
            let by_solid_angle = density(area_of_solid_angle, from, points.point.position, points.point.normal);
            pdf = near.select(pdf * by_solid_angle, pdf);
        }
        (points, PdfArea(pdf))
    }

    /// [`Lights::pdf_next_event`] for this scene.
    #[inline(always)]
    pub fn pdf_next_event<L: Lanes, B>(&self, point: &Point<L, B>, from: &Point<L, B>) -> PdfArea<L::F> {
        let lanes = point.alpha.lanes();
        if L::N == 1 || point.place != Place::Surface || self.few_lights().is_none() {
            return self.lights.pdf_next_event(&self.geometry, point, from);
        }
        // All lights are plain triangles.
        let index = lanes.whole_numbers(|k| L::lane(&point.primitive, k).index());
        let places = (from.position, point.position, point.normal);
        let by_solid_angle = self.plain_densities_from(lanes, point.lies_on_light(), index, places);
        PdfArea(self.lights.pdf_chosen(point, from).0 * by_solid_angle)
    }

    /// [`Lights::density_from`] of places on the triangles `index` in the lanes `which`, which are plain: where from,
    /// where, and N_g there.
    #[inline(always)]
    fn plain_densities_from<L: Lanes>(
        &self,
        lanes: L,
        which: L::M,
        index: L::U,
        (from, position, normal): (L::V, L::V, L::V),
    ) -> L::F {
        let (which, t) = self.records().load(lanes, which, index);
        let (outlook, one) = (Outlook::of(corners_of::<L>(&t), from), lanes.splat(1.0));
        let near = which & outlook.is_near;
        if !near.any() {
            return one;
        }
        near.select(density(outlook.area_of_solid_angle(), from, position, normal), one)
    }

    /// [`Self::pdf_next_event`] over the density `pdf` of emission, where next-event estimation chooses the lights as
    /// emission does: of places on the `primitives` with these words, in the lanes `which`.
    #[inline(always)]
    pub(crate) fn next_event_ratio<L: Lanes>(
        &self,
        which: L::M,
        primitives: [L::U; 2],
        (from, position, normal): (L::V, L::V, L::V),
        pdf: PdfArea<L::F>,
    ) -> L::F {
        let lanes = pdf.0.lanes();
        let densities = if self.few_lights().is_some() {
            self.plain_densities_from(lanes, which, primitives[1], (from, position, normal))
        } else {
            let ([instance, index], mut densities) = ([primitives[0].all(), primitives[1].all()], [1.0; MOST]);
            let (from, position, normal) = (from.all(), position.all(), normal.all());
            for k in which.lanes() {
                if let Some(id) = self.light_of.get(PrimitiveId::of_words([instance[k], index[k]])) {
                    let place = [position[k].into(), normal[k].into()];
                    densities[k] = self.lights.density_from(&self.geometry, id, from[k].into(), place);
                }
            }
            lanes.load(&densities)
        };
        pdf.0 * densities / pdf.0
    }

    /// The lights, if there are few and all are plain.
    #[inline(always)]
    pub(crate) fn few_lights(&self) -> Option<&FewLights> {
        self.records().lights.as_ref()
    }
}

/// As many lights as a table in a register has entries: all are plain triangles, and chosen by power.
#[derive(Clone, Debug)]
pub(crate) struct FewLights {
    /// Where the share of each begins among all choices: upper and lower words.
    begins: [[u32; FewLights::MOST]; 2],
    count: usize,
    triangles: [u32; FewLights::MOST],
    /// The bits of the density of next-event estimation.
    densities: [u32; FewLights::MOST],
    /// 1 for those that emit on both sides, else 0.
    both: [u32; FewLights::MOST],
}

/// Lights that have been chosen, one in each lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chosen<U: Unsigned> {
    /// The triangle.
    pub triangle: U,
    /// The density of its points in next-event estimation.
    pub density: <U::Lanes as Lanes>::F,
    /// Where it emits on both sides.
    pub both: <U::Lanes as Lanes>::M,
}

impl FewLights {
    const MOST: usize = 16;

    /// Their ids.
    pub fn ids(&self) -> impl Iterator<Item = LightId> {
        (0..self.count as u32).map(LightId::new)
    }

    fn new(lights: &Lights, records: &Records) -> Option<Self> {
        let begins = lights.begins_by_power()?;
        let all: Vec<_> = (0..begins.len() as u32).map(LightId::new).map(|id| lights.even_area(id)).collect();
        let plain = |light: &Option<(PrimitiveId, f32, EmissionSides)>| {
            light.is_some_and(|(triangle, ..)| records.is_plain(triangle))
        };
        if begins.len() > Self::MOST || !all.iter().all(plain) {
            return None;
        }
        let none = [0; Self::MOST];
        let mut few = Self { begins: [none; 2], count: all.len(), triangles: none, densities: none, both: none };
        for (i, (triangle, area, sides)) in all.into_iter().flatten().enumerate() {
            (few.begins[0][i], few.begins[1][i]) = ((begins[i] >> 32) as u32, begins[i] as u32);
            few.triangles[i] = triangle.index();
            few.both[i] = u32::from(sides == EmissionSides::Both);
            few.densities[i] = (lights.probability_by_power(LightId::new(i as u32)) / area).to_bits();
        }
        Some(few)
    }

    /// In each lane the light to which the choice with these words leads: as [`Lights::sample_next_event`] and
    /// [`Lights::sample_emission`] take them.
    #[inline(always)]
    pub fn choose<U: Unsigned>(&self, [high, low]: [U; 2]) -> Chosen<U> {
        let lanes = high.lanes();
        // The last choice of all counts as the one before.
        let last = high.eq(lanes.splat_u(u32::MAX)) & low.eq(lanes.splat_u(u32::MAX));
        let low = last.select(lanes.splat_u(u32::MAX - 1), low);
        let mut index = lanes.splat_u(0);
        for i in 1..self.count {
            let (begin, begin_low) = (lanes.splat_u(self.begins[0][i]), lanes.splat_u(self.begins[1][i]));
            let before = high.lt(begin) | (high.eq(begin) & low.lt(begin_low));
            index = before.select(index, lanes.splat_u(i as u32));
        }
        Chosen {
            triangle: index.lookup(&self.triangles),
            density: Float::of_bits(index.lookup(&self.densities)),
            both: index.lookup(&self.both).eq(lanes.splat_u(1)),
        }
    }
}

impl Records {
    pub fn new(
        geometry: &Geometry,
        materials: &[Material],
        light_of: &LightIndex,
        lights: &Lights,
        media: Option<&Media>,
    ) -> Self {
        // Where other surfaces may coincide with a body's, a walk has to look for them.
        let meet = media.is_some_and(Media::meet);
        let is_plain = |material: &Material| {
            let opaque = material.maps.is_none() && material.alpha_mode == AlphaMode::Opaque;
            opaque && Kind::of(&material.bsdf).is_some_and(|kind| !(meet && kind.transmits()))
        };
        let plain = |index: u32| {
            let id = PrimitiveId::world(index);
            is_plain(&materials[geometry.material(id).0 as usize]) && !geometry.may_be_hidden(id)
        };
        let count = if materials.iter().any(is_plain) { geometry.world_triangles() } else { 0 };
        let smooth = |index: &u32| plain(*index) && geometry.world_normals(*index).is_some();
        let smooth: Vec<u32> = (0..count).into_par_iter().filter(smooth).collect();
        let smooth = if smooth.len() <= MOST_NORMALS { smooth } else { Vec::new() };
        let word = f32::from_bits;
        let triangle = |index: u32| {
            let id = PrimitiveId::world(index);
            let ([p, q, r], n) = geometry.world_triangle(index);
            let place = smooth.binary_search(&index);
            let kind = match (plain(index), geometry.world_normals(index), place) {
                (true, None, _) => FLAT,
                (true, Some(_), Ok(_)) => SMOOTH,
                _ => NOT_PLAIN,
            };
            let (light, place) = (LightId::successor(light_of.get(id)), place.unwrap_or(0) as u32);
            let rows = [(p, geometry.material(id).0), (q, light), (r, kind), (n, place)];
            record(rows.map(|(vector, last)| vector.extend(word(last)).to_array()))
        };
        let normals = |index: &u32| {
            let [p, q, r] = geometry.world_normals(*index).unwrap_or_default();
            record([p, q, r, Vec3::ZERO].map(|row| row.extend(0.0).to_array()))
        };
        let material = |material: &Material| {
            let kind = Kind::of(&material.bsdf).unwrap_or(Kind::Diffuse);
            let Terms { color, ior, alpha, fraction, f0, f90 } = Terms::of(&material.bsdf);
            let rows = [(color, word(kind as u32)), (material.emission, ior), (f0, f90)];
            let [bsdf, emission, f0] = rows.map(|(rgb, last)| Vec3::from(rgb).extend(last).to_array());
            record([bsdf, emission, f0, [alpha, fraction, 0.0, 0.0]])
        };
        let mut records = Self {
            triangles: (0..count).into_par_iter().map(triangle).collect(),
            normals: smooth.par_iter().map(normals).collect(),
            materials: materials.iter().map(material).collect(),
            kinds: materials.iter().filter(|m| is_plain(m)).filter_map(|m| Kind::of(&m.bsdf)).fold(0, Kind::in_set),
            lights: None,
        };
        records.lights = FewLights::new(lights, &records);
        records
    }

    /// Whether a primitive is a plain triangle.
    #[inline(always)]
    fn is_plain(&self, primitive: PrimitiveId) -> bool {
        let plain = |triangle: &Record| triangle.0[KIND].to_bits() != NOT_PLAIN;
        primitive.instance().is_none() && self.triangles.get(primitive.index() as usize).is_some_and(plain)
    }

    /// The points at the barycentric coordinates `b` of the triangles `index` in the lanes `which`, as
    /// [`Point::on_surface`] has them, where these are plain.
    #[inline(always)]
    pub fn points<L: Lanes>(&self, lanes: L, which: L::M, index: L::U, b: [L::F; 2]) -> PlainPoints<L> {
        let (which, t) = self.load(lanes, which, index);
        self.points_of(&t, which, index, b)
    }

    /// The records of the triangles `index` in the lanes `which`, and where these are plain.
    #[inline(always)]
    fn load<L: Lanes>(&self, lanes: L, which: L::M, index: L::U) -> (L::M, [L::F; 16]) {
        let which = which & index.lt(lanes.splat_u(self.triangles.len() as u32));
        let t = lanes.records(&self.triangles, which.select(index, lanes.splat_u(0)));
        (which & !t[KIND].to_bits().eq(lanes.splat_u(NOT_PLAIN)), t)
    }

    /// The points of triangles with these records.
    #[inline(always)]
    fn points_of<L: Lanes>(&self, t: &[L::F; 16], which: L::M, index: L::U, [b, c]: [L::F; 2]) -> PlainPoints<L> {
        let (lanes, kind) = (b.lanes(), t[KIND].to_bits());
        let index = which.select(index, lanes.splat_u(0));
        let normal = L::V::new(t[12], t[13], t[14]);
        let (position, error) = surface_of(corners_of::<L>(t), [b, c]);
        let smooth = which & kind.eq(lanes.splat_u(SMOOTH));
        let shading_normal =
            if smooth.any() { self.shading_normals::<L>(smooth, t[15].to_bits(), [b, c], normal) } else { normal };
        let material = t[3].to_bits();
        let m = lanes.records(&self.materials, which.select(material, lanes.splat_u(0)));
        let rgb = |i: usize| Rgb::of(L::V::new(m[i], m[i + 1], m[i + 2]));
        let terms = Terms { color: rgb(0), ior: m[7], alpha: m[12], fraction: m[13], f0: rgb(8), f90: m[11] };
        let (light, material, index) = (t[7].to_bits().all(), material.all(), index.all());
        let (b, c) = (b.all(), c.all());
        let point = Point {
            position,
            normal,
            shading_normal,
            error,
            place: Place::Surface,
            primitive: lanes.each(|k| PrimitiveId::world(index[k])),
            material: lanes.each(|k| MaterialId(material[k])),
            media: [lanes.each(|_| MediumId::EMPTY); 2],
            light: lanes.each(|k| LightId::of_successor(light[k])),
            alpha: lanes.splat(1.0),
            bsdf: Bsdfs::of_kind(Kind::Diffuse, Terms::of_color(Rgb::grey(lanes.splat(0.0)))),
            emission: rgb(4),
            barycentric: lanes.each(|k| glam::Vec2::new(b[k], c[k])),
        };
        PlainPoints { point, which, kind: m[3].to_bits(), terms }
    }

    /// N_s of the smooth triangles.
    #[inline(always)]
    fn shading_normals<L: Lanes>(&self, smooth: L::M, place: L::U, [b, c]: [L::F; 2], normal: L::V) -> L::V {
        let lanes = b.lanes();
        let place = smooth.select(place, lanes.splat_u(0));
        let (zero, one) = (lanes.splat(0.0), lanes.splat(1.0));
        let t = lanes.records(&self.normals, place);
        let corner = |i: usize| L::V::new(t[i], t[i + 1], t[i + 2]);
        let interpolated = corner(0) * (one - b - c) + corner(4) * b + corner(8) * c;
        let reciprocal = one / interpolated.dot(interpolated).sqrt();
        let some = smooth & zero.lt(reciprocal) & reciprocal.lt(lanes.splat(f32::INFINITY));
        let n = interpolated * reciprocal;
        let n = n.dot(normal).lt(zero).select(-n, n);
        let low = some & n.dot(normal).lt(lanes.splat(STEEPEST));
        let n = some.select(n, normal);
        if !low.any() {
            return n;
        }
        let (mut all, normals) = (n.all(), normal.all());
        for k in low.lanes() {
            all[k] = lifted(all[k].into(), normals[k].into()).to_array();
        }
        lanes.vectors(|k| all[k])
    }
}

/// The corners of triangles with these records.
#[inline(always)]
fn corners_of<L: Lanes>(t: &[L::F; 16]) -> [L::V; 3] {
    [L::V::new(t[0], t[1], t[2]), L::V::new(t[4], t[5], t[6]), L::V::new(t[8], t[9], t[10])]
}

fn record([a, b, c, d]: [[f32; 4]; 4]) -> Record {
    let mut numbers = [0.0; 16];
    for (four, row) in numbers.chunks_exact_mut(4).zip([a, b, c, d]) {
        four.copy_from_slice(&row);
    }
    Record(numbers)
}
