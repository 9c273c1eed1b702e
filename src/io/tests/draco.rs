//! Draco meshes: streams of Google's encoder, and what is wrong with a document that has one.

use sha2::{Digest as _, Sha256};

use super::*;
use crate::io::{Limits, buffer::Buffers, draco::Decoded};

/// One torus by Google's encoder (npm's draco3dgltf 1.5.7), and the hashes of what its decoder makes of each stream.
fn vectors() -> Vec<Value> {
    serde_json::from_str(include_str!("draco.json")).unwrap()
}

/// A document that shows the torus of a stream.
fn torus(vector: &Value) -> Value {
    let bytes = STANDARD.decode(vector["encoded"].as_str().unwrap()).unwrap();
    let accessor = |component: u32, kind: &str| json!({ "componentType": component, "count": 117, "type": kind });
    let source = json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": vector["attributes"] } });
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_draco_mesh_compression"],
        "extensionsRequired": ["KHR_draco_mesh_compression"],
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 1, "NORMAL": 2, "TEXCOORD_0": 3, "COLOR_0": 4, "JOINTS_0": 5 },
            "indices": 0,
            "extensions": source,
        }] }],
        "accessors": [
            { "componentType": 5123, "count": 576, "type": "SCALAR" },
            accessor(5126, "VEC3"),
            accessor(5126, "VEC3"),
            accessor(5126, "VEC2"),
            { "componentType": 5121, "count": 117, "type": "VEC4", "normalized": true },
            accessor(5123, "VEC4"),
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:;base64,{}", STANDARD.encode(bytes)) }],
    })
}

fn read(document: &Value, limits: Limits) -> Result<Buffers, String> {
    let text = document.to_string();
    let root = document::parse(text.as_bytes(), Policy::default(), "x", &mut Vec::new()).unwrap();
    let place = Place { folder: Path::new("."), limits, outside: LoadOptions::default().outside };
    let checked = accessor::check(&root, &limits).and_then(|()| buffer::read(&root, None, place, &mut Hash::new()));
    checked.map_err(|fault| fault.at("x.gltf").to_string())
}

#[test]
fn streams_of_googles_encoder_are_what_its_decoder_makes_of_them() {
    for vector in vectors() {
        let name = &vector["name"];
        let document = torus(&vector);
        let buffers = read(&document, Limits::default()).unwrap();
        let Decoded { corners, attributes } = &buffers.primitives[&(0, 0)];
        let same = |what: &str, bytes: &[u8]| {
            let hash: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!(vector[what], json!(hash), "{name}: {what}");
        };
        same("indices", &corners.iter().flat_map(|corner| corner.to_le_bytes()).collect::<Vec<_>>());
        for (semantic, accessor) in document["meshes"][0]["primitives"][0]["attributes"].as_object().unwrap() {
            same(semantic, &attributes[&(accessor.as_u64().unwrap() as usize)].bytes);
        }
        let loaded = load(&document).unwrap();
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        assert_eq!(loaded.geometry.triangle_count(), 192, "{name}");
        let bounds = loaded.geometry.bounds().unwrap();
        let off = (bounds.max - Vec3::new(1.3, 1.3, 0.3)).abs().max((bounds.min + Vec3::new(1.3, 1.3, 0.3)).abs());
        assert!(off.max_element() < 2.6 / 4095.0, "{name}: {bounds:?}, within the quantisation");
    }
}

#[test]
fn numbers_go_into_accessors_of_other_types_where_they_fit() {
    let mut document = torus(&vectors()[0]);
    document["accessors"][4]["componentType"] = json!(5123);
    let buffers = read(&document, Limits::default()).unwrap();
    let colors = &buffers.primitives[&(0, 0)].attributes[&4];
    assert_eq!((colors.bytes.len(), colors.count), (117 * 8, 117));
    document["accessors"][4]["componentType"] = json!(5126);
    assert!(read(&document, Limits::default()).is_ok());
    document["accessors"][1]["componentType"] = json!(5121);
    let error = read(&document, Limits::default()).map(|_| ()).unwrap_err();
    assert!(error.contains("attributes/POSITION: the value at vertex"), "{error}");
}

#[test]
fn a_draco_mesh_is_what_it_is_whatever_else_is_announced() {
    let mut document = torus(&vectors()[2]);
    // Other counts, another order of corners, and no indices.
    document["accessors"][1]["count"] = json!(7);
    document["meshes"][0]["primitives"][0]["mode"] = json!(5);
    document["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    let loaded = load(&document).unwrap();
    assert_eq!(loaded.geometry.triangle_count(), 192);
    assert!(loaded.warnings[0].contains("117 compressed vertices, and not 7"), "{:?}", loaded.warnings);
}

#[test]
fn what_is_wrong_with_a_draco_primitive_is_said() {
    let draco = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    let cases = [
        (format!("{draco}/bufferView"), json!(3), format!("{draco}/bufferView: this is no index of a buffer view")),
        (format!("{draco}/attributes/NORMAL"), json!(9), format!("{draco}/attributes/NORMAL: the Draco mesh has no")),
        (format!("{draco}/attributes/NORMAL"), json!("x"), format!("{draco}/attributes/NORMAL: the Draco mesh has no")),
        (
            format!("{draco}/attributes/NORMAL"),
            json!(2),
            "2 numbers a vertex here, and the accessor /accessors/2".into(),
        ),
        ("/bufferViews/0/byteLength".to_owned(), json!(300), format!("{draco}: the Draco mesh cannot be decompressed")),
        ("/bufferViews/0/byteLength".to_owned(), json!(0), format!("{draco}: the Draco mesh cannot be decompressed")),
    ];
    for (pointer, value, sentence) in cases {
        let error = read(&changed(torus(&vectors()[0]), &pointer, value), Limits::default()).map(|_| ()).unwrap_err();
        assert!(error.contains(&sentence), "{error}");
    }
}

#[test]
fn what_a_draco_mesh_takes_is_limited() {
    let document = torus(&vectors()[0]);
    let few = Limits { zeros: 0, triangles: 191, ..Limits::default() };
    let small = Limits { decoded_bytes: 1000, ..Limits::default() };
    for limits in [few, small] {
        let error = read(&document, limits).map(|_| ()).unwrap_err();
        assert!(error.contains("announces more") && error.contains("--limit decoded-bytes=N"), "{error}");
    }
    // What another primitive would read as zeros is no more than zeros may be.
    let mut document = torus(&vectors()[0]);
    document["accessors"][1]["count"] = json!(1 << 24);
    let plain = json!({ "attributes": { "POSITION": 1 } });
    document["meshes"][0]["primitives"].as_array_mut().unwrap().push(plain);
    let error = load(&document).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("/accessors/1/count: 16777216 elements have no data"), "{error}");
}

#[test]
fn streams_that_are_cut_or_changed_are_refused_or_read() {
    for vector in vectors() {
        let bytes = STANDARD.decode(vector["encoded"].as_str().unwrap()).unwrap();
        let try_to = |bytes: &[u8]| {
            let mut document = torus(&vector);
            document["buffers"][0]["uri"] = json!(format!("data:;base64,{}", STANDARD.encode(bytes)));
            document["buffers"][0]["byteLength"] = json!(bytes.len());
            document["bufferViews"][0]["byteLength"] = json!(bytes.len());
            read(&document, Limits { zeros: 1 << 12, ..Limits::default() }).map(|_| ())
        };
        (0..bytes.len()).step_by(29).for_each(|cut| assert!(try_to(&bytes[..cut]).is_err(), "{cut} bytes"));
        for i in (0..bytes.len()).step_by(7) {
            let mut bytes = bytes.clone();
            bytes[i] ^= [0x01, 0x80, 0xff][i % 3];
            let _ = try_to(&bytes);
        }
    }
}
