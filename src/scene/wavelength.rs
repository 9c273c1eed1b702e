//! One wavelength for all subpaths that can be joined, and the index of refraction that depends on it.
//!
//! Where some volume disperses, a sample has one wavelength λ, drawn with the density p(λ), which every technique
//! shares and no weight sees. A path with a vertex between its ends on a dispersive interface, reflected or refracted,
//! carries F(λ) c(λ)/p(λ), with the colour c(λ) of that wavelength; every other path keeps all channels as they are.
//! Since ∫c dλ = (1, 1, 1), both are the same image where the index does not change.
//!
//! c is the light of one wavelength in linear Rec. 709, which is outside of its gamut: some channel is negative for
//! almost all λ. Its parts are added as they are, or the sum over a spectrum would not be white.

use std::sync::LazyLock;

use glam::DVec3;

use super::{Scene, media::Media, point::Point};
use crate::math::Rgb;

/// A wavelength that was drawn, with what depends on it alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelength {
    nanometres: f32,
    response: Rgb,
    /// (n − n_d)/(n_F − n_C) by Cauchy's equation.
    offset: f32,
}

impl Wavelength {
    /// The wavelength below which the fraction `u` of p lies, u in [0, 1).
    pub fn sample(u: f32) -> Self {
        SPECTRUM.sample(u.into())
    }

    /// λ in nm.
    #[inline]
    pub fn nanometres(self) -> f32 {
        self.nanometres
    }

    /// c(λ)/p(λ), linear Rec. 709; no channel is larger than 5 in magnitude.
    #[inline]
    pub fn response(self) -> Rgb {
        self.response
    }
}

/// The index of refraction of a volume: n(λ) = max(A + B/λ², 1), as KHR_materials_dispersion has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Index {
    /// n_d, at 587.6 nm.
    at_d: f32,
    /// n_F − n_C = (n_d − 1)/V_d.
    spread: f32,
}

/// Fraunhofer's lines F, d and C, nm.
const LINES: [f64; 3] = [486.1, 587.6, 656.3];

impl Index {
    /// That of empty space.
    pub const EMPTY: Self = Self { at_d: 1.0, spread: 0.0 };

    /// The index `at_d` at 587.6 nm and the extension's `dispersion` = 20/V_d, not negative; V_d is Abbe's number.
    pub fn new(at_d: f32, dispersion: f32) -> Self {
        Self { at_d, spread: (at_d - 1.0).max(0.0) * (dispersion / 20.0) }
    }

    /// Whether it depends on the wavelength.
    #[inline]
    pub fn disperses(self) -> bool {
        self.spread > 0.0
    }

    /// n(λ), or n_d without a wavelength.
    #[inline]
    pub fn at(self, wavelength: Option<Wavelength>) -> f32 {
        match wavelength {
            Some(wavelength) if self.disperses() => (self.at_d + self.spread * wavelength.offset).clamp(1.0, f32::MAX),
            _ => self.at_d,
        }
    }
}

impl Scene {
    /// The media, where the index of one of them depends on the wavelength.
    #[inline(always)]
    pub fn dispersing_media(&self) -> Option<&Media> {
        self.media().filter(|media| media.disperse())
    }

    /// Whether paths have a wavelength.
    #[inline(always)]
    pub fn disperses(&self) -> bool {
        self.dispersing_media().is_some()
    }
}

impl Media {
    /// Whether the surface at a point that a walk has come to lies between media of which one disperses.
    #[inline]
    pub fn disperse_at(&self, point: &Point) -> bool {
        self.disperse_between(point.material, point.media)
    }
}

/// The first wavelength that is drawn, the distance of the nodes below, and how many there are: up to 780 nm.
const FIRST: f64 = 380.0;
const STEP: f64 = 5.0;
const NODES: usize = 81;

static SPECTRUM: LazyLock<Spectrum> = LazyLock::new(Spectrum::new);

/// c and p, both linear between nodes. p is in proportion to |c_r| + |c_g| + |c_b| at the nodes: so |c/p| is bounded,
/// and what any channel makes of a wavelength decides how often it is drawn.
struct Spectrum {
    /// c, 1/nm.
    response: [DVec3; NODES],
    /// p times [`Self::whole`].
    size: [f64; NODES],
    /// ∫ size dλ up to each node.
    below: [f64; NODES],
}

impl Spectrum {
    fn new() -> Self {
        let colour: [DVec3; NODES] = std::array::from_fn(|k| rec709(colour_matching(FIRST + STEP * k as f64)));
        // Light of equal power at all wavelengths becomes white, channel by channel.
        let ends = colour[0] + colour[NODES - 1];
        let white = STEP * (colour.iter().sum::<DVec3>() - 0.5 * ends);
        let response = colour.map(|c| c / white);
        let size = response.map(|c| c.abs().element_sum());
        let mut below = [0.0; NODES];
        for k in 1..NODES {
            below[k] = below[k - 1] + 0.5 * STEP * (size[k - 1] + size[k]);
        }
        Self { response, size, below }
    }

    fn whole(&self) -> f64 {
        self.below[NODES - 1]
    }

    fn sample(&self, u: f64) -> Wavelength {
        let target = u * self.whole();
        let k = self.below.partition_point(|below| *below <= target).clamp(1, NODES - 1) - 1;
        let (a, b) = (self.size[k], self.size[k + 1]);
        // What lies below is quadratic between nodes: of its roots the stable form.
        let part = (target - self.below[k]) / (self.below[k + 1] - self.below[k]);
        let t = part * (a + b) / (a + (a * a + part * (b * b - a * a)).sqrt());
        let density = (a + t * (b - a)) / self.whole();
        let response = self.response[k].lerp(self.response[k + 1], t) / density;
        let nanometres = FIRST + STEP * (k as f64 + t);
        let [f, d, c] = LINES.map(|line| line.powi(-2));
        let offset = (nanometres.powi(-2) - d) / (f - c);
        Wavelength { nanometres: nanometres as f32, response: response.into(), offset: offset as f32 }
    }
}

/// The CIE 1931 colour matching functions x̄, ȳ, z̄ of the 2° observer at λ in nm, by the fit of Wyman, Sloan & Shirley
/// 2013, *Simple Analytic Approximations to the CIE XYZ Color Matching Functions*, JCGT 2(2), eq. 4.
pub(super) fn colour_matching(nanometres: f64) -> DVec3 {
    // A height, a place, and a width to either side.
    let lobe = |height: f64, place: f64, left: f64, right: f64| {
        let x = (nanometres - place) / if nanometres < place { left } else { right };
        height * (-0.5 * x * x).exp()
    };
    DVec3::new(
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

/// CIE XYZ in linear Rec. 709 (ITU-R BT.709-6, by its primaries and D65).
pub(super) fn rec709(xyz: DVec3) -> DVec3 {
    const ROWS: [DVec3; 3] = [
        DVec3::new(3.240_969_9, -1.537_383_2, -0.498_610_8),
        DVec3::new(-0.969_243_6, 1.875_967_5, 0.041_555_1),
        DVec3::new(0.055_630_1, -0.203_977_0, 1.056_971_5),
    ];
    DVec3::from_array(ROWS.map(|row| row.dot(xyz)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many wavelengths, evenly over p.
    fn drawn(count: u32) -> impl Iterator<Item = Wavelength> {
        (0..count).map(move |i| Wavelength::sample((i as f32 + 0.5) / count as f32))
    }

    #[test]
    fn all_wavelengths_together_are_white() {
        let count = 1 << 16;
        let sum: DVec3 = drawn(count).map(|x| x.response().as_dvec3()).sum();
        assert!((sum / f64::from(count) - 1.0).abs().max_element() < 1e-5, "{sum}");
        let largest = drawn(count).map(|x| x.response().abs().max_element()).fold(0.0, f32::max);
        assert!((1.0..5.0).contains(&largest), "{largest}");
    }

    /// So that the density is that of what is drawn, and no other by which the whole is white as well.
    #[test]
    fn each_part_of_the_spectrum_has_its_colour() {
        let count = 1 << 16;
        let integral = |from: f64, to: f64| -> DVec3 {
            let step = (to - from) / 4000.0;
            (0..4000).map(|i| rec709(colour_matching(from + step * (f64::from(i) + 0.5))) * step).sum()
        };
        let white = integral(FIRST, 780.0);
        for from in [380.0, 440.0, 500.0, 520.0, 580.0, 610.0, 650.0] {
            let to = from + 40.0;
            let within = |x: &Wavelength| (from..to).contains(&f64::from(x.nanometres()));
            let found: DVec3 = drawn(count).filter(within).map(|x| x.response().as_dvec3()).sum();
            let found = found / f64::from(count);
            let truth = integral(from, to) / white;
            assert!((found - truth).abs().max_element() < 2e-3, "{from}: {found}, {truth}");
        }
    }

    #[test]
    fn colours_are_those_of_the_rainbow() {
        let response = |nanometres: f32| {
            let x = drawn(1 << 14).find(|x| x.nanometres() >= nanometres).expect("within the spectrum");
            x.response().to_array()
        };
        let [red, yellow, green, blue] = [650.0, 578.0, 530.0, 460.0].map(response);
        assert!(red[0] > 1.0 && red[1].abs() < 0.5 && red[2].abs() < 0.5, "{red:?}");
        assert!(yellow[0] > 0.5 && yellow[1] > 0.5 && yellow[2] < 0.0, "{yellow:?}");
        assert!(green[0] < 0.0 && green[1] > 1.0 && green[2] < 0.5, "{green:?}");
        assert!(blue[2] > 1.0 && blue[1] < 0.5, "{blue:?}");
    }

    /// The extension's page: V_d = (n_d − 1)/(n_F − n_C), and its formula with rounded constants.
    #[test]
    fn indices_are_those_of_the_extension() {
        let near = |nanometres: f64| Wavelength {
            offset: ((nanometres.powi(-2) - LINES[1].powi(-2)) / (LINES[0].powi(-2) - LINES[2].powi(-2))) as f32,
            ..Wavelength::sample(0.5)
        };
        for (at_d, abbe) in [(1.5_f32, 59.0_f32), (2.42, 55.0), (1.33, 9.8)] {
            let index = Index::new(at_d, 20.0 / abbe);
            let [f, d, c] = LINES.map(|line| f64::from(index.at(Some(near(line)))));
            assert!((d - f64::from(at_d)).abs() < 1e-6 && index.at(None) == at_d);
            assert!(((d - 1.0) / (f - c) / f64::from(abbe) - 1.0).abs() < 1e-4, "{f} {d} {c}");
            for x in drawn(500) {
                let squared = f64::from(x.nanometres()).powi(2);
                let spread = f64::from((at_d - 1.0) / abbe);
                let page = f64::max(f64::from(at_d) + spread * (523_655.0 / squared - 1.516_8), 1.0);
                let off = (f64::from(index.at(Some(x))) - page).abs();
                assert!(off < 2e-3 * spread + 1e-6, "{} nm: off by {off}", x.nanometres());
            }
        }
    }

    #[test]
    fn no_index_falls_below_one() {
        let wild = Index::new(1.5, 60.0);
        assert!(drawn(100).all(|x| wild.at(Some(x)) >= 1.0) && drawn(100).any(|x| wild.at(Some(x)) == 1.0));
        assert!(drawn(100).all(|x| Index::new(2.0, f32::MAX).at(Some(x)).is_finite()));
        let even = [Index::new(1.5, 0.0), Index::new(1.0, 1.0)];
        assert!(even.iter().all(|index| !index.disperses() && drawn(9).all(|x| index.at(Some(x)) == index.at_d)));
    }
}
