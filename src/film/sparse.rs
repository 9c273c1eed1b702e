//! What few pixels need, made where it is needed.

use std::{iter, sync::OnceLock};

/// A `T` for each pixel, of which pages of `PAGE` come into being when one of them is first written to. Nobody waits
/// for longer than that takes, and reading takes no lock.
pub(super) struct Sparse<T, const PAGE: usize>(Box<[OnceLock<Box<[T; PAGE]>>]>);

impl<T: Default, const PAGE: usize> Sparse<T, PAGE> {
    /// Bytes of a page.
    pub(super) const BYTES_PER_PAGE: u64 = size_of::<[T; PAGE]>() as u64;

    pub(super) fn new(pixels: usize) -> Self {
        Self(iter::repeat_with(OnceLock::new).take(pixels.div_ceil(PAGE)).collect())
    }

    /// That of a pixel, if its page is there.
    #[inline]
    pub(super) fn get(&self, pixel: usize) -> Option<&T> {
        self.0[pixel / PAGE].get().map(|page| &page[pixel % PAGE])
    }

    /// That of a pixel.
    #[inline]
    pub(super) fn get_or_make(&self, pixel: usize) -> &T {
        &self.0[pixel / PAGE].get_or_init(|| Box::new(std::array::from_fn(|_| T::default())))[pixel % PAGE]
    }

    /// What it takes without any page, in bytes.
    pub(super) fn empty_memory(pixels: u64) -> u64 {
        size_of::<OnceLock<Box<[T; PAGE]>>>() as u64 * pixels.div_ceil(PAGE as u64)
    }

    /// What its pages take, in bytes.
    pub(super) fn pages_memory(&self) -> u64 {
        Self::BYTES_PER_PAGE * self.0.iter().filter(|page| page.get().is_some()).count() as u64
    }
}
