//! Lamps as a goniometer measures them: points whose intensity is a table over directions.

use std::{f32::consts::TAU, f64::consts::PI, sync::Arc};

use glam::{Mat3, Vec3};

use super::environment::linear;
use crate::{
    math::Rgb,
    sampling::{Choice, PdfSolidAngle, divide, find},
};

/// Polar angles of the table lie at most this far apart, radians.
const STEP: f64 = 0.0175;

/// Intensities over directions in the frame of a luminaire, candela: a *photometric web* of type C (IES LM-63).
///
/// θ is the angle from the luminaire's axis, −z, and φ that about +z from +x towards +y. In φ the intensity is linear
/// between the angles measured. In θ it is linear, too, to within the 1° that rows of the table lie apart at most, and
/// linear in *cos θ* between these rows. There, solid angle is uniform, so that directions can be sampled exactly in
/// proportion to the intensity, as those of an [`EnvironmentMap`](super::EnvironmentMap). Outside of the polar angles
/// measured it is dark.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// 1 − cos θ of each row, rising.
    rows: Vec<f32>,
    /// φ of each column, rising: the last shows what the first does, a full turn on.
    columns: Vec<f32>,
    /// Row by row, candela.
    values: Vec<f32>,
    /// Where a choice's integers of each band between two rows begin.
    bands: Vec<u64>,
    /// For each band those of its cells between two columns.
    cells: Vec<u64>,
    /// ∫ I dω, lumen.
    integral: f32,
    peak: f32,
    /// The first and the last θ measured, radians.
    range: [f32; 2],
}

impl Profile {
    /// The profile with intensity `value(i, j)`, candela, at the polar angle `polar[i]` and the azimuth `azimuths[j]`,
    /// radians. `None` if it is dark all over.
    ///
    /// # Panics
    /// Unless both are strictly rising, `polar` within 0 … π and `azimuths` over a full turn in which the last values
    /// are the first again, and all values are finite and not negative.
    pub fn new(polar: &[f64], azimuths: &[f64], value: impl Fn(usize, usize) -> f32) -> Option<Self> {
        let rising = |angles: &[f64]| angles.len() > 1 && angles.is_sorted_by(|a, b| a < b);
        let (first, last) = (polar[0], polar[polar.len() - 1]);
        let turn = azimuths[azimuths.len() - 1] - azimuths[0];
        let fits = first >= 0.0 && last <= PI + 1e-6 && (turn - 2.0 * PI).abs() < 1e-6;
        assert!(rising(polar) && rising(azimuths) && fits, "{polar:?} × {azimuths:?}");
        let rows = rows(polar);
        let below_one = |(i, t): &(usize, f64)| {
            let next = polar.get(i + 1).unwrap_or(&last);
            2.0 * (0.5 * (polar[*i] + (next - polar[*i]) * t)).sin().powi(2)
        };
        let at = |(i, t): (usize, f64), j| {
            let (a, b) = (value(i, j), value((i + 1).min(polar.len() - 1), j));
            a + (b - a) * t as f32
        };
        let values: Vec<_> = rows
            .iter()
            .flat_map(|row| (0..azimuths.len()).map(move |j| (*row, j)))
            .map(|(row, j)| at(row, j))
            .collect();
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0), "an intensity below zero, or none");
        let peak = values.iter().copied().fold(0.0, f32::max);
        let mut profile = Self {
            rows: rows.iter().map(|row| below_one(row) as f32).collect(),
            columns: azimuths.iter().map(|angle| *angle as f32).collect(),
            values,
            bands: Vec::new(),
            cells: Vec::new(),
            integral: 0.0,
            peak,
            range: [first as f32, last as f32],
        };
        profile.integrate(&rows.iter().map(below_one).collect::<Vec<_>>(), azimuths);
        (profile.integral > 0.0).then_some(profile)
    }

    /// Fills in the integral and the distributions over bands and cells.
    fn integrate(&mut self, rows: &[f64], azimuths: &[f64]) {
        let mut bands = Vec::with_capacity(rows.len() - 1);
        let mut cells = Vec::with_capacity(azimuths.len() - 1);
        for (band, ends) in rows.windows(2).enumerate() {
            cells.clear();
            cells.extend(azimuths.windows(2).enumerate().map(|(column, turn)| {
                // The mean of a bilinear function is that of its corners.
                let mean = 0.25 * self.corners(band, column).into_iter().map(f64::from).sum::<f64>();
                mean * (turn[1] - turn[0])
            }));
            divide(&cells, &mut self.cells);
            bands.push(cells.iter().sum::<f64>() * (ends[1] - ends[0]));
        }
        divide(&bands, &mut self.bands);
        self.integral = bands.iter().sum::<f64>() as f32;
    }

    /// ∫ I dω: the luminous flux, lumen.
    pub fn integral(&self) -> f32 {
        self.integral
    }

    /// The largest intensity, candela.
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// How many intensities the table has.
    pub fn size(&self) -> usize {
        self.values.len()
    }

    /// The intensity in the unit direction `w`, candela.
    #[inline]
    pub fn intensity(&self, w: Vec3) -> f32 {
        let (sin2, cos) = (w.x * w.x + w.y * w.y, -w.z);
        let below_one = if cos > 0.0 { sin2 / (1.0 + cos) } else { 1.0 - cos }.min(2.0);
        if below_one < self.rows[0] || below_one > self.rows[self.rows.len() - 1] {
            return 0.0;
        }
        let azimuth = w.y.atan2(w.x);
        let turns = ((azimuth - self.columns[0]) / TAU).floor();
        let ((band, down), (column, right)) =
            (between(&self.rows, below_one), between(&self.columns, azimuth - turns * TAU));
        let [a, b, c, d] = self.corners(band, column);
        let (upper, lower) = (a + (b - a) * right, c + (d - c) * right);
        upper + (lower - upper) * down
    }

    /// A unit direction in proportion to the intensity: a band by the second choice, a cell of it by the first, and a
    /// place in the cell from what they leave.
    #[inline]
    pub fn sample(&self, [x, y]: [Choice; 2]) -> Vec3 {
        let (band, v) = find(&self.bands, y);
        let across = self.columns.len() - 1;
        let (column, h) = find(&self.cells[band * across..][..across], x);
        let (v, h) = (v.rest().unit(), h.rest().unit());
        let [a, b, c, d] = self.corners(band, column);
        let down = linear(v, a + b, c + d);
        let right = linear(h, a + (c - a) * down, b + (d - b) * down);
        let below_one = self.rows[band] + (self.rows[band + 1] - self.rows[band]) * down;
        let sin = (below_one * (2.0 - below_one)).max(0.0).sqrt();
        let azimuth = self.columns[column] + (self.columns[column + 1] - self.columns[column]) * right;
        let (y, x) = azimuth.sin_cos();
        Vec3::new(sin * x, sin * y, below_one - 1.0)
    }

    /// The intensities around a cell: two of the upper row, two of the lower.
    #[inline]
    fn corners(&self, band: usize, column: usize) -> [f32; 4] {
        let upper = band * self.columns.len() + column;
        let lower = upper + self.columns.len();
        [self.values[upper], self.values[upper + 1], self.values[lower], self.values[lower + 1]]
    }
}

/// Rows at all polar angles, and evenly between those that lie more than [`STEP`] apart: each as the angle before it
/// and the part of the way to the next.
fn rows(polar: &[f64]) -> Vec<(usize, f64)> {
    let parts = |i: usize| ((polar[i + 1] - polar[i]) / STEP).ceil().max(1.0) as usize;
    let between = |i: usize| (0..parts(i)).map(move |k| (i, k as f64 / parts(i) as f64));
    (0..polar.len() - 1).flat_map(between).chain([(polar.len() - 1, 0.0)]).collect()
}

/// Between which two of the rising `places` x lies, from the first on, and how far.
#[inline]
fn between(places: &[f32], x: f32) -> (usize, f32) {
    let i = places.partition_point(|place| *place <= x).clamp(1, places.len() - 1) - 1;
    (i, ((x - places[i]) / (places[i + 1] - places[i])).clamp(0.0, 1.0))
}

/// A lamp with a profile, somewhere and turned. Never seen directly.
#[derive(Clone, Debug)]
pub struct Goniometric {
    position: Vec3,
    /// From the luminaire's frame to the world: a rotation, or one mirrored.
    to_world: Mat3,
    color: Rgb,
    profile: Arc<Profile>,
}

impl Goniometric {
    /// A lamp at `position` that shines as `profile` says times `color`. The columns of `to_world` are the unit axes
    /// of the profile's frame, at right angles.
    pub fn new(position: Vec3, to_world: Mat3, color: Rgb, profile: Arc<Profile>) -> Self {
        Self { position, to_world, color, profile }
    }

    /// Where it is.
    #[inline]
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// The largest intensity, W/sr or candela.
    pub fn peak(&self) -> Rgb {
        self.color * self.profile.peak
    }

    /// The emitted power, W or lumen.
    pub fn power(&self) -> Rgb {
        self.color * self.profile.integral
    }

    /// A unit axis and the half angle about it, radians, of a cone outside of which it is dark.
    pub fn cone(&self) -> (Vec3, f32) {
        let (up, [first, last]) = (self.to_world.z_axis, self.profile.range);
        let (down, upwards) = (last, std::f32::consts::PI - first);
        if down <= upwards { (-up, down) } else { (up, upwards) }
    }

    /// The intensity in the unit direction `w`, W/sr or candela. Out of line, for few scenes have such lamps.
    #[inline(never)]
    pub fn intensity_towards(&self, w: Vec3) -> Rgb {
        self.color * self.profile.intensity(self.to_local(w))
    }

    /// The density of [`Goniometric::sample`], in proportion to the intensity.
    #[inline(never)]
    pub fn pdf(&self, w: Vec3) -> PdfSolidAngle {
        PdfSolidAngle(self.profile.intensity(self.to_local(w)) / self.profile.integral)
    }

    /// A unit direction with density I/∫I dω.
    #[inline(never)]
    pub fn sample(&self, choices: [Choice; 2]) -> Vec3 {
        self.to_world * self.profile.sample(choices)
    }

    #[inline]
    fn to_local(&self, w: Vec3) -> Vec3 {
        let Mat3 { x_axis, y_axis, z_axis } = self.to_world;
        Vec3::new(x_axis.dot(w), y_axis.dot(w), z_axis.dot(w))
    }
}
