//! Tests of equal means: Welch's t over the whole image's channels and its tiles' luminances, with Šidák's correction
//! for their number. Variances come from independent replicates (renders with seeds of their own), never from the
//! spread inside a tile.

use std::fmt;

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::{film::Image, math::luminance};

/// Tiles along a side of the image.
pub const TILES: usize = 4;
/// How many [`Regions`] there are.
pub const REGIONS: usize = 3 + TILES * TILES;
/// The probability that agreeing integrators fail one comparison.
const SIGNIFICANCE: f64 = 1e-3;

/// Means of an image: its three channels, and then the luminance of each tile.
pub type Regions = Vec<f64>;

/// The index in [`Regions`] of the tile that holds a pixel of an image of `width` × `height` pixels.
#[inline]
pub fn tile_of(x: usize, y: usize, width: usize, height: usize) -> usize {
    3 + (y * TILES / height) * TILES + x * TILES / width
}

/// The means of an image.
pub fn regions(image: &Image) -> Regions {
    let (w, h) = (image.width as usize, image.height as usize);
    let mut sums = vec![0.0_f64; REGIONS];
    for (i, pixel) in image.pixels.iter().enumerate() {
        sums[tile_of(i % w, i / w, w, h)] += f64::from(luminance(*pixel)) * (TILES * TILES) as f64 / (w * h) as f64;
        for (sum, v) in sums.iter_mut().zip(pixel.to_array()) {
            *sum += f64::from(v) / (w * h) as f64;
        }
    }
    sums
}

/// Mean and squared standard error of the mean, region by region, from independent replicates.
#[derive(Clone, Debug)]
pub struct Estimate {
    mean: Vec<f64>,
    /// Squared standard errors of `mean`.
    error2: Vec<f64>,
    replicates: f64,
}

impl Estimate {
    /// # Panics
    /// With fewer than two replicates.
    pub fn new(replicates: &[Regions]) -> Self {
        assert!(replicates.len() >= 2);
        let n = replicates.len() as f64;
        let of = |f: &dyn Fn(usize) -> f64| (0..replicates[0].len()).map(f).collect::<Vec<_>>();
        let mean = of(&|i| replicates.iter().map(|r| r[i]).sum::<f64>() / n);
        let error2 = of(&|i| replicates.iter().map(|r| (r[i] - mean[i]).powi(2)).sum::<f64>() / (n - 1.0) / n);
        Self { mean, error2, replicates: n }
    }

    /// The estimate as a renderer would give it that is too bright by the factor `1 + bias`.
    pub fn biased(&self, bias: f64) -> Self {
        let mean = self.mean.iter().map(|m| m * (1.0 + bias)).collect();
        Self { mean, ..self.clone() }
    }

    /// The same means with larger squared standard errors: for what is known of the variance besides the replicates.
    ///
    /// # Panics
    /// If there is not one number per region.
    #[must_use]
    pub fn with_further_error(self, error2: &[f64]) -> Self {
        assert_eq!(error2.len(), self.error2.len());
        let error2 = self.error2.iter().zip(error2).map(|(a, b)| a + b).collect();
        Self { error2, ..self }
    }

    /// The means.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Squared standard errors of the means.
    pub fn error2(&self) -> &[f64] {
        &self.error2
    }

    /// The same means without an error.
    pub fn exact(&self) -> Self {
        Self { error2: vec![0.0; self.error2.len()], ..self.clone() }
    }

    /// The p-value of a known mean in every region, after Šidák's correction.
    pub fn p_of_mean(&self, expected: f64) -> f64 {
        let known = Self {
            mean: vec![expected; self.mean.len()],
            error2: vec![0.0; self.mean.len()],
            replicates: self.replicates,
        };
        Comparison::new(self, &known).p
    }

    /// The mean of the whole image, averaged over channels.
    pub fn image_mean(&self) -> f64 {
        self.mean[..3].iter().sum::<f64>() / 3.0
    }
}

/// The outcome of a comparison.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The smallest p-value of all means, after Šidák's correction.
    pub p: f64,
    /// The mean that it belongs to, as an index into [`Regions`].
    pub worst: usize,
    /// The smallest relative bias of the whole image that this comparison would call significant.
    pub visible_bias: f64,
    /// The same of each channel as a difference, in the image's unit.
    pub visible: [f64; 3],
    significance: f64,
}

impl Comparison {
    /// Compares region by region, so that agreeing estimates fail with a probability of 1e-3.
    pub fn new(a: &Estimate, b: &Estimate) -> Self {
        Self::at(SIGNIFICANCE, a, b)
    }

    /// Compares region by region, so that agreeing estimates fail with the probability `significance`.
    pub fn at(significance: f64, a: &Estimate, b: &Estimate) -> Self {
        let tests: Vec<_> = (0..a.mean.len()).filter_map(|i| welch(a, b, i).map(|p| (i, p))).collect();
        let (worst, smallest) = tests.iter().copied().min_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((0, 1.0));
        let count = tests.len().max(1) as f64;
        let p = any_of(smallest, count);
        let single = each_of(significance, count);
        let visible = [0, 1, 2].map(|c| {
            let error2 = a.error2[c] + b.error2[c];
            if error2 > 0.0 {
                let t = StudentsT::new(0.0, 1.0, freedom(a, b, c)).unwrap().inverse_cdf(1.0 - 0.5 * single);
                t * error2.sqrt()
            } else {
                0.0
            }
        });
        let relative = |c: usize| visible[c] / (0.5 * (a.mean[c] + b.mean[c]));
        let visible_bias = (0..3).filter(|c| visible[*c] > 0.0).map(relative).fold(0.0, f64::max);
        Self { p, worst, visible_bias, visible, significance }
    }

    /// Whether the two estimates differ by more than chance allows.
    pub fn differs(&self) -> bool {
        self.p < self.significance
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "p = {:.2e} (", self.p)?;
        match self.worst {
            channel @ 0..3 => write!(f, "image, {}", ["R", "G", "B"][channel])?,
            tile => write!(f, "tile {},{}", (tile - 3) % TILES, (tile - 3) / TILES)?,
        }
        write!(f, "); smallest visible bias {:.2} %", 100.0 * self.visible_bias)
    }
}

/// The probability that any of `count` independent tests has a p-value below `p` (Šidák): 1 − (1 − p)^count, without
/// losing small p.
pub fn any_of(p: f64, count: f64) -> f64 {
    -(count * (-p).ln_1p()).exp_m1()
}

/// The significance for each of `count` independent tests so that any fails with the probability `significance`
/// (Šidák).
pub fn each_of(significance: f64, count: f64) -> f64 {
    -((-significance).ln_1p() / count).exp_m1()
}

/// The p-value of each region alone; 1 where both estimates are constant and equal.
pub fn p_values(a: &Estimate, b: &Estimate) -> Vec<f64> {
    (0..a.mean.len()).map(|i| welch(a, b, i).unwrap_or(1.0)).collect()
}

fn freedom(a: &Estimate, b: &Estimate, i: usize) -> f64 {
    let (x, y) = (a.error2[i], b.error2[i]);
    debug_assert!(x + y > 0.0);
    (x + y).powi(2) / (x * x / (a.replicates - 1.0) + y * y / (b.replicates - 1.0))
}

/// The two-sided p-value of equal means of index `i`; `None` where both are exactly constant and equal.
fn welch(a: &Estimate, b: &Estimate, i: usize) -> Option<f64> {
    let error2 = a.error2[i] + b.error2[i];
    let difference = a.mean[i] - b.mean[i];
    // Rounding in the sums is no evidence.
    let rounding = 1e-6 * a.mean[i].abs().max(b.mean[i].abs());
    if difference.abs() <= rounding {
        return (error2 > 0.0).then_some(1.0);
    }
    if error2 == 0.0 {
        return Some(0.0);
    }
    let t = difference / error2.sqrt();
    Some(2.0 * StudentsT::new(0.0, 1.0, freedom(a, b, i)).unwrap().cdf(-t.abs()))
}
