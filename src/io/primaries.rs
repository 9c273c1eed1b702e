//! Which colours the three channels of an image are: its primaries and its white, and the way from there to linear Rec.
//! 709.

use glam::{DMat3, DVec2, DVec3};

use crate::math::Rgb;

/// CIE 1931 chromaticities (x, y) of an image's primaries and of its white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries {
    pub(super) red: DVec2,
    pub(super) green: DVec2,
    pub(super) blue: DVec2,
    pub(super) white: DVec2,
}

/// What the channels of a file are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Colors {
    /// Linear Rec. 709, the renderer's own.
    Rec709,
    /// Others, which this matrix takes to linear Rec. 709.
    Other(DMat3),
}

/// Chromaticities closer than this are the same: files round them to three digits.
const SAME: f64 = 5e-4;

/// From CIE XYZ to the responses of cones in which white is adapted (Bradford; Lindbloom, "Chromatic Adaptation").
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

impl Primaries {
    /// Rec. 709 with D65.
    pub(super) const REC_709: Self = Self {
        red: DVec2::new(0.64, 0.33),
        green: DVec2::new(0.30, 0.60),
        blue: DVec2::new(0.15, 0.06),
        white: DVec2::new(0.3127, 0.3290),
    };

    /// CIE XYZ itself, as OpenEXR files say it.
    pub(super) const XYZ: Self =
        Self { red: DVec2::X, green: DVec2::Y, blue: DVec2::ZERO, white: DVec2::splat(1.0 / 3.0) };

    /// From eight numbers: x and y of red, green, blue and white.
    pub(super) fn of([rx, ry, gx, gy, bx, by, wx, wy]: [f64; 8]) -> Self {
        let at = DVec2::new;
        Self { red: at(rx, ry), green: at(gx, gy), blue: at(bx, by), white: at(wx, wy) }
    }

    /// The way to linear Rec. 709. White goes to white: where it is another than D65, the eye is taken to be adapted to
    /// it (Bradford's von Kries transform). CIE XYZ is the exception: it states colours and no white, so that they stay
    /// what they are.
    ///
    /// # Errors
    /// A clause that says why these are no primaries.
    pub(super) fn to_rec_709(self) -> Result<Colors, &'static str> {
        if self.is_near(Self::REC_709) {
            return Ok(Colors::Rec709);
        }
        let from_xyz = Self::REC_709.to_xyz()?.inverse();
        if self.is_near(Self::XYZ) {
            return Ok(Colors::Other(from_xyz));
        }
        let to_xyz = self.to_xyz()?;
        let cones = |white: DVec2| BRADFORD * xyz(white);
        let (own, ours) = (cones(self.white), cones(Self::REC_709.white));
        if own.min_element() <= 0.0 {
            return Err("its white is no colour that an eye adapts to");
        }
        let adapt = BRADFORD.inverse() * DMat3::from_diagonal(ours / own) * BRADFORD;
        Ok(Colors::Other(from_xyz * adapt * to_xyz))
    }

    /// To CIE XYZ, with Y = 1 for white (SMPTE RP 177).
    fn to_xyz(self) -> Result<DMat3, &'static str> {
        let column = |c: DVec2| DVec3::new(c.x, c.y, 1.0 - c.x - c.y);
        let primaries = DMat3::from_cols(column(self.red), column(self.green), column(self.blue));
        let white = xyz(self.white);
        // Three colours on a line mix to no white; NaN is not above anything either.
        let mixable = primaries.determinant().abs() > 1e-6 && white.is_finite();
        if !mixable {
            return Err("its primaries and white are no colours of which others could be mixed");
        }
        let amounts = primaries.inverse() * white;
        let positive = amounts.is_finite() && amounts.min_element() > 0.0;
        if !positive {
            return Err("its primaries do not mix to its white");
        }
        Ok(primaries * DMat3::from_diagonal(amounts))
    }

    fn is_near(self, other: Self) -> bool {
        let near = |a: DVec2, b: DVec2| (a - b).abs().cmplt(DVec2::splat(SAME)).all();
        near(self.red, other.red)
            && near(self.green, other.green)
            && near(self.blue, other.blue)
            && near(self.white, other.white)
    }
}

impl Colors {
    /// Takes pixels to linear Rec. 709. Colours outside of its gamut get negative channels.
    pub(super) fn convert(self, pixels: &mut [Rgb]) {
        if let Self::Other(matrix) = self {
            pixels.iter_mut().for_each(|pixel| *pixel = (matrix * pixel.as_dvec3()).into());
        }
    }
}

/// CIE XYZ with Y = 1.
fn xyz(c: DVec2) -> DVec3 {
    DVec3::new(c.x, c.y, 1.0 - c.x - c.y) / c.y
}

#[cfg(test)]
mod tests {
    use super::*;

    fn converted(primaries: Primaries, color: [f32; 3]) -> Rgb {
        let mut pixels = [Rgb::from_array(color)];
        primaries.to_rec_709().unwrap().convert(&mut pixels);
        pixels[0]
    }

    /// (x, y) of ACES' two sets and of Rec. 2020, as their standards print them.
    const AP0: [f64; 8] = [0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767];
    const AP1: [f64; 8] = [0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767];
    const REC_2020: [f64; 8] = [0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290];

    #[test]
    fn published_matrices_come_out() {
        // ITU-R BT.2087-0 for Rec. 2020; the ACES ones are OpenColorIO's, with Bradford.
        let cases = [
            (REC_2020, [1.0, 0.0, 0.0], [1.6605, -0.1246, -0.0182]),
            (REC_2020, [0.0, 1.0, 0.0], [-0.5876, 1.1329, -0.1006]),
            (AP1, [1.0, 0.0, 0.0], [1.7050, -0.1302, -0.0240]),
            (AP1, [0.0, 0.0, 1.0], [-0.0832, -0.0105, 1.1530]),
            (AP0, [1.0, 0.0, 0.0], [2.5216, -0.2764, -0.0154]),
        ];
        for (primaries, color, expected) in cases {
            let found = converted(Primaries::of(primaries), color);
            assert!((found - Rgb::from_array(expected)).abs().max_element() < 6e-4, "{primaries:?}: {found}");
        }
        for primaries in [AP0, AP1, REC_2020] {
            let white = converted(Primaries::of(primaries), [1.0; 3]);
            assert!((white - Rgb::ONE).abs().max_element() < 1e-5, "{white}");
        }
    }

    #[test]
    fn xyz_is_what_it_says() {
        let d65 = converted(Primaries::XYZ, [0.950_456, 1.0, 1.089_058]);
        assert!((d65 - Rgb::ONE).abs().max_element() < 1e-3, "{d65}");
    }

    #[test]
    fn rec_709_is_left_alone_to_the_bit() {
        let rounded = Primaries { white: DVec2::new(0.313, 0.329), ..Primaries::REC_709 };
        assert_eq!(rounded.to_rec_709(), Ok(Colors::Rec709));
        assert_eq!(converted(rounded, [1e-30, 0.1, 3e20]), Rgb::new(1e-30, 0.1, 3e20));
    }

    #[test]
    fn what_mixes_to_nothing_is_refused() {
        let p = Primaries::REC_709;
        for bad in [
            Primaries { green: p.red, ..p },
            Primaries { white: DVec2::new(0.3, 0.0), ..p },
            Primaries { white: DVec2::new(0.7, 0.25), ..p },
            Primaries { blue: DVec2::new(f64::NAN, 0.06), ..p },
        ] {
            assert!(bad.to_rec_709().is_err(), "{bad:?}");
        }
    }
}
