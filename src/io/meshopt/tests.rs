//! Streams that meshoptimizer wrote, documents that are compressed here, and what is wrong with either.

use std::path::Path;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

use super::{Compressed, Mode, filters::Filter};
use crate::io::{self, Limits, LoadOptions, error::Fault};

/// Streams of meshoptimizer 1.3 (its npm package) with what its own decoder makes of them: the bytes where there is a
/// filter, whose last bit is open, else their hash.
fn vectors() -> Vec<(Compressed, Vec<u8>, Value)> {
    let vectors: Vec<Value> = serde_json::from_str(include_str!("vectors.json")).unwrap();
    let read = |vector: Value| {
        let text = |member: &str| vector[member].as_str().unwrap().to_owned();
        let bytes = STANDARD.decode(text("encoded")).unwrap();
        let compressed = Compressed {
            at: text("name"),
            buffer: 0,
            start: 0,
            length: bytes.len(),
            count: vector["count"].as_u64().unwrap() as usize,
            stride: vector["stride"].as_u64().unwrap() as usize,
            mode: match text("mode").as_str() {
                "ATTRIBUTES" => Mode::Attributes,
                "TRIANGLES" => Mode::Triangles,
                _ => Mode::Indices,
            },
            filter: match text("filter").as_str() {
                "OCTAHEDRAL" => Some(Filter::Octahedral),
                "QUATERNION" => Some(Filter::Quaternion),
                "EXPONENTIAL" => Some(Filter::Exponential),
                "COLOR" => Some(Filter::Color),
                _ => None,
            },
        };
        (compressed, bytes, vector)
    };
    vectors.into_iter().map(read).collect()
}

#[test]
fn streams_of_meshoptimizer_are_what_its_decoder_makes_of_them() {
    for (compressed, bytes, vector) in vectors() {
        let decoded = compressed.decode(&bytes).unwrap_or_else(|fault| panic!("{fault:?}"));
        let name = &compressed.at;
        assert_eq!(decoded.len() as u64, compressed.bytes(), "{name}");
        let Some(want) = vector["decoded"].as_str() else {
            let hash: String = Sha256::digest(&decoded).iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!(vector["sha256"], json!(hash), "{name}");
            continue;
        };
        let want = STANDARD.decode(want).unwrap();
        // “One unit in the last place”; what fills a number that is no multiple of 8 bits does not matter here.
        let off = |a: i64, b: i64| assert!((a - b).abs() <= 1, "{name}: {a} is not {b}");
        match (compressed.filter.unwrap(), compressed.stride) {
            (Filter::Exponential, _) => assert_eq!(decoded, want, "{name}"),
            (_, 4) => decoded.iter().zip(&want).for_each(|(a, b)| off((*a).into(), (*b).into())),
            _ => {
                let numbers = |bytes: &[u8]| bytes.as_chunks::<2>().0.iter().map(|b| i16::from_le_bytes(*b)).collect();
                let (have, want): (Vec<i16>, Vec<i16>) = (numbers(&decoded), numbers(&want));
                have.iter().zip(&want).for_each(|(a, b)| off((*a).into(), (*b).into()));
            }
        }
    }
}

#[test]
fn streams_that_are_cut_or_changed_are_refused_or_read() {
    for (compressed, bytes, _) in vectors() {
        for cut in 0..bytes.len() {
            let at = Compressed { length: cut, at: String::new(), ..compressed };
            assert!(at.decode(&bytes).is_err(), "{} cut to {cut} bytes", compressed.at);
        }
        for i in (0..bytes.len()).step_by(3) {
            for change in [0x01, 0x80, 0xff] {
                let mut bytes = bytes.clone();
                bytes[i] ^= change;
                if let Ok(decoded) = compressed.decode(&bytes) {
                    assert_eq!(decoded.len() as u64, compressed.bytes());
                }
            }
        }
    }
}

/// Elements as a stream of version 0 that stores every difference in full.
fn encode(bytes: &[u8], stride: usize) -> Vec<u8> {
    let zigzag = |delta: u8| (delta << 1) ^ (delta >> 7).wrapping_neg();
    let mut out = vec![0xa0];
    let elements: Vec<&[u8]> = bytes.chunks(stride).collect();
    assert!(elements.len() <= 16, "one group");
    for byte in 0..stride {
        out.push(3);
        let at = |i: usize| elements.get(i).map_or(0, |element| element[byte]);
        out.extend((0..16).map(|i| zigzag(at(i).wrapping_sub(if i == 0 { 0 } else { at(i - 1) }))));
    }
    out.resize(out.len() + stride.max(32), 0);
    out
}

/// A triangle whose positions and indices are compressed by the extension `name`, without a fallback.
fn document(name: &str) -> Value {
    let positions: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., 0.];
    let positions = encode(&positions.map(f32::to_le_bytes).concat(), 12);
    // One triangle of three new vertices.
    let indices = [&[0xe1, 0xf0][..], &[0; 16]].concat();
    let (first, second) = (positions.len(), indices.len());
    let uri = format!("data:;base64,{}", STANDARD.encode([positions, indices].concat()));
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": [name],
        "extensionsRequired": [name],
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 1, "byteLength": 36, "byteStride": 12, "extensions": { name: {
                "buffer": 0, "byteLength": first, "byteStride": 12, "mode": "ATTRIBUTES", "count": 3,
            } } },
            { "buffer": 1, "byteOffset": 36, "byteLength": 6, "extensions": { name: {
                "buffer": 0, "byteOffset": first, "byteLength": second, "byteStride": 2, "mode": "TRIANGLES",
                "count": 3,
            } } },
        ],
        "buffers": [{ "byteLength": first + second, "uri": uri }, { "byteLength": 42 }],
    })
}

fn load(document: &Value, limits: Limits) -> Result<io::Loaded, String> {
    let options = LoadOptions { limits, ..LoadOptions::default() };
    io::read(document.to_string().as_bytes(), Path::new("."), "x.gltf", &options).map_err(|error| error.to_string())
}

#[test]
fn a_compressed_triangle_is_the_plain_one() {
    for name in super::NAMES {
        let mut document = document(name);
        for fallback in [json!({ "byteLength": 42 }), json!({ "byteLength": 42, "uri": "is-not-there.bin" })] {
            document["buffers"][1] = fallback;
            let loaded = load(&document, Limits::default()).unwrap();
            assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
            assert_eq!(loaded.geometry.triangle_count(), 1);
            let bounds = loaded.geometry.bounds().unwrap();
            assert_eq!((bounds.min.to_array(), bounds.max.to_array()), ([0.0; 3], [1.0, 1.0, 0.0]));
        }
    }
}

#[test]
fn what_is_wrong_with_a_compressed_view_is_said() {
    let name = super::NAMES[0];
    let view = format!("/bufferViews/0/extensions/{name}");
    let other = format!("/bufferViews/1/extensions/{name}");
    let cases = [
        (format!("{view}/buffer"), json!(7), format!("{view}/buffer: there is no buffer 7")),
        (format!("{view}/buffer"), json!(1), format!("{view}/byteLength: the bytes reach beyond the 42")),
        ("/buffers/1/byteLength".to_owned(), json!(40), "the view reaches beyond the 40 bytes of buffer 1".to_owned()),
        ("/buffers/0/uri".to_owned(), json!(null), "/buffers/0: the buffer has no URI".to_owned()),
        (format!("{view}/byteLength"), json!(100_000), format!("{view}/byteLength: the bytes reach beyond the")),
        (format!("{view}/byteLength"), json!(60), format!("{view}: the compressed data are damaged at their byte")),
        (format!("{view}/byteOffset"), json!(-1), format!("{view}/byteOffset: this is no whole number")),
        (format!("{view}/byteStride"), json!(6), format!("{view}/byteStride: elements of 6 bytes do not exist")),
        (format!("{view}/mode"), json!("POINTS"), format!("{view}/mode: the mode “POINTS” does not exist")),
        (format!("{view}/filter"), json!("SHARP"), format!("{view}/filter: the filter “SHARP” does not exist")),
        (format!("{view}/filter"), json!("OCTAHEDRAL"), format!("{view}/filter: the filter is not for elements of 12")),
        (format!("{view}/filter"), json!(3), format!("{view}/filter: this is no text")),
        (format!("{view}/count"), json!(4), format!("{view}/count: 4 elements of 12 bytes are not the view's 36")),
        (format!("{view}/count"), json!(1_u64 << 40), format!("{view}/count: 1099511627776 elements are announced")),
        (format!("{other}/count"), json!(4), format!("{other}/count: 4 corners make no whole triangles")),
        (format!("{other}/filter"), json!("COLOR"), format!("{other}/filter: the filter is not for")),
        (
            format!("{other}/mode"),
            json!("INDICES"),
            format!("{other}: the compressed data are damaged at their byte 0"),
        ),
        ("/bufferViews/0/extensions/EXT_meshopt_compression".to_owned(), json!({}), "by two extensions".to_owned()),
    ];
    for (pointer, value, sentence) in cases {
        let mut document = document(name);
        let (parent, member) = pointer.rsplit_once('/').unwrap();
        document.pointer_mut(parent).unwrap()[member] = value;
        let error = load(&document, Limits::default()).map(|_| ()).expect_err(&pointer);
        assert!(error.contains(&sentence), "{error}");
    }
}

#[test]
fn what_is_decompressed_is_limited() {
    let limits = |decoded_bytes| Limits { decoded_bytes, ..Limits::default() };
    let document = document(super::NAMES[1]);
    assert!(load(&document, limits(42)).is_ok());
    let error = load(&document, limits(41)).map(|_| ()).expect_err("42 bytes");
    assert!(error.contains("/bufferViews/1: decompressed, the views up to this one have 42 bytes"), "{error}");
    assert!(error.contains("--limit decoded-bytes=N"), "{error}");
}

#[test]
fn a_stream_of_a_few_bytes_takes_no_more_than_it_describes() {
    // A billion elements that the stream does not have.
    let at = |mode, stride, bytes: &[u8]| {
        let compressed = Compressed {
            at: String::new(),
            buffer: 0,
            start: 0,
            length: bytes.len(),
            count: 3 << 28,
            stride,
            mode,
            filter: None,
        };
        let _: Fault = compressed.decode(bytes).expect_err("nothing there");
    };
    at(Mode::Attributes, 256, &[&[0xa1][..], &[0xaa; 64], &[0; 320]].concat());
    at(Mode::Triangles, 4, &[&[0xe1, 0xf0][..], &[0; 16]].concat());
    at(Mode::Indices, 4, &[0xd1, 0, 0, 0, 0, 0]);
}
