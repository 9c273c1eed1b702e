//! All of the core, compiled for AVX2: what is inlined into a tile, and not only the walks through the tree.
//!
//! A module of its own, as [`super::portable`] is, because the compiler divides its work by modules: these two are half
//! of it.

use super::{Part, Renderer, deposit::TaskSink};
use crate::{integrator::Scratch, sampling::Sampler};

impl Renderer<'_> {
    /// [`Self::tile`] for AVX2.
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn tile_avx2<S: Sampler>(&self, part: Part<'_>, scratch: &mut Scratch, sink: &mut TaskSink) -> u64 {
        self.tile::<S>(part, scratch, sink)
    }
}
