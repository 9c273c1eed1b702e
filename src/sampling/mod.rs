//! Random numbers, warps, discrete distributions, reconstruction filters and the measures of densities.

mod choice;
mod discrete;
mod filter;
mod hashes;
mod independent;
mod measure;
mod numbers;
mod sampler;
mod sobol;
pub mod warp;

pub use choice::{Chance, Choice, Part, Remainder, Square};
pub(crate) use choice::{divide, find};
pub use discrete::Discrete;
pub use filter::Filter;
pub(crate) use hashes::hash;
pub use independent::Independent;
pub use measure::{PdfArea, PdfSolidAngle};
pub use numbers::Numbers;
pub use sampler::{Block, Sampler, SamplerKind, Stream, UnknownSampler};
pub use sobol::Sobol;
