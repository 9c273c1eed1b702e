//! Passes in waves: many paths at once, in as many lanes as the processor has.

use std::{
    mem,
    sync::{Mutex, PoisonError},
};

use rayon::prelude::*;

use super::{
    Renderer,
    deposit::{Destination, TaskSink},
    padded::PaddedImage,
    statistics::Statistics,
};
use crate::{
    film::{Half, TileSums},
    integrator::{Connects, LightVertexMap, Starts, Sweep, Wave},
    lanes::{Instructions, Lanes, Record, Work},
};

/// How many paths a thread computes at once. No image depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// One.
    One,
    /// A wave, in eight lanes.
    Eight,
    /// A wave, in sixteen lanes.
    Sixteen,
}

impl Width {
    fn instructions(self) -> Option<Instructions> {
        match (self, Instructions::detect()) {
            (Self::One, _) => Some(Instructions::Portable),
            #[cfg(target_arch = "x86_64")]
            (Self::Eight, Instructions::Avx2(eight)) => Some(Instructions::Avx2(eight)),
            #[cfg(target_arch = "x86_64")]
            (Self::Eight, Instructions::Avx512(sixteen)) => Some(Instructions::Avx2(sixteen.eight())),
            #[cfg(target_arch = "x86_64")]
            (Self::Sixteen, Instructions::Avx512(sixteen)) => Some(Instructions::Avx512(sixteen)),
            _ => None,
        }
    }
}

/// The lanes for waves, unless something else is asked for. A build that is not optimized has none: all that is inlined
/// into a wave keeps its own place on the stack there, which is more than a thread has.
pub(super) fn suitable() -> Instructions {
    if cfg!(debug_assertions) { Instructions::Portable } else { Instructions::detect() }
}

impl<'a> Renderer<'a> {
    /// The same, computing so many paths at once where it can; `None` if the processor has no such lanes. Else there
    /// are as many as it has.
    #[must_use]
    pub fn with_width(self, width: Width) -> Option<Self> {
        let lanes = width.instructions()?;
        Some(Self { lanes, ..self })
    }

    /// Whether passes are computed in waves.
    pub fn makes_waves(&self) -> bool {
        self.waves().is_some() && self.keep.is_none()
    }

    /// The lanes in which passes are computed; `None` where they go path by path.
    pub(super) fn waves(&self) -> Option<Instructions> {
        let plain = self.layers.is_none() && self.alpha_sums.is_none();
        let lanes = !matches!(self.lanes, Instructions::Portable);
        (plain && lanes && self.waves_serve).then_some(self.lanes)
    }

    /// One pass, with a wave for each tile; where light vertices are kept for merges, two: all of them come first.
    pub(super) fn pass_in_waves(&self, lanes: Instructions, half: Half) {
        self.scene.prepare_waves();
        let Some(radius) = self.integrator.techniques().radius().filter(|_| self.integrator.merges()) else {
            self.sweep_in_waves((lanes, half), Sweep::Whole);
            return;
        };
        let kept = self.sweep_in_waves((lanes, half), Sweep::Light);
        let map = LightVertexMap::new(&kept, radius);
        drop(kept);
        self.sweep_in_waves((lanes, half), Sweep::Camera(&map));
    }

    /// Returns the light vertices that each tile has kept.
    fn sweep_in_waves(&self, (lanes, half): (Instructions, Half), sweep: Sweep<'_>) -> Vec<Vec<Record>> {
        let image = PaddedImage { sensor: self.scene.camera.sensor(), side: PaddedImage::TILE_OF_WAVES };
        let from_camera = self.integrator.walks_from_camera() && !matches!(sweep, Sweep::Light);
        let tile = |Borrowed { room, .. }: &mut Borrowed<'_>, tile| {
            let Room { starts, wave, sums } = room;
            if from_camera {
                sums.start(image.corner(tile), image.side);
            }
            starts.clear();
            let mut done = Statistics::default();
            image.each_in_squares(tile, |pixel| {
                let stage = self.light_stage(pixel, sweep);
                done.samples += u64::from(stage.connects == Connects::Yes);
                starts.push(pixel.corner(), pixel.key(), stage);
            });
            let mut sink = TaskSink {
                renderer: self,
                done,
                destination: Destination::Film { half, keep: None },
                sums: from_camera.then_some(&mut *sums),
            };
            let (renderer, sink_of_tile) = (self, &mut sink);
            match lanes {
                Instructions::Portable => {}
                #[cfg(target_arch = "x86_64")]
                Instructions::Avx2(lanes) => {
                    lanes.call(Tile { renderer, lanes, sweep, starts, wave, sink: sink_of_tile });
                }
                #[cfg(target_arch = "x86_64")]
                Instructions::Avx512(lanes) => {
                    lanes.call(Tile { renderer, lanes, sweep, starts, wave, sink: sink_of_tile });
                }
            }
            self.count(&sink.done);
            if from_camera {
                sums.flush(&self.film, half);
            }
            wave.take_kept()
        };
        image.tiles().into_par_iter().map_init(|| self.rooms.borrow(), tile).collect()
    }
}

/// What the wave of a tile works in.
#[derive(Default)]
struct Room {
    starts: Starts,
    wave: Wave,
    sums: TileSums,
}

/// Rooms in which nobody works: they serve all passes, since to make one takes about as long as to render a tile in it.
#[derive(Default)]
pub(super) struct Rooms(Mutex<Vec<Room>>);

impl Rooms {
    fn borrow(&self) -> Borrowed<'_> {
        let free = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Borrowed { rooms: self, room: free.unwrap_or_default() }
    }
}

/// A room until it is given back.
struct Borrowed<'a> {
    rooms: &'a Rooms,
    room: Room,
}

impl Drop for Borrowed<'_> {
    fn drop(&mut self) {
        self.rooms.0.lock().unwrap_or_else(PoisonError::into_inner).push(mem::take(&mut self.room));
    }
}

/// The wave of a tile.
struct Tile<'a, 's, L> {
    renderer: &'a Renderer<'s>,
    lanes: L,
    sweep: Sweep<'a>,
    starts: &'a mut Starts,
    wave: &'a mut Wave,
    sink: &'a mut TaskSink<'s>,
}

impl<L: Lanes> Work for Tile<'_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { renderer: Renderer { integrator, scene, settings, passes, .. }, lanes, sweep, starts, wave, sink } =
            self;
        let numbers = (settings.sampler, settings.seed, passes.end);
        integrator.estimate_in_waves(lanes, scene, numbers, (sweep, starts), wave, sink);
    }
}
