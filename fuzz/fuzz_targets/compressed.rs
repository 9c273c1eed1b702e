//! Any bytes as what a scene holds compressed, in a document that fits around them: read, or refused in one line. The
//! first three bytes choose what they are to be, how many elements there are, and how large these are.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use pathspace::io::{self, Limits, LoadOptions};

fuzz_target!(|bytes: &[u8]| {
    let Some((&[kind, count, size], data)) = bytes.split_first_chunk::<3>() else { return };
    let (count, size) = (3 * usize::from(count), 4 * (usize::from(size) % 64 + 1));
    let meshopt = |mode: &str, filter: &str, size: usize| views(data.len(), mode, filter, count, size);
    let json = match kind % 8 {
        0 => draco(data.len()),
        1 => image(data.len()),
        2 => meshopt("ATTRIBUTES", "NONE", size),
        3 => meshopt("ATTRIBUTES", "EXPONENTIAL", size),
        4 => meshopt(
            "ATTRIBUTES",
            if kind & 8 == 0 { "OCTAHEDRAL" } else { "COLOR" },
            if kind & 16 == 0 { 4 } else { 8 },
        ),
        5 => meshopt("ATTRIBUTES", "QUATERNION", 8),
        6 => meshopt("TRIANGLES", "NONE", if kind & 8 == 0 { 2 } else { 4 }),
        _ => meshopt("INDICES", "NONE", if kind & 8 == 0 { 2 } else { 4 }),
    };
    let limits = Limits {
        decoded_bytes: 1 << 22,
        texels: 1 << 16,
        vertices: 1 << 14,
        zeros: 1 << 12,
        triangles: 1 << 14,
        ..Limits::default()
    };
    match io::read(
        &glb(&json, data),
        Path::new("/nowhere"),
        "fuzzed",
        &LoadOptions { limits, ..LoadOptions::default() },
    ) {
        Ok(loaded) => assert!(loaded.warnings.iter().all(|warning| !warning.contains(char::is_control))),
        Err(error) => assert!(!error.to_string().contains(char::is_control), "{error}"),
    }
});

/// A primitive with attributes of every type.
fn draco(length: usize) -> String {
    let accessor = |component, kind| format!(r#"{{"componentType":{component},"count":9,"type":"{kind}"}}"#);
    let accessors = [(5126, "VEC3"), (5126, "VEC3"), (5126, "VEC2"), (5121, "VEC4"), (5123, "VEC4")];
    let accessors = accessors.map(|(component, kind)| accessor(component, kind)).join(",");
    let names = r#""POSITION":0,"NORMAL":1,"TEXCOORD_0":2,"COLOR_0":3,"JOINTS_0":4"#;
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"buffers":[{{"byteLength":{length}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],"accessors":[{accessors}],
        "meshes":[{{"primitives":[{{"attributes":{{{names}}},
            "extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":{{{names}}}}}}}}}]}}]}}"#
    )
}

fn image(length: usize) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{length}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],"images":[{{"bufferView":0,"mimeType":"image/ktx2"}}],
        "textures":[{{"extensions":{{"KHR_texture_basisu":{{"source":0}}}}}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}]}}"#
    )
}

/// A compressed buffer view, its elements as long as they say.
fn views(length: usize, mode: &str, filter: &str, count: usize, size: usize) -> String {
    let bytes = count * size;
    format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{length}}},{{"byteLength":{bytes}}}],
        "bufferViews":[{{"buffer":1,"byteLength":{bytes},"extensions":{{"KHR_meshopt_compression":{{"buffer":0,
            "byteLength":{length},"byteStride":{size},"count":{count},"mode":"{mode}","filter":"{filter}"}}}}}}]}}"#
    )
}

fn glb(json: &str, data: &[u8]) -> Vec<u8> {
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", data)] {
        let padded = chunk.len().next_multiple_of(4);
        out.extend((padded as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
        out.resize(out.len() + padded - chunk.len(), b' ');
    }
    let length = (out.len() as u32).to_le_bytes();
    out[8..12].copy_from_slice(&length);
    out
}
