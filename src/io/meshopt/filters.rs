//! What is done to elements after they were decompressed (`KHR_meshopt_compression`, appendix B). What the
//! specification leaves open for values out of range is some value here, too.

/// A filter, and the bytes of an element that it is made for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Filter {
    /// Unit vectors on an octahedron.
    Octahedral,
    /// Unit quaternions without their largest component.
    Quaternion,
    /// Floats as a mantissa and an exponent.
    Exponential,
    /// Colours as luma, two differences and alpha.
    Color,
}

impl Filter {
    /// Whether the filter is made for elements of `stride` bytes.
    pub(super) fn fits(self, stride: usize) -> bool {
        match self {
            Self::Octahedral | Self::Color => matches!(stride, 4 | 8),
            Self::Quaternion => stride == 8,
            Self::Exponential => stride.is_multiple_of(4),
        }
    }

    /// Decodes elements of `stride` bytes in place.
    pub(super) fn apply(self, bytes: &mut [u8], stride: usize) {
        let wide = stride == 8;
        match self {
            Self::Octahedral if wide => shorts(bytes, |v| octahedral(v.map(u16::cast_signed), 32767.0)),
            Self::Octahedral => octets(bytes, |v| octahedral(v.map(|x| i16::from(x.cast_signed())), 127.0)),
            Self::Quaternion => shorts(bytes, |v| quaternion(v.map(u16::cast_signed))),
            Self::Exponential => {
                bytes.as_chunks_mut::<4>().0.iter_mut().for_each(|v| *v = exponential(i32::from_le_bytes(*v)));
            }
            Self::Color if wide => shorts(bytes, |[y, co, cg, alpha]| {
                let [co, cg] = [co, cg].map(|c| i32::from(c.cast_signed()));
                color([y.into(), co, cg, alpha.into()], 65535.0).map(|c| c as u16)
            }),
            Self::Color => octets(bytes, |[y, co, cg, alpha]| {
                let [co, cg] = [co, cg].map(|c| i32::from(c.cast_signed()));
                // Saturated in 8 bits first.
                color([y.into(), co, cg, alpha.into()], 255.0).map(|c| u16::from(c as u8))
            }),
        }
    }
}

/// Four numbers of 8 bits at a time.
fn octets<T: Low>(bytes: &mut [u8], f: impl Fn([u8; 4]) -> [T; 4]) {
    bytes.as_chunks_mut::<4>().0.iter_mut().for_each(|v| *v = f(*v).map(Low::bits).map(|bits| bits as u8));
}

/// Four numbers of 16 bits at a time.
fn shorts<T: Low>(bytes: &mut [u8], f: impl Fn([u16; 4]) -> [T; 4]) {
    for v in bytes.as_chunks_mut::<8>().0 {
        let [a, b, c, d] =
            f([0, 2, 4, 6].map(|i| u16::from_le_bytes([v[i], v[i + 1]]))).map(|x| x.bits().to_le_bytes());
        *v = [a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]];
    }
}

/// A number whose lowest bits are stored.
trait Low {
    fn bits(self) -> u16;
}

impl Low for i16 {
    fn bits(self) -> u16 {
        self.cast_unsigned()
    }
}

impl Low for u16 {
    fn bits(self) -> u16 {
        self
    }
}

/// The third number is 1 in as many bits as the first two have; the fourth is left as it is.
fn octahedral([x, y, one, rest]: [i16; 4], max: f32) -> [i16; 4] {
    let [x, y] = [x, y].map(|v| f32::from(v) / f32::from(one));
    let z = 1.0 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let scale = max / (x * x + y * y + z * z).sqrt();
    let round = |v: f32| (v * scale).round() as i16;
    [round(x), round(y), round(z), rest]
}

/// The fourth number is 1 in as many bits as the others have, but for its last two, which say where the component
/// belongs that is left out.
fn quaternion([x, y, z, one]: [i16; 4]) -> [i16; 4] {
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(one | 3);
    let [x, y, z] = [x, y, z].map(|v| f32::from(v) * scale);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut out = [w, x, y, z].map(|v| (v * 32767.0).round() as i16);
    out.rotate_right((one & 3) as usize);
    out
}

/// 2^e · m, with e in the upper 8 bits and m in the lower 24.
fn exponential(v: i32) -> [u8; 4] {
    let mantissa = (v << 8) >> 8;
    ((f64::from(v >> 24).exp2() * f64::from(mantissa)) as f32).to_le_bytes()
}

/// The highest bit of alpha says how many bits the numbers have.
fn color([y, co, cg, alpha]: [i32; 4], max: f32) -> [f32; 4] {
    let all = (1 << (32 - alpha.leading_zeros())) - 1;
    let a = alpha & (all >> 1);
    let scale = max / all as f32;
    [y + co - cg, y + cg, y - co - cg, a << 1 | a & 1].map(|c| (c as f32 * scale).round())
}
