//! What vertices carry besides position and normal, for materials that vary over a surface.

use glam::{DMat3, Vec2, Vec3, Vec4};

/// How many sets of texture coordinates a mesh can have.
pub const UV_SETS: usize = 4;

/// The attributes of a mesh's vertices. Each list is empty or has one element per vertex; only what the mesh's material
/// reads needs to be there. Memory per vertex: 8 bytes for each set of texture coordinates, 8 for a colour, 16 for a
/// tangent.
#[derive(Clone, Debug, Default)]
pub struct Attributes {
    /// Sets of texture coordinates.
    pub uv: [Vec<Vec2>; UV_SETS],
    /// Linear red, green, blue and alpha, 65535 for 1.
    pub colors: Vec<[u16; 4]>,
    /// The direction T in which the normal texture's u grows, and the w with which w N × T is up on its image.
    pub tangents: Vec<Vec4>,
}

/// The axes of a normal texture at a place, in world space. They need be neither unit nor perpendicular: what they
/// weigh is normalised at the end, as MikkTSpace asks.
#[derive(Clone, Copy, Debug)]
pub struct TangentFrame {
    /// Where u grows.
    pub tangent: Vec3,
    /// Up on the image, against v: w N × T, and w is the sign that the mesh gives.
    pub bitangent: Vec3,
    /// The interpolated normal, on whichever side of N_g the mesh puts it.
    pub normal: Vec3,
}

/// A place of a triangle: its corners, weighed.
#[derive(Clone, Copy, Debug)]
pub struct Interpolation<'a> {
    attributes: &'a Attributes,
    corners: [u32; 3],
    weights: Vec3,
}

/// The tangent `t` where `m` takes it; zero stays zero. It goes with the surface, but a mirror turns N × T against the
/// image's up, and so the sign turns.
pub fn moved_tangent(m: DMat3, t: Vec4) -> Vec4 {
    let sign = 1.0_f64.copysign(m.determinant()) as f32;
    (m * t.truncate().as_dvec3()).normalize_or_zero().as_vec3().extend(sign * t.w)
}

impl Attributes {
    /// Whether there are none at all.
    pub fn is_empty(&self) -> bool {
        self.uv.iter().all(Vec::is_empty) && self.colors.is_empty() && self.tangents.is_empty()
    }

    /// Whether every list is empty or has `vertices` finite elements.
    pub(super) fn fit(&self, vertices: usize) -> bool {
        let fits = |length: usize| length == 0 || length == vertices;
        self.uv.iter().all(|set| fits(set.len()) && set.iter().all(|uv| uv.is_finite()))
            && fits(self.colors.len())
            && fits(self.tangents.len())
            && self.tangents.iter().all(|t| t.is_finite())
    }

    /// Adds those of a mesh whose first vertex has index `base`. What a mesh lacks is zero, its colour white, and no
    /// memory is taken for what no mesh has had so far.
    pub(super) fn append(&mut self, base: usize, mesh: &Self) {
        fn put<T: Copy>(all: &mut Vec<T>, base: usize, lacking: T, more: &[T]) {
            if !more.is_empty() {
                all.resize(base, lacking);
                all.extend_from_slice(more);
            }
        }
        for (all, more) in self.uv.iter_mut().zip(&mesh.uv) {
            put(all, base, Vec2::ZERO, more);
        }
        put(&mut self.colors, base, [u16::MAX; 4], &mesh.colors);
        put(&mut self.tangents, base, Vec4::ZERO, &mesh.tangents);
    }

    /// The place with barycentric coordinates `b` (of the second and third corner) between these vertices.
    #[inline]
    pub(super) fn between(&self, corners: [u32; 3], b: Vec2) -> Interpolation<'_> {
        Interpolation { attributes: self, corners, weights: Vec3::new(1.0 - b.x - b.y, b.x, b.y) }
    }
}

impl Interpolation<'_> {
    #[inline]
    fn corners<T: Copy>(&self, list: &[T]) -> Option<[T; 3]> {
        let [a, b, c] = self.corners.map(|i| list.get(i as usize).copied());
        Some([a?, b?, c?])
    }

    /// The texture coordinates of a set; (0, 0) where the mesh has no such set.
    #[inline]
    pub fn uv(&self, set: u8) -> Vec2 {
        let corners = self.attributes.uv.get(usize::from(set)).and_then(|set| self.corners(set));
        let Some([p, q, r]) = corners else { return Vec2::ZERO };
        // From the first corner, so that a constant stays one.
        p + (q - p) * self.weights.y + (r - p) * self.weights.z
    }

    /// The vertex colour and alpha, each in [0, 1]; white where the mesh has none.
    #[inline]
    pub fn color(&self) -> Vec4 {
        let Some([p, q, r]) = self.corners(&self.attributes.colors) else { return Vec4::ONE };
        let unit = |c: [u16; 4]| Vec4::from_array(c.map(f32::from)) * (1.0 / 65535.0);
        (unit(p) * self.weights.x + unit(q) * self.weights.y + unit(r) * self.weights.z).clamp(Vec4::ZERO, Vec4::ONE)
    }

    /// The tangents of the three corners; `None` where the mesh has none.
    #[inline]
    pub(super) fn tangents(&self) -> Option<[Vec4; 3]> {
        self.corners(&self.attributes.tangents)
    }

    /// The axes of a normal texture here, from the tangents and normals of the corners; a mesh without normals takes
    /// `n_g`. `None` where the tangents cancel.
    pub(super) fn frame(&self, tangents: [Vec4; 3], normals: [Vec3; 3], n_g: Vec3) -> Option<TangentFrame> {
        let [p, q, r] = tangents;
        let tangent = (p * self.weights.x + q * self.weights.y + r * self.weights.z).truncate();
        let [a, b, c] = normals;
        let normal = a * self.weights.x + b * self.weights.y + c * self.weights.z;
        let normal = if normal == Vec3::ZERO { n_g } else { normal };
        (tangent != Vec3::ZERO).then(|| TangentFrame { tangent, bitangent: p.w * normal.cross(tangent), normal })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_interpolated_between_their_own_corners() {
        let mesh = Attributes {
            uv: [vec![], vec![Vec2::ZERO, Vec2::X, Vec2::new(0.0, 4.0)], vec![], vec![]],
            colors: vec![[65535, 0, 0, 65535], [0, 65535, 0, 65535], [0, 0, 65535, 0]],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, -1.0); 3],
        };
        assert!(mesh.fit(3) && !mesh.fit(4) && !mesh.is_empty());
        let mut all = Attributes::default();
        all.append(5, &mesh);
        all.append(8, &Attributes::default());
        let here = all.between([5, 6, 7], Vec2::new(0.25, 0.5));
        assert_eq!(here.uv(1), Vec2::new(0.25, 2.0));
        assert_eq!(here.uv(0), Vec2::ZERO, "a set that nobody has");
        assert_eq!(here.color(), Vec4::new(0.25, 0.25, 0.5, 0.5));
        let frame = here.frame(here.tangents().unwrap(), [Vec3::ZERO; 3], Vec3::Z).unwrap();
        assert_eq!((frame.tangent, frame.bitangent, frame.normal), (Vec3::X, -Vec3::Y, Vec3::Z));
        let bare = all.between([8, 9, 10], Vec2::ZERO);
        assert_eq!((bare.uv(1), bare.color(), bare.tangents()), (Vec2::ZERO, Vec4::ONE, None));
        let padding = all.between([0, 1, 2], Vec2::ZERO);
        let frame = padding.frame(padding.tangents().unwrap(), [Vec3::Z; 3], Vec3::Z);
        assert!(frame.is_none(), "the zeros before the first mesh are no direction");
    }

    #[test]
    fn the_images_up_goes_through_a_mirror_with_its_surface() {
        let (normal, tangent) = (Vec3::new(0.0, 0.6, 0.8), Vec4::new(1.0, 0.0, 0.0, -1.0));
        let up = |n: Vec3, t: Vec4| t.w * n.cross(t.truncate());
        for mirror in [DMat3::IDENTITY, DMat3::from_diagonal(glam::DVec3::new(1.0, -1.0, 1.0))] {
            let m = DMat3::from_rotation_z(0.7) * mirror;
            let moved = up(m.as_mat3() * normal, moved_tangent(m, tangent));
            let expected = m.as_mat3() * up(normal, tangent);
            assert!((moved - expected).length() < 1e-6, "{moved} for {expected}");
        }
    }
}
