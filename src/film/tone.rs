//! How an image looks on a display: exposure, white balance and a tone curve. Files with radiance know none of it.

use std::fmt;

use glam::{DMat3, DVec3, Vec3};

use super::{Exposure, Image};
use crate::math::Rgb;

/// The curve from exposed linear colours to those of a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// None: what is above white is white.
    #[default]
    Clip,
    /// A fit of ACES' curve, for each channel: K. Narkowicz 2015, *ACES Filmic Tone Mapping Curve*.
    Filmic,
    /// T. Sobotka's AgX in the approximation of B. Wrensch 2023, *Minimal AgX Implementation*: bright colours fade to
    /// white.
    Agx,
}

impl Tone {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Clip, Self::Filmic, Self::Agx];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clip => "none",
            Self::Filmic => "filmic",
            Self::Agx => "agx",
        }
    }

    /// Linear colours of the display, Rec. 709, which still have to be clipped to 0 … 1.
    #[inline]
    pub fn apply(self, color: Rgb) -> Rgb {
        match self {
            Self::Clip => color,
            Self::Filmic => color.map(filmic),
            Self::Agx => agx(color),
        }
    }
}

impl fmt::Display for Tone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Narkowicz' fit. Beyond 10⁴ it is constant to rounding, and its squares would leave f32's range.
fn filmic(x: f32) -> f32 {
    let x = x.clamp(0.0, 1e4);
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// To the working space of AgX, by columns.
const INSET: [[f32; 3]; 3] = [
    [0.842_479_05, 0.042_328_24, 0.042_375_654],
    [0.078_433_6, 0.878_468_63, 0.078_433_6],
    [0.079_223_745, 0.079_166_13, 0.879_143],
];
/// And from it.
const OUTSET: [[f32; 3]; 3] = [
    [1.196_879, -0.052_896_85, -0.052_971_635],
    [-0.098_020_88, 1.151_903_1, -0.098_043_45],
    [-0.099_029_74, -0.098_961_18, 1.151_073_7],
];
/// The stops, log₂ of a channel, that are shown as black and as white.
const STOPS: [f32; 2] = [-12.473_93, 4.026_069];

fn agx(color: Rgb) -> Rgb {
    let times = |[x, y, z]: [[f32; 3]; 3], v: Vec3| Vec3::from(x) * v.x + Vec3::from(y) * v.y + Vec3::from(z) * v.z;
    let [black, white] = STOPS;
    let curve = |x: f32| {
        let x = (x.max(f32::MIN_POSITIVE).log2().clamp(black, white) - black) / (white - black);
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.002_32
    };
    let shown = times(OUTSET, times(INSET, color.into()).map(curve));
    // The curve is that of a display with a gamma of 2.2.
    Rgb::from_array(shown.map(|x| x.max(0.0).powf(2.2)).to_array())
}

/// The colour temperature of a light that is to look white, kelvin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteBalance(f32);

impl WhiteBalance {
    /// The temperatures that there are, kelvin.
    pub const RANGE: [f32; 2] = [1667.0, 25_000.0];

    /// Light of this colour temperature looks white; `None` outside of the range.
    pub fn new(kelvin: f32) -> Option<Self> {
        (Self::RANGE[0]..=Self::RANGE[1]).contains(&kelvin).then_some(Self(kelvin))
    }

    /// Kelvin.
    pub fn kelvin(self) -> f32 {
        self.0
    }

    /// The chromaticity (x, y) of light of this temperature: of daylight from 4000 K on (CIE 15:2004), of a black body
    /// below (Kim et al. 2002, US patent 7024034).
    fn chromaticity(self) -> [f64; 2] {
        let t = f64::from(self.0);
        let cubic = |[a, b, c, d]: [f64; 4], x: f64| ((a * x + b) * x + c) * x + d;
        if t >= 4000.0 {
            let of = if t <= 7000.0 {
                [-4.6070e9, 2.9678e6, 0.099_11e3, 0.244_063]
            } else {
                [-2.0064e9, 1.9018e6, 0.247_48e3, 0.237_040]
            };
            let x = cubic(of, t.recip());
            [x, cubic([0.0, -3.0, 2.87, -0.275], x)]
        } else {
            let x = cubic([-0.266_123_9e9, -0.234_358_9e6, 0.877_695_6e3, 0.179_910], t.recip());
            let of = if t <= 2222.0 {
                [-1.106_381_4, -1.348_110_20, 2.185_558_32, -0.202_196_83]
            } else {
                [-0.954_947_6, -1.374_185_93, 2.091_370_15, -0.167_488_67]
            };
            [x, cubic(of, x)]
        }
    }

    /// The matrix on linear Rec. 709 by which this white becomes that of the display, D65 (Bradford's von Kries
    /// transform; Lindbloom, "Chromatic Adaptation").
    fn matrix(self) -> DMat3 {
        let xyz = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y) / y;
        let (own, ours) = (BRADFORD * xyz(self.chromaticity()), BRADFORD * xyz([0.3127, 0.3290]));
        let adapt = BRADFORD.inverse() * DMat3::from_diagonal(ours / own) * BRADFORD;
        REC_709.inverse() * adapt * REC_709
    }
}

const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);
/// From linear Rec. 709 to CIE XYZ (IEC 61966-2-1).
const REC_709: DMat3 = DMat3::from_cols(
    DVec3::new(0.412_390_8, 0.212_639, 0.019_330_82),
    DVec3::new(0.357_584_34, 0.715_168_68, 0.119_194_78),
    DVec3::new(0.180_480_79, 0.072_192_32, 0.950_532_15),
);

/// All that a PNG of an image depends on besides the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Radiances are multiplied by this first.
    pub exposure: Exposure,
    /// What looks white; `None` leaves colours as they are.
    pub white_balance: Option<WhiteBalance>,
    /// The curve at the end.
    pub tone: Tone,
}

/// Only that exposure.
impl From<Exposure> for Look {
    fn from(exposure: Exposure) -> Self {
        Self { exposure, white_balance: None, tone: Tone::default() }
    }
}

impl Look {
    /// From radiances of `image`, each over the part of its pixel that is covered, to linear colours of the display,
    /// which still have to be clipped.
    pub(super) fn of(self, image: &Image) -> impl Fn(Rgb, f32) -> Rgb {
        let scale = self.exposure.ev(image).exp2();
        let balance = self.white_balance.map(|white| white.matrix().as_mat3());
        move |color, coverage| {
            let exposed = color * (scale / coverage);
            let balanced = match balance {
                Some(matrix) => Rgb::from_array((matrix * Vec3::from(exposed)).to_array()),
                None => exposed,
            };
            self.tone.apply(balanced)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(tone: Tone, x: f32) -> f32 {
        tone.apply(Rgb::splat(x)).g()
    }

    #[test]
    fn curves_have_the_values_of_their_publications() {
        for (x, expected) in [(0.0, 0.0), (0.18, 0.266_90), (1.0, 0.803_80), (10.0, 1.009_07)] {
            assert!((grey(Tone::Filmic, x) - expected).abs() < 1e-4, "{x}: {}", grey(Tone::Filmic, x));
        }
        // The polynomial by hand, at 0 and 1 (black and white), and at log₂ 0.18.
        for (x, shown) in [(1e-6, 0.0), (0.18, 0.496_7), (100.0, 0.998_58)] {
            let found = grey(Tone::Agx, x).powf(1.0 / 2.2);
            assert!((found - shown).abs() < 5e-4, "{x}: {found}");
        }
        for x in [-1.0, 0.0, 0.3, 7.0] {
            assert_eq!(grey(Tone::Clip, x), x);
        }
    }

    #[test]
    fn grey_stays_grey_and_brighter_is_brighter() {
        for tone in Tone::ALL {
            let mut before = -1.0;
            for i in 0..2000 {
                let x = (0.01 * i as f32 - 13.0).exp2();
                let shown = tone.apply(Rgb::splat(x)).map(|c| c.clamp(0.0, 1.0));
                assert!(shown.max_element() - shown.min_element() < 1e-3, "{tone} at {x}: {shown}");
                assert!(shown.g() >= before, "{tone} at {x}");
                before = shown.g();
            }
            assert!(before > 0.98, "{tone}: {before}");
        }
    }

    #[test]
    fn any_radiance_is_a_colour() {
        for tone in Tone::ALL {
            for x in [0.0, f32::MIN_POSITIVE, 1e10, f32::MAX] {
                for color in [Rgb::splat(x), Rgb::new(x, 0.0, 0.0), Rgb::new(0.0, 0.1, x)] {
                    assert!(tone.apply(color).is_finite(), "{tone}: {color}");
                }
            }
        }
        // A bright, pure colour becomes white by AgX, and stays a pure one without a curve.
        let faded = Tone::Agx.apply(Rgb::new(0.0, 0.0, 1000.0));
        assert!(faded.min_element() > 0.3 && Tone::Clip.apply(Rgb::new(0.0, 0.0, 9.0)).r() == 0.0, "{faded}");
    }

    #[test]
    fn light_of_the_temperature_becomes_white() {
        for (kelvin, xy) in [
            // Illuminants of the CIE by their chromaticities, and black bodies.
            (6504.0, [0.3127, 0.3290]),
            (5003.0, [0.3457, 0.3585]),
            (7504.0, [0.2990, 0.3149]),
            (2856.0, [0.4476, 0.4074]),
            (2000.0, [0.5267, 0.4133]),
        ] {
            let white = WhiteBalance::new(kelvin).unwrap();
            let found = white.chromaticity();
            assert!((found[0] - xy[0]).abs() < 1e-3 && (found[1] - xy[1]).abs() < 1e-3, "{kelvin} K: {found:?}");
            let light = REC_709.inverse() * DVec3::new(found[0], found[1], 1.0 - found[0] - found[1]) / found[1];
            let seen = white.matrix() * light;
            assert!((seen - DVec3::ONE).abs().max_element() < 1e-3, "{kelvin} K: {seen}");
        }
        // Daylight of 6504 K is the display's white already; lamps are warmer, so that what is white turns blue.
        let kept = WhiteBalance::new(6504.0).unwrap().matrix();
        assert!((kept * DVec3::new(0.2, 0.5, 0.3) - DVec3::new(0.2, 0.5, 0.3)).abs().max_element() < 1e-3);
        let cooled = WhiteBalance::new(3000.0).unwrap().matrix() * DVec3::ONE;
        assert!(cooled.z > 1.3 && cooled.x < 1.0, "{cooled}");
        assert!(WhiteBalance::new(1000.0).is_none() && WhiteBalance::new(f32::NAN).is_none());
    }
}
