//! Choosing one of many in proportion to given weights.

/// A distribution over 0…n−1 in proportion to non-negative weights, sampled by bisection of its cumulative sum.
#[derive(Clone, Debug, Default)]
pub struct Discrete {
    /// `cumulative[i]` is the sum of the probabilities before `i`; the last entry is exactly 1. In f64, so that an index of
    /// little weight keeps a positive probability.
    cumulative: Vec<f64>,
    probability: Vec<f32>,
}

impl Discrete {
    /// Normalises `weights`, which must be finite and not negative. With no positive weight the distribution is empty.
    ///
    /// # Panics
    /// If the sum of the weights is not finite.
    pub fn new(weights: &[f32]) -> Self {
        debug_assert!(weights.iter().all(|w| w.is_finite() && *w >= 0.0));
        let total: f64 = weights.iter().copied().map(f64::from).sum();
        assert!(total.is_finite(), "weights add up to {total}");
        if total <= 0.0 {
            return Self::default();
        }
        let mut sum = 0.0_f64;
        let mut cumulative = Vec::with_capacity(weights.len() + 1);
        for &w in weights {
            cumulative.push(sum / total);
            sum += f64::from(w);
        }
        cumulative.push(1.0);
        // The probability that bisection really gives.
        let probability = cumulative.windows(2).map(|c| (c[1] - c[0]) as f32).collect();
        Self { cumulative, probability }
    }

    /// Whether there is nothing to choose from.
    pub fn is_empty(&self) -> bool {
        self.probability.is_empty()
    }

    /// The index that the uniform number `u` in [0, 1) selects, and its probability.
    ///
    /// # Panics
    /// If the distribution is empty.
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32) {
        let i = self.cumulative.partition_point(|c| *c <= f64::from(u)) - 1;
        (i, self.probability[i])
    }

    /// The index that `u` selects, and where in the index's share `u` lies: a uniform number in [0, 1) again.
    ///
    /// # Panics
    /// If the distribution is empty.
    #[inline]
    pub fn sample_rest(&self, u: f32) -> (usize, f32) {
        let (i, p) = self.sample(u);
        let rest = (f64::from(u) - self.cumulative[i]) / f64::from(p);
        (i, (rest as f32).clamp(0.0, 1.0_f32.next_down()))
    }

    /// The probability of index `i`.
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
            let (i, p) = d.sample(k as f32 / n as f32);
            assert_eq!(p, d.probability(i));
            counts[i] += 1;
        }
        assert_eq!(counts, [0, n / 4, 0, 3 * n / 4, 0]);
        assert!(Discrete::new(&[0.0]).is_empty());
    }
}
