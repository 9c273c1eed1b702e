//! Strategies and the table that says how often each is used: an integrator is such a table.

use std::{f32::consts::PI, ops::RangeInclusive, sync::Arc};

use super::{LightPaths, MeetingPlaces, VarianceFactors};
use crate::scene::{bsdf::Directions, camera::Sensor};

/// Veach's (s,t): `s` vertices sampled from the light side, `t` from the camera side, then connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Strategy {
    /// Vertices from the light side: p_t … p_n.
    pub s: u32,
    /// Vertices from the camera side: p_0 … p_{t−1}.
    pub t: u32,
}

impl Strategy {
    /// The length of its paths in edges, n = s + t − 1.
    pub fn edges(self) -> u32 {
        self.s + self.t - 1
    }
}

impl std::fmt::Display for Strategy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({},{})", self.s, self.t)
    }
}

/// A way to sample whole paths: what a table counts, and what a path was found by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Technique {
    /// (s,t): walks from both sides, connected.
    Bidirectional(Strategy),
    /// The camera subpath of (s,t), whose last vertex a light subpath of s + 1 vertices has reached as well, within the
    /// [radius](Techniques::radius) of merges.
    Merged(Strategy),
    /// Every vertex on its own, uniform over the area of the surfaces (p_n: of the emitting ones).
    Area,
}

impl std::fmt::Display for Technique {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bidirectional(strategy) => strategy.fmt(f),
            Self::Merged(strategy) => write!(f, "merged {strategy}"),
            Self::Area => f.write_str("area"),
        }
    }
}

/// The table n_{s,t}: how many samples each strategy contributes to one pass over the image.
///
/// A pass has N_c camera subpaths, one per padded pixel, and N_l light subpaths that splat. An entry is a multiplicity
/// m_{s,t} ≥ 0 per subpath: n_{s,t≥2} = N_c·m_{s,t} and n_{s,1} = N_l·m_{s,1}. Zero leaves a strategy out; m_{1,t} = N
/// takes N next-event samples a vertex. A camera subpath that splits into N at its first surface counts N times beyond
/// it. Whatever is no (s,t) (area sampling, merging) has a field of its own, and merging is one more term of the
/// weight's sum at each t.
#[derive(Clone, Debug)]
pub struct Techniques {
    camera_subpaths: u32,
    light_subpaths: u32,
    max_depth: u32,
    /// m_{s,t} at `s·(max_depth + 2) + t`.
    multiplicity: Vec<u32>,
    /// n_{s,t} in the same order.
    count: Vec<f32>,
    /// For each length n the t of the strategies in the table, from the first to the last; empty where there is none.
    range: Vec<RangeInclusive<u32>>,
    directions: Directions,
    /// Into how many a camera subpath splits at p_1; strategies with t ≥ 3 have that many samples.
    splits: u32,
    /// Light subpaths that go with a pixel; strategies with s ≥ 2 or t = 1 have that many samples.
    light_paths: LightPaths,
    /// Instead, of the strategies with s ≥ 2 and t ≥ 2.
    shared: Option<SharedLightVertices>,
    /// Area samples per light subpath for each length of paths.
    area: u32,
    /// The radius within which a camera subpath meets the light subpaths of the pass, if it does; m.
    radius: Option<f32>,
    /// At which vertices.
    meeting_places: MeetingPlaces,
    /// Which of the light subpaths, those that go with so many samples.
    merging_light_paths: LightPaths,
    /// What weights know of the noise of direct light, if anything.
    variance_factors: Option<Arc<VarianceFactors>>,
    light_vertices: LightVertices,
    camera_vertices: u32,
}

impl Techniques {
    /// A table for paths of at most `max_depth` edges, with m_{s,t} given by `multiplicity` for s + t ≤ `max_depth` +
    /// 1. Strategies without an edge or without a camera vertex are left out whatever it says.
    pub fn new(sensor: Sensor, max_depth: u32, multiplicity: impl Fn(Strategy) -> u32) -> Self {
        let side = max_depth + 2;
        let entry = |i: u32| {
            let strategy = Strategy { s: i / side, t: i % side };
            let exists =
                strategy.t >= 1 && (2..=side).contains(&(strategy.s + strategy.t)) && strategy.s + strategy.t < side;
            if exists { multiplicity(strategy) } else { 0 }
        };
        let empty = Self {
            camera_subpaths: sensor.padded_pixels(),
            light_subpaths: sensor.pixels(),
            max_depth,
            multiplicity: Vec::new(),
            count: Vec::new(),
            range: Vec::new(),
            directions: Directions::Bsdf,
            splits: 1,
            light_paths: LightPaths::ONE,
            shared: None,
            area: 0,
            radius: None,
            meeting_places: MeetingPlaces::Everywhere,
            merging_light_paths: LightPaths::ONE,
            variance_factors: None,
            light_vertices: LightVertices::default(),
            camera_vertices: 0,
        };
        empty.with_entries((0..side * side).map(entry).collect())
    }

    /// The table of area sampling alone: N_l samples of every length up to `max_depth` edges.
    pub fn by_area(sensor: Sensor, max_depth: u32) -> Self {
        Self { area: 1, ..Self::new(sensor, max_depth, |_| 0) }
    }

    fn with_entries(&self, multiplicity: Vec<u32>) -> Self {
        let side = self.max_depth + 2;
        let split = self.splits as f32;
        let connections = match self.shared {
            None => self.light_paths.per_sample(),
            Some(SharedLightVertices { each, of_a_path }) => each as f32 / of_a_path,
        };
        let subpaths = |s: u32, t: u32| {
            let from_light = match (s, t) {
                (_, 1) => self.light_paths.per_sample(),
                (0 | 1, _) => 1.0,
                _ => connections,
            };
            from_light
                * match t {
                    1 => self.light_subpaths as f32,
                    2 => self.camera_subpaths as f32,
                    _ => self.camera_subpaths as f32 * split,
                }
        };
        let count = (0..).zip(&multiplicity).map(|(i, m)| *m as f32 * subpaths(i / side, i % side)).collect();
        let variance_factors = self.variance_factors.clone();
        let mut table = Self { multiplicity, count, range: Vec::new(), variance_factors, ..*self };
        let of_length = |n: u32| {
            let mut t = (1..=n + 1).filter(|t| table.multiplicity(Strategy { s: n + 1 - t, t: *t }) > 0);
            let first = t.next();
            first.map_or(RangeInclusive::new(1, 0), |first| first..=t.next_back().unwrap_or(first))
        };
        table.range = (0..=self.max_depth).map(of_length).collect();
        let longest = |wanted: fn(&Strategy) -> bool, vertices: fn(Strategy) -> u32| {
            table.strategies().filter(wanted).map(vertices).max().unwrap_or(0)
        };
        // What merges has two vertices from either side, of which one is the same.
        let merged = if table.radius.is_some() { table.max_depth } else { 0 };
        let light_vertices = LightVertices {
            connected: longest(|x| x.s >= 2 && x.t >= 2, |x| x.s),
            splatted: longest(|x| x.t == 1, |x| x.s),
            merged,
        };
        let camera_vertices = longest(|x| x.t >= 2, |x| x.t).max(merged);
        Self { light_vertices, camera_vertices, ..table }
    }

    /// The same table with every entry but one set to zero.
    #[must_use]
    pub fn only(&self, strategy: Strategy) -> Self {
        let side = self.max_depth + 2;
        let multiplicity = (0..side * side).map(|i| {
            let kept = Strategy { s: i / side, t: i % side } == strategy;
            if kept { self.multiplicity[i as usize] } else { 0 }
        });
        Self { area: 0, radius: None, ..self.clone() }.with_entries(multiplicity.collect())
    }

    /// The same table with merges within `radius`, in metres: every vertex of a camera subpath from p_1 on meets the
    /// vertices of all N_l light subpaths of a pass, or its own table's if it is `None`.
    #[must_use]
    pub fn merging_within(&self, radius: Option<f32>) -> Self {
        Self { radius, ..self.clone() }.with_entries(self.multiplicity.clone())
    }

    /// The same table with merges at such vertices alone, and with so many of the light subpaths, if there are any
    /// merges.
    ///
    /// # Panics
    /// If it would be more than one for each.
    #[must_use]
    pub fn merging_at(self, meeting_places: MeetingPlaces, merging_light_paths: LightPaths) -> Self {
        assert!(merging_light_paths.most() == 1, "a light subpath merges once");
        Self { meeting_places, merging_light_paths, ..self }
    }

    /// Which of the light subpaths merge: those that go with so many samples.
    #[inline]
    pub fn merging_light_paths(&self) -> LightPaths {
        self.merging_light_paths
    }

    /// How many light subpaths that merge go with a sample in the mean, if any do.
    #[inline]
    pub fn merging_per_sample(&self) -> f32 {
        self.light_paths.per_sample() * self.merging_light_paths.per_sample()
    }

    /// At which vertices subpaths merge, if they do.
    #[inline]
    pub fn meeting_places(&self) -> MeetingPlaces {
        self.meeting_places
    }

    /// The same table with weights that know these factors.
    #[must_use]
    pub fn with_variance_factors(self, factors: Arc<VarianceFactors>) -> Self {
        Self { variance_factors: Some(factors), ..self }
    }

    /// The same table with weights that compare densities and counts alone.
    #[must_use]
    pub fn with_plain_weights(self) -> Self {
        Self { variance_factors: None, ..self }
    }

    /// What weights know of the noise of direct light, if anything.
    #[inline]
    pub fn variance_factors(&self) -> Option<&VarianceFactors> {
        self.variance_factors.as_deref()
    }

    /// The radius of merges, if there are any; m.
    #[inline]
    pub fn radius(&self) -> Option<f32> {
        self.radius
    }

    /// πr², the area of what a vertex meets, in m²; zero where nothing merges.
    #[inline]
    pub fn merging_area(&self) -> f32 {
        self.radius.map_or(0.0, |r| PI * r * r)
    }

    /// How many pairs of subpaths of a pass may merge at p_{t−1}: N_c · splits · N_l, with N_l the light subpaths that
    /// merge; zero where nothing does.
    #[inline]
    pub fn merging_pairs(&self, t: u32) -> f32 {
        if self.radius.is_none() || t < self.meeting_places.fewest_camera_vertices() {
            return 0.0;
        }
        let splits = if t == 2 { 1 } else { self.splits };
        (self.camera_subpaths as f32 * splits as f32) * (self.light_subpaths as f32 * self.merging_per_sample())
    }

    /// What the density of (s,t) is to be multiplied by, beside l_{t−1}, for that of the merge at p_{t−1} times its
    /// count: N_c · splits · N_l · πr².
    #[inline]
    pub fn merging_factor(&self, t: u32) -> f32 {
        self.merging_pairs(t) * self.merging_area()
    }

    /// The same table with the rule `directions` for the walks, if it is one of directional sampling alone, s = 0:
    /// there are no connections then, and nothing in the fast form needs the rule but the camera's walk. Any other
    /// table stays as it is.
    #[must_use]
    pub fn with_directions(&self, directions: Directions) -> Self {
        let is_directional = self.area == 0 && self.strategies().all(|x| x.s == 0);
        Self { directions: if is_directional { directions } else { self.directions }, ..self.clone() }
    }

    /// The same table with `samples` next-event samples at a vertex where it takes one: m_{1,t≥2} times as many, which
    /// the weights know of.
    #[must_use]
    pub fn with_light_samples(&self, samples: u32) -> Self {
        let side = self.max_depth + 2;
        let times = |i: u32| if i / side == 1 && i % side >= 2 { samples } else { 1 };
        self.with_entries((0..).zip(&self.multiplicity).map(|(i, m)| m * times(i)).collect())
    }

    /// The same table with camera subpaths that split into `splits` at their first surface (lecture, *splitting*), each
    /// with a direction and a rest of its own: n_{s,t≥3} are that many times as large.
    #[must_use]
    pub fn with_splits(&self, splits: u32) -> Self {
        Self { splits, ..self.clone() }.with_entries(self.multiplicity.clone())
    }

    /// The same table with so many light subpaths for each pixel: n_{s,1} and n_{s≥2,t} are that many times as large,
    /// and so is the number of pairs that may merge.
    #[must_use]
    pub fn with_light_paths(&self, light_paths: LightPaths) -> Self {
        Self { light_paths, ..self.clone() }.with_entries(self.multiplicity.clone())
    }

    /// The same table with connections from each camera vertex to `each` light vertices, chosen uniformly among all
    /// that many light subpaths have, `of_a_path` each in the mean (Davidovič et al. 2014, *Progressive Light Transport
    /// Simulation on the GPU*): n_{s≥2,t≥2} are `each`/`of_a_path` times N_c, however many light subpaths there are.
    #[must_use]
    pub fn with_light_vertices(&self, each: u32, of_a_path: f32) -> Self {
        Self { shared: Some(SharedLightVertices { each, of_a_path }), ..self.clone() }
            .with_entries(self.multiplicity.clone())
    }

    /// How camera vertices are connected to light vertices that are not their own pixel's, if they are.
    #[inline]
    pub fn shared_light_vertices(&self) -> Option<SharedLightVertices> {
        self.shared
    }

    /// How many light subpaths go with a pixel.
    #[inline]
    pub fn light_paths(&self) -> LightPaths {
        self.light_paths
    }

    /// Into how many a camera subpath splits at p_1.
    #[inline]
    pub fn splits(&self) -> u32 {
        self.splits
    }

    /// m_{s,t}, zero outside the table: of each part of a split camera subpath, and of each of a pixel's light
    /// subpaths.
    #[inline]
    pub fn multiplicity(&self, strategy: Strategy) -> u32 {
        let side = self.max_depth + 2;
        if strategy.s >= side || strategy.t >= side {
            0
        } else {
            self.multiplicity[(strategy.s * side + strategy.t) as usize]
        }
    }

    /// n_{s,t}.
    #[inline]
    pub fn count(&self, strategy: Strategy) -> f32 {
        let side = self.max_depth + 2;
        if strategy.s >= side || strategy.t >= side {
            0.0
        } else {
            self.count[(strategy.s * side + strategy.t) as usize]
        }
    }

    /// N_c, what the entries with t ≥ 2 count in multiples of.
    #[inline]
    pub fn camera_subpaths(&self) -> f32 {
        self.camera_subpaths as f32
    }

    /// The t of the table's strategies for paths of `n` edges, from the first to the last (some between them may be
    /// missing); empty where there is none.
    #[inline]
    pub fn range(&self, n: u32) -> RangeInclusive<u32> {
        self.range.get(n as usize).cloned().unwrap_or(RangeInclusive::new(1, 0))
    }

    /// n of any technique: n_{s,t}, the pairs of subpaths that may merge, or the samples that area sampling takes of
    /// each length.
    #[inline]
    pub fn samples(&self, technique: Technique) -> f32 {
        match technique {
            Technique::Bidirectional(strategy) => self.count(strategy),
            Technique::Merged(strategy) => self.merging_pairs(strategy.t),
            Technique::Area => self.area as f32 * self.light_subpaths as f32,
        }
    }

    /// How many area samples of each length go with a light subpath.
    pub fn area(&self) -> u32 {
        self.area
    }

    /// How the walks sample directions.
    #[inline]
    pub fn directions(&self) -> Directions {
        self.directions
    }

    /// The longest path in edges.
    pub fn max_depth(&self) -> u32 {
        self.max_depth
    }

    /// Every strategy with a positive entry.
    pub fn strategies(&self) -> impl Iterator<Item = Strategy> {
        let side = self.max_depth + 2;
        (0..side * side)
            .filter(|i| self.multiplicity[*i as usize] > 0)
            .map(move |i| Strategy { s: i / side, t: i % side })
    }

    /// Every strategy beside which something merges: see [`Technique::Merged`].
    pub fn merges(&self) -> impl Iterator<Item = Strategy> {
        let most = if self.radius.is_some() { self.max_depth } else { 0 };
        let places = self.meeting_places;
        let [fewest_s, fewest_t] = [places.fewest_light_vertices() - 1, places.fewest_camera_vertices()];
        (fewest_s..most).flat_map(move |s| (fewest_t..=most + 1 - s).map(move |t| Strategy { s, t }))
    }

    /// How many vertices a light subpath needs for connections to camera subpaths (s ≥ 2, t ≥ 2), for splats (t = 1)
    /// and for merges.
    #[inline]
    pub fn light_vertices(&self) -> LightVertices {
        self.light_vertices
    }

    /// How many vertices a camera subpath needs: the largest t of any strategy with t ≥ 2 and of merges, zero if there
    /// is none.
    #[inline]
    pub fn camera_vertices(&self) -> u32 {
        self.camera_vertices
    }
}

/// See [`Techniques::with_light_vertices`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedLightVertices {
    /// Connections of a camera vertex.
    pub each: u32,
    /// Light vertices that can be connected to, of one light subpath in the mean.
    pub of_a_path: f32,
}

/// See [`Techniques::light_vertices`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightVertices {
    /// The largest s of a strategy with s ≥ 2 and t ≥ 2, or zero.
    pub connected: u32,
    /// The largest s of a strategy with t = 1, or zero.
    pub splatted: u32,
    /// The most vertices of a light subpath that merges, the common one counted, or zero.
    pub merged: u32,
}

impl LightVertices {
    /// The most that any use asks for.
    pub fn most(self) -> u32 {
        self.connected.max(self.splatted).max(self.merged)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSOR: Sensor = Sensor { width: 4, height: 3, padding: 1 };

    #[test]
    fn counts_follow_the_sensor_and_the_table_ends_at_max_depth() {
        let table = Techniques::new(SENSOR, 3, |x| if x.s == 1 && x.t >= 2 { 5 } else { 1 });
        assert_eq!(table.count(Strategy { s: 0, t: 2 }), 30.0);
        assert_eq!(table.count(Strategy { s: 1, t: 2 }), 150.0);
        assert_eq!(table.count(Strategy { s: 3, t: 1 }), 12.0);
        assert_eq!(table.count(Strategy { s: 0, t: 1 }), 0.0);
        assert_eq!(table.count(Strategy { s: 2, t: 0 }), 0.0);
        assert_eq!(table.count(Strategy { s: 2, t: 3 }), 0.0);
        assert_eq!(table.strategies().count(), 2 + 3 + 4);
        assert_eq!(table.light_vertices(), LightVertices { connected: 2, splatted: 3, merged: 0 });
        assert_eq!(table.camera_vertices(), 4);
        // Three connections for each camera vertex, to what a light subpath has one and a half of.
        let shared =
            Techniques::new(SENSOR, 4, |_| 1).with_light_paths(LightPaths::each(2)).with_light_vertices(3, 1.5);
        assert_eq!(shared.count(Strategy { s: 2, t: 2 }), 60.0);
        assert_eq!([0, 1].map(|s| shared.count(Strategy { s, t: 2 })), [30.0; 2]);
        assert_eq!(shared.count(Strategy { s: 2, t: 1 }), 24.0);
        // A light path for a quarter of the pixels.
        let some = Techniques::new(SENSOR, 4, |_| 1).with_light_paths(LightPaths::one_in(4));
        assert_eq!([0, 1, 2].map(|s| some.count(Strategy { s, t: 2 })), [30.0, 30.0, 7.5]);
        assert_eq!(some.count(Strategy { s: 2, t: 1 }), 3.0);
        let merging = some.merging_within(Some(1.0));
        assert_eq!(merging.merging_pairs(2), 90.0);
        // And merges with one for a third of those.
        let few = merging.merging_at(MeetingPlaces::SeenBySpecular, LightPaths::one_in(3));
        assert_eq!([2, 3].map(|t| few.merging_pairs(t)), [0.0, 30.0]);
        assert_eq!(few.count(Strategy { s: 2, t: 2 }), 7.5);
        assert_eq!(few.merges().collect::<Vec<_>>(), [Strategy { s: 2, t: 3 }]);
        let one = table.only(Strategy { s: 1, t: 2 });
        assert_eq!(one.strategies().collect::<Vec<_>>(), [Strategy { s: 1, t: 2 }]);
        assert_eq!(one.camera_vertices(), 2);
    }
}
