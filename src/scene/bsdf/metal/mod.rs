//! Metals whose η and κ were measured, as reflectances by angle in linear Rec. 709.
//!
//! F(θ) of a channel is ∫ F(λ, θ) c(λ) dλ: the exact reflectance of a conductor for unpolarised light, and the
//! channel's response c to a white surface under D65, divided by its integral. So a constant reflectance stays that
//! constant, and a smooth metal has the colour that a spectral renderer would show under D65. Other light, and light
//! that several metals have reflected, is what three channels make of it.
//!
//! The red of gold lies outside of the space, by 0.035 at normal incidence: channels are brought into [0, 1], or light
//! would be gained. η and κ are linear between the wavelengths of the table, and F is between
//! 257 cosines.

mod data;
#[cfg(test)]
mod tests;

use std::sync::LazyLock;

use glam::DVec3;

use self::data::METALS;
use crate::{
    math::Rgb,
    scene::wavelength::{colour_matching, rec709},
};

/// A metal of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Metal(u8);

impl Metal {
    /// The metal with this chemical symbol, if its η and κ are known here.
    pub fn named(symbol: &str) -> Option<Self> {
        METALS.iter().position(|(name, _)| *name == symbol).map(|i| Self(i as u8))
    }

    /// All of them, by symbol.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..METALS.len() as u8).map(Self)
    }

    /// Its chemical symbol.
    pub fn symbol(self) -> &'static str {
        METALS[usize::from(self.0)].0
    }

    /// Reflectance at a smooth place in air that light meets with this cosine, for each channel in [0, 1]: see the
    /// module.
    #[inline]
    pub fn reflectance(self, cos: f32) -> Rgb {
        self.table().at(cos)
    }

    /// Its mean over the cosine-weighted hemisphere.
    #[inline]
    pub fn mean(self) -> Rgb {
        self.table().mean
    }

    /// Its number among all.
    pub(super) fn index(self) -> u8 {
        self.0
    }

    /// That of this number.
    pub(super) fn of_index(index: u8) -> Self {
        Self(index.min(METALS.len() as u8 - 1))
    }

    #[inline]
    fn table(self) -> &'static Table {
        static TABLES: LazyLock<Vec<Table>> =
            LazyLock::new(|| METALS.iter().map(|(_, data)| Table::new(data)).collect());
        &TABLES[usize::from(self.0)]
    }
}

/// So many cosines, evenly from 0 to 1.
const NODES: usize = 257;

/// The reflectance of a metal by cosine.
struct Table {
    at: [Rgb; NODES],
    mean: Rgb,
}

impl Table {
    fn new(data: &[[f64; 3]]) -> Self {
        let spectrum = spectrum(data);
        let of = |cos: f64| {
            let sum: DVec3 = spectrum.iter().map(|&(response, eta, k)| response * conductor(cos, eta, k)).sum();
            Rgb::from(sum.clamp(DVec3::ZERO, DVec3::ONE))
        };
        let at: [Rgb; NODES] = std::array::from_fn(|i| of(i as f64 / (NODES - 1) as f64));
        // ∫ F 2 cos d cos by the trapezoid rule.
        let last = (NODES - 1) as f32;
        let weight = |i: usize| 2.0 * i as f32 / (last * last) * if i == NODES - 1 { 0.5 } else { 1.0 };
        let mean = (0..NODES).map(|i| at[i] * weight(i)).sum();
        Self { at, mean }
    }

    #[inline]
    fn at(&self, cos: f32) -> Rgb {
        let x = cos.clamp(0.0, 1.0) * (NODES - 1) as f32;
        let i = (x as usize).min(NODES - 2);
        self.at[i].lerp(self.at[i + 1], x - i as f32)
    }
}

/// The unpolarised reflectance, in air, of a conductor of the complex index η + iκ (Fresnel's equations; Born & Wolf,
/// *Principles of Optics*, 14.2).
fn conductor(cos: f64, eta: f64, k: f64) -> f64 {
    let (cos2, sin2) = (cos * cos, 1.0 - cos * cos);
    let (eta2, k2) = (eta * eta, k * k);
    let real = eta2 - k2 - sin2;
    // a² + b² and 2 a cos θ, where a + ib = √((η + iκ)² − sin² θ).
    let square = (real * real + 4.0 * eta2 * k2).sqrt();
    let a = (0.5 * (square + real)).max(0.0).sqrt();
    let s = (square + cos2 - 2.0 * a * cos) / (square + cos2 + 2.0 * a * cos);
    let (even, odd) = (cos2 * square + sin2 * sin2, 2.0 * a * cos * sin2);
    let p = s * (even - odd) / (even + odd);
    0.5 * (s + p)
}

/// At wavelengths 5 nm apart what each channel makes of them under D65, with the sum (1, 1, 1), and η and κ there.
fn spectrum(data: &[[f64; 3]]) -> Vec<(DVec3, f64, f64)> {
    let wavelengths = || (0..=80_u8).map(|i| 380.0 + 5.0 * f64::from(i));
    let response = |nm: f64| rec709(colour_matching(nm)) * d65(nm);
    let white: DVec3 = wavelengths().map(response).sum();
    let at = |nm: f64| {
        let i = data.partition_point(|[place, ..]| *place <= nm).clamp(1, data.len() - 1);
        let ([a, eta_a, k_a], [b, eta_b, k_b]) = (data[i - 1], data[i]);
        let t = (nm - a) / (b - a);
        (response(nm) / white, eta_a + (eta_b - eta_a) * t, k_a + (k_b - k_a) * t)
    };
    wavelengths().map(at).collect()
}

/// The relative power of CIE's standard illuminant D65 (CIE S 014-2), linear between multiples of 10 nm.
fn d65(nm: f64) -> f64 {
    const POWER: [f64; 41] = [
        49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811,
        109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062, 89.5991,
        87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856,
        75.087, 63.5927, 46.4182, 66.8054, 63.3828,
    ];
    let x = ((nm - 380.0) / 10.0).clamp(0.0, 40.0);
    let i = (x as usize).min(39);
    POWER[i] + (POWER[i + 1] - POWER[i]) * (x - i as f64)
}
