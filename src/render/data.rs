//! What the camera sees besides light: the layers that denoisers and compositors ask for.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::{Pixel, Renderer};
use crate::{
    math::Rgb,
    sampling::{Block, Independent, Sampler, SamplerKind, Sobol},
    scene::{camera::Raster, point::Point},
};

/// Means over the camera samples of each pixel that meet a surface, row after row in the crop; zero where none does.
#[derive(Clone, Debug, Default)]
pub struct Data {
    /// How many of the samples meet a surface, in [0, 1].
    pub hits: Vec<f32>,
    /// The colour of the surface: what it reflects and transmits, or of a metal reflects head-on, in [0, 1].
    pub albedo: Vec<Rgb>,
    /// N_s, on the side of N_g; a mean of unit vectors.
    pub shading_normal: Vec<Vec3>,
    /// N_g.
    pub normal: Vec<Vec3>,
    /// In the coordinates of the file, metres.
    pub position: Vec<Vec3>,
    /// Along the camera's axis, metres.
    pub depth: Vec<f32>,
    /// One more than the number of the material that the first sample meets, in the order of the scene's materials; 0
    /// for none.
    pub material: Vec<u32>,
    /// One more than the number of the primitive within its mesh or the world, likewise.
    pub primitive: Vec<u32>,
    /// One more than the number of the instance, 0 for the world.
    pub instance: Vec<u32>,
}

/// Samples of each pixel that the means are over at most. They vary little, and each costs a ray of its own.
const MOST_SAMPLES: u32 = 64;

/// The sums of one pixel.
#[derive(Clone, Copy, Default)]
struct Seen {
    samples: u32,
    hits: u32,
    albedo: DVec3,
    shading_normal: DVec3,
    normal: DVec3,
    position: DVec3,
    depth: f64,
    /// Material, primitive and instance.
    first: Option<[u32; 3]>,
}

impl Renderer<'_> {
    /// The data of the passes so far, or of the first 64 of them: of the same places as the camera subpaths', and of
    /// the points where these would first scatter. A surface with α < ½ is looked through. Pixels have only their own
    /// samples, whatever the filter.
    ///
    /// It depends on the scene, the settings and the passes alone, and is made when asked for.
    pub fn data(&self) -> Data {
        let crop = self.settings.crop;
        let pixels =
            (crop.y0..crop.y1).flat_map(|y| (crop.x0..crop.x1).map(move |x| Pixel { x: x as i32, y: y as i32 }));
        let pixels: Vec<_> = pixels.collect();
        let of_pixel = |pixel: &Pixel| match self.settings.sampler {
            SamplerKind::Independent => self.seen_by::<Independent>(*pixel),
            SamplerKind::Sobol => self.seen_by::<Sobol>(*pixel),
        };
        let all: Vec<Seen> = pixels.par_iter().map(of_pixel).collect();
        let mean = |s: &Seen, sum: DVec3| sum / f64::from(s.hits.max(1));
        let mean_normal = |of: fn(&Seen) -> DVec3| all.iter().map(|s| mean(s, of(s)).as_vec3()).collect();
        let id = |i: usize| all.iter().map(|s| s.first.map_or(0, |ids| ids[i])).collect();
        Data {
            hits: all.iter().map(|s| s.hits as f32 / s.samples.max(1) as f32).collect(),
            albedo: all.iter().map(|s| mean(s, s.albedo).into()).collect(),
            shading_normal: mean_normal(|s| s.shading_normal),
            normal: mean_normal(|s| s.normal),
            position: self.positions(&all),
            depth: all.iter().map(|s| (s.depth / f64::from(s.hits.max(1))) as f32).collect(),
            material: id(0),
            primitive: id(1),
            instance: id(2),
        }
    }

    /// The mean places in the file's coordinates, rounded once.
    fn positions(&self, all: &[Seen]) -> Vec<Vec3> {
        let one = |s: &Seen| match s.hits {
            0 => Vec3::ZERO,
            hits => (self.scene.centre + s.position / f64::from(hits)).as_vec3(),
        };
        all.iter().map(one).collect()
    }

    fn seen_by<S: Sampler>(&self, pixel: Pixel) -> Seen {
        let camera = &self.scene.camera;
        let mut sums = Seen::default();
        for pass in self.passes.clone().take(MOST_SAMPLES as usize) {
            let [mut sampler, ..] = S::streams(self.settings.seed, pixel.key(), pass);
            sampler.start(Block::START);
            let raster = Raster(pixel.corner() + sampler.next_2d());
            let lens = camera.sample_lens(raster, if camera.has_aperture() { sampler.next_2d() } else { Vec2::ZERO });
            let w = camera.direction(&lens, raster);
            let seen = self.scene.trace_from_camera(lens.ray_origin(w), w, lens.primitive, |alpha| alpha >= 0.5);
            sums.samples += 1;
            if let Some(hit) = seen.hit {
                let point = self.scene.point_at(&seen.ray, &hit);
                sums.add(&point, camera.depth(point.position));
            }
        }
        sums
    }
}

impl Seen {
    fn add(&mut self, p: &Point, depth: f32) {
        self.hits += 1;
        self.albedo += p.bsdf.color().as_dvec3();
        self.shading_normal += p.shading_normal.as_dvec3();
        self.normal += p.normal.as_dvec3();
        self.position += p.position.as_dvec3();
        self.depth += f64::from(depth);
        let instance = p.primitive.instance().map_or(0, |number| number + 1);
        self.first.get_or_insert([p.material.0 + 1, p.primitive.index() + 1, instance]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        integrator::IntegratorKind,
        render::Settings,
        scene::{
            Scene,
            camera::{Camera, Sensor},
            geometry::Geometry,
            material::{Material, MaterialId},
        },
    };

    /// A red floor at y = 0 that fills the image's lower half up to the horizon, seen from one metre above it.
    fn floor() -> Scene {
        let mut geometry = Geometry::default();
        let far = 1e4;
        let corners = [
            Vec3::new(-far, 0.0, far),
            Vec3::new(far, 0.0, far),
            Vec3::new(far, 0.0, -far),
            Vec3::new(-far, 0.0, -far),
        ];
        geometry.add_triangles(&corners, None, &[[0, 1, 2], [0, 2, 3]], MaterialId(1));
        let materials = vec![Material::diffuse("none", Rgb::ONE), Material::diffuse("red", Rgb::new(0.8, 0.1, 0.2))];
        let camera = Camera::look_at(
            Vec3::Y,
            Vec3::new(0.0, 1.0, -1.0),
            Vec3::Y,
            std::f32::consts::FRAC_PI_2,
            Sensor { width: 16, height: 16, padding: 0 },
        );
        Scene::new(geometry, materials, &[], camera)
    }

    /// Of every integrator and sampler, on a plane that can be worked out by hand.
    #[test]
    fn a_floor_is_where_it_is_and_as_it_is() {
        let scene = floor();
        let kinds =
            [(IntegratorKind::Path, SamplerKind::Sobol, 0.02), (IntegratorKind::Light, SamplerKind::Independent, 0.12)];
        for (integrator, sampler, tolerance) in kinds {
            let settings = Settings { integrator, sampler, ..Settings::new(scene.camera.sensor()) };
            let mut renderer = Renderer::new(&scene, &settings);
            (0..64).for_each(|_| renderer.pass());
            let data = renderer.data();
            for (pixel, hits) in data.hits.iter().enumerate() {
                let row = pixel / 16;
                if row == 8 {
                    continue; // some rays pass the end of the floor
                }
                if row < 8 {
                    assert_eq!((*hits, data.material[pixel], data.depth[pixel]), (0.0, 0, 0.0), "row {row} is sky");
                    continue;
                }
                assert_eq!((*hits, data.material[pixel], data.instance[pixel]), (1.0, 2, 0), "row {row}");
                assert!((1..=2).contains(&data.primitive[pixel]));
                assert!((data.albedo[pixel] - Rgb::new(0.8, 0.1, 0.2)).abs().element_sum() < 1e-6);
                assert_eq!((data.normal[pixel], data.shading_normal[pixel]), (Vec3::Y, Vec3::Y));
                assert!(data.position[pixel].y.abs() < 1e-5);
                // A ray through y on a film from −1 to 1 meets the floor at depth 1/y: the mean over the row is
                // ln(b/a)/(b − a).
                let (a, b) = (f64::from(row as u32 - 8) / 8.0, f64::from(row as u32 - 7) / 8.0);
                let depth = f64::from(data.depth[pixel]);
                assert!((depth / ((b / a).ln() / (b - a)) - 1.0).abs() < tolerance, "row {row}: {depth}");
                assert!((f64::from(data.position[pixel].z) + depth).abs() < 1e-3 * depth);
            }
        }
    }
}
