//! Random numbers, warps, discrete distributions, reconstruction filters and the measures of densities.

mod discrete;
mod filter;
mod measure;
mod sampler;
pub mod warp;

pub use discrete::Discrete;
pub use filter::Filter;
pub use measure::{PdfArea, PdfSolidAngle};
pub use sampler::{Independent, Sampler, Stream};
