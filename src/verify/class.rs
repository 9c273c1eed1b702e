//! A partition of all paths into a few classes that engineers have names for.

use std::fmt;

use crate::{
    path::{Densities, JoinedPath},
    scene::bsdf::ScatterEvent,
};

/// A class of paths; every path is in exactly one. In Heckbert's letters, camera first, X is any scattering that is not
/// specular.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Class {
    /// C L.
    LightsSeen,
    /// C S⁺ L.
    LightsReflected,
    /// C D L.
    DirectDiffuse,
    /// C G L.
    DirectGlossy,
    /// C X … D L of three edges and more, p_1 not specular.
    Indirect,
    /// C X … G L of three edges and more, p_1 not specular: a blurred caustic.
    GlossyCaustics,
    /// C X … S L.
    Caustics,
    /// C S … X L.
    Reflected,
    /// C S … X … S L.
    CausticsReflected,
}

impl Class {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::LightsSeen,
        Self::LightsReflected,
        Self::DirectDiffuse,
        Self::DirectGlossy,
        Self::Indirect,
        Self::GlossyCaustics,
        Self::Caustics,
        Self::Reflected,
        Self::CausticsReflected,
    ];

    /// The class of a path.
    #[inline]
    pub fn of(path: &JoinedPath) -> Self {
        let n = path.edges();
        if n == 1 {
            return Self::LightsSeen;
        }
        match (path.is_delta(1), path.is_delta(n - 1)) {
            (true, true) if (1..n).all(|i| path.is_delta(i)) => Self::LightsReflected,
            (true, true) => Self::CausticsReflected,
            (true, false) => Self::Reflected,
            (false, true) => Self::Caustics,
            (false, false) => match (path.event(n - 1), n) {
                (ScatterEvent::Glossy, 2) => Self::DirectGlossy,
                (ScatterEvent::Glossy, _) => Self::GlossyCaustics,
                (_, 2) => Self::DirectDiffuse,
                _ => Self::Indirect,
            },
        }
    }

    /// Its letters, camera first.
    pub fn letters(self) -> &'static str {
        match self {
            Self::LightsSeen => "C L",
            Self::LightsReflected => "C S+ L",
            Self::DirectDiffuse => "C D L",
            Self::DirectGlossy => "C G L",
            Self::Indirect => "C X ... D L",
            Self::GlossyCaustics => "C X ... G L",
            Self::Caustics => "C X ... S L",
            Self::Reflected => "C S ... X L",
            Self::CausticsReflected => "C S ... X ... S L",
        }
    }

    /// Its name in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::LightsSeen => "lights seen directly",
            Self::LightsReflected => "lights in mirrors and glass",
            Self::DirectDiffuse => "direct, diffuse",
            Self::DirectGlossy => "direct, glossy",
            Self::Indirect => "indirect",
            Self::GlossyCaustics => "glossy caustics",
            Self::Caustics => "caustics",
            Self::Reflected => "in mirrors and glass",
            Self::CausticsReflected => "caustics in mirrors and glass",
        }
    }

    /// Whether its light was scattered on its way, by more than mirrors and smooth glass. What is left are the lights
    /// themselves, often much brighter than all that they light.
    pub fn is_scattered(self) -> bool {
        !matches!(self, Self::LightsSeen | Self::LightsReflected)
    }

    /// Whether s = 0 is the only strategy that any table can find it with, so that every integrator that covers it does
    /// the same there: a specular chain offers no connection.
    pub fn has_one_strategy(self) -> bool {
        self == Self::LightsReflected
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
