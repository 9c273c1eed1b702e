//! The core: paths, what they contribute, and how densely each strategy samples them.
//!
//! | lecture | here |
//! |---|---|
//! | p̄ = p_0 p_1 … p_n | [`Path`], [`Vertex`], [`Edge`] |
//! | T(p̄) | [`Path::throughput`] |
//! | G(p↔p′), V(p↔p′) | [`Path::geometry_term`], [`Scene::visible`](crate::scene::Scene::visible) |
//! | F_j(p̄) | [`Path::contribution`] |
//! | p_{s,t}, n_{s,t}, w_{s,t} | [`Path::pdf`], [`Techniques`], [`mis_weight`] |
//! | F between two prefixes | [`Joint`], [`Meeting`] |
//! | a step of a walk | [`Step::scatter`] |
//!
//! The core has two faces. The **definition** ([`Path`]) is written straight from the formulas, in f64 and without
//! caches. The **fast form** ([`Subpath`], [`JoinedPath`]) carries prefix products and densities that the random walks
//! fill in, in as many lanes `L` as there are paths at once: one, unless it is said, and a reader may forget them.
//! `tests/transport/identity.rs` holds them together for every path that any integrator finds.

mod absorption;
mod class;
mod definition;
mod departure;
mod edge;
mod joined;
mod joint;
mod light_paths;
mod meeting_places;
mod merging;
mod mis;
mod rivals;
mod roulette;
mod scattering;
mod step;
mod strategy;
mod subpath;
mod tilt;
mod variance;
mod vertex;

#[cfg(test)]
mod tests;

pub use class::{Event, PathClass};
pub use definition::Path;
pub use departure::{Departure, Rules, Scattered};
pub use edge::Edge;
pub use joined::JoinedPath;
pub use joint::{Around, Joint, Tail, are_directions, is_hittable};
pub use light_paths::{LightPaths, NoLightPaths};
pub use meeting_places::MeetingPlaces;
pub use merging::{LightVertex, Meeting, is_met, is_near};
pub use mis::{Densities, Heuristic, is_covered, mis_weight, relative_deposit};
pub use rivals::{Beginning, RivalSum, Rivals, RunningSum};
pub use roulette::Roulette;
pub use scattering::{Sampled, Surfaces};
pub use step::Step;
pub use strategy::{LightVertices, SharedLightVertices, Strategy, Technique, Techniques};
pub use subpath::{Subpath, is_seen_by_specular};
pub use variance::VarianceFactors;
pub use vertex::Vertex;
