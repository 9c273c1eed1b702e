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
use crate::lanes::{Float, Lanes, Mask, Select, Unsigned};

/// Where the light of a reflecting interface goes whose facets reflect everything, seen from one direction or averaged
/// over all. The three add up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split<F = f32> {
    /// A: what is reflected at once for each unit of F0.
    pub normal: F,
    /// B: what is reflected at once for each unit of F90.
    pub grazing: F,
    /// 1 − E₁, E₁ = A + B: what meets another facet.
    pub missing: F,
}

/// Averages 2∫·μ dμ of a smooth interface: the mean of Schlick's (1 − μ)⁵ is 1/21.
const SMOOTH_AVERAGE: [f32; 2] = [20.0 / 21.0, 1.0 / 21.0];

impl<F: Float> Split<F> {
    #[inline(always)]
    fn new(missing: F, grazing: F) -> Self {
        let (zero, one) = (missing.lanes().splat(0.0), missing.lanes().splat(1.0));
        let grazing = grazing.max(zero).min(one - missing);
        Self { normal: one - missing - grazing, grazing, missing }
    }

    /// The split from the direction of cosine `cos`; a mirror's for α below the least rough one.
    #[inline(always)]
    pub fn towards(cos: F, alpha: F) -> Self {
        let lanes = alpha.lanes();
        let rough = !alpha.lt(lanes.splat(SMOOTH_ALPHA));
        let mirror = Self::new(lanes.splat(0.0), fresnel::schlick_power(cos));
        if rough.any() { Self::select(rough, TABLES.split(cos, alpha), mirror) } else { mirror }
    }

    /// The cosine-weighted mean over all directions.
    #[inline(always)]
    pub fn average(alpha: F) -> Self {
        let lanes = alpha.lanes();
        let rough = !alpha.lt(lanes.splat(SMOOTH_ALPHA));
        let [normal, grazing] = [lanes.splat(SMOOTH_AVERAGE[0]), lanes.splat(SMOOTH_AVERAGE[1])];
        let mirror = Self { normal, grazing, missing: lanes.splat(0.0) };
        if rough.any() { Self::select(rough, TABLES.average_split(alpha), mirror) } else { mirror }
    }

    #[inline(always)]
    fn select(which: <F::Lanes as Lanes>::M, yes: Self, no: Self) -> Self {
        Self {
            normal: which.select(yes.normal, no.normal),
            grazing: which.select(yes.grazing, no.grazing),
            missing: which.select(yes.missing, no.missing),
        }
    }
}

/// 1 − E of a rough boundary that reflects and refracts, from the direction of cosine `cos`; `eta` is η across over η
/// on its side.
#[inline(always)]
pub(super) fn boundary_missing<F: Float>(cos: F, alpha: F, eta: F) -> F {
    TABLES.boundary(cos, alpha, eta)
}

/// The cosine-weighted mean of [`boundary_missing`] over all directions of one side.
#[inline(always)]
pub(super) fn boundary_missing_average<F: Float>(alpha: F, eta: F) -> F {
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

/// Where the table is that of boundaries from the dense side, the second one.
#[inline(always)]
fn is_dense<F: Float>(eta: F) -> <F::Lanes as Lanes>::M {
    eta.lt(eta.lanes().splat(1.0))
}

/// Of what either side has, that of the dense one where the condition holds.
#[inline(always)]
fn of_side<L: Lanes>(lanes: L, dense: L::M, [a, b]: [usize; 2]) -> L::U {
    dense.select(lanes.splat_u(b as u32), lanes.splat_u(a as u32))
}

/// Where functions of a cosine or an index bend: at about α, and not above 0.1.
#[inline(always)]
fn knee<F: Float>(alpha: F) -> F {
    alpha * 0.1 / (alpha.lanes().splat(0.1) + alpha)
}

/// Mostly √(μ(1 + k)/(μ + k)), k the knee, where shadowing sets in, which so stays at the same place for all small α.
/// The rest is even in μ, for the critical angle.
#[inline(always)]
fn direction_coordinate<F: Float>(cos: F, alpha: F) -> F {
    let (k, one) = (knee(alpha), alpha.lanes().splat(1.0));
    (cos * (one + k) / (cos + k)).sqrt() * 0.7 + cos * 0.3
}

/// Partly roughness, √α, and partly its root, so that the albedos of smooth interfaces, which go as α², do not grow too
/// much from row to row; as a fraction of its range.
#[inline(always)]
fn roughness_coordinate<F: Float>(roughness: F) -> F {
    let lanes = roughness.lanes();
    let (least, range) = (lanes.splat(LEAST_ROUGHNESS), lanes.splat(1.0 - LEAST_ROUGHNESS));
    let (least_root, range_of_roots) = (lanes.splat(ROOT_OF_LEAST), lanes.splat(1.0 - ROOT_OF_LEAST));
    (roughness - least) * 0.4 / range + (roughness.sqrt() - least_root) * 0.6 / range_of_roots
}

/// q, q² = |η − 1|/(η + 1): from 0 to 1 for all η from 1 to 0 or ∞.
#[inline(always)]
fn bend<F: Float>(eta: F) -> F {
    let one = eta.lanes().splat(1.0);
    ((eta - one).abs() / (eta + one)).sqrt()
}

/// Mostly q(1 + k)/(q + k), k the knee: where the boundary bends light by less than its slopes do, the albedo depends
/// on their ratio. The rest is even in q.
#[inline(always)]
fn index_coordinate<F: Float>(q: F, alpha: F) -> F {
    let (k, one) = (knee(alpha), alpha.lanes().splat(1.0));
    q * 0.7 * (one + k) / (q + k) + q * 0.3
}

/// At least 1 − E of any boundary of a row's roughness, so that entries resolve the small ones of nearly smooth
/// boundaries.
#[inline(always)]
fn boundary_range<U: Unsigned>(row: U) -> <U::Lanes as Lanes>::F {
    let lanes = row.lanes();
    let mut range = lanes.splat(1.0);
    for (i, of_row) in [0.22, 0.36, 0.55, 0.8].into_iter().enumerate() {
        range = row.eq(lanes.splat_u(i as u32)).select(lanes.splat(of_row), range);
    }
    range
}

/// The number of the entry below the fraction `x` of `n` entries, and how far `x` lies towards the next.
#[inline(always)]
fn place<F: Float>(x: F, n: <F::Lanes as Lanes>::U) -> (<F::Lanes as Lanes>::U, F) {
    let (zero, one) = (x.lanes().splat(0.0), x.lanes().splat(1.0));
    let last = n.to_f32() - one;
    let x = x.max(zero).min(one) * last;
    let i = whole(x.min(last - one));
    (i, x - i.to_f32())
}

/// The whole part of numbers below 2²².
#[inline(always)]
fn whole<F: Float>(x: F) -> <F::Lanes as Lanes>::U {
    let lanes = x.lanes();
    // What is added leaves no digits behind the point: this is the nearest one.
    let nearest = (x + lanes.splat(8_388_608.0)).to_bits() & lanes.splat_u(0x3f_ffff);
    let below = nearest.wrapping_add(lanes.splat_u(u32::MAX));
    x.lt(nearest.to_f32()).select(below, nearest)
}

/// n/65535, rounded once: n/2¹⁶ has no rounding, and what it lacks is far below the last digit.
#[inline(always)]
fn fraction<U: Unsigned>(n: U) -> <U::Lanes as Lanes>::F {
    const LACKS: f32 = 1.0 / (65_536.0 * 65_535.0);
    let n = n.to_f32();
    n * (1.0 / 65_536.0) + n * LACKS
}

/// `rows` · `row` + `first`.
#[inline(always)]
fn offset<U: Unsigned>(rows: U, row: U, first: U) -> U {
    rows.wrapping_mul(row).wrapping_add(first)
}

impl Tables<'_> {
    /// Two entries side by side.
    #[inline(always)]
    fn pair(&self, i: u32) -> u32 {
        let pair = &self.bytes[2 * i as usize..2 * i as usize + 4];
        u32::from_le_bytes([pair[0], pair[1], pair[2], pair[3]])
    }

    #[inline(always)]
    fn linear<F: Float>(&self, i: <F::Lanes as Lanes>::U, u: F) -> F {
        let (lanes, i) = (u.lanes(), i.all());
        let pairs = lanes.whole_numbers(|k| self.pair(i[k]));
        let (a, b) = (fraction(pairs & lanes.splat_u(0xffff)), fraction(pairs >> 16));
        a + (b - a) * u
    }

    #[inline(always)]
    fn bilinear<F: Float>(&self, i: <F::Lanes as Lanes>::U, row: <F::Lanes as Lanes>::U, [u, v]: [F; 2]) -> F {
        let (a, b) = (self.linear(i, u), self.linear(i.wrapping_add(row), u));
        a + (b - a) * v
    }

    #[inline(always)]
    fn split<F: Float>(&self, cos: F, alpha: F) -> Split<F> {
        let (lanes, roughness) = (alpha.lanes(), alpha.sqrt());
        let [nx, ny] = [lanes.splat_u(SPLIT[0] as u32), lanes.splat_u(SPLIT[1] as u32)];
        let (i, u) = place(direction_coordinate(cos, alpha), nx);
        let (j, v) = place(roughness_coordinate(roughness), ny);
        let at = offset(j, nx, i);
        let root = self.bilinear(at, nx, [u, v]);
        let (missing, one) = (root * root, lanes.splat(1.0));
        let deviation = self.bilinear(at.wrapping_add(lanes.splat_u(DEVIATION as u32)), nx, [u, v]);
        let deviation = (deviation * 2.0 - one) * DEVIATION_RANGE * roughness;
        Split::new(missing, (one - missing) * (fresnel::schlick_power(cos) + deviation))
    }

    #[inline(always)]
    fn average_split<F: Float>(&self, alpha: F) -> Split<F> {
        let (lanes, roughness) = (alpha.lanes(), alpha.sqrt());
        let (j, v) = place(roughness_coordinate(roughness), lanes.splat_u(SPLIT_AVERAGES as u32));
        let root = self.linear(j.wrapping_add(lanes.splat_u(AVERAGES as u32)), v) * roughness;
        Split::new(root * root, self.linear(j.wrapping_add(lanes.splat_u(GRAZING_AVERAGES as u32)), v))
    }

    #[inline(always)]
    fn boundary<F: Float>(&self, cos: F, alpha: F, eta: F) -> F {
        let (lanes, dense) = (alpha.lanes(), is_dense(eta));
        let [nx, ny, nz] = [
            of_side(lanes, dense, [BOUNDARY[0][0], BOUNDARY[1][0]]),
            of_side(lanes, dense, [BOUNDARY[0][1], BOUNDARY[1][1]]),
            of_side(lanes, dense, [BOUNDARY[0][2], BOUNDARY[1][2]]),
        ];
        let (i, u) = place(direction_coordinate(cos, alpha), nx);
        let (j, v) = place(roughness_coordinate(alpha.sqrt()), ny);
        let (k, w) = place(index_coordinate(bend(eta), alpha), nz);
        let at = offset(offset(k, ny, j), nx, i).wrapping_add(of_side(lanes, dense, BOUNDARIES));
        let (layer, next) = (nx.wrapping_mul(ny), j.wrapping_add(lanes.splat_u(1)));
        let a = self.bilinear(at, layer, [u, w]) * boundary_range(j);
        let b = self.bilinear(at.wrapping_add(nx), layer, [u, w]) * boundary_range(next);
        a + (b - a) * v
    }

    #[inline(always)]
    fn average_boundary<F: Float>(&self, alpha: F, eta: F) -> F {
        let (lanes, dense) = (alpha.lanes(), is_dense(eta));
        let nx = of_side(lanes, dense, [BOUNDARY_AVERAGES[0][0], BOUNDARY_AVERAGES[1][0]]);
        let ny = of_side(lanes, dense, [BOUNDARY_AVERAGES[0][1], BOUNDARY_AVERAGES[1][1]]);
        let (j, v) = place(roughness_coordinate(alpha.sqrt()), nx);
        let (k, w) = place(index_coordinate(bend(eta), alpha), ny);
        let at = offset(k, nx, j).wrapping_add(of_side(lanes, dense, AVERAGE_BOUNDARIES));
        let (a, b) = (self.linear(at, v), self.linear(at.wrapping_add(nx), v));
        let (a, b) = (a * a * alpha, b * b * alpha);
        a + (b - a) * w
    }
}
