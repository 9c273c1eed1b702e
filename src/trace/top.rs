//! The largest of many, in bounded memory.

/// The largest of what it has seen, among equals the first.
pub struct Top<T> {
    most: usize,
    /// Nothing that is not above this one is of interest.
    least: Option<f32>,
    /// Largest first.
    all: Vec<(f32, T)>,
}

impl<T> Top<T> {
    /// The largest `most` of all.
    pub fn new(most: usize) -> Self {
        Self::above(most, None)
    }

    /// The same of those that are larger than `least`.
    pub fn above(most: usize, least: Option<f32>) -> Self {
        Self { most, least, all: Vec::new() }
    }

    /// How many it keeps.
    pub fn most(&self) -> usize {
        self.most
    }

    /// What something has to exceed to be among them.
    pub fn least(&self) -> Option<f32> {
        let last = if self.all.len() < self.most { None } else { self.all.last() };
        last.map(|(size, _)| *size).or(self.least)
    }

    /// Whether something of this size would be among them.
    pub fn admits(&self, size: f32) -> bool {
        self.most > 0 && self.least().is_none_or(|least| size > least)
    }

    /// Adds one, if it is large enough.
    pub fn insert(&mut self, size: f32, item: T) {
        if self.admits(size) {
            let at = self.all.partition_point(|(other, _)| *other >= size);
            self.all.insert(at, (size, item));
            self.all.truncate(self.most);
        }
    }

    /// Adds all that another has seen later.
    pub fn take(&mut self, later: Self) {
        for (size, item) in later.all {
            self.insert(size, item);
        }
    }

    /// All of them.
    pub fn into_largest_first(self) -> impl Iterator<Item = T> {
        self.all.into_iter().map(|(_, item)| item)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_make_the_same_as_the_whole() {
        let sizes: Vec<f32> = (0..200_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 27) as f32).collect();
        let mut whole = Top::new(7);
        sizes.iter().enumerate().for_each(|(i, size)| whole.insert(*size, i));
        let mut parts = Top::new(7);
        for (k, chunk) in sizes.chunks(23).enumerate() {
            let mut part = Top::above(7, parts.least());
            chunk.iter().enumerate().for_each(|(i, size)| part.insert(*size, 23 * k + i));
            parts.take(part);
        }
        // A stable sort keeps the first of equals first.
        let mut order: Vec<_> = (0..sizes.len()).collect();
        order.sort_by(|a, b| sizes[*b].total_cmp(&sizes[*a]));
        let expected = &order[..7];
        assert_eq!(whole.into_largest_first().collect::<Vec<_>>(), expected);
        assert_eq!(parts.into_largest_first().collect::<Vec<_>>(), expected);
        let mut none = Top::new(0);
        none.insert(1.0, 0);
        assert_eq!(none.into_largest_first().count(), 0);
    }
}
