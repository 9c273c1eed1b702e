//! Writes the scenes in `scenes/`: `cargo run --release --example make_scenes [FOLDER]`.
//!
//! The same program always writes the same bytes; a test holds the committed files to it. Units and the Cornell box's
//! dimensions: decimetres of the original measurements, y up, the camera looking along +z, so that +x is on the left.

#[path = "make_scenes/caustics.rs"]
mod caustics;
#[path = "make_scenes/glb.rs"]
mod glb;
#[path = "make_scenes/images.rs"]
mod images;
#[path = "make_scenes/lights.rs"]
mod lights;
#[path = "make_scenes/shapes.rs"]
mod shapes;

use std::{env, f64::consts::FRAC_PI_2, fs, io, path::Path};

use glb::{Builder, Camera, Surface};
use shapes::{Mesh, block, facing_quad, frustum, prism, quad, ring};

/// The measured reflectances of the Cornell box as linear RGB, and its light.
const WHITE: Surface = Surface::Diffuse([0.725, 0.71, 0.68]);
const RED: Surface = Surface::Diffuse([0.63, 0.065, 0.05]);
const GREEN: Surface = Surface::Diffuse([0.14, 0.45, 0.091]);
const LAMP: Surface = Surface::Emitter([17.0, 12.0, 4.0]);

/// Width, height and depth of the Cornell box.
const BOX: [f64; 3] = [5.528, 5.488, 5.592];

fn main() -> io::Result<()> {
    let folder = env::args_os().nth(1).unwrap_or_else(|| concat!(env!("CARGO_MANIFEST_DIR"), "/scenes").into());
    for (name, bytes) in scenes() {
        fs::write(Path::new(&folder).join(name), bytes)?;
    }
    Ok(())
}

fn scenes() -> [(&'static str, Vec<u8>); 19] {
    [
        ("cornell-box.glb", cornell_box()),
        ("cornell-spheres.glb", cornell_spheres()),
        ("veach-room.glb", veach_room()),
        ("caustic-ring.glb", caustic_ring()),
        ("caustic-sphere.glb", caustic_sphere()),
        ("furnace.glb", furnace()),
        ("mis-plates.glb", lights::mis_plates()),
        ("many-lights.glb", lights::many_lights()),
        ("textured-room.glb", lights::textured_room()),
        ("outdoor.glb", lights::outdoor()),
        ("outdoor-sky.hdr", lights::outdoor_sky()),
        ("glass-and-metal.glb", lights::glass_and_metal()),
        ("mirrored-lamps.glb", lights::mirrored_lamps()),
        ("pool.glb", caustics::pool()),
        ("bulb.glb", caustics::bulb()),
        ("glass-of-water.glb", caustics::glass_of_water()),
        ("door-ajar.glb", caustics::door_ajar()),
        ("gem.glb", caustics::gem()),
        ("prism.glb", caustics::spectrum()),
    ]
}

/// The five walls, open towards the camera, which stands where the photograph was taken from.
fn cornell() -> Builder {
    let [x, y, z] = BOX;
    let mut scene = Builder::new(Camera {
        position: [2.78, 2.73, -8.0],
        target: [2.78, 2.73, 0.0],
        yfov: 39.3077_f64.to_radians(),
        aspect: 1.0,
    });
    scene.mesh("floor", "white", WHITE, &quad([[0., 0., 0.], [0., 0., z], [x, 0., z], [x, 0., 0.]]));
    scene.mesh("ceiling", "white", WHITE, &quad([[0., y, 0.], [x, y, 0.], [x, y, z], [0., y, z]]));
    scene.mesh("back", "white", WHITE, &quad([[0., 0., z], [0., y, z], [x, y, z], [x, 0., z]]));
    scene.mesh("right", "green", GREEN, &quad([[0., 0., 0.], [0., y, 0.], [0., y, z], [0., 0., z]]));
    scene.mesh("left", "red", RED, &quad([[x, 0., 0.], [x, 0., z], [x, y, z], [x, y, 0.]]));
    scene
}

/// A rectangle that looks down, just below the ceiling of the Cornell box.
fn ceiling_light(x: [f64; 2], z: [f64; 2]) -> Mesh {
    let y = BOX[1] - 0.002;
    quad([[x[0], y, z[0]], [x[1], y, z[0]], [x[1], y, z[1]], [x[0], y, z[1]]])
}

fn cornell_box() -> Vec<u8> {
    let mut scene = cornell();
    scene.mesh("light", "light", LAMP, &ceiling_light([2.13, 3.43], [2.27, 3.32]));
    let short = [[1.30, 0.65], [0.82, 2.25], [2.40, 2.72], [2.90, 1.14]];
    #[allow(clippy::approx_constant)] // 3.14 is a coordinate of the original
    let tall = [[4.23, 2.47], [2.65, 2.96], [3.14, 4.56], [4.72, 4.06]];
    scene.mesh("short block", "white", WHITE, &prism(short, 1.65));
    scene.mesh("tall block", "white", WHITE, &prism(tall, 3.30));
    scene.finish()
}

/// Jensen's variant: a mirror ball behind on the left, a glass ball in front on the right.
fn cornell_spheres() -> Vec<u8> {
    let mut scene = cornell();
    scene.mesh("light", "light", Surface::Emitter([18.4, 15.6, 11.0]), &ceiling_light([2.13, 3.43], [2.27, 3.32]));
    scene.sphere("mirror ball", "mirror", Surface::Mirror(0.95), [3.95, 1.02, 3.80], 1.02);
    scene.sphere("glass ball", "glass", Surface::Glass(1.5), [1.62, 1.02, 2.05], 1.02);
    scene.finish()
}

/// After the room of Veach's chapter 10: all light is indirect except what passes the glass ball on the table.
fn veach_room() -> Vec<u8> {
    const WALL: Surface = Surface::Diffuse([0.70, 0.68, 0.64]);
    const WOOD: Surface = Surface::Diffuse([0.42, 0.27, 0.15]);
    const SHADE: Surface = Surface::Diffuse([0.25, 0.25, 0.26]);
    let [x, y, z] = [6.0, 3.2, 5.6];
    let mut scene = Builder::new(Camera {
        position: [2.9, 1.75, 0.15],
        target: [3.0, 1.15, 3.6],
        yfov: 56.0_f64.to_radians(),
        aspect: 4.0 / 3.0,
    });
    let walls = [
        [[0., y, 0.], [x, y, 0.], [x, y, z], [0., y, z]],
        [[0., 0., z], [0., y, z], [x, y, z], [x, 0., z]],
        [[0., 0., 0.], [x, 0., 0.], [x, y, 0.], [0., y, 0.]],
        [[0., 0., 0.], [0., y, 0.], [0., y, z], [0., 0., z]],
        [[x, 0., 0.], [x, 0., z], [x, y, z], [x, y, 0.]],
    ];
    scene.mesh("walls", "wall", WALL, &walls.map(quad).into_iter().collect());
    let floor = quad([[0., 0., 0.], [0., 0., z], [x, 0., z], [x, 0., 0.]]);
    scene.mesh("floor", "floor", Surface::Diffuse([0.32, 0.30, 0.28]), &floor);

    // A table with a glass ball.
    let mut table = block([2.1, 0.72, 2.5], [4.1, 0.80, 3.7]);
    for (lx, lz) in [(2.18, 2.58), (3.94, 2.58), (2.18, 3.54), (3.94, 3.54)] {
        table.add(block([lx, 0.0, lz], [lx + 0.08, 0.72, lz + 0.08]));
    }
    scene.mesh("table", "wood", WOOD, &table);
    scene.sphere("glass ball", "glass", Surface::Glass(1.5), [2.75, 1.07, 2.95], 0.26);
    scene.mesh("book", "book", Surface::Diffuse([0.12, 0.18, 0.40]), &block([3.45, 0.80, 2.85], [3.85, 0.87, 3.40]));

    // A floor lamp on the left: an open shade that lets light out towards the ceiling only.
    let (lx, lz) = (4.9, 4.6);
    let mut lamp = block([lx - 0.18, 0.0, lz - 0.18], [lx + 0.18, 0.05, lz + 0.18]);
    lamp.add(block([lx - 0.02, 0.05, lz - 0.02], [lx + 0.02, 1.75, lz + 0.02]));
    lamp.add(frustum([lx, 1.75, lz], [0., 1., 0.], 0.12, 0.24, 0.30, 24));
    scene.mesh("floor lamp", "shade", SHADE, &lamp);
    let bulb = facing_quad([lx, 1.80, lz], [0., 1., 0.], 0.07);
    scene.mesh("floor lamp light", "warm light", Surface::Emitter([520.0, 400.0, 250.0]), &bulb);

    // A shaded spot beside and above the camera that points at the ball: seen only in it.
    let (from, to) = ([0.9, 2.7, 0.5], [2.75, 1.0, 2.95]);
    let axis = shapes::unit(shapes::sub(to, from));
    scene.mesh("spot shade", "shade", SHADE, &frustum(from, axis, 0.14, 0.17, 0.56, 24));
    let bulb = facing_quad(shapes::along(from, axis, 0.03), axis, 0.1);
    scene.mesh("spot light", "cool light", Surface::Emitter([160.0, 154.0, 144.0]), &bulb);
    scene.finish()
}

/// A mirror band on a floor: the light that it gathers inside is the nephroid caustic of a coffee cup.
fn caustic_ring() -> Vec<u8> {
    let mut scene = Builder::new(Camera {
        position: [0.0, 3.4, -4.2],
        target: [0.0, 0.0, 0.0],
        yfov: 38.0_f64.to_radians(),
        aspect: 1.0,
    });
    let floor = quad([[-6., 0., -6.], [-6., 0., 6.], [6., 0., 6.], [6., 0., -6.]]);
    scene.mesh("floor", "gray", Surface::Diffuse([0.5; 3]), &floor);
    scene.mesh("ring", "mirror", Surface::Mirror(1.0), &ring(0.95, 1.0, 0.5, 512));
    let from = [2.2, 2.8, 0.8];
    let light = facing_quad(from, shapes::unit(shapes::sub([0.; 3], from)), 0.1);
    scene.mesh("light", "light", Surface::Emitter([600.0; 3]), &light);
    // A soft fill out of view, so that the shadows are not black.
    let fill = facing_quad([0.0, 6.0, 0.0], [0., -1., 0.], 1.5);
    scene.mesh("fill", "fill", Surface::Emitter([3.0; 3]), &fill);
    scene.finish()
}

fn caustic_sphere() -> Vec<u8> {
    let mut scene = cornell();
    let (x, z) = (BOX[0] / 2.0, BOX[2] / 2.0);
    let light = ceiling_light([x - 0.45, x + 0.45], [z - 0.45, z + 0.45]);
    scene.mesh("light", "light", Surface::Emitter([28.7, 22.5, 11.4]), &light);
    scene.sphere("glass ball", "glass", Surface::Glass(1.5), [2.764, 1.5, 2.6], 1.0);
    scene.finish()
}

/// A closed box whose walls emit 1 and reflect half: with every bounce counted, the radiance is 2 everywhere.
fn furnace() -> Vec<u8> {
    let mut scene =
        Builder::new(Camera { position: [0.3, -0.2, -0.6], target: [-0.2, 0.1, 1.0], yfov: FRAC_PI_2, aspect: 1.0 });
    let walls = block([-1.0; 3], [1.0; 3]).flipped();
    scene.mesh("walls", "wall", Surface::Glowing { albedo: 0.5, radiance: 1.0 }, &walls);
    scene.finish()
}

#[test]
fn the_committed_scenes_are_what_this_program_writes() {
    for (name, bytes) in scenes() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
        let committed = fs::read(&path).unwrap_or_default();
        assert!(committed == bytes, "{name} is not up to date: cargo run --release --example make_scenes");
    }
}
