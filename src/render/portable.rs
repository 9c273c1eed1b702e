//! All of the core, compiled for every processor: see [`super::avx2`](super).

use super::{Part, Renderer, deposit::TaskSink};
use crate::{integrator::Scratch, sampling::Sampler};

impl Renderer<'_> {
    /// [`Self::tile`] for every processor.
    #[inline(never)]
    pub(super) fn tile_portable<S: Sampler>(&self, part: Part<'_>, scratch: &mut Scratch, sink: &mut TaskSink) -> u64 {
        self.tile::<S>(part, scratch, sink)
    }
}
