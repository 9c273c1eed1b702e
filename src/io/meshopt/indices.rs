//! Modes TRIANGLES and INDICES (`KHR_meshopt_compression`, appendix A, modes 1 and 2).

use super::stream::{Broken, Stream, unzigzag};

/// What was met last; a place that nothing was put into is not to be read.
struct Recent<T> {
    entries: [T; 16],
    pushed: usize,
}

impl<T: Copy + Default> Recent<T> {
    fn new() -> Self {
        Self { entries: [T::default(); 16], pushed: 0 }
    }

    fn push(&mut self, entry: T) {
        self.entries[self.pushed % 16] = entry;
        self.pushed += 1;
    }

    /// The entry that was put in `age` entries before the last one.
    fn get(&self, age: u8) -> Option<T> {
        let place = self.pushed.checked_sub(1 + usize::from(age))?;
        Some(self.entries[place % 16])
    }
}

/// `count` corners of triangles, a multiple of three.
pub(super) fn triangles(bytes: &[u8], count: usize) -> Result<Vec<u32>, Broken> {
    let (mut data, _, table) = Stream::new(bytes, &[0xe1], 16)?;
    if table[14..] != [0, 0] || table.iter().any(|entry| entry >> 4 == 15 || entry & 15 == 15) {
        return Err(Broken::new(bytes.len() - 16, "the table at its end has entries that cannot be"));
    }
    // One byte a triangle bounds the memory that is taken.
    let codes = data.take(count / 3)?;
    let mut decoder = Triangles { data, next: 0, last: 0, edges: Recent::new(), vertices: Recent::new() };
    let mut corners = Vec::with_capacity(count);
    for &code in codes {
        corners.extend(match (code >> 4, code & 15) {
            (15, low @ 0..14) => decoder.by_table(table[usize::from(low)])?,
            (15, low) => decoder.in_full(low == 14)?,
            (edge, low) => decoder.at_edge(edge, low)?,
        });
    }
    decoder.data.end()?;
    Ok(corners)
}

struct Triangles<'a> {
    data: Stream<'a>,
    /// The vertex that was not met yet.
    next: u32,
    /// The vertex that was written in full last.
    last: u32,
    edges: Recent<(u32, u32)>,
    vertices: Recent<u32>,
}

impl Triangles<'_> {
    fn unmet(&mut self) -> u32 {
        let next = self.next;
        self.next = next.wrapping_add(1);
        next
    }

    fn met(&self, age: u8) -> Result<u32, Broken> {
        self.vertices.get(age).ok_or_else(|| self.data.broken("it goes back to a vertex before the first"))
    }

    fn written(&mut self) -> Result<u32, Broken> {
        self.last = self.last.wrapping_add(unzigzag(self.data.number()?));
        Ok(self.last)
    }

    /// A triangle at an edge of an earlier one.
    fn at_edge(&mut self, edge: u8, low: u8) -> Result<[u32; 3], Broken> {
        let known = self.edges.get(edge);
        let (a, b) = known.ok_or_else(|| self.data.broken("it goes back to an edge before the first"))?;
        let c = match low {
            0 => self.unmet(),
            1..13 => self.met(low)?,
            13 | 14 => {
                let step = if low == 13 { u32::MAX } else { 1 };
                self.last = self.last.wrapping_add(step);
                self.last
            }
            _ => self.written()?,
        };
        self.edges.push((c, b));
        self.edges.push((a, c));
        if !(1..13).contains(&low) {
            self.vertices.push(c);
        }
        Ok([a, b, c])
    }

    /// A new vertex, and two that are new or were met lately.
    fn by_table(&mut self, entry: u8) -> Result<[u32; 3], Broken> {
        let (z, w) = (entry >> 4, entry & 15);
        let a = self.unmet();
        let b = if z == 0 { self.unmet() } else { self.met(z - 1)? };
        let c = if w == 0 { self.unmet() } else { self.met(w - 1)? };
        self.free([a, b, c], z == 0, w == 0)
    }

    /// Three vertices, each of which may be written in full.
    fn in_full(&mut self, a_is_unmet: bool) -> Result<[u32; 3], Broken> {
        let entry = self.data.byte()?;
        if entry == 0 {
            self.next = 0;
        }
        let (z, w) = (entry >> 4, entry & 15);
        let a = if a_is_unmet { self.unmet() } else { self.written()? };
        let mut vertex = |kind: u8| match kind {
            0 => Ok(self.unmet()),
            15 => self.written(),
            _ => self.met(kind - 1),
        };
        let (b, c) = (vertex(z)?, vertex(w)?);
        self.free([a, b, c], matches!(z, 0 | 15), matches!(w, 0 | 15))
    }

    /// Remembers a triangle whose first vertex, and others as stated, were not among the recent ones.
    fn free(&mut self, [a, b, c]: [u32; 3], b_is_new: bool, c_is_new: bool) -> Result<[u32; 3], Broken> {
        for edge in [(b, a), (c, b), (a, c)] {
            self.edges.push(edge);
        }
        self.vertices.push(a);
        if b_is_new {
            self.vertices.push(b);
        }
        if c_is_new {
            self.vertices.push(c);
        }
        Ok([a, b, c])
    }
}

/// `count` indices of any kind, each a difference from one of two earlier ones.
pub(super) fn sequence(bytes: &[u8], count: usize) -> Result<Vec<u32>, Broken> {
    let (mut data, _, _) = Stream::new(bytes, &[0xd1], 4)?;
    if data.left() < count {
        return Err(Broken::new(bytes.len(), "it ends too early"));
    }
    let mut last = [0_u32; 2];
    let mut indices = Vec::with_capacity(count);
    for _ in 0..count {
        let number = data.number()?;
        let baseline = &mut last[(number & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag(number >> 1));
        indices.push(*baseline);
    }
    data.end()?;
    Ok(indices)
}
