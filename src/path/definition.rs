//! The definition: a path p̄ = p_0 p_1 … p_n, its throughput, its contribution and its densities, written from the
//! formulas alone. Slow, in f64, without a cache: what the fast form is held against.

use std::sync::OnceLock;

use glam::{DVec3, Vec2, Vec3};

use super::{
    Heuristic, MeetingPlaces, PathClass, Strategy, Technique, Techniques, Vertex, class::Event, merging::is_met, tilt,
};
use crate::{
    lanes::One,
    math::{Frame, Rgb},
    sampling::PdfSolidAngle,
    scene::{
        Scene,
        bsdf::{Bsdf, Directions, Scatter},
        camera::Raster,
        geometry::{PrimitiveId, offset_origin},
        media::{Boundary, Media, MediumId},
        point::{Place, Point},
        wavelength::Wavelength,
    },
};

/// A path as an explicit list of vertices: p_0 on the lens, p_1 the first surface, p_n on a light.
#[derive(Clone, Debug)]
pub struct Path<'a> {
    scene: &'a Scene,
    vertices: Vec<Vertex>,
    visibility: Vec<f64>,
    /// Of a path that has merged: where, and the place at which the light's subpath ends beside that vertex.
    merged: Option<(usize, Point)>,
    raster: Raster,
    wavelength: Option<Wavelength>,
    surroundings: OnceLock<Surroundings>,
}

/// What a path lies in.
#[derive(Clone, Debug)]
struct Surroundings {
    /// The medium of every edge.
    edges: Vec<MediumId>,
    /// Of every vertex that bounds a volume, the media in front of it and behind.
    sides: Vec<Option<[MediumId; 2]>>,
}

/// An edge in f64, from p_i to p_j.
struct Segment {
    direction: DVec3,
    distance_squared: f64,
    cos_i: f64,
    cos_j: f64,
    /// In metres; infinite if an end is.
    distance: f64,
}

impl<'a> Path<'a> {
    /// A path with V = 1 on every edge.
    ///
    /// # Panics
    /// With fewer than two vertices.
    pub fn new(scene: &'a Scene, vertices: Vec<Vertex>) -> Self {
        assert!(vertices.len() >= 2, "a path has at least one edge");
        let visibility = vec![1.0; vertices.len() - 1];
        let raster = Raster(Vec2::ZERO);
        let surroundings = OnceLock::new();
        Self { scene, vertices, visibility, merged: None, raster, wavelength: None, surroundings }
    }

    /// The same path, said to arrive there on the image: weights that know their noise ask for it.
    #[must_use]
    pub fn arriving_at(self, raster: Raster) -> Self {
        Self { raster, ..self }
    }

    /// The same path as a merge at p_i = x: its edge to p_{i+1} ends at the point `q` beside x instead, which the
    /// light's subpath has reached. Light scatters at x as if it arrived there.
    ///
    /// # Panics
    /// If p_i is an end of the path.
    #[must_use]
    pub fn merged_at(self, i: usize, q: Point) -> Self {
        assert!(0 < i && i < self.edges(), "a path merges between its ends");
        Self { merged: Some((i, q)), ..self }
    }

    /// The same path with V(p_i↔p_{i+1}) = `visibility[i]`: the product of 1 − α over what the edge crosses, in [0, 1].
    ///
    /// # Panics
    /// If there is not one number per edge.
    #[must_use]
    pub fn with_visibility(self, visibility: Vec<f64>) -> Self {
        assert_eq!(visibility.len(), self.visibility.len());
        Self { visibility, ..self }
    }

    /// The same path at a wavelength. Without one, indices of refraction are those at 587.6 nm, and c/p is 1.
    #[must_use]
    pub fn at_wavelength(self, wavelength: Option<Wavelength>) -> Self {
        Self { wavelength, ..self }
    }

    /// The wavelength of the path, where it has one.
    pub fn wavelength(&self) -> Option<Wavelength> {
        self.wavelength
    }

    /// Where the path has merged, and the point that the light's subpath has reached there.
    pub fn merged(&self) -> Option<(usize, &Point)> {
        self.merged.as_ref().map(|(i, q)| (*i, q))
    }

    /// The same path in the media of `other`, which has vertices at about the same places.
    #[must_use]
    pub fn in_media_of(mut self, other: &Self) -> Self {
        if let Some(media) = self.scene.media() {
            self.surroundings = other.surroundings(media).clone().into();
        }
        self
    }

    /// n, the length in edges.
    pub fn edges(&self) -> usize {
        self.vertices.len() - 1
    }

    /// The vertices, camera first.
    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices
    }

    /// V(p_i↔p_{i+1}) of every edge i.
    pub fn visibility(&self) -> &[f64] {
        &self.visibility
    }

    /// T(p̄) = Π_{i=1}^{n−1} f̂(p_{i+1}→p_i→p_{i−1}) G(p_{i+1}↔p_i): the fraction of the light at p_n that reaches p_0,
    /// with respect to area measure (lecture, *The rendering equation: sum over paths*). In
    /// (sr m²)^(1−n).
    pub fn throughput(&self) -> DVec3 {
        (1..self.edges()).map(|i| self.scattering(i) * self.geometry_term(i) * self.transmittance(i)).product()
    }

    /// G(p_i↔p_{i+1}) = V |cos θ_i| |cos θ_{i+1}| / |p_i − p_{i+1}|², 1/m²; with a distance and a cosine of 1 at an
    /// infinite end and at an orthographic film, and a cosine of 1 where a vertex has no normal.
    pub fn geometry_term(&self, i: usize) -> f64 {
        let e = self.segment(i, i + 1);
        self.visibility[i] * e.cos_i * e.cos_j / e.distance_squared
    }

    /// F_j(p̄)/h_j = W_e(p_1→p_0) G(p_0↔p_1) T(p̄) L_e(p_n→p_{n−1}): the measurement contribution without the pixel's
    /// filter; times c(λ)/p(λ) where it depends on the wavelength.
    ///
    /// Of a path that has merged within a radius, [`Path::kernel`] is one more factor.
    pub fn contribution(&self) -> DVec3 {
        self.spectral_contribution() * self.response()
    }

    /// c(λ)/p(λ) where a vertex between the ends lies on a dispersive interface, else 1: by every scattering there,
    /// reflection as well as refraction.
    pub fn response(&self) -> DVec3 {
        let dispersed = |media: &Media| {
            let between = |i: usize| Some((self.vertices[i].point.material, self.surroundings(media).sides[i]?));
            (1..self.edges()).filter_map(between).any(|(material, sides)| media.disperse_between(material, sides))
        };
        match self.wavelength {
            Some(wavelength) if self.scene.media().is_some_and(dispersed) => wavelength.response().as_dvec3(),
            _ => DVec3::ONE,
        }
    }

    /// F_j(p̄)/h_j at the path's wavelength, whose colour is not in it.
    pub(super) fn spectral_contribution(&self) -> DVec3 {
        let n = self.edges();
        let we = f64::from(self.scene.camera.we(&self.vertices[0].point, self.segment(0, 1).direction.as_vec3()));
        let end = &self.vertices[n];
        let le = self.scene.le(&end.point, self.segment(n, n - 1).direction.as_vec3()).as_dvec3()
            * f64::from(end.point.alpha);
        we * self.geometry_term(0) * self.transmittance(0) * self.throughput() * le
    }

    /// K(x, q) = 1/(πr²) where a merge at p_i takes q for x, else 0; 1/m².
    pub fn kernel(&self, radius: f32) -> f64 {
        let Some((i, q)) = &self.merged else { return 0.0 };
        let x = &self.vertices[*i].point;
        let to_light = self.segment(*i, i + 1).direction.as_vec3();
        let met = is_met(radius, [x.position, q.position], [x.normal, q.normal], to_light);
        if met { 1.0 / (std::f64::consts::PI * f64::from(radius).powi(2)) } else { 0.0 }
    }

    /// The density with which a merge finds this path, with respect to the product area measure of all vertices and q:
    /// Π_{j≤i} c_j Π_{j≥i} l_j. Zero where it cannot.
    ///
    /// # Panics
    /// If the path has not merged at p_{t−1}.
    pub fn pdf_merged(&self, strategy: Strategy) -> f64 {
        let at = strategy.t as usize - 1;
        assert!(self.merged.as_ref().is_some_and(|(i, _)| *i == at), "the path has not merged there");
        self.density_of_meeting(strategy)
    }

    /// Π_{j≤i} c_j Π_{j≥i} l_j at p_i = p_{t−1}, which both subpaths reach: [`Path::pdf_merged`] of any path, also one
    /// that has not merged there. Zero where they cannot meet.
    pub fn density_of_meeting(&self, Strategy { t, .. }: Strategy) -> f64 {
        let (i, n) = (t as usize - 1, self.edges());
        if self.vertices[n].point.light.is_none() || self.vertices[i].is_delta() {
            return 0.0;
        }
        let walks = Strategy { s: 2, t: 1 };
        let camera_part: f64 = (0..=i).map(|j| self.camera_density(j, Directions::Bsdf)).product();
        let light_part: f64 = (i..=n).map(|j| self.light_density(j, walks, Directions::Bsdf)).product();
        camera_part * light_part
    }

    /// The same for the subpaths of a table: zero where its [`MeetingPlaces`] let nothing merge.
    pub fn density_of_merging(&self, strategy: Strategy, techniques: &Techniques) -> f64 {
        let (s, t) = (strategy.s as usize, strategy.t as usize);
        let is_seen = t >= 3 && self.vertices[1..t - 1].iter().all(Vertex::is_delta);
        let merges = techniques.meeting_places() == MeetingPlaces::Everywhere || (is_seen && s >= 2);
        if merges { self.density_of_meeting(strategy) } else { 0.0 }
    }

    /// p_{s,t}(p̄): the density with which strategy (s,t) finds this path, with respect to the product area measure (dω
    /// for an infinite p_n; coefficients of deltas at a pinhole, an orthographic camera, a point light, a sun and in
    /// delta lobes). Zero if it cannot. Walks sample their directions by the BSDF; [`Path::pdf_by`] knows other rules.
    ///
    /// # Panics
    /// If s + t is not the number of vertices.
    pub fn pdf(&self, strategy: Strategy) -> f64 {
        self.pdf_by(Directions::Bsdf, strategy)
    }

    /// p_{s,t}(p̄) as [`Path::pdf`], of walks that sample by the rule `directions`.
    ///
    /// # Panics
    /// If s + t is not the number of vertices.
    pub fn pdf_by(&self, directions: Directions, strategy: Strategy) -> f64 {
        let Strategy { s, t } = strategy;
        let (s, t, n) = (s as usize, t as usize, self.edges());
        assert_eq!(s + t, n + 1, "strategy {strategy} has another length than the path");
        let light = self.vertices[n].point.light;
        let hittable = light.is_some_and(|id| self.scene.lights().is_hittable(id));
        let connected = |i: usize| i == 0 || i == n || !self.vertices[i].is_delta();
        let possible = t >= 1
            && light.is_some()
            && (s == 0 || (connected(t - 1) && connected(t)))
            && (hittable || (s >= 1 && n >= 2))
            && !(s == 1 && t == 1 && self.ends_are_directions());
        if !possible {
            return 0.0;
        }
        let camera_part: f64 = (0..t).map(|i| self.camera_density(i, directions)).product();
        let light_part: f64 = (t..=n).map(|i| self.light_density(i, strategy, directions)).product();
        camera_part * light_part
    }

    /// The density with which area sampling draws this path: that of p_0, 1/A for every other vertex but the last, and
    /// for p_n that among the emitters. V is no part of it. Zero if it cannot: through delta lobes, and from lights
    /// that are no surfaces.
    pub fn pdf_area(&self) -> f64 {
        let n = self.edges();
        let end = &self.vertices[n].point;
        let drawn = |v: &Vertex| v.point.place == Place::Surface && !v.is_delta();
        if !self.vertices[1..].iter().all(drawn) || end.light.is_none() {
            return 0.0;
        }
        let surfaces: f64 =
            self.vertices[1..n].iter().map(|v| f64::from(self.scene.surfaces().pdf(&v.point).0)).product();
        f64::from(self.scene.camera.pdf_lens().0) * surfaces * f64::from(self.scene.emitters().pdf(end).0)
    }

    /// Whether each end of the path is a direction alone (an orthographic camera and an environment): two that are
    /// sampled independently never fit together.
    fn ends_are_directions(&self) -> bool {
        let place = |i: usize| self.vertices[i].point.place;
        place(0) == Place::Film && place(self.edges()) == Place::Infinite
    }

    /// w(p̄) = (v n p)^β / Σ (v n p)^β over all techniques of the table: n_{s,t} p_{s,t} of strategies, with v where
    /// the table has [`VarianceFactors`](super::VarianceFactors), and of the merge at each p_i that it may have,
    /// N_c N_l πr² Π_{j≤i} c_j Π_{j≥i} l_j.
    pub fn mis_weight(&self, found: Technique, techniques: &Techniques, heuristic: Heuristic) -> f64 {
        let n = self.edges() as u32;
        let strategies = || (1..=n + 1).map(|t| Strategy { s: n + 1 - t, t });
        let sampled = |x: Technique| match x {
            Technique::Bidirectional(strategy) => {
                let raster = self.raster.0.to_array();
                let v = techniques.variance_factors().map_or(1.0, |factors| factors.of(One, strategy, raster));
                f64::from(v) * f64::from(techniques.count(strategy)) * self.pdf_by(techniques.directions(), strategy)
            }
            Technique::Merged(strategy) => {
                let area = f64::from(techniques.merging_area());
                f64::from(techniques.merging_pairs(strategy.t)) * area * self.density_of_merging(strategy, techniques)
            }
            Technique::Area => 0.0,
        };
        let merges = strategies().filter(|x| x.t >= 2 && x.s >= 1 && techniques.radius().is_some());
        let all = strategies().map(Technique::Bidirectional).chain(merges.map(Technique::Merged));
        let all: Vec<_> = all.map(|x| (x, sampled(x))).collect();
        let largest = all.iter().map(|x| x.1).fold(0.0, f64::max);
        let beta = match heuristic {
            Heuristic::Balance => 1,
            Heuristic::Power => 2,
            Heuristic::FirstSupported => {
                let first = all.iter().find(|x| x.1 > 0.0).map(|x| x.0);
                return if first == Some(found) { 1.0 } else { 0.0 };
            }
        };
        let share = |np: f64| (np / largest).powi(beta);
        share(sampled(found)) / all.iter().map(|x| share(x.1)).sum::<f64>()
    }

    /// The path's class in Heckbert's letters, camera first.
    pub fn class(&self) -> PathClass {
        let n = self.edges();
        let event = |i: usize| {
            let (to_camera, to_light, frame) = self.local_directions(i);
            let v = &self.vertices[i];
            Event::from(self.bsdf(i).event(v.lobe, frame.to_local(to_camera), frame.to_local(to_light)))
        };
        PathClass::new(std::iter::once(Event::Camera).chain((1..n).map(event)).chain([Event::Light]))
    }

    /// c_i: the density of p_i when it is sampled from p_{i−1}, with the probability that the ray passes what it
    /// crosses.
    fn camera_density(&self, i: usize, directions: Directions) -> f64 {
        if i == 0 {
            return f64::from(self.scene.camera.pdf_lens().0);
        }
        let e = self.segment(i - 1, i);
        let omega = match i {
            1 => f64::from(self.scene.camera.pdf(&self.vertices[0].point, e.direction.as_vec3()).0),
            _ => f64::from(self.scatter(i - 1, directions).to_light.0),
        };
        omega * e.cos_j / e.distance_squared * self.passes_and_stops(i - 1, i)
    }

    /// l_i: the density of p_i when it is sampled from p_{i+1}; of p_n, as `strategy` samples it.
    pub(super) fn light_density(&self, i: usize, strategy: Strategy, directions: Directions) -> f64 {
        let n = self.edges();
        let lights = self.scene.lights();
        if i == n {
            let end = &self.vertices[n].point;
            let next_event = strategy.s == 1 && strategy.t >= 2;
            return f64::from(if next_event {
                self.scene.pdf_next_event(end, self.from(n, n - 1)).0
            } else {
                lights.pdf_position(end).0
            });
        }
        let e = self.segment(i + 1, i);
        let omega = if i + 1 == n {
            f64::from(lights.pdf_direction(&self.vertices[n].point, e.direction.as_vec3()).0)
        } else {
            f64::from(self.scatter(i + 1, directions).to_camera.0)
        };
        omega * e.cos_j / e.distance_squared * self.passes_and_stops(i, i)
    }

    /// The probability that a walk along edge `edge` passes what it crosses, and stops at p_i.
    fn passes_and_stops(&self, edge: usize, i: usize) -> f64 {
        // The edge i comes from the light's side.
        let from = if edge == i { i + 1 } else { edge };
        self.visibility[edge] * f64::from(self.from(from, i).alpha)
    }

    /// f̂(p_{i+1}→p_i→p_{i−1}) = α f_s |ω_s·N_s| / |ω·N_g| dω_s/dω for ω = ω_{i+1}, 1/sr; in a delta lobe, whose
    /// coefficients are with respect to dω, without dω_s/dω.
    fn scattering(&self, i: usize) -> DVec3 {
        let v = &self.vertices[i];
        let f = self.scatter(i, Directions::Bsdf).f;
        if f == Rgb::ZERO {
            return DVec3::ZERO; // also within a surface's plane, where the fraction below is none
        }
        let [_, (to_light, jacobian)] = self.shading_directions(i);
        let shading = v.point.shading_normal.as_dvec3().dot(to_light).abs();
        let geometric = v.point.normal.as_dvec3().dot(self.segment(i, i + 1).direction).abs();
        let jacobian = if v.is_delta() { 1.0 } else { jacobian };
        f.as_dvec3() * (shading / geometric * jacobian * f64::from(v.point.alpha))
    }

    /// f_s at p_i with both densities over N_g by the rule `directions`; zero where N_s and N_g disagree on a
    /// direction's side.
    fn scatter(&self, i: usize, directions: Directions) -> Scatter {
        let v = &self.vertices[i];
        let [camera, light] = self.shading_directions(i);
        let (n_s, n_g) = (v.point.shading_normal.as_dvec3(), v.point.normal.as_dvec3());
        let agrees = |j: usize, w_s: DVec3| self.segment(i, j).direction.dot(n_g) * w_s.dot(n_s) > 0.0;
        if !(agrees(i - 1, camera.0) && agrees(i + 1, light.0)) {
            return Scatter::ZERO;
        }
        let (to_camera, to_light, frame) = self.local_directions(i);
        let f = self.bsdf(i).eval_by(directions, v.lobe, frame.to_local(to_camera), frame.to_local(to_light));
        let (to_light, to_camera) = if v.is_delta() { (1.0, camera.1 / light.1) } else { (light.1, camera.1) };
        let scaled = |p: PdfSolidAngle, by: f64| PdfSolidAngle((f64::from(p.0) * by) as f32);
        Scatter { to_light: scaled(f.to_light, to_light), to_camera: scaled(f.to_camera, to_camera), ..f }
    }

    /// ω_s with dω_s/dω of the directions from p_i towards the camera and the light.
    fn shading_directions(&self, i: usize) -> [(DVec3, f64); 2] {
        let p = &self.vertices[i].point;
        let (n_s, n_g) = (p.shading_normal.as_dvec3().normalize(), p.normal.as_dvec3().normalize());
        [i - 1, i + 1].map(|j| tilt::to_shading(n_s, n_g, self.segment(i, j).direction))
    }

    fn local_directions(&self, i: usize) -> (Vec3, Vec3, Frame) {
        let [(to_camera, _), (to_light, _)] = self.shading_directions(i);
        (to_camera.as_vec3(), to_light.as_vec3(), Frame::around(self.vertices[i].point.shading_normal))
    }

    /// The media in front of p_i and behind it, where it bounds a volume.
    pub(super) fn sides(&self, i: usize) -> Option<[MediumId; 2]> {
        self.scene.media().and_then(|media| self.surroundings(media).sides[i])
    }

    /// The BSDF at p_i: at the boundary of a volume with the indices of the media beside it.
    fn bsdf(&self, i: usize) -> Bsdf {
        let p = &self.vertices[i].point;
        let sides = self.scene.media().and_then(|media| Some((media, self.surroundings(media).sides[i]?)));
        let Some((media, sides)) = sides else { return p.bsdf };
        let mut bsdf = self.scene.bsdf_at(p);
        media.settle(&mut bsdf, p.material, sides, self.wavelength);
        bsdf
    }

    /// exp(−σ_a d) of the medium that edge i lies in. A volume that is no body is asked first, by the end nearer the
    /// camera and then by the other.
    fn transmittance(&self, i: usize) -> DVec3 {
        let Some(media) = self.scene.media() else { return DVec3::ONE };
        let (a, b) = (self.from(i + 1, i), self.from(i, i + 1));
        let e = self.segment(i, i + 1);
        let behind = |p: &Point, w: DVec3| {
            p.bsdf.bounds_volume() && media.boundary(p.material) == Boundary::Local && p.normal.as_dvec3().dot(w) < 0.0
        };
        let sigma = if behind(a, e.direction) {
            media.absorption_behind(a.material)
        } else if behind(b, -e.direction) {
            media.absorption_behind(b.material)
        } else {
            media.absorption(self.surroundings(media).edges[i])
        };
        sigma.as_dvec3().map(|s| if s == 0.0 { 1.0 } else { (-s * e.distance).exp() })
    }

    /// The media of all edges and around all boundaries, by crossings from outside to the middle of the edge, and to a
    /// place just before or behind the boundary. Nothing of what walks know of them.
    fn surroundings(&self, media: &Media) -> &Surroundings {
        let around = |place: Vec3, side: Option<Vec3>| media.around(self.scene.geometry(), place, side).medium();
        let edge = |[a, b]: [&Point; 2]| {
            // No body reaches to infinity.
            let infinite = a.place == Place::Infinite || b.place == Place::Infinite;
            let middle = || (0.5 * (a.position.as_dvec3() + b.position.as_dvec3())).as_vec3();
            if infinite { MediumId::EMPTY } else { around(middle(), None) }
        };
        let sides = |v: &Vertex| {
            let p = &v.point;
            let bounds = p.primitive != PrimitiveId::NONE && media.boundary(p.material) != Boundary::Nothing;
            bounds.then(|| {
                [p.normal, -p.normal].map(|n| around(offset_origin(p.position, p.normal, p.error, n), Some(n)))
            })
        };
        self.surroundings.get_or_init(|| Surroundings {
            edges: (0..self.edges()).map(|i| edge([self.from(i + 1, i), self.from(i, i + 1)])).collect(),
            sides: self.vertices.iter().map(sides).collect(),
        })
    }

    /// p_j as the end of an edge from p_i: where a path has merged, the light's side has a point of its own.
    fn from(&self, i: usize, j: usize) -> &Point {
        match &self.merged {
            Some((at, q)) if *at == j && i > j => q,
            _ => &self.vertices[j].point,
        }
    }

    fn segment(&self, i: usize, j: usize) -> Segment {
        let (a, b) = (self.from(j, i), self.from(i, j));
        let (pa, pb) = (a.position.as_dvec3(), b.position.as_dvec3());
        let distance = match (a.place, b.place) {
            (Place::Infinite, _) | (_, Place::Infinite) => f64::INFINITY,
            _ => pa.distance(pb),
        };
        let (direction, distance_squared) = match (a.place, b.place) {
            (Place::Film, _) => (a.normal.as_dvec3().normalize(), 1.0),
            (_, Place::Film) => (-b.normal.as_dvec3().normalize(), 1.0),
            (_, Place::Infinite) => (pb.normalize(), 1.0),
            (Place::Infinite, _) => (-pa.normalize(), 1.0),
            _ => ((pb - pa).normalize(), pa.distance_squared(pb)),
        };
        let cos = |p: &Point| match p.place {
            Place::Surface => p.normal.as_dvec3().dot(direction).abs(),
            Place::Degenerate | Place::Infinite | Place::Film => 1.0,
        };
        Segment { direction, distance_squared, cos_i: cos(a), cos_j: cos(b), distance }
    }
}
