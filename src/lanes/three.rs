//! Vectors in lanes: three numbers of each.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Float, Lanes, Select, Vector};

/// A vector in each lane, by its coordinates. Roundings are those of glam's `Vec3`.
#[derive(Clone, Copy, Debug)]
pub struct Three<F> {
    /// Along x.
    pub x: F,
    /// Along y.
    pub y: F,
    /// Along z.
    pub z: F,
}

macro_rules! operators {
    ($($trait:ident $name:ident)*) => { $(
        impl<F: $trait<Output = F>> $trait for Three<F> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { x: self.x.$name(other.x), y: self.y.$name(other.y), z: self.z.$name(other.z) }
            }
        }
    )* };
    (by one: $($trait:ident $name:ident)*) => { $(
        impl<F: Copy + $trait<Output = F>> $trait<F> for Three<F> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: F) -> Self {
                Self { x: self.x.$name(other), y: self.y.$name(other), z: self.z.$name(other) }
            }
        }
    )* };
}

operators!(Add add Sub sub Mul mul);
operators!(by one: Mul mul Div div);

impl<F: Neg<Output = F>> Neg for Three<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<F: Float<Lanes: Lanes<V = Self>>> Vector for Three<F> {
    type Lanes = F::Lanes;
    type F = F;

    #[inline(always)]
    fn new(x: F, y: F, z: F) -> Self {
        Self { x, y, z }
    }
    #[inline(always)]
    fn coordinates(self) -> [F; 3] {
        [self.x, self.y, self.z]
    }
    #[inline(always)]
    fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
    #[inline(always)]
    fn normalize(self) -> Self {
        let length = self.dot(self).sqrt();
        self * (length.lanes().splat(1.0) / length)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }
    #[inline(always)]
    fn max_element(self) -> F {
        self.x.max(self.y).max(self.z)
    }
    #[inline(always)]
    fn min_element(self) -> F {
        self.x.min(self.y).min(self.z)
    }
}

impl<F, M: Copy + Select<F>> Select<Three<F>> for M {
    #[inline(always)]
    fn select(self, yes: Three<F>, no: Three<F>) -> Three<F> {
        Three { x: self.select(yes.x, no.x), y: self.select(yes.y, no.y), z: self.select(yes.z, no.z) }
    }
}
