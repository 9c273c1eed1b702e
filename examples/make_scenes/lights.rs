//! Scenes with every kind of light, and with textures and instances.

use crate::{
    glb::{Builder, Camera, Punctual, Surface},
    images::{brick, hash, normal, sky},
    shapes::{self, Mesh, V3, along, block, facing_quad, papered_quad, quad, unit},
};

/// Veach's plates for multiple importance sampling (his figure 9.2): four metal plates from nearly smooth to rough,
/// each turned so that it shows the camera four lights of one power and four sizes.
pub fn mis_plates() -> Vec<u8> {
    let eye = [0.0, 2.0, 15.0];
    let mut scene = Builder::new(Camera {
        position: eye,
        target: [0.0, -1.9, 2.5],
        yfov: 31.0_f64.to_radians(),
        aspect: 4.0 / 3.0,
    });
    let gray = Surface::Diffuse([0.4; 3]);
    scene.mesh(
        "floor",
        "gray",
        gray,
        &quad([[-10., -4.2, -3.], [-10., -4.2, 14.], [10., -4.2, 14.], [10., -4.2, -3.]]),
    );
    scene.mesh("back", "gray", gray, &quad([[-10., -4.2, -3.], [10., -4.2, -3.], [10., 6., -3.], [-10., 6., -3.]]));
    let places =
        [([0.0, -1.5, 0.6], 0.08), ([0.0, -2.15, 2.2], 0.15), ([0.0, -2.8, 3.8], 0.25), ([0.0, -3.45, 5.4], 0.38)];
    for (i, (center, roughness)) in places.into_iter().enumerate() {
        let to = |p: V3| unit(shapes::sub(p, center));
        let facing = unit(along(to(eye), to([0.; 3]), 1.0));
        let depth = shapes::cross([1., 0., 0.], facing).map(|x| 0.75 * x);
        let corner = |x: f64, side: f64| along([x, center[1], center[2]], depth, side);
        // Counter-clockwise seen along −facing.
        let plate = quad([corner(-4., 1.), corner(-4., -1.), corner(4., -1.), corner(4., 1.)]).flipped();
        let metal = Surface::Glossy { color: [0.85; 3], metallic: 1.0, roughness };
        scene.mesh(&format!("plate {i}"), &format!("metal {i}"), metal, &plate);
    }
    let lights = [
        (-3.75, 0.06, [1.0, 0.35, 0.25]),
        (-1.25, 0.18, [1.0, 0.9, 0.3]),
        (1.25, 0.42, [0.35, 1.0, 0.4]),
        (3.75, 0.9, [0.35, 0.5, 1.0]),
    ];
    for (i, (x, radius, color)) in lights.into_iter().enumerate() {
        let radiance = color.map(|c| c * 2.4 / (radius * radius));
        scene.sphere(&format!("light {i}"), &format!("light {i}"), Surface::Emitter(radiance), [x, 0.0, 0.0], radius);
    }
    // From above, so that floor and wall are not black.
    let lamp = facing_quad([0.0, 9.0, 9.0], unit([0.0, -1.0, -0.6]), 1.5);
    scene.mesh("fill", "fill", Surface::Emitter([4.0; 3]), &lamp);
    scene.finish()
}

/// Four hundred small lamps of four colours under the ceiling of a hall with blocks: four instanced meshes.
pub fn many_lights() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [0.4, 1.6, 0.5],
        target: [4.4, 0.9, 5.5],
        yfov: 58.0_f64.to_radians(),
        aspect: 4.0 / 3.0,
    });
    let [x, y, z] = [8.0, 3.0, 8.0];
    let shell = block([0.; 3], [x, y, z]).flipped();
    scene.mesh("hall", "plaster", Surface::Diffuse([0.6, 0.58, 0.55]), &shell);
    for (i, (at, side, height)) in [
        ([2.2, 3.6], 0.9, 0.7),
        ([4.4, 2.4], 0.7, 1.1),
        ([4.0, 5.2], 1.1, 1.6),
        ([6.3, 4.6], 0.8, 0.5),
        ([2.6, 6.2], 0.8, 1.2),
    ]
    .into_iter()
    .enumerate()
    {
        let base =
            [[0., 0.], [0., 1.], [1., 1.], [1., 0.]].map(|[u, v]: [f64; 2]| [at[0] + u * side, at[1] + v * side]);
        scene.mesh(&format!("block {i}"), "stone", Surface::Diffuse([0.45, 0.42, 0.4]), &shapes::prism(base, height));
    }
    let colors = [[1.0, 0.75, 0.45], [1.0, 0.35, 0.25], [0.35, 0.6, 1.0], [0.55, 1.0, 0.45]];
    for (k, color) in colors.into_iter().enumerate() {
        let name = format!("lamps {k}");
        let lamp = facing_quad([0.; 3], [0., -1., 0.], 0.05);
        let mesh = scene.model(&name, &[(&name, Surface::Emitter(color.map(|c| 30.0 * c)), &lamp)]);
        let places: Vec<V3> = (0..400)
            .map(|i| [i % 20, i / 20])
            .filter(|[i, j]| (i + 3 * j) % 4 == k as u32)
            .map(|[i, j]| {
                [0.2 + 0.4 * f64::from(i), 2.6 + 0.3 * f64::from(hash(20 * i + j)) / 255.0, 0.2 + 0.4 * f64::from(j)]
            })
            .collect();
        scene.place_many(&name, mesh, &places);
    }
    scene.finish()
}

/// A room with a normal-mapped brick wall, a floor of tiles of differing roughness, papered walls, and a screen that
/// shines.
pub fn textured_room() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [2.0, 1.3, 0.2],
        target: [1.9, 1.05, 4.0],
        yfov: 60.0_f64.to_radians(),
        aspect: 4.0 / 3.0,
    });
    let papers = Papers::paint(&mut scene);
    let size = [4.0, 2.5, 4.2];
    build_room(&mut scene, &papers, size);
    hang_lights(&mut scene, &papers, size);
    scene.mesh(
        "box",
        "wood",
        Surface::Glossy { color: [0.4, 0.22, 0.1], metallic: 0.0, roughness: 0.5 },
        &shapes::prism([[0.7, 2.5], [0.6, 3.3], [1.4, 3.4], [1.5, 2.6]], 0.6),
    );
    scene.sphere(
        "vase",
        "glaze",
        Surface::Glossy { color: [0.1, 0.25, 0.5], metallic: 0.0, roughness: 0.3 },
        [1.05, 0.85, 2.95],
        0.25,
    );
    scene.finish()
}

/// The textures of [`textured_room`].
struct Papers {
    bricks: usize,
    brick_relief: (usize, usize),
    tiles: usize,
    tile_relief: (usize, usize),
    paper: usize,
    picture: usize,
}

impl Papers {
    fn paint(scene: &mut Builder) -> Self {
        const SIDE: u32 = 128;
        let at = |x, y| brick([x, y], SIDE, 8);
        let bricks = scene.texture("bricks", SIDE, |x, y| match at(x, y) {
            (n, [0, 0]) => [130 + hash(n) / 4, 62 + hash(n + 7) / 8, 45],
            _ => [150, 145, 138],
        });
        let brick_roughness = scene.texture("brick roughness", SIDE, |x, y| match at(x, y) {
            (n, [0, 0]) => [255, 120 + hash(n + 3) / 4, 0],
            _ => [255, 240, 0],
        });
        let brick_relief = scene.texture("brick relief", SIDE, |x, y| {
            let (_, [du, dv]) = at(x, y);
            // Green points up, rows go down.
            normal([-0.7 * f64::from(du), 0.7 * f64::from(dv)])
        });
        let tile = |x: u32, y: u32| (x / 64 + y / 64).is_multiple_of(2);
        let tiles = scene.texture("tiles", SIDE, |x, y| if tile(x, y) { [200, 195, 185] } else { [60, 66, 72] });
        let tile_roughness = scene.texture("tile roughness", SIDE, |x, y| [255, if tile(x, y) { 90 } else { 190 }, 0]);
        let flat = scene.texture("no relief", 1, |_, _| [128, 128, 255]);
        let paper = scene.texture("paper", SIDE, |x, y| match (x / 16 % 2, (x + y) / 8 % 4) {
            (0, 0) => [150, 160, 120],
            (0, _) => [190, 196, 160],
            _ => [205, 200, 175],
        });
        let picture = scene.texture("picture", 16, |x, y| {
            let (dx, dy) = (2 * x as i32 - 15, 2 * y as i32 - 17);
            if dx * dx + dy * dy < 90 { [255, 190, 60] } else { [20, 60 + 6 * y as u8, 160] }
        });
        Self {
            bricks,
            brick_relief: (brick_roughness, brick_relief),
            tiles,
            tile_relief: (tile_roughness, flat),
            paper,
            picture,
        }
    }
}

fn build_room(scene: &mut Builder, papers: &Papers, [x, y, z]: V3) {
    scene.mesh(
        "floor",
        "tiles",
        Surface::Papered { color: papers.tiles, relief: Some(papers.tile_relief) },
        &papered_quad([[0., 0., 0.], [0., 0., z], [x, 0., z], [x, 0., 0.]], [3., 3.]),
    );
    scene.mesh(
        "back",
        "bricks",
        Surface::Papered { color: papers.bricks, relief: Some(papers.brick_relief) },
        &papered_quad([[x, 0., z], [0., 0., z], [0., y, z], [x, y, z]], [3., 2.]),
    );
    let papered = Surface::Papered { color: papers.paper, relief: None };
    scene.mesh(
        "right",
        "paper",
        papered,
        &papered_quad([[0., 0., z], [0., 0., 0.], [0., y, 0.], [0., y, z]], [4., 2.5]),
    );
    scene.mesh("left", "paper", papered, &papered_quad([[x, 0., 0.], [x, 0., z], [x, y, z], [x, y, 0.]], [4., 2.5]));
    let plaster = Surface::Diffuse([0.75; 3]);
    scene.mesh("ceiling", "plaster", plaster, &quad([[0., y, 0.], [x, y, 0.], [x, y, z], [0., y, z]]));
    scene.mesh("front", "plaster", plaster, &quad([[0., 0., 0.], [x, 0., 0.], [x, y, 0.], [0., y, 0.]]));
}

fn hang_lights(scene: &mut Builder, papers: &Papers, [x, y, _]: V3) {
    let lamp = facing_quad([2.0, y - 0.01, 1.8], [0., -1., 0.], 0.4);
    scene.mesh("lamp", "lamp", Surface::Emitter([9.0, 8.4, 7.4]), &lamp);
    let (sx, sy) = (x - 0.02, 1.3);
    let screen = papered_quad(
        [[sx, sy - 0.45, 2.2], [sx, sy - 0.45, 3.4], [sx, sy + 0.45, 3.4], [sx, sy + 0.45, 2.2]],
        [1., 1.],
    );
    scene.mesh("screen", "screen", Surface::Screen { image: papers.picture, radiance: 6.0 }, &screen);
}

/// Blocks and balls on open ground under a low sun; the sky is [`outdoor_sky`].
pub fn outdoor() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [5.5, 2.0, 7.5],
        target: [0.2, 0.7, 0.0],
        yfov: 34.0_f64.to_radians(),
        aspect: 4.0 / 3.0,
    });
    let ground = quad([[-9., 0., -9.], [-9., 0., 9.], [9., 0., 9.], [9., 0., -9.]]);
    scene.mesh("ground", "sand", Surface::Diffuse([0.42, 0.37, 0.28]), &ground);
    let mut wall = block([-3.2, 0., -2.4], [-0.4, 1.9, -1.8]);
    wall.add(block([0.6, 0., -2.4], [2.6, 1.9, -1.8]));
    wall.add(block([-0.4, 1.4, -2.4], [0.6, 1.9, -1.8]));
    scene.mesh("wall", "stone", Surface::Diffuse([0.55, 0.5, 0.46]), &wall);
    scene.sphere(
        "ball",
        "brass",
        Surface::Glossy { color: [0.9, 0.7, 0.35], metallic: 1.0, roughness: 0.35 },
        [-0.9, 0.7, 0.4],
        0.7,
    );
    scene.sphere(
        "other ball",
        "red plastic",
        Surface::Glossy { color: [0.6, 0.08, 0.06], metallic: 0.0, roughness: 0.3 },
        [1.3, 0.5, 0.9],
        0.5,
    );
    scene.mesh(
        "crate",
        "blue paint",
        Surface::Diffuse([0.1, 0.2, 0.45]),
        &shapes::prism([[1.5, -1.2], [1.9, -0.2], [2.9, -0.6], [2.5, -1.6]], 0.8),
    );
    scene.light("sun", Punctual::Sun, [9.0, 7.8, 5.8], [-5.0, 4.0, 3.0], [0.; 3]);
    scene.finish()
}

/// A sky brighter towards the horizon and around the sun of [`outdoor`], over dark ground.
pub fn outdoor_sky() -> Vec<u8> {
    sky(64, |u, v| {
        if v > 0.5 {
            return [0.12, 0.11, 0.09];
        }
        let height = 1.0 - 2.0 * v;
        let haze = (1.0 - height).powi(4);
        // Where the sun stands, at (−5, 4, 3); +x is in the middle of the map, and +z to its right.
        let (du, dv) = (u - 0.914, v - 0.309);
        let glow = 1.0 / (1.0 + 150.0 * (4.0 * du * du + dv * dv));
        [0.25 + 0.45 * haze + 1.6 * glow, 0.4 + 0.35 * haze + 1.2 * glow, 0.8 + 0.1 * haze + 0.7 * glow]
    })
}

/// Clear and frosted glass, rough and polished metal, under lamps without extent: path tracing cannot see their
/// caustics at all.
pub fn glass_and_metal() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [0.0, 2.2, 5.2],
        target: [0.0, 0.55, 0.0],
        yfov: 36.0_f64.to_radians(),
        aspect: 4.0 / 3.0,
    });
    let gray = Surface::Diffuse([0.5, 0.49, 0.47]);
    scene.mesh("table", "gray", gray, &quad([[-3., 0., -2.], [-3., 0., 3.], [3., 0., 3.], [3., 0., -2.]]));
    scene.mesh("back", "gray", gray, &quad([[-3., 0., -2.], [3., 0., -2.], [3., 3., -2.], [-3., 3., -2.]]));
    scene.sphere("clear", "glass", Surface::Glass(1.5), [-1.25, 0.5, 0.5], 0.5);
    scene.sphere("frosted", "frosted glass", Surface::Frosted { ior: 1.5, roughness: 0.4 }, [1.3, 0.45, 0.7], 0.45);
    scene.sphere(
        "brass",
        "brass",
        Surface::Glossy { color: [0.9, 0.7, 0.35], metallic: 1.0, roughness: 0.4 },
        [0.1, 0.55, -0.5],
        0.55,
    );
    let band = shapes::ring(0.5, 0.54, 0.3, 96);
    let band = Mesh { positions: band.positions.iter().map(|p| along(*p, [0.1, 0.0, 1.2], 1.0)).collect(), ..band };
    scene.mesh("band", "mirror", Surface::Mirror(0.9), &band);
    scene.light("bulb", Punctual::Point, [9.0, 8.0, 6.5], [-2.2, 2.4, 1.8], [0.; 3]);
    scene.light("spot", Punctual::Spot(0.25, 0.45), [30.0, 33.0, 40.0], [2.3, 2.8, 1.5], [0.3, 0.3, 0.4]);
    scene.finish()
}

/// Two wall lamps, the second the mirror image of the first: one mesh, placed twice, once with a negative scale.
pub fn mirrored_lamps() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [0.0, 1.4, 4.4],
        target: [0.0, 1.2, 0.0],
        yfov: 44.0_f64.to_radians(),
        aspect: 4.0 / 3.0,
    });
    let shell = block([-2.4, 0., -1.2], [2.4, 2.6, 4.6]).flipped();
    scene.mesh("room", "plaster", Surface::Diffuse([0.62, 0.6, 0.57]), &shell);
    // The lamp hangs at x = 0 and shines to +x, upwards and a little into the room, past a shade on its other side.
    let glass = facing_quad([0.; 3], unit([1.0, 0.6, 0.5]), 0.16);
    let shade = facing_quad(along([0.; 3], unit([1.0, 0.6, 0.5]), -0.03), unit([1.0, 0.6, 0.5]), 0.24);
    let lamp = scene.model(
        "lamp",
        &[
            ("bulb", Surface::Emitter([16.0, 13.0, 9.0]), &glass),
            ("shade", Surface::Diffuse([0.3, 0.12, 0.08]), &shade),
        ],
    );
    scene.place("left lamp", lamp, [-1.4, 1.5, -0.6], [1.0, 1.0, 1.0]);
    scene.place("right lamp", lamp, [1.4, 1.5, -0.6], [-1.0, 1.0, 1.0]);
    let base = [[-0.3, 0.2], [-0.2, 1.0], [0.6, 0.9], [0.5, 0.1]];
    scene.mesh("block", "stone", Surface::Diffuse([0.4, 0.42, 0.45]), &shapes::prism(base, 0.8));
    scene.finish()
}
