//! Choosing one of many in proportion to given weights.

use super::choice::{Choice, Remainder, divide, find};

/// A distribution over 0…n−1 in proportion to non-negative weights, sampled by bisection of its cumulative sum.
#[derive(Clone, Debug, Default)]
pub struct Discrete {
    /// Where the integers of each index begin: see [`divide`].
    begins: Vec<u64>,
    /// That of an index is how many integers choose it.
    probability: Vec<f32>,
}

impl Discrete {
    /// Normalises `weights`, which must be finite and not negative. With no positive weight the distribution is empty.
    ///
    /// # Panics
    /// If the sum of the weights is not finite.
    pub fn new(weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        assert!(total.is_finite(), "weights add up to {total}");
        let mut begins = Vec::with_capacity(weights.len());
        if !divide(weights, &mut begins) {
            return Self::default();
        }
        let ends = begins.iter().skip(1).chain([&Choice::COUNT]);
        let probability = begins.iter().zip(ends).map(|(begin, end)| Choice::probability(end - begin)).collect();
        Self { begins, probability }
    }

    /// Whether there is nothing to choose from.
    pub fn is_empty(&self) -> bool {
        self.probability.is_empty()
    }

    /// The index that `choice` leads to, and where in the index's share it lies.
    ///
    /// # Panics
    /// If the distribution is empty.
    #[inline]
    pub fn sample(&self, choice: Choice) -> (usize, Remainder) {
        find(&self.begins, choice)
    }

    /// Where the choices of each index begin.
    pub fn begins(&self) -> &[u64] {
        &self.begins
    }

    /// The probability of index `i`: positive exactly where its weight is.
    #[inline]
    pub fn probability(&self, i: usize) -> f32 {
        self.probability[i]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_come_in_proportion_and_zero_weights_never() {
        let d = Discrete::new(&[0.0, 1.0, 0.0, 3.0, 0.0]);
        let n = 4000;
        let mut counts = [0; 5];
        for k in 0..n {
            counts[d.sample(Choice::from((k as f32 + 0.5) / n as f32)).0] += 1;
        }
        assert_eq!(counts, [0, n / 4, 0, 3 * n / 4, 0]);
        assert_eq!([0, 1, 2, 3, 4].map(|i| d.probability(i)), [0.0, 0.25, 0.0, 0.75, 0.0]);
        for end in [0, u64::MAX] {
            assert!(d.probability(d.sample(Choice::new(end)).0) > 0.0);
        }
        assert!(Discrete::new(&[0.0]).is_empty() && Discrete::new(&[]).is_empty());
    }

    /// What 24 bits leave out: beside a heavy weight, most of a million light ones.
    #[test]
    fn every_index_of_a_million_has_numbers_in_proportion() {
        let mut weights = vec![1e-3; 1_000_000];
        weights[17] = 1e10;
        let d = Discrete::new(&weights);
        let total = 1e10 + 999.999;
        for i in (0..1_000_000).step_by(997).chain([16, 17, 18, 999_999]) {
            let p = weights[i] / total;
            assert!((f64::from(d.probability(i)) / p - 1.0).abs() < 1e-6, "{i}: {}", d.probability(i));
            // The middle of its share.
            let before = p * (i as f64 + 0.5) + if i > 17 { 1e10 / total - p } else { 0.0 };
            let middle = if i == 17 {
                1 << 63
            } else if i < 17 {
                (before * 2_f64.powi(64)) as u64
            } else {
                Choice::COUNT - (((999_999 - i) as f64 + 0.5) * p * 2_f64.powi(64)) as u64
            };
            assert_eq!(d.sample(Choice::new(middle)).0, i);
        }
    }
}
