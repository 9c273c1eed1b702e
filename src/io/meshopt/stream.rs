//! Bytes that are read once, from front to back.

/// What is wrong with a compressed stream, and at which of its bytes.
#[derive(Debug)]
pub(super) struct Broken {
    pub(super) at: usize,
    pub(super) what: &'static str,
}

impl Broken {
    pub(super) fn new(at: usize, what: &'static str) -> Self {
        Self { at, what }
    }
}

/// The body of a compressed stream, between its header and its tail.
pub(super) struct Stream<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Stream<'a> {
    /// Splits off the header byte, which must be one of `headers`, and `tail` bytes at the end; returns the header too.
    pub(super) fn new(bytes: &'a [u8], headers: &[u8], tail: usize) -> Result<(Self, u8, &'a [u8]), Broken> {
        let Some(header) = bytes.first().copied().filter(|byte| headers.contains(byte)) else {
            return Err(Broken::new(0, "it does not start as its mode does, or has a version that is not known"));
        };
        let end = bytes.len().checked_sub(tail).filter(|&end| end >= 1);
        let end = end.ok_or_else(|| Broken::new(bytes.len(), "it is shorter than its header and its end"))?;
        Ok((Self { bytes: &bytes[..end], at: 1 }, header, &bytes[end..]))
    }

    /// How many bytes are left.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// A complaint about the byte before this place.
    pub(super) fn broken(&self, what: &'static str) -> Broken {
        Broken::new(self.at.saturating_sub(1), what)
    }

    pub(super) fn byte(&mut self) -> Result<u8, Broken> {
        Ok(self.take(1)?[0])
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], Broken> {
        let taken = self.bytes.get(self.at..).and_then(|rest| rest.get(..count));
        let taken = taken.ok_or_else(|| Broken::new(self.bytes.len(), "it ends too early"))?;
        self.at += count;
        Ok(taken)
    }

    /// A number of 7 bits a byte, the lowest first (LEB128), of five bytes at most.
    pub(super) fn number(&mut self) -> Result<u32, Broken> {
        let mut number = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            // Bits beyond the 32nd are dropped, as the specification says.
            number |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err(self.broken("a number has more than five bytes"))
    }

    /// That nothing is left.
    pub(super) fn end(&self) -> Result<(), Broken> {
        match self.left() {
            0 => Ok(()),
            _ => Err(Broken::new(self.at, "there are bytes left over")),
        }
    }
}

/// A signed difference whose sign is its lowest bit.
pub(super) fn unzigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}
