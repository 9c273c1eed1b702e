//! What an integrator says about itself: all that lists, parses, foretells or refuses reads it.

use crate::{
    path::{Heuristic, LightPaths, MeetingPlaces, Roulette, Strategy},
    sampling::SamplerKind,
};

/// An integrator as data. Its file has one, as a constant.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// The name on the command line.
    pub name: &'static str,
    /// What it does, in a sentence.
    pub what: &'static str,
    /// The paths that its table can sample at all, in a sentence for readers. Path by path,
    /// [`Integrator::covers`](super::Integrator::covers) answers; warnings about black pixels follow from [`Gap`]s.
    pub coverage: &'static str,
    /// Its table.
    pub table: Table,
    /// Whether its subpaths merge, too.
    pub merges: Merges,
    /// The rule that weighs its table.
    pub heuristic: Heuristic,
    /// What its weights compare with the least noise in the same time.
    pub weights: Weights,
    /// The roulette that gives it the least noise in the same time: early where a vertex costs many connections and its
    /// share of the image has other strategies, later where the walk is all there is.
    pub roulette: Roulette,
    /// The random numbers that give it the least noise in the same time. Where paths land anywhere on the image,
    /// nothing fills a pixel evenly.
    pub sampler: SamplerKind,
    /// How it chooses among lights with the least noise in the same time: `Suitable` if its table has the strategy
    /// (1,2).
    pub light_sampling: LightSampling,
    /// Where the paths of a pixel's sample land: `Anywhere` if its table has a strategy with t = 1, or is
    /// [`Table::Area`].
    pub landing: Landing,
    /// The longest paths that it finds whatever is asked for, in edges.
    pub longest_path: u32,
}

/// What weights of multiple importance sampling compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// n p of each technique.
    Plain,
    /// v n p, where v says how much less noisy a technique's samples of direct light are than independent ones:
    /// measured before the first pass (see [`VarianceFactors`](crate::path::VarianceFactors)).
    VarianceAware,
}

impl Weights {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Plain, Self::VarianceAware];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::VarianceAware => "variance-aware",
        }
    }
}

/// An integrator's table of techniques.
#[derive(Clone, Copy, Debug)]
pub enum Table {
    /// Walks and connections: m_{s,t}, how often each strategy is evaluated.
    Strategies(fn(Strategy) -> u32),
    /// Every vertex on its own.
    Area,
}

/// Whether subpaths merge where they nearly meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Merges {
    /// At such vertices, with the light subpaths of so many samples. What it estimates is the image in the limit only.
    At(MeetingPlaces, LightPaths),
    /// Nowhere.
    No,
}

/// How an integrator chooses among lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSampling {
    /// By power, as emission does: without next-event estimation nothing asks for more.
    Power,
    /// As suits the lights: see [`Lights::suitable_choice`](crate::scene::light::Lights::suitable_choice).
    Suitable,
}

/// Where paths land.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Landing {
    /// In the pixel whose sample found them.
    OwnPixel,
    /// Anywhere on the image.
    Anywhere,
}

/// What some tables do not cover, although its light belongs in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gap {
    /// Mirrors and clear glass that the camera sees. A walk from the camera follows the one direction that such a
    /// surface leaves open, and a connection hits it with probability zero.
    SpecularSeen,
    /// An environment behind the scene of an orthographic camera, which sees it in one direction.
    ParallelBackground,
    /// Point lights, spots and suns, which no walk hits.
    LightsWithoutExtent,
    /// Their light by way of a mirror or glass to what the camera sees directly.
    CausticsOfPoints,
    /// Lights that are no surfaces.
    LightsInSpace,
}

impl Table {
    /// Whether a strategy of the table, for paths of at most four edges, is one of those that are `wanted`.
    pub fn has(self, wanted: impl Fn(Strategy) -> bool) -> bool {
        let Self::Strategies(multiplicity) = self else { return false };
        let pairs = (0..=5).flat_map(|s| (1..=5 - s).map(move |t| Strategy { s, t }));
        pairs.filter(|x| x.s + x.t >= 2).any(|x| wanted(x) && multiplicity(x) > 0)
    }

    /// Whether the table does not cover what `gap` says.
    pub fn lacks(self, gap: Gap) -> bool {
        let is_there = match gap {
            Gap::SpecularSeen => self.has(|x| x.t >= 3),
            Gap::ParallelBackground => self.has(|x| x.s == 0 && x.t == 2),
            Gap::LightsWithoutExtent => self.has(|x| x.s == 1),
            Gap::CausticsOfPoints => self.has(|x| x.s >= 3),
            Gap::LightsInSpace => matches!(self, Self::Strategies(_)),
        };
        !is_there
    }
}
