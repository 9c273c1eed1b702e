//! How much light a rough interface sends on after one scattering, by direction: what its compensation has to replace.
//!
//! A GGX facet whose reflected or refracted light meets another facet loses it in the single-scattering model (Heitz
//! 2014), two thirds of all light at α = 1. The albedos of that model are known here, as tables that the test
//! `write_the_tables` computes:
//!
//! * one Schlick interface has E(μ) = F0·A(μ) + F90·B(μ), linear in F0 and F90, so that two tables over (μ, α) serve
//!   all of them;
//! * a boundary that refracts has a third parameter, η across it, and one table for either side.
//!
//! The tables hold 1 − E, scaled by what makes it nearly linear in the coordinates below, and the averages 2∫(1 − E)μ
//! dμ of what they interpolate, so that furnaces close up to the tables' own errors: 0.0008 for Schlick's interfaces,
//! and for boundaries 0.002 from the thin side and 0.003 from the dense one, for α from 1e-3 to 1 and all η; averages
//! add at most 0.001 (`tests`).

#[cfg(test)]
mod tests;

use super::{fresnel, microfacet::SMOOTH_ALPHA};

/// Where the light of a reflecting interface goes whose facets reflect everything, seen from one direction or averaged
/// over all. The three add up to 1.
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
        if alpha < SMOOTH_ALPHA { Self::new(0.0, fresnel::schlick_power(cos)) } else { TABLES.split(cos, alpha) }
    }

    /// The cosine-weighted mean over all directions.
    #[inline]
    pub fn average(alpha: f32) -> Self {
        if alpha < SMOOTH_ALPHA { Self::SMOOTH_AVERAGE } else { TABLES.average_split(alpha) }
    }
}

/// 1 − E of a rough boundary that reflects and refracts, from the direction of cosine `cos`; `eta` is η across over η
/// on its side.
#[inline]
pub(super) fn boundary_missing(cos: f32, alpha: f32, eta: f32) -> f32 {
    TABLES.boundary(cos, alpha, eta)
}

/// The cosine-weighted mean of [`boundary_missing`] over all directions of one side.
#[inline]
pub(super) fn boundary_missing_average(alpha: f32, eta: f32) -> f32 {
    TABLES.average_boundary(alpha, eta)
}

/// Numbers of entries: (μ, α) for Schlick's interfaces, (μ, α, η) for boundaries from the thin and from the dense side,
/// where lies the critical angle.
const SPLIT: [usize; 2] = [64, 40];
const BOUNDARY: [[usize; 3]; 2] = [[40, 20, 48], [56, 28, 76]];
/// And of averages, over α and over (α, η), with some between any two rows of the tables; over η, like them.
const SPLIT_AVERAGES: usize = 4 * (SPLIT[1] - 1) + 1;
const BOUNDARY_AVERAGES: [[usize; 2]; 2] = [[172, BOUNDARY[0][2]], [244, BOUNDARY[1][2]]];

/// Where each table begins, in entries: √(1 − E₁), B's deviation, the boundaries' 1 − E, and averages.
const DEVIATION: usize = SPLIT[0] * SPLIT[1];
const BOUNDARIES: [usize; 2] = [2 * DEVIATION, 2 * DEVIATION + size(BOUNDARY[0])];
const AVERAGES: usize = BOUNDARIES[1] + size(BOUNDARY[1]);
const GRAZING_AVERAGES: usize = AVERAGES + SPLIT_AVERAGES;
const AVERAGE_BOUNDARIES: [usize; 2] = {
    let first = GRAZING_AVERAGES + SPLIT_AVERAGES;
    [first, first + BOUNDARY_AVERAGES[0][0] * BOUNDARY_AVERAGES[0][1]]
};
const ENTRIES: usize = AVERAGE_BOUNDARIES[1] + BOUNDARY_AVERAGES[1][0] * BOUNDARY_AVERAGES[1][1];

const fn size([x, y, z]: [usize; 3]) -> usize {
    x * y * z
}

/// √[`SMOOTH_ALPHA`], glTF's roughness where the tables begin.
const LEAST_ROUGHNESS: f32 = 0.031_622_78;
const ROOT_OF_LEAST: f32 = 0.177_827_94;
/// The range of B's deviation: entries 0 … 1 stand for −`DEVIATION_RANGE` … `DEVIATION_RANGE`.
const DEVIATION_RANGE: f32 = 2.0;

/// 16-bit fractions of 1, little-endian.
struct Tables<'a> {
    bytes: &'a [u8; 2 * ENTRIES],
}

static TABLES: Tables<'static> = Tables { bytes: include_bytes!("albedo/tables.bin") };

/// The table of boundaries from the side on which η is seen across: 0 is the thin side.
#[inline]
fn side(eta: f32) -> usize {
    usize::from(eta < 1.0)
}

/// Where functions of a cosine or an index bend: at about α, and not above 0.1.
#[inline]
fn knee(alpha: f32) -> f32 {
    0.1 * alpha / (0.1 + alpha)
}

/// Mostly √(μ(1 + k)/(μ + k)), k the knee, where shadowing sets in, which so stays at the same place for all small α.
/// The rest is even in μ, for the critical angle.
#[inline]
fn direction_coordinate(cos: f32, alpha: f32) -> f32 {
    let k = knee(alpha);
    0.7 * (cos * (1.0 + k) / (cos + k)).sqrt() + 0.3 * cos
}

/// Partly roughness, √α, and partly its root, so that the albedos of smooth interfaces, which go as α², do not grow too
/// much from row to row; as a fraction of its range.
#[inline]
fn roughness_coordinate(roughness: f32) -> f32 {
    0.4 * (roughness - LEAST_ROUGHNESS) / (1.0 - LEAST_ROUGHNESS)
        + 0.6 * (roughness.sqrt() - ROOT_OF_LEAST) / (1.0 - ROOT_OF_LEAST)
}

/// q, q² = |η − 1|/(η + 1): from 0 to 1 for all η from 1 to 0 or ∞.
#[inline]
fn bend(eta: f32) -> f32 {
    ((eta - 1.0).abs() / (eta + 1.0)).sqrt()
}

/// Mostly q(1 + k)/(q + k), k the knee: where the boundary bends light by less than its slopes do, the albedo depends
/// on their ratio. The rest is even in q.
#[inline]
fn index_coordinate(q: f32, alpha: f32) -> f32 {
    let k = knee(alpha);
    0.7 * q * (1.0 + k) / (q + k) + 0.3 * q
}

/// At least 1 − E of any boundary of a row's roughness, so that entries resolve the small ones of nearly smooth
/// boundaries.
#[inline]
fn boundary_range(row: usize) -> f32 {
    [0.22, 0.36, 0.55, 0.8, 1.0][row.min(4)]
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
        Split::new(missing, (1.0 - missing) * (fresnel::schlick_power(cos) + deviation))
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
        let side = side(eta);
        let [nx, ny, nz] = BOUNDARY[side];
        let (i, u) = place(direction_coordinate(cos, alpha), nx);
        let (j, v) = place(roughness_coordinate(alpha.sqrt()), ny);
        let (k, w) = place(index_coordinate(bend(eta), alpha), nz);
        let at = BOUNDARIES[side] + (k * ny + j) * nx + i;
        let row = |next: usize| self.bilinear(at + next * nx, nx * ny, u, w) * boundary_range(j + next);
        let (a, b) = (row(0), row(1));
        a + (b - a) * v
    }

    #[inline(never)]
    fn average_boundary(&self, alpha: f32, eta: f32) -> f32 {
        let side = side(eta);
        let [nx, ny] = BOUNDARY_AVERAGES[side];
        let (j, v) = place(roughness_coordinate(alpha.sqrt()), nx);
        let (k, w) = place(index_coordinate(bend(eta), alpha), ny);
        let column = |k: usize| self.linear(AVERAGE_BOUNDARIES[side] + k * nx + j, v).powi(2) * alpha;
        let (a, b) = (column(k), column(k + 1));
        a + (b - a) * w
    }
}
