//! Reconstruction filters.

/// A reconstruction filter h: non-negative, separable, and of integral 1 over the image, in 1/pixel².
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// One pixel wide, constant.
    Box,
    /// Blackman–Harris, three pixels wide.
    BlackmanHarris,
}
