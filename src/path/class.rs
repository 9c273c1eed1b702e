//! Path classes: what happens to the light along a path, in Heckbert's letters.

use std::fmt;

use crate::scene::bsdf::ScatterEvent;

/// One letter of a path class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Event {
    /// `C`: the lens.
    Camera,
    /// `D`: diffuse scattering.
    Diffuse,
    /// `G`: glossy scattering.
    Glossy,
    /// `S`: specular (delta) scattering.
    Specular,
    /// `L`: a light.
    Light,
}

impl From<ScatterEvent> for Event {
    fn from(event: ScatterEvent) -> Self {
        match event {
            ScatterEvent::Diffuse => Self::Diffuse,
            ScatterEvent::Glossy => Self::Glossy,
            ScatterEvent::Specular => Self::Specular,
        }
    }
}

/// The events of a path from the camera to the light, as in `CDSSL`: a caustic of a glass ball on a diffuse floor
/// (Heckbert 1990, *Adaptive Radiosity Textures for Bidirectional Ray Tracing*).
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PathClass(Vec<Event>);

impl PathClass {
    /// The class with these events.
    pub fn new(events: impl IntoIterator<Item = Event>) -> Self {
        Self(events.into_iter().collect())
    }

    /// The events, camera first.
    pub fn events(&self) -> &[Event] {
        &self.0
    }
}

impl fmt::Display for PathClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|event| {
            f.write_str(match event {
                Event::Camera => "C",
                Event::Diffuse => "D",
                Event::Glossy => "G",
                Event::Specular => "S",
                Event::Light => "L",
            })
        })
    }
}
