//! Waves in eight lanes. A module of its own, because the compiler divides its work by modules.

use super::super::{Renderer, deposit::TaskSink};
use crate::{
    integrator::{Starts, Wave},
    lanes::Eight,
};

impl Renderer<'_> {
    /// The wave of a tile.
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn wave_avx2(&self, lanes: Eight, starts: &mut Starts, wave: &mut Wave, sink: &mut TaskSink) {
        self.wave(lanes, starts, wave, sink);
    }
}
