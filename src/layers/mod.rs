//! Layers: images of the paths that a predicate holds for, made beside the image itself.
//!
//! A predicate asks a path for its events ([`Expression`]), its length, its light or the strategy that found it. Every
//! layer is a film of its own, whose sums are as exact as the image's: layers that share every path among them add up
//! to the image exactly.

mod alphabet;
mod expression;
#[cfg(test)]
mod tests;

use std::{fmt, str::FromStr};

pub use self::{
    alphabet::{TagError, Tags, kind_of_light},
    expression::{Expression, ExpressionError, Matcher},
};
use crate::{
    film::{Film, Half},
    integrator::Integrator,
    math::Rgb,
    path::{Densities, JoinedPath, Strategy, Technique},
    scene::Scene,
};

/// Sets of layers that are there ready-made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayerSet {
    /// K^i L_e: a layer for each path length.
    Bounces,
    /// Σ K^i L_e: all paths up to each length (lecture, *Solution of the rendering equation*).
    Neumann,
    /// Emission, caustics, transmission, mirrors, glossy, direct and indirect light.
    Classes,
    /// A layer for each emissive material, and one for each kind of light without a surface.
    Lights,
    /// w C of each strategy (s,t): Veach's pyramid.
    Strategies,
    /// C of each strategy (s,t), unweighted: what it makes of all paths that it can find, an image of its own. What has
    /// no weight at all is not there, such as hits of lights by `-i path-light`.
    Unweighted,
}

impl LayerSet {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Bounces, Self::Neumann, Self::Classes, Self::Lights, Self::Strategies, Self::Unweighted];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bounces => "bounces",
            Self::Neumann => "neumann",
            Self::Classes => "classes",
            Self::Lights => "lights",
            Self::Strategies => "strategies",
            Self::Unweighted => "unweighted",
        }
    }

    /// Whether every path belongs to exactly one of its layers, so that they add up to the image.
    pub fn is_partition(self) -> bool {
        !matches!(self, Self::Neumann | Self::Unweighted)
    }
}

impl fmt::Display for LayerSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A set's name was none that there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a set of layers is 'bounces', 'neumann', 'classes', 'lights', 'strategies' or 'unweighted'")]
pub struct UnknownLayerSet;

impl FromStr for LayerSet {
    type Err = UnknownLayerSet;

    fn from_str(name: &str) -> Result<Self, UnknownLayerSet> {
        Self::ALL.into_iter().find(|set| set.name() == name).ok_or(UnknownLayerSet)
    }
}

/// The classes of [`LayerSet::Classes`]: a path belongs to the first that it matches.
pub const CLASSES: [(&str, &str); 7] = [
    ("emission", "CL"),
    ("caustics", "C.*[DG]S+L"),
    ("transmission", "CT.*L"),
    ("mirrors", "CS.*L"),
    ("direct", "C.L"),
    ("glossy", "C.*G.*L"),
    ("indirect", "C.*L"),
];

/// Which layers a path belongs to.
#[derive(Clone, Debug)]
enum Sorting {
    /// That of its length.
    Length,
    /// Those of its length and more.
    UpToLength,
    /// The first that it matches.
    Expressions(Vec<Matcher>),
    /// That of its light, by the light's id.
    Light(Vec<u32>),
    /// That of the strategy which found it; area sampling has the last.
    Strategy(StrategyIndex),
    /// The same, without the weight that the integrator's table and rule gave.
    Unweighted(StrategyIndex),
}

#[derive(Clone, Debug)]
struct Group {
    sorting: Sorting,
    names: Vec<String>,
}

/// The layers of a render.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    groups: Vec<Group>,
    tags: Tags,
}

/// Why layers cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayerError {
    /// An expression names what is not there.
    #[error(transparent)]
    Tags(#[from] TagError),
    /// An expression is too long.
    #[error(transparent)]
    Expression(#[from] ExpressionError),
}

impl Layers {
    /// The layers of `sets`, and one of each expression in `own`, for renders of `scene` by `integrator`.
    ///
    /// # Errors
    /// If an expression names a material that the scene does not have, or is too long.
    pub fn new(
        sets: &[LayerSet],
        own: &[(String, Expression)],
        scene: &Scene,
        integrator: &Integrator,
    ) -> Result<Self, LayerError> {
        let tags = Tags::new(own.iter().flat_map(|(_, expression)| expression.names()), scene)?;
        let mut groups = Vec::new();
        for set in sets {
            let group = match set {
                LayerSet::Bounces => by_length(Sorting::Length, integrator),
                LayerSet::Neumann => by_length(Sorting::UpToLength, integrator),
                LayerSet::Classes => classes(&tags)?,
                LayerSet::Lights => by_light(scene),
                LayerSet::Strategies => by_strategy(integrator, Sorting::Strategy),
                LayerSet::Unweighted => by_strategy(integrator, Sorting::Unweighted),
            };
            let names = group.names.iter().map(|name| format!("{set}.{name}")).collect();
            groups.push(Group { names, ..group });
        }
        for (name, expression) in own {
            let sorting = Sorting::Expressions(vec![expression.compile(&tags)?]);
            groups.push(Group { sorting, names: vec![name.clone()] });
        }
        Ok(Self { groups, tags })
    }

    /// The names of all layers, in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.groups.iter().flat_map(|group| group.names.iter().map(String::as_str))
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.groups.iter().map(|group| group.names.len()).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds a deposit of the image to the films of the layers that the path belongs to; `films` has one for each, in
    /// their order. The `integrator` is as it was when it found the path.
    pub(crate) fn deposit(
        &self,
        (scene, integrator): (&Scene, &Integrator),
        path: &JoinedPath,
        value: Rgb,
        half: Half,
        films: &[Film],
    ) {
        let mut symbols = [0; LONGEST];
        let mut spelled = 0;
        let mut films = films;
        for group in &self.groups {
            let (own, rest) = films.split_at(group.names.len());
            films = rest;
            let add = |i: usize| own[i].deposit(path.raster(), value, half);
            let length = path.edges() as usize - 1;
            match &group.sorting {
                Sorting::Length => add(length),
                Sorting::UpToLength => (length..own.len()).for_each(add),
                Sorting::Expressions(matchers) => {
                    if spelled == 0 {
                        spelled = self.tags.spell(scene, path, &mut symbols);
                    }
                    if let Some(i) = matchers.iter().position(|m| m.matches(&symbols[..spelled])) {
                        add(i);
                    }
                }
                Sorting::Light(layer_of) => {
                    if let Some(id) = path.point(path.edges()).light {
                        add(layer_of[id.index()] as usize);
                    }
                }
                Sorting::Strategy(index) => add(index.of(path.technique()).unwrap_or(own.len() - 1)),
                Sorting::Unweighted(index) => {
                    let i = index.of(path.technique()).unwrap_or(own.len() - 1);
                    let weight = path.mis_weight(integrator.techniques(), integrator.heuristic());
                    own[i].deposit(path.raster(), value / weight, half);
                }
            }
        }
    }
}

/// Paths of some classes: a predicate on paths by an expression.
#[derive(Clone, Debug)]
pub struct PathClasses {
    matcher: Matcher,
    tags: Tags,
}

impl PathClasses {
    /// The paths of `scene` that `expression` holds for.
    ///
    /// # Errors
    /// If it names a material that the scene does not have, or is too long.
    pub fn new(expression: &Expression, scene: &Scene) -> Result<Self, LayerError> {
        let tags = Tags::new(expression.names(), scene)?;
        Ok(Self { matcher: expression.compile(&tags)?, tags })
    }

    /// Whether it holds for this path of that scene.
    pub fn holds(&self, scene: &Scene, path: &JoinedPath) -> bool {
        let mut symbols = [0; LONGEST];
        let spelled = self.tags.spell(scene, path, &mut symbols);
        self.matcher.matches(&symbols[..spelled])
    }
}

/// Vertices of the longest path there can be.
const LONGEST: usize = 258;

fn by_length(sorting: Sorting, integrator: &Integrator) -> Group {
    Group { sorting, names: (1..=integrator.techniques().max_depth()).map(|n| n.to_string()).collect() }
}

fn classes(tags: &Tags) -> Result<Group, ExpressionError> {
    let compile = |(_, text): &(&str, &str)| Expression::parse(text)?.compile(tags);
    let matchers = CLASSES.iter().map(compile).collect::<Result<_, _>>()?;
    Ok(Group { sorting: Sorting::Expressions(matchers), names: CLASSES.map(|(name, _)| name.to_owned()).to_vec() })
}

fn by_light(scene: &Scene) -> Group {
    let mut names: Vec<String> = Vec::new();
    let layer_of = scene.lights().all().iter().map(|light| {
        let name = match light {
            crate::scene::light::Light::Area { primitive, .. } => {
                channel_name(&scene.material(scene.geometry().material(*primitive)).name)
            }
            _ => kind_of_light(light).to_owned(),
        };
        let known = names.iter().position(|n| *n == name).unwrap_or_else(|| {
            names.push(name);
            names.len() - 1
        });
        known as u32
    });
    let layer_of = layer_of.collect();
    Group { sorting: Sorting::Light(layer_of), names }
}

/// The number of each technique of a table among those that it has.
#[derive(Clone, Debug)]
struct StrategyIndex {
    /// Of (s,t) at `s·side + t`, and of the merges after all of these.
    numbers: Vec<usize>,
    side: u32,
}

impl StrategyIndex {
    /// `None` for area sampling.
    #[inline]
    fn of(&self, technique: Technique) -> Option<usize> {
        match technique {
            Technique::Bidirectional(Strategy { s, t }) => Some(self.numbers[(s * self.side + t) as usize]),
            Technique::Merged(Strategy { s, t }) => {
                Some(self.numbers[self.numbers.len() / 2 + (s * self.side + t) as usize])
            }
            Technique::Area => None,
        }
    }
}

fn by_strategy(integrator: &Integrator, sorting: impl Fn(StrategyIndex) -> Sorting) -> Group {
    let table = integrator.techniques();
    let side = table.max_depth() + 2;
    let mut numbers = vec![usize::MAX; 2 * (side * side) as usize];
    let mut names = Vec::new();
    for Strategy { s, t } in table.strategies() {
        numbers[(s * side + t) as usize] = names.len();
        names.push(format!("s{s}t{t}"));
    }
    for Strategy { s, t } in table.merges() {
        numbers[(side * side + s * side + t) as usize] = names.len();
        names.push(format!("s{s}t{t}merged"));
    }
    if table.area() > 0 {
        names.push("area".to_owned());
    }
    Group { names, sorting: sorting(StrategyIndex { numbers, side }) }
}

/// A name as programs take it for a part of a channel's: what is neither a letter, a digit, '-' nor '_' becomes '_'.
fn channel_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
    name.chars().take(LONGEST_NAME).map(plain).collect()
}

/// Letters in the name of a layer: of a channel's, OpenEXR takes 255 with all that stands before and after.
pub const LONGEST_NAME: usize = 128;
