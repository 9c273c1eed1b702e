//! Colours: linear RGB, a type of its own, so that no normal is taken for a radiance.

use std::{
    fmt,
    iter::Sum,
    ops::{Add, AddAssign, Div, DivAssign, Index, Mul, MulAssign, Sub, SubAssign},
};

use glam::{DVec3, Vec3};

/// Linear RGB with Rec. 709 primaries: a radiance (W/(m² sr) or nit), an importance or a reflectance per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Rgb(Vec3);

impl Rgb {
    /// Black, or nothing reflected.
    pub const ZERO: Self = Self(Vec3::ZERO);
    /// One in each channel.
    pub const ONE: Self = Self(Vec3::ONE);

    /// From its channels.
    #[inline(always)]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3::new(r, g, b))
    }

    /// The same in all channels.
    #[inline(always)]
    pub const fn splat(grey: f32) -> Self {
        Self(Vec3::splat(grey))
    }

    /// From its channels in the order r, g, b.
    #[inline(always)]
    pub const fn from_array(channels: [f32; 3]) -> Self {
        Self(Vec3::from_array(channels))
    }

    /// Its channels in the order r, g, b.
    #[inline(always)]
    pub const fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }

    /// Its channels in f64.
    #[inline]
    pub fn as_dvec3(self) -> DVec3 {
        self.0.as_dvec3()
    }

    /// The red channel.
    #[inline(always)]
    pub const fn r(self) -> f32 {
        self.0.x
    }

    /// The green channel.
    #[inline(always)]
    pub const fn g(self) -> f32 {
        self.0.y
    }

    /// The blue channel.
    #[inline(always)]
    pub const fn b(self) -> f32 {
        self.0.z
    }

    /// Rec. 709 luminance, in the colour's own unit.
    #[inline]
    pub fn luminance(self) -> f32 {
        self.0.dot(Vec3::new(0.212_639, 0.715_169, 0.072_192))
    }

    /// The largest channel.
    #[inline(always)]
    pub fn max_element(self) -> f32 {
        self.0.max_element()
    }

    /// The smallest channel.
    #[inline(always)]
    pub fn min_element(self) -> f32 {
        self.0.min_element()
    }

    /// The sum of the channels.
    #[inline(always)]
    pub fn element_sum(self) -> f32 {
        self.0.element_sum()
    }

    /// The larger of both, channel by channel.
    #[inline(always)]
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// The smaller of both, channel by channel.
    #[inline(always)]
    #[must_use]
    pub fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }

    /// Whether every channel is finite.
    #[inline(always)]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// Whether a channel is no number.
    #[inline(always)]
    pub fn is_nan(self) -> bool {
        self.0.is_nan()
    }

    /// The absolute value of each channel.
    #[inline(always)]
    #[must_use]
    pub fn abs(self) -> Self {
        Self(self.0.abs())
    }

    /// e to the power of each channel.
    #[inline(always)]
    #[must_use]
    pub fn exp(self) -> Self {
        Self(self.0.exp())
    }

    /// Between this and `other`, by `t` of the way.
    #[inline(always)]
    #[must_use]
    pub fn lerp(self, other: Self, t: f32) -> Self {
        Self(self.0.lerp(other.0, t))
    }

    /// `f` of each channel.
    #[inline(always)]
    #[must_use]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(self.0.map(f))
    }
}

impl From<DVec3> for Rgb {
    /// Rounds each channel.
    #[inline]
    fn from(channels: DVec3) -> Self {
        Self(channels.as_vec3())
    }
}

impl From<Vec3> for Rgb {
    #[inline(always)]
    fn from(channels: Vec3) -> Self {
        Self(channels)
    }
}

impl From<Rgb> for Vec3 {
    #[inline(always)]
    fn from(colour: Rgb) -> Self {
        colour.0
    }
}

impl fmt::Display for Rgb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Index<usize> for Rgb {
    type Output = f32;

    #[inline(always)]
    fn index(&self, channel: usize) -> &f32 {
        &self.0[channel]
    }
}

/// Operators between colours, and with what scales all channels.
macro_rules! operators {
    ($($Operator:ident $operator:ident $Assign:ident $assign:ident $Other:ty, |$other:ident| $of_other:expr;)*) => {$(
        impl $Operator<$Other> for Rgb {
            type Output = Self;

            #[inline(always)]
            fn $operator(self, $other: $Other) -> Self {
                Self(self.0.$operator($of_other))
            }
        }

        impl $Assign<$Other> for Rgb {
            #[inline(always)]
            fn $assign(&mut self, $other: $Other) {
                self.0.$assign($of_other);
            }
        }
    )*};
}

operators! {
    Add add AddAssign add_assign Rgb, |other| other.0;
    Sub sub SubAssign sub_assign Rgb, |other| other.0;
    Mul mul MulAssign mul_assign Rgb, |other| other.0;
    Div div DivAssign div_assign Rgb, |other| other.0;
    Mul mul MulAssign mul_assign f32, |scale| scale;
    Div div DivAssign div_assign f32, |scale| scale;
}

impl Mul<Rgb> for f32 {
    type Output = Rgb;

    #[inline(always)]
    fn mul(self, colour: Rgb) -> Rgb {
        Rgb(self * colour.0)
    }
}

impl Sum for Rgb {
    fn sum<I: Iterator<Item = Self>>(colours: I) -> Self {
        Self(colours.map(|colour| colour.0).sum())
    }
}

/// [`Rgb::luminance`].
#[inline]
pub fn luminance(colour: Rgb) -> f32 {
    colour.luminance()
}
