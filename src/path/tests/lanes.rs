//! Surfaces in lanes against each of them alone: the same bits.

use glam::{Quat, Vec3};

use super::super::scattering::Surfaces;
use crate::{
    lanes::{Arrays, Float, Lanes, Mask, Vector},
    math::Rgb,
    sampling::{Independent, Sampler, Stream, warp},
    scene::{
        bsdf::{
            Bsdf, Bsdfs, Dielectric, Diffuse, Directions, Kind, Lobe, MetallicRoughness, Scatter, ThinDielectric,
            Transport,
        },
        point::{Place, Point},
    },
};

const N: usize = 8;
type InLanes = Arrays<N>;

/// How many kinds there are in lanes.
const KINDS: usize = Kind::ALL.len();

/// As many of one kind as there are lanes; the last kind is any. Others in each of some rounds.
fn bsdfs(kind: usize, round: usize) -> [Bsdf; N] {
    std::array::from_fn(|k| {
        let k = k + N * (round % 5);
        let color = [Rgb::ONE, Rgb::new(0.9, 0.5, 0.0), Rgb::ZERO, Rgb::splat(0.4)][k % 4];
        let ior = [1.5, 0.7, 1.000_05, 1.0, 2.4][k % 5];
        let (alpha, fraction) = ([0.0, 0.2, 1.01e-3, 0.7, 1.0][k % 5], [0.5, 0.0, 1.0][k % 3]);
        match if kind == KINDS { (k + round) % 8 } else { kind } {
            0 => Bsdf::Diffuse(Diffuse { albedo: color }),
            1 => Bsdf::Dielectric(Dielectric { color, ior, alpha: 0.0, transmission: 1.0 }),
            2 => Bsdf::Thin(ThinDielectric { color, ior, alpha: 0.0, transmission: 1.0 }),
            3 => Bsdf::MetallicRoughness(MetallicRoughness::metal(color, 0.0)),
            4 => Bsdf::MetallicRoughness(MetallicRoughness {
                base_color: color,
                metallic: if alpha == 0.0 { 0.9 * fraction } else { fraction },
                alpha,
                dielectric_f0: [Rgb::splat(0.04), Rgb::ZERO, Rgb::new(0.1, 0.9, 0.3)][k / 3 % 3],
                dielectric_f90: [1.0, 0.0][k / 3 % 2],
            }),
            5 => Bsdf::Dielectric(Dielectric {
                color,
                ior,
                alpha,
                transmission: if alpha == 0.0 { 0.9 * fraction } else { fraction },
            }),
            6 => Bsdf::Thin(ThinDielectric { color, ior, alpha: alpha.max(0.01), transmission: fraction }),
            _ => Bsdf::MetallicRoughness(MetallicRoughness::new(color, fraction, alpha)),
        }
    })
}

fn bits(s: Scatter) -> [u32; 5] {
    let [r, g, b] = s.f.to_array();
    [r, g, b, s.to_light.0, s.to_camera.0].map(f32::to_bits)
}

/// What one lane has.
fn of_lane(s: &Scatter<InLanes>, k: usize) -> [u32; 5] {
    let [r, g, b] = s.f.channels().all()[k];
    [r, g, b, s.to_light.0.lane(k as u32), s.to_camera.0.lane(k as u32)].map(f32::to_bits)
}

fn holds(which: <InLanes as Lanes>::M, k: usize) -> bool {
    which.bits() >> k & 1 == 1
}

fn vectors(of: &[Vec3; N]) -> <InLanes as Lanes>::V {
    Arrays.vectors(|k| of[k].to_array())
}

/// Points whose N_s is tilted by up to so many degrees, and N_g itself in every third; one has none.
fn points(bsdfs: &[Bsdf; N], degrees: f32, random: &mut Independent) -> [Point; N] {
    std::array::from_fn(|k| {
        let (normal, axis) = (warp::sphere(random.next_2d()), warp::sphere(random.next_2d()));
        let axis = normal.cross(axis).normalize();
        let tilted = (Quat::from_axis_angle(axis, (degrees * random.next_1d()).to_radians()) * normal).normalize();
        let shading_normal = match k {
            5 => Vec3::NAN,
            _ if k % 3 == 0 => normal,
            _ => tilted,
        };
        Point { normal, shading_normal, bsdf: bsdfs[k], place: Place::Surface, ..Point::nowhere(Vec3::ZERO) }
    })
}

/// Any direction, and some within the plane of either normal or near it.
fn known(points: &[Point; N], random: &mut Independent) -> [Vec3; N] {
    std::array::from_fn(|k| {
        let w = warp::sphere(random.next_2d());
        let n = if k % 2 == 0 || k == 5 { points[k].normal } else { points[k].shading_normal };
        match (random.next_1d() * 6.0) as u32 {
            0 => (w - n * n.dot(w)).normalize(),
            1 => (w - n * n.dot(w) + n * 0.01).normalize(),
            2 => n,
            _ => w,
        }
    })
}

#[test]
fn a_point_in_each_lane_scatters_as_it_does_alone() {
    let mut random = Independent::new(8, 0, 0, Stream::Camera);
    let (mut some, mut lost) = (0, 0);
    for round in 0..1000 * KINDS {
        let (kind, round) = (round % (KINDS + 1), round / (KINDS + 1));
        let degrees = [0.0, 6.0, 25.0, 80.0][round % 4];
        let alone = points(&bsdfs(kind, round), degrees, &mut random);
        let together = Point::of_each(Arrays, Arrays::<N>.first(N), Place::Surface, |k| &alone[k]);
        assert_eq!(matches!(together.bsdf, Bsdfs::Each(..)), kind == KINDS);
        let known = known(&alone, &mut random);
        let u: [Vec3; N] = std::array::from_fn(|_| random.next_3d());
        let transport = [Transport::Radiance, Transport::Importance][round / 4 % 2];
        let directions = Directions::ALL[round / 8 % 2];
        let [x, y, z] = vectors(&u).coordinates();
        let all = Bsdfs::sample_at(&together, directions, vectors(&known), transport, [x, y, z]);
        let (to_camera, to_light) = transport.sides(vectors(&known), all.direction);
        let scatter = Bsdfs::scatter_at(&together, Lobe::Continuous, to_camera, to_light);
        let deltas = [0, 1].map(|i| Bsdfs::scatter_at(&together, Lobe::Delta(i), to_camera, to_light));
        let eta = Bsdfs::relative_ior_at(&together, to_camera, to_light);
        for k in 0..N {
            let (p, case) = (&alone[k], format!("{:?} at {degrees}°, {transport:?} from {}", alone[k], known[k]));
            let one = Bsdf::sample_at(p, directions, known[k], transport, u[k].into());
            assert_eq!([all.some, all.lost_to_sides].map(|m| holds(m, k)), [one.some, one.lost_to_sides], "{case}");
            lost += u32::from(one.lost_to_sides);
            if !one.some {
                continue;
            }
            some += 1;
            assert_eq!(Vec3::from(all.direction.all()[k]), one.direction, "{case}");
            assert_eq!((all.lobe[k], holds(all.is_delta, k)), (one.lobe, one.is_delta), "{case}");
            assert_eq!(of_lane(&all.scatter, k), bits(one.scatter), "{case}");
            let (to_camera, to_light) = transport.sides(known[k], one.direction);
            let alone = |lobe| bits(Bsdf::scatter_at(p, lobe, to_camera, to_light));
            assert_eq!(of_lane(&scatter, k), alone(Lobe::Continuous), "{case}");
            assert_eq!(deltas.map(|s| of_lane(&s, k)), [0, 1].map(|i| alone(Lobe::Delta(i))), "{case}");
            assert_eq!(eta.lane(k as u32), Bsdf::relative_ior_at(p, to_camera, to_light), "{case}");
        }
    }
    assert!(some > 20_000 && lost > 0, "{some} samples, {lost} lost");
}
