//! The choice among lights.

use std::fmt;

use crate::sampling::Discrete;

/// How next-event estimation chooses among the lights. Walks from the light start by kind and power, whatever it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LightChoice {
    /// Each light has a sample of its own: as many rays as lights.
    All,
    /// One, each with the same probability.
    Uniform,
    /// One by kind and emitted power, wherever it is.
    #[default]
    Power,
    /// One by what it could send to where it is asked from: distance, orientation, intensity.
    Tree,
}

impl LightChoice {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::All, Self::Uniform, Self::Power, Self::Tree];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Uniform => "uniform",
            Self::Power => "power",
            Self::Tree => "tree",
        }
    }
}

impl fmt::Display for LightChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What family of lights it is in, as far as the choice is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    /// Emitting surfaces.
    Surface,
    /// Points and spots.
    Lamp,
    /// Parallel light.
    Sun,
    /// What lies around the scene.
    Environment,
}

/// The part of the choice that goes by power among all lights alike.
const BY_POWER: f64 = 0.5;
/// The part in which all lights that emit are alike.
const UNIFORM: f64 = 1.0 / 64.0;

/// The distribution over lights with these families and powers, for emission and for next-event estimation:
///
/// P_i = ½ Φ_i/Φ + (½ − 1/64) Φ_i/(K Φ_kind) + 1/(64 N), and zero where Φ_i is.
///
/// Power is the right measure among lights of one family: a thousand emissive triangles count as the lamp that they
/// make up. Between families it may mislead, since that of a sun or an environment grows with the scene's extent,
/// whatever of it arrives where the camera looks. So half of the choice gives each of the K families present the same
/// part: no kind gets less than nearly 1/(2K), and none needs more than twice the samples that its power alone would
/// have given it. The uniform part bounds what a light's estimate is divided by: no probability is below 1/(64 N), 2²⁶
/// of a choice's integers for as many lights as have ids.
pub(super) fn by_kind_and_power(lights: &[(Family, f64)]) -> Discrete {
    let power_of =
        |wanted: Family| lights.iter().filter(|(family, _)| *family == wanted).map(|(_, power)| power).sum::<f64>();
    let of_families = [Family::Surface, Family::Lamp, Family::Sun, Family::Environment].map(power_of);
    let total: f64 = of_families.iter().sum();
    let families = of_families.iter().filter(|power| **power > 0.0).count() as f64;
    let emitting = lights.iter().filter(|(_, power)| *power > 0.0).count() as f64;
    let relative = |&(family, power): &(Family, f64)| {
        if power <= 0.0 {
            return 0.0;
        }
        let by_family = power / (families * of_families[family as usize]);
        BY_POWER * power / total + (1.0 - BY_POWER - UNIFORM) * by_family + UNIFORM / emitting
    };
    Discrete::new(&lights.iter().map(relative).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_kind_starves_and_no_crowd_crowds_out() {
        // A sun and a sky over a kilometre of land, one lamp, and a window cut into ten thousand triangles.
        let mut lights =
            vec![(Family::Sun, 1e9), (Family::Environment, 1e8), (Family::Lamp, 10.0), (Family::Lamp, 0.0)];
        lights.extend([(Family::Surface, 1e-3); 10_000]);
        let choice = by_kind_and_power(&lights);
        let p = |i| choice.probability(i);
        assert!(p(0) > 0.55 && p(1) > 0.15 && p(2) > 0.12, "{} {} {}", p(0), p(1), p(2));
        assert_eq!(p(3), 0.0);
        let window: f32 = (4..lights.len()).map(p).sum();
        assert!((0.12..0.15).contains(&window), "{window}");
        let sum: f32 = (0..4).map(p).sum::<f32>() + window;
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
    }

    #[test]
    fn one_kind_goes_by_power() {
        let choice = by_kind_and_power(&[(Family::Surface, 1.0), (Family::Surface, 3.0)]);
        let expected = 63.0 / 64.0 * 0.25 + 1.0 / 128.0;
        assert!((choice.probability(0) - expected).abs() < 1e-6, "{}", choice.probability(0));
        assert!(by_kind_and_power(&[(Family::Lamp, 0.0)]).is_empty() && by_kind_and_power(&[]).is_empty());
    }

    #[test]
    fn a_light_of_next_to_no_power_keeps_a_probability() {
        let choice = by_kind_and_power(&[(Family::Lamp, 1e30), (Family::Lamp, 1e-30)]);
        assert!(choice.probability(1) > 0.007);
    }
}
