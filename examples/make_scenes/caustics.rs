//! Scenes whose light passes glass or water before or after it meets anything else, and one that it barely enters.

use crate::{
    glb::{Builder, Camera, Punctual, Surface},
    shapes::{self, Mesh, V3, along, block, bowed, convex, facing_quad, prism, quad, straight, turned, unit},
};

const PLASTER: Surface = Surface::Diffuse([0.72, 0.70, 0.66]);
const WOOD: Surface = Surface::Diffuse([0.42, 0.27, 0.15]);

/// A hall with a pool whose waves gather the light of a small lamp on its floor, where the camera sees it through them.
pub fn pool() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [0.0, 2.4, -2.9],
        target: [0.0, -0.75, 0.05],
        yfov: 44.0_f64.to_radians(),
        aspect: 1.0,
    });
    let (half, depth, wide) = (1.6, 1.4, 3.8);
    scene.mesh("hall", "plaster", PLASTER, &block([-wide, -0.002, -wide], [wide, 3.0, wide]).flipped().without(0));
    // The deck around the pool.
    let stone = Surface::Diffuse([0.45, 0.40, 0.35]);
    let deck = [
        [[-wide, -wide], [wide, -half]],
        [[-wide, half], [wide, wide]],
        [[-wide, -half], [-half, half]],
        [[half, -half], [wide, half]],
    ];
    scene.mesh("deck", "stone", stone, &deck.map(|[a, b]| level(a, b, 0.0)).into_iter().collect());
    let basin = block([-half, -depth, -half], [half, 0.0, half]).flipped().without(1);
    scene.mesh("basin", "tiles", Surface::Diffuse([0.55, 0.72, 0.75]), &basin);
    let lines = [-0.8, 0.0, 0.8].map(|x| level([x - 0.06, -half], [x + 0.06, half], 0.001 - depth));
    scene.mesh("lines", "dark tiles", Surface::Diffuse([0.05, 0.10, 0.25]), &lines.into_iter().collect());
    // It reaches into the walls of the basin, so that nothing is between it and them.
    let [waves, rest] = water(half + 0.04, -0.12, -depth - 0.04);
    let clear = Surface::Glass(1.33);
    scene.parts("water", &[("water", clear, &waves), ("water", clear, &rest)]);
    let lamp = facing_quad([0.9, 2.7, 0.8], [0., -1., 0.], 0.05);
    scene.mesh("lamp", "lamp", Surface::Emitter([900.0, 860.0, 780.0]), &lamp);
    scene.finish()
}

/// A rectangle at a height between two corners given by x and z, facing up.
fn level([x0, z0]: [f64; 2], [x1, z1]: [f64; 2], y: f64) -> Mesh {
    quad([[x0, y, z0], [x0, y, z1], [x1, y, z1], [x1, y, z0]])
}

/// A square body of water: its surface with smooth waves, and what closes it at the sides and below.
fn water(half: f64, height: f64, bottom: f64) -> [Mesh; 2] {
    const CELLS: u32 = 48;
    // Direction, wavelength in metres, amplitude in metres, phase.
    const WAVES: [([f64; 2], f64, f64, f64); 5] = [
        ([0.96, 0.28], 0.83, 0.0100, 0.4),
        ([-0.28, 0.96], 0.71, 0.0085, 2.1),
        ([0.60, -0.80], 0.57, 0.0060, 3.7),
        ([0.80, 0.60], 0.46, 0.0045, 5.2),
        ([-0.936, 0.352], 0.37, 0.0030, 1.3),
    ];
    let place = |i: u32| half * (2.0 * f64::from(i) / f64::from(CELLS) - 1.0);
    let at = |i: u32, j: u32| {
        let (x, z) = (place(i), place(j));
        let (mut y, mut slope) = (height, [0.0; 2]);
        for ([u, v], length, amplitude, phase) in WAVES {
            let k = std::f64::consts::TAU / length;
            let (s, c) = (k * (u * x + v * z) + phase).sin_cos();
            y += amplitude * s;
            slope = [slope[0] + amplitude * k * u * c, slope[1] + amplitude * k * v * c];
        }
        ([x, y, z], unit([-slope[0], 1.0, -slope[1]]))
    };
    let (positions, normals) =
        (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| (i, j))).map(|(i, j)| at(i, j)).unzip();
    let index = |i: u32, j: u32| j * (CELLS + 1) + i;
    let cells = (0..CELLS).flat_map(|j| (0..CELLS).map(move |i| (i, j)));
    let cell = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
        [[a, b, c], [a, c, d]]
    };
    let waves = Mesh { positions, normals: Some(normals), uvs: None, triangles: cells.flat_map(cell).collect() };
    // Around the border, so that every edge of the surface has a wall below it.
    let n = CELLS;
    let border = (0..n).map(|i| (i, 0)).chain((0..n).map(|j| (n, j)));
    let border: Vec<_> = border.chain((0..n).map(|i| (n - i, n))).chain((0..n).map(|j| (0, n - j))).collect();
    let below = |p: V3| [p[0], bottom, p[2]];
    let rest = (0..border.len()).flat_map(|k| {
        let [a, b] = [border[k], border[(k + 1) % border.len()]].map(|(i, j)| at(i, j).0);
        [quad([b, below(b), below(a), a]), triangle([below(a), below(b), [0.0, bottom, 0.0]])]
    });
    [waves, rest.collect()]
}

fn triangle(positions: [V3; 3]) -> Mesh {
    Mesh { positions: positions.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() }
}

/// A room whose only lamp burns in a bulb of clear glass, before a mirror.
pub fn bulb() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [0.5, 1.55, 0.15],
        target: [2.35, 1.25, 3.6],
        yfov: 58.0_f64.to_radians(),
        aspect: 1.0,
    });
    let [x, y, z] = [4.2, 2.7, 3.8];
    scene.mesh("room", "plaster", PLASTER, &block([0.; 3], [x, y, z]).flipped().without(0));
    scene.mesh("floor", "floor", Surface::Diffuse([0.35, 0.25, 0.18]), &level([0., 0.], [x, z], 0.0));
    let mirror = quad([[1.0, 0.5, z - 0.02], [3.9, 0.5, z - 0.02], [3.9, 2.3, z - 0.02], [1.0, 2.3, z - 0.02]]);
    scene.mesh("mirror", "mirror", Surface::Mirror(0.92), &mirror.flipped());
    let mut table = block([1.0, 0.70, 2.2], [2.2, 0.75, 3.0]);
    for (lx, lz) in [(1.05, 2.25), (2.10, 2.25), (1.05, 2.90), (2.10, 2.90)] {
        table.add(block([lx, 0.0, lz], [lx + 0.05, 0.70, lz + 0.05]));
    }
    scene.mesh("table", "wood", WOOD, &table);
    scene.mesh("book", "book", Surface::Diffuse([0.15, 0.25, 0.50]), &block([1.25, 0.75, 2.45], [1.55, 0.80, 2.85]));
    let at = [2.1, 1.75, 2.3];
    let shell = |radius: f64| turned(&bowed(radius, 20), 40).moved(at);
    scene.mesh("bulb", "glass", Surface::Glass(1.5), &shell(0.10));
    scene.mesh("hollow", "glass", Surface::Glass(1.5), &shell(0.094).flipped());
    let cord = block([at[0] - 0.008, at[1] + 0.101, at[2] - 0.008], [at[0] + 0.008, y, at[2] + 0.008]);
    scene.mesh("cord", "cord", Surface::Diffuse([0.1; 3]), &cord);
    let (low, high) = ([-0.012, -0.018, -0.012], [0.012, 0.018, 0.012]);
    scene.mesh("lamp", "lamp", Surface::Emitter([2600.0, 2200.0, 1600.0]), &block(low, high).moved(at));
    scene.finish()
}

/// A glass of water on a table, beside a wall, under a small lamp.
pub fn glass_of_water() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [0.10, 0.24, -0.52],
        target: [-0.015, 0.045, 0.02],
        yfov: 30.0_f64.to_radians(),
        aspect: 1.0,
    });
    scene.mesh("table", "wood", WOOD, &level([-1.2, -1.2], [1.2, 1.2], 0.0));
    let wall = quad([[-1.2, 0., 0.45], [1.2, 0., 0.45], [1.2, 1.5, 0.45], [-1.2, 1.5, 0.45]]).flipped();
    scene.mesh("wall", "plaster", PLASTER, &wall);
    let (outer, inner, height, base) = (0.036, 0.0335, 0.115, 0.008);
    // A hair above the table.
    let foot = 0.0002;
    let glass =
        [[0.0, foot], [outer, foot], [outer, height], [inner, height], [inner, foot + base], [0.0, foot + base]];
    scene.mesh("glass", "glass", Surface::Glass(1.5), &turned(&straight(&glass), 64));
    // Into the middle of the glass, which has the smaller volume and so is what is there.
    let (r, low, high) = (0.5 * (outer + inner), foot + 0.5 * base, 0.080);
    let water = [[0.0, low], [r, low], [r, high], [0.0, high]];
    scene.mesh("water", "water", Surface::Glass(1.33), &turned(&straight(&water), 64));
    let from = [-0.42, 0.62, 0.10];
    let lamp = facing_quad(from, unit(shapes::sub([0.0, 0.05, 0.0], from)), 0.012);
    scene.mesh("lamp", "lamp", Surface::Emitter([1500.0, 1400.0, 1200.0]), &lamp);
    let fill = facing_quad([0.4, 1.6, -0.6], unit([-0.2, -1.0, 0.4]), 0.4);
    scene.mesh("fill", "fill", Surface::Emitter([0.8, 0.9, 1.1]), &fill);
    scene.finish()
}

/// After Veach's second scene: a room that gets its light through a door ajar, from a lamp in the next one.
pub fn door_ajar() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [1.0, 1.45, 0.15],
        target: [2.0, 0.95, 3.0],
        yfov: 56.0_f64.to_radians(),
        aspect: 4.0 / 3.0,
    });
    let ([x, y, z], far, thick) = ([4.0, 2.6, 3.6], 5.6, 0.1);
    let (left, right, lintel) = (2.3, 3.15, 2.05);
    let shell = block([0.; 3], [x, y, far]).flipped().without(0);
    scene.mesh("rooms", "plaster", PLASTER, &shell);
    scene.mesh("floor", "floor", Surface::Diffuse([0.40, 0.36, 0.32]), &level([0., 0.], [x, far], 0.0));
    let mut wall = block([0., 0., z], [left, y, z + thick]);
    wall.add(block([right, 0., z], [x, y, z + thick]));
    wall.add(block([left, lintel, z], [right, y, z + thick]));
    scene.mesh("wall", "plaster", PLASTER, &wall);
    // Hinged on the right, and turned into the room.
    let (s, c) = 20.0_f64.to_radians().sin_cos();
    let leaf = |u: f64, v: f64| [right - u * c - v * s, z - u * s + v * c];
    let (wide, thin) = (right - left - 0.01, 0.04);
    let door = prism([leaf(0.0, 0.0), leaf(0.0, thin), leaf(wide, thin), leaf(wide, 0.0)], lintel - 0.01);
    scene.mesh("door", "door", Surface::Diffuse([0.50, 0.32, 0.20]), &door);
    let mut table = block([1.15, 0.70, 1.9], [2.25, 0.75, 2.7]);
    for (lx, lz) in [(1.2, 1.95), (2.15, 1.95), (1.2, 2.6), (2.15, 2.6)] {
        table.add(block([lx, 0.0, lz], [lx + 0.05, 0.70, lz + 0.05]));
    }
    scene.mesh("table", "wood", WOOD, &table);
    scene.sphere("glass ball", "glass", Surface::Glass(1.5), [1.45, 0.881, 2.35], 0.13);
    let metal = Surface::Glossy { color: [0.85, 0.75, 0.55], metallic: 1.0, roughness: 0.25 };
    scene.sphere("metal ball", "brass", metal, [1.78, 0.861, 2.15], 0.11);
    scene.sphere("plain ball", "clay", Surface::Diffuse([0.60, 0.30, 0.22]), [2.05, 0.841, 2.45], 0.09);
    let lamp = facing_quad([1.4, 2.55, 4.6], [0., -1., 0.], 0.15);
    scene.mesh("lamp", "lamp", Surface::Emitter([6500.0, 5875.0, 4750.0]), &lamp);
    scene.finish()
}

/// A brilliant that lies on a table under a small lamp.
pub fn gem() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [-0.012, 0.056, -0.066],
        target: [-0.004, 0.005, 0.002],
        yfov: 25.0_f64.to_radians(),
        aspect: 1.0,
    });
    let gray = Surface::Diffuse([0.5, 0.49, 0.47]);
    scene.mesh("table", "gray", gray, &level([-0.3, -0.3], [0.3, 0.3], 0.0));
    // Of a girdle whose radius is 1: elevation of the normal in degrees, distance from the centre, azimuths in 32nds.
    let facets: [(f64, f64, &[u32]); 5] = [
        (33.8, 0.86, &[0, 4, 8, 12, 16, 20, 24, 28]),
        (48.0, 0.80, &[1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31]),
        (68.0, 0.53, &[2, 6, 10, 14, 18, 22, 26, 30]),
        (-49.0, 0.655, &[0, 4, 8, 12, 16, 20, 24, 28]),
        (-47.4, 0.675, &[1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31]),
    ];
    let mut planes = vec![([0.0, 1.0, 0.0], 0.33)];
    for (elevation, distance, azimuths) in facets {
        let (s, c) = elevation.to_radians().sin_cos();
        planes.extend(azimuths.iter().map(|i| {
            let (sin, cos) = (f64::from(*i) * std::f64::consts::TAU / 32.0).sin_cos();
            ([c * cos, s, c * sin], distance)
        }));
    }
    // The girdle.
    planes.extend((0..32).map(|i| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 32.0).sin_cos();
        ([cos, 0.0, sin], 1.0)
    }));
    // Turned so that a facet of the pavilion lies down, a hair above the table.
    let (s, c) = 41.0_f64.to_radians().sin_cos();
    let turn = |[x, y, z]: V3| [c * x - s * y, s * x + c * y, z];
    let size = 0.010;
    let planes: Vec<_> = planes.into_iter().map(|(n, d)| (turn(n), size * d)).collect();
    let gem = convex(&planes);
    let lowest = gem.positions.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    scene.mesh("gem", "gem", Surface::Glass(2.0), &gem.moved([0.0, 1e-5 - lowest, 0.0]));
    let from = [-0.15, 0.30, 0.10];
    let lamp = facing_quad(from, unit(shapes::sub([0.; 3], from)), 0.005);
    scene.mesh("lamp", "lamp", Surface::Emitter([2200.0, 2100.0, 1900.0]), &lamp);
    let fill = facing_quad(along([0.; 3], [0., 1., 0.], 0.5), [0., -1., 0.], 0.15);
    scene.mesh("fill", "fill", Surface::Emitter([0.9, 1.0, 1.2]), &fill);
    scene.finish()
}

/// A prism on a stand, which spreads the beam of a spot over a table.
pub fn spectrum() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [1.15, 1.05, -1.25],
        target: [0.24, 0.47, 0.0],
        yfov: 46.0_f64.to_radians(),
        aspect: 1.0,
    });
    let paper = Surface::Diffuse([0.75; 3]);
    scene.mesh("table", "paper", paper, &level([-1.0, -0.8], [1.8, 0.8], 0.0));
    // Light that comes along `beam` goes parallel to the base, the least deviation for an index of 1.62. What passes
    // the prism by does not meet the table.
    let (side, middle) = (0.06_f64, [0.0, 0.9, 0.0]);
    let turn = |degrees: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        [c, s, 0.0]
    };
    let inside = -42.0;
    let bend = (1.62 * 0.5_f64).asin().to_degrees() - 30.0;
    let beam = turn(inside + bend);
    let faces = [inside - 90.0, inside + 30.0, inside + 150.0].map(|degrees| (turn(degrees), side / 12.0_f64.sqrt()));
    let long = 0.12;
    let ends = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]].map(|normal| (normal, long));
    let glass = convex(&[faces.as_slice(), &ends].concat()).moved(middle);
    scene.mesh("prism", "flint", Surface::Flint { ior: 1.62, dispersion: 2.0 }, &glass);
    let stand = [-1.0, 1.0].map(|end: f64| {
        let z = end * (long + 0.012);
        block([-0.03, 0.0, z - 0.01], [0.03, 0.93, z + 0.01])
    });
    scene.mesh("stand", "wood", WOOD, &stand.into_iter().collect());
    let from = along(middle, beam, -2.0);
    scene.light("spot", Punctual::Spot(0.04, 0.06), [9.0; 3], from, middle);
    let fill = facing_quad([0.5, 2.4, -0.4], [0., -1., 0.], 0.5);
    scene.mesh("fill", "fill", Surface::Emitter([0.4, 0.45, 0.5]), &fill);
    scene.finish()
}
