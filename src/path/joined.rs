//! A full path as the fast form sees it: a camera prefix, a light prefix, and the joint between them.

use std::cmp::Ordering;

use super::{
    Beginning, Densities, Edge, Heuristic, LightVertex, Meeting, Path, RivalSum, Rivals, Step, Strategy, Subpath, Tail,
    Technique, Techniques, Vertex, absorption::connecting_transmittance, joint::Joint, mis_weight,
};
use crate::{
    lanes::One,
    math::{Frame, Rgb},
    sampling::PdfArea,
    scene::{
        Scene,
        bsdf::ScatterEvent,
        camera::Raster,
        point::{Place, Point},
        tilt::Tilt,
        wavelength::Wavelength,
    },
};

/// A path that strategy (s,t) has found, or a merge: a view, valid while both subpaths are.
#[derive(Clone, Copy, Debug)]
pub struct JoinedPath<'a> {
    scene: &'a Scene,
    camera: &'a [Step],
    light: &'a [Step],
    /// Of a merge: the light subpath's vertex beside the camera's last.
    beside: Option<&'a Step>,
    joint: Joint,
    raster: Raster,
    technique: Technique,
    wavelength: Option<Wavelength>,
}

impl<'a> JoinedPath<'a> {
    /// s = 0: the camera subpath's last vertex lies on a light. `None` if it emits nothing towards its predecessor.
    #[inline(always)]
    pub fn hit(scene: &'a Scene, camera: &'a [Step], raster: Raster) -> Option<Self> {
        let [.., before, end] = camera else { return None };
        let p = &end.vertex.point;
        p.light?;
        let joint = Joint::hit(scene, &before.vertex.point, end)?;
        let technique = Technique::Bidirectional(Strategy { s: 0, t: camera.len() as u32 });
        Some(Self { scene, camera, light: &[], beside: None, joint, raster, technique, wavelength: None })
    }

    /// s ≥ 1, t ≥ 1: connects the last vertices of two prefixes. `light` is a prefix of a light subpath, whose
    /// [`Subpath::next_event_ratio`] is passed along, or a single next-event vertex with the ratio of its two
    /// densities. `raster` is the camera subpath's; t = 1 finds its own. `None` where nothing passes, before any ray is
    /// traced.
    #[inline(always)]
    pub fn connect(
        scene: &'a Scene,
        camera: &'a [Step],
        light: &'a [Step],
        next_event_ratio: f32,
        raster: Raster,
    ) -> Option<Self> {
        let (z, y) = (camera.last()?, light.last()?);
        let unseen = |id| !scene.lights().is_hittable(id);
        if camera.len() == 1 && light.len() == 1 && y.vertex.point.light.is_some_and(unseen) {
            return None; // (1,1) does not show points and suns, which have no extent on the image
        }
        let strategy = Strategy { s: light.len() as u32, t: camera.len() as u32 };
        let mut joint = Joint::connect(scene, strategy, [z, y], next_event_ratio)?;
        if scene.absorbing_media().is_some() {
            let (z, y) = (&z.vertex.point, &y.vertex.point);
            joint.value *= connecting_transmittance(scene, z, &Edge::between(z, y), y);
        }
        let raster = joint.raster.map_or(raster, |raster| Raster(raster.into()));
        let technique = Technique::Bidirectional(strategy);
        Some(Self { scene, camera, light, beside: None, joint, raster, technique, wavelength: None })
    }

    /// The path at the wavelength of its subpaths.
    #[must_use]
    #[inline(always)]
    pub fn at_wavelength(self, wavelength: Option<Wavelength>) -> Self {
        Self { wavelength, ..self }
    }

    /// What found it.
    #[inline]
    pub fn technique(&self) -> Technique {
        self.technique
    }

    /// (s,t): the vertices from the light and from the camera. Area sampling's count as the camera's; see
    /// [`JoinedPath::technique`].
    #[inline(always)]
    pub fn strategy(&self) -> Strategy {
        Strategy { s: self.light.len() as u32, t: self.camera.len() as u32 }
    }

    /// Where on the image the path arrives.
    #[inline]
    pub fn raster(&self) -> Raster {
        self.raster
    }

    /// F/p without h_j, over roulette's survival probability, times c(λ)/p(λ) where the path is dispersed: one sample's
    /// unweighted estimate. With V = 1 on the connecting edge before [`JoinedPath::seen`]: what the path could
    /// contribute at most.
    #[inline(always)]
    pub fn contribution(&self) -> Rgb {
        self.colored(self.spectral_contribution())
    }

    /// A part of the contribution at the path's wavelength in the colour that stands for it: times c(λ)/p(λ) if a
    /// vertex between the ends lies on a dispersive interface. Once, however many do.
    #[inline(always)]
    pub fn colored(&self, value: Rgb) -> Rgb {
        match self.wavelength {
            Some(wavelength) if self.is_dispersed() => value * wavelength.response(),
            _ => value,
        }
    }

    #[inline(never)]
    fn is_dispersed(&self) -> bool {
        let media = self.scene.dispersing_media();
        media.is_some_and(|media| (1..self.edges()).any(|i| media.disperse_at(self.point(i))))
    }

    /// [`Self::contribution`] at the path's wavelength, whose colour is not in it: in no channel negative.
    #[inline(always)]
    pub(crate) fn spectral_contribution(&self) -> Rgb {
        if self.beside.is_some() {
            return self.joint.value;
        }
        self.joint.contribution(self.camera[self.camera.len() - 1].beta, self.light.last().map(|y| y.beta))
    }

    /// w of the technique that found the path, summed over the whole table. Area sampling shares with nobody.
    pub fn mis_weight(&self, techniques: &Techniques, heuristic: Heuristic) -> f32 {
        self.weight(techniques, heuristic, None)
    }

    /// The same; by the running sums that the subpaths have, where their walks [sum](Subpath::summing) these rivals.
    #[inline(always)]
    pub fn weight(&self, techniques: &Techniques, heuristic: Heuristic, rivals: Option<&Rivals>) -> f32 {
        let (strategy, rivals) = match (self.technique, rivals) {
            (Technique::Bidirectional(strategy), Some(rivals)) => (strategy, rivals),
            (Technique::Merged(_), Some(rivals)) => return self.merged_weight(techniques, rivals),
            _ => return self.whole_weight(techniques, heuristic),
        };
        let before = |steps: &[Step]| if let [.., last, _, _] = steps { last.rivals } else { RivalSum::ZERO };
        let sums = [before(self.camera), before(self.light)];
        if techniques.radius().is_some() {
            rivals.weight_among_merges(self, strategy, techniques, sums)
        } else {
            rivals.weight(self, strategy, techniques, sums)
        }
    }

    /// Out of line, since no integrator that a person can choose needs it for long paths.
    #[inline(never)]
    fn whole_weight(&self, techniques: &Techniques, heuristic: Heuristic) -> f32 {
        mis_weight(self, self.technique, techniques, heuristic)
    }

    /// The path with V of its connecting edge, which costs a ray; `None` if nothing passes. All other edges were found
    /// by rays, and for s = 0 there is no connection: the path itself.
    ///
    /// V is in the densities with which the other strategies walk along this edge, so this comes before any weight.
    #[inline(always)]
    pub fn seen(self) -> Option<Self> {
        let (None, Some(z), Some(y)) = (self.beside, self.camera.last(), self.light.last()) else { return Some(self) };
        let (scene, lens, end) = (self.scene, &z.vertex.point, &y.vertex.point);
        let visibility = if self.camera.len() == 1 && scene.culls_back_faces() {
            scene.visible_from_camera(lens, end)
        } else {
            scene.visible(lens, end)
        };
        (visibility > 0.0).then(|| self.seen_through(visibility))
    }

    /// The path as if V(p_{t−1}↔p_t) were `visibility`.
    #[inline(always)]
    fn seen_through(mut self, visibility: f32) -> Self {
        if visibility != 1.0 {
            let joint = &mut self.joint;
            joint.visibility = visibility;
            joint.camera_density[0].0 *= visibility;
            joint.light_density[0].0 *= visibility;
        }
        self
    }

    /// Whether it is the background as the camera sees it: a path of one edge to an infinite point.
    #[inline]
    pub fn shows_background(&self) -> bool {
        self.edges() == 1 && self.step(1).vertex.point.place == Place::Infinite
    }

    /// The product of roulette's survival probabilities in [`JoinedPath::contribution`].
    pub fn survival(&self) -> f32 {
        self.camera[self.camera.len() - 1].survival * self.beside.or(self.light.last()).map_or(1.0, |y| y.survival)
    }

    /// The vertex p_i with its role in this path: at the joint and at the ends the lobe is continuous.
    pub fn vertex(&self, i: u32) -> Vertex {
        let step = self.step(i);
        let scattered = 0 < i && i < self.edges() && !self.is_at_joint(i);
        if scattered { step.vertex } else { Vertex::new(step.vertex.point) }
    }

    /// Where p_i is.
    #[inline]
    pub fn point(&self, i: u32) -> &'a Point {
        &self.step(i).vertex.point
    }

    /// p_j as the end of the edge from p_i: where a path has merged, the light's side has a point of its own.
    #[inline]
    fn end(&self, i: u32, j: u32) -> &'a Point {
        match self.beside {
            Some(q) if j + 1 == self.camera.len() as u32 && i > j => &q.vertex.point,
            _ => self.point(j),
        }
    }

    /// Whether the light passes to the other side of the surface at p_i, 0 < i < n.
    #[inline]
    pub fn transmits(&self, i: u32) -> bool {
        let n = self.point(i).normal.as_dvec3();
        let side = |j: u32| {
            let (p, q) = (self.end(j, i), self.end(i, j));
            // The difference in f64: a grazing step of a rounding's size has a side, too.
            let w = match q.place {
                Place::Infinite | Place::Film => Edge::between(p, q).direction.as_dvec3(),
                Place::Surface | Place::Degenerate => q.position.as_dvec3() - p.position.as_dvec3(),
            };
            n.dot(w) > 0.0
        };
        side(i - 1) != side(i + 1)
    }

    /// What happens to the light at p_i, 0 < i < n: the letter of the path's class.
    #[inline]
    pub fn event(&self, i: u32) -> ScatterEvent {
        let v = self.vertex(i);
        if v.is_delta() {
            return ScatterEvent::Specular;
        }
        let (frame, tilt) = (Frame::around(v.point.shading_normal), Tilt::at(&v.point));
        let towards = |j: u32| {
            let w = Edge::between(self.end(j, i), self.end(i, j)).direction;
            frame.to_local(if v.point.is_flat() { w } else { tilt.to_shading(w).direction })
        };
        v.point.bsdf.event(v.lobe, towards(i - 1), towards(i + 1))
    }

    /// V(p_i↔p_{i+1}), as far as it is known: see [`JoinedPath::seen`].
    pub fn visibility(&self, i: u32) -> f32 {
        let t = self.camera.len() as u32;
        match (i + 1).cmp(&t) {
            Ordering::Less => self.step(i + 1).back.visibility,
            Ordering::Equal => self.joint.visibility,
            Ordering::Greater => self.step(i).back.visibility,
        }
    }

    /// The path by its definition, for everything that may be slow: oracles, path classes, diagnostics.
    pub fn to_path(&self) -> Path<'a> {
        let visibility = (0..self.edges()).map(|i| f64::from(self.visibility(i))).collect();
        let path = Path::new(self.scene, (0..=self.edges()).map(|i| self.vertex(i)).collect());
        let path = path.with_visibility(visibility).arriving_at(self.raster).at_wavelength(self.wavelength);
        match self.beside {
            Some(q) => path.merged_at(self.camera.len() - 1, q.vertex.point),
            None => path,
        }
    }

    /// The camera prefix p_0 … p_{t−1}.
    pub fn camera(&self) -> &'a [Step] {
        self.camera
    }

    /// The path with another camera prefix of the same length joined to the same light prefix, as visible as before:
    /// for oracles that plant mistakes. `None` if nothing passes then, and of a merge.
    pub fn with_camera<'b>(&self, camera: &'b [Step]) -> Option<JoinedPath<'b>>
    where
        'a: 'b,
    {
        let path = if self.beside.is_some() {
            None
        } else if self.light.is_empty() {
            JoinedPath::hit(self.scene, camera, self.raster)
        } else {
            JoinedPath::connect(self.scene, camera, self.light, self.joint.next_event_ratio, self.raster)
                .map(|path| path.seen_through(self.joint.visibility))
        };
        path.map(|path| path.at_wavelength(self.wavelength))
    }

    #[inline(always)]
    fn is_at_joint(&self, i: u32) -> bool {
        let t = self.camera.len() as u32;
        !self.light.is_empty() && (i + 1 == t || (i == t && self.beside.is_none()))
    }

    #[inline(always)]
    fn step(&self, i: u32) -> &'a Step {
        let t = self.camera.len();
        let i = i as usize;
        if i < t { &self.camera[i] } else { &self.light[self.light.len() - 1 - (i - t)] }
    }
}

impl Densities for JoinedPath<'_> {
    #[inline(always)]
    fn lanes(&self) -> One {
        One
    }

    #[inline(always)]
    fn edges(&self) -> u32 {
        self.strategy().edges()
    }

    #[inline(always)]
    fn camera_density(&self, i: u32) -> PdfArea {
        let t = self.camera.len() as u32;
        if i < t {
            self.camera[i as usize].pdf_fwd
        } else if i - t < 2 {
            self.joint.camera_density[(i - t) as usize]
        } else {
            self.step(i).pdf_rev
        }
    }

    #[inline(always)]
    fn light_density(&self, i: u32) -> PdfArea {
        let t = self.camera.len() as u32;
        if i >= t {
            self.emission_density(i)
        } else if t - 1 - i < 2 {
            self.joint.light_density[(t - 1 - i) as usize]
        } else {
            self.camera[i as usize].pdf_rev
        }
    }

    #[inline(always)]
    fn next_event_ratio(&self) -> f32 {
        self.joint.next_event_ratio
    }

    #[inline(always)]
    fn is_delta(&self, i: u32) -> bool {
        0 < i && i < self.edges() && !self.is_at_joint(i) && self.step(i).vertex.is_delta()
    }

    #[inline(always)]
    fn light_is_hittable(&self) -> bool {
        self.step(self.edges()).vertex.point.light.is_some_and(|id| self.scene.lights().is_hittable(id))
    }

    #[inline(always)]
    fn raster(&self) -> [f32; 2] {
        self.raster.0.to_array()
    }

    #[inline(always)]
    fn ends_are_directions(&self) -> bool {
        let place = |i: u32| self.step(i).vertex.point.place;
        place(0) == Place::Film && place(self.edges()) == Place::Infinite
    }
}

impl JoinedPath<'_> {
    /// `pdf_fwd` of a light vertex, except that a next-event vertex stands in the arrays with its emission density.
    #[inline(always)]
    fn emission_density(&self, i: u32) -> PdfArea {
        let pdf = self.step(i).pdf_fwd;
        let drawn_anew = self.light.len() == 1 && self.camera.len() >= 2 && self.beside.is_none();
        if drawn_anew { PdfArea(pdf.0 / self.joint.next_event_ratio) } else { pdf }
    }
}

impl<'a> JoinedPath<'a> {
    /// s = 1, t ≥ 2: connects a camera prefix to a next-event vertex with its next-event density.
    #[inline(always)]
    pub fn next_event(scene: &'a Scene, camera: &'a [Step], light: &'a Step, raster: Raster) -> Option<Self> {
        let emission = scene.lights().pdf_position(&light.vertex.point);
        Self::connect(scene, camera, std::slice::from_ref(light), light.pdf_fwd.0 / emission.0, raster)
    }

    /// s ≥ 2, or t = 1: connects a camera prefix and the first `s` vertices of a light subpath.
    #[inline(always)]
    pub fn inner(scene: &'a Scene, camera: &'a [Step], light: &'a Subpath, s: usize, raster: Raster) -> Option<Self> {
        let prefix = &light.steps()[..s];
        // With s = 1 the path's p_{n−1} is not the light subpath's; (1,1) has no next-event rival to weigh.
        Self::connect(scene, camera, prefix, light.next_event_ratio(), raster)
    }
}

impl<'a> JoinedPath<'a> {
    /// A merge: the last vertex of a camera prefix meets that of the light subpath `prefix`, which has this beginning.
    ///
    /// # Panics
    /// If the light subpath has fewer than two vertices.
    pub fn merged(
        scene: &'a Scene,
        camera: &'a [Step],
        prefix: &'a [Step],
        beginning: Beginning,
        meeting: &Meeting,
        raster: Raster,
    ) -> Self {
        let [light @ .., beside] = prefix else { panic!("a light subpath that merges has an edge") };
        assert!(!light.is_empty(), "a light subpath that merges has an edge");
        let before = light.len().checked_sub(2).map_or(PdfArea::ZERO, |k| light[k].pdf_rev);
        let joint = Joint {
            value: meeting.contribution,
            visibility: beside.back.visibility,
            camera_density: [meeting.camera_density, before],
            light_density: meeting.light_density,
            next_event_ratio: beginning.next_event_ratio,
            raster: None,
        };
        let technique = Technique::Merged(meeting.strategy);
        Self { scene, camera, light, beside: Some(beside), joint, raster, technique, wavelength: None }
    }

    /// By the light vertex as a pass keeps it, for who looks at the path: a pass weighs without one.
    #[inline(never)]
    fn merged_weight(&self, techniques: &Techniques, rivals: &Rivals) -> f32 {
        let prefix: Vec<_> = self.light.iter().chain(self.beside).copied().collect();
        let beginning =
            Beginning { hittable: f32::from(self.light_is_hittable()), next_event_ratio: self.joint.next_event_ratio };
        let x = &self.camera[self.camera.len() - 1];
        let kept = LightVertex::of_prefix(&prefix, beginning, rivals, 0);
        let met = kept.and_then(|kept| Some((kept, kept.met_by(x, self.strategy(), techniques)?)));
        let camera = (&Tail::of(self.camera), self.raster.0.to_array());
        met.map_or(0.0, |(kept, meeting)| kept.weight(camera, &meeting, techniques, rivals))
    }

    /// A path that area sampling drew, with its V: F/p straight from the definition. `steps` is storage for its
    /// vertices. `None` if it contributes nothing. It has the wavelength that `path` has.
    pub fn by_areas(scene: &'a Scene, path: &Path<'_>, steps: &'a mut Vec<Step>, raster: Raster) -> Option<Self> {
        let value = Rgb::from(path.spectral_contribution() / path.pdf_area());
        steps.clear();
        steps.extend(path.vertices().iter().map(|v| Step { beta: Rgb::ONE, ..Step::first(v.point, PdfArea(1.0)) }));
        for (i, step) in steps.iter_mut().enumerate() {
            step.vertex.point.media = path.sides(i).unwrap_or(step.vertex.point.media);
        }
        for (step, v) in steps.iter_mut().skip(1).zip(path.visibility()) {
            step.back.visibility = *v as f32;
        }
        let nothing = [PdfArea::ZERO; 2];
        let joint = Joint {
            value,
            visibility: 1.0,
            camera_density: nothing,
            light_density: nothing,
            next_event_ratio: 1.0,
            raster: None,
        };
        let technique = Technique::Area;
        (value != Rgb::ZERO).then_some(Self {
            scene,
            camera: steps,
            light: &[],
            beside: None,
            joint,
            raster,
            technique,
            wavelength: path.wavelength(),
        })
    }
}
