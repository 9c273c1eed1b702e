//! Tiny documents made by hand: what is read, and the sentence for each way in which a document can be wrong.

mod animation;
mod corpus;
mod draco;
mod drafts;
mod environment;
mod errors;
mod factors;
mod far;
mod features;
mod ies;
mod image_light;
mod instancing;
mod ktx2;
mod layers;
mod pose;
mod reading;
mod textures;
mod variants;

use std::path::Path;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use glam::{DAffine3, DMat4, DVec3, Vec3};
use serde_json::{Value, json};

use super::{
    Loaded,
    accessor::{self, Accessors},
    buffer::{self, Hash},
    document,
    error::LoadError,
    image::Images,
    limits::{LoadOptions, Place, Policy, Required},
    material, mesh, part,
    placed::Placed,
};

/// A triangle in the xy plane that faces +z, on one node, with its positions, normals and indices in one buffer.
fn triangle() -> Value {
    let positions: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., 0.];
    let normals: [f32; 9] = [0., 0., 1., 0., 0., 1., 0., 0., 1.];
    let mut bytes: Vec<u8> = positions.iter().chain(&normals).flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0, 1, 2, 0]);
    document(&bytes)
}

/// The document of [`triangle`] over other bytes.
fn document(bytes: &[u8]) -> Value {
    let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(bytes));
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5121, "count": 3, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 72, "byteLength": 4 },
        ],
        "buffers": [{ "byteLength": bytes.len(), "uri": uri }],
    })
}

/// [`triangle`] with the value at a JSON pointer replaced or, in an object, added.
fn with(pointer: &str, value: Value) -> Value {
    changed(triangle(), pointer, value)
}

fn changed(mut document: Value, pointer: &str, value: Value) -> Value {
    let (parent, member) = pointer.rsplit_once('/').unwrap();
    match document.pointer_mut(parent).unwrap() {
        Value::Array(array) => array[member.parse::<usize>().unwrap()] = value,
        object => object[member] = value,
    }
    document
}

fn load(document: &Value) -> Result<Loaded, LoadError> {
    load_as(document, &LoadOptions::default())
}

fn load_as(document: &Value, options: &LoadOptions<'_>) -> Result<Loaded, LoadError> {
    super::read(document.to_string().as_bytes(), Path::new("."), "x.gltf", options)
}

/// The document's first mesh, in world space by the first node.
fn world(document: &Value) -> part::World {
    let LoadOptions { limits, outside, drafts, .. } = LoadOptions::default();
    let mut warnings = Vec::new();
    let root = document::parse(document.to_string().as_bytes(), Policy::default(), "x", &mut warnings).unwrap();
    let place = Place { folder: Path::new("."), limits, outside };
    accessor::check(&root, &limits).unwrap();
    let buffers = buffer::read(&root, None, place, &mut Hash::new()).unwrap();
    let mut hash = Hash::new();
    let images = Images::new(&root, &buffers, place, &mut hash);
    let materials = material::all(&root, images, drafts, &mut warnings).unwrap();
    let parts = mesh::read(&root, Accessors::new(&root, &buffers), &materials, 0, &[], &mut warnings).unwrap();
    let nodes = super::node::hierarchy(&root, &[], limits.depth, &mut warnings).unwrap();
    part::place(&parts[0], nodes.last().unwrap()).unwrap()
}

/// N_g of the first triangle.
fn facing(world: &part::World) -> Vec3 {
    let [a, b, c] = world.triangles[0].map(|i| world.positions[i as usize]);
    (b - a).cross(c - a).normalize()
}

fn placed(matrix: DMat4) -> Placed {
    Placed { index: 0, to_world: DAffine3::from_mat4(matrix), visible: true }
}

fn glb(json: &str, bin: Option<&[u8]>) -> Vec<u8> {
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, chunk) in [(b"JSON", Some(json.as_bytes())), (b"BIN\0", bin)] {
        let Some(chunk) = chunk else { continue };
        let padded = chunk.len().next_multiple_of(4);
        out.extend((padded as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
        out.extend(std::iter::repeat_n(b' ', padded - chunk.len()));
    }
    let length = out.len() as u32;
    out[8..12].copy_from_slice(&length.to_le_bytes());
    out
}
