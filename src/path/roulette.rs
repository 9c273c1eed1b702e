//! Russian roulette along walks.

/// When Russian roulette may end a walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Roulette {
    /// Never: only the table's length ends a walk.
    Off,
    /// At vertices with this many edges behind them, and later, a walk survives with the probability of what the step
    /// keeps, f̂|cos θ|/p · η²: the lecture's 1 − ρ ends it.
    FromDepth(u32),
    /// The same from there on, with the probability of what the walk has kept since its first edge.
    ByThroughput(u32),
}

impl Roulette {
    /// No step is surer to be survived, so that nothing walks forever.
    pub(super) const SUREST: f32 = 0.95;
}

impl Default for Roulette {
    /// From four edges on.
    fn default() -> Self {
        Self::FromDepth(4)
    }
}
