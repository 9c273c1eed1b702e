//! The ids of what a point refers to: lights, and media.

use std::num::NonZeroU32;

/// The index of a light: every triangle or sphere that emits is one, in every instance, and so is every point light,
/// spot, sun and environment.
///
/// It is kept as the index's successor, so that a point's `Option<LightId>` takes four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightId(NonZeroU32);

impl LightId {
    /// The light of this index, below `u32::MAX`.
    #[inline]
    pub fn new(index: u32) -> Self {
        Self(NonZeroU32::MIN.saturating_add(index))
    }

    /// What has this [`Self::successor`].
    #[inline(always)]
    pub fn of_successor(index: u32) -> Option<Self> {
        NonZeroU32::new(index).map(Self)
    }

    /// One more than the index, or 0.
    #[inline(always)]
    pub fn successor(light: Option<Self>) -> u32 {
        light.map_or(0, |light| light.0.get())
    }

    /// Its place among [`Lights::all`](super::light::Lights::all).
    #[inline]
    pub fn index(self) -> usize {
        self.0.get() as usize - 1
    }
}

/// A medium: empty space, or a body, in the order of their priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MediumId(pub(super) u8);

impl MediumId {
    /// Empty space.
    pub const EMPTY: Self = Self(0);

    /// The first of the bodies whose bits are set, or empty space.
    #[inline]
    pub(super) fn first(bodies: u64) -> Self {
        Self(if bodies == 0 { 0 } else { bodies.trailing_zeros() as u8 + 1 })
    }

    /// Where a body has its bit.
    #[inline]
    pub(super) fn bit(self) -> usize {
        usize::from(self.0) - 1
    }

    /// The bits of bodies with that of this one set, or not.
    #[inline]
    pub(super) fn with(self, bits: u64, set: bool) -> u64 {
        (bits & !(1 << self.bit())) | (u64::from(set) << self.bit())
    }
}
