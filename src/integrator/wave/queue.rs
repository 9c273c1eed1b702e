//! Queues: what a wave keeps of its paths between two stages, side by side.

use crate::{
    lanes::{Float, Lanes, MOST, Mask, Unsigned, Vector},
    math::Rgb,
    path::Departure,
    sampling::PdfSolidAngle,
    scene::{
        Scene,
        bsdf::Bsdfs,
        geometry::{Hit, Hits, PrimitiveId, Ray, Rays},
        media::Inside,
        point::{Place, Point},
    },
};

/// Records of F numbers and U words, column by column: a stage loads as many of each as there are lanes, and adds those
/// that go on.
#[derive(Clone, Debug)]
pub struct Columns<const F: usize, const U: usize> {
    len: usize,
    // Each has room for all lanes behind the last record.
    numbers: [Vec<f32>; F],
    words: [Vec<u32>; U],
}

impl<const F: usize, const U: usize> Default for Columns<F, U> {
    fn default() -> Self {
        Self { len: 0, numbers: [const { Vec::new() }; F], words: [const { Vec::new() }; U] }
    }
}

impl<const F: usize, const U: usize> Columns<F, U> {
    /// Forgets all, and makes room for so many.
    pub fn clear(&mut self, room: usize) {
        self.len = 0;
        if self.numbers[0].len() < room + MOST {
            self.numbers.iter_mut().for_each(|column| column.resize(room + MOST, 0.0));
            self.words.iter_mut().for_each(|column| column.resize(room + MOST, 0));
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Those from the `at`-th on, one for each lane; anything behind the last.
    #[inline(always)]
    fn get<L: Lanes>(&self, lanes: L, at: usize) -> ([L::F; F], [L::U; U]) {
        let (mut numbers, mut words) = ([lanes.splat(0.0); F], [lanes.splat_u(0); U]);
        for (x, column) in numbers.iter_mut().zip(&self.numbers) {
            *x = lanes.load(&column[at..]);
        }
        for (x, column) in words.iter_mut().zip(&self.words) {
            *x = lanes.load_u(&column[at..]);
        }
        (numbers, words)
    }

    /// Adds those of some lanes.
    #[inline(always)]
    fn push<L: Lanes>(&mut self, (numbers, words): ([L::F; F], [L::U; U]), which: L::M) {
        let at = self.len;
        for (x, column) in numbers.into_iter().zip(&mut self.numbers) {
            x.compress(which, &mut column[at..]);
        }
        for (x, column) in words.into_iter().zip(&mut self.words) {
            x.compress(which, &mut column[at..]);
        }
        self.len += which.bits().count_ones() as usize;
    }

    /// Three columns of numbers from the `from`-th on.
    fn vectors(&self, from: usize) -> [&[f32]; 3] {
        let [x, y, z] = [&self.numbers[from], &self.numbers[from + 1], &self.numbers[from + 2]];
        [&x[..self.len], &y[..self.len], &z[..self.len]]
    }

    fn primitive(&self, from: usize, at: usize) -> PrimitiveId {
        PrimitiveId::of_words([self.words[from][at], self.words[from + 1][at]])
    }
}

/// A walk on its way to its next vertex.
#[derive(Clone, Copy, Debug)]
pub struct Walk<L: Lanes> {
    /// How it has left its last vertex.
    pub departure: Departure<L>,
    /// See [`Roulette::ByThroughput`](crate::path::Roulette::ByThroughput).
    pub whole: L::F,
    /// Where its last vertex is, its N_g, and on what.
    pub position: L::V,
    pub normal: L::V,
    pub primitive: [L::U; 2],
    /// [`DELTA`], [`flag_of`] its place.
    pub flags: L::U,
    /// Where on the image a walk from the camera began.
    pub raster: [L::F; 2],
    /// What [`Numbers`](crate::sampling::Numbers) keeps of its sequences: the first word of its own and of that for
    /// connections, and the second word, which they share.
    pub scrambles: [L::U; 2],
    pub index: L::U,
    /// Which of the wave's walks it is.
    pub number: L::U,
}

/// The walk's last vertex passes a delta lobe.
pub const DELTA: u32 = 1;

/// What kind of place its last vertex is.
pub fn flag_of(place: Place) -> u32 {
    match place {
        Place::Surface => 0,
        Place::Degenerate => 4,
        Place::Infinite => 8,
        Place::Film => 12,
    }
}

impl<L: Lanes> Walk<L> {
    /// In which lanes the last vertex is such a place.
    #[inline(always)]
    pub fn leaves(&self, place: Place) -> L::M {
        let lanes = self.flags.lanes();
        (self.flags & lanes.splat_u(12)).eq(lanes.splat_u(flag_of(place)))
    }

    /// Its last vertex, as far as an edge from there depends on it.
    #[inline(always)]
    pub fn from(&self, place: Place) -> Point<L, Bsdfs<L>> {
        Point::without_surface(self.position, self.normal, place)
    }
}

/// Walks side by side.
#[derive(Clone, Debug, Default)]
pub struct Walks(pub Columns<20, 7>);

impl Walks {
    #[inline(always)]
    pub fn get<L: Lanes>(&self, lanes: L, at: usize) -> Walk<L> {
        let (x, u) = self.0.get(lanes, at);
        let v = |i: usize| L::V::new(x[i], x[i + 1], x[i + 2]);
        Walk {
            departure: Departure {
                origin: v(0),
                direction: v(3),
                pdf: PdfSolidAngle(x[6]),
                beta: Rgb::of(v(7)),
                survival: x[10],
            },
            whole: x[11],
            position: v(12),
            normal: v(15),
            raster: [x[18], x[19]],
            primitive: [u[0], u[1]],
            flags: u[2],
            scrambles: [u[3], u[4]],
            index: u[5],
            number: u[6],
        }
    }

    #[inline(always)]
    pub fn push<L: Lanes>(&mut self, walk: &Walk<L>, which: L::M) {
        let Departure { origin, direction, pdf, beta, survival } = walk.departure;
        let ([a, b, c], [d, e, f]) = (origin.coordinates(), direction.coordinates());
        let ([g, h, i], [j, k, l]) = (beta.channels().coordinates(), walk.position.coordinates());
        let ([m, n, o], [x, y]) = (walk.normal.coordinates(), walk.raster);
        let numbers = [a, b, c, d, e, f, pdf.0, g, h, i, survival, walk.whole, j, k, l, m, n, o, x, y];
        let ([instance, primitive], [camera, connection]) = (walk.primitive, walk.scrambles);
        self.0.push::<L>(
            (numbers, [instance, primitive, walk.flags, camera, connection, walk.index, walk.number]),
            which,
        );
    }

    /// The ray of the `at`-th.
    #[inline(always)]
    pub fn ray(&self, at: usize) -> Ray {
        let v = |[x, y, z]: [&[f32]; 3]| glam::Vec3::new(x[at], y[at], z[at]);
        Ray { origin: v(self.0.vectors(0)), direction: v(self.0.vectors(3)), t_max: f32::INFINITY }
    }

    /// The primitive that the `at`-th has left.
    #[inline(always)]
    pub fn left(&self, at: usize) -> PrimitiveId {
        self.0.primitive(0, at)
    }

    /// The surface points to which those in the lanes `which` of the group from the `from`-th on come. Returns a bit
    /// for each that does not leave the scene.
    #[inline(always)]
    pub fn arrive_each(
        &self,
        scene: &Scene,
        from: usize,
        which: impl Mask,
        hits: &Hits,
        inside: &mut [Inside],
        points: &mut [Point; MOST],
    ) -> u32 {
        let mut some = 0;
        for k in which.lanes() {
            if let Some(point) = self.arrive(scene, from + k, hits, inside) {
                points[k] = point;
                some |= 1 << k;
            }
        }
        some
    }

    /// The places in the sky to which they go.
    #[inline(always)]
    pub fn leave_each(&self, scene: &Scene, from: usize, which: impl Mask, points: &mut [Point; MOST]) {
        for k in which.lanes() {
            if let Some(sky) = scene.lights().environment_at(self.ray(from + k).direction) {
                points[k] = sky;
            }
        }
    }

    /// The surface point to which the `at`-th comes, as [`Subpath`](crate::path::Subpath) would; `None` if it leaves
    /// the scene.
    #[inline(never)]
    fn arrive(&self, scene: &Scene, at: usize, hits: &Hits, inside: &mut [Inside]) -> Option<Point> {
        let (ray, mut hit) = (self.ray(at), hits.get(at)?);
        if scene.geometry().has_coincident() && !scene.geometry().is_met_first(&ray, self.left(at), &hit) {
            // All is opaque, so that nothing asks whether to stop.
            hit = scene.trace_ray(ray.origin, ray.direction, self.left(at), |_| true).hit?;
        }
        let mut point = scene.point_at(&ray, &hit);
        if let Some(media) = scene.media() {
            let inside = &mut inside[self.0.words[6][at] as usize];
            if !inside.may_pass_over(media, &point) {
                inside.arrive(scene, media, &mut point, ray.direction);
            }
        }
        Some(point)
    }

    /// All rays.
    pub fn put_rays(&self, rays: &mut Rays) {
        let skip = |i| [self.0.primitive(0, i), PrimitiveId::NONE];
        rays.set(self.0.len, [self.0.vectors(0), self.0.vectors(3)], |_| f32::INFINITY, skip);
    }
}

/// A connection whose ray has not been traced.
#[derive(Clone, Copy, Debug)]
pub struct Connection<L: Lanes> {
    /// The segment.
    pub ray: Ray<L::V>,
    /// The primitives of both ends, and where they are.
    pub primitives: [[L::U; 2]; 2],
    pub ends: [L::V; 2],
    /// What it deposits if nothing is in the way.
    pub value: Rgb<L::V>,
    /// Where.
    pub raster: [L::F; 2],
}

/// Connections side by side.
#[derive(Clone, Debug, Default)]
pub struct Connections(pub Columns<18, 4>);

impl Connections {
    #[inline(always)]
    pub fn push<L: Lanes>(&mut self, connection: &Connection<L>, which: L::M) {
        let Connection { ray, primitives: [[a, b], [c, d]], ends, value, raster: [x, y] } = connection;
        let ([i, j, k], [l, m, n]) = (ray.origin.coordinates(), ray.direction.coordinates());
        let [r, g, blue] = value.channels().coordinates();
        let [[o, p, q], [s, t, u]] = [ends[0].coordinates(), ends[1].coordinates()];
        let numbers = [i, j, k, l, m, n, ray.t_max, r, g, blue, *x, *y, o, p, q, s, t, u];
        self.0.push::<L>((numbers, [*a, *b, *c, *d]), which);
    }

    /// All rays.
    pub fn put_rays(&self, rays: &mut Rays) {
        let skip = |i| [self.0.primitive(0, i), self.0.primitive(2, i)];
        rays.set(self.0.len, [self.0.vectors(0), self.0.vectors(3)], |i| self.0.numbers[6][i], skip);
    }

    /// Whether the ends of the `at`-th see each other although `hit` lies between them: where surfaces coincide, what
    /// is in the plane of an end is no obstacle.
    #[inline(always)]
    pub fn sees_despite(&self, scene: &Scene, at: usize, hit: &Hit) -> bool {
        let v = |i: usize| glam::Vec3::from([i, i + 1, i + 2].map(|i| self.0.numbers[i][at]));
        let ray = Ray { origin: v(0), direction: v(3), t_max: self.0.numbers[6][at] };
        let primitives = [self.0.primitive(0, at), self.0.primitive(2, at)];
        if !scene.geometry().may_be_in_plane_of_end(&ray, primitives, hit) {
            return false;
        }
        let end = |position, primitive| {
            let place = if primitive == PrimitiveId::NONE { Place::Degenerate } else { Place::Surface };
            Point { place, primitive, ..Point::nowhere(position) }
        };
        scene.sees_among_coincident(&ray, &end(v(12), primitives[0]), &end(v(15), primitives[1]))
    }

    /// The value of the `at`-th and its place on the image.
    pub fn value(&self, at: usize) -> (Rgb, [f32; 2]) {
        let x = |i: usize| self.0.numbers[i][at];
        (Rgb::new(x(7), x(8), x(9)), [x(10), x(11)])
    }
}
