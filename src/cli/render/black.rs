//! Why no light arrived in an image that is black all over.

use pathspace::{
    render::{Renderer, Settings},
    scene::Scene,
};

/// Where rays go, and what is kept of what they find.
pub struct Black<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    /// The expression of `--paths`.
    pub kept: Option<&'a str>,
}

impl Black<'_> {
    /// The likeliest reason, as a clause, and what to do; `None` if the image is not black, or has no samples.
    pub fn why(&self, renderer: &Renderer<'_>) -> Option<String> {
        let Self { scene, settings, kept } = self;
        let statistics = renderer.statistics();
        if renderer.passes() == 0 || !renderer.film().is_black() {
            return None;
        }
        let paths = renderer.film().crop().pixels() * u64::from(renderer.passes());
        Some(if scene.lights().peak_radiance() <= 0.0 {
            "nothing in the scene emits light".to_owned()
        } else if !renderer.film().errors().is_empty() || !statistics.rejected.is_empty() {
            "every contribution had to be left out".to_owned()
        } else if let Some(kept) = kept {
            format!("no path that --paths '{kept}' keeps was found")
        } else if let Some((strategy, _)) = settings.only {
            format!("the strategy ({},{}) alone found no path", strategy.s, strategy.t)
        } else if settings.integrator.has(|x| x.t == 1) && !settings.integrator.has(|x| x.t >= 2) {
            let bounds = scene.geometry().bounds();
            let size = bounds.map_or(0.0, |b| (b.max - b.min).length());
            let lost =
                if statistics.rays.visibility == 0 { "met a surface in the image" } else { "reached the camera" };
            format!(
                "no path from the lights {lost}, and they spread over a scene {size:.0} m across: -i path walks from \
                 the camera"
            )
        } else if settings.max_depth < 2 {
            "the camera sees no light directly, and --max-depth 1 leaves out what lights illuminate".to_owned()
        } else {
            format!("{paths} paths from the camera of at most {} edges met no light", settings.max_depth)
        })
    }
}
