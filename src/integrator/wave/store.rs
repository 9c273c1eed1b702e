//! The light vertices of a tile, to which walks from the camera are connected: the camera's stages come after all of
//! the light's.

use super::{
    queue::{DELTA, DELTA_BEFORE, HITTABLE, SEEN_SPECULAR, SEEN_SPECULAR_BEFORE, flag, has},
    words,
};
use crate::{
    lanes::{Float, Lanes, MOST, Mask, Record, Select, Unsigned, Vector},
    math::Rgb,
    path::{Edge, RivalSum, Step, Tail},
    sampling::PdfArea,
    scene::{
        bsdf::{Bsdf, Bsdfs, Diffuse, Kind, Terms},
        geometry::PrimitiveId,
        point::{Place, Point},
    },
};

/// A light prefix in each lane, as a connection to its last vertex sees it.
#[derive(Clone, Copy, Debug)]
pub struct LightEnd<L: Lanes> {
    /// Its last vertex y_s.
    pub step: Step<L, Bsdfs<L>>,
    /// What a weight sees from there on.
    pub tail: Tail<L>,
    /// Whether a ray can meet its light.
    pub is_hittable: L::M,
    /// See [`Densities::next_event_ratio`](crate::path::Densities::next_event_ratio).
    pub next_event_ratio: L::F,
}

/// Vertices by their number s, and by the number of the walk that has found them.
#[derive(Clone, Debug, Default)]
pub struct VertexStore {
    /// The vertices with s = 2, 3, …
    levels: Vec<Level>,
    /// How many levels have a vertex.
    used: usize,
    /// By the number of the walk, its largest s.
    last: Vec<u32>,
}

/// One vertex of each walk.
#[derive(Clone, Debug, Default)]
struct Level {
    kinds: Vec<Held>,
    /// What [`rows`] makes of a vertex.
    rows: [Vec<Record>; 2],
    /// What [`row_of_terms`] makes of the BSDFs that have more than a colour.
    terms: Vec<Record>,
    /// The BSDFs of [`Held::Other`].
    bsdfs: Vec<Bsdf>,
}

/// What a walk has at some s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// No vertex that a connection could use.
    Nothing,
    /// One of this kind.
    Of(Kind),
    /// One of another BSDF.
    Other,
}

impl Held {
    /// What BSDFs are that a store has to keep.
    #[inline(always)]
    pub fn of<L: Lanes>(lanes: L, bsdf: &Bsdfs<L>) -> Self {
        let (kind, _) = bsdf.kind_and_terms(lanes);
        kind.map_or(Self::Other, Self::Of)
    }

    /// What connections use.
    pub const ALL: [Self; 4] =
        [Self::Of(Kind::Diffuse), Self::Of(Kind::MetallicRoughness), Self::Of(Kind::Dielectric), Self::Other];
}

impl VertexStore {
    /// Forgets all, and makes room for the vertices of so many walks.
    pub fn clear(&mut self, walks: usize) {
        self.used = 0;
        self.last.clear();
        self.last.resize(walks, 1);
    }

    /// The s that some walk may have a vertex of.
    pub fn levels(&self) -> std::ops::RangeInclusive<u32> {
        2..=self.used as u32 + 1
    }

    /// The same of the walks of the lanes `which` with these numbers.
    #[inline(always)]
    pub fn levels_of(&self, numbers: &[u32; MOST], which: impl Mask) -> std::ops::RangeInclusive<u32> {
        let mut last = 1;
        if self.used > 0 {
            for k in which.lanes() {
                last = last.max(self.last[numbers[k] as usize]);
            }
        }
        2..=last
    }

    /// Puts the numbers of all walks in the order of how many vertices they have, so that lanes side by side have
    /// about as many connections to take.
    pub fn sort(&self, order: &mut [u32]) {
        if self.used > 0 {
            order.sort_unstable_by_key(|number| (self.last[*number as usize], *number));
        }
    }

    /// Keeps the s-th vertices of the walks of the lanes `which` with these numbers.
    #[inline(always)]
    pub fn put<L: Lanes>(&mut self, s: u32, end: &LightEnd<L>, number: L::U, which: L::M) {
        let (lanes, numbers) = (number.lanes(), number.all());
        for k in which.lanes() {
            self.last[numbers[k] as usize] = s;
        }
        let (level, bsdf) = (self.level(s), &end.step.vertex.point.bsdf);
        let (kind, terms) = bsdf.kind_and_terms(lanes);
        let held = kind.map_or(Held::Other, Held::Of);
        for (rows, columns) in level.rows.iter_mut().zip(rows(end, terms.color)) {
            lanes.put_records(columns, rows, number, which);
        }
        for k in which.lanes() {
            level.kinds[numbers[k] as usize] = held;
        }
        match held {
            Held::Nothing | Held::Of(Kind::Diffuse) => {}
            Held::Of(_) => {
                level.terms.resize(level.kinds.len(), Record([0.0; 16]));
                lanes.put_records(row_of_terms::<L>(&terms), &mut level.terms, number, which);
            }
            Held::Other => {
                let bsdf = bsdf.all(lanes);
                level.bsdfs.resize(level.kinds.len(), Bsdf::Diffuse(Diffuse { albedo: Rgb::ZERO }));
                for k in which.lanes() {
                    level.bsdfs[numbers[k] as usize] = bsdf(k);
                }
            }
        }
    }

    /// The level of an s that no level below is missing for.
    #[inline(never)]
    fn level(&mut self, s: u32) -> &mut Level {
        let (at, walks) = (s as usize - 2, self.last.len());
        while self.used <= at {
            if self.levels.len() == self.used {
                self.levels.push(Level::default());
            }
            let level = &mut self.levels[self.used];
            level.kinds.clear();
            level.kinds.resize(walks, Held::Nothing);
            level.rows.iter_mut().for_each(|rows| rows.resize(walks, Record([0.0; 16])));
            self.used += 1;
        }
        &mut self.levels[at]
    }

    /// For which of the lanes `which` the walks with these numbers have an s-th vertex of each of [`Held::ALL`], a bit
    /// for each.
    #[inline(always)]
    pub fn kinds(&self, s: u32, numbers: &[u32; MOST], which: impl Mask) -> [u32; Held::ALL.len()] {
        let kinds = &self.levels[s as usize - 2].kinds;
        let mut of_each = [0; Held::ALL.len()];
        for k in which.lanes() {
            let kind = kinds[numbers[k] as usize];
            for (of, held) in of_each.iter_mut().zip(Held::ALL) {
                *of |= u32::from(kind == held) << k;
            }
        }
        of_each
    }

    /// The s-th vertices of the walks of the lanes `which` with these numbers, all of which are of this kind.
    #[inline(always)]
    pub fn get<L: Lanes>(&self, lanes: L, s: u32, held: Held, number: L::U, which: L::M) -> LightEnd<L> {
        let level = &self.levels[s as usize - 2];
        let number = which.select(number, lanes.splat_u(0));
        let rows = [lanes.records(&level.rows[0], number), lanes.records(&level.rows[1], number)];
        let color = Rgb::of(L::V::new(rows[1][0], rows[1][1], rows[1][2]));
        let bsdf = match held {
            Held::Nothing | Held::Of(Kind::Diffuse) => Bsdfs::Diffuse(Diffuse { albedo: color }),
            Held::Of(kind) => Bsdfs::of_kind(kind, of_row::<L>(color, lanes.records(&level.terms, number))),
            Held::Other => {
                let number = number.all();
                Bsdfs::new(lanes, which, |k| &level.bsdfs[number[k] as usize])
            }
        };
        of_rows(rows, bsdf)
    }
}

/// What is kept of a BSDF but its colour.
#[inline(always)]
fn row_of_terms<L: Lanes>(Terms { ior, alpha, fraction, f0, f90, .. }: &Terms<L::V>) -> [L::F; 16] {
    let [r, g, b] = f0.channels().coordinates();
    let mut row = [ior.lanes().splat(0.0); 16];
    [row[0], row[1], row[2], row[3], row[4], row[5], row[6]] = [r, g, b, *ior, *alpha, *fraction, *f90];
    row
}

/// The BSDF that is kept so.
#[inline(always)]
fn of_row<L: Lanes>(color: Rgb<L::V>, row: [L::F; 16]) -> Terms<L::V> {
    let f0 = Rgb::of(L::V::new(row[0], row[1], row[2]));
    Terms { color, ior: row[3], alpha: row[4], fraction: row[5], f0, f90: row[6] }
}

/// What is kept of a vertex: what a connection to it reads. Where waves go, nothing is between the vertices of a walk:
/// V is 1.
#[inline(always)]
fn rows<L: Lanes>(end: &LightEnd<L>, color: Rgb<L::V>) -> [[L::F; 16]; 2] {
    let LightEnd { step, tail, is_hittable, next_event_ratio } = end;
    let (p, back) = (&step.vertex.point, &step.back);
    let lanes = p.error.lanes();
    let [a, b, c] = p.position.coordinates();
    let [d, e, f] = p.normal.coordinates();
    let [g, h, i] = p.shading_normal.coordinates();
    let [j, k, l] = back.direction.coordinates();
    let [r, s, t] = color.channels().coordinates();
    let [u, v, w] = step.beta.channels().coordinates();
    let [x, y] = words(lanes, p);
    let [delta, before] = tail.is_delta;
    let [seen, seen_before] = tail.is_seen_by_specular;
    let flags = flag(lanes, DELTA, delta)
        | flag(lanes, DELTA_BEFORE, before)
        | flag(lanes, SEEN_SPECULAR, seen)
        | flag(lanes, SEEN_SPECULAR_BEFORE, seen_before)
        | flag(lanes, HITTABLE, *is_hittable);
    let ([pdf, before], rivals) = (tail.pdf_fwd, tail.rivals.word());
    let (word, nothing) = (L::F::of_bits, lanes.splat(0.0));
    let (ratio, alpha, alpha_before) = (*next_event_ratio, p.alpha, back.alpha_b);
    let [x, y, flags, rivals] = [word(x), word(y), word(flags), word(rivals)];
    [
        [a, b, c, d, e, f, g, h, i, j, k, l, p.error, back.distance_squared, back.cos_a, back.cos_b],
        [r, s, t, u, v, w, x, y, flags, rivals, pdf.0, before.0, ratio, alpha, alpha_before, nothing],
    ]
}

/// The vertex that is kept so.
#[inline(always)]
fn of_rows<L: Lanes>([p, q]: [[L::F; 16]; 2], bsdf: Bsdfs<L>) -> LightEnd<L> {
    let lanes = p[0].lanes();
    let v = |row: &[L::F; 16], i: usize| L::V::new(row[i], row[i + 1], row[i + 2]);
    let (flags, [instance, index]) = (q[8].to_bits(), [q[6].to_bits().all(), q[7].to_bits().all()]);
    let point = Point {
        shading_normal: v(&p, 6),
        error: p[12],
        alpha: q[13],
        primitive: lanes.each(|k| PrimitiveId::of_words([instance[k], index[k]])),
        bsdf,
        ..Point::without_surface(v(&p, 0), v(&p, 3), Place::Surface)
    };
    let back = Edge {
        direction: v(&p, 9),
        distance_squared: p[13],
        cos_a: p[14],
        cos_b: p[15],
        alpha_a: q[13],
        alpha_b: q[14],
        visibility: lanes.splat(1.0),
    };
    let pdf_fwd = [PdfArea(q[10]), PdfArea(q[11])];
    LightEnd {
        step: Step { back, beta: Rgb::of(v(&q, 3)), ..Step::next_event(point, pdf_fwd[0]) },
        tail: Tail {
            pdf_fwd,
            is_delta: [has(flags, DELTA), has(flags, DELTA_BEFORE)],
            is_seen_by_specular: [has(flags, SEEN_SPECULAR), has(flags, SEEN_SPECULAR_BEFORE)],
            rivals: RivalSum::of_word(q[9].to_bits()),
        },
        is_hittable: has(flags, HITTABLE),
        next_event_ratio: q[12],
    }
}
