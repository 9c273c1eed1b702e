//! Meshes out of a few solids. Counter-clockwise seen from the front.

pub type V3 = [f64; 3];

pub fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn along(a: V3, direction: V3, t: f64) -> V3 {
    [a[0] + t * direction[0], a[1] + t * direction[1], a[2] + t * direction[2]]
}

pub fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn unit(a: V3) -> V3 {
    let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
    a.map(|x| x / length)
}

/// An indexed triangle mesh, flat where it has no normals.
#[derive(Clone, Default)]
pub struct Mesh {
    pub positions: Vec<V3>,
    pub normals: Option<Vec<V3>>,
    pub uvs: Option<Vec<[f64; 2]>>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds another flat mesh; either all parts have texture coordinates, or none.
    pub fn add(&mut self, other: Self) {
        let n = self.positions.len() as u32;
        self.positions.extend(other.positions);
        if let Some(uvs) = other.uvs {
            self.uvs.get_or_insert_default().extend(uvs);
        }
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|i| i + n)));
    }

    /// The same mesh, inside out.
    pub fn flipped(mut self) -> Self {
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        for n in self.normals.iter_mut().flatten() {
            *n = n.map(|x| 0.0 - x);
        }
        self
    }

    /// The same mesh at another place.
    pub fn moved(mut self, by: V3) -> Self {
        for p in &mut self.positions {
            *p = along(*p, by, 1.0);
        }
        self
    }

    /// The same mesh without one of its quadrilaterals.
    pub fn without(mut self, quad: usize) -> Self {
        self.triangles.drain(2 * quad..2 * quad + 2);
        self
    }
}

impl FromIterator<Mesh> for Mesh {
    fn from_iter<I: IntoIterator<Item = Self>>(meshes: I) -> Self {
        let mut all = Self::default();
        meshes.into_iter().for_each(|mesh| all.add(mesh));
        all
    }
}

/// A quadrilateral.
pub fn quad(positions: [V3; 4]) -> Mesh {
    Mesh { positions: positions.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
}

/// A quadrilateral that shows `repeats` textures along its first and its second side, v growing downwards on the image.
pub fn papered_quad(positions: [V3; 4], [u, v]: [f64; 2]) -> Mesh {
    Mesh { uvs: Some(vec![[0., v], [u, v], [u, 0.], [0., 0.]]), ..quad(positions) }
}

/// A square around `center` that faces along the unit vector `normal`.
pub fn facing_quad(center: V3, normal: V3, half: f64) -> Mesh {
    let (u, w) = across(normal);
    let corner = |a: f64, b: f64| along(along(center, u, a * half), w, b * half);
    quad([corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)])
}

/// Two unit vectors that make a right-handed frame with `normal`.
fn across(normal: V3) -> (V3, V3) {
    let up = if normal[1].abs() < 0.9 { [0., 1., 0.] } else { [0., 0., 1.] };
    let u = unit(cross(up, normal));
    (u, cross(normal, u))
}

/// An axis-aligned box with its front outside.
pub fn block([x0, y0, z0]: V3, [x1, y1, z1]: V3) -> Mesh {
    [
        [[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]],
        [[x0, y1, z0], [x0, y1, z1], [x1, y1, z1], [x1, y1, z0]],
        [[x0, y0, z0], [x0, y1, z0], [x1, y1, z0], [x1, y0, z0]],
        [[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]],
        [[x0, y0, z0], [x0, y0, z1], [x0, y1, z1], [x0, y1, z0]],
        [[x1, y0, z0], [x1, y1, z0], [x1, y1, z1], [x1, y0, z1]],
    ]
    .into_iter()
    .map(quad)
    .collect()
}

/// An upright prism on the floor over a quadrilateral given by x and z, without its bottom.
pub fn prism(base: [[f64; 2]; 4], height: f64) -> Mesh {
    let at = |i: usize, y: f64| [base[i % 4][0], y, base[i % 4][1]];
    let mut mesh = quad([0, 1, 2, 3].map(|i| at(i, height)));
    for i in 0..4 {
        mesh.add(quad([at(i, height), at(i, 0.), at(i + 1, 0.), at(i + 1, height)]));
    }
    mesh
}

/// The wall and the small end of a cone's frustum: a lamp shade, open at the end that `axis` points to.
pub fn frustum(base: V3, axis: V3, r0: f64, r1: f64, height: f64, segments: u32) -> Mesh {
    let (u, w) = across(axis);
    let end = along(base, axis, height);
    let rim = |center: V3, r: f64, i: u32| {
        let (s, c) = angle(i, segments);
        along(along(center, u, r * c), w, r * s)
    };
    (0..segments)
        .flat_map(|i| {
            let bottom = [base, rim(base, r0, i + 1), rim(base, r0, i)];
            [
                quad([rim(base, r0, i), rim(base, r0, i + 1), rim(end, r1, i + 1), rim(end, r1, i)]),
                Mesh { positions: bottom.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() },
            ]
        })
        .collect()
}

fn angle(i: u32, segments: u32) -> (f64, f64) {
    (f64::from(i % segments) * std::f64::consts::TAU / f64::from(segments)).sin_cos()
}

/// A band that stands on y = 0: outer and inner wall with smooth normals, and a flat top.
pub fn ring(inner: f64, outer: f64, height: f64, segments: u32) -> Mesh {
    let mut mesh = Mesh { normals: Some(Vec::new()), ..Mesh::default() };
    let bands = [
        ((outer, 0.), (outer, height), 1.0),
        ((inner, height), (inner, 0.), -1.0),
        ((outer, height), (inner, height), 0.0),
    ];
    for (lower, upper, outward) in bands {
        let first = mesh.positions.len() as u32;
        for i in 0..segments {
            let (s, c) = angle(i, segments);
            let normal = if outward == 0.0 { [0., 1., 0.] } else { [outward * c, 0., outward * s] };
            for (r, y) in [lower, upper] {
                mesh.positions.push([r * c, y, r * s]);
                mesh.normals.get_or_insert_default().push(normal);
            }
            let [a, b] = [i, (i + 1) % segments].map(|i| first + 2 * i);
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    mesh
}

/// Part of an outline in the half-plane of a radius and a height: two ends, each with its place and its normal.
pub type Band = [([f64; 2], [f64; 2]); 2];

/// The bands along a polygon, whose inside is on the left.
pub fn straight(outline: &[[f64; 2]]) -> Vec<Band> {
    let band = |pair: &[[f64; 2]]| {
        let [dr, dy] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let length = (dr * dr + dy * dy).sqrt();
        let normal = [dy / length, -dr / length];
        [(pair[0], normal), (pair[1], normal)]
    };
    outline.windows(2).map(band).collect()
}

/// The bands of a sphere around the origin.
pub fn bowed(radius: f64, bands: u32) -> Vec<Band> {
    let end = |i: u32| {
        let (s, c) = (f64::from(i) * std::f64::consts::PI / f64::from(bands)).sin_cos();
        // On the axis exactly.
        let s = if i.is_multiple_of(bands) { 0.0 } else { s };
        ([radius * s, -radius * c], [s, -c])
    };
    (0..bands).map(|i| [end(i), end(i + 1)]).collect()
}

/// The surface that bands make when they turn around the y axis.
pub fn turned(bands: &[Band], segments: u32) -> Mesh {
    let mut mesh = Mesh { normals: Some(Vec::new()), ..Mesh::default() };
    for band in bands {
        let first = mesh.positions.len() as u32;
        for i in 0..segments {
            let (s, c) = angle(i, segments);
            for ([r, y], [nr, ny]) in band {
                // No negative zero: whoever looks for borders compares bits.
                mesh.positions.push([r * c + 0.0, *y, r * s + 0.0]);
                mesh.normals.get_or_insert_default().push([nr * c, *ny, nr * s]);
            }
            let [a, b] = [i, (i + 1) % segments].map(|i| first + 2 * i);
            let is_cone = |end: usize| band[end].0[0] == 0.0;
            if !is_cone(1) {
                mesh.triangles.push([a, a + 1, b + 1]);
            }
            if !is_cone(0) {
                mesh.triangles.push([a, b + 1, b]);
            }
        }
    }
    mesh
}

/// The polyhedron within all `planes`, each a unit normal that points outwards and a distance from the origin.
pub fn convex(planes: &[(V3, f64)]) -> Mesh {
    let dot = |a: V3, b: V3| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let far = 10.0 * planes.iter().map(|plane| plane.1).fold(0.0, f64::max);
    let facet = |(normal, distance): &(V3, f64)| {
        let mut corners = facing_quad(normal.map(|x| x * distance), *normal, far).positions;
        for (other, limit) in planes.iter().filter(|plane| plane.0 != *normal) {
            let beyond = |p: V3| dot(p, *other) - limit;
            corners = (0..corners.len())
                .flat_map(|i| {
                    let [a, b] = [corners[i], corners[(i + 1) % corners.len()]];
                    let [above_a, above_b] = [a, b].map(beyond);
                    let crossing = (above_a > 0.0) != (above_b > 0.0);
                    let crossed = crossing.then(|| along(a, sub(b, a), above_a / (above_a - above_b)));
                    (above_a <= 0.0).then_some(a).into_iter().chain(crossed)
                })
                .collect();
        }
        corners
    };
    // Each facet has found its corners alone; those that are the same up to rounding are made the same.
    let mut known: Vec<V3> = Vec::new();
    let mut weld = |p: V3| {
        let near = |q: &&V3| dot(sub(p, **q), sub(p, **q)) < (1e-7 * far).powi(2);
        if let Some(q) = known.iter().find(near) {
            return *q;
        }
        known.push(p);
        p
    };
    let polygon = |plane| {
        let mut corners: Vec<V3> = facet(plane).into_iter().map(&mut weld).collect();
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        let fan = (2..corners.len() as u32).map(|i| [0, i - 1, i]).collect();
        Mesh { positions: corners, triangles: fan, ..Mesh::default() }
    };
    planes.iter().map(polygon).filter(|mesh: &Mesh| !mesh.triangles.is_empty()).collect()
}
