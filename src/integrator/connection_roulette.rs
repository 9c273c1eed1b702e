//! Russian roulette on connections, before their ray (lecture, *Russian roulette*): what would contribute less than a
//! threshold, were nothing in the way, is looked at with a probability only, and counts for the rest.

/// The rule with an absolute threshold, as an [`Integrator`](super::Integrator) plays it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConnectionRoulette {
    /// A weighted contribution to a pixel, w F/(n p) with V = 1, luminance: a radiance.
    pub threshold: f32,
    /// The probability to end what contributes less, in [0, 1).
    pub end: f32,
}

/// The rule with a threshold that suits any scene, as a person gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeRoulette {
    /// In units of [`Scene::spread_radiance`](crate::scene::Scene::spread_radiance).
    pub threshold: f32,
    /// The probability to end what contributes less, in [0, 1).
    pub end: f32,
}

impl RelativeRoulette {
    /// The rule in a scene whose spread radiance is `unit`.
    pub fn with_unit(self, unit: f64) -> ConnectionRoulette {
        ConnectionRoulette { threshold: (f64::from(self.threshold) * unit) as f32, end: self.end }
    }
}
