//! What a person can choose: each integrator's name, and what its [`Description`] says.

use std::{fmt, str::FromStr};

use super::{
    IntegratorKind,
    description::{Description, Gap, Landing, LightSampling, Merges, Table},
};
use crate::{
    path::{Heuristic, Strategy, Techniques},
    scene::{
        camera::Sensor,
        light::{LightChoice, Lights},
    },
};

/// Makes [`IntegratorKind`] of a list of integrators, each with the file that describes it.
macro_rules! integrators {
    ($($kind:ident: $file:ident,)*) => {
        $(mod $file;)*

        /// The integrators that a person can choose, in the order of the documentation.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum IntegratorKind {
            $(#[doc = concat!("That of `src/integrator/", stringify!($file), ".rs`.")] $kind,)*
        }

        impl IntegratorKind {
            /// All of them.
            pub const ALL: [Self; [$(Self::$kind),*].len()] = [$(Self::$kind),*];

            const DESCRIPTIONS: [&'static Description; Self::ALL.len()] = [$(&$file::DESCRIPTION),*];
        }
    };
}
pub(super) use integrators;

impl IntegratorKind {
    /// What it says about itself.
    pub fn description(self) -> &'static Description {
        Self::DESCRIPTIONS[self as usize]
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        self.description().name
    }

    /// How it chooses among these lights with the least noise in the same time.
    pub fn choice_among(self, lights: &Lights) -> LightChoice {
        match self.description().light_sampling {
            LightSampling::Power => LightChoice::Power,
            LightSampling::Suitable => lights.suitable_choice(),
        }
    }

    /// Whether a pass finds paths that may land anywhere on the image.
    pub fn lands_anywhere(self) -> bool {
        self.description().landing == Landing::Anywhere
    }

    /// Whether its table has a strategy that is one of those `wanted`.
    pub fn has(self, wanted: impl Fn(Strategy) -> bool) -> bool {
        self.description().table.has(wanted)
    }

    /// Whether its table does not cover what `gap` says.
    pub fn lacks(self, gap: Gap) -> bool {
        self.description().table.lacks(gap)
    }

    /// Whether it samples the whole integral, up to paths of any length, by strategies (s,t).
    pub fn has_strategies(self) -> bool {
        matches!(self.description().table, Table::Strategies(_))
    }

    /// Its table.
    pub(super) fn table(self, sensor: Sensor, max_depth: u32) -> Techniques {
        let max_depth = max_depth.min(self.description().longest_path);
        let table = match self.description().table {
            Table::Strategies(multiplicity) => Techniques::new(sensor, max_depth, multiplicity),
            Table::Area => Techniques::by_area(sensor, max_depth),
        };
        match self.description().merges {
            Merges::At(places, light_paths) => table.merging_within(Some(UNSET_RADIUS)).merging_at(places, light_paths),
            Merges::No => table,
        }
    }

    /// Whether its subpaths merge: what it estimates is the image only in the limit.
    pub fn merges(self) -> bool {
        self.description().merges != Merges::No
    }

    /// The rule that weighs its table.
    pub(super) fn heuristic(self) -> Heuristic {
        self.description().heuristic
    }
}

/// That of merges, in metres, until [`Integrator::merging_within`](super::Integrator::merging_within) sets one.
const UNSET_RADIUS: f32 = 1.0;

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
    use std::{fs, path::Path};

    use glam::Vec3;

    use super::*;
    use crate::{
        math::Rgb,
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

    #[test]
    fn paths_land_anywhere_where_something_reaches_for_the_lens() {
        for kind in IntegratorKind::ALL {
            assert_eq!(kind.lands_anywhere(), kind.has(|x| x.t == 1) || !kind.has_strategies(), "{kind}");
        }
    }

    /// Nothing but the list and its own file knows an integrator: to add one takes no more.
    #[test]
    fn an_integrator_is_its_file_and_a_line() {
        fn lines_that_name(folder: &Path, names: &[&str], own: &str) -> Vec<String> {
            let mut found = Vec::new();
            for entry in fs::read_dir(folder).expect("a folder of sources") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    found.extend(lines_that_name(&path, names, own));
                } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with(own) {
                    let text = fs::read_to_string(&path).expect("text");
                    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
                    found.extend(code.filter(|line| names.iter().any(|name| line.contains(name))).map(str::to_owned));
                }
            }
            found
        }
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        // In pieces, so that these lines are not among them.
        let names = [concat!("Path", "Light"), concat!("path", "_light"), concat!("path", "-light")];
        let found = lines_that_name(&sources, &names, concat!("path", "_light.rs"));
        assert_eq!(found, [format!("    {}: {},", names[0], names[1])]);
    }
}
