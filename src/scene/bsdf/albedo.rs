//! How much light a rough interface sends on after one scattering, by direction: what its compensation has to replace.
//!
//! A GGX facet whose reflected or refracted light meets another facet loses it in the single-scattering model (Heitz 2014), two
//! thirds of all light at α = 1. The albedos of that model are known here, as tables that the test `write_the_tables` computes:
//!
//! * one Schlick interface has E(μ) = F0·A(μ) + F90·B(μ), linear in F0 and F90, so that two tables over (μ, α) serve all of them;
//! * a boundary that refracts has a third parameter, η across it, and one table for either side.
//!
//! The tables hold √(1 − E), which is nearly linear in the coordinates below, and the averages 2∫(1 − E)μ dμ of what they
//! interpolate, so that furnaces close up to the tables' own errors: 0.0015 for Schlick's interfaces and 0.003 for boundaries,
//! for α from 1e-3 to 1 and η from 1/4 to 4 (`tests`). Beyond that η the table's last values stand.

#[cfg(test)]
mod tests;

use super::{fresnel, microfacet::SMOOTH_ALPHA};

/// Where the light of a reflecting interface goes whose facets reflect everything, seen from one direction or averaged over all.
/// The three add up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    /// A: what is reflected at once for each unit of F0.
    pub normal: f32,
    /// B: what is reflected at once for each unit of F90.
    pub grazing: f32,
    /// 1 − E₁, E₁ = A + B: what meets another facet.
    pub missing: f32,
}

impl Split {
    /// Averages 2∫·μ dμ of a smooth interface: the mean of Schlick's (1 − μ)⁵ is 1/21.
    const SMOOTH_AVERAGE: Self = Self { normal: 20.0 / 21.0, grazing: 1.0 / 21.0, missing: 0.0 };

    #[inline]
    fn new(missing: f32, grazing: f32) -> Self {
        let grazing = grazing.clamp(0.0, 1.0 - missing);
        Self { normal: 1.0 - missing - grazing, grazing, missing }
    }

    /// The split from the direction of cosine `cos`; a mirror's for α below the least rough one.
    #[inline]
    pub fn towards(cos: f32, alpha: f32) -> Self {
        if alpha < SMOOTH_ALPHA { Self::new(0.0, fresnel::schlick_weight(cos)) } else { TABLES.split(cos, alpha) }
    }

    /// The cosine-weighted mean over all directions.
    #[inline]
    pub fn average(alpha: f32) -> Self {
        if alpha < SMOOTH_ALPHA { Self::SMOOTH_AVERAGE } else { TABLES.average_split(alpha) }
    }
}

/// 1 − E of a rough boundary that reflects and refracts, from the direction of cosine `cos`; `eta` is η across over η on its side.
#[inline]
pub(super) fn boundary_missing(cos: f32, alpha: f32, eta: f32) -> f32 {
    TABLES.boundary(cos, alpha, eta)
}

/// The cosine-weighted mean of [`boundary_missing`] over all directions of one side.
#[inline]
pub(super) fn boundary_missing_average(alpha: f32, eta: f32) -> f32 {
    TABLES.average_boundary(alpha, eta)
}

/// Numbers of entries: (μ, α) for Schlick's interfaces, (μ, α, η) for boundaries, and of averages over α and over (α, η).
const SPLIT: [usize; 2] = [64, 40];
const BOUNDARY: [usize; 3] = [24, 24, 32];
const SPLIT_AVERAGES: usize = 2 * SPLIT[1] - 1;
const BOUNDARY_AVERAGES: [usize; 2] = [2 * BOUNDARY[1] - 1, 2 * BOUNDARY[2] - 1];

/// Where each table begins, in entries: √(1 − E₁), B's deviation, √ of the boundary from the thin and from the dense side, and averages.
const DEVIATION: usize = SPLIT[0] * SPLIT[1];
const BOUNDARIES: usize = 2 * DEVIATION;
const BOUNDARY_SIZE: usize = BOUNDARY[0] * BOUNDARY[1] * BOUNDARY[2];
const AVERAGES: usize = BOUNDARIES + 2 * BOUNDARY_SIZE;
const GRAZING_AVERAGES: usize = AVERAGES + SPLIT_AVERAGES;
const AVERAGE_BOUNDARIES: usize = GRAZING_AVERAGES + SPLIT_AVERAGES;
const AVERAGE_BOUNDARY_SIZE: usize = BOUNDARY_AVERAGES[0] * BOUNDARY_AVERAGES[1];
const ENTRIES: usize = AVERAGE_BOUNDARIES + 2 * AVERAGE_BOUNDARY_SIZE;

/// The square of the largest coordinate (η − 1)/(η + 1) of η: 4 or 1/4.
const LARGEST_STEP: f32 = 0.6;
/// √[`SMOOTH_ALPHA`], glTF's roughness where the tables begin.
const LEAST_ROUGHNESS: f32 = 0.031_622_777;
/// The range of B's deviation: entries 0 … 1 stand for −`DEVIATION_RANGE` … `DEVIATION_RANGE`.
const DEVIATION_RANGE: f32 = 2.0;

/// 16-bit fractions of 1, little-endian.
struct Tables<'a> {
    bytes: &'a [u8; 2 * ENTRIES],
}

static TABLES: Tables<'static> = Tables { bytes: include_bytes!("albedo/tables.bin") };

/// √(μ(1 + α)/(μ + α)). Where μ is about α shadowing sets in: that place stays the same for all small α.
#[inline]
fn direction_coordinate(cos: f32, alpha: f32) -> f32 {
    (cos * (1.0 + alpha) / (cos + alpha)).sqrt()
}

/// Roughness, √α, as a fraction of its range.
#[inline]
fn roughness_coordinate(roughness: f32) -> f32 {
    (roughness - LEAST_ROUGHNESS) / (1.0 - LEAST_ROUGHNESS)
}

/// q(1 + α)/(q + α), q² the step (η − 1)/(η + 1) over the largest: where the boundary bends light by less than its slopes do, the
/// albedo depends on their ratio.
#[inline]
fn index_coordinate(eta: f32, alpha: f32) -> f32 {
    let q = ((eta - 1.0).abs() / ((eta + 1.0) * LARGEST_STEP)).sqrt().min(1.0);
    q * (1.0 + alpha) / (q + alpha)
}

/// The entry below the fraction `x` of `n` entries, and how far `x` lies towards the next.
#[inline]
fn place(x: f32, n: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (x as usize).min(n - 2);
    (i, x - i as f32)
}

impl Tables<'_> {
    #[inline]
    fn entry(&self, i: usize) -> f32 {
        f32::from(u16::from_le_bytes([self.bytes[2 * i], self.bytes[2 * i + 1]])) / 65535.0
    }

    #[inline]
    fn linear(&self, i: usize, u: f32) -> f32 {
        let (a, b) = (self.entry(i), self.entry(i + 1));
        a + (b - a) * u
    }

    #[inline]
    fn bilinear(&self, i: usize, row: usize, u: f32, v: f32) -> f32 {
        let (a, b) = (self.linear(i, u), self.linear(i + row, u));
        a + (b - a) * v
    }

    #[inline(never)]
    fn split(&self, cos: f32, alpha: f32) -> Split {
        let roughness = alpha.sqrt();
        let (i, u) = place(direction_coordinate(cos, alpha), SPLIT[0]);
        let (j, v) = place(roughness_coordinate(roughness), SPLIT[1]);
        let at = j * SPLIT[0] + i;
        let root = self.bilinear(at, SPLIT[0], u, v);
        let missing = root * root;
        let deviation = (2.0 * self.bilinear(DEVIATION + at, SPLIT[0], u, v) - 1.0) * DEVIATION_RANGE * roughness;
        Split::new(missing, (1.0 - missing) * (fresnel::schlick_weight(cos) + deviation))
    }

    #[inline(never)]
    fn average_split(&self, alpha: f32) -> Split {
        let roughness = alpha.sqrt();
        let (j, v) = place(roughness_coordinate(roughness), SPLIT_AVERAGES);
        let root = self.linear(AVERAGES + j, v) * roughness;
        Split::new(root * root, self.linear(GRAZING_AVERAGES + j, v))
    }

    #[inline(never)]
    fn boundary(&self, cos: f32, alpha: f32, eta: f32) -> f32 {
        let (i, u) = place(direction_coordinate(cos, alpha), BOUNDARY[0]);
        let (j, v) = place(roughness_coordinate(alpha.sqrt()), BOUNDARY[1]);
        let (k, w) = place(index_coordinate(eta, alpha), BOUNDARY[2]);
        let slice = BOUNDARY[0] * BOUNDARY[1];
        let at = BOUNDARIES + usize::from(eta < 1.0) * BOUNDARY_SIZE + k * slice + j * BOUNDARY[0] + i;
        let (a, b) = (self.bilinear(at, BOUNDARY[0], u, v), self.bilinear(at + slice, BOUNDARY[0], u, v));
        let root = a + (b - a) * w;
        root * root
    }

    #[inline(never)]
    fn average_boundary(&self, alpha: f32, eta: f32) -> f32 {
        let roughness = alpha.sqrt();
        let (j, v) = place(roughness_coordinate(roughness), BOUNDARY_AVERAGES[0]);
        let (k, w) = place(index_coordinate(eta, alpha), BOUNDARY_AVERAGES[1]);
        let side = AVERAGE_BOUNDARIES + usize::from(eta < 1.0) * AVERAGE_BOUNDARY_SIZE;
        let root = self.bilinear(side + k * BOUNDARY_AVERAGES[0] + j, BOUNDARY_AVERAGES[0], v, w) * roughness;
        root * root
    }
}
