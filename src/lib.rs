//! pathspace: a physically based renderer built on the path-space form of the rendering equation.
//!
//! Its one concept is the *path*: a list of vertices p̄ = p_0 p_1 … p_n from the lens to a light, with an area-measure
//! throughput T(p̄) and a geometry term G. Path tracing, light tracing and bidirectional path tracing are tables that
//! say how often each strategy (s,t) samples such paths; [`path`] is the core that they share.
//!
//! # The core in ten minutes
//!
//! A pixel is an integral over paths of every length, I_j = ∫ F_j(p̄) dA(p̄), with the measurement contribution
//! F_j = W_e T L_e h_j. A strategy (s,t) samples s vertices from a light and t from the camera, with the area density
//! p_{s,t}(p̄). A table says that it does so n_{s,t} times, and multiple importance sampling weighs what it finds:
//! I_j ≈ Σ w_{s,t} F_j / (n_{s,t} p_{s,t}).
//!
//! 1. **The definition.** [`path::Path`] holds vertices and computes [T](path::Path::throughput),
//!    [G](path::Path::geometry_term), [F](path::Path::contribution) and [p_{s,t}](path::Path::pdf) from their formulas,
//!    in f64, and stores nothing. The example below uses all four.
//! 2. **What a vertex is.** [`scene::point::Point`] is a place on a surface, on the lens, on a light or at infinity,
//!    and [`path::Vertex`] adds how it scatters. [`path::Edge`] has the cosines, the distance and V between two of
//!    them.
//! 3. **Densities have a measure.** [`sampling::PdfSolidAngle`] becomes [`sampling::PdfArea`] by one line,
//!    [`to_area`](sampling::PdfSolidAngle::to_area): dω = cos θ/r² dA.
//! 4. **The fast form.** [`path::Subpath`] is a random walk that keeps its throughput and both densities of each
//!    vertex; [`path::JoinedPath`] joins two of them, and knows its contribution and its weight without another walk.
//! 5. **The weight.** [`path::mis_weight`] is a sum over the other strategies of ratios of two arrays of densities.
//! 6. **The table.** [`path::Techniques`] holds n_{s,t}. An integrator is a table with a weight rule:
//!    [`integrator::Description`] has one of each kind, and [`integrator::Integrator`] evaluates any of them.
//! 7. **The image.** [`render::Renderer::pass`] takes a sample for each pixel and deposits it in the [`film::Film`],
//!    whose sums are exact, so that the image depends on neither the number of threads nor their order.
//!
//! `tests/transport/identity.rs` holds 1 and 4 together for every path that any integrator finds.
//!
//! # A path by hand
//!
//! ```
//! use glam::{Vec2, Vec3};
//! use pathspace::{
//!     math::Rgb,
//!     path::{Path, Strategy, Vertex},
//!     scene::{
//!         Scene,
//!         camera::{Camera, Sensor},
//!         geometry::{Geometry, PrimitiveId},
//!         material::{Material, MaterialId},
//!     },
//! };
//!
//! // A white floor, and a lamp above it that faces down.
//! let materials = vec![
//!     Material::diffuse("floor", Rgb::splat(0.8)),
//!     Material::diffuse("lamp", Rgb::ZERO).emitting(Rgb::splat(5.0)),
//! ];
//! let mut geometry = Geometry::default();
//! let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
//! geometry.add_triangles(&[at(-4., 0., -4.), at(0., 0., 4.), at(4., 0., -4.)], None, &[[0, 1, 2]], MaterialId(0));
//! geometry.add_triangles(&[at(-1., 2., -1.), at(1., 2., -1.), at(0., 2., 1.)], None, &[[0, 1, 2]], MaterialId(1));
//! let sensor = Sensor { width: 64, height: 48, padding: 0 };
//! let camera = Camera::look_at(at(0., 1., 6.), at(0., 0., 0.), Vec3::Y, 0.7, sensor);
//! let scene = Scene::new(geometry, materials, &[], camera);
//!
//! // p̄ = lens, floor, lamp: light that the lamp sends to the camera by way of the floor.
//! let path = Path::new(&scene, vec![
//!     Vertex::new(scene.camera.lens_point()),
//!     Vertex::new(scene.trace(&scene.camera.lens_point(), at(0., -1., -6.).normalize()).expect("the floor")),
//!     Vertex::new(scene.point_on(PrimitiveId::world(1), Vec2::new(0.4, 0.3))),
//! ]);
//! println!("class {}", path.class());
//! println!("G(p_1, p_2) = {:.4}", path.geometry_term(1));
//! println!("T = {:.4}", path.throughput());
//! println!("F = {:.1}", path.contribution());
//! for t in 1..=3 {
//!     let strategy = Strategy { s: 3 - t, t };
//!     println!("p_{strategy} = {:.5}", path.pdf(strategy));
//! }
//!
//! // The floor is Lambertian, so T = f G = 0.8/π G; and the lamp is chosen and sampled uniformly in (0,2), (1,2) and
//! // (2,1).
//! let expected = 0.8 / std::f64::consts::PI * path.geometry_term(1);
//! assert!((path.throughput().x / expected - 1.0).abs() < 1e-5);
//! assert_eq!(path.class().to_string(), "CDL");
//! assert!((1..=3).all(|t| path.pdf(Strategy { s: 3 - t, t }) > 0.0));
//! ```

pub mod choice;
pub mod compare;
pub mod converge;
#[cfg(feature = "denoise")]
pub mod denoise;
pub mod film;
pub mod integrator;
pub mod io;
pub mod lanes;
pub mod layers;
pub mod math;
pub mod path;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod statistics;
mod text;
pub mod trace;
pub mod verify;
