//! Where a textured surface emits: for each triangle a density over its area in proportion to its emission.

use glam::Vec2;

use super::super::{
    geometry::{Geometry, PrimitiveId},
    material::{Maps, Material},
};
use crate::{
    math::{Rgb, luminance},
    sampling::{Discrete, Remainder, Square, warp},
};

/// The share of the samples that is uniform in area, wherever the texture is bright: the density is positive wherever
/// anything is emitted, also where the cells' means do not see it.
const UNIFORM: f32 = 0.1;

/// How finely each of a scene's textured emissive triangles is looked at, so that all of them together take neither
/// long nor much memory: at most a million cells and 16 million lookups, about a second.
#[derive(Clone, Copy, Debug)]
pub struct Detail {
    /// The most cells along an edge of a triangle.
    cells: u32,
    /// The most lookups along an edge.
    lookups: u32,
}

impl Detail {
    /// For so many triangles.
    pub fn among(triangles: usize) -> Self {
        let share = |total: f64| (total / triangles.max(1) as f64).sqrt() as u32;
        Self { cells: share(1e6).clamp(1, 64), lookups: share(16e6).clamp(2, 2048) }
    }
}

/// The emission of a triangle over its area, piecewise constant on n² congruent cells.
///
/// Densities are relative to the uniform one: 1 where they equal 1/area.
#[derive(Clone, Debug)]
pub struct EmissionMap {
    n: u32,
    /// `None` where every cell emits the same.
    cells: Option<Discrete>,
    mean: Rgb,
    peak: f32,
}

impl EmissionMap {
    /// The emission of `primitive`, whose material is `material`; `None` if nothing is emitted anywhere on it.
    pub fn new(
        geometry: &Geometry,
        primitive: PrimitiveId,
        material: &Material,
        maps: &Maps,
        detail: Detail,
    ) -> Option<Self> {
        let brightest = material.emission * bound(geometry, primitive, maps);
        let peak = brightest.max_element();
        if peak <= 0.0 {
            return None;
        }
        let at = |b: Vec2| material.emission * maps.emission(&geometry.attributes(primitive, b));
        let texels = footprint(geometry, primitive, maps);
        let n = (texels.ceil() as u32).clamp(1, detail.cells);
        let m = (texels.min(detail.lookups as f32) / n as f32).ceil().max(2.0) as u32;
        let mut sum = Rgb::ZERO;
        let means: Vec<f32> = (0..n * n)
            .map(|cell| {
                let inner = |k| Cell::of(k, m).point(Vec2::splat(1.0 / 3.0), m);
                let mean = (0..m * m).map(|k| at(Cell::of(cell, n).point(inner(k), n))).sum::<Rgb>() / (m * m) as f32;
                sum += mean;
                luminance(mean)
            })
            .collect();
        // What the lookups miss altogether still has to be chosen now and then.
        let mean = (sum / (n * n) as f32).max(brightest * 1e-3);
        let average = means.iter().sum::<f32>() / means.len() as f32;
        let same = means.iter().all(|w| (w - average).abs() <= 1e-3 * average);
        let weight = |w: &f32| if average > 0.0 { (1.0 - UNIFORM) * w / average + UNIFORM } else { 1.0 };
        let weights: Vec<_> = means.iter().map(|w| f64::from(weight(w))).collect();
        Some(Self { n, cells: (!same).then(|| Discrete::new(&weights)), mean, peak })
    }

    /// The mean of L_e over the triangle, for the choice among lights.
    pub fn mean(&self) -> Rgb {
        self.mean
    }

    /// A bound on every channel of L_e over the triangle.
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// Barycentric coordinates (of the second and third corner) with density [`EmissionMap::density`]. `rest` is what
    /// the choice of the triangle has left.
    #[inline]
    pub fn sample(&self, u: Square, rest: Remainder) -> Vec2 {
        let Some(cells) = &self.cells else { return warp::triangle(u.place().to_array()).into() };
        let [x, _] = u.refined(rest.rest());
        let (cell, place) = cells.sample(x);
        Cell::of(cell as u32, self.n).point(warp::triangle([place.rest().unit(), u.place().y]).into(), self.n)
    }

    /// The density at these barycentric coordinates, over that of a uniform choice.
    #[inline]
    pub fn density(&self, b: Vec2) -> f32 {
        let Some(cells) = &self.cells else { return 1.0 };
        let probability = cells.probability(Cell::around(b, self.n).index(self.n) as usize);
        probability * (self.n * self.n) as f32
    }
}

/// One of the n² congruent triangles: in row j the i-th that stands like the whole, or (`turned`) the one across from
/// its long side.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    i: u32,
    j: u32,
    turned: bool,
}

impl Cell {
    /// Row j has 2(n − j) − 1 cells, so the rows before it have j(2n − j).
    #[inline]
    fn of(index: u32, n: u32) -> Self {
        let left = (n * n - index) as f32;
        // The largest j with j(2n − j) ≤ index, that is (n − j)² ≥ n² − index.
        let mut j = n - (left.sqrt().ceil() as u32).min(n);
        while (j + 1) * (2 * n - j - 1) <= index {
            j += 1;
        }
        while j * (2 * n - j) > index {
            j -= 1;
        }
        let k = index - j * (2 * n - j);
        Self { i: k / 2, j, turned: k % 2 == 1 }
    }

    #[inline]
    fn index(self, n: u32) -> u32 {
        self.j * (2 * n - self.j) + 2 * self.i + u32::from(self.turned)
    }

    /// The cell that contains the barycentric coordinates `b`, rounding allowed for.
    #[inline]
    fn around(b: Vec2, n: u32) -> Self {
        let p = b * n as f32;
        let j = (p.y as u32).min(n - 1);
        let i = (p.x as u32).min(n - 1 - j);
        let turned = (p.x - i as f32) + (p.y - j as f32) > 1.0 && i + j + 1 < n;
        Self { i, j, turned }
    }

    /// The point of the triangle with coordinates `c` within this cell.
    #[inline]
    fn point(self, c: Vec2, n: u32) -> Vec2 {
        let corner = Vec2::new(self.i as f32, self.j as f32);
        (if self.turned { corner + 1.0 - c } else { corner + c }) / n as f32
    }
}

/// How many texels long the triangle is in its emission's texture: the square root of twice the area that it takes
/// there, and at least half its longest side, since a sliver varies along itself too.
fn footprint(geometry: &Geometry, primitive: PrimitiveId, maps: &Maps) -> f32 {
    let Some(texture) = &maps.emission else { return 4.0 };
    let (width, height) = texture.image.size();
    let size = Vec2::new(width as f32, height as f32);
    let corner = |b| texture.transform.transform_point2(geometry.attributes(primitive, b).uv(texture.uv_set)) * size;
    let [a, b, c] = [Vec2::ZERO, Vec2::X, Vec2::Y].map(corner);
    let longest = [b - a, c - b, a - c].map(Vec2::length).into_iter().fold(0.0, f32::max);
    let area = (b - a).perp_dot(c - a).abs();
    let length = area.sqrt().max(0.5 * longest);
    if length.is_finite() { length.max(1.0) } else { 1.0 }
}

/// Bounds on what the emission's channels are multiplied by anywhere on the triangle; 0 only for one that is 0
/// everywhere.
fn bound(geometry: &Geometry, primitive: PrimitiveId, maps: &Maps) -> Rgb {
    let Some(texture) = &maps.emission else { return Rgb::ONE };
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y].map(|b| geometry.attributes(primitive, b).uv(texture.uv_set));
    texture.bound(corners).into()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::sampling::Choice;
    use crate::scene::{
        geometry::Attributes,
        material::{MaterialId, Parameters},
        texture::{Encoding, Filter, Image, Texels, Texture},
    };

    const BLACK: Parameters = Parameters { base_color: Rgb::ZERO, ..Parameters::LAMBERT };

    /// A right triangle over the lower left half of a grey image of `side`² texels, emitting 2 where it is white.
    fn triangle(side: u32, texels: Vec<u8>) -> (Geometry, Material) {
        let mut geometry = Geometry::default();
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let uv = corners.map(Vec3::truncate).to_vec();
        let attributes = Attributes { uv: [uv, vec![], vec![], vec![]], ..Attributes::default() };
        geometry.add_triangles_with(&corners, None, &attributes, &[[0, 1, 2]], MaterialId(0));
        let image = Arc::new(Image::new(side, side, Texels::U8(texels)));
        let mut maps = Maps::new(BLACK);
        maps.emission = Some(Texture { filter: Filter::Nearest, ..Texture::new(image, Encoding::Linear) });
        (geometry, Material::varying("lamp", maps).emitting(Rgb::splat(2.0)))
    }

    fn map_of((geometry, material): &(Geometry, Material), detail: Detail) -> Option<EmissionMap> {
        let maps = material.maps.as_ref().unwrap();
        EmissionMap::new(geometry, PrimitiveId::world(0), material, maps, detail)
    }

    /// A chessboard of four by four fields with a spot twice as bright.
    fn board() -> (Geometry, Material) {
        let field = |i: u32| {
            if i == 4 {
                255
            } else if (i % 4 + i / 4).is_multiple_of(2) {
                128
            } else {
                0
            }
        };
        triangle(4, (0..16).map(field).collect())
    }

    #[test]
    fn cells_are_numbered_row_by_row_and_found_again() {
        for n in [1, 2, 3, 7, 64] {
            for index in 0..n * n {
                let cell = Cell::of(index, n);
                assert_eq!(cell.index(n), index, "{cell:?} of {n}");
                for c in [Vec2::splat(1.0 / 3.0), Vec2::new(0.9, 0.05), Vec2::new(0.02, 0.03)] {
                    let b = cell.point(c, n);
                    assert!(b.min_element() >= 0.0 && b.element_sum() <= 1.0, "{b}");
                    assert_eq!(Cell::around(b, n), cell, "{b} of {n}");
                }
            }
            // Corners, and what rounding puts just outside.
            for b in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::splat(0.500_001), Vec2::new(1.000_001, -1e-7)] {
                assert!(Cell::around(b, n).index(n) < n * n, "{b} of {n}");
            }
        }
    }

    #[test]
    fn densities_integrate_to_one_and_follow_the_emission() {
        let scene = board();
        let map = map_of(&scene, Detail::among(1)).unwrap();
        let n = 512;
        let (mut integral, mut mean) = (0.0_f64, Rgb::ZERO);
        let material = &scene.1;
        for cell in 0..n * n {
            let b = Cell::of(cell, n).point(Vec2::splat(1.0 / 3.0), n);
            let emission =
                2.0 * material.maps.as_ref().unwrap().emission(&scene.0.attributes(PrimitiveId::world(0), b));
            let density = map.density(b);
            assert!(density >= 0.99 * UNIFORM, "{density} at {b}");
            integral += f64::from(density);
            mean += emission;
        }
        integral /= f64::from(n * n);
        mean /= (n * n) as f32;
        assert!((integral - 1.0).abs() < 1e-5, "{integral}");
        assert!((map.mean() - mean).abs().max_element() < 0.01 * mean.r(), "{} for {mean}", map.mean());
        // Texel 4 is the first of the second row: u in [0, 1/4], v in [1/4, 1/2]; it emits 2.
        let bright = map.density(Vec2::new(0.12, 0.37));
        let expected = (1.0 - UNIFORM) * 2.0 / mean.r() + UNIFORM;
        assert!((bright - expected).abs() < 0.02 * expected, "{bright} for {expected}");
        assert_eq!(map.peak(), 2.0);
    }

    #[test]
    fn samples_follow_the_density() {
        let map = map_of(&board(), Detail::among(1)).unwrap();
        const BINS: u32 = 8;
        let (n, mut found) = (1_u32 << 18, vec![0_u32; (BINS * BINS) as usize]);
        for i in 0..n {
            let golden = (f64::from(i) * 0.618_033_988_749_895).fract() as f32;
            let u = Vec2::new((i as f32 + 0.5) / n as f32, golden);
            let b = map.sample(u.into(), Choice::new(0).whole());
            assert!(map.density(b) > 0.0);
            found[Cell::around(b, BINS).index(BINS) as usize] += 1;
        }
        let fine = 64;
        let mut expected = vec![0.0_f64; (BINS * BINS) as usize];
        for cell in 0..fine * fine {
            let b = Cell::of(cell, fine).point(Vec2::splat(1.0 / 3.0), fine);
            let share = f64::from(map.density(b)) / f64::from(fine * fine);
            expected[Cell::around(b, BINS).index(BINS) as usize] += share * f64::from(n);
        }
        // Regular numbers: less than the noise of independent ones, whose σ is √expected.
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((f64::from(found) - expected).abs() < 3.0 * expected.sqrt() + 1.0, "{found} for {expected}");
        }
    }

    #[test]
    fn black_triangles_are_no_lights_and_even_ones_need_no_cells() {
        assert!(map_of(&triangle(2, vec![0; 4]), Detail::among(1)).is_none());
        let even = map_of(&triangle(2, vec![51; 4]), Detail::among(1)).unwrap();
        assert!(even.cells.is_none() && (even.mean() - Rgb::splat(0.4)).abs().max_element() < 1e-5, "{even:?}");
        // One texel in a million, and a single lookup that misses it: still a light, with a positive density
        // everywhere.
        let mut texels = vec![0; 1 << 20];
        texels[300 * 1024 + 200] = 255;
        let rare = map_of(&triangle(1024, texels), Detail::among(usize::MAX)).unwrap();
        assert!(rare.mean().min_element() > 0.0 && rare.density(Vec2::new(0.2, 0.3)) > 0.0);
    }

    #[test]
    fn detail_is_shared_among_the_triangles() {
        for n in [0, 1, 100, 1_000_000, 100_000_000] {
            let Detail { cells, lookups } = Detail::among(n);
            assert!(cells >= 1 && lookups >= 2 && n as f64 * f64::from(cells).powi(2) <= 1e6_f64.max(n as f64));
        }
    }
}
