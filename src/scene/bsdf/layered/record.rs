//! The numbers of a layered surface in 46 bytes.
//!
//! Textures have 8 bits, and what they multiply need not be exact to more than an eye sees: colours are kept by their
//! roots in 10 or 11 bits, fractions in 8 to 16. 0 and 1 are exact, and so are a coat's normal that is the surface's
//! and the index of what is clear.
//!
//! F0 of a volume's boundary is kept by its ratio to that of its index: another index leaves the ratio as it is.

use std::f32::consts::PI;

use glam::Vec2;

use super::{super::Metal, Averages, Clear, Emission, Passage, SheenPlace, Surface};
use crate::math::Rgb;

/// So many words of 16 bits: with the tag of the enum 48 bytes.
const WORDS: usize = 23;
/// Bits of the averages at its end.
const AVERAGES: usize = 31;

/// A [`Surface`] with its [`Averages`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Record([u16; WORDS]);

/// The greatest thickness of a film in nanometres: whole numbers of 12 bits. Thicker films have no colour left.
const THICKEST: f32 = 4095.0;
/// How many steps the roots of ratios have.
const RATIOS: f32 = 2046.0;
/// The greatest index of a film.
const DENSEST: f32 = 4.0;

impl Record {
    pub fn new(surface: &Surface, averages: Averages) -> Self {
        let mut bits = Writer { words: [0; WORDS], at: 0 };
        let s = surface;
        bits.passage(s.passage);
        bits.color(11, s.base_color);
        bits.whole(1, u32::from(s.measured.is_some()));
        match s.measured {
            // It has no other interface.
            Some(metal) => [u32::from(metal.index()), 0, 0].into_iter().for_each(|word| bits.whole(11, word)),
            None => match s.passage {
                Passage::Volume(clear) => bits.ratios(s.f0, clear.f0(), s.f90),
                _ => bits.color(11, s.f0),
            },
        }
        bits.fraction(10, s.f90);
        bits.fraction(8, s.metallic);
        bits.fraction(12, s.alpha.sqrt());
        bits.fraction(8, s.diffuse_roughness);
        bits.fraction(8, s.coat);
        bits.fraction(12, s.coat_alpha.sqrt());
        bits.fraction(8, s.coat_f0.sqrt());
        bits.color(10, s.coat_color);
        bits.fraction(8, s.coat_darkening);
        bits.signed(12, s.coat_normal.x);
        bits.signed(12, s.coat_normal.y);
        bits.whole(1, u32::from(s.coat_is_flat));
        bits.whole(1, u32::from(s.emission == Emission::OverAll));
        bits.color(10, s.sheen);
        bits.fraction(10, s.sheen_alpha.sqrt());
        match s.sheen_place {
            SheenPlace::UnderCoat => bits.whole(9, 0),
            SheenPlace::OverAll { cover } => {
                bits.whole(1, 1);
                bits.fraction(8, cover);
            }
        }
        bits.fraction(8, s.film);
        bits.fraction(10, (s.film_ior - 1.0) / (DENSEST - 1.0));
        bits.fraction(12, s.film_thickness / THICKEST);
        bits.fraction(8, s.anisotropy);
        bits.fraction(12, s.tangent.rem_euclid(PI) / PI);
        bits.averages(averages);
        Self(bits.words)
    }

    /// The same with another index of what is clear.
    pub fn with_ior(self, ior: f32) -> Self {
        // It stands after the kind of the passage and its fraction.
        let (mut bits, mut old) = (Writer { words: [0; WORDS], at: 0 }, Reader { words: &self.0, at: 0 });
        bits.whole(10, old.whole(10));
        bits.ior(ior);
        old.at = bits.at;
        while bits.at < 16 * WORDS {
            let n = (16 * WORDS - bits.at).min(16);
            bits.whole(n, old.whole(n));
        }
        Self(bits.words)
    }

    /// The same with other averages, which stand at its end.
    pub fn with_averages(self, averages: Averages) -> Self {
        let mut bits = Writer { words: self.0, at: 16 * WORDS - AVERAGES };
        bits.averages(averages);
        Self(bits.words)
    }

    pub fn read(&self) -> (Surface, Averages) {
        let mut bits = Reader { words: &self.0, at: 0 };
        let square = |x: f32| x * x;
        let passage = bits.passage();
        let base_color = bits.color(11);
        let (measured, f0) = if bits.whole(1) == 1 {
            let [index, ..] = [11; 3].map(|n| bits.whole(n));
            (Some(Metal::of_index(index as u8)), Rgb::ZERO)
        } else {
            let f0 = match passage {
                Passage::Volume(clear) => bits.ratios() * clear.f0(),
                _ => bits.color(11),
            };
            (None, f0)
        };
        let surface = Surface {
            base_color,
            f0,
            f90: bits.fraction(10),
            metallic: bits.fraction(8),
            alpha: square(bits.fraction(12)),
            diffuse_roughness: bits.fraction(8),
            coat: bits.fraction(8),
            coat_alpha: square(bits.fraction(12)),
            coat_f0: square(bits.fraction(8)),
            coat_color: bits.color(10),
            coat_darkening: bits.fraction(8),
            coat_normal: Vec2::new(bits.signed(12), bits.signed(12)),
            coat_is_flat: bits.whole(1) == 1,
            emission: if bits.whole(1) == 1 { Emission::OverAll } else { Emission::UnderCoat },
            sheen: bits.color(10),
            sheen_alpha: square(bits.fraction(10)),
            sheen_place: match (bits.whole(1), bits.fraction(8)) {
                (0, _) => SheenPlace::UnderCoat,
                (_, cover) => SheenPlace::OverAll { cover },
            },
            film: bits.fraction(8),
            film_ior: 1.0 + (DENSEST - 1.0) * bits.fraction(10),
            film_thickness: THICKEST * bits.fraction(12),
            anisotropy: bits.fraction(8),
            tangent: PI * bits.fraction(12),
            passage,
            measured,
        };
        (surface, Averages { passed: bits.fraction(16), spread: square(bits.fraction(15)) })
    }
}

/// The greatest number of so many bits.
fn most(bits: usize) -> f32 {
    ((1_u32 << bits) - 1) as f32
}

struct Writer {
    words: [u16; WORDS],
    at: usize,
}

impl Writer {
    fn whole(&mut self, bits: usize, number: u32) {
        let (word, shift) = (self.at / 16, self.at % 16);
        let shifted = number << shift;
        self.words[word] |= shifted as u16;
        if shift + bits > 16 {
            self.words[word + 1] |= (shifted >> 16) as u16;
        }
        self.at += bits;
    }

    fn averages(&mut self, averages: Averages) {
        self.words[self.at / 16] &= (1 << (self.at % 16)) - 1;
        self.words[self.at / 16 + 1..].fill(0);
        self.fraction(16, averages.passed);
        self.fraction(15, averages.spread.sqrt());
    }

    /// 41 bits: two for the kind, and a fraction, and for a leaf its colour, for what is clear its index, all but the
    /// sign.
    fn passage(&mut self, passage: Passage) {
        let clear = |bits: &mut Self, kind: u32, Clear { fraction, ior }: Clear| {
            bits.whole(2, kind);
            bits.fraction(8, fraction);
            bits.ior(ior);
        };
        match passage {
            Passage::None => [2, 8, 16, 15].into_iter().for_each(|n| self.whole(n, 0)),
            Passage::Leaf { fraction, color } => {
                self.whole(2, 1);
                self.fraction(8, fraction);
                self.color(10, color);
                self.whole(1, 0);
            }
            Passage::Wall(wall) => clear(self, 2, wall),
            Passage::Volume(volume) => clear(self, 3, volume),
        }
    }

    /// All but the sign.
    fn ior(&mut self, ior: f32) {
        self.whole(16, ior.to_bits() & 0xffff);
        self.whole(15, ior.to_bits() >> 16);
    }

    /// f0 by its ratio to `of_index`, up to 4, by its root, of which 1/2 is exact; where the index has none, to `f90`.
    fn ratios(&mut self, f0: Rgb, of_index: f32, f90: f32) {
        let ratio = |f0: f32| if of_index > 1e-9 { f0 / of_index } else { f90 };
        for f0 in f0.to_array() {
            self.whole(11, (0.5 * ratio(f0).sqrt() * RATIOS).round().clamp(0.0, RATIOS) as u32);
        }
    }

    fn fraction(&mut self, bits: usize, x: f32) {
        self.whole(bits, (x.clamp(0.0, 1.0) * most(bits)).round() as u32);
    }

    fn signed(&mut self, bits: usize, x: f32) {
        let half = (1_u32 << (bits - 1)) as f32;
        self.whole(bits, ((x.clamp(-1.0, 1.0) * (half - 1.0)).round() + half) as u32);
    }

    fn color(&mut self, bits: usize, color: Rgb) {
        color.to_array().into_iter().for_each(|c| self.fraction(bits, c.max(0.0).sqrt()));
    }
}

struct Reader<'a> {
    words: &'a [u16; WORDS],
    at: usize,
}

impl Reader<'_> {
    #[inline(always)]
    fn whole(&mut self, bits: usize) -> u32 {
        let (word, shift) = (self.at / 16, self.at % 16);
        let next = self.words.get(word + 1).copied().unwrap_or(0);
        let both = u32::from(self.words[word]) | u32::from(next) << 16;
        self.at += bits;
        both >> shift & ((1 << bits) - 1)
    }

    #[inline(always)]
    fn ratios(&mut self) -> Rgb {
        let roots = [11; 3].map(|n| 2.0 * self.whole(n) as f32 / RATIOS);
        Rgb::from_array(roots.map(|root| root * root))
    }

    #[inline(always)]
    fn passage(&mut self) -> Passage {
        let (kind, fraction) = (self.whole(2), self.fraction(8));
        if kind < 2 {
            let color = self.color(10);
            self.whole(1);
            return if kind == 0 { Passage::None } else { Passage::Leaf { fraction, color } };
        }
        let [low, high] = [16, 15].map(|n| self.whole(n));
        let clear = Clear { fraction, ior: f32::from_bits(high << 16 | low) };
        if kind == 2 { Passage::Wall(clear) } else { Passage::Volume(clear) }
    }

    #[inline(always)]
    fn fraction(&mut self, bits: usize) -> f32 {
        self.whole(bits) as f32 / most(bits)
    }

    #[inline(always)]
    fn signed(&mut self, bits: usize) -> f32 {
        let half = (1_u32 << (bits - 1)) as f32;
        (self.whole(bits) as f32 - half) / (half - 1.0)
    }

    #[inline(always)]
    fn color(&mut self, bits: usize) -> Rgb {
        let c = [self.fraction(bits), self.fraction(bits), self.fraction(bits)];
        Rgb::from_array(c.map(|c| c * c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passage(surface: &Surface) -> (f32, Rgb) {
        match surface.passage {
            Passage::Leaf { fraction, color } => (fraction, color),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn indices_survive_as_they_are() {
        for ior in [0.5, 0.66, 1.0, 1.0001, 1.333, 1.5, 2.4, 40.0_f32] {
            for of in [Passage::Wall, Passage::Volume] {
                let surface = Surface { passage: of(Clear { fraction: 1.0, ior }), ..Surface::LAMBERT };
                let read = Record::new(&surface, Averages::default()).read().0;
                let clear = read.clear().expect("it is clear");
                assert_eq!((clear.ior, clear.fraction), (ior, 1.0));
                assert_eq!(read.bounds_volume(), surface.bounds_volume());
                assert_eq!(Record::new(&read, Averages::default()).read().0, read);
            }
        }
    }

    #[test]
    fn numbers_survive_to_what_an_eye_sees() {
        let surface = Surface {
            base_color: Rgb::new(1.0, 0.5, 0.0),
            f0: Rgb::new(0.04, 1.0, 0.3),
            f90: 1.0,
            metallic: 0.3,
            alpha: 0.09,
            diffuse_roughness: 0.8,
            coat: 1.0,
            coat_alpha: 0.0025,
            coat_f0: 0.04,
            coat_color: Rgb::new(0.9, 0.3, 0.1),
            coat_darkening: 0.6,
            coat_normal: Vec2::new(-0.3, 0.7),
            coat_is_flat: true,
            emission: Emission::OverAll,
            sheen: Rgb::new(0.2, 0.9, 1.0),
            sheen_alpha: 0.5,
            sheen_place: SheenPlace::OverAll { cover: 0.4 },
            film: 0.7,
            film_ior: 1.3,
            film_thickness: 550.0,
            anisotropy: 0.6,
            tangent: 2.5,
            passage: Passage::Leaf { fraction: 0.4, color: Rgb::new(0.1, 0.2, 0.6) },
            measured: None,
        };
        let (read, averages) = Record::new(&surface, Averages { passed: 0.91, spread: 0.013 }).read();
        let near = |a: f32, b: f32, by: f32| assert!((a - b).abs() <= by, "{a} for {b}");
        for (a, b) in [
            (read.base_color, surface.base_color),
            (read.f0, surface.f0),
            (read.sheen, surface.sheen),
            (read.coat_color, surface.coat_color),
            (passage(&read).1, passage(&surface).1),
        ] {
            (0..3).for_each(|i| near(a[i], b[i], 1e-3));
        }
        for (a, b) in [
            (read.f90, 1.0),
            (read.metallic, 0.3),
            (read.alpha, 0.09),
            (read.coat, 1.0),
            (read.coat_alpha, 0.0025),
            (read.coat_normal.x, -0.3),
            (read.coat_normal.y, 0.7),
            (read.sheen_alpha, 0.5),
            (read.film, 0.7),
            (read.film_ior, 1.3),
            (read.film_thickness / THICKEST, 550.0 / THICKEST),
            (read.anisotropy, 0.6),
            (read.tangent, 2.5),
            (passage(&read).0, 0.4),
            (read.diffuse_roughness, 0.8),
            (read.coat_f0, 0.04),
            (read.coat_darkening, 0.6),
            (read.sheen_cover(), 0.4),
            (averages.passed, 0.91),
            (averages.spread, 0.013),
        ] {
            near(a, b, 2e-3);
        }
        assert_eq!((read.base_color.r(), read.base_color.b(), read.f90, read.coat), (1.0, 0.0, 1.0, 1.0));
        assert_eq!(read.emission, Emission::OverAll);
        keeps_what_it_reads(&read, averages);
    }

    fn keeps_what_it_reads(read: &Surface, averages: Averages) {
        assert_eq!(Record::new(read, averages).read().0, *read, "what has been read is kept as it is");
        let flat = Surface { coat_normal: Vec2::ZERO, ..*read };
        assert_eq!(Record::new(&flat, averages).read().0.coat_normal, Vec2::ZERO);
        for metal in Metal::all() {
            let metal = Surface { measured: Some(metal), f0: Rgb::ZERO, ..*read };
            assert_eq!(Record::new(&metal, averages).read().0, metal);
        }
    }
}
