//! Environment maps: radiance from infinitely far away, by direction, and its importance sampling.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, TAU};

use glam::{Vec2, Vec3};

use super::BRIGHTEST;
use crate::{
    math::{Rgb, luminance},
    sampling::{Choice, PdfSolidAngle, divide, find},
};

/// An equirectangular map of radiance.
///
/// # Convention
/// As in Blender and three.js after their glTF import: +y is up, the first row is around +y, the middle of the map
/// shows what lies towards +x, and to its right comes +z: with u rightwards and v downwards in [0, 1], u = ½ + atan2(z,
/// x)/2π and v = acos(y)/π. So −z, the direction in which a glTF camera looks, is at u = ¼, and nothing is mirrored. A
/// rotation turns the map about +y by the right-hand rule: with 90°, what was towards +z comes from +x.
///
/// # Interpolation
/// Between the texels' centres radiance is bilinear in longitude and in *cos θ* (θ from +y), across the seam as
/// elsewhere, and constant above the first row of centres and below the last. In these coordinates solid angle is
/// uniform, so directions can be sampled *exactly* in proportion to the interpolated luminance Y: p(ω) = Y(L(ω)) /
/// ∫Y(L) dω, positive exactly where the radiance is, and bounded at the poles as well. L/p is then constant for a grey
/// map.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    width: usize,
    height: usize,
    /// Row by row from the top.
    texels: Vec<Rgb>,
    /// 1 − cos θ at the centres of the rows.
    from_pole: Vec<f32>,
    /// (cos, sin) of the rotation about +y.
    rotation: Vec2,
    /// Where a choice's integers of each band begin: above the first row of centres, between rows, below the last.
    bands: Vec<u64>,
    /// For each band those of its cells, from each column's centre to that of the next. 64 bits for each, so that no
    /// texel hides another: an f32 has nothing left beside one that is 10⁷ times as bright.
    cells: Vec<u64>,
    /// ∫ Y(L) dω.
    integral: f32,
    /// 1/∫ Y(L) dω, or zero if the map is black.
    inverse_integral: f32,
    brightest: f32,
}

/// A texel that is not a radiance: a channel is negative, infinite, undefined or above 10³⁰.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotARadiance {
    /// Its column, from 0 at the left.
    pub x: usize,
    /// Its row, from 0 at the top.
    pub y: usize,
    /// What stands there.
    pub value: Rgb,
}

/// Where a direction falls: between two rows and two columns of centres.
struct Between {
    rows: [usize; 2],
    columns: [usize; 2],
    /// How far from the first column to the second.
    right: f32,
    /// How far from the first row, the one nearer its pole, to the second.
    down: f32,
}

impl EnvironmentMap {
    /// A map of `width` columns, from its `texels` row by row from the top, turned by `rotation` radians about +y.
    ///
    /// # Errors
    /// The first texel with a channel outside of 0 … 10³⁰.
    ///
    /// # Panics
    /// Without a texel, or if the last row is not full.
    pub fn new(width: usize, texels: Vec<Rgb>, rotation: f32) -> Result<Self, NotARadiance> {
        assert!(!texels.is_empty() && texels.len().is_multiple_of(width), "a map of {width} × {} texels", texels.len());
        let height = texels.len() / width;
        if let Some(i) = texels.iter().position(|t| !t.to_array().iter().all(|c| (0.0..=BRIGHTEST).contains(c))) {
            return Err(NotARadiance { x: i % width, y: i / width, value: texels[i] });
        }
        let brightest = texels.iter().map(|t| t.max_element()).fold(0.0, f32::max);

        let angle = |row: usize| std::f64::consts::PI * (row as f64 + 0.5) / height as f64;
        let from_pole: Vec<_> = (0..height).map(|row| 2.0 * (0.5 * angle(row)).sin().powi(2)).collect();
        let (sin, cos) = f64::from(rotation).sin_cos();
        let mut map = Self {
            width,
            height,
            texels,
            from_pole: from_pole.iter().map(|h| *h as f32).collect(),
            rotation: Vec2::new(cos as f32, sin as f32),
            bands: Vec::with_capacity(height + 1),
            cells: Vec::with_capacity((height + 1) * width),
            integral: 0.0,
            inverse_integral: 0.0,
            brightest,
        };
        map.integrate(&from_pole);
        Ok(map)
    }

    /// Fills in the integral and the distributions over cells and bands.
    fn integrate(&mut self, from_pole: &[f64]) {
        let mut band_integrals = Vec::with_capacity(self.height + 1);
        let mut cells = Vec::with_capacity(self.width);
        for band in 0..=self.height {
            let [upper, lower] = self.rows_of(band);
            // The mean of a bilinear function is that of its corners; first sums of pairs of rows, then of neighbours.
            let column = |i: usize| f64::from(self.luminance(upper, i)) + f64::from(self.luminance(lower, i));
            cells.clear();
            cells.extend((0..self.width).map(|i| 0.25 * (column(i) + column((i + 1) % self.width))));
            divide(&cells, &mut self.cells);
            let sum: f64 = cells.iter().sum();
            let top = if band == 0 { 0.0 } else { from_pole[band - 1] };
            let bottom = if band == self.height { 2.0 } else { from_pole[band] };
            band_integrals.push(sum * (bottom - top) * std::f64::consts::TAU / self.width as f64);
        }
        divide(&band_integrals, &mut self.bands);
        let integral: f64 = band_integrals.iter().sum();
        self.integral = integral as f32;
        self.inverse_integral = if integral > 0.0 { integral.recip() as f32 } else { 0.0 };
    }

    /// L from the unit direction `w` towards the map.
    #[inline]
    pub fn radiance(&self, w: Vec3) -> Rgb {
        let Between { rows: [near, far], columns: [i, j], right, down } = self.between(self.to_map(w));
        let texel = |row: usize, column: usize| self.texels[row * self.width + column];
        let first = texel(near, i) * (1.0 - right) + texel(near, j) * right;
        let second = texel(far, i) * (1.0 - right) + texel(far, j) * right;
        first * (1.0 - down) + second * down
    }

    /// The density of [`EnvironmentMap::sample`]: Y(L(ω)) / ∫Y(L) dω.
    #[inline]
    pub fn pdf(&self, w: Vec3) -> PdfSolidAngle {
        PdfSolidAngle(luminance(self.radiance(w)) * self.inverse_integral)
    }

    /// A unit direction towards the map, in proportion to luminance: a band by the second choice, a cell of it by the
    /// first, and a place in the cell from what they leave.
    #[inline]
    pub fn sample(&self, [x, y]: [Choice; 2]) -> Vec3 {
        let (band, v) = find(&self.bands, y);
        let (column, h) = find(&self.cells[band * self.width..][..self.width], x);
        let (v, h) = (v.rest().unit(), h.rest().unit());
        let next = if column + 1 == self.width { 0 } else { column + 1 };
        let [upper, lower] = self.rows_of(band);
        let corner = |row, column| self.luminance(row, column);
        let (a, b, c, d) = (corner(upper, column), corner(upper, next), corner(lower, column), corner(lower, next));
        let down = linear(v, a + b, c + d);
        let right = linear(h, a + (c - a) * down, b + (d - b) * down);

        // 1 − |cos θ|, from the nearer pole: there is no other way to tell directions close to it apart.
        let north = 2 * band <= self.height;
        let (band, down) = if north { (band, down) } else { (self.height - band, 1.0 - down) };
        let near = if band == 0 { 0.0 } else { self.from_pole[band - 1] };
        let below_one = near + (self.from_pole[band] - near) * down;
        let sin = (below_one * (2.0 - below_one)).max(0.0).sqrt();
        let cos = if north { 1.0 - below_one } else { below_one - 1.0 };
        let longitude = TAU * ((column as f32 + 0.5 + right) / self.width as f32 - 0.5);
        let (z, x) = longitude.sin_cos();
        self.to_world(Vec3::new(sin * x, cos, sin * z))
    }

    /// ∫ Y(L) dω: the power per m² of a disk that faces all of it in turn, W/m² or lux.
    pub fn integral(&self) -> f32 {
        self.integral
    }

    /// The largest channel of all texels.
    pub fn brightest(&self) -> f32 {
        self.brightest
    }

    #[inline]
    fn luminance(&self, row: usize, column: usize) -> f32 {
        luminance(self.texels[row * self.width + column])
    }

    /// The rows of centres above and below a band; outside of them there is but one.
    #[inline]
    fn rows_of(&self, band: usize) -> [usize; 2] {
        [band.saturating_sub(1), band.min(self.height - 1)]
    }

    #[inline]
    fn between(&self, w: Vec3) -> Between {
        let sin2 = w.x * w.x + w.z * w.z;
        let theta = sin2.sqrt().atan2(w.y.abs()).min(FRAC_PI_2);
        let place = theta * FRAC_1_PI * self.height as f32 - 0.5;
        let (rows, down) = if place < 0.0 {
            ([0, 0], 0.0)
        } else {
            let near = place as usize;
            let far = (near + 1).min(self.height - 1);
            let (a, b) = (self.from_pole[near], self.from_pole[far]);
            let below_one = sin2 / (1.0 + w.y.abs());
            ([near, far], if far > near { ((below_one - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 })
        };
        let rows = if w.y >= 0.0 { rows } else { rows.map(|row| self.height - 1 - row) };
        let place = (w.z.atan2(w.x) * (FRAC_1_PI * 0.5) + 0.5) * self.width as f32 - 0.5;
        let left = place.floor();
        let i = if left < 0.0 { self.width - 1 } else { (left as usize).min(self.width - 1) };
        let j = if i + 1 == self.width { 0 } else { i + 1 };
        Between { rows, columns: [i, j], right: place - left, down }
    }

    #[inline]
    fn to_map(&self, w: Vec3) -> Vec3 {
        let Vec2 { x: cos, y: sin } = self.rotation;
        Vec3::new(cos * w.x - sin * w.z, w.y, sin * w.x + cos * w.z)
    }

    #[inline]
    fn to_world(&self, w: Vec3) -> Vec3 {
        let Vec2 { x: cos, y: sin } = self.rotation;
        Vec3::new(cos * w.x + sin * w.z, w.y, cos * w.z - sin * w.x)
    }
}

/// A number in [0, 1] with a density that is linear from `a` at 0 to `b` at 1 (up to their common scale).
#[inline]
pub(super) fn linear(u: f32, a: f32, b: f32) -> f32 {
    let sum = a + b;
    // Rounding may choose a place between two black texels: there, any point is as good.
    if sum <= 0.0 {
        return u;
    }
    let (a, b) = (a / sum, b / sum);
    // The inverse of a x + (b − a) x²/2, over (a + b)/2 = ½.
    u / (a + (a * a + (b - a) * u).max(f32::MIN_POSITIVE).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Remainder, Square};

    /// A map in which one texel outshines the others by `sun`: they differ by a factor of four, and a row is a
    /// hundredth of that.
    fn beside(sun: f32) -> EnvironmentMap {
        let (width, height) = (24, 12);
        let mut texels: Vec<_> = (0..width * height)
            .map(|i| Rgb::splat((1.0 + 0.1 * (i * 7 % 31) as f32) * if i / width == 8 { 0.01 } else { 1.0 }))
            .collect();
        texels[3 * width + 10] = Rgb::splat(sun);
        EnvironmentMap::new(width, texels, 0.4).unwrap()
    }

    /// Every share of the integers of a table, in order: where it begins, and how many there are.
    fn shares(begins: &[u64]) -> Vec<(u64, u64)> {
        let (mut shares, mut begin) = (vec![], 0);
        while begin < Choice::COUNT {
            let (i, place) = find(begins, Choice::new(begin));
            assert_eq!((i, place), (shares.len(), Remainder::new(0, place.width())));
            shares.push((begin, place.width()));
            begin += place.width();
        }
        shares
    }

    #[test]
    fn every_cell_beside_a_sun_has_choices_in_proportion_to_its_light() {
        for sun in [1.0, 1e10, 1e15] {
            let map = beside(sun);
            let (w, h) = (map.width, map.height);
            let bands = shares(&map.bands);
            assert_eq!(bands.len(), h + 1);
            for (band, (first, width)) in bands.into_iter().enumerate() {
                let cells = shares(&map.cells[band * w..][..w]);
                assert_eq!(cells.len(), w);
                let [upper, lower] = map.rows_of(band);
                let angle = |row: usize| std::f64::consts::PI * (row as f64 + 0.5) / h as f64;
                let (top, bottom) = (
                    if band == 0 { 1.0 } else { angle(band - 1).cos() },
                    if band == h { -1.0 } else { angle(band).cos() },
                );
                for (column, (begin, count)) in cells.into_iter().enumerate() {
                    let next = (column + 1) % w;
                    let corners = [(upper, column), (upper, next), (lower, column), (lower, next)];
                    let mean =
                        corners.map(|(row, column)| f64::from(map.luminance(row, column))).iter().sum::<f64>() / 4.0;
                    let exact =
                        mean * (top - bottom) * std::f64::consts::TAU / w as f64 * f64::from(map.inverse_integral);
                    let found = width as f64 * count as f64 * 2_f64.powi(-128);
                    // As exactly as whole integers can.
                    let off = 1e-5 + 1.0 / width as f64 + 1.0 / count as f64;
                    assert!((found / exact - 1.0).abs() < off, "{sun:e}, {band}, {column}: {found} for {exact}");
                    // The choices at the quarters of a share are in different places of its cell.
                    let at =
                        |k: u64| map.sample([Choice::new(begin + count / 4 * k), Choice::new(first + width / 4 * k)]);
                    let [a, b, c] = [1, 2, 3].map(at);
                    for p in [a, b, c] {
                        let cell = map.between(map.to_map(p));
                        let mut rows = cell.rows;
                        rows.sort_unstable();
                        assert_eq!((rows, cell.columns), ([upper, lower], [column, next]), "{sun:e}: {p}");
                    }
                    assert!(a.y > b.y && b.y > c.y, "{sun:e}, {band}, {column}: {a} {b} {c}");
                }
            }
        }
    }

    /// 10⁻³⁰ of the light is less than an integer's share. A cell with it has an integer all the same, and a ray that
    /// leaves the scene there finds what the texel says, with the density that belongs to it.
    #[test]
    fn however_bright_a_sun_is_no_texel_is_black() {
        let (map, even) = (beside(1e30), beside(1.0));
        let (w, h) = (map.width, map.height);
        let bands = shares(&map.bands);
        assert_eq!(bands.len(), h + 1);
        for band in 0..=h {
            assert_eq!(shares(&map.cells[band * w..][..w]).len(), w, "{band}");
        }
        let center = |band: usize, column: usize| {
            let middle = |begins: &[u64], i: usize| {
                let end = begins.get(i + 1).copied().unwrap_or(Choice::COUNT);
                Choice::new(begins[i] + (end - begins[i]) / 2)
            };
            even.sample([middle(&even.cells[band * w..][..w], column), middle(&even.bands, band)])
        };
        // Away from the sun's four cells.
        for (band, column) in (6..=h).flat_map(|band| (0..w).map(move |column| (band, column))) {
            let direction = center(band, column);
            let radiance = map.radiance(direction);
            assert!(
                radiance.min_element() > 0.0 && radiance == even.radiance(direction),
                "{band}, {column}: {radiance}"
            );
            let density = f64::from(luminance(radiance)) / f64::from(map.integral());
            let off = f64::from(map.pdf(direction).0) / density - 1.0;
            assert!(density < 2_f64.powi(-64) && off.abs() < 1e-5, "{band}, {column}: {off}");
        }
    }

    /// A row with one part in 10¹⁰ of the light takes 33 bits: what is left of 24 would be a line.
    #[test]
    fn a_place_in_a_faint_row_has_bits_left() {
        let map = beside(1e12);
        let (begin, width) = shares(&map.bands)[9];
        assert!(width >> 32 == 0, "{width} integers");
        let (word, rest) = ((begin >> 32) as u32, begin as u32);
        let at =
            |k: u32| map.sample(Square([1 << 31, word]).refined(Choice::of_words(0, rest + (width / 100) as u32 * k)));
        let heights: Vec<_> = (1..40).map(|k| at(k).y).collect();
        assert!(heights.is_sorted_by(|a, b| a > b), "{heights:?}");
    }
}
