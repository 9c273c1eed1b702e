//! All of the core, compiled for every processor: see [`super::avx2`](super).

use super::{Renderer, deposit::TaskSink};
use crate::{integrator::Scratch, sampling::Sampler};

impl Renderer<'_> {
    /// [`Self::tile`] for every processor.
    #[inline(never)]
    pub(super) fn tile_portable<S: Sampler>(&self, tile: u32, scratch: &mut Scratch, sink: &mut TaskSink) -> u64 {
        self.tile::<S>(tile, scratch, sink)
    }
}
