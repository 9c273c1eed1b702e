//! The integrators that a person can choose, and what each is best used with.

use std::{fmt, str::FromStr};

use super::{area, bdpt, hybrid, light, path, path_hemisphere, path_light};
use crate::{
    path::{Heuristic, Roulette, Techniques},
    sampling::SamplerKind,
    scene::{
        bsdf::Directions,
        camera::Sensor,
        light::{LightChoice, Lights},
    },
};

/// The integrators that a person can choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// Path tracing with next-event estimation: s ≤ 1.
    Path,
    /// Light tracing: t = 1.
    Light,
    /// Path and light tracing in one, weighted: s ≤ 1 or t = 1.
    Hybrid,
    /// Bidirectional path tracing: every strategy with t ≥ 1.
    Bdpt,
    /// Directional sampling alone: s = 0.
    PathHemisphere,
    /// Next-event estimation without MIS: s = 1, and s = 0 where that has no support.
    PathLight,
    /// Every vertex on its own, over the area of the surfaces.
    Area,
}

impl IntegratorKind {
    /// All of them, in the order of the documentation.
    pub const ALL: [Self; 7] =
        [Self::Path, Self::Light, Self::Hybrid, Self::Bdpt, Self::PathHemisphere, Self::PathLight, Self::Area];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => path::NAME,
            Self::Light => light::NAME,
            Self::Hybrid => hybrid::NAME,
            Self::Bdpt => bdpt::NAME,
            Self::PathHemisphere => path_hemisphere::NAME,
            Self::PathLight => path_light::NAME,
            Self::Area => area::NAME,
        }
    }

    /// The class of paths that the integrator's table can sample at all, in a sentence.
    pub fn coverage(self) -> &'static str {
        match self {
            Self::Path => path::COVERAGE,
            Self::Light => light::COVERAGE,
            Self::Hybrid => hybrid::COVERAGE,
            Self::Bdpt => bdpt::COVERAGE,
            Self::PathHemisphere => path_hemisphere::COVERAGE,
            Self::PathLight => path_light::COVERAGE,
            Self::Area => area::COVERAGE,
        }
    }

    /// The longest paths that it finds whatever is asked for, in edges.
    pub fn longest_path(self) -> u32 {
        match self {
            Self::Area => area::MAX_EDGES,
            _ => u32::MAX,
        }
    }

    /// The random numbers that give it the least noise in the same time. Where paths land anywhere on the image, nothing fills a pixel evenly.
    pub fn sampler(self) -> SamplerKind {
        match self {
            Self::Light | Self::Area => SamplerKind::Independent,
            _ => SamplerKind::Sobol,
        }
    }

    /// The roulette that gives it the least noise in the same time: early where a vertex costs many connections and its share of the
    /// image has other strategies, later where the walk is all there is.
    pub fn roulette(self) -> Roulette {
        match self {
            Self::Hybrid | Self::Bdpt => Roulette::FromDepth(2),
            _ => Roulette::default(),
        }
    }

    /// How it chooses among these lights with the least noise in the same time. Without next-event estimation nothing asks for more
    /// than the power, by which emission starts.
    pub fn choice_among(self, lights: &Lights) -> LightChoice {
        match self {
            Self::Light | Self::PathHemisphere | Self::Area => LightChoice::Power,
            Self::Path | Self::Hybrid | Self::Bdpt | Self::PathLight => lights.suitable_choice(),
        }
    }

    /// Whether a pass finds paths that may land anywhere on the image.
    pub fn traces_from_lights(self) -> bool {
        match self {
            Self::Path | Self::PathHemisphere | Self::PathLight => false,
            Self::Light | Self::Hybrid | Self::Bdpt | Self::Area => true,
        }
    }

    /// Its table.
    pub(super) fn table(self, sensor: Sensor, max_depth: u32) -> Techniques {
        let multiplicity = match self {
            Self::Path => path::multiplicity,
            Self::Light => light::multiplicity,
            Self::Hybrid => hybrid::multiplicity,
            Self::Bdpt => bdpt::multiplicity,
            Self::PathHemisphere => return Techniques::directional(sensor, max_depth, Directions::Bsdf),
            Self::PathLight => path_light::multiplicity,
            Self::Area => return Techniques::by_area(sensor, max_depth.min(area::MAX_EDGES)),
        };
        Techniques::new(sensor, max_depth, multiplicity)
    }

    /// The rule that weighs its table.
    pub(super) fn heuristic(self) -> Heuristic {
        match self {
            Self::PathLight => Heuristic::FirstSupported,
            _ => Heuristic::Power,
        }
    }
}

impl fmt::Display for IntegratorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for IntegratorKind {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|kind| kind.name() == s).ok_or_else(|| {
            let known: Vec<_> = Self::ALL.into_iter().map(Self::name).collect();
            format!("there is no integrator '{s}'; choose one of {}", known.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        math::Rgb,
        path::Strategy,
        scene::{geometry::Geometry, light::Light},
    };

    #[test]
    fn only_next_event_estimation_has_a_use_for_the_tree() {
        let point = |x| Light::Point { position: x * Vec3::X, intensity: Rgb::ONE };
        let lights = Lights::new(&Geometry::default(), &[], &[1.0, 2.0, 3.0].map(point));
        for kind in IntegratorKind::ALL {
            let table = kind.table(Sensor { width: 1, height: 1, padding: 0 }, 2);
            let samples_lights = table.multiplicity(Strategy { s: 1, t: 2 }) > 0;
            let expected = if samples_lights { LightChoice::Tree } else { LightChoice::Power };
            assert_eq!(kind.choice_among(&lights), expected, "{kind}");
        }
    }
}
