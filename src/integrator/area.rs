//! Area sampling (lecture: one does not even need to sample the vertices sequentially): p_1 … p_{n−1} drawn
//! independently and uniformly over the area of all surfaces, p_n over that of all emitting ones, p_0 over the lens.
//!
//! An oracle, slow and simple: it uses F_j, V on every edge and area densities, and nothing of what walks, connections
//! and weights use. Where surfaces touch, its variance is infinite (∫G² diverges): compare it in scenes whose surfaces
//! do not. As the definition does, it takes memory for each path.

use glam::DVec3;

use super::description::{Description, Landing, LightSampling, Merges, Table, Weights};
use crate::{
    path::{Edge, Heuristic, JoinedPath, Path, Roulette, Step, Vertex},
    sampling::{Block, Sampler, SamplerKind},
    scene::{Scene, wavelength::Wavelength},
};

/// What it is.
pub const DESCRIPTION: Description = Description {
    name: "area",
    what: "Area sampling: every vertex is drawn on its own.",
    coverage: "paths of at most four edges from emitting surfaces without a specular vertex; other lights stay dark, \
        and mirrors and glass black",
    table: Table::Area,
    merges: Merges::No,
    heuristic: Heuristic::Power,
    weights: Weights::Plain,
    roulette: Roulette::FromDepth(4),
    sampler: SamplerKind::Independent,
    light_sampling: LightSampling::Power,
    landing: Landing::Anywhere,
    longest_path: MAX_EDGES,
};

/// The longest paths, in edges. Each edge multiplies the variance.
pub const MAX_EDGES: u32 = 4;

/// Draws a path of `n` edges; `None` if it contributes nothing. `steps` is storage.
pub fn draw<'a>(
    scene: &'a Scene,
    n: u32,
    steps: &'a mut Vec<Step>,
    sampler: &mut impl Sampler,
    wavelength: Option<Wavelength>,
) -> Option<JoinedPath<'a>> {
    let mut vertices = vec![Vertex::new(scene.camera.lens_point())];
    for i in 1..=n {
        let areas = if i < n { scene.surfaces() } else { scene.emitters() };
        sampler.start(Block::joint(n * (n + 1) / 2 + i));
        vertices.push(Vertex::new(areas.sample(scene, sampler.next_2d(), sampler.next_choice())?));
    }
    sampler.start(Block::joint(n * (n + 1) / 2));
    vertices[0] = Vertex::new(scene.camera.sample_lens_towards(&vertices[1].point, sampler.next_2d())?);
    let first = Edge::between(&vertices[0].point, &vertices[1].point);
    let raster = scene.camera.raster(&vertices[0].point, first.direction)?;

    let unoccluded = Path::new(scene, vertices).at_wavelength(wavelength);
    // What could not pass anyway needs no rays.
    if unoccluded.contribution() == DVec3::ZERO {
        return None;
    }
    let visible = |(i, pair): (usize, &[Vertex])| {
        let (a, b) = (&pair[0].point, &pair[1].point);
        f64::from(if i == 0 { scene.visible_from_camera(a, b) } else { scene.visible(a, b) })
    };
    let visibility: Vec<_> = unoccluded.vertices().windows(2).enumerate().map(visible).collect();
    if visibility.contains(&0.0) {
        return None;
    }
    JoinedPath::by_areas(scene, &unoccluded.with_visibility(visibility), steps, raster)
}
