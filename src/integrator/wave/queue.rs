//! Queues: what a wave keeps of its paths between two stages, side by side.

use crate::{
    lanes::{Float, Lanes, MOST, Mask, Select, Unsigned, Vector},
    math::Rgb,
    path::{Beginning, Departure, RivalSum, Step, Strategy, Tail},
    sampling::{PdfArea, PdfSolidAngle},
    scene::{
        Scene,
        bsdf::Bsdfs,
        geometry::{Hit, Hits, PrimitiveId, Ray, RayColumns},
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
        [&self.numbers[from], &self.numbers[from + 1], &self.numbers[from + 2]]
    }

    /// Two columns of words from the `from`-th on.
    fn names(&self, from: usize) -> [&[u32]; 2] {
        [&self.words[from], &self.words[from + 1]]
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
    /// The own-side density of its last vertex, and the running sum up to the one before.
    pub pdf_fwd: PdfArea<L::F>,
    pub rivals: RivalSum<L::U>,
    /// Of a walk from a light, from its second vertex on: see [`Beginning`].
    pub next_event_ratio: L::F,
    /// [`DELTA`] and the other flags, and [`flag_of`] its last vertex's place.
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
/// Its pixel is one of the image: what it finds from a light is connected to the lens.
pub const SPLATS: u32 = 16;
/// A walk from the camera through its pixel is connected to what it finds from a light.
pub const CONNECTS: u32 = 32;
/// A ray can meet the light that it comes from.
pub const HITTABLE: u32 = 64;
/// Its vertices are kept for merges.
pub const KEEPS: u32 = 256;
/// Its last vertex but one passes a delta lobe.
pub const DELTA_BEFORE: u32 = 128;
/// All its vertices behind the first one pass delta lobes, and there is one.
pub const SEEN_SPECULAR: u32 = 512;
/// The same but for its last vertex.
pub const SEEN_SPECULAR_BEFORE: u32 = 1024;

/// What kind of place its last vertex is.
pub fn flag_of(place: Place) -> u32 {
    match place {
        Place::Surface => 0,
        Place::Degenerate => 4,
        Place::Infinite => 8,
        Place::Film => 12,
    }
}

/// In which lanes a flag is set.
#[inline(always)]
pub fn has<U: Unsigned>(flags: U, flag: u32) -> <U::Lanes as Lanes>::M {
    let lanes = flags.lanes();
    !(flags & lanes.splat_u(flag)).eq(lanes.splat_u(0))
}

/// The flag where the condition holds.
#[inline(always)]
pub fn flag<L: Lanes>(lanes: L, flag: u32, condition: L::M) -> L::U {
    condition.select(lanes.splat_u(flag), lanes.splat_u(0))
}

impl<L: Lanes> Walk<L> {
    /// What a weight sees of it from `here` on, where it has come to.
    #[inline(always)]
    pub fn tail(&self, here: &Step<L, Bsdfs<L>>) -> Tail<L> {
        Tail {
            pdf_fwd: [here.pdf_fwd, self.pdf_fwd],
            is_delta: [has(self.flags, DELTA), has(self.flags, DELTA_BEFORE)],
            is_seen_by_specular: [has(self.flags, SEEN_SPECULAR), has(self.flags, SEEN_SPECULAR_BEFORE)],
            rivals: self.rivals,
        }
    }

    /// What the first two edges of walks from lights count as, now that the ratio of their lights' densities is known.
    #[inline(always)]
    pub fn beginning(&self, next_event_ratio: L::F) -> Beginning<L::F> {
        let lanes = self.flags.lanes();
        let hittable = has(self.flags, HITTABLE).select(lanes.splat(1.0), lanes.splat(0.0));
        Beginning { hittable, next_event_ratio }
    }

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
pub struct Walks(pub Columns<22, 8>);

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
            pdf_fwd: PdfArea(x[20]),
            next_event_ratio: x[21],
            primitive: [u[0], u[1]],
            flags: u[2],
            scrambles: [u[3], u[4]],
            index: u[5],
            number: u[6],
            rivals: RivalSum::of_word(u[7]),
        }
    }

    #[inline(always)]
    pub fn push<L: Lanes>(&mut self, walk: &Walk<L>, which: L::M) {
        let Departure { origin, direction, pdf, beta, survival } = walk.departure;
        let ([a, b, c], [d, e, f]) = (origin.coordinates(), direction.coordinates());
        let ([g, h, i], [j, k, l]) = (beta.channels().coordinates(), walk.position.coordinates());
        let ([m, n, o], [x, y]) = (walk.normal.coordinates(), walk.raster);
        let (pdf_fwd, ratio) = (walk.pdf_fwd.0, walk.next_event_ratio);
        let numbers = [a, b, c, d, e, f, pdf.0, g, h, i, survival, walk.whole, j, k, l, m, n, o, x, y, pdf_fwd, ratio];
        let ([instance, primitive], [own, connection]) = (walk.primitive, walk.scrambles);
        let rivals = walk.rivals.word();
        let words = [instance, primitive, walk.flags, own, connection, walk.index, walk.number, rivals];
        self.0.push::<L>((numbers, words), which);
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
                inside.arrive(scene, media, &mut point, ray.direction, None);
            }
        }
        Some(point)
    }

    /// All rays.
    pub fn rays(&self) -> RayColumns<'_> {
        let queue = &self.0;
        let (origin, direction) = (queue.vectors(0), queue.vectors(3));
        RayColumns { len: queue.len, origin, direction, t_max: None, skip: [Some(queue.names(0)), None] }
    }
}

/// A connection whose ray has not been traced.
#[derive(Clone, Copy, Debug)]
pub struct Connection<L: Lanes> {
    /// The segment.
    pub ray: Ray<L::V>,
    /// The primitives of both ends.
    pub primitives: [[L::U; 2]; 2],
    /// Where surfaces coincide.
    pub ends: Option<Ends<L>>,
    /// What it deposits if nothing is in the way.
    pub value: Rgb<L::V>,
    /// Where.
    pub raster: [L::F; 2],
    /// What has found it.
    pub strategy: Strategy,
}

/// What is asked of both ends of a connection if something lies between them.
#[derive(Clone, Copy, Debug)]
pub struct Ends<L: Lanes> {
    /// Where they are.
    pub positions: [L::V; 2],
    /// The cosines of the ray to their planes.
    pub cosines: [L::F; 2],
}

/// Connections side by side; and their [`Ends`], where there are any.
#[derive(Clone, Debug, Default)]
pub struct Connections(pub Columns<12, 5>, Columns<8, 0>);

impl Connections {
    /// Forgets all, and makes room for so many.
    pub fn clear(&mut self, room: usize) {
        self.0.clear(room);
        self.1.clear(room);
    }

    #[inline(always)]
    pub fn push<L: Lanes>(&mut self, connection: &Connection<L>, which: L::M) {
        let Connection { ray, primitives: [[a, b], [c, d]], ends, value, raster: [x, y], strategy } = connection;
        let ([i, j, k], [l, m, n]) = (ray.origin.coordinates(), ray.direction.coordinates());
        let [r, g, blue] = value.channels().coordinates();
        let light_vertices = x.lanes().splat_u(strategy.s);
        let numbers = [i, j, k, l, m, n, ray.t_max, r, g, blue, *x, *y];
        self.0.push::<L>((numbers, [*a, *b, *c, *d, light_vertices]), which);
        if let Some(Ends { positions: [a, b], cosines: [cos_a, cos_b] }) = ends {
            let ([i, j, k], [l, m, n]) = (a.coordinates(), b.coordinates());
            self.1.push::<L>(([i, j, k, l, m, n, *cos_a, *cos_b], []), which);
        }
    }

    /// All rays.
    pub fn rays(&self) -> RayColumns<'_> {
        let queue = &self.0;
        RayColumns {
            len: queue.len,
            origin: queue.vectors(0),
            direction: queue.vectors(3),
            t_max: Some(&queue.numbers[6]),
            skip: [Some(queue.names(0)), Some(queue.names(2))],
        }
    }

    /// Of the connections in the lanes `blocked` of the group from the `from`-th on, those whose ends see each other
    /// although there is an obstacle.
    #[inline(always)]
    pub fn see_despite<L: Lanes>(&self, scene: &Scene, from: usize, blocked: L::M, obstacles: &Hits, lanes: L) -> L::M {
        let geometry = scene.geometry();
        let (t, t_max) = (obstacles.distances(lanes, from), lanes.load(&self.0.numbers[6][from..]));
        let cos = |end: usize| lanes.load(&self.1.numbers[6 + end][from..]);
        let close = geometry.may_be_in_planes(t, cos(0)) | geometry.may_be_in_planes(t_max - t, cos(1));
        let mut open = 0;
        for k in (blocked & close).lanes() {
            let sees = obstacles.get(from + k).is_none_or(|hit| self.sees_despite(scene, from + k, &hit));
            open |= u32::from(sees) << k;
        }
        lanes.mask(open)
    }

    /// Whether the ends of the `at`-th see each other although `hit` lies between them: where surfaces coincide, what
    /// is in the plane of an end is no obstacle.
    #[inline(never)]
    fn sees_despite(&self, scene: &Scene, at: usize, hit: &Hit) -> bool {
        let v = |i: usize| glam::Vec3::from([i, i + 1, i + 2].map(|i| self.0.numbers[i][at]));
        let place = |i: usize| glam::Vec3::from([i, i + 1, i + 2].map(|i| self.1.numbers[i][at]));
        let ray = Ray { origin: v(0), direction: v(3), t_max: self.0.numbers[6][at] };
        let primitives = [self.0.primitive(0, at), self.0.primitive(2, at)];
        if !scene.geometry().may_be_in_plane_of_end(&ray, primitives, hit) {
            return false;
        }
        let end = |position, primitive| {
            let place = if primitive == PrimitiveId::NONE { Place::Degenerate } else { Place::Surface };
            Point { place, primitive, ..Point::nowhere(position) }
        };
        scene.sees_among_coincident(&ray, &end(place(0), primitives[0]), &end(place(3), primitives[1]))
    }
}

/// Contributions side by side: what connections deposit that nothing blocks.
#[derive(Clone, Debug, Default)]
pub struct Seen(pub Columns<5, 1>);

impl Seen {
    /// Adds those of the group of connections from the `at`-th on that are `open`, but for what is black.
    #[inline(always)]
    pub fn push_of<L: Lanes>(&mut self, lanes: L, connections: &Connections, at: usize, open: L::M) {
        let Columns { numbers, words, .. } = &connections.0;
        let x = |i: usize| lanes.load(&numbers[i][at..]);
        let (r, g, b, zero) = (x(7), x(8), x(9), lanes.splat(0.0));
        let black = r.eq(zero) & g.eq(zero) & b.eq(zero);
        self.0.push::<L>(([r, g, b, x(10), x(11)], [lanes.load_u(&words[4][at..])]), open & !black);
    }

    /// The value of the `at`-th, its place on the image, and its s.
    #[inline(always)]
    pub fn get(&self, at: usize) -> (Rgb, [f32; 2], u32) {
        let x = |i: usize| self.0.numbers[i][at];
        (Rgb::new(x(0), x(1), x(2)), [x(3), x(4)], self.0.words[0][at])
    }
}
