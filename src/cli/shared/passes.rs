//! Which passes of a render a film holds: all of them, or those of some shards.

use std::{fmt, ops::Range};

use pathspace::film::Film;

/// Ranges of passes without overlaps, in order and none of them empty.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Passes(Vec<Range<u32>>);

impl Passes {
    /// Adds the passes of another part.
    ///
    /// # Errors
    /// Those passes that are there already.
    pub fn insert(&mut self, new: Range<u32>) -> Result<(), Range<u32>> {
        let common = |old: &Range<u32>| old.start.max(new.start)..old.end.min(new.end);
        if let Some(twice) = self.0.iter().map(common).find(|both| !both.is_empty()) {
            return Err(twice);
        }
        if !new.is_empty() {
            self.0.push(new);
            self.0.sort_by_key(|range| range.start);
            self.0.dedup_by(|next, last| {
                let touch = last.end == next.start;
                if touch {
                    last.end = next.end;
                }
                touch
            });
        }
        Ok(())
    }

    /// What is missing of the passes 0 to `whole`.
    pub fn missing(&self, whole: u32) -> Self {
        let starts = self.0.iter().map(|range| range.start).chain([whole]);
        let ends = [0].into_iter().chain(self.0.iter().map(|range| range.end));
        Self(ends.zip(starts).map(|(from, to)| from..to).filter(|gap| !gap.is_empty()).collect())
    }

    /// Samples per pixel.
    pub fn count(&self) -> u32 {
        self.0.iter().map(|range| range.len() as u32).sum()
    }

    /// All of them, if there are no gaps.
    pub fn range(&self) -> Option<Range<u32>> {
        match &self.0[..] {
            [only] => Some(only.clone()),
            _ => None,
        }
    }

    /// From the first of them to the last.
    pub fn span(&self) -> Range<u32> {
        self.0.first().map_or(0, |first| first.start)..self.0.last().map_or(0, |last| last.end)
    }

    /// Whether these are all passes from the first to the last, as those of a render that ended there.
    pub fn is_from_start(&self) -> bool {
        matches!(&self.0[..], [] | [Range { start: 0, .. }])
    }

    /// The noise of their image, if both halves have as many of them.
    pub fn noise(&self, film: &Film) -> Option<f64> {
        let even = |range: &Range<u32>| range.end.div_ceil(2) - range.start.div_ceil(2);
        let even: u32 = self.0.iter().map(even).sum();
        (2 * even == self.count()).then(|| film.noise(self.count())).flatten()
    }
}

impl From<Range<u32>> for Passes {
    fn from(range: Range<u32>) -> Self {
        Self(if range.is_empty() { Vec::new() } else { vec![range] })
    }
}

impl fmt::Display for Passes {
    /// `0 to 15 and 32`: counted from 0, both ends included.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, Range { start, end }) in self.0.iter().enumerate() {
            let and = if i > 0 { " and " } else { "" };
            match end - start {
                1 => write!(f, "{and}{start}")?,
                _ => write!(f, "{and}{start} to {}", end - 1)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(ranges: &[Range<u32>]) -> Passes {
        let mut passes = Passes::default();
        ranges.iter().for_each(|range| passes.insert(range.clone()).unwrap());
        passes
    }

    #[test]
    fn parts_in_any_order_make_one_whole() {
        let all = of(&[5..9, 0..0, 9..9, 0..2, 2..5]);
        assert_eq!((all.count(), all.missing(9), all.is_from_start()), (9, Passes::default(), true));
        assert_eq!(all, (0..9).into());
        let some = of(&[8..9, 2..4, 4..6]);
        assert_eq!((some.to_string().as_str(), some.count()), ("2 to 5 and 8", 5));
        assert_eq!(some.missing(12).to_string(), "0 to 1 and 6 to 7 and 9 to 11");
        assert!(!some.is_from_start());
    }

    #[test]
    fn what_is_there_twice_is_found() {
        assert_eq!(of(&[0..4, 8..12]).insert(3..9), Err(3..4));
        assert_eq!(Passes::from(0..4).insert(1..2), Err(1..2));
        assert_eq!(Passes::from(0..4).insert(2..2), Ok(()));
        assert_eq!(Passes::from(0..4).insert(4..5), Ok(()));
    }
}
