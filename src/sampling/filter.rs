//! Reconstruction filters.

use std::{f32::consts::TAU, fmt, str::FromStr};

/// A reconstruction filter h: non-negative, separable, and of integral 1 over the image, in 1/pixel².
///
/// Since its integral is 1, nothing is ever divided by a sum of its values, and a splat of a light path weighs the same
/// as a camera sample at the same place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// One pixel wide, constant.
    Box,
    /// Blackman–Harris, three pixels wide.
    BlackmanHarris,
}

impl Filter {
    /// Every filter.
    pub const ALL: [Self; 2] = [Self::Box, Self::BlackmanHarris];
    /// The number of pixels that the widest filter covers along one axis.
    pub const MAX_WIDTH: usize = 3;

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::BlackmanHarris => "blackman-harris",
        }
    }

    /// Half the width of the support along each axis, in pixels; a whole number and a half.
    #[inline]
    pub fn radius(self) -> f32 {
        self.padding() as f32 + 0.5
    }

    /// How many pixels beyond its own one a sample reaches on every side, which is also the padding that the
    /// sensor needs around the image so that its border pixels see their whole filter.
    #[inline]
    pub fn padding(self) -> u32 {
        match self {
            Self::Box => 0,
            Self::BlackmanHarris => 1,
        }
    }

    /// h at a distance of (`dx`, `dy`) pixels from a pixel's centre.
    #[inline]
    pub fn value(self, dx: f32, dy: f32) -> f32 {
        self.value_1d(dx) * self.value_1d(dy)
    }

    /// The factor of h along one axis: h(x, y) = w(x) w(y), ∫w = 1.
    #[inline]
    pub fn value_1d(self, d: f32) -> f32 {
        if d.abs() > self.radius() {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::BlackmanHarris => blackman_harris(d / (2.0 * self.radius())) / (2.0 * self.radius()),
        }
    }
}

/// The four-term Blackman–Harris window over |x| ≤ ½ (Harris 1978), divided by its integral: the cosines run over
/// whole periods, so that only a₀ is left of it.
#[inline]
fn blackman_harris(x: f32) -> f32 {
    const A: [f32; 4] = [0.358_75, 0.488_29, 0.141_28, 0.011_68];
    // cos 2φ and cos 3φ from cos φ.
    let c1 = (TAU * x).cos();
    let c2 = 2.0 * c1 * c1 - 1.0;
    let c3 = c1 * (2.0 * c2 - 1.0);
    // The window ends at 6e-5: rounding alone could carry it below zero.
    (1.0 + (A[1] * c1 + A[2] * c2 + A[3] * c3) / A[0]).max(0.0)
}

impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A filter's name was none of `box` and `blackman-harris`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a filter is 'box' or 'blackman-harris'")]
pub struct UnknownFilter;

impl FromStr for Filter {
    type Err = UnknownFilter;

    fn from_str(name: &str) -> Result<Self, UnknownFilter> {
        Self::ALL.into_iter().find(|f| f.name() == name).ok_or(UnknownFilter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_non_negative_and_integrate_to_one() {
        for filter in Filter::ALL {
            let n = 3000;
            let step = 4.0 / n as f32;
            let mut sum = 0.0_f64;
            for i in 0..n {
                let w = filter.value_1d(-2.0 + (i as f32 + 0.5) * step);
                assert!(w >= 0.0);
                sum += f64::from(w * step);
            }
            assert!((sum - 1.0).abs() < 1e-3, "{filter}: {sum}");
            assert_eq!(filter.value(filter.radius() + 1e-3, 0.0), 0.0);
            assert_eq!(filter.padding() as f32, (filter.radius() - 0.5).ceil());
            assert!(filter.padding() as usize * 2 < Filter::MAX_WIDTH);
        }
    }

    #[test]
    fn names_round_trip() {
        for filter in Filter::ALL {
            assert_eq!(filter.to_string().parse(), Ok(filter));
        }
        assert_eq!("gauss".parse::<Filter>(), Err(UnknownFilter));
    }
}
