//! How much of a surface is there: by its material, and by what coincides with it.

use glam::Vec3;

use super::{
    geometry::{Geometry, Hit, PrimitiveId},
    material::Material,
};

/// A product of factors in [0, 1], the same to the last bit in whatever order they come. Trees show the surfaces on a
/// segment in any order, and an image must not depend on the tree; floats that are multiplied one by one would.
///
/// The sum of the factors' logarithms, in fixed point: a factor alone comes out as it went in, and each of several adds
/// an error of 10⁻¹² at most.
#[derive(Clone, Copy)]
pub(super) struct Product {
    /// How often 1 is halved, in units of 2⁻⁴⁰. What a sum cannot hold is 0 anyway.
    halvings: u64,
}

impl Product {
    /// Of no factors.
    pub const ONE: Self = Self { halvings: 0 };

    const UNIT: u64 = 1 << 40;

    /// Multiplies it by another factor.
    #[inline]
    pub fn times(&mut self, factor: f32) {
        // The logarithm of 0 is −∞, and becomes the largest sum.
        let halvings = (-f64::from(factor).log2() * Self::UNIT as f64).round() as u64;
        self.halvings = self.halvings.saturating_add(halvings);
    }

    /// Whether nothing is left, and never will be.
    #[inline]
    pub fn is_zero(self) -> bool {
        // Half of the smallest number that f32 has.
        self.halvings >= 150 * Self::UNIT
    }

    #[inline]
    pub fn value(self) -> f32 {
        (-(self.halvings as f64) / Self::UNIT as f64).exp2() as f32
    }
}

/// The part of the place that the coincident surfaces of a lower rank leave to `primitive`: the product of their 1 − α.
#[inline(never)]
pub(super) fn left_by_others(
    geometry: &Geometry,
    materials: &[Material],
    primitive: PrimitiveId,
    position: Vec3,
) -> f32 {
    if !geometry.may_be_hidden_at(primitive, position) {
        return 1.0;
    }
    let mut left = Product::ONE;
    let rank = geometry.rank(primitive);
    geometry.coincident_at(primitive, position, |hit| {
        if geometry.rank(hit.primitive) < rank {
            left.times(1.0 - alpha(geometry, materials, &hit));
        }
    });
    left.value()
}

/// α in [0, 1] of the material where a ray hits, whatever coincides there.
#[inline]
pub(super) fn alpha(geometry: &Geometry, materials: &[Material], hit: &Hit) -> f32 {
    let material = &materials[geometry.material(hit.primitive).0 as usize];
    material.alpha(|| geometry.attributes(hit.primitive, hit.barycentric))
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    use super::*;
    use crate::{
        math::Rgb,
        scene::{
            Scene,
            camera::{Camera, Sensor},
            geometry::{BuildEffort, MaterialId},
            material::AlphaMode,
            point::Point,
        },
    };

    fn product(factors: &[f32]) -> f32 {
        let mut product = Product::ONE;
        factors.iter().for_each(|factor| product.times(*factor));
        assert_eq!(product.is_zero(), product.value() == 0.0, "{factors:?}");
        product.value()
    }

    #[test]
    fn a_product_is_that_of_its_factors_in_any_order() {
        let mut r = StdRng::seed_from_u64(1);
        let edges = [0.0, 1.0, f32::MIN_POSITIVE, f32::from_bits(1), f32::EPSILON / 2.0, 1.0 - f32::EPSILON / 2.0];
        for factor in edges.into_iter().chain((0..10_000).map(|_| r.random::<f32>())) {
            assert_eq!(product(&[factor]), factor);
            assert_eq!(product(&[factor, 1.0, 1.0]), factor);
            assert_eq!(product(&[factor, 0.0]), 0.0);
            assert_eq!(product(&[0.25; 3]) * factor, product(&[0.25, 0.25, factor, 0.25]));
        }
        for n in [2, 3, 8, 60, 2000] {
            let mut factors: Vec<_> = (0..n).map(|_| r.random::<f32>().powf(8.0 / n as f32)).collect();
            let (first, expected) = (product(&factors), factors.iter().map(|f| f64::from(*f)).product::<f64>());
            assert!((f64::from(first) / expected - 1.0).abs() < 1e-7, "{n}: {first} instead of {expected}");
            for _ in 0..20 {
                factors.rotate_left(r.random_range(0..n));
                factors.swap(0, r.random_range(0..n));
                assert_eq!(product(&factors).to_bits(), first.to_bits(), "{n}");
            }
        }
        assert_eq!(product(&[1e-30; 400_000]), 0.0);
    }

    /// Nine crumpled layers across the z axis, each of another α; the last five may `coincide`.
    fn layered(effort: BuildEffort, coincide: bool) -> Scene {
        const SIDE: u32 = 12;
        let mut r = StdRng::seed_from_u64(7);
        let mut g = Geometry::default();
        let mut corners = Vec::new();
        let grid = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| SIDE * y + x));
        let faces: Vec<_> = grid.flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]]).collect();
        for layer in 0..9 {
            if layer < 5 || !coincide {
                let place = |i: u32| {
                    let (x, y) = (i % SIDE, i / SIDE);
                    Vec3::new(x as f32 - 5.5, y as f32 - 5.5, 2.0 * layer as f32 + 0.5 * r.random::<f32>())
                };
                corners = (0..SIDE * SIDE).map(place).collect();
            }
            g.add_triangles(&corners, None, &faces, MaterialId(layer));
        }
        g.set_effort(effort);
        let veil = |factor| Material::diffuse("veil", Rgb::ONE).covering(AlphaMode::Blend { factor });
        let materials = [0.3, 0.07, 0.613, 0.111, 0.429, 0.83, 0.271, 0.55, 0.19].map(veil).to_vec();
        let sensor = Sensor { width: 1, height: 1, padding: 0 };
        Scene::new(g, materials, &[], Camera::look_at(Vec3::ZERO, Vec3::Z, Vec3::Y, 1.0, sensor))
    }

    #[test]
    fn what_several_layers_let_pass_does_not_depend_on_the_tree() {
        for coincide in [false, true] {
            let [fast, best] = BuildEffort::ALL.map(|effort| layered(effort, coincide));
            assert_eq!(fast.geometry().has_coincident(), coincide);
            let mut r = StdRng::seed_from_u64(8);
            let mut through_all = 0;
            for _ in 0..4000 {
                let mut end =
                    |z: f32| Point::nowhere(Vec3::new(r.random::<f32>() - 0.5, r.random::<f32>() - 0.5, z) * 8.0);
                let (a, b) = (end(-0.2), end(2.2));
                let [v, w] = [&fast, &best].map(|scene| scene.visible(&a, &b));
                assert_eq!(v.to_bits(), w.to_bits(), "{} {}", a.position, b.position);
                through_all += u32::from(v < 0.02);
            }
            assert!(through_all > 1000, "{through_all}");
            let last = fast.geometry().world_len() - 1;
            for _ in 0..1000 {
                let u = Vec2::new(r.random(), r.random());
                let [p, q] = [&fast, &best].map(|scene| scene.point_on(PrimitiveId::world(last), u).alpha);
                assert_eq!(p.to_bits(), q.to_bits());
            }
        }
    }
}
