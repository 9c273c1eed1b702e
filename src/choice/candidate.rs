//! What is chosen among.

use std::fmt;

use crate::{integrator::IntegratorKind, path::LightPaths, render::Settings};

/// An integrator with so many light subpaths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Which table.
    pub integrator: IntegratorKind,
    /// See [`Settings::light_paths`].
    pub light_paths: LightPaths,
}

/// What to choose among, from the simplest to the one that takes the most of a sample. Merges meet the light subpaths
/// of all pixels, so that a scene may be well served by few.
pub const CANDIDATES: [Candidate; 6] = [
    Candidate::new(IntegratorKind::Path, LightPaths::ONE),
    Candidate::new(IntegratorKind::Hybrid, LightPaths::ONE),
    Candidate::new(IntegratorKind::Bdpt, LightPaths::ONE),
    Candidate::new(IntegratorKind::BdptSds, LightPaths::ONE),
    Candidate::new(IntegratorKind::Vcm, LightPaths::one_in(8)),
    Candidate::new(IntegratorKind::Vcm, LightPaths::ONE),
];

impl Candidate {
    /// This integrator with these.
    pub const fn new(integrator: IntegratorKind, light_paths: LightPaths) -> Self {
        Self { integrator, light_paths }
    }

    /// What these settings ask for.
    pub fn of(settings: &Settings) -> Self {
        Self::new(settings.integrator, settings.light_paths)
    }
}

impl fmt::Display for Candidate {
    /// As the command line names it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { integrator, light_paths } = self;
        if *light_paths == LightPaths::ONE {
            write!(f, "{integrator}")
        } else {
            write!(f, "{integrator} --light-paths {light_paths}")
        }
    }
}
