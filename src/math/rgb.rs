//! Colours: linear RGB, a type of its own, so that no normal is taken for a radiance.

use std::{
    fmt,
    iter::Sum,
    ops::{Add, AddAssign, Div, DivAssign, Index, Mul, MulAssign, Sub, SubAssign},
};

use glam::{DVec3, Vec3};

use crate::lanes::{Float, Lanes, Select, Vector};

/// Linear RGB with Rec. 709 primaries: a radiance (W/(m² sr) or nit), an importance or a reflectance per channel. Its
/// channels are those of a vector, in one lane or in several.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Rgb<V = Vec3>(V);

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

impl<V: Vector> Rgb<V> {
    /// From its channels, as a vector's coordinates.
    #[inline(always)]
    pub fn of(channels: V) -> Self {
        Self(channels)
    }

    /// The same in all channels.
    #[inline(always)]
    pub fn grey(of_all: V::F) -> Self {
        Self(V::new(of_all, of_all, of_all))
    }

    /// Its channels, as a vector's coordinates.
    #[inline(always)]
    pub fn channels(self) -> V {
        self.0
    }

    /// The same, so many times as bright.
    #[inline(always)]
    #[must_use]
    pub fn times(self, scale: V::F) -> Self {
        Self(self.0 * scale)
    }

    /// `yes` where the condition holds, `no` elsewhere.
    #[inline(always)]
    pub fn select(which: <V::Lanes as Lanes>::M, yes: Self, no: Self) -> Self {
        Self(which.select(yes.0, no.0))
    }

    /// The largest channel.
    #[inline(always)]
    pub fn max_element(self) -> V::F {
        self.0.max_element()
    }

    /// The smallest channel.
    #[inline(always)]
    pub fn min_element(self) -> V::F {
        self.0.min_element()
    }

    /// Whether every channel is finite.
    #[inline(always)]
    pub fn is_finite(self) -> <V::Lanes as Lanes>::M {
        let [r, g, b] = self.0.abs().coordinates();
        let infinity = r.lanes().splat(f32::INFINITY);
        r.lt(infinity) & g.lt(infinity) & b.lt(infinity)
    }

    /// Whether every channel is zero.
    #[inline(always)]
    pub fn is_black(self) -> <V::Lanes as Lanes>::M {
        let [r, g, b] = self.0.coordinates();
        let zero = r.lanes().splat(0.0);
        r.eq(zero) & g.eq(zero) & b.eq(zero)
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

/// Operators between colours in any lanes.
macro_rules! in_lanes {
    ($($Operator:ident $operator:ident)*) => {$(
        impl<V: Vector> $Operator for Rgb<V> {
            type Output = Self;

            #[inline(always)]
            fn $operator(self, other: Self) -> Self {
                Self(self.0.$operator(other.0))
            }
        }
    )*};
}

/// Operators between a colour and a number or a colour.
macro_rules! operators {
    ($($Operator:ident $operator:ident $Other:ty, |$other:ident| $of_other:expr;)*) => {$(
        impl $Operator<$Other> for Rgb {
            type Output = Self;

            #[inline(always)]
            fn $operator(self, $other: $Other) -> Self {
                Self(self.0.$operator($of_other))
            }
        }
    )*};
}

/// The same that assign.
macro_rules! assigning {
    ($($Assign:ident $assign:ident $Other:ty, |$other:ident| $of_other:expr;)*) => {$(
        impl $Assign<$Other> for Rgb {
            #[inline(always)]
            fn $assign(&mut self, $other: $Other) {
                self.0.$assign($of_other);
            }
        }
    )*};
}

in_lanes!(Add add Sub sub Mul mul);

operators! {
    Div div Rgb, |other| other.0;
    Mul mul f32, |scale| scale;
    Div div f32, |scale| scale;
}

assigning! {
    AddAssign add_assign Rgb, |other| other.0;
    SubAssign sub_assign Rgb, |other| other.0;
    MulAssign mul_assign Rgb, |other| other.0;
    DivAssign div_assign Rgb, |other| other.0;
    MulAssign mul_assign f32, |scale| scale;
    DivAssign div_assign f32, |scale| scale;
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
