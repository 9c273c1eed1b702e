//! Shared meshes and instances.

use super::*;
use crate::scene::geometry::{Geometry, PrimitiveId, Ray};

/// A ribbon of `n` unit triangles along x at z = 0 that face +z, shown by one node, and space for more accessors.
fn ribbon(n: u32, more: &[u8]) -> Value {
    let corners = (0..n).flat_map(|i| [[i as f32, 0., 0.], [i as f32 + 1., 0., 0.], [i as f32, 1., 0.]]);
    let mut bytes: Vec<u8> = corners.flatten().flat_map(f32::to_le_bytes).collect();
    let positions = bytes.len();
    bytes.extend(more);
    let mut document = document(&bytes);
    document["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 } });
    document["accessors"] = json!([{ "bufferView": 0, "componentType": 5126, "count": 3 * n, "type": "VEC3" }]);
    document["bufferViews"] = json!([
        { "buffer": 0, "byteLength": positions },
        { "buffer": 0, "byteOffset": positions, "byteLength": more.len().max(1) }]);
    if more.is_empty() {
        document["bufferViews"].as_array_mut().unwrap().pop();
    }
    document
}

/// Nodes that all show mesh 0.
fn shown_by(mut document: Value, nodes: &[Value]) -> Value {
    document["nodes"] = nodes.iter().map(|node| changed(node.clone(), "/mesh", json!(0))).collect();
    document["scenes"][0]["nodes"] = (0..nodes.len()).collect();
    document
}

fn instanced(mut document: Value, attributes: Value) -> Value {
    document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = attributes;
    document["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    document["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    document
}

/// What a ray along −z from above (x, y) meets.
fn below(g: &Geometry, x: f32, y: f32) -> Option<(PrimitiveId, f32)> {
    let ray = Ray { origin: Vec3::new(x, y, 50.), direction: Vec3::NEG_Z, t_max: f32::INFINITY };
    let hit = g.closest(&ray, PrimitiveId::NONE)?;
    let surface = g.surface(&ray, &hit);
    Some((hit.primitive, surface.position.z * surface.normal.z.signum()))
}

#[test]
fn a_large_mesh_of_several_nodes_is_kept_once_and_looks_like_its_copies() {
    let nodes = [
        json!({ "translation": [0., 0., 1.] }),
        json!({ "translation": [0., 10., 2.], "scale": [-0.5, 3., 1.] }),
        json!({ "translation": [0., 20., 3.], "scale": [1., 1., 0.] }),
        json!({ "translation": [0., 30., 4.] }),
    ];
    let mut loaded = load(&shown_by(ribbon(2000, &[]), &nodes)).unwrap();
    let g = &mut loaded.geometry;
    // The node that flattens cannot be undone: its triangles are copied.
    assert_eq!((g.instance_count(), g.mesh_count(), g.world_len(), g.triangle_count()), (3, 1, 2000, 8000));
    g.build();
    assert_eq!(below(g, 7.2, 0.2), Some((PrimitiveId::of(0, 7), 1.0)));
    assert_eq!(below(g, -3.6, 10.3), Some((PrimitiveId::of(1, 7), 2.0)), "mirrored, and its front is still on top");
    assert_eq!(below(g, 7.2, 20.2), Some((PrimitiveId::world(7), 3.0)));
    assert_eq!(below(g, 7.2, 30.2), Some((PrimitiveId::of(2, 7), 4.0)));
    assert_eq!(below(g, 7.2, 40.2), None);

    // A small mesh is copied, and so is any that only one node shows.
    for (n, nodes) in [(1000, &nodes[..]), (2000, &nodes[..1])] {
        let loaded = load(&shown_by(ribbon(n, &[]), nodes)).unwrap();
        assert_eq!(loaded.geometry.instance_count(), 0);
        assert_eq!(loaded.geometry.world_len() as usize, n as usize * nodes.len());
    }
}

#[test]
fn gpu_instances_are_placed_by_their_attributes_below_the_node() {
    // Two translations, two rotations (none, and half a turn about z) as normalized shorts, two scales, and an id.
    let mut more: Vec<u8> = [0., 0., 1., 0., 10., 2.0_f32].iter().flat_map(|x| x.to_le_bytes()).collect();
    more.extend([0, 0, 0, 32767, 0, 0, 32767, 0_i16].iter().flat_map(|x| x.to_le_bytes()));
    more.extend([1., 1., 1., 2., 2., 2.0_f32].iter().flat_map(|x| x.to_le_bytes()));
    let attributes = json!({ "TRANSLATION": 1, "ROTATION": 2, "SCALE": 3, "_ID": 77 });
    for n in [3000, 4] {
        let mut document = instanced(ribbon(n, &more), attributes.clone());
        document["nodes"][0]["translation"] = json!([100., 0., 0.]);
        let accessors = document["accessors"].as_array_mut().unwrap();
        accessors.push(json!({ "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3" }));
        accessors.push(json!({ "bufferView": 1, "byteOffset": 24, "componentType": 5122, "normalized": true,
            "count": 2, "type": "VEC4" }));
        accessors.push(json!({ "bufferView": 1, "byteOffset": 40, "componentType": 5126, "count": 2, "type": "VEC3" }));
        let mut loaded = load(&document).unwrap();
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let g = &mut loaded.geometry;
        g.build();
        let kept = n > 1000;
        let id = |k, i| if kept { PrimitiveId::of(k, i) } else { PrimitiveId::world(k * n + i) };
        assert_eq!((g.instance_count(), g.triangle_count()), (if kept { 2 } else { 0 }, 2 * u64::from(n)));
        assert_eq!(below(g, 103.2, 0.2), Some((id(0, 3), 1.0)));
        assert_eq!(below(g, 100. - 6.4, 10. - 0.4), Some((id(1, 3), 2.0)));
    }
}

#[test]
fn too_many_instances_are_refused_before_any_is_made() {
    let zeros = |count: u64| json!({ "componentType": 5126, "count": count, "type": "VEC3" });
    let document = |count: u64, nodes: usize| {
        let mut document = shown_by(ribbon(2, &[]), &vec![json!({}); nodes]);
        document["accessors"].as_array_mut().unwrap().push(zeros(count));
        for node in document["nodes"].as_array_mut().unwrap() {
            node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({ "TRANSLATION": 1 });
        }
        document
    };
    let skinned = changed(document(1 << 22, 9), "/nodes/0/weights", json!([]));
    for document in [document(1 << 22, 9), skinned] {
        let sentence = load(&document).unwrap_err().to_string();
        assert!(sentence.contains("/nodes/") && sentence.contains("33554432 is the limit"), "{sentence}");
    }
    let sentence = load(&document(1 << 23, 1)).unwrap_err().to_string();
    assert!(sentence.contains("/accessors/1/count") && sentence.contains("--limit zeros=N"), "{sentence}");
}

#[test]
fn bad_instances_are_a_sentence() {
    let two: Vec<u8> = [0.0_f32; 6].iter().flat_map(|x| x.to_le_bytes()).collect();
    let sentence = |attributes: Value, second: Value| {
        let mut document = instanced(ribbon(2, &two), attributes);
        let accessors = document["accessors"].as_array_mut().unwrap();
        accessors.push(json!({ "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3" }));
        accessors.push(second);
        load(&document).unwrap_err().to_string()
    };
    let one = json!({ "bufferView": 1, "componentType": 5126, "count": 1, "type": "VEC3" });
    let four = json!({ "bufferView": 1, "componentType": 5126, "count": 1, "type": "VEC4" });
    let cases = [
        (json!({ "TRANSLATION": 1, "SCALE": 2 }), &one, "attributes/SCALE", "1 elements, and another one has 2"),
        (json!({ "TRANSLATION": 9 }), &one, "/accessors/9", "no such accessor"),
        (json!({ "TRANSLATION": "x" }), &one, "attributes/TRANSLATION", "not the index of an accessor"),
        (json!({ "ROTATION": 1 }), &one, "/accessors/1/type", "VEC4"),
        (json!({ "ROTATION": 2 }), &four, "EXT_mesh_gpu_instancing", "no unit quaternion"),
        (json!(3), &one, "attributes", "no object"),
    ];
    for (attributes, second, place, what) in cases {
        let sentence = sentence(attributes, second.clone());
        assert!(sentence.contains(place) && sentence.contains(what), "{sentence}");
    }
}
