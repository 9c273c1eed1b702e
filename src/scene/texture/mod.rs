//! Textures: images and how a material reads them.
//!
//! Texels stay as the 8 or 16 bit integers of the file and are decoded on every lookup, sRGB through a table. There are
//! no mipmaps: every pixel averages many paths, which is the integral that a mipmap approximates, and a footprint is
//! defined for camera rays only, so that a prefiltered texture would differ between strategies.

#[cfg(test)]
mod tests;

use std::{
    fmt,
    ops::Range,
    sync::{Arc, LazyLock, OnceLock},
};

use glam::{Affine2, Vec2, Vec3, Vec4};

/// A raster of texels with 1 to 4 channels: grey, grey and alpha, RGB, or RGBA.
#[derive(Clone, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    channels: usize,
    texels: Texels,
    /// The least and the greatest of each channel, alpha last, as fractions of the greatest there can be; found when
    /// first asked for.
    extremes: OnceLock<[Vec4; 2]>,
}

/// The samples of an [`Image`], row by row from the top, channels interleaved.
#[derive(Clone, PartialEq)]
pub enum Texels {
    /// 8 bits a channel.
    U8(Vec<u8>),
    /// 16 bits a channel.
    U16(Vec<u16>),
}

/// How the colour channels of an image stand for numbers; its alpha is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// By the sRGB transfer function (IEC 61966-2-1): colours.
    Srgb,
    /// In proportion: everything that is no colour.
    Linear,
}

/// What lies beyond [0, 1] along one texture coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture again, every second time mirrored.
    Mirror,
    /// The texel at the edge.
    Clamp,
}

/// How a lookup between texel centres is answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// By the texel that contains the place.
    Nearest,
    /// By bilinear interpolation of the four nearest texels, after decoding.
    #[default]
    Bilinear,
}

/// An image as one slot of a material reads it.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The image, shared by all that read it.
    pub image: Arc<Image>,
    /// How its colours are stored.
    pub encoding: Encoding,
    /// What lies beyond its edges, along u and along v.
    pub wrap: [Wrap; 2],
    /// How it is interpolated.
    pub filter: Filter,
    /// Which of the mesh's sets of texture coordinates places it.
    pub uv_set: u8,
    /// From the mesh's texture coordinates to those of the image: (0, 0) its upper left corner, (1, 1) its lower right
    /// one.
    pub transform: Affine2,
}

impl Image {
    /// An image of `width` × `height` texels; how many channels there are follows from the number of samples.
    ///
    /// # Panics
    /// If the size is zero, or the samples are not 1 to 4 for each texel.
    pub fn new(width: u32, height: u32, texels: Texels) -> Self {
        let (samples, pixels) = (texels.len(), width as usize * height as usize);
        assert!(pixels > 0 && samples.is_multiple_of(pixels), "{samples} samples for {width} × {height} texels");
        let channels = samples / pixels;
        assert!((1..=4).contains(&channels), "{channels} channels");
        Self { width, height, channels, texels, extremes: OnceLock::new() }
    }

    /// Width and height in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Whether it has an alpha channel that differs from 1 anywhere.
    pub fn has_alpha(&self) -> bool {
        if !self.channels.is_multiple_of(2) {
            return false;
        }
        match &self.texels {
            Texels::U8(v) => v.chunks_exact(self.channels).any(|t| t[self.channels - 1] != u8::MAX),
            Texels::U16(v) => v.chunks_exact(self.channels).any(|t| t[self.channels - 1] != u16::MAX),
        }
    }

    /// The least and the greatest of each channel among the texels of some columns and rows, linear and in [0, 1].
    fn extremes_within(&self, columns: Range<u32>, rows: Range<u32>) -> [Vec4; 2] {
        let texels = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
        texels
            .map(|(x, y)| self.texel(x, y, Encoding::Linear))
            .fold([Vec4::ONE, Vec4::ZERO], |[least, greatest], texel| [least.min(texel), greatest.max(texel)])
    }

    /// The same of all texels.
    fn extremes(&self) -> [Vec4; 2] {
        *self.extremes.get_or_init(|| self.extremes_within(0..self.width, 0..self.height))
    }

    /// The memory that the texels take, bytes.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Texels::U8(v) => v.len(),
            Texels::U16(v) => 2 * v.len(),
        }
    }

    /// The decoded texel in column `x` and row `y`: red, green, blue, alpha. Grey fills three channels, and a missing
    /// alpha is 1.
    ///
    /// # Panics
    /// Outside of the image.
    #[inline]
    pub fn texel(&self, x: u32, y: u32, encoding: Encoding) -> Vec4 {
        let at = (y as usize * self.width as usize + x as usize) * self.channels;
        match &self.texels {
            Texels::U8(v) => {
                let table = table(encoding);
                spread(&v[at..at + self.channels], |c| table[usize::from(c)], |a| f32::from(a) * (1.0 / 255.0))
            }
            Texels::U16(v) => {
                let linear = |c: u16| f32::from(c) * (1.0 / 65535.0);
                let color = |c: u16| if encoding == Encoding::Srgb { srgb_to_linear(linear(c)) } else { linear(c) };
                spread(&v[at..at + self.channels], color, linear)
            }
        }
    }
}

impl Texels {
    fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U16(v) => v.len(),
        }
    }
}

impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bits = if matches!(self.texels, Texels::U8(_)) { 8 } else { 16 };
        write!(f, "Image({} × {}, {} × {bits} bit)", self.width, self.height, self.channels)
    }
}

/// The sRGB transfer function's inverse (IEC 61966-2-1).
pub fn srgb_to_linear(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

#[inline]
fn table(encoding: Encoding) -> &'static [f32; 256] {
    static SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)));
    static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| i as f32 / 255.0));
    match encoding {
        Encoding::Srgb => &SRGB,
        Encoding::Linear => &LINEAR,
    }
}

#[inline]
fn spread<T: Copy>(texel: &[T], color: impl Fn(T) -> f32, alpha: impl Fn(T) -> f32) -> Vec4 {
    match *texel {
        [l] => Vec4::splat(color(l)).with_w(1.0),
        [l, a] => Vec4::splat(color(l)).with_w(alpha(a)),
        [r, g, b] => Vec4::new(color(r), color(g), color(b), 1.0),
        [r, g, b, a] => Vec4::new(color(r), color(g), color(b), alpha(a)),
        _ => unreachable!("an image has 1 to 4 channels"),
    }
}

impl Wrap {
    /// The texel 0…n−1 that stands for the integer coordinate `i` (OpenGL 4.6 core profile, table 8.20).
    #[inline]
    fn texel(self, i: i64, n: u32) -> u32 {
        let n = i64::from(n);
        (match self {
            Self::Clamp => i.clamp(0, n - 1),
            // A lookup lies within the texture or next to it almost always: no division then.
            _ if (0..n).contains(&i) => i,
            Self::Repeat => i.rem_euclid(n),
            Self::Mirror => {
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }
        }) as u32
    }
}

impl Texture {
    /// A texture that repeats and is interpolated, over the first set of texture coordinates.
    pub fn new(image: Arc<Image>, encoding: Encoding) -> Self {
        Self {
            image,
            encoding,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Bilinear,
            uv_set: 0,
            transform: Affine2::IDENTITY,
        }
    }

    /// The decoded colour and alpha at the mesh's texture coordinates `uv`, each in [0, 1].
    #[inline]
    pub fn lookup(&self, uv: Vec2) -> Vec4 {
        let place = self.place(uv);
        match self.filter {
            Filter::Nearest => {
                let texel = place.floor();
                self.image.texel(self.wrapped(0, texel.x), self.wrapped(1, texel.y), self.encoding)
            }
            Filter::Bilinear => {
                let place = place - 0.5;
                let corner = place.floor();
                let f = place - corner;
                let (x, y) = ([corner.x, corner.x + 1.0], [corner.y, corner.y + 1.0]);
                let (x, y) = (x.map(|x| self.wrapped(0, x)), y.map(|y| self.wrapped(1, y)));
                let row = |y: u32| {
                    let [a, b] = x.map(|x| self.image.texel(x, y, self.encoding));
                    a + (b - a) * f.x
                };
                let (top, bottom) = (row(y[0]), row(y[1]));
                top + (bottom - top) * f.y
            }
        }
    }

    /// The least and the greatest that a lookup can find in each channel, alpha last: interpolation stays between the
    /// texels.
    pub fn extremes(&self) -> [Vec4; 2] {
        self.image.extremes().map(|texel| self.decode(texel))
    }

    /// Bounds on the colour channels of any lookup within the triangle of these texture coordinates; 0 only where all
    /// lookups are 0 in that channel. Large triangles get the whole image's.
    pub fn bound(&self, uv: [Vec2; 3]) -> Vec3 {
        const MOST_TEXELS: f32 = 4096.0;
        let [a, b, c] = uv.map(|uv| self.place(uv));
        let (min, max) = (a.min(b).min(c).floor() - 1.0, a.max(b).max(c).floor() + 1.0);
        let size = max - min + 1.0;
        let whole = Vec2::new(self.image.width as f32, self.image.height as f32);
        // A comparison that also holds for sizes that overflow.
        let small = size.cmplt(whole).all() && size.x * size.y <= MOST_TEXELS && min.abs().max_element() < 1e6;
        let linear = if small {
            let span = |lo: f32, hi: f32, wrap: Wrap, n: u32| (lo as i64..=hi as i64).map(move |i| wrap.texel(i, n));
            let columns = span(min.x, max.x, self.wrap[0], self.image.width);
            let rows = || span(min.y, max.y, self.wrap[1], self.image.height);
            columns
                .flat_map(|x| rows().map(move |y| (x, y)))
                .map(|(x, y)| self.image.texel(x, y, Encoding::Linear))
                .fold(Vec4::ZERO, Vec4::max)
        } else {
            self.image.extremes()[1]
        };
        self.decode(linear).truncate()
    }

    /// A texel as lookups find it, from its fractions of the greatest there can be.
    fn decode(&self, linear: Vec4) -> Vec4 {
        match self.encoding {
            Encoding::Srgb => linear.truncate().map(srgb_to_linear).extend(linear.w),
            Encoding::Linear => linear,
        }
    }

    /// `uv` in units of texels. Coordinates that overflow mean the corner.
    #[inline]
    fn place(&self, uv: Vec2) -> Vec2 {
        let size = Vec2::new(self.image.width as f32, self.image.height as f32);
        let place = self.transform.transform_point2(uv) * size;
        if place.is_finite() { place } else { Vec2::ZERO }
    }

    /// The texel that stands for a whole coordinate along an axis.
    #[inline]
    fn wrapped(&self, axis: usize, coordinate: f32) -> u32 {
        let n = [self.image.width, self.image.height][axis];
        self.wrap[axis].texel(coordinate as i64, n)
    }
}
