//! Waves in sixteen lanes. A module of its own, because the compiler divides its work by modules.

use super::super::{Renderer, deposit::TaskSink};
use crate::{
    integrator::{Starts, Wave},
    lanes::Sixteen,
};

impl Renderer<'_> {
    /// The wave of a tile.
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd,avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn wave_avx512(&self, lanes: Sixteen, starts: &mut Starts, wave: &mut Wave, sink: &mut TaskSink) {
        self.wave(lanes, starts, wave, sink);
    }
}
