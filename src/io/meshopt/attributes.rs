//! Mode ATTRIBUTES: elements of any kind as differences from the element before, each byte of an element in a column
//! of its own (`KHR_meshopt_compression`, appendix A, mode 0; its version 0 is that of `EXT_meshopt_compression`).

use super::stream::{Broken, Stream};

/// The most elements of a block.
const BLOCK: usize = 256;
/// Elements whose differences have the same number of bits.
const GROUP: usize = 16;

/// The differences in one byte of all elements of a block.
type Column = [u8; BLOCK];

/// `count` elements of `stride` bytes, a multiple of 4 from 4 to 256. Memory is taken as the stream is read, which
/// describes at most 1024 bytes by one.
pub(super) fn decode(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Broken> {
    let first = bytes.first().is_some_and(|&header| header == 0xa0);
    let (tail, padded) =
        if first { (stride, stride.max(32)) } else { (stride + stride / 4, (stride + stride / 4).max(24)) };
    let (mut stream, _, end) = Stream::new(bytes, &[0xa0, 0xa1], padded)?;
    let (last, channels) = end[padded - tail..].split_at(stride);
    let channels = channels_of(channels, stride, bytes.len())?;
    let mut last = last.to_vec();
    let mut columns: Vec<Column> = vec![[0; BLOCK]; stride];
    let most = (8192 / stride / GROUP * GROUP).min(BLOCK);
    let mut out = Vec::new();
    let mut left = count;
    while left > 0 {
        let elements = left.min(most);
        let controls = if first { &[][..] } else { stream.take(stride / 4)? };
        for (byte, column) in columns.iter_mut().enumerate() {
            let control = controls.get(byte / 4).map(|four| four >> (byte % 4 * 2) & 3);
            read_column(&mut stream, control, column, elements)?;
        }
        let start = out.len();
        out.resize(start + elements * stride, 0);
        for (k, channel) in channels.iter().enumerate() {
            let last: &mut [u8; 4] = (&mut last[4 * k..4 * k + 4]).try_into().expect("four bytes");
            add_up(*channel, &columns[4 * k..4 * k + 4], last, &mut out[start + 4 * k..], stride, elements);
        }
        left -= elements;
    }
    stream.end()?;
    Ok(out)
}

/// How the differences of four bytes are meant.
#[derive(Clone, Copy)]
enum Channel {
    /// Each byte by itself.
    Bytes,
    /// As two numbers of 16 bits.
    Halves,
    /// As 32 bits that changed, rotated to the left by so many.
    Changed(u32),
}

fn channels_of(modes: &[u8], stride: usize, end: usize) -> Result<Vec<Channel>, Broken> {
    if modes.is_empty() {
        return Ok(vec![Channel::Bytes; stride / 4]);
    }
    let channel = |&mode: &u8| match mode {
        0 => Ok(Channel::Bytes),
        1 => Ok(Channel::Halves),
        _ if mode & 15 == 2 => Ok(Channel::Changed(u32::from(mode >> 4))),
        _ => Err(Broken::new(end - stride / 4, "a channel has a mode that does not exist")),
    };
    modes.iter().map(channel).collect()
}

/// Reads one column of a block. `control` is the column's mode, of which version 0 has none.
fn read_column(
    stream: &mut Stream<'_>,
    control: Option<u8>,
    column: &mut Column,
    elements: usize,
) -> Result<(), Broken> {
    let bits: [u32; 4] = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => {
            column.fill(0);
            return Ok(());
        }
        Some(_) => {
            column[..elements].copy_from_slice(stream.take(elements)?);
            return Ok(());
        }
    };
    let groups = elements.div_ceil(GROUP);
    let headers = stream.take(groups.div_ceil(4))?;
    for (group, deltas) in column.as_chunks_mut::<GROUP>().0[..groups].iter_mut().enumerate() {
        read_group(stream, bits[usize::from(headers[group / 4] >> (group % 4 * 2) & 3)], deltas)?;
    }
    Ok(())
}

/// Reads sixteen differences of so many bits. Where all bits are set, the difference is a byte behind the group.
fn read_group(stream: &mut Stream<'_>, bits: u32, deltas: &mut [u8; GROUP]) -> Result<(), Broken> {
    match bits {
        0 => deltas.fill(0),
        8 => deltas.copy_from_slice(stream.take(GROUP)?),
        _ => {
            let packed = stream.take(2 * bits as usize)?;
            let (per_byte, sentinel) = (8 / bits, (1_u8 << bits) - 1);
            for (i, delta) in (0..).zip(deltas) {
                // From the highest bit down, but single bits from the lowest up.
                let place = i % per_byte;
                let shift = if bits == 1 { place } else { 8 - bits - place * bits };
                *delta = packed[(i / per_byte) as usize] >> shift & sentinel;
                if *delta == sentinel {
                    *delta = stream.byte()?;
                }
            }
        }
    }
    Ok(())
}

/// Puts four bytes of each element together: the first at the start of `out`, the others `stride` bytes apart. `last`
/// are those of the element before, and then of the last one.
fn add_up(channel: Channel, columns: &[Column], last: &mut [u8; 4], out: &mut [u8], stride: usize, elements: usize) {
    for i in 0..elements {
        let delta = [columns[0][i], columns[1][i], columns[2][i], columns[3][i]];
        *last = match channel {
            Channel::Bytes => {
                let sum = |k: usize| last[k].wrapping_add((delta[k] >> 1) ^ (delta[k] & 1).wrapping_neg());
                [sum(0), sum(1), sum(2), sum(3)]
            }
            Channel::Halves => {
                let sum = |k: usize| {
                    let v = u16::from_le_bytes([delta[k], delta[k + 1]]);
                    let delta = (v >> 1) ^ (v & 1).wrapping_neg();
                    u16::from_le_bytes([last[k], last[k + 1]]).wrapping_add(delta).to_le_bytes()
                };
                let ([a, b], [c, d]) = (sum(0), sum(2));
                [a, b, c, d]
            }
            Channel::Changed(rotated) => {
                (u32::from_le_bytes(*last) ^ u32::from_le_bytes(delta).rotate_right(rotated)).to_le_bytes()
            }
        };
        out[i * stride..i * stride + 4].copy_from_slice(last);
    }
}
