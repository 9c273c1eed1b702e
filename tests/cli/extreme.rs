//! Scenes that are legal and extreme: they are rendered, and to what they should be.

use std::fs;

use pathspace::film::Image;
use serde_json::{Value, json};

use crate::{Run, code, pixels, stderr};

/// A square [−1, 1]² that faces a camera two metres away, and whatever `nodes` are besides; mesh 0 is the triangles
/// with the corners `mesh`.
fn scene(run: &Run, mesh: &[[f32; 3]], places: &[[f32; 3]], nodes: &[Value], lights: &Value) -> &'static str {
    let bytes: Vec<u8> = mesh.iter().chain(places).flatten().flat_map(|c| c.to_le_bytes()).collect();
    let (cut, all) = (12 * mesh.len(), bytes.len());
    let mut views = vec![json!({ "buffer": 0, "byteLength": cut })];
    let mut accessors = vec![json!({ "bufferView": 0, "componentType": 5126, "count": mesh.len(), "type": "VEC3" })];
    if !places.is_empty() {
        views.push(json!({ "buffer": 0, "byteOffset": cut, "byteLength": all - cut }));
        accessors.push(json!({ "bufferView": 1, "componentType": 5126, "count": places.len(), "type": "VEC3" }));
    }
    let numbers: Vec<_> = (0..nodes.len()).collect();
    let document = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual", "EXT_mesh_gpu_instancing"],
        "extensions": { "KHR_lights_punctual": { "lights": lights } },
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.01, "aspectRatio": 1 } }],
        "scene": 0,
        "scenes": [{ "nodes": numbers }],
        "nodes": nodes,
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": all, "uri": "a.bin" }],
    });
    fs::write(run.path("a.bin"), bytes).unwrap();
    fs::write(run.path("a.gltf"), document.to_string()).unwrap();
    "a.gltf"
}

fn render(run: &Run, scene: &str, integrator: &str) -> Image {
    let small = ["render", scene, "--width", "16", "--height", "16", "--spp", "64", "-q", "-o", "a.exr"];
    let output = run.pathspace(&[&small[..], &["-i", integrator]].concat());
    assert_eq!((code(&output), stderr(&output).as_str()), (0, ""));
    pixels(&fs::read(run.path("a.exr")).unwrap())
}

fn camera() -> Value {
    json!({ "camera": 0, "translation": [0, 0, 2] })
}

/// Corner to corner: two triangles of the square with these corners, facing +z.
fn square(from: f32, to: f32) -> [[f32; 3]; 6] {
    [[from, from], [to, from], [to, to], [from, from], [to, to], [from, to]].map(|[x, y]| [x, y, 0.0])
}

#[test]
fn ten_thousand_lights_are_as_bright_as_two_of_their_power() {
    let run = Run::new();
    let lit = |count: usize| {
        let mut nodes = vec![camera(), json!({ "mesh": 0 })];
        nodes.extend((0..count).map(|i| {
            let place = if i % 2 == 0 { [0.5, 0.3, 0.7] } else { [-0.6, 0.0, 1.1] };
            json!({ "translation": place, "extensions": { "KHR_lights_punctual": { "light": 0 } } })
        }));
        let lights = json!([{ "type": "point", "intensity": 2.0 / count as f64 }]);
        let scene = scene(&run, &square(-1.0, 1.0), &[], &nodes, &lights);
        ["path", "light", "bdpt"].map(|integrator| render(&run, scene, integrator).mean())
    };
    // Light paths that miss the square leave a noise of 2 %.
    for (two, many) in lit(2).into_iter().zip(lit(10_000)) {
        assert!(two.min_element() > 0.01 && ((many - two) / two).abs().max_element() < 0.05, "{two} and {many}");
    }
}

/// Two million triangles, of instances that make a square together.
#[test]
fn millions_of_instanced_triangles_are_the_square_that_they_make() {
    const SIDE: u32 = 1024;
    let run = Run::new();
    let light = json!({ "translation": [0.2, 0.3, 1.0], "extensions": { "KHR_lights_punctual": { "light": 0 } } });
    let lights = json!([{ "type": "point" }]);
    let nodes = [camera(), json!({ "mesh": 0 }), light.clone()];
    let one = render(&run, scene(&run, &square(-1.0, 1.0), &[], &nodes, &lights), "path");
    let step = 2.0 / SIDE as f32;
    let place = |i: u32| [(i % SIDE) as f32 * step - 1.0, (i / SIDE) as f32 * step - 1.0, 0.0];
    let places: Vec<_> = (0..SIDE * SIDE).map(place).collect();
    let many =
        json!({ "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 1 } } } });
    let nodes = [camera(), many, light];
    let many = render(&run, scene(&run, &square(0.0, step), &places, &nodes, &lights), "path");
    assert!(one.mean().min_element() > 0.01);
    for (one, many) in one.pixels.iter().zip(&many.pixels) {
        assert!((*one - *many).abs().max_element() <= 1e-3 * one.max_element(), "{one} and {many}");
    }
}

/// Light does not leak into a closed box.
#[test]
fn a_camera_inside_a_closed_object_sees_nothing_of_the_light_outside() {
    let run = Run::new();
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 - 0.5);
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [a, c, b, a, d, c]);
    let mesh: Vec<_> = triangles.map(corner).collect();
    let light = json!({ "translation": [0.1, 0.2, 4], "extensions": { "KHR_lights_punctual": { "light": 0 } } });
    let nodes = [json!({ "camera": 0, "translation": [0.1, -0.2, 0.3] }), json!({ "mesh": 0 }), light];
    let scene = scene(&run, &mesh, &[], &nodes, &json!([{ "type": "point", "intensity": 1e6 }]));
    for integrator in ["path", "light", "bdpt"] {
        assert!(render(&run, scene, integrator).pixels.iter().all(|p| p.max_element() == 0.0), "{integrator}");
    }
}
