//! Which of many things are the same, by keys that together would take too much memory.

use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher, Hash};

use rayon::prelude::*;

/// Of all that have a key in common, the first with each of the others, in order.
pub(super) fn same<K: Hash + Ord>(
    things: impl IndexedParallelIterator<Item = u32>,
    key: impl Fn(u32) -> K + Sync,
) -> Vec<(u32, u32)> {
    let hasher = BuildHasherDefault::<DefaultHasher>::default();
    // Of most things the hashes differ already.
    let mut hashes: Vec<(u32, u32)> = things.map(|i| (hasher.hash_one(key(i)) as u32, i)).collect();
    hashes.par_sort_unstable();
    let mut pairs = Vec::new();
    for run in hashes.chunk_by_mut(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
        run.sort_by_cached_key(|&(_, i)| (key(i), i));
        for group in run.chunk_by(|a, b| key(a.1) == key(b.1)) {
            pairs.extend(group[1..].iter().map(|(_, i)| (group[0].1, *i)));
        }
    }
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_comes_with_each_of_the_others() {
        // Two million names, of which hundreds share a hash.
        let count = 2_000_000;
        assert!(same((0..count).into_par_iter(), |i| i).is_empty());
        let halves = same((0..count).into_par_iter(), |i| i % (count - 5));
        assert_eq!(halves, [0, 1, 2, 3, 4].map(|i| (i, count - 5 + i)));
        let all = same((0..40_000).into_par_iter(), |_| 7);
        assert!(all.into_iter().eq((1..40_000).map(|i| (0, i))));
    }
}
